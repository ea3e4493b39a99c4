"""Figures of limit analysis and of collapse.

Thrust line and mechanism of a limit analysis, rating of a bridge, kinematic assessment, capacity
map of rings, and instants of a fall.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.limit.collapse import Collapse, Outcome
from archfem.limit.displaced_blocks import PlacedBlocks
from archfem.limit.rating import Rating
from archfem.limit.vehicles import MovingLoad
from archfem.masonry.loads import PointLoad
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_words, list_first
from archfem.statics.assessed_mechanism import KinematicAssessment
from archfem.statics.assessment_checks import UPPER_BOUND, AssessmentCheck
from archfem.view import style
from archfem.view.joint_marks import Marker, outline_moving_blocks, scale_motion
from archfem.view.positions import FallingBlocks
from archfem.view.structure import block_colours, draw_loads, draw_structure, draw_thrust
from archfem.view.style import Colour, Size

# Share of the largest turn of a hinge from which one is drawn [-]
LEAST_TURN = 0.05

# Hinges of a mechanism that have the names of their joints beside them, and letters of a name
MAX_NAMED, MAX_LETTERS = 8, 24


@validate_arguments
def draw_collapse(structure: Structure, found: Collapse) -> Figure:
    """Draw the thrust line in the undeformed structure, and the collapse mechanism over it.

    Args:
        structure: undeformed.
        found: result of its limit analysis.

    Returns:
        The figure; its title gives the outcome and the collapse factor.
    """
    figure = draw_structure(structure)
    _draw_mechanism(figure.axes[0], structure, found)
    return figure


def _draw_mechanism(axes: Axes, structure: Structure, found: Collapse, factors: str = "") -> None:
    """Draw mechanism, hinges, thrust line and loads over a structure that is drawn already."""
    if found.fill_motion is not None:
        _draw_fill(axes, structure, found)
    elif found.soil is not None and found.soil["backed"].any():
        levels = found.soil["y"].values[found.soil["backed"].values]
        _hatch_backing(axes, structure, float(levels.max()))
    if found.motion.any():
        motion = scale_motion(structure, found.motion)
        dilates = " with dilatancy" * (found.outcome is Outcome.BRACKETED)
        _draw_motion(axes, outline_moving_blocks(structure, motion), f"mechanism{dilates}")
        _mark_hinges(axes, structure, found, label="hinge", ms=7.5)
        _mark_sliding(axes, structure, found.sliding)
    # limit analysis counts the joints of all stones
    soft = set(find_yielding_blocks(structure))
    stones = np.array([not soft & set(joint.blocks) for joint in structure.joints])
    draw_thrust(axes, Marker(structure, stones).at(found.joints))
    # without a solution there may be no bound from below, at which the load would vanish
    multiple = found.upper if found.outcome is Outcome.BRACKETED else found.factor
    factor = f"{multiple:.3g} ×{factors}" if np.isfinite(multiple) else ""
    if found.outcome is not Outcome.INFEASIBLE:  # else nothing was loaded: the weight is too much
        draw_loads(axes, structure, found.live, factor=factor)
    style.set_title(axes, f"{structure.name}: {found.sentence}")
    style.add_legend(axes)


def _draw_fill(axes: Axes, structure: Structure, found: Collapse) -> None:
    """Shade a plastic fill where it strains, and draw its pressure on the stones."""
    fill, soil = found.fill_motion, found.soil
    assert fill is not None
    assert soil is not None
    strain = np.sqrt(fill["strain"].values)  # bands of slip stand out, and what is beside them
    corners = fill["corners"].values[strain > 0.05]
    points = np.stack([fill["x"].values, fill["y"].values], axis=-1)
    shaded = PolyCollection(points[corners], cmap="Oranges", alpha=0.55, linewidths=0.0)
    shaded.set_array(strain[strain > 0.05])
    shaded.set_clim(0.0, 1.0)
    axes.add_collection(shaded)
    # the largest pressure is as long as a twelfth of the structure
    ends = np.stack([soil["x"].values, soil["y"].values], axis=-1)
    along = np.diff(ends, axis=1)
    outward = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    pressure = soil["pressure"].values / max(float(soil["pressure"].max()), 1e-300)
    tips = ends - structure.size / 12.0 * pressure[..., None] * outward
    faces = np.concatenate([ends, tips[:, ::-1]], axis=1)
    look: dict[str, Any] = {"edge": Colour.GREY, "width": 0.5, "label": "pressure of the fill"}
    style.add_polygons(axes, list(faces), "none", **look)


def _hatch_backing(axes: Axes, structure: Structure, level: float) -> None:
    """Hatch the fill below the level of the backing."""
    blocks = [structure.blocks[number].drawn() for number in find_yielding_blocks(structure)]
    look = {"facecolors": "none", "edgecolors": Colour.GREY, "linewidths": 0.0, "hatch": "xxx"}
    backing = PolyCollection(blocks, label="backing", **look)
    axes.add_collection(backing)
    (left, low), (right, _) = style.outline_bounds(structure)
    box = Rectangle((left, low), right - left, level - low, transform=axes.transData)
    backing.set_clip_path(box)


def draw_collapse_result(found: Collapse) -> Figure:
    """Draw a limit analysis over the structure that the result contains."""
    if found.structure is None:
        raise InvalidInput(
            "this result does not contain its structure: use draw_collapse(structure, …)"
        )
    return draw_collapse(found.structure, found)


@validate_arguments
def draw_rating(found: Rating) -> Figure:
    """Draw the factor against the place of the vehicle, and the mechanism at the worst place.

    Args:
        found: rating of a bridge for a vehicle.

    Returns:
        The figure: factors of both directions over the place of the vehicle's middle, up to four
        times the least one. Below is the mechanism at the worst place with the axles as given, and
        marks where the distributed load stands.
    """
    title = f"{found.vehicle.name}: factor {found.factor:.3g}, {found.outcome}"
    worst, factors, strips = _take_axles_as_given(found)
    load = f"{found.vehicle.name} on {found.width:.3g} m of width"
    return _draw_factors(found.moving, worst, title, load, factors, strips, required=1.0)


def _take_axles_as_given(found: Rating) -> tuple[Collapse, str, list[PointLoad]]:
    """Return the worst collapse under axles as given, their factor in words, and strips of load."""
    # an impact on one axle is drawn with that axle
    code = found.live * (found.impact if found.vehicle.impact_on == "all axles" else 1.0)
    # on the vehicle's part of the width and without factors
    share, (axles, strips) = code * found.structure.width / found.width, _split_loads(found.moving)
    live = [replace(load, force=tuple(force / share for force in load.force)) for load in axles]
    factors = "" if code == 1.0 else f" {code:.3g} ×"
    return replace(found.moving.worst, live=live), factors, strips


@validate_arguments
def draw_ratings(ratings: Sequence[Rating]) -> Figure:
    """Draw the factors of several vehicles along a bridge.

    Args:
        ratings: ratings of one bridge; the first six are drawn, and the others named.

    Returns:
        The figure: the lesser factor of both directions over the place of each vehicle's middle, up
        to four times the least one.
    """
    drawn = ratings[: len(Colour.LINES)]
    structure, factors_of = drawn[0].structure, [found.factor for found in drawn]
    largest = max(filter(np.isfinite, factors_of), default=1)
    top = max(4.0 * max(1.0, min(factors_of)), 1.5 * largest)
    figure = style.new_figure(Size.PAGE, 2.8)
    upper = figure.subplots()
    for k, found in enumerate(drawn):
        over = found.moving.factors["factor"].min("direction")
        finite = over.where(np.isfinite(over))
        upper.plot(over["position"], finite, label=found.label, lw=1.5, **style.line_style(k))
        look = {"color": style.line_style(k)["color"], "mec": "white", "ms": 6.5, "zorder": 5}
        upper.plot([found.moving.position], [found.factor], "o", **look)
    upper.axhline(1.0, color=Colour.GREY, lw=1.0)
    upper.set_ylim(0.0, top)
    style.style_axes(upper, "middle of the vehicle, x [m]", "factor [-]")
    left = _name_left_out(ratings)
    style.set_title(upper, f"{structure.name}: least factor of each vehicle, over its place{left}")
    upper.legend(frameon=False, fontsize=Size.LABEL, loc="lower center", ncols=3)
    return figure


@validate_arguments
def draw_worst_places(ratings: Sequence[Rating]) -> Figure:
    """Draw each of several vehicles at its worst place on a bridge, with the mechanism.

    Args:
        ratings: ratings of one bridge, in the order of the panels; the first six are drawn, and the
            others named.

    Returns:
        The figure, with two panels a row.
    """
    drawn = ratings[: len(Colour.LINES)]
    structure, count = drawn[0].structure, (len(drawn) + 1) // 2
    low, high = style.outline_bounds(structure)
    tall = (0.5 * Size.PAGE - 0.2) * (high[1] - low[1]) / (high[0] - low[0]) + 0.3
    left = _name_left_out(ratings)
    figure = style.new_figure(Size.PAGE, min(0.4 + 0.2 * bool(left) + count * tall, 3.65))
    rows = [figure.add_subplot(count, 2, 1 + k) for k in range(len(drawn))]
    for found, axes in zip(drawn, rows, strict=True):
        worst, factors, strips = _take_axles_as_given(found)
        draw_structure(structure, axes=axes)
        _draw_mechanism(axes, structure, worst, factors)
        _mark_strips(axes, structure, strips)
        axes.get_legend().remove()
        axes.set_axis_off()
        # in so small a panel sizes would cover the arrows that they stand beside
        beside = [text for text in axes.texts if text.get_text().endswith(" kN")]
        sizes = [text.get_text() for text in sorted(beside, key=lambda x: x.xy[0])]
        for text in beside:
            text.remove()
        of = f" ({join_words(sizes)})" * bool(sizes)
        style.set_title(axes, f"{found.label}: {found.factor:.3g}{of}", Size.LABEL)
    # the size of the loads is another one in each panel
    every = {x.get_label(): x for axes in rows for x in axes.get_legend_handles_labels()[0]}
    kept = [handle for label, handle in every.items() if not label.startswith("live load")]
    style.add_legend_below(figure, handles=kept)
    if left:
        figure.suptitle(left.removeprefix("; "), fontsize=Size.LABEL)
    return figure


def _name_left_out(ratings: Sequence[Rating]) -> str:
    """Name vehicles with their factors, for which there is no room."""
    left = [f"{x.label} ({x.factor:.3g})" for x in ratings[len(Colour.LINES) :]]
    return f"; not drawn: {list_first(left, 4)}" * bool(left)


@validate_arguments
def draw_moving_load(found: MovingLoad) -> Figure:
    """Draw the collapse factor along the bridge, and the mechanism at the worst place.

    Args:
        found: collapse factors of a vehicle at all places.

    Returns:
        The figure: factors of both directions over the place of the vehicle's middle, up to four
        times the least one, above the mechanism at the worst place.
    """
    title = f"least factor {found.worst.factor:.3g}, driving {found.direction}"
    axles, strips = _split_loads(found)
    worst = replace(found.worst, live=axles)
    return _draw_factors(found, worst, title, "the vehicle", strips=strips)


def _split_loads(found: MovingLoad) -> tuple[list[PointLoad], list[PointLoad]]:
    """Return the axles at the worst place, and the strips of the distributed load."""
    loads = [load for load in found.worst.live if isinstance(load, PointLoad)]
    here = found.factors["axles"].sel(direction=found.direction, position=found.position)
    return loads[: int(here)], loads[int(here) :]


def _draw_factors(
    found: MovingLoad,
    worst: Collapse,
    title: str,
    load: str,
    factors: str = "",
    strips: Sequence[PointLoad] = (),
    *,
    required: float = 0.0,
) -> Figure:
    """Draw factors over the vehicle's middle, above the worst mechanism on the same x axis."""
    structure = worst.structure
    assert structure is not None  # it was analysed
    over, top = found.factors["factor"], 4.0 * max(worst.factor, required)
    low, high = style.outline_bounds(structure)
    # a long vehicle is worst with its middle beside the bridge
    seen = over["position"].values[((over <= top) & np.isfinite(over)).any("direction").values]
    ends = np.array([*seen, low[0], high[0]])
    wide, tall = style.structure_figure(structure).get_size_inches()
    # height to spare, so that the bridge fills its part of the width, and room for the legend
    tall = min(max(1.5 * tall * (high[0] - low[0]) / np.ptp(ends), 2.5), 3.9)
    figure = style.new_figure(wide, tall + 2.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.0, tall])
    # by their marks in grey too, and unlike the thrust line
    for way, line, colour in (("right", ">-", Colour.LINES[-1]), ("left", "<--", Colour.LOAD)):
        drawn = over.sel(direction=way)
        look = {"color": colour, "lw": 1.5, "ms": 4.0, "markevery": 4, "label": f"driving {way}"}
        upper.plot(drawn["position"], drawn.where(np.isfinite(drawn)), line, **look)
    upper.axhline(required, color=Colour.GREY, lw=1.0)
    if np.isfinite(worst.factor):
        look = {"mfc": Colour.HINGE, "mec": "white", "ms": 7.5, "zorder": 5}
        upper.plot([found.position], [worst.factor], "o", label="worst place", **look)
        upper.set_ylim(0.0, top)
    style.style_axes(upper, "middle of the vehicle, x [m]", "factor [-]")
    upper.tick_params(labelbottom=True)
    style.set_title(upper, title)
    draw_structure(structure, axes=lower)
    _draw_mechanism(lower, structure, worst, factors)
    if np.isfinite(worst.factor):
        words = f"a mechanism at {worst.factor:.3g} ×{factors} {load}"
        style.set_title(lower, f"{structure.name}: {words}")
    _mark_strips(lower, structure, strips)
    # below both panels: arrows may stand anywhere in the lower one
    lower.get_legend().remove()
    style.add_legend_below(figure)
    margin = 0.03 * np.ptp(ends)
    lower.set_xlim(ends.min() - margin, ends.max() + margin)
    return figure


