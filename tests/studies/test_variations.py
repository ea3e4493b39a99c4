"""Runs over uncertain properties: the varied properties, and the case of each run."""

import re
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from pages import read_page

import archfem as af
from archfem.cases.defaults import list_finish_ranges
from archfem.cases.verdict_keys import DEFAULT_RANGES, NEUTRAL, default_ranges
from archfem.dynamics import CollapseState, analysis
from archfem.dynamics.damping import vary_damping
from archfem.studies import collapse_risk, evaluators, variations
from archfem.studies.variations import Variation, evaluate_variation
from archfem.units import format_mm

HELD = {name: values[0] for name, values in DEFAULT_RANGES.items()} | {
    **{"k_n": 1.0, "k_s": 1.0, "friction": 0.0, "damping_ratio": 1.0},
}
"""Values that hold all properties as given."""

STANDS = CollapseState("stands", None, (), 0.02, 0.01, True)


@pytest.fixture(scope="module")
def column():
    return af.column(breadth=0.4, heights=[0.8, 0.8], width=1.0)


@pytest.fixture(scope="module")
def motion():
    return af.Motion.synthetic(duration=1.0, pga=4.0, seed=1)


@pytest.fixture
def calls(monkeypatch):
    """Structure, motion, step and analysis of the runs, which are not computed."""
    calls = []

    def elastic(analysis, motion, **options):
        calls.append((analysis.structure, motion, analysis.dt, analysis))
        return SimpleNamespace(fall=STANDS, ending=af.dynamics.Ending.FINISHED)

    def rigid(structure, motion, *, dt):
        calls.append((structure, motion, dt, None))
        return STANDS

    monkeypatch.setattr(evaluators, "time_history", elastic)
    monkeypatch.setattr(variations, "_run_rigid_blocks", rigid)
    return calls


def evaluate(column, motion, damping="effective", **changes):
    settings = {"fidelity": "rigid", "displacements": "large", "damping": damping, "dt": 0.005}
    analysis = af.Analysis(column, **settings)
    return evaluate_variation(Variation(analysis, motion, tuple(changes.items())))


@pytest.mark.parametrize("follows", [0.0025, 0.001])
def test_steps_that_do_not_follow_sliding_are_a_doubt(column, motion, calls, monkeypatch, follows):
    """Runs slide farther than steps follow that are longer than `follows`.

    A run as given would follow with 3 ms; the advice is the half of the step, if all follow by it.
    """

    def slide(analysis, motion, **options):
        step = np.inf if analysis.dt <= follows else 0.003 if analysis.dt == 0.005 else 0.002
        return SimpleNamespace(
            fall=replace(STANDS, admissible_step=step), ending=af.dynamics.Ending.FINISHED
        )

    options = {"vary": {**HELD, "dt": ("as given", "half")}, "samples": 1, "dt": 0.005}
    assert not af.verdict_range(column, motion, **options).doubts
    monkeypatch.setattr(evaluators, "time_history", slide)
    (doubt,) = af.verdict_range(column, motion, **options).doubts
    assert "of 3 runs the steps, 5 ms or half of it, are long for sliding" in doubt.cause
    half = sum(step == 0.0025 for *_, step, analysis in calls if analysis)
    held = f"take 2.5 ms, `--set analysis.dt=0.0025`, with which none of {half} runs is in doubt"
    more = "take 2 ms, `--set analysis.dt=0.002`, or less, and repeat this while any is in doubt"
    assert doubt.remedy.partition("; ")[0] == (held if follows == 0.0025 else more)


