"""The law of a joint over the overlap of its two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½. The traction is integrated exactly over facets, or by
springs at places of a rule. With Φ = ½∫<gap>₋² dx the joint stores k_n w ℓ Φ, and the mean forces
over a step are those whose work is the change of that:

    F_g = k_n w ℓ̄ Σ f̄_i,   F_σ = -k_n w ℓ̄² Σ x_i f̄_i,
    F_s = k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i) + Σ τ̄_i,

f̄_i the means of ∫φ_i <gap>₋ dx, or of W_i <gap>₋, while the gap goes straight, bars means of both
ends; `rubbing` gives the shear τ̄.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.means import facet_means, point_means


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
        paired: whether places that touched at the start stay opposite, as nodes of a mesh do, so
            that the overlap is h (j,).
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
    paired: Any


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def lap(faces, joint, slip):  # type: ignore
    """Return the length on which the law of a joint acts, and its derivative by the slip.

    Args:
        faces: `Faces`.
        joint: its number.
        slip: between the faces [m].
    """
    if faces.paired[joint]:
        return faces.depth[joint], 0.0
    return overlap(faces.depth[joint], slip)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def press_faces(faces, joint, ends, late, force, rate, normals):  # type: ignore
    """Find the mean force of the gaps over a step, and its derivative by the measures at the end.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: measures at the start and at the end of the step (2, 4).
        late: lag of damping over the length of the step [-].
        force: on opening, slip, turn and stretch, filled (4,) [N, N, N m, N].
        rate: filled (4, 4).
        normals: of each point mean pressing force, not negative, and its derivative by opening,
            slip and turn at the end, filled for those of this joint (p, 4) [N].

    Returns:
        Energy that the lag takes [J].
    """
    first, last = lap(faces, joint, ends[0, 1]), lap(faces, joint, ends[1, 1])
    l0, (l1, shrinks) = first[0], last
    mean, turn, stiff = 0.5 * (l0 + l1), 0.5 * (ends[0, 2] + ends[1, 2]), faces.normal[joint]
    widens = 0.5 * shrinks
    total = moment = lost = 0.0
    rate[:] = 0.0  # in the rows of opening and turn, derivatives of total and moment at first
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
            by_b, by_d = gap_rate(k, x0, l1, shrinks, ends), gap_rate(k, x1, l1, shrinks, ends)
            near, far = k00 * by_b + k01 * by_d, k01 * by_b + k11 * by_d
            rate[0, k] += share * (near + far)
            rate[2, k] += share * (x0 * near + x1 * far)
            wider = widens if k == 1 else 0.0
            normals[point, 1 + k] = scale * (mean * near + wider * n0)
            if faces.facets:
                normals[point + 1, 1 + k] = scale * (mean * far + wider * n1)
    before = stored(faces, joint, l0, ends[0, 0], ends[0, 2])[0]
    after, whole, tilted = stored(faces, joint, l1, ends[1, 0], ends[1, 2])
    slope, bends = _slope(ends[0, 1], ends[1, 1], first, last)
    push = 0.5 * (before + after) - mean * turn * moment
    force[0] = stiff * mean * total
    force[1] = stiff * slope * push
    force[2], force[3] = -stiff * mean * mean * moment, 0.0
    by_phi = (whole, -shrinks * ends[1, 2] * tilted, -l1 * tilted)
    for k in range(3):
        wider, turns, tilts = widens if k == 1 else 0.0, 0.5 if k == 2 else 0.0, rate[2, k]
        rate[0, k] = stiff * (mean * rate[0, k] + wider * total)
        rate[2, k] = -stiff * mean * (mean * tilts + 2.0 * wider * moment)
        change = 0.5 * by_phi[k] - (wider * turn + mean * turns) * moment
        change -= mean * turn * tilts
        rate[1, k] = stiff * (slope * change + (bends * push if k == 1 else 0.0))
    return stiff * mean * lost


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def gap_rate(measure, place, length, shrinks, ends):  # type: ignore
    """Return the derivative of the gap at a place by a measure at the end of the step.

    Args:
        measure: 0 opening, 1 slip, 2 turn.
        place: x [-].
        length: of the overlap at the end [m].
        shrinks: its derivative by the slip [-].
        ends: measures at the start and at the end of the step (2, 3).
    """
    if measure == 0:
        return 1.0
    return -place * (shrinks * ends[1, 2] if measure == 1 else length)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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
    half = 0.5 * (first + second)
    if not facet:
        normal, _, rate, _ = point_means(ends[0], ends[2], first, second)
        return (normal, 0.0), (half - rate, 0.0, 0.0)
    normal, _, rates, _ = facet_means(ends, first, second)
    return normal, (half / 3.0 - rates[0], half / 6.0 - rates[1], half / 3.0 - rates[2])


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _slope(before, after, first, last):  # type: ignore
    """Δℓ/Δs over a step, and its derivative by the slip at the end, from ℓ and its derivatives."""
    (l0, r0), (l1, r1) = first, last
    moved = after - before
    same = r0 == r1 and l0 > 0.0 and l1 > 0.0 and before * after > 0.0
    if same or abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return r1, 0.0
    slope = (l1 - l0) / moved
    return slope, (r1 - slope) / moved
