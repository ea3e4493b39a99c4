"""Results as text and tables."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from backfilled import slender_bridge
from mechanisms import FOUR, twitching

import archfem as af
from archfem.cases.analysis_keys import parse_limit
from archfem.cases.defaults import describe_margins_at_rest
from archfem.cases.result_folder import limit_files
from archfem.cases.result_text import (
    _count_mechanisms,
    _mechanism_cell,
    describe_collapse,
    describe_limit,
    describe_pushover,
    describe_run,
    describe_run_quality,
    describe_verdicts,
    format_ratio,
    note_lower_crowns,
    tabulate_joints,
    tabulate_runs,
)
from archfem.cases.toml_file import format_tables
from archfem.commands.cli import main
from archfem.limit.collapse import Outcome, describe_fill
from archfem.limit.fill_range import FillAssumption, FillRange
from archfem.limit.instability import list_margins_at_rest
from archfem.limit.mechanism_count import duration_text
from archfem.masonry.out_of_plane import find_transverse_push


@pytest.fixture(scope="module")
def run(ring):
    """The ring, under a motion that makes it a mechanism."""
    model = af.build(ring, fidelity="rigid")
    motion = af.Motion.synthetic(duration=3.0, pga=6.0, seed=2)
    return af.time_history(model, motion, dt=0.005, damping=af.Rayleigh(0.05, (8.0, 16.0)))


def test_the_verdict_comes_first(run, ring):
    text = describe_run(ring, run, run.joints.isel(time=0))
    found = describe_run_quality(run)
    assert text.startswith(f"{run.verdict}\n\n{found}\n\njoint ")
    assert f"outcome: reached the end of the motion; {len(run.time) - 1} steps" in found
    assert "of the largest exchanged at most" in found


def test_table_of_pairs_has_the_verdict_by_each_definition(run, tmp_path):
    """Class, time, duration and opening of each mechanism, and how many pairs have one."""
    calm = run.with_criteria(af.Criteria(hinge=0.5, failures=18, friction=100.0))
    table = tabulate_runs({"strong": run, "calm": calm})
    strong, other, total = (dict(zip(table.head, row, strict=True)) for row in table.rows)
    assert (strong["pair"], other["pair"], total["pair"]) == ("strong", "calm", "all")
    assert strong["outcome"] == "mechanism"
    assert re.fullmatch(r"joint \d+", strong["joint"])  # the critical one, by name
    for name, found in run.verdict.mechanisms.items():
        words = f"local {found.time:.2f} s, {duration_text(found.duration)}"
        assert strong[name] == f"{words}, {1e3 * found.opening:.3g} mm"
    assert other["any joints at once"] == "none"
    assert total["any joints at once"] == "1 of 2"
    assert strong["ring and pier at once"] == "-"  # there is no pier
    alone = tabulate_runs({"pair": af.History.read(run.save(tmp_path / "run.nc"))})
    assert alone.rows[0][alone.head.index("verified")] == "-"


def test_peaks_of_a_run_that_ended_early_have_its_time_and_no_mechanism_is_unknown(run):
    """The ground's peaks are those up to the end; where joints were lost none is no count."""
    cut = af.History(run.dataset.assign_attrs(ended="parted"), run.structure)
    table = tabulate_runs({"whole": run, "cut": cut})
    whole, parted, _ = (dict(zip(table.head, row, strict=True)) for row in table.rows)
    assert parted["max |ax|"] == f"{whole['max |ax|']} until {run.time[-1]:.2f} s"
    calm = run.with_criteria(af.Criteria(hinge=0.5, failures=18, friction=100.0)).verdict
    found = [calm.mechanisms, run.verdict.mechanisms]
    for until, said in (("", "1 of 2"), (" until 1 s", "≥ 1 of 2")):
        verdicts = [SimpleNamespace(mechanisms=x, until=until) for x in found]
        assert _count_mechanisms(verdicts, "any joints at once") == said
    lost = SimpleNamespace(mechanisms=calm.mechanisms, until=" until 1 s")
    assert _count_mechanisms([lost, lost], "any joints at once") == "unknown"
    assert _count_mechanisms([lost], "ring and pier at once") == "-"


