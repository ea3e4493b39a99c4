"""Range of results over what is assumed of a fill: closed forms of a stone in it, and its words."""

import json
from dataclasses import dataclass, replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from backfilled import SOIL, rectangle

import archfem as af
from archfem.cases.analysis_keys import LimitAnalysis
from archfem.cases.answers import list_ratios
from archfem.cases.result_folder import limit_files
from archfem.cases.result_text import describe_collapse
from archfem.commands.tools import doubt_code
from archfem.limit import collapse
from archfem.limit.fill_range import FillAssumption, FillRange, vary_fill
from archfem.statics.assessment_checks import BY_SPLIT, AssessmentCheck, add_fill_ranges
from archfem.studies.evaluators import evaluate_limit

SITE = af.Eurocode8(ag=0.25, ground="C")
BREADTH, HEIGHT, DEPTH = 1.0, 2.0, 1.5
FEET, CENTROIDS = (
    "the fill's inertia at its columns' feet",
    "the fill's inertia at its columns' centroids",
)
THIRD, NONE = "a third of its passive pressure", "none of its passive pressure"


def buried_stone():
    """A stone on rock below a fill, and beside it, to its right."""
    parts = [
        rectangle(-2.0, -1.0, 9.0, 0.0, "rock", fixed=True),
        rectangle(0.0, 0.0, BREADTH, HEIGHT, "stone", part="wall", role="pier"),
        rectangle(0.0, HEIGHT, BREADTH, HEIGHT + DEPTH, "above", SOIL),
        rectangle(BREADTH, 0.0, 9.0, HEIGHT + DEPTH, "beside", SOIL),
    ]
    return af.masonry.assembled(parts, af.masonry.SOIL_TO_STONE)


def turning_factors(passive, mobilisation=1.0 / 3.0):
    """Factors at which the stone turns into the fill, about its toe, by assumption; and e*."""
    weights = np.array([HEIGHT * af.STONE.unit_weight, DEPTH * SOIL.unit_weight]) * BREADTH
    top = HEIGHT + DEPTH
    # of the pressure m K_p γ (top - y) on 0 < y < HEIGHT
    moment = passive * SOIL.unit_weight * (top * HEIGHT**2 / 2.0 - HEIGHT**3 / 3.0)
    active = SOIL.unit_weight / passive * (top * HEIGHT**2 / 2.0 - HEIGHT**3 / 3.0)
    expected = {}
    for lever, part in product((0.0, 1.0), (mobilisation, 0.0)):
        heights = np.array([HEIGHT / 2.0, HEIGHT + lever * DEPTH / 2.0])
        held = max(part * moment, active)
        factor = (weights.sum() * BREADTH / 2.0 + held) / (weights @ heights)
        share = (weights @ heights) ** 2 / (weights.sum() * (weights @ heights**2))
        words = CENTROIDS if lever else FEET, THIRD if part else NONE
        expected[FillAssumption(*words)] = factor, share
    return expected


@pytest.mark.slow
def test_an_assumption_without_a_state_is_left_out_of_the_range(monkeypatch, caplog):
    """No state without dilatancy is found with it: a factor of 0 would say that nothing stands."""
    search, calls = collapse.search_nonassociated, []

    def search_once(*given):
        calls.append(1)
        state, bounds = search(*given)
        return (state if len(calls) == 1 else None), bounds

    monkeypatch.setattr(collapse, "search_nonassociated", search_once)
    fill = af.limit.Fill(friction_angle=30.0)
    live = af.BodyForce(1.0)
    found = af.collapse_factor(buried_stone(), live=live, friction="nonassociated", fill=fill)
    assert len(calls) == 4
    assert [*found.over_fill.values.values()] == [found.factor]
    assert caplog.text.count("the range over the fill leaves out the fill's inertia at") == 3
    assert "with which no state without dilatancy was found" in caplog.text


