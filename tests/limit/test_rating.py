"""Rating of bridges: against `collapse_factor`, by hand, and both ways over a symmetric bridge."""

import re
import tomllib
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from backfilled import arch_bridge

import archfem as af
from archfem.cases.analysis_keys import LimitAnalysis, parse_limit
from archfem.cases.rating_text import RIGID_JOINTS, doubt_rating, state_ratings, tabulate_ratings
from archfem.cases.result_text import ResultTable
from archfem.limit import VEHICLES, Vehicle, rating, vehicles, worst_places
from archfem.limit.collapse_warnings import describe_closing
from archfem.limit.rating import _places_along as places_along
from archfem.models.model import Doubt
from archfem.view.collapse import draw_ratings

# Of a fill with backing, beside the one given
STATES = (
    *("without_pressure", "full_pressure", "active_alone"),
    *("without_backing", "without_either", "active_without_backing"),
)

EXACT = 1e-6
"""Relative: the programme is solved to 1e-9 block weights, corners count as one within 1e-6."""

GRAVEL = af.limit.Fill(friction_angle=35.0)

CLEAR_FROM = 2.0 + 0.5 * 0.4 * 2.5 / 3.125
"""x of the intrados of the left springing, 0.2 m inside a centre line of 3.125 m of radius."""


@pytest.fixture(scope="module", autouse=True)
def few_places():
    """Places are a tenth of the bridge apart, not a hundredth, which takes longer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rating, "_places_along", partial(rating._places_along, steps=10))
        yield


def scaled(joint, share):
    """Return a joint with a share of its depth, about its middle."""
    inner, outer = np.array(joint.intrados), np.array(joint.extrados)
    middle = 0.5 * (inner + outer)
    ends = [tuple((middle + share * (end - middle)).tolist()) for end in (inner, outer)]
    return replace(joint, intrados=ends[0], extrados=ends[1])


@pytest.fixture(scope="module")
def lorry_rating(few_places):
    """The rating of a lorry with unequal axles, on a bridge three metres wide."""
    lorry = Vehicle("lorry", (60e3, 115e3), (3.2,), live=1.35)
    bridge = arch_bridge(width=3.0, voussoirs=5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rating, "_places_along", partial(places_along, steps=20))
        return af.rate(bridge, lorry, width=2.0, dead=1.1, fill=GRAVEL)


@pytest.mark.slow
def test_the_factor_is_that_of_point_loads_at_the_worst_place(lorry_rating):
    """Factored axles by hand: live factor, the share of the width, and heavier materials."""
    found = lorry_rating
    sense = 1.0 if found.moving.direction == "right" else -1.0
    places = found.moving.position + sense * np.array([1.6, -1.6])
    low, high = 0.0, 9.0  # ends of the fill
    live = [
        af.PointLoad(x, (0.0, -1.35 * 1.5 * weight))
        for x, weight in zip(places, (60e3, 115e3), strict=True)
        if low < x < high
    ]
    soil, stone = (
        replace(material, unit_weight=1.1 * material.unit_weight)
        for material in (af.masonry.BACKFILL, af.STONE)
    )
    bridge = arch_bridge(width=3.0, voussoirs=5)
    assert {block.material for block in bridge.blocks} == {af.masonry.BACKFILL, af.STONE}
    blocks = [
        replace(block, material=soil if block.material == af.masonry.BACKFILL else stone)
        for block in bridge.blocks
    ]
    heavier = replace(bridge, blocks=tuple(blocks))
    expected = af.collapse_factor(heavier, live=live, fill=GRAVEL)
    assert found.factor == pytest.approx(expected.factor, rel=EXACT)
    assert found.moving.worst.hinges == expected.hinges
    assert float(found.moving.factors["factor"].min()) == pytest.approx(found.factor, rel=EXACT)


def test_a_symmetric_bridge_has_one_rating_in_both_directions(lorry_rating):
    factors = lorry_rating.moving.factors["factor"]
    right, left = (factors.sel(direction=way).values for way in ("right", "left"))
    assert np.isfinite(right).sum() > 10
    np.testing.assert_allclose(right, left[::-1], rtol=EXACT)
    assert (right != right[::-1]).any()  # the lorry is not symmetric


def test_the_worst_place_is_printed_as_a_standing_body_with_axles_from_left_to_right(lorry_rating):
    """By hand both ways; axles beyond the bridge, from 0 to 9 m, are left out."""
    moving, front, rear = lorry_rating.moving, 60e3, 115e3
    (pressed,) = moving.worst.live  # at the worst place the lorry is half on it
    long = Vehicle("long", (5e3, front, rear), (40.0, 3.2))
    places = [
        (lorry_rating.vehicle, moving.direction, moving.position, [(pressed.x, rear)]),
        (lorry_rating.vehicle, "right", 4.0, [(2.4, rear), (5.6, front)]),
        (lorry_rating.vehicle, "left", 4.0, [(2.4, front), (5.6, rear)]),
        (long, "left", 4.0 - 20.0, [(2.4, front), (5.6, rear)]),
    ]
    for vehicle, direction, position, expected in places:
        there = replace(moving, direction=direction, position=position)
        text = str(replace(lorry_rating, vehicle=vehicle, moving=there))
        (line,) = (each for each in text.splitlines() if "[structure.standing]" in each)
        table = tomllib.loads(line.partition("): ")[2])["vehicle"]
        given = {
            key: np.array([float(text.split()[0]) for text in np.atleast_1d(value)])
            for key, value in table.items()
        }
        body = af.masonry.StandingBody(
            x=given["x"].item(),
            axles=(1e3 * given["axles"]).tolist(),
            spacings=[*given.get("spacings", ())],
            width=given["width"].item(),
            length=0.3,
            centre_of_gravity=1.3,
        )
        feet = np.column_stack([body.feet.mean(axis=1), body.axles])
        np.testing.assert_allclose(feet, expected, rtol=1e-5)
        assert table["width"] == "2 m"
    assert ", width = " not in str(replace(lorry_rating, width=3.0))


def column_under_axle(width=1.0, overhang=1.0):
    """A stone of 1 m by 2 m whose top overhangs to the right: an axle there turns it."""
    end = 1.0 + overhang
    outline = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (end, 1.0), (end, 2.0), (0.0, 2.0))
    base = ((0.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0))
    return af.masonry.assembled(
        [
            af.Block(base, af.STONE, "rock", part="rock", role="other", fixed=True),
            af.Block(outline, af.STONE, "stone", part="pier", role="pier"),
        ],
        lambda a, b: af.masonry.STONE_TO_STONE,
        width=width,
    )


@pytest.mark.slow
def test_an_axle_on_an_overhang_by_hand():
    """It turns about the toe (1, 0) when Q (x - 1) is the moment of the weight about it.

    Areas: 1 m by 2 m with its middle 0.5 m left of the toe, 1 m by 1 m 0.5 m right of it. The axle
    is worst at the last place on the stone, its edge at 2 m.
    """
    stone = column_under_axle(width=2.0)
    moment = af.STONE.unit_weight * 2.0 * (2.0 * 0.5 - 1.0 * 0.5)
    found = af.rate(stone, Vehicle("axle", (50e3,), live=2.0), width=1.0)
    place = found.moving.position
    assert place == pytest.approx(2.0)
    assert found.factor == pytest.approx(moment / (2.0 * 2.0 * 50e3 * (place - 1.0)), rel=EXACT)
    # It stands on as much of its base, about the middle, as reaches to the resultant; a heavy axle
    # needs a base that reaches beyond the toe.
    for axle, stands in ((2e3, True), (2e5, False)):
        other = af.rate(stone, Vehicle("axle", (axle,)), width=2.0)
        weight, place = 6.0 * af.STONE.unit_weight, other.moving.position
        resultant = (weight * (2.0 * 0.5 + 1.0 * 1.5) / 3.0 + axle * place) / (weight + axle)
        assert other.geometric == pytest.approx(0.5 / (resultant - 0.5), rel=2e-4)  # of the halving
        assert other.passes == (other.geometric >= 1.0) == stands


@pytest.mark.slow
def test_a_strength_that_is_not_given_is_stated_by_hand():
    """The base crushes over N / (σ b) at the toe, and turns about the middle of that.

    So λ Q (x - 1) = M - N² / (2 σ b) with N = W + λ Q, where M is the moment of the weight W.
    """
    stone, axle = column_under_axle(width=2.0), Vehicle("axle", (50e3,))
    weight = 3.0 * 2.0 * af.STONE.unit_weight
    moment, crushes = weight / 6.0, 1.0 / (2.0 * 5e6 * 2.0)
    found = af.rate(stone, axle, width=2.0)
    force = 50e3
    arm = found.moving.position - 1.0
    roots = np.roots(
        [crushes * force**2, force * (2.0 * crushes * weight + arm), crushes * weight**2 - moment]
    )
    expected = float(roots.max())
    assert found.crushing == {"factor": pytest.approx(expected, rel=1e-4)}  # by tangents
    assert expected < 0.995 * found.factor
    ends = f"{expected:.4g} to {found.factor:.4g} over what is assumed of the stones"
    assert f"; the factor is {ends}" in found.outcome
    assert f": factor {found.factor:.4g} without crushing {found.place}, " in repr(found)
    words = f"(56 MPa of the preset is not given); at 5 MPa the least factor is {expected:.4g}"
    assert words in str(found)
    given = af.rate(stone, axle, width=2.0, strength=5e6)
    assert given.factor == pytest.approx(expected, rel=1e-4)
    assert not given.crushing
    assert f": factor {given.factor:.4g} {given.place}, " in repr(given)
    soft = replace(found, live=1.35, impact=1.2, crushing={"factor": 0.9})
    assert replace(soft, moving=_scaled(soft.moving, 3.0)).outcome.startswith(
        "passes only with stones that do not crush"
    )


@pytest.mark.slow
def test_doubts_about_fill_and_stones_are_combined(monkeypatch):
    """Against the rating with the strength: it fails where neither is as given, if both are not."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.5, 4.0, 4.5, 5.0))
    bridge, axle = arch_bridge(voussoirs=9, thickness=0.5), Vehicle("axle", (4e5,), impact=1.0)
    fill = replace(GRAVEL, backing=0.3)
    found, soft = (
        af.rate(bridge, axle, live=1.0, fill=fill, strength=strength) for strength in (None, 5e6)
    )
    expected = {state: getattr(soft, state) for state in ("factor", *STATES)}
    assert found.crushing == pytest.approx(expected, rel=1e-4)
    # an axle that either of the two carries, of a bridge without backing
    low, high = soft.without_either, min(found.without_either, soft.without_backing)
    assert low < 0.98 * high
    heavier = af.rate(bridge, axle, live=(low * high) ** 0.5, fill=GRAVEL)
    words = "passes only with the pressure of the fill or stones that do not crush; the factor is "
    ends = f"{low / heavier.live:.4g} to {heavier.full_pressure:.4g} over what is assumed of the "
    assert heavier.outcome == f"{words}{ends}fill and the stones"
    walking = heavier.by_codes["alone at walking pace (1.1 × 1, from memory)"]
    assert walking.crushing["factor"] == pytest.approx(soft.without_backing / 1.1, rel=1e-3)