def test_a_structure_that_nearly_is_dislocated_is_doubted(column, motion, calls, monkeypatch):
    """Of joints 400 mm deep the limit is 40 mm of residual, and two thirds of it are near."""
    options = {"vary": {**HELD, "dt": ("as given", "half")}, "samples": 1, "dt": 0.005}

    def move(kind, residual, analysis, motion, **options):
        fall = STANDS if analysis.dt == 0.005 else replace(STANDS, kind=kind, residual=residual)
        return SimpleNamespace(fall=fall, ending=af.dynamics.Ending.MET)

    words = "of 3 runs a residual displacement, up to 27 mm, is within a factor of 1.5 of 40 mm"
    for kind, residual, doubted in (
        ("stands", 0.026, False),
        ("stands", 0.027, True),
        ("dislocated", 0.05, False),
    ):
        monkeypatch.setattr(evaluators, "time_history", partial(move, kind, residual))
        found = af.verdict_range(column, motion, **options)
        assert len(found.doubts) == doubted
        assert (words in str(found).splitlines()[1]) == doubted


def test_runs_without_joints_in_strong_motion_are_a_doubt(column, motion, calls, monkeypatch):
    """As given and with half the step; strong motion ends at 95 % of the Arias intensity."""
    options = {"vary": {**HELD, "dt": ("as given", "half")}, "samples": 1, "dt": 0.005}
    for kind, half, count in (("stands", 0.06, 1), ("dislocated", 0.04, 0), ("fallen", 0.06, 0)):

        def meet(analysis, motion, kind=kind, half=half, **options):
            share = 0.0 if analysis.dt == 0.005 else half
            fall = replace(STANDS, kind=kind, loose_share=share)
            return SimpleNamespace(fall=fall, ending=af.dynamics.Ending.MET)

        monkeypatch.setattr(evaluators, "time_history", meet)
        doubts = af.verdict_range(column, motion, **options).doubts
        assert len(doubts) == count
        assert all("of 3 runs blocks were loose" in doubt.cause for doubt in doubts)


