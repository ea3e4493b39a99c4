"""NTC 2018, ASCE 7-22 and EN 1998-1-1:2024 at their corners.

The coefficients and branches were compared with other people's transcriptions of the codes; where
two of those differed, nothing was taken from either: the user gives such a value.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

import archfem as af
from archfem.cases.motion_keys import build_spectrum
from archfem.motion import Asce2022, Eurocode2024, Ntc2018
from archfem.motion.response_spectra import response_spectrum
from archfem.statics.assessment_checks import spectral_acceleration

ROUND_OFF = 1e-12


@pytest.mark.parametrize(
    ("site", "ag", "f0", "factor"),
    [
        # Table 3.2.IV: formula and both bounds of each category.
        ("A", 0.25, 2.4, 1.0),
        ("B", 0.261, 2.42, 1.147352),
        ("B", 0.05, 2.4, 1.2),
        ("B", 0.6, 2.4, 1.0),
        ("C", 0.15, 2.4, 1.484),
        ("C", 0.261, 2.42, 1.321028),
        ("C", 0.02, 2.4, 1.5),
        ("C", 0.6, 2.4, 1.0),
        ("D", 0.25, 2.5, 1.4625),
        ("D", 0.02, 2.4, 1.8),
        ("D", 0.35, 3.0, 0.9),
        ("E", 0.25, 2.5, 1.3125),
        ("E", 0.05, 2.4, 1.6),
        ("E", 0.6, 2.4, 1.0),
    ],
)
def test_subsoil_of_ntc(site, ag, f0, factor):
    assert Ntc2018(ag, f0, 0.35, site).soil == pytest.approx(factor, rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("site", "ratio"),  # C_C at T_C* = 0.35 s, to the digits of a calculator
    [("A", 1.0), ("B", 1.3570), ("C", 1.4847), ("D", 2.1129), ("E", 1.7501)],
)
def test_corners_of_ntc(site, ratio):
    rise, falls, far = Ntc2018(0.25, 2.5, 0.35, site).corners
    assert falls == pytest.approx(ratio * 0.35, rel=1e-4)  # of the rounded ratios
    assert rise == pytest.approx(falls / 3.0, rel=ROUND_OFF)
    assert far == pytest.approx(2.6, rel=ROUND_OFF)


def test_ntc_at_its_corners():
    """L'Aquila, 475 years: a_g 0.261 g, F_0 2.42, T_C* 0.35 s, subsoil C on a slope of 1.2."""
    spectrum = Ntc2018(0.261, 2.42, 0.35, "C", topography=1.2)
    ground = 0.261 * 1.2 * (1.7 - 0.6 * 2.42 * 0.261)
    falls = 1.05 * 0.35**0.67
    periods = [0.0, falls / 6.0, falls / 3.0, falls, 1.0, 2.644, 4.0]
    level = 2.42 * ground
    over = [
        1.0 / 2.42,
        (1.0 + 1.0 / 2.42) / 2.0,
        1.0,
        1.0,
        falls,
        falls / 2.644,
        falls * 2.644 / 16,
    ]
    assert spectrum.horizontal(periods) == pytest.approx(level * np.array(over), rel=ROUND_OFF)
    upright = 1.2 * 0.261 * 1.35 * 2.42 * 0.261**0.5
    over = [1.0 / 2.42, 1.0, 1.0, 0.15, 0.15 / 16.0]
    found = spectrum.vertical([0.0, 0.05, 0.15, 1.0, 4.0])
    assert found == pytest.approx(upright * np.array(over), rel=ROUND_OFF)
    damped = Ntc2018(0.261, 2.42, 0.35, "C", topography=1.2, damping=0.15)
    assert damped.horizontal([0.0, 0.3]) == pytest.approx([ground, level * 0.5**0.5], rel=ROUND_OFF)


def test_asce_at_its_corners():
    spectrum = Asce2022(sds=1.2, sd1=0.6, tl=8.0)
    found = spectrum.horizontal([0.0, 0.05, 0.1, 0.5, 1.0, 8.0, 16.0])
    assert found == pytest.approx([0.48, 0.84, 1.2, 1.2, 0.6, 0.075, 0.01875], rel=ROUND_OFF)


def test_eurocode_of_2024_at_its_corners():
    spectrum = Eurocode2024(0.5, 0.15, f_alpha=1.2, f_beta=1.6)
    falls, far = 0.4, 1.0 + 0.15 * 9.80665
    assert spectrum.corners == pytest.approx((0.1, falls, far), rel=ROUND_OFF)
    found = spectrum.horizontal([0.0, 0.02, 0.06, 0.1, 0.4, 1.0, far, 4.0])
    expected = [0.24, 0.24, 0.42, 0.6, 0.6, 0.24, 0.24 / far, 0.24 * far / 16.0]
    assert found == pytest.approx(expected, rel=ROUND_OFF)
    rock = Eurocode2024(0.5, 0.09, 1.0, 1.0, topography=1.2)
    assert rock.corners == pytest.approx((0.05, 0.18, 2.0), rel=ROUND_OFF)
    assert rock.horizontal([0.05, 2.0]) == pytest.approx([0.6, 0.054], rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Ntc2018(0.2, 2.5, 0.3, "S1"), "subsoil = 'S1' is not known"),
        (lambda: Ntc2018(0.2, 2.1, 0.3, "A"), "F_0 = 2.1 is not between 2.2"),
        (
            lambda: Ntc2018(2.56, 2.5, 0.3, "A"),
            r"a_g \[g\] = 2.56 is not between 0 and 1: 2.56 m/s² are 0.261 g",
        ),
        (lambda: Ntc2018(0.2, 2.5, 0.3, "A", topography=2.0), "not between 1 and 1.4"),
        (lambda: Ntc2018(0.2, 2.5, 0.3, "A").horizontal(4.1), "defined up to 4 s"),
        (lambda: Asce2022(1.0, 0.5, 0.4), "it is beyond T_S"),
        (lambda: Asce2022(1.0, 0.0, 8.0), "is not above 0"),
        (lambda: Asce2022(1.0, 0.5, 8.0).vertical(0.1), "give one by points"),
        (lambda: Eurocode2024(5.0, 0.1, 1.0, 1.0), "T_C = S_beta/S_alpha = 0.02 s is not between"),
        (lambda: Eurocode2024(0.5, 0.1, 1.0, 1.0).vertical(0.1), "give one by points"),
    ],
)
def test_spectra_that_codes_do_not_define_are_refused(build, message):
    with pytest.raises(af.InvalidInput, match=message):
        build()


