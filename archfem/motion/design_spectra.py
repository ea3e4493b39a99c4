"""Elastic design spectra in g: Turkish, European, Italian and American codes, and tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Annotated, Any, ClassVar, Protocol

import numpy as np

from archfem._typing import Array, Metres, Seconds
from archfem._validation import (
    check_array,
    check_between,
    check_choice,
    check_fields,
    check_integer,
    check_number,
    check_own_keys,
    report_user_errors,
    validate_arguments,
)
from archfem.errors import InvalidInput
from archfem.motion.response_spectra import as_periods, check_oscillators
from archfem.units import STANDARD_GRAVITY

# No code has a larger spectral acceleration [g]: the unit must be wrong.
MAX_SPECTRAL_ACCELERATION = 10.0

# Damping of a spectrum in Python; no key, as those of a case are matched and drawn for 5 %
OtherDamping = Annotated[float, None]


class DesignSpectrum(Protocol):
    """Spectral accelerations a motion can be matched to."""

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].
        """

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].
        """


def _validate_periods(periods: float | Array, longest: float) -> Array:
    """Return periods as an array, refused where a spectrum is not defined."""
    natural = as_periods(periods)
    check_oscillators(natural, 0.05)
    if np.any(natural > longest):
        raise InvalidInput(
            f"period {natural.max():g} s: this spectrum is defined up to {longest:g} s"
        )
    return natural


def damping_correction(damping: float) -> float:
    """Return the damping correction factor η of European codes [-]."""
    return max(float(np.sqrt(10.0 / (5.0 + 100.0 * damping))), 0.55)


def damped_acceleration(spectrum: DesignSpectrum, periods: float | Array, damping: float) -> Array:
    """Return horizontal spectral accelerations at a damping in the shape of the periods [g]."""
    if is_dataclass(spectrum) and "damping" in {each.name for each in fields(spectrum)}:
        return np.asarray(replace(spectrum, damping=damping).horizontal(periods))
    return np.asarray(damping_correction(damping) * spectrum.horizontal(periods))


@dataclass(frozen=True)
class SpectrumBranches:
    """A spectrum of straight rise, plateau, and branches in 1/T and 1/T²."""

    level: float  # of the plateau [g]
    lowest: float  # value at period zero over that of the plateau [-]
    corners: Sequence[float]  # periods at which plateau, 1/T and 1/T² begin [s]
    longest: float = np.inf  # period up to which it is defined [s]
    start: float = 0.0  # period at which it begins to rise [s]

    def evaluate(self, periods: float | Array) -> Array:
        """Return spectral accelerations in the shape of the periods [g]."""
        natural = _validate_periods(periods, self.longest)
        rise, falls, far = self.corners
        safe = np.maximum(natural, rise)
        falling = np.minimum(1.0, falls / safe) * np.minimum(1.0, far / safe)
        beyond, width = np.maximum(natural, self.start) - self.start, rise - self.start
        rising = self.lowest + (1.0 - self.lowest) * beyond / width
        return self.level * np.where(natural < rise, rising, falling)


def _european_branches(
    ground: float, amplification: float, corners: Sequence[float], damping: float
) -> SpectrumBranches:
    """Return the branches of European codes, from the acceleration of the ground [g]."""
    top = amplification * damping_correction(damping)
    return SpectrumBranches(ground * top, 1.0 / top, corners, longest=4.0)


def _check_ground(acceleration: float, name: str) -> None:
    """Refuse an acceleration of the ground [g] that no map has, as one in m/s²."""
    number = check_number(acceleration, name)
    remedy = f"{number:.4g} m/s² are {number / STANDARD_GRAVITY:.3g} g"
    check_between(acceleration, name, 0.0, 1.0, ends="(]", remedy=remedy)


class CodeSpectrum:
    """Elastic spectra of a code, which all have the same branches."""

    _corner_names: ClassVar[Sequence[str]] = ("T_B", "T_C", "T_D")

    def describe(self) -> str:
        """Return peak, plateau and corner periods of both spectra, in one line."""
        texts = []
        for name, own in zip(("horizontal", "vertical"), self._branches(), strict=True):
            if own is not None:
                peak, ground = own.level * own.lowest, getattr(self, "ag", None)
                corners = zip(self._corner_names, own.corners, strict=True)
                texts.append(
                    f"{name}: PGA {peak:.3g} g{f' = {peak / ground:.3g} ag' if ground else ''}, "
                    f"plateau {own.level:.3g} g, "
                    f"{', '.join(f'{corner} {period:.3g} s' for corner, period in corners)}"
                )
        return "; ".join(texts)

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        """Return the horizontal spectrum, and the vertical one unless points have to give it."""
        raise NotImplementedError

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, not finite, or beyond those of the code.
        """
        return self._branches()[0].evaluate(periods)

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: as for `horizontal`, or the vertical spectrum has to be given by points.
        """
        upright = self._branches()[1]
        if upright is None:
            raise InvalidInput(
                f"{type(self).__name__} is here without its vertical spectrum: give one by points, "
                "as a TableSpectrum with vertical_values"
            )
        return upright.evaluate(periods)


@dataclass(frozen=True)
class Tbec2018(CodeSpectrum):
    """Elastic spectra of the Turkish Building Earthquake Code 2018, 5 % damping.

    Horizontal: (0.4 + 0.6 T/T_A) S_DS, S_DS from T_A, S_D1/T from T_B, S_D1 T_L/T² from T_L = 6 s,
    with T_A = 0.2 S_D1/S_DS and T_B = S_D1/S_DS. Vertical: (0.32 + 0.48 T/T_AD) S_DS, 0.8 S_DS from
    T_AD = T_A/3, 0.8 S_DS T_BD/T from T_BD = T_B/3 to T_LD = 3 s.

    Args:
        ss: map spectral acceleration at short periods S_S [g].
        s1: map spectral acceleration at 1 s S_1 [g].
        site: ground class ZA to ZE.

    Raises:
        InvalidInput: a value is not positive, or the class is ZF (needs a site study) or unknown.

    References:
        Turkish Building Earthquake Code (2018), sections 2.3.2 to 2.3.5.

    Example:
        >>> code = af.Tbec2018(ss=1.140, s1=0.315, site="ZD")
        >>> code.horizontal([0.0, 0.5, 1.0]).round(3).tolist()
        [0.476, 1.19, 0.625]
    """

    _corner_names: ClassVar[Sequence[str]] = ("T_A", "T_B", "T_L")

    # Site factors F_S and F_1 of tables 2.1 and 2.2: linear between the columns, constant outside
    _site_factors: ClassVar = {
        "ZA": ((0.8, 0.8, 0.8, 0.8, 0.8, 0.8), (0.8, 0.8, 0.8, 0.8, 0.8, 0.8)),
        "ZB": ((0.9, 0.9, 0.9, 0.9, 0.9, 0.9), (0.8, 0.8, 0.8, 0.8, 0.8, 0.8)),
        "ZC": ((1.3, 1.3, 1.2, 1.2, 1.2, 1.2), (1.5, 1.5, 1.5, 1.5, 1.5, 1.4)),
        "ZD": ((1.6, 1.4, 1.2, 1.1, 1.0, 1.0), (2.4, 2.2, 2.0, 1.9, 1.8, 1.7)),
        "ZE": ((2.4, 1.7, 1.3, 1.1, 0.9, 0.8), (4.2, 3.3, 2.8, 2.4, 2.2, 2.0)),
    }

    ss: float
    s1: float
    site: str

    def __post_init__(self) -> None:
        named = (self.ss, "S_S"), (self.s1, "S_1")
        values = [check_number(value, f"map value {name} [g]") for value, name in named]
        if not 0.0 < min(values) <= max(values) <= MAX_SPECTRAL_ACCELERATION:
            raise InvalidInput(f"S_S {self.ss!r}, S_1 {self.s1!r} g: both are between 0 and 10 g")
        check_fields(self)
        if self.site == "ZF":
            raise InvalidInput("ground class ZF has no code spectrum: it needs a site study")
        check_choice(self.site, "ground class", self._site_factors)
        if (end := self.sd1 / self.sds) > 6.0:  # T_L
            raise InvalidInput(
                f"S_S {self.ss:g}, S_1 {self.s1:g} g: T_B = S_D1 / S_DS = {end:.3g} s is beyond "
                "T_L = 6 s: check S_1"
            )

    @property
    def sds(self) -> float:
        """Design spectral acceleration at short periods S_DS = F_S S_S [g]."""
        levels = 0.25, 0.50, 0.75, 1.00, 1.25, 1.50
        return self.ss * float(np.interp(self.ss, levels, self._site_factors[self.site][0]))

    @property
    def sd1(self) -> float:
        """Design spectral acceleration at 1 s S_D1 = F_1 S_1 [g]."""
        levels = 0.10, 0.20, 0.30, 0.40, 0.50, 0.60
        return self.s1 * float(np.interp(self.s1, levels, self._site_factors[self.site][1]))

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        sds, end = self.sds, self.sd1 / self.sds
        upright = SpectrumBranches(0.8 * sds, 0.4, (end / 15.0, end / 3.0, np.inf), longest=3.0)
        return SpectrumBranches(sds, 0.4, (0.2 * end, end, 6.0)), upright


@dataclass(frozen=True)
class Eurocode8(CodeSpectrum):
    """Elastic spectra of Eurocode 8 (2004) with the recommended values.

    Horizontal: a_g S (1 + T/T_B (2.5 η - 1)), 2.5 η a_g S from T_B, times T_C/T from T_C and
    T_C T_D/T² from T_D to 4 s. Vertical: the same with a_vg, 3 in place of 2.5, no S and its own
    periods. η = sqrt(10/(5 + ξ)) >= 0.55 with the damping ξ in per cent.

    Args:
        ag: design ground acceleration on type A ground, importance included [g].
        ground: ground type A to E.
        type: 1, or 2 where magnitudes above 5.5 contribute little.
        damping: ratio to the critical [-].

    Raises:
        InvalidInput: ag is not positive, or ground, type or damping is unknown to the code.

    References:
        EN 1998-1:2004, clauses 3.2.2.2 and 3.2.2.3.

    Example:
        >>> af.Eurocode8(ag=0.3, ground="C").horizontal([0.0, 0.2, 2.0]).round(4).tolist()
        [0.345, 0.8625, 0.2588]
    """

    # EN 1998-1:2004, tables 3.2 to 3.4: soil factor S and T_B, T_C, T_D [s], of type 1 and type 2
    _ground_types: ClassVar = {
        "A": ((1.0, 0.15, 0.4, 2.0), (1.0, 0.05, 0.25, 1.2)),
        "B": ((1.2, 0.15, 0.5, 2.0), (1.35, 0.05, 0.25, 1.2)),
        "C": ((1.15, 0.20, 0.6, 2.0), (1.5, 0.10, 0.25, 1.2)),
        "D": ((1.35, 0.20, 0.8, 2.0), (1.8, 0.10, 0.30, 1.2)),
        "E": ((1.4, 0.15, 0.5, 2.0), (1.6, 0.05, 0.25, 1.2)),
    }

    ag: float
    ground: str
    type: int = 1
    damping: OtherDamping = 0.05

    def __post_init__(self) -> None:
        _check_ground(self.ag, "design ground acceleration [g]")
        check_fields(self)
        if self.type not in (1, 2) or self.ground not in self._ground_types:
            raise InvalidInput(
                f"Eurocode 8 type {self.type!r} on ground {self.ground!r}: expected type 1 or 2 on "
                "ground A, B, C, D or E (S1 and S2 need a site study)"
            )
        check_oscillators(np.zeros(1), self.damping)

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        soil, *corners = self._ground_types[self.ground][self.type - 1]
        ratio = {1: 0.90, 2: 0.45}[self.type]  # a_vg / a_g [-]
        return (
            _european_branches(self.ag * soil, 2.5, corners, self.damping),
            _european_branches(self.ag * ratio, 3.0, (0.05, 0.15, 1.0), self.damping),
        )


@dataclass(frozen=True, eq=False)
class TableSpectrum:
    """A spectrum given by points, straight in between.

    Args:
        periods: growing (n,) [s].
        values: horizontal spectral accelerations (n,) [g].
        vertical_values: vertical spectral accelerations (n,) [g]; None has no vertical.

    Raises:
        InvalidInput: the rows do not fit, the periods do not grow, or a value is not positive.
    """

    periods: Annotated[Array, "s"]
    values: Array
    vertical_values: Array | None = None

    def __post_init__(self) -> None:
        periods = check_array(self.periods, "periods of a spectrum table")
        object.__setattr__(self, "periods", periods)
        grows = periods.ndim == 1 and len(periods) > 1 and bool(np.all(np.diff(periods) > 0.0))
        if not grows or periods[0] < 0.0:
            raise InvalidInput("periods of a spectrum table: expected a row that grows from >= 0 s")
        for name in ("values", "vertical_values"):
            if getattr(self, name) is None and name == "vertical_values":
                continue
            row = check_array(getattr(self, name), f"{name} of a spectrum table")
            if row.shape != periods.shape or not np.all(row > 0.0):
                raise InvalidInput(
                    f"{name} of a spectrum table: expected {len(periods)} positive values in g"
                )
            if row.max() > MAX_SPECTRAL_ACCELERATION:
                raise InvalidInput(
                    f"{name} reach {row.max():.3g} g, more than {MAX_SPECTRAL_ACCELERATION:g} g"
                )
            object.__setattr__(self, name, row)

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is outside the table.
        """
        return self._interpolate(periods, self.values)

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: there is no vertical, or a period is outside the table.
        """
        if self.vertical_values is None:
            raise InvalidInput("this spectrum table has no vertical: give vertical_values")
        return self._interpolate(periods, self.vertical_values)

    def _interpolate(self, periods: float | Array, row: Array) -> Array:
        """Interpolate a row of the table linearly."""
        natural = _validate_periods(periods, self.periods[-1])
        if np.any(natural < self.periods[0]):
            raise InvalidInput(
                f"period {natural.min():g} s is below the table's first, {self.periods[0]:g} s: "
                "begin the table at 0 s, with the peak acceleration"
            )
        return np.interp(natural, self.periods, row)


@dataclass(frozen=True)
class Ntc2018(CodeSpectrum):
    """Elastic spectra of the Italian technical standards for constructions of 2018.

    Horizontal: a_g S η F_0 (T/T_B + (1 - T/T_B)/(η F_0)); a_g S η F_0 from T_B = T_C/3; times T_C/T
    from T_C = C_C T_C*; times T_C T_D/T² from T_D = 4 a_g/g + 1.6 s to 4 s. S = S_S S_T.
    Vertical: the same with the factor F_v = 1.35 F_0 √(a_g/g) in place of F_0, S_S = 1 and periods
    of its own.
    η = √(10/(5 + ξ)) >= 0.55 with the damping ξ in per cent.

    Args:
        ag: horizontal acceleration of the site on rock, of the limit state [g].
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

    # NTC 2018, table 3.2.IV: S_S = a - b F_0 a_g/g within its bounds, and C_C = c (T_C*)^d.
    _subsoil_factors: ClassVar = {
        "A": ((1.00, 0.00), (1.00, 1.00), (1.00, 0.00)),
        "B": ((1.40, 0.40), (1.00, 1.20), (1.10, -0.20)),
        "C": ((1.70, 0.60), (1.00, 1.50), (1.05, -0.33)),
        "D": ((2.40, 1.50), (0.90, 1.80), (1.25, -0.50)),
        "E": ((2.00, 1.10), (1.00, 1.60), (1.15, -0.40)),
    }

    ag: float
    f0: float
    tc_star: Seconds
    site: str
    topography: float = 1.0
    damping: OtherDamping = 0.05

    def __post_init__(self) -> None:
        check_choice(self.site, "subsoil", self._subsoil_factors)
        _check_ground(self.ag, "a_g [g]")
        check_between(self.tc_star, "T_C* [s]", 0.05, 2.0)
        check_between(self.f0, "F_0", 2.2, 5.0, ends="[)")
        check_between(self.topography, "topography S_T", 1.0, 1.4, ends="[]")
        check_oscillators(np.zeros(1), self.damping)

    @property
    def soil(self) -> float:
        """Amplification by the subsoil S_S [-]."""
        (level, slope), (least, most), _ = self._subsoil_factors[self.site]
        return min(max(level - slope * self.f0 * self.ag, least), most)

    @property
    def corners(self) -> tuple[float, float, float]:
        """Periods T_B, T_C and T_D of the horizontal spectrum [s]."""
        factor, power = self._subsoil_factors[self.site][2]
        falls = factor * self.tc_star**power * self.tc_star
        return falls / 3.0, falls, 4.0 * self.ag + 1.6

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        level = self.ag * self.soil * self.topography
        # table 3.2.VI has the periods of Eurocode 8, and S_S = 1
        upright = 1.35 * float(self.ag) ** 1.5 * self.topography
        return (
            _european_branches(level, self.f0, self.corners, self.damping),
            _european_branches(upright, self.f0, (0.05, 0.15, 1.0), self.damping),
        )


