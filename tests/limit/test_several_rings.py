"""Arches and walls of several leaves that slide on each other, by the joints between them."""

from itertools import pairwise

import numpy as np
import pytest

import archfem as af

ROUGH = 0.6


def leaf_of(block):
    return block.name.partition(",")[0]


def assemble(blocks, friction):
    """Assemble blocks with a friction of their own between leaves."""

    def contact(one, other):
        between = {leaf_of(one), leaf_of(other)}
        mu = friction if len(between) == 2 and "support" not in between else ROUGH
        return af.Contact(1.48e9, 0.3e9, friction=mu)

    return af.masonry.assembled(blocks, contact)


def arch_of_rings(rings, friction, stones=12, radius=3.0, thickness=0.6, embrace=140.0):
    """Build concentric rings whose joints are in line."""
    half = np.radians(embrace / 2.0)
    angles = np.pi / 2.0 + np.linspace(half, -half, stones + 1)
    levels = radius + thickness * (np.arange(rings + 1) / rings - 0.5)

    def point(level, angle):
        return (float(level * np.cos(angle)), float(level * np.sin(angle)))

    blocks = []
    for k, (angle, sense) in enumerate(((angles[0], 1.0), (angles[-1], -1.0))):
        out = 0.3 * sense * np.array([-np.sin(angle), np.cos(angle)])
        inner, outer = np.array(point(levels[0], angle)), np.array(point(levels[-1], angle))
        corners = [inner, outer, outer + out, inner + out][:: int(sense)]
        outline = tuple(tuple(map(float, corner)) for corner in corners)
        blocks.append(af.Block(outline, af.STONE, f"support, {k}", fixed=True))
    for ring in range(rings):
        below, above = levels[ring : ring + 2]
        for k, (left, right) in enumerate(pairwise(angles)):
            outline = [(below, left), (below, right), (above, right), (above, left)]
            name = f"ring {ring}, stone {k}"
            blocks.append(af.Block(tuple(point(*each) for each in outline), af.STONE, name))
    return assemble(blocks, friction)


@pytest.mark.parametrize("leaves", [1, 2, 3])
def test_leaves_without_friction_topple_one_by_one(leaves):
    """Each turns about its own toe at b / (n h), for any pressure from behind."""
    width, height = 0.9 / leaves, 2.7
    blocks = [
        af.Block(((-1.0, -0.5), (2.0, -0.5), (2.0, 0.0), (-1.0, 0.0)), af.STONE, "support", True)
    ]
    for k in range(leaves):
        left, right = k * width, (k + 1) * width
        outline = ((left, 0.0), (right, 0.0), (right, height), (left, height))
        blocks.append(af.Block(outline, af.STONE, f"leaf {k}"))
    found = af.collapse_factor(assemble(blocks, 0.0), live=af.BodyForce(1.0))
    assert found.factor == pytest.approx(width / height, rel=1e-7)


@pytest.mark.slow
def test_rings_that_do_not_slide_carry_a_load_as_one():
    load = af.PointLoad(1.2, (0.0, -1e3))
    single = af.collapse_factor(arch_of_rings(1, ROUGH), live=load).factor
    by_friction = [
        af.collapse_factor(arch_of_rings(2, mu), live=load).factor for mu in (0.0, 0.3, 0.6, None)
    ]
    assert np.all(np.diff(by_friction) > 0.0)
    assert by_friction[-1] == pytest.approx(single, rel=1e-7)
    # rings that slide freely: less than half of the single ring, since capacity grows as depth
    # squared and more; without dilatancy rough rings lie between
    assert by_friction[0] < 0.5 * single
    slides = af.collapse_factor(arch_of_rings(2, 0.6), live=load, friction="nonassociated")
    assert by_friction[0] < slides.factor <= by_friction[2] * (1.0 + 1e-9)


@pytest.mark.slow
def test_a_bridge_of_two_rings_is_rated_as_one_only_where_they_cannot_slide():
    single, held, loose, smooth = (
        af.rate(arch_of_rings(rings, friction), "LM1").factor
        for rings, friction in ((1, ROUGH), (2, None), (2, ROUGH), (2, 0.0))
    )
    assert held == pytest.approx(single, rel=1e-6)  # the tolerance of the programmes
    assert smooth < 0.9 * loose < 0.8 * single
