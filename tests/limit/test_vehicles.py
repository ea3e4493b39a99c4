"""A vehicle over a bridge: each place against the collapse of its axles there."""

import itertools
from functools import cache
from types import SimpleNamespace

import backfilled
import numpy as np
import pytest
from backfilled import SOIL, fill_of
from repeats import each_once

import archfem as af
from archfem.limit import linear_programme, vehicles
from archfem.limit.linear_programme import Programme
from archfem.limit.self_weight import self_weight_programme
from archfem.limit.vehicles import (
    _find_worst,
    _search_nonassociated,
    collapse_factors,
    find_worst_rows,
)

EXACT = 1e-6
"""Relative: the programme is solved to 1e-9 block weights, corners count as one within 1e-6."""

GRAVEL = af.limit.Fill(friction_angle=35.0)
CLAYEY = af.limit.Fill(friction_angle=30.0, cohesion=5e3)
LORRY = ([60e3, 115e3, 80e3], [3.2, 1.3])
FEW = np.linspace(-1.0, 10.0, 23)


def ring(**given):
    return af.circular_arch(
        **{"radius": 2.95, "thickness": 0.45, "embrace": 140.0, "voussoirs": 11} | given
    )


@cache
def arch_bridge(**given):
    """A bridge of seven stones, which many tests look at."""
    return backfilled.arch_bridge(**{"voussoirs": 7} | given)


def over(structure, axles, spacings=(), **given):
    return af.moving_load(structure, axles, spacings=spacings, **given)


@pytest.mark.parametrize(
    "fill", [pytest.param(GRAVEL, marks=pytest.mark.slow), None], ids=["fill", "bare"]
)
def test_a_symmetric_bridge_is_as_strong_from_either_side(fill):
    structure = arch_bridge(cover=0.3 if fill else None)
    middle = structure.blocks[0].points[:, 0].min() / 2 + max(
        block.points[:, 0].max() / 2 for block in structure.blocks
    )
    reach = np.linspace(-4.1, 4.1, 21)
    found = over(structure, *LORRY, positions=middle + reach, fill=fill).factors["factor"]
    right, left = found.sel(direction="right").values, found.sel(direction="left").values
    assert np.isfinite(right).sum() > 8
    np.testing.assert_allclose(right, left[::-1], rtol=EXACT)
    assert (right != right[::-1]).any()  # the lorry is not symmetric


@pytest.mark.parametrize(("fill", "direction"), each_once((GRAVEL, None), ("right", "left")))
def test_each_place_is_a_row_of_point_loads(fill, direction):
    structure = arch_bridge(cover=0.3 if fill else None)
    sense = 1.0 if direction == "right" else -1.0
    places = [2.9, 3.6, 4.4]
    found = over(structure, *LORRY, positions=places, fill=fill).factors
    for place in places:
        front = place + sense * 2.25
        axles = zip(LORRY[0], (front, front - sense * 3.2, front - sense * 4.5), strict=True)
        low, high = (0.0, 9.0) if fill else (1.9, 7.1)
        live = [af.PointLoad(x, (0.0, -weight)) for weight, x in axles if low < x < high]
        expected = af.collapse_factor(structure, live=live, fill=fill).factor
        here = found.sel(direction=direction, position=place)
        assert int(here["axles"]) == len(live)
        assert float(here["factor"]) == pytest.approx(expected, rel=EXACT)


@pytest.mark.slow
def test_sliding_flat_is_searched_from_place_to_place(monkeypatch):
    """Results are as weak as by the whole search at each place, in a fifth of its programmes."""
    solved, solve = [], Programme.solve
    monkeypatch.setattr(
        Programme, "solve", lambda self, **how: solved.append(self) or solve(self, **how)
    )
    slick = af.Contact(1.48e9, 0.3e9, 0.3)
    structure, places = ring(voussoirs=9, contact=slick), np.linspace(-2.0, 2.0, 9)
    found = over(structure, 60e3, positions=places, friction="nonassociated")
    swept = len(solved)
    whole = [
        af.collapse_factor(
            structure, live=af.PointLoad(place, (0.0, -60e3)), friction="nonassociated"
        ).factor
        for place in places[2:4]
    ]
    each = (len(solved) - swept) / len(whole)
    factors = found.factors["factor"].sel(direction="right").values
    assert factors[2:4] == pytest.approx(whole, rel=EXACT)
    assert factors == pytest.approx(factors[::-1], rel=1e-4)
    assert found.worst.factor == pytest.approx(factors.min(), rel=EXACT)
    assert swept < each * (1.0 + len(places) / 5.0)  # the worst place by the whole search, too


