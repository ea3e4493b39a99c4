"""Drawn rings with another thickness: Milankovitch's semicircle, faces, and what is no ring."""

import re

import ezdxf
import numpy as np
import pytest
from drawn import draw_portal

import archfem as af
from archfem.masonry import find_ring

MILANKOVITCH = 0.1075
"""Least t/R of a semicircle at its middle line, with hinges at 54.5° from the crown."""


def draw_semicircle(path, stones=66, middle=1.0, depth=0.2, between=2, noise=0.0):
    """Draw a semicircle in millimetres, with points between the corners along both faces."""
    chance = np.random.default_rng(5)
    angles = np.linspace(np.pi, 0.0, stones * (between + 1) + 1)
    faces = [
        (middle + side * depth / 2.0) * np.column_stack([np.cos(angles), np.sin(angles)])
        for side in (-1.0, 1.0)
    ]
    faces = [face + noise * chance.uniform(-1.0, 1.0, face.shape) for face in faces]
    drawing = ezdxf.new(units=ezdxf.units.MM)
    for k in range(stones):
        own = slice(k * (between + 1), (k + 1) * (between + 1) + 1)
        points = 1e3 * np.concatenate([faces[0][own], faces[1][own][::-1]])
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": "RING"})
    for sign in (-1.0, 1.0):
        ends = [face[0 if sign < 0.0 else -1] for face in faces]
        points = 1e3 * np.array([*ends, ends[1] - [0.0, 0.2], ends[0] - [0.0, 0.2]])
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": "ROCK"})
    drawing.saveas(path)
    return path


def read(path, **options):
    layers = {
        "RING": af.masonry.Layer(part="arch", role="ring"),
        "ROCK": af.masonry.Layer(part="rock", role="other", fixed=True),
    }
    return af.masonry.surveyed(path, layers=layers, **options)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0.2, 0.3])
def test_a_drawn_semicircle_needs_what_milankovitch_found(tmp_path, depth):
    drawn = read(draw_semicircle(tmp_path / "arch.dxf", depth=depth))
    ring = find_ring(drawn)
    assert ring.thickness == pytest.approx(depth, rel=1e-6)
    least = af.minimum_thickness(ring.with_thickness, friction=None, tolerance=1e-5)
    assert least == pytest.approx(MILANKOVITCH, abs=1e-4)


def test_joints_have_the_corners_of_their_stones_to_the_last_bit(tmp_path):
    """GEOS 3.14 may take neighbours whose corners differ by round-off for overlaps."""
    path = draw_semicircle(tmp_path / "arch.dxf", 13, 1.7, 0.4, between=0, noise=0.003)
    ring = find_ring(read(path, snap=6e-3))
    for thickness in (0.2, 0.25, 0.3, 0.7):
        alone = ring.with_thickness(thickness)
        for joint in alone.joints:
            for number in joint.blocks:
                assert {joint.intrados, joint.extrados} <= {*alone.blocks[number].outline}


@pytest.mark.slow
def test_noise_of_a_survey_changes_it_by_little(tmp_path):
    path = draw_semicircle(tmp_path / "arch.dxf", 33, 3.0, 0.6, between=0, noise=0.003)
    ring = find_ring(read(path, snap=2e-3))
    least = af.minimum_thickness(ring.with_thickness, friction=None, tolerance=1e-4)
    assert least / 3.0 == pytest.approx(MILANKOVITCH, abs=0.002)  # 6 mm of 322


@pytest.mark.parametrize("thickness", [0.1, 0.2, 0.35])
def test_it_is_the_ring_of_the_same_middle_line(thickness):
    """The radius of a shape is that of its middle line."""
    sizes = {"radius": 1.0, "embrace": 140.0, "voussoirs": 9}
    made = find_ring(af.circular_arch(thickness=0.2, **sizes)).with_thickness(thickness)
    same = af.circular_arch(thickness=thickness, **sizes)
    stones = [same.blocks[k] for k in same.free]
    for block, expected in zip(made.blocks, stones, strict=False):
        assert block.points == pytest.approx(expected.points, abs=1e-12)
        assert block.area == pytest.approx(expected.area)
    for joint, expected in zip(made.joints, same.joints, strict=True):
        assert joint.ends == pytest.approx(expected.ends, abs=1e-12)
    push = [af.collapse_factor(each, live=af.BodyForce(1.0)).factor for each in (made, same)]
    assert push[0] == pytest.approx(push[1], rel=1e-9)


