"""Chipped corners beside joints, which are no errors of a survey, and joints drawn open."""

import numpy as np
import pytest
from drawn import geojson, square

import archfem as af

BASE = [[0, -1], [1, -1], [1, 0], [0, 0]]


def read(folder, stones, snap=0.014):
    return af.read_outlines(geojson(folder / "a.geojson", stones), snap=snap)


@pytest.mark.parametrize(
    ("along", "across"), [(0.06, 0.05), (0.04, 0.08), (0.025, 0.025), (0.12, 0.1), (0.3, 0.06)]
)
@pytest.mark.parametrize("error", [0.0, 0.003])
def test_a_chipped_corner_shortens_its_joint(tmp_path, along, across, error):
    """The size of the chip does not matter; errors of the survey change it by as much."""
    chipped = [[0, 0], [1 - along, 0], [1, across], [1, 1], [0, 1]]
    chance = np.random.default_rng(3)
    stones = {
        name: (np.array(points) + chance.uniform(-error, error, np.shape(points))).tolist()
        for name, points in {"base": BASE, "stone": chipped}.items()
    }
    survey = read(tmp_path, stones)
    ((stone, other, *lengths),) = survey.chips
    assert (stone, other) == ("stone", "base")
    assert lengths == pytest.approx([along, across, 1.0 - along], abs=3.0 * error + 1e-9)
    (joint,) = af.masonry.surveyed(tmp_path / "a.geojson", snap=0.014).joints
    assert joint.depth == pytest.approx(1.0 - along, abs=3.0 * error + 1e-9)
    assert "chipped: 'stone' by " in str(survey)


def test_a_chip_is_said_in_the_unit_of_the_drawing(tmp_path):
    survey = read(tmp_path, {"base": BASE, "stone": [[0, 0], [0.94, 0], [1, 0.05], [1, 1], [0, 1]]})
    assert str(survey).endswith(
        ";\n  chipped: 'stone' by 0.06 m along and 0.05 m across its joint with 'base', which "
        "touches along 0.94 m of 1 m"
    )


def test_chips_of_ragged_cuts_of_both_stones_and_between_three(tmp_path):
    ragged = [[0, 0], [0.94, 0], [0.96, 0.03], [1, 0.05], [1, 1], [0, 1]]
    assert read(tmp_path, {"base": BASE, "stone": ragged}).chips[0][2:4] == pytest.approx(
        [0.06, 0.05]
    )
    both = {
        "base": [[0, -1], [1, -1], [1, -0.03], [0.97, 0], [0, 0]],
        "stone": [[0, 0], [0.97, 0], [1, 0.03], [1, 1], [0, 1]],
    }
    assert {each[:2] for each in read(tmp_path, both).chips} == {
        ("base", "stone"),
        ("stone", "base"),
    }
    bond = {
        "base": [[0, -1], [2, -1], [2, 0], [0, 0]],
        "left": [[0, 0], [1, 0], [1, 0.95], [0.94, 1], [0, 1]],
        "right": square(1, 0),
        "top": [[0, 1], [2, 1], [2, 2], [0, 2]],
    }
    found = read(tmp_path, bond).chips
    assert {each[:2] for each in found} == {("left", "right"), ("left", "top")}


@pytest.mark.parametrize(
    "stone",
    [
        [[0, 0], [1, 0.05], [1, 1], [0, 1]],  # touches at a corner alone
        [[0, 0], [0.4, 0], [1, 0.05], [1, 1], [0, 1]],  # and along less than half
        [[0, 0.03], [1, 0.03], [1, 1], [0, 1]],  # nowhere
    ],
)
def test_faces_that_touch_along_less_than_half_are_errors(tmp_path, stone):
    with pytest.raises(af.InvalidStructure, match=r"taken for an error of the survey"):
        read(tmp_path, {"base": BASE, "stone": stone})


def test_a_gap_beside_a_whole_face_is_an_error(tmp_path):
    """A stone on the step of another touches its tread along 0.97 m, and not its riser."""
    step = [[0, -1], [2, -1], [2, 1], [1, 1], [1, 0], [0, 0]]
    stone = [[0, 0], [0.97, 0], [0.97, 1], [0, 1]]
    with pytest.raises(af.InvalidStructure, match=r"30 mm apart"):
        read(tmp_path, {"step": step, "stone": stone})


def test_whole_stones_have_no_chips(viaduct, tmp_path):
    arch = af.circular_arch(radius=2.0, embrace=180.0, thickness=0.3, voussoirs=3)
    for structure in (viaduct, arch):
        af.masonry.write_outlines(structure, tmp_path / "whole.geojson")
        found = af.read_outlines(tmp_path / "whole.geojson")
        assert (found.chips, found.closed) == ((), ())


@pytest.mark.parametrize("gap", [0.005, 0.0011])
def test_joints_drawn_open_are_named_with_their_gap(tmp_path, gap):
    stones = {"base": BASE, "stone": square(0, gap), "top": square(0, 1.0005 + gap)}
    found = read(tmp_path, stones)
    assert [each[:2] for each in found.closed] == [("base", "stone")]  # 0.5 mm is said of none
    assert found.closed[0][2] == pytest.approx(gap)
    assert "closed by snap: 1 joint, drawn open by more than 0.001 m, " in str(found)
    overlap = {"base": BASE, "stone": square(0, -gap)}
    assert read(tmp_path, overlap).closed == ()