@pytest.mark.slow
def test_the_worst_place_is_that_of_the_least_factor():
    structure = arch_bridge(voussoirs=5)
    found = over(structure, *LORRY, fill=GRAVEL)
    least = float(found.factors["factor"].min())
    here = found.factors["factor"].sel(direction=found.direction, position=found.position)
    # of places that differ by rounding, as on this symmetric bridge, the first is the worst
    assert float(here) == pytest.approx(least, rel=EXACT)
    assert least == pytest.approx(found.worst.factor, rel=EXACT)
    assert found.worst.outcome is af.limit.Outcome.COLLAPSES
    ends = np.ptp([x for k in structure.free for x in structure.blocks[k].points[:, 0]])
    assert np.diff(found.factors["position"]).max() <= (1.0 + EXACT) * ends / 100.0
    assert f"driving {found.direction}" in str(found)
    assert len(found.worst.hinges) == 4


@pytest.mark.slow
def test_by_default_no_place_nearby_is_worse_on_bare_stones():
    """Where an axle stands at an end of a stone, the factor jumps."""
    ring = arch_bridge(cover=None)
    found = over(ring, *LORRY)
    step = float(np.diff(found.factors["position"]).max())
    around = np.linspace(found.position - step, found.position + step, 81)
    nearby = float(over(ring, *LORRY, positions=around).factors["factor"].min())
    assert nearby > (1.0 - 1e-4) * found.worst.factor


def test_where_nothing_is_too_much_the_worst_place_has_most_axles():
    count = np.array([[1, 2, 0], [2, 3, 1]])
    assert _find_worst(np.full((2, 3), np.inf), count) == (1, 1)
    assert _find_worst(np.array([[np.inf, 3.0, 2.0], [np.inf, np.inf, 4.0]]), count) == (0, 2)


@pytest.mark.slow
def test_the_vehicle_enters_and_leaves():
    found = over(arch_bridge(), *LORRY, fill=GRAVEL).factors
    axles, factors = found["axles"].values, found["factor"].values
    assert set(np.unique(axles)) == {1, 2, 3}  # of the last axle that leaves, too
    assert (axles[:, [0, -1]] == 1).all()
    assert (factors[:, [0, -1]] == np.inf).all()
    assert float(found["position"][0]) == pytest.approx(-2.25)
    assert float(found["position"][-1]) == pytest.approx(9.0 + 2.25, abs=0.1)


def test_one_axle_has_no_direction():
    found = over(arch_bridge(), 1e5, positions=FEW, fill=GRAVEL).factors["factor"]
    np.testing.assert_array_equal(found[0], found[1])


def test_two_axles_on_one_spot_are_one():
    given = {"positions": FEW[::3], "fill": GRAVEL}
    one = over(arch_bridge(), 1e5, **given).factors["factor"]
    two = over(arch_bridge(), [4e4, 6e4], [1e-7], **given).factors["factor"]
    np.testing.assert_allclose(two, one, rtol=1e-5)  # they are 1e-7 m apart


@pytest.mark.slow
def test_twice_the_weight_has_half_the_factor():
    once, twice = (
        over(arch_bridge(), [k * w for w in LORRY[0]], LORRY[1], positions=FEW[::3], fill=GRAVEL)
        for k in (1.0, 2.0)
    )
    np.testing.assert_allclose(once.factors["factor"], 2.0 * twice.factors["factor"], rtol=EXACT)


def test_an_influence_line_of_four_hinges():
    """By the kinematic theorem no place has a factor above what the worst mechanism gives there."""
    structure = ring()
    found = over(structure, 1e4, positions=np.linspace(-2.9, 2.9, 71), friction=None)
    worst = found.worst
    work = worst.factor * descent(structure, worst.motion, found.position)
    bounded = 0
    for place, factor in zip(
        found.factors["position"].values[3:-3], found.factors["factor"].values[0, 3:-3], strict=True
    ):
        sink = descent(structure, worst.motion, place)
        if sink > 1e-9:
            assert factor <= work / sink * (1.0 + EXACT)
            bounded += 1
    assert bounded > 20


def descent(structure, motion, x):
    """How fast the road sinks at x [m/s]."""
    number, point = af.PointLoad(x, (0.0, -1.0)).place(structure)
    _, v, turn = motion[number]
    return -v - turn * (point[0] - structure.blocks[number].centroid[0])


