"""One block cut free: what its joints and its weight do must balance, with the right senses."""

from pathlib import Path

import numpy as np
import pytest

from archfem.cases.case import Case
from archfem.cases.report import write_dead
from archfem.cases.run import Rest
from archfem.dynamics.ladder import build
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.masonry.actions import BodyForce
from archfem.masonry.assembly import assembled
from archfem.masonry.materials import STONE, STONE_TO_STONE
from archfem.masonry.shapes import arch_on_piers
from archfem.masonry.structure import Block
from archfem.statics.equilibrium import dead_load, equilibrium
from archfem.statics.freebody import forces_on
from archfem.view.freebody import draw_free_body

BALANCED = 1e-9
"""Newton's method stops at 1e-10 of the load, and forces on a block are of its order."""

BRIDGE = Path(__file__).parents[2] / "meshes" / "prusias.toml"


@pytest.fixture(scope="module")
def portal():
    return arch_on_piers(
        radius=2.0, thickness=0.6, voussoirs=11, pier_breadth=0.6, courses=[0.5, 0.5]
    )


def check_balance(model, joints):
    """Forces and moments of every free block add up to nothing."""
    structure = model.structure
    for number in structure.free:
        body = forces_on(structure, joints, number, model.cells)
        reach = np.ptp(body.points, axis=0).max()
        assert body.closing_error < BALANCED, body.block.name
        assert abs(body.moment) < BALANCED * reach * body.sizes.max(), body.block.name


@pytest.mark.parametrize("rung", ["rigid", "faces", "full"])
@pytest.mark.parametrize("name", ["ring", "stack", "portal"])
def test_forces_on_every_block_balance(request, name, rung):
    model = build(request.getfixturevalue(name), fidelity=rung)
    check_balance(model, dead_load(model).joints)


def test_forces_on_every_block_of_a_bridge_balance():
    """Soil joints, skewbacks and the backfill itself included."""
    model = build(Case.read(BRIDGE).structure, fidelity="full")
    check_balance(model, dead_load(model).joints)


@pytest.mark.parametrize("tilt", [-0.1, 0.1])
def test_shear_and_moment_have_the_senses_they_are_drawn_with(portal, tilt):
    """Under a horizontal body force the joints' forces must carry it: V and M of either sign."""
    model = build(portal, fidelity="rigid")
    state = equilibrium(model, model.load(BodyForce(tilt, -1.0)))
    for number in portal.free:
        body = forces_on(portal, state.joints, number)
        weight = body.sizes[-1]
        assert body.sum == pytest.approx([-tilt * weight, 0.0], abs=BALANCED * body.sizes.max())
        assert abs(body.moment) < BALANCED * body.sizes.max()  # it acts at the centroid


def test_what_a_joint_does_to_one_block_it_does_against_the_other(ring, ring_model):
    joints = dead_load(ring_model).joints
    lower, higher = (forces_on(ring, joints, number) for number in (5, 6))
    assert lower.names == ("joint 4", "joint 5", "weight")
    assert lower.forces[1] == pytest.approx(-higher.forces[0])
    assert lower.points[1] == pytest.approx(higher.points[0])


def test_the_left_abutment_pushes_the_ring_up_and_inwards(ring, ring_model):
    push = forces_on(ring, dead_load(ring_model).joints, "voussoir 1").forces[0]
    assert push[0] > 0.0
    assert push[1] == pytest.approx(ring.weight / 2.0, rel=1e-3)  # by symmetry; chords are lighter


def test_weight_is_that_of_the_outline_or_of_the_cells(ring, ring_model):
    """Four chords to a sector of angle φ weigh 1 - (φ / 4)² / 6 of it."""
    joints = dead_load(ring_model).joints
    true, meshed = (forces_on(ring, joints, 9, s).sizes[-1] for s in (None, ring_model.cells))
    turn = np.radians(159.0 / 17)
    assert true == pytest.approx(ring.weight / 17)
    assert meshed / true == pytest.approx(1.0 - (turn / 4.0) ** 2 / 6.0, abs=1e-6)


def test_an_open_joint_acts_at_its_middle(stack):
    """Nothing presses, and shear springs still hold: they act along the joint."""
    joints = joint_dataset(stack, np.array([[3e4, 0.0, 0.0], [0.0, 500.0, 0.0]]))
    body = forces_on(stack, joints, "block 2")
    assert body.points[0] == pytest.approx(stack.joints[1].middle)
    assert body.forces[0] == pytest.approx([-500.0, 0.0])


