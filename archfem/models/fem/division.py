"""Into how many cells each edge is cut, so that one mesh can fit all blocks.

A block with corners is meshed from side to side, so its opposite sides need the same number of
cells, and neighbours share edges: the numbers hang together through the whole structure. They are
the solution of a small integer program (Tam and Armstrong, International Journal for Numerical
Methods in Engineering 36 (1993) 2581): the fewest cells with which opposite sides agree, no edge
has fewer than wished, and, for quadrilaterals, each edge of a freely meshed block has an even one,
without which it could not be filled. The last is no obstacle: any solution may be doubled.

Blocks without corners take the numbers of their neighbours; on their other edges, and inside, the
cells grow with the distance from those.
"""

from dataclasses import dataclass
from math import prod

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from archfem.arrays import Array
from archfem.errors import MeshError
from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation
from archfem.models.fem.edges import Edges, Numbers, edges_of

SLENDER = 2.0
"""Longest cell of a stone, in multiples of the stone's thickness across it [-]."""

ROUNDING = 1e-6
"""Part of a cell that makes no further one."""

GROWTH = 0.35
"""By how much the cells of a freely meshed block grow with the distance from its stones [-]."""

MOST = 1_000_000
"""Cells of a mesh, beyond which there is no room for it."""

PIECES = 500
"""Into which an edge is cut to count the cells that fit on it."""


@dataclass(frozen=True, eq=False)
class Sizes:
    """Cell size that grows with the distance from facets: the least of l + GROWTH d.

    Attributes:
        middles: of the facets (f, 2) [m].
        lengths: of the facets (f,) [m].
        coarse: largest size [m].
    """

    middles: Array
    lengths: Array
    coarse: float

    def at(self, places: Array) -> Array:
        """Return the size of cells at places (...,) [m].

        Args:
            places: (..., 2) [m].
        """
        away = np.linalg.norm(places[..., None, :] - self.middles, axis=-1)
        grown = self.lengths + GROWTH * np.maximum(away - 0.5 * self.lengths, 0.0)
        size: Array = np.minimum(grown.min(axis=-1), self.coarse)
        return size


@dataclass(frozen=True, eq=False)
class Division:
    """Edges cut into cells.

    Attributes:
        edges: of the blocks.
        stations: for each edge, where its cells end, from 0 at its first point to 1.
        units: what each edge's number of cells is a multiple of (m,).
        sizes: of the cells in each block without corners.
    """

    edges: Edges
    stations: tuple[Array, ...]
    units: Numbers
    sizes: dict[int, Sizes]


def divided(structure: Structure, asked: Discretisation) -> Division:
    """Cut the edges of a structure's blocks into cells.

    Args:
        structure: whose blocks are to be meshed.
        asked: least numbers of cells, and their kind.

    Returns:
        Where the cells on each edge end.

    Raises:
        MeshError: opposite sides cannot be made to agree.
    """
    edges = edges_of(structure, [_along(block.fixed, asked) for block in structure.blocks])
    units = _units(edges, asked)
    _check_room(edges, asked)
    least, fine = _wishes(edges, asked)
    counts = _assigned(edges, units, least)
    counts = _assigned(edges, units, _even(edges, units, counts, least))
    free = edges.unstructured
    sizes = {number: _sizes(edges, number, fine, counts, asked) for number in free}
    graded = _graded(edges, sizes)
    for edge, through in graded.items():
        counts[edge] = max(counts[edge], round(through[-1]))
    counts = _assigned(edges, units, counts)
    stations = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    for edge, through in graded.items():
        place = np.linspace(0.0, 1.0, len(through))
        stations[edge] = np.interp(stations[edge] * through[-1], through, place)
    return Division(edges, tuple(stations), units, sizes)


def _along(fixed: bool, asked: Discretisation) -> int:
    """Cells along a block; an abutment, which does not deform, has one."""
    return 1 if fixed else asked.along


def _check_room(edges: Edges, asked: Discretisation) -> None:
    """Refuse a mesh of more cells than there is room for, before it takes any."""
    count = sum(prod(map(float, _wanted(edges, number, asked))) for number in edges.structured)
    if asked.coarse is not None:
        blocks = [edges.structure.blocks[number] for number in edges.unstructured]
        area = sum(block.area for block in blocks if not block.fixed)
        count += area / asked.coarse / asked.coarse
    if not count <= MOST:
        raise MeshError(
            f"a mesh of {count:.3g} cells, and there is room for {MOST}: use fewer cells, larger "
            "ones (coarse), or the rung 'rigid', which has none"
        )


def _wanted(edges: Edges, number: int, asked: Discretisation) -> list[int]:
    """Least number of cells on each side of a structured block."""
    block = edges.structure.blocks[number]
    lengths = [edges.lengths[side].sum() for side in edges.sides[number]]
    long = [0.5 * (lengths[k] + lengths[k + 2]) for k in range(2)]
    wanted = [_along(block.fixed, asked), asked.through]
    if not block.fixed and block.centre is None:  # arcs are drawn in so many chords already
        slender = [long[k] / (SLENDER * long[1 - k]) for k in range(2)]
        wanted = [max(n, int(np.ceil(s - ROUNDING))) for n, s in zip(wanted, slender, strict=True)]
    return wanted


