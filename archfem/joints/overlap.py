"""The law of a joint over the overlap of its two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½, and the traction is integrated exactly over equal
facets. With Φ = ½∫<gap>₋² dx the joint stores k_n w ℓ Φ, and the mean forces over a step are those
whose work is the change of that:

    F_g = k_n w ℓ̄ Σ f̄_i,   F_σ = -k_n w ℓ̄² Σ x_i f̄_i,
    F_s = k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i) + Σ τ̄_i,

f̄ the means of ∫φ_i <gap>₋ dx while the gap goes straight, bars means of both ends. At each end of
a facet a spring in series with a stop holds the shear, as `law.shear_over_step`.
"""

from typing import NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.means import facet_means


class Faces(NamedTuple):
    """Of all joints, what their law needs.

    Attributes:
        depth: h (j,) [m].
        normal: k_n w (j,) [Pa].
        shear: of each point, k_s times its area (j,) [N/m].
        friction: μ, infinite where a joint never slides (j,) [-].
        facets: on each joint.
    """

    depth: Array
    normal: Array
    shear: Array
    friction: Array
    facets: int


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
def stored(length, opening, turn):  # type: ignore
    """Return Φ, half the mean square of the closing over the overlap [m²].

    Args:
        length: of the overlap [m].
        opening: g [m].
        turn: σ [-].
    """
    first, last = opening + 0.5 * length * turn, opening - 0.5 * length * turn
    low, high = min(first, last), max(first, last)
    if low >= 0.0:
        return 0.0
    if high <= 0.0:
        return (low * low + low * high + high * high) / 6.0
    return -(low**3) / (6.0 * (high - low))


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
        normals: of each end of each facet mean pressing force, not negative, and its derivative by
            opening, slip and turn at the end, filled (2 m, 4) [N].

    Returns:
        Energy that the lag takes [J].
    """
    depth, count, stiff = faces.depth[joint], faces.facets, faces.normal[joint]
    share = 1.0 / count
    (l0, r0), (l1, r1) = overlap(depth, ends[0, 1]), overlap(depth, ends[1, 1])
    mean, turn = 0.5 * (l0 + l1), 0.5 * (ends[0, 2] + ends[1, 2])
    slope, bends = _slope(ends[0, 1], ends[1, 1], (l0, l1), (r0, r1))
    total = moment = lost = 0.0
    total_by, moment_by = np.zeros(3), np.zeros(3)
    second = 1.0 + late
    for facet in range(count):
        x0 = -0.5 + facet * share
        x1 = x0 + share
        a, c = ends[0, 0] - x0 * l0 * ends[0, 2], ends[0, 0] - x1 * l0 * ends[0, 2]
        b, d = ends[1, 0] - x0 * l1 * ends[1, 2], ends[1, 0] - x1 * l1 * ends[1, 2]
        lagged = (a + late * (b - a), c + late * (d - c), b + late * (b - a), d + late * (d - c))
        normal, _, rates, _ = facet_means(lagged, late, second)
        half = 0.5 * (late + second)
        k00, k01, k11 = half / 3.0 - rates[0], half / 6.0 - rates[1], half / 3.0 - rates[2]
        if late > 0.0:
            plain = facet_means((a, c, b, d), 0.0, 1.0)[0]
            lost += (normal[0] - plain[0]) * (b - a) + (normal[1] - plain[1]) * (d - c)
        total += normal[0] + normal[1]
        moment += x0 * normal[0] + x1 * normal[1]
        for k in range(3):
            if k == 0:
                by_b = by_d = 1.0
            elif k == 1:
                by_b, by_d = -x0 * r1 * ends[1, 2], -x1 * r1 * ends[1, 2]
            else:
                by_b, by_d = -x0 * l1, -x1 * l1
            near, far = k00 * by_b + k01 * by_d, k01 * by_b + k11 * by_d
            total_by[k] += near + far
            moment_by[k] += x0 * near + x1 * far
            widens = 0.5 * r1 if k == 1 else 0.0
            factor = -stiff * share
            normals[2 * facet, 1 + k] = factor * (mean * near + widens * normal[0])
            normals[2 * facet + 1, 1 + k] = factor * (mean * far + widens * normal[1])
        normals[2 * facet, 0] = -stiff * share * mean * normal[0]
        normals[2 * facet + 1, 0] = -stiff * share * mean * normal[1]
    scale = stiff * share
    phi0 = stored(l0, ends[0, 0], ends[0, 2])
    phi1 = stored(l1, ends[1, 0], ends[1, 2])
    push = 0.5 * count * (phi0 + phi1) - mean * turn * moment
    force[0] = scale * mean * total
    force[1] = scale * slope * push
    force[2] = -scale * mean * mean * moment
    now = _gap_sums(l1, ends[1, 0], ends[1, 2])
    by_phi = (now[0], -r1 * ends[1, 2] * now[1], -l1 * now[1])
    for k in range(3):
        widens = 0.5 * r1 if k == 1 else 0.0
        turns = 0.5 if k == 2 else 0.0
        rate[0, k] = scale * (mean * total_by[k] + widens * total)
        rate[2, k] = -scale * mean * (mean * moment_by[k] + 2.0 * widens * moment)
        change = 0.5 * count * by_phi[k] - (widens * turn + mean * turns) * moment
        change -= mean * turn * moment_by[k]
        rate[1, k] = scale * (slope * change + (bends * push if k == 1 else 0.0))
    return scale * mean * lost


@numba.njit(cache=True)
def _slope(before, after, lengths, rates):  # type: ignore
    """Δℓ/Δs over a step, and its derivative by the slip at the end."""
    if rates[0] == rates[1] and lengths[0] > 0.0 and lengths[1] > 0.0 and before * after > 0.0:
        return rates[1], 0.0
    moved = after - before
    if abs(moved) < 1e-12 * (abs(before) + abs(after)) or moved == 0.0:
        return rates[1], 0.0
    slope = (lengths[1] - lengths[0]) / moved
    return slope, (rates[1] - slope) / moved


@numba.njit(cache=True)
def _gap_sums(length, opening, turn):  # type: ignore
    """∫<gap>₋ dx and ∫x <gap>₋ dx over an overlap of unit length."""
    first, last = opening + 0.5 * length * turn, opening - 0.5 * length * turn
    low, high = 0.0, 1.0
    if (first <= 0.0) != (last <= 0.0):
        zero = first / (first - last)
        if first <= 0.0:
            high = zero
        else:
            low = zero
    elif first > 0.0:
        return 0.0, 0.0
    step = last - first
    whole = first * (high - low) + 0.5 * step * (high**2 - low**2)
    tilted = 0.5 * first * (high**2 - low**2) + step * (high**3 - low**3) / 3.0
    return whole, tilted - 0.5 * whole


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
def rub_faces(faces, joint, ends, late, normals, slid, force, rate, after):  # type: ignore
    """Add the shear of a joint over a step, and what its points remember at the end.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 3).
        late: lag of damping over the length of the step [-].
        normals: as `press_faces` fills them (2 m, 4) [N].
        slid: how far each point has slid for good before (2 m,) [m].
        force: on opening, slip and turn, added to (3,) [N, N, N m].
        rate: its derivative by the measures at the end, added to (3, 3).
        after: `slid` at the end, filled (2 m,) [m].

    Returns:
        The mean shear [N], and the energy that friction and the lag take [J].
    """
    stiff, friction = faces.shear[joint], faces.friction[joint]
    change = stiff * (ends[1, 1] - ends[0, 1])
    found = np.empty(5)
    total = lost = 0.0
    for point in range(2 * faces.facets):
        first = stiff * (ends[0, 1] - slid[point])
        limit = np.inf if friction == np.inf else friction * max(normals[point, 0], 0.0)
        rub(first, change, late, limit, found)
        total += found[0]
        lost += found[4] / stiff
        rate[1, 1] += stiff * found[2]
        after[point] = slid[point] + found[1] / stiff
        if found[3] != 0.0:
            for k in range(3):
                rate[1, k] += found[3] * friction * normals[point, 1 + k]
    force[1] += total
    return total, lost
