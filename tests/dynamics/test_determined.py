"""How long histories are the same: of motions that hardly differ, and of different steppers."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import determined
from archfem.dynamics.determined import parted

DAMPED = af.StiffnessDamping(0.05, 8.0)


@pytest.fixture(scope="module")
def slender():
    """A ring of a few stones that rattles when it is not damped."""
    contact = af.Contact(1.48e10, 0.30e10, 0.6)
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 7}
    return af.build(af.circular_arch(**given, contact=contact), fidelity="rigid")


def test_in_calm_motion_nothing_grows(slender):
    motion = af.Motion.synthetic(duration=1.0, pga=0.5, seed=1)
    found = af.dynamics.predictability(slender, motion, damping=DAMPED, method="contact")
    assert found.until == np.inf
    assert found.difference < 1e-8
    assert found.text.startswith("histories stay equal to")


def test_steppers_part_when_a_nudge_says_so(slender):
    """Undamped impacts: both differ by all there is in the end, though peaks hardly do."""
    motion, given = af.Motion.synthetic(duration=2.0, pga=12.0, seed=2), {"dt": 0.005}
    nudged = af.dynamics.predictability(slender, motion, method="compliance", **given)
    runs = [af.time_history(slender, motion, method=m, **given) for m in ("contact", "compliance")]
    steppers = parted(*runs)
    assert 0.1 < nudged.until < 2.0
    assert steppers.until > 0.8 * nudged.until  # the same to a millionth as long as is promised
    assert nudged.growth > 5.0
    assert nudged.peaks < 0.05
    assert "from then on only statistics are" in nudged.text


@pytest.mark.parametrize("begun", [1e-9, 0.95e-8])
def test_growth_of_a_difference_that_is_known(slender, begun):
    """Made by hand: e-fold by e-fold, told from 1e-8 on, which the second is at the first step."""
    motion = af.Motion.synthetic(duration=1.0, pga=0.5, seed=1)
    run = af.time_history(slender, motion, dt=0.005, damping=DAMPED)
    off = begun * np.exp(20.0 * run.time)[:, None] * np.abs(run.joints["N"].values).max()
    other = af.History(run.dataset.assign(N=run.dataset["N"] + off))
    found = parted(run, other)
    assert found.growth == pytest.approx(20.0, rel=0.01)
    assert found.until == pytest.approx(np.log(1e-6 / begun) / 20.0, abs=0.006)


@pytest.mark.parametrize(("share", "same"), [(0.98, True), (1.02, False)])
def test_histories_are_the_same_to_a_millionth_of_the_largest_force(slender, share, same):
    """Which any joint may exceed, to either side; growth is told from a hundred nudges on."""
    motion = af.Motion.synthetic(duration=1.0, pga=0.5, seed=1)
    run = af.time_history(slender, motion, dt=0.005, damping=DAMPED)
    largest = np.abs(run.joints["N"].values).max()
    off = np.zeros(run.joints["N"].shape)
    off[50:100, 2] = 0.9e-8 * largest  # below a hundred times 1e-10: not told of
    off[100:, 2] = 1.1e-8 * largest * np.exp(10.0 * (run.time[100:] - run.time[100]))
    off[150:, 2] = -share * 1e-6 * largest
    found = parted(run, af.History(run.dataset.assign(N=run.dataset["N"] + off)))
    assert found.until == (np.inf if same else run.time[150])
    assert found.difference == pytest.approx(share * 1e-6)
    known = np.log(share * 1e-6 / 1.1e-8) / (run.time[150] - run.time[100])
    assert found.growth == pytest.approx(known, rel=1e-4)
    assert found.peaks == 0.0


def test_a_history_that_ended_earlier_is_compared_as_far_as_it_goes(slender):
    """And one that is the same grows apart by nothing."""
    motion = af.Motion.synthetic(duration=1.0, pga=0.5, seed=1)
    run = af.time_history(slender, motion, dt=0.005, damping=DAMPED)
    short = af.History(run.dataset.isel(time=slice(0, 50)))
    for pair in ((run, short), (short, run)):
        found = parted(*pair)
        assert (found.until, found.growth, found.difference) == (np.inf, 0.0, 0.0)


@pytest.mark.parametrize(("given", "dt"), [({}, 0.005), ({"dt": 0.01}, 0.01)])
def test_steps_are_five_milliseconds_unless_told(stack, given, dt, monkeypatch):
    asked = []

    def asking(model, motion, **options):
        asked.append((options["dt"], motion.pga))
        return af.time_history(model, motion, **options)

    monkeypatch.setattr(determined, "time_history", asking)
    motion = af.Motion.synthetic(duration=1.0, pga=0.5, seed=1).cut(0.4, 0.5)
    model = af.build(stack, fidelity="rigid")
    assert af.dynamics.predictability(model, motion, **given).until == np.inf
    assert [each for each, _ in asked] == [dt, dt]
    assert asked[1][1] == pytest.approx((1.0 + 1e-10) * asked[0][1], rel=1e-13)
