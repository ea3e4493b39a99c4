"""Results show themselves: a picture, a line or two, and the same for notebooks."""

import json
import subprocess
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import archfem as af
from archfem._display import ResultDisplay
from archfem.dynamics import CollapseState
from archfem.limit import rating
from archfem.studies import variations


@pytest.fixture(scope="module")
def things():
    with pytest.MonkeyPatch.context() as patch:
        # the runs of the range, which other tests compute, take most of the time
        stands = CollapseState("stands", None, (), 0.02, 0.01, True)
        patch.setattr(variations, "prepare_runs", lambda *_: lambda _: stands)
        patch.setattr(rating, "_places_along", partial(rating._places_along, steps=4))
        yield one_of_each()


def risk_of_two():
    """A risk of eight samples under two records."""
    hazard = {"intensity": [1.0, 10.0], "rate": [0.1, 0.001], "measure": "pga", "period": None}
    low = np.linspace(2.0, 4.0, 8)
    samples = {"lower": low, "upper": 1.1 * low, "record_number": np.arange(8) % 2}
    samples |= {"runs": np.ones(8, int), "error": [""] * 8, "alternative": ["as given"] * 8}
    samples |= {"admissible_step": np.full(8, np.inf)}
    records = {f"unscaled_{name}": np.array([1.0, 1.2]) for name in ("pga", "pgv", "sa", "sa_avg")}
    return af.studies.CollapseRisk(
        xr.Dataset(
            {name: ("sample", values) for name, values in samples.items()}
            | {name: ("record", values) for name, values in records.items()},
            attrs={"hazard": json.dumps(hazard), "doubts": "[]", "dt": 0.005},
        )
    )


def one_of_each():
    """One of each, of two stones on top of one another whose name has marks of HTML."""
    stones = af.column(breadth=0.4, heights=[0.8, 0.8])
    stones = replace(stones, name="two <b>stones</b> for $5 or $6")
    model = af.build(stones, fidelity="rigid")
    motion = af.Motion([0.0, 0.5, 0.0], 0.01, name="tap")
    return [
        stones,
        af.dead_load(model),
        af.time_history(model, motion, dt=0.005),
        af.pushover(model, af.BodyForce(1.0)),
        af.collapse_factor(stones, live=af.BodyForce(1.0)),
        af.modes(model, 2),
        motion,
        af.kinematic_assessment(stones, af.Eurocode8(ag=0.2, ground="B")),
        af.moving_load(stones, 1e3, positions=[0.0]),
        af.rate(stones, af.limit.Vehicle("lorry", (5e3,), ())),
        af.verdict_range(stones, motion, samples=2, vary={"joint_rule": "exact"}),
        risk_of_two(),
        af.ensemble(stones, motion),
        af.studies.Ida(
            xr.Dataset(
                {
                    "pga": ("motion", [2.0]),
                    "verified": ("motion", [1.5]),
                    "verified, survives": ("motion", [1.0]),
                    "error": ("motion", [""]),
                    "scale": (("motion", "entry"), [[1.0, 1.5]]),
                    "rotation": (("motion", "entry"), [[0.01, 0.02]]),
                },
                {"motion": ["tap"]},
            )
        ),
        af.motion.RecordSelection(
            rule=af.motion.SELECTION_RULES["NTC-2018"],
            measure="horizontal",
            band=(0.1, 1.0),
            scales=(0.5, 2.0),
            records=(af.motion.SelectedRecord(motion, "1999-08-17", 1.0, {}),),
            periods=np.array([0.1, 1.0]),
            spectra=np.ones((1, 2)),
            target=np.ones(2),
            zero_period_ratio=np.nan,
            candidates=1,
            skipped={},
        ),
    ]


def test_one_result_of_each_kind_is_tested(things):
    assert {type(each) for each in things} == set(ResultDisplay.__subclasses__())


def test_each_result_draws_itself(things):
    for each in things:
        assert isinstance(each.plot(), Figure), type(each)
        assert isinstance(each._repr_html_(), str)


def test_each_result_is_shown_in_a_line_or_two(things):
    for each in things:
        words = repr(each)
        assert words.startswith(type(each).__name__)
        assert len(words) < 250
        assert "\n" not in words
        assert "<b>" not in each._repr_html_()
    assert "2 blocks that move, 1 fixed, 2 joints" in repr(things[0])
    assert "factor 0.25" in repr(things[4])  # b / h of the whole column, 0.4 / 1.6


@pytest.mark.slow
def test_pictures_are_loaded_on_first_use():
    script = """
import sys, archfem as af
import archfem.commands.tools  # of `archfem check`
repr(af.column(breadth=0.4, heights=[0.8]))
print("matplotlib" in sys.modules)
"""
    ran = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert ran.stdout.strip() == "False"
