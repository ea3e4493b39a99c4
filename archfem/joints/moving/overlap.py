"""The law of a joint over the overlap of its two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½. The traction is integrated exactly over facets, or by
springs at places of a rule. With Φ = ½∫<gap>₋² dx the joint stores k_n w ℓ Φ, and the mean forces
over a step are those whose work is the change of that:

    F_g = k_n w ℓ̄ Σ f̄_i,   F_σ = -k_n w ℓ̄² Σ x_i f̄_i,
    F_s = k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i) + Σ τ̄_i,

f̄_i the means of ∫φ_i <gap>₋ dx, or of W_i <gap>₋, while the gap goes straight, bars means of both
ends. At each point a spring in series with a stop holds the shear, as `law.shear_over_step`.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.means import closed_means, facet_means, point_means


class Faces(NamedTuple):
    """Of all joints, what their law needs.

    Attributes:
        depth: h (j,) [m].
        normal: k_n w (j,) [Pa].
        friction: μ, infinite where a joint never slides (j,) [-].
        first: where the points of each joint begin (j + 1,).
        place: of the points, x; of a facet its two ends in turn (p,) [-].
        share: of the depth that a point stands for, or the whole facet it is on (p,) [-].
        shear: k_s times the area of each point (p,) [N/m].
        facets: whether points are ends of facets, not springs.
        cohesion: c w, which adds to friction where a joint is closed (j,) [N/m].
    """

    depth: Array
    normal: Array
    friction: Array
    first: Any
    place: Array
    share: Array
    shear: Array
    facets: bool
    cohesion: Array


@numba.njit(cache=True)
def overlap(depth, slip):  # type: ignore
    """Return the length on which the faces overlap, and its derivative by the slip.

    Args:
        depth: of the faces [m].
        slip: between them [m].
    """
    length = depth - abs(slip)
    if length <= 0.0:
        return 0.0, 0.0
    return length, -np.sign(slip)


@numba.njit(cache=True)
def stored(faces, joint, length, opening, turn):  # type: ignore
    """Return Φ, half the mean square of the closing over the overlap, and its derivatives.

    Args:
        faces: `Faces`.
        joint: its number.
        length: of the overlap [m].
        opening: g [m].
        turn: σ [-].

    Returns:
        Φ [m²], ∫<gap>₋ dx and ∫x <gap>₋ dx [m].
    """
    if not faces.facets:
        phi = whole = tilted = 0.0
        for point in range(faces.first[joint], faces.first[joint + 1]):
            place, share = faces.place[point], faces.share[point]
            gap = min(opening - place * length * turn, 0.0)
            phi += 0.5 * share * gap * gap
            whole += share * gap
            tilted += share * place * gap
        return phi, whole, tilted
    first, last = opening + 0.5 * length * turn, opening - 0.5 * length * turn
    low, high = 0.0, 1.0
    if first > 0.0 and last > 0.0:
        return 0.0, 0.0, 0.0
    if (first <= 0.0) != (last <= 0.0):
        zero = first / (first - last)
        if first <= 0.0:
            high = zero
        else:
            low = zero
    step, a, b = last - first, high - low, 0.5 * (high**2 - low**2)
    c = (high**3 - low**3) / 3.0
    whole, tilted = first * a + step * b, first * b + step * c
    return 0.5 * (first * whole + step * tilted), whole, tilted - 0.5 * whole


@numba.njit(cache=True)
def press_faces(faces, joint, ends, late, force, rate, normals):  # type: ignore
    """Find the mean force of the gaps over a step, and its derivative by the measures at the end.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 3).
        late: lag of damping over the length of the step [-].
        force: on opening, slip and turn, filled (3,) [N, N, N m].
        rate: filled (3, 3).
        normals: of each point mean pressing force, not negative, and its derivative by opening,
            slip and turn at the end, filled for those of this joint (p, 4) [N].

    Returns:
        Energy that the lag takes [J].
    """
    (l0, _), (l1, shrinks) = (
        overlap(faces.depth[joint], ends[0, 1]),
        overlap(faces.depth[joint], ends[1, 1]),
    )
    mean, turn, stiff = 0.5 * (l0 + l1), 0.5 * (ends[0, 2] + ends[1, 2]), faces.normal[joint]
    widens = 0.5 * shrinks
    total = moment = lost = 0.0
    total_by, moment_by = np.zeros(3), np.zeros(3)
    stride = 2 if faces.facets else 1
    for point in range(faces.first[joint], faces.first[joint + 1], stride):
        x0 = faces.place[point]
        x1 = faces.place[point + stride - 1]
        a, c = ends[0, 0] - x0 * l0 * ends[0, 2], ends[0, 0] - x1 * l0 * ends[0, 2]
        b, d = ends[1, 0] - x0 * l1 * ends[1, 2], ends[1, 0] - x1 * l1 * ends[1, 2]
        lagged = (a + late * (b - a), c + late * (d - c), b + late * (b - a), d + late * (d - c))
        share = faces.share[point]
        (n0, n1), (k00, k01, k11) = _carried(lagged, late, 1.0 + late, faces.facets)
        if late > 0.0:
            p0, p1 = _carried((a, c, b, d), 0.0, 1.0, faces.facets)[0]
            lost += share * ((n0 - p0) * (b - a) + (n1 - p1) * (d - c))
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        scale = -stiff * share
        normals[point, 0] = scale * mean * n0
        if faces.facets:
            normals[point + 1, 0] = scale * mean * n1
        for k in range(3):
            by_b, by_d = _gap_rate(k, x0, l1, shrinks, ends), _gap_rate(k, x1, l1, shrinks, ends)
            near, far = k00 * by_b + k01 * by_d, k01 * by_b + k11 * by_d
            total_by[k] += share * (near + far)
            moment_by[k] += share * (x0 * near + x1 * far)
            wider = widens if k == 1 else 0.0
            normals[point, 1 + k] = scale * (mean * near + wider * n0)
            if faces.facets:
                normals[point + 1, 1 + k] = scale * (mean * far + wider * n1)
    before = stored(faces, joint, l0, ends[0, 0], ends[0, 2])[0]
    after, whole, tilted = stored(faces, joint, l1, ends[1, 0], ends[1, 2])
    slope, bends = _slope(ends[0, 1], ends[1, 1], faces.depth[joint])
    push = 0.5 * (before + after) - mean * turn * moment
    force[0] = stiff * mean * total
    force[1] = stiff * slope * push
    force[2] = -stiff * mean * mean * moment
    by_phi = (whole, -shrinks * ends[1, 2] * tilted, -l1 * tilted)
    for k in range(3):
        wider, turns = widens if k == 1 else 0.0, 0.5 if k == 2 else 0.0
        rate[0, k] = stiff * (mean * total_by[k] + wider * total)
        rate[2, k] = -stiff * mean * (mean * moment_by[k] + 2.0 * wider * moment)
        change = 0.5 * by_phi[k] - (wider * turn + mean * turns) * moment
        change -= mean * turn * moment_by[k]
        rate[1, k] = stiff * (slope * change + (bends * push if k == 1 else 0.0))
    return stiff * mean * lost


@numba.njit(cache=True)
def _gap_rate(measure, place, length, shrinks, ends):  # type: ignore
    """Derivative of the gap at a place by a measure at the end of the step."""
    if measure == 0:
        return 1.0
    return -place * (shrinks * ends[1, 2] if measure == 1 else length)


@numba.njit(cache=True)
def _carried(ends, first, second, facet):  # type: ignore
    """Mean of ∫φ_i <gap>₋ over a step on a facet of unit length, or of <gap>₋, and its derivative.

    Args:
        ends: gaps of both ends at the start, and of both at the end, of their paths [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
        facet: whether it is one.

    Returns:
        At both ends, and derivatives of the first by the first and by the second gap, and of the
        second by the second.
    """
    a, c, b, d = ends
    half = 0.5 * (first + second)
    if not facet:
        normal, _, rate, _ = point_means(a, b, first, second)
        return (normal, 0.0), (half - rate, 0.0, 0.0)
    if max(a, c, b, d) <= 0.0:
        near, far = 0.5 * (a + b), 0.5 * (c + d)
        normal = ((2.0 * near + far) / 6.0, (near + 2.0 * far) / 6.0)
        return normal, (half / 3.0, half / 6.0, half / 3.0)
    if min(a, c, b, d) > 0.0:
        return (0.0, 0.0), (0.0, 0.0, 0.0)
    normal, _, rates, _ = facet_means(ends, first, second)
    return normal, (half / 3.0 - rates[0], half / 6.0 - rates[1], half / 3.0 - rates[2])


@numba.njit(cache=True)
def _slope(before, after, depth):  # type: ignore
    """Δℓ/Δs over a step, and its derivative by the slip at the end."""
    (l0, r0), (l1, r1) = overlap(depth, before), overlap(depth, after)
    moved = after - before
    same = r0 == r1 and l0 > 0.0 and l1 > 0.0 and before * after > 0.0
    if same or abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return r1, 0.0
    slope = (l1 - l0) / moved
    return slope, (r1 - slope) / moved


@numba.njit(cache=True)
def limit_faces(faces, joint, ends, late, limits):  # type: ignore
    """Turn the pressing forces of a joint over a step into Coulomb's limits, μ N + c A.

    A is the mean area on which a facet is closed, shared among its ends.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 3).
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
        overlap(faces.depth[joint], ends[0, 1])[0],
        overlap(faces.depth[joint], ends[1, 1]),
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
            by_b, by_d = _gap_rate(k, x0, l1, shrinks, ends), _gap_rate(k, x1, l1, shrinks, ends)
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
    if max(abs(first), abs(first + change), abs(trial)) <= limit:
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
def rub_faces(faces, joint, ends, late, normals, slid, found):  # type: ignore
    """Add the shear of a joint over a step, and what its points remember at the end.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 3).
        late: lag of damping over the length of the step [-].
        normals: Coulomb's limits, as `limit_faces` leaves them (p, 4) [N].
        slid: how far each point has slid for good before (p,) [m].
        found: force on opening, slip and turn (3,) [N, N, N m], and its derivative by the measures
            at the end (3, 3), both added to; `slid` at the end, filled for this joint (p,) [m].

    Returns:
        The mean shear [N], and the energy that friction and the lag take [J].
    """
    (force, rate, after), friction, own = found, faces.friction[joint], np.empty(5)
    total = lost = 0.0
    for point in range(faces.first[joint], faces.first[joint + 1]):
        stiff = faces.shear[point]
        change = stiff * (ends[1, 1] - ends[0, 1])
        first = stiff * (ends[0, 1] - slid[point])
        limit = np.inf if friction == np.inf else normals[point, 0]
        rub(first, change, late, limit, own)
        total += own[0]
        lost += own[4] / stiff
        rate[1, 1] += stiff * own[2]
        after[point] = slid[point] + own[1] / stiff
        if own[3] != 0.0:
            for k in range(3):
                rate[1, k] += own[3] * normals[point, 1 + k]
    force[1] += total
    return total, lost
