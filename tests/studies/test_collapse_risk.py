"""Rates of collapse: closed form of a lognormal capacity, intervals, parts, continued files."""

import json
import re
import tomllib
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import trapezoid
from scipy.optimize import brentq
from scipy.stats import norm

import archfem as af
from archfem.cases import risk_keys
from archfem.commands.cli import main
from archfem.studies.collapse_risk import CollapseRisk, RiskSample, bracket_capacity
from archfem.studies.variations import FallingRuns, as_falling

SITE = af.Hazard.power(2e-3, 2.5)


def risk_of(capacity, record, alternative=None, width=0.01, spectra=2.0):
    """A risk whose samples fall in brackets about given capacities, PGA in m/s²."""
    count, records = len(capacity), int(np.max(record)) + 1
    values = asdict(SITE)
    values |= {name: values[name].tolist() for name in ("intensity", "rate")}
    unscaled = {f"unscaled_{name}": ("record", np.ones(records)) for name in ("pga", "pgv")}
    unscaled["unscaled_sa"] = "record", np.ones(records)
    unscaled["unscaled_sa_avg"] = "record", np.geomspace(1.0 / spectra, spectra, records)
    samples = {
        "lower": capacity * (1.0 - 0.5 * width),
        "upper": capacity * (1.0 + 0.5 * width),
        "record_number": np.asarray(record),
        "alternative": np.array(["as given"] * count if alternative is None else alternative),
        "runs": np.full(count, 4),
        "error": np.array([""] * count),
        "admissible_step": np.full(count, np.inf),
        "lacks_joints": np.zeros(count, int),
    }
    columns = {name: ("sample", each) for name, each in samples.items()} | unscaled
    attrs = {"hazard": json.dumps(values), "doubts": "[]", "dt": 0.005}
    return CollapseRisk(xr.Dataset(columns, attrs=attrs))


def test_rate_of_a_lognormal_capacity_is_that_of_cornell():
    """For rates k a^-b, the rate is k m^-b exp(b² β² / 2)."""
    median, dispersion = 5.0, 0.4
    shares = (np.arange(1000) + 0.5) / 1000
    capacity = median * np.exp(dispersion * norm.ppf(shares))
    risk = risk_of(capacity, np.arange(1000) % 20)
    exact = 2e-3 * median**-2.5 * np.exp(0.5 * (2.5 * dispersion) ** 2)
    # quantiles at the middle of 1000 shares lack 0.2 % of the variance, and brackets add 1e-5
    assert risk.rate().rate == pytest.approx(exact, rel=2e-3)
    chance = risk.rate().probability(50.0)[0]
    assert chance == pytest.approx(1.0 - np.exp(-50.0 * risk.rate().rate), rel=1e-12)
    edges, shares = risk.disaggregation(60)
    # above the last edge all fall, and a thousandth lies below the first one
    rest = float(risk.hazard.rate_of(edges[-1])) / risk.rate().rate
    assert 0.04 < rest == pytest.approx(0.999 - shares.sum(), rel=0.01)
    # Φ(z) x^-b is largest where φ / Φ is b β
    z = brentq(lambda z: norm.pdf(z) / norm.cdf(z) - 2.5 * dispersion, -5.0, 5.0)
    peak = np.sqrt(edges[1:] * edges[:-1])[np.argmax(shares)]
    assert peak == pytest.approx(median * np.exp(dispersion * z), rel=0.04)  # a bin is 4 %


def test_shares_of_the_rate_are_those_of_a_steep_hazard_and_a_wide_capacity():
    """Integration by parts: of the rate Φ(z + b β) - Φ(z) exp(-b β z - (b β)² / 2) is below z."""
    median, dispersion, exponent = 5.0, 0.8, 3.0
    capacity = median * np.exp(dispersion * norm.ppf((np.arange(1000) + 0.5) / 1000))
    risk = risk_of(capacity, np.arange(1000) % 20)
    values = asdict(SITE) | {"intensity": [1.0, 10.0], "rate": [2e-3, 2e-3 * 10.0**-exponent]}
    risk.dataset.attrs["hazard"] = json.dumps(values)
    wide = risk.fragility().dispersion
    for bins in (6, 60):
        edges, shares = risk.disaggregation(bins)
        z = np.log(edges / risk.fragility().median) / wide
        shift = exponent * wide
        below = norm.cdf(z + shift) - norm.cdf(z) * np.exp(-shift * z - shift**2 / 2.0)
        assert below[0] == pytest.approx(1e-3, rel=0.01)
        # steps of 0.005 deviations, and two ways to fit a lognormal to narrow brackets
        assert shares == pytest.approx(np.diff(below), abs=1e-4)


