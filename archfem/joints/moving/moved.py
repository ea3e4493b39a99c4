"""Joints of blocks that move as far as they like, over a step, compiled.

The mean forces of a step, what joints remember at its end, and the derivative by the coordinates
there: faces' poses by `poses`, measures by `frames`, the law by `overlap`. At an instant, that is
over a step that goes nowhere, forces are those of statics and twice the derivative is the tangent.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.carrying import carry
from archfem.joints.moving.compiled import computing, inlined
from archfem.joints.moving.frames import curved, follow, measures, pushed, seen
from archfem.joints.moving.overlap import Faces, lap, stored
from archfem.joints.moving.poses import Sides, gather, pose, shape, stretched, swing, swing_bend


class Moved(NamedTuple):
    """Joints between blocks that move.

    Attributes:
        sides: faces of the blocks.
        faces: what the law needs.
        angle: direction of the normals before anything moved (j,) [rad].
        hand: 1 where the extrados is on the left of the normal, -1 where it is on the right: slip,
            turn, V and M are told as positive toward the extrados (j,).
        whole: which joint of the structure each is; where faces bend one is in pieces, as the nodes
            of its mesh divide it (j,).
        aside: how far its middle lies from that of the whole, toward the extrados (j,) [m].
        wholes: number of joints of the structure.
        built: opening, slip, turn and stretch of each before anything moved, where blocks were
            placed on others that had been displaced (j, 4) [m, m, -, m].
    """

    sides: Sides
    faces: Faces
    angle: Array
    hand: Array
    whole: Any
    aside: Array
    wholes: int
    built: Array


class Answer(NamedTuple):
    """What joints do over a step, filled by `pass_joints`.

    Attributes:
        force: mean generalised forces of each joint, of the lower block's coordinates and of the
            higher's (j, 2, s).
        rate: derivative by the coordinates at the end (j, 2, s, 2, s).
        resultants: mean N, V, M of the joints of the structure (n_joints, 3) [N, N, N m].
        slid: how far each point has slid for good at the end (p,) [m].
        lost: energy that friction and the lag take (j,) [J].
        ways: which way each point slid when last looked at, 1 or -1; 0 where it held, or nobody has
            looked (p,).
        held: what `force` lacks if points held that slide the other way now (j, 2, s); `rate` is
            that of points that hold there.
    """

    force: Array
    rate: Array
    resultants: Array
    slid: Array
    lost: Array
    ways: Array
    held: Array


def answer(joints: Moved) -> Answer:
    """Return room for what joints do.

    Args:
        joints: of which.
    """
    count, size = len(joints.angle), joints.sides.shapes.shape[-1]
    return Answer(
        np.zeros((count, 2, size)),
        np.zeros((count, 2, size, 2, size)),
        np.zeros((joints.wholes, 3)),
        np.zeros(len(joints.faces.place)),
        np.zeros(count),
        np.zeros(len(joints.faces.place)),
        np.zeros((count, 2, size)),
    )


@inlined
def find_measures(joints, joint, q):  # type: ignore
    """Return opening, slip and turn of a joint, positive to the left of its normal [m, m, -].

    Args:
        joints: `Moved`.
        joint: its number.
        q: coordinates (n,).
    """
    lower, higher = pose(joints.sides, joint, 0, q), pose(joints.sides, joint, 1, q)
    return _since(joints, joint, measures(lower, higher, joints.angle[joint]))


@inlined
def _since(joints, joint, found):  # type: ignore
    """Opening, slip and turn since the joint was built stress-free."""
    built = joints.built
    return (
        found[0] + built[joint, 0],
        found[1] + built[joint, 1],
        found[2] + built[joint, 2],
    )


@numba.njit(cache=True)
def all_measures(joints, states):  # type: ignore
    """Return opening, slip and turn of the joints of the structure (k, n_joints, 3) [m, m, -].

    Slip and turn with their signs. Of a joint in pieces, the plane nearest to the openings, and the
    mean slip, as `faces.face_matrix` has them.

    Args:
        joints: `Moved`.
        states: coordinates (k, n).
    """
    found, sums = np.zeros((len(states), joints.wholes, 3)), np.empty((joints.wholes, 4))
    for k in range(len(states)):
        _all_measures(joints, states[k], sums, found[k])
    return found


@computing
def _all_measures(joints, q, sums, found):  # type: ignore
    """Find the measures in one state; sums are Σd, Σd a, Σd a² with the pieces' own, Σd a g."""
    for whole in range(joints.wholes):
        for k in range(4):
            sums[whole, k] = 0.0
    for joint in range(len(joints.angle)):
        own, hand = find_measures(joints, joint, q), joints.hand[joint]
        whole, depth, place = joints.whole[joint], joints.faces.depth[joint], joints.aside[joint]
        spread = 0.25 * depth**3
        found[whole, 0] += depth * own[0]
        found[whole, 1] += depth * hand * own[1]
        sums[whole, 0] += depth
        sums[whole, 1] += depth * place
        sums[whole, 2] += depth * place**2 + spread
        sums[whole, 3] += depth * place * own[0] - spread * hand * own[2]
    for whole in range(joints.wholes):
        total, first = sums[whole, 0], sums[whole, 1]
        middle = first / total
        turn = middle * found[whole, 0] - sums[whole, 3]
        turn /= sums[whole, 2] - middle * first
        found[whole, 0] = found[whole, 0] / total + turn * middle
        found[whole, 1] /= total
        found[whole, 2] = turn


