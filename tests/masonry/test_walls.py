"""Walls in bond by a few lengths, against areas by hand, stones laid one by one, closed forms."""

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from bonded import bonded_wall

import archfem as af
from archfem.cases.structure_text import describe_depths
from archfem.errors import InvalidStructure

CONTACT = af.Contact(1.48e9, 0.3e9, friction=0.6)
DOOR = af.shapes.Opening(left=-0.75, breadth=1.0, head=2.0, name="door")
WINDOW = af.shapes.Opening(left=-0.6, breadth=1.2, sill=1.8, head=4.2, name="window")

# Lengths of walls, and their areas by hand [m²]
WALLS = {
    "rectangle": ({"breadth": 4.0, "height": 3.0}, 12.0),
    "triangle": ({"breadth": 3.0, "height": 2.0, "eaves": 0.0}, 3.0),
    "barn": ({"breadth": 4.0, "height": 4.0, "eaves": 2.5, "openings": [DOOR]}, 10.0 + 3.0 - 2.0),
    "gable": (
        {"breadth": 6.4, "height": 6.8, "eaves": 4.0, "openings": [WINDOW], "course": 0.4},
        6.4 * 4.0 + 6.4 * 2.8 / 2.0 - 1.2 * 2.4,
    ),
    "two heads": (
        {
            **{"breadth": 6.4, "height": 6.8, "eaves": 4.0, "course": 0.4, "stone": 0.7},
            "openings": [WINDOW, af.shapes.Opening(left=-2.6, breadth=1.0, head=2.2, name="door")],
        },
        6.4 * 4.0 + 6.4 * 2.8 / 2.0 - 1.2 * 2.4 - 2.2,
    ),
    "window above a door": (
        {
            **{"breadth": 4.0, "height": 5.0},
            "openings": [DOOR, af.shapes.Opening(left=-0.75, breadth=1.0, sill=3.0, head=4.0)],
        },
        20.0 - 2.0 - 1.0,
    ),
}


@cache
def build(name):
    lengths, area = WALLS[name]
    return af.shapes.wall(width=0.4, contact=CONTACT, **lengths), lengths, area


def head_joints(wall):
    """Return the places of the head joints of each course, by its level."""
    found = {}
    for joint in wall.joints:
        (x, y), (u, v) = joint.intrados, joint.extrados
        if x == u and y != v:
            found.setdefault(min(y, v), []).append(x)
    return found


@pytest.mark.parametrize("name", WALLS)
def test_stones_fill_the_wall(name):
    wall, _, area = build(name)
    assert sum(wall.blocks[number].area for number in wall.free) == pytest.approx(area, rel=1e-12)
    assert wall.weight == pytest.approx(area * 0.4 * af.STONE.unit_weight, rel=1e-12)


@pytest.mark.parametrize("name", WALLS)
def test_no_head_joint_stands_above_another(name):
    wall, lengths, _ = build(name)
    courses = [joints for _, joints in sorted(head_joints(wall).items())]
    for below, above in pairwise(courses):
        distance = np.abs(np.subtract.outer(below, above)).min()
        assert distance > 0.3 * lengths.get("stone", 0.5)


@pytest.mark.parametrize("name", ["barn", "gable", "two heads", "window above a door"])
def test_one_stone_spans_each_opening(name):
    wall, lengths, _ = build(name)
    for each in lengths["openings"]:
        lintels = []
        for number in wall.free:
            (low_x, low_y), (high_x, _) = wall.blocks[number].points[[0, 2]]
            if low_y == each.head and low_x < each.left and high_x > each.right:
                lintels.append(number)
            inside = low_x < each.right - 1e-9 and high_x > each.left + 1e-9
            assert not (inside and each.sill - 1e-9 < low_y < each.head - 1e-9)
        assert len(lintels) == 1


def lay_opening(left, right, sill, head, name="opening"):
    return af.shapes.Opening(left=left, breadth=right - left, sill=sill, head=head, name=name)


