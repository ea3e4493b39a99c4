"""Case files: accepted keys, and errors of invalid ones."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.cases.analysis_tables import SECTION_FIELDS

RING = Path(__file__).parents[2] / "meshes" / "ring_paper.toml"


GLUED = "contacts.stone to stone.friction=none"
"""Joints that never slide, as Newmark and HHT require."""


def test_shipped_case():
    case = af.Case.read(RING)
    assert case.analysis.scheme == af.dynamics.Conserving()
    assert case.structure.friction == pytest.approx(0.60)
    assert case.structure.joints[8].depth == pytest.approx(0.55)
    assert case.structure.joints[0].contact.normal_stiffness == pytest.approx(1.48e9)
    assert case.analysis.damping.frequencies == (8.0, 16.0)
    assert case.ground_motion().pga == pytest.approx(5.5)
    assert af.Case.of(tomllib.loads(case.text())).structure == case.structure


def test_changes_from_the_command_line():
    changes = ["structure.thickness=0.6", "analysis.scheme=hht", "motion.scale=0.5", "title=x y"]
    case = af.Case.read(RING, [*changes, GLUED])
    assert case.structure.joints[0].depth == pytest.approx(0.6)
    assert case.analysis.scheme == af.HHT()
    assert case.title == "x y"
    assert case.ground_motion().pga == pytest.approx(2.75)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("structure.radus=3", "unknown key 'structure.radus': did you mean 'radius'"),
        ("structre.radius=3", "unknown key 'structre': did you mean 'structure'"),
        ("structure.materials.stone.young=1e9", r"\[materials\] stands beside \[structure\]"),
        ("structure.radius='3 s'", r"structure.radius = '3 s' is not in a unit like m"),
        ("structure.voussoirs=1.5", "structure.voussoirs = 1.5 is not a whole number"),
        ("structure.shape=cone", "structure.shape = 'cone' is not known"),
        ("structure.material=jelly", "'jelly' is not among the materials"),
        ("structure.material=['stone']", r"structure.material = \['stone'\] is not a word"),
        ("structure.shape=['column']", r"structure.shape = \['column'\] is not known"),
        ("materials.stne={young=1e9}", "materials.stne lacks poisson, unit_weight"),
        (
            "materials.lime={young=2e10, unit_weight=24e3}",
            r"lime lacks poisson \(rigid models take E and ν too, .* from preset = 'stone'",
        ),
        ("contacts.x={normal_stifness=1e9}", "'contacts.x.normal_stifness': did you mean"),
        ("analysis.dt=-1", r"toml: dt \[s\] = -1.0 is not between 1e-06 and 0.1"),
        ("analysis.dt='5 s'", r"toml: dt \[s\] = 5.0 is not between 1e-06 and 0.1"),
        ("output.free_body='vousoir 3'", "no block 'vousoir 3': .*'voussoir 3'"),
        (
            "assessment.loads=[{ block = 'vousoir 3', point = [0, 1], weight = 1e3 }]",
            "no block 'vousoir 3': .*'voussoir 3'",
        ),
        ("model.cells=4", r"model.cells = 4 is not a list"),
        ("model.cells=[0, 4]", "ring_paper.toml: cells through = 0 is not a whole number"),
        (
            "model.tolerance=2",
            r"ring_paper.toml: tolerance on .e. \[-\] = 2.0 is not between 0 and 1",
        ),
        ("model.fidelity=modal", "fidelity = 'modal' is not known: use one of"),
        ("analysis.damping={ratio=0.05}", r"write \{ ratio = 0.05, modes"),
        ("analysis.scheme=euler", r"use one of \['conserving', 'newmark', 'hht'\]"),
        ("analysis.scheme={name='conserving', alpha=-0.1}", "unknown key 'analysis.scheme.alpha'"),
        (
            "analysis.scheme={name='hht', alpha=-1.0}",
            r"HHT alpha \[-\] = -1.0 is not between -0.333333 and 0",
        ),
        ("contacts.stone to stone.friction=nun", "friction = 'nun' is not .*, or \"none\""),
        ("contacts.stone to stone.cohesion='5 kN'", "cohesion = '5 kN' is not in a unit like Pa"),
        (
            "contacts.stone to stone.tension='1 kPa'",
            "tension of .* = 1000.0 is not between 0 and 0",
        ),
        ("contacts.stone to stone.cohesion=-1", "cohesion of 'stone to stone' = -1.0 is not betw"),
        ("analysis.until=maybe", "analysis.until = 'maybe' is not known: use one of"),
        ("analysis.stop_at_mechanism=true", "unknown key 'analysis.stop_at_mechanism'"),
        ("model.points=3", "unknown key 'model.points'"),
        (
            "analysis.displacements='large'",
            r"unknown key 'analysis\.displacements': it is model\.displacements$",
        ),
        ("model.damping=1", r"unknown key 'model\.damping': it is analysis\.damping$"),
        (
            "horizontal=1.0",
            r"unknown key 'horizontal': it is limit\.horizontal or pushover\.horizontal",
        ),
        ("output.every=2", "unknown key 'output.every'"),
        ("criteria.hinge=0.7", r"criteria hinge \[-\] = 0.7 is not between 0 and 0.5"),
        ("criteria.limit=0.4", "unknown key 'criteria.limit'"),
        ("criteria.failures=4.0", "criteria.failures = 4.0 is not a whole number"),
        ("criteria=0.4", r"criteria = 0.4 is not a table: write \[criteria\]"),
        ("structure=3", "structure = 3 is not a table"),
        ("nonsense", "write section.key=value"),
        ("title.x=3", "title is not a table"),
        ("title=inf", "title is a float: write words in quotes"),
    ],
)
def test_refusals_name_the_key(change, says):
    with pytest.raises((af.InvalidInput, af.InvalidStructure), match=says):
        af.Case.read(RING, [change])


@pytest.mark.parametrize("scheme", ["newmark", "hht"])
def test_schemes_that_follow_no_sliding_are_refused_where_joints_slide(scheme):
    """Before the dead load, and in the words of the file; joints that never slide may have any."""
    change = f"analysis.scheme={scheme}"
    says = f'(?i)toml: {scheme} follows no sliding.* "conserving".* friction = "none"'
    with pytest.raises(af.InvalidInput, match=says):
        af.Case.read(RING, [change])
    scheme = af.Case.read(RING, [change, GLUED]).analysis.scheme
    assert scheme in (af.dynamics.Newmark(), af.HHT())


def test_every_contact_must_be_kept_from_sliding_for_them():
    bridge, changes = RING.with_name("prusias.toml"), [GLUED, "analysis.scheme=newmark"]
    with pytest.raises(af.InvalidInput, match="follows no sliding"):
        af.Case.read(bridge, changes)
    glued = af.Case.read(bridge, [*changes, "contacts.soil to stone.friction=none"])
    assert np.isinf(glued.structure.friction).all()


def test_joints_of_a_case_slide_by_friction_and_cohesion():
    plain = af.Case.read(RING).structure.joints[3].contact
    assert (plain.friction, plain.cohesion) == (0.60, 0.0)
    table = "contacts.stone to stone"
    held = af.Case.read(RING, [f"{table}.friction='0.7'", f"{table}.cohesion='5 kPa'"])
    contact = held.structure.joints[3].contact
    assert (contact.friction, contact.cohesion) == (0.7, pytest.approx(5e3))
    bonded = af.Case.read(
        RING,
        [f"{table}.{each}" for each in ("cohesion='30 kPa'", "tension='20 kPa'", "dilatancy=0.1")],
    )
    contact = bonded.structure.joints[3].contact
    assert (contact.tension, contact.dilatancy) == (pytest.approx(20e3), 0.1)
    glued = af.Case.read(RING, [GLUED])
    assert not glued.structure.joints[3].contact.slides
    assert af.Case.of(tomllib.loads(glued.text())).structure == glued.structure


def test_geometry_errors_name_the_file():
    with pytest.raises(af.InvalidStructure, match=r"ring_paper.toml: thickness 9 m"):
        af.Case.read(RING, ["structure.thickness=9"])


def test_a_case_has_one_source_of_its_motion():
    with pytest.raises(af.InvalidInput, match="either a file, or synthetic"):
        af.Case.read(RING, ["motion.file=x.AT2"]).ground_motion()
    with pytest.raises(af.InvalidInput, match=r"x\.AT2"):
        af.Case.of({**af.Case.read(RING).settings, "motion": {"file": "x.AT2"}}).ground_motion()


def test_files_that_are_no_case(tmp_path):
    with pytest.raises(af.InvalidInput, match="no case file"):
        af.Case.read(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("= 3")
    with pytest.raises(af.InvalidInput, match="is not TOML"):
        af.Case.read(bad)


BASE = """
[structure]
shape = "circular_arch"
radius = 2.95
thickness = "0.55 m"
embrace = 159.0
voussoirs = 17

