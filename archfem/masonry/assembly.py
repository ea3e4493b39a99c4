"""From blocks to a structure: joints wherever straight edges of two blocks touch."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.block import Block
from archfem.masonry.direction import Direction, directions_of
from archfem.masonry.materials import Contact
from archfem.masonry.roles import with_roles
from archfem.masonry.structure import TOUCHING, Joint, Structure
from archfem.units import G

ContactOf = Callable[[Block, Block], Contact]
"""Tells how two blocks touch."""

UPRIGHT = 0.1
"""Largest inclination of an upright line, horizontal to vertical."""

Touch = tuple[int, int, Array]
"""Two blocks and both ends of a line along which they touch, the left or lower one first."""


def assembled(
    blocks: Sequence[Block],
    contact: Contact | ContactOf,
    *,
    joints: Sequence[Joint] = (),
    width: float = 1.0,
    gravity: float = G,
    name: str = "structure",
) -> Structure:
    """Return a structure of blocks, with a joint along every line on which two of them touch.

    Joints across a ring or a pier come first, named and counted along it: "main arch, joint 0" is
    its left springing, "north pier, base" its foot, "north pier, joint 1" the next one up. Their
    intrados is the end nearer the ring's centre, in a pier the left one. Any other joint is named
    "one block to other block"; its "intrados" is its left end, or the lower one where it is
    upright.

    A joint belongs to the part of its blocks. Between two parts it belongs to that of the block
    that moves; then to the ring it lies across, as a springing does, or the pier it carries; then
    to one that is neither ring nor pier; then to the ring. It has the role of that part.

    Args:
        blocks: in the order they will be numbered. Roles that they do not tell go by the names of
            their parts.
        contact: of the joints found, or a function of the two blocks.
        joints: that are given already; their pairs of blocks are left alone, and their parts are
            not counted.
        width: out of plane [m].
        gravity: acceleration of gravity [m/s²].
        name: of the structure.

    Raises:
        InvalidStructure: blocks do not hang together, or roles contradict one another.
    """
    blocks = with_roles(blocks, joints)
    known = {frozenset(joint.blocks) for joint in joints}
    counted = {joint.part for joint in joints}
    touches = touching(blocks)
    ways = directions_of(blocks, touches)
    of = contact if callable(contact) else lambda *_: contact
    across: dict[str, list[Joint]] = {part: [] for part in ways}
    others = []
    for a, b, ends in touches:
        if {a, b} not in known:
            owner = _owner(blocks[a], blocks[b], ends, ways)
            part = owner.part
            made = _joint((a, b), ends, of(blocks[a], blocks[b]), owner)
            if part in ways and part not in counted and ways[part].separates(ends):
                across[part].append(made)
            else:
                others.append(made)
    lined = [each for part in ways for each in _counted(across[part], part, ways[part], blocks)]
    made_all = (*joints, *lined, *_named(others, blocks))
    return Structure(blocks, made_all, width, gravity, name)


def by_materials(contact: Contact, pairs: Mapping[str, Contact]) -> ContactOf:
    """Return how blocks touch, by the names of their materials.

    Args:
        contact: of two blocks of one material.
        pairs: contacts of two materials, "stone/backfill". Where a pair is missing, its blocks may
            not touch: asked for their contact, what is returned raises `InvalidInput`.

    Raises:
        InvalidInput: a key is no pair of names.
    """
    known = {frozenset(name.strip() for name in key.split("/")): key for key in pairs}
    for names, key in known.items():
        if len(names) != 2:
            raise InvalidInput(f"'{key}' is no pair of two materials: write e.g. stone/backfill")

    def of(a: Block, b: Block) -> Contact:
        names = frozenset((a.material.name, b.material.name))
        if len(names) == 1:
            return contact
        if names not in known:
            raise InvalidInput(
                f"'{a.name}' of {a.material.name} and '{b.name}' of {b.material.name} touch, and "
                f'of that contact nothing is said: give one for "{"/".join(sorted(names))}"'
            )
        return pairs[known[names]]

    return of


def touching(blocks: Sequence[Block]) -> list[Touch]:
    """Return the straight lines along which blocks touch, back to back.

    Args:
        blocks: whose outlines may have points in the middle of a line; arcs touch nothing.

    Raises:
        InvalidStructure: there are no blocks.
    """
    starts, ends, owner = _edges(blocks)
    if not len(starts):
        raise InvalidStructure("there are no blocks to assemble: give at least one")
    near = TOUCHING * float(np.linalg.norm(np.ptp(starts, axis=0)))
    steps = ends - starts
    lengths = np.linalg.norm(steps, axis=1)
    found: dict[tuple[int, int], list[Array]] = {}
    for k, (start, step, length) in enumerate(zip(starts, steps, lengths, strict=True)):
        tangent = step / length
        normal = np.array([-tangent[1], tangent[0]])
        off = np.abs([(starts - start) @ normal, (ends - start) @ normal]).max(axis=0)
        low, high = (ends - start) @ tangent, (starts - start) @ tangent  # they run against
        overlap = np.minimum(high, length) - np.maximum(low, 0.0)
        for other in np.flatnonzero((off <= near) & (overlap > 4.0 * near) & (owner > owner[k])):
            span = np.array([max(low[other], 0.0), min(high[other], length)])
            pair = (int(owner[k]), int(owner[other]))
            found.setdefault(pair, []).append(start + span[:, None] * tangent)
    return [(*pair, line) for pair in sorted(found) for line in _joined(found[pair], near)]


def _edges(blocks: Sequence[Block]) -> tuple[Array, Array, Array]:
    """Starts and ends of all straight edges (e, 2), and their blocks (e,)."""
    starts, ends, owner = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0, dtype=int)]
    for number, block in enumerate(blocks):
        straight = np.any(block.points != np.roll(block.points, -1, axis=0), axis=1)
        if block.centre is not None:
            straight[[0, 2]] = False
        starts.append(block.points[straight])
        ends.append(np.roll(block.points, -1, axis=0)[straight])
        owner.append(np.full(int(straight.sum()), number))
    return np.concatenate(starts), np.concatenate(ends), np.concatenate(owner)


def _joined(lines: list[Array], near: float) -> list[Array]:
    """Lines between two blocks, those that continue one another made one, from left to right."""
    whole: list[Array] = []
    for line in lines:
        apart = []
        for other in whole:
            if _continues(line, other, near) or _continues(other, line, near):
                line = np.array(max(((a, b) for a in line for b in other), key=_distance))
            else:
                apart.append(other)
        whole = [*apart, line]
    middles = np.array([line.mean(axis=0) for line in whole])
    order = np.argsort(middles[:, int(np.argmax(np.ptp(middles, axis=0)))], kind="stable")
    return [_turned(whole[k]) for k in order]


def _continues(line: Array, other: Array, near: float) -> bool:
    """Whether a line goes on where another ends, in the same way."""
    arm, step = other[1] - other[0], line[1] - line[0]
    bend = abs(arm[0] * step[1] - arm[1] * step[0]) / np.linalg.norm(arm)
    return bool(_distance((line[0], other[1])) <= 2.0 * near and bend <= 2.0 * near)


def _distance(ends: tuple[Array, Array]) -> float:
    return float(np.linalg.norm(ends[1] - ends[0]))


def _turned(line: Array) -> Array:
    """A line with its left end first, or where it is upright its lower one."""
    x, y = line[1] - line[0]
    forward = y > 0.0 if abs(x) <= UPRIGHT * abs(y) else x > 0.0
    return line if forward else line[::-1]


def _owner(a: Block, b: Block, line: Array, ways: Mapping[str, Direction]) -> Block:
    """The one of two blocks to whose part the joint between them belongs."""
    if a.fixed != b.fixed:
        return b if a.fixed else a
    rank = {"other": 0, "ring": 1, "pier": 2}
    for block, other in ((a, b), (b, a)):
        way = ways.get(block.part)
        if way is not None and other.role != block.role and way.separates(line):
            below = other.centroid[1] < line[:, 1].mean()
            if block.role == "ring" or (other.role == "other" and below):
                return block
    return min((b, a), key=lambda block: rank[block.role])


def _joint(pair: tuple[int, int], ends: Array, contact: Contact, owner: Block) -> Joint:
    """A joint of its owner's part, still without a name."""
    (x0, y0), (x1, y1) = ends.tolist()
    return Joint(pair, (x0, y0), (x1, y1), contact, "", owner.part, owner.role)


