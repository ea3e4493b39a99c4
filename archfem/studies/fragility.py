"""Fragility: lognormal probability of a limit state over the intensity of the ground motion.

Capacities of incremental dynamic analysis lie in brackets of two intensities, or above one
(censored). Multiple stripes give the number of failing motions at each intensity. Both are fitted
by maximum likelihood, with confidence bands by the bootstrap and the goodness of fit.

References:
    Baker, Earthq. Spectra 31 (2015) 579-599. Porter, Kennedy and Bachman, Earthq. Spectra 23 (2007)
    471-489. Dempster, Laird and Rubin, J. R. Stat. Soc. B 39 (1977) 1-38, for censored samples.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import hypot, nan
from typing import Any

import numpy as np
from scipy import stats
from scipy.special import ndtr, rel_entr

from archfem._typing import Array
from archfem._validation import (
    check_array,
    check_integer,
    check_number,
    check_numbers,
    check_type,
    short_repr,
    validate_arguments,
    validate_methods,
)
from archfem.errors import InvalidInput
from archfem.motion.hazard import Hazard

# Largest number of motions at a level, far below where integers of the bootstrap overflow [-]
MAX_MOTIONS = 1e9

# Smallest and largest dispersion of a fit [-]
DISPERSION_RANGE = (0.005, 5.0)

# Least intensity of a rate of collapse, in deviations β from the median. Where hazards fall as a^-b
# the rate comes from about b β below the median, to 6 deviations on either side: b β up to 9 [-]
LEAST_DEVIATION = -15.0


@dataclass(frozen=True)
class Rate:
    """Mean annual rate at which a limit state is reached.

    Attributes:
        rate: mean annual rate [1/year].
        low: lower end of the 90 % interval [1/year].
        high: its upper end [1/year].
    """

    rate: float
    low: float
    high: float

    def probability(self, years: float = 50.0) -> tuple[float, float, float]:
        """Return the probability in a time, with the ends of its interval [-].

        Args:
            years: the time [year].
        """
        time = check_number(years, "years", minimum=0.0)
        rates = np.array([self.rate, self.low, self.high])
        return tuple(float(each) for each in -np.expm1(-rates * time))  # type: ignore[return-value]

    def __str__(self) -> str:
        """Rate with its interval, and the probability in 50 years."""
        chance = self.probability()
        return (
            f"{self.rate:.2g} a year ({self.low:.2g} to {self.high:.2g} at 90 %), "
            f"{chance[0]:.2g} in 50 years ({chance[1]:.2g} to {chance[2]:.2g})"
        )


@validate_methods
@dataclass(frozen=True, eq=False)
class Fragility:
    """A lognormal fragility curve, P = Φ(ln(x / median) / dispersion).

    Attributes:
        median: intensity at which half of all motions fail, in the unit of the data.
        dispersion: standard deviation of the logarithm of the intensity [-].
        goodness: p-value, probability that samples of this curve fit no better than the data; below
            0.05 a lognormal is doubtful.
        misfit: largest distance between the empirical curve and this one [-].
        resampled: medians and dispersions of the bootstrap samples (samples, 2).
    """

    median: float
    dispersion: float
    goodness: float
    misfit: float
    resampled: Array = field(repr=False)

    def __str__(self) -> str:
        """Describe the median with its confidence interval, the dispersion and the fit."""
        low, high = self.interval()
        return (
            f"median {self.median:.3g} ({low:.3g} to {high:.3g} at 90 %), dispersion "
            f"{self.dispersion:.2f}, p-value of the fit {self.goodness:.2f}"
        )

    def probability(self, intensity: Any) -> Array:
        """Return the probability of the limit state at intensities.

        Args:
            intensity: intensities above 0, of any shape.
        """
        return _curve(check_array(intensity, "intensity"), self.median, self.dispersion)

    def band(self, intensity: Any, share: float = 0.9) -> tuple[Array, Array]:
        """Return the confidence band of the probability.

        Args:
            intensity: intensities above 0 (n,).
            share: share of the bootstrap samples within the band [-].

        Returns:
            The lower and the upper end (n,) [-].
        """
        medians, dispersions = self.resampled.T[:, :, None]
        curves = _curve(check_array(intensity, "intensity"), medians, dispersions)
        low, high = np.quantile(curves, _tails(share), axis=0)
        return low, high

    def interval(self, share: float = 0.9) -> tuple[float, float]:
        """Return the confidence interval of the median.

        Args:
            share: share of the bootstrap samples within the interval [-].
        """
        low, high = np.quantile(self.resampled[:, 0], _tails(share))
        return float(low), float(high)

    def widened(self, dispersion: float) -> "Fragility":
        """Return the curve with an epistemic dispersion added to its own.

        Args:
            dispersion: dispersion of the median by uncertain stiffness, friction and damping [-].
        """
        more = check_number(dispersion, "dispersion", minimum=0.0)
        resampled = np.column_stack([self.resampled[:, 0], np.hypot(self.resampled[:, 1], more)])
        return replace(self, dispersion=hypot(self.dispersion, more), resampled=resampled)

    def annual_rate(self, hazard: Hazard) -> Rate:
        """Return the annual rate of the limit state, with its 90 % interval.

        Args:
            hazard: hazard of the site, for the intensity of this curve.

        References:
            Cornell, Jalayer, Hamburger and Foutch, J. Struct. Eng. 128 (2002) 526-533.
        """
        curves = np.vstack([[self.median, self.dispersion], self.resampled])
        rate, *resampled = integrate_rates(np.log(curves[:, 0]), curves[:, 1], hazard)
        low, high = np.quantile(resampled, [0.05, 0.95])
        return Rate(float(rate), float(low), float(high))


@dataclass(frozen=True)
class Spread:
    """Dispersion of capacities from record to record and by uncertain properties of the structure.

    Attributes:
        median: geometric mean of the medians of the variants, in their unit.
        record: record-to-record dispersion, root mean square over the variants [-].
        epistemic: standard deviation of the logarithms of the medians [-].
    """

    median: float
    record: float
    epistemic: float

    @property
    def total(self) -> float:
        """Dispersion by both causes, which are independent [-]."""
        return hypot(self.record, self.epistemic)


@validate_arguments
def spread(curves: Iterable[Fragility]) -> Spread:
    """Return the record-to-record and the epistemic dispersion of variants of a structure.

    Args:
        curves: curves of one limit state, one for each variant under the same motions. The variants
            are equally likely samples of uncertain stiffness, friction and the like.

    Returns:
        Both dispersions; `Fragility.widened` by the epistemic one gives the curve with both.

    Raises:
        InvalidInput: there are fewer than two variants.
    """
    curves = list(curves)
    for curve in curves:
        check_type(curve, Fragility, "curves", "give what stripe_fragility returns")
    if len(curves) < 2:
        raise InvalidInput(f"{len(curves)} curve: the spread of variants needs two or more")
    medians = np.log([curve.median for curve in curves])
    record = np.sqrt(np.mean([curve.dispersion**2 for curve in curves]))
    return Spread(float(np.exp(medians.mean())), float(record), float(medians.std(ddof=1)))


def fragility(
    upper: Iterable[float],
    lower: Iterable[float] | None = None,
    *,
    resamples: int = 500,
    seed: int = 0,
) -> Fragility:
    """Fit a fragility curve to capacities of motions, each in a bracket from lower to upper."""
    high = np.array([float(value) for value in upper])
    low = high.copy() if lower is None else np.array(check_numbers(lower, "lower", len(high)))
    if len(high) < 3 or not (high >= low).all() or not (low >= 0.0).all() or (high <= 0).any():
        raise InvalidInput(
            f"capacities from {low.tolist()} to {high.tolist()}: give 3 or more, above 0, "
            "none larger below than above"
        )
    if np.isinf(high).mean() > 0.5 or np.ptp(high[np.isfinite(high)]) == 0.0:
        raise InvalidInput(
            f"capacities up to {high.tolist()}: more than half were not reached, or all are alike, "
            "and determine no curve; go on to larger intensities, or use other motions"
        )
    with np.errstate(divide="ignore"):
        ends = np.log(np.array([low, high]))
    mean, deviation = fit_brackets(ends[:, None, :])
    median, dispersion = float(np.exp(mean[0])), float(deviation[0])
    misfit = float(_distance(ends[:, None, :], mean, deviation)[0])
    random = np.random.default_rng(check_integer(seed, "seed", minimum=0))
    drawn = random.integers(len(high), size=(check_integer(resamples, "resamples"), len(high)))
    means, deviations = fit_brackets(ends[:, drawn])
    # Goodness of fit by simulation (Lilliefors): samples of the fitted curve are fitted in turn.
    samples = _bracket(random.normal(mean[0], deviation[0], size=drawn.shape), ends)
    middle = samples.mean(axis=0)
    refit = middle.mean(axis=1), np.maximum(middle.std(axis=1), DISPERSION_RANGE[0])
    goodness = float((_distance(samples, *refit) >= misfit).mean())
    resampled = np.column_stack([np.exp(means), deviations])
    return Fragility(median, dispersion, goodness, misfit, resampled)


@validate_arguments
def stripe_fragility(
    levels: Sequence[float] | Array,
    failures: Sequence[float] | Array,
    motions: float | Sequence[float] | Array,
    *,
    resamples: int = 500,
    seed: int = 0,
) -> Fragility:
    """Fit a fragility curve to multiple stripes: numbers of failing motions at intensity levels.

    Args:
        levels: intensities above 0 (n,).
        failures: number of motions that fail at each level (n,).
        motions: whole number of motions at each level (n,), or one number for all.
        resamples: number of bootstrap samples.
        seed: seed of the bootstrap.

    Returns:
        The curve of maximum likelihood for binomial counts.

    Raises:
        InvalidInput: there are fewer than three levels, counts are out of range, motions are not
            whole numbers, or the dispersion is undetermined: no motion fails below one level, and
            all do above it, or the share of failures does not grow.
    """
    x = np.array(check_numbers(levels, "levels"))
    count = check_array(motions, "motions")
    if count.shape not in ((), x.shape):
        raise InvalidInput(f"motions = {short_repr(motions)}: give one number, or {len(x)} of them")
    count = np.broadcast_to(count, x.shape)
    failed = np.array(check_numbers(failures, "failures", len(x)))
    if len(x) < 3 or (x <= 0.0).any() or (failed > count).any() or (failed < 0.0).any():
        raise InvalidInput(
            f"{failed.tolist()} of {count.tolist()} motions fail at levels {x.tolist()}: give "
            f"3 levels or more above 0, and at each no more failures than motions"
        )
    if (count > MAX_MOTIONS).any() or (count % 1.0).any():
        raise InvalidInput(f"{count.tolist()} motions: give whole numbers up to {MAX_MOTIONS:g}")
    if not ((failed > 0.0) & (failed < count)).any():
        raise InvalidInput(
            f"{failed.tolist()} of {count.tolist()} motions fail: at no level some do and some do "
            "not, and the dispersion is undetermined; try levels between"
        )
    median, dispersion = (float(each[0]) for each in _probit(x, failed[None], count))
    if not 1.001 * DISPERSION_RANGE[0] < dispersion < 0.999 * DISPERSION_RANGE[1]:
        raise InvalidInput(
            f"{failed.tolist()} of {count.tolist()} motions fail at levels {x.tolist()}: their "
            "share hardly grows with the level, or from none to all at one of them, and the "
            "dispersion is undetermined; try levels farther apart, or nearer to that one"
        )
    share = _curve(x, median, dispersion)
    random = np.random.default_rng(check_integer(seed, "seed", minimum=0))
    size = check_integer(resamples, "resamples"), len(x)
    drawn = random.binomial(count.astype(int), share, size=size)
    resampled = np.column_stack(_probit(x, drawn.astype(float), count))
    survived = count - failed
    terms = rel_entr(failed, count * share) + rel_entr(survived, count * (1.0 - share))
    deviance = 2.0 * float(np.sum(terms))
    goodness = float(stats.chi2.sf(deviance, max(len(x) - 2, 1)))
    misfit = float(np.abs(failed / count - share).max())
    return Fragility(median, dispersion, goodness, misfit, resampled)


def _tails(share: float) -> list[float]:
    """Return the probabilities at both ends of an interval."""
    half = 0.5 * check_number(share, "share", minimum=0.0, maximum=1.0)
    return [0.5 - half, 0.5 + half]


def _curve(intensity: Array, median: Any, dispersion: Any) -> Array:
    """Lognormal probability; 0 at intensity 0."""
    if (intensity < 0.0).any():
        raise InvalidInput(f"intensity {float(intensity.min()):g} is below 0: give none")
    with np.errstate(divide="ignore"):
        return np.asarray(ndtr((np.log(intensity) - np.log(median)) / dispersion))


def fit_brackets(ends: Array, members: Any = True) -> tuple[Array, Array]:
    """Mean and deviation (samples,) of normal data in brackets (2, samples, n), by EM.

    Only members (samples, n) count, of which each sample has one or more.
    """
    low, high = ends
    members = np.broadcast_to(members, low.shape)
    shares = members / members.sum(axis=1, keepdims=True)
    # initial guess: the middle of a bracket, or the end of an unbounded one
    bounded = np.where(np.isfinite(high), high, low)
    start = np.where(np.isfinite(high) & np.isfinite(low), 0.5 * (low + high), bounded)
    mean = (shares * start).sum(axis=1)
    variance = (shares * (start - mean[:, None]) ** 2).sum(axis=1)
    deviation = np.maximum(np.sqrt(variance), DISPERSION_RANGE[0])
    moving = np.arange(len(mean))  # samples that have not converged
    for _ in range(2000):
        at, by = mean[moving], deviation[moving]
        first, second = _moments(low[moving], high[moving], at[:, None], by[:, None])
        mean[moving] = (shares[moving] * first).sum(axis=1)
        variance = (shares[moving] * second).sum(axis=1) - mean[moving] ** 2
        deviation[moving] = np.clip(np.sqrt(np.maximum(variance, 0.0)), *DISPERSION_RANGE)
        change = np.maximum(np.abs(mean[moving] - at), np.abs(deviation[moving] - by))
        moving = moving[change >= 1e-9]
        if not moving.size:
            break
    return mean, deviation


def _moments(low: Array, high: Array, mean: Array, deviation: Array) -> tuple[Array, Array]:
    """First and second moment of normal variables truncated to brackets."""
    a, b = (low - mean) / deviation, (high - mean) / deviation
    exact = high - low < 1e-9  # the formulas of a truncated normal would divide 0 by 0
    share = np.where(exact, 1.0, np.maximum(_between(a, b), 1e-300))
    dense_a, dense_b = _density(a), _density(b)
    shift = (dense_a - dense_b) / share
    at_a = np.where(np.isfinite(a), a, 0.0) * dense_a
    at_b = np.where(np.isfinite(b), b, 0.0) * dense_b
    square = 1.0 + (at_a - at_b) / share
    first = np.where(exact, low, mean + deviation * shift)
    second = mean**2 + 2.0 * mean * deviation * shift + deviation**2 * square
    return first, np.where(exact, np.where(exact, low, 0.0) ** 2, second)


def integrate_rates(means: Array, deviations: Array, hazard: Hazard) -> Array:
    """Return the annual rates (k,) of lognormal fragilities under a hazard curve."""
    # ∫ rate φ dz; beyond 8 deviations φ is round-off
    z, step = np.linspace(LEAST_DEVIATION, 8.0, 921, retstep=True)
    x = np.exp(means[:, None] + deviations[:, None] * z)
    return np.asarray(hazard.rate_of(x) @ _density(z) * step)


def variance_component(values: Array, groups: Any) -> float:
    """Return the variance between groups by a one-way analysis of variance, at least 0 or nan."""
    kinds, place = np.unique(groups, return_inverse=True)
    counts = np.bincount(place)
    if len(kinds) < 2:
        return 0.0
    if len(values) <= len(kinds):
        return nan
    means = np.bincount(place, values) / counts
    within = float(np.sum((values - means[place]) ** 2)) / (len(values) - len(kinds))
    between = float(np.sum(counts * (means - values.mean()) ** 2)) / (len(kinds) - 1)
    size = (len(values) - float(np.sum(counts**2)) / len(values)) / (len(kinds) - 1)
    return max((between - within) / size, 0.0)


def _bracket(samples: Array, ends: Array) -> Array:
    """Brackets of samples, of the median width of the data's brackets."""
    widths = (ends[1] - ends[0])[np.isfinite(ends).all(axis=0)]
    if not len(widths) or (width := float(np.median(widths))) < 1e-9:
        return np.array([samples, samples])
    low = np.floor(samples / width) * width
    return np.array([low, low + width])


