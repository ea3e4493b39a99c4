"""Seismic hazard of a site: the annual rate at which an intensity is exceeded.

Rates are straight lines in double logarithm between the points that are given, and beyond them
along the last lines. Probabilities in a time T are those of a Poisson process, 1 - exp(-rate T).
Curves of sites steepen with the intensity, so that a rate beyond the last point is often too large.
"""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from archfem._typing import Array
from archfem._validation import (
    check_array,
    check_choice,
    check_number,
    check_numbers,
    validate_arguments,
    validate_methods,
)
from archfem.errors import InvalidInput

# Intensity measures, with their units
MEASURES = {"pga": "m/s²", "pgv": "m/s", "sa": "m/s²", "sa_avg": "m/s²"}

# Largest intensity of a hazard curve [m/s² or m/s]: the unit of a larger one must be wrong
LARGEST = {"pga": 200.0, "pgv": 20.0, "sa": 200.0, "sa_avg": 200.0}

# Return period of the design earthquake in most codes, 10 % in 50 years [year]
DESIGN_PERIOD = 475.0

# Longest return period of maps for codes, 2 % in 50 years, to which power laws are fitted [year]:
# rarer intensities are extrapolated
LONGEST_PERIOD = 2475.0

# Names that OpenQuake gives to measures, and their unit in ours
OPENQUAKE_UNITS = {"PGA": ("pga", 9.80665), "PGV": ("pgv", 0.01), "SA": ("sa", 9.80665)}


