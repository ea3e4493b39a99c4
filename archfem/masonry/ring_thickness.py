"""A ring of drawn stones with another thickness about its middle line."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from archfem._typing import Array, Metres, Numbers
from archfem._validation import check_between, validate_arguments, validate_methods
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.block import Block, as_point, check_simple, measure_path
from archfem.masonry.structure import CONTACT_TOLERANCE, Joint, Structure, join_names


@validate_methods
@dataclass(frozen=True, eq=False)
class Ring:
    """Stones of one ring between two springings, in one layer.

    Attributes:
        structure: structure that contains the ring.
        joints: numbers of its joints from one springing to the other.
        stones: numbers of its stones, each between two of these joints.
    """

    structure: Structure
    joints: tuple[int, ...]
    stones: tuple[int, ...]

    @property
    def thickness(self) -> float:
        """Mean depth of the joints [m]."""
        return float(self.structure.depths[list(self.joints)].mean())

    def with_thickness(self, thickness: Metres) -> Structure:
        """Return the ring alone, between fixed springings, with another mean thickness.

        Each point of a face moves along the line to the opposite point of the other face, which is
        as far along its stone. The middle of every section stays, and all depths change by the
        same factor: the arch of which Heyman's geometric factor of safety is the multiple.

        Args:
            thickness: mean depth of the joints as drawn, times the factor [m]. Joints of unequal
                stones are those along both, and become less deep than that.

        Raises:
            InvalidStructure: the stones of a thicker ring run into themselves, or those of a
                thinner one no longer touch.

        References:
            Heyman, Int. J. Mech. Sci. 11 (1969) 363-385.
        """
        check_between(thickness, "thickness [m]", 0.0)
        factor = thickness / self.thickness
        old = self.structure
        blocks, faces = [], dict[tuple[int, int], Array]()
        for place, number in enumerate(self.stones):
            pair = self.joints[place : place + 2]
            at = [old.joints[j] for j in pair]
            block, ends = _scale_stone(old.blocks[number], at, factor, old.size)
            check_simple(block.points, block.name)
            blocks.append(block)
            faces |= {(joint, place): face for joint, face in zip(pair, ends, strict=True)}
        joints = []
        for place, number in enumerate(self.joints):
            own = [faces[number, k] for k in (place - 1, place) if (number, k) in faces]
            joint = _join_faces(old.joints[number], own)
            if len(own) == 2:
                joints.append(replace(joint, blocks=(place - 1, place)))
                continue
            stone = min(place, len(self.stones) - 1)
            joints.append(replace(joint, blocks=(stone, len(blocks))))
            blocks.append(_make_springing(joint, blocks[stone]))
        return Structure(tuple(blocks), tuple(joints), old.width, old.gravity, old.name)


@validate_arguments
def find_ring(structure: Structure, part: str | None = None) -> Ring:
    """Find the stones and joints of a ring, to give it another thickness.

    Args:
        structure: structure with a ring, drawn or of a shape.
        part: part that is the ring; None where there is one ring alone.

    Raises:
        InvalidInput: there is no ring, there are several, or it is drawn in one or two pieces; or
            it is not one layer of stones between two springings, with nothing on its faces.

    Example:
        >>> ring = af.masonry.find_ring(af.circular_arch(radius=1.0, thickness=0.2, embrace=180.0,
        ...                                              voussoirs=7))
        >>> least = af.minimum_thickness(ring.with_thickness, friction=None, tolerance=1e-4)
        >>> f"{ring.thickness / least:.2f}"
        '2.08'
    """
    rings = list(dict.fromkeys(each.part for each in structure.joints if each.role == "ring"))
    if part is None and len(rings) != 1:
        raise InvalidInput(f"there are {len(rings)} rings: give the part of one of {rings}")
    part = rings[0] if part is None else part
    if part not in rings:
        raise InvalidInput(f"'{part}' is no ring: its parts with that role are {rings}")
    stones = {k for k in structure.free if structure.blocks[k].part == part}
    touching: dict[int, list[int]] = {k: [] for k in stones}
    for number, joint in enumerate(structure.joints):
        for k in stones & {*joint.blocks}:
            touching[k].append(number)
    for k, numbers in touching.items():
        if len(numbers) != 2:
            names = join_names([structure.joints[number].name for number in numbers], "; ")
            raise InvalidInput(
                f"'{structure.blocks[k].name}' has {len(numbers)} joints ({names}): a ring whose "
                "thickness changes is one layer of stones, none missing, that carry nothing else; "
                "leave out what is on them, for the bare ring: of a bridge by remove = "
                "['structure.backfill'], of a drawing by ignore = true of its layers; or give the "
                "strength of a fill in [limit], for the depth of all joints with it"
            )
    if len(stones) < 3:
        raise InvalidInput(
            f"ring '{part}' in {len(stones)} pieces cannot hinge: draw each voussoir"
        )
    return Ring(structure, *_follow_ring(structure, stones, touching))


def _follow_ring(
    structure: Structure, stones: set[int], touching: dict[int, list[int]]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return joints and stones from the first springing to the last."""
    springings = [
        (number, k)
        for k, numbers in touching.items()
        for number in numbers
        if not {*structure.joints[number].blocks} <= stones
    ]
    if len(springings) != 2:
        pairs = [structure.joints[number].blocks for number, _ in springings]
        names = [" to ".join(f"'{structure.blocks[k].name}'" for k in pair) for pair in pairs]
        # a stone on a wrong layer interrupts the ring, or is no stone of it
        usual = "give each ring a part of its own, and stones of piers the pier's"
        raise InvalidInput(
            f"the ring has {len(springings)} springings ({join_names(names)}), and needs two: "
            f"{next(iter(structure.misplaced.values()), usual)}"
        )
    number, stone = min(springings)
    joints, order = [number], [stone]
    while True:
        number = next(each for each in touching[order[-1]] if each != joints[-1])
        joints.append(number)
        onward = stones & {*structure.joints[number].blocks} - {order[-1]}
        if not onward:
            return tuple(joints), tuple(order)
        order.append(onward.pop())


