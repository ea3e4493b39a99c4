"""Fragility curves recover the lognormal that samples are drawn from, and say how sure they are."""

import numpy as np
import pytest
from scipy import optimize, stats

import archfem as af
from archfem.studies import spread, stripe_fragility
from archfem.studies.fragility import fragility

MEDIAN, DISPERSION = 2.5, 0.4


def drawn(count, seed=1):
    return np.random.default_rng(seed).lognormal(np.log(MEDIAN), DISPERSION, count)


def test_exact_capacities_give_mean_and_deviation_of_their_logarithms():
    capacities = drawn(25)
    found = fragility(capacities)
    assert found.median == pytest.approx(np.exp(np.log(capacities).mean()), rel=1e-9)
    assert found.dispersion == pytest.approx(np.log(capacities).std(), rel=1e-9)
    assert float(found.probability(found.median)) == pytest.approx(0.5)
    fitted = stats.lognorm(s=found.dispersion, scale=found.median)
    assert found.misfit == pytest.approx(stats.kstest(capacities, fitted.cdf).statistic, rel=1e-6)


@pytest.mark.parametrize("width", [0.0, 0.1, 0.5])
def test_censored_capacities_give_the_curve_of_largest_likelihood(width):
    """Capacities up to 3.5, exact or in brackets, and larger ones of which no more is known."""
    capacities = drawn(60)
    lower, upper = (1.0 - width) * capacities, (1.0 + width) * capacities
    beyond = capacities > 3.5
    lower[beyond], upper[beyond] = 3.5, np.inf
    found = fragility(upper, lower, resamples=1)

    def unlikely(parameters):
        mean, deviation = parameters[0], np.exp(parameters[1])
        low, high = (stats.norm.cdf(np.log(end), mean, deviation) for end in (lower, upper))
        density = stats.norm.pdf(np.log(lower), mean, deviation)
        return -np.log(np.where(lower == upper, density, high - low)).sum()

    best = optimize.minimize(unlikely, [0.5, -0.5], method="Nelder-Mead", tol=1e-10).x
    assert np.log(found.median) == pytest.approx(best[0], abs=1e-6)
    assert np.log(found.dispersion) == pytest.approx(best[1], abs=1e-6)
    # of the empirical curve, up to where it is known
    known = np.sort(0.5 * (np.log(lower) + np.log(upper)))
    fitted = stats.norm.cdf(known[~np.isinf(known)], np.log(found.median), found.dispersion)
    steps = np.arange(len(fitted) + 1) / len(capacities)
    ends = np.abs(fitted - steps[:-1]), np.abs(fitted - steps[1:])
    assert found.misfit == pytest.approx(np.max(ends), abs=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motion_far_from_all_others_keeps_its_weight(side):
    """Fourteen deviations from 199 others, in a bracket too narrow to matter: of 1 in 10,000."""
    logarithms = np.append(1e-3 * np.sin(np.arange(199.0)), side)
    found = fragility(np.exp(logarithms + 5e-5), np.exp(logarithms - 5e-5), resamples=1)
    assert np.log(found.median) == pytest.approx(logarithms.mean(), rel=1e-6)
    assert found.dispersion == pytest.approx(logarithms.std(), rel=1e-6)


def test_samples_of_the_bootstrap_are_fits_of_motions_that_are_drawn_again():
    """All of them to the same digits, though some converge later than others."""
    upper = drawn(20)
    lower = np.array([0.2, 0.9] * 10) * upper
    lower[-3:], upper[-3:] = 1.0, np.inf
    found = fragility(upper, lower, resamples=9, seed=4)
    again = np.random.default_rng(4).integers(20, size=(9, 20))
    alone = [fragility(upper[k], lower[k], resamples=1) for k in again]
    assert found.resampled == pytest.approx(
        np.array([(each.median, each.dispersion) for each in alone]), rel=1e-7
    )


def test_many_samples_recover_their_curve():
    found = fragility(drawn(4000), resamples=20)
    assert found.median == pytest.approx(MEDIAN, rel=3 * DISPERSION / np.sqrt(4000))
    assert found.dispersion == pytest.approx(DISPERSION, rel=3 / np.sqrt(8000))


def test_stripes_give_the_curve_of_largest_likelihood():
    levels = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
    share = stats.lognorm(s=DISPERSION, scale=MEDIAN).cdf(levels)
    exact = stripe_fragility(levels, 1e4 * share, 1e4, resamples=10)
    assert exact.median == pytest.approx(MEDIAN, rel=1e-6)
    assert exact.dispersion == pytest.approx(DISPERSION, rel=1e-6)
    failed = np.random.default_rng(2).binomial(20, share)
    found = stripe_fragility(levels, failed, 20)

    def unlikely(parameters):
        curve = stats.lognorm(s=np.exp(parameters[1]), scale=np.exp(parameters[0])).cdf(levels)
        return -stats.binom.logpmf(failed, 20, curve).sum()

    best = optimize.minimize(unlikely, [0.5, -0.5], method="Nelder-Mead", tol=1e-10).x
    assert np.log(found.median) == pytest.approx(best[0], abs=1e-6)
    assert np.log(found.dispersion) == pytest.approx(best[1], abs=1e-6)
    assert found.goodness > 0.05


@pytest.mark.parametrize(
    "failed", [[0, 2, 8, 10], pytest.param([0, 1, 6, 10], marks=pytest.mark.slow), [2, 3, 5, 7]]
)
def test_samples_of_stripes_are_curves_of_largest_likelihood(failed):
    """No curve of a grid is likelier, also where all motions of a sample fail from one level on."""
    levels = np.array([1.0, 1.5, 2.0, 3.0])
    found = stripe_fragility(levels, failed, 10, resamples=100, seed=1)
    counts = np.random.default_rng(1).binomial(10, found.probability(levels), size=(100, 4))

    def likelihood(medians, dispersions):
        share = stats.norm.cdf(np.log(levels / medians[:, None]) / dispersions[:, None])
        return stats.binom.logpmf(counts, 10, share).sum(axis=1)

    own = likelihood(*found.resampled.T)
    for median in np.geomspace(0.9, 3.3, 24):
        for dispersion in np.geomspace(0.005, 2.0, 16):
            other = likelihood(np.full(100, median), np.full(100, dispersion))
            assert (own >= other - 1e-6).all()


def test_confidence_bands_hold_the_truth_at_their_stated_rate():
    """47 or more of 60 intervals of 90 %, by 40 motions each, hold it but for one case in 500."""
    held = 0
    for seed in range(60):
        low, high = fragility(drawn(40, seed), resamples=200).interval(0.9)
        held += low <= MEDIAN <= high
    assert 47 <= held <= 60
    found = fragility(drawn(40))
    low, high = found.band(np.array([1.0, MEDIAN, 6.0]))
    assert (low < found.probability([1.0, MEDIAN, 6.0])).all()
    assert (high > found.probability([1.0, MEDIAN, 6.0])).all()


def test_goodness_rejects_samples_that_are_not_lognormal():
    two_heaps = np.concatenate([drawn(30) * 0.1, drawn(30) * 10.0])
    assert fragility(two_heaps).goodness < 0.05
    assert fragility(drawn(60)).goodness > 0.05
    uneven = stripe_fragility([1.0, 2.0, 3.0, 4.0], [1, 18, 3, 19], 20)
    assert uneven.goodness < 0.01


@pytest.mark.parametrize(("width", "apart"), [(0.5, 0.0), (0.5, 3.0), (0.1, 3.0)])
def test_goodness_does_not_judge_the_steps_of_brackets(width, apart):
    """Brackets of a factor of 1.6 make steps of a curve which no exact samples have.

    Two heaps are no lognormal, in coarse brackets and in fine ones.
    """
    logarithms = np.log(drawn(200)) + apart * np.sign(np.arange(200) - 99.5)
    below = np.floor(logarithms / width) * width
    found = fragility(np.exp(below + width), np.exp(below), resamples=200)
    assert (found.goodness > 0.05) is (apart == 0.0)
    assert fragility(np.exp(below + 0.5 * width), resamples=200).goodness < 0.05


def test_a_curve_states_its_median_and_dispersion():
    curve = fragility(np.exp([0.0, 1.0, 2.0]))
    assert str(curve).startswith(f"median {np.e:.3g} (")
    assert f"dispersion {curve.dispersion:.2f}, " in str(curve)


def test_uncertainty_of_the_structure_widens_the_curve():
    found = fragility(drawn(30))
    wider = found.widened(0.3)
    assert wider.dispersion == pytest.approx(np.hypot(found.dispersion, 0.3))
    assert wider.median == found.median


def test_variants_and_motions_share_the_variance_of_all_together():
    scales = [0.5, 0.8, 1.0, 1.7]
    found = spread(fragility(scale * drawn(30)) for scale in scales)
    pooled = fragility(np.concatenate([scale * drawn(30) for scale in scales]))
    between = found.epistemic**2 * 3 / 4  # of these four alone, not of their population
    assert pooled.dispersion**2 == pytest.approx(found.record**2 + between, rel=1e-6)
    assert pooled.median == pytest.approx(found.median, rel=1e-6)
    assert found.total == np.hypot(found.record, found.epistemic)
    with pytest.raises(af.InvalidInput, match="two or more"):
        spread([pooled])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (([1.0, 2.0],), "give 3 or more"),
        (([1.0, 2.0, -1.0],), "above 0"),
        (([2.0, 2.0, 2.0],), "all are alike"),
        (([2.0, np.inf, np.inf], [1.0, 3.0, 3.0]), "more than half were not reached"),
        (([2.0, 1.0, 1.0], [1.0, 3.0, 0.5]), "none larger below"),
    ],
)
def test_invalid_capacities_are_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        fragility(*given)
    with pytest.raises(af.InvalidInput, match="no more failures"):
        stripe_fragility([1.0, 2.0, 3.0], [0, 5, 21], 20)
    for motions in (2**63, 20.5):
        with pytest.raises(af.InvalidInput, match="give whole numbers up to 1e"):
            stripe_fragility([1.0, 2.0, 3.0], [0, 5, 10], motions)
    with pytest.raises(af.InvalidInput, match="try levels between"):
        stripe_fragility([1.0, 2.0, 3.0], [0, 0, 20], 20)
    with pytest.raises(af.errors.InvalidInput, match="hardly grows with the level"):
        stripe_fragility([1.0, 2.0, 3.0], [18, 10, 2], 20)


