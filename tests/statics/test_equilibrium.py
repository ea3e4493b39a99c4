"""Dead load: equilibrium, failures, and warnings of results that dry stone cannot have."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from drawn import draw_portal, square

import archfem as af
from archfem.masonry.block import say_place
from archfem.statics import Equilibrium, dead_load, equilibrium, self_weight
from archfem.statics.equilibrium import (
    _increment_load,
    dead_load_doubts,
    structure_doubts,
)
from archfem.statics.fill_checks import fill_doubts
from archfem.statics.newton import Solution

ROOT = Path(__file__).parents[2]


def semicircle(share, fidelity):
    """A ring of 7 chorded stones, `share` times as thick as its polygon must be to stand."""
    given = {"radius": 1.0, "embrace": 180.0, "voussoirs": 7, "chords": 1}
    return af.build(af.circular_arch(thickness=share * 0.0957, **given), fidelity=fidelity)


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_a_ring_stands_just_above_its_least_thickness(fidelity):
    found = dead_load(semicircle(1.02, fidelity))
    assert np.abs(found.joints["eccentricity"]).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("full", marks=pytest.mark.slow)])
def test_a_ring_does_not_stand_just_below_its_least_thickness(fidelity):
    thin = semicircle(0.98, fidelity)
    with pytest.raises(
        af.DidNotConverge, match=r"joints hinge .* it stands if they are 1\.0[23]\d* times as deep"
    ) as caught:
        dead_load(thin)
    assert caught.value.last.q.shape == (thin.size,)


def test_point_load_is_carried_whole(ring):
    """Thrusts at both springings balance weight and load, at either fidelity."""
    load = af.PointLoad(x=1.0, force=(0.0, -5e3))
    for fidelity in ("rigid", "full"):
        model = af.build(ring, fidelity=fidelity)
        forces = self_weight(model) + model.load(load)
        joints = af.statics.equilibrium_under(model, forces).joints
        up = sum(
            side
            * float(
                joints["N"][k] * ring.normals[k, 1] - joints["V"][k] * ring.joints[k].tangent[1]
            )
            for k, side in ((0, 1.0), (17, -1.0))
        )
        weight = model.mass_influence[:, 1].sum() * ring.gravity
        assert up == pytest.approx(weight + 5e3, rel=1e-9)


def test_joints_that_stay_closed_take_one_step_and_one_iteration(stack):
    found = dead_load(af.build(stack, fidelity="rigid"))
    assert (found.iterations, found.steps) == (1, 1)


def test_point_load_off_the_structure(ring):
    with pytest.raises(af.InvalidInput, match=r"x = 9 m misses the structure"):
        af.PointLoad(x=9.0, force=(0.0, -1.0)).place(ring)


class Growing:
    """A model that stands as it is."""

    support_motion, memory = np.zeros(1), np.zeros(0)

    def with_memory(self, memory):
        return self


def grown(most, ways=("whole", "half", "least")):
    """Parts of a load at which an equilibrium was sought up to a largest one, and how it was."""
    calls, begin = [], Equilibrium(Growing(), np.zeros(1), 5, 2)

    def way(name):
        def find(solver, model, load, start):
            calls.append((float(load), name, float(start[0])))
            if load > most(len(calls)):
                raise af.DidNotConverge("made to fail")
            return model, Solution(np.array([load]), 3, 0.0)

        return find

    ways = tuple(way(name) for name in ways)
    try:
        found = _increment_load(None, begin, lambda part: (begin.model, part), "load", ways)
    except af.DidNotConverge as error:
        return calls, error
    return calls, found


def test_steps_of_a_load_are_halved_where_there_is_no_equilibrium():
    """Steps are halved, and then kept; each begins where the last one ended."""
    calls, found = grown(lambda count: 0.6 if count == 1 else 1.0)
    assert calls == [(1.0, "whole", 0.0), (0.5, "half", 0.0), (1.0, "half", 0.5)]
    assert (found.iterations, found.steps, found.q[0]) == (5 + 6, 2 + 2, 1.0)


def test_a_load_is_given_up_at_a_sixty_fourth_of_it():
    """Another way is tried for the smallest step; the error has the last state and its load."""
    calls, error = grown(lambda count: 0.3)
    parts = [part for part, *_ in calls]
    known = [1.0, 0.5, 0.25, 0.5, 0.375, 0.3125, 0.28125, 0.3125, 0.296875, 0.3125]
    assert parts == pytest.approx(known)
    assert [name for _, name, _ in calls][-3:] == ["half", "least", "least"]
    assert "no equilibrium beyond 0.297 of the load" in str(error)
    assert error.last.q[0] == pytest.approx(0.296875)


def test_an_equilibrium_in_a_line(stack):
    found = dead_load(af.build(stack, fidelity="rigid"))
    assert repr(found) == (
        f"Equilibrium of '{stack.name}' (rigid, 6 coordinates): |e| ≤ 0.000, V/N ≤ 0.000, N ≥ 20 kN"
    )


def resting(**given):
    """A ring with joints of some friction, under its weight."""
    dimensions = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 9} | given
    shear = dimensions.pop("shear_stiffness", 0.30e9)
    contact = af.Contact(1.48e9, shear, dimensions.pop("friction", 0.6))
    ring = af.circular_arch(**dimensions, contact=contact)
    return af.dead_load(af.build(ring, fidelity="rigid"))


def test_an_ordinary_ring_is_not_in_doubt():
    assert dead_load_doubts(resting()) == ()
    assert dead_load_doubts(resting(friction=None)) == ()


def test_shear_beyond_friction_in_joints_that_never_slide_is_a_doubt():
    """Plane blocks one beside the other between walls: shear alone holds them."""
    dead = resting(embrace=7.0, friction=None)
    assert float(dead.joints["friction"].max()) > 3.5
    (doubt,) = dead_load_doubts(dead)
    assert "joints slide from 1 on: they hold only because they never slide" in doubt.cause


def test_doubts_use_the_friction_of_the_criteria():
    assert "slide from 0.2 on" in dead_load_doubts(resting(friction=None), 0.2)[0].cause


@pytest.mark.slow
def test_large_slips_and_small_coefficients_are_doubts():
    """A wedge that friction does not hold comes to rest millimetres below where it was drawn."""
    slid, smooth = dead_load_doubts(resting(embrace=7.0, voussoirs=3, friction=1e-3))
    assert "joints slide by up to 1.18 mm" in slid.cause
    assert "the least coefficient of friction is 0.001" in smooth.cause


def test_shear_that_displaces_soft_joints_is_no_sliding():
    """A closed joint is displaced by V / (k_s A); with the k_s of the remedy by a millimetre."""
    soft = resting(shear_stiffness=0.01e9)
    (doubt,) = dead_load_doubts(soft)
    worst = int(abs(soft.joints["slip"].values).argmax())
    shear, depth = abs(soft.joints["V"].values[worst]), soft.model.structure.depths[worst]
    area = depth * soft.model.structure.width
    assert f"joints by up to {1e3 * shear / (0.01e9 * area):.3g} mm" in doubt.cause
    assert float(soft.joints["friction"].max()) < 0.6
    assert "none slides" in doubt.cause
    assert "k_s from 0.01 MPa/mm" in doubt.cause
    (given,) = re.findall(r"shear_stiffness of about ([\d.]+) MPa/mm", doubt.remedy)
    enough = resting(shear_stiffness=1e9 * float(given))
    assert dead_load_doubts(enough) == ()
    # it is rounded up to two digits from 1.05 times the least
    assert float(abs(enough.joints["slip"]).max()) > 0.85e-3


@pytest.mark.parametrize(
    ("read", "least", "factor"), [("friction", 1.0, 1.0), ("slip", 1e-3, 1e3), ("slip", -1e-3, 1e3)]
)
def test_doubts_begin_at_their_documented_bounds(read, least, factor):
    """By two per cent to either side: V / N of one, a slip of a millimetre either way."""
    dead = resting()
    for share, doubted in ((0.98, False), (1.02, True)):
        found = dead.joints.copy(deep=True)
        found[read].values[3] = share * least
        said = dead_load_doubts(SimpleNamespace(model=dead.model, joints=found))
        assert len(said) == doubted
        assert all(f"{share * abs(least) * factor:.3g} " in doubt.cause for doubt in said)


def test_joints_of_stone_are_not_smooth():
    assert dead_load_doubts(SimpleNamespace(**smooth(0.102))) == ()
    (doubt,) = dead_load_doubts(SimpleNamespace(**smooth(0.098)))
    assert doubt.cause == "the least coefficient of friction is 0.098"
    assert doubt.remedy == "joints of stone have 0.6 to 0.75: check it"


def test_one_smooth_joint_among_rough_ones_is_named(stack):
    rough, other = stack.joints
    slippery = replace(other, contact=replace(other.contact, friction=0.02))
    mixed = replace(stack, joints=(rough, slippery))
    (doubt,) = dead_load_doubts(af.dead_load(af.build(mixed, fidelity="rigid")))
    assert doubt.cause.startswith("the least coefficient of friction is 0.02")


def with_fixed(structure, *numbers):
    """A structure some blocks of which are fixed by mistake."""
    blocks = list(structure.blocks)
    for number in numbers:
        blocks[number] = replace(blocks[number], fixed=True)
    return replace(structure, blocks=tuple(blocks))


@pytest.mark.parametrize("numbers", [[2], [5], [8], [3, 4]])
def test_a_fixed_voussoir_is_a_doubt_with_its_place(numbers):
    """Blocks 0 and 10 are the abutments of nine voussoirs; two neighbours are one body."""
    ring = with_fixed(resting().model.structure, *numbers)
    dead = af.dead_load(af.build(ring, fidelity="rigid"))
    (doubt,) = dead_load_doubts(dead)
    names = " and ".join(f"'{ring.blocks[number].name}'" for number in numbers)
    x, y = np.mean([ring.blocks[number].centroid for number in numbers], axis=0)
    assert doubt.cause.startswith(f"{names} at ({x:.2f}, {y:.2f}) m cannot move, but stands")
    assert "between stones of 'arch'" in doubt.cause
    assert doubt.remedy.startswith("take fixed from it")


def test_a_voussoir_that_extends_its_abutment_is_none():
    assert structure_doubts(with_fixed(resting().model.structure, 1, 2, 9)) == []


@pytest.mark.parametrize("part", ["abutment", "arch"])
def test_a_voussoir_on_the_layer_of_the_abutments_is_a_doubt(part):
    """One that is fixed as a stone of the ring is so on purpose, and an abutment alone is none."""
    ring = with_fixed(resting().model.structure, 1)
    blocks = list(ring.blocks)
    blocks[1] = replace(blocks[1], part=part, role="ring" if part == "arch" else "other")
    doubts = structure_doubts(af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE))
    assert len(doubts) == (part == "abutment")
    for doubt in doubts:
        assert doubt.cause.startswith(f"'{blocks[1].name}' at (")
        assert "and carries 'arch': by its size it may be a stone of that" in doubt.cause


@pytest.mark.parametrize(("factor", "doubts"), [(1.0, 0), (10.0, 1), (25.4, 1)])
def test_a_ring_in_a_wrong_unit_is_a_doubt(factor, doubts):
    """Drawn in mm, and read in mm, cm or inches."""
    ring = af.circular_arch(radius=3.0 * factor, thickness=0.3 * factor, embrace=150, voussoirs=9)
    found = structure_doubts(ring)
    assert len(found) == doubts
    assert all(f"typically {0.3 * factor:.3g} m deep" in doubt.cause for doubt in found)


@pytest.mark.parametrize("voussoirs", [2, 3, 4, 15])
def test_a_ring_drawn_as_a_few_stones_is_a_doubt(voussoirs):
    """It bears more than one of voussoirs; chord and rise are those of an arc."""
    sizes = {"radius": 1.0, "thickness": 0.2, "embrace": 180.0}
    ring, fine = (af.circular_arch(**sizes, voussoirs=n) for n in (voussoirs, 60))
    factors = [af.collapse_factor(x, live=af.BodyForce(1.0, 0.0)).factor for x in (ring, fine)]
    found, half = structure_doubts(ring), np.pi / voussoirs / 2.0
    assert len(found) == (factors[0] > 1.1 * factors[1]) == (voussoirs < 15)
    for doubt in found:
        assert f"in one piece over {10.0 * np.sin(half):.3g} times" in doubt.cause
        assert f"rises by {4.5 * (1.0 - np.cos(half)):.2g} of the depth" in doubt.cause
        assert doubt.remedy == "draw the outline of each voussoir, unless it is one stone"


def test_lintels_keystones_and_blocks_of_piers_may_be_monoliths():
    sizes = {"radius": 1.5, "thickness": 0.35, "voussoirs": 9, "pier_breadth": 0.7}
    monoliths = [
        af.arch_on_piers(**sizes, courses=[3.0]),
        af.shapes.pointed_arch(span=2.0, rise=2.0, thickness=0.3, voussoirs=11),
        af.Case.read(ROOT / "archfem/cases/new/portal.toml").structure,
        af.shapes.flat_arch(span=2.0, thickness=0.4, voussoirs=3, skewback="10 degree"),
    ]
    assert [structure_doubts(each) for each in monoliths] == [[], [], [], []]


def test_a_fixed_stone_of_a_pier_or_a_flat_arch_is_a_doubt():
    pier = af.column(breadth=0.6, heights=[0.5] * 4)
    flat = af.shapes.flat_arch(span=2.0, thickness=0.4, voussoirs=5, skewback="10 degree")
    for structure, number in ((pier, 2), (flat, 3)):
        assert structure_doubts(structure) == []
        (doubt,) = structure_doubts(with_fixed(structure, number))
        assert doubt.cause.startswith(f"'{structure.blocks[number].name}' at (")


@pytest.mark.slow
def test_a_fixed_course_on_one_that_moves_is_a_doubt(tmp_path, capsys):
    """The springing of a ring on piers is of two parts; the course below hangs from nothing."""
    sizes = {"radius": 1.5, "thickness": 0.35, "voussoirs": 9, "pier_breadth": 0.7}
    portal = af.arch_on_piers(**sizes, courses=[0.5, 0.5, 0.5])
    assert structure_doubts(portal) == []
    tops = [k for k in portal.free if portal.blocks[k].part.endswith("pier")]
    tops = [k for k in tops if portal.centroids[k][1] > -0.3]
    wrong = with_fixed(portal, *tops)
    doubts = structure_doubts(wrong)
    assert len(doubts) == len(tops) == 2
    for k, doubt in zip(sorted(tops), sorted(doubts, key=lambda each: each.cause), strict=True):
        x, y = wrong.centroids[k]
        name = wrong.blocks[k].name
        assert doubt.cause.startswith(f"'{name}' at ({x:.2f}, {y:.2f}) m cannot move, but lies on ")
        assert doubt.remedy == "take fixed from it, in a drawing by its layer"
    path = af.Analysis(wrong, fidelity="rigid").write(tmp_path / "wrong.toml")
    horizontal = ["--set", "limit.horizontal=1.0"]
    for command in (["check"], ["limit", *horizontal], ["run", "--out", str(tmp_path / "out")]):
        assert af.commands.main([command[0], str(path), *command[1:]]) == 3
        said = capsys.readouterr().out
        assert said.count("m cannot move, but lies on '") == 2
        assert ("N ≥ 0.00 kN, as nothing is carried by " in said) == (command[0] != "limit")


@pytest.mark.parametrize(
    ("moved", "name", "why"),
    [
        pytest.param(
            {"WEST 1": "SLAB"},
            "SLAB 1",
            "mm broad) is fixed, as is 'SLAB 2' beside it, and carries",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"WEST 1": "SLAB", "WEST 2": "SLAB"},
            "SLAB 2",
            "as is 'SLAB 1' beside it, and carries",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            dict.fromkeys(["WEST 1", "WEST 2", "WEST 3"], "SLAB"),
            "SLAB 3",
            "carries 'arch': by its",
            marks=pytest.mark.slow,
        ),
        ({"WEST 1": "RING"}, "RING 1", "of 'arch', apart from most others of it: it may be one of"),
        pytest.param(
            {"WEST 2": "RING"},
            "RING 1",
            "from most others of it: it may be one of 'west pier'",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"WEST 3": "RING"},
            "RING 1",
            "mm broad as 'WEST 2' below, where its joints are 299 mm",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"WEST 2": "EAST"},
            "EAST 1",
            "of 'east pier', apart from most others of it: it may be o",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"RING 4": "EAST"},
            "EAST 1",
            "apart from most others of it: it may be one of 'arch'",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"RING 11": "WEST"},
            "WEST 4",
            "of it: it may be one of 'arch' or 'east pier'",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_stone_on_a_wrong_layer_of_a_drawing_is_a_doubt(tmp_path, moved, name, why, capsys):
    case = draw_portal(tmp_path, moved, on_piers=len(moved) == 3)
    structure = af.Case.read(case).structure
    (doubt,) = structure_doubts(structure)
    (block,) = (block for block in structure.blocks if block.name == name)
    assert doubt.cause.startswith(f"'{name}' at {say_place(block.centroid)} m ")
    assert why in doubt.cause
    assert "in a drawing by its layer" in doubt.remedy
    assert af.commands.main(["check", str(case)]) == 3
    assert f"in doubt: '{name}' at " in capsys.readouterr().out


def lay_footings(stones):
    """Put a footing below each pier, broader by a tenth on each side, above a lower slab."""
    for name, course in (("SLAB 2", "WEST 1"), ("SLAB 3", "EAST 3")):
        (left, low), (right, _) = stones[course].min(axis=0), stones[course].max(axis=0)
        left, right = left - 45.0, right + 45.0
        corners = [[left, low - 300.0], [right, low - 300.0], [right, low], [left, low]]
        stones[name] = np.array(corners)
    stones["SLAB 1"] -= [0.0, 300.0]


def turn(stones, angle):
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    for name in stones:
        stones[name] = stones[name] @ [[c, s], [-s, c]]


def draw_on_footings(folder, moved=()):
    """Draw the portal on footings that move."""
    free = {"SLAB 2": "FOOT", "SLAB 3": "FOOT"}
    case = draw_portal(folder, free | dict(moved), change=lay_footings)
    footings = 'FOOT = { part = "footings", role = "other" }\n[model]'
    case.write_text(case.read_text().replace("[model]", footings))
    return case


@pytest.mark.slow
@pytest.mark.parametrize(
    ("moved", "whys"),
    [
        ({}, []),
        ({"WEST 1": "SLAB"}, ["'SLAB 1' .* cannot move, but lies on 'FOOT 1'"]),
        ({"WEST 1": "SLAB", "EAST 3": "SLAB"}, ["'SLAB 1' .* on 'FOOT 1'", "'SLAB 2' .*'FOOT 2'"]),
        ({"WEST 1": "FOOT"}, ["'FOOT 1' .* as broad as 'west pier' on it, where others of it pro"]),
        ({"EAST 3": "FOOT"}, ["'FOOT 1' .* as broad as 'east pier' on it, .* of 'east pier'"]),
        ({"RING 1": "WEST"}, ["'WEST 4' .* joint is as deep as those of 'arch': .* of 'arch'"]),
        ({"RING 1": "WEST", "RING 2": "WEST"}, ["'WEST 4' .*: .* of 'arch'", "'WEST 5' .* 'arch'"]),
        ({"RING 11": "FOOT"}, ["'FOOT 1' .* between 'arch' and 'east pier' by joints as deep as"]),
        ({"RING 5": "FOOT"}, ["'FOOT 1' .* between 'arch' by joints as deep as those of 'arch'"]),
    ],
)
def test_a_stone_on_a_wrong_layer_above_footings_that_move_is_a_doubt(tmp_path, moved, whys):
    case = draw_on_footings(tmp_path, moved)
    doubts = sorted(doubt.cause for doubt in structure_doubts(af.Case.read(case).structure))
    assert len(doubts) == len(whys)
    for cause, why in zip(doubts, whys, strict=True):
        assert re.match(why, cause)
    assert af.commands.main(["check", str(case)]) == (3 if whys else 0)


@pytest.mark.parametrize("change", [None, lay_footings, lambda stones: turn(stones, 0.5)])
@pytest.mark.parametrize("on_piers", [False, True])
def test_a_sound_drawing_has_no_doubts(tmp_path, change, on_piers):
    """On footings, with both piers on one layer, and turned by less than a survey errs."""
    case = draw_portal(tmp_path, change=change, on_piers=on_piers)
    assert structure_doubts(af.Case.read(case).structure) == []


def test_two_arches_of_one_part_are_no_strays(tmp_path):
    def repeat(stones):
        for name in [name for name in stones if not name.startswith("SLAB")]:
            stones[f"{name} again"] = stones[name] + [4000.0, 0.0]
        stones["SLAB 1"][1:3, 0] += 4000.0

    case = draw_portal(tmp_path, change=repeat)
    assert structure_doubts(af.Case.read(case).structure) == []
    with pytest.raises(af.InvalidInput, match=r"has 4 springings .*: give each ring a part of its"):
        af.masonry.find_ring(af.Case.read(case).structure)


def widen_springers(stones):
    """Draw the first and the last voussoir as broad on their pier as it is."""
    for ring, pier in (("RING 1", "WEST 3"), ("RING 11", "EAST 1")):
        voussoir, course = stones[ring], stones[pier]
        ends = [np.argsort(voussoir[:, 1])[:2], np.argsort(course[:, 1])[2:]]
        low, top = (k[np.argsort(x[k, 0])] for k, x in zip(ends, (voussoir, course), strict=True))
        voussoir[low] = course[top]


@pytest.mark.parametrize(
    ("moved", "change", "count"),
    [
        ({"WEST 1": "SLAB", "EAST 3": "SLAB"}, None, 2),
        ({"WEST 3": "RING", "EAST 1": "RING"}, None, 2),
        ({}, widen_springers, 0),
    ],
)
def test_courses_of_both_piers_are_judged_by_their_breadth_alone(tmp_path, moved, change, count):
    """No pier has a course as high as those on the ground; rings may widen at both ends.

    A springer has a sloping joint towards its ring. The top of a pier has a level one.
    """
    structure = af.Case.read(draw_portal(tmp_path, moved, change)).structure
    assert len(structure_doubts(structure)) == count


def test_a_course_with_the_ring_above_a_footing_is_one_doubt(tmp_path):
    """The footing, hardly larger than that course, is no stone of the ring."""

    def narrow(stones):
        lay_footings(stones)
        stones["SLAB 2"][:2, 1] += 120.0
        stones["SLAB 3"][:2, 1] += 120.0
        stones["SLAB 1"] += [0.0, 120.0]

    case = draw_portal(tmp_path, {"WEST 1": "RING"}, change=narrow)
    (doubt,) = structure_doubts(af.Case.read(case).structure)
    assert doubt.cause.startswith("'RING 1' at (-1.600, ")


@pytest.mark.parametrize(("moved", "kind"), [("RING 11 2", "SPAN"), ("RING 5 2", "SPAN")])
def test_a_voussoir_with_the_ring_of_another_span_is_a_doubt(tmp_path, moved, kind):
    """Two spans that share no pier, as of two rings on one layer each."""

    def repeat(stones):
        for name in [name for name in stones if not name.startswith("SLAB")]:
            stones[f"{name} 2"] = stones[name] + [4000.0, 0.0]
        stones["SLAB 1"][1:3, 0] += 4000.0

    second = {f"RING {k} 2": kind for k in range(1, 12)}
    case = draw_portal(tmp_path, second | {moved: "RING"}, change=repeat)
    ring = 'RING = { part = "arch", role = "ring" }'
    case.write_text(case.read_text().replace(ring, f'{ring}\n{kind} = {{ role = "ring" }}'))
    (doubt,) = structure_doubts(af.Case.read(case).structure)
    assert doubt.cause.startswith("'RING 12' at (")
    assert f"it may be one of '{kind}'" in doubt.cause


@pytest.mark.parametrize("angle", [2.0, -2.0])
def test_a_drawing_that_is_turned_is_a_doubt(tmp_path, angle):
    case = draw_portal(tmp_path, change=lambda stones: turn(stones, angle))
    (doubt,) = structure_doubts(af.Case.read(case).structure)
    assert doubt.cause.startswith(f"all beds of the piers slope by about {angle:.2g}°")


@pytest.mark.parametrize(
    ("material", "role", "count"),
    [(af.masonry.BACKFILL, "other", 0), (af.STONE, "other", 1), (af.STONE, "pier", 1)],
)
def test_a_fixed_block_on_a_stone_is_a_doubt_and_on_fill_none(material, role, count):
    """Sidewalls lean against what they hold."""
    stones = [
        af.Block(tuple(map(tuple, square(0.0, y))), material, name, fixed=name != "free", role=role)
        for y, name in enumerate(("ground", "free", "wall"))
    ]
    assembled = af.masonry.assembled(stones, af.masonry.STONE_TO_STONE)
    assert len(structure_doubts(assembled)) == count


def test_a_fixed_pier_between_arches_of_one_part_is_none():
    """A fixed pier carries two stones of one part, whose springings are nearly vertical."""
    skew = np.tan(np.radians(3.5))
    faces = [((x, 0.0), (x + side * skew, 1.0)) for x, side in ((1.0, 1), (2.0, -1))]
    pier = [(0.9, -1.0), (2.1, -1.0), faces[1][0], faces[1][1], faces[0][1], faces[0][0]]
    stones = [
        af.Block(((0.0, 0.0), *faces[0], (0.0, 1.0)), af.STONE, "left", part="arches", role="ring"),
        af.Block(
            ((3.0, 1.0), faces[1][1], faces[1][0], (3.0, 0.0)),
            af.STONE,
            "right",
            part="arches",
            role="ring",
        ),
        af.Block(tuple(pier), af.STONE, "pier", fixed=True, part="rock", role="other"),
    ]
    assert structure_doubts(af.masonry.assembled(stones, af.masonry.STONE_TO_STONE)) == []


CASES = [*ROOT.glob("meshes/*.toml"), *ROOT.glob("archfem/cases/new/*.toml")]


@pytest.mark.parametrize(
    "path",
    [
        # the largest; most differ from "prusias" in piers, fill or motion alone
        pytest.param(
            *(path,),
            marks=pytest.mark.slow if re.match("prusias|survey|bridge", path.stem) else (),
            id=path.stem,
        )
        for path in CASES
        if not re.search(r"^\[?case", path.read_text(), re.MULTILINE)
    ],
)
def test_supports_of_shipped_cases_are_none(path):
    assert structure_doubts(af.Case.read(path).structure) == []


def smooth(friction):
    """A block that rests on a level joint, which needs no friction."""
    block = af.column(breadth=1.0, heights=[1.0], contact=af.Contact(1e9, 4e8, friction))
    dead = af.dead_load(af.build(block, fidelity="rigid"))
    return {"model": dead.model, "joints": dead.joints}


def test_a_state_beyond_limit_analysis_is_a_doubt():
    """A state of joints with 0.6, put to joints with 0.2: no thrust line is within those."""
    dead = resting()
    weaker = af.build(
        replace(
            dead.model.structure,
            joints=tuple(
                replace(joint, contact=replace(joint.contact, friction=0.2))
                for joint in dead.model.structure.joints
            ),
        ),
        fidelity="rigid",
    )
    assert not af.stands(weaker.structure)
    assert (
        "archfem.stands says that it falls"
        in dead_load_doubts(replace(dead, model=weaker))[-1].cause
    )


@pytest.mark.parametrize(("embrace", "code"), [(159.0, 0), (7.0, 3)])
def test_the_check_command_prints_doubts(embrace, code, tmp_path, capsys):
    path = tmp_path / "ring.toml"
    path.write_text(
        '[structure]\nshape = "circular_arch"\nradius = 2.95\nthickness = 0.55\nvoussoirs = 9\n'
        f'embrace = {embrace}\n[model]\nfidelity = "rigid"\n'
        '[contacts."stone to stone"]\nfriction = "none"\n'
    )
    assert af.commands.main(["check", str(path)]) == code
    said = capsys.readouterr().out
    assert ("in doubt: under dead load |V| / N is" in said) == bool(code)
    assert ("toml: ready" in said) != bool(code)


@pytest.mark.slow
def test_commands_name_fixed_blocks_and_doubt_those_within_a_ring(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (1.4,))
    path, ring = tmp_path / "ring.toml", with_fixed(resting().model.structure, 5)
    af.Analysis(ring, fidelity="rigid").write(path)
    assert af.commands.main(["check", str(path)]) == 3
    said = capsys.readouterr().out
    sizes = {number: 1e3 * np.ptp(ring.blocks[number].points[:, 0]) for number in (0, 5, 10)}
    fixed = ", ".join(f"'{ring.blocks[k].name}' ({mm:.3g} mm broad)" for k, mm in sizes.items())
    weight = f"{ring.weight / 1e3:.4g} kN in all"
    assert f"blocks that move, {weight}: 8 of 'arch'; fixed: {fixed}\n" in said
    assert "in doubt: 'voussoir 5' at (0.00, " in said
    commands = (
        ["rate", "--vehicle", "CS454-single"],
        ["limit", "--set", "limit.vertical=-1"],
        ["modes", "--count", "1", "--out", str(tmp_path / "modes")],
    )
    for command in commands:
        assert af.commands.main([command[0], str(path), *command[1:]]) == 3
        assert "in doubt: 'voussoir 5' at (0.00, " in capsys.readouterr().out


def arch_bridge(**walls):
    """A bridge of one span under fill; with the given sidewalls, or none."""
    arch = af.shapes.Arch(span=8.4, rise=2.1, thickness=0.55, voussoirs=16)
    names = ("left wall", "right wall") if walls else ()
    sides = [af.shapes.Sidewall(name=name, **walls) for name in names]
    fill = af.shapes.Backfill(cover=0.45)
    return af.bridge(arches=[arch], sidewalls=sides, backfill=fill, width=5.0)


NOTHING = {"joint_rule": "exact", "sign": "as given", "dt": "as given"}
WALLS = {"length": 2.0, "height": 2.0, "above": 2.0, "course": 0.5, "state": "fixed"}


@pytest.mark.slow
def test_fill_that_only_tension_holds_is_a_doubt_with_its_free_ends():
    (doubt,) = fill_doubts(arch_bridge())
    assert "as soil of 30° and 5 kPa it does not stand under its own weight" in doubt.cause
    # radius 5.25 m, springing at cos α = 0.6: from the extrados there to the deck
    assert f"free faces of {5.8 + 0.45 - 5.8 * 0.6:.3g}, 2.77 m" in doubt.cause
    assert "sidewalls" in doubt.remedy
    # limit analysis of pieces, once for all results of structures that are equal
    assert fill_doubts(arch_bridge()) is fill_doubts(arch_bridge())
    assert fill_doubts(arch_bridge(**WALLS)) == ()
    assert fill_doubts(resting().model.structure) == ()


def test_fill_in_pieces_answers_itself():
    pieces = af.masonry.jointed_fill(arch_bridge(), 1.2, friction_angle=30.0)
    assert not af.stands(pieces)
    assert fill_doubts(pieces) == ()


@pytest.mark.slow
def test_pieces_as_large_as_the_fill_is_deep_lock_the_ring_and_words_say_by_how_much():
    """A plastic fill of this strength bounds the push on the ring: no fill beside it bears more."""
    walls = WALLS | {"length": 4.0}
    bridge, soil = arch_bridge(**walls), {"friction_angle": 30.0, "cohesion": 5e3}
    stones = [k for k in bridge.free if bridge.blocks[k].role == "ring"]
    push = [af.PointLoad(x, (1e3, 0.0), y) for x, y in bridge.centroids[stones]]
    coarse, fine = (af.masonry.jointed_fill(bridge, size, **soil) for size in (2.5, 0.9))
    plastic = af.limit.PlasticFill(**soil, gap=0.1)
    most = af.collapse_factor(bridge, live=push, fill=plastic).upper
    factors = [af.collapse_factor(cut, live=push).factor for cut in (coarse, fine)]
    (doubt,) = fill_doubts(coarse)
    assert factors[0] > 1.7 * most
    assert factors[1] < 1.3 * most
    fill = af.limit.Fill(**soil, mobilisation=1.0)
    ratio = factors[0] / af.collapse_factor(bridge, live=push, fill=fill).factor
    assert f"fails it at {ratio:.3g} times the push with all passive pressure" in str(doubt)
    assert "half the size" in doubt.remedy
    assert fill_doubts(fine) == ()
    # limit analysis with the strength of a fill does not depend on its pieces
    assert structure_doubts(coarse) == []


@pytest.mark.slow
def test_every_answer_of_a_bridge_has_the_doubt_of_its_fill(tmp_path, capsys):
    """Check, limit analysis, a run, and the range of its verdict; and no answer with sidewalls."""
    path = tmp_path / "bridge.toml"
    motion = af.Motion.synthetic(duration=0.5, pga=0.5, seed=1)
    for structure, doubted in ((arch_bridge(), True), (arch_bridge(**WALLS), False)):
        analysis = af.Analysis(structure, fidelity="rigid", displacements="large")
        analysis.write(path)
        fill = ["--set", "limit.fill.friction_angle=30 degree", "--set", "limit.vertical=-1"]
        for command in (["check"], ["limit", *fill]):
            af.commands.main([command[0], str(path), *command[1:]])
            assert ("fill in one piece holds itself" in capsys.readouterr().out) == doubted
        found = analysis.run(motion), analysis.verdict_range(motion, samples=1, vary=NOTHING)
        for each in found:
            assert any("holds itself" in doubt.cause for doubt in each.doubts) == doubted


def thin_ring(stiffness, unit_weight=20e3):
    """1.03 times as thick as limit analysis needs, 0.19568 m, in large displacements."""
    ring = af.circular_arch(
        radius=2.95,
        thickness=1.03 * 0.19568,
        embrace=159.0,
        voussoirs=17,
        contact=af.Contact(stiffness, 0.2 * stiffness, 0.6),
        material=af.Material(30e9, 0.2, unit_weight),
    )
    return af.build(ring, fidelity="rigid", displacements="large")


@pytest.mark.slow
def test_an_error_of_large_displacements_states_the_stiffness_that_is_needed(verified):
    """By a path along which the weight grows past its peak, whose steps resolve it to 0.05 %."""
    light = 0.02  # of the weight that is there at the start of the path
    path = af.pushover(thin_ring(1e11, light * 20e3), af.BodyForce(0.0, -1.0), control="path")
    factors = path.curve["factor"].values
    least = 1e11 / (light * (1.0 + factors.max()))
    assert factors[-1] < 0.999 * factors.max()
    with pytest.raises(af.DidNotConverge, match=r"^as rigid .* joints are too soft") as caught:
        dead_load(thin_ring(1e11))
    reported = float(re.search(r"k_n from (\S+) Pa/m on", str(caught.value))[1])
    verified("stiffness at which a thin ring stands [Pa/m]", least, "path past its peak", reported)
    # a step of the load is a sixty-fourth, and the reported stiffness is rounded up to two digits
    assert least < reported < 1.12 * least
    assert dead_load(thin_ring(reported)).steps >= 1
    assert dead_load(thin_ring(1.01 * least)).steps >= 1
    soft = thin_ring(0.97 * least)
    with pytest.raises(af.DidNotConverge):
        af.statics.equilibrium_under(soft, self_weight(soft))


@pytest.mark.slow
def test_the_error_also_states_that_a_ring_carries_a_thousandth_of_its_weight():
    """The first step of the load is larger than the load that it carries."""
    with pytest.raises(af.DidNotConverge, match=r"(39|4[01])0 times as stiff, k_n from [56]\.\de"):
        dead_load(thin_ring(1.48e9))


@pytest.mark.slow
def test_friction_at_its_limit_is_named_rather_than_soft_joints_alone(monkeypatch):
    """With a tenth more friction the same joints carry it."""

    def ring(friction):
        sizes = {"radius": 1.0, "thickness": 0.24, "embrace": 200.0, "voussoirs": 15}
        arch = af.circular_arch(**sizes, contact=af.Contact(1e9, 4e8, friction))
        return af.build(arch, fidelity="rigid", displacements="large")

    monkeypatch.setattr(equilibrium, "_find_carried_part", lambda *_: 0.08)
    with pytest.raises(af.DidNotConverge) as caught:
        dead_load(ring(0.45))
    assert str(caught.value).startswith(
        "as rigid blocks it stands from a coefficient of friction of 0.441, which is too near its "
        "0.45 for joints that deform (give more of it, or stiffer joints): it stands if they are 13"
    )
    assert dead_load(ring(0.495)).steps >= 1
    assert af.stands(ring(0.441).structure)
    assert not af.stands(ring(0.44).structure)


def test_the_part_of_its_weight_that_soft_joints_carry_is_found():
    """By linear joints it is that of the whole weight with as much stiffer ones."""

    def gate(stiffness):
        sizes = {"span": 4.2, "rise": 1.2, "thickness": 0.42, "breadth": 0.7, "height": 2.3}
        dry = af.Contact(stiffness, 0.4 * stiffness, 0.6)
        arch = af.shapes.buttressed_arch(**sizes, voussoirs=9, course=3.0, contact=dry)
        model = af.build(arch, fidelity="rigid", displacements="large")
        return af.statics.equilibrium_under(model, self_weight(model))

    with pytest.raises(af.DidNotConverge) as caught:
        gate(1e10)
    part = float(re.search(r"beyond (\S+) of the load, by steps of 0\.016", str(caught.value))[1])
    assert part > 0.2
    assert gate(1e10 / part).steps >= 1
    with pytest.raises(af.DidNotConverge):
        gate(1e10 / (part + 1.0 / 64.0))


@pytest.mark.slow
def test_with_cohesion_no_needed_stiffness_is_stated():
    contact = af.Contact(1e11, 0.2e11, 0.6, cohesion=0.05)
    ring = thin_ring(1e11).structure
    joints = tuple(replace(joint, contact=contact) for joint in ring.joints)
    glued = af.build(replace(ring, joints=joints), fidelity="rigid", displacements="large")
    with pytest.raises(af.DidNotConverge, match="compare with stiffer joints; no equilibrium"):
        dead_load(glued)


def test_the_part_of_a_weight_that_is_carried_is_sought_in_ever_smaller_steps(monkeypatch):
    """0.37 is carried, in steps of a sixty-fourth of the load; the first search ends early."""
    weight, tried = np.array([0.0, -3.0]), []

    def carry(model, load, newton):
        part = float(load @ weight / (weight @ weight))
        tried.append(part)
        if part <= 0.37:
            return None
        carried = 0.1 if len(tried) == 1 else np.floor(0.37 / part * 64.0) / 64.0 * part
        state = SimpleNamespace(force=lambda q: carried * weight)
        raise af.DidNotConverge("", last=SimpleNamespace(model=state, q=None))

    monkeypatch.setattr(equilibrium, "equilibrium_under", carry)
    monkeypatch.setattr(equilibrium, "self_weight", lambda model: weight)
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    found = equilibrium._find_carried_part(model, None)
    most = 59.0 / 64.0 * 0.4  # of 0.4 that were tried after 0.1 and 0.2 were carried
    assert found == pytest.approx(most)
    roots = 2.0 ** (1.0 / 2.0 ** np.arange(5))  # 1.044, the last, is less than five per cent
    assert tried == pytest.approx([1.0, 0.2, 0.4, *(roots[:-1] * most)])


@pytest.mark.parametrize(
    ("carried", "tried", "most"),
    [
        # nothing, the first sixty-fourth, 5 % more than that, no more, and nothing further
        (
            [0.0, 1.0 / 64.0, 1.05 / 64.0, 1.05 / 64.0, None],
            [1.0, 1.0 / 64.0, 2.0 / 64.0, 2.1 / 64.0, 2.0**0.5 * 1.05 / 64.0],
            1.05 / 64.0,
        ),
        ([0.7, 1.0], [1.0, 1.0], 1.0),  # the whole, at a second trial
        ([None], [1.0], None),
    ],
)
def test_trials_follow_the_part_of_a_weight_that_was_carried(carried, tried, most, monkeypatch):
    """Twice the largest part is tried next, the whole at most; the root of two where that fails."""
    weight, loads, left = np.array([0.0, -3.0]), [], list(carried)

    def carry(model, load, newton):
        part = left.pop(0)
        loads.append(float(load @ weight / (weight @ weight)))
        if part is None:
            raise af.DidNotConverge("", last=None)
        if part < loads[-1]:
            state = SimpleNamespace(force=lambda q: part * weight)
            raise af.DidNotConverge("", last=SimpleNamespace(model=state, q=None))

    monkeypatch.setattr(equilibrium, "equilibrium_under", carry)
    monkeypatch.setattr(equilibrium, "self_weight", lambda model: weight)
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    found = equilibrium._find_carried_part(model, None)
    assert found == (most and pytest.approx(most))
    assert loads == pytest.approx(tried)


def test_the_stiffness_that_is_needed_is_that_of_the_softest_joint(stack, monkeypatch):
    """0.42 of the weight is carried: joints 2.5 times as stiff carry it with 5 % to spare."""
    soft, other = stack.joints
    stiff = replace(other, contact=replace(other.contact, normal_stiffness=7e9))
    soft = replace(soft, contact=replace(soft.contact, normal_stiffness=2e9))
    model = af.build(replace(stack, joints=(soft, stiff)), fidelity="rigid")

    def fail(*_):
        raise af.DidNotConverge("made to fail", last=None)

    monkeypatch.setattr(equilibrium, "_load_from_rest", fail)
    monkeypatch.setattr(equilibrium, "_find_carried_part", lambda model, newton: 0.42)
    with pytest.raises(
        af.DidNotConverge,
        match=r"if they are 2\.5 times as stiff, k_n from 5e\+09.*RigidBlockSimulation need no s",
    ):
        dead_load(model)
