"""Joints that are not assessed: stated in verdicts, tables and pictures; a doubt if they fail."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from portals import DRY, box, portal

import archfem as af
from archfem.cases import result_text
from archfem.cases.report import conclusion, report_data, response
from archfem.dynamics.verdict import doubt_unassessed_joints
from archfem.joints.criteria import describe_assessed_joints
from archfem.studies.evaluators import of_history
from archfem.view.films.renderer import FrameLayout
from archfem.view.films.settings import Setup

SENTENCE = (
    "assessed: 2 of 4 joints (rings and piers: left pier, right pier); "
    "not assessed: left post to lintel; right post to lintel"
)
BOTH = ["left post to lintel", "right post to lintel"]


def shaken(role):
    """The portal, swaying for two seconds at 3 m/s²."""
    motion = af.Motion(3.0 * np.sin(4.0 * np.pi * np.arange(0.0, 2.0, 0.005)), 0.005)
    model = af.build(portal(role), fidelity="rigid")
    given = {"damping": af.StiffnessDamping(0.05, 8.0), "record": af.Record(fields_every=10)}
    return model, af.time_history(model, motion, dt=0.005, **given)


@pytest.fixture(scope="module")
def other():
    return shaken("other")


@pytest.fixture(scope="module")
def ring():
    return shaken("ring")


def unassessed(run):
    """Doubts of joints that are not assessed."""
    return [doubt for doubt in run.verdict.doubts if "not assessed" in doubt.cause]


def test_a_lintel_that_hinges_uncounted_is_a_doubt_with_its_values(other):
    """|e| is beyond 0.46 at both ends, the worse of which is named; the remedy has its part."""
    run = other[1]
    assert run.verdict.mechanisms["any joints at once"] is None
    sizes = {name: float(abs(run.joint(name)["eccentricity"]).max()) for name in BOTH}
    assert min(sizes.values()) > 0.46
    (doubt,) = unassessed(run)
    worse, other_end = sorted(sizes, key=sizes.__getitem__, reverse=True)
    assert doubt.cause.startswith("joints that are not assessed fail: 2; with them counted, ")
    assert f"; for example {worse} (|e| {sizes[worse]:.3f}, V/N " in doubt.cause
    assert other_end not in doubt.cause
    assert "part 'lintel' role='pier' or 'ring'" in doubt.remedy
    lines = str(run.verdict).splitlines()
    assert f"in doubt: {doubt}" in lines
    assert SENTENCE in lines
    assert run.verdict.headline.endswith(f"; {len(run.doubts)} doubts")


def test_assessed_joints_fail_as_long_as_all_joints_do(other, ring):
    """The history is the same; of the lintel as a ring all joints count, by a loop as well."""
    (doubt,), run = unassessed(other[1]), ring[1]
    np.testing.assert_array_equal(run.joints["N"].values, other[1].joints["N"].values)
    failed = (run.joints["hinge"] != 0) | run.joints["slide"] | run.joints["open"]
    seconds = 0.005 * int((failed.sum("joint") >= 4).sum())
    assert seconds > 0.3
    (said,) = re.findall(r"4 joints and more fail at once for (\S+) (m?)s in all", str(run.verdict))
    assert float(said[0]) * (1e-3 if said[1] else 1.0) == pytest.approx(seconds, rel=0.005)
    words = f"with them counted, 4 joints and more fail at once for {seconds:.3g} s in all"
    assert words in str(doubt)
    assert not unassessed(run)
    assert run.verdict.assessed == ""
    assert "assessed" not in str(run.verdict)
    assert run.mechanism.part == "left pier + right pier + lintel"


def test_the_doubt_follows_criteria_and_roles(other, ring, tmp_path):
    """Between the largest |e| of posts and lintel only the lintel hinges, and beyond it nothing."""
    run = other[1]
    e = abs(run.joints["eccentricity"]).max("time").values
    assert e[:2].max() < e[2:].min()
    between = run.with_criteria(af.Criteria(hinge=0.5 * (e[:2].max() + e[2:].min())))
    assert "no assessed joint hinges" in str(between.verdict)
    assert "not assessed fail: 2; for example " in unassessed(between)[0].cause
    assert "with them" not in unassessed(between)[0].cause
    (left,) = unassessed(run.with_criteria(af.Criteria(hinge=0.5 * (e[2] + e[3]))))
    assert [name in left.cause for name in BOTH] == [e[2] > e[3], e[3] > e[2]]
    assert not unassessed(run.with_criteria(af.Criteria(hinge=0.499)))
    # doubts are not stored: a file that is read with other roles has others
    again = run.with_doubts(run.doubts)
    assert "assessed" not in again.dataset.attrs["doubts"]
    assert again.doubts == run.doubts
    path = run.save(tmp_path / "run.nc")
    assert len(unassessed(af.History.read(path, run.structure))) == 1
    again = af.History.read(path, ring[1].structure)
    assert not unassessed(again)
    assert again.mechanism.joints == ring[1].mechanism.joints
    assert af.History.read(path).verdict.assessed == SENTENCE


def test_failures_shorter_than_the_criteria_are_no_doubt(other):
    run = other[1]
    longest = 0.0
    for name in BOTH:
        own, count = run.joint(name), 0
        for failed in ((own["hinge"] != 0) | own["slide"] | own["open"]).values:
            count = count + 1 if failed else 0
            longest = max(longest, 0.005 * count)
    assert unassessed(run.with_criteria(af.Criteria(duration=longest)))
    assert not unassessed(run.with_criteria(af.Criteria(duration=longest + 1e-3)))


def history(structure, failing, displacements):
    """Two instants at which named joints hinge."""
    found = np.zeros((2, len(structure.joints), 3))
    found[..., 0] = 1e4
    for number, joint in enumerate(structure.joints):
        found[:, number, 2] = 0.49e4 * joint.depth * (joint.name in failing)
    dataset = af.joints.joint_dataset(structure, found, 0.01 * np.arange(2.0))
    return dataset.assign_attrs(displacements=displacements)


def test_large_displacements_doubt_joints_at_rings_and_piers_alone():
    """Their verdict follows every stone: a stack beside the portal is no part of it."""
    stack = [
        box(5.0, y, 6.0, y + 1.0, f"stone {y:g}", part="stack", role="other") for y in (0.0, 1.0)
    ]
    structure = portal("other", stack)
    (bed,) = {joint.name for joint in structure.joints if joint.blocks == (4, 5)}
    for failing, said in ((bed, {"small"}), (BOTH[0], {"small", "large"}), ("left pier, base", ())):
        doubted = {
            kind
            for kind in ("small", "large")
            if doubt_unassessed_joints(history(structure, [failing], kind), structure)
        }
        assert doubted == set(said)


def gate(role):
    """A semicircle on piers, and three spandrel stones a side from its extrados to the outside."""
    sizes = {"radius": 1.6, "thickness": 0.3, "voussoirs": 12, "pier_breadth": 0.8}
    bare = af.arch_on_piers(**sizes, courses=[0.6, 0.6], chords=1)
    x, y = 1.75 * np.cos(np.arange(4) * np.pi / 12.0), 1.75 * np.sin(np.arange(4) * np.pi / 12.0)
    stones = []
    for k in range(3):
        corners = np.array([(x[k], y[k]), (2.0, y[k]), (2.0, y[k + 1]), (x[k + 1], y[k + 1])])
        for side, points in (("east", corners), ("west", corners[::-1] * (-1.0, 1.0))):
            given = {"part": f"{side} spandrel", "role": role}
            stones.append(af.Block(points.tolist(), af.STONE, f"{side} {k}", **given))
    return af.masonry.assembled([*bare.blocks, *stones], DRY)


@pytest.mark.parametrize("role", ["other", "pier"])
def test_faces_of_a_spandrel_on_the_extrados_are_no_hinges_of_the_arch(role):
    """All six fail throughout: no mechanism and no doubt. A bed on a pier is one or counts."""
    structure = gate(role)
    by_name = {joint.name: joint for joint in structure.joints}
    backs = [name for name in by_name if name.startswith("voussoir")]
    assert len(backs) == 6
    bed = "right pier course 2 to east 0" if role == "other" else "east spandrel, base"
    for name in backs:
        assert np.hypot(*by_name[name].ends.T) == pytest.approx(1.75)
        part = f"{name.split()[-2]} spandrel" if role == "other" else "extrados of arch"
        assert (by_name[name].part, by_name[name].role) == (part, "other")
    for kind in ("small", "large"):
        joints = history(structure, [*backs, bed], kind)
        assert not any(af.first_mechanisms(af.History(joints, structure)).values())
        causes = [doubt.cause for doubt in doubt_unassessed_joints(joints, structure)]
        assert [bed in cause for cause in causes] == [True] * (role == "other")
        assert not any("voussoir" in cause for cause in causes)
    counted = dict(zip(by_name, structure.judged, strict=True))
    assert counted[bed] is np.bool_(role == "pier")


def test_a_joint_that_bears_nothing_at_rest_is_no_hinge():
    """One end of the lintel has no force, from the start on or later."""
    structure = portal("other")
    for start, doubted in (0, False), (1, True):
        found = np.full((2, 4, 3), [1e4, 0.0, 0.0])
        found[start:, 2] = 0.0
        joints = af.joints.joint_dataset(structure, found, 0.01 * np.arange(2.0))
        assert bool(doubt_unassessed_joints(joints, structure)) is doubted


def test_fill_that_slides_is_no_doubt_but_left_out():
    """One ring below fill, all of whose joints hinge."""
    arch = af.shapes.Arch(span=4.0, rise=1.6, thickness=0.3, voussoirs=13)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.5))
    soil = [joint.name for joint in bridge.joints if joint.role == "other"]
    joints = history(bridge, soil, "small")
    assert (joints["hinge"].any("time").sum(), len(soil)) == (13, 13)
    assert doubt_unassessed_joints(joints, bridge) == []
    assert describe_assessed_joints(joints) == (
        "assessed: 14 of 27 joints (rings and piers: arch); not assessed: 13 of backfill"
    )


def test_chords_of_a_curved_face_count_as_one_joint(tmp_path):
    """A ring of 13 stones has 14 joints and carries fill on 13 backs, by one chord or by four."""
    arch = af.shapes.Arch(span=4.0, rise=1.6, thickness=0.3, voussoirs=13)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.5), chords=4)
    words = "assessed: 14 of 27 joints (rings and piers: arch); not assessed: 13 of backfill"
    assert len(bridge.joints) == 14 + 4 * 13
    assert bridge.assessment == words
    joints = history(bridge, [], "small")
    assert describe_assessed_joints(joints) == words
    joints.to_netcdf(tmp_path / "joints.nc")
    assert describe_assessed_joints(xr.load_dataset(tmp_path / "joints.nc")) == words


def test_nothing_is_said_where_all_joints_are_assessed():
    """Rings and piers; or other parts, where there are no rings and piers."""
    whole = portal("pier")
    wall = af.masonry.assembled([replace(block, role="other") for block in whole.blocks], DRY)
    for structure in (whole, wall):
        assert structure.judged.all()
        assert structure.assessment == ""
        dead = af.dead_load(af.build(structure, fidelity="rigid"))
        assert dead.plot().get_suptitle() == ""


def test_tables_state_what_is_assessed(other, ring):
    for (model, run), said in ((other, True), (ring, False)):
        table = result_text.describe_pairs({"one": run, "two": run})
        assert (SENTENCE in table.splitlines()) == said
        assert (of_history(run).get("assessed") == SENTENCE) == said
        limit, assessment = SimpleNamespace(demand=None), SimpleNamespace(spectrum=None)
        case = SimpleNamespace(
            structure=model.structure, suite=None, report={}, settings={"structure": {}}
        )
        case.limit, case.assessment, case.target = limit, assessment, None
        data = report_data.ReportData(case, {"one": run})
        vars(data)["motions"] = {}  # a run alone does not keep its motion
        facts = conclusion.list_facts(data)
        assert (("joints", SENTENCE) in facts) == said
        grid = response._tabulate_joints(data, run)
        assert grid.caption.endswith(f" A{SENTENCE[1:]}.") == said


@pytest.mark.slow
def test_a_case_that_is_run_states_it_everywhere(tmp_path, capsys):
    """Printed at check and run, in summary and report; the doubt sets the exit code."""
    af.masonry.write_outlines(portal("other"), tmp_path / "portal.geojson")
    case = tmp_path / "portal.toml"
    case.write_text(
        'title = "Portal"\n[structure]\nshape = "outlines"\nfile = "portal.geojson"\n'
        '[model]\nfidelity = "rigid"\n[motion]\nsynthetic = { duration = 2.0, pga = 4.0 }\n'
        "[analysis]\ndt = 0.005\n"
    )
    assert af.commands.main(["check", str(case)]) == 0
    assert SENTENCE in capsys.readouterr().out.splitlines()
    out = tmp_path / "out"
    assert af.commands.main(["run", str(case), "--out", str(out)]) == 3
    assert capsys.readouterr().out.splitlines().count(SENTENCE) >= 2
    summary = (out / "summary.txt").read_text()
    assert SENTENCE in summary.splitlines()
    assert "in doubt: joints that are not assessed fail: 2; " in summary
    assert af.commands.main(["report", str(out), "--inputs", str(tmp_path)]) == 0
    page = (out / "report.html").read_text()
    assert page.count(SENTENCE[1:]) >= 3  # principal results, table of joints, player


@pytest.mark.slow
def test_pictures_state_what_is_assessed(other, ring):
    for (model, run), said in ((other, True), (ring, False)):
        dead, instant = af.dead_load(model), run.joints.isel(time=90)
        figures = [
            *(dead.plot(), run.plot(), af.view.draw_names(model.structure)),
            af.view.draw_envelope({"run": run}),
            af.view.draw_structure(model.structure, instant),
            af.view.draw_displaced(model, dead),
            af.view.draw_instants({"run": (model.structure, instant)}),
            af.view.draw_joint({"run": run}, "left pier, base"),
        ]
        notes = {" ".join(figure.get_suptitle().split()) for figure in figures}
        assert all((SENTENCE in note) == said for note in notes)
        layout = FrameLayout(
            Setup.of(model, dead.q[None], "displacement", None), (1280, 720), run.joints
        )
        texts = [text.get_text() for text in layout._figure.texts]
        assert (SENTENCE in texts) == said
        assert run.player(model).scene.note.startswith(f"A{SENTENCE[1:]}.") == said
    both = af.view.draw_envelope({"other": other[1], "ring": ring[1]})
    assert " ".join(both.get_suptitle().split()) == f"other: {SENTENCE}"


def test_a_figure_of_the_user_keeps_its_title(other):
    figure = af.view.draw_structure(other[0].structure)
    figure.suptitle("mine")
    af.view.draw_structure(other[0].structure, other[1].joints.isel(time=90), axes=figure.axes[0])
    assert figure.get_suptitle() == "mine"


def test_a_thrust_line_needs_assessed_joints_at_both_faces(other, ring):
    """Through posts and lintel, or through none: a post has one assessed joint."""
    for (model, run), count in ((other, 0), (ring, 3)):
        scene = run.player(model).scene
        assert len(scene.data["links"]) == count
        assert ("thrust line</span>" in run.player(model).page) == (count > 0)
        labels = af.dead_load(model).plot().axes[0].get_legend_handles_labels()[1]
        assert ("thrust line" in labels) == (count > 0)
        assert ("thrust at a joint" in labels) == (count == 0)


def test_no_thrust_line_crosses_a_part_that_is_not_assessed():
    """Two arches on a free abutment of another role: both springings are assessed, it is not."""
    ring = {"part": "left arch", "role": "ring"}
    blocks = [
        box(-1.0, -1.0, 0.0, 0.0, "rock", fixed=True, part="rock", role="other"),
        box(0.0, -0.5, 1.0, 0.0, "left stone", **ring),
        box(1.0, -1.0, 2.0, 0.0, "abutment", part="abutment", role="other"),
        box(2.0, -0.5, 3.0, 0.0, "right stone", part="right arch", role="ring"),
        box(3.0, -1.0, 4.0, 0.0, "far rock", fixed=True, part="rock", role="other"),
        box(1.0, -2.0, 2.0, -1.0, "ground", fixed=True, part="rock", role="other"),
    ]
    structure = af.masonry.assembled(blocks, DRY)
    found = np.tile([1e4, 0.0, 0.0], (len(structure.joints), 1))
    figure = af.view.draw_structure(structure, af.joints.joint_dataset(structure, found))
    assert structure.judged.sum() == 4
    (line,) = [each for each in figure.axes[0].lines if each.get_label() == "thrust line"]
    pieces = line.get_xydata().reshape(-1, 3, 2)[:, :2, 0]
    assert sorted(map(sorted, pieces.tolist())) == [[0.0, 1.0], [2.0, 3.0]]
