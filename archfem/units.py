"""Multipliers that turn a number in the named unit into SI: `young=30 * GPa`."""

from math import pi

mm = 1e-3  # m
cm = 1e-2  # m
kN = 1e3  # N
MN = 1e6  # N
kPa = 1e3  # Pa
MPa = 1e6  # Pa
GPa = 1e9  # Pa
deg = pi / 180.0  # rad

G = 9.81
"""Acceleration of gravity wherever none is given [m/s²]."""

STANDARD_GRAVITY = 9.80665
"""The g in which accelerograms are recorded and spectra are given [m/s²]."""