def test_intervals_and_bands_are_quantiles_of_the_samples():
    """Nine tenths of them by default, or any other share."""
    found = fragility(drawn(30), resamples=99)
    medians, dispersions = np.sort(found.resampled[:, 0]), found.resampled[:, 1]
    assert len(medians) == 99
    for share, options in ((0.9, {}), (0.5, {"share": 0.5})):
        ends = np.interp([0.5 - share / 2, 0.5 + share / 2], np.linspace(0, 1, 99), medians)
        assert found.interval(**options) == pytest.approx(tuple(ends), rel=1e-12)
        for intensity in (1.5, 4.0):
            curve = stats.norm.cdf(np.log(intensity / found.resampled[:, 0]) / dispersions)
            ends = np.interp(
                [0.5 - share / 2, 0.5 + share / 2], np.linspace(0, 1, 99), np.sort(curve)
            )
            band = found.band([intensity], **options)
            assert (band[0][0], band[1][0]) == pytest.approx(tuple(ends), rel=1e-9)
    assert fragility(drawn(5)).resampled.shape == (500, 2)
    again = fragility(drawn(30), resamples=99, seed=0)
    assert np.array_equal(again.resampled, found.resampled)
    assert not np.array_equal(fragility(drawn(30), resamples=99, seed=3).resampled, again.resampled)


