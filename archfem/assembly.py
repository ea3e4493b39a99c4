"""From blocks to a structure: joints wherever straight edges of two blocks touch."""

from collections.abc import Callable, Sequence

import numpy as np

from archfem.criteria import part_role
from archfem.errors import InvalidStructure
from archfem.materials import Contact
from archfem.structure import TOUCHING, Array, Block, Joint, Structure
from archfem.units import G

ContactOf = Callable[[Block, Block], Contact]
"""Tells how two blocks touch."""

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
    """Make a structure of blocks, with a joint along every line on which two of them touch.

    Such a joint is named "one block to other block". Its "intrados" is its left end, or the lower
    one where it is upright. It belongs to the part of its blocks; between two parts, to that of
    the block that moves, then to one that is neither ring nor pier, then to the ring.

    Args:
        blocks: in the order they will be numbered.
        contact: of the joints found, or a function of the two blocks.
        joints: that are given already; their pairs of blocks are left alone.
        width: out of plane [m].
        gravity: acceleration of gravity [m/s²].
        name: of the structure.

    Raises:
        InvalidStructure: blocks do not hang together.
    """
    known = {frozenset(joint.blocks) for joint in joints}
    of = contact if callable(contact) else lambda *_: contact
    found = [touch for touch in touching(blocks) if frozenset(touch[:2]) not in known]
    pairs = [touch[:2] for touch in found]
    made = []
    for k, (a, b, ends) in enumerate(found):
        first, second = blocks[a], blocks[b]
        words = f"{first.name} to {second.name}"
        if pairs.count((a, b)) > 1:
            words += f", {pairs[: k + 1].count((a, b))}"
        (x0, y0), (x1, y1) = ends.tolist()
        made.append(
            Joint((a, b), (x0, y0), (x1, y1), of(first, second), words, _part(first, second))
        )
    return Structure(tuple(blocks), (*joints, *made), width, gravity, name)


def touching(blocks: Sequence[Block]) -> list[Touch]:
    """Find the straight lines along which blocks touch, back to back.

    Args:
        blocks: whose outlines may have points in the middle of a line; arcs touch nothing.
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
        straight = np.ones(len(block.points), dtype=bool)
        if block.centre is not None:
            straight[[0, 2]] = False
        starts.append(block.points[straight])
        ends.append(np.roll(block.points, -1, axis=0)[straight])
        owner.append(np.full(int(straight.sum()), number))
    return np.concatenate(starts), np.concatenate(ends), np.concatenate(owner)


def _joined(lines: list[Array], near: float) -> list[Array]:
    """Lines between two blocks, those that continue one another made one, left ends first."""
    ordered = [line if _before(line[0], line[1], near) else line[::-1] for line in lines]
    ordered.sort(key=lambda line: (line[0][0], line[0][1]))
    whole = ordered[:1]
    for line in ordered[1:]:
        arm, step = whole[-1][1] - whole[-1][0], line[1] - line[0]
        bend = abs(arm[0] * step[1] - arm[1] * step[0]) / np.linalg.norm(arm)
        if np.linalg.norm(line[0] - whole[-1][1]) <= 2.0 * near and bend <= 2.0 * near:
            whole[-1] = np.array([whole[-1][0], line[1]])
        else:
            whole.append(line)
    return whole


def _before(a: Array, b: Array, near: float) -> bool:
    """Whether a lies to the left of b, or below it on an upright line."""
    return bool(a[1] < b[1]) if abs(a[0] - b[0]) <= near else bool(a[0] < b[0])


def _part(a: Block, b: Block) -> str:
    """Part of a joint between two blocks."""
    if a.fixed != b.fixed:
        return b.part if a.fixed else a.part
    rank = {"other": 0, "ring": 1, "pier": 2}
    return min((b.part, a.part), key=lambda part: rank[part_role(part)])
