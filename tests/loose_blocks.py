"""Boxes on a floor, and the rigid block that rocks, integrated from impact to impact."""

import numpy as np
from scipy.integrate import quad, solve_ivp

import archfem as af

G = 9.81
BREADTH, HEIGHT = 0.6, 2.4
REACH = np.hypot(BREADTH, HEIGHT) / 2.0
TILT = np.arctan(BREADTH / HEIGHT)
PULSE = np.sqrt(0.75 * G / REACH)
"""p, the rate at which the rocking block falls away from balance [1/s]."""

KEPT = 1.0 - 1.5 * np.sin(TILT) ** 2
"""Turning after an impact over that before, after Housner (1963)."""


def floor(*boxes, friction=0.6, floor=(-20.0, 60.0)):
    """Boxes (left, bottom, right, top) on a fixed floor whose top is at zero, side by side."""
    slab = _block((floor[0], -1.0, floor[1], 0.0), "floor", fixed=True, part="floor", role="other")
    blocks = [slab]
    joints = []
    for k, box in enumerate(boxes, 1):
        blocks.append(_block(box, f"block {k}", part="boxes", role="pier"))
        contact = af.Contact(1e9, 1e9, friction)
        ends = (box[0], 0.0), (box[2], 0.0)
        joints.append(af.Joint((0, k), *ends, contact, f"joint {k}", "boxes", "pier"))
    return af.Structure(tuple(blocks), tuple(joints), gravity=G)


def _block(box, name, **options):
    left, low, right, high = box
    outline = ((left, low), (right, low), (right, high), (left, high))
    return af.Block(outline, af.STONE, name, **options)


def rocking_block():
    """The block, on a floor on which it does not slide."""
    return floor((-BREADTH / 2, 0.0, BREADTH / 2, HEIGHT), friction=5.0, floor=(-4.0, 4.0))


def tilted(structure, turn, number=1):
    """Pose of all blocks with a box turned clockwise about its lower right corner, at rest."""
    start = af.dynamics.LooseBlocks.as_built(structure)
    block = structure.blocks[number]
    arm = block.centroid - block.points[1]
    c, s = np.cos(turn), np.sin(turn)
    start.poses[number] = *(np.array([[c, s], [-s, c]]) @ arm - arm), -turn
    return start


def toppling_time(breadth, height, start, end):
    """Time in which a block turns about its corner from rest beyond balance to an angle [s].

    Args:
        breadth: of the block [m].
        height: of the block [m].
        start: angle beyond balance [rad].
        end: angle from upright [rad].
    """
    rate = np.sqrt(1.5 * G / np.hypot(breadth, height))
    far = end - np.arctan(breadth / height) - start

    def slowness(root):
        return 2.0 * root / np.sqrt(2.0 * (np.cos(start) - np.cos(start + root**2)))

    return quad(slowness, 0.0, np.sqrt(far))[0] / rate


def overturns(ratio, peak, halves):
    """Whether the rocking block falls over under half sines, integrated from impact to impact.

    Args:
        ratio: circular frequency of the sine over p.
        peak: of the ground's acceleration, over g.
        halves: how many half sines.
    """
    omega = ratio * PULSE
    end, time = halves * np.pi / omega, np.arcsin(np.tan(TILT) / peak) / omega
    side, state = 1.0, [1e-14, 0.0]

    def rates(t, y):
        push = side * peak * np.sin(omega * t) * (t < end)
        return [y[1], -(PULSE**2) * (np.sin(TILT - y[0]) - push * np.cos(TILT - y[0]))]

    def lands(_, y):
        return y[0]

    def falls(_, y):
        return y[0] - 1.0

    lands.terminal = falls.terminal = True
    lands.direction = -1.0
    for _ in range(20):
        for stop in (end, 30.0):
            if time >= stop:
                continue
            events, tight = [lands, falls], {"rtol": 1e-10, "atol": 1e-12}
            found = solve_ivp(rates, (time, stop), state, "DOP853", events=events, **tight)
            time, state = found.t[-1], found.y[:, -1]
            if found.status == 1:
                break
        if len(found.t_events[1]):
            return True
        side, state = -side, [1e-14, -KEPT * state[1]]
    return False


def sine(ratio, peak, halves, dt):
    """The same half sines as a motion whose samples are at most dt apart [s]."""
    omega = ratio * PULSE
    end = halves * np.pi / omega
    steps = int(np.ceil(end / dt))
    samples = peak * G * np.sin(omega * end / steps * np.arange(steps + 1))
    return af.Motion(samples, end / steps)