@pytest.mark.parametrize(
    ("low", "words"),
    [
        ({}, "passes"),
        ({"stones": 0.9}, "passes only with stones that do not crush"),
        ({"stones": np.nan}, "passes only with stones that do not crush"),
        ({"pressure": 0.9}, "passes only with the pressure of the fill"),
        ({"passive": 0.9}, "passes only with the passive pressure of the fill"),
        (
            {"passive, backing": 0.9},
            "passes only with the passive pressure of the fill or the backing",
        ),
        (
            {"pressure": 0.9, "stones": 0.9},
            "passes only with the pressure of the fill and stones that do not crush",
        ),
        (
            {"stones": 0.9, "pressure, backing": 0.9},
            "passes only with stones that do not crush, and the pressure of the fill or the "
            "backing",
        ),
        (
            {"pressure, backing, stones": 0.9},
            "passes only with the pressure of the fill or the backing or stones that do not crush",
        ),
    ],
)
def test_a_verdict_names_the_least_that_it_needs(lorry_rating, low, words):
    """Without more parts a bridge carries no more: factors by the set of parts left out."""
    names = {"": "factor", "pressure": "without_pressure"}
    names |= {"backing": "without_backing", "pressure, backing": "without_either"}
    names |= {"passive": "active_alone", "passive, backing": "active_without_backing"}

    def least(parts):
        return min((x for key, x in low.items() if {*key.split(", ")} <= {*parts}), default=1.5)

    of_fill = {name: least(key.split(", ")) for key, name in names.items()}
    crushing = {name: least([*key.split(", "), "stones"]) for key, name in names.items()}
    moving = _scaled(lorry_rating.moving, of_fill.pop("factor") / lorry_rating.factor)
    fill = replace(GRAVEL, backing=0.5)
    found = replace(lorry_rating, missing=(), fill=fill, crushing=crushing, **of_fill)
    assert replace(found, moving=moving).short_outcome == words


@pytest.mark.parametrize(("without", "doubted"), [(0.9, True), (1.1, False)])
def test_what_passes_with_pressure_of_the_fill_alone_is_in_doubt(lorry_rating, without, doubted):
    moving = _scaled(lorry_rating.moving, 1.5 / lorry_rating.factor)
    found = replace(lorry_rating, moving=moving, crushing={}, by_cs454={}, without_pressure=without)
    remarks = doubt_rating(found, LimitAnalysis([], "coulomb", 1e7))
    causes = [remark.cause for remark in remarks if isinstance(remark, Doubt)]
    # a pass by a code is in doubt as that of a vehicle with its factors given
    only = "the bridge passes only with the pressure of the fill"
    given = found.live * found.impact
    products = {"good": 1.35 * 1.2, "fair": 1.35 * 1.4}
    named = [
        f"lorry by Eurocodes on a {road} road (1.35 × {product / 1.35:.1f}, from memory)"
        for road, product in products.items()
        if 1.1 * given / product < 1.0 <= 1.5 * given / product
    ]
    assert len(named) == 2
    assert causes == [only if doubted else f"{only}, for {' and '.join(named)}"]
    sure = replace(found, without_pressure=1.4, missing=())
    assert not [
        x for x in doubt_rating(sure, LimitAnalysis([], "coulomb", 1e7)) if "only" in str(x)
    ]


def without_places(text):
    """A text without the places of axles behind factors."""
    return re.sub(r" \(axles? at x = [^)]*\)", "", text)


def _scaled(moving, share):
    """Return a moving load whose least factor is a multiple."""
    return replace(moving, worst=replace(moving.worst, factor=share * moving.worst.factor))


@pytest.mark.slow
def test_a_distributed_load_on_an_overhang_by_hand():
    """It counts where it turns the stone: beyond the toe at 1 m, with its middle at 1.5 m.

    It has the partial factor, on the width of the vehicle, and no dynamic factor.
    """
    stone = column_under_axle(width=2.0)
    resists = af.STONE.unit_weight * 2.0 * (2.0 * 0.5 - 1.0 * 0.5)
    lorry = Vehicle("lorry", (50e3,), live=2.0, impact=1.5, area_load=4e3)
    found = af.rate(stone, lorry, width=1.0)
    assert found.moving.position == pytest.approx(2.0)
    turns = 2.0 * 1.5 * 2.0 * 50e3 * 1.0 + 2.0 * 4e3 * 2.0 * 0.5
    assert found.factor == pytest.approx(resists / turns, rel=EXACT)
    here = found.moving.factors.sel(direction="left", position=found.moving.position)
    assert float(here["loaded"]) == pytest.approx(1.0)
    assert np.isnan(found.by_rule)  # it has what its code and the rule say, or more
    assert ", and 4 kN/m² of road where it is adverse; given" in str(found)


def test_parapets_on_an_overhang_by_hand():
    """Their middle is 0.25 m left of the toe at 1 m, as that of the overhang is right of it."""
    stone = column_under_axle(width=2.0, overhang=0.5)
    moment = af.STONE.unit_weight * 2.0 * (2.0 * 0.5 - 0.5 * 0.25) + 18e3 * 1.5 * 0.25
    axle, given = Vehicle("axle", (50e3,), live=1.0, impact=1.0), {"width": 1.0}
    found = af.rate(stone, axle, **given, parapets=18e3)
    assert found.factor == pytest.approx(moment / (2.0 * 50e3 * 0.5), rel=EXACT)
    assert "\nparapets of 18 kN/m\n" in str(found)
    with pytest.raises(af.InvalidInput, match=r"parapets 17.6 N/m look like kN/m"):
        af.rate(stone, axle, **given, parapets=17.6)