def _mark_strips(axes: Axes, structure: Structure, strips: Sequence[PointLoad]) -> None:
    """Mark where a distributed load stands."""
    if strips:
        places = np.array([load.place(structure)[1] for load in strips])
        look = {"color": Colour.LOAD, "ls": "", "marker": "v", "ms": 3.0, "zorder": 9}
        axes.plot(*places.T, label="distributed load", **look)


@validate_arguments
def draw_kinematic_assessment(found: KinematicAssessment) -> Figure:
    """Draw the mechanism at its displacement capacity, and the capacity curve with its demand.

    Args:
        found: an assessment with a mechanism.

    Returns:
        The figure: blocks at rest and at the capacity d_u* beside a*(d*), divided by the
        confidence factor, over the spectrum of the demand; the mechanism alone where it has no
        finite motion. Curve, capacity and demand are of the split of weights that decides.

    Raises:
        InvalidInput: no horizontal force makes the structure a mechanism.
    """
    if found.path is None:
        raise InvalidInput("there is no motion to draw: no mechanism moves under horizontal forces")
    if found.displacement is None:
        figure = style.structure_figure(found.structure)
        _draw_displaced_mechanism(figure.add_subplot(), found)
        style.add_legend_below(figure, 2)
        figure.draw_without_rendering()  # the first layout cuts off a title over what moves upwards
        return figure
    wide, high = style.structure_figure(found.structure).get_size_inches()
    wide = max(wide, 0.75 * Size.COLUMN)
    if style.panel_grid(2) == (1, 2):
        figure = style.new_figure(wide + 0.8 * Size.COLUMN, max(high, 4.2))
        left, right = figure.subplots(1, 2, width_ratios=[wide, 0.8 * Size.COLUMN])
    else:
        figure = style.new_figure(wide, high + 3.0)
        left, right = figure.subplots(2, 1, height_ratios=[high, 3.0])
    # one weight a body lowers the ratio, where the check has both
    drawn = found if found.displacement.bodies is None else found.of_bodies or found
    _draw_displaced_mechanism(left, drawn)
    _draw_capacity_curve(right, drawn, found)
    # in the panels it would lie on curves
    style.add_legend_below(figure, 3)
    return figure