def test_a_mechanism_too_small_to_matter_stands_beside_the_first_that_is_not():
    """By more than a thousandth of the depth, 0.5 mm; without pile it is the first of all."""
    structure, joints = twitching("pier 2")
    run = af.History(joints, structure)
    found = run.mechanisms["verified"]
    assert found.decisive.joints == tuple(FOUR)
    assert found.displacement == 1e-5 < found.below == 5e-4
    first, larger = str(found).split("; the first that moves by more than 0.5 mm: ")
    assert first.startswith("local mechanism of pier 2 at 1.000 s by ")
    assert larger == str(af.limit.first_verified_mechanism(*twitching("side wall")).moved)
    cell = _mechanism_cell(SimpleNamespace(mechanisms=run.mechanisms), "verified")
    assert cell == "local 1.00 s, 1 s, 0.01 mm; beyond 0.5 mm semi-global 3.00 s, 2 s, 3 mm"
    brief = af.History(joints.isel(time=slice(0, 3)), structure).mechanisms["verified"]
    assert str(brief) == f"{first}; none moves by more than 0.5 mm"
    assert brief.decisive is None


def test_a_slide_of_a_part_of_a_millisecond_has_a_bound_in_the_table(run):
    """One joint slides in a step of 0.3 ms, one in a step of 0.7 ms, and the others do not."""
    joints = run.joints.isel(time=slice(0, 4)).copy(deep=True)
    joints["time"] = [1.0, 1.0003, 1.001, 1.002]
    number = np.flatnonzero(joints["judged"].values)[:3]
    joints["slide"].values[:] = False
    joints["slide"].values[1, number[0]] = joints["slide"].values[2, number[1]] = True
    head, rows = tabulate_joints(joints)
    columns = head.index("slide from"), head.index("slide for")
    said = [[row[k] for k in columns] for row in rows[:3]]
    assert said == [["1.000 s", "< 0.001 s"], ["1.001 s", "0.001 s"], ["-", "-"]]


def test_words_and_tables_obey_the_criteria_of_the_run(run):
    loose = run.with_criteria(af.Criteria(hinge=0.3, failures=5))
    assert tabulate_joints(loose.joints) != tabulate_joints(run.joints)
    calm = loose.with_criteria(af.Criteria(failures=18))
    met = [name for name, found in calm.verdict.mechanisms.items() if found]
    assert met == ["verified"]
    assert calm.verdict.headline.startswith("mechanism by verified; none by any joints at once, ")


@pytest.mark.parametrize(("rise", "count"), [(2.1, 0), (1.7, 1)])
def test_lower_crowns_are_noted(rise, count):
    """By the radii: the middle one of nine stones has its highest corners beside the crown."""
    rings = {"left": (8.4, 2.1), "low one": (8.4, rise)}
    bridge, fill = slender_bridge(**rings), af.limit.Fill(friction_angle=35.0)
    notes = note_lower_crowns(bridge, fill)
    arches = (af.shapes.Arch(span=a, rise=b, thickness=0.6, voussoirs=9) for a, b in rings.values())
    high, low = (
        (each.radius + 0.3) * np.cos(each.half / 9.0) - each.radius * np.cos(each.half)
        for each in arches
    )
    words = f"note: crowns differ by {high - low:.2f} m: fill above 'low one' bears none of the "
    assert len(notes) == count
    assert all(note.startswith(words) for note in notes)
    assert not note_lower_crowns(bridge, None)


DEFAULTS = (
    "fill, by default: law pressure, cohesion 0 kPa, active 1, dispersal boussinesq, spread 30 "
)
DEFAULTS += "degree, lever 0"


@pytest.mark.parametrize("foot", ["buttressed", pytest.param("on piers", marks=pytest.mark.slow)])
def test_a_hinge_of_a_pier_is_named_by_its_left_or_right_face(foot):
    """Pushed to the right, a pier turns about its right face, whichever side is its intrados."""
    if foot == "on piers":
        sizes = {"radius": 1.7, "thickness": 0.4, "voussoirs": 9, "pier_breadth": 0.9}
        built, base = af.arch_on_piers(**sizes, courses=[0.8] * 3), "joint 15"
    else:
        sizes = {"span": 3.0, "thickness": 0.4, "voussoirs": 9, "breadth": 0.9, "height": 2.4}
        built, base = af.shapes.buttressed_arch(**sizes, embrace=180), "pier 2, base"
    for joint in built.joints:
        inner, outer = joint.ends[:, 0]
        faces = ["left face", "right face"][:: 1 if inner < outer else -1]
        expected = faces if joint.role == "pier" else ["intrados", "extrados"]
        assert [*map(joint.name_face, ("intrados", "extrados"))] == expected
    pushed = af.collapse_factor(built, live=af.BodyForce(1.0))
    turned = SimpleNamespace(hinges=pushed.hinges, sentence="")
    spectrum = af.motion.Eurocode8(0.2, "B")
    for words in (
        describe_collapse(built, pushed, parse_limit({})),
        str(pushed),
        str(af.kinematic_assessment(built, spectrum)),
        describe_pushover(built, turned, []),
    ):
        assert f"{base} at the right face" in words
        assert re.search(r"joint \d+ at the extrados", words)  # of the ring