@dataclass(frozen=True)
class Asce2022(CodeSpectrum):
    """Two-period design spectrum of ASCE/SEI 7-22, 5 % damping.

    (0.4 + 0.6 T/T_0) S_DS, S_DS from T_0 = 0.2 S_D1/S_DS, S_D1/T from T_S = S_D1/S_DS, S_D1 T_L/T²
    from T_L. S_DS and S_D1 are two thirds of S_MS and S_M1; the code has no site
    factors: its maps give both values for the site class. Where the maps have a multi-period
    spectrum, the code requires it for time histories: give its points as a `TableSpectrum`. This
    class has no vertical spectrum either.

    Args:
        sds: design spectral acceleration at short periods S_DS [g].
        sd1: design spectral acceleration at 1 s S_D1 [g].
        tl: long-period transition T_L [s].

    Raises:
        InvalidInput: a value is not positive, or T_L is not beyond T_S.

    References:
        ASCE/SEI 7-22 (2022), sections 11.4.4 and 11.4.5.2.
    """

    _corner_names: ClassVar[Sequence[str]] = ("T_0", "T_S", "T_L")

    sds: float
    sd1: float
    tl: Seconds

    def __post_init__(self) -> None:
        check_between(self.sds, "S_DS [g]", 0.0)
        check_between(self.sd1, "S_D1 [g]", 0.0)
        end = self.sd1 / self.sds
        check_between(self.tl, "T_L [s]", end, remedy="it is beyond T_S = S_D1/S_DS")

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        end = self.sd1 / self.sds
        return SpectrumBranches(self.sds, 0.4, (0.2 * end, end, self.tl)), None