def _draw_displaced_mechanism(axes: Axes, found: KinematicAssessment) -> None:
    """Draw the blocks at rest, and at the displacement capacity, true to scale, if there is one."""
    structure, path, check = found.structure, found.path, found.displacement
    draw_structure(structure, axes=axes)
    if check is None:
        motion = scale_motion(structure, path.velocity)
        _draw_motion(axes, outline_moving_blocks(structure, motion), "mechanism as it begins")
    else:
        place = int(np.searchsorted(found.curve["d"].values, check.capacity))
        place = min(place, len(path.displacements) - 1)
        blocks = path.blocks.moved(path.displacements[place])
        moved = [k for k in structure.free if np.abs(path.displacements[place, k]).max() > 1e-9]
        _draw_motion(axes, [blocks.outlines[k] for k in moved], "mechanism at the capacity")
    _mark_hinges(axes, structure, found, label="hinge at rest", ms=6.5)
    _mark_sliding(axes, structure, found.sliding)
    _draw_ties(axes, path.blocks)
    _name_blocks(axes, found)
    style.set_title(axes, f"alpha_0 = {found.alpha_0:.3f}, e* = {found.e_star:.2f}")


def _name_blocks(axes: Axes, found: KinematicAssessment) -> None:
    """Write the blocks beside a hinge that name the mechanism, on the side that it leaves."""
    structure, way = found.structure, -found.direction
    room = way * 0.6 / style.drawing_scale(structure)  # of a name [m]
    for k in structure.pairs[[joint for joint, _ in found.hinges]].ravel():
        if (block := structure.blocks[k]).name in found.mechanism_name:
            place = way * (way * block.points[:, 0]).max(), block.centroid[1]
            style.write_name(axes, block.name, place, (way, 0.0))
            axes.update_datalim([(place[0] + room, place[1])])
    axes.autoscale_view()


