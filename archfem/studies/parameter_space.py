"""What a study goes over: full products, listed points, samples from distributions.

One point of a study: a case file and what differs from it.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from itertools import chain, product
from math import isfinite, log2
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from scipy.stats import qmc

from archfem._validation import check_integer
from archfem.cases.case import Case
from archfem.cases.provenance import hash_inputs
from archfem.cases.toml_file import check_choice, check_table, refuse_unknown, set_value
from archfem.errors import InvalidInput

SAMPLES = {"count": int, "method": str, "seed": int}
METHODS = ("latin", "sobol")


@dataclass(frozen=True)
class Axis:
    """One direction of a study, along which one key of the case changes, or several together."""

    name: str  # of the dimension
    keys: tuple[str, ...]  # of the case, "section.key" each
    # values of the keys at each place; None leaves a key as it is
    rows: tuple[tuple[Any, ...], ...]


def parameter_axes(over: Any, samples: Mapping[str, Any] | None = None) -> tuple[Axis, ...]:
    """Return the axes of a study.

    Args:
        over: a table whose keys are "section.key" of the case, each with a list of values, or a
            distribution: one of SciPy, frozen, or as a table, { distribution = "lognorm", s = 0.3,
            scale = 1.5e9 }; or a list of tables, one for each point.
        samples: how distributions are sampled: `count`, `method`, "latin" (Latin hypercube) or
            "sobol", and `seed`.

    Returns:
        One for each list; one, "sample", for all distributions together; one, "point", for points
        that are listed.

    Raises:
        InvalidInput: a list is empty, a distribution is not known or gives no numbers, or samples
            cannot be meant.
    """
    if isinstance(over, Sequence) and not isinstance(over, str):
        return (_listed(over),)
    if not isinstance(over, Mapping) or not over:
        raise InvalidInput(
            f"{over!r} varies nothing: give a table of keys of the case with lists of values or "
            "distributions, or a list of such tables, one for each point"
        )
    told = _flat(over)
    random = {key: value for key, value in told.items() if not _is_list(value)}
    axes = [Axis(key, (key,), _rows(key, told[key])) for key in told if key not in random]
    if random:
        axes.append(_sampled(random, samples))
    elif samples is not None:
        raise InvalidInput("samples are of distributions, and there are none: take samples out")
    return tuple(axes)


def changes_along(axes: Sequence[Axis]) -> list[tuple[tuple[str, Any], ...]]:
    """Return the changes of each point of the product of axes, the last axis fastest."""
    return [
        tuple(
            (key, value)
            for axis, row in zip(axes, rows, strict=True)
            for key, value in zip(axis.keys, row, strict=True)
            if value is not None
        )
        for rows in product(*(axis.rows for axis in axes))
    ]


def check_points(axes: Sequence[Axis]) -> list[int]:
    """Return the numbers of points that show whether all can be meant."""
    wanted, stride = {0}, 1
    for axis in reversed(axes):
        for column in zip(*axis.rows, strict=True):
            numbers = [value for value in column if isinstance(value, int | float)]
            telling = [min(numbers), max(numbers)] if len(numbers) == len(column) else column
            wanted |= {stride * column.index(value) for value in telling}
        stride *= len(axis.rows)
    return sorted(wanted)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)


def _flat(over: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Keys with dots between tables and keys, whether they were quoted or not."""
    found: dict[str, Any] = {}
    for key, value in over.items():
        if isinstance(value, Mapping) and "distribution" not in value:
            found |= _flat(value, f"{above}{key}.")
        elif _is_list(value) or hasattr(value, "ppf") or isinstance(value, Mapping):
            found[above + key] = value
        else:
            raise InvalidInput(
                f"{above}{key} = {value!r}: give a list of values, or a distribution; what "
                "stays the same belongs to set"
            )
    return found


def _rows(key: str, values: Any) -> tuple[tuple[Any, ...], ...]:
    if not len(values):
        raise InvalidInput(f"{key} is empty: a product over it has no points; give values")
    return tuple((_plain(value),) for value in values)


def _plain(value: Any) -> Any:
    """A value as TOML would give it."""
    return value.item() if isinstance(value, np.generic) else value


def _listed(points: Sequence[Any]) -> Axis:
    """Points that are listed, one table each."""
    if not points or not all(isinstance(point, Mapping) and point for point in points):
        raise InvalidInput("the list of points is empty: give a table of keys of the case for each")
    keys = tuple(dict.fromkeys(key for point in points for key in point))
    rows = tuple(tuple(_plain(point.get(key)) for key in keys) for point in points)
    return Axis("point", keys, rows)


