"""Scale factors at first mechanism: closed form, whole runs, the search on made-up runs."""

import re
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import inf
from types import SimpleNamespace

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem._display import ProgressReport
from archfem.cases import answers
from archfem.dynamics import CollapseScale, mechanism_scales, motion_scaling
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.fall import RIGID_STAND
from archfem.dynamics.monitor import FILL_TENSION
from archfem.dynamics.rigid_body.rocking_body import FirstFall
from archfem.dynamics.scale_search import (
    COLLAPSE_DEFINITION,
    MechanismScales,
    ScaledRun,
    search_scales,
)
from archfem.dynamics.time_history import LEAVE_OUT, OR_LEAVE_OUT
from archfem.dynamics.verdict import ROCKS_SOFTLY
from archfem.errors import logger as log
from archfem.models.model import Doubt
from archfem.motion.motion import admissible_range

ROUND_OFF = 1.0 + 1e-9
DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
Ending = af.dynamics.Ending
DEFINITIONS = af.dynamics.MECHANISM_DEFINITIONS


@pytest.fixture(scope="module")
def on_piers():
    structure = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * 3
    )
    return af.build(structure, fidelity="rigid")


def test_a_slow_push_hinges_a_block_as_statics_says():
    """e = a h / (2 g b) reaches its limit; the pulse lasts 250 periods of the block."""
    breadth, height, peak = 0.5, 1.0, 4.0
    model = af.build(af.column(breadth=breadth, heights=[height]), fidelity="rigid")
    pulse = 0.5 * peak * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, 401)))
    found = mechanism_scales(
        model,
        af.Motion(pulse, dt=0.02),
        damping=af.Rayleigh(0.05, (10.0, 30.0)),
        precision=0.01,
        dt=0.01,
    )
    expected = af.Criteria().hinge * 2.0 * model.structure.gravity * breadth / height / peak
    bracket = found["verified"]
    assert bracket.lower / 1.01 < expected < 1.01 * bracket.upper  # the pulse is not quite static
    assert bracket.ratio <= 1.01 * ROUND_OFF
    assert found.definitions == ("verified",)
    assert "has no such joints" in found.table()


@pytest.mark.slow
def test_bounds_are_those_of_whole_runs(on_piers):
    """Each bound again, to the end of the motion, without the event that shortens runs."""
    motion = af.Motion.synthetic(duration=2.0, pga=6.0, seed=2)
    given = {"start": af.dead_load(on_piers), "damping": DAMPING, "dt": 0.005}
    found = mechanism_scales(on_piers, motion, precision=0.2, **given)
    assert found.definitions == DEFINITIONS
    for scale in {
        bound for name in DEFINITIONS for bound in (found[name].lower, found[name].upper)
    }:
        run = af.time_history(on_piers, motion.scaled(scale), **given)
        met = af.first_mechanisms(run)
        for name in DEFINITIONS:
            if scale <= found[name].lower:
                assert met[name] is None
            elif scale == found[name].upper:
                assert met[name] == found[name].run.mechanisms[name]
    assert all(found[name].ratio <= 1.2 * ROUND_OFF for name in DEFINITIONS)
    assert found["any joints at once"].upper <= min(found[name].upper for name in DEFINITIONS[:3])


def pretended(fails, ended=lambda scale: Ending.FINISHED):
    """Runs that fail by a rule of the scale alone."""

    def shaken(scale):
        hit = af.limit.Mechanism("local", "arch", (0,), 1.0)
        found = {name: hit if fails[name](scale) else None for name in DEFINITIONS}
        return ScaledRun(scale, found, ended(scale), f"in words at {scale:.3g}")

    return shaken


def test_lines_of_a_search_name_its_motion(monkeypatch, capsys):
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)
    fails = dict.fromkeys(DEFINITIONS, beyond(2.0))
    search_scales(pretended(fails), DEFINITIONS, 0.05, (0.05, 5.0), name="first")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 3
    assert all(line.startswith("scale of first: ") for line in lines)


def test_lines_within_a_run_name_its_scale_behind_what_the_last_one_found(monkeypatch, capsys):
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)

    def shaken(scale):
        with ProgressReport("loose blocks", None) as progress:
            progress.show(f"at {scale:#.3g}")
        kind, stones = ("dislocated", ("WC",)) if scale > 1.2 else ("stands", ())
        fall = CollapseState(kind, None, stones, 0.1, 0.1, True)
        return ScaledRun(scale, {}, Ending.FINISHED, "", fall)

    search_scales(shaken, ("collapse",), 0.5, (1.0, 1.5), name="first")
    lines = capsys.readouterr().err.splitlines()
    within = [
        re.sub(r"in \S+ s(; about .* step alone)?", "in t s", x) for x in lines if "loose" in x
    ]
    assert within[:3] == [
        "scale of first: now 1.00 ×; loose blocks: at 1.00",
        "scale of first: 1.00 × the motion: stands, in t s; now 1.41 ×; loose blocks: at 1.41",
        "scale of first: 1.41 × the motion: dislocated (WC), in t s; now 1.50 ×; loose blocks: "
        "at 1.50",
    ]


@pytest.mark.parametrize("threshold", [0.3, 1.7, 4.0])
def test_lines_of_a_search_estimate_how_many_runs_are_left(threshold, monkeypatch, capsys):
    """At most two more or less once a fall and a stand are known; their time is by the mean."""
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)
    clock = iter(np.arange(0.0, 1000.0, 1.5))  # read before and after a run
    monkeypatch.setattr("archfem.dynamics.scale_search.perf_counter", lambda: next(clock))
    made = []

    def shaken(scale):
        kind = "fallen" if scale >= threshold else "stands"
        made.append(scale)
        return ScaledRun(scale, {}, Ending.FINISHED, "", CollapseState(kind, None, (), 0, 0, True))

    search_scales(shaken, (COLLAPSE_DEFINITION,), 0.05, (0.1, 10.0), name="first")
    done = [x for x in capsys.readouterr().err.splitlines() if "now" not in x.rpartition(";")[2]]
    assert len(done) == len(made)
    known = next(k for k in range(99) if min(made[: k + 1]) < threshold <= max(made[: k + 1]))
    for k, line in enumerate(done[:-1]):
        left, seconds = re.search(
            r"; about (\d+) runs, (\S+) s, are left by this time step alone", line
        ).groups()
        assert float(seconds) == pytest.approx(1.5 * int(left), rel=0.05)  # two digits
        assert k < known or abs(int(left) - (len(made) - 1 - k)) <= 2
    assert "left" not in done[-1]


def searched(fails, *, ended=lambda scale: Ending.FINISHED, precision=0.05, between=(0.05, 5.0)):
    """Brackets of such runs."""
    return search_scales(pretended(fails, ended), DEFINITIONS, precision, between)


THRESHOLDS = dict(zip(DEFINITIONS, (0.21, 0.74, 0.75, 0.2, 3.1), strict=True))