def _scale_stone(
    block: Block, joints: Sequence[Joint], factor: float, size: float
) -> tuple[Block, tuple[Array, Array]]:
    """Return a stone with scaled depth, and its faces at both joints (2, 2), intrados first."""
    points = block.points
    near = CONTACT_TOLERANCE * size
    # faces of a stone deeper than its neighbours end beyond the joints
    spans = [block.face_span(joint.ends, near) for joint in joints]
    faces = [j.intrados + np.outer(s, j.tangent) for j, s in zip(joints, spans, strict=True)]
    corners = [[int(np.linalg.norm(points - x, axis=1).argmin()) for x in face] for face in faces]
    (first_in, first_out), (last_in, last_out) = corners
    if len({*corners[0], *corners[1]}) < 4:
        raise InvalidInput(
            f"'{block.name}' has no four corners at its two joints: draw it from joint to joint"
        )
    inner = _walk(block, first_in, last_in, {first_out, last_out})
    outer = _walk(block, first_out, last_out, {first_in, last_in})
    new = points.copy()
    for here, there in ((inner, outer), (outer, inner)):
        places = _shares(points[here]), _shares(points[there])
        opposite = np.column_stack([np.interp(*places, row) for row in points[there].T])
        new[here] = points[here] + 0.5 * (1.0 - factor) * (opposite - points[here])
    for start, end in corners:
        between = _walk(block, start, end, {*inner, *outer} - {start, end})[1:-1]
        middle = points[[start, end]].mean(axis=0)
        new[between] = middle + factor * (points[between] - middle)
    scaled = replace(block, outline=tuple(map(as_point, new)))
    return scaled, (new[corners[0]], new[corners[1]])


def _walk(block: Block, start: int, end: int, forbidden: set[int]) -> Numbers:
    """Return the vertices of an outline from one to another that avoid forbidden ones."""
    count = len(block.points)
    for step in (1, -1):
        length = (end - start) * step % count
        walk = (start + step * np.arange(length + 1)) % count
        if not forbidden & {*walk.tolist()}:
            return walk
    raise InvalidInput(
        f"the joints of '{block.name}' do not cross it from the intrados to the extrados: draw "
        "both across it, or give stones of piers a part of their own, in a drawing by their layer"
    )


def _shares(path: Array) -> Array:
    """Return the share of the length of a path at each of its points (n,)."""
    along = measure_path(path)
    return along / along[-1]


def _join_faces(joint: Joint, faces: Sequence[Array]) -> Joint:
    """Return a joint along the common part of scaled faces of its stones."""
    # the same corners to the last bit: GEOS may take neighbours that differ by less for overlaps
    if all(np.array_equal(face, faces[0]) for face in faces):
        return replace(joint, intrados=as_point(faces[0][0]), extrados=as_point(faces[0][1]))
    along = [np.sort((face - joint.middle) @ joint.tangent) for face in faces]
    low, high = max(span[0] for span in along), min(span[1] for span in along)
    if low >= high:
        raise InvalidStructure(
            f"the stones at {joint.name} do not touch any more: take a thickness nearer to theirs"
        )
    ends = joint.middle + np.outer([low, high], joint.tangent)
    return replace(joint, intrados=as_point(ends[0]), extrados=as_point(ends[1]))


def _make_springing(joint: Joint, stone: Block) -> Block:
    """Return a fixed block behind a springing."""
    intrados, extrados = joint.ends
    normal = np.array([-joint.tangent[1], joint.tangent[0]]) * joint.depth
    if (stone.centroid - joint.middle) @ normal > 0.0:
        normal = -normal
    corners = [intrados, extrados, extrados + normal, intrados + normal]
    (a, b), (c, d) = corners[1] - corners[0], normal
    outline = tuple(map(as_point, corners if a * d - b * c > 0.0 else corners[::-1]))
    name = f"springing at {joint.name}"
    return Block(outline, stone.material, name, fixed=True, part=stone.part, role=stone.role)