@pytest.mark.parametrize(
    ("opening", "area"),
    [
        ((-0.45, 0.45, 0.9, 2.7), 17.1),  # its head is a third of a course below the eaves
        pytest.param((-0.45, 0.45, 2.9, 4.1), 17.64, marks=pytest.mark.slow),
        ((-2.3, -1.4, 0.9, 2.1), None),  # beside the edge there is no room for a jamb
        ((1.5, 2.6, 0.9, 2.1), None),
    ],
)
def test_opening_takes_its_area_or_is_refused(opening, area):
    """4.8 m broad, 2.8 m to the eaves and 5 m to the ridge: 18.72 m²."""
    lengths = {"breadth": 4.8, "height": 5.0, "eaves": 2.8, "width": 0.4}
    lengths["openings"] = [lay_opening(*opening)]
    if area is None:
        with pytest.raises(InvalidStructure, match=r"below 2\.3 m from the middle, 0\.2 of a s"):
            af.shapes.wall(**lengths)
        return
    wall = af.shapes.wall(**lengths)
    assert sum(wall.blocks[k].area for k in wall.free) == pytest.approx(area)


def test_stones_far_shorter_than_most_are_named():
    """A pier between two windows is 0.1 m broad, of three courses; one lintel spans both."""
    lengths = {
        "breadth": 6.2,
        "height": 6.1,
        "eaves": 4.2,
        "width": 0.55,
        "course": 0.3,
        "stone": 0.75,
    }
    openings = [lay_opening(-0.7, -0.1, 3.0, 3.9), lay_opening(0.0, 0.7, 3.0, 3.9, "other")]
    says = describe_depths(af.shapes.wall(**lengths, openings=openings)).splitlines()
    assert says[2].startswith("stones shorter than 0.25 of the usual 800 mm")
    assert re.findall(r"\((\d+) mm\)", says[2]) == ["100", "100", "100"]
    # its jambs are 0.25 m from those of the door, which leaves stones of three eighths
    door, window = lay_opening(-0.6, 0.6, 0.0, 2.1), lay_opening(-0.35, 0.35, 3.0, 3.9)
    whole = describe_depths(af.shapes.wall(**lengths, openings=[door, window])).splitlines()
    assert "shorter than" not in "".join(whole)


@pytest.mark.parametrize(("head", "count"), [(2.0, 9), (1.9, 0), (2.1, 0)])
def test_courses_far_less_high_than_most_are_named(head, count):
    """Heads 0.1, 0.2 and 0 m apart; a door's lintel bears on 0.65 and 0.85 m by default."""
    lengths = {"breadth": 8.0, "height": 3.6, "width": 0.65, "course": 0.3, "stone": 0.7}
    openings = [lay_opening(left, left + 1.4, 0.0, 2.1, f"{left}") for left in (-2.7, 1.3)]
    openings.append(lay_opening(-0.45, 0.45, 1.1, head, "window"))
    wall = af.shapes.wall(**lengths, openings=openings)
    low = [x.name for x in wall.blocks if np.ptp(x.points[:, 1]) < 0.14]
    assert len(low) == count
    says = describe_depths(wall)
    words = f"\nstones less high than 0.5 of the usual 300 mm: '{(low or [''])[0]}' (100 mm), "
    assert (words in says) == ("less high" in says) == bool(low)
    assert ("' (100 mm) and 6 more; give nearly equal heads and sills one level" in says) is bool(
        low
    )
    if head == 2.0:
        assert says.endswith(
            "least bearing of a lintel: 425 mm, of 'course 8, stone 5'; most 850 mm"
        )
        # a body on the wall is no stone of it
        roof = {"x": 0.0, "length": 0.6, "weight": 1e3, "centre_of_gravity": 0.05}
        body = af.masonry.carrying(wall, [af.masonry.StandingBody(**roof, name="roof")])
        assert "(100 mm) and 6 more;" in describe_depths(body)


def lay_front(bearing=None, extra=()):
    """A door and two windows below three upper windows on nearly the same axes."""
    places = [(-2.9, 1.0, 0.0, 2.1), (-0.6, 0.9, 0.9, 2.1), (1.6, 0.9, 0.9, 2.1)]
    places += [(left, 0.8, 3.6, 4.7) for left in (-2.8, -0.55, 1.65)]
    openings = [
        af.shapes.Opening(left=x, breadth=b, sill=low, head=high, bearing=bearing, name=f"{k}")
        for k, (x, b, low, high) in enumerate([*places, *extra])
    ]
    lengths = {"breadth": 7.6, "height": 5.4, "width": 0.5, "course": 0.3, "stone": 0.6}
    return lengths | {"openings": openings}


