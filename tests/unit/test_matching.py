"""Matching to a design spectrum, and suites of matched motions."""

from pathlib import Path

import numpy as np
import pytest

from archfem.codes import Eurocode8, TableSpectrum, Tbec2018
from archfem.errors import DidNotConverge, InvalidInput
from archfem.matching import matched, misfit
from archfem.motion import Motion
from archfem.spectra import response_spectrum
from archfem.suite import Suite
from archfem.units import STANDARD_GRAVITY

RECORDS = Path(__file__).parents[2].parent / "shared" / "records"
CASE_STUDY = Tbec2018(ss=1.140, s1=0.315, site="ZD")


@pytest.fixture(scope="module")
def shaking():
    return Motion.synthetic(duration=10.0, dt=0.01, seed=3)


@pytest.fixture(scope="module")
def match(shaking):
    return matched(shaking, CASE_STUDY)


@pytest.mark.parametrize("component", ["horizontal", "vertical"])
def test_matched_motion_follows_the_target(match, component):
    # Evenly in period here, in log period where it is matched.
    periods = np.linspace(0.05, 2.0, 120)
    target = getattr(CASE_STUDY, component)(periods) * STANDARD_GRAVITY
    ratio = response_spectrum(match.motion, periods, component=component) / target
    assert np.sqrt(np.mean((ratio - 1.0) ** 2)) < 0.05
    assert match.misfit[component] < 0.05
    peak = np.abs(match.motion.component(component)).max() / STANDARD_GRAVITY
    # The rounds stop within 10 % of the target's peak, or at the best they found.
    assert peak == pytest.approx(float(getattr(CASE_STUDY, component)(0.0)), rel=0.15)
    assert match.misfit[component] == misfit(match.motion, CASE_STUDY, component=component)


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
    target = Eurocode8(ag=0.25, ground="B")
    level = shaking.with_vertical(None)
    match = matched(level, target, band=(0.1, 1.0), tolerance=0.04)
    assert misfit(match.motion, target, band=(0.1, 1.0)) < 0.04
    assert match.motion.components == ("horizontal",)


def test_a_table_that_begins_above_zero_will_do(shaking):
    periods = np.geomspace(0.05, 2.0, 60)
    table = TableSpectrum(periods, CASE_STUDY.horizontal(periods))
    assert matched(shaking.with_vertical(None), table).misfit["horizontal"] < 0.05


def test_what_cannot_be_matched_is_refused(shaking):
    with pytest.raises(InvalidInput, match="shorter than 20 s"):
        matched(shaking, CASE_STUDY, band=(0.05, 10.0))
    with pytest.raises(InvalidInput, match="at rest"):
        matched(Motion(np.zeros(2000), 0.01), CASE_STUDY)
    with pytest.raises(InvalidInput, match="0 < first < second"):
        matched(shaking, CASE_STUDY, band=(1.0, 0.5))
    spike = TableSpectrum([0.01, 0.5, 0.51, 0.52, 5.0], [1e-3, 1e-3, 1.0, 1e-3, 1e-3])
    with pytest.raises(DidNotConverge, match="misfit") as caught:
        matched(shaking.with_vertical(None), spike, tolerance=0.02)
    assert caught.value.last.misfit["horizontal"] > 0.02


@pytest.mark.parametrize(
    "name",
    ["peer_at2/RSN126_GAZLI_GAZ-UP.AT2", "plain_columns/erzikan.txt", "other_formats/0111a.smc"],
)
def test_real_records_match(name):
    if not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    match = matched(Motion.read(RECORDS / name, column=1), CASE_STUDY)
    assert match.misfit["horizontal"] < 0.05
    assert match.motion.displacement()[-1] == pytest.approx(0.0, abs=1e-9)


def motions(count, **options):
    return [Motion.synthetic(duration=6.0, seed=seed, **options) for seed in range(count)]


def test_six_horizontals_share_three_verticals():
    levels, uprights = motions(6), motions(3, vertical_ratio=0.0)
    suite = Suite.paired("case", levels, uprights, scale=1.5, reduction=3.0)
    assert len(suite.pairs) == 6
    assert suite.pairs[3].vertical == pytest.approx(uprights[1].horizontal)
    assert suite.motions[3].horizontal == pytest.approx(0.5 * levels[3].horizontal)
    assert suite.motions[3].vertical == pytest.approx(0.5 * uprights[1].horizontal)
    spectra = suite.spectra(np.array([0.0, 0.2]))
    # At zero period the spectrum is the peak, scaled but not reduced.
    assert spectra[:, 0] == pytest.approx([1.5 * level.pga for level in levels])


def test_synthetic_suite_is_matched_and_repeats():
    build = {"horizontals": 2, "verticals": 1, "duration": 8.0, "reduction": 3.0}
    suite = Suite.synthetic(CASE_STUDY, seed=11, **build)
    assert len(suite.matches) == 2
    assert max(max(match.misfit.values()) for match in suite.matches) < 0.05
    again = Suite.synthetic(CASE_STUDY, seed=11, **build)
    assert np.array_equal(suite.motions[1].horizontal, again.motions[1].horizontal)
    assert suite.motions[0].pga == pytest.approx(suite.pairs[0].pga / 3.0)


def test_suites_that_cannot_be_are_refused():
    with pytest.raises(InvalidInput, match="has no motion"):
        Suite("empty", ())
    with pytest.raises(InvalidInput, match="cannot share 2 verticals"):
        Suite.paired("odd", motions(3), motions(2))
    with pytest.raises(InvalidInput, match="are > 0"):
        Suite("none", motions(1), reduction=0.0)