@pytest.mark.parametrize(("spread_of", "known"), [(1e-4, 0.005), (20.0, 5.0)])
def test_dispersions_are_between_five_thousandths_and_five(spread_of, known):
    found = fragility(2.0 * np.exp(spread_of * np.array([-1.0, 0.0, 1.0])))
    assert found.dispersion == pytest.approx(known, rel=1e-9)
    assert found.median == pytest.approx(2.0, rel=1e-9)


def test_the_fit_of_stripes_is_judged_by_their_deviance():
    """Twice the logarithm of the likelihood of counts of their own over that of the curve."""
    levels, motions = np.array([1.0, 1.6, 2.2, 3.0, 4.5]), np.array([20, 10, 40, 20, 8])
    failed = np.array([0, 4, 12, 14, 8])
    found = stripe_fragility(levels, failed, motions, resamples=20)
    curve = stats.lognorm(s=found.dispersion, scale=found.median).cdf(levels)
    own, fitted = (
        stats.binom.logpmf(failed, motions, share).sum() for share in (failed / motions, curve)
    )
    assert found.goodness == pytest.approx(stats.chi2.sf(2.0 * (own - fitted), 3), rel=1e-6)
    assert found.misfit == pytest.approx(np.abs(failed / motions - curve).max(), rel=1e-9)
    three = stripe_fragility([1.0, 2.0, 3.0], [2, 9, 17], 20, resamples=20)
    curve = stats.lognorm(s=three.dispersion, scale=three.median).cdf([1.0, 2.0, 3.0])
    own, fitted = (
        stats.binom.logpmf([2, 9, 17], 20, share).sum()
        for share in (np.array([0.1, 0.45, 0.85]), curve)
    )
    assert three.goodness == pytest.approx(stats.chi2.sf(2.0 * (own - fitted), 1), rel=1e-6)