def beyond(threshold):
    return lambda scale: scale >= threshold


def test_search_closes_in_on_every_threshold():
    found = searched({name: beyond(each) for name, each in THRESHOLDS.items()}, precision=0.02)
    for name, threshold in THRESHOLDS.items():
        assert found[name].lower < threshold <= found[name].upper
        assert found[name].ratio <= 1.02 * ROUND_OFF
    assert len(found.runs) <= 10 + 5 * 4  # ladder, and ln(√2) / ln(1.02) halved to 1 for each


@pytest.mark.slow
def test_every_run_of_a_search_has_the_criteria(on_piers):
    motion = af.Motion.synthetic(duration=2.0, pga=6.0, seed=2)
    given = {"damping": DAMPING, "criteria": af.Criteria(hinge=0.4, failures=60), "dt": 0.005}
    found = mechanism_scales(on_piers, motion, precision=1.0, **given)
    assert found.definitions == ("verified",)  # there are no sixty joints
    assert len(found.runs) > 1
    for run in found.runs:
        whole = af.time_history(on_piers, motion.scaled(run.scale), **given)
        assert run.mechanisms["verified"] == af.first_mechanisms(whole)["verified"]
    usual = af.first_mechanisms(whole, af.Criteria())["verified"]
    assert run.mechanisms["verified"] != usual  # the criteria tell


def test_brackets_are_open_where_a_definition_fails_nowhere_or_everywhere():
    always, never = (lambda _: True), (lambda _: False)
    fails = dict(zip(DEFINITIONS, (always, never, never, never, beyond(2.0)), strict=True))
    found = searched(fails, between=(0.1, 3.0))
    assert (found["any joints at once"].lower, found["any joints at once"].upper) == (0.0, 0.1)
    assert (found["one part at once"].lower, found["one part at once"].upper) == (3.0, inf)
    assert found["verified"].upper == pytest.approx(2.0, rel=0.05)


def test_no_motion_beyond_five_g_is_tried():
    """A block so broad that it hinges nowhere, and so rough that it slides nowhere."""
    broad = af.build(glued(af.column(breadth=10.0, heights=[0.5])), fidelity="rigid")
    strong = af.Motion(np.array([0.0, 20.0, 0.0]), dt=0.01)
    found = mechanism_scales(broad, strong, criteria=af.Criteria(hinge=0.5, friction=100.0))
    assert found.runs[-1].scale == pytest.approx(5.0 * 9.80665 / 20.0)


def test_survivals_above_a_failure_are_noted():
    """A window that fails, below scales that survive: the smallest failure found counts."""
    fails = {name: beyond(0.3) for name in DEFINITIONS}
    fails["verified"] = lambda scale: 0.45 < scale < 0.6 or scale >= 2.0
    found = searched(fails)
    bracket = found["verified"]
    assert 0.45 <= bracket.upper <= 0.45 * 1.05
    assert 1.0 in bracket.above
    assert "survives also" in found.table()
    assert not found["any joints at once"].above


def test_a_run_without_equilibrium_counts_as_failed():
    found = searched(
        dict.fromkeys(DEFINITIONS, lambda _: False),
        ended=lambda scale: Ending.FAILED if scale >= 1.3 else Ending.FINISHED,
    )
    for name in DEFINITIONS:
        assert found[name].lower < 1.3 <= found[name].upper
    words = f"in words at {found['verified'].upper:.3g}"
    assert found.table().count(words) == len(DEFINITIONS)


def test_mechanisms_of_a_failed_run_are_kept(ring, monkeypatch):
    """By Newmark's method, undamped, energy grows without work before all joints fail at once."""
    newmark = partial(af.time_history, scheme=af.dynamics.Newmark())
    monkeypatch.setattr("archfem.dynamics.motion_scaling.time_history", newmark)
    model = af.build(glued(ring), fidelity="rigid")
    motion = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)
    ours = af.Criteria(hinge=0.5, failures=18, friction=10.0)
    found = mechanism_scales(model, motion, criteria=ours, between=(1.0, 1.0), dt=0.005)
    (run,) = found.runs
    assert run.ending is af.dynamics.Ending.FAILED
    assert run.outcome.startswith("failed at")
    assert found["any joints at once"].upper == 1.0


def test_ctrl_c_keeps_the_bracket_so_far():
    found = searched(
        {name: beyond(2.5) for name in DEFINITIONS},
        ended=lambda scale: Ending.INTERRUPTED if scale > 1.9 else Ending.FINISHED,
    )
    # the broken-off run at 2 counts for nothing
    assert [run.scale for run in found.runs] == pytest.approx([1.0, 2.0**0.5])
    assert found.interrupted
    (doubt,) = found.doubts
    assert str(doubt) == "the search was interrupted after 2 runs; the same command continues it"
    assert str(found).startswith("no mechanism at 1.41 × the motion, search unfinished, nor at")
    assert found["verified"].lower == pytest.approx(2.0**0.5)
    assert found["verified"].run is None
    stopped = pretended(dict.fromkeys(DEFINITIONS, beyond(2.5)), lambda _: Ending.INTERRUPTED)
    assert search_scales(stopped, DEFINITIONS, 0.05, (0.05, 5.0), (2.0, 1.0)).runs == ()


def test_ctrl_c_between_runs_keeps_the_bracket_so_far():
    made = pretended({name: beyond(2.5) for name in DEFINITIONS})

    def shaken(scale):
        if scale > 1.9:
            raise KeyboardInterrupt
        return made(scale)

    found = search_scales(shaken, DEFINITIONS, 0.05, (0.05, 5.0))
    assert found.interrupted
    assert [run.scale for run in found.runs] == pytest.approx([1.0, 2.0**0.5])


def test_scales_of_given_runs():
    hit = af.limit.Mechanism("local", "arch", (1, 2, 3, 4), 1.5)
    met = {scale: hit if scale in (2.0, 4.0) else None for scale in (1.0, 2.0, 3.0, 4.0)}
    runs = [
        ScaledRun(scale, {"verified": found}, Ending.FINISHED, "") for scale, found in met.items()
    ]
    found = MechanismScales(("verified",), tuple(runs))["verified"]
    assert (found.lower, found.upper, found.above) == (1.0, 2.0, (3.0,))
    assert found.run.mechanisms["verified"] is hit


def test_refusals(on_piers, motion):
    with pytest.raises(af.InvalidInput, match="precision 0 between"):
        mechanism_scales(on_piers, motion, precision=0.0)
    with pytest.raises(af.InvalidInput, match="the smaller first"):
        mechanism_scales(on_piers, motion, between=(2.0, 1.0))


def test_a_search_makes_forty_runs_at_most():
    found = searched({name: beyond(0.7) for name in DEFINITIONS}, precision=1e-12)
    assert len(found.runs) == 40
    assert found["verified"].lower < 0.7 <= found["verified"].upper


