"""The law of a joint over the overlap of its two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½. The traction is integrated exactly over facets, or by
springs at places of a rule. With Φ = ½∫<gap>₋² dx the joint stores k_n w ℓ Φ, and the mean forces
over a step are those whose work is the change of that:

    F_g = k_n w ℓ̄ Σ f̄_i,   F_σ = -k_n w ℓ̄² Σ x_i f̄_i,
    F_s = k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i) + Σ τ̄_i,

f̄_i the means of ∫φ_i <gap>₋ dx, or of W_i <gap>₋, while the gap goes straight, bars means of both
ends; `rubbing` gives the shear τ̄, and `carrying` puts all together.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.compiled import inlined
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


@inlined
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


@inlined
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


@inlined
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


@inlined
def carried(ends, late, facet):  # type: ignore
    """Return means of ∫φ_i <gap>₋ over a step on a facet of unit length, or of <gap>₋.

    Args:
        ends: gaps of both ends at the start, and of both at the end [m].
        late: lag of damping over the length of the step, by which gaps are seen ahead [-].
        facet: whether it is one; else only its first end counts.

    Returns:
        At both ends, and derivatives of the first by the first and by the second gap at the end,
        and of the second by the second.
    """
    half = 0.5 + late
    if max(ends) <= 0.0:
        a, c, b, d = ends
        near, far = (a + b) / 12.0, (c + d) / 12.0
        if facet:
            return (2.0 * near + far, near + 2.0 * far), (half / 3.0, half / 6.0, half / 3.0)
        return (6.0 * near, 0.0), (half, 0.0, 0.0)
    if min(ends) > 0.0:
        return (0.0, 0.0), (0.0, 0.0, 0.0)
    if not facet:
        normal, _, rate, _ = point_means(ends[0], ends[2], late, 1.0 + late)
        return (normal, 0.0), (half - rate, 0.0, 0.0)
    normal, _, rates, _ = facet_means(ends, late, 1.0 + late)
    return normal, (half / 3.0 - rates[0], half / 6.0 - rates[1], half / 3.0 - rates[2])


@inlined
def slope(before, after, first, last):  # type: ignore
    """Return Δℓ/Δs over a step, and its derivative by the slip at the end.

    Args:
        before: slip at the start [m].
        after: slip at the end [m].
        first: ℓ at the start and its derivative, as by `lap`.
        last: the same at the end.
    """
    (l0, r0), (l1, r1) = first, last
    moved = after - before
    same = r0 == r1 and l0 > 0.0 and l1 > 0.0 and before * after > 0.0
    if same or abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return r1, 0.0
    slope = (l1 - l0) / moved
    return slope, (r1 - slope) / moved
