"""Assembly of blocks into a structure, with joints along touching straight edges."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from archfem._typing import Array, Metres, MetresPerSecondSquared
from archfem._validation import check_type, validate_arguments
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.block import Block
from archfem.masonry.materials import Contact
from archfem.masonry.parts import Direction, assign_roles, find_backs, find_directions
from archfem.masonry.structure import CONTACT_TOLERANCE, Joint, Structure
from archfem.units import G

# Returns the contact of two blocks.
ContactOf = Callable[[Block, Block], Contact]

# Numbers of two blocks and the ends of their common line, the left or lower end first
Touch = tuple[int, int, Array]


@validate_arguments
def assembled(
    blocks: Sequence[Block],
    contact: Contact | ContactOf,
    *,
    joints: Sequence[Joint] = (),
    width: Metres = 1.0,
    gravity: MetresPerSecondSquared = G,
    name: str = "structure",
) -> Structure:
    """Assemble blocks to a structure, with a joint along every common line of two blocks.

    Joints across a ring or a pier are first, named and numbered along it: "main arch, joint 0" is
    its left springing, "north pier, base" its foot, "north pier, joint 1" the next one above. Their
    intrados is the end closer to the centre of the ring, in a pier the left one. Other joints, and
    all of a wall in bond, are named "one block to other block"; their "intrados" is the left end,
    or the lower one where they are vertical.

    A joint belongs to the part of its blocks. Between two parts it belongs to that of the free
    block; then to the ring it crosses, as a springing does, or to the pier above it; then to a part
    that is neither ring nor pier; then to the ring. It has the role of that part.

    Args:
        blocks: in the order of their numbers. Missing roles are inferred from the names of parts.
        contact: contact of the new joints, or a function of the two blocks.
        joints: existing ones; their pairs of blocks get no further joint, and joints of their parts
            are not numbered.
        width: out of plane [m].
        gravity: acceleration of gravity [m/s²].
        name: name of the structure.

    Raises:
        InvalidStructure: blocks are not connected, or roles contradict one another.
    """
    blocks = assign_roles(blocks, joints)
    joined = {frozenset(joint.blocks) for joint in joints}
    numbered = {joint.part for joint in joints}
    touches = touching(blocks)
    directions = find_directions(blocks, touches)
    of = contact if callable(contact) else lambda *_: contact
    across: dict[str, list[Joint]] = {part: [] for part in directions}
    others = []
    backs = find_backs(blocks, touches, directions)
    for number, (a, b, ends) in enumerate(touches):
        if {a, b} not in joined:
            owner = _select_owner(blocks[a], blocks[b], ends, directions)
            part, role = owner.part, owner.role
            if role == "ring" and number in backs:
                part, role = f"extrados of {part}", "other"
            (x0, y0), (x1, y1) = ends.tolist()
            law = of(blocks[a], blocks[b])
            check_type(law, Contact, "contact of two blocks", "return a Contact from the function")
            joint = Joint((a, b), (x0, y0), (x1, y1), law, "", part, role)  # named below
            if part in directions and part not in numbered and directions[part].separates(ends):
                across[part].append(joint)
            else:
                others.append(joint)
    all_joints = list(joints)
    # in a wall, a pier with joints along it too, a number would not say where a joint is
    walls = {joint.part for joint in others if joint.role == "pier" and _is_inner(joint, blocks)}
    unnamed: list[Joint] = []
    for part, direction in directions.items():
        ordered = _order_joints(across[part], part, direction, blocks)
        (unnamed if part in walls else all_joints).extend(ordered)
    all_joints += name_joints([*unnamed, *others], blocks)
    return Structure(blocks, tuple(all_joints), width, gravity, name)


def by_materials(contact: Contact, pairs: Mapping[str, Contact]) -> ContactOf:
    """Return a function that selects the contact by the materials of two blocks."""
    key_of = {frozenset(name.strip() for name in key.split("/")): key for key in pairs}
    for names, key in key_of.items():
        if len(names) != 2:
            raise InvalidInput(f"'{key}' is no pair of two materials: write e.g. stone/backfill")

    def of(a: Block, b: Block) -> Contact:
        names = frozenset((a.material.name, b.material.name))
        if len(names) == 1:
            return contact
        if names not in key_of:
            raise InvalidInput(
                f"'{a.name}' of {a.material.name} and '{b.name}' of {b.material.name} touch, and "
                f'there is no contact for these: give one for "{"/".join(sorted(names))}"'
            )
        return pairs[key_of[names]]

    return of


def touching(blocks: Sequence[Block]) -> list[Touch]:
    """Find the straight lines along which edges of two blocks touch."""
    starts, ends, owner = _straight_edges(blocks)
    near = CONTACT_TOLERANCE * float(np.linalg.norm(np.ptp(starts, axis=0)))
    steps = ends - starts
    lengths = np.linalg.norm(steps, axis=1)
    lines: dict[tuple[int, int], list[Array]] = {}
    for k, (start, step, length) in enumerate(zip(starts, steps, lengths, strict=True)):
        tangent = step / length
        normal = np.array([-tangent[1], tangent[0]])
        off = np.abs([(starts - start) @ normal, (ends - start) @ normal]).max(axis=0)
        low, high = (ends - start) @ tangent, (starts - start) @ tangent  # opposite directions
        overlap = np.minimum(high, length) - np.maximum(low, 0.0)
        for other in np.flatnonzero((off <= near) & (overlap > 4.0 * near) & (owner > owner[k])):
            span = np.array([max(low[other], 0.0), min(high[other], length)])
            pair = (int(owner[k]), int(owner[other]))
            lines.setdefault(pair, []).append(start + span[:, None] * tangent)
    return [(*pair, line) for pair in sorted(lines) for line in _merge_lines(lines[pair], near)]


def _straight_edges(blocks: Sequence[Block]) -> tuple[Array, Array, Array]:
    """Return starts and ends of all straight edges (e, 2), and their blocks (e,)."""
    if not blocks:
        raise InvalidStructure("there are no blocks to assemble: give at least one")
    starts = np.concatenate([block.points for block in blocks])
    ends = np.concatenate([np.roll(block.points, -1, axis=0) for block in blocks])
    owner = np.repeat(np.arange(len(blocks)), [len(block.points) for block in blocks])
    straight = np.any(starts != ends, axis=1)
    for number, block in enumerate(blocks):
        if block.centre is not None:
            straight[np.flatnonzero(owner == number)[[0, 2]]] = False
    return starts[straight], ends[straight], owner[straight]


def _merge_lines(lines: list[Array], near: float) -> list[Array]:
    """Merge collinear lines between two blocks, sorted from left to right."""
    merged: list[Array] = []
    for line in lines:
        apart = []
        for other in merged:
            if _is_continuation(line, other, near) or _is_continuation(other, line, near):
                line = np.array(max(((a, b) for a in line for b in other), key=_length_of))
            else:
                apart.append(other)
        merged = [*apart, line]
    middles = np.array([line.mean(axis=0) for line in merged])
    order = np.argsort(middles[:, int(np.argmax(np.ptp(middles, axis=0)))], kind="stable")
    return [_orient_line(merged[k]) for k in order]


def _is_continuation(line: Array, other: Array, near: float) -> bool:
    """Return whether a line starts at the end of another, in the same direction."""
    arm, step = other[1] - other[0], line[1] - line[0]
    bend = abs(arm[0] * step[1] - arm[1] * step[0]) / np.linalg.norm(arm)
    return bool(_length_of((line[0], other[1])) <= 2.0 * near and bend <= 2.0 * near)


def _length_of(ends: tuple[Array, Array]) -> float:
    """Return the distance of two points [m]."""
    return float(np.linalg.norm(ends[1] - ends[0]))


def _orient_line(line: Array) -> Array:
    """Return a line with its left end first, or the lower one where it is vertical within 1:10."""
    x, y = line[1] - line[0]
    forward = y > 0.0 if abs(x) <= 0.1 * abs(y) else x > 0.0
    return line if forward else line[::-1]


def _select_owner(a: Block, b: Block, line: Array, directions: Mapping[str, Direction]) -> Block:
    """Select the block whose part includes the joint, by the rules of `assembled`."""
    if a.fixed != b.fixed:
        return b if a.fixed else a
    for block, other in ((a, b), (b, a)):
        direction = directions.get(block.part)
        if direction is not None and other.role != block.role and direction.separates(line):
            below = other.centroid[1] < line[:, 1].mean()
            if block.role == "ring" or (other.role == "other" and below):
                return block
    return min((b, a), key=lambda block: ("other", "ring", "pier").index(block.role))


def _order_joints(
    joints: Sequence[Joint], part: str, direction: Direction, blocks: Sequence[Block]
) -> list[Joint]:
    """Order and name the joints across a ring or pier, with intrados and extrados."""
    ordered = sorted(joints, key=lambda joint: direction.along(joint.middle))
    words = [f"joint {k}" for k in range(len(ordered))]
    if ordered and ordered[0].role == "pier":
        ordered.sort(key=lambda joint: not _is_foot(joint, blocks))
        feet = sum(_is_foot(joint, blocks) for joint in ordered)
        words = [f"base {k + 1}" for k in range(feet)] if feet > 1 else ["base"]
        words += [f"joint {k + 1}" for k in range(len(ordered))]
    named = []
    for joint, word in zip(ordered, words, strict=False):
        inner, outer = joint.intrados, joint.extrados
        if joint.tangent @ direction.outward(joint.middle) < 0.0:
            inner, outer = outer, inner
        name = f"{part}, {word}" if part else word
        named.append(replace(joint, intrados=inner, extrados=outer, name=name))
    return named


def _is_inner(joint: Joint, blocks: Sequence[Block]) -> bool:
    """Return whether a joint separates two free stones of its part."""
    return all(not blocks[k].fixed and blocks[k].part == joint.part for k in joint.blocks)


def _is_foot(joint: Joint, blocks: Sequence[Block]) -> bool:
    """Return whether a joint rests on a fixed block."""
    return any(blocks[number].fixed for number in joint.blocks)


def name_joints(joints: Sequence[Joint], blocks: Sequence[Block]) -> list[Joint]:
    """Name joints by their blocks, with numbers where two blocks have several."""
    pairs = [joint.blocks for joint in joints]
    named = []
    for k, joint in enumerate(joints):
        words = " to ".join(blocks[number].name for number in joint.blocks)
        if pairs.count(joint.blocks) > 1:
            words += f", {pairs[: k + 1].count(joint.blocks)}"
        named.append(replace(joint, name=words))
    return named
