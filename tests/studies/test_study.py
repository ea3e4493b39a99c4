"""Studies: points, findings, one table, and going on where one was ended."""

import errno
import json
import os
import re
import subprocess
from contextlib import ExitStack, suppress
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats
from study_tables import equal_tables

import archfem as af
from archfem._netcdf import write_dataset
from archfem.cases import provenance
from archfem.cases.report.study_findings import collect_findings, tabulate_study
from archfem.cases.result_text import describe_collapse
from archfem.studies import parameter_axes, process_pool, result_store
from archfem.studies.evaluators import Evaluator, evaluate_limit, evaluate_rating
from archfem.studies.parameter_space import group_by_model
from archfem.studies.result_store import Store
from archfem.studies.shared_results import compute_once, share_results
from archfem.view import draw_findings


@pytest.fixture
def undo():
    """Calls to be made after the test."""
    with ExitStack() as stack:
        yield stack


def test_each_point_of_a_study_has_the_results_of_its_case_alone(small_ring, tmp_path):
    over = {"structure.thickness": [0.5, 0.6], "motion.scale": [0.5, 2.0]}
    found = af.Study(small_ring, over).run(workers=1)
    assert dict(found.sizes) == {"structure.thickness": 2, "motion.scale": 2}
    changes = ["structure.thickness=0.5", "motion.scale=2.0"]
    case = af.Case.read(small_ring.folder / "ring.toml", changes)
    alone = af.studies.of_history(
        af.cases.run_time_history(case, case.ground_motion(), af.cases.dead_load_of_case(case))
    )
    there = found.sel({"structure.thickness": 0.5, "motion.scale": 2.0})
    for name in ("eccentricity", "rotation", "verified", "largest_displacement"):
        assert float(there[name]) == pytest.approx(alone[name], rel=1e-6)
    units = {name: there[name].attrs.get("units") for name in ("slip", "rotation", "friction")}
    assert units == {"slip": "m", "rotation": "rad", "friction": None}
    assert {there[each].attrs["units"] for each in af.dynamics.MECHANISM_DEFINITIONS} == {"s"}
    assert (found["eccentricity"].diff("motion.scale") > 0.0).all()


def test_two_processes_and_one_give_the_same_bits(study_file, tmp_path):
    study = af.Study.read(study_file, own_code=True)
    one, two = (study.run(tmp_path / f"out{n}", workers=n) for n in (1, 2))
    xr.testing.assert_identical(one, two)
    assert equal_tables(tmp_path / "out1", tmp_path / "out2")
    failed = one["error"].sel({"structure.thickness": 1.0}).values
    assert set(failed) == {"RuntimeError: too thick for this test"}
    assert np.isnan(one["twice"].sel({"structure.thickness": 1.0})).all()
    assert one["rows"].dims == ("structure.thickness", "motion.scale", "entry")


def test_keys_with_spaces_are_coordinates_too(small_ring, tmp_path):
    axis = "contacts.stone_to_stone.friction"
    over = {"contacts.stone to stone.friction": [0.5, 0.6], "title": ["2 m"]}
    found = af.Study(small_ring, over, "dead load").run(tmp_path, workers=1)
    assert found[axis].values.tolist() == [0.5, 0.6]
    assert found["title"].values.tolist() == ["2 m"]  # a name, whatever it looks like
    assert af.studies.read_table(tmp_path / "results.nc").identical(found)


def test_plain_xarray_and_pandas_read_the_table(study_file, tmp_path):
    found = af.Study.read(study_file, own_code=True).run(tmp_path / "out", workers=1)
    with xr.open_dataset(tmp_path / "out" / "results.nc") as kept:
        assert kept["twice"].equals(found["twice"])
        assert kept.attrs["archfem"].startswith(f"{af.__version__}+")
    frame = pd.read_csv(tmp_path / "out" / "results.csv")
    assert len(frame) == 6
    assert frame["twice"].tolist()[:4] == [1.0, 1.0, 1.2, 1.2]
    assert af.studies.read_table(tmp_path / "out" / "results.nc").identical(found)


def test_finished_points_are_not_computed_again(study_file, tmp_path, monkeypatch):
    study = af.Study.read(study_file, own_code=True)
    folder = tmp_path / "out"
    first = study.run(folder, workers=1)
    numbers = []

    def counted(points, question):
        numbers.extend(number for number, _ in points)
        return iter([(number, {"found": {}, "error": "", "ours": True}) for number, _ in points])

    monkeypatch.setattr("archfem.studies.process_pool.evaluate_serially", counted)
    # points that failed for no reason of the case's own are tried again: numbers 4 and 5
    study.run(folder, workers=1)
    assert numbers == [4, 5]
    next(iter(folder.glob("points/*/*.json"))).unlink()
    numbers.clear()
    study.run(folder, workers=1)
    assert len(numbers) == 1
    assert set(first.data_vars) == {"twice", "voussoirs", "rows", "error"}


@pytest.mark.parametrize(
    "what", ["case", "record", "rewritten", "option", "helper", "version", "program"]
)
def test_a_changed_case_is_computed_anew(
    what, study_file, tmp_path, finders, at2, monkeypatch, caplog, undo
):
    at2(tmp_path / "a.at2", [0.1, 0.2, -0.1], 0.01)
    case = tmp_path / "ring.toml"
    case.write_text(case.read_text().replace("synthetic = {", 'file = "a.at2" # {'))
    folder = tmp_path / "out"
    before = af.Study.read(study_file, own_code=True)
    before.run(folder, workers=1)
    if what == "case":
        case.write_text(case.read_text().replace("radius = 3.0", "radius = 3.1"))
    elif what == "record":
        at2(tmp_path / "a.at2", [0.1, 0.2, -0.3], 0.01)
    elif what == "rewritten":  # of the same size and time, as by a program that keeps times
        record = tmp_path / "a.at2"
        then = record.stat()
        at2(record, [0.1, 0.3, -0.1], 0.01)
        os.utime(record, ns=(then.st_atime_ns, then.st_mtime_ns))
        assert record.stat().st_size == then.st_size
        assert record.stat().st_mtime_ns == then.st_mtime_ns
    elif what == "helper":  # beside the function that is called, in its module
        module = finders / "finders_of_tests.py"
        source = module.read_text()
        module.write_text(source.replace("0.9", "0.8"))
        undo.callback(module.write_text, source)
    elif what == "program":
        monkeypatch.setattr(provenance, "_hash_modules", lambda: "another")
    elif what == "option":
        study_file.write_text(
            study_file.read_text().replace("tests:lengths", "tests:lengths_again")
        )
    else:
        monkeypatch.setattr(af, "__version__", "0.1.0")
    after = af.Study.read(study_file, own_code=True)
    digests = [[study.evaluator.digest(point) for point in study.points]
               for study in (before, after)]  # fmt: skip
    if what in ("case", "option"):
        assert not set(digests[0]) & set(digests[1])
    assert len(Store(folder).load_rows(digests[1])) == 0
    with caplog.at_level("WARNING", logger="archfem"):
        after.run(folder, workers=1)
    assert "6 points of other cases" in caplog.text


