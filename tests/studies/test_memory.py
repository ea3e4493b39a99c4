"""Caches of a worker between points: never of another point, and used where they may be."""

from copy import copy, deepcopy
from dataclasses import replace
from functools import wraps
from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.cases import motion_keys
from archfem.cases.provenance import hash_inputs, hash_sections
from archfem.cases.structure_keys import cached_structure
from archfem.dynamics import StiffnessDamping
from archfem.dynamics.solvers import base
from archfem.models import Discretisation
from archfem.studies import cache
from archfem.studies.parameter_space import Point

DT = 0.005

CASE = {
    "structure": {"shape": "column", "breadth": "0.6 m", "heights": ["0.5 m", "0.5 m", "0.5 m"]},
    "model": {"fidelity": "rigid"},
    "motion": {"synthetic": {"seed": 1, "duration": 8.0, "pga": "4 m/s**2"}},
    "analysis": {"dt": "5 ms", "damping": {"ratio": 0.05, "frequency": "9 Hz"}},
}


def case(**changes):
    """The case with other values, "section__key"."""
    settings = deepcopy(CASE)
    for key, value in changes.items():
        section, name = key.split("__")
        settings.setdefault(section, {})[name] = value
    return af.Case.of(settings)


@pytest.fixture(scope="module")
def rest():
    return cache.dead_load_of(case())


def same(first, second):
    """Whether two runs are the same, bit for bit."""
    return all(
        first.dataset[name].values.tobytes() == second.dataset[name].values.tobytes()
        for name in ("N", "V", "M", "eccentricity", "opening", "rotation", "energy_drift", "last_q")
    )


@pytest.mark.parametrize(
    ("displacements", "method"),
    [
        pytest.param("small", "newton", marks=pytest.mark.slow),
        pytest.param("small", "compliance", marks=pytest.mark.slow),
        ("large", "newton"),
    ],
)
def test_runs_of_one_model_are_those_of_new_models_whatever_ran_before(displacements, method):
    """Runs share the matrices of their solver, and each has its own state: bit for bit."""
    damping = StiffnessDamping(0.05, 9.0)
    motions = [af.Motion.synthetic(duration=1.0, pga=pga, seed=2) for pga in (2.0, 7.0)]
    structure = case().structure

    def run(model, number, damping=damping):
        return af.time_history(model, motions[number], dt=DT, damping=damping, method=method)

    def build():
        return af.build(structure, fidelity="rigid", displacements=displacements)

    alone = [run(build(), number) for number in (0, 1)]
    compiled, model = len(base.advance.signatures), build()
    for number in (0, 1, 0, 1, 1):
        assert same(run(model, number), alone[number])
    assert not same(*alone)
    assert len(base.advance.signatures) == compiled  # copies have the types of the originals
    # another damping, and a copy that was changed, have matrices of their own
    assert not same(run(model, 0, StiffnessDamping(0.1, 9.0)), alone[0])
    heavier = copy(model)
    heavier.mass = 2.0 * model.mass
    assert not same(run(heavier, 0), alone[0])
    assert same(run(model, 0), alone[0])


def test_motions_are_read_once_at_any_scale_and_scaled_as_by_the_case(monkeypatch):
    made, synthetic = [], af.Motion.synthetic
    monkeypatch.setattr(cache, "_cache", {})

    @wraps(synthetic)  # its arguments are the keys of a case
    def noted(**given):
        made.append(given)
        return synthetic(**given)

    monkeypatch.setitem(motion_keys.MADE, "synthetic", noted)
    cases = [case(motion__scale=scale) for scale in (0.3, 1.7)]
    found = [cache.ground_motion(each) for each in cases]
    assert len(made) == 1
    for each, motion in zip(cases, found, strict=True):
        assert motion.horizontal.tobytes() == each.ground_motion().horizontal.tobytes()
        assert motion.vertical.tobytes() == each.ground_motion().vertical.tobytes()
    turned = cache.ground_motion(case(motion__reversed=True))
    assert np.array_equal(turned.horizontal, -synthetic(**made[0]).horizontal)


def test_a_suite_is_matched_once_for_all_factors(monkeypatch):
    settings = {key: deepcopy(CASE[key]) for key in ("structure", "model", "analysis")}
    settings["suite"] = {
        "matched": True,
        "target": {"code": "TBEC-2018", "ss": 1.14, "s1": 0.315, "site": "ZD"},
        "pairs": {"only": {"synthetic": {"seed": 1, "duration": 10.0, "dt": 0.01}}},
    }
    cases = []
    for factors in ({}, {"scale": 1.3, "reduction": 3.0}, {"reduction": 2.0, "reversed": True}):
        changed = deepcopy(settings)
        changed["suite"] |= factors
        cases.append(af.Case.of(changed))
    met = []

    def matched(suite, target, band):  # which would take a second
        met.append(target)
        return replace(suite, pairs=tuple(pair.scaled(target.ss / 3.0) for pair in suite.pairs))

    monkeypatch.setattr(af.Suite, "matched", matched)
    own = [each.ground_suite().motions[0] for each in cases]
    monkeypatch.setattr(cache, "_cache", {})
    met.clear()
    for each, motion in zip(cases, own, strict=True):
        assert cache.ground_motion(each).horizontal.tobytes() == motion.horizontal.tobytes()
    assert len(met) == 1
    settings["suite"]["target"]["ss"] = 1.2
    cache.ground_motion(af.Case.of(settings))
    assert len(met) == 2


