"""Eccentricity, friction and thrust line of joints whose resultants are given."""

import numpy as np
import pytest

import archfem as af
from archfem.joints import resultants as resultants_module
from archfem.joints.criteria import with_failure_flags
from archfem.joints.resultants import eccentricity_and_friction

DEPTH = 0.55


def test_eccentricity_and_friction(joints):
    assert float(joints["eccentricity"][1, 3]) == pytest.approx(-0.48)
    assert float(joints["friction"][2, 7]) == pytest.approx(0.7)
    assert np.isnan(joints["eccentricity"][2, 11])
    assert np.isnan(joints["friction"][2, 11])
    assert joints["N"].attrs["units"] == "N"


def test_thrust_line_passes_the_faces_at_half(ring):
    resultants = np.zeros((18, 3))
    resultants[:, 0] = 1.0
    resultants[:9, 2], resultants[9:, 2] = 0.5 * DEPTH, -0.5 * DEPTH
    resultants[5] = 0.0
    line = af.joints.thrust_line(ring, af.joints.joint_dataset(ring, resultants)).values
    radii = np.hypot(*line.T)
    assert radii[:5] == pytest.approx(2.95 + DEPTH / 2)
    assert radii[9:] == pytest.approx(2.95 - DEPTH / 2)
    assert np.isnan(line[5]).all()


def test_a_joint_pressed_by_the_least_of_numbers_has_no_eccentricity():
    """Its N times a depth below one half rounds to nothing, which nothing is divided by."""
    resultants = np.array([[5e-324, 0.0, 1e-3], [1e3, 100.0, 50.0]])
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        eccentricity, friction = eccentricity_and_friction(resultants, np.array([0.4, 0.5]))
    assert np.isnan([eccentricity[0], friction[0]]).all()
    assert (eccentricity[1], friction[1]) == (0.1, 0.1)


def test_the_ratios_are_the_same_however_narrow_a_structure_is():
    resultants = np.array([[1e3, 100.0, 50.0]])
    for width in (1.0, 1e-6):
        found = eccentricity_and_friction(width * resultants, np.array([0.5]))
        assert np.ravel(found) == pytest.approx([0.1, 0.1], rel=1e-12)


def test_faces_that_slid_are_judged_by_their_overlap(ring):
    """e is of the length h - |slip|, to either side; a face that has slid off has none."""
    resultants = np.tile([1000.0, 0.0, 55.0], (18, 1))
    faces = np.zeros((3, 18))
    faces[2, :3] = 0.11, -0.275, 0.6
    moved, built = (
        af.joints.joint_dataset(ring, resultants, faces=faces, moved=each)["eccentricity"].values
        for each in (True, False)
    )
    assert built == pytest.approx(0.1)
    assert moved[:2] == pytest.approx([0.055 / 0.44, 0.055 / 0.275])
    assert np.isnan(moved[2])
    assert moved[3:] == pytest.approx(0.1)


def test_a_stone_on_a_longer_base_is_judged_by_all_of_its_face():
    """Slid by 0.3 m from an edge on a base of 3 m: e, opening and bond of 1 m.

    Openings are g - θ a at a distance a from the mean middle, and its face is from -0.35 to 0.65 m.
    """
    blocks = [
        af.Block(((x, y), (x + b, y), (x + b, y + 1), (x, y + 1)), af.STONE, name, fixed=y < 0)
        for x, y, b, name in ((0.0, -1.0, 3.0, "base"), (0.0, 0.0, 1.0, "stone"))
    ]
    contact = af.Contact(1e9, 1e9, 0.2, cohesion=1e3)
    bed = af.Joint((0, 1), (0.0, 0.0), (1.0, 0.0), contact, "bed")
    structure = af.Structure(tuple(blocks), (bed,))
    resultants, faces = np.array([[1e4, 2.98e3, 500.0]]), np.array([[0.0], [-1e-3], [0.3]])
    found = af.joints.joint_dataset(structure, resultants, faces=faces, moved=True)
    assert found["eccentricity"].item() == pytest.approx(0.05)
    assert found["opening"].item() == pytest.approx(0.65e-3)
    assert found["cohesion_limit"].item() == pytest.approx(1e3)
    assert not found["slide"].item()
    # it slides by μ N + 0.99 c A, off the other edge by less
    resultants[0, 1] = 2.995e3
    assert af.joints.joint_dataset(structure, resultants, faces=faces, moved=True)["slide"].item()
    faces[2], resultants[0, 1] = -0.3, 2.8e3
    left = af.joints.joint_dataset(structure, resultants, faces=faces, moved=True)
    assert left["cohesion_limit"].item() == pytest.approx(700.0)
    assert left["slide"].item()
    again = with_failure_flags(left, af.Criteria(hinge=0.4))
    assert again["slide"].item()


def test_variables_of_a_long_record_are_those_of_its_steps(ring):
    """Eccentricity, friction, opening and flags are derived 8192 steps at a time."""
    rng, steps = np.random.default_rng(1), (0, 8191, 8192, 9999)
    resultants = rng.normal(size=(10_000, 18, 3)) * (1e4, 6e3, 2e3)
    faces = 1e-3 * rng.normal(size=(10_000, 3, 18))
    given = {"moved": True, "time": np.arange(10_000.0)}
    whole = af.joints.joint_dataset(ring, resultants, faces=faces, **given)
    assert whole["hinge"].dtype == np.int8
    for step in steps:
        alone = af.joints.joint_dataset(ring, resultants[step], faces=faces[step], moved=True)
        assert whole.isel(time=step, drop=True).identical(alone)
    assert {0, 1, -1} == set(np.unique(whole["hinge"]))
    assert whole["open"].any()
    assert whole["slide"].any()


@pytest.mark.parametrize(
    ("shape", "parts"),
    [((9, 2, 3), [4, 4, 1]), ((4, 2, 3), [4]), ((9, 3), [9])],
    ids=["a long record", "a short record", "one instant"],
)
def test_steps_are_taken_in_parts_and_joints_together(shape, parts):
    """Four steps at a time."""
    given, taken = np.random.default_rng(1).normal(size=shape), []

    def derive(some, faces):
        taken.append(len(some))
        return {"twice N": ("dims", 2.0 * some[..., 0], "attributes")}

    found = resultants_module._derive_in_parts(derive, given, None, 4)
    assert taken == parts
    dims, values, attributes = found["twice N"]
    assert (dims, attributes) == ("dims", "attributes")
    assert values.tolist() == (2.0 * given[..., 0]).tolist()