def shaken_down(*windows, made=None):
    """A function from a scale to a run that falls within any of some windows."""

    def run(scale):
        made.append(scale)
        kind = "fallen" if any(low < scale < high for low, high in windows) else "stands"
        state = af.dynamics.CollapseState(kind, None, (), 0.1, 0.1, True)
        return ScaledRun(scale, {}, Ending.FINISHED, "", state)

    return run


@pytest.mark.parametrize("place", np.geomspace(2.0, 3.5, 9))
def test_a_window_of_falls_a_tenth_wide_below_the_first_fall_is_found(place):
    """The ladder steps over it, from half of its fall on; falls found so end the next search."""
    made, window = [], (place, 1.1 * place)
    found = search_scales(shaken_down(window, (3.9, inf), made=made), ("collapse",), 0.05, (0.1, 9))
    bracket = found["collapse"]
    assert place < bracket.upper < 1.1 * place
    assert bracket.lower < place
    assert bracket.ratio <= 1.05 * ROUND_OFF
    below = [each for each in sorted(made) if 0.5 * bracket.upper < each <= bracket.upper]
    assert max(high / low for low, high in pairwise(below)) <= 1.1
    near = [each for each in below if each > 0.7 * bracket.upper]
    assert max(high / low for low, high in pairwise(near)) <= 1.05
    assert len(made) <= 32


def test_gaps_below_the_largest_scale_are_filled_where_nothing_falls_there():
    """As below a fall; with a coarse precision, and for mechanisms, only brackets count."""
    made = []
    search_scales(shaken_down((2.3, 2.55), made=made), ("collapse",), 0.05, (0.1, 4.0))
    assert any(2.3 < scale < 2.55 for scale in made)
    made.clear()
    search_scales(shaken_down(made=made), ("collapse",), 0.5, (0.1, 4.0))
    assert made == pytest.approx([2.0**k for k in np.arange(0.0, 2.1, 0.5)])
    found = searched({name: beyond(2.5) for name in DEFINITIONS}, precision=0.5)
    assert len(found.runs) == 4


@pytest.mark.parametrize("moves", [0.3, 0.83, 1.3])
def test_the_smallest_dislocation_is_bracketed_below_a_distant_fall(moves):
    """Whether the search begins below it or above."""
    runs = shaken_down((3.9, inf), made=[])

    def shaken(scale):
        run = runs(scale)
        moved = replace(run, fall=replace(run.fall, kind="dislocated"))
        return moved if moves <= scale < 3.9 else run

    found = search_scales(shaken, ("collapse",), 0.05, (0.1, 9))
    stood = max(run.scale for run in found.runs if run.fall.kind == "stands")
    dislocated = min(run.scale for run in found.runs if run.fall.kind == "dislocated")
    assert stood < moves <= dislocated <= 1.1 * stood
    assert len(found.runs) <= 32


def searched_by_steps(monkeypatch, windows, made, follows=inf, *, is_given=True):
    """Search the fall of a block that falls within given windows of scales by each time step.

    Longer steps than a given one do not follow sliding.
    """

    def shake(model, motion, *, dt, **_):
        run = shaken_down(
            *(windows[dt] if isinstance(windows, dict) else windows), made=made.setdefault(dt, [])
        )(motion.pga)
        attrs = {"admissible_step": 0.6 * dt} if dt > follows else {}
        dataset = SimpleNamespace(attrs=attrs)
        return SimpleNamespace(
            ending=run.ending, outcome="", fall=run.fall, doubts=(), dataset=dataset, mechanisms={}
        )

    monkeypatch.setattr("archfem.dynamics.motion_scaling.time_history", shake)
    block = af.column(breadth=1.0, heights=[1.0])
    model = af.build(block, fidelity="rigid", displacements="large")
    given = (*windows,) if isinstance(windows, dict) and is_given else None
    return af.collapse_scale(model, af.Motion(np.array([0.0, 1.0, 0.0]), dt=0.01), dt=given)


@pytest.mark.parametrize("agree", [True, False])
@pytest.mark.parametrize(("window", "finds"), [((0.9, 0.93), 0.01), ((0.925, 0.945), 0.005)])
def test_steps_disagree_at_equal_scales_only(monkeypatch, window, finds, agree):
    """One step finds a window of falls over which the other one jumps."""
    made, beyond = {}, (0.97, inf)
    falls = {dt: (window, beyond) if agree or dt == finds else (beyond,) for dt in (0.01, 0.005)}
    found = searched_by_steps(monkeypatch, falls, made)
    bracket = found.bracket(finds)
    assert window[0] < bracket.upper < window[1]
    assert all({bracket.lower, bracket.upper} <= set(scales) for scales in made.values())
    assert any("its time steps find" in doubt.cause for doubt in found.doubts) != agree
    assert all(len(set(scales)) == len(scales) for scales in made.values())


@pytest.mark.parametrize(
    ("follows", "steps"),
    [(inf, (5.0, 2.5)), (0.004, (3.0, 1.5)), (0.002, (1.8, 0.9)), (0.0, (0.5, 0.25))],
)
def test_a_search_without_a_step_shortens_its_own_until_sliding_follows(
    monkeypatch, follows, steps
):
    """By 0.6 of the longest at a time, down to 0.5 ms; a step that is given is kept.

    Half of a step that is too long is not run.
    """
    found = searched_by_steps(monkeypatch, ((2.9, inf),), {}, follows)
    assert [1e3 * dt for dt in found.searches] == pytest.approx(steps)
    assert found.lower < 2.9 < found.upper
    kept = searched_by_steps(monkeypatch, {0.005: ((2.9, inf),)}, {}, follows)
    assert [*kept.searches] == [0.005]


def test_the_fall_of_steps_too_long_for_sliding_is_stated_and_bounds_nothing(monkeypatch):
    """5 ms fall from 3.5 on, the others from 2.9 on: the range is of all."""
    windows = {0.005: ((3.5, inf),), **dict.fromkeys((0.003, 0.0015), ((2.9, inf),))}
    given = searched_by_steps(monkeypatch, windows, {}, 0.004, is_given=False)
    assert [1e3 * dt for dt in (*given.longer, *given.searches)] == pytest.approx([5, 3, 1.5])
    assert given.lower < 2.9 < given.upper < 3.5
    (doubt,) = given.doubts
    low, high = min(given.bracket(dt).upper for dt in given.searches), given.longer[0.005]
    high = high["collapse"].upper
    assert f"the first fall at {low:#.3g} to {high:#.3g} × the motion" in doubt.cause
    assert "time step (5, 3, 1.5 ms), and no property or motion: how far" in str(given)
    steps = [row[0] for row in given.rows()[1]]
    assert {*steps} == {"5 ms", "3 ms", "1.5 ms"}
    assert all(row[2] == "as given" for row in given.rows()[1])