@pytest.mark.slow
def test_parapets_are_a_dead_load_along_the_bridge(monkeypatch):
    """Against columns of thin paving, as heavy: without pressure of the fill weights decide.

    In a narrow fan it does not matter that an axle on the paving is 3 cm higher.
    """
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.0, 3.5, 4.0, 4.5))
    weight, width = 18e3, 3.0
    walls = [
        af.shapes.Sidewall(length=2.0, height=1.0, above=0.5, state="fixed", name=side)
        for side in ("left", "right")
    ]
    arch = af.shapes.Arch(span=5.0, rise=1.25, thickness=0.4, voussoirs=20)
    parts = {"arches": [arch], "sidewalls": walls, "backfill": af.shapes.Backfill(cover=0.4)}
    plain = af.bridge(**parts, width=width)
    paved = af.bridge(**parts, width=width, paving=af.shapes.Paving(thickness=0.03, length=0.2))
    heavy = af.Material(10e9, 0.2, weight / (0.03 * width), stands_for="parapets")
    blocks = [replace(x, material=heavy) if x.part == "paving" else x for x in paved.blocks]
    paved = replace(paved, blocks=tuple(blocks))
    fill = af.limit.Fill(friction_angle=35.0, mobilisation=0.0, active=0.0, spread="3 degree")
    axle, given = Vehicle("axle", (1e5,), impact=1.0, live=1.0), {"fill": fill, "strength": 5e6}
    given["width"] = 2.0
    found, light, as_paving = (
        af.rate(structure, axle, **given, parapets=parapets)
        for structure, parapets in ((plain, weight), (plain, 0.0), (paved, 0.0))
    )
    assert found.factor > 1.05 * light.factor
    assert found.factor == pytest.approx(as_paving.factor, rel=5e-3)
    assert found.full_pressure > light.full_pressure
    assert "\nparapets of 18 kN/m\n" in str(found)
    again = rating.rate_again(found, plain, 2.0, fill=fill, strength=5e6, friction="coulomb")
    assert again == pytest.approx(found.factor, rel=1e-3)
    assert found.geometric > light.geometric
    limit = LimitAnalysis([], "coulomb", 5e6)
    assert "parapets" not in doubt_rating(found, limit)[-1]
    assert "and parapets (their weight is parapets = " in doubt_rating(light, limit)[-1]
    with pytest.raises(af.InvalidInput, match=r"parapets 17.6 N/m look like kN/m"):
        af.rate(plain, axle, **given, parapets=17.6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axles", "turns", "direction", "number"),
    [
        ((40e3, 50e3), 1.8 * 50e3 * 1.0 + 40e3 * 0.7, "left", 2),
        pytest.param(
            *((50e3, 40e3), 1.8 * 50e3 * 1.0 + 40e3 * 0.7, "right", 1), marks=pytest.mark.slow
        ),
        pytest.param(
            *((20e3, 70e3, 25e3), 1.8 * 70e3 * 1.0 + 25e3 * 0.7, "right", 2),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_impact_on_one_axle_by_hand(axles, turns, direction, number):
    """It is on the axle, and the vehicle drives so, that the overhang turns at the least factor.

    An axle stands at its edge, 1 m beyond the toe, and the next one 0.3 m nearer to that.
    """
    stone = column_under_axle(width=2.0)
    resists = af.STONE.unit_weight * 2.0 * (2.0 * 0.5 - 1.0 * 0.5)
    spacings = (0.3,) * (len(axles) - 1)
    lorry = Vehicle("lorry", axles, spacings, live=1.9, impact=1.8, impact_on="worst axle")
    found = af.rate(stone, lorry, width=1.0)
    # it stands beside the edge, by micrometres
    assert found.factor == pytest.approx(resists / (2.0 * 1.9 * turns), rel=1e-5)
    assert found.moving.direction == direction
    words = (
        f"\nimpact by 1.8 on the worst axle alone, here number {number} from the front (given)\n"
    )
    assert words in str(found)
    factors = found.moving.factors["factor"]
    assert float(factors.min()) == pytest.approx(found.factor, rel=EXACT)
    # at each place the least over the axles that may have the impact
    for row in 1.9 * np.array(axles) * (1.0 + 0.8 * np.eye(len(axles))):
        places = factors["position"].values.tolist()
        own = af.moving_load(stone, (2.0 * row).tolist(), spacings=spacings, positions=places)
        assert (factors.values <= (1.0 + EXACT) * own.factors["factor"].values).all()
    everywhere = af.rate(stone, replace(lorry, impact_on="all axles"), width=1.0)
    assert everywhere.factor < 0.95 * found.factor
    assert "\nimpact by 1.8 (given)\n" in str(everywhere)


def test_mirrored_vehicles_are_driven_once():
    """Of three equal axles the outer ones are mirrored; unequal spacings are not."""
    counts = {(1.3, 1.3): 2, (1.3, 1.4): 3}
    for spacings, count in counts.items():
        axles = Vehicle("bogie", (80e3,) * 3, spacings, impact_on="worst axle")
        assert len(axles.factored(1.9, 1.8)) == count
        assert [row.tolist() for row in axles.factored(1.9, 1.0)] == [pytest.approx([152e3] * 3)]
    assert sum(VEHICLES["CS454-triple-2.6"].factored(1.9, 1.8)[1]) == pytest.approx(
        1.9 * (2.0 + 1.8) * 78480.0
    )
    with pytest.raises(af.InvalidInput, match="impact_on of axle = 'one axle' is not known"):
        Vehicle("axle", (80e3,), impact_on="one axle")


def test_a_vehicle_spreads_over_its_wheels_and_the_fill_up_to_a_lane():
    for name, cover, width in (
        ("LM1", 0.3, 2.4 + 0.3),
        ("LM1", 0.9, 3.0),
        ("LM1", None, 2.4),
        ("CS454-single", 0.3, 1.5 + 0.3),
        ("CS454-single", 1.2, 2.5),
    ):
        bridge = arch_bridge(voussoirs=4, cover=cover, width=4.0)
        assert VEHICLES[name].spread_over(bridge) == pytest.approx(width, abs=1e-6), (name, cover)
        assert VEHICLES[name].spread_over(replace(bridge, width=1.2)) == 1.2
    single = VEHICLES["CS454-single"]
    for cover, words in (
        (0.3, "1.8 m of width: 1.5 m over the wheels and 0.3 m of fill above the crown, never "),
        (1.2, "2.5 m of width: all of a lane, never more than a lane of 2.5 m (BD 21/01: "),
    ):
        bridge = arch_bridge(voussoirs=4, cover=cover, width=4.0)
        said = single.describe_width(bridge, single.spread_over(bridge))
        assert said.startswith(f"over {words}")
    assert single.describe_width(replace(bridge, width=1.2), 1.2).startswith(
        "over 1.2 m of width: all of the bridge, never more than"
    )


@pytest.mark.slow
def test_the_depth_of_fill_is_found_beside_its_ends_too():
    """The fill ends above a corner of the ring, which rounding may put outside it."""
    for number in range(0, 60, 4):
        span = 4.0 + 0.1 * number
        arch = af.shapes.Arch(span=span, rise=0.25 * span, thickness=0.55, voussoirs=15)
        bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.45), width=5.0)
        assert Vehicle("axle", (1e5,)).spread_over(bridge) == pytest.approx(1.95, abs=1e-9), span


@pytest.mark.slow
def test_of_a_wider_vehicle_the_factor_by_rule_is_stated():
    stone, axle = column_under_axle(width=6.0), Vehicle("axle", (50e3,), live=1.0, impact=1.0)
    rule, wide = (af.rate(stone, axle, **given) for given in ({}, {"width": 6.0}))
    assert wide.factor == pytest.approx(6.0 / rule.width * rule.factor, rel=EXACT)
    assert wide.by_rule == pytest.approx(rule.factor, rel=EXACT)
    assert f"by rule, {rule.factor:.4g} at this place" in repr(wide)
    assert np.isnan(rule.by_rule)


@pytest.mark.slow
def test_less_than_the_rule_is_stated_beside_the_verdict(monkeypatch):
    """Twice the width has twice the factor; the factor by rule stands in the same line."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (2.6, 3.1, 3.6))
    bridge = arch_bridge(voussoirs=5, cover=0.6, width=6.0)
    axle = Vehicle("axle", (50e3,), live=1.35, impact=1.2, area_load=3e3)
    rule, wide = (af.rate(bridge, axle, fill=GRAVEL, **given) for given in ({}, {"width": 6.0}))
    bare = af.rate(bridge, axle, fill=GRAVEL, width=6.0, area_load=0.0)
    alone = af.rate(bridge, axle, fill=GRAVEL, area_load=0.0)
    assert rule.width == pytest.approx(2.1, abs=1e-6)
    assert bare.factor == pytest.approx(6.0 / 2.1 * alone.factor, rel=EXACT)
    assert rule.factor < wide.factor < bare.factor
    for found in (wide, bare, alone):
        assert found.moving.position == rule.moving.position
        assert found.by_rule == pytest.approx(rule.factor, rel=EXACT)
        by_rule = f"over 2.1 m of width and 3 kN/m² beside the axles, by rule, {rule.factor:.4g}"
        assert f"; {by_rule} at this place, with the fill as given" in repr(found)
    assert np.isnan(rule.by_rule)
    ends = f"{min(rule.crushing.values()):.4g} to {rule.full_pressure:.4g}"
    over = "over what is assumed of the fill and the stones"
    assert repr(rule).endswith(f"passes; the factor is {ends} {over}")
    train = replace(VEHICLES["LM71"], axles=(1e3,), spacings=())
    found = af.rate(bridge, train, fill=GRAVEL)
    least = min(found.crushing.values())
    ends = f"the factor is {least:.4g} to {found.full_pressure:.4g} {over}"
    left = "left out: the 80 kN/m beside the axles (LM71-train)"
    most = f"passes if the code's impact is at most {found.factor:.4g}"
    # the active pressure pushes stones over
    most += f", with the active pressure of the fill alone {found.active_alone:.4g}"
    assert found.active_alone < found.without_pressure < found.factor
    assert repr(found).endswith(f"{most}; {ends}; {left}")
    assert found.short_outcome == "passes, without impact"


def test_places_are_a_hundredth_of_the_bridge_apart():
    places = places_along(column_under_axle(), np.array([[1.0, 0.0]]))
    np.testing.assert_allclose(places, np.linspace(0.0, 2.0, 101), atol=1e-12)


@pytest.mark.slow
def test_the_geometric_factor_of_a_ring_is_one_of_thickness():
    """A ring whose joints have been narrowed by hand to the least depth has a factor of one."""
    ring = af.circular_arch(radius=2.95, thickness=0.45, embrace=140.0, voussoirs=11)
    found = af.rate(ring, Vehicle("axle", (5e3,)))
    assert found.geometric > 1.1
    live = found.moving.worst.live
    for share, carries in ((1.001 / found.geometric, True), (0.999 / found.geometric, False)):
        other = replace(ring, joints=tuple(scaled(joint, share) for joint in ring.joints))
        factor = af.collapse_factor(other, live=list(live)).factor
        assert (factor >= 1.0) == carries


@pytest.mark.slow
@pytest.mark.parametrize("spacings", [(), (1.3,)])
def test_the_least_factor_of_bare_stones_is_at_the_end_of_one(spacings, monkeypatch):
    """Whichever places are sampled; places beside it come near to it from above."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    vehicle = Vehicle("axles", (20e3,) * (1 + len(spacings)), spacings)
    factors = []
    for steps in (30, 41):
        monkeypatch.setattr(rating, "_places_along", partial(places_along, steps=steps))
        found = af.rate(ring, vehicle)
        factors.append(found.factor)
        drawn = found.moving.factors["factor"]
        assert float(drawn.min()) == pytest.approx(found.factor, rel=EXACT)
        assert (np.diff(drawn["position"]) > 0.0).all()
    assert factors[0] == pytest.approx(factors[1], rel=1e-4)  # within hundredths of a millimetre
    around = np.linspace(-0.05, 0.05, 41) + found.moving.position
    near = af.moving_load(ring, vehicle.axles, spacings=spacings, positions=around.tolist()).worst
    assert factors[0] <= (1.0 + EXACT) * near.factor
    assert near.factor == pytest.approx(factors[0], rel=0.02)


def test_vehicles_have_sources_and_grades():
    assert {"LM1", "LM2", "LM71", "LM71-train", "CS454-single", "HL93-truck"} <= set(VEHICLES)
    for name, vehicle in VEHICLES.items():
        assert vehicle.name == name
        assert vehicle.grade in ("read", "from memory")
        assert vehicle.source != "given"
        assert "from memory" in vehicle.live_source
        assert len(vehicle.spacings) == len(vehicle.axles) - 1
    tandem = VEHICLES["LM1"]
    assert (tandem.axles, tandem.spacings) == ((300e3, 300e3), (1.2,))
    assert VEHICLES["CS454-single"].axles == pytest.approx((11.5 * 9810.0,))
    assert sum(VEHICLES["LM71-train"].axles) == pytest.approx(1000e3 + 20 * 80e3)


def test_words_and_table(lorry_rating):
    words = str(lorry_rating)
    assert "live load by 1.35 (given)" in words
    assert "dead load by 1.1 (given)" in words
    assert "175 kN; given" in words
    assert "over 2 m of width (given)" in words
    sense = 1.0 if lorry_rating.moving.direction == "right" else -1.0
    places = sorted(lorry_rating.moving.position + sense * np.array([1.6, -1.6]))
    (beside,) = (x for x in places if not 0.0 < x < 9.0)  # ends of the fill
    (x,) = {*places} - {beside}
    clear = f"{x - CLEAR_FROM:.2f} m from the left clear springing"
    stands = f"1 axle of 2 at x = {x:.2f} m, {clear} (the other at {beside:.2f} m), "
    assert f"factor {lorry_rating.factor:.4g} without crushing with {stands}" in repr(lorry_rating)
    assert ("passes" in repr(lorry_rating)) == (lorry_rating.factor >= 1.0)
    head, *rows = lorry_rating.table().splitlines()
    assert head.startswith("direction,position")
    assert "of the vehicle's middle [m]" in head
    assert words.count("(the vehicle's middle)") == 1
    factor, geometric = (
        next(k for k, line in enumerate(words.splitlines()) if start in line)
        for start in ("Rating of", "geometric factor")
    )
    assert words.splitlines()[factor + 1].endswith("codes with partial factors require 1")
    assert "Heyman's criterion" in words.splitlines()[geometric + 1]
    hinges = [joint for joint, _ in lorry_rating.moving.worst.hinges]
    (line,) = (line for line in words.splitlines() if line.startswith("hinges at x = "))
    for x, joint in zip(line.removeprefix("hinges at x = ").split(","), hinges, strict=True):
        ends = lorry_rating.structure.ends[joint][:, 0]
        assert ends.min() - 0.01 < float(x.removesuffix(" m")) < ends.max() + 0.01
    span = f"clear span from {CLEAR_FROM:.2f} to {9.0 - CLEAR_FROM:.2f} m"
    assert f"\nevery x is that of the case and the picture; {span}\n" in words
    assert "\ncomputed with 2 m of width, fill of law pressure and 35°, friction 0.6, " in words
    assert words.endswith("passive pressure, friction angle 35°, cohesion 0 kPa")
    # where axles stand beside the bridge there is no factor
    factors = lorry_rating.moving.factors["factor"].values
    assert [row.split(",")[2] for row in rows] == [f"{x:.6g}" for x in factors[factors < np.inf]]
    assert len(rows) < factors.size
    least = min(float(row.split(",")[2]) for row in rows)
    assert least == pytest.approx(lorry_rating.factor, rel=1e-5)  # six digits


@pytest.mark.slow
def test_the_range_over_the_pressure_of_the_fill_is_that_of_all_places(lorry_rating):
    """Of the same axles at all places, on heavier materials: none of it, and all."""
    worst, vehicle = lorry_rating.moving.worst, lorry_rating.vehicle
    loads = [load.force[1] for load in worst.live]
    axles = np.array(vehicle.axles) * min(loads) / -max(vehicle.axles)
    places = {"positions": lorry_rating.moving.factors["position"].values.tolist()}
    none, active, whole = (
        af.limit.moving_load(
            worst.structure,
            axles.tolist(),
            spacings=vehicle.spacings,
            fill=replace(GRAVEL, **pressure),
            **places,
        ).worst.factor
        for pressure in (
            {"mobilisation": 0.0, "active": 0.0},
            {"mobilisation": 0.0},
            {"mobilisation": 1.0},
        )
    )
    assert lorry_rating.active_alone == pytest.approx(active, rel=EXACT)
    assert lorry_rating.least == min(lorry_rating.crushing.values())
    # by that state alone it fails: the active pressure pushes stones over
    by_code = lorry_rating.by_codes[vehicles.BY_CS454]
    assert by_code.crushing["active_alone"] < 1.0 < by_code.crushing["without_pressure"]
    needed = "passes only with the passive pressure of the fill or stones that do not crush"
    assert by_code.short_outcome == needed
    assert lorry_rating.without_pressure == pytest.approx(none, rel=EXACT)
    assert lorry_rating.full_pressure == pytest.approx(whole, rel=EXACT)
    assert none < 0.9 * lorry_rating.factor < 0.8 * whole
    begin = f"over the pressure of the fill, each at its worst place: {none:.4g} with "
    begin += f"neither active nor passive, {active:.4g} with the active one alone"
    share = "all of the active and up to a third of the passive one"
    end = f", {whole:.4g} with all of it"
    said = without_places(str(lorry_rating))
    assert f"\n{begin}, {lorry_rating.factor:.4g} with {share}{end}\n" in said
    half = replace(lorry_rating, fill=replace(lorry_rating.fill, mobilisation=0.5))
    (line,) = half.describe_pressure()
    assert without_places(line).endswith(f"active and up to 0.5 of the passive one{end}")


@pytest.mark.slow
@pytest.mark.parametrize("area_load", [0.0, 9e3])
def test_other_states_of_the_fill_have_worst_places_of_their_own(area_load, monkeypatch):
    """Against all places: with all of the pressure the axle is worst on the other span."""
    places = np.linspace(1.0, 15.0, 43).tolist()
    monkeypatch.setattr(rating, "_places_along", lambda *_: places)
    bridge = af.bridge(
        arches=[
            af.shapes.Arch(span=5.0, rise=rise, thickness=0.45, voussoirs=9, name=f"{rise}")
            for rise in (1.1, 2.2)
        ],
        piers=[af.shapes.Pier(gap=1.0, height=3.0, course=3.0, name="pier")],
        sidewalls=[
            af.shapes.Sidewall(length=2.0, height=1.5, state="fixed", name=f"{side} wall")
            for side in ("left", "right")
        ],
        backfill=af.shapes.Backfill(cover=0.4),
        width=3.0,
    )
    fill = replace(GRAVEL, backing=0.3)
    vehicle = Vehicle("axle", (1e5,), area_load=area_load)
    found = af.rate(bridge, vehicle, fill=fill, width=3.0)
    states = {
        "without_pressure": {"mobilisation": 0.0, "active": 0.0},
        "full_pressure": {"mobilisation": 1.0},
        "without_backing": {"backing": None},
        "without_either": {"mobilisation": 0.0, "active": 0.0, "backing": None},
        "active_alone": {"mobilisation": 0.0},
        "active_without_backing": {"mobilisation": 0.0, "backing": None},
    }
    for name, changes in states.items():
        given = {"area_load": area_load, "fill": replace(fill, **changes)}
        coarse = af.limit.moving_load(bridge, 1e5, positions=places, **given)
        near = coarse.position + np.linspace(-1.0, 1.0, 41) / 3.0  # 17 mm apart
        expected = af.limit.moving_load(bridge, 1e5, positions=near, **given).worst.factor
        assert getattr(found, name) <= (1.0 + 1e-4) * expected  # beside one place alone
        # with the vehicle at the place that is printed
        x = found.places[name][1]
        there = af.limit.moving_load(bridge, 1e5, positions=[x], **given).worst
        assert getattr(found, name) == pytest.approx(there.factor, rel=1e-4)  # of mirror images
        assert f"{getattr(found, name):.4g} (axle at x = {x:.2f} m)" in str(found)
    assert area_load or abs(found.places["full_pressure"][1] - found.moving.position) > 1.0
    x = found.places["crushing factor"][1]
    assert (
        f"at 5 MPa the least factor is {found.crushing['factor']:.4g} (axle at x = {x:.2f} m)"
        in (found.crushing_text)
    )
    (row, *_) = (row for row in state_ratings([(found, [])]).rows if row.demand == "axle")
    x = found.places["without_pressure"][1]
    part = f"{found.without_pressure:.4g} (axle at x = {x:.2f} m) without the pressure of the fill"
    assert f"; {part}; " in row.outcome
    whole = replace(fill, mobilisation=1.0)
    there = af.collapse_factor(bridge, live=found.moving.worst.live, fill=whole).factor
    assert area_load or there > 1.3 * found.full_pressure


TWO_SPANS = """[structure]
shape = "bridge"
width = 4.0
arches = { thickness = 0.4, voussoirs = 15, span = 5.0, rise = 1.8, a = {}, b = {} }
piers = { breadth = 1.7, height = 2.0, course = 0.5, pier = {} }
sidewalls = { length = 1.0, height = 0.5, above = 0.5, state = "fixed", left = {}, right = {} }
backfill = { cover = 0.1 }
[materials]
stone = { unit_weight = 24e3 }
backfill = { unit_weight = 19e3, young = 20e6 }
"""


@pytest.mark.slow
def test_the_worst_place_may_lie_beside_another_one_than_the_worst_of_the_search(monkeypatch):
    """Against places 12 mm apart: beside the second worst of two the factor is 0.3 % less."""
    bridge = af.Case.of(tomllib.loads(TWO_SPANS)).structure
    lorry = Vehicle("lorry", (60e3, 100e3, 90e3, 90e3, 90e3), (3.0, 5.2, 1.3, 1.3), grade="read")
    coarse = places_along(bridge, af.masonry.standing.parse_axles(lorry.axles, lorry.spacings))
    step = coarse[1] - coarse[0]
    near = [x for x in coarse if min(abs(x - 2.55), abs(x - 9.15)) < 0.3]
    monkeypatch.setattr(rating, "_places_along", lambda *_: near)
    monkeypatch.setattr(worst_places, "_other_states", lambda *_: {})
    found = af.rate(bridge, lorry, fill=GRAVEL, width=4.0)
    given = {"spacings": lorry.spacings, "fill": GRAVEL}
    first, second = (
        af.limit.moving_load(bridge, lorry.axles, positions=at, **given).worst.factor
        for at in (near, near[0] + np.arange(0.0, 5.0 * step, step / 12.0))
    )
    assert found.factor <= (1.0 + 1e-4) * second < 0.997 * first
    assert abs(found.moving.position - 2.55) < step


@pytest.mark.slow
def test_a_narrow_worst_place_is_found(monkeypatch):
    """Against all places: places a fifteenth of the bridge apart are 5 % beside it."""
    shapes = ((7.85, 1.53, 0.591, 11), (6.09, 1.77, 0.377, 7), (4.72, 2.12, 0.406, 7))
    names = ("span", "rise", "thickness", "voussoirs")
    bridge = af.bridge(
        arches=[
            af.shapes.Arch(**dict(zip(names, shape, strict=True)), name=f"arch {k}")
            for k, shape in enumerate(shapes)
        ],
        piers=[
            af.shapes.Pier(gap=gap, height=height, course=height / 2.0, name=f"pier {gap}")
            for gap, height in ((0.91, 2.3), (1.58, 3.7))
        ],
        sidewalls=[
            af.shapes.Sidewall(length=length, height=1.5, state="fixed", name=f"wall {length}")
            for length in (2.69, 1.79)
        ],
        backfill=af.shapes.Backfill(cover=0.52),
        width=3.0,
    )
    fill = af.limit.Fill(friction_angle=36.1, backing=0.224, mobilisation=0.0, active=0.0)
    lorry = Vehicle("lorry", (69e3, 111.6e3), (1.38,), grade="read")
    monkeypatch.setattr(rating, "_places_along", partial(places_along, steps=60))
    monkeypatch.setattr(worst_places, "_other_states", lambda given, _: {"without_pressure": given})
    found = af.rate(bridge, lorry, fill=fill, width=3.0)
    assert found.without_pressure == pytest.approx(found.factor, rel=EXACT)


@pytest.mark.slow
def test_a_plastic_fill_has_the_factors_of_its_pressure_beside_its_own(monkeypatch):
    """Those of a rating with the fill as weight and pressure, of the same strength and backing."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.0, 3.5, 4.0, 5.5, 6.5))
    bridge, vehicle = arch_bridge(voussoirs=9), Vehicle("axle", (1e4,))
    strength = {"friction_angle": 30.0, "cohesion": 5e3, "spread": "5 degree"}
    plastic = af.limit.PlasticFill(gap=0.9, backing_height=0.6, **strength)
    found = af.rate(bridge, vehicle, fill=plastic)
    pressed = af.rate(bridge, vehicle, fill=af.limit.Fill(backing_height=0.6, **strength))
    assert found.by_pressure == pytest.approx(pressed.factor, rel=EXACT)
    for state in STATES:
        assert getattr(found, state) == pytest.approx(getattr(pressed, state), rel=EXACT)
    assert np.isnan(pressed.by_pressure)
    begin = "\nnot as a plastic body, but by the pressure of the fill, each at its worst place: "
    values = f"{found.without_pressure:.4g} with neither active nor passive, "
    assert begin + values in without_places(str(found))
    weak = replace(found, by_pressure=0.99).outcome
    assert weak.startswith("passes only with the fill as a plastic body if the code's")
    assert tabulate_ratings([found]).head[2:4] == ["factor", "by pressure"]
    head = ["factor", "without pressure", "full pressure", "without backing"]
    assert tabulate_ratings([pressed]).head[2:6] == head


@pytest.mark.slow
def test_a_bridge_that_the_fill_holds_has_no_factor_without_it(monkeypatch):
    monkeypatch.setattr(rating, "_places_along", lambda *_: (4.5,))
    found = af.rate(
        arch_bridge(voussoirs=9, rise=2.4, thickness=0.14), Vehicle("axle", (1e4,)), fill=GRAVEL
    )
    assert np.isfinite(found.factor)
    assert np.isnan(found.without_pressure)
    words = "place: none, as the bridge does not stand, with neither active nor passive"
    assert words in str(found)


@pytest.mark.slow
def test_places_of_axles_are_of_the_span_that_is_loaded(monkeypatch):
    """Of many axles the first and the last, and only those that stand on the structure."""
    arches = [
        af.shapes.Arch(span=4.0, rise=1.5, thickness=0.4, voussoirs=5, name=f"{side} arch")
        for side in ("left", "right")
    ]
    pier = af.shapes.Pier(gap=1.0, height=1.0, course=0.5, name="pier")
    bridge = af.bridge(arches=arches, piers=[pier])
    inner = [joint.intrados[0] for joint in bridge.joints if joint.part == "right arch"]
    monkeypatch.setattr(rating, "places_at_ends", lambda *_: [])
    monkeypatch.setattr(rating, "_places_along", lambda *_: (min(inner) + 1.0,))
    found = af.rate(bridge, Vehicle("axles", (1e3,) * 9, (0.2,) * 8))
    first, last = min(inner) + 0.2, min(inner) + 1.8
    assert f"with 9 axles over 'right arch' at x = {first:.2f} to {last:.2f} m, " in repr(found)
    # an axle in front, on the other arch, takes no part
    found = af.rate(bridge, Vehicle("tractor", (1e3, 50e3, 50e3), (4.0, 1.0)))
    (fails,) = {bridge.joints[k].part for k, _ in found.moving.worst.hinges}
    assert len(found.moving.worst.live) == 3
    assert f"with 2 axles of 3 over '{fails}' at x = " in repr(found)
    sense = 1.0 if found.moving.direction == "right" else -1.0
    tractor = found.moving.position + 2.5 * sense
    assert f" springing (the other at {tractor:.2f} m), " in repr(found)
    unlike = af.rate(bridge, Vehicle("lorry", (60e3, 115e3), (0.5,)))
    loads = "60 and 115" if unlike.moving.direction == "left" else "115 and 60"
    assert f"with 2 axles ({loads} kN) over " in repr(unlike)
    monkeypatch.setattr(rating, "_places_along", lambda *_: (min(inner) - 20.0,))
    found = af.rate(bridge, Vehicle("long", (1e3, 1e3, 1e3), (2.0, 40.0)))
    assert f"with 1 axle of 3 over 'right arch' at x = {min(inner) + 1.0:.2f} m" in repr(found)


def test_a_verdict_says_which_parts_of_the_fill_it_rests_on(lorry_rating):
    """The factor without the pressure, or without the backing, is below 1 or none."""
    lorry_rating = replace(lorry_rating, crushing={}, by_cs454={})
    assert lorry_rating.outcome.startswith("passes if")
    soft = replace(lorry_rating, without_pressure=0.99)
    assert soft.outcome.startswith("passes only with the pressure of the fill if")
    passive = replace(lorry_rating, active_alone=0.99)
    assert passive.outcome.startswith("passes only with the passive pressure of the fill if")
    assert passive.list_losses()[0] == (0.99, "with the active pressure of the fill alone")
    fill = {"fill": replace(GRAVEL, backing=0.5), "active_without_backing": 1.02}
    backed = replace(soft, **fill, without_backing=np.nan)
    words = "passes only with the pressure of the fill and the backing"
    assert backed.outcome.startswith(words)
    without = "\nwithout the backing but with the pressure, each at its worst place: "
    alone = "with the active one alone: 1.02; without either: "
    assert f"{without}the bridge does not stand; {alone}" in str(backed)
    either = replace(lorry_rating, **fill, without_backing=1.01, without_either=0.8)
    assert either.outcome.startswith("passes only with the pressure of the fill or the backing if")
    assert f"{without}1.01; {alone}0.8\n" in str(either)
    # with neither it is the least, and may be far below that without one of them
    least = replace(either, without_either=1.005, full_pressure=np.inf)
    assert least.outcome.startswith("passes if")
    assert "; the factor is 1.005 to inf over what is assumed of the fill" in least.outcome
    assert least.least == 1.005
    assert replace(least, without_pressure=np.nan).least == 0.0
    alone = replace(least, full_pressure=np.nan)
    assert alone.least == alone.factor
    none = replace(least, without_pressure=np.nan, full_pressure=7.5).outcome
    assert "; the factor is none to 7.5 over what is assumed of the fill" in none
    assert "over what is assumed" not in replace(least, full_pressure=np.nan).outcome


@pytest.mark.parametrize(
    ("given", "noted"),
    [
        ({"mobilisation": 0.14}, True),
        ({"mobilisation": 0.15}, False),
        ({"mobilisation": 0.0}, True),
        ({"mobilisation": 0.0, "active": 0.0}, False),
    ],
)
def test_a_mobilisation_below_the_active_pressure_is_noted(lorry_rating, given, noted):
    """Of 27° the active pressure is 1 / K_p² = 0.141 of the passive one."""
    other = af.limit.Fill(friction_angle=27.0, **given)
    given_fill = replace(lorry_rating, fill=other, by_cs454={})
    notes = doubt_rating(given_fill, LimitAnalysis([], "coulomb", 1e7))
    words = f"note: mobilisation {given['mobilisation']:.2g} counts as 0.14, the active pressure"
    assert any(note.startswith(words) for note in notes) == noted
    assert notes[-1].startswith("note: left out: a second lorry that meets the vehicle")


@pytest.mark.slow
def test_a_rating_with_backing_has_the_factor_without_it(monkeypatch):
    monkeypatch.setattr(rating, "_places_along", lambda *_: (6.5,))
    backed, axle = replace(GRAVEL, backing=0.6), Vehicle("axle", (1e4,))
    found = af.rate(arch_bridge(voussoirs=9), axle, fill=backed)
    plain = af.rate(arch_bridge(voussoirs=9), axle, fill=GRAVEL)
    assert found.without_backing == pytest.approx(plain.factor, rel=EXACT)
    assert found.without_either == pytest.approx(plain.without_pressure, rel=EXACT)
    assert found.factor > 1.02 * plain.factor
    assert np.isnan(plain.without_backing)


@pytest.mark.parametrize(
    ("vehicle", "given", "missing"),
    [
        ("own", {}, "live × impact"),
        pytest.param("own", {"live": 1.5}, "impact", marks=pytest.mark.slow),
        pytest.param("own", {"impact": 1.3}, "live", marks=pytest.mark.slow),
        pytest.param("own", {"live": 1.5, "impact": 1.3}, "", marks=pytest.mark.slow),
        pytest.param("own", {"live": 1.1, "impact": 1.0}, "", marks=pytest.mark.slow),
        pytest.param("alone", {}, "", marks=pytest.mark.slow),
        pytest.param("by span", {"live": 1.45}, "impact", marks=pytest.mark.slow),
        pytest.param("LM2", {}, "", marks=pytest.mark.slow),
    ],
)
def test_a_vehicle_without_factors_passes_on_a_condition(vehicle, given, missing):
    """Those of LM2 are in its weights, and the one of LM71 depends on the span."""
    stone = column_under_axle(width=10.0)
    own, light = Vehicle("axle", (10e3,)), VEHICLES["LM2"]
    alone = replace(own, live=1.0, impact=1.0)
    by_span = replace(own, impact_source=VEHICLES["LM71"].impact_source)
    driven = {"own": own, "by span": by_span, "LM2": light, "alone": alone}[vehicle]
    found = af.rate(stone, replace(driven, wheels=10.0, lane=10.0), dead=10.0, **given)
    condition = f" if the code's {missing} is at most {found.factor:.4g}" if missing else ""
    assert f"(the vehicle's middle), passes{condition}; the factor is" in repr(found)
    (live, impact) = (line for line in str(found).splitlines() if line[:6] in ("live l", "impact"))
    assert ("(none" in live) == ("live" in missing)
    assert ("(none" in impact) == ("impact" in missing)


@pytest.mark.slow
def test_bare_axles_have_multiples_of_their_factor_by_eurocodes():
    stone, lorry = column_under_axle(width=2.0), Vehicle("lorry", (50e3, 40e3), (0.3,))
    factors = {"live": 1.1, "impact": 1.0}
    bare, given = (af.rate(stone, lorry, width=1.0, **each) for each in ({}, factors))
    name = "alone at walking pace (1.1 × 1, from memory)"
    (own,) = (x for key, x in bare.by_codes.items() if key == name)
    assert own.factor == pytest.approx(given.factor, rel=EXACT)
    assert own.outcome == given.outcome  # with the end of the range
    assert f"lorry {name}: factor {own.factor:.4g}, {own.outcome}" in bare.describe_codes()


@pytest.mark.slow
def test_factors_of_codes_are_stated_with_outcome_and_range(monkeypatch):
    """Against ratings with these factors; those of CS 454 search the axle that has the impact."""
    monkeypatch.setattr(rating, "_places_along", partial(places_along, steps=10))
    bridge, fill = (
        arch_bridge(width=3.0, voussoirs=9),
        replace(GRAVEL, mobilisation=0.5, backing=0.6),
    )
    lorry = Vehicle("lorry", (60e3, 115e3, 80e3), (2.2, 1.3), live=1.35, impact=1.4)
    on_worst_axle = replace(lorry, live=1.9, impact=1.8, impact_on="worst axle")
    given, bare, good, alone, by_cs454 = (
        af.rate(bridge, each, fill=fill, **factors)
        for each, factors in (
            (lorry, {}),
            (replace(lorry, live=None, impact=None), {}),
            (lorry, {"impact": 1.2}),
            (lorry, {"live": 1.1, "impact": 1.0}),
            (on_worst_axle, {}),
        )
    )
    names = ("by Eurocodes on a good road (1.35 × 1.2, from memory)",)
    names += ("by Eurocodes on a fair road (1.35 × 1.4, from memory)",)
    names += ("alone at walking pace (1.1 × 1, from memory)",)
    expected = dict(zip(names, (good, given, alone), strict=True))
    code = "by CS 454 (1.9, and 1.8 on the worst axle, from memory)"
    for found in (bare, given, good, alone):
        assert [*found.by_codes] == [*names, code]
        for name, other in expected.items():
            own = found.by_codes[name]
            assert own.factor == pytest.approx(other.factor, rel=EXACT)
            assert own.outcome == other.outcome  # with the ends of the range
    least = f"{alone.crushing['without_either']:.4g} to {alone.full_pressure:.4g} over what is"
    assert least in bare.by_codes[names[2]].outcome
    # in each state of fill and stones, by the nearest bounds alone
    states = (
        "without_pressure",
        "active_alone",
        "full_pressure",
        "without_backing",
        "without_either",
    )
    for state in ("factor", "crushing", *states):
        assert given.by_cs454[state] == pytest.approx(getattr(by_cs454, state), rel=1e-3), state
    of_code = given.by_codes[code]
    assert of_code.factor == given.by_cs454["factor"]
    assert of_code.short_outcome == by_cs454.short_outcome
    ends = f"is {given.by_cs454['crushing']['without_either']:.4g} to "
    assert f"{ends}{given.by_cs454['full_pressure']:.4g} over" in of_code.outcome
    assert by_cs454.factor < 0.7 * bare.factor / 1.9  # the impact counts
    factors = f"bare axles {bare.factor:.4g}, live × impact 1.89 given"
    codes = given.by_codes.items()
    lines = [f"lorry {name}: factor {x.factor:.4g}, {x.outcome}" for name, x in codes]
    assert given.describe_codes() == [factors, *lines]
    assert bare.describe_codes()[0].startswith(f"lorry {names[0]}: factor ")
    assert [*by_cs454.by_codes] == [code]  # for Eurocodes another axle may be the worst
    rows, sentences = state_ratings([(given, [])])[1::-1]
    outcome, *others = given.clauses
    first = f"rating for lorry: factor {given.factor:.4g} without crushing, {outcome}"
    expected = [first, f"worst {given.place}", *others, factors, *lines]
    assert sentences[: len(expected)] == expected
    # the worst first, each with its range over fill and stones
    stated = [("lorry", given, f"{given.short_outcome}, {given.place}")]
    stated += [(f"lorry {name}", x, x.short_outcome) for name, x in codes]
    losses = [x.say_losses() for _, x, _ in stated]
    for (_, x, _), said in zip(stated, losses, strict=True):
        known = [f"{factor:.4g} {of}" for factor, of in x.list_losses()]
        assert [*map(without_places, said)] == known
    stated = [
        (name, x, "; ".join([y, *of])) for (name, x, y), of in zip(stated, losses, strict=True)
    ]
    least = f"; {given.by_cs454['crushing']['without_either']:.4g} if stones also crush at 5 MPa"
    assert least in without_places(str(rows))
    state = "without the pressure of the fill, without the backing, if stones also crush at 5 MPa"
    assert {row.numbers["state"] for row in rows} == {state}
    assert [row.numbers["least"] for row in rows] == sorted(x.least for _, x, _ in stated)
    assert [row[:4] for row in rows] == [
        ("rating", name, words, f"{x.factor:.4g}")
        for name, x, words in sorted(stated, key=lambda each: each[1].factor)
    ]
    # a property that takes a third of the factor away takes it from each multiple
    weak = (
        ["abutments free", f"{given.factor / 1.5:.6g}"],
        ["stronger", f"{9.0 * given.factor:.6g}"],
    )
    varied = ResultTable(["lorry with", "factor"], [*weak, ["on a pier", "-"]])
    for row in state_ratings([(given, [])], varied).rows:
        x = next(x for name, x, _ in stated if name == row.demand)
        flips = 1.0 <= x.factor < 1.5 and "CS 454" not in row.demand
        fails = f"; fails with abutments free ({x.factor / 1.5:.3g})"
        assert ("fails with" in row.outcome) == row.outcome.endswith(fails) == flips
    # the worst of each property at once is less than all that is assumed; of CS 454 it has a row
    at_once = ["all unfavourable at once", f"{0.1 * given.factor:.6g}"]
    worst = varied._replace(rows=[at_once, ["all unfavourable at once, by CS 454", "0.0123"]])
    numbers = [x.numbers for x in state_ratings([(given, [])], worst).rows if "CS" in x.demand]
    assert numbers == [{"passes": bool(by_cs454.passes), "least": 0.0123, "state": at_once[0]}]
    for row in state_ratings([(given, [])], varied._replace(rows=[at_once])).rows:
        x = next(x for name, x, _ in stated if name == row.demand)
        by_axle = "CS 454" in row.demand
        assert row.numbers["least"] == pytest.approx(
            x.least if by_axle else 0.1 * x.factor, rel=1e-5
        )
        unknown = f"{state}, {at_once[0]} not computed"
        assert row.numbers["state"] == (unknown if by_axle else at_once[0])
    # the impact is not on a distributed load, so that no multiple of the factor is that of a code
    assert [*replace(given, area_load=1e3).by_codes] == [code]
    assert not replace(given, vehicle=VEHICLES["LM2"], by_cs454={}).by_codes


@pytest.mark.slow
@pytest.mark.parametrize(("area_load", "searches"), [(0.0, 1), (9e3, 2)])
def test_one_axle_has_multiples_of_its_factors_by_cs454(area_load, searches, monkeypatch):
    """Without a distributed load, against a rating with 1.9 and 1.8; with one it is searched."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.0, 4.0))
    search, seen = rating.find_least_factors, []

    def find_least_factors(*given):
        seen.append(given)
        return search(*given)

    monkeypatch.setattr(rating, "find_least_factors", find_least_factors)
    bridge, fill = arch_bridge(voussoirs=9), replace(GRAVEL, backing=0.2)
    axle = Vehicle("axle", (5e4,), live=1.2, impact=1.1, area_load=area_load)
    found = af.rate(bridge, axle, fill=fill)
    assert len(seen) == searches
    assert (len(found.by_cs454) > 0) == (searches == 2)
    code = af.rate(bridge, replace(axle, live=1.9, impact=1.8, grade="read"), fill=fill)
    of_code = [x for by, x in found.by_codes.items() if by.startswith("by CS 454 (1.9, and 1.8 ")]
    (of_code,) = of_code
    assert of_code.factors | {"geometric": 0.0} == pytest.approx(
        code.factors | {"geometric": 0.0}, rel=1e-3
    )
    assert of_code.crushing == pytest.approx(code.crushing, rel=1e-3)


def test_the_impact_on_a_train_follows_from_half_the_least_span():
    """1.67 at most (EN 1991-2, 6.4.5.2)."""
    for span, impact in ((12.0, 1.44 / (6.0**0.5 - 0.2) + 0.82), (3.0, 1.67)):
        arch = af.shapes.Arch(span=span, rise=span / 4.0, thickness=0.5, voussoirs=9)
        bridge = af.bridge(arches=[arch], width=3.0)
        ((name, product),) = VEHICLES["LM71"].list_products(bridge, 1.45, ["impact"]).items()
        assert name.startswith(f"with impact {impact:.3g} (by half the span, {span / 2.0:g} m; ")
        assert product == pytest.approx(1.45 * impact)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("span", "impact"),
    [(6.0, 1.44 / (3.0**0.5 - 0.2) + 0.82), (3.0, 1.67)],
)
def test_the_impact_on_a_train_is_that_of_half_the_span(span, impact, monkeypatch):
    """1.67 at most (EN 1991-2, 6.4.5.2): against a rating with it."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.5,))
    arch = af.shapes.Arch(span=span, rise=span / 4.0, thickness=0.5, voussoirs=9)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4), width=3.0)
    found = af.rate(bridge, "LM71", fill=GRAVEL, strength=10e6)
    ((name, by_span),) = found.by_codes.items()
    half = f"{span / 2.0:g} m; from memory"
    assert name == f"with impact {min(impact, 1.67):.3g} (by half the span, {half})"
    other = af.rate(bridge, "LM71", fill=GRAVEL, strength=10e6, impact=min(impact, 1.67))
    assert by_span.factor == pytest.approx(other.factor, rel=EXACT)
    assert by_span.outcome == other.outcome
    factor, outcome = by_span.factor, by_span.outcome
    assert not other.by_codes
    assert found.describe_codes() == [f"LM71 {name}: factor {factor:.4g}, {outcome}"]


@pytest.mark.slow
def test_abutments_that_cannot_move_are_noted(monkeypatch):
    """Those with courses of their own are not, nor a ring on free blocks."""
    arch = af.shapes.Arch(span=5.0, rise=1.25, thickness=0.5, voussoirs=9)
    limit = parse_limit({"strength": "none"})
    monkeypatch.setattr(rating, "_places_along", lambda *_: (2.5,))
    for state in ("fixed", "free", None):
        walls = [af.shapes.Sidewall(length=2.0, height=1.0, state=state or "free")] * 2
        walls = [replace(wall, name=side) for wall, side in zip(walls, "ab", strict=True)]
        bridge = af.bridge(arches=[arch], sidewalls=walls if state else [], width=3.0)
        found = af.rate(bridge, Vehicle("axle", (50e3,)), strength=np.inf)
        assert not found.crushing  # it was said that stones do not crush
        assert found.least == found.factor
        note = 'abutments are taken as immovable: state = "free" tests them'
        assert (note in str(doubt_rating(found, limit))) == (state != "free")


def test_pictures_and_tables_name_the_factors_that_are_missing(lorry_rating):
    given = replace(lorry_rating, missing=())
    name = given.vehicle.name
    for missing, words, column in (
        (("live", "impact"), ", without partial factors", "none × none"),
        (("impact",), ", without impact", f"{given.live:g} × none"),
        ((), "", f"{given.live:g} × {given.impact:g}"),
    ):
        found = replace(given, missing=missing)
        assert found.label == f"{name}{words}"
        assert tabulate_ratings([found]).rows[0][1] == column
        figure = draw_ratings([found, given])
        assert figure.axes[0].get_legend().get_texts()[0].get_text() == f"{name}{words}"


@pytest.mark.slow
def test_an_axle_that_loads_no_ring_does_not_count(monkeypatch):
    """One behind the springing stands on the fill over the abutment alone, and changes nothing."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (3.5, 4.5))
    bridge = arch_bridge(voussoirs=9)
    alone = af.rate(bridge, Vehicle("axle", (5e4,)), fill=GRAVEL)
    x = alone.moving.position
    far = 8.9 if x < 4.5 else 8.99
    lorry = Vehicle("lorry", (5e4, 5e4), (far - x,))
    monkeypatch.setattr(rating, "_places_along", lambda *_: (0.5 * (x + far),))
    found = af.rate(bridge, lorry, fill=GRAVEL)
    assert found.factor == pytest.approx(alone.factor, rel=1e-3)
    assert float(found.moving.factors["axles"].max()) == 2.0  # it is on the bridge
    clear = f"{x - CLEAR_FROM:.2f} m from the left clear springing"
    assert f"with 1 axle of 2 at x = {x:.2f} m, {clear} (the other at {far:.2f} m)" in repr(found)