@dataclass(frozen=True)
class Eurocode2024(CodeSpectrum):
    """Horizontal elastic spectrum of EN 1998-1-1:2024 with the recommended values, 5 % damping.

    With S_α = F_T F_α S_α,RP and S_β = F_T F_β S_β,RP: S_α/F_A to T_A = 0.02 s; straight to S_α at
    T_B = T_C/χ within 0.05 and 0.1 s; S_β/T from T_C = S_β/S_α; S_β T_D/T² from T_D = 2 s, or
    1 + S_β,RP/(m/s²) s where that is more, to 4 s; F_A = 2.5 and χ = 4.

    The site factors F_α and F_β depend on category, depth and stiffness of the ground and on the
    accelerations themselves: they are to be taken from the standard; on rock (A) they are 1.
    There is no vertical spectrum here: give one by points, as a `TableSpectrum`.

    Args:
        s_alpha: S_α,RP, the level on rock for the return period [g].
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
            check_between(getattr(self, key), f"Eurocode 8 (2024), {key}", 0.0)
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
        rise = min(max(falls / 4.0, 0.05), 0.1)
        return rise, falls, max(2.0, 1.0 + self.s_beta * STANDARD_GRAVITY)

    def _branches(self) -> tuple[SpectrumBranches, SpectrumBranches | None]:
        level = self.topography * self.f_alpha * self.s_alpha
        return SpectrumBranches(level, 1.0 / 2.5, self.corners, longest=4.0, start=0.02), None


@dataclass(frozen=True)
class FloorSpectrum:
    """Spectrum of what stands on a height of a building, by the first mode of the building.

    With A = 1.1 η(ξ) / √ξ_1 and a_Z = S(T_1, ξ_1) · amplification · √(1 + 4 ξ_1²) it is a_Z at
    period zero,

        a_Z A / (1 + (A - 1) (1 - T / (0.8 T_1))^1.6)  up to 0.8 T_1,  a_Z A  up to 1.1 T_1,
        a_Z A / (1 + (A - 1) (T / (1.1 T_1) - 1)^1.2)  beyond,

    and nowhere below S(T, ξ), the spectrum of the ground, as the rule requires beyond T_1 alone.
    It has no vertical. With height and storeys in place of the amplification, this is
    3 n / (2 n + 1) z / H at the foot z of each mechanism of an assessment. Above H it is that of
    z = H, where the mode is 1; `horizontal` is then that of the ground, z = 0.

    Args:
        ground_spectrum: spectrum of the ground, S.
        period: T_1 of the building [s]; by default 0.05 H^(3/4), that of masonry up to 40 m.
        amplification: participation of the mode times its shape at the height [-].
        building_damping: ξ_1 [-].
        height: H of the building above the ground, in place of the amplification [m].
        storeys: number n of its storeys, as equal ones.
        damping: ξ of what stands there [-].

    Raises:
        InvalidInput: a value is out of range; not one of amplification and height with storeys is
            given; or the spectrum of the ground ends before a period.

    References:
        Circolare 7/2019, eq. C7.2.5 to C7.2.10, read in a transcription, and C7.3.2; these are of
        Degli Abbati, Cattari and Lagomarsino, Bull. Earthquake Eng. 16 (2018).

    Example:
        >>> ground = af.motion.Ntc2018(ag=0.18, f0=2.5, tc_star=0.32, site="B")
        >>> floor = af.motion.FloorSpectrum(ground, height=10.5, storeys=3)
        >>> floor.at(6.8).describe()
        'amplification 0.833, a_Z 0.452 g'
    """

    ground_spectrum: Annotated[DesignSpectrum, dict]
    period: Seconds | None = None
    amplification: float | None = None
    building_damping: float = 0.05
    height: Metres | None = None
    storeys: int | None = None
    damping: OtherDamping = 0.05

    def __post_init__(self) -> None:
        either = self.amplification, self.height, self.storeys
        given = tuple(value is not None for value in either)
        at_height, by_height = given == (True, False, False), given == (False, True, True)
        if not by_height and (not at_height or self.period is None):
            raise InvalidInput(
                f"a floor spectrum has amplification, height, storeys {either} and period "
                f"{self.period}: give height [m] and storeys of the building, or period and "
                "amplification of one height"
            )
        if by_height:
            check_between(self.height, "floor spectrum, height [m]", 0.0, 300.0, ends="()")
            check_integer(self.storeys, "floor spectrum, storeys", maximum=100)
        check_between(self.own_period, "floor spectrum, period [s]", 0.0, 4.0, ends="()")
        share = self.amplification or 0.0
        check_between(share, "floor spectrum, amplification [-]", 0.0, 3.0, ends="[]")
        check_between(self.building_damping, "floor spectrum, building_damping", 0.005, 0.3)
        check_oscillators(np.zeros(1), self.damping)

    @property
    def own_period(self) -> float:
        """T_1 of the building [s]."""
        return 0.05 * (self.height or 0.0) ** 0.75 if self.period is None else self.period

    @property
    def level(self) -> float:
        """Spectral acceleration a_Z at period zero, without that of the ground [g]."""
        level = (self.amplification or 0.0) * np.sqrt(1.0 + 4.0 * self.building_damping**2)
        given = self.ground_spectrum, self.own_period, self.building_damping
        return float(level * damped_acceleration(*given))

    @property
    def resonance(self) -> float:
        """Largest spectral acceleration over that at period zero, without the ground's, A [-]."""
        return 1.1 * damping_correction(self.damping) / float(np.sqrt(self.building_damping))

    def at(self, foot: float) -> "FloorSpectrum":
        """Return that of what stands at a height above the ground [m]; itself without `height`."""
        if self.height is None or self.storeys is None:
            return self
        # the mode of eq. C7.2.10 is 1 at the top of the building, and carries what is above it
        mode = min(foot / self.height, 1.0)
        share = 3.0 * self.storeys / (2.0 * self.storeys + 1.0) * mode
        return replace(self, period=self.own_period, amplification=share, height=None, storeys=None)

    def describe(self) -> str:
        """Return amplification and a_Z in one line."""
        return f"amplification {self.amplification or 0.0:.3g}, a_Z {self.level:.3g} g"

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].
        """
        ratio = np.asarray(periods) / self.own_period
        level, resonance = self.level, self.resonance
        ground = damped_acceleration(self.ground_spectrum, periods, self.damping)
        below, beyond = np.maximum(1.0 - ratio / 0.8, 0.0), np.maximum(ratio / 1.1 - 1.0, 0.0)
        reduction = 1.0 + (resonance - 1.0) * (below**1.6 + beyond**1.2)
        return np.asarray(np.maximum(level * resonance / reduction, ground))

    def vertical(self, periods: float | Array) -> Array:
        """Refuse the vertical, which the rule does not have."""
        raise InvalidInput("a floor spectrum has no vertical: give a table with vertical_values")


# Spectra that case files can name, with those of the user
registered_spectra: dict[str, Callable[..., DesignSpectrum]] = {
    **{"TBEC-2018": Tbec2018, "EC8": Eurocode8, "NTC-2018": Ntc2018, "ASCE-7-22": Asce2022},
    **{"EC8-2024": Eurocode2024, "table": TableSpectrum, "floor": FloorSpectrum},
}


@validate_arguments
def register_spectrum(name: str, spectrum: type) -> None:
    """Add a code spectrum that case files can name, `target = { code = "NAME", … }`.

    In Python an object with `horizontal` and `vertical` needs no registration.

    Args:
        name: name of the code.
        spectrum: dataclass whose fields are numbers, whole numbers and texts, the keys of a case;
            with the methods of `DesignSpectrum`, in g.

    Raises:
        InvalidInput: the class is no such dataclass, or the name is that of a code of archfem.
    """
    check_own_keys(f"spectrum '{name}'", spectrum)
    for method in ("horizontal", "vertical"):
        if not callable(getattr(spectrum, method, None)):
            raise InvalidInput(f"spectrum '{name}' has no method {method}(periods)")
    if name in registered_spectra and registered_spectra[name].__module__ == __name__:
        raise InvalidInput(f"spectrum '{name}' is one of archfem's: give another name")
    registered_spectra[name] = spectrum


def build_registered_spectrum(name: str, values: dict[str, Any]) -> DesignSpectrum:
    """Return a spectrum by its name, one of the user after a check of its values up to 4 s."""
    spectrum_class, periods = registered_spectra[name], np.linspace(0.0, 4.0, 81)
    with report_user_errors(f"spectrum '{name}'"):
        spectrum = spectrum_class(**values)
    if spectrum_class.__module__ == __name__:
        return spectrum
    for direction in ("horizontal", "vertical"):
        with report_user_errors(f"spectrum '{name}', {direction}"):
            found = np.asarray(getattr(spectrum, direction)(periods), dtype=float)
        if found.shape != periods.shape:
            raise InvalidInput(
                f"spectrum '{name}', {direction}: {found.shape} values for {periods.shape} periods"
            )
        # a comparison with NaN is false
        wrong = ~((found >= 0.0) & (found <= MAX_SPECTRAL_ACCELERATION))
        if wrong.any():
            raise InvalidInput(
                f"spectrum '{name}', {direction}: {found[wrong][0]:g} g at "
                f"{periods[wrong][0]:g} s: give values from 0 to {MAX_SPECTRAL_ACCELERATION:g} g"
            )
    return spectrum