def _draw_ties(axes: Axes, blocks: PlacedBlocks) -> None:
    """Draw the ties at rest, to their anchors or towards the ground that holds them."""
    size, label = 0.2 * np.ptp(np.concatenate(blocks.outlines), axis=0).max(), "tie"
    for tie in (load for load in blocks.loads if load.passive and any(load.force)):
        end = tie.point + size * np.array(tie.force) / np.hypot(*tie.force)
        ends = np.array([tie.point, end if tie.anchor_point is None else tie.anchor_point])
        axes.plot(*ends.T, color=Colour.LOAD, lw=1.4, marker=".", zorder=9, label=label)
        ways = [*(ends - ends.mean(axis=0)) / (0.5 * np.hypot(*np.diff(ends, axis=0)[0]))]
        for anchored, place, way in zip((tie.block, tie.anchor), ends, ways, strict=True):
            if anchored is not None:
                name = blocks.structure.blocks[blocks.structure.block_number(anchored)].name
                style.write_name(axes, name, place, way)
        label = ""


def _draw_capacity_curve(
    axes: Axes, found: KinematicAssessment, titled: KinematicAssessment
) -> None:
    """Draw curve and demand of a split of weights, under the title of the whole assessment."""
    check, curve = found.displacement, found.curve
    reduced = curve["a"].values / found.confidence_factor
    last = float(curve["d"][-1])
    label, place = f"capacity a*(d*), FC = {found.confidence_factor:g}", curve.attrs["holds"] + 1
    look = {"color": Colour.THRUST, "lw": 1.8, "label": label}
    axes.plot(curve["d"][:place], reduced[:place], **look)
    if place < len(reduced):
        look |= {"ls": ":", "label": f"the same, {UPPER_BOUND}"}
        axes.plot(curve["d"][place - 1 :], reduced[place - 1 :], **look)
    periods = np.geomspace(0.02 * check.period, max(4.0, check.period), 160)  # as codes, to 4 s
    displacement, acceleration = found.demand(periods)
    label = f"spectrum, {100.0 * found.limit_state.damping:.0f} % damped"
    axes.plot(displacement, acceleration, color=Colour.GREY, lw=1.2, label=label)
    slope = (2.0 * np.pi / check.period) ** 2
    top = 1.15 * max(reduced.max(), acceleration.max())
    reach = min(1.1 * last, top / slope)
    look = {"color": Colour.LOAD, "lw": 1.0, "ls": "--"}
    axes.plot([0.0, reach], [0.0, slope * reach], label=f"T = {check.period:.2f} s", **look)
    colour = Colour.MECHANISM if titled.displacement.passes else Colour.HINGE
    axes.axvline(check.capacity, color=colour, lw=1.2, label=f"capacity {check.capacity:.3f} m")
    look = {"mfc": Colour.LOAD, "mec": "white", "ms": 7.0, "zorder": 5}
    label = f"demand {check.demand:.3f} m"
    axes.plot([check.demand], [slope * check.demand], "D", label=label, **look)
    style.style_axes(axes, "spectral displacement d* [m]", "spectral acceleration a* [m/s²]")
    axes.set(xlim=(0.0, 1.1 * max(last, check.demand)), ylim=(0.0, top))
    rest = ", at which it begins to move" if check.at_rest else ""
    titles = [f"{_title_check(titled.displacement)}{rest}"]
    titles += [] if titled.linear.passes else [_title_check(titled.linear)]
    style.set_title(axes, "; ".join(titles))


