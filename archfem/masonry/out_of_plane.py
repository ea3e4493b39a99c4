"""Walls across their plane: columns of them, and the push that begins to overturn a body.

Each body turns about an edge of the width, held by nothing else.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import compress, pairwise
from typing import Any

import numpy as np
import shapely

from archfem._typing import Array, Metres
from archfem._validation import check_between, validate_arguments
from archfem.masonry.block import Block
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.materials import COURSE_LENGTH
from archfem.masonry.shapes.rings import column
from archfem.masonry.structure import LEVEL_TOLERANCE, Structure, join_words, merge_levels
from archfem.units import format_mm

# What a result in the plane of the drawing leaves open
UNCHECKED_ACROSS = "nothing is checked across the plane of the drawing"

# Weight of a course across the plane, over the median, below which it is one block with the course
# below it: on a joint as stiff as those of whole courses, the tip of a gable would decide the step
LIGHT_COURSE = 0.2

# What stones of a wall across its plane stand for that carry nothing
_OF_STONES = None, COURSE_LENGTH

# Height of the block at the top of a strip that bears what a slope carries, over that of its course
LOADED_TOP = 0.05


@validate_arguments
def columns_across(wall: Structure, *, above: Metres | None = None) -> dict[str, Structure]:
    """Return a wall across its plane, held by nothing else: a strip, the whole, and a pier.

    All are as broad as the wall is thick, and have its courses: from one bed over most of its
    length to the next or, without any, one at each bed of a stone. A course of the whole weighs as
    much as that of the wall, less its openings; its joints are as long as the stones of the lowest
    course. A course of less than a fifth of the median weight, as the tip of a gable, is one block
    with the course below it. One whose centre is above its middle, as that of a ring, is two blocks
    with that centre. The strip has a mean metre of the wall, its openings filled with
    stones of the course. What stones stand for besides themselves, such as a floor, weighs on all,
    and is named there. On the strip that of a sloping crown is at the top, by its mean over the
    length of the wall.

    The pier is that which overturns first of those beside openings, also at an end of the wall. It
    carries the wall up to the middle of the openings beside it, but what is below their heads.

    A course of a gable acts at the middle of its height, higher than its centre, and its tip at its
    centre: of five courses the factor of overturning is 1 % too low, of more less.

    Args:
        wall: structure in its plane; its width is the thickness of the wall.
        above: level from whose next bed on it is taken, such as that of the eaves; None for all
            [m].

    Returns:
        Columns "strip", 1 m long, "whole", and of a wall with openings "pier".

    Example:
        >>> list(af.masonry.columns_across(af.column(breadth=3.0, heights=[1.0], width=0.5)))
        ['strip', 'whole']
    """
    blocks = [wall.blocks[number] for number in wall.free]
    levels, shares = _divide_into_courses(blocks)
    title, ground = wall.name, float(levels[0])
    if above is not None:
        check_between(above, "above [m], up to the last bed,", *levels[[0, -2]].tolist(), ends="[]")
        # but for round-off
        first, title = int(np.searchsorted(levels, above - 1e-9)), f"{title} above {above:g} m"
        levels, shares = levels[first:], shares[:, first:]
    areas = np.array([[block.area] for block in blocks]) * shares
    unit_weights = np.array([block.material.unit_weight for block in blocks])
    words = [block.material.stands_for for block in blocks]
    plain = np.array([not each for each in words]) if None in words else np.ones(len(words))
    # stones that carry nothing: those of the course, or those of the wall where it has none
    own = plain[:, None] * (areas + 1e-9 * areas.sum(axis=1, keepdims=True))
    solid = unit_weights @ own / own.sum(axis=0)
    # a body that stands on the wall has no masonry beside it
    solid *= np.array([block.name != block.material.stands_for for block in blocks]) @ areas > 0.0
    material = blocks[int(plain.argmax())].material
    given: Any = {"breadth": wall.width, "material": material, "gravity": wall.gravity}
    given["contact"] = wall.joints[int(wall.heads.argmin())].contact

    def build(
        piece: str, width: float, weights: Array, areas: Array, levels: Array = levels
    ) -> Structure:
        """Build the column of a piece from the weights of its courses, over the width [N/m]."""
        heights = np.diff(levels)
        stack = column(heights=heights.tolist(), above=float(levels[0]) - ground, **given)
        loads = [join_words(sorted({*filter(None, compress(words, each))})) for each in areas.T]
        stones, values = [stack.blocks[0]], (weights / width / heights).round(3).tolist()
        for block, weight, load in zip(stack.blocks[1:], values, loads, strict=True):
            stone = replace(material, stands_for=load or None)  # equal ones share a material
            if weight != material.unit_weight:  # or it remains the default that it may be
                stone = replace(material, unit_weight=weight, stands_for=load or COURSE_LENGTH)
            stones.append(replace(block, material=stone))
        return replace(stack, blocks=tuple(stones), width=width, name=f"{title}, {piece}")

    sides = np.array([[block.points[:, 0].min(), block.points[:, 0].max()] for block in blocks])
    length, foot = float(np.ptp(sides)), float(areas[:, 0].sum() / (levels[1] - levels[0]))
    carried = (unit_weights @ areas - solid * areas.sum(axis=0)) / length
    spans = np.array([np.ptp(sides[each > 0.0]) for each in areas.T])
    columns = {
        "strip": build("strip", 1.0, *_fill_strip(levels, solid, carried, areas, spans)),
        "whole": build("whole", foot, *_split_high(blocks, levels, shares, areas)),
    }
    pier = _find_worst_pier(wall, levels, shares, unit_weights)
    return columns | ({"pier": build(*pier)} if pier else {})


def take_highest_strip(
    whole: Structure, loads: Sequence[AttachedLoad]
) -> tuple[Structure, list[AttachedLoad]] | None:
    """Return the strip of a whole wall through its highest place, with all loads of the wall.

    Its courses are as long as the longest one, or as a gable at its foot. A weight on the shorter
    ones at the top, as of a roof on its slopes, is on its top. None without courses of different
    lengths.
    """
    stones = [x for x in whole.blocks if not x.fixed and x.material.stands_for in _OF_STONES]
    if not any(x.material.stands_for for x in stones):
        return None
    solid = max((x.material for x in stones), key=lambda material: material.unit_weight)
    short = [x in stones and x.material.unit_weight < solid.unit_weight for x in whole.blocks]
    crown = len(short) - short[::-1].index(False)
    own = [x.material.unit_weight for x in stones]
    if len(own) > 1 and own == sorted({*own}, reverse=True):  # a gable above its eaves
        low, high = (float(np.ptp(x.points[:, 1])) for x in stones[:2])
        foot = own[0] + (own[0] - own[1]) * low / (low + high)
        solid = replace(solid, unit_weight=foot, stands_for=COURSE_LENGTH)
    filled = tuple(replace(x, material=solid) if x in stones else x for x in whole.blocks)
    on_crown = [x for x in loads if x.weight and whole.block_number(x.block) >= crown]
    top, level = filled[-1].name, float(filled[-1].points[:, 1].max())
    moved = [x for x in loads if x not in on_crown]
    moved += [replace(x, weight=0.0) for x in on_crown if any(x.force)]
    places = [(x.point[0], max(x.point[1], level)) for x in on_crown]
    moved += [AttachedLoad(top, y, x.weight) for x, y in zip(on_crown, places, strict=True)]
    return replace(whole, blocks=filled, name=f"{whole.name}, highest strip"), moved


def describe_lengths(structure: Structure) -> str:
    """Say what the length of a wall across its plane is where its courses have different ones."""
    differ = any(block.material.stands_for == COURSE_LENGTH for block in structure.blocks)
    return ", as its lowest course on average" * differ


def _split_high(
    blocks: Sequence[Block], levels: Array, shares: Array, areas: Array
) -> tuple[Array, Array, Array]:
    """Return weights, areas and levels with courses of high centre as two blocks with that centre.

    So is the tip of a gable. Others of low centre stay one block, on the safe side: its centre is
    higher.
    """
    ends = np.array([[block.points[:, 1].min(), block.points[:, 1].max()] for block in blocks])
    low, high = (np.clip(ends[:, [k]], levels[:-1], levels[1:]) for k in (0, 1))
    middles = 0.5 * (low + high)
    # the shares of a stone together have its centroid
    own = np.array([block.centroid[1] for block in blocks])
    higher = shares.sum(axis=1) * own - (shares * middles).sum(axis=1)
    unit_weights = np.array([block.material.unit_weight for block in blocks])
    weights = unit_weights @ areas
    centres = unit_weights @ (areas * (middles + higher[:, None])) / weights
    up = (centres - levels[:-1]) / np.diff(levels)
    for k in np.flatnonzero((up > 0.51) | (up < 0.4))[::-1]:
        # cut at the centre, of which both halves are half a height away
        levels, areas = np.insert(levels, k + 1, centres[k]), np.insert(areas, k, areas[:, k], 1)
        weights = np.insert(weights, k, (1.0 - up[k]) * weights[k])
        weights[k + 1] *= up[k]
    return weights, areas, levels


def _fill_strip(
    levels: Array, solid: Array, carried: Array, areas: Array, spans: Array
) -> tuple[Array, Array, Array]:
    """Return weights of the courses of a strip 1 m long, areas of what they bear, and levels.

    What courses carry that are longer than the next one is on the strip's top, as a roof on the
    ridge of a gable.
    """
    top = int(np.flatnonzero(solid)[-1])
    moved = np.append(np.diff(spans) < -0.01 * spans.max(), False) & (np.arange(len(spans)) < top)
    weights = solid * np.diff(levels) + carried
    if carried[moved].sum() <= 1e-9 * weights.sum():  # round-off
        return weights, areas, levels
    moved[top] = True
    rest = np.insert(np.where(moved, 0.0, carried), top + 1, carried[moved].sum())
    borne = np.insert(np.where(moved, 0.0, areas), top + 1, areas[:, moved].sum(axis=1), axis=1)
    edge = levels[top + 1] - LOADED_TOP * (levels[top + 1] - levels[top])
    levels = np.insert(levels, top + 1, edge)
    return np.insert(solid, top, solid[top]) * np.diff(levels) + rest, borne, levels


def _divide_into_courses(blocks: Sequence[Block]) -> tuple[Array, Array]:
    """Return the levels of a wall's courses, and the share of each stone in them (n, n_courses)."""
    ends = np.array([[block.points.min(axis=0), block.points.max(axis=0)] for block in blocks])
    merged = merge_levels(ends[..., 1])
    levels, low, high = np.unique(merged), merged[:, :1], merged[:, 1:]
    above, below, across = (
        np.ptp(ends[..., 0], axis=1) @ met
        for met in (low == levels, high == levels, (low < levels) & (levels < high))
    )
    through = np.minimum(above, below) > across  # not those of the stones of an arch
    through[[0, -1]] = True
    levels = levels[through] if through.sum() > 2 else levels
    weights = np.array([block.area * block.material.unit_weight for block in blocks])
    shares = np.clip(high, levels[:-1], levels[1:]) - np.clip(low, levels[:-1], levels[1:])
    return _merge_light(levels, shares / (high - low), weights)