@pytest.mark.parametrize("what", ["a digit", "found", "no table", "another point"])
def test_rows_that_were_changed_are_computed_again(what, study_file, tmp_path, caplog):
    study, folder = af.Study.read(study_file, own_code=True), tmp_path / "out"
    first = study.run(folder, workers=1)
    paths = sorted(folder.glob("points/*/*.json"))
    row, other, *_ = (path for path in paths if '"twice"' in path.read_text())
    before, content = row.read_text(), json.loads(row.read_text())
    done = af.studies.status(folder).done
    if what == "a digit":
        number = content["content"]["found"]["twice"]
        row.write_text(before.replace(f'"twice": {number}', f'"twice": {number + 0.1}'))
        assert row.read_text() != before
    elif what == "found":
        row.write_text(json.dumps({"found": "x", "error": "", "ours": True}))
    elif what == "no table":
        row.write_text("[1]")
    else:
        row.write_text(other.read_text())
    assert af.studies.status(folder).done == done - 1
    again = study.run(folder, workers=1)
    assert "1 of the stored points" in caplog.text
    assert again.identical(first)
    assert json.loads(row.read_text()) == content


@pytest.mark.slow
def test_no_file_of_a_study_stands_for_another(study_file, tmp_path):
    """Each is replaced by that of another study, and by others of its own: refused or redone."""
    folder, other = tmp_path / "a", tmp_path / "b"
    command = ["study", str(study_file), "--own-code", "--workers", "1", "--out"]
    assert af.commands.main([*command, str(folder)]) == 3
    assert af.commands.main([*command, str(other), "--set", "structure.voussoirs=11"]) == 3
    whole, others = (
        {path: path.read_bytes() for path in sorted(each.rglob("*")) if path.is_file()}
        for each in (folder, other)
    )
    kinds = {path.name if path.parent == folder else path.parts[-3]: path for path in whole}
    kinds = {kind: kinds[kind] for kind in ("archfem.json", "points", "results.nc")}
    counterparts = dict(zip(whole, others.items(), strict=True))
    swaps = 0
    for path, before in whole.items():
        for content in {counterparts[path][1], *(whole[source] for source in kinds.values())}:
            if content == before or path.name == "progress.json":
                continue
            path.write_bytes(content)
            swaps += 1
            with suppress(af.ArchfemError):
                af.studies.status(folder)
            if path.name in ("results.nc", "archfem.json"):
                with pytest.raises(af.InvalidInput, match=r"not the file|no list|damaged"):
                    af.studies.read_table(folder / "results.nc")
            assert af.commands.main([*command, str(folder)]) == 3
            for each in {*whole} - {folder / "progress.json"}:
                assert each.read_bytes() == whole[each], (path, each)
    assert swaps > 50


def test_a_shared_result_of_another_key_is_computed_again(tmp_path):
    with share_results(tmp_path / "shared"):
        assert [compute_once("runs", key, key.upper) for key in "ab"] == ["A", "B"]
        first, second = (tmp_path / "shared" / "runs").iterdir()
        second.write_bytes(first.read_bytes())
        again = [compute_once("runs", key, lambda: "again") for key in "ab"]
        assert sorted(again) in (["A", "again"], ["B", "again"])
        assert [compute_once("runs", key, lambda: "third") for key in "ab"] == again


def test_a_table_of_another_study_is_refused(study_file, tmp_path):
    for name, change in (("a", "motion.scale=1"), ("b", "structure.voussoirs=11")):
        af.Study.read(study_file, [change], own_code=True).run(tmp_path / name, workers=1)
    table = tmp_path / "a" / "results.nc"
    assert af.studies.read_table(table).identical(af.studies.read_table(table))
    table.write_bytes((tmp_path / "b" / "results.nc").read_bytes())
    with pytest.raises(af.InvalidInput, match="is not the file that archfem wrote there"):
        af.studies.read_table(table)


def test_a_second_driver_is_refused(study_file, tmp_path):
    folder = tmp_path / "out"
    with (
        Store(folder).lock(),
        pytest.raises(af.InvalidInput, match=rf"another command .*process {os.getpid()}"),
    ):
        af.Study.read(study_file, own_code=True).run(folder, workers=1)
    assert (
        not af.Study.read(study_file, own_code=True).run(folder, workers=1)["twice"].isnull().all()
    )