def random_front(seed):
    """Three storeys on one to three axes, with openings of a breadth of each storey."""
    rng = np.random.default_rng(seed)
    breadth, count, openings = rng.uniform(6.0, 9.0), rng.integers(1, 4), []
    axes = ((np.arange(count) + 0.5) / count - 0.5) * (breadth - 1.0)
    for storey, (sill, head) in enumerate([(0.9, 2.1), (3.6, 4.7), (6.3, 7.3)]):
        wide = rng.uniform(0.7, 1.1)
        for k, x in enumerate(axes.tolist()):
            opening = lay_opening(x - wide / 2, x + wide / 2, sill, head, f"{storey}.{k}")
            openings.append(opening if k or storey else replace(opening, sill=0.0))
    sizes = {"breadth": breadth, "height": 8.0, "width": 0.5, "course": 0.3}
    return sizes | {"stone": rng.uniform(0.4, 0.7), "openings": openings}


def measure_bond(wall, openings):
    """Least and longest stone, overlap of head joints, and bearings; from outlines [m]."""
    courses = {}
    for number in wall.free:
        (left, low), (right, _) = (
            wall.blocks[number].points.min(0),
            wall.blocks[number].points.max(0),
        )
        courses.setdefault(round(low, 6), []).append((left, right))
    rows = [sorted(courses[low]) for low in sorted(courses)]
    lengths = [right - left for row in rows for left, right in row]
    heads = [[b for (_, b), (c, _) in pairwise(row) if abs(b - c) < 1e-9] for row in rows]
    overlap = min(abs(x - y) for one, other in pairwise(heads) for x in one for y in other)
    bearings = {}
    for each in openings:
        ((left, right),) = (
            ends
            for ends in courses[round(each.head, 6)]
            if ends[0] < each.left and ends[1] > each.right
        )
        bearings[each.name] = (each.left - left, right - each.right)
        lengths = [x for x in lengths if x != right - left]
    return (min(lengths), max(lengths)), overlap, bearings


@pytest.mark.parametrize(
    "lengths",
    [
        lay_front(),
        lay_front(0.25),
        *(pytest.param(random_front(seed), marks=pytest.mark.slow) for seed in range(8)),
    ],
    ids=["front", "bearing", *(f"seed {seed}" for seed in range(8))],
)
def test_jambs_of_one_storey_leave_the_bond_of_others(lengths):
    """Jambs nearly above one another cut no slivers, and head joints keep a quarter of a stone."""
    wall, stone, openings = af.shapes.wall(**lengths), lengths["stone"], lengths["openings"]
    void = sum(each.breadth * (each.head - each.sill) for each in openings)
    area = sum(wall.blocks[number].area for number in wall.free)
    assert area == pytest.approx(lengths["breadth"] * lengths["height"] - void, rel=1e-12)
    (shortest, longest), overlap, bearings = measure_bond(wall, openings)
    assert shortest > 0.374 * stone
    assert longest < 1.501 * stone
    assert overlap > 0.249 * stone
    assert wall.depths[~wall.heads].min() > 0.249 * stone  # beds of stones below a sill too
    assert min(map(min, bearings.values())) > 0.249 * stone


@pytest.mark.parametrize("is_lintel", [False, True])
def test_a_keystone_between_voussoirs_is_no_lintel(is_lintel):
    """A keystone's joints, 0.6 m high over 0.2 m, are steep; a stone on both walls bears on 2 m."""
    places = {
        "ground": ((-3, -1), (6, -1), (6, 0), (-3, 0)),
        "left": ((-3, 0), (-1, 0), (-1, 1), (-3, 1)),
        "right": ((1, 0), (3, 0), (3, 1), (1, 1)),
        "one": ((4, 0), (5, 0), (5, 1), (4, 1)),
        "other": ((5, 0), (6, 0), (6, 1), (5, 1)),
        "key": ((-3, 1), (3, 1), (3, 2), (-3, 2)),
    }
    if not is_lintel:
        places |= {
            "left haunch": ((-3, 1), (-1, 1), (-0.5, 1.5), (-0.7, 2.1), (-3, 2.1)),
            "right haunch": ((1, 1), (3, 1), (3, 2.1), (0.7, 2.1), (0.5, 1.5)),
            "key": ((-0.5, 1.5), (0.5, 1.5), (0.7, 2.1), (-0.7, 2.1)),
        }
    span = dict.fromkeys(("key", "left haunch", "right haunch"), ("span", "ring"))
    blocks = list[af.Block]()
    for name, outline in places.items():
        part, role = span.get(name, ("wall", "other"))
        own = {"fixed": name == "ground", "part": part, "role": role}
        blocks.append(af.Block(outline, af.STONE, name, **own))
    said = describe_depths(af.masonry.assembled(blocks, CONTACT))
    assert ("least bearing of a lintel: 2000 mm, of 'key'" in said) == is_lintel
    assert ("lintel" in said) == is_lintel