def test_variations_that_do_not_stand_as_drawn_are_doubted(motion, calls, tmp_path):
    """By shear of the dead load with that k_s, V / (k_s A); rigid contact has none."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    vary = {**HELD, "joint_rule": ("exact", "rigid"), "k_s": (0.02, 1.0)}
    found = af.verdict_range(ring, motion, vary=vary, samples=4, seed=2)
    rules, factors = (found.dataset[name].values for name in ("joint_rule", "k_s"))
    slips = found.dataset["slip_at_rest"].values
    for rule, factor, slip in zip(rules, factors, slips, strict=True):
        given = ring.joints[0].contact
        contact = replace(given, shear_stiffness=factor * given.shear_stiffness)
        joints = tuple(replace(joint, contact=contact) for joint in ring.joints)
        rest = af.dead_load(af.build(replace(ring, joints=joints), fidelity="rigid")).joints
        sheared = abs(rest["V"].values) / (contact.shear_stiffness * ring.depths * ring.width)
        # closed joints; displacements of the run may be large
        expected = 0.0 if rule == "rigid" else sheared.max()
        assert slip == pytest.approx(expected, rel=0.02)
    assert found.in_doubt.tolist() == (slips > 1e-3).tolist()
    number = int(found.in_doubt.sum())
    assert 1 <= number < len(slips) - 2
    (doubt,) = found.doubts
    assert f"under dead load in {number} of 7 variations" in doubt.cause
    # all that the remedy keeps stand as drawn
    low, high = map(float, re.findall(r"verdict\.vary\.k_s=\[([\d.]+),([\d.]+)\]", doubt.remedy)[0])
    assert factors[found.in_doubt].max() < low
    assert high == 1.0
    kept = af.verdict_range(ring, motion, vary={**vary, "k_s": (low, high)}, samples=4, seed=2)
    assert kept.doubts == ()
    assert "slip_at_rest" not in kept.dataset


def test_contacts_motion_and_step_reach_the_run(column, motion, calls):
    found = evaluate(column, motion)
    (same, moved, dt, *_) = calls.pop()
    assert found == {
        "outcome": "stands",
        "displacement": 0.02,
        "residual": 0.01,
        "time": pytest.approx(np.nan, nan_ok=True),
        "admissible_step": np.inf,
        "lacks_joints": False,
        "slip_at_rest": pytest.approx(0.0, abs=1e-12),  # beds are level
    }
    assert (same, dt) == (column, 0.005)
    assert np.array_equal(moved.horizontal, motion.horizontal)
    evaluate(column, motion, k_n=2.0, k_s=0.5, friction=-0.1, scale=3.0, sign="reversed", dt="half")
    (changed, moved, dt, *_) = calls.pop()
    for new, old in zip(changed.joints, column.joints, strict=True):
        assert new.contact == replace(
            old.contact,
            normal_stiffness=2.0 * old.contact.normal_stiffness,
            shear_stiffness=0.5 * old.contact.shear_stiffness,
            friction=old.contact.coefficient - 0.1,
        )
    assert moved.horizontal == pytest.approx(-3.0 * motion.horizontal)
    assert dt == 0.0025
    evaluate(column, motion, finish="hewn", k_n=2.0)
    (finished, *_) = calls.pop()
    usual = af.joint_stiffness(30e9, 0.4, "hewn", strength=56e6)
    for new, old in zip(finished.joints, column.joints, strict=True):
        assert new.contact == replace(
            old.contact,
            normal_stiffness=2.0 * usual.initial[1],
            shear_stiffness=usual.shear[1],
            closure=usual.closure[1],
        )
    # soil has no finish
    soft = tuple(replace(block, material=af.masonry.BACKFILL) for block in column.blocks)
    evaluate(replace(column, blocks=soft), motion, finish="hewn")
    (same, *_) = calls.pop()
    assert [joint.contact for joint in same.joints] == [joint.contact for joint in column.joints]
    evaluate(column, motion, friction=-5.0)
    assert calls.pop()[0].joints[0].contact.coefficient == 0.05


def test_finishes_are_alternatives_of_a_range(column, motion, calls):
    vary = {**HELD, "finish": ("sawn", "weathered")}
    found = af.verdict_range(column, motion, vary=vary, samples=8, seed=1)
    drawn = set(found.dataset["finish"].values[found.dataset["sampled"].values])
    assert drawn == {"sawn", "weathered"}
    assert len({structure.joints[0].contact for structure, *_ in calls}) == 3
    with pytest.raises(af.InvalidInput, match=r"finish = .* give some of"):
        af.verdict_range(column, motion, vary={"finish": ("polished",)}, samples=1)


def test_joint_rules_select_the_method(column, motion, monkeypatch):
    built, rigid = [], []
    build, run = analysis.build, variations._run_rigid_blocks

    def note(structure, settings):
        names = ("fidelity", "displacements", "quadrature", "quadrature_points")
        built.append(tuple(getattr(settings, name) for name in names))
        return build(structure, settings)

    monkeypatch.setattr(analysis, "build", note)
    monkeypatch.setattr(
        variations,
        "_run_rigid_blocks",
        lambda *given, **step: rigid.append(given) or run(*given, **step),
    )
    exact = evaluate(column, motion)
    springs = evaluate(column, motion, joint_rule="three points")
    plain = ("rigid", "large")
    assert built == [(*plain, "exact", None), (*plain, "trapezoidal", 3)]
    assert not rigid
    blocks = evaluate(column, motion, joint_rule="rigid")
    assert len(rigid) == 1
    assert len(built) == 2
    assert len({each["displacement"] for each in (exact, springs, blocks)}) == 3


@pytest.mark.parametrize(("dt", "steps"), [(0.01, 2e-3), (0.005, 2e-3), (0.002, 8e-4)])
def test_rigid_blocks_have_shorter_steps_and_time_to_settle(column, motion, monkeypatch, dt, steps):
    """Of 2 ms, or of 0.4 of the step if that is less; they rest 20 s after the motion."""
    given = {}

    class Simulation:
        def __init__(self, structure, dt):
            given["dt"] = dt

        def frames(self, bodies, end, motion, spacing):
            given.update(end=end, spacing=spacing)
            return []

    standing = CollapseState("stands", None, (), 0.0, 0.0, True)
    monkeypatch.setattr(variations, "RigidBlockSimulation", Simulation)
    monkeypatch.setattr(variations, "classify_collapse", lambda structure, frames: standing)
    variations._run_rigid_blocks(column, motion, dt=dt)
    assert given == {"dt": pytest.approx(steps), "end": motion.duration + 20.0, "spacing": 0.05}


@pytest.mark.parametrize(
    ("given", "kind", "expected"),
    [
        (af.StiffnessDamping(0.05, 8.0), "stiffness", af.StiffnessDamping(0.1, 8.0)),
        (af.StiffnessDamping(0.05, 8.0), "mass and stiffness", af.Rayleigh(0.1, (8.0, 16.0))),
        (af.Rayleigh(0.05, (6.0, 9.0)), "stiffness", af.StiffnessDamping(0.1, 6.0)),
        (af.Rayleigh(0.05, (6.0, 9.0)), "mass and stiffness", af.Rayleigh(0.1, (6.0, 9.0))),
    ],
)
def test_damping_that_is_given_is_varied(column, motion, monkeypatch, given, kind, expected):
    used = []
    history = evaluators.time_history
    monkeypatch.setattr(
        evaluators,
        "time_history",
        lambda *words, damping, **rest: (
            used.append(damping) or history(*words, damping=damping, **rest)
        ),
    )
    evaluate(column, motion, given, damping_kind=kind, damping_ratio=2.0)
    assert used == [expected]
    evaluate(column, motion, given)  # as given
    assert used[1] == given


@pytest.mark.parametrize(
    "kind",
    [
        "run",
        pytest.param("scale", marks=pytest.mark.slow),
        pytest.param("verdict_range", marks=pytest.mark.slow),
        "ensemble",
        pytest.param("ida", marks=pytest.mark.slow),
    ],
)
def test_falls_of_soft_blocks_in_one_piece_are_doubted(kind):
    """A slender block that overturns, of soil and of stone."""
    block = af.column(breadth=0.25, heights=[1.5], contact=af.Contact(1e9, 5e8, 0.7))
    soil = af.Material(6.25e6, 0.2, 18e3, name="soil")
    blocks = (*block.blocks[:-1], replace(block.blocks[-1], material=soil))
    times = np.arange(0.0, 0.6, 0.005)
    pulse = af.Motion(np.where(times < 0.5, 4.0, 0.0), 0.005, name="pulse")
    words = f"for rigid bodies, each in one piece: {blocks[-1].name}; cut them with jointed_fill"
    for structure, doubted in ((replace(block, blocks=blocks), True), (block, False)):
        analysis = af.Analysis(
            structure, fidelity="rigid", displacements="large", damping="effective", dt=0.005
        )
        find = {
            "run": lambda analysis: analysis.run(pulse),
            "scale": lambda analysis: analysis.scale(pulse, precision=0.9),
            "verdict_range": lambda analysis: analysis.verdict_range(pulse, vary=HELD, samples=1),
            "ensemble": lambda analysis: af.ensemble(analysis, pulse),
            "ida": lambda analysis: af.ida(
                analysis, pulse, limits=["collapse"], precision=0.9, between=(0.5, 2.0)
            ),
        }
        found = find[kind](analysis)
        assert any(words in str(doubt) for doubt in found.doubts) == doubted


def test_by_default_damping_is_that_of_effective_modes(column):
    given = af.Analysis(column, fidelity="rigid", displacements="large", damping="effective")
    model, rest = given.model, given.dead_load()
    for kind, name in (("stiffness", "stiffness"), ("mass and stiffness", "rayleigh")):
        expected = af.effective_damping(model, 0.025, kind=name)
        assert vary_damping(given.damping, model, rest, kind, 0.5) == expected


def test_the_run_as_given_comes_first_then_each_change_alone(column, motion, calls):
    found = af.verdict_range(column, motion, samples=3)
    rows = found.dataset.isel(run=np.flatnonzero(~found.dataset["sampled"].values))
    assert found.properties == tuple(DEFAULT_RANGES)
    neutral = {**NEUTRAL, "damping_kind": "stiffness"}
    changed = [
        {
            name: rows[name].values[k]
            for name in DEFAULT_RANGES
            if rows[name].values[k] != neutral[name]
        }
        for k in range(rows.sizes["run"])
    ]
    assert changed == [
        {},
        *({"joint_rule": rule} for rule in ("three points", "rigid")),
        *({name: factor} for name in ("k_n", "k_s") for factor in (1.0 / 3.0, 3.0)),
        *({"friction": added} for added in (-0.1, 0.1)),
        *({"damping_ratio": factor} for factor in (0.5, 2.0)),
        *({"damping_kind": "mass and stiffness"}, {"sign": "reversed"}, {"dt": "half"}),
    ]
    assert found.dataset["sampled"].values[-3:].all()
    assert found.dataset.sizes["run"] == len(changed) + 3 == len(calls)
    contact = column.joints[0].contact
    assert found.dataset.attrs["k_n"] == pytest.approx(contact.normal_stiffness)


def test_stiffness_varies_over_the_range_of_the_finish(column, motion, calls):
    """From the softest to the stiffest joint that `joint_stiffness` states; by 3 without finish."""
    hewn = af.masonry.with_finish(column, "hewn")
    af.verdict_range(hewn, motion, samples=1)
    stone = column.blocks[-1].material
    law = af.joint_stiffness(stone.young, 0.4, "hewn", strength=stone.strength or 56e6)
    used = [structure.joints[0].contact for structure, *_ in calls]
    for name, stated in (("normal_stiffness", law.initial), ("shear_stiffness", law.shear)):
        values = [getattr(contact, name) for contact in used]
        assert [min(values), values[0], max(values)] == pytest.approx(stated)
    low, usual, high = law.shear
    ranges = collapse_risk._check_varied({}, [column, hewn])
    assert usual / low > 3.0
    assert high / usual > 3.0
    assert ranges["k_s"] == pytest.approx((low / usual, high / usual))
    assert collapse_risk._check_varied({}, [column])["k_s"] == (1.0 / 3.0, 3.0)


def test_the_least_shear_stiffness_is_that_of_the_median_depth():
    """τ = σ tan(JRC log10(JCS / σ) + 30°) is reached at 1 % of a joint's length, by JRC 4."""
    sizes = {"radius": 1.8, "thickness": 0.42, "voussoirs": 15, "pier_breadth": 0.9}
    portal = af.masonry.with_finish(af.arch_on_piers(**sizes, courses=[0.6] * 4), "dressed")
    depths = [joint.depth for joint in portal.joints]
    assert (min(depths), max(depths)) == pytest.approx((0.42, 0.9))
    low = 0.05e6 * np.tan(np.radians(4.0 * np.log10(56.0 / 0.05) + 30.0)) / (0.01 * 0.42)
    usual = portal.joints[0].contact.shear_stiffness
    assert default_ranges(portal)["k_s"][0] == pytest.approx(low / usual)
    contact = portal.joints[0].contact
    _, text = list_finish_ranges(portal, contact, "dressed")["shear_stiffness"]
    assert f"({low / 1e9:.2g} to " in text
    assert "at 0.05 MPa on joints 420 mm deep, their median (k_s, low: Barton" in text