def test_the_smallest_fall_of_any_step_is_the_one_that_is_stated(monkeypatch):
    """5 ms, too long for sliding, fall from 2.2 on, 3 ms from 2.9 on and 1.5 ms from 2.5 on."""
    falls = {0.005: 2.2, 0.003: 2.9, 0.0015: 2.5}
    windows = {dt: ((scale, inf),) for dt, scale in falls.items()}
    found = searched_by_steps(monkeypatch, windows, {}, 0.004, is_given=False)
    long = found.longer[0.005]
    moved = replace(long.runs[2], fall=replace(long.runs[2].fall, kind="dislocated"))
    fell = replace(long["collapse"].run, doubts=(Doubt("slip is wrong"),))
    found = replace(found, longer={0.005: long.with_run(moved).with_run(fell)})
    cells = [(float(row[1]), row[3]) for row in found.rows()[1]]
    least = {
        kind: min(x for x, state in cells if state == kind) for kind in ("fallen", "dislocated")
    }
    last = max(
        min(run.scale for run in each.runs if run.fails("collapse"))
        for each in (*found.longer.values(), *found.searches.values())
    )
    assert 2.2 < least["fallen"] < 2.35 < 2.9 < last < 3.05
    first = f"{found.states['falls']:#.3g}"
    assert float(first) == least["fallen"]
    assert found.first_falls == (found.states["falls"], last)
    assert found.states["dislocated"] == moved.scale == pytest.approx(least["dislocated"], rel=5e-3)
    steps = [f"by steps of {1e3 * dt:g} ms first at {last:#.3g} ×" for dt in found.searches]
    assert any(f" ({first} × the motion), {step}" in str(found) for step in steps)
    shorter = min(each["collapse"].upper for each in found.searches.values())
    assert f", by those that follow sliding at {shorter:#.3g} ×;" in str(found)
    assert [*map(str, found.doubts)] == [
        f"its time steps find the first fall at {first} to {last:#.3g} × the motion",
        f"at {first} × by 5 ms: slip is wrong",
    ]
    (read,) = answers.read_numbers(
        answers.Scales,
        answers.Statement.read(
            answers.state_scale(found, af.Motion(np.ones(9), 0.01), [])["scale.json"]
        ),
    )
    assert (read.states, read.all_steps) == (found.states, last)
    assert found.held < moved.scale < found.lower < found.states["falls"]


def test_windows_of_steps_too_long_for_sliding_are_said_below_the_fall_of_shorter_ones(monkeypatch):
    """5 ms stand from 2.45 to 3.1, beyond the falls of 3 and 1.5 ms from 2.9 on."""
    windows = {0.005: ((2.2, 2.45), (3.1, inf)), 0.003: ((2.9, inf),), 0.0015: ((2.9, inf),)}
    found = searched_by_steps(monkeypatch, windows, {}, 0.004, is_given=False)
    first, shorter = found.first_falls[0], min(found.bracket(dt).upper for dt in found.searches)
    assert 2.2 < first < 2.45 < 2.9 < shorter
    assert f", by those that follow sliding at {shorter:#.3g} ×, and does not fall at" in str(found)
    long = [run.scale for run in found.longer[0.005].runs if 2.45 < run.scale < 3.1]
    assert found.above == tuple(scale for scale in long if scale < found.upper) != ()
    (doubt,) = [str(x) for x in found.doubts if "not monotonic" in x.cause]
    least = f"{found.above[0]:#.3g}"
    assert doubt.startswith(f"by 5 ms: it is not monotonic: above a fall it survives {least} ")


def test_the_second_step_begins_near_the_fall_of_the_first(monkeypatch):
    """Its scales lie between those of the first."""
    made = {}
    found = searched_by_steps(monkeypatch, dict.fromkeys((0.01, 0.005), ((2.9, inf),)), made)
    assert found.lower < 2.9 < found.upper
    assert made[0.005][0] == pytest.approx(found.bracket(0.01).upper / 1.05**0.5)
    assert len(made[0.005]) < len(made[0.01])
    assert max(min(scales) for scales in made.values()) <= 0.5 * found.upper
    away = [min(abs(one / other - 1.0) for other in made[0.01]) for one in made[0.005]]
    assert min(away) > 0.015
    assert "; stands at every smaller scale that was run: from " in str(found)
    assert " apart, and none between was run; varied were the scale and the " in str(found)


@pytest.mark.parametrize("threshold", [2.0, pytest.param(2.2, marks=pytest.mark.slow)])
def test_the_smallest_fall_alone_is_followed_to_its_end(monkeypatch, threshold):
    """From 1.2 on blocks are loose; from 2 on one is lost, to a threshold not with shorter steps.

    A search that is interrupted at any run, and continued, finds the same fall.
    """
    made, last = [], [None]

    def run(model, motion, *, dt, record=None, **_):
        scale, whole = motion.pga / 2.0, record is None
        if len(made) == last[0]:
            raise KeyboardInterrupt
        made.append((dt, scale, whole))
        loose, falls = scale > 1.2, scale > (threshold if whole else 2.0)
        state = CollapseState("fallen" if falls else "stands", None, (), 0.1, 0.1, True)
        dataset = SimpleNamespace(attrs={"fall_step": 5e-4} if loose else {})
        given = {"ending": Ending.FINISHED, "outcome": "", "doubts": (), "mechanisms": {}}
        return SimpleNamespace(fall=state, dataset=dataset, **given)

    monkeypatch.setattr(motion_scaling, "_run_as_far", run)
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid", displacements="large")
    search = partial(af.collapse_scale, model, af.Motion(np.array([0.0, 2.0, 0.0]), dt=0.01))
    found, runs = search(dt=0.01), made.copy()
    for each in found.searches.values():
        fall = each["collapse"]
        assert fall.lower < threshold < fall.upper <= 1.05 * ROUND_OFF * fall.lower
        assert all(x.whole == (not x.fails("collapse") or x is fall.run) for x in each.runs)
    # of the others it is unknown whether they fall partly, and where blocks come to rest
    ends = {(row[3], row[5]) for row in found.rows()[1] if float(row[1]) > threshold}
    assert ends == {("fallen", "0.1 m"), ("loses a block", "-")}
    # whole are what stands though blocks are loose, the smallest fall, and falls that were none
    for dt, scale in {(dt, scale) for dt, scale, _ in runs}:
        modes = [whole for *key, whole in runs if key == [dt, scale]]
        repeated = 1.2 < scale < threshold or scale == found.bracket(dt).upper
        assert modes in ([[False, True], [True]] if repeated else [[False], [True]])
    assert sum(whole for *_, whole in runs) > len(runs) / 2 > len(runs) - len({x[:2] for x in runs})
    for count in range(len(runs)):
        made.clear()
        last[0] = count
        begun = search(dt=0.01)
        assert begun.interrupted
        last[0] = None
        again = search(dt=0.01, made=begun.kept_runs)
        assert threshold < again.first_falls[0] <= 1.05 * ROUND_OFF * again.lower
        assert len(begun.kept_runs) <= count
        # known from the start, falls that were none lead to other scales
        assert threshold > 2.0 or (again == found and len(made) <= len(runs) + 1)