def test_uncertainty_of_the_structure_widens_every_sample():
    found = fragility(drawn(30), resamples=20)
    wider = found.widened(0.3)
    assert wider.resampled[:, 0] == pytest.approx(found.resampled[:, 0])
    assert wider.resampled[:, 1] == pytest.approx(np.hypot(found.resampled[:, 1], 0.3))
    assert found.widened(0.0).dispersion == found.dispersion


def test_the_dispersion_of_records_is_the_root_of_their_mean_square():
    one, other = fragility(drawn(30)), fragility(drawn(30) ** 2)
    found = spread([one, other])
    assert found.record**2 == pytest.approx((one.dispersion**2 + other.dispersion**2) / 2.0)
    apart = np.log(other.median / one.median)
    assert found.epistemic == pytest.approx(abs(apart) / np.sqrt(2.0))
    assert found.median == pytest.approx(np.sqrt(one.median * other.median))


def test_annual_rate_is_that_of_cornell():
    """For rates k a^-b, the rate is k m^-b exp(b² β² / 2), of the curve and each of its samples."""
    random = np.random.default_rng(3)
    curve = fragility(4.0 * np.exp(0.3 * random.standard_normal(30)))
    rate = curve.annual_rate(af.Hazard.power(2e-3, 2.5))

    def cornell(median, dispersion):
        return 2e-3 * median**-2.5 * np.exp(0.5 * (2.5 * dispersion) ** 2)

    assert rate.rate == pytest.approx(cornell(curve.median, curve.dispersion), rel=1e-9)
    ends = np.quantile(cornell(*curve.resampled.T), [0.05, 0.95])
    assert (rate.low, rate.high) == pytest.approx(tuple(ends), rel=1e-9)


@pytest.mark.parametrize(
    ("exponent", "dispersion"), [(4.0, 1.0), (4.0, 1.3), (6.0, 0.7), (3.0, 0.0)]
)
def test_an_annual_rate_counts_the_weakest_where_hazard_is_steep(exponent, dispersion):
    """Most of the rate then comes from b β below the median, here from up to 5.2 deviations."""
    curve = af.studies.Fragility(3.0, dispersion, 1.0, 0.0, np.tile([3.0, dispersion], (2, 1)))
    exact = 1e-3 * 3.0**-exponent * np.exp(0.5 * (exponent * dispersion) ** 2)
    # 15 deviations to the left leave 10 of its own around that peak
    assert curve.annual_rate(af.Hazard.power(1e-3, exponent)).rate == pytest.approx(exact, rel=1e-9)


def test_an_annual_rate_needs_a_hazard():
    curve = fragility([1.0, 2.0, 3.0])
    with pytest.raises(af.InvalidInput, match="give Hazard"):
        curve.annual_rate(2e-3)


@pytest.mark.parametrize(
    ("levels", "failures"),
    [
        ([1.0, 2.0, 3.0], [0, 5, 10]),  # all of the growth is at one level
        ([1.0, 1.0, 1.0], [1, 2, 3]),  # which there is only one of
    ],
)
def test_stripes_that_determine_no_dispersion_are_refused(levels, failures):
    with pytest.raises(af.InvalidInput, match="dispersion is undetermined"):
        af.studies.stripe_fragility(levels, failures, 10)


@pytest.mark.parametrize("share", [-1.0, 2.0, float("nan")])
def test_shares_outside_0_and_1_are_refused(share):
    curve = fragility([1.0, 2.0, 3.0])
    for ask in (curve.interval, lambda share: curve.band([1.0], share)):
        with pytest.raises(af.InvalidInput, match="share"):
            ask(share)
    with pytest.raises(af.InvalidInput, match="below 0"):
        curve.probability([1.0, -1.0])
