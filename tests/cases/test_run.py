"""Cases carried out: results, saved and reused histories, prefixes of warnings."""

import logging
import tomllib
from time import perf_counter

import numpy as np
import pytest

import archfem as af
from archfem.cases import provenance
from archfem.cases.run import DeadLoadResult, doubt_fidelity, load_finished_run, log_prefix
from archfem.joints import joint_dataset


def names(results):
    return [type(result).__name__ for result in results]


def test_results_come_as_they_are_found_and_histories_are_kept(small, tmp_path):
    case = af.Case.read(small, ["limit.horizontal=1"])
    results = list(af.cases.run_case(case, str(tmp_path / "out")))
    assert names(results) == ["Collapse", "DeadLoadResult", "Suite", "Run", "Run"]
    collapse, rest, suite, *runs = results
    assert collapse.factor == pytest.approx(0.5)  # two blocks 1 m wide, 2 m high in all
    assert rest.damping == (None, "damping: none")
    assert rest.strength_use is None  # rigid
    assert [run.motion.name for run in runs] == [pair.name for pair in suite.pairs]
    for run in runs:
        assert run.path == tmp_path / "out" / run.motion.name / "history.nc"
        assert af.History.read(run.path).outcome == run.history.outcome
        assert tomllib.loads(run.case.text())["suite"]["pairs"].keys() == {run.motion.name}
        assert not run.reused

    (tmp_path / "out" / "first" / "history.nc").unlink()
    again = [each for each in af.cases.run_case(case, tmp_path / "out") if "Run" in names([each])]
    assert [run.reused for run in again] == [False, True]
    for run, before in zip(again, runs, strict=True):
        assert np.array_equal(run.history.joints["N"], before.history.joints["N"])


def test_without_a_folder_nothing_is_kept_and_pairs_may_be_named(small):
    case = af.Case.read(small)
    before = set(small.parent.iterdir())
    *_, suite, run = af.cases.run_case(case, pairs=["second"])
    assert [pair.name for pair in suite.pairs] == ["second"]
    assert (run.motion.name, run.path) == ("second", None)
    assert set(small.parent.iterdir()) == before


def test_one_motion_has_its_history_in_the_folder_itself(small, tmp_path):
    tables = tomllib.loads(small.read_text())
    tables["motion"] = tables.pop("suite")["pairs"]["first"]
    rest, run = af.cases.run_case(af.Case.of(tables), tmp_path / "out")
    assert names([rest, run]) == ["DeadLoadResult", "Run"]
    assert run.path == tmp_path / "out" / "history.nc"
    assert len(list(af.cases.run_case(af.Case.of(tables), tmp_path / "out"))) == 2


def test_ctrl_c_ends_the_suite_after_the_run_it_met(small, tmp_path):
    def interrupted(case, motion, *given):
        history = af.cases.run_time_history(case, motion, *given)
        history.dataset.attrs["ended"] = "interrupted"
        return history

    case = af.Case.read(small)
    results = list(af.cases.run_case(case, tmp_path / "out", run_motion=interrupted))
    assert names(results) == ["DeadLoadResult", "Suite", "Run"]
    assert not any(
        run.reused for run in af.cases.run_case(case, tmp_path / "out") if "Run" in names([run])
    )


def test_a_step_that_fails_ends_its_run_only(small, tmp_path):
    def failing(case, motion, *given):
        history = af.cases.run_time_history(case, motion, *given)
        if motion.name == "first":
            history.dataset.attrs["ended"] = "failed"
            raise af.DidNotConverge("no equilibrium", history=history)
        return history

    case = af.Case.read(small)
    *_, first, second = af.cases.run_case(case, tmp_path / "out", run_motion=failing)
    assert "no equilibrium" in str(first.error)
    assert second.error is None
    alone = case.alone("first")
    assert af.History.read(first.path).ending is af.dynamics.Ending.FAILED
    assert load_finished_run(first.path, alone, alone.ground_suite().motions[0]) is None

    def never_begun(*_):
        raise af.DidNotConverge("no equilibrium")

    with pytest.raises(af.DidNotConverge, match="no equilibrium"):
        list(af.cases.run_case(case, run_motion=never_begun))


def test_pairs_are_run_again_where_their_files_have_changed(small, tmp_path, at2):
    tables = tomllib.loads(small.read_text())
    tables["suite"]["pairs"] = {"one": {"file": "level.AT2"}}
    at2(tmp_path / "level.AT2", [0.0, 0.01, -0.01, 0.0], 0.01)
    case = af.Case.of(tables, tmp_path)
    (motion,) = case.ground_suite().motions
    shaken = af.cases.run_time_history(case, motion, af.cases.dead_load_of_case(case))
    path = shaken.save(tmp_path / "history.nc")
    assert load_finished_run(path, case, motion).outcome == shaken.outcome
    assert load_finished_run(path, case, motion.scaled(1.01)) is None
    at2(tmp_path / "level.AT2", [0.0, 0.06, -0.06, 0.0], 0.01)
    assert load_finished_run(path, case, motion) is None  # before the motions are compared


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
            monkeypatch.setattr(provenance, "_hash_modules", lambda: "another")
        *_, run = af.cases.run_case(af.Case.of(tables, tmp_path), tmp_path / "out")
        kept.append(run.reused)
    assert kept == [False, True, False]