def fallen(*scales):
    """Runs at some scales, those of a negative one fallen."""
    made = (
        af.dynamics.CollapseState("fallen" if s < 0 else "stands", None, (), 0.1, 0.1, True)
        for s in scales
    )
    runs = (ScaledRun(abs(s), {}, Ending.PARTED, "", f) for s, f in zip(scales, made, strict=True))
    return MechanismScales(("collapse",), tuple(runs))


@pytest.mark.parametrize(
    ("scales", "stated"),
    [
        (
            (1.0, -2.0, -3.0, -4.0),
            "may not occur; where it falls at 3.00 × the motion, they fall too",
        ),
        ((1.0, -2.0), "and with stiffer ones it may not occur"),
    ],
)
def test_the_scale_from_which_rigid_blocks_fall_is_stated(scales, stated):
    """The falls at 2 alone are doubted by a comparison with rigid blocks, that at 2.5 has none."""
    made = fallen(*scales).with_run(replace(fallen(-2.5).runs[0], whole=False))
    stand = af.models.model.Doubt(RIGID_STAND, "remedy", (0.2,))
    runs = (replace(run, doubts=(stand,)) if run.scale == 2.0 else run for run in made.runs)
    found = CollapseScale({0.01: replace(made, runs=tuple(runs))})
    (cause,) = (doubt.cause for doubt in found.doubts)
    assert "under this motion of 0.2 g: " in cause
    assert cause.endswith(stated)


def test_scales_are_as_close_from_half_of_the_smallest_fall_on_as_the_pages_say():
    """Of a fall at 4.76 scales from 2.38 on are 1.1 apart; one at 2 is below its half."""
    near = [2.0, 2.32, *(2.32 * 1.09**k for k in range(1, 9)), -4.76]
    found = CollapseScale({0.001: fallen(1.0, *near)})
    assert found.lower == pytest.approx(2.32 * 1.09**8)  # 4.62, half of which is below 2.32
    assert "from 2.32 × on they are up to a factor of 1.09 apart" in str(found)


@pytest.mark.parametrize("words", [LEAVE_OUT, f"take 1 ms or less{OR_LEAVE_OUT}"])
def test_a_search_that_chose_its_steps_does_not_advise_to_leave_them_out(words):
    run = replace(fallen(1.0).runs[0], doubts=(Doubt("steps are long", words),))
    (doubt,) = motion_scaling._choose_shorter(run, True).doubts
    assert motion_scaling._choose_shorter(run, False) is run
    assert "dt out" not in doubt.remedy
    assert doubt.remedy in ("give shorter ones by analysis.dt", "take 1 ms or less")


def test_collapse_is_between_a_stable_and_a_falling_run_at_every_step():
    found = CollapseScale({0.01: fallen(1.0, -2.0, 3.0, -4.0), 0.005: fallen(0.5, 1.5, -2.5, 2.7)})
    assert (found.lower, found.upper) == (1.0, 2.5)
    assert found.above == (2.7, 3.0)
    assert found.bracket(0.005).upper == 2.5
    assert str(found) == (
        "stands at 1.00 × the motion, falls at 2.00 × the motion, by steps of 5 ms first at "
        "2.50 ×, and does not fall at some scales from 2.70 to 3.00 ×; stands at every "
        "smaller scale that was run: from 0.500 × on they are up to a factor of 2.00 apart, and "
        "none between was run; varied were the scale and the time step (10, 5 ms), and no property "
        "or motion: how far others, such as other seeds, differ is unknown"
    )
    assert [str(doubt) for doubt in found.doubts] == [
        "by 10 ms: it is not monotonic: above a fall it survives 3.00 × the motion",
        "by 5 ms: it is not monotonic: above a fall it survives 2.70 × the motion",
    ]
    moved = [replace(run, mechanisms={"verified": True}) for run in fallen(0.5, 1.5).runs]
    all_moved = CollapseScale({0.01: MechanismScales(("collapse",), (*moved, *fallen(-2.0).runs))})
    assert (found.moves_in_all, all_moved.moves_in_all) == (False, True)
    # a statement has what the reports need of these
    for each, as_one, expected in (
        (found, FirstFall(1.8, None), (2.5, 1.8, False, [2.7, 3.0], {"falls": 2.0})),
        (all_moved, None, (2.0, None, True, [], {"moves": 0.5, "falls": 2.0})),
    ):
        searched = replace(each, as_one=as_one)
        files = answers.state_scale(searched, af.Motion(np.ones(9), 0.01), [])
        stated = answers.Statement.read(files["scale.json"])
        (read,) = answers.read_numbers(answers.Scales, stated)
        assert (read.all_steps, read.as_one, read.moves_in_all, read.again, read.states) == expected
    # the worse of courses and of one body is stated first, and is the factor
    for one, begins, factor in (
        (
            0.95,
            "as one rigid body without crushing it first falls at 0.950 × the motion; in courses it"
            " stands at 1.00",
            "< 0.950",
        ),
        (
            1.8,
            "as one rigid body without crushing it first falls at 1.80 × the motion; in courses it "
            "stands at 1.00",
            "1.00",
        ),
        (2.2, "stands at 1.00 × the motion, falls at 2.00 ×", "1.00"),
        (inf, "stands at 1.00 × the motion, falls at 2.00 ×", "1.00"),
    ):
        searched = replace(found, as_one=FirstFall(one, None))
        assert searched.sentence.startswith(begins)
        (row,) = answers.Statement.read(
            answers.state_scale(searched, af.Motion(np.ones(9), 0.01), [])["scale.json"]
        ).rows
        assert row.factor == factor
    never = CollapseScale({0.01: fallen(1.0, -2.0), 0.005: fallen(1.0, 2.0)})
    assert (never.lower, never.upper, never.above) == (1.0, inf, ())
    assert str(never) == (
        "stands at 1.00 × the motion, falls at 2.00 × the motion, by steps of 5 ms at no scale; "
        "varied were the scale and the time step (10, 5 ms), and no property or motion: how far "
        "others, such as other seeds, differ is unknown"
    )
    (doubt,) = never.doubts
    assert str(doubt) == "a time step finds a fall at 2.00 ×, and another none"
    three = CollapseScale({dt: fallen(1.0, -upper) for dt, upper in enumerate((2.0, 2.2, 2.1))})
    assert "2.00 × the motion, by steps of 1000 ms first at 2.20 ×" in str(three)