@pytest.mark.slow
def test_a_pair_is_matched_once_by_all_workers(matching_study, tmp_path):
    tables = []
    for workers in (1, 2):
        study, marks = matching_study(tmp_path / str(workers))
        tables.append(study.run(workers=workers))
        assert sorted(mark.name[0] for mark in marks.iterdir()) == list("abc")
    assert tables[0].identical(tables[1])  # to the last bit
    assert (tables[0]["mean"].std("suite.pair") > 0.0).all()


def test_models_are_distinguished_by_content():
    """Cases that were read apart share a model, and one that another key changes has its own."""
    first, again, other = (
        Point(settings, Path(), changes)
        for settings, changes in (
            (deepcopy(CASE), (("structure.breadth", "0.7 m"),)),
            (case(structure__breadth="0.7 m", analysis__dt="2 ms").settings, ()),
            (deepcopy(CASE), ()),
        )
    )
    assert first.model_key == again.model_key
    assert first.model_key != other.model_key


def test_a_structure_is_made_once_and_again_where_anything_of_it_differs(tmp_path):
    first, again = case(motion__scale=0.5).structure, case(motion__scale=0.7).structure
    assert first is again
    assert case(structure__breadth="0.7 m").structure is not first
    assert case(**{"contacts__stone to stone": {"friction": 0.5}}).structure is not first
    settings = {"structure": {"shape": "outlines", "file": "wall.geojson"}}
    path = tmp_path / "wall.geojson"
    for height in (1.0, 1.5):
        drawing = af.column(breadth=0.6, heights=[height])
        af.masonry.write_outlines(drawing, path)
        assert cached_structure(settings, tmp_path).weight == pytest.approx(drawing.weight)


def test_cases_differ_where_their_arches_stand_in_another_order():
    piers = {"first": {"height": "1 m"}, "second": {"height": "2 m"}}
    turned = dict(reversed(piers.items()))
    digests = {
        hash_inputs({"structure": {"piers": each, "width": 1.0}}) for each in (piers, turned)
    }
    assert len(digests) == 2
    same = {"structure": {"width": 1.0, "piers": piers}}
    assert hash_inputs(same) in digests  # where a number stands says nothing


def test_a_quantity_is_the_same_in_any_spelling():
    def digests(rest, width, friction, title="57 mm"):
        settings = {
            "title": title,
            "structure": {"shape": "column", "breadth": width, "heights": [width, 1]},
            "motion": {"file": "pulse.csv", "rest": rest},
            "contacts": {"stone to stone": {"friction": friction}},
        }
        case = hash_inputs(settings)
        return case, hash_sections(settings, Path(), ["structure", "motion", "contacts"])

    first = digests("10 s", "57 mm", 0.5)
    # 57e-3 and 57 * 1e-3 differ by round-off
    for other in ((10, 0.057, 0.5), (10.0, "5.7 cm", 0.5), ("10000 ms", 57e-3, 0.5)):
        assert digests(*other) == first
    for other in ((1, "57 mm", 0.5), ("10 s", 0.0570001, 0.5), ("10 s", "57 mm", "none")):
        assert not {*digests(*other)} & {*first}
    # words that pint would compute are no quantities
    assert digests(10, 0.057, 0.5, "2026-11-29") != digests(10, 0.057, 0.5, "1986")


def test_a_mesh_serves_other_materials_and_no_other_shape():
    pytest.importorskip("dolfinx")
    from archfem.models.fem.mesh import get_mesh

    discretisation = Discretisation("full", (2, 2))
    stiff, soft = (
        af.column(breadth=0.6, heights=[1.0], contact=af.Contact(stiffness, 3e8, 0.6, "joint"))
        for stiffness in (1e9, 2e9)
    )
    first, again = get_mesh(stiff, discretisation), get_mesh(soft, discretisation)
    assert first.grid is again.grid
    assert again.structure is soft
    wider = af.column(breadth=0.7, heights=[1.0])
    assert get_mesh(wider, discretisation).grid is not first.grid
    assert get_mesh(stiff, Discretisation("full", (3, 2))).grid is not first.grid