def test_limit_analysis_in_words(ring):
    pushed = af.collapse_factor(ring, live=af.BodyForce(1.0))
    limit = parse_limit({"strength": 2e6, "fill": {"friction_angle": 35}})
    outcome, hinges, crushing, fill, across = describe_collapse(ring, pushed, limit).splitlines()
    least = find_transverse_push(ring)[0]
    assert least < pushed.factor
    assert across.startswith("note: nothing is checked across the plane of the drawing: held by")
    assert f"begins to overturn at {least:.3g} g" in across
    wide = replace(ring, width=100.0)
    assert "across the plane" not in describe_collapse(wide, pushed, limit)
    place = f"at {pushed.factor:.4g} g, pushed to the right"
    assert outcome == f"limit analysis: four-hinge mechanism, {place}"
    assert hinges.startswith("hinges, by the face in contact: joint 0 at the intrados; joint 6 at")
    assert crushing == "joints crush at 2 MPa, given for limit analysis (stones: 56 MPa)"
    own = parse_limit({"strength": 56e6, "fill": {"friction_angle": 35}})
    words = describe_collapse(ring, pushed, own)
    assert "\njoints crush at 56 MPa, the strength of the stones\n" in words
    assert "at most a third of the passive pressure, friction angle 35°, cohesion 0 kPa" in fill
    plastic = {"law": "plastic", "friction_angle": 30, "cohesion": "5 kPa"}
    plastic = parse_limit({"fill": plastic}).fill
    assert describe_fill(plastic, ring).startswith(
        "fill: a plastic body, friction angle 30°, cohesion 5 kPa, too strong for 5 of 8 bridges"
    )
    # the clear springing of a ring is below the ends of its centre line
    clear = min(joint.intrados[1] for joint in ring.joints)
    for law, ends in ((plastic, "stones below are fixed"), (limit.fill, "by up to 1 MPa")):
        by_level = describe_fill(replace(law, backing=0.5), ring)
        above = f"{0.5 - clear:.3g} m above the lowest clear springing"
        assert f"; backing up to y = 0.5 m, {above}: " in by_level
        assert by_level.endswith(ends)
        assert describe_fill(replace(law, backing_height=0.5 - clear), ring) == by_level
    mirrored = af.collapse_factor(ring, live=af.BodyForce(-2.0))
    assert mirrored.sentence == pushed.sentence.replace("right", "left")
    assert pushed.sentence.startswith("four-hinge mechanism, at ")
    wheel = af.PointLoad(0.5, (0.0, -3e3))
    loaded = af.collapse_factor(ring, live=wheel)
    assert loaded.sentence.endswith(f"at {loaded.factor:.4g} times 3 kN at x = 0.5 m")
    axles = af.collapse_factor(ring, live=[wheel, af.PointLoad(1.0, (0.0, -2e3))])
    assert axles.sentence.endswith(f"at {axles.factor:.4g} times 3, 2 kN at x = 0.5, 1 m")
    both = af.collapse_factor(ring, live=[wheel, af.BodyForce(1.0)])
    assert both.sentence.endswith(f"at {both.factor:.4g} times the load")
    # the lesser of both senses is concluded with
    site = af.Eurocode8(ag=0.1, ground="C")
    given = {"limit": {"fill": {"friction_angle": 35, "mobilisation": 1.0 / 3.0}}}
    case = SimpleNamespace(structure=ring, limit=limit, target=None, settings=given, parapets=0.0)
    case.assessment = SimpleNamespace(spectrum=None, options={})
    case.motion = case.suite = None
    for factor, rank in ((0.9, "higher"), (1.1, "higher"), (0.99999, "the same")):
        other = replace(mirrored, factor=factor * pushed.factor, upper=factor * pushed.factor)
        least, words, _ = describe_limit(case, pushed, other)
        first, second = (other, pushed) if factor == 0.9 else (pushed, other)
        assert least is first
        assert words.startswith(f"limit analysis: {first.sentence}\n")
        other = f"\nin the other sense: {second.sentence} ({rank})\n"
        # a value is a default by the case, not by its size
        assert words.endswith(f"{other}{DEFAULTS}")
    ranged = replace(pushed, upper=1.2 * pushed.factor)
    between = 1.1 * pushed.factor
    words = describe_limit(case, ranged, replace(mirrored, factor=between, upper=between))[1]
    assert words.endswith(f" (their ranges overlap)\n{DEFAULTS}")
    # a sense in which nothing was found has bounds alone, and never leads over one with a mechanism
    ends = {"factor": 0.0, "motion": 0.0 * pushed.motion}
    lost = replace(mirrored, outcome=Outcome.BRACKETED, upper=2.0 * pushed.factor, **ends)
    for given_first in ((lost, pushed), (pushed, lost)):
        least, words, _ = describe_limit(case, *given_first)
        assert least is pushed
        bound = (
            f"no state without dilatancy was found; it is between 0 and {2.0 * lost.upper:.4g} g"
        )
        noted = (
            f"in the other sense: {bound}, pushed to the left (which sense bears less is not known)"
        )
        assert noted in words
    lower = replace(lost, upper=pushed.factor)
    assert describe_limit(case, lost, lower)[0] is lower
    endless = replace(pushed, outcome=Outcome.UNBOUNDED, factor=np.inf, upper=np.inf)
    assert describe_limit(case, endless, lost)[0] is lost
    # 1.15 a_g at the surface
    for case.target, named in (
        (site, "0.1 g × S 1.15 (type 1 by default); vertical acceleration is left out"),
        (af.motion.TableSpectrum([0.0, 1.0], [0.1, 0.2]), "0.1 g"),
    ):
        ratio = pushed.factor / float(case.target.horizontal(0.0))
        for bounded in (False, True):
            words = describe_limit(case, replace(mirrored, bounded=bounded), None)[1]
            most = f"{'≤ ' * bounded}{ratio:.3g} times the site's {named}"
            outcome = f"is withstood{' by an upper estimate alone' * bounded}"
            assert words.endswith(f"\na push by the ground {outcome}: it begins to move at {most}")
    assert "a push by the ground" not in describe_limit(case, pushed, lost)[1]
    strong = 1.1 * pushed.factor
    case.target = af.motion.TableSpectrum([0.0, 1.0], [strong, strong])
    outcome = "a push by the ground is not withstood: it begins to move at 0.909 times"
    assert outcome in describe_limit(case, pushed, None)[1]
    case.target = None
    least = replace(pushed, solutions=SimpleNamespace(may_be_less=True))
    words = describe_limit(case, least, mirrored)[1]
    assert words.endswith(f" (higher, as far as a search can tell)\n{DEFAULTS}")
    given["limit"]["fill"] |= {"backing": 0.5, "backing_strength": 1e6}
    case.limit = parse_limit(given["limit"])
    assert "backing strength" not in describe_limit(case, pushed, None)[1]
    del given["limit"]["fill"]["backing_strength"]
    assert describe_limit(case, pushed, None)[1].endswith(f"{DEFAULTS}, backing strength 1 MPa")
    slab = af.column(breadth=4.0, heights=[1.0])  # slides before it turns
    slid, lifted = (af.collapse_factor(slab, live=af.BodyForce(*g)) for g in ((1.0,), (0.0, -1.0)))
    assert (slid.bounded, lifted.bounded, pushed.bounded) == (True, False, False)
    words = describe_collapse(slab, slid, parse_limit({})).splitlines()
    assert words[1] == f"sliding: {slab.joints[0].name}"
    first = "limit analysis: this load never overturns it"
    last = (
        "joints do not crush: no strength of the stones counts (56 MPa of the preset is not given)"
    )
    assert describe_collapse(slab, lifted, parse_limit({})).splitlines() == [first, last]


