"""Suites of ground motions with one scale and one reduction factor."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from archfem._typing import Array
from archfem._validation import check_fields, validate_methods
from archfem.errors import InvalidInput
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.matching import DEFAULT_BAND, Match, matched
from archfem.motion.motion import Motion
from archfem.motion.response_spectra import response_spectrum


@validate_methods
@dataclass(frozen=True, eq=False)
class Suite:
    """A named set of motions, each with its vertical, with one scale and reduction factor.

    Args:
        name: name of the suite.
        pairs: motions as read or matched, before scale and reduction.
        scale: factor on all of them [-].
        reduction: reduction factor R of the elastic demand by the code [-].
        matches: results of spectral matching for each pair; empty without it.

    Raises:
        InvalidInput: there is no motion, or a factor is not positive.
    """

    name: str
    pairs: tuple[Motion, ...]
    scale: float = field(default=1.0, kw_only=True)
    reduction: float = field(default=1.0, kw_only=True)
    matches: tuple[Match, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "pairs", tuple(self.pairs))
        if not self.pairs:
            raise InvalidInput(f"suite {self.name!r} has no motion")
        if not (self.scale > 0.0 and self.reduction > 0.0):
            raise InvalidInput(
                f"suite {self.name!r}: scale {self.scale!r} and "
                f"reduction {self.reduction!r} are > 0"
            )

    @classmethod
    def paired(
        cls,
        name: str,
        horizontals: Sequence[Motion],
        verticals: Sequence[Motion],
        *,
        scale: float = 1.0,
        reduction: float = 1.0,
    ) -> "Suite":
        """Combine horizontal and vertical motions; fewer verticals serve several horizontals each.

        Args:
            name: name of the suite.
            horizontals: motions, one for each pair.
            verticals: motions whose vertical is taken, or the only component they have.
            scale: factor on all of them [-].
            reduction: factor R [-].

        Raises:
            InvalidInput: the number of horizontals is no multiple of the number of verticals, or
                the steps of two that meet differ.
        """
        if not verticals or len(horizontals) % len(verticals):
            raise InvalidInput(
                f"{len(horizontals)} horizontals cannot share {len(verticals)} verticals evenly"
            )
        share = len(horizontals) // len(verticals)
        pairs = tuple(x.with_vertical(verticals[k // share]) for k, x in enumerate(horizontals))
        return cls(name, pairs, scale=scale, reduction=reduction)

    @classmethod
    def synthetic(
        cls,
        spectrum: DesignSpectrum,
        *,
        horizontals: int = 6,
        verticals: int = 3,
        seed: int = 0,
        duration: float = 20.0,
        reduction: float = 1.0,
    ) -> "Suite":
        """Generate artificial motions matched to a spectrum.

        Args:
            spectrum: target of horizontals and verticals.
            horizontals: how many pairs there are.
            verticals: how many different verticals they share, at most one each.
            seed: the same seed gives the same suite.
            duration: duration of each motion [s].
            reduction: factor R [-].

        Raises:
            InvalidInput: the pairs cannot share the verticals evenly, or the duration is shorter
                than twice the longest period matched.
            DidNotConverge: a motion could not be matched within the tolerance.
        """
        made = [Motion.synthetic(seed=seed + k, duration=duration) for k in range(horizontals)]
        share = cls.paired(f"synthetic {seed}", made, made[:verticals], reduction=reduction)
        return share.matched(spectrum)

    def matched(
        self, spectrum: DesignSpectrum, *, band: tuple[float, float] = DEFAULT_BAND
    ) -> "Suite":
        """Return the suite with every pair matched to a spectrum, see `matched`.

        Args:
            spectrum: target of horizontals and verticals.
            band: shortest and longest period to match [s].

        Raises:
            InvalidInput: a pair is at rest or too short, or the spectrum lacks what it needs.
            DidNotConverge: a pair could not be matched within the tolerance.
        """
        matches = tuple(matched(pair, spectrum, band=band) for pair in self.pairs)
        return replace(self, pairs=tuple(match.motion for match in matches), matches=matches)

    def reversed(self) -> "Suite":
        """Return the suite with reversed horizontal components."""
        return replace(self, pairs=tuple(pair.reversed() for pair in self.pairs))

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The motions to apply: the pairs times scale over reduction."""
        return tuple(pair.scaled(self.scale / self.reduction) for pair in self.pairs)

    def spectra(
        self, periods: Array, *, component: str = "horizontal", damping: float = 0.05
    ) -> Array:
        """Return the spectra of the pairs (n_pairs, n_periods) [m/s²], scaled but not reduced.

        Args:
            periods: natural periods (n_periods,) [s].
            component: horizontal, vertical or transverse.
            damping: ratio to the critical [-].

        Raises:
            InvalidInput: a pair has no such component, or no oscillator such a period or damping.
        """
        return self.scale * np.array(
            [response_spectrum(pair, periods, damping, component=component) for pair in self.pairs]
        )