def test_a_full_disk_is_named_and_finished_points_stay(study_file, tmp_path, monkeypatch):
    folder, written = tmp_path / "out", []
    replace = os.replace

    def full(draft, path):
        written.append(path)
        if len(written) > 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(draft, path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(af.errors.StudyStopped, match=r"disk of .*out is full"):
            af.Study.read(study_file, own_code=True).run(folder, workers=1)
    kept = list(folder.glob("points/*/*.json"))
    assert 1 <= len(kept) < 6
    assert all(json.loads(path.read_text())["content"]["ours"] for path in kept)
    assert not list(folder.rglob(".*"))
    found = af.Study.read(study_file, own_code=True).run(folder, workers=1)
    assert found.identical(
        af.Study.read(study_file, own_code=True).run(tmp_path / "other", workers=1)
    )


@pytest.mark.slow
def test_a_changed_title_or_picture_recomputes_nothing(ring_file, tmp_path, monkeypatch):
    over, folder = {"structure.thickness": [0.5, 0.6]}, tmp_path / "out"

    def table(*changes, find="dead load"):
        case = af.Case.read(ring_file, ["record.every=1", *changes])
        return af.Study(case, over, find, title="one").run(folder, workers=1)

    first = table()
    evaluated = []
    original = process_pool.evaluate_serially

    def counted(points, evaluator):
        evaluated.append(len(points))
        return original(points, evaluator)

    monkeypatch.setattr(process_pool, "evaluate_serially", counted)
    assert table("title=other", "output.animation=true", "output.joints=[1]").identical(first)
    assert not evaluated
    table("record.every=2")  # the largest value of a run is that of its records
    assert evaluated == [2]
    assert len({title(table(f"title={word}", find=title)) for word in "ab"}) == 2


def title(found):
    """The title of a case, as a function of the user; or that of its first point."""
    if isinstance(found, af.Case):
        return {"name": found.title}
    return found["name"].values[0]


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_progress_is_reported_where_the_output_is_a_file(
    small_ring, finders, tmp_path, monkeypatch, capsys, workers
):
    monkeypatch.setattr(result_store, "PROGRESS_INTERVAL", 0.02)
    find = {"name": "finders_of_tests:slowly", "seconds": 0.08}
    over = {"structure.thickness": [0.5, 0.55, 0.6, 0.65, 0.7]}  # two workers end two at once
    af.Study(small_ring, over, find, title="thickness").run(workers=workers)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 2
    assert all(line.startswith("thickness: ") and "of 5 points done" in line for line in lines)
    assert any("0 failed" in line and "s remaining" in line for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_progress_of_a_range_is_reported_where_the_output_is_a_file(monkeypatch, capsys, workers):
    monkeypatch.setattr(result_store, "PROGRESS_INTERVAL", 0.02)
    column = af.column(breadth=0.5, heights=[1.0])
    motion = af.Motion.synthetic(duration=1.0, pga=1.0, seed=1)
    found = af.verdict_range(column, motion, samples=6, workers=workers)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 2
    total = found.dataset.sizes["run"]
    assert all(
        re.match(rf"range of .+: \d+ of {total} points done, 0 failed", line) for line in lines
    )


@pytest.mark.parametrize("workers", [1, 2])
def test_a_repeated_warning_is_logged_once(small_ring, finders, caplog, workers):
    over = {"structure.thickness": [0.5, 0.6, 0.7]}
    af.Study(small_ring, over, "finders_of_tests:noisy").run(workers=workers)
    said = [record.getMessage() for record in caplog.records]
    first = re.fullmatch(r"a joint had turned by (0\.[567]) rad", said[0])
    # either worker may be the first
    assert said[1] == f"another {first[1]}"
    assert workers == 2 or first[1] == "0.5"
    assert said[2:] == ["4 more warnings as above, of other runs, are not repeated"]


@pytest.mark.slow
def test_cases_and_findings_are_in_one_file(ring_file, low_resolution, tmp_path, capsys):
    path, folder = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(
        'title = "two measures"\ncompute = "limit"\nset = ["limit.horizontal=1.0"]\n'
        '[cases]\n"as it stands" = { case = "ring.toml" }\n'
        '"thicker" = { case = "ring.toml", set = ["structure.thickness=0.9"] }\n'
        '[vary]\nstructure.width = ["1 m", "150 cm"]\n'
    )
    command = ["study", str(path), "--out", str(folder), "--workers", "1"]
    assert af.commands.main(command) == 3  # with dilatancy a joint slides in each case
    said = capsys.readouterr().out
    assert said.count("in doubt: ") == 1
    assert "of which the first: joints slide" in said
    found = af.studies.read_table(folder / "results.nc")
    assert found["factor"].dims == ("case", "structure.width")
    assert found["structure.width"].values.tolist() == [1.0, 1.5]  # numbers in any notation
    assert found["structure.width"].attrs["units"] == "m"
    for name, changes in (("as it stands", []), ("thicker", ["structure.thickness=0.9"])):
        case = af.Case.read(ring_file, ["limit.horizontal=1.0", *changes])
        factor = case.limit.solve(case.structure).factor
        assert found["factor"].sel(case=name).values == pytest.approx(factor, rel=1e-9)
        assert f"{name:12}" in said
        assert f"{factor:.5g}" in said
    assert "structure.width [m]" in said
    assert (folder / "study.png").stat().st_size > 10_000
    sheet = pd.read_excel(folder / "results.xlsx")
    assert sheet["structure.width"].tolist() == [1.0, 1.5, 1.0, 1.5]
    assert sheet["factor"].to_numpy() == pytest.approx(found["factor"].values.ravel(), rel=1e-12)
    before = (folder / "results.xlsx").read_bytes()
    assert af.commands.main(command) == 3
    assert (folder / "results.xlsx").read_bytes() == before  # without the time of day


def test_pairs_that_another_worker_matches_are_left_for_later(small):
    over = {"analysis.dt": [0.005], "suite.pair": ["first", "second"]}
    points = list(enumerate(af.Study(af.Case.read(small), over, "dead load").points))
    tasks = process_pool.TaskQueue(points, Evaluator.of("dead load"))
    assert tasks.pop(None, (), {"first"}).pair == "second"
    assert tasks.pop(None, (), {"first"}).pair == "first"  # better than to wait


def test_a_boolean_key_is_drawn_and_printed_in_words(tmp_path):
    """Its column of the files has 0 and 1."""
    axes = parameter_axes({"motion.reversed": [True, False], "motion.scale": [1.0, 2.0, 3.0]})
    rows = [{"found": {"factor": 1.0 + k}, "error": ""} for k in range(6)]
    table = result_store.build_table(axes, rows, {}, {})
    assert table["motion.reversed"].values.tolist() == [1.0, 0.0]
    kept = af.studies.read_table(write_dataset(table, tmp_path / "results.nc", "table"))
    over_sense, over_scale = draw_findings(kept).axes
    assert [x.get_text() for x in over_sense.get_xticklabels()] == ["yes", "no"]
    assert [x.get_text() for x in over_scale.get_legend().get_texts()] == ["yes", "no"]
    first = result_store.format_table(kept).splitlines()[1]
    assert first.split() == ["yes", "1", "1"]
    assert tabulate_study(collect_findings("signs", "", kept)).rows[-1] == ["no", "3", "6"]


def test_a_long_table_is_cut_and_equal_findings_are_stated_once(small_ring):
    over = {"structure.thickness": ["0.5 m", "0.6 m", "0.7 m"]}

    def find(case):
        depth = case.structure.joints[0].depth
        return {"a": 1.5, "b": case.structure.weight, "c": float(depth > 0.55)}

    table = af.Study(small_ring, over, find).run(workers=1)
    lines = result_store.format_table(table, max_rows=2).splitlines()
    assert lines[0].split() == ["structure.thickness", "[m]", "b", "c"]
    assert [line.split()[::2] for line in lines[1:3]] == [["0.5", "0"], ["0.6", "1"]]
    assert lines[3:] == ["… 1 more points", "the same at all points: a = 1.5"]
    pushed = table.rename(b="least_push")
    lines = result_store.format_table(pushed, max_rows=1).splitlines()
    least = f"{float(table['b'][1:].min()):.5g}"
    assert lines[2] == f"… 2 more points, with a least push of {least}"
    for ended, loose in ("parted", True), ("finished", False):
        of_runs = table.assign(ended=table["c"].astype(str).where(table["c"] == 0.0, ended))
        text = result_store.format_table(of_runs)
        assert ("joints are those before its blocks were loose" in text) == loose


def test_a_table_that_no_sheet_can_hold_is_not_written_for_excel(tmp_path, monkeypatch):
    """A sheet has 2^20 rows, one of them for the names."""
    written = []

    def write(frame, path, **_):
        Path(path).touch()

    def write_sheet(frame, path):
        written.append(len(frame))
        write(frame, path)

    monkeypatch.setattr(result_store, "_write_sheet", write_sheet)
    for name in ("to_csv", "to_parquet"):
        monkeypatch.setattr(pd.DataFrame, name, write)
    store = result_store.Store(tmp_path)
    store.write_plan({"points": []})
    for rows in (2**20 - 1, 2**20):
        frame = pd.DataFrame(index=range(rows))
        monkeypatch.setattr(result_store, "_flatten", lambda table, frame=frame: frame)
        store.write_table(xr.Dataset())
    assert written == [2**20 - 1]


def test_the_study_files_of_the_documentation_are_read(tmp_path):
    root = Path(__file__).parents[2]
    page = (root / "docs/howto/studies.md").read_text(encoding="utf-8")
    files = [part.partition("```")[0] for part in page.split("```toml\n")[1:]]
    (tmp_path / "meshes").symlink_to(root / "meshes")
    counts = []
    for text in files:
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        counts.append(len(af.Study.read(tmp_path / "study.toml").points))
    assert counts == [3 * 64]


def test_cases_with_a_suite_are_computed_under_each_pair(small, tmp_path):
    path = tmp_path / "study.toml"
    cases = (
        f'[cases]\na = {{ case = "{small}" }}\nb = {{ case = "{small}", set = ["suite.scale=2"] }}'
    )
    path.write_text(f'compute = "history"\n{cases}\n[[vary]]\nanalysis.dt = "5 ms"\n')
    study = af.Study.read(path)
    assert study.axes[0].rows == tuple((c, p) for c in "ab" for p in ("first", "second"))
    assert [axis.name for axis in study.axes] == ["point", "variation"]
    path.write_text(f'compute = "history"\npairs = ["second"]\n{cases}\n')
    assert [dict(point.changes) for point in af.Study.read(path).points] == [
        {"suite.pair": "second"}
    ] * 2
    single = f'case = "{small}"\nvary.analysis.dt = [0.005, 0.01]\n'
    path.write_text(single)
    assert [axis.name for axis in af.Study.read(path).axes] == ["suite.pair", "analysis.dt"]
    path.write_text(f'compute = "comparison"\n{single}')
    study = af.Study.read(path)
    assert isinstance(study, af.studies.Comparison)
    table = study.run(workers=1)
    assert list(study.findings(table)) == ["analysis.dt = 0.005", "analysis.dt = 0.01"]
    assert all(len(finding.runs) == 2 for finding in study.findings(table).values())


@pytest.mark.slow
def test_status_states_the_progress_of_a_study(study_file, tmp_path, capsys):
    folder = tmp_path / "out"
    command = ["study", "--own-code", str(study_file), "--out", str(folder), "--workers", "1"]
    assert af.commands.main(command) == 3
    said = capsys.readouterr().out
    assert "in doubt: 2 of 6 points ended in RuntimeError: too thick" in said
    next(iter(folder.glob("points/*/*.json"))).unlink()
    assert af.commands.main(["study", "--status", str(folder)]) == 0
    assert "points done" in (said := capsys.readouterr().out)
    assert "not running" in said
    assert af.commands.main(["study", "--status", str(tmp_path / "none")]) == 1
    assert af.commands.main(["study", str(study_file)]) == 1
    assert "needs a file and a folder" in capsys.readouterr().err
    assert str(af.studies.Status(4, 2, 1, 0.5)).startswith("2 of 4 points done, 1 failed, 0.5 a")
    assert af.studies.Status(4, 2, 1, 0.5).remaining == pytest.approx(4.0)


@pytest.mark.slow
def test_an_interrupted_study_writes_the_table_of_what_is_done(
    study_file, tmp_path, monkeypatch, capsys
):
    """Two of six points are stored; before the first there is no table, and the rest continues."""
    folder, store, stored = tmp_path / "out", af.Study._store, []

    def stop(*given):
        if len(stored) == most:
            raise KeyboardInterrupt
        stored.append(given)
        store(*given)

    command = ["study", "--own-code", str(study_file), "--out", str(folder), "--workers", "1"]
    most, evaluate = 0, "archfem.studies.process_pool.evaluate_point"
    with monkeypatch.context() as patch:
        patch.setattr(evaluate, stop)
        assert af.commands.main(command) == 130
    assert not (folder / "results.csv").exists()
    monkeypatch.setattr(af.Study, "_store", stop)
    most = 2
    assert af.commands.main(command) == 130
    said = capsys.readouterr().out
    assert "in doubt: 3 of 6 points ended in an interruption of the study" in said
    text = (folder / "study.txt").read_text(encoding="utf-8")
    assert text.startswith("six rings, interrupted: 3 points are not computed\n")
    errors = pd.read_csv(folder / "results.csv")["error"].fillna("").tolist()
    assert errors == [""] * 3 + ["an interruption of the study"] * 3
    most = 9
    assert af.commands.main(command) == 3
    assert len(stored) == 6  # none twice
    assert (folder / "study.txt").read_text(encoding="utf-8").startswith("six rings\n")


def test_a_search_counts_its_runs(tmp_path):
    """Two of four motions took 10 runs each, in 40 s with 4 runs of the third: 16 are left."""
    known = {"running": True, "runs": 24, "run_rate": 24 / 40, "runs_left": 16.0}
    searched = af.studies.Status(4, 2, 0, 2 / 40, **known)
    assert searched.remaining == pytest.approx(16 / (24 / 40))
    assert "24 runs kept, 0.6 runs a second, 27 s remaining" in str(searched)
    begun = replace(searched, done=0, rate=0.0, runs_left=0.0)
    assert begun.remaining == inf
    assert "0.6 runs a second, time known when the first has ended" in str(begun)
    progress = result_store.Progress(4, 0, 0, None, tmp_path)
    (tmp_path / "runs").mkdir()
    for number in range(24):
        (tmp_path / "runs" / f"{number}.json").touch()
    for _ in range(2):
        progress.add(failed=False, runs=10)
    assert progress._status.runs_left == pytest.approx(16.0)
    progress.close()


@pytest.mark.parametrize("method", ["latin", "sobol"])
def test_samples_have_their_distribution_and_their_seed(small_ring, method):
    over = {
        "structure.thickness": stats.uniform(0.5, 0.2),
        "analysis": {"damping": {"ratio": {"distribution": "lognorm", "s": 0.3, "scale": 0.05}}},
        "motion.scale": [1.0, 2.0],
    }
    samples = {"count": 256, "method": method, "seed": 4}
    axes = parameter_axes(over, samples)
    assert [axis.name for axis in axes] == ["motion.scale", "sample"]
    assert axes[1].keys == ("structure.thickness", "analysis.damping.ratio")
    thickness, ratio = np.array(axes[1].rows).T
    assert thickness.mean() == pytest.approx(0.6, abs=2e-4)  # both fill space evenly
    assert np.median(ratio) == pytest.approx(0.05, rel=0.01)
    assert np.log(ratio).std() == pytest.approx(0.3, rel=0.02)
    assert abs(np.corrcoef(thickness, ratio)[0, 1]) < 0.1
    assert parameter_axes(over, samples)[1].rows == axes[1].rows
    assert parameter_axes(over, samples | {"seed": 5})[1].rows != axes[1].rows
    left_out = {key: value for key, value in samples.items() if key != "seed"}
    assert parameter_axes(over, left_out)[1] == parameter_axes(over, left_out | {"seed": 0})[1]
    study = af.Study(small_ring, over, "dead load", samples=samples)
    assert len(study.points) == 512


def test_points_may_be_listed(small_ring):
    points = [{"structure.thickness": 0.5}, {"structure.thickness": 0.6, "title": "other"}]
    study = af.Study(small_ring, points, "dead load")
    found = study.run(workers=1)
    assert found["structure.thickness"].dims == ("point",)
    assert found["title"].values.tolist() == ["", "other"]
    assert study.points[1].case.title == "other"


def test_a_study_varies_pairs_of_a_suite(small):
    case = af.Case.read(small)
    found = af.Study(case, {"suite.pair": ["first", "second"]}).run(workers=1)
    run = af.cases.run_time_history(
        case, case.alone("second").ground_suite().motions[0], af.cases.dead_load_of_case(case)
    )
    alone = af.studies.of_history(run)["eccentricity"]
    assert float(found["eccentricity"].sel({"suite.pair": "second"})) == pytest.approx(
        alone, rel=1e-6
    )
    assert (
        af.Study(case, {"model.quadrature_points": [3]})
        .run()["error"]
        .item()
        .startswith("InvalidInput: the suite has 2 pairs")
    )


def test_limit_analysis_needs_no_pairs(small, tmp_path):
    """Each pair of a suite is a point of a history, and none of what has no motion."""
    path = tmp_path / "study.toml"
    text = (
        'case = "small.toml"\nset = ["limit.horizontal=1.0"]\nvary.structure.breadth = [1.0, 2.0]\n'
    )
    alone = ("limit", "rating", "assessment", "dead load")
    for compute, points in (*((each, 2) for each in alone), ("history", 4)):
        path.write_text(f'{text}compute = "{compute}"\n')
        assert len(af.Study.read(path).points) == points


@pytest.mark.slow
def test_a_study_of_ratings_has_the_factors_of_rate(small, monkeypatch):
    monkeypatch.setattr(af.limit.rating, "_places_along", lambda *_: (0.2, 0.6))
    axle = '{ name = "axle", axles = ["10 kN"], live = 1.5, impact = 1.2 }'
    case = af.Case.read(small, [f"rating.vehicle={axle}"])
    table = af.Study(case, {"rating.dead": [1.0, 2.0]}, "rating").run(workers=1)
    for dead, factor in zip((1.0, 2.0), table["factor"].values, strict=True):
        vehicle = af.limit.Vehicle("axle", (10e3,), live=1.5, impact=1.2)
        assert factor == af.rate(case.structure, vehicle, dead=dead).factor


@pytest.mark.slow
def test_a_study_of_assessments_has_the_least_margin_of_assess(tmp_path, capsys):
    """What a tie gains is a study; stones crush there as by the command."""
    column = '[structure]\nshape = "column"\nbreadth = 0.6\nheights = [2.0, 1.0]\nwidth = 1.0\n'
    code = '{ code = "NTC-2018", ag = 0.2, f0 = 2.4, tc_star = 0.3, site = "B" }'
    text = f'{column}[assessment]\nspectrum = {code}\n[materials.stone]\nstrength = "1 MPa"\n'
    (tmp_path / "column.toml").write_text(text)
    tie = '{ block = 1, point = [0.0, 1.9], force = ["10 kN", "0 kN"], passive = true }'
    given = {"bare": [], "tied": [f"assessment.loads=[{tie}]"]}
    cases = "\n".join(f"{name} = {{ set = {changes} }}" for name, changes in given.items())
    (tmp_path / "study.toml").write_text(
        f'case = "column.toml"\ncompute = "assessment"\n[cases]\n{cases}\n'
    )
    table = af.Study.read(tmp_path / "study.toml").run(workers=1)
    for name, changes in given.items():
        file = str(tmp_path / "column.toml")
        sets = [word for each in changes for word in ("--set", each)]
        ended = af.commands.main(["assess", file, *sets])
        said = capsys.readouterr().out
        assert ended == (3 if "in doubt: " in said else 0)
        margin = float(re.search(r"least margin ([\d.]+)", said)[1])
        found = table.sel(case=name)
        assert found["least_margin"].item() == pytest.approx(margin, rel=5e-3)
        assert found["doubts"].item() == said.count("in doubt: ")
    bare, tied = table["alpha_0"].values
    # of a weight of 36 kN on 1 m the edge crushes by N / (2 w f)
    assert bare == pytest.approx((0.3 - 36e3 / 2e6) / 1.5, rel=1e-9)
    assert tied == pytest.approx(bare)  # the tie pulls to the right, and holds one sense alone


@pytest.mark.slow
def test_a_study_of_ratings_states_those_without_backing(monkeypatch):
    """The factor without the backing is that of a case that has none, here far below."""
    monkeypatch.setattr(af.limit.rating, "_places_along", lambda *_: (3.5, 4.5))
    arch = {"span": "5 m", "rise": "1.8 m", "thickness": "0.35 m", "voussoirs": 9}
    wall = {"length": "2 m", "height": "1.5 m", "state": "fixed"}
    given = {
        "structure": {
            **{"shape": "bridge", "width": "3 m", "arches": {"arch": arch}},
            **{"sidewalls": {"left": wall, "right": wall}, "backfill": {"cover": "0.4 m"}},
        },
        "rating": {"vehicle": {"name": "axle", "axles": ["10 kN"], "live": 1.5, "impact": 1.2}},
        "limit": {"strength": "5 MPa"},
    }
    strength = {"friction_angle": "30 degree"}
    found = {}
    for name, fill in (("backed", strength | {"backing_height": "1 m"}), ("bare", strength)):
        case = af.Case.of(given | {"limit": given["limit"] | {"fill": fill}})
        found[name] = evaluate_rating(case)
    backed, bare = found.values()
    assert backed["without_backing"] == pytest.approx(bare["factor"], rel=1e-6)
    assert backed["without_either"] == pytest.approx(bare["without_pressure"], rel=1e-6)
    assert backed["without_pressure"] > 1.1 * backed["without_either"]
    assert "without_backing" not in bare


def test_pairs_that_all_fail_have_their_errors(small, tmp_path, monkeypatch):
    case, errors = af.Case.read(small), ["no first equilibrium", "nor a second"]
    table = xr.Dataset({"error": ("suite.pair", errors)})
    monkeypatch.setattr(af.Study, "run", lambda *_, **__: table)
    assert af.studies.study.compute_pairs(case, tmp_path) == errors
    ended = table.assign(ended=("suite.pair", ["", "interrupted"]), error=("suite.pair", ["a", ""]))
    monkeypatch.setattr(af.Study, "run", lambda *_, **__: ended)
    assert af.studies.study.compute_pairs(case, tmp_path) == ["a", "interrupted"]


def test_values_may_be_an_array(small_ring):
    study = af.Study(small_ring, {"structure.thickness": np.array([0.5, 0.6])}, "dead load")
    assert [dict(point.changes)["structure.thickness"] for point in study.points] == [0.5, 0.6]


@pytest.mark.slow
def test_a_state_that_was_not_found_is_no_number(ring_file, tmp_path, capsys, monkeypatch):
    """Its factor is undefined and its bound known: the associated factor of the static theorem."""
    monkeypatch.setattr("archfem.limit.nonassociated.find_solution", lambda *_, **__: None)
    monkeypatch.setattr("archfem.limit.nonassociated.descend", lambda *_, **__: [])
    path, folder = tmp_path / "study.toml", tmp_path / "out"
    push = "limit.horizontal=1.0"
    path.write_text(
        f'case = "ring.toml"\ncompute = "limit"\nset = ["{push}"]\n'
        '[vary]\nlimit.friction = ["nonassociated", "coulomb"]\n'
    )
    assert af.commands.main(["study", str(path), "--out", str(folder), "--workers", "1"]) == 3
    words = "limit.friction = nonassociated: no state without dilatancy was found; it is at most"
    assert f"in doubt: {words} 0.6713 g" in capsys.readouterr().out
    table = af.studies.read_table(folder / "results.nc")
    assert all(table["doubts"] == 2)  # in either sense; with dilatancy a joint slides
    case = af.Case.read(ring_file, [push])
    bound = case.limit.solve(case.structure).factor
    assert table["factor"].values == pytest.approx([np.nan, bound], nan_ok=True)
    assert table["push"].values == pytest.approx([np.nan, bound], nan_ok=True)
    assert table["factor_at_most"].values[0] == pytest.approx(bound)


@pytest.mark.slow
def test_what_is_not_proved_least_is_marked(tmp_path, capsys):
    """As the command marks each case: a stack of stones is proved, a bond is not."""
    limit = '[limit]\nhorizontal = 1.0\nfriction = "nonassociated"\ndemand = "1 g"\n'
    shapes = {
        "stack": 'shape = "column"\nbreadth = 1.0\nheights = [1.0, 1.0]\n',
        "bond": 'shape = "wall"\nbreadth = 0.5\nheight = 0.6\nstone = 0.5\n'
        "course = 0.3\nwidth = 0.5\n",
    }
    path, folder, cases = tmp_path / "study.toml", tmp_path / "out", ""
    for name, keys in shapes.items():
        (tmp_path / f"{name}.toml").write_text(f"[structure]\n{keys}{limit}")
        cases += f'{name} = {{ case = "{name}.toml" }}\n'
    path.write_text(f'compute = "limit"\n[cases]\n{cases}')
    af.commands.main(["study", str(path), "--out", str(folder), "--workers", "1"])
    text = capsys.readouterr().out
    read = [af.Case.read(tmp_path / f"{name}.toml") for name in shapes]
    said = [case.limit.solve(case.structure).sentence for case in read]
    assert ["≤" in each for each in said] == [False, True]
    table = af.studies.read_table(folder / "results.nc")
    assert table["factor"].dtype.kind == "f"
    stack, bond = (float(each) for each in table["push"])
    rows = [re.split(r"\s{2,}", line) for line in text.splitlines()[2:5]]
    shown = [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]
    for name in ("factor", "push [g]", "least_push [g]", "least_push_over_site"):
        assert [row[name] for row in shown] == [f"{stack:.5g}", f"≤ {bond:.5g}"]
    assert f"; 'bond', at ≤ {bond:.3g} of it" in text
    found = collect_findings("", "", table)
    assert [row[1] for row in tabulate_study(found).rows] == [f"{stack:.3g}", f"≤ {bond:.3g}"]


def test_bonds_that_yield_prove_no_least_push(tmp_path):
    """A mortared block on its bed, in the words of its limit analysis; the least stands first."""
    path = tmp_path / "bonded.toml"
    path.write_text(
        '[structure]\nshape = "column"\nbreadth = 1.0\nheights = [2.0]\ncontact = "mortar"\n'
        '[contacts.mortar]\nnormal_stiffness = "1 MPa/mm"\nshear_stiffness = "1 MPa/mm"\n'
        'friction = 0.6\ntension = "50 kPa"\ncohesion = "60 kPa"\n'
        '[limit]\nhorizontal = 1.0\nfriction = "nonassociated"\n'
    )
    case = af.Case.read(path)
    found = evaluate_limit(case)
    assert [*found][:2] == ["least_push", "factor"]
    assert {*found["upper_bounds"].split(", ")} == {"factor", "push", "least_push"}
    text = describe_collapse(case.structure, case.limit.solve(case.structure), case.limit)
    assert "\nif bonds yield: proved the least" in text
    dry = af.Case.read(path, ["contacts.mortar.tension=0", "contacts.mortar.cohesion=0"])
    assert "upper_bounds" not in evaluate_limit(dry)
    text = describe_collapse(dry.structure, dry.limit.solve(dry.structure), dry.limit)
    assert "\nproved the least" in text


def test_a_case_above_the_tables_is_that_of_those_that_name_none(tmp_path):
    for name, thickness in (("ring", 0.5), ("thin", 0.4)):
        text = f'[structure]\nshape = "circular_arch"\nradius = 2.0\nthickness = {thickness}\n'
        (tmp_path / f"{name}.toml").write_text(f"{text}embrace = 150.0\nvoussoirs = 5\n")
    tables = (
        '[cases.a]\n[cases.b]\ncase = "thin.toml"\n[cases.c]\nset = ["structure.thickness=0.3"]'
    )
    (tmp_path / "study.toml").write_text(f'case = "ring.toml"\ncompute = "limit"\n{tables}\n')
    points = af.Study.read(tmp_path / "study.toml").points
    assert [point.case.structure.depths.max() for point in points] == pytest.approx([0.5, 0.4, 0.3])


GOOD = 'case = "ring.toml"\ncompute = "dead load"\n'
RANDOM = "vary.structure.thickness = { distribution = 'norm', loc = 0.5, scale = 0.01 }\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (GOOD, 'study.toml: it says nothing of vary: write case = "file.toml" and vary'),
        (f"{GOOD}[cases]", r'study.toml: it has no cases: write \[cases."name"\] with case ='),
        ("[cases.a]", "study.toml: cases.a names no case file"),
        ("[structure]", "study.toml: this is a case: name it in the file of a study"),
        (f"{GOOD}find = 'limit'", "study.toml: unknown key 'find'"),
        (f"{GOOD}scales = true\nvary.title = ['a']", "scales is the search of a comparison"),
        (f"{GOOD}pairs = ['a']\nvary.title = ['a']", "needs none: take pairs out"),
        ("vary.structure.thickness = [0.5]", "says nothing of case"),
        (f"{GOOD}vary.structure.thicknes = [0.5]", "did you mean 'thickness'"),
        (f"{GOOD}vary.structure.thickness = []", "thickness is empty: a product"),
        (f"{GOOD}vary = []", "list of points is empty"),
        (f"{GOOD}vary = {{}}", "varies nothing: give a table of keys"),
        (f"{GOOD}vary.structure.thickness = 0.5", "give a list of values, or a distribution"),
        (f"{GOOD}vary.structure.thickness = [0.5, -0.5]", "thickness = -0.5 is no case"),
        (f"{GOOD}vary.structure.thickness = [0.5, 0.6, 100.0]", "thickness = 100.0 is no case"),
        (f"{GOOD}{RANDOM}", "say how they are sampled"),
        (f"{GOOD}{RANDOM}samples = {{ count = 12, method = 'sobol' }}", "powers of 2 alone"),
        (f"{GOOD}{RANDOM}samples = {{ count = 8, method = 'halton' }}", "use one of"),
        (f"{GOOD}{RANDOM}samples = {{ number = 8 }}", "unknown key 'samples.number'"),
        (f"{GOOD}{RANDOM.replace('norm', 'nrm')}samples.count = 8", "no distribution 'nrm'"),
        (f"{GOOD}{RANDOM.replace('loc', 'mean')}samples.count = 8", "does not take"),
        (f"{GOOD}{RANDOM.replace('0.01', '-1.0')}samples.count = 8", "that are no numbers"),
        (f"{GOOD}samples.count = 8\n[vary]\nstructure.thickness = [0.5]", "there are none"),
        (
            f"{GOOD}samples.count = 16\n[vary.contacts.'stone to stone']\nnormal_stiffness = "
            "{ distribution = 'norm', loc = 1e9, scale = 1e9 }",
            "normal_stiffness = -.* is no case",
        ),
        (f"{GOOD}vary.suite.pair = ['a']", "has no \\[suite\\]"),
        (f"{GOOD.replace('dead load', 'ded load')}vary.title = ['a']", "did you mean 'dead load'"),
        (
            f"{GOOD.replace('dead load', 'no_module:f')}vary.title = ['a']",
            "is code, which no file runs by itself",
        ),
        (
            f"{GOOD.replace(chr(34) + 'dead load' + chr(34), '{ name = chr, x = 1 }')}"
            "vary.title = ['a']",
            "is not TOML",
        ),
    ],
)
def test_invalid_studies_are_refused(text, says, ring_file):
    path = ring_file.with_name("study.toml")
    path.write_text(text)
    with pytest.raises(af.InvalidInput, match=says):
        af.Study.read(path)


