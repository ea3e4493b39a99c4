"""Selection of model and time step, by known errors and by candidates."""

from types import SimpleNamespace

import pytest

import archfem as af
from archfem.dynamics import model_selection
from archfem.dynamics.model_selection import (
    MODEL_LEVELS,
    candidate_discretisations,
    discretisation_label,
    reference_discretisation,
)
from archfem.models.builder import build
from archfem.models.builder import build as plain

BLOCK = af.column(breadth=1.0, heights=[1.0])


class Known:
    """An estimator of known errors: of steps by their tolerance, of models in the order asked."""

    model = None
    window = damping = None

    def __init__(self, in_time, in_model, chance=0.0):
        self._time, self._errors, self._chance = in_time, iter(in_model), chance
        self.paces, self.asked = [], 0

    def time_step_error(self, steps):
        self.paces.append(steps.step_tolerance)
        return self._time[len(self.paces) - 1]

    def model_error(self, model, steps):
        self.asked += 1
        return next(self._errors)

    def with_reference(self, finer):
        return self

    def chaotic_spread(self, model, steps):
        return self._chance


@pytest.fixture
def choose(monkeypatch):
    """Select by such an estimator, all models the same."""

    def chosen(known, tolerance=0.01, dt=None):
        known.model = plain(BLOCK, af.models.Discretisation("rigid"))
        monkeypatch.setattr(model_selection, "_make_estimator", lambda *_: known)
        monkeypatch.setattr(model_selection, "small_displacement_error", lambda *_: 0.0)
        return model_selection.select_model(BLOCK, tolerance, dt=dt, builder=lambda *_: known.model)

    return chosen


def test_the_first_model_within_what_steps_leave_is_chosen(choose):
    """Steps err by 0.002 of 0.01: models may by 0.008, to either side of which they lie here."""
    known = Known([0.002], [0.02, 0.0081, 0.0079, 1.0])
    told = choose(known).prediction
    assert known.asked == 3
    assert told.error == pytest.approx(0.0099)
    assert (told.time_step_error, told.is_met, told.step_tolerance) == (0.002, True, 0.005)
    errors = [error for _, error in told.candidates]
    assert errors == pytest.approx([0.002, 0.022, 0.0101, 0.0099])
    assert [name.split(" exact")[0] for name, _ in told.candidates[1:]] == [
        "rigid 1×1",
        "faces 2×2",
        "faces 4×4",
    ]


def test_steps_leave_half_of_the_tolerance_whatever_they_err_by(choose):
    known = Known([0.007] * 9, [0.0051, 0.0049])
    told = choose(known).prediction
    assert known.asked == 2
    assert told.error == pytest.approx(0.0119)
    assert not told.is_met


def test_where_none_is_good_enough_the_best_is_taken(choose):
    model = choose(Known([0.002], [0.03, 0.012, 0.05, 0.02, 0.04, 0.013]))
    assert model.prediction.error == pytest.approx(0.014)
    assert len(model.prediction.candidates) == 1 + 6
    assert "no finer mesh is tried" in str(model.doubts[-1])


def test_steps_are_shortened_until_they_err_by_half_of_the_tolerance(choose):
    """Their tolerance falls by four at a time, and not below 1e-4; else the best of them is taken.

    The 2^-n of 0.005: 5e-3, 1.25e-3 and 3.1e-4 are tried.
    """
    known = Known([0.02, 0.0051, 0.0049, 0.0], [0.0])
    told = choose(known).prediction
    assert known.paces == pytest.approx([0.005, 0.00125, 0.0003125])
    assert (told.time_step_error, told.step_tolerance) == (0.0049, pytest.approx(0.0003125))
    known = Known([0.02, 0.006, 0.008, 0.0], [0.0])
    told = choose(known).prediction
    assert len(known.paces) == 3
    assert (told.time_step_error, told.step_tolerance) == (0.006, pytest.approx(0.00125))
    known = Known([0.02, 0.0], [0.0])
    choose(known, tolerance=1.5e-4)
    assert known.paces == [1e-4]


def test_no_error_is_predicted_below_what_is_chance(choose):
    told = choose(Known([0.001], [0.002], chance=0.003)).prediction
    assert told.error == pytest.approx(0.004)
    assert told.chaotic_spread == 0.003
    model = choose(Known([0.001], [0.002], chance=0.0091))
    assert "impacts decide" in str(model.doubts[-1])


def test_a_step_that_is_asked_for_is_judged_alone(choose):
    known = Known([0.02], [0.0])
    model = choose(known, dt=0.01)
    assert known.paces == [None]
    assert (model.prediction.dt, model.prediction.step_tolerance) == (0.01, None)
    assert "leave dt out" in str(model.doubts[-1])


def test_damping_is_found_of_a_model_where_it_is_asked_for():
    damping = af.StiffnessDamping(0.03, 8.0)
    found = SimpleNamespace(size=3)
    assert model_selection.resolve_damping(found, lambda model: (model.size, damping)) == (
        3,
        damping,
    )
    assert model_selection.resolve_damping(found, damping) is damping
    assert model_selection.resolve_damping(found, None) is None


FIRST = ["rigid 1×1 exact", "faces 2×2 exact", "faces 4×4 exact", "condensed 4×4 exact"]
SECOND = ["faces 8×8 exact", "condensed 8×8 exact"]
FINER = ["condensed 8×8 exact", "condensed 12×12 exact"]
"""Another copy of what `build` with "auto" goes through, the cheapest first."""


def test_models_come_the_cheapest_first(ring):
    found = [
        [discretisation_label(each) for each in candidate_discretisations(ring, level)]
        for level in MODEL_LEVELS
    ]
    assert found == [FIRST, SECOND]
    assert [
        discretisation_label(reference_discretisation(ring, level)) for level in MODEL_LEVELS
    ] == FINER
    sizes = [
        build(af.column(breadth=1.0, heights=[1.0]), each).size
        for each in candidate_discretisations(ring, MODEL_LEVELS[0])
    ]
    assert sizes == sorted(sizes)


def test_soil_keeps_its_nodes_and_is_never_rigid():
    stack = af.column(breadth=1.0, heights=[1.0])
    soft = af.Block(
        ((-0.5, 1.0), (0.5, 1.0), (0.5, 2.0), (-0.5, 2.0)), af.masonry.BACKFILL, "soil", part="fill"
    )
    contact = af.masonry.SOIL_TO_STONE
    bed = af.Joint((1, 2), (-0.5, 1.0), (0.5, 1.0), contact, "bed", "fill", "other")
    structure = af.Structure((*stack.blocks, soft), (*stack.joints, bed))
    found = [
        discretisation_label(each) for each in candidate_discretisations(structure, MODEL_LEVELS[0])
    ]
    assert found == [f"{each.replace(' ', ' + soil ', 1)}" for each in FIRST[1:]]
    (first, *_) = candidate_discretisations(structure, MODEL_LEVELS[0])
    assert first.fidelity == {"soil": "full", "rest": "faces"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fidelity": "full", "cells": (3, 5), "quadrature": "gauss", "points": 4}, "3×5 gauss 4"),
        ({"fidelity": "faces", "cells": (2, 1), "quadrature": "nodal"}, "faces 2×1 nodal"),
    ],
)
def test_a_model_in_a_few_words(given, words):
    assert discretisation_label(af.models.Discretisation(**given)).endswith(words)
