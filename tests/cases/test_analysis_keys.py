"""Limit analysis and damping of case files, against the functions of Python."""

import re
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from backfilled import arch_bridge

import archfem as af
from archfem.cases.analysis_keys import (
    parse_assessment,
    parse_limit,
    parse_pushover,
    parse_rating,
    rate_case,
)
from archfem.dynamics.damping import resolve_effective_damping
from archfem.dynamics.schemes import EffectiveDamping
from archfem.models.model import Doubt

RING = Path(__file__).parents[2] / "meshes" / "ring.toml"
POINT = {"x": "1.4 m", "force": ["0 kN", "-1 kN"]}


@pytest.mark.parametrize(
    ("given", "live", "friction"),
    [
        ({"horizontal": 1.0}, [af.BodyForce(1.0)], "coulomb"),
        ({"horizontal": 1.0, "vertical": 0.3}, [af.BodyForce(1.0, 0.3)], "coulomb"),
        ({"point": POINT, "friction": "none"}, [af.PointLoad(1.4, (0.0, -1000.0))], None),
        pytest.param(
            {"point": POINT, "horizontal": -0.1, "friction": "nonassociated"},
            [af.BodyForce(-0.1), af.PointLoad(1.4, (0.0, -1000.0))],
            "nonassociated",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_table_means_the_same_as_its_call(ring, given, live, friction):
    found = parse_limit(given).solve(ring)
    expected = af.collapse_factor(ring, live=live, friction=friction)
    assert 0.0 < found.factor == expected.factor < np.inf
    assert found.hinges == expected.hinges


def test_a_fill_means_the_same_as_its_call():
    structure = arch_bridge()
    table = {
        "friction_angle": "35 degree",
        "cohesion": "2 kPa",
        "mobilisation": 0.5,
        "active": 0.8,
        "dispersal": "uniform",
        "spread": 26.6,
    }
    point = {"x": "3.2 m", "force": ["0 kN", "-1 kN"]}
    found = parse_limit({"point": point, "fill": table}).solve(structure)
    fill = af.limit.Fill(**table | {"friction_angle": 35.0, "cohesion": 2e3})
    live = af.PointLoad(3.2, (0.0, -1e3))
    assert found.factor == af.collapse_factor(structure, live=live, fill=fill).factor


def test_a_point_load_of_a_limit_may_have_a_height(stack):
    point = {"x": "-0.5 m", "y": "1.25 m", "force": ["1 kN", "0 kN"]}
    live = af.PointLoad(-0.5, (1e3, 0.0), y=1.25)
    factor = parse_limit({"point": point}).solve(stack).factor
    assert factor == af.collapse_factor(stack, live=live).factor


def test_a_limit_without_a_load_has_friction_and_fill_for_a_rating(ring):
    limit = parse_limit({"friction": "none", "fill": {"friction_angle": "35 degree"}})
    assert (limit.friction, limit.fill.friction_angle) == (None, pytest.approx(35.0))
    with pytest.raises(af.InvalidInput, match="limit has no load: give horizontal"):
        limit.solve(ring)


def test_a_fill_of_a_limit_may_be_plastic():
    keys = {"friction_angle": "30 degree", "cohesion": "5 kPa"}
    given = {"friction_angle": pytest.approx(30.0), "cohesion": 5e3}
    pressing, plastic = (
        parse_limit({"fill": keys | law}).fill for law in ({}, {"law": "plastic", "gap": 0.05})
    )
    assert isinstance(pressing, af.limit.Fill)
    assert isinstance(plastic, af.limit.PlasticFill)
    for fill in (pressing, plastic):
        assert {key: getattr(fill, key) for key in given} == given
    assert plastic.gap == 0.05
    with pytest.raises(af.InvalidInput, match=r"unknown key 'limit\.fill\.mobilisation'"):
        parse_limit({"fill": keys | {"law": "plastic", "mobilisation": 1.0}})
    with pytest.raises(af.InvalidInput, match=r"limit\.fill\.law"):
        parse_limit({"fill": keys | {"law": "elastic"}})


def test_stones_crush_at_the_strength_of_a_limit(ring):
    table = {"horizontal": 1.0, "strength": "0.5 MPa"}
    factor = parse_limit(table).solve(ring).factor
    live = af.BodyForce(1.0)
    assert factor == af.collapse_factor(ring, live=live, strength=5e5).factor
    assert factor < 0.99 * af.collapse_factor(ring, live=live).factor


def strength_of(**tables):
    """Strength of the limit analysis of a bridge whose case has some tables."""
    arch = {"span": 4.0, "rise": 1.0, "thickness": 0.4, "voussoirs": 5}
    walls = {"length": 2.0, "height": 1.0, "state": "fixed", "left": {}, "right": {}}
    bridge = {"arches": {"arch": arch}, "sidewalls": walls, "backfill": {"cover": 0.3}}
    return af.Case.of({"structure": {"shape": "bridge", **bridge}, **tables}).limit.strength


def test_a_given_strength_of_the_stones_is_that_of_the_limit_analysis():
    """That of the preset is a default, which no limit analysis has; soil is no stone."""
    assert strength_of() is None
    assert strength_of(materials={"backfill": {"strength": "0.1 MPa"}}) is None
    given = {"stone": {"strength": "2 MPa"}, "backfill": {"strength": "0.1 MPa"}}
    assert strength_of(materials=given) == pytest.approx(2e6)
    assert strength_of(materials=given, limit={"friction": "none"}) == pytest.approx(2e6)
    assert strength_of(materials=given, limit={"strength": "3 MPa"}) == pytest.approx(3e6)
    assert strength_of(materials=given, limit={"strength": "none"}) == np.inf


def test_an_assessment_has_the_strength_of_the_limit_analysis_and_crushes_under_all_weights():
    """A stone and a mass at its top turn about a point N / (2 f w) inside its edge."""
    breadth, height, strength, extra = 0.6, 2.0, 1e6, 60e3
    column = {"shape": "column", "breadth": breadth, "heights": [height], "width": 1.0}
    spectrum = {"code": "NTC-2018", "ag": 0.2, "f0": 2.4, "tc_star": 0.3, "site": "B"}
    load = {"block": 1, "point": [0.0, height], "weight": extra}
    tables = {"structure": column, "assessment": {"spectrum": spectrum, "loads": [load]}}
    for materials, limit, crush in (
        ({}, {}, 0.0),
        ({"stone": {"strength": strength}}, {}, 1.0),
        ({"stone": {"strength": strength}}, {"strength": "none"}, 0.0),
        ({"stone": {"strength": strength}}, {"strength": 0.5 * strength}, 2.0),
    ):
        case = af.Case.of(tables | {"materials": materials, "limit": limit})
        weight = case.structure.weight
        arm = 0.5 * (breadth - crush * (weight + extra) / strength)
        for found in case.assessment.solve(case.structure, None).values():
            by_hand = (weight + extra) * arm / (0.5 * weight * height + extra * height)
            assert found.alpha_0 == pytest.approx(by_hand)
    with pytest.raises(af.InvalidInput, match=r"'assessment.strength': it is limit.strength"):
        af.Case.of({"structure": column, "assessment": {"strength": "2 MPa"}})


@pytest.mark.slow
def test_results_state_the_strength_with_which_joints_crush(tmp_path, capsys, monkeypatch):
    """A column under its weight and an axle: its factor, and that without a given strength."""
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (0.2,))
    column = {"shape": "column", "breadth": 0.6, "heights": [1.0, 1.0]}
    tables = {"structure": column, "limit": {"horizontal": 1.0}}
    spectrum = {"code": "NTC-2018", "ag": 0.2, "f0": 2.4, "tc_star": 0.3, "site": "B"}
    tables["assessment"] = {"spectrum": spectrum}
    factors = []
    for materials, says in (({}, "do not crush"), ({"stone": {"strength": 1e6}}, "crush at 1 MPa")):
        path = tmp_path / "column.toml"
        path.write_text(af.Case.of(tables | {"materials": materials}).text())
        for command in (["limit"], ["rate", "--vehicle", "CS454-single", "--width", "1"]):
            # a rating without a strength is in doubt, and says what the stones' might do
            doubted = command[0] == "rate" and not materials
            assert af.commands.main([command[0], str(path), *command[1:]]) == 3 * doubted
            said = capsys.readouterr().out
            assert f"joints {says}" in said
            assert ("\nin doubt: joints do not crush, as no strength of the st" in said) == doubted
            factors += re.findall(r"(?:factor|, at) (inf|[\d.]+)", said)[:1]
        assert af.commands.main(["assess", str(path)]) == 0
        said = capsys.readouterr().out
        assert ("\njoints crush at 1 MPa: hinges are set back by 12 mm\n" in said) == bool(
            materials
        )
        factors += re.findall(r"alpha_0 = ([\d.]+)", said)[:1]
    push, rating, alpha, weaker_push, weaker_rating, weaker_alpha = map(float, factors)
    assert weaker_push < 0.97 * push
    assert (alpha, weaker_alpha) == (pytest.approx(push), pytest.approx(weaker_push))
    assert weaker_rating < rating


@pytest.mark.slow
def test_a_case_is_rated_by_its_own_table(ring):
    lorry = {"name": "lorry", "axles": ["20 kN", "40 kN"], "spacings": ["3 m"]}
    rating = parse_rating({"vehicle": lorry, "live": 1.2, "impact": 1.1, "width": "0.5 m"})
    own = af.limit.Vehicle("lorry", (20e3, 40e3), (3.0,))
    expected = af.rate(ring, own, live=1.2, impact=1.1, width=0.5, friction=None)
    plain = parse_limit({})
    found = rate_case(ring, rating, parse_limit({"friction": "none"}))
    assert found.factor == expected.factor
    # keys of the command count before those of the table
    heavier = rate_case(ring, rating | {"live": 2.4}, plain)
    assert heavier.live == 2.4
    with pytest.raises(af.InvalidInput, match="a rating needs a vehicle"):
        rate_case(ring, {}, plain)
    # a vehicle has the factors of its code, and stones the strength of the limit analysis
    coded = parse_rating({"vehicle": {**lorry, "live": 1.2, "impact": 1.1}, "width": "0.5 m"})
    limit = parse_limit({"friction": "none", "strength": "1 MPa"})
    weaker = af.rate(ring, own, live=1.2, impact=1.1, width=0.5, friction=None, strength=1e6)
    assert rate_case(ring, coded, limit).factor == weaker.factor < expected.factor
    # of several vehicles the first, as a study rates
    assert parse_rating({"vehicle": ["LM1", lorry]}) == {"vehicle": "LM1"}
    assert parse_rating({"vehicle": [lorry, "LM1"]}) == {"vehicle": own}
    with pytest.raises(af.InvalidInput, match=r"rating.vehicle.axles.0. = '20 m'"):
        parse_rating({"vehicle": {**lorry, "axles": ["20 m"]}})
    # of a lorry in kg; an axle of a cart has its unit, and that of 1 N is one of a study
    heavy = {"name": "lorry", "axles": [7000, "9 kN"], "spacings": [3.0]}
    with pytest.raises(af.InvalidInput, match=r"are in N, and the heaviest, 9 kN, is that of a c"):
        parse_rating({"vehicle": ["LM1", heavy]})
    with pytest.raises(af.InvalidInput, match=r'in "78.48 kN" for a mass of 8000 kg'):
        parse_rating({"vehicle": heavy | {"axles": [7000, 8000]}})
    for axles in (["7 kN", "9 kN"], [7000, 20000], [1.0, 1.0]):
        parse_rating({"vehicle": heavy | {"axles": axles}})


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"horizontal": 1.0, "fill": {}}, "lacks its angle of friction"),
        ({"horizontal": 1.0, "fill": {"angle": 35}}, "unknown key 'limit.fill.angle'"),
        ({"horizontal": 1.0, "fill": {"friction_angle": "0.6 rad", "spread": 85}}, "not between"),
        ({"horizontl": 1.0}, "unknown key 'limit.horizontl': did you mean 'horizontal'"),
        ({"horizontal": "1 kN"}, "limit.horizontal = '1 kN' has a unit, and"),
        ({"horizontal": 1.0, "friction": "some"}, "limit.friction = 'some' is not known"),
        ({"point": 3}, "limit.point = 3 is not a table"),
        ({"point": {"x": 1.4}}, "give a place and the two components of a force"),
        ({"point": {"x": 1.4, "force": [1.0]}}, "two components of a force"),
        ({"point": {**POINT, "z": 1}}, "unknown key 'limit.point.z'"),
        ({"point": {**POINT, "force": ["0 m", "1 kN"]}}, "limit.point.force.0. = '0 m'"),
        (3, "limit = 3 is not a table"),
    ],
)
def test_invalid_limits_are_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        parse_limit(given)