@pytest.mark.slow
def test_lintels_bear_on_the_given_length_or_a_quarter_of_a_stone():
    lengths = lay_front(0.25)
    wall = af.shapes.wall(**lengths)
    *_, bearings = measure_bond(wall, lengths["openings"])
    assert np.array([*bearings.values()]) == pytest.approx(0.25, abs=1e-12)
    assert describe_depths(wall).endswith(
        "\nleast bearing of a lintel: 250 mm, of 'course 17, stone 3'"
    )
    # by default to the next head joints, and half a stone beside jambs that the bond leaves out
    *_, bearings = measure_bond(af.shapes.wall(**lay_front()), lengths["openings"])
    assert np.array([bearings[name] for name in "345"]) == pytest.approx(0.3, abs=1e-12)
    assert np.array([bearings[name] for name in "12"]) == pytest.approx(1.3 / 4, abs=1e-12)
    short = af.shapes.wall(**lay_front(0.08))
    assert re.search(r": 80 mm, of '[^']*', less than the 100 mm of", describe_depths(short))
    broad = lay_front() | {"openings": [lay_opening(-0.8, 0.8, 0.0, 2.1)]}  # from 1.2 m on 150 mm
    broad["openings"] = [replace(broad["openings"][0], bearing=0.12)]
    assert ": 120 mm, of 'course 8, stone 6', less than the 150 mm of" in describe_depths(
        af.shapes.wall(**broad)
    )
    # one lintel spans both sides of a pier of a quarter of a stone
    narrow = [lay_opening(-1.2, -0.4, 3.6, 4.7, "left"), lay_opening(-0.25, 0.6, 3.6, 4.7, "right")]
    narrow = lay_front() | {"openings": [lay_opening(-0.5, 0.5, 0.0, 2.1), *narrow]}
    *_, bearings = measure_bond(af.shapes.wall(**narrow), narrow["openings"])
    assert bearings["left"][1] == pytest.approx(0.15 + 0.85 + bearings["right"][1])
    # lintels that meet have a joint between them; the pier is 1.3 m broad
    lengths = lay_front(0.65) | {"openings": lay_front(0.65)["openings"][:2]}
    *_, bearings = measure_bond(af.shapes.wall(**lengths), lengths["openings"])
    assert np.array([*bearings.values()]) == pytest.approx(0.65, abs=1e-12)


def test_a_course_is_no_taller_than_the_wall():
    """30 m typed for 0.30 m; a course of the whole height is one."""
    with pytest.raises(
        InvalidStructure, match=r"course \[m\] = 30.0 is not between 0 and 2.1: a co"
    ):
        af.shapes.wall(breadth=6.0, height=2.1, width=0.5, course=30.0)
    assert af.shapes.wall(breadth=6.0, height=2.1, width=0.5, course=2.1).heads.any()


@pytest.mark.parametrize(
    ("openings", "head", "eaves"),
    [
        pytest.param([], 0.0, 2.5, marks=pytest.mark.slow),
        pytest.param([(-0.75, 0.25, 0.0)], 2.0, 2.5, marks=pytest.mark.slow),
        ([(0.2, 1.0, 1.0)], 2.0, 2.4),
        pytest.param([(0.2, 1.0, 0.75)], 2.0, 2.4, marks=pytest.mark.slow),
        pytest.param([(-0.5, 0.5, 1.0)], 1.75, 2.5, marks=pytest.mark.slow),
        pytest.param(
            [(-1.9, -0.9, 0.0), (0.4, 1.5, 0.9)], 2.0, 2.5, marks=pytest.mark.slow
        ),  # a door and a window
    ],
)
def test_walls_are_in_running_bond(openings, head, eaves):
    """No head joint is above another, also where a lintel ends; a mirrored wall is the same."""
    walls = []
    for each in (openings, [(-right, -left, sill) for left, right, sill in openings]):
        laid = [lay_opening(*sides, head, f"opening {k}") for k, sides in enumerate(each)]
        lengths = {"breadth": 5.2, "height": eaves + 1.8, "eaves": eaves, "width": 0.4}
        walls.append(af.shapes.wall(openings=laid, **lengths))
    found = [
        np.array([j.ends for j, head in zip(w.joints, w.heads, strict=True) if head]) for w in walls
    ]
    places, low, high = (found[0][:, :, 0].mean(axis=1), *np.sort(found[0][:, :, 1], axis=1).T)
    above = np.isclose(high[:, None], low)
    assert above.any()
    assert np.abs(places[:, None] - places)[above].min() > 0.15
    other = np.sort((found[1].mean(axis=1) * [-1.0, 1.0]).round(6).view(complex), axis=0)
    assert np.allclose(np.sort(found[0].mean(axis=1).round(6).view(complex), axis=0), other)
    for left, right, sill in openings:
        middle, points = (left + right) / 2.0, [block.points for block in walls[0].blocks[1:]]
        (lintel,) = (
            each
            for each in points
            if each[:, 1].min() == head and each[:, 0].min() < middle < each[:, 0].max()
        )
        assert lintel[:, 0].min() < left - 0.2
        assert lintel[:, 0].max() > right + 0.2
        inside = np.array([middle, (sill + head) / 2.0])
        assert not any(
            (b.points.min(0) < inside).all() and (b.points.max(0) > inside).all()
            for b in walls[0].blocks
        )


