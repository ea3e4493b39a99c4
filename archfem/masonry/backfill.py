"""Jointed backfill: a soft body cut into rigid pieces with dry joints between them.

The joints run straight through the body in six directions, 30° apart: each triangle of a lattice
is divided by its medians into six (the kisrhombille tiling). A slip line of any inclination is
within 15° of such a direction, which bounds the error in strength; see `jointed_fill`. Bricks or
hexagons, whose joints are not continuous, would interlock and could not fail like soil.

All compliance is in the joints. A piece is the mirror image of its neighbour in their joint. The
incentres are therefore 2 r apart on its normal, with r the radius of the inscribed circle. Joints
of stiffness E / 2 r in both directions strain like a homogeneous body of modulus E and Poisson's
ratio zero. They do so under any uniform stress, for any size of the pieces. The argument is that of
Bolander and Saito, Engineering Fracture Mechanics 61 (1998) 569-591, for Voronoi cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import radians, sqrt, tan
from typing import NamedTuple

import numpy as np
import shapely

from archfem._typing import Angle, Array, Metres, Pascals
from archfem._validation import check_between, check_number, validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import Contact, Material
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import CONTACT_TOLERANCE, Joint, Structure
from archfem.units import in_degrees

# Area of a whole piece, over the square of its longest side [-]
TILE_AREA = sqrt(3.0) / 8.0


class _Piece(NamedTuple):
    """Part of a tile inside the outline, and the incentre of the whole tile."""

    polygon: shapely.Polygon
    centre: Array  # (2,) [m]


@validate_arguments
def jointed_fill(
    structure: Structure, piece_size: Metres, *, friction_angle: Angle, cohesion: Pascals = 0.0
) -> Structure:
    """Return a structure whose fill is cut into pieces with dry joints between them.

    Every body of `find_yielding_blocks` is cut. Its joints have no tensile strength and the
    Mohr-Coulomb limit |t_s| = c + |t_n| tan φ, without dilatancy. The compliance of the fill is
    unchanged but for Poisson's ratio, which becomes zero. Pieces are practically rigid, so every
    fidelity is suitable, first of all "rigid". Joints to the stone keep their law, in series with
    the fill between them and the next piece.

    Where pieces are small beside the structure, strength depends on the directions of their joints
    alone, 0°, ±30°, ±60° and 90°; coarse ones lock a ring. For a Coulomb wedge along the critical
    one of these, the thrust on a smooth wall is Rankine's at φ = 30°; at 20° and 40° the active
    thrust is 1.2 % and 3.4 % smaller, the passive one larger by as much.

    Args:
        structure: some of whose blocks are soft.
        piece_size: longest side of a piece; its other sides are 0.87 and 0.5 of it [m].
        friction_angle: angle of internal friction φ [°].
        cohesion: c [Pa].

    Returns:
        The same stones on fill in pieces, "backfill 1" and so on, of the fill's part.

    Raises:
        InvalidInput: no block is soft, or a value is not valid.
    """
    angle = in_degrees(friction_angle, "angle of friction")
    law = _fill_contact(angle, check_number(cohesion, "cohesion [Pa]", minimum=0.0))
    soft = find_yielding_blocks(structure)
    _check_fill(structure, soft, check_number(piece_size, "size of the pieces [m]"))
    # radius of the inscribed circle of a whole piece
    radius = (sqrt(3.0) - 1.0) / 4.0 * piece_size
    fill = _FillAssembly(structure, set(soft), law, radius)
    blocks: list[Block] = []
    for number, block in enumerate(structure.blocks):
        pieces = cut_block(block, piece_size) if number in soft else []
        blocks += _create_blocks(block, pieces) if pieces else [block]
        fill.origin += [number] * max(1, len(pieces))
        fill.centres += [piece.centre for piece in pieces] or [np.zeros(2)]
    table = {"law": "jointed", "piece_size": piece_size}
    table |= {"friction_angle": angle, "cohesion": cohesion}
    origin = structure.origin and (structure.origin[0], {**structure.origin[1], "fill": table})
    return replace(fill.assemble(blocks), origin=origin)


def _fill_contact(angle: float, cohesion: float) -> Contact:
    """Return a contact with the strength of the fill."""
    remedy = "soil has about 30°"
    check_between(angle, "angle of friction [°]", 0.0, 60.0, ends="[)", remedy=remedy)
    return Contact(1e3, 1e3, tan(radians(angle)), "fill", cohesion)


def _check_fill(structure: Structure, soft: Sequence[int], size: float) -> None:
    """Check that there is fill, and that the size of the pieces suits it."""
    if not soft:
        raise InvalidInput(
            "no block is soft beside its joints: there is no fill to cut; give the structure one, "
            "with a material such as BACKFILL and role='other'"
        )
    if any(structure.blocks[number].grain for number in soft):
        raise InvalidInput("the fill is cut into pieces already: cut the structure it was made of")
    check_between(size, "size of the pieces [m]", 0.0, remedy="give a length in m")
    area = sum(structure.blocks[number].area for number in soft)
    count = area / (TILE_AREA * size**2)
    if not 2.0 <= count <= 20_000:  # more cannot be solved in reasonable time
        raise InvalidInput(
            f"pieces of {size:g} m make {count:.3g} of a fill of {area:.3g} m²: give a size with "
            "which there are 2 to 20000"
        )


def _tile_box(low: Array, high: Array, middle: float, size: float) -> Iterator[Array]:
    """Yield the tiles (3, 2) [m] that may intersect a box."""
    # one line of joints is the lower side of the box, another its vertical axis of symmetry
    side, rise = size * sqrt(3.0), 1.5 * size
    reach = int(np.ceil(0.5 * (high[0] - low[0]) / side)) + 2
    for row in range(int(np.ceil((high[1] - low[1]) / rise))):
        lower = low[1] + row * rise
        for k in range(-2 * reach, 2 * reach):
            left = middle + 0.5 * k * side
            up = (k + row) % 2 == 0
            foot, top = (lower, lower + rise) if up else (lower + rise, lower)
            corners = np.array([(left, foot), (left + side, foot), (left + 0.5 * side, top)])
            yield from _split_by_medians(corners if up else corners[::-1])


def _split_by_medians(corners: Array) -> Iterator[Array]:
    """Yield the six triangles between the medians of a triangle."""
    centre = corners.mean(axis=0)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        foot = 0.5 * (start + end)
        yield np.array([start, foot, centre])
        yield np.array([foot, end, centre])


def _incentre(corners: Array) -> Array:
    """Return the centre of the inscribed circle of a triangle (2,) [m]."""
    opposite = np.linalg.norm(np.roll(corners, -1, axis=0) - np.roll(corners, 1, axis=0), axis=1)
    return opposite @ corners / opposite.sum()


def cut_block(block: Block, size: float) -> list[_Piece]:
    """Cut a block into pieces; slivers are merged with their main neighbour."""
    outline = block.drawn()
    body = shapely.Polygon(outline)
    low, high = outline.min(axis=0), outline.max(axis=0)
    grid = 1e-3 * CONTACT_TOLERANCE * size
    pieces = []
    for corners in _tile_box(low, high, 0.5 * float(low[0] + high[0]), size):
        common = shapely.intersection(shapely.Polygon(corners), body, grid_size=grid)
        parts = (part for part in shapely.get_parts(common) if part.geom_type == "Polygon")
        pieces += [_Piece(part, _incentre(corners)) for part in parts if part.area > 0.0]
    # below 30 % of a whole piece a sliver is merged
    return _merge_slivers(pieces, 0.3 * TILE_AREA * size**2, grid)


def _merge_slivers(pieces: list[_Piece], min_area: float, grid: float) -> list[_Piece]:
    """Merge pieces below an area [m²] with the neighbour of the longest common edge."""
    alone: list[_Piece] = []
    while pieces:
        smallest = min(pieces, key=lambda piece: piece.polygon.area)
        if smallest.polygon.area >= min_area:
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


def describe_held_ends(structure: Structure) -> str:
    """Say that fixed walls hold the ends of a fill in pieces over most of its height; or ""."""
    pieces = [block.points for block in structure.blocks if block.grain]
    heights: dict[float, float] = {}
    for joint in structure.joints:
        owners = [structure.blocks[number] for number in joint.blocks]
        wide, high = np.ptp(joint.ends, axis=0)
        if any(x.fixed for x in owners) and any(x.grain for x in owners) and wide < 1e-6 * high:
            place = round(float(joint.middle[0]), 3)
            heights[place] = heights.get(place, 0.0) + float(high)
    if not heights or max(heights.values()) < 0.5 * np.ptp(np.concatenate(pieces)[:, 1]):
        return ""
    return f"fixed walls hold the ends of the fill over {max(heights.values()):.3g} m"


def stiffen(material: Material) -> Material:
    """Return the material of pieces, a thousand times stiffer: the compliance is in the joints."""
    return replace(material, young=min(1e3 * material.young, 1e13))


def _create_blocks(block: Block, pieces: Sequence[_Piece]) -> list[Block]:
    """Create blocks from pieces, from below upwards and from left to right."""
    material, blocks = stiffen(block.material), list[Block]()
    for count, piece in enumerate(pieces, 1):
        ring = np.array(piece.polygon.exterior.normalize().coords)[:-1]
        x, y = ring.T
        oriented = ring if x @ np.roll(y, -1) > y @ np.roll(x, -1) else ring[::-1]
        points, name = tuple(map(tuple, oriented.tolist())), f"{block.name} {count}"
        blocks.append(Block(points, material, name, part=block.part, role=block.role, grain=True))
    return blocks


@dataclass(eq=False)
class _FillAssembly:
    """Assembly of pieces of soft bodies with each other and with the stones."""

    structure: Structure  # with whole fill
    soft: set[int]  # numbers of the divided bodies
    law: Contact  # strength between pieces of one body
    radius: float  # of the inscribed circle of a whole piece [m]
    origin: list[int] = field(default_factory=list)  # original block of each new one
    centres: list[Array] = field(default_factory=list)  # of the pieces, each (2,) [m]

    def assemble(self, blocks: Sequence[Block]) -> Structure:
        """Assemble the structure of the new blocks."""
        old = self.structure
        place = {number: new for new, number in enumerate(self.origin)}
        unchanged = [
            replace(joint, blocks=(place[joint.blocks[0]], place[joint.blocks[1]]))
            for joint in old.joints
            if not self.soft & set(joint.blocks)
        ]
        cut = assembled(
            blocks, self.law, joints=unchanged, width=old.width, gravity=old.gravity, name=old.name
        )
        new = filter(None, map(self._with_contact, cut.joints[len(unchanged) :]))
        return replace(cut, joints=(*unchanged, *new))

    def _with_contact(self, joint: Joint) -> Joint | None:
        """Return a joint with its contact; None where the whole bodies had no joint."""
        first, second = (self.origin[number] for number in joint.blocks)
        if first == second:
            within = self.structure.blocks[first].material.young / (2.0 * self.radius)
            law = replace(self.law, normal_stiffness=within, shear_stiffness=within)
        else:
            joints = (j for j in self.structure.joints if set(j.blocks) == {first, second})
            if (whole := next(joints, None)) is None:
                return None
            soil = sum(self._soil_compliance(joint, number) for number in joint.blocks)
            law = whole.contact.in_series(soil, soil)
        return replace(joint, contact=law)

    def _soil_compliance(self, joint: Joint, number: int) -> float:
        """Return the compliance of the fill between a joint and the incentre of a piece [m/Pa]."""
        if self.origin[number] not in self.soft:
            return 0.0
        block = self.structure.blocks[self.origin[number]]
        across = np.array([joint.tangent[1], -joint.tangent[0]])
        return abs(float((self.centres[number] - joint.middle) @ across)) / block.material.young
