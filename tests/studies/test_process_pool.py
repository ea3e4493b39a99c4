"""Workers of a study: how they end, their settings, and the order in which processes end."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from multiprocessing import Pipe, forkserver
from pathlib import Path
from types import SimpleNamespace

import pytest

import archfem as af
from archfem import _display
from archfem.studies import process_pool, result_store


def lives(process):
    """Whether a process exists and has not ended; a zombie has ended."""
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
    return af.Study(case, over, find)


@pytest.mark.slow
def test_the_driver_reports_once_that_workers_compile(small_ring, tmp_path, finders, capsys):
    over = {"structure.thickness": [0.5, 0.6, 0.7, 0.8]}
    study = af.Study(small_ring, over, "finders_of_tests:compiling")
    study.run(tmp_path, workers=2)
    assert capsys.readouterr().err.count("compiling the time steps, which takes about") == 1
    assert "compiling" not in (tmp_path / "workers.log").read_text()


@pytest.mark.slow
def test_workers_compile_every_function_once(small_ring, tmp_path):
    (tmp_path / "case.toml").write_text(small_ring.text())
    vary = "motion.scale = [0.1, 0.2, 0.3, 0.4]"
    study = f'case = "case.toml"\ncompute = "history"\n[vary]\n{vary}\n'
    (tmp_path / "study.toml").write_text(study)
    command = [sys.executable, "-m", "archfem", "study", str(tmp_path / "study.toml")]
    command += ["--out", str(tmp_path / "out"), "--workers", "2"]
    shown = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_DEBUG_CACHE": "1"}
    ran = subprocess.run(command, env=os.environ | shown, text=True, capture_output=True)
    assert "4 of 4" in ran.stdout, ran.stderr
    assert ran.stderr.count("compiling the time steps, which takes about") == 1
    log = (tmp_path / "out" / "workers.log").read_text()
    saved = re.findall(r"data saved to '(.*)'", log)
    assert any("advance" in path for path in saved)
    assert len(saved) == len(set(saved))


@pytest.mark.slow
def test_deaths_of_workers_are_reported_and_nothing_is_inherited(
    small_ring, tmp_path, finders, monkeypatch, caplog
):
    monkeypatch.setattr(process_pool, "MAX_DEATHS_PER_POINT", 2)
    thicknesses = [0.5, 0.6, 0.7, 0.8, 0.81, 0.82, 0.83]
    study = study_of(small_ring, "ending", thicknesses, tmp_path)
    table = study.run(tmp_path / "out", workers=2)
    errors = dict(zip(thicknesses, table["error"].values, strict=True))
    assert "2 processes that computed this point ended, the last with signal 9" in errors.pop(0.6)
    assert errors.pop(0.7).endswith("the last with exit code 0")
    assert errors.pop(0.8).endswith("the last with exit code 5")  # by sys.exit
    assert not any(errors.values())  # 0.5 ended its first process alone
    messages = [record.getMessage() for record in caplog.records]
    first = "a worker ended with signal 9 while it computed point 0 (structure.thickness = 0.5)"
    assert [text for text in messages if text.startswith(f"{first}: the point is computed again")]
    assert sum("point 2 (structure.thickness = 0.7): the point is lost" in m for m in messages) == 1
    assert len(messages) == 7  # two of each of three points, and one of the first
    rows = table.isel({"structure.thickness": [0, 4, 5, 6]})
    assert (rows["sockets"] == 1).all()  # neither the other workers' nor the fork server's
    assert (rows["threads"] == 1).all()  # of the fork server
    assert (rows["mpi"] == 0).all()
    assert (rows["blas"] == 1).all()
    draws = set(zip(rows["process"].values, rows["draw"].values, strict=True))
    assert len({draw for _, draw in draws}) == len(draws)  # each has random numbers of its own
    assert len(set(rows["parent"].values)) == 1
    assert not any(map(lives, map(int, set(rows["process"].values))))
    assert not any(Path(f"/proc/{int(each)}").exists() for each in rows["process"].values)
    log = (tmp_path / "out" / "workers.log").read_text()
    assert "an exit is noted" in log
    assert "so are errors" in log


@pytest.mark.slow
def test_a_study_outlives_its_fork_server(small_ring, tmp_path, finders):
    thicknesses = [0.5, 0.6, 0.7, 0.8]
    table = study_of(small_ring, "orphaned", thicknesses, tmp_path).run(workers=2)
    assert table["error"].values.tolist() == 4 * [""]
    assert table["twice"].values.tolist() == [2.0 * each for each in thicknesses]
    begun = {int(path.name) for path in (tmp_path / "seen").iterdir()}
    assert len(begun) >= 3  # one fork server at least, and two workers
    # a second fork server serves later studies; workers of the first have become children of init
    begun -= {forkserver._forkserver._forkserver_pid, 1}
    assert all_end(begun, within=5.0)


def test_a_study_stops_if_no_worker_starts(small_ring, tmp_path, finders, monkeypatch):
    def start(process):
        raise EOFError

    monkeypatch.setattr("multiprocessing.process.BaseProcess.start", start)
    study = study_of(small_ring, "ending", [0.81, 0.82, 0.83], tmp_path)
    with pytest.raises(af.errors.StudyStopped, match="no worker could be started in 10 attempts"):
        study.run(workers=2)


def test_a_dead_worker_does_not_end_its_driver(small_ring, tmp_path, finders):
    """The driver also survives after gmsh has restored the default action of SIGPIPE."""
    usual = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        table = study_of(small_ring, "deadly", [0.5, 0.81, 0.82], tmp_path).run(workers=2)
    finally:
        signal.signal(signal.SIGPIPE, usual)
    assert table["twice"].values[0] == 1.0


@pytest.mark.slow
def test_a_script_without_a_main_guard_is_not_run_by_workers(small_ring, tmp_path, finders):
    script = tmp_path / "script.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(finders)!r})\n"
        "import archfem as af\n"
        f"case = af.Case.read({str(small_ring.folder / 'ring.toml')!r})\n"
        "vary = {'structure.thickness': [0.5, 0.6]}\n"
        "table = af.Study(case, vary, 'finders_of_tests:lengths').run(workers=2)\n"
        "print(table['twice'].values.tolist())\n"
    )
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert ran.stdout == "[1.0, 1.2]\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "endings",
    [(signal.SIGKILL,), (signal.SIGINT,), (signal.SIGINT, signal.SIGINT)],
    ids=["killed", "interrupted", "interrupted twice"],
)
def test_no_worker_outlives_a_driver_that_is_ended(small_ring, tmp_path, finders, endings):
    code = (
        f"import sys; sys.path.insert(0, {str(finders)!r})\n"
        "import archfem as af\n"
        f"case = af.Case.read({str(small_ring.folder / 'ring.toml')!r})\n"
        "find = {'name': 'finders_of_tests:slowly', 'seconds': 60.0}\n"
        "af.Study(case, {'motion.scale': [1.0, 2.0, 3.0]}, find).run(workers=2)\n"
    )
    command = [sys.executable, "-c", code]
    driver = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    begun, workers, until = [], [], time.monotonic() + 60.0
    while len(workers) < 2 and time.monotonic() < until:
        time.sleep(0.05)
        begun = children(driver.pid)
        workers = [worker for process in begun for worker in children(process)]
    assert len(workers) == 2
    time.sleep(0.2)
    for ending in endings:  # to all of them, as Ctrl-C in a terminal, but for a kill
        os.kill(driver.pid, ending) if len(endings) == 1 else os.killpg(driver.pid, ending)
        time.sleep(0.05)
    driver.wait(timeout=20.0)
    assert all_end([*begun, *workers], within=5.0)  # long before their points would


def test_lines_of_progress_are_of_the_slowest_motion_and_none_comes_twice(monkeypatch):
    """Two workers send how far they are; without it hundreds of lines said the same."""
    lines, pool = [], process_pool.WorkerPool(process_pool.TaskQueue([], None), 2, os.devnull)
    monkeypatch.setattr(result_store, "write_progress_line", lambda *line: lines.append(line[1]))
    monkeypatch.setattr(result_store, "PROGRESS_INTERVAL", 0.005)
    monkeypatch.setattr(_display, "MOTION_INTERVAL", 0.0)
    progress = result_store.Progress(2, 0, 0, name="pairs")
    for number, (name, time_reached) in enumerate([("first", 12.0), ("second", 3.0)]):
        worker = object.__new__(process_pool.Worker)
        worker.task, (worker.pipe, remote) = SimpleNamespace(number=number), Pipe()
        monkeypatch.setattr(_display, "send_progress", remote.send)
        with _display.ProgressReport(name, 20.0, rarely=True) as motion:
            motion.show(f"{time_reached:g} of 20 s", time_reached)
        assert pool._receive(worker) is None
        until = time.monotonic() + 10.0
        while not (lines and f"; {name}: " in lines[-1]) and time.monotonic() < until:
            time.sleep(0.01)
    time.sleep(0.05)
    pool.close()
    progress.close()
    assert lines[-1] == (
        "0 of 2 points done, 0 failed, time known when the first has ended, running; "
        "second: 3 of 20 s"
    )
    assert len(lines) == len(set(lines))
    assert not process_pool.reached


def test_repeated_warnings_are_counted(caplog):
    repeated = process_pool.RepeatedWarnings()
    repeated.log(["joint 1 slid by 2e-3 m", "joint 4 slid by 0.5 m", "an opening"])
    repeated.log_count()
    repeated.log(["joint 7 slid by 0.1 m"])
    repeated.log_count()
    assert [record.getMessage() for record in caplog.records] == [
        "joint 1 slid by 2e-3 m",
        "an opening",
        "1 more warning as above, of other runs, is not repeated",
        "2 more warnings as above, of other runs, are not repeated",
    ]


def test_a_point_is_given_up_after_three_workers_and_each_uses_one_thread(monkeypatch, tmp_path):
    assert process_pool.MAX_DEATHS_PER_POINT == 3
    given = []

    @contextmanager
    def limit_threads(limits):
        yield given.append(limits)

    monkeypatch.setattr(process_pool, "threadpool_limits", limit_threads)
    assert list(process_pool.evaluate_points([], None, workers=1)) == []
    version = process_pool.describe_version()
    assert process_pool.evaluate_batch([], None, version, tmp_path) == (version, [])
    assert process_pool.evaluate_batch([], None, "another", tmp_path) == (version, [])
    assert given == [1, 1]


def test_workers_search_modules_where_the_driver_does(monkeypatch):
    monkeypatch.setattr(sys, "path", ["", "/first", "/second"])
    with process_pool._isolate_start():
        assert os.environ["PYTHONPATH"].split(os.pathsep) == [os.getcwd(), "/first", "/second"]