@pytest.mark.slow
def test_a_bridge_that_is_too_weak_would_carry_with_deeper_joints():
    ring = af.circular_arch(radius=2.95, thickness=0.45, embrace=140.0, voussoirs=5)
    slides = af.rate(ring, "lm1")
    assert not slides.passes
    assert np.isnan(slides.geometric)
    none = "none, joints of any depth do not carry the vehicle there"
    assert f"{none}, but slide at {slides.deepest:.4g} of it" in str(slides)
    # a vehicle of the weight at which the deepest joints slide is the heaviest that depth helps
    light, heavy = (
        af.rate(ring, "lm1", live=1.35 * part * slides.deepest) for part in (0.99, 1.01)
    )
    assert 0.0 < light.geometric < 1.0
    assert np.isnan(heavy.geometric)
    assert heavy.deepest == pytest.approx(1.0 / 1.01, rel=1e-6)
    found = af.rate(ring, "lm1", friction=None)
    assert found.factor < 1.0
    assert not found.passes
    assert found.geometric < 1.0
    assert f"below 1: joints are too thin by {100.0 * (1.0 - found.geometric):.2g} %" in str(found)


@pytest.mark.slow
def test_impact_multiplies_the_vehicle():
    ring = af.circular_arch(radius=2.95, thickness=0.45, embrace=140.0, voussoirs=9)
    own, doubled = (Vehicle("axle", (1e4,), impact=i, impact_source="ours") for i in (1.0, 2.0))
    still, moving = af.rate(ring, own), af.rate(ring, doubled)
    assert moving.factor == pytest.approx(0.5 * still.factor, rel=1e-6)
    assert af.rate(ring, doubled, impact=1.0).factor == pytest.approx(still.factor, rel=1e-6)
    assert "impact by 2 (ours)" in str(moving)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"vehicle": "LM9"}, "is not known: use one of LM1, LM2"),
        ({"vehicle": 3}, "vehicle"),
        ({"live": 0.0}, "live, factor on the vehicle"),
        ({"dead": -1.0}, "dead, factor on the weights"),
        ({"width": 7.0}, "up to that of the bridge"),
        ({"width": 0.0}, "up to that of the bridge"),
        ({"area_load": -1.0}, "area_load"),
        ({"structure": 3}, "structure"),
        ({"fill": None}, "softer than the joints"),
    ],
)
def test_invalid_input_is_refused(given, says):
    options = {"structure": arch_bridge(voussoirs=7), "vehicle": "LM1", "fill": GRAVEL} | given
    with pytest.raises(af.InvalidInput, match=says):
        af.rate(**options)