@validate_methods
@dataclass(frozen=True, eq=False)
class Hazard:
    """A hazard curve.

    Attributes:
        intensity: intensities, ascending (n,) [m/s² or m/s].
        rate: annual rates at which they are exceeded, descending (n,) [1/year].
        measure: "pga", "pgv", "sa" at `period`, or "sa_avg". The last is the geometric mean of Sa
            over periods from 0.2 to 3 times that of the structure (Eads, Miranda and Lignos,
            Earthq. Eng. Struct. Dyn. 44 (2015) 2057-2073).
        period: period of "sa" [s]; None takes that of the structure.
        source: where the curve is from, such as a map with its edition; "" if that is not known.

    Raises:
        InvalidInput: fewer than two points, or they do not ascend and descend, or are not above 0.

    Example:
        >>> site = af.Hazard.from_return_periods({475.0: 4.0, 2475.0: 7.0})
        >>> round(1.0 / float(site.rate_of(4.0)))
        475
    """

    intensity: Array
    rate: Array
    measure: str = field(default="pga", kw_only=True)
    period: float | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        """Check that the curve falls."""
        check_choice(self.measure, "measure", tuple(MEASURES))
        if self.period is not None:
            check_number(self.period, "period [s]", minimum=0.01)
            if self.measure != "sa":
                raise InvalidInput(f"period with measure {self.measure!r}: it belongs to 'sa'")
        x = np.array(check_numbers(self.intensity, "intensity"), float)
        y = np.array(check_numbers(self.rate, "rate", len(x)), float)
        falls = len(x) > 1 and (np.diff(x) > 0.0).all() and (np.diff(y) < 0.0).all()
        if not falls or min(x.min(), y.min()) <= 0.0:
            raise InvalidInput(
                f"hazard with intensities {x.tolist()} and rates {y.tolist()}: give two points or "
                "more above 0, intensities ascending, annual rates descending"
            )
        unit, most = MEASURES[self.measure], LARGEST[self.measure]
        if x[-1] > most:
            raise InvalidInput(
                f"the hazard reaches {x[-1]:g} {unit}: that can only be a wrong unit, or return "
                "periods in place of intensities"
            )
        object.__setattr__(self, "intensity", x)
        object.__setattr__(self, "rate", y)

    @property
    def origin(self) -> str:
        """Where the curve is from, in words."""
        return f"hazard of the site: {self.source or 'source not given'}"

    @classmethod
    @validate_arguments
    def power(cls, factor: float, exponent: float, **options: object) -> "Hazard":
        """Return the curve rate = factor · intensity^(-exponent), by points at 475 and 2475 years.

        Args:
            factor: annual rate at intensity 1 in SI units [1/year].
            exponent: slope in double logarithm, above 0; 2 to 4 at most sites [-].
            options: `measure`, `period` and `source`.
        """
        if not (factor > 0.0 and exponent > 0.0):
            raise InvalidInput(
                f"hazard with factor {factor} and exponent {exponent}: give two numbers above 0"
            )
        periods = np.array([DESIGN_PERIOD, LONGEST_PERIOD])
        with np.errstate(over="ignore"):  # an infinite intensity is refused
            points = (factor * periods) ** (1.0 / exponent)
        return cls(points, 1.0 / periods, **options)  # type: ignore[arg-type]

    @classmethod
    @validate_arguments
    def from_return_periods(cls, points: Mapping[float, float], **options: object) -> "Hazard":
        """Return the curve through intensities of return periods, as codes give them.

        Args:
            points: intensity by return period [year]; two or more.
            options: `measure`, `period` and `source`.
        """
        periods = sorted(points)
        if not periods or min(periods) <= 0.0:
            raise InvalidInput(f"return periods {periods}: give two or more above 0")
        intensities = np.array([points[period] for period in periods])
        return cls(intensities, 1.0 / np.array(periods), **options)  # type: ignore[arg-type]

    @classmethod
    @validate_arguments
    def read(cls, path: str | Path, site: int = 0, source: str = "") -> "Hazard":
        """Read a hazard curve of OpenQuake, a CSV file of probabilities of exceedance.

        Args:
            path: file whose first line names `investigation_time` and `imt`, and whose columns
                `poe-…` are the probabilities at intensities, of a site in each row.
            site: number of the row.
            source: as of the class; by default the name of the file and the row.

        Raises:
            InvalidInput: there is no such file, row, or column.
        """
        try:
            lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidInput(f"hazard curve {path}: {error}: give a text file") from error
        head = " ".join(line for line in lines if line.startswith("#"))
        years = re.search(r"investigation_time=([\d.]+)", head)
        measure = re.search(r"imt='?\"?(?:(PGA|PGV)|(SA)\(([\d.]+)\))", head)
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        if years is None or measure is None or not 0 <= site < len(rows):
            raise InvalidInput(
                f"hazard curve {path}: no row {site}, or its first line does not name "
                "investigation_time and imt (PGA, PGV or SA(…)): export it by OpenQuake as CSV"
            )
        name, unit = OPENQUAKE_UNITS[measure.group(1) or measure.group(2)]
        found = {key[4:]: value for key, value in rows[site].items() if key and key[:4] == "poe-"}
        try:
            x, poe = np.array([*found], float) * unit, np.array([*found.values()], float)
        except ValueError as error:
            raise InvalidInput(f"hazard curve {path}, row {site}: {error}") from error
        falls = (poe >= 0.0).all() and (poe <= 1.0).all() and (np.diff(poe) <= 0.0).all()
        if not falls or float(years.group(1)) <= 0.0:
            raise InvalidInput(
                f"hazard curve {path}, row {site}: probabilities {poe.tolist()} in "
                f"{years.group(1)} years: they are from 1 to 0, and none is larger than the one "
                "before; the file is damaged"
            )
        # a rate of zero has no logarithm; of equal probabilities the largest intensity has the rate
        rates = -np.log1p(-np.minimum(poe, 1.0 - 1e-12)) / float(years.group(1))
        kept = (rates > 0.0) & (np.diff(rates, append=-1.0) < 0.0)
        period = float(measure.group(3)) if measure.group(3) else None
        origin = source or f"{Path(path).name}, row {site}"
        return cls(x[kept], rates[kept], measure=name, period=period, source=origin)

    def rate_of(self, intensity: float | Sequence[float] | Array) -> Array:
        """Return the annual rate at which intensities are exceeded [1/year].

        Args:
            intensity: above 0, of any shape.
        """
        given = check_array(intensity, "intensity")
        if (given <= 0.0).any():
            raise InvalidInput(f"intensity {float(given.min()):g}: a rate needs one above 0")
        return _along(given, self.intensity, self.rate)

    def intensity_of(self, years: float | Sequence[float] | Array) -> Array:
        """Return the intensities of return periods, the inverse of `rate_of`.

        Args:
            years: return periods, above 0, of any shape [year].
        """
        given = check_array(years, "years")
        if (given <= 0.0).any():
            raise InvalidInput(f"return period {float(given.min()):g}: give one above 0")
        return _along(given, 1.0 / self.rate, self.intensity)


def _along(x: Array, points: Array, values: Array) -> Array:
    """Return values at x > 0 along straight lines in double logarithm, the last ones continued."""
    x, points, values = np.log(x), np.log(points), np.log(values)
    piece = np.clip(np.searchsorted(points, x) - 1, 0, len(points) - 2)
    slopes = np.diff(values) / np.diff(points)
    return np.asarray(np.exp(values[piece] + slopes[piece] * (x - points[piece])))
