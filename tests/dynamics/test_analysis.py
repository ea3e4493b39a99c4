"""`archfem.Analysis`: its methods, and the functions that take it, agree with those of a model."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import analysis

COLUMN = af.column(breadth=0.6, heights=[1.2, 1.2])
MOTION = af.Motion.synthetic(duration=0.5, pga=2.5, seed=2)
ROCKING = af.Analysis(
    COLUMN, fidelity="rigid", displacements="large", damping="effective", dt=0.004
)


def equal_bits(one, other):
    """Whether two histories have the same N, V, M and ground to the last bit."""
    return all(one.joints[k].values.tobytes() == other.joints[k].values.tobytes() for k in "NVM")


def test_its_run_is_that_of_the_functions_with_the_same_words():
    model = af.build(COLUMN, fidelity="rigid", displacements="large")
    run = ROCKING.run(MOTION)
    assert equal_bits(run, af.time_history(model, MOTION, damping="effective", dt=0.004))
    dead = af.dead_load(model)
    viscous = af.effective_damping(model, 0.05)
    assert equal_bits(run, af.time_history(model, MOTION, start=dead, damping=viscous, dt=0.004))
    assert equal_bits(run, af.time_history(ROCKING, MOTION))
    assert float(abs(run.joints["eccentricity"]).max()) > 0.3  # it rocks


@pytest.mark.parametrize(
    ("given", "like"),
    [
        ({"dt": 0.008}, {"dt": 0.008}),
        ({"damping": af.StiffnessDamping(0.1, 5.0)}, {"damping": af.StiffnessDamping(0.1, 5.0)}),
        ({"tolerance": 0.02, "dt": None}, {"tolerance": 0.02, "dt": None}),
        ({"damping": None}, {"damping": None}),
        ({"displacements": "small"}, {"displacements": "small"}),
        ({"record": af.Record(every=3)}, {"record": af.Record(every=3)}),
        ({"criteria": af.Criteria(hinge=0.4)}, {"criteria": af.Criteria(hinge=0.4)}),
        ({"method": "snes"}, {"method": "snes"}),
    ],
)
def test_a_keyword_of_a_run_takes_the_place_of_the_setting(given, like):
    short = MOTION.cut(0.0, 0.2)
    run, changed = af.time_history(ROCKING, short, **given), replace(ROCKING, **like).run(short)
    assert equal_bits(run, changed)
    for key in ("criteria_hinge", "method", "tolerance"):
        assert run.dataset.attrs.get(key) == changed.dataset.attrs.get(key)
    assert len(run.time) == len(changed.time)


def test_its_tolerance_is_that_of_the_steps_where_it_has_no_step():
    free = replace(ROCKING, dt=None, tolerance=0.03)
    model = af.build(COLUMN, fidelity="rigid", displacements="large")
    other = af.time_history(model, MOTION, damping="effective", tolerance=0.03)
    assert equal_bits(free.run(MOTION), other)
    assert free.run(MOTION).dataset.attrs["tolerance"] == 0.03


def test_functions_of_models_and_structures_take_it():
    rest = ROCKING.dead_load()
    assert af.dead_load(ROCKING) is rest
    # the weights of one and of two stones, 0.6 x 1.2 m2 of 20 kN/m3
    assert rest.joints["N"].values == pytest.approx([28.8e3, 14.4e3], rel=1e-9)
    assert af.modes(ROCKING, 2).frequencies.tolist() == ROCKING.modes(2).frequencies.tolist()
    assert len(ROCKING.modes().frequencies) == 6
    assert len(ROCKING.modes(99).frequencies) == rest.model.size
    # breadth over height
    assert af.collapse_factor(ROCKING, live=af.BodyForce(1.0)).factor == pytest.approx(0.25)
    assert af.stands(ROCKING)
    spectrum = af.Eurocode8(ag=0.2, ground="B")
    assert af.kinematic_assessment(ROCKING, spectrum).alpha_0 == pytest.approx(0.25, rel=1e-3)
    small = replace(ROCKING, displacements="small")
    pushed = af.pushover(small, af.BodyForce(1.0))
    assert pushed.factor < 0.25  # rigid blocks alone reach it
    assert pushed.factor == pytest.approx(0.25, rel=0.1)
    assert af.effective_damping(ROCKING).frequency == pytest.approx(
        ROCKING.modes(1).frequencies[0], rel=1e-9
    )


@pytest.mark.slow
def test_its_searches_are_those_of_the_functions():
    found = ROCKING.scale(MOTION, precision=1.0)
    model = af.build(COLUMN, fidelity="rigid", displacements="large")
    options = {"precision": 1.0, "dt": [0.004, 0.002]}
    assert found == af.collapse_scale(model, MOTION, damping="effective", **options)
    assert found == ROCKING.scale(MOTION, **options)
    scales = af.mechanism_scales(
        replace(ROCKING, criteria=af.Criteria(failures=1)), MOTION, precision=0.3
    )
    assert scales["any joints at once"].upper <= scales["verified"].upper
    with pytest.raises(af.InvalidInput, match=r"small displacements.*displacements='large'"):
        replace(ROCKING, displacements="small").scale(MOTION)


@pytest.mark.slow
def test_studies_take_it(tmp_path):
    longer = af.Motion.synthetic(duration=1.0, pga=2.5, seed=2)
    ida = ROCKING.ida([longer], limits=["first hinge"], precision=0.3, workers=1)
    low, high = ida.capacities("first hinge")
    # a steady push of 0.46 / 0.5 of breadth over height hinges the base, short pulses need more
    assert 0.92 * 0.25 * 9.81 < high[0] < 6.0
    assert high[0] <= 1.3 * low[0]
    study = af.Study(
        ROCKING, vary={"structure.breadth": [0.6, 0.9], "dt": [0.004, 0.002]}, motion=MOTION
    )
    table = study.run(tmp_path, workers=1)
    assert dict(table.sizes) == {"structure.breadth": 2, "analysis.dt": 2}
    thick = table["largest_displacement"].values
    assert (thick[1] < thick[0]).all()  # a broader column rocks less
    run = ROCKING.run(MOTION)
    assert thick[0, 0] == run.verdict.displacement
    at_rest = af.Study(ROCKING, vary={"displacements": ["small", "large"]}).run(workers=1)
    assert at_rest["N"].values == pytest.approx(14.4e3, rel=1e-6)


@pytest.mark.slow
def test_its_sensitivity_to_mesh_and_step():
    elastic = af.Analysis(COLUMN, fidelity="condensed", damping="effective")
    found = elastic.mesh_sensitivity(
        MOTION.cut(0.0, 0.15), cells=(1, 2, 4), rules=["exact"], rungs=["rigid"], workers=1
    )
    assert found.step is not None
    assert 0.0 < found.mesh.limit < 0.5
    resting = elastic.mesh_sensitivity(cells=(1, 2, 4), rules=["exact"], rungs=[], workers=1)
    assert resting.step is None
    assert resting.of("N").mesh.limit == pytest.approx(14.4e3, rel=1e-6)


@pytest.mark.slow
def test_the_range_of_its_verdict_is_of_large_displacements():
    small, motion = replace(ROCKING, displacements="small"), MOTION.cut(0.0, 0.3)
    found = small.verdict_range(motion, samples=1, vary={"joint_rule": ["exact"]})
    assert found.dataset["outcome"].values[0] == "stands"
    assert found.dataset["displacement"].values[0] == ROCKING.run(motion).verdict.displacement
    undamped = replace(ROCKING, damping=None).verdict_range(
        motion, samples=1, vary={"joint_rule": ["exact"]}
    )
    assert not {"damping_ratio", "damping_kind"} & set(undamped.properties)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fidelity": "modal"}, "fidelity = 'modal' is not known"),
        ({"damping": 0.05}, "damping = 0.05: give 'effective', EffectiveDamping"),
        ({"damping": "critical"}, "damping = 'critical': give 'effective'"),
        ({"dt": 5.0}, r"dt \[s\] = 5.0 is not between 1e-06 and 0.1"),
        ({"tolerance": 0.0}, r"tolerance on .e. \[-\] = 0.0 is not between 0 and 1"),
        ({"scheme": af.HHT()}, "HHT.* does not keep the energy of blocks that turn far"),
        ({"fidelity": "auto", "mesh_file": "x.msh"}, "one mesh, and fidelity 'auto' chooses"),
        ({"record": 3}, "record = 3 is a int: give Record"),
        ({"stages": [af.masonry.Stage(blocks=("stone",))]}, "no block or part 'stone'"),
        (
            {
                "until": af.CountedMechanism(criteria=af.Criteria()),
                "criteria": af.Criteria(hinge=0.4),
            },
            "the run is judged by",
        ),
    ],
)
def test_values_that_exclude_each_other_are_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        replace(ROCKING, **given)


def test_schemes_without_sliding_are_refused_where_joints_slide():
    with pytest.raises(af.InvalidInput, match="Newmark follows no sliding"):
        af.Analysis(COLUMN, fidelity="rigid", scheme=af.dynamics.Newmark())


def test_models_are_built_once_and_not_sent_to_other_processes(monkeypatch):
    built = []
    build = analysis.build
    monkeypatch.setattr(analysis, "build", lambda *a, **k: built.append(1) or build(*a, **k))
    fresh = replace(ROCKING)
    fresh.run(MOTION)
    fresh.run(MOTION.scaled(0.5))
    fresh.modes(1)
    assert built == [1]
    sent = pickle.loads(pickle.dumps(fresh))
    assert sent == fresh
    assert set(vars(sent)) == set(analysis.Analysis.__dataclass_fields__)


def test_its_repr_has_what_differs_from_the_defaults():
    assert repr(af.Analysis(COLUMN)) == "Analysis(column)"
    assert len({ROCKING, replace(ROCKING), replace(ROCKING, dt=0.002)}) == 2
    text = repr(replace(ROCKING, damping=None))
    assert text == "Analysis(column, fidelity='rigid', displacements='large', dt=0.004)"


def test_auto_selects_a_model_for_each_motion(monkeypatch):
    motions = []

    def select(structure, tolerance, motion, damping, dt, *, displacements):
        motions.append((motion, tolerance, damping, dt, displacements))
        return af.build(structure, fidelity="rigid")

    monkeypatch.setattr(analysis, "select_model", select)
    auto = af.Analysis(COLUMN, fidelity="auto", tolerance=0.01, dt=0.004)
    assert auto.discretisation.fidelity == "full"
    auto.dead_load(MOTION)
    auto.dead_load()
    assert motions == [(each, 0.01, None, 0.004, "small") for each in (MOTION, None)]
    assert np.isfinite(auto.run(MOTION).joints["N"].values).all()