def test_wall_equals_stones_laid_one_by_one():
    laid = bonded_wall(12)
    wall = af.shapes.wall(breadth=4.0, height=3.0, width=0.4, contact=CONTACT)
    outlines = [
        sorted(tuple(np.round(block.points, 12).ravel()) for block in each.blocks)
        for each in (laid, wall)
    ]
    assert outlines[0] == outlines[1]
    assert len(wall.joints) == len(laid.joints)


@pytest.mark.slow
def test_triangle_slides_at_its_friction():
    # all bed joints reach μ at once, and a triangle overturns at 1.5 B / H = 2.25 g only
    lengths = {"breadth": 1.5, "height": 1.0, "eaves": 0.0, "width": 0.4}
    wall = af.shapes.wall(contact=CONTACT, **lengths)
    found = af.collapse_factor(wall, live=af.BodyForce(1.0), friction="nonassociated")
    assert found.factor == pytest.approx(0.6, rel=1e-6)


def test_case_file_has_openings_by_name(tmp_path):
    wall, *_ = build("two heads")
    af.Analysis(wall, fidelity="rigid").write(tmp_path / "wall.toml")
    text = (tmp_path / "wall.toml").read_text()
    assert 'shape = "wall"' in text
    assert "[structure.openings.window]" in text
    assert af.Case.read(tmp_path / "wall.toml").structure == wall
    varied = af.Case.read(tmp_path / "wall.toml", ["structure.openings.window.sill=2.2"])
    area = sum(varied.structure.blocks[number].area for number in varied.structure.free)
    assert area == pytest.approx(WALLS["two heads"][1] + 1.2 * 0.4, rel=1e-12)


def test_a_floor_weighs_on_the_stones_below_its_bed_by_their_lengths(tmp_path):
    """A floor on 4 m with a door of 1 m through its bed, and a roof along slopes and on a tie."""
    lengths = {"breadth": 4.0, "height": 4.0, "eaves": 2.5, "width": 0.4, "openings": [DOOR]}
    floors = [
        af.shapes.Floor(level=1.5, load=6e3),
        af.shapes.Floor(level=2.5, load=2e3, name="beam"),
        af.shapes.Floor(level=2.5, load=1e3, name="vault"),
        af.shapes.Floor(level=4.0, load=3e3, name="roof"),
    ]
    wall = af.shapes.wall(**lengths, floors=floors)
    bare = af.shapes.wall(**lengths)
    # each has its load on 4 m: the floor on 3 m of stones, slopes by their horizontal lengths
    assert wall.weight - bare.weight == pytest.approx(4.0 * 12e3)
    found = dict.fromkeys(("floor", "beam and vault", "roof"), 0.0)
    for block, plain in zip(wall.blocks, bare.blocks, strict=True):
        (left, low), (right, _), (top_right, high), *rest = block.points
        top = top_right - (rest[0][0] if rest else top_right)
        word, load = {1.5: ("floor", 6e3 * 4.0 / 3.0), 2.5: ("beam and vault", 3e3)}.get(
            high, (None, 0.0)
        )
        load *= top
        if low >= 2.5 and (slope := right - left - top) > 1e-9:
            word, load = "roof", 3e3 * slope
        added = (block.material.unit_weight - plain.material.unit_weight) * block.area * 0.4
        assert added == pytest.approx(load, abs=1e-3)
        assert block.material.stands_for == word
        if word:
            found[word] += added
    assert [*found.values()] == pytest.approx([24e3, 12e3, 12e3])
    path = af.Analysis(wall, fidelity="rigid").write(tmp_path / "wall.toml")
    text = path.read_text()
    assert "[structure.floors.roof]\nlevel = 4.0\nload = 3000.0\n" in text
    assert af.Case.read(path).structure == wall
    path.write_text(text.replace("load = 3000.0", 'load = "3.5 kN/m"'))
    assert af.Case.read(path).structure.weight == pytest.approx(wall.weight + 2e3)