@pytest.mark.parametrize(
    ("right", "left", "low", "high"),
    [((0.0, 0.87), (0.0, 0.39), 0.0, 0.39), ((0.1, 0.9), (0.4, 0.2), 0.1, 0.2)],
)
def test_a_push_is_compared_with_the_site_by_the_lesser_sense_of_each_state(
    ring, right, left, low, high
):
    """Ranges of the senses may overlap, or begin alike where a state does not stand."""
    states = [FillAssumption("at the feet", x) for x in ("none of its pressure", "all of it")]
    push = af.collapse_factor(ring, live=af.BodyForce(1.0))
    senses = [
        replace(
            push,
            factor=max(each),
            upper=max(each),
            live=(af.BodyForce(sense),),
            over_fill=FillRange(dict(zip(states, each, strict=True))),
        )
        for sense, each in ((1.0, right), (-1.0, left))
    ]
    case = SimpleNamespace(structure=ring, limit=parse_limit({}), target=None, settings={})
    case.limit = replace(case.limit, demand=0.23 * 9.80665)
    case.assessment, case.parapets = SimpleNamespace(spectrum=None, options={}), 0.0
    case.motion = case.suite = None
    for first, other in (senses, senses[::-1]):
        found, words, site = describe_limit(case, first, other)
        assert (site.least, site.most) == pytest.approx((low / 0.23, high / 0.23))
        decided = (
            "is withstood only by what is assumed of the fill"
            if high > 0.23
            else "is not withstood"
        )
        move = f"it begins to move at {site} times the demand of 0.23 g"
        assert words.endswith(f"\na push by the ground {decided}: {move}")
        assert found.push == (-1.0 if low == 0.0 else 1.0)
        files = limit_files(case, found, words, site, [])
        assert json.loads(files["limit.json"])["rows"][0][4]["most"] == site.most
    # a motion without a vertical, and one with it
    end = "; vertical acceleration is left out"
    for table, lacks in (
        ({"file": "m.csv"}, False),
        ({"file": "m.csv", "vertical": "v.csv"}, True),
        ({"synthetic": {"seed": 1}}, True),
        ({"synthetic": {"seed": 1, "vertical_ratio": 0.0}}, False),
    ):
        for case.motion, case.suite in ((table, None), (None, {"pairs": {"m": table}})):
            case.limit = replace(case.limit, dead=())
            assert describe_limit(case, *senses)[1].endswith(end) == lacks
            case.limit = replace(case.limit, dead=(af.BodyForce(0.0, 0.18),))
            assert not describe_limit(case, *senses)[1].endswith(end)