def test_a_ring_on_piers_is_taken_alone():
    sizes = {"radius": 1.5, "thickness": 0.35, "voussoirs": 9, "pier_breadth": 0.7}
    portal = af.arch_on_piers(**sizes, courses=[0.5, 0.5])
    alone = find_ring(portal).with_thickness(0.3)
    assert [block.part for block in alone.blocks] == ["arch"] * 11
    assert [block.fixed for block in alone.blocks] == [False] * 9 + [True] * 2
    assert alone.depths == pytest.approx(0.3)
    old = sum(block.area for block in portal.blocks if block.part == "arch")
    new = sum(alone.blocks[k].area for k in alone.free)
    assert new == pytest.approx(0.3 / 0.35 * old, rel=1e-6)


def test_stones_of_unequal_depth_touch_along_what_is_common():
    def box(left, right, low, high, name, fixed=False):
        corners = [(left, low), (right, low), (right, high), (left, high)]
        return af.Block(corners, af.STONE, name, fixed, part="lintel", role="ring")

    blocks = [
        box(-1.0, 0.0, 0.0, 1.0, "west", fixed=True),
        box(0.0, 1.0, 0.0, 1.0, "one"),
        box(1.0, 2.0, 0.1, 0.9, "two"),
        box(2.0, 3.0, 0.1, 0.9, "three"),
        box(3.0, 4.0, 0.1, 0.9, "east", fixed=True),
    ]
    lintel = af.masonry.assembled(blocks, af.Contact(1e9, 1e9, friction=0.6))
    ring = find_ring(lintel)
    assert ring.thickness == pytest.approx((1.0 + 0.8 + 0.8 + 0.8) / 4.0)
    half = ring.with_thickness(0.5 * ring.thickness)
    assert half.depths == pytest.approx([0.5, 0.4, 0.4, 0.4])
    assert [block.area for block in half.blocks[:3]] == pytest.approx([0.5, 0.4, 0.4])


