"""Faces along the back of a ring: shoulders of keystones and stepped voussoirs are no joints."""

from itertools import pairwise

import numpy as np
import pytest

import archfem as af

DRY = af.Contact(1.48e9, 0.30e9, friction=0.6)


def box(left, low, right, high, name, part, role="pier", **given):
    corners = ((left, low), (right, low), (right, high), (left, high))
    return af.Block(corners, af.STONE, name, part=part, role=role, **given)


def both_sides(stones):
    """Stones of the right half and their mirror images."""
    made = []
    for name, points, part, role, fixed in stones:
        for sign, mark in ((1.0, ""), (-1.0, "'")):
            corners = tuple((sign * x, y) for x, y in points[:: int(sign)])
            made.append(af.Block(corners, af.STONE, name + mark, fixed, part=part, role=role))
    return made


def stepped(embrace=180.0, role="pier", count=9):
    """Voussoirs with level tops and plumb sides, and a course of masonry beside each."""
    half = np.radians(embrace / 2.0)
    angles = np.linspace(half / count, half, count)[::-1]  # from the vertical, springing first
    inner, outer = (r * np.array([np.sin(angles), np.cos(angles)]).T for r in (2.0, 2.4))
    level = outer[0, 1]
    bed = [inner[0], outer[0], (4.0, level), (4.0, -1.0), (inner[0, 0], -1.0)]
    stones = [("abutment", bed[::-1], "abutment", "pier", False)]
    foot = [(inner[0, 0], -1.5), (4.0, -1.5), (4.0, -1.0), (inner[0, 0], -1.0)]
    stones.append(("rock", foot, "rock", "other", True))
    for k in range(count - 1):
        (x, y), (_, top) = outer[k], outer[k + 1]
        ring = [inner[k], outer[k], (x, top), outer[k + 1], inner[k + 1]]
        stones.append((f"V{k + 1}", ring, "arch", "ring", False))
        course = [(x, y), (4.0, y), (4.0, top), (x, top)]
        stones.append((f"Z{k + 1}", course, "spandrel", role, False))
    (x, y), crown = outer[-1], 2.6
    course = [(x, y), (4.0, y), (4.0, crown), (x, crown)]
    stones.append((f"Z{count}", course, "spandrel", role, False))
    key = [inner[-1], outer[-1], (x, crown), (-x, crown), (-x, y), (-inner[-1, 0], inner[-1, 1])]
    named = [af.Block(tuple(key), af.STONE, "keystone", part="arch", role="ring")]
    return af.masonry.assembled([*both_sides(stones), *named], DRY)


def ring_joints(structure, part="arch"):
    """Pairs of stones at the numbered joints of a ring, in their order."""
    names = [block.name for block in structure.blocks]
    return [
        {names[k] for k in joint.blocks}
        for joint in structure.joints
        if joint.name.startswith(f"{part}, joint")
    ]


@pytest.mark.parametrize("role", ["pier", "other"])
@pytest.mark.parametrize("embrace", [180.0, 140.0, 90.0, 60.0])
def test_shoulders_of_voussoirs_are_of_the_back(embrace, role):
    """Joints of the ring are the radial ones alone, at any rise and whatever is beside it."""
    structure = stepped(embrace, role)
    right = [f"V{k}" for k in range(8, 0, -1)]
    way = ["abutment'", *(f"{name}'" for name in right[::-1]), "keystone", *right, "abutment"]
    assert ring_joints(structure) == [{a, b} for a, b in pairwise(way)]
    beside = {"keystone", *right, *(f"{name}'" for name in right)}
    names = [block.name for block in structure.blocks]
    for joint in structure.joints:
        pair = {names[k] for k in joint.blocks}
        if pair & beside and "Z" in "".join(pair):
            assert joint.role == "other"
            assert joint.name == f"{names[joint.lower]} to {names[joint.higher]}"


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.4), (-0.2, 0.0), (-0.2, 0.4)])
def test_a_keystone_of_a_flat_arch_may_rise_and_drop(low, high):
    """Its sides above and below the voussoirs beside it are no joints."""
    inner = [(0.2, 2.0), (0.5, 2.0), (0.6, 2.5), (0.25, 2.5)]
    outer = [(0.5, 2.0), (0.8, 2.0), (1.0, 2.5), (0.6, 2.5)]
    pier = [(0.8, 0.0), (1.8, 0.0), (1.8, 2.5), (1.0, 2.5), (0.8, 2.0)]
    stones = [
        ("rock", [(0.8, -0.5), (1.8, -0.5), (1.8, 0.0), (0.8, 0.0)], "rock", "other", True),
        ("P", pier, "pier", "pier", False),
        ("V1", outer, "arch", "ring", False),
        ("V2", inner, "arch", "ring", False),
        ("Z", [(0.25, 2.5), (1.8, 2.5), (1.8, 2.9), (0.25, 2.9)], "spandrel", "pier", False),
    ]
    half = [(0.2, 2.0 + low), (0.2, 2.0), (0.25, 2.5), (0.25, 2.5 + high)]
    half = list(dict.fromkeys(half))
    corners = (*half, *((-x, y) for x, y in half[::-1]))
    key = af.Block(corners, af.STONE, "keystone", part="arch", role="ring")
    structure = af.masonry.assembled([*both_sides(stones), key], DRY)
    way = ["P'", "V1'", "V2'", "keystone", "V2", "V1", "P"]
    assert ring_joints(structure) == [{a, b} for a, b in pairwise(way)]


def test_a_springing_on_two_stones_of_a_pier_has_two_joints():
    """Both bear the ring, as broad as it is; what stands beside the springer does not."""
    angles = np.linspace(0.0, np.pi / 2.0, 4)
    inner, outer = (r * np.array([np.cos(angles), np.sin(angles)]).T for r in (2.0, 2.5))
    stones = [("rock", [(2.0, -1.5), (3.0, -1.5), (3.0, -1.0), (2.0, -1.0)], "rock", "other", True)]
    for name, left, right in (("P1", 2.0, 2.2), ("P2", 2.2, 3.0)):
        corners = [(left, -1.0), (right, -1.0), (right, 0.0), (left, 0.0)]
        stones.append((name, corners, "pier", "pier", False))
    springer = [inner[0], (2.6, 0.0), (2.6, outer[1, 1]), outer[1], inner[1]]
    stones.append(("V1", springer, "arch", "ring", False))
    for k in (1, 2):
        corners = [inner[k], outer[k], outer[k + 1], inner[k + 1]]
        stones.append((f"V{k + 1}", corners, "arch", "ring", False))
    beside = [(2.6, 0.0), (3.0, 0.0), (3.0, outer[1, 1]), (2.6, outer[1, 1])]
    stones.append(("Z", beside, "spandrel", "pier", False))
    pairs = ring_joints(af.masonry.assembled(both_sides(stones), DRY))
    assert pairs[-2:] in ([{"P1", "V1"}, {"P2", "V1"}], [{"P2", "V1"}, {"P1", "V1"}])
    assert len(pairs) == 2 * 2 + 5
