"""Fill that gives way: a soft body cut into pieces that open and slide along joints of their own.

The joints run straight through the body in six directions, 30° apart: each triangle of a lattice
is cut by its medians into six (the kisrhombille tiling). A slip line of any inclination lies within
15° of such a direction, which is what the tiling costs in strength; see `jointed_fill`. Bricks or
hexagons, whose joints do not run through, would interlock, and never fail as soil does.

All compliance is in the joints. A piece is the mirror image of its neighbour in the joint between
them, so their incentres lie 2 r apart, r the radius of the inscribed circle, on a line across it:
joints of stiffness E / 2 r, along as across, strain as a homogeneous body of modulus E and
Poisson's ratio zero under any uniform stress, whatever the size of the pieces. It is the argument
of Bolander and Saito, Engineering Fracture Mechanics 61 (1998) 569-591, for Voronoi cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import radians, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import Contact
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import TOUCHING, Joint, Structure
from archfem.units import in_degrees

if TYPE_CHECKING:
    from shapely import Polygon

RADIUS = (sqrt(3.0) - 1.0) / 4.0
"""Radius of the circle in a whole piece, over its longest side [-]."""

SLIVER = 0.3
"""Part of a whole piece below which what an outline leaves of it is joined to its neighbour [-]."""

STIFF = 1e3
"""Young's modulus of a piece itself over that of the body it stands for [-]."""

MOST = 20_000
"""Pieces beyond which nobody means it."""


@dataclass(frozen=True)
class _Piece:
    """What an outline leaves of a piece of the tiling, and the incentre of the whole one."""

    polygon: "Polygon"
    centre: tuple[float, float]


def jointed_fill(
    structure: Structure, size: float, *, angle: float | str, cohesion: float = 0.0
) -> Structure:
    """Return a structure whose fill is cut into pieces with dry joints between them.

    Every body that `yielding_blocks` names is cut. Its joints have no tensile strength and slide
    by Mohr and Coulomb, |t_s| = c + |t_n| tan φ, without dilatancy. The fill is as compliant as
    before, but for Poisson's ratio, which becomes zero; pieces themselves are as good as rigid,
    so that any rung serves, "rigid" first of all. Joints to the stone keep their law, in series
    with the fill between them and the next piece.

    Strength does not depend on the size of the pieces but on the directions of their joints, 0°,
    ±30°, ±60° and 90°. By the wedge of Coulomb that slides along the best of these the thrust
    on a smooth wall is Rankine's where φ = 30°; at 20° and 40° the active one is 1.2 % and 3.4 %
    less than his, the passive one as much more.

    Args:
        structure: some of whose blocks are soft.
        size: longest side of a piece; its other sides are 0.87 and 0.5 of it [m].
        angle: of internal friction, φ [°].
        cohesion: c [Pa].

    Returns:
        The same stones on fill in pieces, "backfill 1" and so on, of the fill's part.

    Raises:
        InvalidInput: nothing is soft, or a value cannot be meant.
    """
    instance(structure, Structure, "structure", "give one with a fill, e.g. bridge(…)")
    law = _law(in_degrees(angle, "angle of friction"), real(cohesion, "cohesion [Pa]", least=0.0))
    soft = yielding_blocks(structure)
    _check(structure, soft, real(size, "size of the pieces [m]"))
    blocks: list[Block] = []
    origin: list[int] = []
    centres: list[tuple[float, float]] = []
    for number, block in enumerate(structure.blocks):
        pieces = list(_cut(block, size)) if number in soft else []
        blocks += _grains(block, pieces) if pieces else [block]
        origin += [number] * max(1, len(pieces))
        centres += [piece.centre for piece in pieces] or [(0.0, 0.0)]
    touching = _Touching(structure, set(soft), origin, np.array(centres), law, RADIUS * size)
    return touching.joined(blocks)


