"""Bounds with a plastic fill, against closed forms, mirror images and each other."""

from dataclasses import replace
from math import atan, cos, radians, sin, sqrt, tan

import numpy as np
import pytest
from backfilled import SOIL, arch_bridge, rectangle, retaining_wall
from scipy.optimize import brentq

import archfem as af
from archfem.errors import InvalidInput
from archfem.limit import PlasticFill
from archfem.limit.cone_programme import solve_cones
from archfem.limit.fill_bounds import bound_least_factor, refine_bounds
from archfem.limit.fill_mesh import HELD, SURFACE, mesh_fill
from archfem.masonry.stiffness_ratio import find_yielding_blocks

pytest.importorskip("clarabel")

ROUNDING = 1e-5
"""Relative error of a factor: ten times the one at which the cone programme ends."""


@pytest.fixture(scope="module")
def footing():
    """Return a footing of 1 m on a fill of next to no weight, in a box 12 m wide and 3 m deep."""
    light, stone = (replace(material, unit_weight=1.0) for material in (SOIL, af.STONE))
    blocks = [
        rectangle(-6.0, -4.0, 6.0, -3.0, "rock", fixed=True),
        rectangle(-7.0, -3.0, -6.0, 0.5, "left", fixed=True),
        rectangle(6.0, -3.0, 7.0, 0.5, "right", fixed=True),
        rectangle(-6.0, -3.0, 6.0, 0.0, "soil", light),
        rectangle(-0.5, 0.0, 0.5, 0.3, "footing", stone),
        # the footing touches a support, from which it parts
        rectangle(-0.5, 0.3, 0.5, 0.6, "beam", fixed=True),
    ]
    return af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE, width=1.0)


# on fill without cohesion a weightless footing carries nothing: Prandtl's N_c
@pytest.mark.parametrize(
    ("angle", "exact", "gap"),
    [
        (0.0, 2.0 + np.pi, 0.25),
        pytest.param(30.0, 30.1396, 0.45, marks=pytest.mark.slow),
        pytest.param(30.0, 30.1396, 0.2, marks=pytest.mark.slow),
    ],
)
def test_a_footing_is_between_its_bounds(footing, angle, exact, gap):
    """Prandtl (1920), Reissner (1924): the bearing capacity over the cohesion."""
    fill = PlasticFill(friction_angle=angle, cohesion=1e3, gap=gap)
    live = af.PointLoad(x=0.0, y=0.2, force=(0.0, -1e3))
    found = af.collapse_factor(footing, live=live, fill=fill)
    assert found.lower < exact < found.upper
    assert found.upper - found.lower <= gap * found.upper
    assert found.motion[4, 1] < 0.0  # it goes down


@pytest.mark.parametrize("cohesion", [0.0, pytest.param(2e3, marks=pytest.mark.slow)])
def test_a_smooth_wall_has_the_passive_pressure_of_rankine(cohesion):
    """Its linear stresses are in equilibrium, so that the lower bound is the closed form."""
    passive = tan(radians(45.0 + 15.0)) ** 2
    weight = SOIL.unit_weight
    exact = 0.5 * passive * weight + 2.0 * cohesion * np.sqrt(passive)
    # where the resultant acts: a third of the height up for the weight, half for the cohesion
    height = (0.5 * passive * weight / 3.0 + np.sqrt(passive) * cohesion) / exact
    fill = PlasticFill(friction_angle=30.0, cohesion=cohesion, roughness=0.0, adhesion=0.0, gap=0.2)
    push = af.PointLoad(x=-1.0, y=height, force=(1e3, 0.0))
    wall = retaining_wall(height=1.0, friction=1e-6)
    found = af.collapse_factor(wall, live=push, fill=fill)
    assert found.lower == pytest.approx(exact / 1e3, rel=2e-3)
    assert found.upper > found.lower
    # the pressure on the wall carries the load
    beside = found.soil.sel(contact=found.soil["block"] == 1)
    lengths = abs(np.diff(beside["y"].values, axis=1)[:, 0])
    thrust = float((beside["pressure"].mean("end") * lengths).sum())
    assert thrust == pytest.approx(1e3 * found.lower, rel=ROUNDING)


