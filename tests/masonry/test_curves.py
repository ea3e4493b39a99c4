"""Rings along other curves: closed forms of their lengths and areas, and least thicknesses."""

from math import acos, atan2, cos, pi, sin, sqrt, tan

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.special import ellipe

import archfem as af
from archfem.masonry import shapes

CHORDS = 2e-4
"""Area that faces in chords of 1/40 of the curve lack: π²/6 of its turn's square, or less."""


def area(structure):
    return sum(block.area for block in structure.blocks if not block.fixed)


@pytest.mark.parametrize("voussoirs", [10, 11])
def test_lengths_and_area_of_a_pointed_arch(voussoirs):
    span, rise, thickness = 4.0, 3.0, 0.5
    ring = shapes.pointed_arch(
        span=span, rise=rise, thickness=thickness, voussoirs=voussoirs, chords=80 // voussoirs
    )
    assert np.ptp(ring.ends[[0, -1], 0, 0]) == pytest.approx(span, rel=1e-12)
    inner = (span**2 / 4 + rise**2) / span
    outer, centre = inner + thickness, inner - span / 2
    whole = [  # half the area under an arc, from its springing to the crown
        0.5 * (size**2 * acos(centre / size) - centre * sqrt(size**2 - centre**2))
        for size in (inner, outer)
    ]
    assert area(ring) == pytest.approx(2.0 * (whole[1] - whole[0]), rel=5 * CHORDS)
    tops = [points.max(axis=0)[1] for points in (b.points for b in ring.blocks)]
    assert max(tops) == pytest.approx(sqrt(outer**2 - centre**2), rel=1e-12)
    crown = ring.joints[voussoirs // 2]
    if voussoirs % 2 == 0:
        assert crown.intrados == pytest.approx((0.0, rise), abs=1e-12)
        assert crown.depth > thickness
    assert ring.ends[::-1] * (-1.0, 1.0) == pytest.approx(ring.ends, abs=1e-12)  # symmetric


def test_lengths_and_area_of_an_elliptical_arch():
    span, rise, thickness = 6.0, 1.8, 0.5
    ring = shapes.elliptical_arch(span=span, rise=rise, thickness=thickness, voussoirs=13, chords=8)
    length = span / 2 * 2.0 * ellipe(1.0 - (rise / (span / 2)) ** 2)
    parallel = thickness * length + 0.5 * pi * thickness**2  # turns by π from end to end
    assert area(ring) == pytest.approx(parallel, rel=5 * CHORDS)
    assert ring.depths == pytest.approx(thickness, rel=1e-12)
    x, y = ring.ends[:, 0].T
    assert (2 * x / span) ** 2 + (y / rise) ** 2 == pytest.approx(1.0, rel=1e-12)
    slope = np.column_stack([y * (span / 2) ** 2, -x * rise**2])  # along the ellipse
    assert np.sum(slope * ring.tangents, axis=1) == pytest.approx(0.0, abs=1e-12)


def test_a_flat_arch_and_its_thrust():
    span, height, angle = 2.0, 0.5, 20.0
    arch = shapes.flat_arch(span=span, thickness=height, voussoirs=6, skewback=angle)
    more = height * tan(np.radians(angle))
    assert area(arch) == pytest.approx(height * (span + more), rel=1e-12)
    dead = af.dead_load(af.build(arch, fidelity="rigid"))
    crown, foot = (dead.joints.isel(joint=k) for k in (3, 0))
    places = [
        arch.middles[k] + float(each["eccentricity"]) * arch.depths[k] * arch.tangents[k]
        for k, each in ((3, crown), (0, foot))
    ]
    half = arch.blocks[1:4]
    weights = np.array([block.area * block.material.unit_weight for block in half])
    arms = np.array([block.centroid[0] for block in half]) - places[1][0]
    thrust, rise = float(crown["N"]), places[0][1] - places[1][1]
    assert thrust * rise == pytest.approx(weights @ arms, rel=1e-6)  # of the solver
    horizontal = float(foot["N"]) * cos(np.radians(angle)) - abs(float(foot["V"])) * sin(
        np.radians(angle)
    )
    assert abs(horizontal) == pytest.approx(thrust, rel=1e-6)


def test_an_arch_along_points_of_a_circle_is_that_of_the_circle():
    angles = np.radians(90.0 + 75.0 * np.linspace(1.0, -1.0, 801))
    points = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    expected = af.circular_arch(radius=3.2, thickness=0.4, embrace=150.0, voussoirs=9, chords=4)
    for given in (points, points[::-1]):
        ring = shapes.arch_along(given, thickness=0.4, voussoirs=9)
        assert ring.ends == pytest.approx(expected.ends, abs=1e-5)  # chords of 800 pieces
    assert af.stands(ring)


def thinnest(rise, sections=400):
    """Least thickness of a pointed arch of span 2 by lines of thrust, without blocks.

    Half the arch is cut at angles from the springing to the crown; the crown bears H at a height of
    K / H. The thrust must pass each radial section between intrados and extrados.
    """
    inner = (1.0 + rise**2) / 2.0
    centre, low, high = inner - 1.0, 1e-3, 1.0
    while high - low > 1e-5:
        thickness = 0.5 * (low + high)
        outer = inner + thickness
        top, last = atan2(rise, centre), acos(centre / outer)
        edges = np.linspace(0.0, last, 20 * sections + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        near = np.maximum(inner, centre / np.cos(middles))
        step = edges[1]
        weights = 0.5 * (outer**2 - near**2) * step
        moments = centre * weights - np.cos(middles) * (outer**3 - near**3) / 3.0 * step
        above = [np.cumsum(each[::-1])[::-1] for each in (weights, moments)]
        at = np.flatnonzero(edges[:-1] <= top)[::20]
        weight, moment = (each[at] for each in above)
        rows, bounds = [[rise, -1.0], [-sqrt(outer**2 - centre**2), 1.0]], [0.0, 0.0]
        for size, side in ((inner, 1.0), (outer, -1.0)):
            x, y = centre - size * np.cos(edges[at]), size * np.sin(edges[at])
            rows += np.column_stack([side * y, np.full_like(y, -side)]).tolist()
            bounds += (-side * (moment - weight * x)).tolist()
        found = linprog([0.0, 0.0], A_ub=rows, b_ub=bounds, bounds=[(0, None), (None, None)])
        low, high = (low, thickness) if found.status == 0 else (thickness, high)
    return high


@pytest.mark.slow
def test_stones_of_a_pointed_arch_meet_at_the_crown_whatever_their_number():
    for voussoirs in range(2, 62, 2):
        ring = shapes.pointed_arch(span=2.0, rise=4.0, thickness=0.3, voussoirs=voussoirs)
        crown = ring.joints[voussoirs // 2]
        assert np.array([crown.intrados, crown.extrados])[:, 0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("rise", [sqrt(3.0), 1.3])
def test_least_thickness_of_a_pointed_arch_by_lines_of_thrust(rise):
    """The more joints, the more of the sections bind: 40 stones lack half a per cent of it."""
    found = af.minimum_thickness(
        lambda t: shapes.pointed_arch(span=2.0, rise=rise, thickness=t, voussoirs=40),
        friction=None,
        tolerance=1e-3,
    )
    assert found == pytest.approx(thinnest(rise), rel=0.015)
    assert found < thinnest(rise)


@pytest.mark.parametrize(
    "shape",
    [pytest.param(shapes.pointed_arch, marks=pytest.mark.slow), shapes.elliptical_arch],
)
def test_a_semicircle_by_any_shape_has_its_least_thickness(shape):
    """t/R = 0.1075 of the centre line: Milankovitch (1907)."""
    least = af.minimum_thickness(
        lambda t: shape(span=2.0, rise=1.0, thickness=t, voussoirs=40),
        friction=None,
        tolerance=1e-4,
    )
    assert least / (1.0 + least / 2.0) == pytest.approx(0.1075, abs=1e-4)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: shapes.pointed_arch(span=4, rise=1.9, thickness=0.4, voussoirs=9), "no pointed"),
        (
            lambda: shapes.elliptical_arch(span=4, rise=0, thickness=0.4, voussoirs=9),
            r"rise \[m\] = 0 is not between",
        ),
        (
            lambda: shapes.elliptical_arch(span=4, rise=1, thickness=0.4, voussoirs=0),
            "whole number",
        ),
        (lambda: shapes.flat_arch(span=2, thickness=0.4, voussoirs=7, skewback=0.35), "radians"),
        (lambda: shapes.flat_arch(span=2, thickness=0.4, voussoirs=7, skewback=80), "try 20"),
        (
            lambda: shapes.flat_arch(span=5e-324, thickness=0.4, voussoirs=7, skewback=20),
            "two corners beside each other",
        ),
        (lambda: shapes.arch_along([(0, 0), (1, 1)], thickness=0.1, voussoirs=3), "at least three"),
        (lambda: shapes.arch_along("abc", thickness=0.1, voussoirs=3), "not a row of values"),
    ],
)
def test_invalid_arches_are_refused(make, says):
    with pytest.raises((af.InvalidStructure, af.InvalidInput), match=says):
        make()


LENGTHS = {"span": 4.0, "thickness": 0.5, "voussoirs": 5}
RINGS = {
    "pointed": lambda n: shapes.pointed_arch(rise=3.0, chords=n, **LENGTHS),
    "elliptical": lambda n: shapes.elliptical_arch(rise=1.5, chords=n, **LENGTHS),
    "flat": lambda n: shapes.flat_arch(skewback=20.0, **LENGTHS),
    "along": lambda n: shapes.arch_along(
        [(-2.0, 0.0), (-1.0, 1.2), (0.0, 1.6), (1.0, 1.2), (2.0, 0.0)],
        thickness=0.5, voussoirs=5, chords=n,
    ),
    "circular": lambda n: shapes.circular_arch(
        radius=2.0, thickness=0.5, embrace=150.0, voussoirs=5, chords=n
    ),
    "sectors": lambda n: shapes.circular_arch(
        radius=2.0, thickness=0.5, embrace=150.0, voussoirs=5
    ),
}  # fmt: skip


@pytest.mark.parametrize("chords", [1, 2, 3])
@pytest.mark.parametrize("kind", RINGS)
def test_corners_of_stones_are_the_ends_of_their_joints(kind, chords):
    """The first and third side along the faces, the others on the joints; anticlockwise."""
    ring = RINGS[kind](chords)
    for number in ring.free:
        block = ring.blocks[number]
        a, b, c, d = block.points[list(block.corners)]
        own = [joint for joint in ring.joints if number in joint.blocks]
        found = {frozenset(map(tuple, joint.ends.round(9).tolist())) for joint in own}
        beds = {frozenset(map(tuple, np.round(each, 9).tolist())) for each in ([b, c], [d, a])}
        assert found == beds
        least = 4 if kind in ("flat", "sectors") else 2 * (chords + 1)
        assert len(block.outline) == least or kind == "pointed"  # its keystone has more
        turn = (b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0]
        assert turn > 0.0


@pytest.mark.parametrize("kind", RINGS)
def test_abutments_lie_behind_the_springings(kind):
    """Half as deep as the first joint, and as broad as theirs."""
    ring = RINGS[kind](2)
    deep = 0.5 * ring.depths[0]
    for joint, name in ((ring.joints[0], "left abutment"), (ring.joints[-1], "right abutment")):
        block = ring.blocks[ring.block_number(name)]
        normal = np.array([-joint.tangent[1], joint.tangent[0]])
        off = (block.points - joint.middle) @ normal
        assert np.ptp(off) == pytest.approx(deep)
        assert np.abs(off).min() == pytest.approx(0.0, abs=1e-9)
        assert block.area == pytest.approx(deep * joint.depth)
