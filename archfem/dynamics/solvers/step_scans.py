"""Compiled scans of the steps of a batch: what bounds the slip of joints."""

import numpy as np

from archfem._numba import entry


@entry
def scan_shears(forces, law, lengths, middles, rows, results):  # type: ignore
    """Find V/N of joints, by how much it varies within steps, and what it lacks to its limit.

    `law` are numbers, friction, cohesion and least compression of the joints (j,). V/N and what it
    lacks are appended to `rows` (…, 2, j), which begins with steps before, as do the times
    `middles`. `results` are the variation and the margin in a step and the two before (steps, j),
    and the least margin of a step (steps,).
    """
    joints, friction, cohesion, least = law
    variation, margins, nearest = results
    for k in range(len(lengths)):
        row, nearest[k] = len(middles) - len(lengths) + k, np.inf
        for j in range(len(joints)):
            normal, shear = forces[k, joints[j], 0], forces[k, joints[j], 1]
            pressed = max(normal, least[j])
            limit = friction[j] * max(normal, 0.0) + cohesion[j]
            rows[row, 0, j], rows[row, 1, j] = shear / pressed, (limit - abs(shear)) / pressed
            margin, bend = rows[row, 1, j], 0.0
            for before in range(max(row - 2, 0), row):
                margin = min(margin, rows[before, 1, j])
            if row > 1:
                early = (rows[row - 1, 0, j] - rows[row - 2, 0, j]) / (
                    middles[row - 1] - middles[row - 2]
                )
                late = (rows[row, 0, j] - rows[row - 1, 0, j]) / (middles[row] - middles[row - 1])
                bend = 2.0 * (late - early) / (middles[row] - middles[row - 2])
            variation[k, j] = lengths[k] ** 2 * abs(bend) / 6.0
            margins[k, j] = max(margin, 0.0)
            nearest[k] = min(nearest[k], margins[k, j])


@entry
def add_drifts(rows, lengths, acceleration, near, sums):  # type: ignore
    """Add the errors of the slip by those of the velocity, and update these.

    `rows` are of the steps (…, 2, j), as of `scan_shears`, and of two before the first of them.
    `sums` are the slip's error [m] and the velocity's since the last rest [m/s] (j,). A turn
    replaces the latter: of the last one it leaves (a - μ g)/(a + μ g).
    """
    total, drift = sums
    for k in range(2, len(rows)):
        length = lengths[len(lengths) - len(rows) + k]
        for j in range(len(drift)):
            slides, before = rows[k, 1, j] < near, rows[k - 2, 1, j] < near
            if slides and before and rows[k, 0, j] * rows[k - 2, 0, j] < 0.0:
                turned = acceleration[j] * abs(rows[k, 0, j] - rows[k - 2, 0, j]) / np.sqrt(12.0)
                drift[j] = turned * length
            elif not (slides or rows[k - 1, 1, j] < near):
                drift[j] = 0.0
            total[j] += length * drift[j]
