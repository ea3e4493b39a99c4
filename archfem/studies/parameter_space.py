"""Parameter space of a study: products of values, listed points, samples of distributions.

A point is one case of the study: a case and the keys in which it differs.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from math import isfinite, log2
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from scipy.stats import qmc

from archfem._files import hash_value
from archfem._validation import check_choice, check_integer, short_repr
from archfem.cases.analysis_tables import complete_path
from archfem.cases.case import Case
from archfem.cases.provenance import STRUCTURE_SECTIONS, hash_inputs, hash_sections
from archfem.cases.toml_file import apply_change, check_table, refuse_unknown
from archfem.errors import ArchfemError, InvalidInput

# Sections of a case that define its model
MODEL_SECTIONS = (*STRUCTURE_SECTIONS, "model", "dead_load")

# Key that selects the one pair of the suite under which a point is evaluated
PAIR_KEY = "suite.pair"


@dataclass(frozen=True)
class Axis:
    """One dimension of a study, along which one key of the case varies, or several together."""

    name: str  # of the dimension
    keys: tuple[str, ...]  # of the case, "section.key" each
    # values of the keys at each coordinate; None leaves a key unchanged
    rows: tuple[tuple[Any, ...], ...]


def parameter_axes(over: Any, samples: Mapping[str, Any] | None = None) -> tuple[Axis, ...]:
    """Return the axes of a study.

    Args:
        over: a table whose keys are "section.key" of the case, each with a list of values, or a
            distribution: a frozen one of SciPy, or a table, { distribution = "lognorm", s = 0.3,
            scale = 1.5e9 }; or a list of tables, one for each point.
        samples: settings of the sampling: `count`, `method`, "latin" (Latin hypercube) or "sobol",
            and `seed`.

    Returns:
        One axis for each list; one axis, "sample", for all distributions; or one axis, "point", for
        listed points.

    Raises:
        InvalidInput: a list is empty, a distribution is unknown or has invalid parameters, or the
            settings of the sampling are invalid.
    """
    if isinstance(over, Sequence) and not isinstance(over, str):
        return (_point_axis(over),)
    if not isinstance(over, Mapping) or not over:
        raise InvalidInput(
            f"{over!r} varies nothing: give a table of keys of the case with lists of values or "
            "distributions, or a list of such tables, one for each point"
        )
    values = _flatten_axes(over)
    random = {key: value for key, value in values.items() if not _is_list(value)}
    axes = [_value_axis(key, values[key]) for key in values if key not in random]
    if random:
        axes.append(_sample_axis(random, samples))
    elif samples is not None:
        raise InvalidInput("samples needs distributions, and there are none: take samples out")
    keys = [key for axis in axes for key in axis.keys]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        raise InvalidInput(f"{twice} vary twice: a keyword and its path in a case are one")
    return tuple(axes)


def changes_along(axes: Sequence[Axis]) -> list[tuple[tuple[str, Any], ...]]:
    """Return the changed keys and values of each point; the last axis varies fastest."""
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
    """Return the numbers of points to be checked: extreme values of numbers, all other values."""
    points, stride = {0}, 1
    for axis in reversed(axes):
        for column in zip(*axis.rows, strict=True):
            numeric = all(isinstance(value, int | float) for value in column)
            values = (min(column), max(column)) if numeric else column
            points |= {stride * column.index(value) for value in values}
        stride *= len(axis.rows)
    return sorted(points)


def _is_list(value: Any) -> bool:
    row = isinstance(value, Sequence) or (isinstance(value, np.ndarray) and value.ndim == 1)
    return row and not isinstance(value, str)


def _flatten_axes(over: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of each key that varies; each is a list or a distribution."""
    flat = flatten_tables(over)
    for key, value in flat.items():
        if not (_is_list(value) or hasattr(value, "ppf") or isinstance(value, Mapping)):
            raise InvalidInput(
                f"{key} = {value!r}: give a list of values, or a distribution; a value "
                "that stays the same belongs to set"
            )
    return flat


