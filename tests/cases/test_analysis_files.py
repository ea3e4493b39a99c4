"""Analyses written as case files and read again: every bit of the value, and of its history."""

import itertools
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.cases.report.inputs import tabulate_inputs
from archfem.cases.report.report_data import ReportData
from archfem.cases.toml_file import format_tables, parse_tables
from archfem.joints import DryJoint
from archfem.joints.own_law import registered_laws
from archfem.masonry import Stage, assembled
from archfem.masonry.materials import STONE_TO_STONE

CASES = sorted(
    path
    for path in (Path(__file__).parents[2] / "meshes").glob("*.toml")
    if "[structure" in path.read_text(encoding="utf-8") or "\nbase = " in path.read_text("utf-8")
)
MOTION = af.Motion.synthetic(duration=0.5, pga=3.0, seed=4)


def read_again(analysis, folder):
    """Return an analysis as its file describes it."""
    return af.Case.read(analysis.write(folder / "written.toml")).analysis


@pytest.mark.parametrize(
    "path",
    [
        # the largest files: bridges with fill, piers and walls of many lengths
        pytest.param(
            path, marks=pytest.mark.slow if path.stem.startswith("prusias") else (), id=path.stem
        )
        for path in CASES
    ],
)
def test_shipped_cases_are_read_as_they_were_written(path, tmp_path):
    analysis = af.Case.read(path).analysis
    again = read_again(analysis, tmp_path)
    assert again == analysis
    assert again.fingerprint == analysis.fingerprint
    assert read_again(again, tmp_path / "twice").fingerprint == analysis.fingerprint


