"""Cases carried out: results, saved and reused histories, prefixes of warnings."""

import logging
import tomllib
from time import perf_counter
from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.cases import provenance
from archfem.cases import run as run_module
from archfem.cases.run import load_finished_run, log_prefix, run_time_history


def names(results):
    return [type(result).__name__ for result in results]


def test_results_come_as_they_are_found_and_histories_are_kept(small, tmp_path, undoubted):
    case = af.Case.read(small, ["limit.horizontal=1"])
    results = list(af.cases.run_case(case, str(tmp_path / "out")))
    assert names(results) == ["DeadLoadResult", "Suite", "Run", "Run", "Collapse"]
    rest, suite, *runs, collapse = results
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


def test_without_a_folder_nothing_is_kept_and_pairs_may_be_named(small, undoubted):
    case = af.Case.read(small)
    before = set(small.parent.iterdir())
    *_, suite, run = af.cases.run_case(case, pairs=["second"])
    assert [pair.name for pair in suite.pairs] == ["second"]
    assert (run.motion.name, run.path) == ("second", None)
    assert set(small.parent.iterdir()) == before


def test_one_motion_has_its_history_in_the_folder_itself(small, tmp_path, undoubted):
    tables = tomllib.loads(small.read_text())
    tables["motion"] = tables.pop("suite")["pairs"]["first"]
    rest, run = af.cases.run_case(af.Case.of(tables), tmp_path / "out")
    assert names([rest, run]) == ["DeadLoadResult", "Run"]
    assert run.path == tmp_path / "out" / "history.nc"
    assert len(list(af.cases.run_case(af.Case.of(tables), tmp_path / "out"))) == 2


def test_ctrl_c_ends_the_suite_after_the_run_it_met(small, tmp_path, undoubted, monkeypatch):
    def interrupted(case, motion, *given):
        history = run_time_history(case, motion, *given)
        history.dataset.attrs["ended"] = "interrupted"
        return history

    case = af.Case.read(small)
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "run_time_history", interrupted)
        results = list(af.cases.run_case(case, tmp_path / "out"))
    assert names(results) == ["DeadLoadResult", "Suite", "Run"]
    assert not any(
        run.reused for run in af.cases.run_case(case, tmp_path / "out") if "Run" in names([run])
    )


def test_a_step_that_fails_ends_its_run_only(small, tmp_path, undoubted, monkeypatch):
    def failing(case, motion, *given):
        history = run_time_history(case, motion, *given)
        if motion.name == "first":
            history.dataset.attrs["ended"] = "failed"
            raise af.DidNotConverge("no equilibrium", history=history)
        return history

    case = af.Case.read(small)
    monkeypatch.setattr(run_module, "run_time_history", failing)
    *_, first, second = af.cases.run_case(case, tmp_path / "out")
    assert "no equilibrium" in str(first.error)
    assert second.error is None
    alone = case.alone("first")
    assert af.History.read(first.path).ending is af.dynamics.Ending.FAILED
    assert load_finished_run(first.path, alone, alone.ground_suite().motions[0]) is None

    def never_begun(*_):
        raise af.DidNotConverge("no equilibrium")

    monkeypatch.setattr(run_module, "run_time_history", never_begun)
    with pytest.raises(af.DidNotConverge, match="no equilibrium"):
        list(af.cases.run_case(case))


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
    for off, same in ((0.95e-6, True), (1.05e-6, False)):  # round-off of matching is below 1e-6
        other = af.Motion(motion.horizontal + off, motion.dt)
        assert (load_finished_run(path, case, other) is not None) is same
    at2(tmp_path / "level.AT2", [0.0, 0.06, -0.06, 0.0], 0.01)
    assert load_finished_run(path, case, motion) is None  # before the motions are compared


