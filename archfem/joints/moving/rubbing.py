"""Shear of a joint over a step, held by friction and cohesion or sliding, compiled.

At each point a spring in series with a stop holds the shear, as `law.shear_over_step`. Where faces
stretch, points slide by s + x η, η how much longer the higher face has become than the lower, and
the forces that do the work on η are Σ x_i τ̄_i.
"""

import numba
import numpy as np

from archfem.joints.moving.means import closed_means
from archfem.joints.moving.overlap import gap_rate, lap
from archfem.joints.operator import TOUCHING


@numba.njit(cache=True)
def limit_faces(faces, joint, ends, late, limits):  # type: ignore
    """Turn the pressing forces of a joint over a step into Coulomb's limits, μ N + c A.

    A is the mean area on which a facet is closed, shared among its ends.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 4).
        late: lag of damping over the length of the step [-].
        limits: pressing forces as `press_faces` fills them, made limits (p, 4) [N].
    """
    friction, cohesion = faces.friction[joint], faces.cohesion[joint]
    if friction == np.inf:
        return
    for point in range(faces.first[joint], faces.first[joint + 1]):
        limits[point] *= friction
        limits[point, 0] = max(limits[point, 0], 0.0)
    if cohesion == 0.0:
        return
    l0, (l1, shrinks) = (
        lap(faces, joint, ends[0, 1])[0],
        lap(faces, joint, ends[1, 1]),
    )
    mean, stride = 0.5 * (l0 + l1), 2 if faces.facets else 1
    for point in range(faces.first[joint], faces.first[joint + 1], stride):
        x0, x1 = faces.place[point], faces.place[point + stride - 1]
        a, c = ends[0, 0] - x0 * l0 * ends[0, 2], ends[0, 0] - x1 * l0 * ends[0, 2]
        b, d = ends[1, 0] - x0 * l1 * ends[1, 2], ends[1, 0] - x1 * l1 * ends[1, 2]
        lagged = (a + late * (b - a), c + late * (d - c), b + late * (b - a), d + late * (d - c))
        (near, far), (k00, k01, k11) = closed_means(lagged, late, 1.0 + late, faces.facets)
        scale = cohesion * faces.share[point]
        limits[point, 0] += scale * mean * near
        if faces.facets:
            limits[point + 1, 0] += scale * mean * far
        for k in range(3):
            by_b, by_d = gap_rate(k, x0, l1, shrinks, ends), gap_rate(k, x1, l1, shrinks, ends)
            wider = 0.5 * shrinks if k == 1 else 0.0
            limits[point, 1 + k] += scale * (mean * (k00 * by_b + k01 * by_d) + wider * near)
            if faces.facets:
                closing = mean * (k01 * by_b + k11 * by_d) + wider * far
                limits[point + 1, 1 + k] += scale * closing


@numba.njit(cache=True)
def rub(first, change, late, limit, found):  # type: ignore
    """Find the mean shear of a point over a step, as `law.shear_over_step`.

    Args:
        first: elastic shear at the start [N].
        change: of it, if the point did not slide [N].
        late: lag of damping over the length of the step [-].
        limit: Coulomb's [N].
        found: mean shear [N], what friction has not held at the end [N], derivatives of the mean
            by the change and by the limit [-], and loss times the stiffness [N²], filled (5,).
    """
    trial = first + (0.5 + late) * change
    touching = change == 0.0 and abs(first) <= (1.0 + TOUCHING) * limit
    if touching or max(abs(first), abs(first + change), abs(trial)) <= limit:
        found[0], found[1], found[2], found[3] = trial, 0.0, 0.5 + late, 0.0
        found[4] = late * change * change
        return
    start = min(max(first, -limit), limit)
    last = min(max(start + change, -limit), limit)
    over = start + change - last
    slid = min(max(over / change, 0.0), 1.0) if over != 0.0 and change != 0.0 else 0.0
    mean = start + 0.5 * change - 0.5 * over * slid
    shear = min(max(mean + late * change, -limit), limit)
    found[0], found[1] = shear, first + change - last
    if abs(mean + late * change) > limit or (change == 0.0 and abs(first) > limit):
        found[2], found[3] = 0.0, np.sign(shear)
    else:
        lost = np.sign(first) if abs(first) > limit else 0.0
        found[2] = 0.5 * (1.0 - slid) ** 2 + late
        found[3] = (1.0 - slid) * lost + slid * np.sign(change)
    found[4] = 0.5 * (first**2 - start**2) + abs(over) * limit + (shear - mean) * change


@numba.njit(cache=True)
def rub_faces(faces, joint, ends, late, limits, slid, found):  # type: ignore
    """Add the shear of a joint over a step, and what its points remember at the end.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: opening, slip, turn and stretch at the start and at the end of the step (2, 4).
        late: lag of damping over the length of the step [-].
        limits: Coulomb's, as `limit_faces` leaves them (p, 4) [N].
        slid: how far each point has slid for good before (p,) [m].
        found: force on the four measures (4,) [N, N, N m, N], and its derivative by the measures at
            the end (4, 4), both added to; `slid` at the end, filled for this joint (p,) [m].

    Returns:
        The mean shear [N], and the energy that friction and the lag take [J].
    """
    (force, rate, after), friction, own = found, faces.friction[joint], np.empty(5)
    total = lost = 0.0
    for point in range(faces.first[joint], faces.first[joint + 1]):
        stiff, place = faces.shear[point], faces.place[point]
        start, end = ends[0, 1] + place * ends[0, 3], ends[1, 1] + place * ends[1, 3]
        limit = np.inf if friction == np.inf else limits[point, 0]
        rub(stiff * (start - slid[point]), stiff * (end - start), late, limit, own)
        total += own[0]
        force[3] += place * own[0]
        lost += own[4] / stiff
        along = stiff * own[2]
        rate[1, 1] += along
        rate[1, 3] += place * along
        rate[3, 1] += place * along
        rate[3, 3] += place * place * along
        after[point] = slid[point] + own[1] / stiff
        if own[3] != 0.0:
            for k in range(3):
                by_limit = own[3] * limits[point, 1 + k]
                rate[1, k] += by_limit
                rate[3, k] += place * by_limit
    force[1] += total
    return total, lost
