"""Elastic design spectra of NTC 2018, ASCE 7-22 and EN 1998-1-1:2024, in g."""

from dataclasses import dataclass

import numpy as np

from archfem.arguments import real
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.motion.design_spectra import branches, checked_periods
from archfem.motion.oscillator import check
from archfem.units import STANDARD_GRAVITY

# NTC 2018, table 3.2.IV: S_S = a - b F_0 a_g/g within its bounds, and C_C = c (T_C*)^d.
_SUBSOIL = {
    "A": ((1.00, 0.00), (1.00, 1.00), (1.00, 0.00)),
    "B": ((1.40, 0.40), (1.00, 1.20), (1.10, -0.20)),
    "C": ((1.70, 0.60), (1.00, 1.50), (1.05, -0.33)),
    "D": ((2.40, 1.50), (0.90, 1.80), (1.25, -0.50)),
    "E": ((2.00, 1.10), (1.00, 1.60), (1.15, -0.40)),
}
_UPRIGHT = (0.05, 0.15, 1.0)  # T_B, T_C, T_D [s] of the vertical, table 3.2.VI, with S_S = 1
_LEAST_AMPLIFICATION = 2.2  # of F_0
_STEEPEST = 1.4  # largest S_T of table 3.2.V


@dataclass(frozen=True)
class Ntc2018:
    """Elastic spectra of the Italian technical standards for constructions of 2018.

    Horizontal: a_g S η F_0 (T/T_B + (1 - T/T_B)/(η F_0)), a_g S η F_0 from T_B = T_C/3, times T_C/T
    from T_C = C_C T_C* and T_C T_D/T² from T_D = 4 a_g/g + 1.6 s to 4 s, with S = S_S S_T.
    Vertical: the same with the factor F_v = 1.35 F_0 √(a_g/g) in place of F_0, S_S = 1 and periods
    of its own.
    η = √(10/(5 + ξ)) >= 0.55 with the damping ξ in per cent.

    Args:
        ag: horizontal acceleration of the site on rock, of the limit state asked about [g].
        f0: largest amplification F_0 of the site [-].
        tc_star: T_C* of the site, where its constant velocity begins [s].
        site: category of subsoil A to E.
        topography: factor S_T of the slope, 1 to 1.4 [-].
        damping: ratio to the critical [-].

    Raises:
        InvalidInput: a value is not positive or out of range, or the category is unknown.

    References:
        D.M. 17 January 2018, sections 3.2.3.2.1 and 3.2.3.2.2, tables 3.2.IV to 3.2.VI.
    """

    ag: float
    f0: float
    tc_star: float
    site: str
    topography: float = 1.0
    damping: float = 0.05

    def __post_init__(self) -> None:
        if self.site not in _SUBSOIL:
            raise InvalidInput(f"subsoil {self.site!r} is unknown: use A, B, C, D or E")
        if not (
            _positive(self.ag, "a_g [g]") < 2.0 and 0.05 < real(self.tc_star, "T_C* [s]") < 2.0
        ):
            raise InvalidInput(
                f"a_g {self.ag:g} g and T_C* {self.tc_star:g} s: expected a_g in g, below 2, and "
                "T_C* in seconds, 0.05 to 2"
            )
        if not _LEAST_AMPLIFICATION <= real(self.f0, "F_0") < 5.0:
            raise InvalidInput(f"F_0 {self.f0:g} is not from {_LEAST_AMPLIFICATION} to 5")
        if not 1.0 <= real(self.topography, "topography S_T") <= _STEEPEST:
            raise InvalidInput(f"topography {self.topography:g} is not from 1 to {_STEEPEST}")
        check(np.zeros(1), self.damping)

    @property
    def soil(self) -> float:
        """Amplification by the subsoil S_S [-]."""
        (level, slope), (least, most), _ = _SUBSOIL[self.site]
        return min(max(level - slope * self.f0 * self.ag, least), most)

    @property
    def corners(self) -> tuple[float, float, float]:
        """Periods T_B, T_C and T_D of the horizontal spectrum [s]."""
        factor, power = _SUBSOIL[self.site][2]
        falls = factor * self.tc_star**power * self.tc_star
        return falls / 3.0, falls, 4.0 * self.ag + 1.6

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 4 s, where the code gives none.
        """
        top = self._reduction * self.f0
        shape = branches(checked_periods(periods, 4.0), self.corners, lowest=1.0 / top)
        return self.ag * self.soil * self.topography * top * shape

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 4 s, where the code gives none.
        """
        top = self._reduction * self.f0
        shape = branches(checked_periods(periods, 4.0), _UPRIGHT, lowest=1.0 / top)
        factor = 1.35 * float(self.ag) ** 1.5 * self.topography
        found: Array = factor * top * shape
        return found

    @property
    def _reduction(self) -> float:
        return max(float(np.sqrt(10.0 / (5.0 + 100.0 * self.damping))), 0.55)