@numba.njit(cache=True)
def paired_slips(joints, q):  # type: ignore
    """Return how far pieces have slid whose places stay opposite, over their length (j,) [-].

    Args:
        joints: `Moved`.
        q: coordinates (n,).
    """
    found, faces = np.zeros(len(joints.angle)), joints.faces
    for joint in range(len(found)):
        if faces.paired[joint]:
            found[joint] = abs(find_measures(joints, joint, q)[1]) / faces.depth[joint]
    return found


@computing
def joint_energy(joints, q, slid):  # type: ignore
    """Return the energy stored in all joints [J].

    Args:
        joints: `Moved`.
        q: coordinates (n,).
        slid: how far each point has slid for good (p,) [m].
    """
    total, faces = 0.0, joints.faces
    for joint in range(len(joints.angle)):
        found = find_measures(joints, joint, q)
        longer = joints.built[joint, 3] + stretched(joints.sides, joint, q)
        length = lap(faces, joint, found[1])[0]
        phi = stored(faces, joint, length, found[0], found[2])[0]
        total += faces.normal[joint] * length * phi
        for point in range(faces.first[joint], faces.first[joint + 1]):
            elastic = found[1] + faces.place[point] * longer - slid[point]
            total += 0.5 * faces.shear[point] * elastic**2
    return total


@numba.njit(cache=True)
def pass_joints(joints, before, after, late, slid, found):  # type: ignore
    """Find what joints do over a step.

    Args:
        joints: `Moved`.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        late: lag of damping over the length of the step [-].
        slid: how far each point has slid for good before (p,) [m].
        found: `Answer`, filled.
    """
    longer = np.empty((2, 2, joints.sides.stretch.shape[2]))
    found.resultants[:] = 0.0
    for joint in range(len(joints.angle)):
        _pass(joints, joint, (before, after), late, slid, longer, found)


@inlined
def _pass(joints, joint, states, late, slid, room, found):  # type: ignore
    """Find what a joint does over a step."""
    sides, faces, (before, after) = joints.sides, joints.faces, states
    first, swings, ways = swing(sides, joint, 0, before, after)
    second, others, more = swing(sides, joint, 1, before, after)
    start, end, rates, now, step = follow(first, second, joints.angle[joint])
    longer = joints.built[joint, 3]
    stretch = longer + stretched(sides, joint, before), longer + stretched(sides, joint, after)
    ends = _since(joints, joint, start), _since(joints, joint, end), stretch
    memory = slid, found.slid, found.ways
    force, law, lengthens, (shear, found.lost[joint], missing) = carry(
        faces, joint, ends, late, memory
    )
    whole, hand = joints.whole[joint], joints.hand[joint]
    found.resultants[whole, 0] -= force[0]
    found.resultants[whole, 1] += hand * shear
    found.resultants[whole, 2] += hand * force[2] - joints.aside[joint] * force[0]
    x, y, low, high = pushed(rates, force)
    gather(sides, joint, 0, ways[0], (-x, -y, low), found.force[joint, 0])
    gather(sides, joint, 1, more[0], (x, y, high), found.force[joint, 1])
    _hold(sides, joint, (ways[0], more[0]), pushed(rates, (0.0, missing[0], 0.0)), found.held)
    force = force[0], force[1] + missing[0], force[2], force[3]
    x, y, low, high = pushed(rates, force)
    _spread(sides, joint, (ways, more), curved(step, rates, now, force, law), found.rate)
    if sides.turns[joint, 0]:
        swing_bend(sides, joint, 0, swings, (-x, -y, low), found.rate)
    if sides.turns[joint, 1]:
        swing_bend(sides, joint, 1, others, (x, y, high), found.rate)
    if sides.stretch.shape[2] > 0:
        by_all, of_all = seen(now, law[3]), pushed(rates, (0.0, lengthens[0], 0.0))
        _pulls(sides, joint, ((ways[1], more[1]), (ways[0], more[0])), (by_all, of_all), room)
        _stretch(sides, joint, (force[3], missing[1], lengthens[1]), room, found)