def test_smaller_scales_at_which_it_is_dislocated_are_said():
    found = fallen(1.0, 1.1, 1.2, 1.3, -1.4)
    runs = [
        replace(run, fall=replace(run.fall, kind="dislocated")) if 1.1 <= run.scale < 1.3 else run
        for run in found.runs
    ]
    said = str(CollapseScale({0.005: replace(found, runs=tuple(runs))}))
    assert said.startswith("stands at 1.00 × the motion, dislocated at 1.10 ×, falls at 1.40")
    assert "; stands or is dislocated at every smaller scale that was" in said
    for first, words in ((1, "dislocated"), (0, "a mechanism at 1.00 × or less, dislocated")):
        moved = [replace(run, mechanisms={"verified": k >= first}) for k, run in enumerate(runs)]
        said = str(CollapseScale({0.005: replace(found, runs=tuple(moved))}))
        assert said.startswith(f"stands at 1.00 × the motion, {words} at 1.10 ×, falls at 1.40 ×")
    rests = [replace(run, mechanisms={"verified": k > 1}) for k, run in enumerate(found.runs)]
    said = str(CollapseScale({0.005: replace(found, runs=tuple(rests))}))
    assert said.startswith("stands at 1.30 × the motion, a mechanism at 1.20 ×, falls at 1.40 ×")
    rocks = Doubt(ROCKS_SOFTLY, "", (0.44, 0.1))
    soft = [replace(run, doubts=(rocks,) * (k > 1)) for k, run in enumerate(found.runs)]
    assert str(CollapseScale({0.005: replace(found, runs=tuple(soft))})).startswith(said[:56])
    parted = [  # by 1.1 × the first names, at larger scales others
        replace(run, fall=replace(run.fall, blocks=tuple("abcdefg"[k:] if k else "")))
        for k, run in enumerate(runs[:3])
    ]
    named = CollapseScale({0.005: replace(found, runs=(*parted, *runs[3:]))})
    assert ", dislocated at 1.10 × (b, c, d and 3 more), falls at 1.40 ×" in str(named)
    cells = [row[3] for row in named.rows()[1]]
    assert cells[:3] == [
        "stands",
        "dislocated (b, c, d and 3 more)",
        "dislocated (c, d, e and 2 more)",
    ]
    bound = CollapseScale({0.005: replace(found, runs=(*runs[:1], runs[1], found.runs[-1]))})
    assert "; stands at every smaller scale that was run" in str(bound)


def test_scales_without_an_answer_bound_what_is_known():
    """It stands to 2, is dislocated at 3 and 4, and beyond 5 one step or none has an answer."""
    found, kinds = fallen(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0), ["stands"] * 2 + ["dislocated"] * 4
    runs = [
        replace(run, fall=replace(run.fall, kind=kind))
        for run, kind in zip(found.runs, kinds, strict=False)
    ]
    runs.append(replace(found.runs[-1], fall=None, outcome="came loose"))
    part = [replace(run, fall=None) if run.scale == 5.0 else run for run in runs]
    both = {dt: replace(found, runs=tuple(own)) for dt, own in ((0.01, runs), (0.005, part))}
    said = CollapseScale(both, pga=0.5 * 9.80665)
    assert (said.lower, said.upper, said.unanswered) == (6.0, inf, (5.0, 7.0))
    words = "by 10 ms: runs without an answer were at 7.00 × the motion: the first came loose"
    assert words in map(str, said.doubts)
    assert str(said).startswith(
        "stands at 1.00 g (2.00 × the motion), dislocated at 3.00 ×, falls in no run that has an "
        "answer (3 have none, the first at 5.00 ×); stands or is dislocated or has no answer at "
    )


def test_a_margin_rests_on_finished_steps():
    """Where Ctrl-C ended a search says nothing of the structure; a fall that was met does."""
    whole, begun = fallen(0.7, 1.0, 1.2, 1.25, -1.3), replace(fallen(0.7, -1.5), interrupted=True)
    found = CollapseScale({0.005: whole, 0.0025: begun})
    assert (found.lower, found.held, found.upper) == (1.25, 1.25, 1.3)
    assert str(found).startswith(
        "stands at 1.25 × the motion, search unfinished, falls at 1.30 × the motion; stands at "
    )
    # the margin of a report is that of both steps
    motion = af.Motion(np.ones(9), 0.01, name="a")
    between = replace(begun, runs=fallen(0.7, 1.27, -1.5).runs)  # it stands by both at 1.25
    every = (found, 0.7), (CollapseScale({0.005: whole, 0.0025: between}), 1.25)
    for each, held in (*every, (CollapseScale({0.005: whole}), 1.25)):
        stated = answers.Statement.read(answers.state_scale(each, motion, [])["scale.json"])
        assert answers.read_numbers(answers.Scales, stated)[0].held == held
        unfinished = " so far" * each.interrupted + " by all time steps" * (held < each.held)
        assert stated.rows[0].factor == f"{held:#.3g}{unfinished}"
    (doubt,) = found.doubts
    words = "by 2.5 ms: the search was interrupted after 2 runs; the same command continues it"
    assert str(doubt) == words
    weaker = replace(begun, runs=fallen(0.7, -1.1).runs)
    assert CollapseScale({0.005: whole, 0.0025: weaker}).held == 1.0
    # shorter steps that follow sliding have no finished search: those with longer steps decide
    none = replace(begun, runs=())
    for searches in ({0.0025: begun}, {0.0025: none}):
        both = CollapseScale(searches, longer={0.005: whole})
        assert (both.held, both.upper) == (1.25, 1.3)
        assert str(both).startswith("stands at 1.25 × the motion, search unfinished, falls at 1.30")
    assert CollapseScale({0.005: begun}).held == 0.7
    assert "search unfinished, falls at no scale" in str(CollapseScale({0.005: none}))


@pytest.mark.parametrize("large", [pytest.param("large", marks=pytest.mark.slow), "small"])
def test_a_search_continues_from_its_runs(monkeypatch, large):
    """It makes the runs that are left, and finds what one without a break does."""
    model = af.build(af.column(breadth=0.25, heights=[1.0]), fidelity="rigid", displacements=large)
    tap = af.Motion(np.concatenate([np.sin(np.pi * np.linspace(0.0, 1.0, 41)), np.zeros(20)]), 0.01)
    search = af.collapse_scale if large == "large" else mechanism_scales
    options = {"precision": 0.5, "between": (1.0, 8.0), "dt": 0.01}
    made, compute = [], motion_scaling.time_history

    def shake(*given, **settings):
        made.append((settings["dt"], given[1].pga, "record" in settings))
        if len(made) == 3:
            raise KeyboardInterrupt
        return compute(*given, **settings)

    monkeypatch.setattr(motion_scaling, "time_history", shake)
    begun = search(model, tap, **options)
    assert begun.interrupted
    assert len(begun.kept_runs) == 2
    found = search(model, tap, made=begun.kept_runs, **options)
    assert not found.interrupted
    # none twice but the one that was interrupted, and falls that are repeated to their end
    assert len(made) == 1 + len(set(made))
    assert len({(dt, pga) for dt, pga, _ in made}) == len(found.kept_runs)
    assert found == search(model, tap, **options)
    if large == "large":  # after Ctrl-C no shorter step is tried, either
        del made[2:], options["dt"]
        assert [*search(model, tap, **options).searches] == [0.005]