@pytest.mark.slow
def test_the_sample_is_a_latin_hypercube(column, motion, calls):
    """Each of as many equal parts of a range as there are samples has one sample."""
    found = af.verdict_range(column, motion, samples=6, seed=3, vary={"scale": (0.5, 0.9)})
    rows = found.dataset.isel(run=slice(-6, None))
    log = np.log(rows["k_n"].values * 3.0) / np.log(9.0)  # evenly in logarithm
    even = (rows["scale"].values - 0.5) / 0.4
    shift = (rows["friction"].values + 0.1) / 0.2
    for share in (log, even, shift):
        assert sorted(np.floor(6.0 * share)) == list(range(6))
    for name in ("joint_rule", "sign"):
        _, counts = np.unique(rows[name].values, return_counts=True)
        assert set(counts) == {6 // len(DEFAULT_RANGES[name])}
    again = af.verdict_range(column, motion, samples=6, seed=3, vary={"scale": (0.5, 0.9)})
    assert again.dataset.identical(found.dataset)


@pytest.mark.slow
def test_factors_over_more_than_twice_are_spread_in_their_logarithm(column, motion, calls):
    """Each of six equal parts of the range, in one measure or the other, has one sample."""
    for vary, even, in_logarithm in (
        ({"scale": (0.05, 0.15), "friction": (0.0, 0.1), "k_n": (3.0, 3.0)}, ["friction"], "scale"),
        ({"scale": (1.0, 2.0), "k_n": (1.0, 2.1)}, ["scale"], "k_n"),
        ({"scale": (2.1, 1.0)}, [], "scale"),
    ):
        found = af.verdict_range(column, motion, samples=6, vary=HELD | vary).dataset
        for name in (*even, in_logarithm):
            values, (low, high) = found[name].values[-6:], sorted(vary[name])
            share = (values - low) / (high - low)
            if name == in_logarithm:
                share = np.log(values / low) / np.log(high / low)
            assert sorted(np.floor(6.0 * share)) == list(range(6)), (name, vary)
        if vary.get("k_n") == (3.0, 3.0):
            assert set(found["k_n"].values[-6:]) == {3.0}


@pytest.mark.parametrize(("upper", "ratio"), [(0.9, 1.5), (np.inf, 2.0)])
def test_scales_of_a_bracket_are_varied_between_its_ends(column, motion, calls, upper, ratio):
    """To twice the lower one where nothing falls."""
    bracket = SimpleNamespace(lower=0.6, upper=upper)
    found = variations.verdict_range_of_bracket(bracket, column, motion, samples=2, vary=HELD)
    assert found.dataset["scale"].values[:2] == pytest.approx([1.0, ratio])
    peaks = [np.abs(moved.horizontal).max() for _, moved, *_ in calls[:2]]
    assert peaks == pytest.approx([0.6 * motion.pga, 0.6 * ratio * motion.pga])
    with pytest.raises(af.InvalidInput, match="it fell at the smallest scale"):
        variations.verdict_range_of_bracket(SimpleNamespace(lower=0.0, upper=upper), column, motion)


def test_a_property_that_is_held_does_not_vary(column, motion, calls):
    found = af.verdict_range(
        column, motion, samples=2, vary=HELD | {"sign": ("as given", "reversed")}
    )
    assert found.dataset["sign"].values[:2].tolist() == ["as given", "reversed"]
    assert found.dataset.sizes["run"] == 4
    for name in set(DEFAULT_RANGES) - {"sign"}:
        assert set(found.dataset[name].values) == {HELD[name]}


def test_other_structures_and_motions_are_varied_by_label(column, motion, calls):
    thin = af.column(breadth=0.3, heights=[0.8, 0.8], width=1.0)
    other = motion.scaled(0.5)
    vary = HELD | {"survey": {"thin": thin}, "record": {"weaker": other}}
    found = af.verdict_range(column, motion, samples=1, vary=vary)
    assert found.dataset["survey"].values.tolist() == ["as given", "thin", "as given", "thin"]
    depths = [call[0].joints[0].depth for call in calls]
    assert depths == pytest.approx([0.4, 0.3, 0.4, 0.3])
    assert [np.array_equal(call[1].horizontal, other.horizontal) for call in calls] == [
        *(False, False, True, True)
    ]


@pytest.mark.parametrize(
    ("vary", "says"),
    [
        ({"frction": (0.1, 0.2)}, "'frction' cannot be varied: name one of"),
        ({"joint_rule": ("exact", "five")}, "give some of"),
        ({"sign": ()}, "give some of"),
        ({"k_n": ()}, "give the ends of a range above 0"),
        ({"k_n": (-1.0, 2.0)}, "give the ends of a range above 0"),
        ({"scale": "strong"}, "scale"),
        ({"survey": {"thin": 3}}, "give labels with structures or with motions"),
    ],
)
def test_unknown_names_and_values_are_refused(column, motion, calls, vary, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.verdict_range(column, motion, vary=vary)
    assert not calls


def test_other_arguments_are_refused(column, motion):
    for given in ((1, motion), (column, 2)):
        with pytest.raises(af.InvalidInput):
            af.verdict_range(*given)
    with pytest.raises(af.InvalidInput, match="samples = 0"):
        af.verdict_range(column, motion, samples=0)
    with pytest.raises(af.DidNotConverge):
        af.verdict_range(
            af.circular_arch(radius=2.95, thickness=0.15, embrace=159.0, voussoirs=7), motion
        )


SMALL = {name: HELD[name] for name in ("k_s", "friction", "damping_ratio", "damping_kind", "dt")}


@pytest.mark.slow
def test_two_workers_give_the_same_bits_as_one(column, motion):
    alone, shared = (
        af.verdict_range(column, motion, samples=2, vary=SMALL, workers=workers)
        for workers in (1, 2)
    )
    assert shared.dataset.identical(alone.dataset)
    assert alone.answered.all()


def test_a_run_without_an_equilibrium_has_no_answer(column, motion):
    """Blocks that slide off each other under their own weight."""
    sloped = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5)
    vary = HELD | {"friction": (-0.55, 0.0)}
    found = af.verdict_range(sloped, motion.cut(0.0, 0.2).scaled(0.1), samples=1, seed=0, vary=vary)
    slippery = found.dataset["friction"].values < -0.5
    assert "own weight" in found.dataset["error"].values[slippery][0]
    assert found.dataset["outcome"].values[slippery][0] == "unknown"
    assert not found.answered[slippery].any()
    assert "have no answer" in found.sentence


CASE = """
title = "A column"
[structure]
shape = "column"
breadth = "0.4 m"
heights = ["0.8 m", "0.8 m"]
[model]
fidelity = "rigid"
displacements = "large"
[analysis]
dt = "4 ms"
damping = { ratio = 0.03, modes = "effective" }
[motion]
synthetic = { seed = 1, duration = 1.0, pga = 4.0 }
[output]
animation = false
"""


@pytest.mark.slow
def test_a_case_gives_its_damping_and_its_step(tmp_path, calls):
    path = tmp_path / "column.toml"
    path.write_text(CASE)
    case = af.Case.read(path)
    motion = case.ground_motion()
    af.verdict_range(case.analysis, motion, samples=1)
    (_, moved, dt, given) = calls[0]
    model = af.build(case.structure, fidelity="rigid", displacements="large")
    rest = given.dead_load()
    damping = vary_damping(given.damping, rest.model, rest, None, 1.0)
    assert damping == af.effective_damping(model, 0.03)
    assert dt == 0.004
    assert np.array_equal(moved.horizontal, motion.horizontal)
    path.write_text(CASE.replace('dt = "4 ms"', ""))
    af.Case.read(path).analysis.verdict_range(motion, samples=1)
    assert calls[-1][2] == 0.005  # without one


@pytest.mark.slow
def test_the_command_writes_files_that_a_report_shows(tmp_path, capsys, unplotted, calls):
    path, out = tmp_path / "column.toml", tmp_path / "out"
    path.write_text(CASE)
    assert af.commands.main(["verdict", str(path), "--out", str(out), "--samples", "2"]) == 0
    said = capsys.readouterr().out
    names = {"archfem.json", "case.toml", "variations"} | {
        f"verdict_range.{kind}" for kind in ("nc", "txt", "png")
    }
    assert names == {each.name for each in out.iterdir()}
    found = af.dynamics.VerdictRange.read(out / "verdict_range.nc")
    assert str(found) in said
    assert (out / "verdict_range.txt").read_text().strip() == str(found)


@pytest.mark.parametrize("ran", [pytest.param(True, marks=pytest.mark.slow), False])
def test_the_command_states_its_steps_beside_those_of_the_run(
    ran, tmp_path, capsys, unplotted, calls
):
    path, out = tmp_path / "column.toml", tmp_path / "out"
    path.write_text(CASE.replace('dt = "4 ms"', ""))
    words = "variations take steps of 5 ms, and a run varies its own"
    if ran:
        (*_, run) = af.cases.run_case(af.Case.read(path), out)
        verdict = run.history.verdict
        most, left = (format_mm(x) for x in (verdict.displacement, verdict.residual))
        words += f": in this folder it is displaced by up to {most}, {left} at the end"
    assert af.commands.main(["verdict", str(path), "--out", str(out), "--samples", "1"]) == 0
    assert calls[0][2] == 0.005
    said = capsys.readouterr().out
    assert f"\n{words}\n" in said
    assert "unvaried it is displaced by 20 mm" in said


@pytest.mark.slow
def test_a_report_shows_the_range(tmp_path, undrawn, calls):
    path, out = tmp_path / "column.toml", tmp_path / "out"
    path.write_text(CASE)
    assert af.commands.main(["run", str(path), "--out", str(out)]) == 0
    words = " ".join(read_page(report(out)).words)
    assert "Range over uncertain properties" not in words
    assert af.commands.main(["verdict", str(path), "--out", str(out), "--samples", "2"]) == 0
    words = " ".join(read_page(report(out)).words)
    found = af.dynamics.VerdictRange.read(out / "verdict_range.nc")
    assert found.sentence.startswith(f"{found.count}; {found.groups}, under 'synthetic 1'")
    assert found.count == "falls in none of 16 variations"
    said = f"Under 'synthetic 1' it {found.count}. By groups: {found.groups}."
    assert said in " ".join(words.split())
    assert "falls with none of 13 single changes" in words


@pytest.mark.slow
def test_a_report_draws_the_properties_that_decide(tmp_path, undrawn):
    path, out = tmp_path / "column.toml", tmp_path / "out"
    path.write_text(CASE.replace('"0.4 m"', '"0.2 m"').replace("duration = 1.0", "duration = 3.0"))
    af.commands.main(["run", str(path), "--out", str(out)])
    af.commands.main(["verdict", str(path), "--out", str(out), "--samples", "12"])
    assert af.dynamics.VerdictRange.read(out / "verdict_range.nc").decisive.any()
    words = " ".join(read_page(report(out)).words)
    assert "Residual displacement over the properties that explain most of it" in words


def report(folder):
    return af.cases.open_results(folder).report().read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_stopped_range_continues_from_its_folder(
    column, motion, calls, monkeypatch, tmp_path, caplog
):
    """Only runs that are left are computed, also of more samples; other arguments share none."""
    prepare = variations.prepare_runs

    def stopped(*given):
        if len(calls) == 4:
            raise KeyboardInterrupt
        return prepare(*given)

    vary, place = {**HELD, "k_n": (0.5, 2.0)}, tmp_path / "runs"
    monkeypatch.setattr(variations, "prepare_runs", stopped)
    with pytest.raises(KeyboardInterrupt):
        af.verdict_range(column, motion, vary=vary, samples=5, folder=place)
    assert f"finished runs are kept in {place}" in caplog.text
    monkeypatch.setattr(variations, "prepare_runs", prepare)
    counts = []
    for seed, shaken in ((0, motion), (0, motion), (1, motion), (0, motion.scaled(1.1))):
        calls.clear()
        settings = {"vary": vary, "samples": 5, "seed": seed}
        found = af.verdict_range(column, shaken, **settings, folder=place)
        counts.append(len(calls))
        assert found.dataset.identical(af.verdict_range(column, shaken, **settings).dataset)
    # 8 runs, of which 3 are of no random number
    assert counts == [4, 0, 5, 8]
