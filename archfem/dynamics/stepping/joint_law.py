"""The joint law, compiled: what closed parts of joints carry, and what tension they do not.

With all joints closed forces are linear in the gaps z. The law takes out of them the tension

    λ = J(z) z,

J block-diagonal, zero where a joint is closed: point by point, or facet by facet exactly.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.facets import Facets
from archfem.joints.operator import JointOperator


class Law(NamedTuple):
    """The joint law as the compiled loops take it.

    Attributes:
        facets: whether facets are exact.
        stiffness: of each point, that of the whole facet where facets are exact (p,) [N/m].
        arm: of each point (p,) [m].
        joint: of each point (p,).
    """

    facets: bool
    stiffness: Array
    arm: Array
    joint: Any


def law_of(joints: JointOperator) -> Law:
    """Return the law of some joints as the compiled loops take it.

    Args:
        joints: whose law is elastic without tension.
    """
    points = joints.points
    stiffness = points.weight * points.normal_stiffness
    facets = isinstance(joints.law, Facets)
    if facets:
        stiffness = np.repeat(stiffness[0::2] + stiffness[1::2], 2)
    return Law(facets, stiffness, points.arm, points.joint)


@numba.njit(cache=True)
def open_part(a, b):  # type: ignore
    """Return where a facet of unit length is open, from one place to another [-].

    Args:
        a: gap at its first end [m].
        b: gap at its second end [m]; one of both is positive.
    """
    if a > 0.0:
        return 0.0, (1.0 if b > 0.0 else a / (a - b))
    return (a / (a - b) if b > 0.0 else 1.0), 1.0


@numba.njit(cache=True)
def integrals(low, high):  # type: ignore
    """Return ∫ φ_i φ_j of the two linear functions, for (1, 1), (1, 2) and (2, 2) [-].

    Args:
        low: where the integral begins, on a facet of unit length [-].
        high: where it ends [-].
    """
    length, near, far = high - low, 1.0 - low, 1.0 - high  # no small difference of large numbers
    first = length * (near**2 + near * far + far**2) / 3.0
    second = length * (high**2 + high * low + low**2) / 3.0
    return first, 0.5 * length * (high + low) - second, second


@numba.njit(cache=True)
def pull(gap, other, stiffness, facets):  # type: ignore
    """Return λ at a point: what its closed stiffness would hold where the joint is open [N].

    Args:
        gap: at the point [m].
        other: at the other end of its facet [m]; not read where facets are not exact.
        stiffness: of the point, that of the whole facet where facets are exact [N/m].
        facets: whether facets are exact.
    """
    if not facets:
        return stiffness * max(gap, 0.0)
    if gap <= 0.0 and other <= 0.0:
        return 0.0
    low, high = open_part(gap, other)
    first, mixed, _ = integrals(low, high)
    return stiffness * (first * gap + mixed * other)


@numba.njit(cache=True)
def pulls(gap, law, force):  # type: ignore
    """Find λ at all points.

    Args:
        gap: at the points (p,) [m].
        law: `Law`.
        force: λ, filled (p,) [N].
    """
    facets, stiffness, _, _ = law
    for row in range(len(gap)):
        force[row] = pull(gap[row], gap[row ^ 1] if facets else 0.0, stiffness[row], facets)


@numba.njit(cache=True)
def closed_stiffness(gap, law, stiffness):  # type: ignore
    """Find the stiffness of the closed part of the joint at each point.

    Args:
        gap: at the points (p,) [m].
        law: `Law`.
        stiffness: of each point with itself and, where facets are exact, with the other end of its
            facet; filled (p, 2) [N/m].
    """
    whole = law.stiffness
    if not law.facets:
        for row in range(len(gap)):
            stiffness[row, 0] = whole[row] if gap[row] <= 0.0 else 0.0
        return
    for row in range(0, len(gap), 2):
        a, b, low, high = gap[row], gap[row + 1], 0.0, 1.0
        if a > 0.0 or b > 0.0:
            opens, ends = open_part(a, b)
            low, high = (ends, 1.0) if a > 0.0 else (0.0, opens)
        first, mixed, second = integrals(low, high)
        stiffness[row, 0] = whole[row] * first
        stiffness[row, 1] = stiffness[row + 1, 1] = whole[row] * mixed
        stiffness[row + 1, 0] = whole[row] * second


@numba.njit(cache=True)
def joint_resultants(result, gap, shear, law):  # type: ignore
    """Find N, V, M of every joint from the gaps at its points.

    Args:
        result: filled (n_joints, 3) [N, N, N m].
        gap: that the law sees (p,) [m].
        shear: V of every joint (n_joints,) [N].
        law: `Law`.
    """
    facets, stiffness, arm, joint = law
    result[:] = 0.0
    result[:, 1] = shear
    for row in range(len(gap)):
        carried = 0.0  # from the closed part alone, so that an open joint carries exactly nothing
        if not facets:
            carried = stiffness[row] * min(gap[row], 0.0)
        elif gap[row] <= 0.0 or gap[row ^ 1] <= 0.0:
            low, high = open_part(gap[row], gap[row ^ 1])
            first, mixed, _ = integrals(high, 1.0) if low == 0.0 else integrals(0.0, low)
            carried = stiffness[row] * (first * gap[row] + mixed * gap[row ^ 1])
        result[joint[row], 0] -= carried
        result[joint[row], 2] -= carried * arm[row]
