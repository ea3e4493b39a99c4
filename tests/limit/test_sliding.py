"""Sliding along a joint without opening it, in limit analysis."""

from dataclasses import replace

import numpy as np
import pytest
from kinematics import gaps

import archfem as af

EXACT = 1e-7
"""Relative: the programme is solved to 1e-9 block weights."""

SIDEWAYS = af.BodyForce(1.0)


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**(given | changes))


def rough(friction):
    return replace(af.masonry.STONE_TO_STONE, friction=friction)


def test_sliding_without_dilatancy_is_weaker_and_hardly_dilates():
    structure = af.circular_arch(
        radius=3.0, thickness=0.6, embrace=120.0, voussoirs=15, contact=rough(0.5)
    )
    push = af.PointLoad(0.0, (-1e3, 0.0))
    upper = af.collapse_factor(structure, live=push)
    found = af.collapse_factor(structure, live=push, friction="nonassociated")
    assert found.factor < 0.95 * upper.factor
    assert found.sliding
    excess = abs(found.joints["V"]) - 0.5 * found.joints["N"]
    assert float(excess.max()) < 1e-4 * float(found.joints["N"].max())  # iteration: 1e-5
    opening_in, opening_out, slip = gaps(structure, found.motion).T
    dilation = np.minimum(opening_in, opening_out)[list(found.sliding)]
    assert np.all(dilation < 2e-3 * np.abs(slip[list(found.sliding)]))  # α = 1e-3


def test_sliding_without_dilatancy_changes_nothing_where_nothing_slides():
    plain, without = (
        af.collapse_factor(ring(), live=SIDEWAYS, friction=f).factor
        for f in ("coulomb", "nonassociated")
    )
    assert without == pytest.approx(plain, rel=EXACT)