@pytest.mark.slow
def test_a_stone_turns_into_a_fill_at_a_factor_by_each_assumption(verified):
    fill = af.limit.Fill(friction_angle=30.0)
    live = af.BodyForce(1.0)
    found = af.collapse_factor(buried_stone(), live=live, friction=None, fill=fill)
    expected = {key: factor for key, (factor, _) in turning_factors(3.0).items()}
    assert found.over_fill.values == pytest.approx(expected, rel=1e-9)
    low, high = min(expected.values()), max(expected.values())
    verified("stone in a fill: least factor over its assumptions", low, "moments", found.range[0])
    assert found.factor == pytest.approx(high)
    assert found.sentence.endswith(f", at {low:.4g} to {high:.4g} g, pushed to the right")
    over = f"; at {low:.4g} g ({CENTROIDS}, {NONE}) to {high:.4g} g ({FEET}, {THIRD}); joints "
    assert over in str(found)
    doubled = af.collapse_factor(
        buried_stone(), live=af.BodyForce(2.0), friction="nonassociated", fill=fill
    )
    assert doubled.over_fill.values == pytest.approx(
        {key: factor / 2.0 for key, factor in expected.items()}, rel=1e-6
    )
    assert doubled.sentence == found.sentence
    # whatever is given, both ends are found
    raised = replace(fill, lever=1.0, mobilisation=0.0)
    raised = af.collapse_factor(buried_stone(), live=live, friction=None, fill=raised)
    assert raised.factor == pytest.approx(low)
    assert sorted(raised.over_fill.values.values()) == pytest.approx(
        [low, expected[FillAssumption(FEET, NONE)]]
    )
    # what is drawn is the lower end
    settings = LimitAnalysis((live,), None, fill=fill)
    least = settings.solve(buried_stone()).least
    assert f" (of the least), at {low:.4g} to {high:.4g} g" in least.sentence
    assert (least.factor, *least.range) == pytest.approx((low, low, high))
    assert least.least is None
    down = af.collapse_factor(buried_stone(), live=af.BodyForce(0.0, 1.0), fill=fill)
    assert down.over_fill is None


@pytest.mark.parametrize(
    ("angle", "doubtful"), [pytest.param(35.0, False, marks=pytest.mark.slow), (25.0, True)]
)
def test_what_happens_at_the_upper_end_of_a_range_alone_is_a_note(angle, doubtful, caplog):
    """Fill of 35° slides at tan φ = 0.7, between the ends, and one of 25° below both."""
    fill, live = af.limit.Fill(friction_angle=angle), af.BodyForce(1.0)
    factors = [x for x, _ in turning_factors(np.tan(np.radians(45.0 + angle / 2.0)) ** 2).values()]
    slope = np.tan(np.radians(angle))
    assert (min(factors) > slope) == doubtful
    found = af.collapse_factor(buried_stone(), live=live, friction=None, fill=fill)
    slides = "at a factor of {:.4g} the fill itself slides, at"
    upper = slides.format(max(factors))
    assert [note.startswith(upper) for note in found.notes] == [True]
    noted, limit = f"with the fill as given, {upper}", LimitAnalysis((), None)
    assert f"\nnote: {noted}" in describe_collapse(buried_stone(), found, limit)
    case = SimpleNamespace(structure=buried_stone(), limit=limit, parapets=0.0, motion=None)
    stated = json.loads(limit_files(case, found, "", None, [])["limit.json"])
    _, own = stated["notes"]  # and what is not checked across the plane
    assert own.startswith(noted)
    assert found.least.notes == found.notes
    checked = af.kinematic_assessment(buried_stone(), SITE, friction=None, fill=fill)
    assert checked.alpha_0 == pytest.approx(max(factors))
    assert (checked.least.alpha_0 > slope) == doubtful
    # doubts are of the least factor, and of the least margin
    least = [min(factors), checked.least.alpha_0] * doubtful
    said = [record.getMessage() for record in caplog.records]
    assert all(x.startswith(slides.format(y)) for x, y in zip(said, least, strict=True))


