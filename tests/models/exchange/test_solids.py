"""Faces of joints, on the outlines of the blocks that they lie on."""

import numpy as np
import pytest

import archfem as af
from archfem.models.export import Solids

ROUND_OFF = 1e-12
"""Of coordinates of some metres [m]."""


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_faces_are_where_their_edges_say(fidelity):
    """Interpolated displacements give the corners themselves, within edges or at their ends.

    In a portal, on whose piers the ring stands on a part of their heads.
    """
    portal = af.arch_on_piers(
        radius=2.0, thickness=0.4, voussoirs=5, pier_breadth=0.8, courses=[0.5, 0.5]
    )
    solids = Solids(af.build(portal, fidelity=fidelity, cells=(2, 3)))
    found = solids.joint_faces(solids.cells.places)
    ends = np.array([joint.ends for joint in portal.joints])
    assert found == pytest.approx(solids.corners, abs=ROUND_OFF)
    assert found[:, :2] == pytest.approx(ends, abs=ROUND_OFF)
    assert found[:, 2:] == pytest.approx(ends[:, ::-1], abs=ROUND_OFF)
    assert {*np.ravel(solids._anchors[1])} != {0.0, 1.0}
    owner = solids.cells.block[solids._anchors[0][:, 0]].reshape(-1, 4)
    lower, higher = portal.pairs.T
    assert (owner == np.column_stack([lower, lower, higher, higher])).all()
