"""Which model and which steps are chosen, by errors that are known."""

from types import SimpleNamespace

import pytest

import archfem as af
from archfem.dynamics import ladder
from archfem.models.build import build as plain

BLOCK = af.column(breadth=1.0, heights=[1.0])


class Known:
    """A yardstick of known errors: of steps by their tolerance, of models in the order asked."""

    model = None
    window = damping = None

    def __init__(self, in_time, in_model, chance=0.0):
        self._time, self._errors, self._chance = in_time, iter(in_model), chance
        self.paces, self.asked = [], 0

    def in_time(self, steps):
        self.paces.append(steps.pace)
        return self._time[len(self.paces) - 1]

    def in_model(self, model, steps):
        self.asked += 1
        return next(self._errors)

    def by(self, finer):
        return self

    def by_chance(self, model, steps):
        return self._chance


@pytest.fixture
def choose(monkeypatch):
    """Choose by such a yardstick, all models the same."""

    def chosen(known, tolerance=0.01, dt=None):
        known.model = plain(BLOCK, af.models.Discretisation("rigid"))
        monkeypatch.setattr(ladder, "_yardstick", lambda *_: known)
        monkeypatch.setattr(ladder, "error_of_small", lambda *_: 0.0)
        return ladder.choose(BLOCK, tolerance, dt=dt, builder=lambda *_: known.model)

    return chosen


def test_the_first_model_within_what_steps_leave_is_chosen(choose):
    """Steps err by 0.002 of 0.01: models may by 0.008, to either side of which they lie here."""
    known = Known([0.002], [0.02, 0.0081, 0.0079, 1.0])
    told = choose(known).prediction
    assert known.asked == 3
    assert told.error == pytest.approx(0.0099)
    assert (told.in_time, told.met, told.pace) == (0.002, True, 0.005)
    errors = [error for _, error in told.considered]
    assert errors == pytest.approx([0.002, 0.022, 0.0101, 0.0099])
    assert [name.split(" exact")[0] for name, _ in told.considered[1:]] == [
        "rigid 1×1",
        "faces 2×2",
        "faces 4×4",
    ]


def test_steps_leave_half_of_the_tolerance_whatever_they_err_by(choose):
    known = Known([0.007] * 9, [0.0051, 0.0049])
    told = choose(known).prediction
    assert known.asked == 2
    assert told.error == pytest.approx(0.0119)
    assert not told.met


def test_where_none_is_good_enough_the_best_is_taken(choose):
    model = choose(Known([0.002], [0.03, 0.012, 0.05, 0.02, 0.04, 0.013]))
    assert model.prediction.error == pytest.approx(0.014)
    assert len(model.prediction.considered) == 1 + 6
    assert "no finer mesh is tried" in model.doubts[-1]


def test_steps_are_shortened_until_they_err_by_half_of_the_tolerance(choose):
    """Their tolerance falls by four at a time, and not below 1e-4; else the best of them is taken.

    The 2^-n of 0.005: 5e-3, 1.25e-3 and 3.1e-4 are tried.
    """
    known = Known([0.02, 0.0051, 0.0049, 0.0], [0.0])
    told = choose(known).prediction
    assert known.paces == pytest.approx([0.005, 0.00125, 0.0003125])
    assert (told.in_time, told.pace) == (0.0049, pytest.approx(0.0003125))
    known = Known([0.02, 0.006, 0.008, 0.0], [0.0])
    told = choose(known).prediction
    assert len(known.paces) == 3
    assert (told.in_time, told.pace) == (0.006, pytest.approx(0.00125))
    known = Known([0.02, 0.0], [0.0])
    choose(known, tolerance=1.5e-4)
    assert known.paces == [1e-4]


def test_no_error_is_predicted_below_what_is_chance(choose):
    told = choose(Known([0.001], [0.002], chance=0.003)).prediction
    assert told.error == pytest.approx(0.004)
    assert told.of_chance == 0.003
    model = choose(Known([0.001], [0.002], chance=0.0091))
    assert "impacts decide" in model.doubts[-1]


def test_a_step_that_is_asked_for_is_judged_alone(choose):
    known = Known([0.02], [0.0])
    model = choose(known, dt=0.01)
    assert known.paces == [None]
    assert (model.prediction.dt, model.prediction.pace) == (0.01, None)
    assert "leave dt out" in model.doubts[-1]


def test_damping_is_found_of_a_model_where_it_is_asked_for():
    damping = af.StiffnessDamping(0.03, 8.0)
    found = SimpleNamespace(size=3)
    assert ladder.damping_for(found, lambda model: (model.size, damping)) == (3, damping)
    assert ladder.damping_for(found, damping) is damping
    assert ladder.damping_for(found, None) is None
