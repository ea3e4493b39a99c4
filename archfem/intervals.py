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

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from archfem.arguments import real
from archfem.errors import InvalidInput, MeshError
from archfem.outlines import Numbers, Outlines, outlines_of
from archfem.structure import Array, Structure

CELLS = ("quadrilateral", "triangle")

SLENDER = 2.0
"""Longest cell of a stone, in multiples of the stone's thickness across it [-]."""

ROUNDING = 1e-6
"""Part of a cell that makes no further one."""

GROWTH = 0.35
"""By how much the cells of a freely meshed block grow with the distance from its stones [-]."""

PIECES = 500
"""Into which an edge is cut to count the cells that fit on it."""


@dataclass(frozen=True)
class Meshing:
    """How finely blocks are cut into cells.

    These are least numbers: a side gets more where a neighbour needs them, where it bends or is
    touched at more points, or where cells of a polygon would be longer than twice its thickness.

    Attributes:
        through: cells through the thickness, so facets on a joint.
        along: cells along each block; a sector's faces get as many chords.
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners, such as backfill [m]; where it is not
            given, half of the block's mean thickness 2 A / P, A its area and P its perimeter.
    """

    through: int = 4
    along: int = 4
    cell: str = "quadrilateral"
    coarse: float | None = None

    def __post_init__(self) -> None:
        """Refuse impossible settings."""
        for key in ("through", "along"):
            count = getattr(self, key)
            if not (isinstance(count, int | np.integer) and 1 <= count <= 1000):
                raise InvalidInput(f"cells {key} = {count!r}: give a whole number, 1 to 1000")
        if self.cell not in CELLS:
            raise InvalidInput(f"cell '{self.cell}' is not known: use one of {CELLS}")
        if self.coarse is not None and not real(self.coarse, "coarse [m]") > 0.0:
            raise InvalidInput(f"coarse = {self.coarse!r} m: give a length above 0, e.g. 0.5")


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
        """Size at places (..., 2) [m]."""
        away = np.linalg.norm(places[..., None, :] - self.middles, axis=-1)
        grown = self.lengths + GROWTH * np.maximum(away - 0.5 * self.lengths, 0.0)
        return np.minimum(grown.min(axis=-1), self.coarse)


@dataclass(frozen=True, eq=False)
class Division:
    """Edges cut into cells.

    Attributes:
        outlines: whose edges they are.
        stations: for each edge, where its cells end, from 0 at its first point to 1.
        units: what each edge's number of cells is a multiple of (m,).
        sizes: of the cells in each block without corners.
    """

    outlines: Outlines
    stations: tuple[Array, ...]
    units: Numbers
    sizes: dict[int, Sizes]


def divided(structure: Structure, meshing: Meshing) -> Division:
    """Cut the edges of a structure's blocks into cells.

    Raises:
        MeshError: opposite sides cannot be made to agree.
    """
    outlines = outlines_of(structure, [_along(block.fixed, meshing) for block in structure.blocks])
    least, fine = _wishes(outlines, meshing)
    counts = _assigned(outlines, least, meshing)
    counts = _assigned(outlines, _even(outlines, counts, least, meshing), meshing)
    free = outlines.unstructured
    sizes = {number: _sizes(outlines, number, fine, counts, meshing) for number in free}
    graded = _graded(outlines, sizes)
    for edge, through in graded.items():
        counts[edge] = max(counts[edge], round(through[-1]))
    counts = _assigned(outlines, counts, meshing)
    stations = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    for edge, through in graded.items():
        place = np.linspace(0.0, 1.0, len(through))
        stations[edge] = np.interp(stations[edge] * through[-1], through, place)
    return Division(outlines, tuple(stations), _units(outlines, meshing), sizes)


def _along(fixed: bool, meshing: Meshing) -> int:
    """Cells along a block; an abutment, which does not deform, has one."""
    return 1 if fixed else meshing.along


def _wanted(outlines: Outlines, number: int, meshing: Meshing) -> list[int]:
    """Least number of cells on each side of a structured block."""
    block = outlines.structure.blocks[number]
    lengths = [outlines.lengths[side].sum() for side in outlines.sides(number)]
    long = [0.5 * (lengths[k] + lengths[k + 2]) for k in range(2)]
    wanted = [_along(block.fixed, meshing), meshing.through]
    if not block.fixed and block.centre is None:  # arcs are drawn in so many chords already
        slender = [long[k] / (SLENDER * long[1 - k]) for k in range(2)]
        wanted = [max(n, int(np.ceil(s - ROUNDING))) for n, s in zip(wanted, slender, strict=True)]
    return wanted


