"""Files of result folders."""

import json
import os
import shutil
from hashlib import sha256
from pathlib import Path

import pytest
import xarray as xr

import archfem as af
from archfem._files import read_file_list, replace_results, write_sealed_json
from archfem.cases import result_folder as results
from archfem.cases import run as run_module
from archfem.cases.answers import NO_DEMAND
from archfem.cases.run import carry_out, link_file, replace_run, run_time_history
from archfem.cases.toml_file import format_tables


def test_more_pairs_than_colours_share_several_pictures(small):
    rest, _, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    runs = {str(number): run.history for number in range(7)}
    files = results.pair_files(runs, rest, "a table")
    assert list(files) == ["suite.txt", "envelope.png", "envelope_2.png"]


CASE = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0]
[model]
fidelity = "rigid"
[suite.pairs]
first = { synthetic = { seed = 1, duration = 0.3, pga = 1.0 } }
second = { synthetic = { seed = 2, duration = 0.3, pga = 1.0 } }
"""


def run_into(folder, small, change):
    """Carry out a suite of two pairs as `archfem run` does; its figures are texts."""
    case = af.Case.read(small, [change, "record.fields_every=10"])
    with replace_run(case, folder) as draft:
        for result in carry_out(case, draft):
            if isinstance(result, af.cases.Run):
                result.path.with_name("summary.txt").write_text(f"{change}: {result.motion.name}")
                result.path.with_name("envelope.png").write_text(change)
        (draft / "suite.txt").write_text(change)
        (draft / "limit.txt").write_text(change)
    inputs = read_file_list(folder)["run"].inputs
    with replace_results(folder, "modes", inputs) as draft:
        (draft / "modes.txt").write_text(change)
    return case


def test_other_commands_write_while_a_page_is_drawn(small, tmp_path):
    """But a page of results that were replaced meanwhile is refused."""
    run_into(tmp_path, small, "suite.scale=1")
    opened, own = results.open_results(tmp_path), read_file_list(tmp_path)["run"].inputs

    def write_beside(path, command="verdict", inputs=own):
        with replace_results(tmp_path, command, inputs) as draft:
            name = "case.toml" if command == "run" else f"{command}.txt"
            (draft / name).write_text("words")
        Path(path).write_text("a page")
        return Path(path)

    assert opened._write("report", write_beside, None).read_text() == "a page"
    assert (tmp_path / "verdict.txt").read_text() == "words"
    assert "report.html" in read_file_list(tmp_path)["report"].files
    with pytest.raises(af.InvalidInput, match="other results now"):
        opened._write("report", lambda path: write_beside(path, "run", "others"), None)
    assert "report" not in read_file_list(tmp_path)


@pytest.fixture(scope="module", autouse=True)
def undoubted_runs():
    """Runs are not compared with finer ones, which test_run.py tests: a third of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("archfem.cases.run.doubt_fidelity", lambda *_: [])
        yield


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory):
    """Folder with the folders of two runs that differ in the scale of the motions."""
    folder = tmp_path_factory.mktemp("runs")
    case = folder / "small.toml"
    case.write_text(CASE)
    for scale in (1, 2):
        run_into(folder / f"scale {scale}", case, f"suite.scale={scale}")
    return folder


@pytest.fixture
def two_runs(carried_out, tmp_path):
    """Copies of them."""
    folder = Path(shutil.copytree(carried_out, tmp_path / "runs"))
    return [folder / f"scale {scale}" for scale in (1, 2)]


