"""Elastic design spectra of codes and of the user, in g."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from archfem.annotated import check_fields
from archfem.arguments import real, said, unmasked
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.motion.oscillator import check

LARGEST = 10.0  # spectral acceleration that no code gives [g]: more can only be a wrong unit


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


# Site factors of TBEC-2018, tables 2.1 and 2.2: linear between the columns, constant outside.
_SHORT = np.array([0.25, 0.50, 0.75, 1.00, 1.25, 1.50])
_SHORT_FACTORS = {
    "ZA": (0.8, 0.8, 0.8, 0.8, 0.8, 0.8),
    "ZB": (0.9, 0.9, 0.9, 0.9, 0.9, 0.9),
    "ZC": (1.3, 1.3, 1.2, 1.2, 1.2, 1.2),
    "ZD": (1.6, 1.4, 1.2, 1.1, 1.0, 1.0),
    "ZE": (2.4, 1.7, 1.3, 1.1, 0.9, 0.8),
}
_LONG = np.array([0.10, 0.20, 0.30, 0.40, 0.50, 0.60])
_LONG_FACTORS = {
    "ZA": (0.8, 0.8, 0.8, 0.8, 0.8, 0.8),
    "ZB": (0.8, 0.8, 0.8, 0.8, 0.8, 0.8),
    "ZC": (1.5, 1.5, 1.5, 1.5, 1.5, 1.4),
    "ZD": (2.4, 2.2, 2.0, 1.9, 1.8, 1.7),
    "ZE": (4.2, 3.3, 2.8, 2.4, 2.2, 2.0),
}


@dataclass(frozen=True)
class Tbec2018:
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

    ss: float
    s1: float
    site: str

    def __post_init__(self) -> None:
        real(self.ss, "map value S_S [g]")
        real(self.s1, "map value S_1 [g]")
        if not (0.0 < self.ss <= LARGEST and 0.0 < self.s1 <= LARGEST):
            raise InvalidInput(f"S_S {self.ss!r}, S_1 {self.s1!r} g: both are between 0 and 10 g")
        check_fields(self)
        if self.site == "ZF":
            raise InvalidInput("ground class ZF has no code spectrum: it needs a site study")
        if self.site not in _SHORT_FACTORS:
            raise InvalidInput(f"ground class {self.site!r} is unknown: use ZA, ZB, ZC, ZD or ZE")

    @property
    def sds(self) -> float:
        """Design spectral acceleration at short periods S_DS = F_S S_S [g]."""
        return self.ss * float(np.interp(self.ss, _SHORT, _SHORT_FACTORS[self.site]))

    @property
    def sd1(self) -> float:
        """Design spectral acceleration at 1 s S_D1 = F_1 S_1 [g]."""
        return self.s1 * float(np.interp(self.s1, _LONG, _LONG_FACTORS[self.site]))

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative or not finite.
        """
        start, end, long = 0.2 * self.sd1 / self.sds, self.sd1 / self.sds, 6.0
        return self.sds * branches(checked_periods(periods, np.inf), (start, end, long), lowest=0.4)

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 3 s, where the code gives none.
        """
        natural = checked_periods(periods, 3.0)
        start, end = self.sd1 / self.sds / 15.0, self.sd1 / self.sds / 3.0
        return 0.8 * self.sds * branches(natural, (start, end, np.inf), lowest=0.4)


# EN 1998-1:2004, tables 3.2 to 3.4: soil factor S and the periods T_B, T_C, T_D [s].
_GROUND = {
    1: {
        "A": (1.0, 0.15, 0.4, 2.0),
        "B": (1.2, 0.15, 0.5, 2.0),
        "C": (1.15, 0.20, 0.6, 2.0),
        "D": (1.35, 0.20, 0.8, 2.0),
        "E": (1.4, 0.15, 0.5, 2.0),
    },
    2: {
        "A": (1.0, 0.05, 0.25, 1.2),
        "B": (1.35, 0.05, 0.25, 1.2),
        "C": (1.5, 0.10, 0.25, 1.2),
        "D": (1.8, 0.10, 0.30, 1.2),
        "E": (1.6, 0.05, 0.25, 1.2),
    },
}
_UPRIGHT, _UPRIGHT_PERIODS = {1: 0.90, 2: 0.45}, (0.05, 0.15, 1.0)  # a_vg / a_g; T_B, T_C, T_D [s]


@dataclass(frozen=True)
class Eurocode8:
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

    ag: float
    ground: str
    type: int = 1
    damping: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0 < real(self.ag, "design ground acceleration [g]") <= LARGEST:
            told = f"expected more than 0, up to {LARGEST:g}"
            raise InvalidInput(f"design ground acceleration {self.ag!r} g: {told}")
        check_fields(self)
        if self.type not in _GROUND or self.ground not in _GROUND[1]:
            raise InvalidInput(
                f"Eurocode 8 type {self.type!r} on ground {self.ground!r}: expected type 1 or 2 on "
                "ground A, B, C, D or E (S1 and S2 need a site study)"
            )
        check(np.zeros(1), self.damping)

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 4 s, where these clauses give none.
        """
        soil, *corners = _GROUND[self.type][self.ground]
        top = 2.5 * self._reduction
        natural = checked_periods(periods, 4.0)
        return self.ag * soil * top * branches(natural, tuple(corners), lowest=1.0 / top)

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is negative, or beyond 4 s, where these clauses give none.
        """
        top = 3.0 * self._reduction
        shape = branches(checked_periods(periods, 4.0), _UPRIGHT_PERIODS, lowest=1.0 / top)
        return self.ag * _UPRIGHT[self.type] * top * shape

    @property
    def _reduction(self) -> float:
        return max(float(np.sqrt(10.0 / (5.0 + 100.0 * self.damping))), 0.55)


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

    periods: Array
    values: Array
    vertical_values: Array | None = None

    def __post_init__(self) -> None:
        unmasked(self.periods, "periods of a spectrum table")
        periods = np.asarray(self.periods, dtype=float)
        object.__setattr__(self, "periods", periods)
        grows = periods.ndim == 1 and len(periods) > 1 and bool(np.all(np.diff(periods) > 0.0))
        if not grows or periods[0] < 0.0:
            raise InvalidInput("periods of a spectrum table: expected a row that grows from >= 0 s")
        for name in ("values", "vertical_values"):
            if getattr(self, name) is None and name == "vertical_values":
                continue
            unmasked(getattr(self, name), f"{name} of a spectrum table")
            row = np.asarray(getattr(self, name), dtype=float)
            if row.shape != periods.shape or not np.all((row > 0.0) & np.isfinite(row)):
                raise InvalidInput(
                    f"{name} of a spectrum table: expected {len(periods)} positive values in g"
                )
            if row.max() > LARGEST:
                raise InvalidInput(f"{name} reach {row.max():.3g} g, more than {LARGEST:g} g")
            object.__setattr__(self, name, row)

    def horizontal(self, periods: float | Array) -> Array:
        """Return horizontal spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: a period is outside the table.
        """
        return self._between(periods, self.values)

    def vertical(self, periods: float | Array) -> Array:
        """Return vertical spectral accelerations in the shape of the periods [g].

        Args:
            periods: natural periods, of any shape [s].

        Raises:
            InvalidInput: there is no vertical, or a period is outside the table.
        """
        if self.vertical_values is None:
            raise InvalidInput("this spectrum table has no vertical: give vertical_values")
        return self._between(periods, self.vertical_values)

    def _between(self, periods: float | Array, row: Array) -> Array:
        natural = checked_periods(periods, self.periods[-1])
        if np.any(natural < self.periods[0]):
            raise InvalidInput(f"period below the table's first, {self.periods[0]:g} s")
        return np.interp(natural, self.periods, row)


def checked_periods(periods: float | Array, longest: float) -> Array:
    """Return periods as an array, refused where a spectrum is not defined.

    Args:
        periods: of any shape [s].
        longest: for which the spectrum is defined [s].

    Raises:
        InvalidInput: a period is negative, not finite, or beyond the longest.
    """
    try:
        natural = np.asarray(periods, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"periods {said(periods)} s are no numbers") from error
    check(natural, 0.05)
    if np.any(natural > longest):
        raise InvalidInput(
            f"period {natural.max():g} s: this spectrum is defined up to {longest:g} s"
        )
    return natural


def branches(periods: Array, corners: tuple[float, ...], *, lowest: float) -> Array:
    """Return the usual shape: from lowest to 1, level, falling with 1/T and then with 1/T².

    Args:
        periods: of any shape [s].
        corners: where it is level, begins to fall, and falls with 1/T² [s].
        lowest: value at zero.
    """
    rise, level, fall = corners
    safe = np.maximum(periods, rise)
    return np.where(
        periods < rise,
        lowest + (1.0 - lowest) * periods / rise,
        np.minimum(1.0, level / safe) * np.minimum(1.0, fall / safe),
    )
