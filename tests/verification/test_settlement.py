"""Supports that move: joints follow, at every fidelity, toward limit states of rigid blocks."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem.joints.rigid_kinematics import block_motion_gaps
from archfem.masonry.structure import rigid_motion_matrix

RING = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
COUPLE = af.circular_arch(radius=2.0, thickness=0.5, embrace=120.0, voussoirs=2, chords=1)
TIGHT = af.statics.Newton(tolerance=1e-13)
FIDELITIES = ("rigid", "faces", "condensed", "full", "monolithic")


def about(structure, block, turn, shift):
    """Motion of a block that turns with the whole plane about the origin."""
    x, y = structure.blocks[block].centroid
    return (shift[0] - turn * y, shift[1] + turn * x, turn)


def differ(found, reference):
    """Largest difference of resultants, relative to the largest of each kind."""
    return max(
        float(np.abs(found[key] - reference[key]).max() / np.abs(reference[key]).max())
        for key in ("N", "V", "M")
    )


def force_on_higher(joints):
    """Force of each lower on its higher block of the couple (n_joints, 2) [N]."""
    tangents = np.array([joint.tangent for joint in COUPLE.joints])
    return joints["N"].values[:, None] * COUPLE.normals - joints["V"].values[:, None] * tangents


@cache
def at_rest(fidelity, rule):
    """The ring on its supports as they were built."""
    return af.dead_load(af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature=rule))


QUICK = [
    *(("rigid", "exact"), ("faces", "nodal"), ("condensed", "gauss")),
    *(("full", "lobatto"), ("monolithic", "lobatto")),
]
"""Each fidelity and each rule, once."""


@pytest.mark.parametrize(
    "motion",
    [
        pytest.param((-0.05, 0.0, 0.0), marks=pytest.mark.slow),
        pytest.param((0.0, 0.0, 1e-3), marks=pytest.mark.slow),
        (0.01, -0.01, 1e-3),  # both at once
    ],
)
@pytest.mark.parametrize(
    ("fidelity", "rule"),
    [
        pytest.param(*each, marks=() if each in QUICK else pytest.mark.slow)
        for each in [
            *product(("rigid", "faces", "condensed", "full"), ("exact", "lobatto")),
            ("monolithic", "lobatto"),
            *product(("rigid", "faces", "condensed"), ("nodal", "gauss")),
        ]
    ],
)
def test_supports_that_move_together_change_nothing(fidelity, rule, motion):
    """The ring moves with them, a rigid motion of everything, although its joints could slide."""
    reference = at_rest(fidelity, rule)
    moved = model = af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature=rule)
    for block in (0, len(RING.blocks) - 1):
        moved = moved.settled(af.Settlement(block, about(RING, block, motion[2], motion[:2])))
    found = af.dead_load(moved)
    assert differ(found.joints, reference.joints) < 1e-8  # round-off of 5 cm against µm
    gap = model.cells.displacement(found.q - reference.q)
    plane = rigid_motion_matrix(model.cells.places, np.zeros(2)) @ motion
    np.testing.assert_allclose(gap, plane, atol=1e-8)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_support_forces_are_the_derivative_of_the_force(fidelity):
    """By differences, on joints that never slide, where some are open in part."""
    model = af.build(glued(RING), fidelity=fidelity, cells=(2, 2), quadrature="lobatto")
    q, motion = af.dead_load(model).q, np.zeros_like(model.support_motion)
    motion[0] = [-1.0, 0.5, 0.3]
    ahead, back = (model.with_support_motion(sign * 1e-9 * motion).force(q) for sign in (1.0, -1.0))
    pulled = model.support_forces(q, motion)
    np.testing.assert_allclose((ahead - back) / 2e-9, pulled, atol=1e-6 * np.abs(pulled).max())


@pytest.mark.parametrize(
    "settlement", [(-1.0, 0.0, 0.0), pytest.param((0.0, -1.0, 0.0), marks=pytest.mark.slow)]
)
def test_a_support_that_moves_far_at_once_leads_where_small_steps_lead(settlement):
    """Joints slide to and fro on the way, by 0.1 to 0.3 mm; 5 cm at once give the same."""
    model = af.build(RING, fidelity="rigid")
    stop = af.statics.Stop(displacement=0.05 / RING.size)
    path = af.pushover(model, af.Settlement(0, settlement), stop=stop)
    far = float(path.curve["displacement"][-1])
    once = af.dead_load(model.settled(af.Settlement(0, tuple(far * each for each in settlement))))
    last = path.joints.isel(step=-1)
    assert far > 0.05
    assert len(path.curve["step"]) > 50
    assert np.abs(last["slip"].values).max() > 1e-4
    assert differ(once.joints, last) < 1e-8
    np.testing.assert_allclose(once.joints["slip"], last["slip"], atol=1e-10)


@pytest.mark.parametrize(
    "rule",
    [
        "lobatto",
        *(pytest.param(each, marks=pytest.mark.slow) for each in ("nodal", "gauss")),
        "exact",
    ],
)
def test_condensation_and_modes_follow_as_all_nodes_do(rule):
    spread = af.Settlement("left abutment", (-2e-4, -1e-4, 1e-5))
    built = {
        fidelity: af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature=rule).settled(spread)
        for fidelity in ("condensed", "full")
    }
    found = {fidelity: af.dead_load(model, TIGHT).joints for fidelity, model in built.items()}
    assert differ(found["condensed"], found["full"]) < 1e-7


def test_nodes_of_the_support_may_move_instead_of_joints():
    """The monolithic model moves the abutment's own nodes, and has no offsets."""
    spread = af.Settlement("left abutment", (-2e-4, -1e-4, 1e-5))
    built = (
        af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature="lobatto")
        for fidelity in ("full", "monolithic")
    )
    full, slow = (af.dead_load(model.settled(spread), TIGHT).joints for model in built)
    assert differ(full, slow) < 1e-8