@pytest.mark.slow
def test_unequal_stones_that_no_longer_touch_do_not_stand(tmp_path):
    """Every second stone of a semicircle is deeper outwards: thin ones miss their neighbours."""
    angles, drawing = np.linspace(np.pi, 0.0, 14), ezdxf.new(units=ezdxf.units.M)

    def draw(angles, inner, outer, layer):
        polar = zip([*angles, *angles[::-1]], [inner, inner, outer, outer], strict=True)
        corners = [(radius * np.cos(angle), radius * np.sin(angle)) for angle, radius in polar]
        drawing.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})

    for k in range(13):
        draw(angles[k : k + 2], 1.0, 1.3 + 0.06 * (k % 2), "RING")
    for end, side in ((0.0, -0.3), (np.pi, 0.3)):
        draw([end, end + side], 0.9, 1.5, "ROCK")
    drawing.saveas(tmp_path / "arch.dxf")
    ring = find_ring(read(tmp_path / "arch.dxf"))
    with pytest.raises(af.InvalidStructure, match="do not touch any more"):
        ring.with_thickness(0.02)
    least = af.minimum_thickness(ring.with_thickness, tolerance=1e-5)
    assert af.stands(ring.with_thickness(least))
    assert not af.stands(ring.with_thickness(0.9999 * least))
    # joints become less deep than the factor says by what neighbours are offset, 30 mm (1 - factor)
    factor = least / ring.thickness
    assert ring.with_thickness(least).depths[1:-1] == pytest.approx(
        0.3 * factor - 0.03 * (1.0 - factor), abs=1e-3
    )


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: find_ring(af.column(breadth=1.0, heights=[1.0])), "there are 0 rings"),
        (lambda: find_ring(ring_of_seven(), part="dome"), "'dome' is no ring"),
        (
            lambda: find_ring(filled()),
            "has 3 joints .*one layer of stones, none missing, that carry nothing else; leave out "
            r"what is on them, for the bare ring: of a bridge by remove = \['structure.backfill'\]",
        ),
        (lambda: find_ring(ring_of_seven()).with_thickness(0.0), "thickness"),
        (lambda: find_ring(ring_of_seven()).with_thickness(2.5), "crosses or touches itself"),
    ],
)
def test_what_is_no_ring_is_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_ring_in_one_or_two_pieces_cannot_hinge(pieces):
    angles = np.linspace(np.pi, 0.0, 19)
    blocks = [af.Block([(-3, -1), (3, -1), (3, 0), (-3, 0)], af.STONE, "rock", fixed=True)]
    for k, own in enumerate(np.split(angles[:18], pieces)):
        own = np.append(own, angles[(k + 1) * 18 // pieces])
        unit = np.column_stack([np.cos(own), np.sin(own)]).round(9)
        corners = [*(1.9 * unit), *(1.5 * unit[::-1])][::-1]
        blocks.append(af.Block(corners, af.STONE, f"piece {k + 1}", part="arch", role="ring"))
    drawn = af.masonry.assembled(blocks, af.Contact(1e9, 1e9, friction=0.6))
    with pytest.raises(af.InvalidInput, match=f"'arch' in {pieces} pieces cannot hinge: draw each"):
        find_ring(drawn)


def test_a_stone_may_be_more_than_twice_as_deep_as_its_neighbours(tmp_path):
    """Its faces end far beyond its joints, whose ends are nearer to the intrados."""

    def deepen(stones):
        stones["RING 6"][2:] *= 2.14 / 1.75  # the extrados of the keystone: 0.69 m for 0.3 m

    ring = find_ring(af.Case.read(draw_portal(tmp_path, change=deepen)).structure)
    (key,) = (block for block in ring.with_thickness(0.15).blocks if block.name == "RING 6")
    assert np.ptp(key.points[:, 1]) == pytest.approx(0.5 * 0.69, abs=0.01)


def test_a_missing_voussoir_is_named_as_a_cause(tmp_path):
    case = draw_portal(tmp_path, change=lambda stones: stones.pop("RING 6"))
    with pytest.raises(af.InvalidInput, match=r"'RING \d' has 1 joints .* of stones, none missing"):
        find_ring(af.Case.read(case).structure)


@pytest.mark.parametrize("longer", [0.0, 2500.0])  # mm, of the lowest courses
def test_piers_on_the_layer_of_the_ring_are_named(tmp_path, longer):
    """In the part of the ring they would be thinned as it is."""

    def lengthen(stones):
        low = stones["SLAB 1"][:, 1].max() + 10.0
        for outline in stones.values():
            outline[outline[:, 1] < low, 1] -= longer

    courses = [f"{side} {k}" for side in ("WEST", "EAST") for k in (1, 2, 3)]
    case = draw_portal(tmp_path, dict.fromkeys(courses, "RING"), lengthen)
    case.write_text(re.sub("(WEST|EAST) = .*\n", "", case.read_text()))
    structure = af.Case.read(case).structure
    west, east = structure.misplaced.values()  # stones from left to right, down the right pier
    sizes = r"45\d mm broad on 'RING {}' and (299|30\d) mm at its other end: .* one of a pier"
    assert re.match(rf"'RING 3' at .*, {sizes.format(2)}", west)
    assert re.match(rf"'RING 15' at .*, {sizes.format(16)}", east)
    if longer:  # beside such a pier the middle of the ring is on the other side
        named = r"joints of 'RING 1' do not cross it .* give stones of piers a part of their own"
        with pytest.raises(af.InvalidInput, match=named):
            find_ring(structure).with_thickness(0.2)


def ring_of_seven():
    return af.circular_arch(radius=1.0, thickness=0.2, embrace=140.0, voussoirs=7)


def filled():
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=7)
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3))
