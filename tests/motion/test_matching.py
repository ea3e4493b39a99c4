"""Matching to a design spectrum."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.motion import matched, response_spectra
from archfem.motion.matching import _build_wavelet, _impulse_response, spectral_misfit

RECORDS = Path(__file__).parents[2].parent / "shared" / "records"
CASE_STUDY = af.Tbec2018(ss=1.140, s1=0.315, site="ZD")


@pytest.fixture(scope="module")
def shaking():
    return af.Motion.synthetic(duration=10.0, dt=0.01, seed=3)


@pytest.fixture(scope="module")
def match(shaking):
    return matched(shaking, CASE_STUDY)


@pytest.mark.parametrize("component", ["horizontal", "vertical"])
def test_matched_motion_follows_the_target(match, component, verified):
    # Evenly in period here, in log period where it is matched.
    periods = np.linspace(0.05, 2.0, 120)
    target = getattr(CASE_STUDY, component)(periods) * af.units.STANDARD_GRAVITY
    ratio = af.response_spectrum(match.motion, periods, component=component) / target
    assert np.sqrt(np.mean((ratio - 1.0) ** 2)) < 0.05
    assert match.misfit[component] < 0.05
    peak = np.abs(match.motion.component(component)).max() / af.units.STANDARD_GRAVITY
    # The rounds stop within 10 % of the target's peak, or at the best they found.
    assert peak == pytest.approx(float(getattr(CASE_STUDY, component)(0.0)), rel=0.15)
    assert match.misfit[component] == spectral_misfit(match.motion, CASE_STUDY, component=component)
    case = f"motion matched to TBEC-2018, {component}, 0.05 to 2 s: rms misfit"
    verified(case, "below 0.05", "the target", f"{match.misfit[component]:.3f}", difference=None)


@pytest.mark.parametrize("component", ["horizontal", "vertical"])
def test_matched_motion_ends_at_rest_where_it_began(match, component):
    # The wavelets have no net velocity or displacement: round-off.
    assert match.motion.velocity(component)[-1] == pytest.approx(0.0, abs=1e-10)
    assert match.motion.displacement(component)[-1] == pytest.approx(0.0, abs=1e-10)


def test_matching_keeps_the_character_of_the_motion(match, shaking):
    before, after = match.before["horizontal"], match.after["horizontal"]
    assert before.pga == pytest.approx(shaking.pga)
    assert after.pga == match.motion.pga
    assert match.motion.dt == 0.005  # a tenth of the shortest period that is matched
    assert after.significant_duration == pytest.approx(before.significant_duration, rel=0.3)
    moved = np.corrcoef(match.motion.at(shaking.times())[:, 0], shaking.horizontal)[0, 1]
    assert moved > 0.7


def test_matching_twice_changes_little(match):
    again = matched(match.motion, CASE_STUDY)
    # Already below the misfit at which the rounds stop: only drift and scale are touched.
    assert np.abs(again.motion.horizontal - match.motion.horizontal).max() < 0.05 * match.motion.pga


def test_a_fling_that_matching_takes_out_is_said_with_its_size(shaking, caplog):
    """A pulse of whole sine, 2 π d/T² high, moves the ground by d = 1 m in T = 3 s."""
    times = shaking.times()
    pulse = np.sin(2.0 * np.pi * (times - 4.0) / 3.0) * ((times >= 4.0) & (times <= 7.0))
    fling = af.Motion(shaking.horizontal + 2.0 * np.pi / 9.0 * pulse, shaking.dt, name="fling")
    periods = np.geomspace(0.05, 2.0, 100)
    own = af.response_spectrum(fling, periods) / af.units.STANDARD_GRAVITY
    with caplog.at_level("WARNING", logger="archfem"):
        match = matched(fling, af.motion.TableSpectrum(periods, own))
    (said,) = caplog.messages
    assert "motion 'fling', horizontal: matching took out a displacement of 1 m at the end" in said
    before, after = match.before["horizontal"], match.after["horizontal"]
    assert before.pgd > 1.0 > 2.0 * after.pgd
    assert f"PGD was {before.pgd:.3g} and is {after.pgd:.3g} m, PGV {before.pgv:.3g}" in said
    caplog.clear()
    matched(shaking.with_vertical(None), CASE_STUDY)  # which ends where it began
    assert not caplog.messages


def test_other_spectra_and_bands(shaking):
    target = af.Eurocode8(ag=0.25, ground="B")
    level = shaking.with_vertical(None)
    match = matched(level, target, band=(0.1, 1.0), tolerance=0.04)
    assert spectral_misfit(match.motion, target, band=(0.1, 1.0)) < 0.04
    assert match.motion.components == ("horizontal",)


def test_a_table_that_begins_above_zero_is_accepted(shaking):
    periods = np.geomspace(0.05, 2.0, 60)
    table = af.motion.TableSpectrum(periods, CASE_STUDY.horizontal(periods))
    assert matched(shaking.with_vertical(None), table).misfit["horizontal"] < 0.05


@pytest.mark.slow
def test_motions_and_bands_that_cannot_be_matched_are_refused(shaking):
    with pytest.raises(af.errors.InvalidInput, match="shorter than 20 s"):
        matched(shaking, CASE_STUDY, band=(0.05, 10.0))
    with pytest.raises(af.errors.InvalidInput, match="at rest"):
        matched(af.Motion(np.zeros(2000), 0.01), CASE_STUDY)
    with pytest.raises(af.errors.InvalidInput, match="0 < first < second"):
        matched(shaking, CASE_STUDY, band=(1.0, 0.5))
    for band in ((0.0, 1.0), (0.1, np.inf)):
        with pytest.raises(af.errors.InvalidInput, match="0 < first < second"):
            spectral_misfit(shaking, CASE_STUDY, band=band)
    spike = af.motion.TableSpectrum([0.01, 0.5, 0.51, 0.52, 5.0], [1e-3, 1e-3, 1.0, 1e-3, 1e-3])
    short = af.Motion.synthetic(duration=4.0, dt=0.02, seed=3).with_vertical(None)
    with pytest.raises(af.errors.DidNotConverge, match="misfit") as caught:
        matched(short, spike, tolerance=0.02)
    assert caught.value.last.misfit["horizontal"] > 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "peer_at2/RSN126_GAZLI_GAZ-UP.AT2",
        "plain_columns/erzikan.txt",
        "other_formats/0111a.smc",
    ],
)
def test_real_records_match(name):
    if not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    match = matched(af.Motion.read(RECORDS / name, column=1), CASE_STUDY)
    assert match.misfit["horizontal"] < 0.05
    assert match.motion.displacement()[-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("period", "damping"), [(0.3, 0.05), (0.8, 0.2)])
def test_the_sum_of_impulse_responses_is_the_response(period, damping):
    """A smooth motion against the exact oscillator; the sum of rectangles errs by (ω Δt)²."""
    dt, times = 0.002, 0.002 * np.arange(600)
    samples = np.sin(5.0 * times) * times * np.exp(-times)
    moved = response_spectra.oscillator_displacement(samples, dt, period, damping)
    for at in (150, 599):
        memory = _impulse_response(period, at * dt, damping, dt=dt, count=600)
        expected = -((2.0 * np.pi / period) ** 2) * moved[at]
        assert memory @ samples == pytest.approx(expected, rel=5e-3)
        assert not memory[at + 1 :].any()
    assert _impulse_response(0.0, 0.2, damping, dt=dt, count=600) @ samples == samples[100]


@pytest.mark.parametrize("centre", [5.0, 0.3, 9.8])
def test_a_wavelet_moves_the_ground_by_a_cosine_under_a_bell(centre):
    """The wavelet has size one: second differences of a closed form off the ends, and no drift.

    Where it is brought to zero far from its middle it has faded to 1e-7.
    """
    period, dt, count = 0.5, 0.01, 1001
    wave = _build_wavelet(period, centre, dt, count)
    assert np.abs(wave).max() == pytest.approx(1.0)
    assert np.abs(np.cumsum(wave)).max() > 0.1
    assert np.abs([np.cumsum(wave)[-1], np.cumsum(np.cumsum(wave))[-1]]).max() < 1e-10
    time = dt * np.arange(-1, count + 1) - centre
    bell = np.exp(-((time / (1.178 * period**0.93)) ** 2)) * np.cos(2.0 * np.pi * time / period)
    inner = slice(*{5.0: (52, 949), 0.3: (52, 600), 9.8: (400, 949)}[centre])
    known = np.diff(bell, 2)[inner]
    scale = (wave[inner] @ known) / (known @ known)
    assert wave[inner] == pytest.approx(scale * known, abs=2e-7)
    assert scale > 0.0


def test_wavelets_that_reach_an_end_are_brought_to_zero_within_a_period():
    """The ramp 3 x² - 2 x³ on the displacement, at the first sample and from a period on."""
    period, dt, count = 0.5, 0.01, 1001
    moved = np.cumsum(np.cumsum(_build_wavelet(period, 0.2, dt, count)))
    time = dt * np.arange(1, 100) - 0.2
    bell = np.exp(-((time / (1.178 * period**0.93)) ** 2)) * np.cos(2.0 * np.pi * time / period)
    share = np.clip((np.arange(1, 100) - 1.0) / (period / dt), 0.0, 1.0)
    known = bell * share**2 * (3.0 - 2.0 * share)
    scale = (moved[:99] @ known) / (known @ known)
    assert moved[:99] == pytest.approx(scale * known, abs=1e-8 * np.abs(moved).max())


def test_the_misfit_is_taken_evenly_in_log_period():
    """The target is half of the motion's spectrum up to a period and all of it beyond."""
    motion = af.Motion.synthetic(duration=6.0, dt=0.01, seed=3)
    own = af.response_spectrum(motion, np.geomspace(0.05, 2.0, 400)) / af.units.STANDARD_GRAVITY

    class Target:
        @staticmethod
        def horizontal(periods):
            found = np.interp(periods, np.geomspace(0.05, 2.0, 400), own)
            return np.where(periods < 0.05 * 40.0**0.25, 0.5 * found, found)

    assert spectral_misfit(motion, Target) == pytest.approx(0.5, abs=0.01)  # a quarter errs by 1
