"""Selection of model and time step, by runs whose peaks are known."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import error_estimation, model_selection
from archfem.dynamics.error_estimation import RunPeaks
from archfem.dynamics.model_selection import discretisation_label, exact_discretisation
from archfem.models.builder import build as plain

BLOCK = af.column(breadth=1.0, heights=[1.0])
MOTION = af.Motion(np.append(np.ones(401), np.zeros(1600)), 0.01)
"""Twenty seconds, of which about two and a half hold six tenths of the intensity."""


class Chosen:
    """A selection by known peaks; its runs, and the model it returns."""

    def __init__(self, monkeypatch):
        self.steps, self.built, self.ends, self.parts = [], [], [], []
        self.model = None
        self._patch = monkeypatch

    def of(self, *peaks, turn=0.0, slip=0.0, tolerance=0.01, dt=None, **given):
        """Select by runs of these largest |e|."""
        self.steps, self.built, self.ends, self.parts = [], [], [], []
        rigid = plain(BLOCK, af.models.Discretisation("rigid"))

        def build(structure, discretisation):
            self.built.append(discretisation)
            return rigid

        def run(model, motion, damping, step, parts):
            number = len(self.steps)
            self.steps.append(step)
            self.ends.append(motion.duration)
            self.parts.append(parts)
            largest, start = np.array([0.1, peaks[number]]), SimpleNamespace(time=0.0)
            return RunPeaks(largest, turn, np.array([0.5, 1.5]), (start,), slip)

        self._patch.setattr(error_estimation, "run_peaks", run)
        self._patch.setattr(model_selection.plain, "build", build)
        self.model = model_selection.select_model(BLOCK, tolerance, MOTION, dt=dt, **given)
        return self.model.prediction


@pytest.fixture
def chosen(monkeypatch):
    return Chosen(monkeypatch)


REST = 1.0 / (2.0**2 - 1.0)


def test_the_first_setting_within_the_tolerance_is_chosen(chosen):
    prediction = chosen.of(0.32, 0.28, 0.276)
    assert chosen.steps == [0.005, 0.0025, 0.00125]
    assert prediction.error == pytest.approx(0.004 * (1.0 + REST))
    assert prediction.dt == 0.0025
    assert len(chosen.built) == 2
    assert [name for name, _ in prediction.candidates] == [
        "faces 8×8 exact 5 ms",
        "faces 8×8 exact 2.5 ms",
        "condensed 8×8 exact 1.25 ms",
    ]
    errors = [error for _, error in prediction.candidates]
    assert errors == pytest.approx([0.044 + 0.004 * REST, prediction.error, 0.004 * REST])
    assert prediction.is_met
    assert not chosen.model.doubts


def test_only_the_first_runs_beyond_its_last_peak(chosen):
    """The second of the same model starts from states of the first, the third at rest."""
    chosen.of(0.32, 0.28, 0.276)
    assert chosen.ends == pytest.approx([chosen.ends[0], 1.75, 1.75])
    assert chosen.ends[0] > 3.0
    assert [parts is None for parts in chosen.parts] == [True, False, True]
    assert [(start.time, end) for start, end in chosen.parts[1]] == [(0.0, 1.75)]


def test_a_cheap_setting_that_took_longer_to_find_than_to_run_is_not_chosen(chosen, monkeypatch):
    """Where the strongest part is most of the motion."""
    monkeypatch.setattr(error_estimation, "strongest_window", lambda motion: motion)
    prediction = chosen.of(0.300, 0.299)
    assert prediction.dt == 0.0025
    assert prediction.error == pytest.approx(0.001 * REST)


@pytest.mark.parametrize(
    ("difference", "step"), [(0.0, 5.0), (0.003, 5.0), (0.006, 5.0), (0.012, 3.5), (0.0299, 2.5)]
)
def test_the_longest_step_within_the_tolerance_is_taken(chosen, difference, step):
    """Steps are multiples of 0.5 ms; errors are of order 2: 0.003 of 0.012 is left at 2.5 ms."""
    prediction = chosen.of(0.3 + difference, 0.3)
    assert 1e3 * prediction.dt == pytest.approx(step)
    assert prediction.error == pytest.approx(REST * difference * (step / 2.5) ** 2)
    assert len(chosen.built) == 1


@pytest.mark.parametrize(
    ("difference", "step"), [(0.003, 5.0), (0.005, 5.0), (0.008, 3.0), (0.0099, 2.5)]
)
def test_where_joints_slide_errors_are_of_order_one(chosen, difference, step):
    """What two steps differ by is left at 2.5 ms, and grows with the step."""
    prediction = chosen.of(0.3 + difference, 0.3, slip=0.011)
    assert 1e3 * prediction.dt == pytest.approx(step)
    assert prediction.error == pytest.approx(difference * step / 2.5)
    assert chosen.of(0.3 + difference, 0.3, slip=0.009).error < prediction.error
    assert len(chosen.of(0.312, 0.3, 0.3, slip=0.011).candidates) == 3


def test_where_none_is_good_enough_the_best_is_taken(chosen):
    prediction = chosen.of(0.45, 0.33, 0.26, 0.22)
    assert prediction.dt == 0.000625
    assert not prediction.is_met
    assert "no finer setting is tried" in str(chosen.model.doubts[-1])


def test_refinement_ends_where_it_changes_no_less_than_before(chosen):
    prediction = chosen.of(0.40, 0.35, 0.29)
    assert len(chosen.steps) == 3
    assert prediction.error == pytest.approx(0.06 * REST)
    assert "impacts decide" in chosen.model.doubts[-1].remedy


@pytest.mark.parametrize(("largest", "rocks"), [(0.39, False), (0.41, True)])
def test_no_prediction_is_trusted_where_a_stack_rocks(chosen, largest, rocks):
    chosen.of(largest, largest)
    assert [f"up to {largest}" in doubt.cause for doubt in chosen.model.doubts] == [True] * rocks


def test_a_given_step_is_compared_with_one_twice_as_long(chosen):
    prediction = chosen.of(0.40, 0.30, dt=0.01)
    assert chosen.steps == [0.02, 0.01]
    assert prediction.dt == 0.01
    assert "leave dt out" in chosen.model.doubts[-1].remedy
    assert chosen.of(0.3, 0.3, dt=0.01).dt == 0.01


def test_large_rotations_of_joints_are_a_doubt_of_small_displacements(chosen):
    prediction = chosen.of(0.3, 0.3, turn=0.004)
    assert prediction.small_displacement_error == pytest.approx(0.012)
    assert prediction.error == 0.0
    assert not prediction.is_met
    assert "by the assumption of small displacements" in prediction.text
    (doubt,) = chosen.model.doubts
    assert "small errs by about 0.012" in doubt.cause
    assert "displacements='large'" in doubt.remedy


def test_a_choice_may_be_of_large_displacements(chosen):
    """They are built once, of the choice; nothing is left to doubt about their size."""
    assert chosen.of(0.3, 0.3, turn=0.004, displacements="large").small_displacement_error == 0.0
    assert not chosen.model.doubts
    with pytest.raises(af.InvalidInput, match="displacements = 'huge' is not known"):
        chosen.of(0.3, 0.3, displacements="huge")


def test_effective_damping_is_that_of_the_model_tried_about_its_dead_load(ring):
    model, motion = af.build(ring, fidelity="rigid"), af.Motion.synthetic(duration=1.0, pga=1.0)
    (_, found, _) = model_selection._resolve_excitation(model, motion, "effective")
    assert found == af.effective_damping(model, 0.05, af.dead_load(model))
    assert found != af.effective_damping(model, 0.05, "closed")
    given = af.StiffnessDamping(0.03, 8.0)
    assert model_selection._resolve_excitation(model, motion, given)[1] == given


def test_soil_keeps_its_nodes_and_is_never_rigid():
    stack = af.column(breadth=1.0, heights=[1.0])
    soft = af.Block(
        ((-0.5, 1.0), (0.5, 1.0), (0.5, 2.0), (-0.5, 2.0)), af.masonry.BACKFILL, "soil", part="fill"
    )
    contact = af.masonry.SOIL_TO_STONE
    bed = af.Joint((1, 2), (-0.5, 1.0), (0.5, 1.0), contact, "bed", "fill", "other")
    structure = af.Structure((*stack.blocks, soft), (*stack.joints, bed))
    found = exact_discretisation(structure, "faces", (2, 2))
    assert discretisation_label(found) == "faces + soil 2×2 exact"
    assert found.fidelity == {"soil": "full", "rest": "faces"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"fidelity": "full", "cells": (3, 5), "quadrature": "gauss", "quadrature_points": 4},
            "3×5 gauss 4",
        ),
        ({"fidelity": "faces", "cells": (2, 1), "quadrature": "nodal"}, "faces 2×1 nodal"),
    ],
)
def test_a_model_in_a_few_words(given, words):
    assert discretisation_label(af.models.Discretisation(**given)).endswith(words)


@pytest.mark.slow
def test_a_structure_that_does_not_stand_raises_the_error_of_its_dead_load(monkeypatch):
    """Far below the least thickness of Milankovitch, 0.107 of the radius for a half circle."""
    thin = af.circular_arch(radius=3.0, thickness=0.2, embrace=180.0, voussoirs=11)
    # the first model tried raises it, on any mesh
    monkeypatch.setattr(model_selection, "TRIED_SETTINGS", (("faces", (1, 1), 0.005),))
    with pytest.raises(af.DidNotConverge, match="does not stand under its own weight") as said:
        af.build(thin, fidelity="auto", motion=MOTION)
    with pytest.raises(af.DidNotConverge) as known:
        af.dead_load(af.build(thin, fidelity="rigid"))
    assert str(said.value) == str(known.value)


@pytest.mark.parametrize(
    ("count", "share", "chosen"),
    [(2, 0.39, 0.004), (2, 0.41, 0.0025), (3, 0.24, 0.005), (3, 0.26, 0.0025)],
)
def test_a_coarser_setting_is_chosen_where_finding_it_was_the_smaller_part(count, share, chosen):
    """A share of the motion was run: 0.4 of it by two settings, a quarter by three.

    The errors of two fall with the square of the step, of which multiples of 0.5 ms are taken:
    2.5 ms times the root of 2.6 is 4.03 ms.
    """
    tolerance = 0.013
    steps = (0.01, 0.005, 0.0025)[-count:] if count == 3 else (0.005, 0.0025)
    run = RunPeaks(None)
    trials = [model_selection._Trial(None, dt, None, run, share) for dt in steps]
    errors = {2: [0.02, 0.005], 3: [0.05, 0.012, 0.004]}[count]
    found, error = model_selection._select_trial(trials, errors, tolerance)
    assert found.dt == pytest.approx(chosen)
    expected = {0.004: 0.005 * 1.6**2, 0.005: 0.012, 0.0025: errors[-1]}[chosen]
    assert error == pytest.approx(expected)
    assert model_selection._select_trial(trials, errors, 0.001) == (trials[-1], errors[-1])