@pytest.mark.slow
@pytest.mark.parametrize("fill", [GRAVEL, None], ids=["fill", "bare"])
def test_a_distributed_load_stands_on_the_worst_of_all_sets_of_strips(fill, monkeypatch):
    """Against each of the 2**5 sets of strips, solved one by one with the axles."""
    monkeypatch.setattr(vehicles.cut_road, "__defaults__", (5,))
    structure, weight = arch_bridge(cover=0.3 if fill else None), 20e3
    strips = vehicles.cut_road(structure, weight)
    corners = np.concatenate([structure.blocks[n].drawn() for n in structure.free])[:, 0]
    total = sum(load.force[1] for load in strips)
    assert total == pytest.approx(-weight * np.ptp(corners))
    places = [2.6]
    found = over(structure, [60e3], positions=places, area_load=weight, fill=fill).factors
    for place in places:
        axle = af.PointLoad(place, (0.0, -60e3))
        sets = itertools.product((False, True), repeat=len(strips))
        factors = [
            af.collapse_factor(structure, live=[axle, *itertools.compress(strips, s)], fill=fill)
            for s in sets
        ]
        least = min(factors, key=lambda each: each.factor)
        here = found.sel(direction="right", position=place)
        assert float(here["factor"]) == pytest.approx(least.factor, rel=EXACT)
        alone, everywhere = factors[0].factor, factors[-1].factor
        assert least.factor < min(alone, everywhere)
    assert 0.0 < float(found["loaded"].min()) <= float(found["loaded"].max()) < np.ptp(corners)


@pytest.mark.parametrize(
    ("strength", "rounds"), [(np.inf, 1.0), pytest.param(5e6, 2.5, marks=pytest.mark.slow)]
)
def test_a_search_for_the_worst_place_solves_each_once(strength, rounds, monkeypatch):
    """With the factors of places on their own, and few rounds of cuts where stones crush.

    An axle behind the springing reaches the stones by round-off alone.
    """
    options = {"friction": "coulomb", "strength": strength, "fill": GRAVEL}
    stones, dead = self_weight_programme(arch_bridge(), **options)
    rows = [(af.PointLoad(x, (0.0, -1e5)),) for x in np.linspace(0.1, 8.9, 45).tolist()]
    axles = {row: stones.load(row) for row in rows}
    solved, solve = [], linear_programme.solve_linear
    expected = collapse_factors(stones, dead, axles, options)
    monkeypatch.setattr(
        linear_programme, "solve_linear", lambda *given: [solved.append(1), solve(*given)][1]
    )
    worst, factors = find_worst_rows(dead, axles, {}, np.zeros(len(rows)))
    assert len(solved) <= rounds * len(rows)
    # of a place and its mirror image either is the worst
    assert expected[next(iter(worst))] == pytest.approx(min(expected.values()), rel=1e-5)
    reached = [k for k, row in enumerate(rows) if np.isfinite(expected[row])]
    assert 20 < len(reached) < len(rows)
    own = [expected[rows[k]] for k in reached]
    assert factors[reached].tolist() == pytest.approx(own, rel=1e-5)  # of the cuts
    row = next(iter(worst))
    small = {row: 1e-9 * axles[row], rows[0]: 0.0 * axles[row]}
    _, factors = find_worst_rows(dead, small, {}, np.zeros(2))
    assert factors[0] == pytest.approx(1e9 * expected[row], rel=1e-5)
    assert factors[1] > 1e12 * factors[0]
    # of places that differ by round-off the first one
    for rounding in (1e-8, -1e-8):
        alike = {rows[0]: axles[row], rows[1]: (1.0 + rounding) * axles[row]}
        worst, _ = find_worst_rows(dead, alike, {}, np.zeros(2))
        assert [*worst] == rows[:2]


@pytest.mark.slow
def test_more_cover_spreads_axles_and_carries_more():
    """A weightless fill without strength has only the spreading."""
    soil = af.Material(SOIL.young, SOIL.poisson, 1e-3, None, "light")
    fill = af.limit.Fill(friction_angle=0.0, mobilisation=0.0, active=0.0, spread=40.0)
    worst = [
        over(arch_bridge(cover=c, material=soil), 1e5, fill=fill).worst.factor
        for c in (0.05, 0.4, 0.9)
    ]
    assert (np.diff(worst) > 0.0).all()


@pytest.mark.parametrize("friction", [pytest.param("nonassociated", marks=pytest.mark.slow), None])
def test_options_are_those_of_collapse_factor(friction, monkeypatch):
    monkeypatch.setattr(
        "archfem.limit.nonassociated.MAX_START_COUNT", 2
    )  # both search from the same ones
    structure = arch_bridge(voussoirs=9)
    options = {"friction": friction, "strength": 3e6, "fill": GRAVEL}
    found = over(structure, 1e5, positions=[3.1, 3.3], **options)
    live = af.PointLoad(found.position, (0.0, -1e5))
    assert found.worst.factor == af.collapse_factor(structure, live=live, **options).factor
    assert float(found.factors["factor"].min()) == pytest.approx(found.worst.factor, rel=EXACT)


def test_a_bridge_that_does_not_stand_has_no_factor():
    thin = arch_bridge(rise=2.4, thickness=0.12)
    nothing = af.limit.Fill(friction_angle=35.0, mobilisation=0.0, active=0.0)
    found = over(thin, *LORRY, positions=FEW, fill=nothing)
    assert found.factors["factor"].isnull().all()
    assert found.worst.outcome is af.limit.Outcome.INFEASIBLE


