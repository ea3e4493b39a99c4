"""The first trials of each campaign of `make fuzz`, in this process: none may end badly."""

import importlib

import pytest
from fuzz.trial import BAD

COUNTS = {"case_files": 12, "records": 50, "drawings": 20, "calls": 50, "shakes": 1}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    "campaign",
    [pytest.param(x, marks=pytest.mark.slow if x == "shakes" else ()) for x in COUNTS],
)
def test_odd_input_ends_in_an_answer_or_a_named_error(tmp_path, monkeypatch, campaign):
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(f"fuzz.{campaign}")
    module.ready()
    for number in range(COUNTS[campaign]):
        came = module.trial(0, number, tmp_path)
        assert came.kind not in BAD, f"{campaign} {number}: {came.kind}: {came.words}\n{came.input}"
