"""How points of rigid blocks move, and their joints with them."""

import numpy as np


def displacement(points, block, motion):
    """Displacements of points (k, 2) of a block whose centroid moves by (u, v, θ)."""
    arm = points - block.centroid
    return motion[:2] + motion[2] * np.column_stack([-arm[:, 1], arm[:, 0]])


def jumps(structure, motion):
    """Jumps from the lower to the higher block, at both ends of each joint (n_joints, 2, 2)."""
    return np.array(
        [
            displacement(joint.ends, structure.blocks[joint.higher], motion[joint.higher])
            - displacement(joint.ends, structure.blocks[joint.lower], motion[joint.lower])
            for joint in structure.joints
        ]
    )


def gaps(structure, motion):
    """Openings at both ends and slip of each joint (n_joints, 3)."""
    found = jumps(structure, motion)
    opening = np.einsum("jea,ja->je", found, structure.normals)
    slip = np.einsum("ja,ja->j", found.mean(axis=1), structure.tangents)
    return np.column_stack([opening, slip])