def test_a_bed_is_laid_at_a_floor():
    """Four courses of 0.275 m below it, in place of some of 0.25 m."""
    floor = af.shapes.Floor(level=1.1, load=6e3)
    wall = af.shapes.wall(breadth=4.0, height=2.5, width=0.4, floors=[floor])
    tops = sorted({round(block.points[:, 1].max(), 9) for block in wall.blocks})
    assert tops[:5] == pytest.approx([0.0, 0.275, 0.55, 0.825, 1.1])
    bare = af.shapes.wall(breadth=4.0, height=2.5, width=0.4)
    assert wall.weight - bare.weight == pytest.approx(4.0 * 6e3)


@pytest.mark.parametrize("floor", [{"level": 1.5, "load": 6.0}, {"level": 1.5, "load": -6e3}])
def test_a_floor_weighs_newtons_per_metre(floor):
    with pytest.raises(af.InvalidInput, match=r"'floor': load \[N/m\].*6 kN/m are 6e3"):
        af.shapes.Floor(**floor)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(  # within a course, above eaves at 2.5 m, above the ridge
            (
                {"floors": [af.shapes.Floor(level=level, load=6e3)]},
                rf"'floor' at {level:g} m is at no bed that .* take the nearest, {nearest} m",
            )
            for level, nearest in (
                (0.1, r"0\.250"),
                (3.0, r"2\.500 and 4\.000"),
                (9.0, r"4\.000"),
                (0.0, r"0\.250"),
            )
        ),
        ({"eaves": 4.5}, "eaves"),
        ({"breadth": 0.0}, "breadth"),
        ({"stone": -0.5}, "stone"),
        ({"course": 0.0}, "course"),
        ({"course": 1e-3, "stone": 1e-3}, "courses times stones"),
        ({"openings": [af.shapes.Opening(left=-2.0, breadth=1.0, head=2.0)]}, "room for it"),
        ({"openings": [af.shapes.Opening(left=0.0, breadth=1.0, head=4.0)]}, "no room for it"),
        ({"openings": [replace(DOOR, head=20.0)]}, "the wall is 4 m high, and has no room for it"),
        ({"eaves": None, "openings": [replace(DOOR, head=20.0)]}, "4 m high, and has no room for"),
        (  # a contradiction, and no lack of room
            {"openings": [replace(DOOR, head=1.0, sill=1.5)]},
            r"from 1\.5 to 1 m high: its sill must be below its head",
        ),
        ({"width": 40.0}, r"width \[m\] = 40.0 is not between 0 and 4: a wall is no thicker than"),
        ({"openings": [DOOR, af.shapes.Opening(left=0.0, breadth=0.5, head=1.0)]}, "overlap"),
        (
            {"openings": [DOOR, af.shapes.Opening(left=-0.5, breadth=0.5, sill=2.0, head=2.2)]},
            "lintel",
        ),
        ({"openings": [replace(DOOR, bearing=0.0)]}, r"door: bearing \[m\] = 0.0 is not above 0"),
        (
            {"openings": [replace(DOOR, bearing=1.2)]},
            r"from x = -1\.95 to 1\.45 m, with its bearing, and.*has room",
        ),
        (  # its lintel is below a slope
            {"eaves": 1.9, "openings": [replace(DOOR, left=-0.5, bearing=1.2)]},
            r"below 1\.5\d* m from",
        ),
        (
            {"openings": [replace(DOOR, bearing=0.1), replace(DOOR, left=0.6, breadth=0.4)]},
            r"0\.35 m apart, and bearings of lintels take 0\.225 m.*leave 0\.1875 m for a stone",
        ),
    ],
)
def test_walls_that_cannot_be_built(changes, words):
    lengths = {"breadth": 4.0, "height": 4.0, "eaves": 2.5, "width": 0.4} | changes
    with pytest.raises(af.ArchfemError, match=words):
        af.shapes.wall(**lengths)
