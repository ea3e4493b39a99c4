"""Newmark's sliding block, integrated from event to event."""

from itertools import pairwise

import numpy as np


def slide(ground, dt, limit):
    """Slip relative to the ground at the end of its motion, and the way there and back [m].

    The ground's acceleration is straight between samples, so that between events the speed is a
    parabola and the slip a cubic in time: events are roots of known polynomials.

    Args:
        ground: its accelerations (n,) [m/s²].
        dt: time between samples [s].
        limit: acceleration that friction can give, μ g [m/s²].
    """
    slip = speed = path = 0.0
    for before, after in pairwise(ground):
        rate, now, left = (after - before) / dt, before, dt
        while left > 1e-14 * dt:
            way = _way(now, rate, speed, limit)
            pull, jerk = (0.0, 0.0) if way == 0.0 else (-now - way * limit, -rate)
            span = min([left, *_events(now, rate, speed, limit, way)])
            moved = span * (speed + span * (pull / 2.0 + span * jerk / 6.0))
            slip, path = slip + moved, path + abs(moved)
            speed += span * (pull + span * jerk / 2.0)
            speed = 0.0 if way == 0.0 or (span < left and abs(speed) < 1e-9) else speed
            now, left = now + rate * span, left - span
    return slip, path


def _way(ground, rate, speed, limit):
    """The way in which the block slides, or is about to: 1, -1, or 0 where it holds."""
    if speed != 0.0:
        return np.sign(speed)
    over = abs(ground) - limit
    grows = rate * np.sign(ground) > 0.0
    return (
        -np.sign(ground) if over > 1e-12 * limit or (abs(over) <= 1e-12 * limit and grows) else 0.0
    )


def _events(ground, rate, speed, limit, way):
    """Times until it begins to slide, or stops (0 or 1 of them)."""
    if way == 0.0:
        times = [(side * limit - ground) / rate for side in (-1.0, 1.0)] if rate else []
        return [time for time in times if time > 1e-12]
    roots = np.roots([-rate / 2.0, -ground - way * limit, speed])
    times = sorted(root.real for root in roots if abs(root.imag) == 0.0 and root.real > 1e-12)
    return times[:1]
