"""Stiffness of dry joints: the published relations, ranges, and quantities that depend on them."""

import numpy as np
import pytest

import archfem as af


def test_dressed_joints_by_hand():
    """JCS = σ_c = 50 MPa at 1 MPa; softest at JRC 8, a = 0.16 mm, stiffest at 4, a = 0.08 mm."""
    expected = [
        initial * (1.0 - 1.0 / (closure * initial + 1.0)) ** -2 / mismatch
        for initial, closure, mismatch in (
            (13.10, -0.1032 - 0.0592 + 1.135 * 312.5**-0.251, 2.16),
            (12.35, -0.1032 - 0.0296 + 1.135 * 625.0**-0.251, 2.08),
        )
    ]
    low, _, high = af.joint_stiffness(30e9, 0.5, strength=50e6, stress=1e6).normal
    assert [low, high] == pytest.approx(1e9 * np.array(expected), rel=1e-12)


def test_ranges_are_ordered_and_near_the_paper():
    given = (30e9, 0.5)
    ranges = {name: af.joint_stiffness(*given, name) for name in ("dressed", "hewn", "weathered")}
    for found in ranges.values():
        for low, usual, high in (found.normal, found.shear):
            assert 0.0 < low <= usual <= high
        contact = found.contact()
        assert (contact.normal_stiffness, contact.shear_stiffness) == (
            found.normal[1],
            found.shear[1],
        )
        assert all(word in found.table() for word in ("k_n", "usual", "Bandis", "Lourenço"))
    assert ranges["weathered"].normal[0] < ranges["dressed"].normal[0]
    low, _, high = ranges["weathered"].shear
    assert low <= 0.30e9 <= high  # Demirel and Aldemir (2021)
    thrust = 21.6e3 / 0.55  # of their ring
    paper = af.joint_stiffness(*given, "weathered", stress=thrust).normal
    assert 0.5 * paper[0] <= 1.48e9 < paper[0]  # softer than rock joints that are weathered


def test_rigid_blocks_lend_their_flexibility_to_joints():
    soft, stiff = (af.joint_stiffness(5e9, 0.5, rigid=rigid) for rigid in (True, False))
    for k in range(3):
        assert 1.0 / soft.normal[k] == pytest.approx(1.0 / stiff.normal[k] + 0.5 / 5e9)
    assert af.joint_stiffness(5e9, 0.5, stress=1e6).normal > stiff.normal


def test_the_report_shows_what_depends_on_stiffness(small_ring):
    found = af.studies.stiffness_report(
        small_ring, af.joint_stiffness(30e9, 0.5), "dead load", workers=1
    )
    usual, soft, stiff, *_ = found["frequency"].values
    assert soft < usual < stiff


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((30e9, 0.5, "rough"), "condition = 'rough'"),
        ((30e9, 0.0), "spacing = 0.0 is not above 0"),
        ((-1.0, 0.5), "young = -1.0"),
    ],
)
def test_invalid_joints_are_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.joint_stiffness(*given)
    with pytest.raises(af.InvalidInput, match="not between 0 and the strength"):
        af.joint_stiffness(30e9, 0.5, stress=1e9)