def _counted(
    joints: Sequence[Joint], part: str, way: Direction, blocks: Sequence[Block]
) -> list[Joint]:
    """Joints across a row in their order along it, from inside outwards, and with their names."""
    ordered = sorted(joints, key=lambda joint: way.along(joint.middle))
    words = [f"joint {k}" for k in range(len(ordered))]
    if ordered and ordered[0].role == "pier":
        ordered.sort(key=lambda joint: not _is_foot(joint, blocks))
        feet = sum(_is_foot(joint, blocks) for joint in ordered)
        words = [f"base {k + 1}" for k in range(feet)] if feet > 1 else ["base"]
        words += [f"joint {k + 1}" for k in range(len(ordered))]
    found = []
    for joint, word in zip(ordered, words, strict=False):
        inner, outer = joint.intrados, joint.extrados
        if joint.tangent @ way.outward(joint.middle) < 0.0:
            inner, outer = outer, inner
        name = f"{part}, {word}" if part else word
        found.append(replace(joint, intrados=inner, extrados=outer, name=name))
    return found


def _is_foot(joint: Joint, blocks: Sequence[Block]) -> bool:
    return any(blocks[number].fixed for number in joint.blocks)


def _named(joints: Sequence[Joint], blocks: Sequence[Block]) -> list[Joint]:
    """Joints with names made of those of their blocks, numbered where two have several."""
    pairs = [joint.blocks for joint in joints]
    found = []
    for k, joint in enumerate(joints):
        words = " to ".join(blocks[number].name for number in joint.blocks)
        if pairs.count(joint.blocks) > 1:
            words += f", {pairs[: k + 1].count(joint.blocks)}"
        found.append(replace(joint, name=words))
    return found