def _law(angle: float, cohesion: float) -> Contact:
    """A contact with the strength asked for."""
    if not 0.0 <= angle < 60.0:
        raise InvalidInput(f"angle of friction {angle:g}° is not from 0 to 60°: soil has about 30°")
    return Contact(1e3, 1e3, tan(radians(angle)), "fill", cohesion)


def _check(structure: Structure, soft: Sequence[int], size: float) -> None:
    """Refuse a structure without fill, and sizes with which nothing comes of it."""
    if not soft:
        raise InvalidInput(
            "no block is soft beside its joints: there is no fill to cut; give the structure one, "
            "with a material such as BACKFILL and role='other'"
        )
    if any(structure.blocks[number].grain for number in soft):
        raise InvalidInput("the fill is cut into pieces already: cut the structure it was made of")
    if not size > 0.0:
        raise InvalidInput(f"size {size:g} m of the pieces is not above 0: give a length in m")
    area = sum(structure.blocks[number].area for number in soft)
    count = area / (size**2 * sqrt(3.0) / 8.0)
    if not 2.0 <= count <= MOST:
        raise InvalidInput(
            f"pieces of {size:g} m make {count:.3g} of a fill of {area:.3g} m²: give a size with "
            f"which there are 2 to {MOST}"
        )


def _tiling(low: Array, high: Array, middle: float, size: float) -> Iterator[Array]:
    """Pieces of the tiling that may lie in a box (3, 2) [m].

    A line of joints runs along the lower side of the box, one upright through its middle.

    Args:
        low: its lower left corner (2,) [m].
        high: its upper right corner (2,) [m].
        middle: x of its middle [m].
        size: longest side of a piece [m].

    Yields:
        The three corners of each piece.
    """
    side, rise = size * sqrt(3.0), 1.5 * size
    reach = int(np.ceil(0.5 * (high[0] - low[0]) / side)) + 2
    for row in range(int(np.ceil((high[1] - low[1]) / rise))):
        lower = low[1] + row * rise
        for k in range(-2 * reach, 2 * reach):
            left = middle + 0.5 * k * side
            up = (k + row) % 2 == 0
            foot, top = (lower, lower + rise) if up else (lower + rise, lower)
            corners = np.array([(left, foot), (left + side, foot), (left + 0.5 * side, top)])
            yield from _sixths(corners if up else corners[::-1])


def _sixths(corners: Array) -> Iterator[Array]:
    """The six parts into which its medians cut a triangle."""
    centre = corners.mean(axis=0)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        foot = 0.5 * (start + end)
        yield np.array([start, foot, centre])
        yield np.array([foot, end, centre])


def _incentre(corners: Array) -> tuple[float, float]:
    """Centre of the circle in a triangle."""
    opposite = np.linalg.norm(np.roll(corners, -1, axis=0) - np.roll(corners, 1, axis=0), axis=1)
    x, y = opposite @ corners / opposite.sum()
    return float(x), float(y)


def _cut(block: Block, size: float) -> Iterator[_Piece]:
    """Pieces of a block; slivers are joined to the neighbour with which they share most."""
    import shapely

    outline = block.drawn()
    body = shapely.Polygon(outline)
    low, high = outline.min(axis=0), outline.max(axis=0)
    grid = 1e-3 * TOUCHING * size
    found = []
    for corners in _tiling(low, high, 0.5 * float(low[0] + high[0]), size):
        common = shapely.intersection(shapely.Polygon(corners), body, grid_size=grid)
        parts = (part for part in shapely.get_parts(common) if part.geom_type == "Polygon")
        found += [_Piece(part, _incentre(corners)) for part in parts if part.area > 0.0]
    yield from _merged(found, SLIVER * size**2 * sqrt(3.0) / 8.0, grid)


