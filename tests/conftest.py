"""Structures and models that many tests use."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest

from archfem.masonry.shapes import circular_arch, column


@pytest.fixture(scope="session")
def ring():
    """The validation ring of Demirel and Aldemir (2021), Figure 3."""
    return circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)


@pytest.fixture(scope="session")
def ring_model(ring):
    """The ring with all nodes of 4 × 4 cells a voussoir."""
    from archfem.dynamics.ladder import build

    return build(ring, fidelity="full", cells=(4, 4))


@pytest.fixture(scope="session")
def stack():
    """Two square blocks on a base."""
    return column(breadth=1.0, heights=[1.0, 1.0])
