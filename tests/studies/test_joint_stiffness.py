"""Influence of the joint stiffness on findings."""

import archfem as af


def test_the_report_shows_what_depends_on_stiffness(small_ring):
    found = af.studies.stiffness_report(
        small_ring, af.joint_stiffness(30e9, 0.5), "dead load", workers=1
    )
    usual, soft, stiff, *_ = found["frequency"].values
    assert soft < usual < stiff