@dataclass(frozen=True)
class Asce2022:
    """Two-period design spectrum of ASCE/SEI 7-22, 5 % damping.

    (0.4 + 0.6 T/T_0) S_DS, S_DS from T_0 = 0.2 S_D1/S_DS, S_D1/T from T_S = S_D1/S_DS, S_D1 T_L/T²
    from T_L. S_DS and S_D1 are two thirds of S_MS and S_M1; the code has no site factors any more:
    its maps give all of them for the site's own class. Where the maps have a multi-period spectrum,
    the code wants that one for analyses in time: give its points as a `TableSpectrum`, and so too
    a vertical one, of which this class has none.

    Args:
        sds: design spectral acceleration at short periods S_DS [g].
        sd1: design spectral acceleration at 1 s S_D1 [g].
        tl: long-period transition T_L [s].

    Raises:
        InvalidInput: a value is not positive, or T_L is not beyond T_S.

    References:
        ASCE/SEI 7-22 (2022), sections 11.4.4 and 11.4.5.2.
    """

    sds: float
    sd1: float
    tl: float

    def __post_init__(self) -> None:
        _positive(self.sds, "S_DS [g]")
        _positive(self.sd1, "S_D1 [g]")
        if not _positive(self.tl, "T_L [s]") > self.sd1 / self.sds:
            raise InvalidInput(
                f"T_L {self.tl:g} s is not beyond T_S = S_D1/S_DS = {self.sd1 / self.sds:.3g} s"
            )

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative or not finite.
        """
        end = self.sd1 / self.sds
        corners = (0.2 * end, end, self.tl)
        return self.sds * branches(checked_periods(periods, np.inf), corners, lowest=0.4)

    def vertical(self, periods: float | Array) -> Array:
        """Refuse: the vertical spectrum has to be given by points.

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: always.
        """
        raise InvalidInput(_without_vertical("ASCE 7-22"))


_CUT = 0.02  # T_A [s], below which the ground's own acceleration is meant
_PEAK = 2.5  # F_A, the level over the ground's own acceleration
_WIDTH = 4.0  # chi, T_C / T_B


@dataclass(frozen=True)
class Eurocode2024:
    """Horizontal elastic spectrum of EN 1998-1-1:2024 with the recommended values, 5 % damping.

    With S_α = F_T F_α S_α,RP and S_β = F_T F_β S_β,RP: S_α/F_A to T_A = 0.02 s, straight to S_α at
    T_B = T_C/χ within 0.05 and 0.1 s, S_β/T from T_C = S_β/S_α, S_β T_D/T² from T_D = 2 s, or
    1 + S_β,RP/(m/s²) s where that is more, to 4 s; F_A = 2.5 and χ = 4.

    The site factors F_α and F_β depend on category, depth and stiffness of the ground and on the
    accelerations themselves: they are to be taken from the standard; on rock (A) they are 1.
    There is no vertical spectrum here: give one by points, as a `TableSpectrum`.

    Args:
        s_alpha: S_α,RP, the level on rock for the return period asked about [g].
        s_beta: S_β,RP, the spectral acceleration at 1 s on rock [g].
        f_alpha: site factor of the level F_α [-].
        f_beta: site factor at 1 s F_β [-].
        topography: factor F_T [-].

    Raises:
        InvalidInput: a value is not positive, or T_C is not between T_B and T_D.

    References:
        EN 1998-1-1:2024, clause 5.2.2.2.
    """

    s_alpha: float
    s_beta: float
    f_alpha: float
    f_beta: float
    topography: float = 1.0

    def __post_init__(self) -> None:
        for key in ("s_alpha", "s_beta", "f_alpha", "f_beta", "topography"):
            _positive(getattr(self, key), f"Eurocode 8 (2024), {key}")
        rise, falls, far = self.corners
        if not rise < falls < far:
            raise InvalidInput(
                f"Eurocode 8 (2024): T_C = S_beta/S_alpha = {falls:.3g} s is not between T_B = "
                f"{rise:.3g} s and T_D = {far:.3g} s: check s_alpha and s_beta, both in g"
            )

    @property
    def corners(self) -> tuple[float, float, float]:
        """Periods T_B, T_C and T_D [s]."""
        falls = self.f_beta * self.s_beta / (self.f_alpha * self.s_alpha)
        rise = min(max(falls / _WIDTH, 0.05), 0.1)
        return rise, falls, max(2.0, 1.0 + self.s_beta * STANDARD_GRAVITY)

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 4 s.
        """
        rise, falls, far = self.corners
        natural = np.maximum(checked_periods(periods, 4.0), _CUT) - _CUT
        corners = (rise - _CUT, np.inf, np.inf)
        shape = branches(natural, corners, lowest=1.0 / _PEAK)
        beyond = np.maximum(natural + _CUT, falls)
        level = self.topography * self.f_alpha * self.s_alpha
        found: Array = level * shape * (falls / beyond) * np.minimum(1.0, far / beyond)
        return found

    def vertical(self, periods: float | Array) -> Array:
        """Refuse: the vertical spectrum has to be given by points.

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: always.
        """
        raise InvalidInput(_without_vertical("Eurocode 8 (2024)"))


def _without_vertical(code: str) -> str:
    return (
        f"{code} is here without its vertical spectrum: give one by points, as a TableSpectrum "
        "with vertical_values"
    )


def _positive(value: float, name: str) -> float:
    """A number that must be above zero."""
    if not real(value, name) > 0.0:
        raise InvalidInput(f"{name} = {value!r}: expected more than 0")
    return value
