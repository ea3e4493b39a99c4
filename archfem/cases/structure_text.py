"""Structures as text: their supports, depths of joints, spans, and least thickness of rings."""

from collections import Counter
from contextlib import suppress
from functools import partial

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from archfem.cases.answers import RESULTS, Row
from archfem.cases.case import Case
from archfem.cases.defaults import describe_margins_at_rest, say_loads_left_out
from archfem.errors import InvalidInput
from archfem.limit.collapse import describe_crushing
from archfem.limit.fill_strength import Fill, PlasticFill
from archfem.limit.instability import explain_instability, find_factors_at_rest
from archfem.limit.self_weight import check_options, say_strength
from archfem.limit.thickness import minimum_thickness
from archfem.masonry.ring_thickness import find_ring
from archfem.masonry.standing import find_bodies
from archfem.masonry.structure import Structure, describe_spans, join_names, list_first
from archfem.units import Ends, format_mm, kN, mm

_DEPTH = "least depth of all joints"
_BARE = (
    "a least thickness of the ring is of a ring without fill, which is another structure: "
    "--set remove=\"['structure.backfill']\""
)


def describe_supports(structure: Structure, max_names: int = 4) -> str:
    """Describe which blocks move, with their weight, and which are fixed; many by their parts."""
    groups = []
    weight = f"move, {structure.weight / kN:.4g} kN in all"
    for word, fixed in ((weight, False), ("fixed", True)):
        own = [block for block in structure.blocks if block.fixed is fixed]
        names = [f"'{block.name}'" for block in own]
        if fixed:
            names = [f"'{b.name}' ({format_mm(np.ptp(b.points[:, 0]))} broad)" for b in own]
        if len(own) > max_names:
            parts = Counter(block.part or "unnamed" for block in own)
            stacks = {part: _count_stacks(structure, part) for part in parts}
            names = [
                f"{count} of '{part}'" + f" in {stacks[part]} stacks apart" * (stacks[part] > 1)
                for part, count in parts.items()
            ]
        groups.append(f"{word}: {join_names(names)}")
    return f"blocks that {'; '.join(groups)}"


def _count_stacks(structure: Structure, part: str) -> int:
    """Return the number of stacks of a pier that no joint connects; 0 for other parts."""
    own = [
        k for k in structure.free if (b := structure.blocks[k]).part == part and b.role == "pier"
    ]
    touching = np.isin(structure.pairs, own).all(axis=1)
    links = np.ones(np.count_nonzero(touching)), structure.pairs[touching].T
    size = len(structure.blocks)
    pieces = connected_components(coo_matrix(links, (size, size)), directed=False)[1]
    return len({*pieces[own].tolist()})


def describe_depths(structure: Structure) -> str:
    """Describe depths of the assessed joints by part, clear spans and piers, and lintels."""
    depths = np.where(structure.judged, structure.depths, np.inf)
    parts = np.array([joint.part for joint in structure.joints])
    names = dict.fromkeys(parts[structure.judged].tolist())
    medians = [
        format_mm(float(np.median(depths[(parts == part) & structure.judged])))
        + (f" of '{part}'" if len(names) > 1 else "")
        for part in names
    ]
    return (
        f"depth of joints: {format_mm(float(depths.min()))} at least, at "
        f"{structure.joints[int(depths.argmin())].name}; median {join_names(medians)}\n"
        f"{describe_spans(structure)}{_name_slivers(structure)}{_describe_bearing(structure)}"
    )


def _name_slivers(structure: Structure) -> str:
    """Return lines on stones of a wall in bond that are far shorter or less high than most."""
    bodies, lines = find_bodies(structure), ""
    stones = [x for x in structure.blocks if not (x.fixed or x.grain or x.name in bodies)]
    stones = [each for each in stones if each.role != "ring"] if structure.heads.any() else []
    remedies = "put jambs of openings further apart", "give nearly equal heads and sills one level"
    kinds = zip(("shorter", "less high"), (0.25, 0.5), remedies, strict=True)
    for axis, (word, share, remedy) in enumerate(kinds):
        sizes = {each.name: np.ptp(each.points[:, axis]) for each in stones}
        usual = float(np.median([*sizes.values()] or [0.0]))
        slivers = [f"'{k}' ({format_mm(x)})" for k, x in sizes.items() if x < share * usual]
        listed = f"{share:g} of the usual {format_mm(usual)}: {list_first(slivers, 3)}"
        lines += f"\nstones {word} than {listed}; {remedy}" * bool(slivers)
    return lines


