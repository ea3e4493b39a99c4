"""The contact law of dry joints: tractions from opening and slip, at an instant and over a step.

Openings g are positive where the joint is open, tractions positive where they pull. The joint bears
only compression across, and an elastic traction limited by Coulomb friction along:

    t_n = k_n <g>_-,    t_s = k_s (s - s_p),    |t_s| ≤ μ |t_n| + c where the joint is closed,

with s_p the irreversible slip. The law is written with arithmetic and `abs` alone, so that one
definition serves numbers, NumPy arrays and UFL expressions; derivatives, which UFL finds by itself,
are for arrays only. `large.point_law` is its compiled twin. Joints that stiffen as they close have
`closing_traction` across; its integrals and means over a step are compiled, in `large.closing_law`.

Over a step opening and slip are linear in time, and tractions are averaged along this path. The
work of the mean traction is the change of the stored energy, wherever the joint opens or closes on
the way: the averaged vector field of Quispel and McLaren, J. Phys. A 41 (2008) 045206. Friction is
a slider in series with the shear spring, whose limit over a step is that of the mean normal force.

Along the joint the law is linear in areas: the functions serve forces at points as well as
tractions, with stiffnesses and closed areas of the points.
"""

from collections.abc import Callable, Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from archfem._typing import Array, Flags, Numbers

# Added to a denominator that may be zero where the quotient is to be zero
ZERO_DIVISION_GUARD = 1e-300

# Limit of the shear of joints that never slide [Pa]. Sums with any traction round to it, so that
# nothing exceeds it and every derivative is elastic; infinity would make differences no number.
NO_LIMIT = 1e300

# Closing over δ_m from which on the law follows its tangent, so that any closing has a finite
# traction [-]. The traction is 49 k_n δ_m there, and the tangent 2500 k_n: faces that stiff
# are closed to any program.
LARGEST_CLOSING = 0.98

# Opening up to which joints cohere, over c / k_n [-]. Joints that nothing presses rest at zero
# opening, within 1e-8 m: if cohesion ended there, shear would jump, and no iteration converge.
COHESIVE_OPENING = 1e-4

# Excess over Coulomb's limit, relative to it, that counts as round-off of a point that holds [-]
SLIP_LIMIT_TOLERANCE = 1e-9


def negative_part(x: Any) -> Any:
    """Return the negative part of a value: x where x < 0, else 0."""
    return 0.5 * (x - abs(x))


def is_closed(opening: Array) -> Flags:
    """Return where the normal spring acts."""
    # a joint that just touches is closed: the tangent of the unloaded structure would be singular
    return opening <= 0.0