def test_a_load_beside_the_structure_is_refused(ring):
    with pytest.raises(af.InvalidInput, match=r"x = 9 m misses the structure"):
        parse_limit({"point": {**POINT, "x": 9.0}}).solve(ring)


@pytest.mark.parametrize("key", ["point", "dead"])
@pytest.mark.parametrize("parse", [parse_limit, parse_pushover])
def test_a_check_refuses_loads_beside_the_structure(ring, parse, key):
    far = {**POINT, "x": 120.0}
    given = {"point": far} if key == "point" else {"point": POINT, "dead": [far]}
    with pytest.raises(af.InvalidInput, match=r"x = 120 m misses the structure"):
        parse(given).check(ring)
    parse({"point": POINT}).check(ring)


def test_a_check_refuses_a_settlement_of_another_block_than_a_support(ring):
    settled = parse_pushover({"settlement": {"block": "no block", "motion": [0.0, -1.0, 0.0]}})
    with pytest.raises(af.InvalidInput, match="block 'no block' cannot settle"):
        settled.check(ring)


def test_a_demand_that_looks_like_a_multiple_of_g_is_refused_in_both_units(caplog):
    for g in ("0.24 g", "0.03 g", "0.04 g"):
        parse_limit({"horizontal": 1.0, "demand": g})
    assert not caplog.messages
    says = r"limit\.demand is 0.24 m/s², which is 0.0245 g: write 2.35 m/s² if it is 0.24 g"
    with pytest.raises(af.InvalidInput, match=says):
        parse_limit({"horizontal": 1.0, "demand": 0.24})