def _describe_bearing(structure: Structure) -> str:
    """Return a line on the lintels of a wall in bond with the least and most bearing, if any."""
    found, most = [], 0.0
    # a keystone leans on stones beside it by steep joints
    beds = np.flatnonzero(np.abs(structure.normals[:, 0]) <= np.abs(structure.normals[:, 1]))
    pairs = structure.pairs[beds]
    above = pairs[np.arange(len(beds)), structure.centroids[pairs, 1].argmax(axis=1)]
    bodies = find_bodies(structure)
    for number in np.unique(above) if structure.heads.any() else ():
        block = structure.blocks[number]
        if block.grain or block.name in bodies:
            continue
        ends = np.sort(structure.ends[beds[above == number], :, 0], axis=1)
        ends = ends[ends[:, 0].argsort()]
        gaps = ends[1:, 0] - ends[:-1, 1]
        edges = np.flatnonzero(gaps > 0.01)  # wider than gaps of a survey
        if len(edges):
            bearings = ends[[*edges, -1], 1] - ends[[0, *(edges + 1)], 0]
            bearing, most = float(bearings.min()), max(most, float(bearings.max()))
            # NHBC Standards 2020, 6.1.12, table 5: lintels of steel or concrete
            usual = 0.10 if gaps.max() <= 1.2 else 0.15
            found.append((bearing / usual, bearing, usual, block.name))
    if not found:
        return ""
    share, bearing, usual, name = min(found)
    short = f", less than the {format_mm(usual)} of lintels in new houses" if share < 1.0 else ""
    more = f"; most {format_mm(most)}" * (most > bearing + 1.0 * mm)
    return f"\nleast bearing of a lintel: {format_mm(bearing)}, of '{name}'{short}{more}"


def _state_depth(case: Case, fill: Fill | PlasticFill | None, at_rest: str) -> list[Row]:
    """State the least depth of all joints at rest, by which a structure stands as given."""
    given = case.structure, case.limit.strength
    states = find_factors_at_rest(*given, fill)
    if not states.get(""):
        return []
    hard = find_factors_at_rest(case.structure, np.inf, fill)[""]
    depth = f"{1.0 / states['']:.3g} of what is built, {say_strength(*given, f'{1.0 / hard:.3g}')}"
    ends, name = Ends.of(states.values()), f"{_DEPTH}{' with the fill' * (fill is not None)}"
    return [Row(name, at_rest, depth, f"{ends:ratio}", {"most": ends[0]})]


def describe_thickness(case: Case, part: str | None) -> tuple[list[Row], list[str]]:
    """Find a ring's least thickness, and of more than a ring the least depth of all joints.

    They are returned as rows, with factors of safety, and in lines. Below a fill of known strength
    it is the least depth alone: the ring by itself is another structure.
    """
    at_rest = f"at rest{say_loads_left_out(case)}"
    margins = describe_margins_at_rest(case, case.structure)
    try:
        ring = find_ring(case.structure, part)
    except InvalidInput:
        fill = case.limit.fill
        if part is not None or fill is None or not (rows := _state_depth(case, fill, at_rest)):
            raise
        return rows, [*margins, _BARE]
    limit, build = case.limit, ring.with_thickness
    find = partial(minimum_thickness, build, strength=limit.strength, tolerance=1e-5)
    least = find(friction=limit.friction)
    words = f"{format_mm(least)} of {format_mm(ring.thickness)}, of the ring alone"
    factor = ring.thickness / least
    given = case.structure, limit.strength
    crushes = np.isfinite(check_options(case.structure, limit.friction, limit.strength))
    hard = find(friction=limit.friction, strength=np.inf) if crushes else least
    whole = _state_depth(case, None, at_rest)
    is_whole = len(ring.stones) == len(case.structure.free)
    weight = "with the weight of thinner stones"
    beside = [f" ({row.factor} of less deep joints under the same weight)" for row in whole]
    lines = [
        f"least thickness at rest: {words} on fixed springings, by the mean depth of its joints as "
        "drawn, all stones scaled alike about the middle line",
        "geometric factor of safety of the ring, "
        f"{say_strength(*given, f'{ring.thickness / hard:.3g}')}: {factor:.3g}, {weight}"
        f"{''.join(beside * is_whole)}; {describe_crushing(limit.strength, case.structure)}",
    ]
    words += f" {weight}, {say_strength(*given, format_mm(hard))}"
    rows = [Row(RESULTS["thickness"], at_rest, words, f"{factor:.3g}", {"most": factor})]
    rows += [] if is_whole else whole
    if limit.friction is not None:
        with suppress(InvalidInput):  # without sliding it may stand at any thickness
            rough = find(friction=None)
            moving = explain_instability(build(0.99 * least)) or "joints crush"
            moving = moving.partition(": ")[0]
            lines.append(f"if thinner, {moving}; without sliding {format_mm(rough)} are enough")
    # that of all joints is nearly that of a ring alone, and not said twice
    margins = [x for x in margins if not (is_whole and x.startswith("geometric"))]
    return rows, [*lines, *(["the whole structure as drawn:", *margins] if margins else [])]
