"""Cases carried out: results as they are found, kept, and gone on with."""

import tomllib

import numpy as np
import pytest

import archfem as af
from archfem.cases import inputs
from archfem.cases import run as analysis
from archfem.cases.kept import finished


def names(results):
    return [type(result).__name__ for result in results]


def test_results_come_as_they_are_found_and_histories_are_kept(small, tmp_path):
    case = af.Case.read(small, ["limit.horizontal=1"])
    results = list(analysis.carried_out(case, str(tmp_path / "out")))
    assert names(results) == ["Collapse", "Rest", "Suite", "Run", "Run"]
    collapse, rest, suite, *runs = results
    assert collapse.factor == pytest.approx(0.5)  # two blocks 1 m wide, 2 m high in all
    assert rest.damping == (None, "damping: none")
    assert rest.use is None  # rigid
    assert [run.motion.name for run in runs] == [pair.name for pair in suite.pairs]
    for run in runs:
        assert run.path == tmp_path / "out" / run.motion.name / "history.nc"
        assert af.History.read(run.path).outcome == run.history.outcome
        assert tomllib.loads(run.case.text())["suite"]["pairs"].keys() == {run.motion.name}
        assert not run.kept

    (tmp_path / "out" / "first" / "history.nc").unlink()
    again = [
        each for each in analysis.carried_out(case, tmp_path / "out") if "Run" in names([each])
    ]
    assert [run.kept for run in again] == [False, True]
    for run, before in zip(again, runs, strict=True):
        assert np.array_equal(run.history.joints["N"], before.history.joints["N"])


def test_without_a_folder_nothing_is_kept_and_pairs_may_be_named(small):
    case = af.Case.read(small)
    before = set(small.parent.iterdir())
    *_, suite, run = analysis.carried_out(case, pairs=["second"])
    assert [pair.name for pair in suite.pairs] == ["second"]
    assert (run.motion.name, run.path) == ("second", None)
    assert set(small.parent.iterdir()) == before


def test_one_motion_has_its_history_in_the_folder_itself(small, tmp_path):
    tables = tomllib.loads(small.read_text())
    tables["motion"] = tables.pop("suite")["pairs"]["first"]
    rest, run = analysis.carried_out(af.Case.of(tables), tmp_path / "out")
    assert names([rest, run]) == ["Rest", "Run"]
    assert run.path == tmp_path / "out" / "history.nc"
    assert len(list(analysis.carried_out(af.Case.of(tables), tmp_path / "out"))) == 2


def test_ctrl_c_ends_the_suite_after_the_run_it_met(small, tmp_path):
    def interrupted(case, motion, *given):
        history = analysis.shaken(case, motion, *given)
        history.dataset.attrs["ended"] = "interrupted"
        return history

    case = af.Case.read(small)
    results = list(analysis.carried_out(case, tmp_path / "out", shake=interrupted))
    assert names(results) == ["Rest", "Suite", "Run"]
    assert not any(
        run.kept for run in analysis.carried_out(case, tmp_path / "out") if "Run" in names([run])
    )


def test_a_step_that_fails_ends_its_run_only(small, tmp_path):
    def failing(case, motion, *given):
        history = analysis.shaken(case, motion, *given)
        if motion.name == "first":
            history.dataset.attrs["ended"] = "failed"
            raise af.DidNotConverge("no equilibrium", history=history)
        return history

    case = af.Case.read(small)
    *_, first, second = analysis.carried_out(case, tmp_path / "out", shake=failing)
    assert "no equilibrium" in str(first.error)
    assert second.error is None
    alone = case.alone("first")
    assert af.History.read(first.path).ended is af.dynamics.Ending.FAILED
    assert finished(first.path, alone, alone.ground_suite().motions[0]) is None

    def never_begun(*_):
        raise af.DidNotConverge("no equilibrium")

    with pytest.raises(af.DidNotConverge, match="no equilibrium"):
        list(analysis.carried_out(case, shake=never_begun))


def test_pairs_are_run_again_where_their_files_have_changed(small, tmp_path, at2):
    tables = tomllib.loads(small.read_text())
    tables["suite"]["pairs"] = {"one": {"file": "level.AT2"}}
    at2(tmp_path / "level.AT2", [0.0, 0.01, -0.01, 0.0], 0.01)
    case = af.Case.of(tables, tmp_path)
    (motion,) = case.ground_suite().motions
    shaken = analysis.shaken(case, motion, analysis.at_rest(case))
    path = shaken.save(tmp_path / "history.nc")
    assert finished(path, case, motion).outcome == shaken.outcome
    assert finished(path, case, motion.scaled(1.01)) is None
    at2(tmp_path / "level.AT2", [0.0, 0.06, -0.06, 0.0], 0.01)
    assert finished(path, case, motion) is None  # before it asks what the ground does


@pytest.mark.parametrize("what", ["drawing", "program"])
def test_nothing_is_kept_of_another_drawing_or_by_another_program(what, tmp_path, monkeypatch):
    """A drawing that is stretched leaves the case's own words and the ground as they are."""
    stretched, drawing = 1.3, tmp_path / "column.geojson"
    column = af.column(breadth=1.0, heights=[1.0, 1.0])
    af.masonry.write_outlines(column, drawing)
    tables = {
        "structure": {"shape": "outlines", "file": drawing.name},
        "model": {"fidelity": "rigid"},
        "suite": {"pairs": {"one": {"synthetic": {"duration": 0.5, "pga": 0.5}}}},
        "analysis": {"dt": 0.005},
    }
    kept = []
    for changed in (False, False, True):
        if changed and what == "drawing":
            af.masonry.write_outlines(
                af.column(breadth=stretched, heights=[stretched, stretched]), drawing
            )
        elif changed:
            monkeypatch.setattr(inputs, "_modules_digest", lambda: "another")
        *_, run = analysis.carried_out(af.Case.of(tables, tmp_path), tmp_path / "out")
        kept.append(run.kept)
    assert kept == [False, True, False]