def test_point_loads_without_a_strength_are_stated_by_an_assumed_one_too(ring):
    """A strength that is given as none, or the search without dilatancy, has no such number."""
    point = {"x": 1.4, "force": (0.0, -1e3)}
    limit = parse_limit({"point": point})
    crushed = af.collapse_factor(ring, live=limit.live, strength=5e6)
    whole = limit.solve(ring)
    assert crushed.factor < 0.99 * whole.factor
    last = describe_collapse(ring, whole, limit).splitlines()[-1]
    words = (
        "joints do not crush: no strength of the stones counts (56 MPa of the preset is not given)"
    )
    assert last == f"{words}; with 5 MPa, {crushed.sentence}"
    for given in ({"strength": "none"}, {"friction": "nonassociated"}):
        without = parse_limit({"point": point, **given})
        assert without.describe_crushing(ring) == words
    assert parse_limit({"horizontal": 1.0}).describe_crushing(ring) == words


def test_verdicts_of_several_runs_are_counted(run):
    ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=180.0, voussoirs=5)
    assert describe_verdicts([run], ring) == run.verdict.headline
    outcome, doubtful = run.verdict.outcome, "2" if run.verdict.doubts else "none"
    assert describe_verdicts([run, run], ring) == f"{outcome} in 2 of 2 runs; doubts in {doubtful}"


@pytest.mark.parametrize(("above", "state"), [(0.9, "fixed"), (0.9, "free"), (0.2, "fixed")])
def test_verdicts_and_notes_name_fixed_walls_that_hold_the_ends_of_pieces(run, above, state):
    """Of a fill of 1.2 m; walls that yield, or end low, do not hold it."""
    ring = af.shapes.Arch(span=2.0, rise=0.5, thickness=0.3, voussoirs=5)
    wall = {"length": 1.5, "height": 1.0, "above": above, "setback": 0.0, "state": state}
    sides = [af.shapes.Sidewall(name=f"{side} wall", **wall) for side in ("left", "right")]
    whole = af.bridge(
        arches=[ring], sidewalls=sides, backfill=af.shapes.Backfill(cover=0.4), width=1.0
    )
    soil = {"friction_angle": 30.0, "cohesion": 1e5}
    structure = af.masonry.jointed_fill(whole, 0.45, **soil)
    words = "fixed walls hold the ends of the fill over 0.9 m"
    held = f"; {words}" * (above == 0.9 and state == "fixed")
    assert describe_verdicts([run], structure) == run.verdict.headline + held
    assert describe_verdicts([run, run], structure).endswith(f"doubts in 2{held}")
    case = af.Case.of({"structure": {"shape": "column", "breadth": 0.6, "heights": [1.2]}})
    friction, depth, *notes = describe_margins_at_rest(case, structure)
    assert friction.endswith(", that of the fill too")
    assert "all joints, those of the fill too, " in depth
    begin = f"note: {words} and do not yield, so that a ring stands longer: "
    assert [note.startswith(begin) for note in notes] == [True] * bool(held)
    assert [*list_margins_at_rest(structure, np.inf)] == []
    assert describe_verdicts([run], whole) == run.verdict.headline


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-1e-5, "0.000"),
        (-0.0006, "-0.001"),
        (0.4996, "0.500"),
        (float("nan"), "open"),
        (1e3, "> 100"),
    ],
)
def test_a_ratio_of_nothing_has_no_sign(value, text):
    assert format_ratio(value) == text