@pytest.mark.parametrize("what", ["drawing", pytest.param("program", marks=pytest.mark.slow)])
def test_nothing_is_kept_of_another_drawing_or_by_another_program(
    what, undoubted, tmp_path, monkeypatch
):
    """A drawing that is stretched leaves the case's own words and the ground as they are."""
    stretched, drawing = 1.3, tmp_path / "column.geojson"
    column = af.column(breadth=1.0, heights=[1.0, 1.0])
    af.masonry.write_outlines(column, drawing)
    tables = {
        "structure": {"shape": "outlines", "file": drawing.name},
        "model": {"fidelity": "rigid"},
        "suite": {"pairs": {"one": {"synthetic": {"duration": 0.25, "pga": 0.5}}}},
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


@pytest.mark.slow
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
    assert "take fidelity 'faces'; or 'auto'" in str(doubt)
    # which a report keeps
    assert doubt.cause.endswith("and displacements may differ several times: take fidelity 'faces'")


def test_a_run_and_its_dead_load_take_no_more_time_than_has_passed(small):
    begin = perf_counter()
    rest, _, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    assert min(rest.seconds, run.seconds) > 0.0
    assert rest.seconds + run.seconds < perf_counter() - begin


def test_a_run_is_compared_with_a_finer_one_over_its_first_half_second(stack, monkeypatch, caplog):
    """By the largest |e| of each joint, until either run ends; 0.03 is in no doubt."""
    begun = []

    def history(*rows, normal=(1.0, 1.0)):
        """A joint pressed by 1 N, 1 m deep, has e = M; records are 0.1 s apart."""
        resultants = np.zeros((len(rows), 2, 3))
        resultants[..., 0], resultants[..., 2] = normal, rows
        time = 0.1 * np.arange(len(rows))
        joints = af.joints.joint_dataset(stack, resultants, time)
        return SimpleNamespace(time=time, joints=joints, ending=af.dynamics.Ending.FINISHED)

    def doubts(coarse, finer, softened=None):
        def run(analysis, motion, **_):
            begun.append(motion)
            run_module.logger.warning("of the other model")
            return {"faces": finer, "soft": softened}[analysis]

        monkeypatch.setattr(run_module, "time_history", run)
        light = SimpleNamespace(weight=1.0, free=(1,))
        rigid, faces = (
            SimpleNamespace(model=SimpleNamespace(fidelity=name, structure=light))
            for name in ("rigid", "faces")
        )
        soft = softened and ("soft", rigid)
        rest = SimpleNamespace(
            dead=rigid, finer=("faces", faces), softened=soft, damping=(None, "")
        )
        return [each.cause for each in run_module.doubt_fidelity(rest, motion, coarse)]

    motion = af.Motion(0.1 * np.arange(1.0, 101.0), 0.01)
    coarse = history((0.0, 0.0), (0.1, -0.2))
    assert doubts(coarse, history((0.0, 0.0), (0.129, -0.171))) == []
    (said,) = doubts(coarse, history((0.0, 0.0), (0.1, -0.2315)))
    assert said == (
        "within the first 0.1 s fidelity 'rigid' differs from 'faces' by 0.032 in the largest |e| "
        "of a joint, and displacements may differ several times: take fidelity 'faces'"
    )
    # a joint that carries 0.5 % of the other, with |e| of 0 and 0.4
    centred, eccentric = (history((0.0, 0.0), (0.1, m), normal=(1.0, 0.005)) for m in (0.0, 0.002))
    assert doubts(centred, eccentric) == []
    longer = history((0.0, 0.0), (0.1, -0.2), (0.4, 0.4))
    assert doubts(coarse, longer) == doubts(longer, coarse) == []
    assert begun[0].horizontal.tolist() == motion.horizontal[:51].tolist()
    motion = af.Motion(np.arange(1.0, 4.0), 0.01)
    assert doubts(coarse, coarse) == []
    assert begun[-1].horizontal.tolist() == [1.0, 2.0, 3.0]
    motion, begun[:] = af.Motion(0.1 * np.arange(1.0, 101.0), 0.01), []
    far = history((0.0, 0.0), (0.4, -0.2))
    # joints that the stones soften differ by less than a quarter of it: no finer run is made
    assert doubts(coarse, far, softened=history((0.0, 0.0), (0.1, -0.2074))) == []
    assert len(begun) == 1
    assert len(doubts(coarse, far, softened=history((0.0, 0.0), (0.1, -0.2076)))) == 1
    assert not caplog.text


def test_some_models_have_no_finer_one_to_compare_with(small, monkeypatch):
    """The finest, one whose error is predicted, and any where FEniCSx is not installed."""

    def finer(fidelity, prediction=None):
        model = SimpleNamespace(fidelity=fidelity, prediction=prediction)
        return af.cases.DeadLoadResult(case, SimpleNamespace(model=model)).finer

    case = af.Case.read(small)
    other, dead = finer("rigid")
    assert (other.discretisation.fidelity, dead.model.fidelity) == ("faces", "faces")
    assert finer("full") is None
    assert finer("rigid", "an error of 0.01") is None
    monkeypatch.setattr(run_module, "find_spec", lambda name: None)
    assert finer("rigid") is None


def test_each_step_is_recorded_and_a_film_shows_every_tenth(small):
    case = af.Case.read(small, ["output.animation=true", "analysis.dt=0.005"])
    (motion, _) = case.ground_suite().motions
    run = af.cases.run_time_history(case, motion, af.cases.dead_load_of_case(case))
    assert run.time == pytest.approx(0.005 * np.arange(201))
    assert run.dataset["frame_time"].values == pytest.approx(0.05 * np.arange(21))
    every = af.Case.read(small, ["record.every=4", "analysis.dt=0.005"])
    run = af.cases.run_time_history(every, motion, af.cases.dead_load_of_case(every))
    assert run.time == pytest.approx(0.02 * np.arange(51))
    assert "q" not in run.dataset


def test_modules_of_a_case_are_among_its_files(tmp_path):
    settings = {"extensions": ["laws.py", "a_package"], "structure": {"file": "stones.dxf"}}
    found = provenance.list_input_files(settings, tmp_path)
    assert found == [tmp_path / "stones.dxf", tmp_path / "laws.py"]


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "count"), [(0.05, 1), (0.6, 0)])
def test_a_ring_that_only_its_elastic_fill_holds_up_is_a_doubt(thickness, count):
    """By limit analysis with the fill of [limit], of which a run without a push makes no use."""
    sides = {"state": "fixed", "length": 2.0, "height": 1.0, "above": 1.5}
    arch = {"span": 6.0, "rise": 1.5, "thickness": thickness, "voussoirs": 9}
    structure = {"shape": "bridge", "arches": {"arch": arch}, "backfill": {"cover": 0.4}}
    structure["sidewalls"] = {**sides, "left wall": {}, "right wall": {}}
    case = af.Case.of(
        {
            "structure": structure,
            "model": {"fidelity": "rigid", "cells": [1, 1]},
            "limit": {"fill": {"friction_angle": 30.0}},
        }
    )
    assert af.stands(case.structure, **case.limit.resistance) == (not count)
    doubts = [str(doubt) for doubt in af.cases.DeadLoadResult.of(case).doubts]
    assert sum("finds no equilibrium at rest" in doubt for doubt in doubts) == count
    case.settings["contacts"] = {"stone to stone": {"tension": 1e5, "cohesion": 1e6}}
    bonded = af.cases.DeadLoadResult.of(af.Case.of(case.settings))
    assert "finds no equilibrium" not in "".join(map(str, bonded.doubts))
