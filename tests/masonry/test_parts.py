"""Parts of a bridge that cannot be."""

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
            "'arch': span 0 m is not between 0 and 1000",
        ),
        (lambda: af.shapes.Arch(**RING | {"rise": -1.0}), "'arch': rise -1 m"),
        (lambda: af.shapes.Arch(**RING | {"thickness": 4e3}), "'arch': thickness 4000 m"),
        (
            lambda: af.shapes.Arch(**RING | {"rise": None}, embrace=360.0),
            "embrace 360° is not between",
        ),
        (lambda: af.shapes.Pier(gap=1.0, height=-2.0), "'pier': height -2 m"),
        (
            lambda: af.shapes.Sidewall(**WALL, state="loose"),
            "'sidewall': state 'loose' is unknown",
        ),
        (
            lambda: af.shapes.Sidewall(**WALL | {"above": -0.1}),
            "'sidewall': above -0.1 m is not from 0",
        ),
        (
            lambda: af.shapes.Sidewall(**WALL, setback=-0.1),
            "'sidewall': setback -0.1 m is not from 0",
        ),
        (
            lambda: af.shapes.Backfill(cover=0.4, erosion=-0.1),
            "'backfill': erosion -0.1 m is not from 0",
        ),
        (lambda: af.shapes.Backfill(cover=float("nan")), "'backfill': cover nan m is not from 0"),
        (lambda: af.shapes.Backfill(cover=0.4, hump=-1.0), "'backfill': hump -1 m is not from 0"),
        (
            lambda: af.shapes.Backfill(cover=0.4, spandrels=-1.0),
            "'backfill': spandrels -1 m is not from 0",
        ),
        (lambda: af.shapes.Paving(thickness=0.0), "'paving': thickness 0 m"),
    ],
)
def test_impossible_parts_are_refused(make, says):
    with pytest.raises(af.errors.InvalidStructure, match=says):
        make()