def _sampled(random: Mapping[str, Any], samples: Mapping[str, Any] | None) -> Axis:
    """Samples of all distributions together, which are independent of each other."""
    if samples is None:
        raise InvalidInput(
            "distributions are to be sampled: say how they are sampled, "
            'samples = { count = 64, method = "sobol", seed = 1 }'
        )
    told = check_table(samples, SAMPLES, "samples")
    count = check_integer(told.get("count"), "samples.count")
    method = check_choice(told.get("method", "latin"), METHODS, "samples.method")
    if method == "sobol" and log2(count) % 1.0:
        raise InvalidInput(
            f"samples.count = {count}: a Sobol sequence is balanced for powers of 2 alone; give "
            f"{2 ** round(log2(count))}"
        )
    make = {"latin": qmc.LatinHypercube, "sobol": qmc.Sobol}[method]
    unit = make(
        len(random), seed=check_integer(told.get("seed", 0), "samples.seed", minimum=0)
    ).random(count)
    columns = [_column(key, given, unit[:, k]) for k, (key, given) in enumerate(random.items())]
    return Axis("sample", tuple(random), tuple(zip(*columns, strict=True)))


def _column(key: str, given: Any, unit: Any) -> list[float]:
    """Values of one key at places (count,) between 0 and 1 of its distribution."""
    frozen = _frozen(key, given) if isinstance(given, Mapping) else given
    values = [float(value) for value in frozen.ppf(unit)]
    if not all(isfinite(value) for value in values):
        raise InvalidInput(
            f"{key} = {given!r} gives values that are no numbers: its parameters are outside "
            "their range"
        )
    return values


def _frozen(key: str, given: Mapping[str, Any]) -> Any:
    """A distribution of SciPy by its name and parameters."""
    told = dict(given)
    name = str(told.pop("distribution"))
    kind = getattr(stats, name, None)
    if not isinstance(kind, stats.rv_continuous | stats.rv_discrete):
        raise InvalidInput(
            f"{key}: scipy.stats has no distribution {name!r}; try 'norm', 'lognorm', "
            "'uniform' or 'triang'"
        )
    try:
        return kind(**told)
    except TypeError as error:
        raise InvalidInput(
            f"{key}: the distribution {name!r} does not take {sorted(told)}: {error}"
        ) from error


# Sections of a case that make its model
MODEL = ("structure", "materials", "contacts", "model", "dead_load")

# Key whose value is the one pair of the suite that a point is about
PAIR = "suite.pair"


@dataclass(frozen=True)
class Point:
    """One case of a study, told by what differs from a case that many points share."""

    base: Mapping[str, Any] = field(repr=False)  # tables of the case that is changed
    folder: Path  # where relative file names start
    # keys, "section.key" each, and their values; "suite.pair" names the one pair of the suite that
    # is meant
    changes: tuple[tuple[str, Any], ...] = ()

    @property
    def settings(self) -> dict[str, Any]:
        """Tables of the case, changes made."""
        made = deepcopy(dict(self.base))
        for key, value in self.changes:
            if key == PAIR:
                _leave_one(made, value)
            else:
                set_value(made, key, deepcopy(value))
        return made

    @property
    def case(self) -> Case:
        """The case."""
        return Case.of(self.settings, self.folder)

    def digest(self, asked: str) -> str:
        """Return what tells this point from every other: of its case, its files and the version."""
        text = f"{asked}\n{hash_inputs(self.settings, self.folder)}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def model_key(point: Point) -> str:
    """Return what points of one study have in common where they are of one model, as a rule."""
    told = [change for change in point.changes if change[0].partition(".")[0] in MODEL]
    return f"{id(point.base)} {told!r}"


def group_by_model(points: Iterable[tuple[int, Point]]) -> list[tuple[int, Point]]:
    """Return points in their order, but those of one model together: who has built it goes on."""
    groups: dict[str, list[tuple[int, Point]]] = {}
    for number, point in points:
        groups.setdefault(model_key(point), []).append((number, point))
    return list(chain.from_iterable(groups.values()))


def _leave_one(settings: dict[str, Any], pair: str) -> None:
    """Take all other pairs out of a suite."""
    pairs = settings.get("suite", {}).get("pairs", {})
    if not pairs:
        raise InvalidInput(f"{PAIR} = {pair!r}: the case has no [suite] to take a pair of")
    refuse_unknown({pair: None}, pairs, "suite.pairs")
    settings["suite"]["pairs"] = {pair: pairs[pair]}
