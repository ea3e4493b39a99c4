"""Rings from a few lengths: weights, spans, and refused values."""

from math import radians

import numpy as np
import pytest

import archfem as af


def test_ring_has_the_weight_of_its_sector(ring):
    assert ring.weight == pytest.approx(20e3 * 0.55 * 2.95 * radians(159.0), rel=1e-12)
    chorded = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
    turn = radians(159.0) / 17
    assert chorded.weight / ring.weight == pytest.approx(np.sin(turn) / turn, rel=1e-12)


def test_span_and_rise_are_clear(ring):
    arch = af.circular_arch(span=5.0, rise=2.0, thickness=0.4, voussoirs=11)
    feet = [arch.joints[0].intrados, arch.joints[-1].intrados]
    assert feet[1][0] - feet[0][0] == pytest.approx(5.0)
    crown = max(y for block in arch.blocks[1:-1] for x, y in block.drawn()[:17])
    assert crown - feet[0][1] == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("embrace", [20.0, 127.3, 200.0])
def test_ring_by_span_and_embrace(embrace):
    """The chord of the intrados subtends the embrace: s = 2 r sin(β/2)."""
    ring = af.circular_arch(span=5.0, embrace=embrace, thickness=0.6, voussoirs=9)
    radius = 2.5 / np.sin(np.radians(embrace / 2.0))
    left, right = np.array([ring.joints[0].intrados, ring.joints[-1].intrados])
    assert right - left == pytest.approx([5.0, 0.0])
    assert np.linalg.norm([left, right], axis=1) == pytest.approx(radius)
    crown = max(np.linalg.norm(block.drawn(), axis=1).max() for block in ring.blocks[1:-1])
    assert crown == pytest.approx(radius + 0.6)


def test_over_semicircular_and_single_stone_rings():
    assert len(af.circular_arch(radius=1, thickness=0.2, embrace=200, voussoirs=9).joints) == 10
    assert len(af.circular_arch(radius=1, thickness=0.2, embrace=80, voussoirs=1).blocks) == 3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"thickness": -0.1}, "thickness -0.1 m is not between"),
        ({"thickness": 7.0}, "twice the radius"),
        ({"embrace": 400.0}, r"embrace \[°\] = 400"),
        ({"voussoirs": 0}, "voussoirs 0"),
        ({"voussoirs": 2.5}, "voussoirs 2.5"),
        ({"span": 5.0}, "two of its numbers: span and rise, span and embrace, or"),
        ({"rise": 2.0}, "two of its numbers"),
        ({"radius": None}, "two of its numbers"),
        ({"radius": None, "span": 5.0, "rise": 2.0}, "two of its numbers"),
        ({"radius": None, "span": 0.0}, "twice the radius"),
        ({"radius": None, "embrace": None, "span": 5.0, "rise": 2.6}, "half the span"),
        ({"radius": None, "embrace": None, "span": 1e308, "rise": 1.0}, "make no circle: give"),
        ({"width": 0.0}, r"width \[m\] = 0.0 is not"),
        ({"gravity": -9.81}, r"gravity .* = -9.81"),
    ],
)
def test_impossible_rings_are_refused(change, says):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    with pytest.raises(af.errors.InvalidStructure, match=says):
        af.circular_arch(**{**given, **change})


def test_a_negative_span_is_refused():
    with pytest.raises(af.InvalidInput, match=r"span \[m\] = -5.0 is below 0"):
        af.circular_arch(span=-5.0, embrace=159.0, thickness=0.5, voussoirs=9)


def test_an_angle_that_looks_like_radians_is_refused_with_both_readings():
    given = {"radius": 2.95, "thickness": 0.55, "voussoirs": 17}
    with pytest.raises(af.InvalidInput, match=r"looks like radians: give 159 for 2\.775 rad, or"):
        af.circular_arch(embrace=2.775, **given)
    with pytest.raises(af.InvalidInput, match=r"'north': embrace = 2\.775"):
        af.shapes.Arch(name="north", span=4.0, thickness=0.4, embrace=2.775, voussoirs=9)
    with pytest.raises(af.InvalidInput, match="has no unit"):
        af.circular_arch(embrace="2.775", **given)
    whole = af.circular_arch(embrace=159.0, **given)
    for same in ("159 degree", "159°", f"{radians(159.0)!r} rad"):
        ring = af.circular_arch(embrace=same, **given)
        assert ring.ends == pytest.approx(whole.ends, abs=1e-12)
    slight = af.circular_arch(embrace="2.775 degree", **given)  # insisted on
    assert np.ptp(slight.ends[:, 0, 0]) == pytest.approx(
        2.0 * 2.675 * np.sin(np.radians(2.775 / 2))
    )