def test_findings_that_cannot_be_kept(small_ring):
    over = {"structure.thickness": [0.5]}
    found = af.Study(small_ring, over, lambda case: {"x": {"y": 1}}).run(workers=1)
    assert "finding 'x' is a dict" in found["error"].item()
    with pytest.raises(af.InvalidInput, match="does not take"):
        af.Study(small_ring, over, {"name": "scales", "precisions": 0.1})
    study = af.Study(small_ring, {"structure.thickness": [0.5, 0.6]}, lambda case: {})
    with pytest.raises(af.InvalidInput, match="cannot be handed to another process"):
        study.run(workers=2)
    with pytest.raises(af.InvalidInput, match="workers = 0 is not a whole number"):
        study.run(workers=0)


def test_the_job_for_slurm_in_the_documentation_is_a_script(tmp_path):
    page = (Path(__file__).parents[2] / "docs/howto/studies.md").read_text(encoding="utf-8")
    job = tmp_path / "job.sh"
    job.write_text(page.partition("```bash\n")[2].partition("```")[0])
    subprocess.run(["bash", "-n", str(job)], check=True)
    assert "dask scheduler" in job.read_text()


def test_a_file_runs_no_code_without_permission(study_file, tmp_path, capsys):
    """A module beside the file would run as it is imported."""
    mark = tmp_path / "ran"
    (tmp_path / "beside.py").write_text(f"import pathlib\npathlib.Path({str(mark)!r}).touch()\n")
    for find in ('"beside:found"', '{ name = "beside:found" }'):
        text = study_file.read_text().replace('"finders_of_tests:lengths"', find)
        study_file.with_name("hostile.toml").write_text(text)
        with pytest.raises(af.InvalidInput, match="is code, which no file runs by itself"):
            af.Study.read(study_file.with_name("hostile.toml"))
        command = ["study", str(study_file.with_name("hostile.toml")), "--out", str(tmp_path / "o")]
        assert af.commands.main(command) == 1
        assert "--own-code" in capsys.readouterr().err
    assert not mark.exists()


