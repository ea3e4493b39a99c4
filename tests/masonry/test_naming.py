"""Joints and blocks found by name: in lists, and in case files before anything is run."""

from pathlib import Path

import pytest

import archfem as af
from archfem.masonry.structure import find_number, join_joint_names, join_names, list_or_count

RING = Path(__file__).parents[2] / "meshes" / "ring_paper.toml"
NAMES = ["north pier, base", "main arch, joint 4", "main arch, joint 5"]


def test_by_name_and_by_number():
    assert find_number("joint", NAMES, "main arch, joint 5") == 2
    assert find_number("joint", NAMES, 2) == 2


@pytest.mark.parametrize(
    ("joint", "says"),
    [
        ("main arhc, joint 5", "did you mean 'main arch, joint 5'"),
        ("base of the north pier", "did you mean 'north pier, base'"),
        ("", "did you mean"),
        (3, "from 0 to 2, or a name such as 'north pier, base'"),
        (-1, "there is no joint -1"),
        (1.5, "there is no joint 1.5"),
    ],
)
def test_near_misses(joint, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        find_number("joint", NAMES, joint)


def test_a_case_names_joints_or_numbers_them():
    assert af.Case.read(RING, ['output.joints=["joint 5", 7]']).joints == (5, 7)
    assert af.Case.read(RING, ["output.joints=[]"]).joints == ()


@pytest.mark.parametrize(
    ("joints", "says"),
    [('["jint 5"]', "did you mean 'joint 5'"), ("[18]", "no joint 18"), ("[2.5]", "a word")],
)
def test_a_case_refuses_joints_that_are_not_there(joints, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        af.Case.read(RING, [f"output.joints={joints}"])


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["joint 5"], "joint 5"),
        (["joint 0", "joint 5", "joint 11"], "joints 0, 5 and 11"),
        (NAMES, "north pier, base; main arch, joints 4 and 5"),
        (["a, joint 1", "b, joint 1", "a, joint 2"], "a, joint 1; b, joint 1; a, joint 2"),
        (["stone 4 to fill", "bed 3"], "stone 4 to fill; bed 3"),
        (
            [f"joint {k}" for k in range(9)],
            "joints 0, 1, 2 and 3; …; joints 5, 6, 7 and 8 (9 in all)",
        ),
    ],
)
def test_joints_in_a_list(names, words):
    assert join_joint_names(names) == words


def test_a_long_list_loses_its_middle():
    assert join_names(["a", "b"]) == "a, b"
    assert list_or_count([*"abcdefghijklmnop"]).endswith("m; n; o; p (16 in all)")
    assert list_or_count([*"abcdefghijklmnopq"]) == "17 joints, drawn in the picture"
    assert join_names([*"abcdefghi"], "; ") == "a; b; c; d; …; f; g; h; i (9 in all)"