def _merge_light(levels: Array, shares: Array, weights: Array) -> tuple[Array, Array]:
    """Return levels and shares of stones with light courses as one with the course below them."""
    while (of_courses := weights @ shares).min() < LIGHT_COURSE * np.median(of_courses):
        k = max(int(of_courses.argmin()), 1)  # the upper one of two that become one
        shares[:, k - 1] += shares[:, k]
        shares, levels = np.delete(shares, k, axis=1), np.delete(levels, k)
    return levels, shares


def _find_worst_pier(
    wall: Structure, levels: Array, shares: Array, unit_weights: Array
) -> tuple[str, float, Array, Array, Array] | None:
    """Return the pier of highest centre: name, breadth, weights, areas and levels of courses."""
    found, stones = [], [wall.blocks[number] for number in wall.free]
    for left, right, met in _find_piers(wall, float(levels[0])):
        beds = np.flatnonzero(met @ shares > 0.0)[-1] + 1  # a slope may end below the ridge
        own, of_courses = _merge_light(
            levels[: beds + 1], shares[:, :beds].copy(), met * unit_weights
        )
        areas = met[:, None] * of_courses
        weights, areas, own = _split_high(stones, own, of_courses, areas)
        arm = np.average(0.5 * (own[1:] + own[:-1]), weights=weights)
        name = f"pier at x = {0.5 * (left + right):.3g} m"
        found.append((arm, (name, right - left, weights, areas, own)))
    return max(found, key=lambda each: each[0])[1] if found else None