class ContactLaw(NamedTuple):
    """The law with its parameters: numbers, arrays over points, or constants of UFL."""

    normal_stiffness: Any  # k_n [Pa/m]
    shear_stiffness: Any  # k_s [Pa/m]
    friction: Any  # μ, 0 where a joint never slides [-]
    cohesion: Any  # c [Pa]
    # limit of the shear also where open: `NO_LIMIT` of joints that never slide, else 0 [Pa]
    resistance: Any = 0.0
    closing_rate: Any = 0.0  # 1 / δ_m of joints that stiffen as they close, else 0 [1/m]

    @classmethod
    def of(cls, contact: Any) -> "ContactLaw":
        """Return the law of an object with parameters of a contact; others have their defaults."""
        defaults = cls._field_defaults
        law = cls(*(getattr(contact, name, defaults.get(name)) for name in cls._fields))
        if (closure := getattr(contact, "closure", None)) is not None:
            law = law._replace(closing_rate=1.0 / closure)
        held = law._replace(friction=0.0, cohesion=0.0, resistance=NO_LIMIT)
        return law if law.friction < inf else held

    @classmethod
    def at_points(cls, contacts: Sequence[Any], number: Numbers) -> "ContactLaw":
        """Return the law at points, from the number of the contact of each (p,)."""
        return cls(*np.array([cls.of(contact) for contact in contacts]).T[:, number])

    def mapped(self, function: Callable[[Any], Any]) -> "ContactLaw":
        """Return the law with a function of each parameter."""
        return ContactLaw(*map(function, self))

    def normal_traction(self, opening: Any) -> Any:
        """Return the traction across a joint that closes elastically and opens freely [Pa]."""
        return self.normal_stiffness * negative_part(opening)

    def closing_traction(self, opening: Any) -> Any:
        """Return the traction across a joint that stiffens as it closes [Pa]."""
        share, beyond = self._closing_shares(opening)
        pressure = share / (1.0 - share) + beyond / (1.0 - LARGEST_CLOSING) ** 2
        return -self.normal_stiffness / self.closing_rate * pressure

    def closing_energy(self, opening: Any, logarithm: Callable[[Any], Any]) -> Any:
        """Return the energy of `closing_traction` for each area, with a function ln [J/m²]."""
        (share, beyond), left = self._closing_shares(opening), 1.0 - LARGEST_CLOSING
        energy = -logarithm(1.0 - share) - share
        energy += beyond * (LARGEST_CLOSING / left + 0.5 * beyond / left**2)
        return self.normal_stiffness / self.closing_rate**2 * energy

    def _closing_shares(self, opening: Any) -> tuple[Any, Any]:
        """Return the closing over δ_m up to `LARGEST_CLOSING`, and its rest beyond [-]."""
        beyond = -negative_part(LARGEST_CLOSING + self.closing_rate * opening)
        return -self.closing_rate * negative_part(opening) - beyond, beyond

    def normal_tangent(self, opening: Array) -> Array:
        """Return the derivative of `normal_traction` [Pa/m]."""
        return np.where(is_closed(opening), self.normal_stiffness, 0.0)

    def normal_energy(self, opening: Any) -> Any:
        """Return the energy stored across the joint for each area [J/m²]."""
        return 0.5 * self.normal_traction(opening) * opening

    def mean_normal_traction(self, start: Any, end: Any) -> Any:
        """Return the mean of `normal_traction` over a step [Pa]."""
        closing = 0.5 * (negative_part(start) + negative_part(end))
        return self.normal_stiffness * closing * contact_fraction(start, end)

    def mean_normal_tangent(self, start: Array, end: Array, rates: tuple[float, float]) -> Array:
        """Return the derivative of the mean from those of the gaps at start and end [Pa/m]."""
        fraction = contact_fraction(start, end)
        square = 0.5 * fraction**2
        by_start = np.where(is_closed(start), fraction - square, square)
        by_end = np.where(is_closed(end), fraction - square, square)
        return np.asarray(self.normal_stiffness * (rates[0] * by_start + rates[1] * by_end))

    def cohesive_gap(self, opening: Any) -> Any:
        """Return an opening, less that up to which the joint coheres [m]."""
        return opening - COHESIVE_OPENING * self.cohesion / self.normal_stiffness

    def shear_traction(self, slip: Any) -> Any:
        """Return the elastic traction along the joint, t_s = k_s s [Pa]."""
        return self.shear_stiffness * slip

    def shear_limit(self, normal: Any, closed: Any) -> Any:
        """Return Coulomb's limit of the shear, μ |t_n| + c where closed [Pa]."""
        return self.resistance + self.limit_rate(normal, closed)

    def limit_rate(self, normal: Any, closed: Any) -> Any:
        """Return the derivative of `shear_limit` from those of its arguments."""
        return self.cohesion * closed - self.friction * normal


def contact_fraction(start: Any, end: Any) -> Any:
    """Return the fraction of a step for which a joint is closed, gap linear in time [-]."""
    # both parts of the quotient are guarded: a joint that just touches all the step is closed
    closed = ZERO_DIVISION_GUARD - negative_part(start) - negative_part(end)
    return closed / (abs(start) + abs(end) + ZERO_DIVISION_GUARD)


def contact_fraction_rate(start: Array, end: Array, rates: tuple[float, float]) -> Array:
    """Return the derivative of `contact_fraction` from those of the gaps at start and end [1/m]."""
    fraction, changes = contact_fraction(start, end), is_closed(start) != is_closed(end)
    total = np.where(changes, abs(start) + abs(end), np.inf)  # no derivative without a change
    by_start, by_end = (np.where(is_closed(gap), 1.0 - fraction, fraction) for gap in (start, end))
    return -(rates[0] * by_start + rates[1] * by_end) / total


