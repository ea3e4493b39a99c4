"""Studies on a scheduler of Dask: the same rows, and errors of ours where it fails."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import pytest
from study_tables import equal_tables

import archfem as af
from archfem.studies.cluster import _evaluate
from archfem.studies.result_store import Store

distributed = pytest.importorskip("distributed")


def local_cluster(workers):
    """A scheduler and workers in this process."""
    options = {"threads_per_worker": 1, "processes": False, "dashboard_address": None}
    return distributed.LocalCluster(n_workers=workers, **options)


@pytest.fixture
def client():
    """A scheduler and two workers in this process."""
    with local_cluster(2) as cluster, distributed.Client(cluster) as client:
        yield client


@contextmanager
def cluster(folder, workers=2, preload=None):
    """A scheduler and workers as processes of their own; gives the address, and the processes."""
    path = os.pathsep.join(each or os.getcwd() for each in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}
    file = folder / "scheduler.json"

    def started(*words):
        command = [sys.executable, "-m", "dask", *words, "--scheduler-file", str(file)]
        command += ["--no-dashboard"]
        log = (folder / f"{words[0]}.log").open("a")
        return subprocess.Popen(command, env=environment, stdout=log, stderr=log)

    processes = [started("scheduler", "--host", "127.0.0.1", "--port", "0")]
    try:
        while not file.exists() or not file.stat().st_size:
            assert processes[0].poll() is None
            time.sleep(0.1)
        more = ["--preload", str(preload)] if preload else []
        processes += [
            started("worker", "--nthreads", "1", "--no-nanny", *more) for _ in range(workers)
        ]
        with file.open() as text:
            yield json.load(text)["address"], processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_client_gives_the_rows_that_processes_give(study_file, tmp_path, client):
    study = af.Study.read(study_file, own_code=True)
    found = study.run(tmp_path / "out", client=client)
    assert found.identical(study.run(tmp_path / "serial", workers=1))
    assert equal_tables(tmp_path / "out", tmp_path / "serial")


@pytest.mark.slow
def test_an_analysis_of_blocks_is_varied_on_a_cluster_and_on_processes(tmp_path, client):
    """A structure of Python, whose joints are not those of any preset, travels whole."""
    wall = af.column(breadth=0.6, heights=[1.0, 1.0], contact=af.Contact(3e9, 1e9, friction=0.4))
    moved = replace(wall, joints=(replace(wall.joints[0], name="foot"), *wall.joints[1:]))
    analysis = af.Analysis(moved, fidelity="rigid")
    study = af.Study(analysis, vary={"structure.width": [1.0, 2.0]})
    found = study.run(tmp_path / "out", client=client)
    assert found.identical(study.run(workers=2))
    assert found["frequency"].values[0] == analysis.modes(1).frequencies[0]
    # the weight of the upper stone, for the whole width
    assert found["N"].values == pytest.approx([12e3, 24e3], rel=1e-9)


@pytest.mark.slow
def test_a_pair_is_matched_once_on_a_cluster(matching_study, tmp_path, client):
    study, marks = matching_study(tmp_path / "marks")
    found = study.run(tmp_path / "out", client=client)
    assert sorted(mark.name[0] for mark in marks.iterdir()) == list("abc")
    serial, _ = matching_study(tmp_path / "serial")
    assert (found["mean"].values == serial.run(workers=1)["mean"].values).all()


def test_a_worker_of_another_version_is_named(study_file, monkeypatch):
    """It is the only one, of a scheduler that is given by its address."""
    monkeypatch.setattr("archfem.studies.cluster.describe_version", lambda: "9.9.9")
    says = r"a worker runs archfem .*, this is 9\.9\.9: install"
    with local_cluster(1) as cluster, pytest.raises(af.InvalidInput, match=says):
        af.Study.read(study_file, own_code=True).run(client=cluster.scheduler_address)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "no address"])
def test_a_dead_scheduler_is_named(study_file, monkeypatch, address):
    monkeypatch.setattr("archfem.studies.cluster.SCHEDULER_TIMEOUT", 0.2)
    with pytest.raises(
        af.InvalidInput, match=r"no scheduler .*answers at .*start 'dask scheduler'"
    ):
        af.Study.read(study_file, own_code=True).run(client=address)


def test_without_dask_the_extra_is_named(study_file, monkeypatch):
    monkeypatch.delitem(sys.modules, "archfem.studies.cluster", raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(af.InvalidInput, match=r"pip install 'archfem\[cluster\]'"):
        af.Study.read(study_file, own_code=True).run(client="tcp://127.0.0.1:1")


@pytest.mark.slow
def test_scheduler_and_workers_as_processes(study_file, tmp_path, capsys):
    with cluster(tmp_path) as (address, _):
        command = ["study", "--own-code", str(study_file), "--out", str(tmp_path / "out")]
        assert af.commands.main([*command, "--scheduler", address]) == 3
    af.Study.read(study_file, own_code=True).run(tmp_path / "serial", workers=1)
    assert equal_tables(tmp_path / "out", tmp_path / "serial")


@pytest.mark.slow
def test_a_scheduler_that_dies_leaves_the_finished_rows(small_ring, finders, tmp_path, monkeypatch):
    monkeypatch.setattr("archfem.studies.cluster.SCHEDULER_TIMEOUT", 20.0)
    over = {"structure.thickness": [0.5 + 0.01 * k for k in range(12)]}
    find = {"name": "finders_of_tests:slowly", "seconds": 0.5}
    study, folder = af.Study(small_ring, over, find), tmp_path / "out"
    with cluster(tmp_path) as (address, processes):
        original = Store.write_row

        def write_row(self, digest, row):
            original(self, digest, row)
            if processes[0].poll() is None and len(self.digests()) >= 3:
                processes[0].kill()

        monkeypatch.setattr(Store, "write_row", write_row)
        with pytest.raises(af.errors.StudyStopped, match="scheduler was lost"):
            study.run(folder, client=address)
    assert 3 <= len(Store(folder).digests()) < 12
    monkeypatch.setattr(Store, "write_row", original)
    assert study.run(folder, workers=1).identical(study.run(workers=1))


@pytest.mark.slow
def test_a_worker_that_ends_is_reported(small_ring, finders, tmp_path, monkeypatch, caplog):
    over = {"structure.thickness": [0.5 + 0.01 * k for k in range(12)]}
    find = {"name": "finders_of_tests:slowly", "seconds": 0.5}
    study = af.Study(small_ring, over, find)
    with cluster(tmp_path) as (address, processes):
        original = Store.write_row

        def write_row(self, digest, row):
            original(self, digest, row)
            if len(self.digests()) == 3:
                processes[1].kill()

        monkeypatch.setattr(Store, "write_row", write_row)
        table = study.run(tmp_path / "out", client=address)
    assert not table["error"].values.astype(bool).any()
    assert "1 workers of the scheduler ended (tcp://" in caplog.text


@pytest.mark.slow
def test_a_process_of_another_version_is_named(study_file, tmp_path):
    preload = tmp_path / "older.py"
    preload.write_text("import archfem\narchfem.__version__ = '0.1.0'\n")
    with (
        cluster(tmp_path, 1, preload) as (address, _),
        pytest.raises(af.InvalidInput, match=r"a worker runs archfem 0\.1\.0"),
    ):
        af.Study.read(study_file, own_code=True).run(client=address)


@pytest.mark.parametrize(
    ("count", "size"), [(10, 1), (239, 1), (240, 2), (1200, 10), (50_000, 200)]
)
def test_workers_take_forty_batches_each_of_two_hundred_points_at_most(count, size, tmp_path):
    """There are two workers, one with two threads."""
    sizes = []

    def submit(function, batch, *given, **options):
        sizes.append(len(batch))
        raise OSError("made to end")

    client = SimpleNamespace(nthreads=lambda: {"one": 1, "two": 2}, submit=submit)
    with pytest.raises(af.errors.StudyStopped):
        next(_evaluate([(k, None) for k in range(count)], None, client, tmp_path))
    assert sizes == [size]