def test_two_blocks_on_a_support_that_sinks_a_little():
    """A micrometre, by which no point opens or closes: linear, and odd about the crown.

    The crown is sheared and not turned, and the springings carry the same weight between them.
    """
    model = af.build(COUPLE, fidelity="rigid")
    before = af.dead_load(model, TIGHT).joints[["N", "V", "M"]]
    sunk, risen = (
        af.dead_load(model.settled(af.Settlement(3, (0.0, by, 0.0))), TIGHT).joints[[*before]]
        - before
        for by in (-1e-6, 1e-6)
    )
    assert float(sunk["V"][1]) < -1.0  # the higher block, on the right, is carried by its neighbour
    for key in ("N", "V", "M"):
        np.testing.assert_allclose(sunk[key], -risen[key], atol=1e-5)
    np.testing.assert_allclose(sunk["V"], sunk["V"][::-1], atol=1e-5)
    np.testing.assert_allclose(sunk["M"], -sunk["M"][::-1], atol=1e-5)
    change = force_on_higher(sunk)
    assert change[0, 1] == pytest.approx(change[2, 1], abs=1e-5)


@pytest.mark.parametrize("rule", [pytest.param("lobatto", marks=pytest.mark.slow), "exact"])
def test_two_blocks_on_a_support_that_sinks_far_are_carried_by_three_hinges(rule):
    """Moments about the hinges alone give the thrust between the blocks, at any stiffness.

    Hinges are corners where springs end in a point; a facet is closed over a length of its own,
    and hinges where its pressure acts.
    """
    model = af.build(COUPLE, fidelity="rigid", quadrature=rule)
    joints = af.dead_load(model.settled(af.Settlement(3, (0, -0.2, 0)))).joints
    e = joints["eccentricity"].values
    assert e == pytest.approx([-0.5, -0.5, 0.5], abs=1e-6 if rule == "lobatto" else 0.03)
    left, crown, right = (
        joint.middle + each * joint.depth * joint.tangent
        for joint, each in zip(COUPLE.joints, e, strict=True)
    )
    rows, known = [], []
    for pivot, block, sign in ((left, COUPLE.blocks[1], -1.0), (right, COUPLE.blocks[2], 1.0)):
        arm = sign * (crown - pivot)
        rows.append([-arm[1], arm[0]])
        weight = block.area * block.material.unit_weight * COUPLE.width
        known.append(weight * (block.centroid[0] - pivot[0]))
    force = np.linalg.solve(rows, known)
    assert force_on_higher(joints)[1] == pytest.approx(force, rel=1e-6)


def test_the_gap_of_a_support_is_its_motion_across_the_joint():
    base = af.column(breadth=1.0, heights=[1.0])
    model = af.build(base, fidelity="rigid", quadrature="lobatto")
    gaps = block_motion_gaps(
        base, model.operator.points, np.array([[0.0, -0.02, 0.0], [0.0, 0.0, 0.0]])
    )
    np.testing.assert_allclose(gaps, [[0.02] * 9 if k == 0 else [0.0] * 9 for k in range(2)])


@pytest.mark.parametrize("scheme", [af.dynamics.Conserving(), af.dynamics.Newmark()])
def test_a_settled_ring_is_shaken(scheme):
    """The motion is too small to change forces; by Newmark's method each step has to be solved."""
    averaged = scheme == af.dynamics.Conserving()
    model = af.build(RING if averaged else glued(RING), fidelity="rigid")
    model = model.settled(af.Settlement("left abutment", (-1e-3, 0.0, 0.0)))
    start, motion = af.dead_load(model), af.Motion.synthetic(duration=0.3, pga=1e-6, seed=1)
    run = af.time_history(model, motion, start=start, scheme=scheme, dt=0.005)
    assert (run.dataset.attrs["method"] == "snes") == (not averaged)
    np.testing.assert_allclose(run.joints["N"][-1], start.joints["N"], rtol=1e-4)


def test_only_supports_settle():
    with pytest.raises(af.InvalidInput, match="cannot settle"):
        af.build(RING, fidelity="rigid").settled(af.Settlement(3, (0.0, 0.1, 0.0)))
