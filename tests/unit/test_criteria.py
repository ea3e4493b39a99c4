"""Resultants and criteria on joints whose state is known by construction."""

from dataclasses import replace

import numpy as np
import pytest

from archfem.criteria import (
    counted_mechanism,
    envelope,
    failed,
    first_time,
    hinged,
    longest_duration,
    opened,
    sliding,
)
from archfem.materials import STONE_TO_STONE
from archfem.mechanism import verified_mechanism
from archfem.resultants import joint_dataset, thrust_line
from archfem.shapes import column
from archfem.summary import joint_table

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
    return joint_dataset(ring, resultants, np.arange(5) * 0.1)


def test_eccentricity_and_friction(joints):
    assert float(joints["eccentricity"][1, 3]) == pytest.approx(-0.48)
    assert float(joints["friction"][2, 7]) == pytest.approx(0.7)
    assert np.isnan(joints["eccentricity"][2, 11])
    assert np.isnan(joints["friction"][2, 11])
    assert joints["N"].attrs["units"] == "N"


def test_flags(joints):
    assert hinged(joints)[1, 3] == -1
    assert hinged(joints)[2, 14] == 1
    assert hinged(joints)[4, 14] == 0
    assert sliding(joints).sum() == 3
    assert opened(joints).sum() == 1
    assert failed(joints)[2].values.nonzero()[0].tolist() == [3, 7, 11, 14]


@pytest.mark.parametrize("share", [1.0 - 1e-9, 1.0, 1.0 + 1e-9])
def test_friction_at_its_limit_is_used_up_whatever_the_round_off(ring, share):
    normal = 1000.0 * 1.1 ** np.arange(18)  # V / N is then μ only to a few digits of the last
    resultants = np.stack([normal, 0.6 * share * normal, np.zeros(18)], axis=1)
    assert sliding(joint_dataset(ring, resultants)).all()
    resultants[:, 1] *= 1.0 - 1e-5
    assert not sliding(joint_dataset(ring, resultants)).any()


def test_a_joint_without_friction_slides_either_way():
    """A plain stack on a frictionless bed: nothing but the bed lets it move."""
    slippery = replace(STONE_TO_STONE, friction=0.0)
    stack = column(breadth=1.0, heights=[1.0], contact=slippery)
    joints = joint_dataset(stack, np.array([[1000.0, 0.0, 0.0]]))
    assert verified_mechanism(stack, joints).moved.blocks == (1,)


def test_first_times_and_durations(joints):
    first, longest = first_time(sliding(joints)), longest_duration(sliding(joints))
    assert float(first[7]) == pytest.approx(0.2)
    assert float(longest[7]) == pytest.approx(0.3)
    assert np.isnan(first[0])
    assert float(longest[0]) == 0.0
    assert float(longest_duration(hinged(joints) != 0)[3]) == pytest.approx(0.2)


def test_envelope(joints):
    span = envelope(joints)
    assert float(span["lowest"][3]) == pytest.approx(-0.48)
    assert float(span["highest"][14]) == pytest.approx(0.47)
    assert float(span["highest"][11]) == 0.0


def test_mechanism_needs_four_joints_at_once(joints):
    found = counted_mechanism(joints)
    assert found.time == pytest.approx(0.2)
    assert found.joints == (3, 7, 11, 14)
    assert counted_mechanism(joints.isel(time=[0, 1, 3, 4])) is None


def test_thrust_line_passes_the_faces_at_half(ring):
    resultants = np.zeros((18, 3))
    resultants[:, 0] = 1.0
    resultants[:9, 2], resultants[9:, 2] = 0.5 * DEPTH, -0.5 * DEPTH
    resultants[5] = 0.0
    line = thrust_line(ring, joint_dataset(ring, resultants)).values
    radii = np.hypot(*line.T)
    assert radii[:5] == pytest.approx(2.95 + DEPTH / 2)
    assert radii[9:] == pytest.approx(2.95 - DEPTH / 2)
    assert np.isnan(line[5]).all()


def test_table_says_when_and_how_long(joints):
    lines = joint_table(joints).splitlines()
    assert len(lines) == 19
    assert lines[8].split()[8:12] == ["0.200", "s", "0.300", "s"]
    assert lines[1].split()[-6:] == ["-"] * 6
