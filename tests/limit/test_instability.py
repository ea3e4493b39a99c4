"""Why a structure does not stand under its own weight, and the values from which it would."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from backfilled import SOIL, retaining_wall

import archfem as af
from archfem.limit import linear_programme
from archfem.limit.instability import (
    describe_friction,
    describe_geometric_factor,
    explain_instability,
    least_friction,
    list_margins_at_rest,
)

STONE = af.STONE


def on_a_bed(outline, *, friction=0.6, tilt=0.0, cohesion=0.0):
    """A block on a fixed one, 1 m broad and tilted [rad]."""
    c, s = np.cos(tilt), np.sin(tilt)
    turn = np.array([[c, s], [-s, c]])
    bed = np.array([[0.0, -0.5], [1.0, -0.5], [1.0, 0.0], [0.0, 0.0]])
    blocks = [
        af.Block(tuple(map(tuple, bed @ turn)), STONE, "bed", fixed=True),
        af.Block(tuple(map(tuple, np.array(outline) @ turn)), STONE, "stone"),
    ]
    return af.masonry.assembled(blocks, af.Contact(1e10, 4e9, friction, cohesion=cohesion))


def value(pattern, text):
    return float(re.search(pattern, text)[1])


def test_a_block_on_a_slope_needs_the_friction_of_its_angle():
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    text = explain_instability(on_a_bed(cube, friction=0.2, tilt=np.arctan(0.35)))
    assert value(r"coefficient of friction of ([\d.]+)", text) == pytest.approx(0.35, rel=0.02)
    assert "no thickness helps" in text
    assert explain_instability(on_a_bed(cube, friction=0.36, tilt=np.arctan(0.35))) is None


@pytest.mark.parametrize(
    ("slope", "friction", "least"),
    [(0.35, 0.6, 0.35), (0.35, np.inf, 0.35), (0.35, 0.3, None), (0.0, 0.6, 0.05)],
)
def test_the_least_friction_of_a_block_on_a_slope(slope, friction, least):
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    stone = on_a_bed(cube, friction=friction, tilt=np.arctan(slope))
    found, words = least_friction(stone), describe_friction(stone)
    if least is None:
        assert (found, words) == (None, "")
    else:
        assert found == pytest.approx(least, rel=0.01)
        assert f"it stands from a coefficient of friction of {least:g}" in words
        assert words.endswith(" or less") == (least == 0.05)


@pytest.mark.parametrize(
    ("slope", "factor"),
    [
        # the weight meets the bed 0.25 m times the slope from the middle of its 1 m
        (0.35, 0.5 / (0.25 * 0.35)),
        (0.05, 20.0),  # and more, which is not sought
        (0.7, None),  # it slides
    ],
)
def test_the_geometric_factor_of_a_block_on_a_slope(slope, factor):
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    stone = on_a_bed(cube, friction=0.6, tilt=np.arctan(slope))
    found = af.limit.geometric_factor(stone)
    if factor is None:
        assert found is None
        return
    assert found == pytest.approx(factor, rel=2e-3)  # of the bisection
    assert ("20 or more" in describe_geometric_factor(stone, np.inf)) == (factor == 20.0)
    # where it crushes, half the depth is the eccentricity and half the stress block
    normal = STONE.unit_weight * 0.5 * np.cos(np.arctan(slope))
    strength = 10.0 * normal
    found = af.limit.geometric_factor(stone, strength)
    crushed = 1.0 / (0.5 * slope + 0.1)
    assert found == pytest.approx(crushed, rel=2e-3)
    # with the strength each number has that without
    hard = f"{factor:.3g}{' or more' * (factor == 20.0)} without crushing"
    words = f"at rest, crushing at {strength / 1e6:.3g} MPa ({hard}): "
    assert value(re.escape(words) + r"([\d.]+),", describe_geometric_factor(stone, strength)) == (
        pytest.approx(crushed, rel=5e-3)  # three digits, and the bisection
    )
    assert "at rest, without crushing: " in describe_geometric_factor(stone, np.inf)
    (depth, of), *_ = list_margins_at_rest(stone, strength)
    assert depth == pytest.approx(crushed, rel=2e-3)
    begin = "the depth of its joints under the same weight, crushing at "
    assert of == f"{begin}{strength / 1e6:.3g} MPa ({hard})"
    with pytest.raises(af.errors.InvalidInput, match="strength"):
        af.limit.geometric_factor(stone, -1.0)


def test_where_a_wall_crushes_most_depths_take_one_programme(monkeypatch):
    """Its lowest bed crushes under γ H; that, its first crushing cuts say, bounds the depth."""
    solved, solve = [], linear_programme.solve_linear
    monkeypatch.setattr(
        linear_programme, "solve_linear", lambda *given: [solved.append(1), solve(*given)][1]
    )
    wall = af.shapes.wall(breadth=3.0, height=1.8, width=0.5, course=0.3, stone=0.5)
    weight = {block.material.unit_weight for block in wall.blocks}.pop()
    found = af.limit.geometric_factor(wall, 8.0 * weight * 1.8)
    assert found == pytest.approx(8.0, rel=2e-3)  # of the bisection
    assert len(solved) < 60  # 38; 178 where each depth has all its cuts


def test_cohesion_of_less_deep_joints_is_less():
    """A block on a slope of 0.8 slides unless c h = W (sin - mu cos)."""
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    pressure = STONE.unit_weight * 0.5 * np.cos(np.arctan(0.8))
    cohesion = 2.0 * pressure * (0.8 - 0.6)
    stone = on_a_bed(cube, friction=0.6, tilt=np.arctan(0.8), cohesion=cohesion)
    found = af.limit.geometric_factor(stone)
    assert found == pytest.approx(2.0, rel=2e-3)  # of sliding: 2.5 of turning


@pytest.mark.slow
def test_the_geometric_factor_of_a_ring_is_that_of_its_thickness():
    """The two weigh a little otherwise, as the corners of a thinner ring are cut less."""
    ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=180.0, voussoirs=10)
    least = af.minimum_thickness(af.masonry.find_ring(ring).with_thickness, tolerance=1e-4)
    assert af.limit.geometric_factor(ring) == pytest.approx(0.2 / least, rel=3e-3)


def test_less_deep_joints_are_a_thinner_ring_of_heavier_stones():
    """Where joints crush, the weight of thinner stones makes the factor on the thickness another.

    Thinner stones as heavy in all as those built stand down to the least depth of joints, but for
    their centroids, which are 0.3 % of it nearer to the middle line.
    """
    given = {"radius": 1.0, "thickness": 0.2, "embrace": 180.0, "voussoirs": 15}
    strength, near = 2e5, 0.005
    depth = af.limit.geometric_factor(af.circular_arch(**given), strength)
    for share in (depth * (1.0 - near), depth * (1.0 + near)):
        for weight, stands in ((share, share < depth), (1.0, True)):
            heavier = replace(STONE, unit_weight=weight * STONE.unit_weight)
            ring = af.masonry.find_ring(af.circular_arch(material=heavier, **given))
            thinner = ring.with_thickness(0.2 / share)
            assert af.stands(thinner, strength=strength) == stands


@pytest.mark.parametrize("slope", [0.1947, 0.344])
def test_a_block_on_a_slope_stands_with_the_friction_that_is_printed(slope):
    """Both are less when rounded to two digits."""
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    words = describe_friction(on_a_bed(cube, friction=0.6, tilt=np.arctan(slope)))
    said = value(r"coefficient of friction of ([\d.]+)", words)
    assert slope <= said < 1.01 * slope
    assert af.stands(on_a_bed(cube, friction=said, tilt=np.arctan(slope)))


@pytest.mark.parametrize(
    "friction",
    [
        0.351,
        pytest.param(0.3604, marks=pytest.mark.slow),
        0.5,
        pytest.param(0.65, marks=pytest.mark.slow),
        np.inf,
    ],
)
def test_the_least_friction_does_not_depend_on_that_given(friction):
    """Of a block on a slope of 0.3504, in thousandths, as from a friction that is too small."""
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    stone, smooth = (on_a_bed(cube, friction=f, tilt=np.arctan(0.3504)) for f in (friction, 0.3))
    assert least_friction(stone) == 0.351
    for words in (describe_friction(stone), explain_instability(smooth)):
        assert value(r"coefficient of friction of ([\d.]+)", words) == 0.351


def test_a_block_that_leans_out_needs_a_bed_up_to_its_centroid():
    """A parallelogram, its centroid 0.8 m from the middle of a bed of half a metre to each side."""
    leaning = [[0.0, 0.0], [1.0, 0.0], [2.6, 2.0], [1.6, 2.0]]
    text = explain_instability(on_a_bed(leaning))
    assert value(r"if they are ([\d.]+) times as deep", text) == pytest.approx(1.6, rel=0.01)
    assert "no friction helps" in text


@pytest.mark.slow
def test_a_smooth_ring_is_not_helped_by_thickness():
    """The message of a failed dead load; by `stands` it holds from the coefficient named."""

    def ring(friction, thickness=0.55):
        return af.circular_arch(
            radius=2.95,
            thickness=thickness,
            embrace=159.0,
            voussoirs=9,
            contact=af.Contact(1e11, 4e10, friction),
        )

    with pytest.raises(af.DidNotConverge, match="no thickness helps") as caught:
        af.dead_load(af.build(ring(0.2), fidelity="rigid"))
    least = value(r"coefficient of friction of ([\d.]+)", str(caught.value))
    assert not af.stands(ring(least - 0.01))
    assert af.stands(ring(least + 0.005))
    assert not af.stands(ring(0.2, 1.5))
    assert "joints hinge (joints " in explain_instability(
        af.circular_arch(radius=2.95, thickness=0.12, embrace=180.0, voussoirs=17)
    )


def test_nothing_holds_a_block_that_hangs():
    """Below a fixed block, it would need tension."""
    hanging = [[0.0, -1.0], [1.0, -1.0], [1.0, -0.5], [0.0, -0.5]]
    text = explain_instability(on_a_bed(hanging))
    assert text.startswith("no compression in its joints can hold 'stone'")


def test_the_joint_that_slides_and_the_block_that_nothing_holds_are_named():
    """A stack on a slope of 0.35, one of its beds smooth; and a second block that hangs."""
    tilt = np.arctan(0.35)
    c, s = np.cos(tilt), np.sin(tilt)

    def cube(low, name, **kind):
        points = np.array([[0.0, low], [1.0, low], [1.0, low + 0.5], [0.0, low + 0.5]])
        turned = points @ np.array([[c, s], [-s, c]])
        return af.Block(tuple(map(tuple, turned)), STONE, name, **kind)

    blocks = [cube(-0.5, "bed", fixed=True), cube(0.0, "low"), cube(0.5, "top")]
    stack = af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.9))
    smooth = replace(stack.joints[1].contact, friction=0.2)
    joints = (stack.joints[0], replace(stack.joints[1], contact=smooth))
    text = explain_instability(replace(stack, joints=joints))
    assert text.startswith(f"joints slide ({joints[1].name}): it stands from")
    assert value(r"coefficient of friction of ([\d.]+)", text) == pytest.approx(0.35, rel=0.02)
    outlines = {"lintel": (-0.5, 0.0), "hanging": (-1.0, -0.5)}
    shifted = [
        af.Block(((3.0, a), (4.0, a), (4.0, b), (3.0, b)), STONE, name, fixed=name == "lintel")
        for name, (a, b) in outlines.items()
    ]
    both = af.masonry.assembled([*blocks[:2], *shifted], af.Contact(1e10, 4e9, 0.9))
    text = explain_instability(both)
    assert text.startswith("no compression in its joints can hold 'hanging'")


def ring_without(*missing, embrace=150.0):
    """A ring of nine stones and two supports without some of its blocks."""
    ring = af.circular_arch(radius=3.0, thickness=0.4, embrace=embrace, voussoirs=9)
    blocks = [block for block in ring.blocks if block.name not in missing]
    return af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.6))


def test_an_arch_without_its_keystone_is_said_to_be_interrupted():
    text = explain_instability(ring_without("voussoir 5", embrace=60.0))
    assert "joints slide (arch, joints 0 and 7) and hinge (" in text
    assert text.endswith("add the stone between them, which may be on an ignored layer")
    for ring in (text, explain_instability(ring_without("voussoir 5"))):
        assert "interrupted, 0." in ring
        assert "m from 'voussoir 4' at " in ring
        assert " to 'voussoir 6': add the stone between them" in ring


def test_a_ring_in_masonry_without_a_voussoir_is_said_to_be_interrupted():
    """Masonry beside it leaves a state of more friction, which is no remedy.

    Between the stones beside it is the chord of a ninth of 64° at the intrados of 2.4 m.
    """
    survey = af.masonry.read_outlines(Path(__file__).parent / "gateway.geojson", snap=6e-3)
    blocks = [block for block in survey.blocks if block.name != "V6r"]
    text = explain_instability(af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.6)))
    assert re.match(
        r"joints slide \(.*\): the ring is interrupted, 0\.298 m from 'V[57]r' at ", text
    )
    assert re.search(r" to 'V[57]r': add the stone between them, which may be on an ign", text)


def test_a_gap_far_below_a_stone_is_a_joint_to_close():
    """The right half, the support too, 30 mm to the right of the left one."""
    whole = af.circular_arch(radius=3.0, thickness=0.4, embrace=150.0, voussoirs=9)
    blocks = [
        replace(b, outline=tuple((x + 0.03, y) for x, y in b.outline), centre=None)
        if b.centroid[0] > 0.1
        else b
        for b in whole.blocks
    ]
    apart = af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.6))
    text = explain_instability(apart)
    assert text.endswith("close the joint between them, by faces that touch")


def test_a_ring_on_one_support_is_named_with_its_end():
    """Without the right support; and without the stone above it, which lies nearer to the end."""
    whole = ring_without()
    right = max((b for b in whole.blocks if b.fixed), key=lambda block: block.centroid[0])
    left = min((b for b in whole.blocks if b.fixed), key=lambda block: block.centroid[0])
    end = "voussoir 9"
    with pytest.raises(af.DidNotConverge, match=f"'{end}' at .* rests on nothing") as caught:
        af.dead_load(af.build(ring_without(right.name), fidelity="rigid"))
    assert f"and only '{left.name}' holds the others: add a support, or" in str(caught.value)
    text = explain_instability(ring_without(end))
    assert "m from 'voussoir 8' at " in text
    assert f" to '{right.name}': add the stone between them" in text
    text = explain_instability(ring_without("voussoir 4", "voussoir 5", "voussoir 6"))
    assert "'voussoir 3' at " in text
    assert "'voussoir 7' at " in text
    assert "rest on nothing: add a support, or the stones that are missing" in text


def bridge_with_ends(above, arch, cover):
    """A bridge whose sidewalls hold the ends of its fill up to some heights above the springing."""
    walls = [
        af.shapes.Sidewall(length=1.5, height=1.0, above=high, state="fixed", name=name)
        for high, name in zip(above, ("left wall", "right wall"), strict=True)
    ]
    fill = af.shapes.Backfill(cover=cover)
    return af.bridge(arches=[arch], sidewalls=walls, backfill=fill)


@pytest.mark.parametrize(
    ("above", "named"),
    [
        pytest.param((0.1, 0.1), True, marks=pytest.mark.slow),
        ((0.9, 0.1), True),
        ((0.9, 0.9), False),
    ],
)
def test_fill_that_falls_out_of_a_free_end_is_held_by_higher_walls(above, named):
    """The end that is named is one with a low wall, and the remedy is one."""
    arch = af.shapes.Arch(span=2.0, rise=0.5, thickness=0.3, voussoirs=5)
    bridge = bridge_with_ends(above, arch, cover=0.4)
    text = explain_instability(af.masonry.jointed_fill(bridge, 0.45, friction_angle=20.0))
    if not named:
        assert text is None
        return
    end = 0.0 if above[0] < 0.5 else max(block.points[:, 0].max() for block in bridge.blocks)
    assert f"; pieces of the fill fall out of its free end at x = {end:.2f} m, which" in text
    assert "thickness" not in text


@pytest.mark.slow
@pytest.mark.parametrize(
    "above",
    [
        *(pytest.param(each, marks=pytest.mark.slow) for each in ((0.1, 1.3), (1.3, 0.1))),
        (1.3, 1.3),
    ],
)
def test_fill_that_opens_and_falls_out_of_a_free_end_is_named_by_the_dead_load(above):
    """Rigid, it stands by cohesion that joints lose as they open; higher walls let it rest."""
    arch = af.shapes.Arch(span=4.0, rise=1.2, thickness=0.35, voussoirs=9)
    bridge = bridge_with_ends(above, arch, cover=0.6)
    cut = af.masonry.jointed_fill(bridge, 0.5, friction_angle=30.0, cohesion=3e3)
    assert af.stands(cut)
    model = af.build(cut, fidelity="rigid")
    if min(above) > 1.0:
        assert af.dead_load(model).steps == 1
        return
    with pytest.raises(af.DidNotConverge) as caught:
        af.dead_load(model)
    end = 0.0 if above[0] < 1.0 else max(block.points[:, 0].max() for block in cut.blocks)
    assert re.search(
        r"^as rigid blocks it stands, but not with joints that open: pieces of the fill move on "
        rf"\(backfill \d+ .*\): pieces of the fill fall out of its free end at x = {end:.2f} m, "
        r"which more cohesion would hold, or a wall as high as the fill \(`above`",
        str(caught.value),
    )


def test_where_a_search_for_equilibrium_stalls_the_least_residual_decides(monkeypatch):
    """A block on a slope of 1 in 4 stands from a coefficient of friction of 0.25."""
    square = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    stone = on_a_bed(square, tilt=np.arctan(0.25))
    monkeypatch.setattr(linear_programme, "STALLED_AFTER", 1e-9)
    assert least_friction(stone) == pytest.approx(0.25, rel=6e-3)  # of the bisection


@pytest.mark.parametrize("active", [1.0, 0.5])
def test_the_geometric_factor_of_a_wall_that_holds_a_fill(active):
    """Rankine's thrust a K_a γ H²/2 at a third of the height, over the weight of the wall."""
    wall, fill = (
        retaining_wall(),
        af.limit.Fill(friction_angle=30.0, mobilisation=0.0, active=active),
    )
    stone = next(block for block in wall.blocks if not block.fixed and block.material is STONE)
    breadth, height = np.ptp(stone.points, axis=0)
    thrust = active / 3.0 * SOIL.unit_weight * height**2 / 2.0
    offset = thrust * height / 3.0 / (STONE.unit_weight * breadth * height)
    found = af.limit.geometric_factor(wall, fill=fill)
    assert found == pytest.approx(0.5 * breadth / offset, rel=2e-3)  # of the bisection
    none = replace(fill, active=0.0)
    assert af.limit.geometric_factor(wall, fill=none) == pytest.approx(100.0)  # and more
    assert "100 or more" in describe_geometric_factor(wall, np.inf, none)
    with pytest.raises(af.errors.InvalidInput, match=r"fill=af\.limit\.Fill"):
        af.limit.geometric_factor(wall)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pressure", "factor"),
    [
        ({"mobilisation": 0.0, "active": 0.0}, 15.65),
        ({"mobilisation": 0.0}, 31.05),
        ({}, 34.98),
        ({"mobilisation": 1.0}, 50.99),
    ],
)
def test_the_geometric_factor_of_a_bridge_with_fill(pressure, factor):
    """That of a linear programme of its own: columns, eight pressures a stone, joints narrowed."""
    walls = [
        af.shapes.Sidewall(length=6.0, height=0.5, above=0.3, state="fixed", name=f"{side} wall")
        for side in ("left", "right")
    ]
    bridge = af.bridge(
        arches=[af.shapes.Arch(span=7.2, rise=2.1, thickness=0.55, voussoirs=29)],
        sidewalls=walls,
        backfill=af.shapes.Backfill(cover=0.353, material=replace(SOIL, unit_weight=18e3)),
        material=replace(STONE, unit_weight=23e3),
    )
    fill = af.limit.Fill(friction_angle=35.0, **pressure)
    # bisections to a thousandth, and the digits of the reference
    assert af.limit.geometric_factor(bridge, fill=fill) == pytest.approx(factor, rel=2e-3)