SMALL_CASE = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0, 1.0]

[model]
fidelity = "rigid"

[analysis]
damping = { ratio = 0.05, modes = "effective" }
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_CASE, encoding="utf-8")
    return path


def test_a_case_takes_its_damping_from_the_modes(small):
    case = af.Case.read(small)
    assert case.analysis.damping == EffectiveDamping(0.05)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    damping, how = af.cases.damping_of(case, dead)
    assert damping == af.dynamics.effective_damping(dead.model, 0.05, dead)
    assert re.fullmatch(
        r"damping: 5 % at \d+\.\d\d Hz, proportional to stiffness; mode 1, the first effective "
        r"along x, has \d+\.\d % of the mass",
        how,
    )
    # Before a model is chosen it is of elastic blocks, and lower by their compliance.
    elastic = af.build(case.structure, fidelity="condensed")
    expected = resolve_effective_damping(case.analysis.damping, elastic, None)[0].frequency
    assert expected == af.cases.damping_of(case, af.dead_load(elastic))[0].frequency
    assert expected == pytest.approx(damping.frequency, rel=0.05)


@pytest.mark.parametrize("kind", ["stiffness", "rayleigh"])
def test_the_same_words_give_the_same_damping(kind):
    """A ring whose joints open under its weight: about closed joints its damping is another."""
    change = [f"analysis.damping={{ ratio = 0.05, modes = 'effective', kind = '{kind}' }}"]
    case = af.Case.read(RING, [*change, "model={ fidelity = 'rigid' }"])
    model = af.build(case.structure, fidelity="rigid")
    result = af.cases.DeadLoadResult.of(case)
    assert af.effective_damping(model, 0.05, kind=kind) == result.damping[0]
    assert af.effective_damping(model, 0.05, "closed", kind=kind) != result.damping[0]