def test_what_cannot_be_cut_free_is_refused(stack):
    joints = joint_dataset(stack, np.array([[3e4, 0.0, 0.0], [1e4, 0.0, 0.0]]))
    with pytest.raises(InvalidInput, match=r"'base' is fixed.*that can move"):
        forces_on(stack, joints, "base")
    with pytest.raises(InvalidInput, match=r"no block 'blok 1': did you mean 'block 1'"):
        forces_on(stack, joints, "blok 1")
    with pytest.raises(InvalidInput, match=r"no block 3: give a number from 0 to 2"):
        forces_on(stack, joints, 3)
    over_time = joint_dataset(stack, np.ones((4, 2, 3)), np.arange(4.0))
    with pytest.raises(InvalidInput, match=r"give one instant of the 2 joints"):
        forces_on(stack, over_time, "block 1")


def arrows(axes):
    """Tails and heads of the arrows in axes (n, 2, 2)."""
    return np.array([(each.xyann, each.xy) for each in axes.texts if hasattr(each, "xyann")])


def test_the_picture_shows_forces_where_they_act_and_a_closed_polygon(ring, ring_model):
    joints = dead_load(ring_model).joints
    figure = draw_free_body(ring, joints, "voussoir 5", cells=ring_model.cells)
    body = forces_on(ring, joints, "voussoir 5", ring_model.cells)
    left, right = figure.axes
    beside = arrows(left)
    assert beside[:-1, 1] == pytest.approx(body.points[:-1])  # joints push at their points
    assert beside[-1, 0] == pytest.approx(body.points[-1])  # the weight hangs from the centroid
    ratio = np.linalg.norm(beside[:, 1] - beside[:, 0], axis=1) / body.sizes
    assert ratio == pytest.approx(ratio[0])
    chain = arrows(right)
    assert chain[1:, 0] == pytest.approx(chain[:-1, 1])
    assert chain[-1, 1] == pytest.approx(chain[0, 0], abs=1e-6 * body.sizes.max() / 1e3)
    assert sorted(np.linalg.norm(chain[:, 1] - chain[:, 0], axis=1)) == pytest.approx(
        sorted(body.sizes / 1e3)
    )
    assert right.get_title() == f"closes to {body.closing_error:.0e} of the largest force"
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [word.split(":")[0] for word in words] == ["1  joint 4", "2  joint 5", "3  weight"]
    assert f"{body.sizes[0] / 1e3:.1f} kN" in words[0]


def test_an_open_joint_is_named_and_has_no_arrow():
    """Two stones side by side on the ground touch without a push."""

    def box(name, left, right, low, high, fixed=False):
        outline = ((left, low), (right, low), (right, high), (left, high))
        return Block(outline, STONE, name, fixed)

    stones = [box("a", 0.0, 1.0, 0.0, 1.0), box("b", 1.0, 2.0, 0.0, 1.0)]
    pair = assembled([box("ground", 0.0, 2.0, -0.3, 0.0, True), *stones], STONE_TO_STONE)
    dead = dead_load(build(pair, fidelity="rigid"))
    figure = draw_free_body(pair, dead.joints, "a")
    figure.draw_without_rendering()
    left, right = figure.axes
    assert (len(arrows(left)), len(arrows(right))) == (2, 2)  # weight and ground
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any(each.endswith("a to b: open") for each in words)


def test_a_polygon_of_too_many_forces_is_refused():
    bridge = Case.read(BRIDGE).structure
    joints = joint_dataset(bridge, np.tile([1e4, 0.0, 0.0], (len(bridge.joints), 1)))
    with pytest.raises(InvalidInput, match=r"'backfill' has \d+ joints: .* choose a stone"):
        draw_free_body(bridge, joints, "backfill")


def test_a_case_may_ask_for_a_free_body(tmp_path):
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    tables = {"structure": {**ring, "voussoirs": 9}, "output": {"free_body": "voussoir 3"}}
    for cells, more in (({"fidelity": "rigid"}, []), ({"cells": [2, 2]}, ["png", "txt"])):
        case = Case.of({**tables, "model": cells})
        dead = dead_load(build(case.structure, **case.model))
        files = [path.name for path in write_dead(Rest(case, dead), tmp_path)]
        assert files == ["dead.png", *(f"dead_stress.{kind}" for kind in more), "free_body.png"]
    assert (tmp_path / "dead_stress.txt").read_text().splitlines()[1].startswith("arch ")
