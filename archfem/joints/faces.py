"""How the two faces of a joint move relative to each other: opening, rotation and slip.

Of elastic blocks the faces do not stay plane; what is told of them is the plane nearest to the
openings at the joint's points, by least squares with the points' areas, and the mean slip. Of rigid
blocks both are exact.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.operator import JointOperator

MEASURES = {
    "opening": ("m", "largest gap between the faces, at the end that is more open; 0 where closed"),
    "rotation": ("rad", "turn of the higher face, positive where it opens the intrados"),
    "slip": ("m", "mean slip of the higher block, positive toward the extrados"),
}
"""Unit and meaning of what `measures` gives, by name."""


def face_matrix(operator: JointOperator) -> tuple[sparse.csr_matrix, Array]:
    """Return what gives gap, rotation and slip of all joints from coordinates: D q + d.

    With g and s opening and slip at the points of a joint, a their arms and w their areas,

        min Σ w (g - g_0 + θ a)²  over g_0 and θ,      s_0 = Σ w s / Σ w,

    so that θ > 0 opens the intrados, as the moment of a positive eccentricity does.

    Args:
        operator: of the joints.

    Returns:
        D (3 n_joints, n), the gaps g_0 at mid-depth first, then the rotations θ, then the slips
        s_0, and d (3 n_joints,) [m, rad, m], what supports that have moved add.
    """
    points = operator.points
    mean, turn = _means(points.joint, points.weight, points.arm, points.count)
    middle = mean - sparse.diags(mean @ points.arm) @ turn
    fit = sparse.block_diag([sparse.vstack([middle, -turn]), mean], "csr")
    matrix = fit @ sparse.vstack([operator.opening, operator.slip], "csr")
    offset = np.zeros((2, len(points.arm))) if operator.offset is None else operator.offset
    return matrix, np.asarray(fit @ offset.ravel())


def _means(
    joint: NDArray[np.intp], weight: Array, arm: Array, count: int
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Matrices (n_joints, p): weighted means over each joint, and slopes along it."""
    place = (joint, np.arange(len(joint)))
    shape = (count, len(joint))
    total = np.bincount(joint, weight, count)
    mean = sparse.csr_matrix((weight / total[joint], place), shape)
    off = arm - (mean @ arm)[joint]
    spread = np.bincount(joint, weight * off**2, count)
    steepness = np.divide(weight * off, spread[joint], np.zeros_like(off), where=spread[joint] > 0)
    return mean, sparse.csr_matrix((steepness, place), shape)


def measures(faces: Array, depth: Array) -> dict[str, Array]:
    """Return what `MEASURES` names, from gaps at mid-depth, rotations and slips.

    Args:
        faces: by `face_matrix` (…, 3, n_joints) [m, rad, m].
        depth: of the joints (n_joints,) [m].
    """
    gap, rotation, slip = np.moveaxis(faces, -2, 0)
    opening = np.maximum(gap + 0.5 * depth * np.abs(rotation), 0.0)
    return {"opening": opening, "rotation": rotation, "slip": slip}