def test_rayleigh_damping_is_set_by_its_kind(small):
    case = af.Case.read(
        small, ["analysis.damping.kind=rayleigh", "analysis.damping.mass_share=0.95"]
    )
    assert case.analysis.damping == EffectiveDamping(0.05, "rayleigh", mass_share=0.95)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    damping, how = af.cases.damping_of(case, dead)
    assert damping == af.dynamics.effective_damping(
        dead.model, 0.05, dead, kind="rayleigh", mass_share=0.95
    )
    assert re.match(r"damping: 5 % at \d+\.\d\d and \d+\.\d\d Hz; modes 1 and ", how)


def test_damping_at_a_frequency(small):
    case = af.Case.read(small, ['analysis.damping={ ratio = 0.05, frequency = "8 Hz" }'])
    assert case.analysis.damping == af.StiffnessDamping(0.05, 8.0)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    assert (
        af.cases.damping_of(case, dead)[1] == "damping: 5 % at 8.00 Hz, proportional to stiffness"
    )


def test_effective_damping_has_its_ratio_by_default(small):
    for damping in ('"effective"', '{ modes = "effective" }'):
        case = af.Case.read(small, [f"analysis.damping={damping}"])
        assert case.analysis.damping == af.EffectiveDamping(0.05)


@pytest.mark.parametrize(
    "damping",
    [
        '{ ratio = 0.05, modes = "all" }',
        '{ ratio = 0.05, modes = "effective", frequencies = [1, 2] }',
        "{ ratio = 0.05, frequencies = [1, 2], mass_share = 0.1 }",
        '{ frequency = "8 Hz" }',
        '{ ratio = 0.05, modes = "effective", mass_share = 0.9 }',
        '{ ratio = 0.05, frequency = 8.0, kind = "rayleigh" }',
    ],
)
def test_invalid_damping_is_refused(small, damping):
    with pytest.raises(af.InvalidInput, match=r'write \{ ratio = 0\.05, modes = "effective" \}'):
        af.Case.read(small, [f"analysis.damping={damping}"])


