"""Time histories of blocks in large displacements, and their results."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from portals import box
from repeats import each_once

import archfem as af
from archfem import InvalidInput
from archfem.dynamics import State

RECORDS = Path(__file__).parents[2].parent / "shared" / "records"

SHAKE = af.Motion.synthetic(duration=1.5, pga=4.0, seed=4)

PULSE = af.Motion(np.concatenate([np.full(51, 6.9), np.zeros(50)]), 0.01)
"""0.7 g for half a second."""

DAMPED = af.StiffnessDamping(0.05, 8.0)

TIGHT = af.statics.Newton(tolerance=1e-12)


@cache
def ring(friction=0.6, stiff=1.0, stones=9):
    contact = af.Contact(1.48e9 * stiff, 0.3e9 * stiff, friction)
    return af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=stones, contact=contact
    )


@cache
def model(fidelity="rigid", friction=0.6, displacements="large", quadrature="exact"):
    return af.build(
        ring(friction),
        fidelity=fidelity,
        cells=(2, 2),
        quadrature=quadrature,
        displacements=displacements,
    )


@pytest.mark.parametrize(
    ("fidelity", "friction", "quadrature"),
    [
        ("rigid", 0.4, "nodal"),
        pytest.param("faces", 0.4, "exact", marks=pytest.mark.slow),
        ("faces", None, "nodal"),
        pytest.param("rigid", 0.4, "exact", marks=pytest.mark.slow),
        pytest.param("rigid", None, "exact", marks=pytest.mark.slow),
        pytest.param("rigid", None, "nodal", marks=pytest.mark.slow),
        pytest.param("faces", 0.4, "nodal", marks=pytest.mark.slow),
        pytest.param("faces", None, "exact", marks=pytest.mark.slow),
    ],
)
def test_small_motions_are_those_of_small_displacements(fidelity, friction, quadrature):
    """Forces and tangents at random states of 1 nm: the difference is of second order."""
    far = model(fidelity, friction, quadrature=quadrature)
    near = far.small
    q = 1e-9 * np.random.default_rng(0).normal(size=far.size)
    assert far.force(q) == pytest.approx(near.force(q), abs=1e-7 * np.abs(near.force(q)).max())
    matrix = near.tangent(q).toarray()
    assert far.tangent(q).toarray() == pytest.approx(matrix, abs=1e-7 * np.abs(matrix).max())
    expected = near.resultants(q)
    assert far.resultants(q) == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())
    moved = near.cells.displacement(q)
    assert far.cells.displacement(q) == pytest.approx(moved, abs=1e-16)


@pytest.mark.parametrize(("friction", "fidelity"), each_once((0.4, None), ("rigid", "faces")))
def test_the_tangent_is_the_derivative_far_from_rest(fidelity, friction):
    far = model(fidelity, friction)
    q = 1e-2 * np.random.default_rng(1).normal(size=far.size)
    steps = 1e-8 * np.eye(far.size)
    found = np.array([(far.force(q + s) - far.force(q - s)) / 2e-8 for s in steps]).T
    tangent = far.tangent(q).toarray()
    assert tangent == pytest.approx(found, abs=1e-6 * np.abs(tangent).max())


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow)])
def test_the_strategy_gives_the_history_of_snes(fidelity):
    """N to 1e-8 of the largest; slips, openings and rotations to 1e-9 m and rad."""
    built, brief = model(fidelity), SHAKE.cut(0.4, 0.6)
    runs = [
        af.time_history(built, brief, dt=0.005, damping=DAMPED, method=method, newton=TIGHT).joints
        for method in ("newton", "snes")
    ]
    scale = float(runs[1]["N"].max())
    assert float(np.abs(runs[0]["N"] - runs[1]["N"]).max()) < 1e-7 * scale
    for name in ("opening", "rotation", "slip"):
        assert float(np.abs(runs[0][name] - runs[1][name]).max()) < 1e-8


@pytest.mark.parametrize(("dt", "friction"), each_once((0.01, 0.002), (0.3, 0.6, None)))
def test_an_undamped_run_keeps_its_energy(friction, dt, verified):
    """To 1e-6 of the largest exchanged, at any step, with joints that hinge and slide."""
    run = af.time_history(model(friction=friction), SHAKE.scaled(1.5), dt=dt)
    assert run.dataset.attrs["energy_drift"] == pytest.approx(0.0, abs=1e-6)
    case = f"energy of an undamped ring that moves far, friction {friction}"
    off = abs(run.dataset.attrs["energy_drift"])
    verified(case, "constant", "conservation", "constant", difference=off)
    assert float(np.abs(run.joints["rotation"]).max()) > 3e-3


@pytest.mark.skipif(not RECORDS.is_dir(), reason="records are not shipped")
@pytest.mark.parametrize("friction", [0.6, pytest.param(None, marks=pytest.mark.slow)])
def test_an_undamped_run_keeps_its_energy_through_a_record(friction):
    """To 1e-6 of the largest exchanged, through 6 s of Erzincan's worst; joints turn far."""
    motion = af.Motion.read(
        RECORDS / "plain_columns" / "erzikan.txt", column=2, units="cm/s2", dt=0.005
    ).cut(0.0, 6.0)
    run = af.time_history(model(friction=friction), motion, dt=0.005)
    assert run.dataset.attrs["energy_drift"] == pytest.approx(0.0, abs=1e-6)
    assert float(np.abs(run.joints["rotation"]).max()) > 0.01


