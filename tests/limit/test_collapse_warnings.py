"""Warnings of limit analysis: on made-up joints, at the bounds from which they are given."""

import logging
from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.limit import collapse, collapse_warnings


@pytest.fixture
def warned(caplog):
    """The messages logged so far, in one line."""
    with caplog.at_level(logging.WARNING, "archfem"):
        yield lambda: " ".join(caplog.messages)


@pytest.mark.parametrize(
    ("each", "said"), [((0.0, 0.0), ""), ((0.02, 0.0, 0.05), "up to 0.05,"), ((0.01,), "0.01,")]
)
def test_the_steepest_dilatancy_that_is_left_out_is_stated(each, said, warned):
    joints = [SimpleNamespace(contact=SimpleNamespace(dilatancy=value)) for value in each]
    collapse_warnings.warn_dilatancy(SimpleNamespace(joints=joints))
    assert said in warned()
    assert bool(warned()) == bool(said)


@pytest.mark.parametrize(("force", "said"), [((1e3, 0.0), False), ((0.0, 1e5), True)])
def test_a_load_that_lifts_is_named(force, said, warned):
    pier = af.column(breadth=0.6, heights=[2.4])
    af.collapse_factor(pier, live=af.PointLoad(0.1, force))
    assert ("at x = 0.1 m acts upwards by 100 kN, and lifts" in warned()) == said


def test_joints_that_slide_are_named_with_their_factor(warned):
    structure = SimpleNamespace(face_names=["a", "b", "c", "c"])  # the last of two chords
    assert not collapse_warnings.warn_sliding(structure, [], 0.3)
    assert not warned()
    assert collapse_warnings.warn_sliding(structure, [0, 2, 3], 0.31416)
    assert "joints slide (a; c)" in warned()
    assert "factor 0.3142 is" in warned()


@pytest.mark.parametrize(
    ("shear", "friction", "failing", "count"),
    [
        (23.999, 0.5, {0, 1}, 0),  # c A of the closed part 4 N, and 0.5 of 40 N
        (24.00002, 0.5, {0, 1}, 0),  # within a millionth of both parts of it
        (24.001, 0.5, {0, 1}, 2),
        (-24.001, 0.5, {0, 1}, 2),
        (24.001, 0.5, {1}, 1),  # others hold
        (24.001, np.inf, {0, 1}, 0),  # and never slide
    ],
)
def test_joints_that_hold_by_more_cohesion_than_is_closed_are_named(
    shear, friction, failing, count, warned, monkeypatch
):
    """The closed part has 40 % of 10 N of cohesion."""
    monkeypatch.setattr(
        collapse, "contact_fractions", lambda structure, normal, moment: np.full(2, 0.4)
    )
    structure = SimpleNamespace(
        cohesion=np.full(2, 10.0),
        friction=np.full(2, friction),
        joints=[SimpleNamespace(name="bed 0"), SimpleNamespace(name="bed 1")],
    )
    forces = {"N": np.full(2, 40.0), "V": np.full(2, shear), "M": np.zeros(2)}
    joints = {name: SimpleNamespace(values=values) for name, values in forces.items()}
    bounded = collapse.warn_cohesion(structure, failing, joints, 0.31416)
    assert bounded == bool(warned()) == bool(count)
    if count:
        assert warned().startswith(f"{count} joints such as 'bed {min(failing)}' fail partly open")
        assert "factor 0.3142 is" in warned()


def test_friction_none_is_doubted_where_it_locks_joints_that_carry_nothing(caplog):
    """Two stones beside each other: the joint between them is idle; a pile has none such."""
    boxes = [(0.0, 1.0), (1.0, 2.0)]
    stones = [
        af.Block([(a, 0.0), (b, 0.0), (b, 0.5), (a, 0.5)], af.STONE, f"stone {a:g}")
        for a, b in boxes
    ]
    ground = [(-1.0, -0.5), (3.0, -0.5), (3.0, 0.0), (-1.0, 0.0)]
    course = [af.Block(ground, af.STONE, "ground", fixed=True), *stones]
    beside = af.masonry.assembled(course, af.Contact(1e9, 4e8, friction=0.6))
    af.collapse_factor(beside, live=af.BodyForce(1.0), friction=None)
    assert "friction None locks" in caplog.text
    caplog.clear()
    for friction in ("coulomb", "nonassociated"):
        af.collapse_factor(beside, live=af.BodyForce(1.0), friction=friction)
    pile = af.column(breadth=1.0, heights=[1.0, 1.0])
    af.collapse_factor(pile, live=af.BodyForce(1.0), friction=None)
    assert "friction None locks" not in caplog.text