def _merged(pieces: list[_Piece], least: float, grid: float) -> list[_Piece]:
    """Pieces of which none is smaller than an area, if it has a neighbour [m²]."""
    import shapely

    alone: list[_Piece] = []
    while pieces:
        smallest = min(pieces, key=lambda piece: piece.polygon.area)
        if smallest.polygon.area >= least:
            break
        pieces.remove(smallest)
        rim = smallest.polygon.boundary
        others = shapely.boundary([piece.polygon for piece in pieces])
        shared = shapely.length(shapely.intersection(rim, others, grid_size=grid))
        if not len(shared) or shared.max() <= grid:
            alone.append(smallest)
            continue
        host = pieces[int(np.argmax(shared))]
        both = shapely.union(host.polygon, smallest.polygon, grid_size=grid)
        pieces[pieces.index(host)] = _Piece(both, host.centre)
    return [*pieces, *alone]


def _grains(block: Block, pieces: Sequence[_Piece]) -> list[Block]:
    """Pieces as blocks, from below upwards and from left to right."""
    material = replace(block.material, young=min(STIFF * block.material.young, 1e13))
    made = []
    for count, piece in enumerate(pieces, 1):
        ring = np.array(piece.polygon.exterior.normalize().coords)[:-1]
        x, y = ring.T
        turned = ring if x @ np.roll(y, -1) > y @ np.roll(x, -1) else ring[::-1]
        points = tuple((float(px), float(py)) for px, py in turned)
        made.append(
            Block(
                points,
                material,
                f"{block.name} {count}",
                part=block.part,
                role=block.role,
                grain=True,
            )
        )
    return made


@dataclass(frozen=True, eq=False)
class _Touching:
    """How pieces of soft bodies touch one another, and the stones around them.

    Attributes:
        structure: before its fill was cut.
        soft: numbers of the bodies that were cut.
        origin: block of that structure, for each new one.
        centres: of the pieces (n_blocks, 2) [m].
        law: strength between pieces of one body.
        radius: of the circle in a whole piece [m].
    """

    structure: Structure
    soft: set[int]
    origin: Sequence[int]
    centres: Array
    law: Contact
    radius: float

    def joined(self, blocks: Sequence[Block]) -> Structure:
        """Return the structure of the new blocks.

        Args:
            blocks: stones and pieces.
        """
        old = self.structure
        place = {number: new for new, number in enumerate(self.origin)}
        kept = [
            replace(joint, blocks=(place[joint.blocks[0]], place[joint.blocks[1]]))
            for joint in old.joints
            if not self.soft & set(joint.blocks)
        ]
        made = assembled(
            blocks, self.law, joints=kept, width=old.width, gravity=old.gravity, name=old.name
        )
        new = (self._between(joint) for joint in made.joints[len(kept) :])
        return replace(made, joints=(*kept, *(joint for joint in new if joint is not None)))

    def _between(self, joint: Joint) -> Joint | None:
        """A joint with its contact; None where the whole bodies had none."""
        first, second = (self.origin[number] for number in joint.blocks)
        if first == second:
            young = self.structure.blocks[first].material.young
            return replace(joint, contact=_with(self.law, (2.0 * self.radius / young,) * 2))
        whole = next((j for j in self.structure.joints if set(j.blocks) == {first, second}), None)
        if whole is None:
            return None
        soil = sum(self._give(joint, number) for number in joint.blocks)
        across, along = whole.contact.normal_stiffness, whole.contact.shear_stiffness
        return replace(
            joint, contact=_with(whole.contact, (1.0 / across + soil, 1.0 / along + soil))
        )

    def _give(self, joint: Joint, number: int) -> float:
        """Compliance of what lies between a joint and the middle of a block [m/Pa]."""
        if self.origin[number] not in self.soft:
            return 0.0
        block = self.structure.blocks[self.origin[number]]
        across = np.array([joint.tangent[1], -joint.tangent[0]])
        return abs(float((self.centres[number] - joint.middle) @ across)) / block.material.young


def _with(contact: Contact, compliance: tuple[float, float]) -> Contact:
    """A contact of the same strength with other compliances, across and along [m/Pa]."""
    across, along = compliance
    return replace(contact, normal_stiffness=1.0 / across, shear_stiffness=1.0 / along)