def _wishes(edges: Edges, asked: Discretisation) -> tuple[Numbers, Array]:
    """Return the least number of cells on each edge, and whether it is a stone's or on a joint.

    Where a side has several edges, none of their cells is longer than the side's would be; so it
    is with a joint between two blocks without corners.
    """
    least = np.ones(len(edges.ends), dtype=np.intp)
    fine = np.zeros(len(edges.ends), dtype=bool)

    def deal(side: Numbers, cells: int) -> None:
        shares = cells * edges.lengths[side] / edges.lengths[side].sum()
        least[side] = np.maximum(least[side], np.ceil(shares - ROUNDING).astype(int))
        fine[side] = True

    for number in edges.structured:
        wanted = _wanted(edges, number, asked)
        for side, cells in zip(edges.sides[number], wanted * 2, strict=True):
            deal(side, cells)
    free = set(edges.unstructured)
    for joint, shared in zip(edges.structure.joints, edges.joints, strict=True):
        if free.issuperset(joint.blocks):
            deal(shared, asked.through)
    return least, fine


def _assigned(edges: Edges, units: Numbers, least: Numbers) -> Numbers:
    """Solve for the numbers of cells; long edges take additional ones first."""
    size = len(edges.ends)
    rows = []
    for number in edges.structured:
        sides = edges.sides[number]
        for side, other in zip(sides[:2], sides[2:], strict=True):
            both = np.concatenate([side, other])
            signs = np.repeat([1, -1], [len(side), len(other)])
            places = (np.zeros(len(both), dtype=int), both)
            rows.append(sparse.csr_matrix((signs * units[both], places), (1, size)))
    found = milp(
        units * edges.lengths.mean() / edges.lengths,
        integrality=np.ones(size),
        bounds=Bounds(np.ceil(least / units), np.inf),
        constraints=LinearConstraint(sparse.vstack(rows), 0.0, 0.0) if rows else (),
    )
    if found.x is None:
        raise MeshError(
            "no numbers of cells make opposite sides of all four-sided blocks agree: mesh some of "
            "them freely, by leaving out their corners"
        )
    multiples: Numbers = np.round(found.x).astype(np.intp)
    return units * multiples


def _even(edges: Edges, units: Numbers, counts: Numbers, least: Numbers) -> Numbers:
    """Least numbers with which the cells of each side are dealt to its edges by their lengths."""
    dealt = least.copy()
    for number in edges.structured:
        for side in edges.sides[number]:
            lengths = edges.lengths[side]
            shares = counts[side].sum() * lengths / lengths.sum() + ROUNDING
            dealt[side] = np.maximum(dealt[side], (shares // units[side]).astype(int) * units[side])
    return dealt


def _units(edges: Edges, asked: Discretisation) -> Numbers:
    """What each edge's number of cells is a multiple of."""
    unit = np.ones(len(edges.ends), dtype=np.intp)
    if asked.cell == "quadrilateral":
        for number in edges.unstructured:
            unit[edges.around[number]] = 2
    return unit


def _sizes(edges: Edges, number: int, fine: Array, counts: Numbers, asked: Discretisation) -> Sizes:
    """Sizes in a freely meshed block, which grow from its fine edges."""
    block, around = edges.structure.blocks[number], edges.around[number]
    small = around[fine[around]]
    ends = edges.points[edges.ends[small]]
    middles = [
        start + (end - start) * (np.arange(count)[:, None] + 0.5) / count
        for (start, end), count in zip(ends, counts[small], strict=True)
    ]
    lengths = np.repeat(edges.lengths[small] / counts[small], counts[small])
    coarse = asked.coarse or block.area / float(edges.lengths[around].sum())
    return Sizes(np.concatenate(middles), lengths, np.inf if block.fixed else coarse)


def _graded(edges: Edges, sizes: dict[int, Sizes]) -> dict[int, Array]:
    """For each edge of freely meshed blocks alone, cells up to equidistant places on it."""
    taken = {edge for number in edges.structured for edge in edges.around[number]}
    found: dict[int, Array] = {}
    for number, size in sizes.items():
        for edge in set(edges.around[number].tolist()) - taken:
            start, end = edges.points[edges.ends[edge]]
            places = start + (end - start) * np.linspace(0.0, 1.0, PIECES + 1)[:, None]
            density = edges.lengths[edge] / size.at(places)
            steps = 0.5 * (density[1:] + density[:-1]) / PIECES
            through = np.append(0.0, np.cumsum(steps))
            if edge not in found or found[edge][-1] < through[-1]:
                found[edge] = through
    return found
