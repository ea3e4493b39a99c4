"""Least-squares circle through surveyed points, such as those of an intrados."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from archfem._typing import Array
from archfem.errors import InvalidInput, logger
from archfem.masonry.block import Point, as_point, check_points
from archfem.units import mm

# Largest distance from the circle that is no doubt, in extents of the points: 5 % of a ring whose
# thickness is a twelfth of its span, 16 mm at 4 m, and surveys err by millimetres. By then a ring
# along the circle needs 12 % less thickness at rest than one along a half ellipse of that misfit.
MAX_MISFIT = 0.004


@dataclass(frozen=True)
class FittedCircle:
    """A circle fitted to points.

    Attributes:
        centre: coordinates of the centre (x, y) [m].
        radius: radius [m].
        distances: signed distances of the points from the circle, positive outside (n,) [m].
        embrace: angle at the centre between the first and the last point [degrees].
    """

    centre: Point
    radius: float
    distances: Array
    embrace: float

    @property
    def rms(self) -> float:
        """Root mean square distance of the points from the circle [m]."""
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def span(self) -> float:
        """Chord over the embrace, which is the clear span of an intrados [m]."""
        return 2.0 * self.radius * float(np.sin(np.radians(self.embrace) / 2.0))

    @property
    def rise(self) -> float:
        """Rise of the arc over its chord [m]."""
        return self.radius * (1.0 - float(np.cos(np.radians(self.embrace) / 2.0)))


def fitted_circle(points: Sequence[Point] | Array) -> FittedCircle:
    """Fit the circle with the least sum of squared distances to surveyed points.

    Distances are normal to the circle. The iteration starts from that of least algebraic error. A
    warning says where points are more than 0.4 % of their extent from it: their curve is another.

    Args:
        points: points along an arc, from one springing to the other (n, 2) [m].

    Raises:
        InvalidInput: there are fewer than three points, or they lie on a line.

    References:
        Coope, J. Optim. Theory Appl. 76 (1993) 381-388. Gander, Golub and Strebel, BIT 34 (1994)
        558-578.
    """
    places = np.array(check_points(points, "points")).reshape(-1, 2)
    mean = places.mean(axis=0) if len(places) else np.zeros(2)
    centred = places - mean
    extent = float(np.abs(centred).max(initial=0.0))
    # the smaller singular value vanishes for points on a line
    if len(places) < 3 or np.linalg.svd(centred, compute_uv=False)[1] <= 1e-6 * extent:
        raise InvalidInput(f"{len(places)} points on a line, or fewer than three, make no circle")
    # algebraic fit: x² + y² = 2 x_c x + 2 y_c y + (r² - x_c² - y_c²) is linear in its coefficients
    terms = np.column_stack([2.0 * centred, np.ones(len(centred))])
    x, y, constant = np.linalg.lstsq(terms, np.sum(centred**2, axis=1), rcond=None)[0]
    start = np.array([x, y, np.sqrt(constant + x * x + y * y)])

    def distances(circle: Array) -> Array:
        return np.asarray(np.linalg.norm(centred - circle[:2], axis=1) - circle[2])

    def derivatives(circle: Array) -> Array:
        offsets = circle[:2] - centred
        sizes = np.linalg.norm(offsets, axis=1)
        return np.column_stack([offsets / sizes[:, None], -np.ones(len(centred))])

    # differences take steps of 1e-8 of a coordinate, and round-off where it starts at zero
    fit = least_squares(distances, start, derivatives, method="lm", xtol=1e-12, ftol=1e-15)
    if not fit.success:
        raise InvalidInput("no circle comes nearest to these points: they hardly bend")
    circle = fit.x
    offsets = centred - circle[:2]
    angles = np.unwrap(np.arctan2(offsets[:, 1], offsets[:, 0]))
    centre, embrace = mean + circle[:2], float(np.degrees(abs(angles[-1] - angles[0])))
    _warn_of_misfit(distances(circle), float(np.ptp(places, axis=0).max()))
    return FittedCircle(as_point(centre), float(circle[2]), distances(circle), embrace)


def _warn_of_misfit(distances: Array, extent: float) -> None:
    """Warn of points that are farther from their circle than a survey errs."""
    misfit = float(np.abs(distances).max())
    if misfit > MAX_MISFIT * extent:
        logger.warning(
            "points are up to %.3g mm from the circle nearest to them, %.2g %% of their extent: "
            "a ring along it may need far more or less thickness than one along their curve; take "
            "af.shapes.pointed_arch, elliptical_arch or arch_along",
            misfit / mm,
            100.0 * misfit / extent,
        )