def test_warnings_name_case_and_motion(caplog):
    logger = logging.getLogger("archfem")
    with log_prefix("study", "pair 3"), log_prefix("ring", "pair 3"):
        logger.warning("energy drifts by %d %%", 3)
    logger.warning("on its own, 100% as it is")
    assert caplog.messages == [
        "study, pair 3: energy drifts by 3 %",
        "on its own, 100% as it is",
    ]


def test_a_fidelity_is_doubted_where_the_next_finer_one_disagrees():
    """Stones barely stiffer than their joints: rigid ones err from the dead load on."""
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    ring |= {"voussoirs": 7, "material": "stone"}
    motion = {"synthetic": {"duration": 1.0, "pga": 0.5, "seed": 1}}

    def doubts(young):
        case = af.Case.of(
            {
                "structure": ring,
                "materials": {"stone": {"young": young}},
                "model": {"fidelity": "rigid"},
                "motion": motion,
                "analysis": {"dt": 0.005},
            }
        )
        *_, run = af.cases.run_case(case)
        return [doubt for doubt in run.history.doubts if "differs from 'faces'" in doubt.cause]

    assert not doubts("10 GPa")
    (doubt,) = doubts("0.5 GPa")
    assert "take fidelity 'faces', or 'auto'" in doubt.remedy


def test_a_run_takes_no_more_time_than_has_passed(small):
    begin = perf_counter()
    *_, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    assert 0.0 < run.seconds < perf_counter() - begin


def test_steps_are_saved_each_and_fields_of_a_film_every_tenth(small):
    case = af.Case.read(small, ["output.animation=true", "analysis.dt=0.01"])
    dead, (motion, _) = af.cases.dead_load_of_case(case), case.ground_suite().motions
    run = af.cases.run_time_history(case, motion, dead)
    assert run.time == pytest.approx(0.01 * np.arange(101))
    plain = af.Case.read(small, ["analysis.dt=0.01", "output.save_every=4"])
    few = af.cases.run_time_history(plain, motion, dead)
    assert few.time == pytest.approx(0.04 * np.arange(26))
    assert "q" not in few.dataset
    assert run.dataset["q"].sizes["frame"] == 11


def test_the_finest_fidelity_has_none_to_compare_with(small):
    pytest.importorskip("dolfinx")
    case = af.Case.read(small, ["model.fidelity=full", "model.cells=[1, 1]"])
    assert DeadLoadResult.of(case).finer is None
    other, dead = DeadLoadResult.of(af.Case.read(small)).finer
    assert (other.settings["model"]["fidelity"], dead.model.fidelity) == ("faces", "faces")


@pytest.mark.parametrize(
    ("size", "count"), [(0.2, 0), (0.2295, 0), (0.2305, 1), (0.1705, 0), (0.1695, 1)]
)
def test_fidelities_are_compared_over_the_first_half_second(small, monkeypatch, size, count):
    """By the largest |e| of each joint, up to where the shorter run ends: above 0.03."""
    case = af.Case.read(small)
    motion = case.ground_suite().motions[0]
    column, seen = case.structure, []

    def run_of(values):
        forces = np.zeros((len(values), 2, 3))
        forces[..., 0], forces[..., 2] = 1e3, 1e3 * np.array(values)[:, None]
        return af.History(joint_dataset(column, forces, 0.1 * np.arange(len(values))), column)

    def finer(other, given, dead, damping):
        seen.append(given)
        return run_of([0.0, size, 0.1])

    monkeypatch.setattr("archfem.cases.run.run_time_history", finer)
    doubts = doubt_fidelity(DeadLoadResult.of(case), motion, run_of([0.0, -0.2, 0.05, 0.3]))
    assert len(doubts) == count
    assert all("within the first 0.2 s fidelity 'rigid'" in each.cause for each in doubts)
    (first,) = seen
    assert first.duration == pytest.approx(0.5)
    assert first.horizontal == pytest.approx(motion.horizontal[: len(first.horizontal)])


def test_modules_of_a_case_are_among_its_files(tmp_path):
    settings = {"extensions": ["laws.py", "a_package"], "structure": {"file": "stones.dxf"}}
    found = provenance.list_input_files(settings, tmp_path)
    assert found == [tmp_path / "stones.dxf", tmp_path / "laws.py"]
