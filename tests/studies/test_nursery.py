"""Workers forked from one process: how they end, what they inherit, and who outlives whom."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import archfem as af
from archfem.studies import process_pool


def lives(process):
    """Whether a process is there that has not ended; one that nobody has waited for has."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children(process):
    """Processes that one has begun."""
    return Path(f"/proc/{process}/task/{process}/children").read_text().split()


def all_end(begun, within):
    """Whether processes end in some time [s]."""
    until = time.monotonic() + within
    while any(map(lives, begun)) and time.monotonic() < until:
        time.sleep(0.02)
    return not any(map(lives, begun))


def study_of(case, find, thicknesses, folder):
    """A study over thicknesses, by a finder of the tests."""
    over = {"structure.thickness": thicknesses}
    find = {"name": f"finders_of_tests:{find}", "folder": str(folder)}
    return af.Study.of(case, over, find)


def test_how_workers_end_is_told_and_nothing_is_inherited(
    small_ring, tmp_path, finders, monkeypatch
):
    monkeypatch.setattr(process_pool, "ATTEMPTS", 2)
    thicknesses = [0.5, 0.6, 0.7, 0.8, 0.81, 0.82, 0.83]
    study = study_of(small_ring, "ending", thicknesses, tmp_path)
    found = study.run(tmp_path / "out", workers=2)
    told = dict(zip(thicknesses, found["error"].values, strict=True))
    assert "2 processes that computed this point ended, the last with signal 9" in told.pop(0.6)
    assert told.pop(0.7).endswith("the last with exit code 7")
    assert told.pop(0.8).endswith("the last with exit code 5")  # by sys.exit
    assert not any(told.values())  # 0.5 ended the first of its processes alone
    kept = found.isel({"structure.thickness": [0, 4, 5, 6]})
    assert (kept["sockets"] == 1).all()  # neither the siblings' nor the nursery's
    assert (kept["threads"] == 1).all()  # of the nursery, which forks
    assert (kept["mpi"] == 0).all()
    draws = set(zip(kept["process"].values, kept["draw"].values, strict=True))
    assert len({draw for _, draw in draws}) == len(draws)  # chance is each one's own
    assert len(set(kept["parent"].values)) == 1
    assert not any(map(lives, map(int, {*kept["parent"].values, *kept["process"].values})))
    assert "an exit is noted" in (tmp_path / "out" / "workers.log").read_text()


def test_a_study_outlives_its_nursery(small_ring, tmp_path, finders, monkeypatch):
    cold = "from archfem.studies import process_pool as n; n.preload = lambda: None; n.tend({})"
    monkeypatch.setattr(process_pool, "TEND", cold)  # these points need nothing that is compiled
    thicknesses = [0.5, 0.6, 0.7, 0.8]
    found = study_of(small_ring, "orphaned", thicknesses, tmp_path).run(workers=2)
    assert found["error"].values.tolist() == 4 * [""]
    assert found["twice"].values.tolist() == [2.0 * each for each in thicknesses]
    begun = [int(path.name) for path in (tmp_path / "seen").iterdir()]
    assert len(begun) >= 3  # one nursery at least, and two workers
    assert all_end(begun, within=5.0)


def test_what_cannot_be_begun_fails_in_the_end(small_ring, tmp_path, finders, monkeypatch):
    monkeypatch.setattr(process_pool, "NURSERIES", 2)
    monkeypatch.setattr(process_pool, "TEND", "raise SystemExit({})")
    usual = signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as gmsh leaves it
    try:
        found = study_of(small_ring, "ending", [0.5, 0.6, 0.7], tmp_path).run(workers=2)
    finally:
        signal.signal(signal.SIGPIPE, usual)
    for words in found["error"].values:
        assert "2 processes that were to fork workers ended, the last with exit code" in words


@pytest.mark.slow
def test_nobody_outlives_a_driver_that_is_killed(small_ring, tmp_path, finders):
    code = (
        f"import sys; sys.path.insert(0, {str(finders)!r})\n"
        "import archfem as af\n"
        f"case = af.Case.read({str(small_ring.folder / 'ring.toml')!r})\n"
        "find = {'name': 'finders_of_tests:slowly', 'seconds': 60.0}\n"
        "af.Study.of(case, {'motion.scale': [1.0, 2.0, 3.0]}, find).run(workers=2)\n"
    )
    driver = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    begun, until = [], time.monotonic() + 60.0
    while len(begun) < 3 and time.monotonic() < until:
        time.sleep(0.05)
        begun = children(driver.pid)
        begun += [each for one in begun for each in children(one)]
    assert len(begun) == 3
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    assert all_end(begun, within=5.0)  # long before their points would