FILL = PlasticFill(friction_angle=30.0, cohesion=5e3, gap=0.08)


@pytest.mark.slow
def test_the_mirror_image_of_a_load_has_bounds_that_agree():
    """Meshes are no mirror images, so that each bound bounds the other load too."""
    found = [
        af.collapse_factor(arch_bridge(), live=af.PointLoad(x=x, force=(0.0, -1e3)), fill=FILL)
        for x in (3.3, 5.7)
    ]
    for one, other in (found, found[::-1]):
        assert one.lower < other.upper
        assert one.upper - one.lower <= 0.08 * one.upper
        assert len(one.hinges) >= 3
        bounds = f"factor {one.lower:.4g} to {one.upper:.4g}"
        assert bounds in str(one)
        axes = one.plot().axes[0]
        words = axes.get_title().replace("\n", " ").partition("mechanism, ")[2]
        place = one.live[0].x
        assert words == f"{bounds.replace('factor', 'at')} times 1 kN at x = {place:g} m"
        # the triangles that strain, the others are left out
        shaded = next(each for each in axes.collections if each.get_array() is not None)
        assert 0 < len(shaded.get_paths()) < one.fill_motion.sizes["triangle"]


@pytest.mark.slow
def test_a_narrower_gap_is_within_a_wider_one():
    load = af.PointLoad(x=3.3, force=(0.0, -1e3))
    wide, narrow = (
        af.collapse_factor(arch_bridge(), live=load, fill=replace(FILL, gap=gap))
        for gap in (0.08, 0.03)
    )
    assert wide.lower <= narrow.lower * (1.0 + ROUNDING)
    assert narrow.upper <= wide.upper * (1.0 + ROUNDING)
    assert narrow.upper - narrow.lower <= 0.04 * narrow.upper


def test_bounds_of_the_finest_mesh_that_is_solved_are_returned(monkeypatch, caplog):
    """A programme that does not converge loses nothing, and the gap that remains is stated."""
    load = [af.PointLoad(x=3.3, force=(0.0, -1e3))]

    def bound(fill):
        return list(refine_bounds(arch_bridge(), load, "coulomb", None, fill, first=60))[-1]

    coarse = bound(replace(FILL, gap=0.9))
    solved = []

    def fails_later(*programme):
        solved.append(programme)
        return solve_cones(*programme) if len(solved) <= 2 else None

    monkeypatch.setattr("archfem.limit.fill_bounds.solve_cones", fails_later)
    found = bound(replace(FILL, gap=1e-3))
    assert (found.below.factor, found.above.factor) == (coarse.below.factor, coarse.above.factor)
    assert "further apart than the gap of 0.001" in caplog.text
    solved += [()] * 2
    with pytest.raises(af.DidNotConverge, match="second-order cone programme"):
        bound(FILL)


@pytest.mark.slow
def test_the_least_of_several_loads_is_that_of_each_on_its_own(monkeypatch, capsys):
    """Other loads keep bounds of coarse meshes, above the least one; progress is shown in lines."""
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)
    loads = [[af.PointLoad(x, (0.0, -1e3))] for x in (4.5, 3.3, 2.5)]

    def search(load):
        return refine_bounds(arch_bridge(), load, "coulomb", None, replace(FILL, gap=0.1), first=60)

    alone = [list(search(load)) for load in loads]
    least = min(range(3), key=lambda k: alone[k][-1].lower)
    found = bound_least_factor({k: search(load) for k, load in enumerate(loads)})
    assert min(found, key=lambda k: found[k].lower) == least
    assert found[least].lower == pytest.approx(alone[least][-1].lower, rel=ROUNDING)
    assert found[least].gap <= 0.1
    assert sum(len(each.filled.mesh.triangles) for each in found.values()) < sum(
        len(each[-1].filled.mesh.triangles) for each in alone
    )
    for each in alone:  # finer meshes never lower a bound from below
        lower = [bounds.lower for bounds in each]
        assert (np.diff(lower) >= -ROUNDING * lower[-1]).all()
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "plastic fill: place 1 of 3"
    assert lines[3].startswith("plastic fill: least factor ")