@pytest.mark.parametrize(
    ("kind", "scales", "says"),
    [
        ("stands", (1.0, -2.0), "stands at 0.500 g (1.00 × the motion), falls at 1.00 g (2.00 × "),
        (
            "dislocated",
            (1.0, -2.0),
            "dislocated at 1.00 ×, falls at 1.00 g (2.00 × the motion); no smaller scale is ",
        ),
        ("stands", (1.0, 2.0), "stands at 1.00 g (2.00 × the motion), falls at no scale that was"),
        ("stands", (-1.0, -2.0), "falls at 0.500 g (1.00 × the motion); no smaller scale is kno"),
    ],
)
def test_a_fall_is_said_in_g(kind, scales, says):
    found = fallen(*scales)
    runs = [
        replace(r, fall=replace(r.fall, kind=r.fall.kind if r.fall.kind == "fallen" else kind))
        for r in found.runs
    ]
    runs[0] = replace(runs[0], doubts=(Doubt("energy drifts"),))
    found = CollapseScale({0.005: replace(found, runs=tuple(runs))}, pga=0.5 * 9.80665)
    assert str(found).startswith(says)
    bound = scales[0] in (found.lower, -found.upper)
    assert [*map(str, found.doubts)] == ["at 1.00 × by 5 ms: energy drifts"] * bound


def test_a_doubt_of_several_runs_is_said_once():
    """What differs by its numbers alone is one doubt; that of a run beside the bracket is none."""

    def doubted(search, *doubts):
        pairs = zip(search.runs, doubts, strict=True)
        return replace(search, runs=tuple(replace(run, doubts=each) for run, each in pairs))

    def slips(size):
        return (Doubt("it slips by {:mm}", "", (size,)),)

    found = CollapseScale(
        {
            0.01: doubted(fallen(1.0, 1.5, -2.0), (Doubt("far off"),), (), slips(0.0035)),
            0.005: doubted(fallen(1.2, -2.1), (Doubt("energy drifts"),), slips(0.012)),
        }
    )
    assert [*map(str, found.doubts)] == [
        "at 2.00 × by 10 ms (likewise at 2.10 × by 5 ms): it slips by 3.5 to 12 mm",
        "at 1.20 × by 5 ms: energy drifts",
    ]


def test_a_first_mechanism_is_said_in_g():
    found = searched({**dict.fromkeys(DEFINITIONS, beyond(2.5)), "verified": beyond(2.0)})
    found = replace(found, pga=9.80665)
    lower, upper = found["verified"].lower, found["verified"].upper
    assert str(found) == (
        f"no mechanism at {lower:#.3g} g ({lower:#.3g} × the motion), first mechanism at "
        f"{upper:#.3g} g ({upper:#.3g} × the motion), by verified; varied was the scale, and no "
        "property or motion: how far others, such as other seeds, differ is unknown"
    )
    assert found.doubts == ()
    none = searched(dict.fromkeys(DEFINITIONS, beyond(inf)))
    assert none.sentence.endswith("nor at any scale that was tried")
    assert "interrupted" in replace(none, interrupted=True).doubts[0].cause


def test_no_bracket_rests_on_a_run_without_an_answer():
    """Stands up to 1.2, falls from 1.9 on, and is broken off between 1.35 and 1.5."""

    def shaken(scale):
        if 1.35 < scale < 1.5:
            return ScaledRun(scale, {}, Ending.PARTED, "blocks came loose")
        kind = "fallen" if scale > 1.9 else "stands"
        state = af.dynamics.CollapseState(kind, None, (), 0.1, 0.1, True)
        return ScaledRun(scale, {}, Ending.FINISHED, "", state)

    found = search_scales(shaken, ("collapse",), 0.05, (0.1, 4.0))
    bracket = found["collapse"]
    assert bracket.lower < 1.9 < bracket.upper <= 1.05 * ROUND_OFF * bracket.lower
    assert pytest.approx(np.sqrt(2.0)) in bracket.unanswered
    assert all(1.35 < scale < 1.5 for scale in bracket.unanswered)
    scales = CollapseScale({0.005: found})
    assert scales.unanswered == bracket.unanswered
    assert "no answer" in scales.table()
    run = next(run for run in found.runs if run.fall is None)
    assert not run.survives("collapse")
    assert not run.fails("collapse")


def test_neither_a_twitch_moves_a_structure_nor_is_its_fall_without_a_mechanism(monkeypatch):
    """A loose stone twitches at every scale, more moves from 1.1 on, and all falls from 2 on."""
    larger = af.limit.Mechanism("local", "arch", (0, 6), 2.0)

    def run(model, motion, **_):
        scale = motion.pga / 2.0
        kind, by = ("fallen", "by hinges (joint 0) at 1.000 s") if scale > 2.0 else ("stands", "")
        first = replace(larger, part="pier", below=4e-4, larger=larger if scale > 1.1 else None)
        return SimpleNamespace(
            mechanisms={"verified": first},
            ending=Ending.FINISHED,
            outcome="",
            fall=CollapseState(kind, None, (), 0.1, 0.1, True, mechanism=by),
            doubts=(),
            dataset=SimpleNamespace(attrs={}),
        )

    monkeypatch.setattr(motion_scaling, "_run_as_far", run)
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid", displacements="large")
    found = af.collapse_scale(model, af.Motion(np.array([0.0, 2.0, 0.0]), dt=0.01), dt=0.01)
    scales = [run.scale for each in found.searches.values() for run in each.runs]
    assert found.moves == min(scale for scale in scales if scale > 1.1) > min(scales)
    falls = f"at {found.states['falls']:#.3g} × it falls by hinges (joint 0) at 1.000 s"
    assert (found.mechanism, replace(found, searches={}).mechanism) == (falls, "")


@pytest.mark.parametrize(
    ("between", "limits"),
    [((0.1, 10.0), (0.1, 2.4516625)), ((0.1, 2.0), (0.1, 2.0)), ((3.0, 4.0), (3.0, 3.0))],
)
def test_collapse_is_not_sought_beyond_five_g(between, limits, monkeypatch):
    """Five g, of a motion of 20 m/s²; one scale where the least of the given ones is beyond."""
    ranges = []
    monkeypatch.setattr(
        "archfem.dynamics.motion_scaling.search_scales",
        lambda _, what, precision, found, *begin, **_name: (
            ranges.append(found) or MechanismScales(what)
        ),
    )
    block = af.column(breadth=1.0, heights=[1.0])
    model = af.build(block, fidelity="rigid", displacements="large")
    strong = af.Motion(np.array([0.0, 20.0, 0.0]), dt=0.01)
    af.collapse_scale(model, strong, between=between)
    assert ranges == [pytest.approx(limits)] * 2