def _value_axis(key: str, values: Any) -> Axis:
    """The axis of a list of values."""
    if not len(values):
        raise InvalidInput(f"{key} is empty: a product over it has no points; give values")
    if any(value is None for value in values):
        raise InvalidInput(f"{key} has the value None, which no file holds: list points without it")
    path = complete_path(key)
    return Axis(path, (path,), tuple((_to_python(value),) for value in values))


def _to_python(value: Any) -> Any:
    """Convert a NumPy scalar to a type of TOML."""
    return value.item() if isinstance(value, np.generic) else value


def _point_axis(points: Sequence[Any]) -> Axis:
    """The axis of listed points, one table each."""
    if not points or not all(isinstance(point, Mapping) and point for point in points):
        raise InvalidInput("the list of points is empty: give a table of keys of the case for each")
    keys = tuple(dict.fromkeys(key for point in points for key in point))
    rows = tuple(tuple(_to_python(point.get(key)) for key in keys) for point in points)
    return Axis("point", tuple(map(complete_path, keys)), rows)


def _sample_axis(random: Mapping[str, Any], samples: Mapping[str, Any] | None) -> Axis:
    """The axis of independent samples of all distributions."""
    if samples is None:
        raise InvalidInput(
            "distributions are to be sampled: say how they are sampled, "
            'samples = { count = 64, method = "sobol", seed = 1 }'
        )
    samplers = {"latin": qmc.LatinHypercube, "sobol": qmc.Sobol}
    settings = check_table(samples, {"count": int, "method": str, "seed": int}, "samples")
    count = check_integer(settings.get("count"), "samples.count")
    method = check_choice(settings.get("method", "latin"), "samples.method", samplers)
    if method == "sobol" and log2(count) % 1.0:
        raise InvalidInput(
            f"samples.count = {count}: a Sobol sequence is balanced for powers of 2 alone; give "
            f"{2 ** round(log2(count))}"
        )
    seed = check_integer(settings.get("seed", 0), "samples.seed", minimum=0)
    shares = samplers[method](len(random), seed=seed).random(count)  # between 0 and 1
    columns = [_quantiles(key, random[key], shares[:, k]) for k, key in enumerate(random)]
    return Axis("sample", tuple(map(complete_path, random)), tuple(zip(*columns, strict=True)))


def _quantiles(key: str, setting: Any, shares: Any) -> list[float]:
    """Quantiles (count,) of the distribution of a key at cumulative probabilities (count,)."""
    distribution = _freeze(key, setting) if isinstance(setting, Mapping) else setting
    values = [float(value) for value in distribution.ppf(shares)]
    if not all(isfinite(value) for value in values):
        raise InvalidInput(
            f"{key} = {setting!r} gives values that are no numbers: its parameters are outside "
            "their range"
        )
    return values


def _freeze(key: str, setting: Mapping[str, Any]) -> Any:
    """Return the distribution of SciPy with a name and parameters."""
    parameters = dict(setting)
    name = str(parameters.pop("distribution"))
    kind = getattr(stats, name, None)
    if not isinstance(kind, stats.rv_continuous | stats.rv_discrete):
        raise InvalidInput(
            f"{key}: scipy.stats has no distribution {name!r}; try 'norm', 'lognorm', "
            "'uniform' or 'triang'"
        )
    try:
        return kind(**parameters)
    except TypeError as error:
        raise InvalidInput(
            f"{key}: the distribution {name!r} does not take {sorted(parameters)}: {error}"
        ) from error


@dataclass(frozen=True)
class Point:
    """One case of a study: a case that many points share, and changes to it."""

    base: Mapping[str, Any] = field(repr=False)  # sections of the shared case
    folder: Path  # of relative file names
    # keys, "section.key" each, and their values; "suite.pair" selects one pair of the suite
    changes: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def of(cls, case: Case, changes: Iterable[tuple[str, Any]] = ()) -> "Point":
        """Return the point of a case and changes to it."""
        return cls(case.settings, case.folder, tuple(changes))

    @property
    def settings(self) -> dict[str, Any]:
        """Sections of the changed case."""
        settings = _copy_tables(self.base)
        for key, value in self.changes:
            if key == PAIR_KEY:
                _select_pair(settings, value)
            else:
                apply_change(settings, key, deepcopy(value))
        return settings

    @property
    def case(self) -> Case:
        """The changed case."""
        return Case.of(self.settings, self.folder)

    @property
    def model_key(self) -> str:
        """Digest of the content of all sections and files that define the model."""
        return hash_sections(self.settings, self.folder, MODEL_SECTIONS)