def _find_piers(wall: Structure, foot: float) -> Iterator[tuple[float, float, Array]]:
    """Yield left and right of each pier beside openings [m], and areas of the stones it carries.

    A pier carries the wall up to the middle of the openings beside it, but what is below their
    heads.
    """
    far = 1e4  # beyond any wall
    stones = np.array([shapely.Polygon(wall.blocks[number].drawn()) for number in wall.free])
    low, _, high, _ = shapely.total_bounds(stones).tolist()
    # left and right of openings above one another, and least head; the ends of the wall
    rows: list[list[float]] = [[low - 2.0, low, foot]]
    for left, _, right, head in find_openings(wall, foot):
        if left < rows[-1][1]:
            rows[-1][1:] = max(rows[-1][1], right), min(rows[-1][2], head)
        else:
            rows.append([left, right, head])
    if len(rows) == 1:
        return
    for (left, one, head), (other, right, beyond) in pairwise([*rows, [high, high + 2.0, foot]]):
        halves = (0.5 * (left + one), head, one, far), (other, beyond, 0.5 * (other + right), far)
        boxes = [shapely.box(*each) for each in ((one, -far, other, far), *halves)]
        yield one, other, shapely.area(shapely.intersection(stones, shapely.union_all(boxes)))


def find_openings(
    wall: Structure, foot: float | None = None
) -> list[tuple[float, float, float, float]]:
    """Return left, sill, right and head of the openings of a wall in bond, from the left [m].

    They are holes between the stones and the level of the foot, by default that of the stones.
    """
    if not wall.heads.any():
        return []
    polygons = np.array([shapely.Polygon(block.drawn()) for block in wall.blocks])
    low, bottom, high, top = shapely.total_bounds(polygons[list(wall.free)]).tolist()
    far, gap = 1e4, 0.5 * LEVEL_TOLERANCE * (top - bottom)  # beyond any wall; of a survey
    foot = bottom if foot is None else foot
    grown = shapely.buffer(polygons, gap, join_style="mitre")
    solid = shapely.union_all(shapely.intersection(grown, shapely.box(-far, foot, far, far)))
    solid = shapely.union(solid, shapely.box(low, foot - 1.0, high, foot))
    rings = sorted(ring.bounds for part in shapely.get_parts(solid) for ring in part.interiors)
    return [(a - gap, b - gap * (b > foot), c + gap, d + gap) for a, b, c, d in rings]


