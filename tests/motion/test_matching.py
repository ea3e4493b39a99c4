"""Matching to a design spectrum."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.motion.matching import matched, misfit

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
    assert match.misfit[component] == misfit(match.motion, CASE_STUDY, component=component)
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
    assert after.significant_duration == pytest.approx(before.significant_duration, rel=0.3)
    moved = np.corrcoef(match.motion.at(shaking.times())[:, 0], shaking.horizontal)[0, 1]
    assert moved > 0.7


def test_matching_twice_changes_nothing_much(match):
    again = matched(match.motion, CASE_STUDY)
    # Already below the misfit at which the rounds stop: only drift and scale are touched.
    assert np.abs(again.motion.horizontal - match.motion.horizontal).max() < 0.05 * match.motion.pga


def test_other_spectra_and_bands(shaking):
    target = af.Eurocode8(ag=0.25, ground="B")
    level = shaking.with_vertical(None)
    match = matched(level, target, band=(0.1, 1.0), tolerance=0.04)
    assert misfit(match.motion, target, band=(0.1, 1.0)) < 0.04
    assert match.motion.components == ("horizontal",)


def test_a_table_that_begins_above_zero_will_do(shaking):
    periods = np.geomspace(0.05, 2.0, 60)
    table = af.motion.TableSpectrum(periods, CASE_STUDY.horizontal(periods))
    assert matched(shaking.with_vertical(None), table).misfit["horizontal"] < 0.05


def test_what_cannot_be_matched_is_refused(shaking):
    with pytest.raises(af.errors.InvalidInput, match="shorter than 20 s"):
        matched(shaking, CASE_STUDY, band=(0.05, 10.0))
    with pytest.raises(af.errors.InvalidInput, match="at rest"):
        matched(af.Motion(np.zeros(2000), 0.01), CASE_STUDY)
    with pytest.raises(af.errors.InvalidInput, match="0 < first < second"):
        matched(shaking, CASE_STUDY, band=(1.0, 0.5))
    for band in ((0.0, 1.0), (0.1, np.inf)):
        with pytest.raises(af.errors.InvalidInput, match="0 < first < second"):
            misfit(shaking, CASE_STUDY, band=band)
    spike = af.motion.TableSpectrum([0.01, 0.5, 0.51, 0.52, 5.0], [1e-3, 1e-3, 1.0, 1e-3, 1e-3])
    with pytest.raises(af.errors.DidNotConverge, match="misfit") as caught:
        matched(shaking.with_vertical(None), spike, tolerance=0.02)
    assert caught.value.last.misfit["horizontal"] > 0.02


@pytest.mark.parametrize(
    "name",
    ["peer_at2/RSN126_GAZLI_GAZ-UP.AT2", "plain_columns/erzikan.txt", "other_formats/0111a.smc"],
)
def test_real_records_match(name):
    if not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    match = matched(af.Motion.read(RECORDS / name, column=1), CASE_STUDY)
    assert match.misfit["horizontal"] < 0.05
    assert match.motion.displacement()[-1] == pytest.approx(0.0, abs=1e-9)
