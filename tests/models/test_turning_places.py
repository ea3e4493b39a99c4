"""Points of blocks that turn: their places by complex numbers, their rates by differences."""

import numpy as np
import pytest

import archfem as af
from archfem.models.large.joints import JointSegments
from archfem.models.large.model import RotatingPoint

STEP = 1e-6
"""Of central differences: they err by STEP², and by rounding of 1e-16 / STEP."""

NEAR = 1e-8


@pytest.fixture
def point():
    """A point of a block with two modes, whose coordinates are 2 to 6 of eight."""
    shapes = np.array([[0.3, -0.2], [0.5, 0.4]])
    return RotatingPoint(2, np.array([0.7, -0.4]), shapes), np.random.default_rng(1).normal(size=8)


def slopes(function, q):
    """Derivative of a function of coordinates, a column for each."""
    columns = [
        (function(q + step) - function(q - step)) / (2.0 * STEP) for step in STEP * np.eye(len(q))
    ]
    return np.stack(columns, axis=-1)


def test_a_point_turns_with_its_block_and_strains_in_its_frame(point):
    made, q = point
    arm, strained = made.arm @ [1, 1j], (made.shapes @ q[5:7]) @ [1, 1j]
    moved = q[2:4] @ [1, 1j] + np.exp(1j * q[4]) * (arm + strained) - arm
    assert made.displacement(q) @ [1, 1j] == pytest.approx(moved, abs=1e-14)


def test_rates_of_a_point_are_its_derivatives(point):
    made, q = point
    gradient = made.gradient(q, 8).toarray()
    assert gradient == pytest.approx(slopes(made.displacement, q), abs=NEAR)
    force = np.array([2.0, -3.0])
    bent = slopes(lambda q: made.gradient(q, 8).T @ force, q)
    assert made.force_rate(q, force, 8).toarray() == pytest.approx(bent, abs=NEAR)


def test_points_of_stones_turn_and_strain_as_their_frames_do():
    """A stone is meshed inside: its corners by `RotatingPoint`, all of its places at once."""
    structure = af.column(breadth=0.4, heights=[0.8, 0.8])
    model = af.build(structure, fidelity="faces", cells=(2, 2), displacements="large")
    cells, rng = model.cells, np.random.default_rng(2)
    q = rng.normal(scale=0.3, size=model.size)
    moved = cells.displacement(q)
    assert cells.displacement(np.stack([q, 2.0 * q]))[0] == pytest.approx(moved, abs=1e-14)
    for number in structure.free:
        own = np.flatnonzero(cells.block == number)
        first = int(cells.turns[own[0]]) - 2
        arms = cells.places[own] - structure.blocks[number].centroid
        later = [b for b in structure.free if int(cells.turns[cells.block == b][0]) - 2 > first]
        end = min((int(cells.turns[cells.block == b][0]) - 2 for b in later), default=model.size)
        lift = cells.shape_functions.toarray().reshape(len(cells.places), 2, -1)[own][
            :, :, first + 3 : end
        ]
        for k in range(len(own)):
            made = RotatingPoint(first, arms[k], lift[k])
            assert moved[own[k]] == pytest.approx(made.displacement(q), abs=1e-12)
    corners = cells.corners(structure)
    assert cells.select(corners).displacement(q) == pytest.approx(moved[corners], abs=1e-12)
    places = np.concatenate([np.asarray(structure.blocks[b].points) for b in structure.free])
    assert cells.places[corners] == pytest.approx(places, abs=1e-9)


def test_faces_of_supports_turn_about_their_centroids():
    """By complex numbers: the middle of every piece goes with either block, and turns as much."""
    arch = af.circular_arch(radius=3.0, thickness=0.5, embrace=140.0, voussoirs=3, chords=1)
    joint = np.array([0, 0, 1, 2, 3])
    aside = np.array([-0.125, 0.125, 0.0, 0.1, 0.0])
    pieces = JointSegments(arch, joint, np.arange(6), aside, np.full(5, 0.25))
    poses = np.random.default_rng(3).normal(size=(len(arch.blocks), 3))
    found = pieces.fixed_poses(poses)
    for k, number in enumerate(joint):
        section = arch.joints[number]
        place = (section.middle + aside[k] * section.tangent) @ [1, 1j]
        for side, block in enumerate(section.blocks):
            centre, turn = arch.blocks[block].centroid @ [1, 1j], poses[block, 2]
            moved = centre + poses[block, :2] @ [1, 1j] + np.exp(1j * turn) * (place - centre)
            assert found[k, side, :2] @ [1, 1j] == pytest.approx(moved - place, abs=1e-14)
            assert found[k, side, 2] == turn
    assert pieces.paired.tolist() == [True, True, False, False, False]