def test_motions_are_scaled_to_five_g_at_most_by_their_strongest_component():
    """However weak they are; one that is none is refused."""
    weak, strong = np.array([0.0, 0.01, -0.02]), np.array([0.0, 0.03, -0.05])
    five_g, between = 5.0 * 9.80665, (0.1, inf)
    allowed = pytest.approx((0.1, five_g / 0.02))
    assert admissible_range(between, af.Motion(weak, 0.01)) == allowed
    for others in ({"vertical": strong}, {"transverse": strong}):
        allowed = pytest.approx((0.1, five_g / 0.05))
        assert admissible_range(between, af.Motion(weak, 0.01, **others)) == allowed
    with pytest.raises(af.InvalidInput, match="motion 'still' is at rest: no factor on it moves"):
        admissible_range(between, af.Motion(0.0 * weak, 0.01, name="still"))


def test_a_search_whose_first_runs_are_in_doubt_says_so_at_once(tmp_path, monkeypatch):
    """After the second one, once; not where a smaller scale is free of doubt."""
    for least, count in ((0.1, 1), (0.9, 0)):
        shake = pretended(dict.fromkeys(DEFINITIONS, beyond(2.5)))

        def doubted(scale, shake=shake, least=least):
            doubts = (Doubt(FILL_TENSION, "cut it", (5.0 * scale, 0.3)),) * (scale >= least)
            return replace(shake(scale), doubts=doubts)

        with open(tmp_path / "errors", "w") as errors:
            monkeypatch.setattr("sys.stderr", errors)
            search_scales(doubted, DEFINITIONS, 0.5, (0.5, 5.0))
        lines = (tmp_path / "errors").read_text().splitlines()
        found = [k for k, line in enumerate(lines) if "so that the answer will be in doubt" in line]
        assert len(found) == count
        assert all('law = "jointed"' in lines[k] for k in found)


def test_no_margin_is_claimed_where_the_fill_bears_more_tension_than_soil():
    """It stands up to 4, and its fill is in doubt from 2 on: it is known to stand at 1 alone."""

    def pulled(search, least):
        def doubts(scale):
            return (Doubt(FILL_TENSION, "cut it", (5.0 * scale, 0.3)),) if scale >= least else ()

        return replace(search, runs=tuple(replace(r, doubts=doubts(r.scale)) for r in search.runs))

    runs = {0.01: fallen(1.0, 2.0, 4.0, -8.0), 0.005: fallen(1.0, 2.0, 5.0, -9.0)}
    found = CollapseScale({dt: pulled(search, 2.0) for dt, search in runs.items()})
    assert (found.lower, found.held, found.states["tension"]) == (4.0, 1.0, 2.0)
    words = "in doubt, as the elastic fill bears tension of over 5.8 kPa"
    assert str(found).startswith(
        f"stands at 1.00 × the motion, at 2.00 × {words}: falls at 8.00 × the motion"
    )
    # one doubt of the runs that bound the fall, with the range of its numbers
    (doubt,) = found.doubts
    assert doubt.cause.startswith("elastic fill bears 20 to 45 kPa of tension, at t = 0.3 s: soil")
    assert doubt.place == (
        "at 4.00 × by 10 ms (likewise at 8.00 × by 10 ms, 5.00 × by 5 ms, 9.00 × by 5 ms)"
    )
    # all of them in tension: nothing is known; tension beyond the fall says nothing
    every = CollapseScale({dt: pulled(search, 0.5) for dt, search in runs.items()})
    assert every.held == 0.0
    begin = f"stands in doubt up to 4.00 ×, at 1.00 × {words}: falls at 8.00 × the motion"
    assert str(every).startswith(begin)
    beyond_it = CollapseScale({dt: pulled(search, 8.0) for dt, search in runs.items()})
    assert (beyond_it.held, "tension" in beyond_it.states) == (4.0, False)
    small = searched(dict.fromkeys(DEFINITIONS, beyond(2.5)))
    held = pulled(small, 1.5)
    assert 1.0 <= held.held < 1.5 <= small.held
    assert f"at {held.states['tension']:#.3g} × {words}: first mechanism at" in str(held)


def test_scales_are_smaller_until_the_fill_bears_no_tension():
    """A search begins at 1, where the fill is in tension, and nothing falls below 4."""

    def shaken(scale):
        doubts = (Doubt(FILL_TENSION, "", (9.0 * scale, 0.3)),) if scale > 0.6 else ()
        state = CollapseState("fallen" if scale > 4.0 else "stands", None, (), 0.1, 0.1, True)
        return ScaledRun(scale, {}, Ending.FINISHED, "", state, doubts)

    found = search_scales(shaken, (COLLAPSE_DEFINITION,), 0.05, (0.1, 10.0))
    assert CollapseScale({0.005: found}).held == pytest.approx(0.5)


def test_a_doubt_of_the_model_is_not_repeated_as_one_of_its_runs():
    of_model, of_run = Doubt("fill in one piece", "cut it"), Doubt("energy drifts")
    search = fallen(1.0, -2.0)
    runs = tuple(replace(run, doubts=(of_model, of_run)) for run in search.runs)
    found = CollapseScale({0.005: replace(search, runs=runs)}, of_model=(of_model,))
    assert [doubt.cause for doubt in found.doubts] == ["fill in one piece", "energy drifts"]


@pytest.mark.parametrize(
    ("scale", "share", "doubted"), [(0.5, 0.06, True), (0.5, 0.04, False), (3.0, 0.06, False)]
)
def test_a_run_without_joints_below_a_fall_is_in_doubt(scale, share, doubted):
    """Brackets are from 1 to 2: with joints it may have fallen before, and above that is known."""
    search, doubt = fallen(0.5, 1.0, -2.0, 3.0), Doubt("blocks were loose")
    runs = tuple(
        replace(run, fall=replace(run.fall, loose_share=share), doubts=(doubt,))
        if run.scale == scale
        else run
        for run in search.runs
    )
    said = [str(x) for x in CollapseScale({0.005: replace(search, runs=runs)}).doubts]
    words = f"at {scale:#.3g} × by 5 ms: blocks were loose"
    assert [x for x in said if "loose" in x] == [words] * doubted


def test_doubts_of_many_runs_are_logged_once_by_kind(caplog):
    def shaken(scale):
        log.warning("%s", Doubt("it slips by {:mm}", "", (1e-3 * scale,)))
        log.warning("another at %.3g", scale)
        state = CollapseState("fallen" if scale > 4.0 else "stands", None, (), 0.1, 0.1, True)
        return ScaledRun(scale, {}, Ending.FINISHED, "", state)

    found = search_scales(shaken, (COLLAPSE_DEFINITION,), 0.05, (0.1, 10.0))
    said = [record.getMessage() for record in caplog.records]
    assert said[0] == "it slips by 1 mm"
    assert sum("slips" in text for text in said) == 1
    assert len(said) == 1 + len(found.runs)