def _title_check(check: AssessmentCheck) -> str:
    """Return outcome and ratio of a check in a few words; assumptions on a fill are in the text."""
    some = check.over_fill is not None and check.over_fill.needed
    outcome = "passes with some assumptions" if some else check.words
    ratios = check.ratios
    # that of a lower bound has both
    if not (check.over_fill or check.unshown) and (check.bodies or np.inf) < 0.999 * check.ratio:
        ratios = f"{check.bodies:.3g} with one weight a body, {ratios} with the weights apart"
    return f"{check.name}: {outcome}, ratio {ratios}"


def draw_capacity(
    capacity: xr.DataArray,
    thinnest: Mapping[float, float],
    known: Mapping[tuple[float, float], float],
) -> Figure:
    """Map the horizontal acceleration at collapse of rings over embrace and thickness.

    Args:
        capacity: horizontal acceleration at collapse over embrace [degrees] and ratio, t/R [g];
            undefined (NaN) where a ring does not stand.
        thinnest: least t/R under self-weight over embrace [degrees], the lower limit of the map.
        known: reference values of the acceleration over (embrace [degrees], t/R) [g]; zero at the
            least t/R.

    Returns:
        The figure, with a colour bar beside the map.
    """
    figure, axes = style.new_axes(Size.COLUMN, 4.4, "embrace [°]", "thickness / radius, t/R [-]")
    embraces, ratios = capacity["embrace"].values, capacity["ratio"].values
    # rings that no acceleration overturns are drawn in the colour of the largest values
    values = np.nan_to_num(capacity.values.T, nan=0.0, posinf=1e3)
    levels = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0]  # [g]
    filled = axes.contourf(embraces, ratios, values, levels, cmap=Colour.MAP, extend="max")
    axes.contour(embraces, ratios, values, levels[1:], colors="white", linewidths=0.5)
    edge = np.array(sorted(thinnest.items()))
    axes.fill_between(edge[:, 0], 0.0, edge[:, 1], color="white", zorder=2)
    axes.plot(*edge.T, color=Colour.TEXT, lw=1.6, zorder=3, label="least thickness")
    _mark_reference_values(axes, known)
    axes.set(xlim=(embraces[0], embraces[-1]), ylim=(0.0, ratios[-1]))
    style.add_legend(axes)
    style.style_colour_bar(figure.colorbar(filled), "horizontal acceleration at collapse [g]")
    return figure


