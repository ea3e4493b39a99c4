"""A picture in which each joint has its name."""

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from bonded import bonded_wall
from matplotlib.backends.backend_agg import FigureCanvasAgg

import archfem as af
from archfem.cases.analysis_keys import LimitAnalysis
from archfem.cases.report.sections import _draw_assessed
from archfem.cases.result_text import describe_collapse, describe_run
from archfem.view import draw_envelope, draw_names, draw_structure
from archfem.view.structure import draw_dimensions, list_numbers
from archfem.view.style import limit_width, short_name


def test_short_names():
    assert short_name("main arch, joint 5", "main arch") == "5"
    assert short_name("north pier, base", "north pier") == "base"
    assert short_name("joint 5", "arch") == "5"
    assert short_name("left bed", "pier") == "left bed"


def written(figure):
    """Words of a picture of names, with the boxes that they take on the page."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return [(note.get_text(), note) for note in figure.axes[0].texts]


def test_every_third_judged_joint_of_a_bridge_is_named(bridge):
    """Those to the soil are not; each name stands near the intrados end of its own joint.

    The bridge is 30 m long: on a page there is no room for all, and in piers for every second.
    """
    notes = written(draw_names(bridge))
    judged = [joint for joint, own in zip(bridge.joints, bridge.judged, strict=True) if own]
    words = [word for word, _ in notes]
    parts = dict.fromkeys(joint.part for joint in judged)
    every = {part: 2 if "pier" in part else 3 for part in parts}
    named = [j for part in parts for j in [j for j in judged if j.part == part][:: every[part]]]
    assert sorted(words) == sorted([*parts, *(short_name(j.name, j.part) for j in named)])
    places = np.array([note.xy for word, note in notes if word not in parts])
    assert places == pytest.approx(np.array([joint.intrados for joint in named]))


@pytest.mark.parametrize(
    "voussoirs", [9, *(pytest.param(n, marks=pytest.mark.slow) for n in (17, 60))]
)
def test_names_of_a_ring_are_legible(voussoirs):
    """Each is upright, as a turned 6 may be a 9, and on no other; none is below 7 points."""
    ring = af.circular_arch(radius=2.95, thickness=0.3, embrace=159.0, voussoirs=voussoirs)
    figure = draw_names(ring)
    notes = [note for _, note in written(figure)]
    # 60 stones are too near to one another: every second joint
    assert len(notes) == (31 if voussoirs == 60 else voussoirs + 1)
    assert min(note.get_fontsize() for note in notes) >= 7.0
    transform = figure.axes[0].transData
    places = transform.transform([note.xy for note in notes]) * 72.0 / figure.dpi
    lines = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert lines.min() > 1.2 * max(note.get_fontsize() for note in notes)
    assert all(note.get_rotation() == 0.0 for note in notes)
    boxes = [note.get_window_extent() for note in notes]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_no_name_is_written_over_another_in_the_figures_of_a_report():
    """A portal on piers, and two spans with a pier and sidewalls, as wide as reports draw them."""
    arches = {"thickness": 0.5, "voussoirs": 15, "span": 5.0, "rise": 1.8}
    tables = {
        "shape": "bridge",
        "arches": {"left arch": arches, "right arch": arches},
        "piers": {"breadth": 1.7, "height": 2.0, "course": 0.5, "pier": {}},
        "sidewalls": {"length": 2.5, "height": 2.0, "above": 1.0, "course": 0.5, "left wall": {}},
    }
    tables["sidewalls"] |= {"state": "fixed", "right wall": {}}
    spans = af.Case.of({"structure": tables}).structure
    portal = af.arch_on_piers(
        radius=1.5, thickness=0.4, voussoirs=9, courses=[0.5] * 4, pier_breadth=0.8
    )
    for structure, width in ((spans, 128.0), (spans, 84.0), (portal, 84.0)):
        with limit_width(width):
            figure = draw_names(structure)
        notes = written(figure)
        boxes = [note.get_window_extent() for _, note in notes]
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
        if structure is spans:
            assert {"left arch", "right arch", "pier"} <= {word for word, _ in notes}
        # stones, which texts name, stand between joints that the figure names
        middle = next(x for x in list_numbers(structure) if " is between " in x)
        stone, _, sides = middle.partition(" is between ")
        own = [j for j in structure.joints if stone in [structure.blocks[k].name for k in j.blocks]]
        assert [joint.name for joint in own] == sides.split(" and ")


def test_names_of_bases_stand_above_the_ground(bridge):
    figure = draw_names(bridge)
    figure.draw_without_rendering()
    feet = [note for word, note in written(figure) if word == "base"]
    assert len(feet) > 1
    for note in feet:
        ground = figure.axes[0].transData.transform(note.xy)[1]
        # the letters have room for descenders below them
        box = note.get_window_extent()
        assert box.y0 + 0.25 * box.height > ground


# a ring without anything above it
PIERS = af.Case.of(
    {
        "structure": {
            "shape": "bridge",
            "arches": {"arch": {"span": 4.0, "rise": 1.5, "thickness": 0.5, "voussoirs": 9}},
        }
    }
).structure


@pytest.mark.slow
def test_long_names_are_numbered_and_the_name_of_a_ring_keeps_off_a_deck(bridge):
    """Two posts and a lintel: names of both stones would be written over each other."""
    rows = (("left upper drum", 0.0, 0.6, 0.0, 2.4), ("right upper drum", 2.2, 2.8, 0.0, 2.4))
    rows += (("lintel", 0.0, 2.8, 2.4, 2.9), ("ground", -1.0, 3.8, -0.5, 0.0))
    blocks = [
        af.Block(
            ((a, c), (b, c), (b, d), (a, d)),
            *(af.STONE, name, name == "ground"),
            part=name,
            role="ring" if name == "lintel" else "other" if name == "ground" else "pier",
        )
        for name, a, b, c, d in rows
    ]
    portal = af.masonry.assembled(blocks, af.Contact(1.48e9, 0.3e9, friction=0.6))
    figure = draw_names(portal)
    words = [word for word, _ in written(figure)]
    assert {"0", "1"} <= set(words)
    assert not any("to lintel" in word for word in words)
    note = " ".join(figure.get_suptitle().split())
    assert "lintel: 0 left upper drum to lintel, 1 right upper drum to lintel" in note
    names = {word: note.xy[1] for word, note in written(draw_names(bridge))}
    for ring in {block.part for block in bridge.blocks if block.role == "ring"}:
        ends = [y for joint in bridge.joints if joint.part == ring for _, y in joint.ends]
        assert names[ring] < min(ends) + 0.02
    names = {word: note.xy[1] for word, note in written(draw_names(PIERS))}
    assert names["arch"] > max(joint.ends[0][1] for joint in PIERS.joints)


def bonded(courses=6):
    """A wall in running bond, whose joints are named after both stones."""
    blocks = [
        af.Block(
            ((-1.0, -0.5), (4.0, -0.5), (4.0, 0.0), (-1.0, 0.0)),
            af.STONE,
            "ground",
            fixed=True,
            part="ground",
            role="other",
        )
    ]
    for k in range(courses):
        ends = [0.0, *np.arange(0.5 - 0.25 * (k % 2), 3.0, 0.5), 3.0]
        for a, b in pairwise(ends):
            corners = ((a, 0.25 * k), (b, 0.25 * k), (b, 0.25 * (k + 1)), (a, 0.25 * (k + 1)))
            name = f"course {k + 1}, stone {len(blocks)}"
            blocks.append(af.Block(corners, af.STONE, name, part="wall", role="pier"))
    return af.masonry.assembled(blocks, af.Contact(1.48e9, 0.3e9, friction=0.6))


def test_stones_of_a_wall_in_bond_are_numbered():
    wall = bonded()
    figure = draw_names(wall)
    notes = written(figure)
    assert [word for word, _ in notes] == [str(k) for k in wall.free]
    boxes = [note.get_window_extent() for _, note in notes]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    title = figure.axes[0].get_title()
    assert "numbers of stones" in title.replace("\n", " ")


@pytest.mark.slow
def test_numbers_of_stones_beside_those_of_joints_are_marked():
    """A column beside a wall in bond, whose joints are named 0, 1 and so on."""
    wall = bonded()
    stones = [
        af.Block(((3.5, k), (3.9, k), (3.9, k + 1), (3.5, k + 1)), af.STONE, f"c{k}", part="c")
        for k in range(2)
    ]
    stones = [replace(stone, role="pier") for stone in stones]
    both = af.masonry.assembled([*wall.blocks, *stones], af.Contact(1.48e9, 0.3e9, friction=0.6))
    figure = draw_names(both)
    words = [word for word, _ in written(figure)]
    marked = [word for word in words if word.startswith("#")]
    assert marked == [f"#{k}" for k in wall.free]
    assert len({*words}) == len(words)
    assert "; #" in figure.axes[0].get_title()


@pytest.mark.parametrize("end", ["", ", named at length"])
def test_stones_beside_a_gable_in_bond_have_their_names_where_these_are_short(end):
    """Results call joints of the gable after its stones; joints of ring and piers have numbers."""
    blocks = [*bonded(2).blocks]
    blocks[1:] = [replace(block, part="gable", role="other") for block in blocks[1:]]
    for side, x in (("L", 4.0), ("R", 6.0)):
        feet = ((x, -0.5), (x + 0.5, -0.5), (x + 0.5, 0.0), (x, 0.0))
        own = {"part": f"{side} pier", "role": "pier"}
        blocks.append(af.Block(feet, af.STONE, f"{side} foot", fixed=True, **own))
        shaft = [(a, y + 0.5 + 0.5 * k) for k in range(3) for a, y in feet]
        blocks += [af.Block(shaft[4 * k : 4 * k + 4], af.STONE, "s", **own) for k in range(3)]
    blocks = [replace(b, name=b.name if b.fixed else f"S{k}{end}") for k, b in enumerate(blocks)]
    wall = af.masonry.assembled(blocks, af.Contact(1.48e9, 0.3e9, friction=0.6))
    assert wall.heads.any()
    figure = draw_names(wall)
    words = [word for word, _ in written(figure)]
    stones = {wall.blocks[k].name for k in wall.free}
    assert stones.intersection(words) == (set() if end else stones)
    assert {"base", "2", "L pier", "R pier"} <= {*words}
    title = figure.axes[0].get_title().replace("\n", " ")
    assert "numbers of stones" not in title
    assert ("names of stones" in title) == (not end)
    caption = _draw_assessed(wall).caption
    named = "" if end else " and the names of stones"
    assert caption.startswith(f"The structure, 1 m thick, with its assessed joints{named}")
    assert ("; S" in caption) == bool(end)  # else a stone is named by its joints


@pytest.mark.slow
def test_small_stones_at_a_slope_have_no_number_and_all_others_do():
    wall = bonded(courses=6)
    tips = [
        af.Block(
            ((x, 1.5), (x + 0.05, 1.5), (x, 1.55)), af.STONE, f"tip, {x}", part="wall", role="pier"
        )
        for x in (0.1, 2.1)
    ]
    wall = af.masonry.assembled([*wall.blocks, *tips], af.Contact(1.48e9, 0.3e9, friction=0.6))
    words = [word for word, _ in written(draw_names(wall))]
    assert words == [str(k) for k in wall.free if not wall.blocks[k].name.startswith("tip")]


def test_walls_in_bond_have_points_of_thrust_and_no_line():
    wall = bonded()
    dead = af.dead_load(af.build(wall, fidelity="rigid"))
    labels = {line.get_label() for line in draw_structure(wall, dead.joints).axes[0].lines}
    assert "thrust at a joint" in labels
    assert "thrust line" not in labels


def test_a_wall_has_its_assessed_joints_alone_in_pictures_and_the_worst_in_a_table():
    wall = bonded()
    shake = af.Motion(2.0 * np.sin(40.0 * np.arange(0.0, 0.1, 0.005)), 0.005)
    run = af.time_history(af.build(wall, fidelity="rigid"), shake, dt=0.005)
    axes = draw_envelope({"quake": run}).axes[0]
    judged, heights = int(wall.judged.sum()), wall.middles[:, 1].round(6)
    axes.figure.canvas.draw()
    # a joint of each bed at 0, 0.25, … m: that of its largest |e|
    labels = [text.get_text() for text in axes.get_xticklabels()]
    assert labels == ["0", "0.25", "0.5", "0.75", "1", "1.25"]
    largest = abs(run.joints["eccentricity"]).max("time").fillna(0.5).values
    lines = [each.get_ydata() for each in axes.lines if len(each.get_ydata()) == 6]
    drawn = np.nan_to_num(np.abs(lines[:2]).max(axis=0), nan=0.5)
    wanted = [largest[wall.judged & (heights == float(label))].max() for label in labels]
    assert drawn == pytest.approx(wanted)
    assert "height of the bed" in axes.get_xlabel()
    dead = run.joints.isel(time=0)
    whole, brief = (describe_run(wall, run, dead, *count) for count in ((), (20,)))
    assert whole.count(" to course ") - brief.count(" to course ") >= judged - 20 - 10
    assert f"20 of {judged} joints, those of the largest |e|: summary.txt has all" in brief
    size = abs(run.joints["eccentricity"]).max("time").where(wall.judged, 0.0)
    assert f"\n{run.joints['name'].values[int(size.values.argmax())]} " in brief


def test_a_wall_that_slides_has_one_of_many_mechanisms():
    said = " (one of many: all bed joints reach μ), at "
    for friction, slides in ((0.3, True), (4.0, False)):
        wall = bonded()
        joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in wall.joints]
        wall = replace(wall, joints=tuple(joints))
        limit = LimitAnalysis((af.BodyForce(1.0),), "coulomb")
        text = describe_collapse(wall, limit.solve(wall), limit)
        assert (said in text) == slides
        push = 0.9 * limit.solve(wall).factor  # a motion that tests the answer
        assert text.splitlines()[-1] == (
            "blocks are rigid, and elastic joints may bear less: hold a push of "
            f"{push:.3g} g, a tenth below, by [motion] held"
        )


def test_joints_of_a_wedge_that_turn_and_slide_are_counted_as_both():
    """The picture has those that turn clearly, and all that slide."""
    wall, limit = bonded_wall(9, half=1.0), LimitAnalysis((af.BodyForce(1.0),), "coulomb")
    found = limit.solve(wall)
    text = describe_collapse(wall, found, limit)
    turns, slides = {k for k, _ in found.hinges}, set(found.sliding)
    drawn = f"{len(turns)} joints, drawn in the picture where they turn clearly"
    assert f"\nhinges, by the face in contact: {drawn}\n" in text
    both = f"{len(slides)} joints, {len(turns & slides)} of which hinge too, drawn in the picture"
    assert f"\nsliding: {both}\n" in text
    assert f"hinges: {drawn}; sliding: " in str(found)


def test_length_and_height_of_a_wall_are_drawn_beside_it():
    """Not those of the ground below it."""
    wall = af.shapes.wall(breadth=4.0, height=3.0, width=0.5, course=0.5, stone=1.0)
    figure = draw_names(wall)
    draw_dimensions(figure.axes[0], wall)
    notes = {word: note.get_position() for word, note in written(figure)}
    (x, above), (beside, y) = notes["4 m"], notes["3 m"]
    middle = np.mean([wall.blocks[k].centroid[0] for k in wall.free])
    assert (x, y) == pytest.approx((middle, 1.5), abs=1e-9)
    assert above > 3.0
    assert beside > x + 2.0