@pytest.mark.parametrize(
    ("gravity", "width", "ratio", "mark"), [(9.81, 1.0, 0.05, "default"), (9.7, 1.3, 0.02, "given")]
)
def test_what_equals_its_default_is_not_written_and_not_given(
    gravity, width, ratio, mark, tmp_path
):
    blocks = [af.Block(((0, -1), (1, -1), (1, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    blocks.append(af.Block(((0, 0), (1, 0), (1, 2), (0, 2)), af.STONE, "stone", part="pier"))
    stack = replace(assembled(blocks, af.Contact(1.48e9, 0.3e9, 0.7), width=width), gravity=gravity)
    damping = af.EffectiveDamping(ratio)
    analysis = af.Analysis(stack, fidelity="rigid", damping=damping)
    case = af.Case.read(analysis.write(tmp_path / "stack.toml"))
    assert case.analysis == analysis
    marks = {row[0]: row[-1] for row in tabulate_inputs(ReportData(case, {})).rows}
    assert {marks[name] for name in ("gravity", "width")} == {mark}
    assert (case.settings["analysis"]["damping"] == {"modes": "effective"}) is (mark == "default")
    assert (marks["contact: k_n"], marks["contact: μ"]) == ("given", "given")
    assert not {"contact: cohesion", "contact: dilatancy"} & marks.keys()


def marks_of_ring(folder, stone, contact):
    """Return the marks of the values of a ring's stone and joints after it was written and read."""
    sizes = {"radius": 3.0, "thickness": 0.5, "embrace": 160.0, "voussoirs": 5}
    ring = af.circular_arch(**sizes, material=stone, contact=contact)
    analysis = af.Analysis(ring, fidelity="rigid")
    case = af.Case.read(analysis.write(folder / "ring.toml"))
    assert case.analysis == analysis
    return {row[0]: row[-1] for row in tabulate_inputs(ReportData(case, {})).rows}


def test_values_given_in_python_are_given_in_the_file_though_they_equal_defaults(tmp_path):
    """As friction 0.6, and all that a preset has; what Python left out is a default there too."""
    given = {"normal_stiffness": 1.48e9, "shear_stiffness": 0.3e9}
    for name in ("stone to stone", "ashlar"):
        own = marks_of_ring(tmp_path, af.STONE, af.Contact(**given, friction=0.6, name=name))
        assert [own[f"{name}: {key}"] for key in ("k_n", "k_s", "μ")] == ["given"] * 3
        left = marks_of_ring(tmp_path, af.STONE, af.Contact(**given, name=name))
        assert [left[f"{name}: {key}"] for key in ("k_n", "k_s", "μ")] == [
            "given",
            "given",
            "default",
        ]
    changed = marks_of_ring(tmp_path, af.STONE, replace(STONE_TO_STONE, normal_stiffness=2e9))
    marks = [changed[f"stone to stone: {key}"] for key in ("k_n", "k_s", "μ")]
    assert marks == ["given", "default", "default"]
    for name in ("stone", "granite"):
        stone = af.Material(30e9, 0.2, 20e3, 56e6, name)
        own = marks_of_ring(tmp_path, stone, STONE_TO_STONE)
        assert [own[f"{name}: {key}"] for key in ("E", "weight", "strength")] == ["given"] * 3
        # a strength that is given counts in limit analysis
        assert af.Case.read(tmp_path / "ring.toml").limit.strength == 56e6
    again = af.Case.read(tmp_path / "ring.toml").analysis.write(tmp_path / "again.toml")
    assert again.read_text() == (tmp_path / "ring.toml").read_text()


def test_a_shape_is_written_by_its_lengths(tmp_path):
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
    text = af.Analysis(ring, fidelity="rigid").write(tmp_path / "ring.toml").read_text()
    assert parse_tables(text)["structure"] == {
        "shape": "circular_arch",
        **{"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 7},
    }
    thicker = af.Case.read(tmp_path / "ring.toml", ["structure.thickness=0.6"]).structure
    assert thicker.depths == pytest.approx(0.6)
    # a changed copy of a shape is none any more
    moved = replace(ring, joints=(replace(ring.joints[0], name="left springing"), *ring.joints[1:]))
    again = read_again(af.Analysis(moved, fidelity="rigid"), tmp_path)
    assert again.structure == moved
    assert again.structure.joints[0].name == "left springing"


def random_contact(random, name):
    """A contact with values that no preset has."""
    friction = None if random.random() < 0.2 else float(random.uniform(0.3, 0.9))
    cohesion = float(random.choice([0.0, random.uniform(1e3, 1e5)]))
    slides = friction is not None
    return af.Contact(
        float(10.0 ** random.uniform(8, 11)),
        float(10.0 ** random.uniform(8, 10)),
        friction=friction,
        name=name,
        cohesion=cohesion,
        dilatancy=float(random.choice([0.0, 0.5 * friction])) if slides else 0.0,
        tension=float(random.choice([0.0, 0.9 * cohesion / friction])) if slides else 0.0,
    )


def random_structure(seed):
    """A wall of random courses and bricks, or a ring, with values of their own at each joint."""
    random = np.random.default_rng(seed)
    materials = [
        af.Material(
            float(10.0 ** random.uniform(8, 11)),
            float(random.uniform(0.0, 0.4)),
            float(random.uniform(5e3, 3e4)),
            None if k else float(random.uniform(1e6, 1e8)),
            name=str(random.choice(["stone", "brick"])),
        )
        for k in range(2)
    ]
    if seed % 4 == 0:
        ring = af.circular_arch(
            radius=float(random.uniform(1.0, 4.0)),
            thickness=float(random.uniform(0.3, 0.6)),
            embrace=float(random.uniform(90.0, 180.0)),
            voussoirs=int(random.integers(3, 6)),
            material=materials[0],
        )
        joints = [
            replace(joint, contact=random_contact(random, f"joint law {k % 2}"))
            for k, joint in enumerate(ring.joints)
        ]
        return replace(ring, joints=tuple(joints), name=f"ring {seed}")
    y, blocks = 0.0, [af.Block(((-9, -1), (9, -1), (9, 0), (-9, 0)), materials[0], "base", True)]
    for course in range(random.integers(1, 4)):
        high = y + float(random.uniform(0.2, 0.5))
        edges = np.cumsum([0.0, *random.uniform(0.3, 0.9, random.integers(1, 3))]).tolist()
        for k, (left, right) in enumerate(itertools.pairwise(edges)):
            outline = ((left, y), (right, y), (right, high), (left, high))
            role = str(random.choice(["pier", "ring", "other"]))
            part = f'part "{course}.{k}"'
            blocks.append(
                af.Block(outline, materials[k % 2], f"stone {course}.{k}", part=part, role=role)
            )
        y = high
    contacts = [random_contact(random, "joint") for _ in range(3)]
    return assembled(
        blocks,
        lambda a, b: contacts[(len(a.name) + len(b.name)) % 3],
        width=float(random.uniform(0.5, 5.0)),
        gravity=float(random.choice([9.81, 9.80665])),
        name=f"wall {seed}",
    )


def random_analysis(seed):
    """A random structure with random settings."""
    structure, random = random_structure(seed), np.random.default_rng(seed)
    schemes = (af.dynamics.Conserving(), af.dynamics.Newmark(0.3, 0.55), af.HHT(-0.2))
    never_slides = np.isinf(structure.friction).all() and not structure.tension.any()
    until = af.CountedMechanism(kinds=("local",), criteria=af.Criteria(hinge=0.45))
    stages = [Stage(blocks=tuple(b.name for b in structure.blocks if not b.fixed), name="all")]
    damping = (
        *(None, "effective", af.Rayleigh(0.03, (5.0, 25.0), "initial")),
        *(af.StiffnessDamping(0.04, 9.0, restitution=0.8), af.EffectiveDamping(0.02)),
        af.EffectiveDamping(0.05, "rayleigh", "none", 0.8),
    )
    return af.Analysis(
        structure,
        fidelity="rigid",
        damping=damping[seed % len(damping)],
        dt=None if seed % 3 else float(random.uniform(1e-3, 1e-2)),
        tolerance=float(random.uniform(1e-3, 1e-2)),
        scheme=schemes[seed % 3] if never_slides else schemes[0],
        until=until if seed % 5 == 0 else None,
        record=af.Record(every=1 + seed % 2, fields_every=None if seed % 2 else 3),
        stages=stages if seed % 7 == 0 else None,
    )


@pytest.mark.parametrize(
    "count",
    # a multiple of 5 and of 7, as the settings of `random_analysis` recur
    [12, pytest.param(35, marks=pytest.mark.slow)],
)
def test_random_structures_are_read_as_they_were_written(count, tmp_path):
    for seed in range(count):
        analysis = random_analysis(seed)
        again = read_again(analysis, tmp_path)
        assert again == analysis, seed
        assert again.fingerprint == analysis.fingerprint, seed
        # what the file holds is what Python holds, down to joints, fixed stones and roles
        assert again.structure.joints == analysis.structure.joints
        assert [b.role for b in again.structure.blocks] == [
            b.role for b in analysis.structure.blocks
        ]


@pytest.mark.parametrize(
    "seed", [pytest.param(1, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow), 9]
)
def test_the_value_and_its_file_have_histories_of_the_same_bits(seed, tmp_path):
    analysis = replace(random_analysis(seed), dt=0.002, stages=None, until=None)
    analysis = replace(analysis, structure=strengthened(analysis.structure))
    here, there = analysis.run(MOTION), read_again(analysis, tmp_path).run(MOTION)
    for name in ("N", "V", "M"):
        assert here.joints[name].values.tobytes() == there.joints[name].values.tobytes()


def strengthened(structure):
    """A structure whose joints neither dilate nor break, so that it is stepped by compiled code."""
    joints = [
        replace(joint, contact=replace(joint.contact, dilatancy=0.0, tension=0.0))
        for joint in structure.joints
    ]
    return replace(structure, joints=tuple(joints))


def test_fingerprints_differ_by_the_last_bit():
    column = af.Analysis(af.column(breadth=0.6, heights=[2.4]), fidelity="rigid", dt=0.005)
    stiffer = [
        replace(
            joint,
            contact=replace(joint.contact, normal_stiffness=np.nextafter(1.48e9, inf)),
        )
        for joint in column.structure.joints
    ]
    others = [
        replace(column, structure=replace(column.structure, joints=tuple(stiffer))),
        replace(column, dt=float(np.nextafter(0.005, 1.0))),
        replace(column, damping="effective"),
        replace(column, criteria=af.Criteria(failures=5)),
    ]
    assert len({each.fingerprint for each in [column, *others]}) == 5


def test_parts_of_default_names_and_numbers_of_numpy_are_written(tmp_path):
    arch = af.shapes.Arch(span=4.0, rise=1.5, thickness=0.4, voussoirs=5)
    bridge = af.bridge(arches=[arch], width=2.0)
    numbers = {"dt": np.float32(0.005), "cells": (np.int64(2), np.int64(3))}
    analysis = af.Analysis(bridge, fidelity="faces", damping=af.Rayleigh(0.03, [6, 30]), **numbers)
    again = read_again(analysis, tmp_path)
    assert again == analysis
    assert again.structure.origin[0] == "bridge"


@dataclass(frozen=True)
class Linear(DryJoint):
    """A law of the user."""


def test_a_law_of_the_user_is_written_by_its_name(tmp_path, monkeypatch):
    law = Linear(1e9, 2e8, 0.5, 1e3)
    contact = af.Contact(1e9, 2e8, friction=0.5, law=law)
    column = af.column(breadth=0.6, heights=[1.0], contact=contact)
    analysis = af.Analysis(column, fidelity="rigid")
    with pytest.raises(af.InvalidInput, match=r"register its class by archfem\.joints\.register"):
        analysis.write(tmp_path / "column.toml")
    monkeypatch.setitem(registered_laws, "linear", Linear)
    assert read_again(analysis, tmp_path).structure.joints[0].contact.law == law


def test_a_criterion_that_is_not_registered_has_no_name_in_a_file(tmp_path):
    analysis = af.Analysis(
        af.column(breadth=0.6, heights=[1.0]), fidelity="rigid", until=lambda *_: None
    )
    with pytest.raises(af.InvalidInput, match=r"register it by archfem\.dynamics"):
        analysis.write(tmp_path / "column.toml")


def test_blocks_of_a_file_are_joined_where_it_lists_no_joints(tmp_path):
    (tmp_path / "stack.toml").write_text(
        '[structure]\nshape = "blocks"\nblocks = [\n'
        '  { name = "base", fixed = true, outline = [[-1, -1], [2, -1], [2, 0], [-1, 0]] },\n'
        '  { name = "stone", part = "pier", outline = [[0, 0], ["1 m", 0], [1, "2 m"], [0, 2]] },\n'
        "]\n"
    )
    structure = af.Case.read(tmp_path / "stack.toml").structure
    assert [joint.name for joint in structure.joints] == ["pier, base"]
    limit = af.collapse_factor(structure, live=af.BodyForce(1.0))
    assert limit.factor == pytest.approx(0.5, abs=1e-9)  # breadth over height


@pytest.mark.parametrize(
    ("block", "says"),
    [
        ('{ name = "a" }', r"structure.blocks\[0\] lacks outline"),
        ('{ name = "a", outlines = [] }', r"'structure.blocks\[0\].outlines': did you mean"),
        ('{ name = "a", outline = [[0, 0], [1, 0]] }', "give at least 3 finite points"),
        ('{ name = "a", outline = [[0, 0, 1]] }', "outline"),
        (
            '{ name = "a", outline = [[0, 0]], material = "jam" }',
            "'jam' is not among the materials",
        ),
    ],
)
def test_invalid_blocks_are_refused(block, says, tmp_path):
    (tmp_path / "bad.toml").write_text(f'[structure]\nshape = "blocks"\nblocks = [{block}]\n')
    with pytest.raises((af.InvalidInput, af.InvalidStructure), match=says):
        af.Case.read(tmp_path / "bad.toml")


def test_tables_are_formatted_as_toml_that_reads_the_same():
    tables = {
        "title": 'A "ring" \\ of Nîmes',
        "numbers": [1, -2.5, 1e-300, 1e300, inf, 0.1],
        "empty": {},
        "a section": {"b.c": {"x": True, "y": [[1.0, 2.0], []]}, "z": [{"k": "v"}, {}]},
    }
    assert parse_tables(format_tables(tables)) == tables