def test_an_interrupted_search_leaves_bounds_once_each_load_has_some(caplog):
    load = [af.PointLoad(x=3.3, force=(0.0, -1e3))]
    coarse = next(refine_bounds(arch_bridge(), load, "coulomb", None, FILL, first=60))

    def interrupted(*bounds):
        yield from bounds
        raise KeyboardInterrupt

    found = bound_least_factor({"load": interrupted(coarse)})
    assert found == {"load": coarse}
    assert f"interrupted: the factor {coarse.lower:.4g} is the least" in caplog.text
    with pytest.raises(KeyboardInterrupt):
        bound_least_factor({"load": interrupted(coarse), "other": interrupted()})


@pytest.mark.slow
def test_a_stronger_fill_carries_more():
    """The lower bound of the stronger one is above the upper one of the weaker."""
    load = af.PointLoad(x=3.3, force=(0.0, -1e3))
    weak, strong = (
        af.collapse_factor(arch_bridge(), live=load, fill=replace(FILL, **more))
        for more in ({"cohesion": 3e3, "gap": 0.3}, {"cohesion": 20e3, "gap": 0.2})
    )
    assert weak.upper < strong.lower


def test_a_wall_slides_under_the_seismic_pressure_of_its_fill():
    """Mononobe and Okabe (1929): a wedge behind a rough wall is a mechanism, so from above."""
    friction, angle, weight = 0.3, radians(30.0), SOIL.unit_weight

    def excess(pull):
        """Return horizontal pull and pressure on the wall, less friction [N]."""
        turned = atan(pull)
        slope = cos(angle + turned)
        root = sqrt(sin(2.0 * angle) * sin(angle - turned) / slope)
        pressure = (cos(angle - turned) / (1.0 + root)) ** 2 / (cos(turned) * slope)
        held = friction * (af.STONE.unit_weight + 0.5 * weight * pressure * sin(angle))
        return pull * af.STONE.unit_weight + 0.5 * weight * pressure * cos(angle) - held

    wedge = brentq(excess, -0.2, friction)
    fill = PlasticFill(friction_angle=30.0, gap=0.2)
    wall = retaining_wall(height=1.0, friction=friction)
    found = af.collapse_factor(wall, live=af.BodyForce(-1.0), fill=fill)
    assert found.lower <= wedge
    # the best curved surface behind a rough wall is within 5 % of the wedge
    assert found.upper >= 0.95 * wedge
    assert found.sliding_names == ("rock to wall",)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"friction_angle": 70.0}, "friction_angle 70° is neither 0 nor between"),
        ({"roughness": 1.2}, "roughness = 1.2 is above 1"),
        ({"gap": 0.0}, r"gap \[-\] = 0.0 is below 0.001"),
        ({"cohesion": -1.0}, "cohesion"),
        ({"cohesion": 5.0}, "cohesion 5 Pa is less than soil has: give pascals, 5000 for 5 kPa"),
    ],
)
def test_wrong_values_are_refused(change, words):
    with pytest.raises(InvalidInput, match=words):
        replace(FILL, **change)


def test_analyses_that_have_no_bounds_are_refused():
    load = af.PointLoad(x=3.3, force=(0.0, -1e3))
    with pytest.raises(InvalidInput, match="no block is soft enough"):
        af.collapse_factor(
            af.circular_arch(radius=2.0, thickness=0.3, embrace=120.0, voussoirs=7),
            live=af.BodyForce(1.0),
            fill=FILL,
        )
    with pytest.raises(InvalidInput, match="only collapse_factor bounds a plastic fill"):
        af.stands(arch_bridge(), fill=FILL)
    with pytest.raises(InvalidInput, match="need associated flow"):
        af.collapse_factor(arch_bridge(), live=load, fill=FILL, friction="nonassociated")
    with pytest.raises(InvalidInput, match="a settlement and a plastic fill"):
        af.collapse_factor(
            arch_bridge(), live=af.Settlement("right wall, course 1", (0.1, 0, 0)), fill=FILL
        )


