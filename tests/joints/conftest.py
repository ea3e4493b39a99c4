"""Joints whose state is known by construction."""

import numpy as np
import pytest
from kernels import each_way  # noqa: F401  (a fixture)

import archfem as af

DEPTH = 0.55


@pytest.fixture
def joints(ring):
    """Five steps: joint 3 hinges at the intrados, 7 slides, 11 opens, at different times."""
    resultants = np.zeros((5, 18, 3))
    resultants[..., 0] = 1000.0
    resultants[1:3, 3, 2] = -0.48 * 1000.0 * DEPTH
    resultants[2:, 7, 1] = -700.0
    resultants[2, 11] = 0.0
    resultants[2, 14, 2] = 0.47 * 1000.0 * DEPTH
    resultants[4, 14, 2] = 0.45 * 1000.0 * DEPTH
    return af.joints.joint_dataset(ring, resultants, np.arange(5) * 0.1)
