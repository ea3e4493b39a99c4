"""Range of a result over unmeasured properties of a fill: place of inertia, pressure, backing.

Horizontal forces on a fill act at the feet of its columns or at their centroids. From the feet,
shear carries their moment to ends that hold; at the centroids the stones below carry all of it. Its
passive pressure needs movement to develop. Its active pressure is that of smooth faces and of
settled fill, which holds haunches and may push other stones over. Backing is seldom opened. All are
assumed, so a result must hold for all of their values. An associated factor is concave in the
part of the active pressure: the least is at an end.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, product
from typing import Any, NamedTuple

from archfem.limit.fill_strength import Fill, change_fill, has_backing

# Fills of `vary_pressure`, and as given ("factor") or as the pressure of a plastic one, with those
# whose pressures are within theirs, so that their factors are bounds from below; the weakest first
WEAKER_FILLS: Mapping[str, Sequence[str]] = {
    "without_either": (),
    "without_backing": (),
    "without_pressure": ("without_either",),
    "active_without_backing": (),
    "active_alone": ("active_without_backing",),
    "by_pressure": ("without_backing",),
    "factor": ("without_backing",),
    "full_pressure": ("by_pressure", "factor", "without_backing"),
}

# Changes of a fill: its active pressure alone, none, no backing
_ACTIVE: Mapping[str, Any] = {"mobilisation": 0.0, "active": 1.0}
_NO_PRESSURE: Mapping[str, Any] = {"mobilisation": 0.0, "active": 0.0}
_BARE: Mapping[str, Any] = {"backing": None, "backing_height": None}

BACKED = "the backing"
_FALLS = "; it does not stand"


class FillAssumption(NamedTuple):
    """Words of one assumption on a fill: on its inertia, pressure and backing."""

    inertia: str  # empty where nothing pushes the fill
    pressure: str  # empty without a strength
    backing: str = ""  # empty where none is given

    def __str__(self) -> str:
        """Return all in words."""
        return ", ".join(filter(None, self))


def vary_fill(
    fill: Fill | None, *, pushed: bool = True
) -> dict[FillAssumption, tuple[float, Fill | None]]:
    """Return lever and strength of a fill by each assumption; that of the fill itself is first.

    Its inertia varies where it is pushed; without a strength, as weight and mass, that alone.
    """
    own, states, backed = 0.0, list[Fill | None]([fill]), has_backing(fill)
    if fill is not None:
        changes = product(({}, _BARE)[: 1 + backed], ({}, _ACTIVE, _NO_PRESSURE))
        own, states = fill.lever, [change_fill(fill, **x, **y) for x, y in changes]
    assumed = dict[FillAssumption, tuple[float, Fill | None]]()
    for state, lever in [(fill, own), *product(states, (1.0, 0.0) if pushed else (own,))]:
        place = {0.0: "columns' feet", 1.0: "columns' centroids"}.get(lever, f"lever of {lever:g}")
        place = f"the fill's inertia at its {place}" * pushed
        backing = (BACKED if has_backing(state) else "no backing") * backed
        key = FillAssumption(place, _say_pressure(state), backing)
        assumed.setdefault(key, (lever, state and change_fill(state, lever=lever)))
    return assumed


def _say_pressure(fill: Fill | None) -> str:
    """Return the largest pressure of a fill, in words; empty without a strength."""
    if fill is None:
        return ""
    if fill.mobilisation:
        return f"{say_part(fill.mobilisation)} of its passive pressure"
    part = f"{say_part(fill.active)} of " * (fill.active < 1.0)
    return f"{part}its active pressure" if fill.active else "no pressure"


def vary_pressure(fill: Fill) -> dict[str, Fill]:
    """Return a fill without pressure, with the active and all passive one, and without backing."""
    changes = {"without_pressure": _NO_PRESSURE, "full_pressure": {"mobilisation": 1.0}}
    changes |= {"active_alone": _ACTIVE}
    if has_backing(fill):
        changes |= {"without_backing": _BARE, "without_either": {**_BARE, **_NO_PRESSURE}}
        changes |= {"active_without_backing": {**_BARE, **_ACTIVE}}
    return {name: change_fill(fill, **values) for name, values in changes.items()}


def say_part(mobilisation: float) -> str:
    """Return the mobilised part of the passive pressure, in words."""
    words = {0.0: "none", 0.333: "a third", 1.0: "all"}
    return words.get(round(mobilisation, 3), f"{mobilisation:.2g}")


@dataclass(frozen=True)
class FillRange:
    """Values of one result over all assumptions on a fill.

    Attributes:
        values: by assumption, a pair of words, a factor on a load or a demand [-]; 0 where the
            structure does not stand, infinite where nothing limits it.
        unknown: assumptions under which no result was found: the least may be less.
    """

    values: Mapping[FillAssumption, float]
    unknown: Sequence[FillAssumption] = ()

    @classmethod
    def least_of(cls, ranges: Iterable["FillRange"]) -> "FillRange":
        """Return the least of several results under each assumption.

        Args:
            ranges: of the results, one at least.
        """
        values, unknown = dict[FillAssumption, float](), list[FillAssumption]()
        for each in ranges:
            values |= {key: min(x, values.get(key, x)) for key, x in each.values.items()}
            unknown += each.unknown
        return cls(values, tuple(dict.fromkeys(unknown)))

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest value [-]."""
        return min(self.values.values()), max(self.values.values())

    def format_ends(self, unit: float = 1.0, digits: int = 4) -> str:
        """Return both ends as text, or one where they do not differ.

        Args:
            unit: unit by which the values are multiplied, such as a push in g.
            digits: significant ones.
        """
        low, high = (f"{value * unit:.{digits}g}" for value in self.ends)
        return low if low == high else f"{low} to {high}"

    def describe(self, unit: float = 1.0, digits: int = 4, name: str = "") -> str:
        """Return both ends as text, each with its assumption.

        Args:
            unit: unit by which the values are multiplied, such as a push in g.
            digits: significant ones.
            name: name of the unit, behind each value.
        """
        if " to " not in (both := self.format_ends(unit, digits)):
            return f"{both}{name} whatever is assumed of the fill"
        texts = []
        for key in (choose(self.values, key=self.values.__getitem__) for choose in (min, max)):
            falls = _FALLS * (self.values[key] == 0.0)
            texts.append(f"{self.values[key] * unit:.{digits}g}{name} ({key}{falls})")
        return " to ".join(texts)

    def describe_states(self, unit: float = 1.0, digits: int = 4, name: str = "") -> str:
        """Return both ends in each state of pressure and backing, the least first, as a line.

        Args:
            unit: unit by which the values are multiplied, such as a push in g.
            digits: significant ones.
            name: name of the unit, behind the values.
        """
        begin, states = "over what is assumed of the fill", dict[str, FillRange]()
        for key, value in self.values.items():
            state = str(key._replace(inertia=""))
            own = states[state].values if state in states else {}
            states[state] = FillRange({**own, key: value})
        if len(states) == 1 or " to " not in self.format_ends(unit, digits):
            return f"{begin}: {self.describe(unit, digits, name)}"
        texts = [
            f"{own.format_ends(unit, digits)}{name} ({state}{_FALLS * (own.ends[0] == 0.0)})"
            for state, own in sorted(states.items(), key=lambda each: each[1].ends)
        ]
        pushed = any(key.inertia for key in self.values)
        by = ", by the place of its inertia, feet or centroids" * pushed
        return f"{begin}{by}: {'; '.join(texts)}"

    @property
    def outcome(self) -> str:
        """Return "passes", "fails", or "passes only with" the assumptions under which it does."""
        if self.needed:
            return f"passes only with {self.needed}"
        known = ", as far as results were found" * bool(self.unknown)
        return f"passes{known}" if self.ends[0] >= 1.0 else "fails"

    @property
    def needed(self) -> str:
        """Assumptions under which alone it passes, in words; "" where it always does, or never."""
        good = [key for key, value in self.values.items() if value >= 1.0]
        if len(good) in (0, len(self.values)):
            return ""
        words = [*filter(None, dict.fromkeys(chain(*good)))]
        enough = list[tuple[str, ...]]()
        # the fewest words with which it passes in any case
        for each in chain(*(combinations(words, count) for count in (1, 2, 3))):
            under = [value for key, value in self.values.items() if {*each} <= {*key}]
            if min(under, default=0.0) >= 1.0 and not any({*x} <= {*each} for x in enough):
                enough.append(each)
        return " or ".join(" and ".join(each) for each in enough)