@pytest.mark.parametrize("last", [pytest.param(2.5, marks=pytest.mark.slow), 8.0])
def test_a_rate_from_beyond_the_last_point_of_the_hazard_is_in_doubt(last):
    median, dispersion = 5.0, 0.4
    capacity = median * np.exp(dispersion * norm.ppf((np.arange(400) + 0.5) / 400))
    site = asdict(SITE) | {"intensity": [1.0, last], "rate": SITE.rate_of([1.0, last]).tolist()}
    risk = risk_of(capacity, np.arange(400) % 20)
    risk.dataset.attrs["hazard"] = json.dumps(site)

    def rate_above(least):
        """Rate of falls by intensities above one, by the density of the power law's rate."""
        x = np.linspace(least, 60.0, 200_000)
        falls = norm.cdf(np.log(x / median) / dispersion) * 2.5 * SITE.rate_of(x) / x
        return trapezoid(falls, x)

    share = rate_above(last) / rate_above(0.2)
    if share < 0.3:
        assert not risk.doubts
    else:
        assert f"{share:.0%} of the rate comes from intensities above {last:g}" in str(risk)


@pytest.mark.parametrize(
    ("records", "spectra", "words"),
    [
        (20, 2.0, None),
        (7, 2.0, None),
        (6, 2.0, "6 records: the interval is that of these"),
        (20, 1.05, "20 records, of spectra as of matched ones (dispersion 0.03): the interval"),
        pytest.param(
            3,
            1.05,
            "3 records, of spectra as of matched ones (dispersion 0.05): the interval",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_few_or_matched_records_are_doubted_with_the_rate_of_usual_ones(records, spectra, words):
    """Of rates k a^-b a dispersion d in place of c gives exp(b² (d² - c²) / 2) times the rate."""
    shares = (np.arange(400) + 0.5) / 400
    mixed = np.random.default_rng(0).permutation(400)
    capacity = 5.0 * np.exp(0.2 * norm.ppf(shares))[mixed]
    risk = risk_of(capacity, np.arange(400) % records, spectra=spectra)
    risk.dataset.attrs["hazard"] = json.dumps(
        {"intensity": [1.0, 50.0], "rate": SITE.rate_of([1.0, 50.0]).tolist(), "measure": "pga"}
    )
    if words is None:
        assert not risk.doubts
        return
    (doubt,) = map(str, risk.doubts)
    assert words in doubt
    known = risk.dispersions()["records"]
    factor = np.exp(0.5 * 2.5**2 * (0.3**2 - known**2))
    assert f"in place of {known:.2f}, the rate is {factor:.2g} times as large" in doubt
    assert known < 0.05


@pytest.mark.parametrize(("factor", "doubted"), [(2e-3, True), (0.05, False)])
def test_a_rate_from_beyond_the_periods_of_codes_is_in_doubt_with_a_law(factor, doubted):
    """Of 2e-3 a^-2.5 the intensity at 2475 years is 1.9 m/s², of 0.05 a^-2.5 6.86 m/s²."""
    risk = risk_of(5.0 * np.exp(0.4 * norm.ppf((np.arange(400) + 0.5) / 400)), np.arange(400) % 20)
    law = af.Hazard.power(factor, 2.5)
    risk.dataset.attrs["hazard"] = json.dumps(
        {"intensity": law.intensity.tolist(), "rate": law.rate.tolist(), "measure": "pga"}
    )
    words = f"above {(2475.0 * factor) ** 0.4:.3g} m/s², once in 2475 years"
    assert (words in str(risk)) == doubted == bool(risk.doubts)
    ratio = 5.0 / (475.0 * factor) ** 0.4
    assert f"of pga, {ratio:.2g} times that of 475 years" in risk.sentence


def test_samples_that_do_not_stand_as_drawn_are_in_doubt_with_the_rate_of_the_others():
    """Rates of lognormal capacities by Cornell's formula, k_0 m^-k exp((k β)² / 2)."""
    capacity = np.exp(np.linspace(0.0, 1.0, 20))
    soft, found = capacity < 1.5, risk_of(capacity, np.arange(20) % 10)
    assert "under dead load" not in str(found.doubts)  # a file without their slips
    found.dataset["k_s"] = "sample", np.where(soft, 0.5, 2.0)
    found.dataset["slip_at_rest"] = "sample", np.where(soft, 1.2e-3, 0.9e-3)
    (doubt,) = (each for each in found.doubts if "under dead load" in each.cause)

    def cornell(capacities):
        logs = np.log(capacities)
        return np.exp(0.5 * (2.5 * np.std(logs)) ** 2 - 2.5 * np.mean(logs))

    (times,) = re.findall(r"the rate is (.*) times", doubt.cause)
    # two digits; brackets are as narrow as 1 %
    assert float(times) == pytest.approx(cornell(capacity[~soft]) / cornell(capacity), rel=0.03)
    assert f"by up to 1.2 mm under dead load in {soft.sum()} of 20 samples" in doubt.cause
    assert "vary={'k_s': (0.63, 2)}" in doubt.remedy  # 0.5 × 1.2 with 5 % added
    found.dataset["slip_at_rest"][:] = 1.2e-3
    (doubt,) = (each for each in found.doubts if "under dead load" in each.cause)
    assert "in 20 of 20 samples, which do not stand as drawn; `archfem check`" in str(doubt)


@pytest.mark.slow
def test_the_interval_holds_the_rate_as_often_as_it_says():
    """Each record has one sample: ln λ varies by b² β² / n (1 + b² β² / 2)."""
    random, inside, widths = np.random.default_rng(1), 0, []
    exact = 2e-3 * 5.0**-2.5 * np.exp(0.5 * (2.5 * 0.3) ** 2)
    for _ in range(40):
        risk = risk_of(5.0 * np.exp(0.3 * random.standard_normal(60)), np.arange(60))
        rate = risk.rate()
        inside += rate.low <= exact <= rate.high
        widths.append(np.log(rate.high / rate.low))
    # binomial of 40 at 0.9: 31 or more in 97 %
    assert inside >= 31
    expected = 2.0 * 1.645 * 0.75 * np.sqrt((1.0 + 0.5 * 0.75**2) / 60)
    assert np.mean(widths) == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
def test_few_records_widen_the_interval():
    """Of seven records quantiles of the bootstrap would contain the rate in 74 of these cases."""
    random, inside = np.random.default_rng(3), 0
    exact = 2e-3 * 5.0**-2.5 * np.exp(0.5 * 2.5**2 * (0.35**2 + 0.25**2))
    record = np.arange(21) % 7
    for _ in range(100):
        logs = 0.35 * random.standard_normal(7)[record] + 0.25 * random.standard_normal(21)
        rate = risk_of(5.0 * np.exp(logs), record).rate()
        inside += rate.low <= exact <= rate.high
    assert 78 <= inside <= 96


@pytest.mark.slow
def test_alternatives_far_apart_add_their_rates():
    """Their capacities together are far from lognormal: one fit gives half of the rate."""
    quantiles = 0.3 * norm.ppf((np.arange(200) + 0.5) / 200)
    weak = np.arange(2000) % 10 == 0
    capacity = np.empty(2000)
    capacity[weak] = 2.0 * np.exp(quantiles)
    capacity[~weak] = 10.0 * np.exp(np.tile(quantiles, 9))
    risk = risk_of(capacity, np.arange(2000) // 10 % 20, np.where(weak, "rubble", "ashlar"))
    weakest, other = (2e-3 * median**-2.5 * np.exp(0.5 * 0.75**2) for median in (2.0, 10.0))
    # 200 quantiles lack 1 % of the variance
    assert risk.rate("rubble").rate == pytest.approx(weakest, rel=0.01)
    assert risk.rate().rate == pytest.approx(0.1 * weakest + 0.9 * other, rel=0.01)
    edges, shares = risk.disaggregation(60)
    density = sum(
        weight * norm.cdf(np.log(edges / median) / 0.3) * edges**-2.5
        for weight, median in ((0.1, 2.0), (0.9, 10.0))
    )
    below = edges < 4.0
    above = edges[-1] ** -2.5 / 2.5
    whole = trapezoid(density, np.log(edges)) + above
    exact = trapezoid(density[below], np.log(edges[below])) / whole
    assert shares[below[1:]].sum() == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda risk: risk.rate().probability(-50.0), "years = -50"),
        (lambda risk: risk.disaggregation(0), "bins = 0"),
        (lambda risk: risk.capacities("Sa"), "measure = 'Sa' is not known"),
    ],
)
def test_questions_without_an_answer_are_refused(ask, words):
    risk = risk_of(np.linspace(3.0, 5.0, 12), np.arange(12) % 4)
    with pytest.raises(af.InvalidInput, match=words):
        ask(risk)


def test_scales_the_larger_first_are_refused():
    with pytest.raises(af.InvalidInput, match="the smaller first"):
        af.collapse_risk(*tilted_block(), SITE, between=(2.0, 1.0))


@pytest.mark.parametrize("missing", [1, 3])
def test_many_samples_without_an_answer_are_a_doubt(missing):
    risk = risk_of(np.geomspace(3.0, 6.0, 40), np.arange(40) % 8)
    risk.dataset["error"].values = np.array(["it failed"] * missing + [""] * (40 - missing))
    have = "sample has" if missing == 1 else "samples have"
    assert f"{missing} {have} no answer" in risk.sentence
    assert ("3 of 40 samples have no answer because" in str(risk.doubts)) == (missing == 3)


def slid(time, joint):
    return f"DidNotConverge: by t = {time} s the faces of '{joint}' had slid; take fewer cells"


def test_the_most_common_reason_is_given_of_samples_without_an_answer():
    risk = risk_of(np.geomspace(3.0, 6.0, 12), np.arange(12) % 3)
    errors = ["InvalidInput: another", slid(1.92, "stone 30"), slid(2.5e-1, "stone 1"), *[""] * 9]
    risk.dataset["error"].values = np.array(errors, object)
    (doubt,) = (str(each) for each in risk.doubts if "answer" in str(each))
    reason = slid(1.92, "stone 30").removeprefix("DidNotConverge: ")
    assert doubt.endswith(f"3 of 12 samples have no answer, 2 of them because {reason}")
    few = CollapseRisk(risk.dataset.isel(sample=slice(10)))
    for ask in (few.rate, few.fragility, lambda: str(few)):
        with pytest.raises(af.DidNotConverge, match=r"3 of 10 .* take fewer cells; a rate needs 8"):
            ask()
    few = CollapseRisk(few.dataset.assign(error=("sample", np.array([""] * 10))))
    few.dataset["runs"].values[:4] = 0
    with pytest.raises(af.DidNotConverge, match="4 of 10 samples were not run yet"):
        few.rate()


def test_a_motion_of_nothing_is_refused():
    analysis, motions = tilted_block()
    still = af.Motion(np.zeros(50), 0.01, name="still")
    with pytest.raises(af.InvalidInput, match="'still' is zero along x"):
        af.collapse_risk(analysis, [*motions, still], SITE)


@pytest.mark.slow
def test_dispersion_is_split_into_its_parts():
    random = np.random.default_rng(2)
    record, alternative = np.arange(1200) % 30, (np.arange(1200) // 30) % 2
    logs = 0.3 * random.standard_normal(30)[record] + 0.2 * (2.0 * alternative - 1.0)
    logs += 0.1 * random.standard_normal(1200)
    labels = np.array(["sawn", "hewn"])[alternative]
    parts = risk_of(5.0 * np.exp(logs), record, labels).dispersions()
    # of thirty records the deviation is known to 13 %; two alternatives ± 0.2 have 0.28
    assert parts["records"] == pytest.approx(0.3, rel=0.4)
    assert parts["alternatives"] == pytest.approx(0.2 * np.sqrt(2.0), rel=0.1)
    total = parts["total"] ** 2
    assert total == pytest.approx(0.3**2 + 0.2**2 + 0.1**2, rel=0.4)
    rates = {
        label: risk_of(5.0 * np.exp(logs), record, labels).rate(label) for label in set(labels)
    }
    assert rates["sawn"].rate > rates["hewn"].rate


@pytest.mark.slow
def test_widths_of_brackets_are_no_dispersion():
    """Of brackets as wide as a run makes them, about capacities without any dispersion but 0.1."""
    random, width = np.random.default_rng(4), np.log(1.25)
    logs = np.log(5.0) + 0.1 * random.standard_normal(1500)
    low = width * np.floor(logs / width)
    risk = risk_of(np.exp(logs), np.arange(1500) % 20)
    risk.dataset["lower"].values[:] = np.exp(low)
    risk.dataset["upper"].values[:] = np.exp(low + width)
    parts = risk.dispersions()
    # middles of the brackets deviate by 0.119
    assert (parts["total"], parts["properties"]) == pytest.approx((0.1, 0.1), rel=0.05)
    assert parts["total"] == pytest.approx(risk.fragility().dispersion, rel=0.05)


def tilted_block():
    """A slender block, which one run decides in milliseconds, and short motions."""
    block = af.column(breadth=0.25, heights=[1.5], contact=af.Contact(1e9, 5e8, 0.7))
    analysis = af.Analysis(block, fidelity="rigid", damping="effective", dt=0.005)
    motions = [af.Motion.synthetic(duration=2.0, pga=3.0, seed=seed) for seed in range(3)]
    return analysis, motions


@pytest.fixture
def quick_runs(monkeypatch):
    """Structures that fall where the ground is stronger than their breadth over their height."""

    def prepare(analysis, changes):
        block = analysis.structure.blocks[-1]
        width, height = np.ptp(np.array(block.points), axis=0)
        limit = 9.81 * width / height * (1.0 + changes["friction"])

        def run(motion):
            kind = "fallen" if motion.pga > limit else "stands"
            return af.dynamics.CollapseState(kind, None, (), 0.0, 0.0, True)

        return run

    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", prepare)


@pytest.mark.slow
def test_a_block_falls_between_what_tilts_it_and_what_any_pulse_needs():
    analysis, motions = tilted_block()
    found = af.collapse_risk(analysis, motions, SITE, samples=8, precision=0.5)
    low, high = found.capacities()
    assert (low < high).all()
    # peaks above b/h g lift it
    assert (high > 9.81 * 0.25 / 1.5).all()


@pytest.mark.parametrize("precision", [0.1, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("begin", [0.3, 0.95, 3.7])
def test_no_bracket_is_narrower_than_its_precision(quick_runs, precision, begin):
    analysis, motions = tilted_block()
    exact = 9.81 * 0.25 / 1.5 / motions[0].pga
    sample = RiskSample(
        analysis, motions[0], (("friction", 0.0),), begin * exact, (0.01, 5.0), precision
    )
    found = bracket_capacity(sample)
    assert found["lower"] < exact < found["upper"]
    # but for rounding: bisections of the factor between scales end there
    assert found["upper"] / found["lower"] == pytest.approx(1.0 + precision, rel=1e-12)


@pytest.mark.slow
def test_steps_too_long_for_sliding_at_a_bound_are_in_doubt(monkeypatch):
    """Those of runs far from the bracket do not count."""

    def slides(_, changes):
        def run(motion):
            over = motion.pga / (2.0 + changes["friction"])
            falls, far = over > 1.0, not 0.5 < over < 2.0
            step = 1e-4 if far else 2e-3 if falls and changes["friction"] < 0.0 else np.inf
            kind = "fallen" if falls else "stands"
            return af.dynamics.CollapseState(kind, None, (), 0.0, 0.0, True, step)

        return run

    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", slides)
    given = *tilted_block(), SITE
    found = af.collapse_risk(*given, samples=8, precision=0.5, vary={"friction": (-0.1, 0.1)})
    (doubt,) = (str(each) for each in found.doubts if "sliding" in str(each))
    assert doubt == (
        "in 4 of 8 samples the steps, 5 ms, are long for sliding; take 2 ms, "
        "`--set analysis.dt=0.002`, or less, and repeat this while any is in doubt"
    )
    found.dataset["admissible_step"].values[:] = np.inf
    assert "sliding" not in str(found.doubts)


@pytest.mark.slow
def test_samples_that_stand_without_joints_in_strong_motion_are_in_doubt(monkeypatch):
    """Half of the samples have loose blocks, of which those that fall count for nothing."""

    def loose(analysis, changes):
        def run(motion):
            falls = motion.pga > 2.0 + changes["k_n"]
            share = 0.5 if changes["friction"] < 0.0 else 0.04
            kind = "fallen" if falls else "stands"
            return af.dynamics.CollapseState(kind, None, (), 0.0, 0.0, True, np.inf, share)

        return run

    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", loose)
    given = *tilted_block(), SITE
    found = af.collapse_risk(*given, samples=8, precision=0.5, vary={"friction": (-0.1, 0.1)})
    (doubt,) = (str(each) for each in found.doubts if "loose" in str(each))
    assert doubt.startswith("in 4 of 8 samples blocks were loose, without elastic joints")
    found.dataset["lacks_joints"].values[:] = 0
    assert "loose" not in str(found.doubts)


def test_samples_are_kept_and_continued(tmp_path, monkeypatch, quick_runs):
    analysis, motions = tilted_block()
    options = {"samples": 10, "out": tmp_path / "risk.nc", "precision": 0.02}
    whole = af.collapse_risk(analysis, motions, SITE, samples=10, precision=0.02)
    calls = []
    store = af.studies.collapse_risk._store_row

    def interrupted(table, number, row):
        store(table, number, row)
        calls.append(number)
        if len(calls) == 5:
            raise KeyboardInterrupt

    monkeypatch.setattr(af.studies.collapse_risk, "_store_row", interrupted)
    with pytest.raises(KeyboardInterrupt):
        af.collapse_risk(analysis, motions, SITE, **options)
    found = af.collapse_risk(analysis, motions, SITE, **options)
    assert len(calls) == 11  # the one that was ended before it was kept, again
    xr.testing.assert_identical(
        found.dataset[["lower", "upper", "runs"]], whole.dataset[["lower", "upper", "runs"]]
    )
    low, high = found.capacities()
    assert (low < high).all()
    assert "falls at" in str(CollapseRisk.read(options["out"]))
    with pytest.raises(af.InvalidInput, match="other arguments"):
        af.collapse_risk(analysis, motions, SITE, **options | {"seed": 1})


def test_slips_of_samples_in_doubt_under_dead_load_stay_in_a_file(
    tmp_path, quick_runs, monkeypatch
):
    """Those up to a millimetre are in no doubt; a file of such alone has none."""
    prepare, analysis = af.studies.collapse_risk.prepare_runs, tilted_block()

    def soft(*given):
        run = prepare(*given)
        run.slip_at_rest = 1e-3 / given[1]["k_s"]
        return run

    options = {"out": tmp_path / "risk.nc", "precision": 0.02}
    stiff = af.collapse_risk(*analysis, SITE, samples=8, **options).dataset
    assert "slip_at_rest" not in stiff
    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", soft)
    for samples in (18, 26):
        found = af.collapse_risk(*analysis, SITE, samples=samples, **options).dataset
    factors = found["k_s"].values
    expected = np.where((factors < 1.0) & (np.arange(26) >= 8), 1e-3 / factors, 0.0)
    assert 3 < np.count_nonzero(expected) < 15
    assert found["slip_at_rest"].values == pytest.approx(expected)


def test_each_sample_keeps_how_far_its_dead_load_shears_the_joints(monkeypatch):
    """V / (k_s A) of closed joints by an analysis of the dead load alone."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    stands = af.dynamics.CollapseState("stands", None, (), 0.0, 0.0, True)
    monkeypatch.setattr(FallingRuns, "__call__", lambda *_: stands)
    analysis, motion = as_falling(ring), af.Motion.synthetic(seed=1, duration=1.0, pga=1.0)
    for factor in (0.05, 1.0):
        sample = RiskSample(analysis, motion, (("k_s", factor),), 1.0, (0.5, 2.0), 0.5)
        given = ring.joints[0].contact
        contact = replace(given, shear_stiffness=factor * given.shear_stiffness)
        joints = tuple(replace(joint, contact=contact) for joint in ring.joints)
        rest = af.dead_load(af.build(replace(ring, joints=joints), fidelity="rigid")).joints
        sheared = abs(rest["V"].values) / (contact.shear_stiffness * ring.depths * ring.width)
        # displacements of a sample may be large; up to a millimetre none is kept
        kept = bracket_capacity(sample).get("slip_at_rest", 0.0)
        assert kept == pytest.approx(sheared.max() * (factor == 0.05), rel=0.02)


@pytest.mark.slow
def test_samples_are_added_to_those_of_a_file(tmp_path, quick_runs):
    analysis, motions = tilted_block()
    options = {"out": tmp_path / "risk.nc", "precision": 0.02}
    first = af.collapse_risk(analysis, motions, SITE, samples=10, **options).dataset
    more = af.collapse_risk(analysis, motions, SITE, samples=26, **options).dataset
    for name in ("friction", "record_number", "lower", "upper"):
        np.testing.assert_array_equal(more[name].values[:10], first[name].values)
    # those added are a Latin hypercube: one in each sixteenth of the range
    added = more["friction"].values[10:]
    assert sorted(np.floor((added + 0.1) / 0.2 * 16.0).astype(int)) == list(range(16))
    assert (more["runs"].values > 0).all()
    again = af.collapse_risk(analysis, motions, SITE, samples=26, **options).dataset
    xr.testing.assert_identical(again, more)
    third = af.collapse_risk(analysis, motions, SITE, samples=27, **options).dataset
    np.testing.assert_array_equal(third["friction"].values[:26], more["friction"].values)
    with pytest.raises(af.InvalidInput, match=r"has 27 samples.*give samples = 27 or more"):
        af.collapse_risk(analysis, motions, SITE, samples=26, **options)
    with pytest.raises(af.InvalidInput, match="other arguments"):
        af.collapse_risk(analysis, motions, SITE, samples=40, seed=1, **options)


def test_another_hazard_keeps_the_samples_of_a_file(tmp_path, quick_runs, monkeypatch):
    analysis, motions = tilted_block()
    options = {"out": tmp_path / "risk.nc", "precision": 0.02, "samples": 10}
    first = af.collapse_risk(analysis, motions, SITE, **options)
    rare = af.Hazard(SITE.intensity, 0.1 * SITE.rate)
    no_run = {"name": "bracket_capacity", "value": None}
    monkeypatch.setattr(af.studies.collapse_risk, **no_run)
    again = af.collapse_risk(analysis, motions, rare, **options)
    assert again.rate().rate == pytest.approx(0.1 * first.rate().rate, rel=1e-9)
    assert CollapseRisk.read(options["out"]).hazard.rate == pytest.approx(rare.rate)


@pytest.mark.parametrize(
    ("measure", "ratio", "doubted"),
    [
        ("pga", 0.87, True),
        ("sa", 0.92, False),
        pytest.param("pga", 0.92, False, marks=pytest.mark.slow),
        pytest.param("pga", 1.09, False, marks=pytest.mark.slow),
        pytest.param("sa", 0.87, True, marks=pytest.mark.slow),
        pytest.param("sa", 1.09, False, marks=pytest.mark.slow),
    ],
)
def test_a_hazard_of_other_ground_than_the_target_is_in_doubt(ratio, doubted, measure, quick_runs):
    """Soil C of EN 1998-1 has S = 1.15, and 1.15 · 2.5 on its plateau: rock is 13 % below."""
    design = 9.80665 * 0.22 * 1.15 * (2.5 if measure == "sa" else 1.0)
    period = {"period": 0.4} if measure == "sa" else {}
    points = {475.0: ratio * design, 2475.0: 1.7 * ratio * design}
    site = af.Hazard.from_return_periods(points, measure=measure, **period)
    target = af.motion.Eurocode8(0.22, "C")
    options = {"samples": 8, "precision": 0.02}
    found = af.collapse_risk(*tilted_block(), site, target=target, **options)
    words = f"the target of the motions {design:.3g} m/s²"
    assert (words in str(found)) == doubted
    assert words not in str(af.collapse_risk(*tilted_block(), site, **options))


def thin_arch(finish):
    """A semicircle of seven stones, t/R = 0.125, with joints of a finish."""
    size = {"radius": 4.0, "thickness": 0.5, "embrace": 180.0, "voussoirs": 7, "chords": 1}
    return af.masonry.with_finish(af.circular_arch(**size), finish)


@pytest.mark.slow
def test_a_tree_over_finish_has_the_rates_of_each_finish_alone():
    """Softer joints lower the capacity; a sample is the same in the tree and alone."""
    times = np.arange(0.0, 0.5, 0.005)
    pulses = [
        af.Motion(np.where(times < end, np.sin(np.pi * times / end), 0.0), 0.005)
        for end in (0.2, 0.3)
    ]
    held = {"k_n": 1.0, "k_s": 1.0, "friction": 0.0, "damping_ratio": 1.0}
    options = {"samples": 16, "vary": held, "precision": 0.2}
    damping = af.StiffnessDamping(0.05, 11.0)
    analysis = af.Analysis(thin_arch("sawn"), fidelity="rigid", damping=damping, dt=0.005)
    alternatives = {name: (1.0, thin_arch(name)) for name in ("sawn", "weathered")}
    tree = af.collapse_risk(analysis, pulses, SITE, alternatives=alternatives, **options)
    assert tree.rate("weathered").rate > 1.2 * tree.rate("sawn").rate
    alone = af.collapse_risk(analysis, pulses, SITE, **options)
    own = np.flatnonzero(tree.dataset["alternative"].values == "sawn")
    same = CollapseRisk(alone.dataset.isel(sample=own))
    first = own[own < 8]  # the search of others begins at the median of these
    for name in ("lower", "upper"):
        found = (each.dataset[name].values[first] for each in (tree, alone))
        np.testing.assert_array_equal(*found)
    # brackets of one capacity, whose width is the precision, overlap
    assert np.log(tree.rate("sawn").rate / same.rate().rate) == pytest.approx(
        0.0, abs=2.5 * np.log(1.2)
    )


@pytest.mark.parametrize("name", ["sign", "scale", "width"])
def test_what_is_no_property_is_refused(name):
    analysis, motions = tilted_block()
    values = {"sign": "reversed", "scale": (1.0, 2.0), "width": {"one": analysis.structure}}
    with pytest.raises(af.InvalidInput, match=f"'{name}' cannot be varied here"):
        af.collapse_risk(analysis, motions, SITE, vary={name: values[name]})


def test_runs_without_any_answer_are_an_error(monkeypatch):
    def fail(*_):
        raise af.DidNotConverge("made to fail", last=None)

    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", fail)
    with pytest.raises(af.DidNotConverge, match=r"8 of 8 samples .* because made to fail"):
        af.collapse_risk(*tilted_block(), SITE, samples=9)


def test_soft_fill_that_falls_in_one_piece_is_a_doubt(quick_runs):
    analysis, motions = tilted_block()
    block = analysis.structure.blocks[-1]
    soil = af.Material(6.25e6, 0.2, 18e3, name="soil")
    blocks = (*analysis.structure.blocks[:-1], replace(block, material=soil))
    soft = replace(analysis, structure=replace(analysis.structure, blocks=blocks))
    options = {"samples": 16, "precision": 0.02}
    tree = {"stone": (1.0, analysis), "soil": (1.0, soft)}
    found = af.collapse_risk(analysis, motions, SITE, alternatives=tree, **options)
    words = f"for rigid bodies, each in one piece: {block.name}"
    assert sum(words in str(doubt) for doubt in found.doubts) == 1
    assert words in str(found)
    alone = af.collapse_risk(analysis, motions, SITE, **options)
    assert words not in str(alone)


def test_too_few_records_are_refused():
    analysis, motions = tilted_block()
    with pytest.raises(af.InvalidInput, match="several records"):
        af.collapse_risk(analysis, motions[:1], SITE)


@pytest.mark.slow
def test_a_case_file_gives_the_same_rate(tmp_path, capsys, quick_runs, low_resolution):
    path = tmp_path / "block.toml"
    path.write_text(
        """
title = "Slender block"
[structure]
shape = "column"
breadth = 0.25
heights = [1.5]
[model]
fidelity = "rigid"
[suite]
name = "short"
pairs.a = { synthetic = { seed = 0, duration = 2.0, pga = 3.0 } }
pairs.b = { synthetic = { seed = 1, duration = 2.0, pga = 3.0 } }
[analysis]
dt = 0.005
damping = { ratio = 0.05, modes = "effective" }
[risk]
samples = 16
precision = 0.05
hazard = { rates = [0.02, 0.001], intensities = ["1 m/s**2", "0.4 g_0"], source = "a test" }
alternatives.slender = {}
alternatives.slenderer = { weight = 1.0, set = ["structure.breadth=0.22"] }
[[assessment.loads]]
block = "block 1"
point = [0.0, 1.5]
weight = "2 kN"
"""
    )
    code = main(["risk", str(path), "--out", str(tmp_path / "out")])
    printed = capsys.readouterr().out
    found = CollapseRisk.read(tmp_path / "out" / "risk.nc")
    assert str(found) in printed
    assert "note: without the 2 kN of weights of [assessment]" in printed
    assert (code == 3) == bool(found.doubts)
    assert found.rate("slenderer").rate > found.rate("slender").rate
    assert found.hazard.rate_of([1.0, 0.4 * 9.80665]) == pytest.approx([0.02, 0.001])
    main(["report", str(tmp_path / "out")])
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Annual rate of collapse</h2>" in report
    concluded = report.partition("Inputs and assumptions</h2>")[0]
    median = f"from {found.fragility().median:.3g} m/s² of PGA. Hazard of the site: a test."
    assert f"The structure falls at {found.rate()}. In half of the cases {median}" in concluded
    assert "\nhazard of the site: a test\n" in printed
    assert "dispersion 0" not in concluded  # statistics are in their section
    assert "Cornell et al." in report


@pytest.mark.slow
def test_a_risk_without_a_rate_is_reported_with_the_reason(tmp_path, capsys, monkeypatch):
    path = tmp_path / "block.toml"
    path.write_text(
        """
title = "Slender block"
structure = { shape = "column", breadth = 0.25, heights = [1.5] }
model = { fidelity = "rigid" }
suite.name = "short"
suite.pairs.a = { synthetic = { seed = 0, duration = 2.0, pga = 3.0 } }
suite.pairs.b = { synthetic = { seed = 1, duration = 2.0, pga = 3.0 } }
analysis = { dt = 0.005 }
risk = { samples = 8, hazard = { factor = 0.01, exponent = 2.0 } }
"""
    )

    def fail(*_):
        raise af.DidNotConverge("blocks overlap by 3 mm", last=None)

    monkeypatch.setattr(af.studies.collapse_risk, "prepare_runs", fail)
    assert main(["risk", str(path), "--out", str(tmp_path / "out")]) not in (0, 3)
    words = "8 of 8 samples have no answer because blocks overlap by 3 mm"
    assert f"no answer: {words}" in capsys.readouterr().out
    main(["report", str(tmp_path / "out")])
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"nnual rate of collapse: no answer: {words}" in report


def test_a_hazard_is_a_power_law_points_or_a_row_of_a_file(tmp_path):
    def parse(words):
        return risk_keys.parse_hazard(tomllib.loads(f"h = {words}")["h"], tmp_path)

    assert parse("{ factor = 0.01, exponent = 2.0 }").rate_of(2.0) == pytest.approx(0.0025)
    points = parse('{ return_periods = [475, 2475], intensities = ["4 m/s**2", 7.0] }')
    assert points.rate_of([4.0, 7.0]) == pytest.approx([1 / 475, 1 / 2475])
    rows = "31.16,40.84,0.0,0.4,0.2\n", "31.16,40.85,0.0,0.3,0.1\n"
    head = "#,,,\"imt='PGA', investigation_time=50.0\"\nlon,lat,depth,poe-0.1,poe-0.2\n"
    (tmp_path / "curves.csv").write_text(head + "".join(rows))
    for words, probability in (("", 0.4), (", site = 1", 0.3)):
        hazard = parse(f"{{ file = 'curves.csv'{words} }}")
        assert hazard.origin == f"hazard of the site: curves.csv, row {int(probability < 0.4)}"
        rate = -np.log(1.0 - probability) / 50.0
        assert hazard.rate_of(0.1 * 9.80665) == pytest.approx(rate)
    assert parse("{ factor = 0.01, exponent = 2.0, source = 'map' }").origin.endswith(": map")
    assert points.origin == "hazard of the site: source not given"
    assert parse("{ file = 'curves.csv', source = 'map' }").origin.endswith(": map")
    with pytest.raises(af.InvalidInput, match="a file names its measure"):
        parse("{ file = 'curves.csv', period = 0.2 }")


def test_every_form_of_a_hazard_in_the_guide_is_read(tmp_path):
    """Rows of its table, each inside the braces of its head; all bring the keys that there are."""
    page = Path(__file__).parents[2] / "docs" / "howto" / "falls.md"
    forms = re.findall(r"^\| `(\w+ = [^`]*)` \|", page.read_text(encoding="utf-8"), re.MULTILINE)
    head = "#,,,\"imt='PGA', investigation_time=50.0\"\nlon,lat,depth,poe-0.1,poe-0.2\n"
    (tmp_path / "hazard_curve-mean-PGA.csv").write_text(head + "31.16,40.84,0.0,0.4,0.2\n")
    tables = [tomllib.loads(f"hazard = {{ {form} }}")["hazard"] for form in forms]
    rates = [risk_keys.parse_hazard(table, tmp_path).rate_of(4.5) for table in tables]
    assert rates[:3] == pytest.approx([1 / 475, 2.1e-3, 2e-3 * 4.5**-2.5])
    assert set().union(*tables) | {"measure", "period", "source"} == set(risk_keys.HAZARD_KEYS)


@pytest.mark.parametrize("hazard", ["{ rates = [0.1] }", "{ factor = 1.0 }", "{}"])
def test_a_hazard_that_is_none_is_refused(hazard):
    with pytest.raises(af.InvalidInput, match="hazard"):
        risk_keys.parse_hazard(tomllib.loads(f"h = {hazard}")["h"], Path())
