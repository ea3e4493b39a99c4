"""Tractions of a dry joint from its opening and slip, at an instant and over a step.

Written with arithmetic and `abs` alone, so that one definition serves NumPy arrays and UFL
expressions; only statuses and derivatives, which UFL finds for itself, are for arrays alone.
Openings are positive where the joint is open, tractions where they pull.

Over a step opening and slip go straight from their start to their end, and tractions are averaged
on the way: the mean of a force along its path is what makes the work of a step the change of the
stored energy, whatever opens or closes on the way (the averaged vector field of Quispel and
McLaren, J. Phys. A 41 (2008) 045206). Friction is a stop in series with the elastic shear, whose
limit over a step is that of its mean normal traction.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

NONE = 1e-300
"""Added to a denominator that may be zero, where the quotient then is zero as well."""


def negative(x: Any) -> Any:
    """Return the negative part of a value: x where x < 0, else 0.

    Args:
        x: numbers, or a UFL expression.
    """
    return 0.5 * (x - abs(x))


def normal_traction(opening: Any, stiffness: Any) -> Any:
    """Return the traction across a joint that closes elastically and opens freely [Pa].

        t_n = k_n <g>_-      (compression only)

    Args:
        opening: gap g between the faces [m], positive where open.
        stiffness: k_n [Pa/m]; times an area [N/m] it gives forces [N].
    """
    return stiffness * negative(opening)


def shear_traction(slip: Any, stiffness: Any) -> Any:
    """Return the elastic traction along a joint, t_s = k_s s [Pa].

    Args:
        slip: relative displacement s along the joint, less what it has slid for good [m].
        stiffness: k_s [Pa/m].
    """
    return stiffness * slip


def excess(trial: Any, limit: Any) -> Any:
    """Return what friction does not hold of an elastic traction along a joint [Pa].

    Args:
        trial: the traction if the joint did not slide [Pa].
        limit: Coulomb's, μ |t_n| + c, finite and not negative [Pa].
    """
    return negative(trial + limit) - negative(limit - trial)


def held(trial: Any, limit: Any) -> Any:
    """Return what friction holds of an elastic traction along a joint [Pa].

    Args:
        trial: the traction if the joint did not slide [Pa].
        limit: Coulomb's, finite and not negative [Pa].
    """
    return trial - excess(trial, limit)


def closed_time(start: Any, end: Any) -> Any:
    """Return the part of a step for which a joint is closed [-].

    Args:
        start: gap at its start [m].
        end: gap at its end [m].
    """
    return -(negative(start) + negative(end)) / (abs(start) + abs(end) + NONE)


def mean_closing(start: Any, end: Any) -> Any:
    """Return the mean of <g>_- over a step [m].

    Args:
        start: gap at its start [m].
        end: gap at its end [m].
    """
    return 0.5 * (negative(start) + negative(end)) * closed_time(start, end)


def shear_over_step(start: Any, change: Any, late: Any, limit: Any) -> tuple[Any, Any]:
    """Return the mean traction along a joint over a step, and its elastic part at the end [Pa].

    The elastic traction grows in proportion to the slip until it meets the limit, and stays there;
    what it exceeds the limit by at the start is lost. Damping adds to the mean, up to the limit.
    The work of the mean is the change of the stored energy and a loss that is never negative.

    Args:
        start: elastic traction at the start [Pa].
        change: of it, if the joint did not slide [Pa].
        late: lag of damping over the length of the step [-].
        limit: Coulomb's [Pa].
    """
    first = held(start, limit)
    over = excess(first + change, limit)
    most = 0.5 * (abs(change) + abs(over) + abs(abs(change) - abs(over)))
    mean = first + 0.5 * change - 0.5 * over * abs(over) / (most + NONE)
    return held(mean + late * change, limit), first + change - over


def is_closed(opening: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where the normal spring acts; a joint that just touches is closed.

    Otherwise the first tangent of a structure at rest would be singular.

    Args:
        opening: gaps, of any shape [m].
    """
    return opening <= 0.0


def mean_closing_rate(
    start: NDArray[np.float64], end: NDArray[np.float64], rates: tuple[float, float]
) -> NDArray[np.float64]:
    """Return the derivative of `mean_closing` by a parameter on which both gaps depend [-].

    Args:
        start: gaps at the start of the step, of any shape [m].
        end: gaps at its end, of the same [m].
        rates: change of both per change of the parameter [-].
    """
    time = closed_time(start, end)
    time = np.where(is_closed(start) & is_closed(end), 1.0, time)  # also where both just touch
    square = 0.5 * time**2
    by_start = np.where(is_closed(start), time - square, square)
    by_end = np.where(is_closed(end), time - square, square)
    rate: NDArray[np.float64] = rates[0] * by_start + rates[1] * by_end
    return rate


def closed_time_rate(
    start: NDArray[np.float64], end: NDArray[np.float64], rates: tuple[float, float]
) -> NDArray[np.float64]:
    """Return the derivative of `closed_time` by a parameter on which both gaps depend [1/m].

    Args:
        start: gaps at the start of the step, of any shape [m].
        end: gaps at its end, of the same [m].
        rates: change of both per change of the parameter [-].
    """
    time, turns = closed_time(start, end), is_closed(start) != is_closed(end)
    whole = np.where(turns, abs(start) + abs(end), np.inf)
    by_start, by_end = (np.where(is_closed(each), 1.0 - time, time) for each in (start, end))
    rate: NDArray[np.float64] = -(rates[0] * by_start + rates[1] * by_end) / whole
    return rate