def test_no_spreadsheet_computes_a_cell_of_a_table(small_ring, tmp_path):
    over = {"title": ["=1+1", "@SUM(A1)", "plain"], "motion.scale": [-1.0]}
    af.Study(small_ring, over, "dead load").run(tmp_path, workers=1)
    frame = pd.read_csv(tmp_path / "results.csv")
    assert frame["title"].tolist() == ["'=1+1", "'@SUM(A1)", "plain"]
    assert frame["motion.scale"].tolist() == [-1.0, -1.0, -1.0]


def test_points_of_one_model_are_taken_together(small_ring):
    over = {"motion.scale": [0.1, 0.2], "structure.thickness": [0.5, 0.6]}
    points = list(enumerate(af.Study(small_ring, over, "dead load").points))
    sorted_points = group_by_model(points)
    thick = [dict(point.changes)["structure.thickness"] for _, point in sorted_points]
    assert thick == [0.5, 0.5, 0.6, 0.6]
    assert [number for number, _ in sorted_points] == [0, 2, 1, 3]
    assert sorted(sorted_points, key=lambda pair: pair[0]) == points


def test_a_free_worker_continues_with_the_model_that_it_has(small_ring):
    over = {"motion.scale": [0.1, 0.2, 0.3], "structure.thickness": [0.5, 0.6, 0.7]}
    points = list(enumerate(af.Study(small_ring, over, "dead load").points))
    tasks = process_pool.TaskQueue(points, Evaluator.of("dead load"))
    first = tasks.pop(None, set())
    other = tasks.pop(None, {first.model})
    assert other.model != first.model
    taken = [first, *(tasks.pop(first.model, {other.model}) for _ in range(2))]
    assert {task.model for task in taken} == {first.model}
    third = tasks.pop(first.model, {other.model})
    assert third.model not in (first.model, other.model)
    tasks.put_back(third)
    rest = [tasks.pop(other.model, {third.model}) for _ in range(5)]
    assert [task.model for task in rest] == 2 * [other.model] + 3 * [third.model]
    assert sorted(task.number for task in (*taken, other, *rest)) == list(range(9))
    assert not tasks