def find_transverse_push(structure: Structure) -> tuple[float, str]:
    """Return the push across the plane that begins to overturn a body [g], and which, in words.

    All blocks above a level turn as one body about the edge of the width there; or a strip of a
    wall in bond from bottom to top, or a pier beside its openings. The push is undefined (NaN) for
    a single stack, which may be drawn across its plane.
    """
    blocks = [structure.blocks[number] for number in structure.free]
    ends = np.array([[block.points.min(axis=0), block.points.max(axis=0)] for block in blocks])
    bottom = merge_levels(ends[..., 1])[:, 0]
    if ends[:, 0, 0].max() < ends[:, 1, 0].min():
        return np.nan, ""
    weights = np.array([block.area * block.material.unit_weight for block in blocks])
    heights = np.array([block.centroid[1] for block in blocks])
    arms = {}
    for level in np.unique(bottom):
        above, up = bottom >= level, level - bottom.min()
        size = format_mm(up) if up < 1.0 else f"{up:.3g} m"
        words = f"all above {size} from the base" if up else "all of it"
        arms[words] = np.average(heights[above], weights=weights[above]) - level
    columns = columns_across(structure) if structure.heads.any() else {}
    for key, each in columns.items():
        if key != "whole":
            own = [block.area * block.material.unit_weight for block in each.blocks[1:]]
            pier = f"the {each.name.rpartition(', ')[2]}, with what it carries,"
            words = "a strip from bottom to top" if key == "strip" else pier
            arms[words] = np.average(each.centroids[1:, 1], weights=own)
    pushes = {words: 0.5 * structure.width / float(arm) for words, arm in arms.items()}
    body = min(pushes, key=lambda words: float(f"{pushes[words]:.3g}"))  # the first of equal ones
    return pushes[body], body


def describe_transverse_push(structure: Structure) -> str:
    """Describe what is not checked across the plane, with the push that overturns it.

    Empty of a column of a wall, which is across its plane.
    """
    push, body = find_transverse_push(structure)
    if structure.above is not None:
        return ""
    if np.isnan(push):
        return (
            f"{UNCHECKED_ACROSS}; if that is the section of a wall, it is checked across "
            "its own plane here, and in it by a case of its own"
        )
    loaded = any(structure.blocks[number].material.stands_for for number in structure.free)
    return (
        f"{UNCHECKED_ACROSS}: held by nothing else, {body} begins to overturn at {push:.3g} g"
        f"{' or less' * loaded}, by the width over twice the height of its centre"
    )