def test_share_of_a_case_is_checked_when_it_is_read(small):
    with pytest.raises(af.InvalidInput, match=r"share of the mass \[-\] = 2\.0 is not"):
        af.Case.read(small, ["analysis.damping.kind=rayleigh", "analysis.damping.mass_share=2.0"])
    with pytest.raises(af.InvalidInput, match="damping kind = 'mass' is not known"):
        af.Case.read(small, ["analysis.damping.kind=mass"])


@pytest.mark.slow
def test_command(small, capsys):
    out = small.parent / "out"
    assert af.commands.main(["modes", str(small), "--out", str(out), "--count", "3"]) == 0
    said = capsys.readouterr().out
    assert (out / "modes.txt").read_text(encoding="utf-8") in said
    assert "damping: 5 % at" in said
    written = {"modes.txt", "modes.csv", "modes.png", "modes.gif", "archfem.json"}
    assert {path.name for path in out.iterdir()} == written


def test_assessment_of_a_case_has_the_arguments_of_python():
    table = {
        "spectrum": {"code": "EC8", "ag": 0.2, "ground": "B"},
        "friction": "none",
        "direction": -1,
        "loads": [{"block": 1, "point": ["0 m", "2 m"], "weight": "5 kN"}],
        "limit_state": {
            **{"name": "own", "share": 0.5, "period_factor": 2.0, "secant_share": 1.0},
            **{"damping": 0.05, "source": "a test"},
        },
    }
    settings = parse_assessment(table)
    assert settings.spectrum == af.Eurocode8(ag=0.2, ground="B")
    assert settings.directions == (-1.0,)
    assert parse_assessment({}).directions == (1.0, -1.0)
    # the fill is that of the limit analysis, but for one of its own or a plastic one
    own = {"fill": {"friction_angle": 30}}
    limit = parse_limit({"fill": {"friction_angle": 35}})
    assert parse_assessment({}, limit).options["fill"] is limit.fill
    assert parse_assessment({}, limit).of_limit == ("fill",)
    assert parse_assessment(own, limit).options["fill"].friction_angle == 30.0
    plastic = replace(limit, fill=af.limit.PlasticFill(friction_angle=35.0))
    assert not parse_assessment({}, plastic).options
    assert settings.options == {
        "friction": None,
        "loads": [af.masonry.AttachedLoad(1, (0.0, 2.0), weight=5e3)],
        "limit_state": af.statics.LimitState("own", 0.5, 2.0, 1.0, 0.05, "a test"),
    }