def _density(z: Array) -> Array:
    """Density of the standard normal distribution."""
    return np.asarray(np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi))


def _between(a: Array, b: Array) -> Array:
    """Normal probability between two ends."""
    flip = a > 0.0  # in the lower tail the difference loses no digits
    left, right = np.where(flip, -b, a), np.where(flip, -a, b)
    return ndtr(right) - ndtr(left)


def _distance(ends: Array, mean: Array, deviation: Array) -> Array:
    """Distance (Kolmogorov) of the empirical curves (2, samples, n) from normal ones [-]."""
    low, high = ends
    middle = np.where(np.isfinite(high) & np.isfinite(low), 0.5 * (low + high), high)
    ordered = np.sort(middle, axis=1)
    count = ordered.shape[1]
    fitted = ndtr((ordered - mean[:, None]) / deviation[:, None])
    steps = np.arange(count + 1) / count
    # the empirical curve has a step at each value: both of its ends count
    distance = np.maximum(np.abs(fitted - steps[:-1]), np.abs(fitted - steps[1:]))
    return np.where(np.isfinite(ordered), distance, 0.0).max(axis=1)


def _probit(x: Array, failed: Array, count: Array) -> tuple[Array, Array]:
    """Medians and dispersions (samples,) for failures (samples, n) at levels, by Fisher scoring."""
    # the probability of failure is Φ(intercept + slope · s), s the standardised logarithm of x
    t = np.log(x)
    centre, width = float(np.mean(t)), max(float(np.std(t)), 1e-6)
    s = (t - centre) / width
    intercept, slope = np.zeros(len(failed)), np.ones(len(failed))
    smallest, largest = (width / dispersion for dispersion in reversed(DISPERSION_RANGE))
    for _ in range(200):
        z = np.clip(intercept[:, None] + slope[:, None] * s, -8.0, 8.0)
        share, density = np.clip(ndtr(z), 1e-12, 1.0 - 1e-12), _density(z)
        # Fisher information (a, b; b, c) and score (u, v) of intercept and slope
        weight = count * density**2 / (share * (1.0 - share))
        score = (failed - count * share) * density / (share * (1.0 - share))
        a, b, c = weight.sum(1), (weight * s).sum(1), (weight * s**2).sum(1)
        u, v = score.sum(1), (score * s).sum(1)
        determinant = np.maximum(a * c - b**2, 1e-12)
        # steps are limited, since the likelihood is flat far from the optimum
        steeper = slope + np.clip((a * v - b * u) / determinant, -1.0, 1.0)
        rise = np.clip(steeper, smallest, largest) - slope
        # of the slope as it will be, which may be at its limit
        step = np.clip((u - b * rise) / np.maximum(a, 1e-12), -1.0, 1.0)
        intercept, slope = intercept + step, slope + rise
        if max(np.abs(step).max(), np.abs(rise).max()) < 1e-9:
            break
    return np.exp(centre - width * intercept / slope), width / slope