[analysis]
damping = { ratio = 0.05, frequencies = ["8 Hz", "16 Hz"] }
"""


def test_a_case_states_only_differences_from_its_base(tmp_path):
    (tmp_path / "ring.toml").write_text(BASE)
    (tmp_path / "by_span.toml").write_text(
        'base = "ring.toml"\nremove = ["structure.radius", "structure.embrace"]\n'
        "[structure]\nspan = 4.0\nrise = 1.5\n[analysis.damping]\nratio = 0.02\n"
    )
    case = af.Case.read(tmp_path / "by_span.toml", ["structure.voussoirs=9"])
    settings = tomllib.loads(case.text())
    (tmp_path / "all.toml").write_text(BASE.replace("ratio = 0.05", "ratio = 0.02"))
    changes = ['remove=["structure.radius", "structure.embrace"]', "structure.voussoirs=9"]
    changes += ["structure.span=4.0", "structure.rise=1.5"]
    assert af.Case.read(tmp_path / "all.toml", changes).settings == case.settings
    with pytest.raises(af.InvalidInput, match=r"^remove = 3: write"):
        af.Case.read(tmp_path / "all.toml", ["remove=3"])
    assert settings["structure"] == {
        "shape": "circular_arch",
        "thickness": "0.55 m",
        "voussoirs": 9,
        "span": 4.0,
        "rise": 1.5,
    }
    assert case.analysis.damping.ratio == 0.02
    assert case.analysis.damping.frequencies == (8.0, 16.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('base = "nothing.toml"', "there is no case file"),
        ('base = "case.toml"', "is its own base"),
        ("base = 3", "not the name of a file"),
        ('base = "ring.toml"\nremove = ["structure.rise"]', "there is no such key"),
        ('base = "ring.toml"\n[structure]\nradios = 3.0', "did you mean 'radius'"),
        (
            'base = "ring.toml"\n[assessment.spectrum]\ncode = "ASCE-7-22"\nsds = 1.0\nsd1 = 0.5',
            r"'assessment.spectrum.ag': it is of another code than ASCE-7-22, whose keys.*"
            r'\(remove = \["assessment\.spectrum"\] leaves out the table of a base\)$',
        ),
    ],
)
def test_invalid_bases_are_refused(text, says, tmp_path):
    spectrum = '[assessment]\nspectrum = { code = "EC8", ag = 0.2, ground = "B" }\n'
    (tmp_path / "ring.toml").write_text(BASE + spectrum)
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(af.InvalidInput, match=says):
        af.Case.read(tmp_path / "case.toml")


def test_a_case_with_some_of_its_pairs_keeps_its_structure(small):
    case = af.Case.read(small)
    alone = case.alone("second")
    assert alone.structure is case.structure
    assert list(alone.suite["pairs"]) == ["second"]
    assert [motion.name for motion in alone.ground_suite().motions] == ["second"]
    assert af.Case.of(tomllib.loads(alone.text())).suite == alone.suite
    assert list(case.alone("second", "first").suite["pairs"]) == ["first", "second"]
    with pytest.raises(af.InvalidInput, match=r"'suite.pairs.secnd': did you mean 'second'"):
        case.alone("secnd")
    with pytest.raises(af.InvalidInput, match=r"no .suite. to take pairs of"):
        af.Case.read(RING).alone("second")


def test_a_case_may_state_every_setting_of_a_discretisation():
    fields = set(af.models.Discretisation.__dataclass_fields__)
    assert set(SECTION_FIELDS["model"]) == fields | {"tolerance"}
    case = af.Case.read(RING, ["model.fidelity=auto", "model.tolerance=0.02"])
    assert (case.analysis.selects_model, case.analysis.tolerance) == (True, 0.02)
    assert case.analysis.discretisation == af.models.Discretisation("full", (4, 4))
    case = af.Case.read(RING, ["model.max_cell_size=50 cm"])
    assert case.analysis.discretisation.max_cell_size == pytest.approx(0.5)


SAMPLES = {"samples": [1.0, 2.0, 4.0], "dt": 0.01}


@pytest.mark.parametrize(
    ("key", "usual", "given", "read"),
    [
        ("model.tolerance", 0.005, {"fidelity": "auto"}, lambda case: case.analysis.tolerance),
        ("motion.scale", 1.0, SAMPLES, lambda case: case.ground_motion().pga),
        ("motion.start", 0.0, SAMPLES | {"end": 0.01}, lambda case: case.ground_motion().duration),
        ("suite.scale", 1.0, {"pairs": {"a": SAMPLES}}, lambda case: case.ground_suite().scale),
        ("suite.reduction", 1.0, {"pairs": {"a": SAMPLES}}, lambda c: c.ground_suite().reduction),
        ("limit.horizontal", 0.0, {"vertical": 0.3}, lambda case: case.limit),
        ("limit.vertical", 0.0, {"horizontal": 0.3}, lambda case: case.limit),
    ],
)
def test_a_key_that_is_left_out_has_its_usual_value(key, usual, given, read):
    column = {"structure": {"shape": "column", "breadth": 1.0, "heights": [1.0]}}
    section, name = key.split(".")
    left_out, stated = (
        read(af.Case.of(column | {section: table})) for table in (given, given | {name: usual})
    )
    assert left_out == stated


def test_a_study_is_no_case(tmp_path):
    (tmp_path / "study.toml").write_text('case = "ring.toml"\n[vary]\nstructure.width = [1, 2]\n')
    with pytest.raises(
        af.InvalidInput, match="this is a study of cases: compute it by `archfem st"
    ):
        af.Case.read(tmp_path / "study.toml")
