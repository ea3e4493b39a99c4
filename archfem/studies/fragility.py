"""Fragility: the probability of a limit state over the intensity of the ground, as a lognormal.

Capacities of incremental dynamic analysis are known between two intensities, or only to lie above
one; counts of multiple stripes say how many motions of one intensity fail. Both are fitted by
maximum likelihood, with bands by the bootstrap and a figure of the goodness of fit.

References:
    Baker, Earthq. Spectra 31 (2015) 579-599. Porter, Kennedy and Bachman, Earthq. Spectra 23 (2007)
    471-489. Dempster, Laird and Rubin, J. R. Stat. Soc. B 39 (1977) 1-38, for censored samples.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import hypot
from typing import Any

import numpy as np
from scipy import stats
from scipy.special import ndtr

from archfem._typing import Array
from archfem._validation import check_integer, check_number, check_numbers
from archfem.errors import InvalidInput

# Samples of the bootstrap
RESAMPLES = 500

# Motions or stripes that two parameters take at least
LEAST = 3

# Relative change at which an iteration has settled, and its largest number of rounds
SETTLED, MOST = 1e-9, 2000

# Dispersions between which one is looked for [-]
NARROWEST, WIDEST = 0.005, 5.0


@dataclass(frozen=True, eq=False)
class Fragility:
    """A lognormal fragility curve, P = Φ(ln(x / median) / dispersion).

    Attributes:
        median: intensity at which half of all motions fail, in the unit that was given.
        dispersion: standard deviation of its logarithm [-].
        goodness: probability that data of this curve fit no better than these; below 0.05 they are
            hardly lognormal.
        misfit: largest distance of the data's own curve from this one [-].
        resampled: medians and dispersions of the bootstrap (samples, 2).
    """

    median: float
    dispersion: float
    goodness: float
    misfit: float
    resampled: Array = field(repr=False)

    def probability(self, intensity: Any) -> Array:
        """Return the probability of the limit state at intensities.

        Args:
            intensity: values above 0, of any shape.
        """
        return _curve(np.asarray(intensity, dtype=float), self.median, self.dispersion)

    def band(self, intensity: Any, share: float = 0.9) -> tuple[Array, Array]:
        """Return between what the probability lies, as far as so few motions tell.

        Args:
            intensity: values above 0 (n,).
            share: of the samples of the bootstrap that lie in the band [-].

        Returns:
            The lower and the upper end (n,) [-].
        """
        medians, dispersions = self.resampled.T[:, :, None]
        curves = _curve(np.asarray(intensity, dtype=float), medians, dispersions)
        low, high = np.quantile(curves, [0.5 - 0.5 * share, 0.5 + 0.5 * share], axis=0)
        return low, high

    def interval(self, share: float = 0.9) -> tuple[float, float]:
        """Return between what the median lies, as far as so few motions tell.

        Args:
            share: of the samples of the bootstrap that lie in the interval [-].
        """
        low, high = np.quantile(self.resampled[:, 0], [0.5 - 0.5 * share, 0.5 + 0.5 * share])
        return float(low), float(high)

    def widened(self, dispersion: float) -> "Fragility":
        """Return the curve with the spread of what is not known of the structure beside its own.

        Args:
            dispersion: of the median, by stiffness, friction and damping that are not known [-].
        """
        more = check_number(dispersion, "dispersion", minimum=0.0)
        resampled = np.column_stack([self.resampled[:, 0], np.hypot(self.resampled[:, 1], more)])
        return replace(self, dispersion=hypot(self.dispersion, more), resampled=resampled)


@dataclass(frozen=True)
class Spread:
    """What makes capacities differ: one motion from another, and what is not known of a structure.

    Attributes:
        median: geometric mean of the medians of the variants, in their unit.
        record: dispersion from record to record, root mean square over the variants [-].
        epistemic: standard deviation of the logarithms of the medians [-].
    """

    median: float
    record: float
    epistemic: float

    @property
    def total(self) -> float:
        """Dispersion of both, which are independent [-]."""
        return hypot(self.record, self.epistemic)


def spread(curves: Iterable[Fragility]) -> Spread:
    """Return how far variants of a structure differ beside the motions: stiffness, friction, ….

    Args:
        curves: of one limit state, of each variant under the same motions; variants are samples of
            what is not known, each as likely as another.

    Returns:
        Both dispersions; `Fragility.widened` by the epistemic one gives the curve of both.

    Raises:
        InvalidInput: there are fewer than two variants.
    """
    each = list(curves)
    if len(each) < 2:
        raise InvalidInput(f"{len(each)} curve: the spread of variants needs two or more")
    medians = np.log([curve.median for curve in each])
    record = np.sqrt(np.mean([curve.dispersion**2 for curve in each]))
    return Spread(float(np.exp(medians.mean())), float(record), float(medians.std(ddof=1)))


def fragility(
    upper: Any, lower: Any = None, *, resamples: int = RESAMPLES, seed: int = 0
) -> Fragility:
    """Fit a fragility curve to capacities of motions, as incremental dynamic analysis finds them."""
    high = np.array([float(value) for value in upper])
    low = high.copy() if lower is None else np.array(check_numbers(lower, "lower", len(high)))
    if len(high) < LEAST or not (high >= low).all() or not (low >= 0.0).all() or (high <= 0).any():
        raise InvalidInput(
            f"capacities from {low.tolist()} to {high.tolist()}: give {LEAST} or more, above 0, "
            "none larger below than above"
        )
    if np.isinf(high).mean() > 0.5 or np.ptp(high[np.isfinite(high)]) == 0.0:
        raise InvalidInput(
            f"capacities up to {high.tolist()}: more than half were not reached, or all are alike, "
            "and no curve can be told; go on to larger intensities, or use other motions"
        )
    with np.errstate(divide="ignore"):
        ends = np.log(np.array([low, high]))
    mean, deviation = _censored(ends[:, None, :])
    chance = np.random.default_rng(check_integer(seed, "seed", minimum=0))
    drawn = chance.integers(len(high), size=(check_integer(resamples, "resamples"), len(high)))
    means, deviations = _censored(ends[:, drawn])
    median, dispersion = float(np.exp(mean[0])), float(deviation[0])
    misfit = float(_distance(ends[:, None, :], mean, deviation)[0])
    made = _bracketed(chance.normal(mean[0], deviation[0], size=drawn.shape), ends)
    middle = made.mean(axis=0)
    refit = middle.mean(axis=1), np.maximum(middle.std(axis=1), NARROWEST)
    goodness = float((_distance(made, *refit) >= misfit).mean())
    resampled = np.column_stack([np.exp(means), deviations])
    return Fragility(median, dispersion, goodness, misfit, resampled)


def stripe_fragility(
    levels: Any, failures: Any, motions: Any, *, resamples: int = RESAMPLES, seed: int = 0
) -> Fragility:
    """Fit a fragility curve to multiple stripes: how many motions of each intensity fail.

    Args:
        levels: intensities above 0 (n,).
        failures: motions that fail at each (n,).
        motions: that were tried at each (n,), or one number for all.
        resamples: how many samples the bootstrap draws.
        seed: of these.

    Returns:
        The curve of greatest likelihood, as binomial counts have it.

    Raises:
        InvalidInput: there are fewer than three levels, counts that cannot be meant, or none that
            tells of the spread: nothing fails up to one level, and everything from the next.
    """
    x = np.array(check_numbers(levels, "levels"))
    count = np.broadcast_to(np.asarray(motions, dtype=float), x.shape)
    failed = np.array(check_numbers(failures, "failures", len(x)))
    if len(x) < LEAST or (x <= 0.0).any() or (failed > count).any() or (failed < 0.0).any():
        raise InvalidInput(
            f"{failed.tolist()} of {count.tolist()} motions fail at levels {x.tolist()}: give "
            f"{LEAST} levels or more above 0, and at each no more failures than motions"
        )
    if not ((failed > 0.0) & (failed < count)).any():
        raise InvalidInput(
            f"{failed.tolist()} of {count.tolist()} motions fail: at no level some do and some do "
            "not, and the spread cannot be told; try levels between"
        )
    median, dispersion = (float(each[0]) for each in _probit(x, failed[None], count))
    share = _curve(x, median, dispersion)
    chance = np.random.default_rng(check_integer(seed, "seed", minimum=0))
    drawn = chance.binomial(
        count.astype(int), share, size=(check_integer(resamples, "resamples"), len(x))
    )
    resampled = np.column_stack(_probit(x, drawn.astype(float), count))
    deviance = 2.0 * float(
        np.sum(_entropy(failed, count * share) + _entropy(count - failed, count * (1.0 - share)))
    )
    goodness = float(stats.chi2.sf(deviance, max(len(x) - 2, 1)))
    misfit = float(np.abs(failed / count - share).max())
    return Fragility(median, dispersion, goodness, misfit, resampled)


def _curve(intensity: Array, median: Any, dispersion: Any) -> Array:
    """Lognormal probability; 0 at no intensity."""
    with np.errstate(divide="ignore"):
        found: Array = ndtr((np.log(intensity) - np.log(median)) / dispersion)
    return found


def _censored(ends: Array) -> tuple[Array, Array]:
    """Mean and deviation of normal samples known between two ends (2, samples, n), by EM."""
    low, high = ends
    known = np.where(np.isfinite(high) & np.isfinite(low), 0.5 * (low + high), np.nan)
    known = np.where(np.isfinite(known), known, np.where(np.isfinite(high), high, low))
    mean, deviation = known.mean(axis=1), np.maximum(known.std(axis=1), NARROWEST)
    for _ in range(MOST):
        first, second = _moments(low, high, mean[:, None], deviation[:, None])
        mean_now = first.mean(axis=1)
        square = second.mean(axis=1) - mean_now**2
        now = np.clip(np.sqrt(np.maximum(square, 0.0)), NARROWEST, WIDEST)
        change = max(np.abs(mean_now - mean).max(), np.abs(now - deviation).max())
        mean, deviation = mean_now, now
        if change < SETTLED:
            break
    return mean, deviation


def _moments(low: Array, high: Array, mean: Array, deviation: Array) -> tuple[Array, Array]:
    """Expected value and square of normal samples that lie between two ends."""
    a, b = (low - mean) / deviation, (high - mean) / deviation
    exact = high - low < 1e-9
    share = np.where(exact, 1.0, np.maximum(_between(a, b), 1e-300))
    dense_a, dense_b = (np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) for z in (a, b))
    shift = (dense_a - dense_b) / share
    at_a, at_b = (
        np.where(np.isfinite(z), z, 0.0) * dense for z, dense in ((a, dense_a), (b, dense_b))
    )
    square = 1.0 + (at_a - at_b) / share
    first = np.where(exact, low, mean + deviation * shift)
    second = mean**2 + 2.0 * mean * deviation * shift + deviation**2 * square
    return first, np.where(exact, np.where(exact, low, 0.0) ** 2, second)


def _bracketed(samples: Array, ends: Array) -> Array:
    """Ends of brackets about samples, as wide as those that are known."""
    known = np.isfinite(ends).all(axis=0)
    width = float(np.median((ends[1] - ends[0])[known])) if known.any() else 0.0
    if width < 1e-9:
        return np.array([samples, samples])
    low = np.floor(samples / width) * width
    return np.array([low, low + width])


def _between(a: Array, b: Array) -> Array:
    """Normal probability between two ends, in the tail that keeps its digits."""
    flip = a > 0.0
    left, right = np.where(flip, -b, a), np.where(flip, -a, b)
    return ndtr(right) - ndtr(left)


def _distance(ends: Array, mean: Array, deviation: Array) -> Array:
    """Largest distance of the samples' own curves (2, samples, n) from normal ones [-]."""
    low, high = ends
    middle = np.where(np.isfinite(high) & np.isfinite(low), 0.5 * (low + high), high)
    place = np.sort(middle, axis=1)
    count = place.shape[1]
    fitted = ndtr((place - mean[:, None]) / deviation[:, None])
    steps = np.arange(count + 1) / count
    apart = np.maximum(np.abs(fitted - steps[:-1]), np.abs(fitted - steps[1:]))
    return np.where(np.isfinite(place), apart, 0.0).max(axis=1)