def test_a_vehicle_needs_weights_and_spacings():
    with pytest.raises(af.InvalidInput, match="one between each two axles"):
        Vehicle("lorry", (1e5, 1e5))
    with pytest.raises(af.InvalidInput, match="partial factor on the live load of lorry"):
        Vehicle("lorry", (1e5,), live=-1.0)
    with pytest.raises(af.InvalidInput, match="lane of lorry"):
        Vehicle("lorry", (1e5,), lane=-1.0)


@pytest.mark.parametrize(
    "given",
    [
        {"axles": (60.0, 115.0), "spacings": (3.2,)},  # kN
        {"axles": (60e3, 115e3), "spacings": (3200.0,)},  # mm
        {"axles": (60e3,), "area_load": 9.0},  # kPa
        {"axles": (60e3,), "wheels": 1500.0},  # mm
    ],
)
def test_vehicles_of_wrong_units_are_refused(given):
    Vehicle("unit load", (1.0, 1.0), spacings=(3.2,))
    with pytest.raises(af.InvalidInput, match=r"'lorry' .* can only be a wrong unit"):
        Vehicle("lorry", **given)


@pytest.mark.slow
def test_the_worst_place_on_a_fill_is_found_between_the_places_of_the_search(monkeypatch):
    """Against places 5 mm apart, and on a longer road, of which other places are searched."""
    monkeypatch.setattr(rating, "_places_along", places_along)
    lorry = Vehicle("lorry", (58.86e3, 98.1e3), (1.35,), grade="read")
    options = {"fill": GRAVEL, "strength": np.inf}
    arch, found = af.shapes.Arch(span=7.2, rise=2.1, thickness=0.55, voussoirs=13), []
    for length in (2.0, 6.0):
        walls = [
            af.shapes.Sidewall(length=length, height=0.5, above=0.3, state="fixed", name=side)
            for side in ("left", "right")
        ]
        cover = af.shapes.Backfill(cover=0.35)
        bridge = af.bridge(arches=[arch], sidewalls=walls, backfill=cover, width=3.0)
        found.append(af.rate(bridge, lorry, width=3.0, **options))
    first, second = found
    step = np.ptp(first.structure.blocks[-1].points[:, 0]) / 100.0
    near = first.moving.position + np.arange(-step, step, 0.005)
    given = options | {"spacings": lorry.spacings, "positions": near}
    dense = af.limit.moving_load(first.structure, lorry.axles, **given)
    assert first.factor == pytest.approx(dense.worst.factor, rel=1e-4)  # half of a fourth digit
    for name in ("factor", "without_pressure", "full_pressure"):
        values = getattr(first, name), getattr(second, name)
        assert values[0] == pytest.approx(values[1], rel=1e-4)
    coarse = places_along(second.structure, np.array([[1.0, 0.675], [1.0, -0.675]]))
    assert second.factor < (1.0 - 1e-3) * np.nanmin(second.moving.factors_at(coarse))


