"""Parts of a bridge that cannot be."""

import numpy as np
import pytest

import archfem as af

RING = {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 13}
WALL = {"length": 2.0, "height": 2.3, "above": 0.8}


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: af.shapes.Arch(**RING | {"rise": None}), "either embrace or rise"),
        (lambda: af.shapes.Arch(**RING, embrace=150.0), "either embrace or rise"),
        (
            lambda: af.shapes.Arch(**RING | {"span": 0.0}),
            r"'arch': span \[m\] = 0.0 is not between 0 and 1000",
        ),
        (lambda: af.shapes.Arch(**RING | {"rise": -1.0}), r"'arch': rise \[m\] = -1.0"),
        (lambda: af.shapes.Arch(**RING | {"thickness": 4e3}), r"'arch': thickness \[m\] = 4000.0"),
        (
            lambda: af.shapes.Arch(**RING | {"rise": None}, embrace=360.0),
            r"embrace \[°\] = 360.0 is not between",
        ),
        (lambda: af.shapes.Arch(**RING, measured="extrados"), "measured = 'extrados' is unknown"),
        (lambda: af.shapes.Arch(**RING | {"rise": 2.1}), "rise 2.1 m is above half the span 4 m"),
        (lambda: af.shapes.Arch(**RING, measured=1), "measured = 1 is unknown"),
        (lambda: af.shapes.Pier(height=2.0), "'pier': give either breadth, "),
        (lambda: af.shapes.Pier(gap=1.0, breadth=1.0, height=2.0), "give either breadth, "),
        (lambda: af.shapes.Pier(gap=1.0, height=-2.0), r"'pier': height \[m\] = -2.0"),
        (
            lambda: af.shapes.Sidewall(**WALL, state="loose"),
            "'sidewall': state 'loose' is unknown",
        ),
        (
            lambda: af.shapes.Sidewall(**WALL | {"above": -0.1}),
            r"'sidewall': above \[m\] = -0.1 is not",
        ),
        (
            lambda: af.shapes.Sidewall(**WALL, setback=-0.1),
            r"'sidewall': setback \[m\] = -0.1 is not",
        ),
        (
            lambda: af.shapes.Backfill(cover=0.4, erosion=-0.1),
            r"'backfill': erosion \[m\] = -0.1 is not",
        ),
        (
            lambda: af.shapes.Backfill(cover=float("nan")),
            r"'backfill': cover \[m\] = nan is not between",
        ),
        (lambda: af.shapes.Backfill(cover=0.4, hump=-1.0), r"'backfill': hump \[m\] = -1.0 is not"),
        (
            lambda: af.shapes.Backfill(cover=0.4, spandrels=-1.0),
            r"'backfill': spandrels \[m\] = -1.0 is not",
        ),
        (lambda: af.shapes.Backfill(cover=300.0), r"cover \[m\] = 300.0 is not between 0 and 30"),
        (lambda: af.shapes.Backfill(cover=45.0), r"cover \[m\] = 45.0 is not between 0 and 30"),
        (
            lambda: af.bridge(arches=[af.shapes.Arch(**RING)], width=4000.0),
            r"width \[m\] = 4000.0 is not between 0.001 and 300: give metres",
        ),
        (lambda: af.shapes.Paving(thickness=0.0), r"'paving': thickness \[m\] = 0.0"),
    ],
)
def test_impossible_parts_are_refused(make, says):
    with pytest.raises(af.errors.InvalidStructure, match=says):
        make()


@pytest.mark.parametrize("shape", [{"rise": 1.6}, {"rise": None, "embrace": 150.0}])
@pytest.mark.parametrize(("measured", "depth"), [("intrados", 0.0), ("centre line", 0.5)])
def test_span_and_rise_are_those_of_the_line_that_is_named(measured, depth, shape):
    """By joints of the ring: `depth` is from the intrados, 0, to the extrados, 1."""
    arch = af.shapes.Arch(**RING | shape, measured=measured)
    faces = np.array([joint.ends for joint in af.bridge(arches=[arch]).joints])
    first, last = faces[0], faces[-1]
    foot, end = ((1.0 - depth) * low + depth * high for low, high in (first, last))
    assert end[0] - foot[0] == pytest.approx(4.0, rel=1e-12)
    assert end[1] == pytest.approx(foot[1], abs=1e-12)
    # the joints lie on circles about one centre, where the springing joints meet
    half = np.arctan2(*np.abs(first[1] - first[0]))
    radius = 2.0 / np.sin(half)
    if "embrace" in shape:
        assert 2.0 * np.degrees(half) == pytest.approx(150.0, rel=1e-12)
    else:
        assert radius * (1.0 - np.cos(half)) == pytest.approx(1.6, rel=1e-12)