@pytest.mark.slow
def test_a_stone_turns_into_a_fill_with_and_without_its_backing(verified):
    """Backing holds its part of the face by its strength alone; without it the fill is as ever."""
    strength, level, passive = 1e5, HEIGHT / 2.0, 3.0
    fill = af.limit.Fill(friction_angle=30.0, backing=level, backing_strength=strength)
    options = {"live": af.BodyForce(1.0), "friction": None}
    found = af.collapse_factor(buried_stone(), fill=fill, **options)
    expected = {
        key._replace(backing="no backing"): factor
        for key, (factor, _) in turning_factors(passive).items()
    }
    weights = np.array([HEIGHT * af.STONE.unit_weight, DEPTH * SOIL.unit_weight]) * BREADTH
    # moment of γ (top - y) above the backing
    levels, top = np.array([level, HEIGHT]), HEIGHT + DEPTH
    above = SOIL.unit_weight * np.diff(top * levels**2 / 2.0 - levels**3 / 3.0)[0]
    for place, pressure in product((FEET, CENTROIDS), (THIRD, NONE)):
        heights = np.array([HEIGHT / 2.0, HEIGHT + DEPTH / 2.0 * (place == CENTROIDS)])
        held = weights.sum() * BREADTH / 2.0 + strength * level**2 / 2.0
        held += above * (passive / 3.0 if pressure == THIRD else 1.0 / passive)
        key = FillAssumption(place, pressure, "the backing")
        expected[key] = held / (weights @ heights)
    assert found.over_fill.values == pytest.approx(expected, rel=1e-9)
    least = min(expected.values())
    verified("stone in a backed fill: least factor", least, "moments", found.range[0])
    assert f"at {least:.4g} g ({CENTROIDS}, {NONE}, no backing) to" in str(found)
    assert f"({FEET}, {THIRD}, the backing)" in str(found)
    settings = LimitAnalysis((af.BodyForce(1.0),), None, fill=fill)
    assert settings.solve(buried_stone()).least.factor == pytest.approx(least)
    # to the left the active pressure turns it, which backing has not
    site = {"assessment": SimpleNamespace(spectrum=None), "target": None}
    case = SimpleNamespace(structure=buried_stone(), limit=settings, **site)
    studied = evaluate_limit(case)
    high = weights @ [HEIGHT / 2.0, HEIGHT + DEPTH / 2.0]
    whole = SOIL.unit_weight * (top * HEIGHT**2 / 2.0 - HEIGHT**3 / 3.0)
    for name, active in (("least_push", whole), ("least_push_on_backing", above)):
        left = (weights.sum() * BREADTH / 2.0 - active / passive) / high
        assert studied[name] == pytest.approx(left, rel=1e-6)
    case.limit = replace(settings, fill=replace(fill, backing=None))
    assert "least_push_on_backing" not in evaluate_limit(case)
    # a reader takes the state that is known, at the worse place of the inertia
    line = describe_collapse(buried_stone(), found, settings).splitlines()[2]
    for state in product((THIRD, NONE), ("the backing", "no backing")):
        low, high = (expected[FillAssumption(place, *state)] for place in (CENTROIDS, FEET))
        assert f" {low:.4g} to {high:.4g} g ({', '.join(state)})" in line


@pytest.mark.slow
def test_an_assessment_of_a_backed_stone_has_the_ratio_without_backing():
    fill = af.limit.Fill(friction_angle=30.0, backing=HEIGHT / 2.0, backing_strength=1e5)
    assessed = af.kinematic_assessment(buried_stone(), SITE, fill=fill, friction=None)
    bare = af.limit.Fill(friction_angle=30.0)
    bare = af.kinematic_assessment(buried_stone(), SITE, fill=bare, friction=None)
    assert assessed.linear.over_fill.ends[0] == pytest.approx(bare.linear.over_fill.ends[0])


@pytest.mark.slow
def test_an_assessment_has_a_linear_ratio_by_each_assumption():
    """By hand, of one weight for the body that moves; the least of all is that of one fill."""
    structure, fill = buried_stone(), af.limit.Fill(friction_angle=30.0)
    options = {"friction": None, "q": 1.0, "confidence_factor": 1.0}
    found = af.kinematic_assessment(structure, SITE, fill=fill, **options)
    ground = float(SITE.horizontal(0.0)) * 9.80665
    unit, expected = structure.gravity / ground, turning_factors(3.0)
    ratios = {key: factor * unit for key, (factor, _) in expected.items()}
    assert found.linear.over_fill.values == pytest.approx(ratios, rel=1e-6)
    factor, share = expected[FillAssumption(FEET, THIRD)]
    assert found.linear.ratio == pytest.approx(factor * unit / share, rel=1e-6)
    assert found.least.displacement.over_fill.values == found.displacement.over_fill.values
    assert found.least.alpha_0 < 0.99 * found.alpha_0