def files_below(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_no_reader_takes_a_file_of_another_run(two_runs, capsys):
    """Each file in turn is replaced by that of the other run."""
    folder, other = two_runs
    names = sorted(files_below(folder))
    assert len(names) == 11
    for name in names:
        kept = (folder / name).read_bytes()
        (folder / name).write_bytes((other / name).read_bytes())
        assert af.commands.main(["report", str(folder)]) == 1
        said = capsys.readouterr().err
        assert "is not the file that archfem wrote" in said, name
        if name.endswith(("history.nc", ".json")):
            path = folder / name if name.endswith("history.nc") else folder / "first" / "history.nc"
            with pytest.raises(af.InvalidInput, match="is not the file that archfem wrote"):
                af.History.read(path)
            assert af.commands.main(["animate", str(path)]) == 1
        elif name == "case.toml":
            assert af.commands.main(["animate", str(folder / "first" / "history.nc")]) == 1
        (folder / name).write_bytes(kept)
    assert af.cases.open_results(folder).missing == ()


def test_saving_replaces_no_file_of_a_run(two_runs, tmp_path):
    folder, _ = two_runs
    path = folder / "first" / "history.nc"
    before, history = path.read_bytes(), af.History.read(path)
    with pytest.raises(af.InvalidInput, match="is a result of `archfem run`"):
        history.save(path)
    assert path.read_bytes() == before
    assert af.History.read(history.save(folder / "first" / "copy.nc")).outcome == history.outcome


def test_a_run_replaces_results_of_another_run(two_runs):
    folder, other = two_runs
    for name in ("first/history.nc", "second/summary.txt"):
        (folder / name).write_bytes((other / name).read_bytes())
    case = af.Case.read(folder / "case.toml")
    found = {}
    with replace_run(case, folder) as draft:
        for result in carry_out(case, draft):
            if isinstance(result, af.cases.Run):
                found[result.motion.name] = result.reused, results.adopt_files(result)
        assert not (draft / "second" / "summary.txt").exists()
    # the history of the first is computed again, the summary of the second written again
    assert found == {"first": (False, False), "second": (True, False)}


def test_results_of_an_earlier_call_are_adopted(two_runs):
    folder, _ = two_runs
    before = {name: (folder / name).read_bytes() for name in files_below(folder)}
    case = af.Case.read(folder / "case.toml")
    with replace_run(case, folder) as draft:
        for result in carry_out(case, draft):
            if isinstance(result, af.cases.Run):
                assert results.adopt_files(result)
    for name in ("first/history.nc", "first/summary.txt", "second/envelope.png"):
        assert (folder / name).read_bytes() == before[name]
    assert "suite.txt" not in files_below(folder)


def test_a_second_run_in_a_folder_is_refused(two_runs, small, capsys):
    folder, _ = two_runs
    case = af.Case.read(small)
    before = files_below(folder)
    with replace_run(case, folder):
        assert af.commands.main(["run", str(small), "--out", str(folder)]) == 1
        assert "another command runs in" in capsys.readouterr().err
        assert af.cases.open_results(folder).missing == ()  # the earlier run, until the end
    assert files_below(folder) < before


def fail_after(draft, **histories):
    for name, text in histories.items():
        (draft / name).mkdir(exist_ok=True)
        (draft / name / "history.nc").unlink(missing_ok=True)  # linked to that of the folder
        (draft / name / "history.nc").write_text(text)
    raise af.DidNotConverge("no equilibrium")


@pytest.mark.parametrize("earlier", [False, True])
def test_a_run_that_fails_replaces_no_other(earlier, two_runs, small, tmp_path, caplog):
    folder = two_runs[0] if earlier else tmp_path / "new"
    before = {name: (folder / name).read_bytes() for name in files_below(folder)}
    case = af.Case.read(small)

    def run(**histories):
        with replace_run(case, folder) as draft:
            fail_after(draft, **histories)

    with pytest.raises(af.DidNotConverge):
        run()  # before any result
    assert files_below(folder) == set(before)
    with pytest.raises(af.DidNotConverge):
        run(first="part of a run")
    if earlier:
        assert {name: (folder / name).read_bytes() for name in before} == before
        assert "keeps the results of an earlier run; what was computed now is in" in caplog.text
        assert (folder / ".unfinished-run" / "first" / "history.nc").read_text() == "part of a run"
    else:
        assert f"what was computed is kept in {folder}" in caplog.text
        assert files_below(folder) == {"archfem.json", "case.toml", "first/history.nc"}


def test_pairs_of_a_run_that_was_killed_are_used_again_for_the_same_case(two_runs):
    folder, other = two_runs
    case, draft = af.Case.read(folder / "case.toml"), folder / ".unfinished-run"
    (draft / "third").mkdir(parents=True)
    shutil.copytree(folder / "first", draft / "first")  # with a summary, which is written again
    shutil.copytree(other / "second", draft / "second")
    (draft / "dead.png").touch()
    (draft / "third" / "history.nc").write_text("of a pair that the case has no more")
    own = draft / "first" / "history.nc", draft / "second" / "history.nc"
    with replace_run(case, folder):
        assert files_below(draft) == {"case.toml", "first/history.nc", "second/history.nc"}
        linked = [path.samefile(folder / path.relative_to(draft)) for path in own]
        assert linked == [False, True]
    with replace_run(af.Case.read(folder / "case.toml", ["suite.scale=3"]), folder):
        assert files_below(draft) == {"case.toml"}


COLUMN = {
    "structure": {"shape": "column", "breadth": 1.0, "heights": [1.0]},
    "model": {"fidelity": "rigid"},
    "motion": {"synthetic": {"duration": 0.3, "pga": 1.0}},
}


def run_one(folder, scale):
    """Run one motion in Python."""
    tables = {**COLUMN, "motion": {**COLUMN["motion"], "scale": scale}}
    *_, run = af.cases.run_case(af.Case.of(tables), folder)
    return run


def break_off(case, motion, *given):
    """Integrate a motion as if a step failed."""
    history = run_time_history(case, motion, *given)
    history.dataset.attrs["ended"] = "failed"
    raise af.DidNotConverge("no equilibrium", history=history)


@pytest.mark.slow
def test_results_of_a_case_with_another_title_are_replaced_with_a_warning(tmp_path, caplog):
    for title, scale in (("Bell tower", 1.0), ("Bell tower", 0.5), ("Gate", 1.0)):
        assert caplog.text == ""
        motion = {**COLUMN["motion"], "scale": scale}
        case = af.Case.of({**COLUMN, "title": title, "motion": motion})
        [*af.cases.run_case(case, tmp_path)]
    assert "has results of another case, 'Bell tower'" in caplog.text


@pytest.mark.parametrize("name", ["history.nc", "case.toml"])
def test_a_run_replaces_no_file_that_archfem_did_not_write(name, small, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    mine = tmp_path / "out" / name
    mine.write_bytes(b"of the user")
    assert af.commands.main(["run", str(small), "--out", str(mine.parent)]) == 1
    assert f"{name} is no result of archfem" in capsys.readouterr().err
    with pytest.raises(af.InvalidInput, match="would replace it"):
        next(af.cases.run_case(af.Case.read(small), mine.parent))
    assert mine.read_bytes() == b"of the user"
    assert [path.name for path in mine.parent.iterdir()] == [name]


def test_in_python_too_a_run_replaces_another_as_a_whole(two_runs, monkeypatch):
    """Files of the suite that was there vanish with it; a run that fails replaces none."""
    folder, _ = two_runs
    before = {name: (folder / name).read_bytes() for name in files_below(folder)}
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "run_time_history", break_off)
        failed = run_one(folder, 1.0)
    assert failed.path.is_relative_to(folder / ".unfinished-run")
    after = {name: (folder / name).read_bytes() for name in before}
    assert after == before
    run = run_one(folder, 1.0)
    assert run.path == folder / "history.nc"
    # modes.txt is of another command
    assert files_below(folder) == {"archfem.json", "case.toml", "history.nc", "modes.txt"}
    opened = af.cases.open_results(folder)
    assert opened.case.motion["scale"] == 1.0
    assert list(opened.runs) == ["synthetic 0"]


@pytest.mark.slow
def test_results_that_are_read_in_python_keep_their_pictures(two_runs):
    """Pairs are reused, and one that was swapped is computed anew: then the old pictures go."""
    folder, other = two_runs
    before = {name: (folder / name).read_bytes() for name in files_below(folder)}
    case = af.Case.read(folder / "case.toml")
    runs = [each for each in af.cases.run_case(case, folder) if isinstance(each, af.cases.Run)]
    assert [(run.reused, run.path.is_relative_to(folder)) for run in runs] == [(True, True)] * 2
    assert {name: (folder / name).read_bytes() for name in files_below(folder)} == before
    path = folder / "first" / "history.nc"
    stored = xr.load_dataset(path)
    path.write_bytes((other / "first" / "history.nc").read_bytes())
    runs = [each for each in af.cases.run_case(case, folder) if isinstance(each, af.cases.Run)]
    assert [run.reused for run in runs] == [False, True]
    # some versions of HDF5 write the time into the file, which is then no longer the same
    assert xr.load_dataset(path).identical(stored)
    assert "suite.txt" not in files_below(folder)
    assert af.cases.open_results(folder).missing == ()


def test_in_python_too_a_folder_has_one_run_at_a_time(tmp_path):
    first = af.cases.run_case(af.Case.of(COLUMN), tmp_path)
    next(first)
    with pytest.raises(af.InvalidInput, match="another command runs in"):
        run_one(tmp_path, 1.0)
    first.close()
    assert list(tmp_path.iterdir()) == []
    assert run_one(tmp_path, 1.0).path.is_file()


@pytest.mark.slow
def test_no_pair_of_another_case_stays_among_those_of_a_suite(two_runs):
    folder, _ = two_runs
    case = af.Case.read(folder / "case.toml", ["suite.scale=3"])
    list(af.cases.run_case(case, folder, pairs=["second"]))
    opened = af.cases.open_results(folder)
    assert (list(opened.runs), opened.missing) == (["second"], ("first",))
    reused = [
        each.reused for each in af.cases.run_case(case, folder) if isinstance(each, af.cases.Run)
    ]
    assert reused == [False, True]


def test_pairs_are_reused_as_others_join_the_suite(two_runs):
    folder, _ = two_runs
    third = "suite.pairs.third={synthetic={seed=3, duration=0.3, pga=1.0}}"
    case = af.Case.read(folder / "case.toml", [third])
    runs = [each for each in af.cases.run_case(case, folder) if isinstance(each, af.cases.Run)]
    assert {run.motion.name: run.reused for run in runs} == {
        **{"first": True, "second": True},
        "third": False,
    }


def test_a_pair_that_is_interrupted_joins_those_that_are_finished(two_runs, monkeypatch):
    """It replaces nothing, as no earlier run has it."""
    folder, _ = two_runs
    case = af.Case.read(folder / "case.toml", ["suite.scale=3"])
    list(af.cases.run_case(case, folder, pairs=["second"]))

    def interrupted(*given):
        history = run_time_history(*given)
        history.dataset.attrs["ended"] = "interrupted"
        return history

    monkeypatch.setattr(run_module, "run_time_history", interrupted)
    *_, run = af.cases.run_case(case, folder)
    assert run.path == folder / "first" / "history.nc"
    assert set(af.cases.open_results(folder).runs) == {"first", "second"}


def test_no_files_are_adopted_of_a_pair_that_has_none(two_runs, tmp_path):
    """A run made in Python has a history alone; its summary is still to be written."""
    case, folder = af.Case.read(two_runs[0] / "case.toml"), tmp_path / "new"
    list(af.cases.run_case(case, folder, pairs=["first"]))
    with replace_run(case, folder) as draft:
        *_, run = carry_out(case, draft, pairs=["first"])
        assert run.reused
        assert not results.adopt_files(run)


def test_disks_without_links_get_copies(two_runs, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError("no links")

    monkeypatch.setattr("os.link", refuse)
    link_file(two_runs[0] / "suite.txt", tmp_path / "new" / "suite.txt")
    assert (tmp_path / "new" / "suite.txt").read_text() == "suite.scale=1"


@pytest.mark.slow
def test_a_case_may_request_a_free_body():
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    tables = {"structure": {**ring, "voussoirs": 9}, "output": {"free_body": "voussoir 3"}}
    for cells, more in (({"fidelity": "rigid"}, []), ({"cells": [2, 2]}, ["png", "txt"])):
        rest = af.cases.DeadLoadResult.of(af.Case.of({**tables, "model": cells}))
        files = results.dead_load_files(rest)
        drawn = [f"dead_stress.{kind}" for kind in more]
        assert list(files) == ["dead.png", "names.png", *drawn, "free_body.png"]
    assert files["dead_stress.txt"].splitlines()[1].startswith("arch ")


@pytest.fixture
def mine(tmp_path):
    """Folder of the user outside the result folder."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for name in ("precious.txt", ".precious.part", "history.nc", "case.toml"):
        (folder / name).write_bytes(b"precious!" * 1000)
    return folder


def contents(folder):
    """Files, folders and links below a folder, with what they hold."""
    return {
        path.relative_to(folder).as_posix(): os.readlink(path)
        if path.is_symlink()
        else path.read_bytes()
        if path.is_file()
        else ""
        for path in folder.rglob("*")
    }


def link(folder, name, target):
    """Put a link in the place of a name in a result folder."""
    path = folder / name
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def plant(folder, mine, name):
    """Leave a finished draft with a file below a link, as if its publication was interrupted."""
    (folder / ".finished" / "x").mkdir(parents=True)
    (folder / ".finished" / "x" / name).write_text("planted")
    shutil.copy(folder / "archfem.json", folder / ".finished")
    link(folder, "x", mine)


def link_to_results(folder, mine, name):
    """Link to a result folder of the user, so that its files look like a draft."""
    shutil.copytree(folder, mine / "results")
    link(folder, name, mine / "results")


def list_outside(folder, mine, name):
    """List a file of the user with its very digest, in a list that is sealed again."""
    groups = {k: {"inputs": v.inputs, "files": v.files} for k, v in read_file_list(folder).items()}
    groups["run"]["files"][name] = sha256((mine / "precious.txt").read_bytes()).hexdigest()
    write_sealed_json(folder / "archfem.json", groups)


def copy_and_link(folder, mine, name):
    """Link to a copy, whose digest is right."""
    (mine / "copy").write_bytes((folder / name).read_bytes())
    link(folder, name, mine / "copy")


# What a stranger may have put into a folder whose report the user writes
ATTACKS = {
    "lock": lambda folder, mine: link(folder, ".lock", mine / "precious.txt"),
    "lock to nowhere": lambda folder, mine: link(folder, ".lock", mine / "new.txt"),
    "second name as lock": lambda folder, mine: os.link(mine / "precious.txt", folder / ".lock"),
    "pipe as lock": lambda folder, mine: os.mkfifo(folder / ".lock"),
    "finished draft": lambda folder, mine: link_to_results(folder, mine, ".finished"),
    "finished file": lambda folder, mine: plant(folder, mine, "precious.txt"),
    "finished new file": lambda folder, mine: plant(folder, mine, "planted.txt"),
    "finished link": lambda folder, mine: (
        (folder / ".finished").mkdir(),
        copy_and_link(folder, mine, "archfem.json"),
        link(folder, ".finished/archfem.json", mine / "copy"),
    ),
    "draft": lambda folder, mine: link(folder, ".unfinished-report", mine),
    "draft of results": lambda folder, mine: link_to_results(folder, mine, ".unfinished-report"),
    "other draft": lambda folder, mine: link(folder, ".unfinished-limit", mine),
    "case": lambda folder, mine: copy_and_link(folder, mine, "case.toml"),
    "list": lambda folder, mine: copy_and_link(folder, mine, "archfem.json"),
    "history": lambda folder, mine: copy_and_link(folder, mine, "first/history.nc"),
    "text": lambda folder, mine: copy_and_link(folder, mine, "limit.txt"),
    "name outside": lambda folder, mine: list_outside(folder, mine, "../../mine/precious.txt"),
    "name of the root": lambda folder, mine: list_outside(folder, mine, str(mine / "precious.txt")),
    "folder as lock": lambda folder, mine: (folder / ".lock").mkdir(),
    "folder as file": lambda folder, mine: (
        (folder / ".finished").mkdir(),
        (folder / ".finished" / "first").touch(),
        shutil.copy(folder / "archfem.json", folder / ".finished"),
    ),
    "file as draft": lambda folder, mine: (folder / ".finished").touch(),
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_the_report_of_a_folder_touches_nothing_outside_it(
    attack, two_runs, mine, unplotted, capsys
):
    """Links and names that lead out of the folder end in an error, and files stay as they are."""
    folder, _ = two_runs
    ATTACKS[attack](folder, mine)
    before = contents(mine)
    assert af.commands.main(["report", str(folder)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("archfem: ")
    assert contents(mine) == before
    assert not set(contents(folder)) & {"precious.txt", ".precious.part"}


@pytest.mark.parametrize(
    "name",
    [
        ".unfinished-run",
        ".unfinished-run/first",
        ".unfinished-run/first/history.nc",
        "first",
        "first/history.nc",
    ],
)
def test_a_run_in_a_folder_of_a_stranger_touches_nothing_outside(name, two_runs, mine, capsys):
    folder, _ = two_runs
    case = shutil.copy(folder / "case.toml", folder.parent)
    if (folder / name).is_dir():
        shutil.rmtree(folder / name)
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    link(folder, name, mine / ("history.nc" if name.endswith(".nc") else "."))
    before = contents(mine)
    assert af.commands.main(["run", str(case), "--out", str(folder)]) == 1
    assert f"{name} is a link, a pipe or a device" in capsys.readouterr().err
    with pytest.raises(af.InvalidInput, match="is a link"):
        list(af.cases.run_case(af.Case.read(case), folder))
    assert contents(mine) == before


@pytest.mark.parametrize("name", ["points", "points/ab", "shared", "study.json", "workers.log"])
def test_a_study_in_a_folder_of_a_stranger_touches_nothing_outside(name, two_runs, mine):
    """Leftovers of its folders are deleted, which begin with a dot as those of the user do."""
    folder, _ = two_runs
    study = af.Study(af.Case.read(folder / "case.toml"), {"suite.scale": [1.0]}, "dead load")
    (folder / name).parent.mkdir(exist_ok=True)
    link(folder, name, mine / ("precious.txt" if "." in name else "."))
    before = contents(mine)
    with pytest.raises(af.InvalidInput, match=f"{name} is a link"):
        study.run(folder, workers=1)
    assert contents(mine) == before


def test_files_that_are_missing_are_named(two_runs, unplotted, caplog):
    """Both a picture and a history of the list; a report itself may be deleted."""
    folder, _ = two_runs
    with replace_results(folder, "report", read_file_list(folder)["run"].inputs) as draft:
        (draft / "report.html").touch()
    (folder / "report.html").unlink()
    af.cases.open_results(folder)
    assert "missing" not in caplog.text
    for name in ("first/envelope.png", "second/history.nc"):
        (folder / name).unlink()
    page = af.cases.open_results(folder).report().read_text(encoding="utf-8")
    for text in (caplog.text, page):
        assert "a listed file is missing: first/envelope.png, second/history.nc; put" in text


LEFT_OUT = "vertical acceleration is left out"


@pytest.mark.parametrize(
    ("changes", "shown", "factor"),
    [
        ([], "2.5 times the PGA of 'synthetic 1', 0.2 g; " + LEFT_OUT, "-"),
        (["motion.scale=2.0"], "1.25 times the PGA of 'synthetic 1', 0.4 g; " + LEFT_OUT, "-"),
        (["limit.horizontal=0.25"], "2.5 times the PGA of 'synthetic 1', 0.2 g; " + LEFT_OUT, "-"),
        (["limit.demand=0.1 g"], "the demand of 0.1 g; " + LEFT_OUT, "5"),
        (['motion={file="lost.txt"}'], "", "-"),
    ],
)
def test_a_push_stands_beside_the_peak_of_the_motion_which_is_no_demand(
    changes, shown, factor, tmp_path, capsys, unplotted
):
    """A stone 0.5 m broad and 1 m high, which a push of 0.5 g overturns, and a motion of 0.2 g."""
    tables = {
        "title": "a stone",
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0]},
        "contacts": {"stone to stone": {"friction": 0.8}},
        "limit": {"horizontal": 1.0},
        "motion": {"synthetic": {"seed": 1, "pga": 0.2 * 9.80665}},
    }
    path = tmp_path / "stone.toml"
    path.write_text(format_tables(tables), encoding="utf-8")
    given = [x for change in changes for x in ("--set", change)]
    assert af.commands.main(["limit", str(path), *given, "--out", str(tmp_path / "out")]) == 0
    ((_, demand, _, capacity, _),) = json.loads((tmp_path / "out/limit.json").read_text())["rows"]
    none = "; ".join(filter(None, [NO_DEMAND, shown]))
    assert (demand, capacity) == (none if factor == "-" else shown, factor)
    said = f"it begins to move at {shown if factor == '-' else '5 times'}"
    assert (said in capsys.readouterr().out) == bool(shown)