def lagged_path(start: Any, end: Any, lag: Any) -> tuple[Any, Any]:
    """Return gaps at both ends of a step, plus their change times the lag of damping."""
    ahead = lag * (end - start)
    return start + ahead, end + ahead


def friction_excess(trial: Any, limit: Any) -> Any:
    """Return the part of a trial shear traction beyond the limit [Pa]."""
    return negative_part(trial + limit) - negative_part(limit - trial)


def clip_to_friction(trial: Any, limit: Any) -> Any:
    """Return a trial shear traction clipped to the limit [Pa]."""
    return trial - friction_excess(trial, limit)


def exceeds_limit(trial: Array, limit: Array) -> Flags:
    """Return where a trial shear traction slides, by more than round-off."""
    return np.abs(trial) > (1.0 + SLIP_LIMIT_TOLERANCE) * limit


def shear_tangent(trial: Array, limit: Array, closed: Any) -> tuple[Array, Array]:
    """Return the derivatives of `clip_to_friction` by the trial and by the limit [-].

    `closed` is the closed area, or whether any is.
    """
    slides = exceeds_limit(trial, limit) | ((closed == 0.0) & (limit == 0.0))
    # A sliding point retains a small part of its elastic stiffness: a body that slides at all its
    # joints would be free, though it holds as soon as it moves back. Open points have none.
    residual = np.where(limit > 0.0, 1e-9, 0.0)
    return np.where(slides, residual, 1.0), np.where(slides, np.sign(trial), 0.0)


def shear_over_step(start: Any, change: Any, lag: Any, limit: Any) -> tuple[Any, Any]:
    """Return the mean shear traction over a step, and the elastic traction lost by slip [Pa].

    The elastic traction grows with the slip up to the limit, and stays there. Excess at the start
    is lost. Damping with the time lag adds to the mean, up to the limit. The work of the mean is
    the change of the stored energy and a loss that is never negative.
    """
    lost = friction_excess(start, limit)
    first = start - lost
    excess = friction_excess(first + change, limit)
    # max(|change|, |excess|); the excess is the last part of the change, at the limit
    largest = 0.5 * (abs(change) + abs(excess) + abs(abs(change) - abs(excess)))
    mean = first + 0.5 * change - 0.5 * excess * abs(excess) / (largest + ZERO_DIVISION_GUARD)
    return clip_to_friction(mean + lag * change, limit), lost + excess


def mean_shear_tangent(start: Array, change: Array, lag: float, limit: Array) -> Any:
    """Return derivatives of the mean shear by its elastic change and by the limit [-]."""
    first = clip_to_friction(start, limit)
    excess = friction_excess(first + change, limit)
    # part of the step in which the point slides; very small changes are lost in the sums
    with np.errstate(all="ignore"):
        sliding = np.where(excess != 0.0, np.clip(excess / change, 0.0, 1.0), 0.0)
    clipped = np.where(np.abs(start) > limit, np.sign(start), 0.0)
    mean = shear_over_step(start, change, 0.0, limit)[0] + lag * change
    at_limit = np.abs(mean) > limit
    by_change = 0.5 * (1.0 - sliding) ** 2 + lag
    by_limit = (1.0 - sliding) * clipped + sliding * np.sign(change)
    return np.where(at_limit, 0.0, by_change), np.where(at_limit, np.sign(mean), by_limit)


def shear_loss(start: Any, change: Any, lag: Any, limit: Any) -> Any:
    """Return the energy lost along the joint over a step, times the shear stiffness."""
    first = clip_to_friction(start, limit)
    excess = friction_excess(first + change, limit)
    lagged, mean = (shear_over_step(start, change, each, limit)[0] for each in (lag, 0.0))
    # excess at the start, friction while sliding at the limit, damping
    at_end = first + change - excess
    return 0.5 * (start**2 - first**2) + excess * at_end + (lagged - mean) * change