class WholePoint:
    """Base of points that are evaluated as they are, and share no model with others."""

    changes: tuple[tuple[str, Any], ...]

    @property
    def case(self) -> Any:
        """The point itself."""
        return self

    @property
    def model_key(self) -> str:
        """Empty: the order of points saves nothing."""
        return ""


# What workers evaluate, and the changes by which it differs from others
StudyPoint = Point | WholePoint


def describe_changes(point: StudyPoint) -> str:
    """Return the changes of a point in words."""
    changes = ", ".join(f"{key} = {short_repr(value)}" for key, value in point.changes)
    return changes or "no change"


def list_varied_keys(points: Iterable[StudyPoint]) -> list[str]:
    """Return the keys of cases, "section.key", in which points differ."""
    cases = [point for point in points if isinstance(point, Point)]
    # most points share their case
    tables = [flatten_tables(each) for each in {id(p.base): p.base for p in cases}.values()]
    keys = {key for point in cases for key, _ in point.changes}
    keys |= {key for each in tables for key in each if any(each[key] != t.get(key) for t in tables)}
    return sorted(keys)


def find_nearest_cases(names: Iterable[str], points: Iterable[StudyPoint]) -> dict[str, str]:
    """Return of each named case the other one, the first of several, with the fewest other keys."""
    named = zip(names, points, strict=True)
    flat = {name: flatten_tables(x.settings) for name, x in named if isinstance(x, Point)}
    tables = {name: {**flat[name], "title": ""} for name in flat}

    def count(one: str, other: str) -> int:
        keys = tables[one].keys() | tables[other].keys()
        return sum(tables[one].get(key) != tables[other].get(key) for key in keys)

    others = {name: [each for each in tables if each != name] for name in tables}
    return {name: min(own, key=partial(count, name)) for name, own in others.items() if own}


def list_structures(points: Iterable[StudyPoint]) -> list[str]:
    """Return the digests of points' structures, of cases that they change and their structures."""
    cases = [point for point in points if isinstance(point, Point)]
    found = {hash_sections(x.settings, x.folder, STRUCTURE_SECTIONS) for x in cases}
    for point in {id(x.base): x for x in cases}.values():
        found.add(hash_inputs(point.base, point.folder))
        with suppress(ArchfemError):  # some are no cases without changes
            found.add(hash_value(replace(point, changes=()).case.structure))
    return sorted(found)


def flatten_tables(tables: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Join the names of nested tables and keys by dots; a distribution is a value."""
    flat: dict[str, Any] = {}
    for key, value in tables.items():
        own = isinstance(value, Mapping) and "distribution" not in value
        flat |= flatten_tables(value, f"{prefix}{key}.") if own else {prefix + key: value}
    return flat


def group_by_model(points: Iterable[tuple[int, Point]]) -> list[tuple[int, Point]]:
    """Return points in their order, but those of one model together, so that it is built once."""
    places: dict[str, int] = {}  # of models, in the order of their first points
    return sorted(points, key=lambda each: places.setdefault(each[1].model_key, len(places)))


def _copy_tables(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Copy tables within each other, but not the rows in them, which nothing changes."""
    return {k: _copy_tables(x) if isinstance(x, Mapping) else x for k, x in tables.items()}


def _select_pair(settings: dict[str, Any], pair: str) -> None:
    """Remove all other pairs from the suite of a case."""
    pairs = settings.get("suite", {}).get("pairs", {})
    if not pairs:
        raise InvalidInput(f"{PAIR_KEY} = {pair!r}: the case has no [suite] to take a pair of")
    refuse_unknown({pair: None}, pairs, "suite.pairs")
    settings["suite"]["pairs"] = {pair: pairs[pair]}