@pytest.mark.slow
def test_a_floor_amplifies_the_ground_as_an_oscillator_does(verified):
    """A storey at 1.2 times the first mode, T_1 = 0.25 s, under motions matched to the ground."""
    ground = af.motion.Ntc2018(ag=0.17, f0=2.45, tc_star=0.32, site="B")
    floor = af.motion.FloorSpectrum(ground, 0.25, 1.2)
    periods, frequency = np.array([0.03, 0.25, 0.5, 1.0]), 2.0 * np.pi / 0.25
    spectra = []
    for seed in range(3):
        motion = af.Motion.synthetic(duration=12.0, pga=2.0, seed=seed, vertical_ratio=0.0)
        motion = af.motion.matched(motion, ground).motion
        rows = motion.dt * np.arange(len(motion.horizontal)), [1.0, 0.1 * frequency, frequency**2]
        _, mode, _ = lsim((rows[1][1:], rows[1]), motion.horizontal, rows[0])
        shaken = af.Motion(motion.horizontal + 1.2 * (mode - motion.horizontal), motion.dt)
        spectra.append(response_spectrum(shaken, periods, 0.05) / af.units.G)
    computed, stated = np.mean(spectra, axis=0), floor.horizontal(periods)
    verified("floor spectrum at resonance [g]", computed[1], "three histories, mean", stated[1])
    # below the mode the rule is an envelope, up to twice the mean
    assert stated[1] == pytest.approx(computed[1], rel=0.2)
    assert stated[2:] == pytest.approx(computed[2:], rel=0.25)
    assert computed[0] < stated[0] < 2.0 * computed[0]


def test_a_floor_spectrum_at_its_corners():
    """a_Z at period zero, a_Z 1.1 / √ξ from 0.8 to 1.1 T_1, and the ground's far beyond."""
    ground = af.motion.Ntc2018(ag=0.17, f0=2.45, tc_star=0.32, site="B")
    floor = af.motion.FloorSpectrum(ground, 0.25, 1.5, building_damping=0.03)
    level = 1.5 * np.sqrt(10.0 / 8.0) * ground.horizontal(0.25) * np.sqrt(1.0 + 4.0 * 0.03**2)
    expected = level * np.array([1.0, 1.1 / np.sqrt(0.03), 1.1 / np.sqrt(0.03)])
    assert floor.horizontal([0.0, 0.2, 0.275]) == pytest.approx(expected)
    assert af.motion.FloorSpectrum(ground, 0.25, 0.3).horizontal(4.0) == ground.horizontal(4.0)
    # the damping of what stands there lowers the peak, and the branches by less
    peak = 1.1 / np.sqrt(0.03) * np.sqrt(10.0 / 13.0)
    parts = 1.0 + (peak - 1.0) * np.array([0.5**1.6, 1.0**1.2])
    damped = replace(floor, damping=0.08)
    assert damped.horizontal([0.1, 0.55]) == pytest.approx(level * peak / parts)
    own = spectral_acceleration(floor, np.array([0.1, 0.55]), 0.08) / af.units.STANDARD_GRAVITY
    assert own == pytest.approx(level * peak / parts)
    case = {"code": "floor", "period": "0.25 s", "amplification": 1.5, "building_damping": 0.03}
    case["ground_spectrum"] = {"code": "NTC-2018", "ag": 0.17, "f0": 2.45, "tc_star": 0.32}
    case["ground_spectrum"]["site"] = "B"
    assert build_spectrum(case, "assessment.spectrum") == floor
    building = af.motion.FloorSpectrum(ground, height=10.0, storeys=4)
    assert building.at(7.5) == af.motion.FloorSpectrum(ground, 0.05 * 10.0**0.75, 1.0)
    assert building.horizontal([0.0, 0.3]) == pytest.approx(ground.horizontal([0.0, 0.3]))
    del case["period"], case["amplification"]
    case |= {"height": "10 m", "storeys": 4, "building_damping": 0.05}
    assert build_spectrum(case, "assessment.spectrum") == building
    for given in ({"height": 10.0}, {"amplification": 1.0}, {"height": 9.0, "storeys": 2.5}):
        with pytest.raises(af.InvalidInput, match="floor spectrum"):
            af.motion.FloorSpectrum(ground, **given)
    with pytest.raises(af.InvalidInput, match="a floor spectrum has no vertical"):
        floor.vertical(0.1)
    with pytest.raises(af.InvalidInput, match="ground_spectrum"):
        build_spectrum({"code": "floor", "period": 0.2, "amplification": 1.0}, "x")