def test_a_rating_says_by_how_much_elastic_joints_would_close():
    """A strut of three joints by hand: Σ N/(k_n A), of 300 kN on 0.5 m × 2 m and 1 MPa/mm."""
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=60.0, voussoirs=2, width=2.0)
    thrusts = np.full(len(ring.joints), 300e3)
    usual = describe_closing(thrusts, ring)
    own = replace(af.masonry.STONE_TO_STONE, normal_stiffness=1e9)
    given = describe_closing(
        thrusts,
        af.circular_arch(
            radius=3.0, thickness=0.5, embrace=60.0, voussoirs=2, width=2.0, contact=own
        ),
    )
    assert len(ring.joints) == 3
    assert given.endswith("with k_n 1 MPa/mm the thrust shortens it by 0.9 mm")
    by = f"{3 * 300 / 1.48e3:.2g}"
    assert usual.endswith(f"with k_n 1.48 MPa/mm (default) the thrust shortens it by {by} mm")


def test_a_rating_notes_that_joints_are_rigid(lorry_rating):
    assert "joints are rigid; elastic ones close" in str(lorry_rating)
    notes = [str(each) for each in doubt_rating(lorry_rating, LimitAnalysis((), None))]
    assert any(RIGID_JOINTS in each for each in notes)


@pytest.mark.slow
def test_elastic_joints_and_large_displacements_bear_less_than_rigid_ones():
    """Equilibrium of another formulation: a tenth at least is lost, and 0.3 remain."""
    arch = af.shapes.Arch(span=5.0, rise=1.25, thickness=0.45, voussoirs=25)
    walls = [
        af.shapes.Sidewall(length=3.0, height=0.3, above=0.3, state="fixed", name=f"{side} wall")
        for side in ("left", "right")
    ]
    contact = af.Contact(14.8e9, 6.4e9, friction=0.6)
    ring = af.bridge(arches=[arch], sidewalls=walls, width=4.5, contact=contact)
    live = [af.PointLoad(x=4.0, force=(0.0, -100e3))]
    rigid = af.collapse_factor(ring, live=live, strength=np.inf).factor
    model = af.Analysis(ring, fidelity="rigid", displacements="large").model
    stop = af.statics.Stop(displacement=0.1)
    elastic = af.pushover(model, live, control="path", stop=stop).factor
    assert 0.3 < elastic / rigid < 0.9