@computing
def _hold(sides, joint, ways, push, held):  # type: ignore
    """Write down what the forces lack of points that should hold."""
    x, y, low, high = push
    gather(sides, joint, 0, ways[0], (-x, -y, low), held[joint, 0])
    gather(sides, joint, 1, ways[1], (x, y, high), held[joint, 1])


@inlined
def _spread(sides, joint, ways, curved, rate):  # type: ignore
    """Write down the derivative of the forces on both blocks by the coordinates of both."""
    (xx, xy, xa, xb), (yx, yy, ya, yb), (ax, ay, aa, ab), (bx, by, ba, bb) = curved
    (low, lower), (high, higher) = ways
    _columns(
        sides, joint, (0, 0), (low, lower), ((xx, xy, -xa), (yx, yy, -ya), (-ax, -ay, aa)), rate
    )
    _columns(
        sides, joint, (1, 0), (high, lower), ((-xx, -xy, xa), (-yx, -yy, ya), (-bx, -by, ba)), rate
    )
    _columns(
        sides, joint, (0, 1), (low, higher), ((-xx, -xy, -xb), (-yx, -yy, -yb), (ax, ay, ab)), rate
    )
    _columns(sides, joint, (1, 1), (high, higher), ((xx, xy, xb), (yx, yy, yb), (bx, by, bb)), rate)


@inlined
def _columns(sides, joint, where, ways, curved, rate):  # type: ignore
    """Write down the derivative of the forces on a block by the coordinates of one."""
    (side, other), (way, now), first = where, ways, 0
    (a, b, c), (d, e, f), (g, h, i) = curved
    if sides.turns[joint, other]:
        first, (x, y) = 3, now[2]
        gather(sides, joint, side, way, (a, d, g), rate[joint, side, :, other, 0])
        gather(sides, joint, side, way, (b, e, h), rate[joint, side, :, other, 1])
        third = a * x + b * y + c, d * x + e * y + f, g * x + h * y + i
        gather(sides, joint, side, way, third, rate[joint, side, :, other, 2])
    for k in range(first, sides.size[joint, other]):
        x, y, z = shape(sides, joint, other, k, now)
        push = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
        gather(sides, joint, side, way, push, rate[joint, side, :, other, k])


@computing
def _pulls(sides, joint, ways, rows, longer):  # type: ignore
    """Find how the stretch changes with all coordinates, and all forces with the stretch."""
    for end in range(2):
        x, y, low, high = rows[end]
        gather(sides, joint, 0, ways[end][0], (-x, -y, low), longer[end, 0])
        gather(sides, joint, 1, ways[end][1], (x, y, high), longer[end, 1])


@computing
def _stretch(sides, joint, law, longer, found):  # type: ignore
    """Add what the stretch of the faces does: its force, and how all forces change with it."""
    for side, sign in ((0, -1.0), (1, 1.0)):
        for k in range(sides.size[joint, side]):
            pulled = sign * sides.stretch[joint, side, k]
            found.force[joint, side, k] += law[0] * pulled
            found.held[joint, side, k] += law[1] * pulled
            for other, against in ((0, -1.0), (1, 1.0)):
                for m in range(sides.size[joint, other]):
                    more = against * sides.stretch[joint, other, m]
                    value = pulled * (longer[0, other, m] + law[2] * more)
                    found.rate[joint, side, k, other, m] += value + longer[1, side, k] * more
