"""Shear of a joint over a step, held by friction and cohesion or sliding, compiled.

At each point a spring in series with a stop holds the shear, as `law.shear_over_step`. Where faces
stretch, points slide by s + x η, η how much longer the higher face has become than the lower, and
the forces that do the work on η are Σ x_i τ̄_i.
"""

import numba
import numpy as np

from archfem.joints.moving.means import closed_means, shear_means
from archfem.joints.moving.overlap import gap_rate, lap
from archfem.joints.operator import TOUCHING


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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
        limits[point, 0] = friction * max(limits[point, 0], 0.0)
        for k in range(1, 4):
            limits[point, k] *= friction
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


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _rubbed(first, change, late, limit):  # type: ignore
    """What `shear_means` gives of a point whether it slides or not, also over no step at all."""
    trial = first + (0.5 + late) * change
    touching = change == 0.0 and abs(first) <= (1.0 + TOUCHING) * limit
    if touching or max(abs(first), abs(first + change), abs(trial)) <= limit:
        return trial, 0.0, 0.5 + late, 0.0, late * change * change
    found = shear_means(first, change, late, limit)
    if change == 0.0 and abs(first) > limit:
        return found[0], found[1], 0.0, np.sign(found[0]), found[4]
    return found


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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
    (force, rate, after), friction = found, faces.friction[joint]
    total = lost = 0.0
    for point in range(faces.first[joint], faces.first[joint + 1]):
        stiff, place = faces.shear[point], faces.place[point]
        start, end = ends[0, 1] + place * ends[0, 3], ends[1, 1] + place * ends[1, 3]
        limit = np.inf if friction == np.inf else limits[point, 0]
        first, change = stiff * (start - slid[point]), stiff * (end - start)
        shear, over, by_change, by_limit, rubbing = _rubbed(first, change, late, limit)
        total += shear
        force[3] += place * shear
        lost += rubbing / stiff
        along = stiff * by_change
        rate[1, 1] += along
        rate[1, 3] += place * along
        rate[3, 1] += place * along
        rate[3, 3] += place * place * along
        after[point] = slid[point] + over / stiff
        if by_limit != 0.0:
            for k in range(3):
                lessened = by_limit * limits[point, 1 + k]
                rate[1, k] += lessened
                rate[3, k] += place * lessened
    force[1] += total
    return total, lost
