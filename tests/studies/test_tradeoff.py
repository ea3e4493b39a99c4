"""Speed against error of a case: as of the structure by itself, and gone on with."""

import numpy as np
import pytest

import archfem as af
from archfem.cases.examples import list_examples
from archfem.dynamics import accuracy
from archfem.dynamics.accuracy import candidate_settings, reference_settings
from archfem.models import Discretisation
from archfem.studies import case_accuracy

COARSE = Discretisation("faces", (2, 2), quadrature="exact")
REFERENCES = accuracy.Setting(COARSE, 0.005), accuracy.Setting(COARSE, 0.01)
GIVEN = {"rungs": ("rigid",), "cells": ((2, 2),), "rules": (("gauss", 3), ("exact", None))}
STEPS = (0.01, 0.005)


@pytest.fixture(scope="module")
def few_settings():
    """Few settings, and a coarse reference."""
    few = (*GIVEN.values(), STEPS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accuracy, "reference_settings", lambda structure: REFERENCES)
        patch.setattr(
            accuracy,
            "candidate_settings",
            lambda structure, *tried: candidate_settings(structure, *(tried or few)),
        )
        yield


@pytest.fixture(scope="module")
def case(few_settings):
    """A ring under half a second of motion."""
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    motion = {"synthetic": {"duration": 0.5, "pga": 2.0, "seed": 1}}
    return af.Case.of(
        {
            "structure": {**ring, "voussoirs": 5},
            "model": {"fidelity": "condensed", "quadrature_points": 4, "quadrature": "gauss"},
            "motion": motion,
            "analysis": {"dt": 0.002, "damping": {"ratio": 0.05, "frequency": "20 Hz"}},
        }
    )


@pytest.fixture(scope="module")
def compared(case, tmp_path_factory):
    """The comparison of that case, and the folder that keeps its runs."""
    folder = tmp_path_factory.mktemp("compared")
    return case_accuracy(case, folder), folder


@pytest.mark.slow
def test_a_case_is_compared_as_its_structure_is(case, compared):
    """The case's own fidelity, rule and step do not matter; its damping does."""
    found, _ = compared
    given = {**GIVEN, "damping": case.analysis.damping, "steps": STEPS}
    known = af.accuracy(case.structure, case.ground_motion(), **given)
    assert [trial.setting for trial in found.trials] == [trial.setting for trial in known.trials]
    errors = [[trial.error for trial in each.trials] for each in (found, known)]
    assert np.allclose(*errors, rtol=0.0, atol=1e-9)
    assert max(errors[0]) > 1e-3
    assert found.reference_error == pytest.approx(known.reference_error, abs=1e-9)


@pytest.mark.slow
def test_settings_that_ran_are_not_run_again(case, compared, monkeypatch):
    first, folder = compared
    monkeypatch.setattr("archfem.studies.convergence.time_run", None)
    again = case_accuracy(case, folder)
    assert again == first


def test_a_reference_that_fails_is_named(case, monkeypatch):
    def failing(model, motion, **options):
        if options["dt"] == 0.005 and motion.duration > 0.01:
            raise af.DidNotConverge("no equilibrium")
        return af.time_history(model, motion, **options)

    monkeypatch.setattr("archfem.dynamics.accuracy.time_history", failing)
    with pytest.raises(af.DidNotConverge, match="the reference, faces 2×2 exact 5 ms, did not"):
        case_accuracy(case)


def test_soil_keeps_its_nodes():
    """A stone's fidelity is not that of soft blocks, in references and in all other settings."""
    bridge = af.Case.read(list_examples()["prusias"]).structure
    assert all(
        setting.discretisation.fidelity["backfill"] == "full"
        for setting in (*reference_settings(bridge), *candidate_settings(bridge))
    )