def _probit(x: Array, failed: Array, count: Array) -> tuple[Array, Array]:
    """Medians and dispersions (samples,) by scoring, of counts (samples, n) at levels (n,)."""
    t = np.log(x)
    centre, width = float(np.mean(t)), max(float(np.std(t)), 1e-6)
    place = (t - centre) / width
    start, slope = np.zeros(len(failed)), np.ones(len(failed))
    for _ in range(200):
        z = np.clip(start[:, None] + slope[:, None] * place, -8.0, 8.0)
        share = np.clip(ndtr(z), 1e-12, 1.0 - 1e-12)
        dense = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
        weight = count * dense**2 / (share * (1.0 - share))
        score = (failed - count * share) * dense / (share * (1.0 - share))
        a, b, c = weight.sum(1), (weight * place).sum(1), (weight * place**2).sum(1)
        one, two = score.sum(1), (score * place).sum(1)
        size = np.maximum(a * c - b**2, 1e-12)
        step = np.clip((c * one - b * two) / size, -1.0, 1.0)
        rise = np.clip((a * two - b * one) / size, -1.0, 1.0)
        start, slope = start + step, np.clip(slope + rise, width / WIDEST, width / NARROWEST)
        if max(np.abs(step).max(), np.abs(rise).max()) < SETTLED:
            break
    return np.exp(centre - width * start / slope), width / slope


def _entropy(seen: Array, expected: Array) -> Array:
    """Terms of the deviance; none where nothing was seen."""
    ratio = np.where(seen > 0.0, seen / np.maximum(expected, 1e-300), 1.0)
    return seen * np.log(ratio)