def _wishes(outlines: Outlines, meshing: Meshing) -> tuple[Numbers, Array]:
    """Least number of cells on each edge, and whether it is a stone's or on a joint.

    Where a side has several edges, none of their cells is longer than the side's would be; so it
    is with a joint between two blocks without corners.
    """
    least = np.ones(len(outlines.edges), dtype=np.intp)
    fine = np.zeros(len(outlines.edges), dtype=bool)

    def deal(edges: Numbers, cells: int) -> None:
        shares = cells * outlines.lengths[edges] / outlines.lengths[edges].sum()
        least[edges] = np.maximum(least[edges], np.ceil(shares - ROUNDING).astype(int))
        fine[edges] = True

    for number in outlines.structured:
        wanted = _wanted(outlines, number, meshing)
        for side, cells in zip(outlines.sides(number), wanted * 2, strict=True):
            deal(side, cells)
    free = set(outlines.unstructured)
    for joint, edges in zip(outlines.structure.joints, outlines.joints, strict=True):
        if free.issuperset(joint.blocks):
            deal(edges, meshing.through)
    return least, fine


def _assigned(outlines: Outlines, least: Numbers, meshing: Meshing) -> Numbers:
    """Solve for the numbers of cells; long edges take additional ones first."""
    size = len(outlines.edges)
    unit = _units(outlines, meshing)
    rows = []
    for number in outlines.structured:
        sides = outlines.sides(number)
        for side, other in zip(sides[:2], sides[2:], strict=True):
            edges = np.concatenate([side, other])
            signs = np.repeat([1, -1], [len(side), len(other)])
            places = (np.zeros(len(edges), dtype=int), edges)
            rows.append(sparse.csr_matrix((signs * unit[edges], places), (1, size)))
    found = milp(
        unit * outlines.lengths.mean() / outlines.lengths,
        integrality=np.ones(size),
        bounds=Bounds(np.ceil(least / unit), np.inf),
        constraints=LinearConstraint(sparse.vstack(rows), 0.0, 0.0) if rows else (),
    )
    if found.x is None:
        raise MeshError(
            "no numbers of cells make opposite sides of all four-sided blocks agree: mesh some of "
            "them freely, by leaving out their corners"
        )
    return unit * np.round(found.x).astype(np.intp)


def _even(outlines: Outlines, counts: Numbers, least: Numbers, meshing: Meshing) -> Numbers:
    """Least numbers with which the cells of each side are dealt to its edges by their lengths."""
    dealt, unit = least.copy(), _units(outlines, meshing)
    for number in outlines.structured:
        for side in outlines.sides(number):
            lengths = outlines.lengths[side]
            shares = counts[side].sum() * lengths / lengths.sum() + ROUNDING
            dealt[side] = np.maximum(dealt[side], (shares // unit[side]).astype(int) * unit[side])
    return dealt


def _units(outlines: Outlines, meshing: Meshing) -> Numbers:
    """What each edge's number of cells is a multiple of."""
    unit = np.ones(len(outlines.edges), dtype=np.intp)
    if meshing.cell == "quadrilateral":
        for number in outlines.unstructured:
            unit[outlines.around[number]] = 2
    return unit


def _sizes(
    outlines: Outlines, number: int, fine: Array, counts: Numbers, meshing: Meshing
) -> Sizes:
    """Sizes in a freely meshed block, which grow from its fine edges."""
    block, around = outlines.structure.blocks[number], outlines.around[number]
    edges = around[fine[around]]
    ends = outlines.points[outlines.edges[edges]]
    middles = [
        start + (end - start) * (np.arange(count)[:, None] + 0.5) / count
        for (start, end), count in zip(ends, counts[edges], strict=True)
    ]
    lengths = np.repeat(outlines.lengths[edges] / counts[edges], counts[edges])
    coarse = meshing.coarse or block.area / float(outlines.lengths[around].sum())
    return Sizes(np.concatenate(middles), lengths, np.inf if block.fixed else coarse)


def _graded(outlines: Outlines, sizes: dict[int, Sizes]) -> dict[int, Array]:
    """For each edge of freely meshed blocks alone, cells up to equidistant places on it."""
    taken = {edge for number in outlines.structured for edge in outlines.around[number]}
    found: dict[int, Array] = {}
    for number, size in sizes.items():
        for edge in set(outlines.around[number].tolist()) - taken:
            start, end = outlines.points[outlines.edges[edge]]
            places = start + (end - start) * np.linspace(0.0, 1.0, PIECES + 1)[:, None]
            density = outlines.lengths[edge] / size.at(places)
            steps = 0.5 * (density[1:] + density[:-1]) / PIECES
            through = np.append(0.0, np.cumsum(steps))
            if edge not in found or found[edge][-1] < through[-1]:
                found[edge] = through
    return found