@pytest.mark.parametrize("chosen", [0.0, 0.3, 1.0])
def test_a_mesh_covers_its_fill_and_stays_conforming(chosen):
    """Before and after refinement: areas add up, and boundary lengths are those of the outline."""
    structure = arch_bridge()
    (number,) = find_yielding_blocks(structure)
    mesh = mesh_fill(structure, (number,), 0.3, holds_ends=True)
    rng = np.random.default_rng(3)
    mesh = mesh.refined(rng.random(len(mesh.triangles)) < chosen)
    outline = structure.blocks[number].points
    around = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).sum()
    assert mesh.areas.min() > 0.0
    assert mesh.areas.sum() == pytest.approx(structure.blocks[number].area, rel=1e-12)
    assert mesh.normals(mesh.boundary)[1].sum() == pytest.approx(around, rel=1e-12)
    # an edge is on the boundary, or between two triangles
    assert len(mesh.boundary) + 2 * len(mesh.pairs) == 3 * len(mesh.triangles)
    beside = {int(n) for pair in structure.pairs if number in pair for n in pair} - {number}
    assert set(mesh.touches.tolist()) == beside | {SURFACE, HELD}
    # gradients of the shapes of a triangle add up to zero
    assert np.abs(mesh.gradients.sum(axis=1)).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("live", "half"),
    [
        (af.PointLoad(x=3.3, force=(0.0, -1e3)), lambda f: af.PointLoad(3.3, (0.0, -500.0 * f))),
        (af.BodyForce(1.0, 0.2), lambda f: af.BodyForce(0.5 * f, 0.1 * f)),
    ],
)
def test_half_of_the_load_that_stays_is_no_longer_live(live, half):
    """On one mesh both bounds fall by just that half."""
    fill = replace(FILL, gap=0.9)
    whole = af.collapse_factor(arch_bridge(), live=live, fill=fill)
    rest = af.collapse_factor(arch_bridge(), live=live, fill=fill, dead=[half(whole.lower)])
    size = ROUNDING * whole.upper
    assert rest.lower == pytest.approx(0.5 * whole.lower, abs=size)
    assert rest.upper == pytest.approx(whole.upper - 0.5 * whole.lower, abs=size)


@pytest.mark.parametrize("strength", [None, pytest.param(2e6, marks=pytest.mark.slow)])
def test_bonds_of_a_pier_beside_the_fill_yield_as_in_linear_programmes(footing, strength):
    """The fill has no part in it: both bounds are the factor of the pier alone."""
    bond = replace(af.masonry.STONE_TO_STONE, cohesion=40e3, tension=20e3)
    pier = rectangle(-6.8, 0.5, -6.2, 2.5, "pier")
    rest = af.masonry.assembled([*footing.blocks, pier], bond, width=1.0)
    ground = rectangle(-7.0, -3.0, -6.0, 0.5, "left", fixed=True)
    alone = af.masonry.assembled([ground, pier], bond, width=1.0)
    live = af.PointLoad(x=-6.8, y=2.4, force=(1e3, 0.0))
    fill = PlasticFill(friction_angle=30.0, cohesion=1e3, gap=0.9)
    found = af.collapse_factor(rest, live=live, fill=fill, strength=strength)
    exact = af.collapse_factor(alone, live=live, strength=strength).factor
    assert (found.lower, found.upper) == pytest.approx((exact, exact), rel=ROUNDING)
    dry = af.collapse_factor(
        af.masonry.assembled([ground, pier], af.masonry.STONE_TO_STONE, width=1.0), live=live
    ).factor
    assert exact > 1.1 * dry