def test_assessment_slides_as_the_limit_analysis_but_for_its_own_keys(monkeypatch):
    limit = parse_limit({"friction": "nonassociated"})
    found = parse_assessment({}, limit)
    assert found.options == {"friction": "nonassociated"}
    assert found.of_limit == ("friction",)
    for table in (
        {"friction": "coulomb"},
        {"fill": {"friction_angle": 30}},
        {"loads": [{"block": 1, "point": ["0 m", "2 m"], "weight": "5 kN"}]},
    ):
        found = parse_assessment(table, limit)
        assert found.options.get("friction") != "nonassociated"
        assert not found.of_limit
    given = []
    monkeypatch.setattr(
        "archfem.statics.mechanism_assessment.assess_parts",
        lambda *_, **options: given.append(options) or {},
    )
    parse_assessment({}, limit).solve(None, af.Eurocode8(ag=0.2, ground="B"), parts=True)
    assert given == [{"direction": 1.0}, {"direction": -1.0}]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"spectrum": {"ag": 0.2}}, "assessment.spectrum.code is missing"),
        ({"direction": 2}, "assessment.direction = 2: give 1 for right or -1 for left"),
        ({"loads": [{"block": 1}]}, "assessment.loads = .*missing.*its keys are"),
        ({"limit_state": {"share": 0.5}}, "assessment.limit_state = .*missing"),
        ({"friction": "dry"}, "assessment.friction = 'dry' is not known"),
        ({"qq": 2}, "unknown key 'assessment.qq'"),
    ],
)
def test_refused_assessments_of_a_case(table, message):
    with pytest.raises(af.InvalidInput, match=message):
        parse_assessment(table)


def test_loads_of_a_limit_may_stay(stack):
    point = {"x": 0.0, "y": 1.0, "force": ["1 kN", "0 kN"]}
    stays = [{"horizontal": 0.01}, {"x": 0.0, "force": ["0 kN", "-5 kN"]}]
    limit = parse_limit({"point": point, "dead": stays})
    assert limit.dead == (af.BodyForce(0.01), af.PointLoad(0.0, (0.0, -5e3)))
    live = af.PointLoad(0.0, (1e3, 0.0), y=1.0)
    exact = af.collapse_factor(stack, live=live, dead=limit.dead).factor
    assert limit.solve(stack).factor == pytest.approx(exact, rel=1e-9)
    with pytest.raises(af.InvalidInput, match=r"limit\.dead"):
        parse_limit({"point": point, "dead": [{"x": 0.0}]})
    with pytest.raises(af.InvalidInput, match="a rating takes no loads that stay"):
        rate_case(stack, {"vehicle": "LM1"}, limit)


def test_a_doubt_of_both_senses_is_printed_once_with_both_numbers(
    tmp_path, capsys, monkeypatch, unplotted
):
    numbers = count(1)
    monkeypatch.setattr(
        "archfem.statics.assessment_checks.AssessmentCheck.doubt_split",
        lambda _: [Doubt("it may be {:.3g} g", "hold it", (0.25 * next(numbers),))],
    )
    spectrum = {"code": "NTC-2018", "ag": 0.2, "f0": 2.4, "tc_star": 0.3, "site": "B"}
    column = {"shape": "column", "breadth": 0.6, "heights": [2.4]}
    path = tmp_path / "column.toml"
    path.write_text(af.Case.of({"structure": column, "assessment": {"spectrum": spectrum}}).text())
    assert af.commands.main(["assess", str(path)]) == 3
    said = capsys.readouterr().out
    assert re.findall("in doubt: it may be .*", said) == [
        "in doubt: it may be 0.25 to 1 g; hold it"
    ]