def _draw_motion(axes: Axes, outlines: Sequence[Array], label: str) -> None:
    """Draw displaced blocks over a structure that is drawn already."""
    look = {"edge": Colour.MECHANISM, "width": 0.8, "zorder": 2, "label": label}
    style.add_polygons(axes, outlines, f"{Colour.MECHANISM}30", **look)
    axes.autoscale_view()


def _mark_hinges(
    axes: Axes, structure: Structure, found: Collapse | KinematicAssessment, **look: Any
) -> None:
    """Mark each hinge that turns visibly, as built, where its blocks stay in contact."""
    if not found.hinges:
        return
    numbers, sides = zip(*found.hinges, strict=True)
    velocity = found.motion if isinstance(found, Collapse) else found.path.velocity
    turns = np.abs(np.diff(velocity[structure.pairs[[*numbers]], 2], axis=1))[:, 0]
    points = structure.ends[[*numbers], [int(side != "intrados") for side in sides]]
    look |= {"mfc": Colour.HINGE, "mec": "white", "mew": 0.8, "zorder": 6}
    clear = np.flatnonzero(turns >= LEAST_TURN * turns.max())
    joints = [structure.joints[numbers[k]] for k in clear]
    names = [style.short_name(joint.name, joint.part) for joint in joints]
    if len(names) <= MAX_NAMED and len(max(names, key=len)) <= MAX_LETTERS:
        for name, joint, point in zip(names, joints, points[clear], strict=True):
            way = point - joint.ends.mean(axis=0)
            style.write_name(axes, name, point, way / np.hypot(*way))
    axes.plot(*points[clear].T, "o", **look)