def test_dead_loads_that_a_push_leaves_at_rest_are_noted(tmp_path, capsys, unplotted):
    """W = 28.8 kN and P = 10 kN on a block of 0.6 m by 2.4 m: about the toe, b/2 over heights."""
    block = {"shape": "column", "breadth": 0.6, "heights": [2.4]}
    tables = {"structure": block, "limit": {"horizontal": 1.0, "friction": "none"}}
    press = [{"x": 0.0, "force": [0.0, -10e3]}]
    push = {"horizontal": 1.0, "dead": press, "stop": {"steps": 3}}
    rigid = {"fidelity": "rigid"}
    loaded = tables | {"limit": tables["limit"] | {"dead": press}, "pushover": push, "model": rigid}
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(format_tables(loaded))
    assert main(["run", str(path), "--out", str(out)]) == 0
    note = "dead loads of 10 kN have no mass: they are not pushed; what has mass stands in"
    assert capsys.readouterr().out.count(f"note: {note}") == 2
    for name in ("limit", "pushover"):
        (own,) = json.loads((out / f"{name}.json").read_text())["notes"]
        assert own.startswith(note)
        assert note in (out / f"{name}.txt").read_text()
    case = af.Case.of(loaded)
    found = case.limit.solve(case.structure)
    assert found.factor == pytest.approx(38.8 * 0.3 / (28.8 * 1.2), rel=1e-6)
    assert note in str(found)
    body = {"x": 0.0, "length": 0.4, "weight": 10e3, "centre_of_gravity": 0.2}
    standing = af.Case.of(tables | {"structure": block | {"standing": {"press": body}}})
    moved = standing.limit.solve(standing.structure)
    assert moved.factor == pytest.approx(38.8 * 0.3 / (28.8 * 1.2 + 10.0 * 2.6), rel=1e-6)
    # loads that grow by themselves push no weights
    point = af.collapse_factor(
        case.structure, live=af.PointLoad(0.0, (1e3, 0.0), y=2.4), dead=case.limit.dead
    )
    assert "no mass" not in str(point) + str(moved)


@pytest.mark.slow
def test_parapets_of_a_rating_that_a_push_leaves_out_are_noted(tmp_path, capsys, unplotted):
    """2 kN/m along 0.6 m are 1.2 kN, 4.2 % of 28.8 kN: runs, limits, assessments say so."""
    tables = {
        "structure": {"shape": "column", "breadth": 0.6, "heights": [2.4]},
        "limit": {"horizontal": 1.0, "friction": "none"},
        "model": {"fidelity": "rigid"},
        "assessment": {"spectrum": {"code": "NTC-2018", "ag": 0.2, "f0": 2.4, "tc_star": 0.3}},
        "rating": {"vehicle": "LM1", "parapets": "2 kN/m"},
    }
    tables["assessment"]["spectrum"]["site"] = "B"
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(format_tables(tables))
    note = "note: parapets of [rating], 2 kN/m, are left out here: 1.2 kN, 4.2% of the weight; as "
    for command, count in (("run", 2), ("limit", 1), ("assess", 1)):
        main([command, str(path), "--out", str(out / command)])
        assert capsys.readouterr().out.count(note) == count
    assert note in (out / "limit" / "limit.txt").read_text()
    assert note.removeprefix("note: ") in (out / "limit" / "limit.json").read_text()
    body = {"x": 0.0, "length": 0.6, "weight": "1.2 kN", "centre_of_gravity": 0.5}
    tables["structure"]["standing"] = {"parapets": body}
    for given in (tables | {"rating": {"vehicle": "LM1"}}, tables):
        path.write_text(format_tables(given))
        main(["limit", str(path), "--out", str(out / "limit")])
        assert "note: parapets" not in capsys.readouterr().out
