"""Coefficients of schemes and of damping, by the formulas of their papers."""

import numpy as np
import pytest

import archfem as af


@pytest.mark.parametrize("alpha", [0.0, -0.05, -0.1, -1.0 / 3.0])
def test_hht_keeps_second_order(alpha):
    """β = (1 - α)² / 4 and γ = 1/2 - α (Hilber, Hughes and Taylor, 1977)."""
    scheme = af.HHT(alpha)
    assert scheme.beta == pytest.approx((1.0 - alpha) ** 2 / 4.0)
    assert scheme.gamma == pytest.approx(0.5 - alpha)
    assert af.HHT().alpha == -0.1


def test_newmark_is_average_acceleration_and_the_midpoint_rule_its_own():
    """u₁ = u₀ + Δt v₀ + Δt² ((1/2 - β) a₀ + β a₁) with one acceleration a₁ over the whole step."""
    newmark, conserving = af.dynamics.Newmark(), af.dynamics.Conserving()
    assert (newmark.beta, newmark.gamma, newmark.alpha) == (0.25, 0.5, 0.0)
    assert (conserving.beta, conserving.gamma, conserving.alpha) == (0.5, 1.0, -0.5)


@pytest.mark.parametrize("frequency", [2.0, 8.0, 31.0])
def test_damping_has_its_ratio_at_the_given_frequency(frequency):
    """a / (4 π f) + b π f (Clough and Penzien, 1993)."""
    both = af.Rayleigh(0.03, (frequency, 3.0 * frequency))
    for f in both.frequencies:
        ratio = both.mass / (4.0 * np.pi * f) + both.stiffness * np.pi * f
        assert ratio == pytest.approx(0.03)
    lone = af.StiffnessDamping(0.03, frequency)
    assert (lone.mass, lone.stiffness * np.pi * frequency) == (0.0, pytest.approx(0.03))