def _mark_sliding(axes: Axes, structure: Structure, joints: Sequence[int]) -> None:
    """Mark sliding joints as built."""
    if joints:
        look = {"colors": Colour.SLIDING, "linewidths": 2.4, "zorder": 4}
        lines = structure.ends[list(joints)]
        axes.add_collection(LineCollection(lines, label="sliding joint", **look))


def _mark_reference_values(axes: Axes, known: Mapping[tuple[float, float], float]) -> None:
    """Mark reference values on the capacity map."""
    thin = [point for point, factor in known.items() if factor == 0.0]
    strong = [point for point, factor in known.items() if factor > 0.0]
    look: dict[str, Any] = {"ms": 6.5, "zorder": 5, "clip_on": False}
    for points, label, marker, face, edge in (
        (thin, "reference thickness", "D", "white", Colour.TEXT),
        (strong, "reference acceleration", "o", Colour.HINGE, "white"),
    ):
        if points:
            axes.plot(*np.array(points).T, marker, mfc=face, mec=edge, label=label, **look)
    for point, factor in known.items():
        text = f"{factor:.3f}".rstrip("0") if factor else f"{point[1]:.4g}"
        style.annotate(
            axes, text, point, (-8, 3), ha="right", zorder=6, path_effects=style.white_halo(2.0)
        )


@validate_arguments
def draw_fall(run: History) -> Figure:
    """Draw the blocks at four instants of a collapse, over their original positions.

    Args:
        run: a history with its structure and with loose blocks.

    Returns:
        The figure, with a panel for each instant.

    Raises:
        InvalidInput: the run contains no structure, or no block came loose.
    """
    falls = None if run.structure is None else FallingBlocks.of(run.structure, run)
    if falls is None:
        raise InvalidInput(
            "there is no fall to draw: no block came loose, displacements were taken as small, or "
            "the run has no structure; read it with History.read(path, structure)"
        )
    instants = _select_instants(falls)
    built = [block.drawn() for block in falls.structure.blocks]
    drawn = np.concatenate([*built, *(each for time in instants for each in falls.outlines(time))])
    size, margin = np.ptp(drawn, axis=0), 0.4  # [m], [inch]
    # panels have the shape of what is drawn: else they would leave much of the page white
    scale = ((np.array([Size.PAGE, 5.6]) / 2.0 - margin) / size).min()
    figure = style.new_figure(*np.maximum(2.0 * (scale * size + margin), 0.5 * Size.COLUMN))
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for axes, time in zip(panels, instants, strict=True):
        _draw_instant(axes, falls, time)
    return figure


def _select_instants(
    falls: FallingBlocks, shares: Sequence[float] = (0.0, 1.0 / 3.0, 2.0 / 3.0)
) -> list[float]:
    """Return the times [s] when mean descent reaches shares of its final value, and the last."""
    descent = -falls.poses[:, list(falls.structure.free), 1].mean(axis=1)
    # blocks may bounce: only the progress counts
    progress = np.maximum.accumulate(descent - descent[0])
    frames = [int(np.argmax(progress >= share * progress[-1])) for share in shares]
    return [float(falls.times[k]) for k in (*frames, -1)]


def _draw_instant(axes: Axes, falls: FallingBlocks, time: float) -> None:
    """Draw the loose blocks and the ground at one instant."""
    structure = falls.structure
    style.style_length_axes(axes)
    axes.axhline(falls.level, color=Colour.EDGE, lw=1.2, zorder=0)
    built = [block.drawn() for block in structure.blocks]
    style.add_polygons(axes, built, "none", edge=Colour.UNDEFORMED, width=0.6)
    colours = [block_colours(structure)[number] for number in falls.owners]
    style.add_polygons(axes, falls.outlines(time), colours, zorder=2, gid="blocks")
    axes.set_title(f"t = {time:.2f} s", fontsize=Size.TITLE, color=Colour.TEXT)
    axes.autoscale_view()
    axes.label_outer()
