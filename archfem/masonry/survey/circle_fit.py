"""The circle that comes nearest to surveyed points, as of an intrados."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from archfem._typing import Array
from archfem._validation import check_numbers, check_sequence
from archfem.errors import InvalidInput
from archfem.masonry.block import Point

# Step relative to the radius below which the search for the circle has ended
STEP_TOLERANCE = 1e-12

# Steps within which it ends, or is given up
STEPS = 100


@dataclass(frozen=True)
class FittedCircle:
    """A circle through the midst of points.

    Attributes:
        centre: of the circle [m].
        radius: of the circle [m].
        distances: of each point from the circle, outside positive (n,) [m].
        embrace: angle at the centre between the first and the last point [degrees].
    """

    centre: Point
    radius: float
    distances: Array
    embrace: float

    @property
    def rms(self) -> float:
        """Root of the mean square distance of a point [m]."""
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def span(self) -> float:
        """Chord of the embrace: of an intrados the clear span [m]."""
        return 2.0 * self.radius * float(np.sin(np.radians(self.embrace) / 2.0))

    @property
    def rise(self) -> float:
        """Rise over that chord [m]."""
        return self.radius * (1.0 - float(np.cos(np.radians(self.embrace) / 2.0)))


def fitted_circle(points: Sequence[Point] | Array) -> FittedCircle:
    """Return the circle with the least sum of squared distances of surveyed points.

    Distances are measured at right angles to the circle. The search starts from the circle of least
    algebraic error and goes by Gauss's and Newton's steps.

    Args:
        points: along an arc, from one springing to the other (n, 2) [m].

    Raises:
        InvalidInput: there are fewer than three points, or they lie on a line.

    References:
        Coope, J. Optim. Theory Appl. 76 (1993) 381-388. Gander, Golub and Strebel, BIT 34 (1994)
        558-578.
    """
    rows = [
        check_numbers(point, f"points[{k}] [m]", 2)
        for k, point in enumerate(check_sequence(points, "points"))
    ]
    places = np.array(rows, dtype=float).reshape(-1, 2)
    middle = places.mean(axis=0) if len(places) else np.zeros(2)
    about = places - middle
    extent = float(np.abs(about).max(initial=0.0))
    if len(places) < 3 or np.linalg.svd(about, compute_uv=False)[1] <= 1e-6 * extent:
        raise InvalidInput(f"{len(places)} points on a line, or fewer than three, make no circle")
    terms = np.column_stack([2.0 * about, np.ones(len(about))])
    x, y, rest = np.linalg.lstsq(terms, np.sum(about**2, axis=1), rcond=None)[0]
    found = np.array([x, y, np.sqrt(rest + x * x + y * y)])
    for _ in range(STEPS):
        away = about - found[:2]
        far = np.linalg.norm(away, axis=1)
        slopes = np.column_stack([-away / far[:, None], -np.ones(len(far))])
        step = np.linalg.lstsq(slopes, found[2] - far, rcond=None)[0]
        found = found + step
        if np.abs(step).max() <= STEP_TOLERANCE * found[2]:
            break
    else:
        raise InvalidInput("no circle comes nearest to these points: they hardly bend")
    away = about - found[:2]
    turned = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    centre = middle + found[:2]
    return FittedCircle(
        (float(centre[0]), float(centre[1])),
        float(found[2]),
        np.linalg.norm(away, axis=1) - found[2],
        float(np.degrees(abs(turned[-1] - turned[0]))),
    )