@pytest.mark.slow
def test_an_assessment_passes_only_with_what_it_needs():
    """The margin of the displacement check is that of each fill alone."""
    structure, fill = buried_stone(), af.limit.Fill(friction_angle=30.0)
    options = {"friction": None, "q": 1.0, "confidence_factor": 1.0}
    found = af.kinematic_assessment(structure, SITE, fill=fill, **options)
    ratios = found.linear.over_fill.values
    displacement = found.displacement.over_fill.values
    for assumption, (_, assumed) in vary_fill(fill).items():
        alone = af.kinematic_assessment(structure, SITE, fill=assumed, **options)
        assert displacement[assumption] == pytest.approx(alone.displacement.bodies)
        assert alone.displacement.bodies < 0.99 * alone.displacement.ratio
        if displacement[assumption] == min(displacement.values()):
            assert found.least.alpha_0 == pytest.approx(alone.alpha_0)
            assert found.least.displacement.capacity == pytest.approx(alone.displacement.capacity)
            assert f"all else is under one assumption: {assumption}" in str(found.least)
    between = np.mean(sorted(ratios.values())[1:3])
    weaker = af.Eurocode8(ag=0.25 * between, ground="C")
    partly = af.kinematic_assessment(structure, weaker, fill=fill, **options).linear
    assert partly.outcome == f"passes only with {THIRD}"
    assert not partly.passes
    low, high = (end / between for end in (min(ratios.values()), max(ratios.values())))
    assert f"{partly.outcome}, the spectrum may be {low:.3g} to {high:.3g} (one weight" in str(
        partly
    )
    # as weight and mass alone its inertia varies
    bare = af.kinematic_assessment(structure, SITE, **options)
    assert [*bare.linear.over_fill.values] == [
        FillAssumption(FEET, ""),
        FillAssumption(CENTROIDS, ""),
    ]


@dataclass(frozen=True)
class Assessed:
    """What `add_fill_ranges` reads and writes of an assessment."""

    linear: AssessmentCheck
    displacement: AssessmentCheck | None = None
    doubts: tuple = ()
    least: "Assessed | None" = None


def check_of(ratio, bodies):
    return AssessmentCheck("linear", ratio, 1.0, "m/s²", ratio, np.nan, "", bodies=bodies)


@pytest.mark.parametrize(
    ("apart", "bodies", "outcome", "of_given"),
    [
        # of a laden bridge, by feet and centroids with a third, then with none
        ((1.36, 1.16, 1.08, 0.91), (1.12, 0.965, 0.886, 0.761), f"{FEET} and {THIRD}", ""),
        ((1.36, 1.16, 1.08, 1.01), (1.12, 1.0, 0.886, 0.761), THIRD, ""),
        ((1.36, 1.16, 0.9, 0.8), (0.96, 0.9, 0.8, 0.7), "fails", BY_SPLIT),
        ((1.36, 1.16, 1.08, 1.01), (0.96, 0.9, 0.8, 0.7), BY_SPLIT, BY_SPLIT),
    ],
)
def test_a_range_and_what_it_needs_are_of_one_weight_a_body(apart, bodies, outcome, of_given):
    """It passes with no assumption under which one weight a body fails, whatever blocks do."""
    keys = (FillAssumption(i, p) for p, i in product((THIRD, NONE), (FEET, CENTROIDS)))
    each = [Assessed(check_of(*ratios)) for ratios in zip(apart, bodies, strict=True)]
    found = add_fill_ranges(each[0], dict(zip(keys, each, strict=True)))
    given, least = found.linear, found.least.linear
    outcome = outcome if of_given else f"passes only with {outcome}"
    assert (given.outcome, least.outcome) == (of_given or outcome, outcome)
    assert doubt_code(found.doubts) == 3 * ("only with" in outcome)
    assert all("fill decides whether it passes; measure" in str(x) for x in found.doubts)
    for check in (given, least):
        assert (*check.over_fill.values.values(),) == bodies
        assert not check.passes
    assert least.ratio == apart[-1]
    ((_, ratios),) = list_ratios(SimpleNamespace(checks=[least]))
    assert (ratios.decisive, ratios.least, ratios.most) == (bodies[-1], apart[-1], bodies[0])
    assert str(ratios) == f"{bodies[-1]} to {bodies[0]} ({apart[-1]} with the weights apart)"


