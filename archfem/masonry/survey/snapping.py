"""Closing of small gaps between surveyed outlines.

Vertices nearer to one another than the tolerance `snap` are merged. A vertex within `snap` of an
edge of another outline is moved onto it. A joint between two blocks that deviates from a line by
at most `snap` is made straight. Remaining overlaps and narrow gaps are ambiguous, hence errors.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from archfem._typing import Array
from archfem.errors import InvalidStructure
from archfem.masonry.block import check_overlaps, check_simple, measure_polygon
from archfem.masonry.structure import CONTACT_TOLERANCE

# Gaps and contacts up to this multiple of the tolerance are taken for errors of the survey [-]
AMBIGUOUS_GAP_RATIO = 5.0

Edge = tuple[int, int]
Boundaries = list[list[int]]


def close_gaps(
    outlines: Sequence[Array], names: Sequence[str], snap: float
) -> tuple[list[Array], float]:
    """Return the outlines without gaps below `snap`, and the largest vertex displacement [m]."""
    if not snap > 0.0:
        raise InvalidStructure(f"snap {snap!r} m is not above 0: give e.g. 0.001")
    for name, points in zip(names, outlines, strict=True):
        check_simple(points, name)
    # all outlines anticlockwise
    oriented = [points if measure_polygon(points)[0] > 0.0 else points[::-1] for points in outlines]
    given = np.concatenate(oriented)
    places, number = _merge_vertices(oriented, snap)
    parts = np.split(number, np.cumsum([len(points) for points in oriented])[:-1])
    # merged vertices repeat, inside a boundary and across its end
    boundaries = [part[part != np.roll(part, 1)].tolist() or [int(part[0])] for part in parts]
    owners = [name for name, points in zip(names, oriented, strict=True) for _ in points]
    _check_moved(places[number] - given, given, owners, snap)
    for name, boundary in zip(names, boundaries, strict=True):
        if len(boundary) < 3:
            raise InvalidStructure(f"'{name}' is no larger than snap {snap:.3g} m: lower snap")
    ties = _find_ties(boundaries, places, snap)
    ties |= _find_bends(boundaries, places, ties, snap)
    places = _place_tied(places, ties)
    moved = _check_moved(places[number] - given, given, owners, snap)
    found = [places[boundary] for boundary in boundaries]
    check_overlaps(found, names, AMBIGUOUS_GAP_RATIO * snap)
    _check_gaps(places, boundaries, names, snap)
    return found, moved


def _edges(boundaries: Boundaries) -> Iterator[tuple[int, int, int]]:
    """Yield the boundary number and the two points of every edge."""
    for number, boundary in enumerate(boundaries):
        for a, b in zip(boundary, boundary[1:] + boundary[:1], strict=True):
            yield number, a, b


def _project(places: Array, a: int, b: int) -> tuple[Array, Array, float]:
    """Return coordinates of all places along and to the left of an edge, and its length [m]."""
    step = places[b] - places[a]
    length = float(np.linalg.norm(step))
    x, y = (places - places[a]).T
    return (x * step[0] + y * step[1]) / length, (step[0] * y - step[1] * x) / length, length


def _merge_vertices(outlines: Sequence[Array], snap: float) -> tuple[Array, Any]:
    """Return merged vertices, the places (n, 2) [m], and the place number of each vertex."""
    points = np.concatenate(outlines)
    tree = cKDTree(points)
    # pairs are counted before memory is taken for them; a few touch at each corner
    near = tree.count_neighbors(tree, snap) / len(points)
    if near > 100.0:
        raise InvalidStructure(
            f"snap = {snap:.3g} m would merge {near:.0f} vertices at each place on average: lower "
            "snap below the shortest side of a block"
        )
    pairs = [tree.query_pairs(snap, output_type="ndarray")]
    starts = np.cumsum([0, *map(len, outlines)])
    owner = np.repeat(np.arange(len(outlines)), [len(points) for points in outlines])
    vertices = [list(range(a, b)) for a, b in pairwise(starts)]
    for number, a, b in _edges(vertices):
        along, off, length = _project(points, a, b)
        near = (np.abs(off) <= snap) & (owner != number)
        # a vertex beside the end of an edge merges with that end, else it would make a sliver
        for end, away in ((a, along), (b, length - along)):
            others = np.flatnonzero(near & (away >= 0.0) & (away <= snap))
            pairs.append(np.column_stack([others, np.full(len(others), end)]))
    one, two = np.concatenate(pairs).T
    # chains of near vertices merge into their mean
    graph = sparse.coo_matrix((np.ones(len(one)), (one, two)), (len(points), len(points)))
    count, number = connected_components(graph, directed=False)
    sums = np.array([np.bincount(number, weights=x, minlength=count) for x in points.T])
    places = (sums / np.bincount(number)).T
    return places, number


def _find_ties(boundaries: Boundaries, places: Array, snap: float) -> dict[int, Edge]:
    """Return the places near edges of other outlines, each with its nearest such edge."""
    best: dict[int, tuple[float, Edge]] = {}
    for number, a, b in _edges(boundaries):
        along, off, length = _project(places, a, b)
        inside = (np.abs(off) <= snap) & (along > 0.0) & (along < length)
        for place in set(np.flatnonzero(inside).tolist()) - set(boundaries[number]):
            found = (float(abs(off[place])), (a, b))
            best[place] = min(best.get(place, found), found)
    return {place: edge for place, (_, edge) in best.items()}


def _find_bends(
    boundaries: Boundaries, places: Array, ties: dict[int, Edge], snap: float
) -> dict[int, Edge]:
    """Return the inner vertices of nearly straight joints, each with the ends of its joint."""
    on: dict[frozenset[int], list[int]] = {}
    for place, edge in ties.items():
        on.setdefault(frozenset(edge), []).append(place)
    # boundaries with the places tied to their edges
    whole: Boundaries = [[] for _ in boundaries]
    for number, a, b in _edges(boundaries):
        along = _project(places, a, b)[0]
        whole[number] += [a, *sorted(on.get(frozenset((a, b)), []), key=lambda n: along[n])]
    # a joint is a run of edges that one other boundary has in the opposite direction
    across = {(a, b): number for number, a, b in _edges(whole)}
    found: dict[int, Edge] = {}
    for boundary in whole:
        after = boundary[1:] + boundary[:1]
        beyond = [across.get((b, a), -1) for a, b in zip(boundary, after, strict=True)]
        # start where the neighbour changes, so that no joint is split by the start of the list
        turn = next((k for k in range(len(boundary)) if beyond[k] != beyond[k - 1]), 0)
        nodes, beyond = boundary[turn:] + boundary[:turn], beyond[turn:] + beyond[:turn]
        for other, run in groupby(range(len(boundary)), beyond.__getitem__):
            which = list(run)
            ends = nodes[which[0]], nodes[(which[-1] + 1) % len(nodes)]
            middle = [nodes[k] for k in which[1:]]
            if other >= 0 and middle and ends[0] != ends[1]:
                _, off, _ = _project(places, *ends)
                if np.abs(off[middle]).max() <= snap:
                    found |= {place: ends for place in middle if place not in ties}
    return found


def _place_tied(places: Array, ties: dict[int, Edge]) -> Array:
    """Move tied places onto their edges, whose ends may be tied in turn."""
    # rows of tied places: x = (1 - s) x_a + s x_b; one solve satisfies chains of ties
    hold = sparse.identity(len(places), format="lil")
    free = places.copy()
    for place, (a, b) in ties.items():
        along, _, length = _project(places, a, b)
        share = along[place] / length
        hold[place, a], hold[place, b] = share - 1.0, -share
        free[place] = 0.0
    return np.asarray(splu(hold.tocsc()).solve(free))


def _check_moved(change: Array, given: Array, owners: Sequence[str], snap: float) -> float:
    """Return the largest vertex displacement; refuse it above twice the tolerance.

    Short steps may add up to it.
    """
    moved = np.linalg.norm(change, axis=1)
    worst = int(np.argmax(moved))
    if moved[worst] > 2.0 * snap:
        x, y = given[worst]
        raise InvalidStructure(
            f"the vertex of '{owners[worst]}' at ({x:.3f}, {y:.3f}) would move by "
            f"{1e3 * moved[worst]:.3g} mm until all nearer than snap = {snap:.3g} m touch: raise "
            "snap if the survey is rougher than that; lower it, or leave out vertices, if they "
            "follow one another so closely"
        )
    return float(moved[worst])


def _check_gaps(places: Array, boundaries: Boundaries, names: Sequence[str], snap: float) -> None:
    """Refuse blocks with a narrow gap between them."""
    import shapely

    near = CONTACT_TOLERANCE * float(np.linalg.norm(np.ptp(places, axis=0)))
    polygons = [shapely.Polygon(places[boundary]) for boundary in boundaries]
    tree = shapely.STRtree(polygons)
    first: dict[int, int] = {}
    for number, boundary in enumerate(boundaries):
        first = dict.fromkeys(boundary, number) | first
    found = []
    for number, a, b in _edges(boundaries):
        along, off, length = _project(places, a, b)
        beside = (off < -near) & (off >= -AMBIGUOUS_GAP_RATIO * snap)
        beside &= (along > -near) & (along < length + near)
        for place in set(np.flatnonzero(beside).tolist()) - set(boundaries[number]):
            foot = places[a] + along[place] / length * (places[b] - places[a])
            middle = shapely.Point(0.5 * (foot + places[place]))
            # a gap filled by a third block is none
            if not len(tree.query(middle, predicate="within")):
                found.append((float(-off[place]), number, place))
    if not found:
        return
    width, number, place = max(found)
    x, y = places[place]
    more = f" ({len(found)} such places, this is the widest)" if len(found) > 1 else ""
    raise InvalidStructure(
        f"'{names[first[place]]}' and '{names[number]}' are {1e3 * width:.3g} mm apart at "
        f"({x:.3f}, {y:.3f}){more}, just more than snap: raise snap = {snap:.3g} m above that if "
        f"they touch; if not, draw a gap of more than {AMBIGUOUS_GAP_RATIO * snap:.3g} m"
    )