def test_a_bridge_that_no_vehicle_breaks():
    thick = ring(thickness=1.9)
    found = over(thick, 1e5, positions=[-0.5, 0.0, 0.5], friction=None)
    assert found.worst.outcome is af.limit.Outcome.UNBOUNDED
    assert (found.factors["factor"] == np.inf).all()


def test_the_fill_over_the_abutments_carries_an_axle_to_the_ground():
    structure = arch_bridge()
    left = fill_of(structure).points[:, 0].min()
    found = over(structure, 1e5, positions=[left + 0.1, left + 2.3], fill=GRAVEL).factors["factor"]
    assert float(found[0, 0]) == np.inf
    assert np.isfinite(float(found[0, 1]))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"axles": []}, "at least one axle"),
        ({"axles": -1e5}, "weights and spacings above 0"),
        ({"axles": [1e5, 1e5]}, "one between each two axles"),
        ({"axles": [1e5, 1e5], "spacings": [0.0]}, "spacings above 0"),
        ({"axles": "lorry"}, "not a row of values"),
        ({"positions": []}, "positions has none"),
        ({"positions": [50.0]}, "nowhere on the structure"),
        ({"fill": None}, "softer than the joints"),
        ({"friction": "some"}, "is not known"),
        ({"structure": 3}, "structure is a int"),
    ],
)
def test_invalid_input_is_refused(given, says):
    options = {"structure": arch_bridge(), "axles": 1e5, "fill": GRAVEL} | given
    with pytest.raises(af.InvalidInput, match=says):
        af.moving_load(**options)


def test_the_weakest_solution_at_a_place_is_kept(monkeypatch, capsys):
    """There and back again: each search begins with the solution found beside it just before."""
    monkeypatch.setattr("archfem._display.PROGRESS_INTERVAL", 0.0)
    values, calls = iter([0.1, 0.3, None, None, 0.2, 0.4]), []

    def weakest_from(programme, starts):
        calls.append((programme, list(starts)))
        value = next(values)
        return None if value is None else SimpleNamespace(value=value, forces=f"{value}")

    def some_starts(programme, start, number, seed):
        return [f"{start} {number} {seed}"]

    monkeypatch.setattr("archfem.limit.vehicles.find_weakest", weakest_from)
    monkeypatch.setattr("archfem.limit.vehicles.starting_forces", some_starts)
    felt = {"a": 1, "b": 2, "c": 3}
    found = _search_nonassociated(felt, {"a": "at a", "b": "at b", "c": "at c"})
    assert {row: state and state.value for row, state in found.items()} == {
        **{"a": 0.4, "b": 0.3, "c": None}
    }
    assert calls == [
        (1, ["at a 2 0"]),
        (2, ["0.1", "at b 2 1"]),
        (3, ["0.3", "at c 2 2"]),
        (3, []),
        (2, []),
        (1, ["0.3"]),
    ]
    lines = capsys.readouterr().err.splitlines()
    ways = [f"place {k} of 3, {way}" for way in ("there", "back") for k in (1, 2, 3)]
    assert lines == [f"sliding without dilatancy: {way}" for way in ways]


@pytest.mark.slow
def test_a_plastic_fill_bounds_the_vehicle_at_each_place(monkeypatch, caplog):
    """Each place is one pair of bounds; the rating has the least of them."""
    pytest.importorskip("clarabel")
    fill = af.limit.PlasticFill(friction_angle=30.0, cohesion=5e3, gap=0.9)
    given = {"positions": [3.3], "area_load": 2e3}
    moving = af.moving_load(arch_bridge(), [1e4], fill=fill, **given)
    assert "other parts may be worse with a plastic fill" in caplog.text
    factors = moving.factors["factor"].sel(direction="right").values
    pressing = af.moving_load(arch_bridge(), [1e4], fill=CLAYEY, **given).worst
    assert moving.worst.live == pressing.live
    assert len(pressing.live) > 3
    alone = af.collapse_factor(arch_bridge(), live=list(moving.worst.live), fill=fill)
    assert factors[0] == pytest.approx(alone.lower, rel=1e-6)
    assert moving.worst.upper == pytest.approx(alone.upper, rel=1e-6)
    # a rating takes every fifth of its places: one here
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (3.3, *[4.5] * 4))
    rating = af.rate(arch_bridge(), vehicles.Vehicle("axle", (1e4,), area_load=2e3), fill=fill)
    assert rating.factor == pytest.approx(factors[0], rel=1e-6)
    assert np.isnan(rating.geometric)
    assert "not searched with a plastic fill" in str(rating)