@pytest.mark.slow
def test_what_does_not_stand_without_pressure_says_so():
    """Two stones that lean to the right against the fill, which alone holds them."""
    parts = [
        rectangle(-2.0, -1.0, 9.0, 0.0, "rock", fixed=True),
        rectangle(0.0, 0.0, 1.0, 2.0, "stone", part="wall", role="pier"),
        rectangle(0.6, 2.0, 2.0, 4.0, "leaning", part="wall", role="pier"),
        rectangle(2.0, 0.0, 9.0, 4.0, "beside", SOIL),
    ]
    structure = af.masonry.assembled(parts, af.masonry.SOIL_TO_STONE)
    fill = af.limit.Fill(friction_angle=30.0, mobilisation=1.0, active=0.0)
    found = af.collapse_factor(structure, live=af.BodyForce(1.0), friction=None, fill=fill)
    assert found.factor > 0.0
    assert found.range == (0.0, found.factor)
    assert found.describe_range().startswith(f"at 0 g ({CENTROIDS}, {NONE}; it does not stand) to")
    assert found.describe_range().endswith(f"({FEET}, all of its passive pressure)")
    # the mechanism of the least is the fall at rest: the upper stone about the edge of the lower
    (hinge,) = found.least.hinges
    joint = structure.joints[hinge[0]]
    assert {structure.blocks[k].name for k in joint.blocks} == {"stone", "leaning"}
    assert getattr(joint, hinge[1])[0] == pytest.approx(1.0)
    most = f"else at up to {found.factor:.4g} g, pushed to the right"
    state = f"it does not stand under its own weight (fill: {NONE})"
    assert found.least.sentence == f"{state}: {found.least.mechanism_name}; {most}"
    assert describe_collapse(
        structure, found.least, LimitAnalysis((af.BodyForce(1.0),), None, fill=fill)
    ).startswith(f"limit analysis: {state}: ")
    assert f" (of the most), at 0 to {found.factor:.4g} g" in found.sentence
    checks = af.kinematic_assessment(structure, SITE, friction=None, fill=fill).checks
    assert [check.over_fill.ends[0] for check in checks] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((1.2, 1.1, 1.3, 1.0), "passes"),
        ((0.9, 0.8, 0.7, 0.6), "fails"),
        ((1.2, 0.9, 1.1, 0.8), f"passes only with {FEET}"),
        ((1.2, 1.1, 0.9, 0.8), f"passes only with {THIRD}"),
        ((1.2, 1.1, 1.1, 0.8), f"passes only with {FEET} or {THIRD}"),
        ((1.2, 0.9, 0.9, 0.8), f"passes only with {FEET} and {THIRD}"),
    ],
)
def test_outcomes_hold_over_the_range(values, words):
    keys = (FillAssumption(i, p) for p, i in product((THIRD, NONE), (FEET, CENTROIDS)))
    found = FillRange(dict(zip(keys, values, strict=True)))
    assert found.outcome == words
    low, high = min(values), max(values)
    assert found.ends == (low, high)
    assert found.format_ends(digits=2) == f"{low:.2g} to {high:.2g}"
    alike = FillRange(dict.fromkeys(found.values, 1.0))
    assert alike.describe().startswith("1 whatever is")
    assert alike.describe_states() == f"over what is assumed of the fill: {alike.describe()}"
    halved = FillRange({key: value / 2.0 for key, value in found.values.items()})
    assert FillRange.least_of([found, halved]) == halved


@pytest.mark.parametrize(
    ("passing", "words"),
    [
        ("backing", "the backing"),
        ("backing and feet", f"{FEET} and the backing"),
        ("backing or third", f"{THIRD} or the backing"),
    ],
)
def test_outcomes_state_the_backing_where_they_need_it(passing, words):
    values = {}
    for key in product((FEET, CENTROIDS), (THIRD, NONE), ("the backing", "no backing")):
        backed = key[2] == "the backing"
        passes = {
            "backing": backed,
            "backing and feet": backed and key[0] == FEET,
            "backing or third": backed or key[1] == THIRD,
        }
        values[FillAssumption(*key)] = 0.9 + 0.2 * passes[passing]
    assert FillRange(values).outcome == f"passes only with {words}"
