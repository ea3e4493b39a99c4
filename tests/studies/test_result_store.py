"""How far a study is, and how long it takes still, on a clock that stands where it is put."""

from math import inf

import pytest

import archfem as af
from archfem.studies import result_store
from archfem.studies.result_store import Progress, Store


@pytest.mark.parametrize(
    ("given", "remaining"),
    [
        ({}, inf),
        ({"rate": 0.05}, 120.0),
        ({"rate": 2.0}, 3.0),
        ({"rate": 2.0, "run_rate": 0.5}, inf),
        ({"rate": 2.0, "run_rate": 0.5, "runs_left": 40.0}, 80.0),
    ],
)
def test_the_remaining_time_follows_the_rate_of_points_or_of_runs(given, remaining):
    assert af.studies.Status(10, 4, 0, **given).remaining == pytest.approx(remaining)
    assert af.studies.Status(10, 10, 0, **given).remaining == 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rate": 2.0}, "4 of 10 points done, 1 failed, 2 a second, 3 s remaining, not running"),
        ({}, "4 of 10 points done, 1 failed, time known when the first has ended, not running"),
        (
            {"runs": 7, "run_rate": 0.5, "runs_left": 40.0, "running": True},
            "4 of 10 points done, 1 failed, 7 runs kept, 0.5 runs a second, 80 s remaining, "
            "running",
        ),
    ],
)
def test_a_status_says_what_is_known(given, words):
    assert str(af.studies.Status(10, 4, 1, **given)) == words
    assert str(af.studies.Status(4, 4, 0)) == "4 of 4 points done, 0 failed, not running"


class Kept:
    """Stands for a store that keeps what is written."""

    def __init__(self):
        self.written = []

    def write_progress(self, status):
        self.written.append(status)


@pytest.fixture
def progress(monkeypatch, tmp_path):
    """Progress of 20 points, 5 of them done before with 30 runs, and what sets clock and runs."""
    now = {"time": 100.0, "runs": 30}
    monkeypatch.setattr(result_store, "monotonic", lambda: now["time"])
    monkeypatch.setattr(result_store, "count_results", lambda folder, kind: now["runs"])
    store = Kept()
    found = Progress(20, 5, 1, store, tmp_path)
    yield found, store, now
    found.close()


def test_rates_are_those_since_the_driver_began(progress):
    """Three points of 4 runs each in 6 s, and 8 runs of others: 12 points of 4 runs are left."""
    found, store, now = progress
    for second, failed in ((102.0, False), (104.0, True), (106.0, False)):
        now["time"] = second
        now["runs"] += 4
        found.add(failed=failed, runs=4)
    assert [status.done for status in store.written] == [6, 7, 8]
    now["runs"] += 8
    status = found._status
    assert (status.total, status.done, status.failed, status.runs) == (20, 8, 2, 50)
    assert status.running
    assert status.rate == pytest.approx(0.5)
    assert status.run_rate == pytest.approx(20.0 / 6.0)
    assert status.runs_left == pytest.approx(12 * 4 - 8)


def test_runs_under_way_beyond_those_expected_leave_none(progress):
    found, _, now = progress
    now.update(time=102.0, runs=31)
    found.add(failed=False, runs=1)
    assert found._status.runs_left == 14.0  # one for each point that is left
    now["runs"] += 30
    assert found._status.runs_left == 0.0


def test_before_the_first_point_no_runs_are_expected(progress):
    found, _, now = progress
    now.update(time=110.0, runs=32)
    status = found._status
    assert (status.rate, status.run_rate, status.runs_left) == (0.0, pytest.approx(0.2), 0.0)


def test_points_of_milliseconds_are_written_once_a_second(progress):
    found, store, now = progress
    for second in (100.0, 100.5, 100.99, 101.05, 101.5, 102.1):
        now["time"] = second
        found.add(failed=False)
    assert [status.done for status in store.written] == [6, 9, 11]
    assert found._status.runs_left == 0.0  # points without runs of their own


def test_errors_that_would_be_raised_again_are_kept(tmp_path):
    """Those of archfem; that of a library or of a function of the user may not occur again."""
    store = Store(tmp_path)
    rows = {
        "aa1": {"found": {"x": 1.0}, "error": "", "ours": True},
        "bb2": {"found": {}, "error": "DidNotConverge: no equilibrium", "ours": True},
        "cc3": {"found": {}, "error": "MemoryError", "ours": False},
    }
    for digest, row in rows.items():
        store.write_row(digest, row)
    del rows["cc3"]
    assert store.load_rows(["aa1", "bb2", "cc3", "dd4"]) == rows
