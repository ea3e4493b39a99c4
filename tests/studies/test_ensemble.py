"""Ensembles of histories: every answer is that of the history on its own."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.studies import ensemble as module
from archfem.studies import evaluators

SCALES = (0.2, 5.0)

# falls end once a block is lost for good
BRIEF = af.Record(whole_fall=False)


@pytest.fixture(scope="module")
def ring():
    return af.circular_arch(radius=2.95, thickness=0.35, embrace=159.0, voussoirs=7)


@pytest.fixture(scope="module")
def motions():
    return [af.Motion.synthetic(duration=1.0, pga=8.0, seed=seed) for seed in (1, 2)]


def with_closure(structure, closure):
    joints = [replace(j, contact=replace(j.contact, closure=closure)) for j in structure.joints]
    return replace(structure, joints=tuple(joints))


def of(structure, displacements, dt=0.005):
    damping = af.StiffnessDamping(0.05, 8.0)
    settings = {"fidelity": "rigid", "displacements": displacements, "record": BRIEF}
    return af.Analysis(structure, damping=damping, dt=dt, **settings)


@pytest.mark.parametrize(
    ("displacements", "closure", "scales"),
    [
        ("small", None, (0.1, 0.8)),
        pytest.param("large", None, SCALES, marks=pytest.mark.slow),
        pytest.param("large", 2e-4, SCALES, marks=pytest.mark.slow),
    ],
)
def test_each_history_is_that_of_the_run_on_its_own(ring, motions, displacements, closure, scales):
    structure = ring if closure is None else with_closure(ring, closure)
    analysis = of(structure, displacements)
    found = af.ensemble(analysis, motions, scales=scales)
    assert found.outcome.dims == found.displacement.dims == ("motion", "scale")
    for i, motion in enumerate(motions):
        for k, scale in enumerate(scales):
            # a model of its own, so that nothing is left from the ensemble
            run = replace(analysis).run(motion.scaled(scale))
            each, verdict = found.dataset.isel(motion=i, scale=k), run.verdict
            assert str(each["outcome"].values) == verdict.outcome
            # the same code from the same start: no bit may differ
            assert float(each["displacement"]) == verdict.displacement
            slips = np.abs(run.joints["slip"].values[:, run.joints["judged"].values])
            assert float(each["slip"]) == slips.max()
            for name, mechanism in verdict.mechanisms.items():
                own = each.isel(definition=list(each["definition"].values).index(name))
                assert float(own["time"]) == (np.inf if mechanism is None else mechanism.time)
                joints = np.flatnonzero(own["failed"].values)
                assert tuple(joints) == (() if mechanism is None else mechanism.joints)
    kinds = set(found.outcome.values.ravel())
    assert len(kinds) > 1, "all runs end alike, so that outcomes are not compared"


def test_changes_are_those_of_the_structure_changed_by_hand(ring, motions):
    analysis = of(ring, "large")
    changes = [{}, {"k_n": 0.5, "friction": -0.1, "damping_ratio": 2.0}]
    found = af.ensemble(analysis, motions[:1], scales=SCALES, changes=changes)
    assert found.outcome.dims == ("motion", "scale", "change")
    joints = [
        replace(
            joint,
            contact=replace(
                joint.contact,
                normal_stiffness=0.5 * joint.contact.normal_stiffness,
                friction=joint.contact.friction - 0.1,
            ),
        )
        for joint in ring.joints
    ]
    changed = replace(
        analysis,
        structure=replace(ring, joints=tuple(joints)),
        damping=af.StiffnessDamping(0.1, 8.0),
    )
    for number, each in enumerate((analysis, changed)):
        run = each.run(motions[0].scaled(SCALES[0]))
        own = found.displacement.isel(motion=0, scale=0, change=number)
        assert float(own) == run.verdict.displacement
    first, second = found.displacement.isel(motion=0, scale=0).values
    assert abs(second - first) > 1e-3 * first
    whole = found.history(0, 0, 1)
    assert whole.verdict.displacement == second


def test_each_changed_structure_is_prepared_once(ring, motions, monkeypatch):
    prepared, prepare = [], module.prepare_histories

    def count(analysis, changes):
        prepared.append(dict(changes))
        return prepare(analysis, changes)

    monkeypatch.setattr(module, "prepare_histories", count)
    changes = [{}, {"friction": -0.1}]
    af.ensemble(of(ring, "small"), motions, scales=(0.01,), changes=changes)
    assert prepared == changes


def test_a_run_without_equilibrium_is_unknown_and_the_others_remain(ring, motions, monkeypatch):
    def prepare(analysis, changes):
        def run(motion):
            if motion.pga > 5.0:
                raise af.errors.DidNotConverge("no equilibrium", last=None)
            return analysis.run(motion)

        return run

    monkeypatch.setattr(module, "prepare_histories", prepare)
    found = af.ensemble(of(ring, "large"), motions[0], scales=SCALES)
    assert found.outcome.values.tolist() == [["stands", "unknown"]]
    assert str(found.dataset["error"].values[0, 1]) == "DidNotConverge: no equilibrium"
    assert np.isnan(found.displacement.values[0, 1])


@pytest.mark.parametrize("method", ["ensemble", "verdict_range"])
def test_ctrl_c_ends_all_runs(ring, motions, monkeypatch, method):
    begun = []

    def interrupted(analysis, motion, **options):
        begun.append(motion)
        history = af.time_history(analysis, motion.cut(0.0, 0.05), **options)
        history.dataset.attrs["ended"] = "interrupted"
        return history

    monkeypatch.setattr(evaluators, "time_history", interrupted)
    with pytest.raises(KeyboardInterrupt):
        getattr(af, method)(of(ring, "large"), motions[0])
    assert len(begun) == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scales": ()}, "empty"),
        ({"scales": (0.0,)}, "scale"),
        ({"changes": [{"scale": 2.0}]}, "cannot be changed"),
        ({"changes": [{"k_n": -1.0}]}, "above 0"),
        ({"motions": []}, "no motions"),
        ({"motions": [1.0]}, "motion"),
    ],
)
def test_wrong_arguments_are_refused(ring, motions, options, words):
    with pytest.raises(af.errors.InvalidInput, match=words):
        af.ensemble(of(ring, "large"), **{"motions": motions, **options})


def test_a_history_that_was_not_computed_is_refused(ring, motions):
    found = af.ensemble(of(ring, "small"), motions[0], scales=(0.1,))
    with pytest.raises(af.errors.InvalidInput, match="numbered from 0"):
        found.history(1)
    assert "1 histories" in repr(found)