def test_a_block_let_go_swings_for_its_period(verified):
    """Housner's block 0.6 × 2.4 m from half of its angle: 2.1637 s, stiff faces 0.2 to 0.4 % more.

    A quarter of it is the time until it stands; of a rigid block that is an elliptic integral.
    """
    contact = af.Contact(1e11, 0.5e11, friction=None)
    block = af.column(breadth=0.6, heights=[2.4], contact=contact)
    built = af.build(block, fidelity="rigid", displacements="large")
    tilt, corner = -0.5 * np.arctan2(0.3, 1.2), np.array([0.3, -1.2])
    spin = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    place = corner - spin @ corner + [0.0, af.dead_load(built).q[1]]
    start = State(0.0, np.array([*place, tilt]), np.zeros(3), np.zeros(3), None)
    still = af.Motion(np.zeros(2), 0.7)
    run = af.time_history(built, still, dt=1e-3, start=start, record=af.Record(fields_every=1))
    turn, time = run.dataset["q"].values[:, 2], run.time
    k = int(np.argmax(turn >= 0.0))
    upright = np.interp(0.0, turn[k - 1 : k + 1], time[k - 1 : k + 1])
    assert 1.002 < 4.0 * upright / 2.1637 < 1.004
    case = "Housner's block from half of its angle, stiff joint: period [s]"
    verified(case, 2.1637, "elliptic integral of a rigid block", 4.0 * upright)
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-6


def test_a_ring_stands_or_falls_as_reported(tmp_path):
    """Under a pulse of 0.2 g and of 0.7 g; the saved history agrees."""
    stands = af.time_history(model(), PULSE.scaled(0.3), dt=0.005, damping=DAMPED)
    assert (stands.fall.kind, stands.fall.time, stands.fall.blocks) == ("stands", None, ())
    assert stands.verdict.outcome == "stands"
    falls = af.time_history(model(), PULSE, dt=0.005, damping=DAMPED)
    assert falls.ending == "parted"
    assert falls.fall.kind == "fallen"
    assert len(falls.fall.blocks) > 4
    assert falls.fall.time > falls.dataset.attrs["last_time"]
    poses = falls.dataset["fall_pose"]
    assert poses.sizes["block"] == len(ring().blocks)
    assert float(poses[-1, 5, 1]) < -1.0
    read = type(falls).read(falls.save(tmp_path / "falls.nc"), ring())
    assert read.fall == falls.fall


@pytest.mark.slow
def test_stones_whose_joints_never_slide_rub_once_they_are_loose():
    falls = af.time_history(model(friction=None), PULSE, dt=0.005, damping=DAMPED)
    assert falls.fall.kind == "fallen"


def test_a_column_that_still_topples_as_its_motion_ends_is_followed_to_the_ground():
    contact = af.Contact(1e10, 0.5e10, friction=0.7)
    block = af.column(breadth=0.4, heights=[2.0], contact=contact)
    built = af.build(block, fidelity="rigid", displacements="large")
    push = af.Motion(np.concatenate([np.full(42, 4.0), np.zeros(5)]), 0.01)
    run = af.time_history(built, push, dt=0.002)
    assert run.ending == "finished"
    assert run.fall.kind == "fallen"
    assert run.fall.time > push.duration


@pytest.mark.slow
def test_a_symmetric_wall_at_rest_stays_there():
    """Courses from five stones to one, on joints of which parts are open all the time."""
    blocks = [box(-9.0, -1.0, 9.0, 0.0, "ground", fixed=True, part="ground", role="other")]
    for course in range(5):
        edges, low, half = 0.3 * np.arange(6 - course), 0.3 * course, 0.15 * (5 - course)
        for left, right in pairwise(edges - half):
            lean = 0.1 * (left == -half), 0.1 * (right == half)
            top = (right - lean[1], low + 0.3), (left + lean[0], low + 0.3)
            name = f"stone {len(blocks)}"
            corners = (left, low), (right, low), *top
            blocks.append(af.Block(corners, af.STONE, name, part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1.48e9, 0.3e9, friction=0.3), width=0.4)
    built = af.build(wall, fidelity="rigid", displacements="large")
    still = af.Motion(np.zeros(5), 1.0)
    for dt in (0.0025, 0.002, 0.001):
        run = af.time_history(built, still, dt=dt, damping="effective")
        assert run.verdict.displacement < 1e-9
        assert abs(run.dataset.attrs["energy_drift"]) < 1e-9
        assert run.dataset.attrs["fallback_steps"] == 0


@pytest.mark.slow
def test_the_scale_at_which_it_falls_is_between_a_run_that_stands_and_one_that_falls():
    found = af.collapse_scale(
        model(),
        PULSE,
        damping=DAMPED,
        dt=(0.01, 0.005),
        precision=0.6,
        between=(0.3, 1.0),
    )
    assert 0.3 <= found.lower < found.upper <= 1.0
    for dt in (0.01, 0.005):
        kinds = {run.scale: run.fall.kind for run in found.searches[dt].runs}
        assert kinds[found.bracket(dt).lower] in ("stands", "dislocated")
        assert kinds[found.bracket(dt).upper] in ("partly fallen", "fallen")
    assert "stands" in found.table()


def test_models_without_large_displacements_are_refused():
    with pytest.raises(
        InvalidInput, match="large displacements do not exist with fidelity 'monolithic'"
    ):
        af.build(ring(), fidelity="monolithic", cells=(1, 1), displacements="large")
    with pytest.raises(InvalidInput, match="use one of"):
        af.build(ring(), fidelity="rigid", displacements="huge")
    glued = af.circular_arch(
        radius=2.95,
        thickness=0.55,
        embrace=159.0,
        voussoirs=5,
        contact=af.Contact(1e9, 1e9, 0.6, cohesion=1e4, tension=1e4),
    )
    with pytest.raises(InvalidInput, match="tension"):
        af.build(glued, fidelity="rigid", displacements="large")
    with pytest.raises(InvalidInput, match="displacements='large'"):
        af.collapse_scale(model(displacements="small"), SHAKE)
