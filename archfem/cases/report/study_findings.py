"""Findings of a study in a report: the worst point of each case, falls first, and what decides."""

import json
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import hash_json, path_inside, read_file_list, read_listed, read_sealed_json
from archfem._netcdf import name_flags, read_dataset
from archfem.cases.result_text import STATED_DOUBTS, UPPER_BOUNDS, mark_bound
from archfem.cases.structure_keys import CONTACT_KEYS, MATERIAL_KEYS, list_shapes, shape_keys
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.errors import InvalidInput
from archfem.masonry.structure import join_words, list_first
from archfem.models.model import Doubt, merge_doubts, read_doubts
from archfem.units import format_mm
from archfem.view.pages.document import Grid

# Findings that a report shows, those that decide first: of factors the least is the worst, and
# those of a push are shown in g
OVER_SITE = "over the site's acceleration"
_FACTORS = (
    *("least_margin", "least_push", "push", OVER_SITE),
    *("factor", "without_pressure", "full_pressure", "without_backing", "without_either"),
)
_SIZES = ("largest_displacement", "residual_displacement")
MAX_CASES = 24
MIN_CHANGE = 0.1  # of a finding that is worth a sentence [-]
MIN_STEP = 0.03  # from the extreme of a sweep to its neighbours, likewise
MAX_NAMES = 4  # of cases in a sentence
MAX_TIE_DIFFERENCE = 1e-3  # of findings that are equal, as numbers with three digits are [-]

# What cases are counted by, those that fail first, as verbs of one case and of several
_COUNTED = {
    "falls": ("falls", "fall"),
    "dislocated": ("is dislocated", "are dislocated"),
    "failed": ("has no outcome", "have no outcome"),
}

# Numbers, and names of joints, by which doubts of one kind differ between cases
_OF_ONE_CASE = re.compile(r"\([^)]*\)|[\d.]+(e[-+]?\d+)?")

# Coordinates that are motions of one case, and those that number points too
_MOTIONS = ("pair", "suite.pair")
_NO_CASE = {"point", "sample", "variation", *_MOTIONS}

# What a key of a case varies, in the words of the conclusion
_VARIED = {
    "lengths": r"structure\.(?!gravity|material|contact)",
    "stiffness": r"contacts\..*\.(\w*stiffness|closure|finish)$",
    "friction": r"contacts\..*\.friction$",
    "damping": r"analysis\.damping",
    "size of the motions": r"(motion|suite)\.(scale|reduction|target)|.*\.pga$",
    "time step": r"analysis\.(dt|tolerance)$",
    "motion": r"suite\.pair$|motion\.(file|synthetic)",
    "fidelity": r"model\.fidelity$",
}


@dataclass(frozen=True, eq=False)
class StudyFindings:
    """Table of a study, and the worst point of each case."""

    title: str
    text: str  # that the command has written
    table: xr.Dataset
    keys: tuple[str, ...]  # coordinates that tell cases apart
    names: tuple[str, ...]  # findings that are shown, that which decides first
    # DataFrame of the cases in the order of the study; `falls`, `dislocated` and `failed` of `runs`
    worst: Any
    folder: Path = Path()
    name: str = "the study"  # with its title in a report, as `_keep_whole` returns it
    is_own: bool = True  # whether one of its cases, or their base, has the report's structure
    digests: Collection[str] = ()  # of its structures, and of the cases that it changes

    @cached_property
    def numbers(self) -> xr.Dataset:
        """Findings that are numbers, in words, beside falls; lengths in mm, and none of a fall."""
        numbers = [name for name in self.names if self.table[name].dtype.kind == "f"]
        others = {"fall", UPPER_BOUNDS} & {*self.table}
        table = self.table[[*numbers, *others]].copy()
        if UPPER_BOUNDS in others:
            table[UPPER_BOUNDS] = table[UPPER_BOUNDS].str.replace("_", " ")
        for name in [name for name in _SIZES if name in table]:
            held = self.table[name].where(~self.table["fall"].isin(FALLEN_STATES))
            table[name] = (1e3 * held).assign_attrs(units="mm")
        return table.rename({name: name.replace("_", " ") for name in numbers})

    @property
    def decides(self) -> str:
        """Name of the finding by which cases are compared."""
        return self.names[0]

    @property
    def is_static(self) -> bool:
        """Whether its cases are computed without histories."""
        return "fall" not in self.table and not {*_FACTORS}.isdisjoint(self.names)

    @property
    def idle(self) -> list[str]:
        """Cases, or keys that were varied one by one, that change no finding."""
        rows, names = self.worst, [*self.names]
        texts = rows[names].map("{:.6g}".format)
        if self.keys == ("case",):
            same = (texts == texts.iloc[0]).all(axis=1)
            return [f"'{name}'" for name in rows["case"][same][1:]]
        idle = list[str]()
        for key in self.keys:
            others = [rows[each] for each in self.keys if each != key] or [rows[key].isna()]
            groups = texts.groupby(others)
            if groups.size().min() > 1 and groups.nunique().max(axis=None) == 1:
                idle.append(key)
        return idle

    @property
    def motions(self) -> list[str]:
        """Motions of a suite under which the cases were run, each once; empty without a suite."""
        found = [self.table[name].values for name in _MOTIONS if name in self.table.coords]
        return [*dict.fromkeys(str(name) for each in found for name in each.ravel().tolist())]

    @property
    def under(self) -> str:
        """Under which motions of a suite the cases were run, in words; "" without a suite."""
        names = [f"'{name}'" for name in self.motions]
        if len(names) > MAX_NAMES:
            return f" under {len(names)} motions"
        return f" under {join_words(names)}" if names else ""

    @cached_property
    def doubts(self) -> list[Doubt]:
        """Doubts of the runs, each kind once, with the cases and motions that have it."""
        found = list[Doubt]()
        for row in self.table.to_dataframe().reset_index().to_dict("records"):
            motion = [f"under '{row[name]}'" for name in _MOTIONS if name in {*row} - {*self.keys}]
            place = " ".join([*filter(None, [self.label(row)]), *motion])
            own = read_doubts(row.get(STATED_DOUBTS) or "[]")
            found += [replace(doubt, place=place) for doubt in own]
        groups = dict[tuple[str, ...], list[Doubt]]()
        for doubt in found:
            groups.setdefault(tuple(_OF_ONE_CASE.sub("", x) for x in doubt.kind), []).append(doubt)
        return [_merge_cases(each) for each in groups.values()]

    def label(self, row: Any, keys: Sequence[str] = ()) -> str:
        """Return the name of the case of a row, by all keys or some."""
        if self.keys == ("case",):
            return f"'{_keep_whole(row['case'])}'"
        units = {key: self.table[key].attrs.get("units", "") for key in keys or self.keys}
        return ", ".join(
            f"{k.replace('_', ' ')} = {_format(row[k])} {units[k]}".strip() for k in units
        )

    def list_tied(self, row: Any, name: str) -> list[str]:
        """List keys that together leave a finding of a case equal, whatever their values."""
        tied, rows = list[str](), self.worst
        for key in self.keys:
            kept = [each for each in self.keys if each not in (*tied, key)]
            same = rows[(rows[kept] == [row[each] for each in kept]).all(axis=1)]
            if (
                kept
                and same[key].nunique() > 1
                and np.ptp(same[name]) <= MAX_TIE_DIFFERENCE * abs(row[name])
            ):
                tied.append(key)
        return tied

    def place(self, row: Any, name: str) -> str:
        """Return the name of the case of a row by the keys that change a finding there."""
        tied = self.list_tied(row, name)
        whatever = f", whatever the {join_words([x.replace('_', ' ') for x in tied])}" * bool(tied)
        return self.label(row, [key for key in self.keys if key not in tied]) + whatever


def _keep_whole(name: str) -> str:
    """Return a name with unbreakable spaces behind colons and semicolons, which end no clause."""
    return re.sub(r"([:;]) ", "\\1\N{NO-BREAK SPACE}", str(name))


def _merge_cases(doubts: Sequence[Doubt]) -> Doubt:
    """Return doubts of several cases as one: its numbers are their ends, or those of the first."""
    named = [*dict.fromkeys(doubt.place for doubt in doubts)]
    places = f"{len(named)} cases"
    if len(named) <= MAX_NAMES or named[0].startswith("'"):
        places = list_first(named, MAX_NAMES)
    if len({doubt.kind for doubt in doubts}) > 1:
        return replace(doubts[0], place=f"{places}, of which the first")
    return merge_doubts(doubts, places)


def read_study(place: Path, structure: Collection[str]) -> StudyFindings:
    """Read the study in a folder for a report of a structure, of which there are digests."""
    if not (place / "study.txt").is_file():
        begun = (place / "progress.json").is_file()
        words = "its study is not finished: run it again, which continues it"
        words = words if begun else "run `archfem study`, which writes it"
        raise InvalidInput(f"{place} has no study.txt: {words}")
    title, _, text = read_listed(place, "study.txt").decode("utf-8").strip().partition("\n\n")
    found = collect_findings(title, text, read_dataset(place / "results.nc", "table"))
    plan, listed = path_inside(place, "study.json"), read_file_list(place).get("study")
    kept = read_sealed_json(plan, "study") if plan.is_file() else {}
    # the plan is rewritten before its table
    fits = listed is not None and listed.inputs == hash_json(kept.get("points"))
    digests = kept.get("structures", ()) if fits else ()
    name, is_own = f"the study '{_keep_whole(title)}'", not {*structure}.isdisjoint(digests)
    return replace(found, folder=place, name=name, is_own=is_own, digests=digests)


def collect_findings(title: str, text: str, table: xr.Dataset) -> StudyFindings:
    """Return the worst point of each case of the table of a study."""
    table = name_flags(table.drop_dims("entry", errors="ignore"))
    if "least_push_over_site" in table:
        table = table.rename(least_push_over_site=OVER_SITE)
        if UPPER_BOUNDS in table:
            renamed = table[UPPER_BOUNDS].str.replace("least_push_over_site", OVER_SITE)
            table = table.assign({UPPER_BOUNDS: renamed})
    frame = table.to_dataframe().reset_index()
    differing = [str(name) for name in table.coords if frame[name].nunique() > 1]
    keys = [name for name in differing if name not in _NO_CASE] or differing
    table, keys = _name_keys(table, keys)
    frame = table.to_dataframe().reset_index()
    numbers = [name for name, each in table.data_vars.items() if each.dtype.kind == "f"]
    shown = [name for name in (*_FACTORS, *_SIZES) if name in numbers]
    hidden = {"factor"} if "push" in shown else set()
    if "least_push" in shown and np.allclose(table["push"], table["least_push"], equal_nan=True):
        hidden.add("least_push")
    names = [name for name in shown if name not in hidden]
    worst = _find_worst(frame, keys, names) if keys and names else frame.head(0)
    return StudyFindings(title, text, table, tuple(keys), tuple(names), worst)


def _name_keys(table: xr.Dataset, keys: list[str]) -> tuple[xr.Dataset, list[str]]:
    """Return a table whose keys are in words, with units; it keeps what it varies as attribute."""
    varied = "; ".join([*filter(None, [table.attrs.get("varied")]), *keys])
    words = dict[str, str]()
    for key in (x for x in keys if x.startswith(("structure.", "contacts.", "materials."))):
        above, _, name = key.replace("_", " ").partition(".")[2].rpartition(".")
        words[key] = f"{name} of {above.rpartition('.')[2]}" if above else name
    if len({*words.values(), *table.variables}) < len(words) + len(table.variables):
        words = {}  # two would have one name
    for key in words:
        unit = _list_units().get(key.rpartition(".")[2])
        if table[key].dtype.kind in "if" and "units" not in table[key].attrs and unit:
            table = table.assign_coords({key: table[key].assign_attrs(units=unit)})
    return table.rename(words).assign_attrs(varied=varied), [words.get(x, x) for x in keys]


@cache
def _list_units() -> dict[str, str]:
    """List the units of the numbers of structures, materials and contacts by their keys."""
    tables = [CONTACT_KEYS, MATERIAL_KEYS, *map(shape_keys, list_shapes())]
    units = {k: unit for keys in tables for k, unit in keys.items() if isinstance(unit, str)}
    return {key: unit.replace("**3", "³") for key, unit in units.items() if unit != "1"}


def _find_worst(frame: Any, keys: list[str], names: list[str]) -> Any:
    """Return the worst outcome of each case and the worst of each finding over its motions."""
    states = frame["fall"] if "fall" in frame else frame[names[0]].map(lambda _: "")
    rank = states.map(lambda state: COLLAPSE_STATES.index(state) if state in COLLAPSE_STATES else 0)
    size = frame[names[0]] if names[0] in _FACTORS else -frame[names[0]]
    ranked = frame.assign(rank=-rank, size=size, falls=states.isin(FALLEN_STATES), runs=1)
    ranked = ranked.assign(dislocated=states == "dislocated", failed=frame.get("error", "") != "")
    # of a fall the displacement is the way to the ground
    sizes = [name for name in names if name in _SIZES]
    ranked[sizes] = ranked[sizes].mask(ranked["falls"])
    ways = {name: "min" if name in _FACTORS else "max" for name in names}
    ways |= dict.fromkeys((*_COUNTED, "runs"), "sum")
    cases = ranked.groupby(keys, sort=False, dropna=False)
    ranked = ranked.assign(**{name: cases[name].transform(way) for name, way in ways.items()})
    return ranked.sort_values(["rank", "size"]).drop_duplicates(keys).sort_index()


def tabulate_study(found: StudyFindings) -> Grid:
    """Tabulate the worst point of each case in the order of the study.

    Of many cases those that fall come first, then those with doubts; of factors the least.
    """
    order = found.worst
    if len(order) > MAX_CASES:
        rises = {"size": True} if found.is_static else {"rank": True, "doubts": False}
        ranks = [name for name in rises if name in order]
        order = order.sort_values(ranks, ascending=[rises[x] for x in ranks], kind="stable")
    pair = next((name for name in _MOTIONS if name in order), "")
    several = pair not in ("", *found.keys) and order["runs"].max() > 1
    state = "fall" in order and any(order["fall"])
    head = [_label_finding(found.table, name) for name in (*found.keys, *found.names)]
    head += ["outcome"] if state else []
    rows = []
    for _, row in order.head(MAX_CASES).iterrows():
        cells = [_format(row[name]) for name in found.keys]
        cells += [_format_finding(row, name) for name in found.names]
        failed = row["falls"] or row["dislocated"]
        count = f", in {failed} of {row['runs']}" if several and failed else ""
        count += f"; dislocated, in {row['dislocated']}" * bool(row["falls"] and row["dislocated"])
        rows.append([*cells, f"{row['fall'] or 'no outcome'}{count}"] if state else cells)
    caption = f"Study: {found.title}{found.under}"
    caption += (
        "; of each case the worst of each column over its motions that do not fall"
        if several
        else ""
    )
    caption += f"; {join_words(found.idle)} changed nothing" * bool(found.idle)
    if any(cell.startswith("≤") for row in rows for cell in row):
        caption += "; ≤ is an upper bound, below which the value may lie: such values show no trend"
    if left := order.iloc[MAX_CASES:].to_dict("records"):
        falls = f"of which {sum(row['falls'] > 0 for row in left)} fall"
        if found.is_static:
            failed = " or no outcome" * any(row["failed"] for row in left)
            falls = f"with no less {found.decides.replace('_', ' ')}{failed}"
        caption += f"; {len(left)} of {len(order)} cases are left out, {falls}"
    return Grid(head, rows, caption)


def _label_finding(table: xr.Dataset, name: str) -> str:
    """Return the name of a key or finding, with its unit."""
    unit = None if name in _SIZES else table[name].attrs.get("units")
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")


def _format_finding(row: Any, name: str) -> str:
    """Return a finding of a row; displacements are of runs without a fall, to the ground."""
    if name not in _SIZES or row[name] != row[name]:
        return mark_bound(row, name, _format(row[name]))
    return format_mm(row[name])


def _format(value: Any) -> str:
    """Return a number with four digits, "-" without one, or a word."""
    if value != value:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def say_what_changes(found: StudyFindings) -> Iterator[str]:
    """Yield a sentence: which cases of a study fail, and which other differs most from the first.

    Cases fail if they fall, are dislocated, or have no outcome.
    """
    if not len(found.worst):
        return
    rows, name = found.worst.to_dict("records"), found.decides
    counted, others = list[str](), rows
    for count, verbs in _COUNTED.items():
        failing = [row for row in others if row[count]]
        others = [row for row in others if not row[count]]
        if failing:
            of = "" if counted else f" of {len(rows)} cases"
            verb = verbs[len(failing) > 1]
            runs = (f", under {x[count]} of {x['runs']} motions" * (x["runs"] > 1) for x in failing)
            listed = [f"{found.label(x)}{under}" for x, under in zip(failing, runs, strict=True)]
            counted.append(f"{len(failing)}{of} {verb}: {list_first(listed, MAX_NAMES, '; ')}")
        elif count == "falls" and any(row.get("fall") for row in rows):
            counted.append(f"none of {len(rows)} cases falls")
    then = ", and " if len(others) == len(rows) else "; of the others "
    known = [row for row in others if np.isfinite(row[name])]
    compared = _compare_cases(found, known, rows[0]) if len(known) > 1 else ""
    if counted or compared:
        said = then.join(filter(None, ["; ".join(counted), compared]))
        yield f"in {found.name}{found.under} {said}"
    if found.keys == ("case",) and rows[0]["falls"] and others:
        each = "each of " * (len(others) > 1)
        yield f"it stands with {each}{list_first([*map(found.label, others)], MAX_NAMES)}"


def say_failures(found: StudyFindings, *, damaged: bool = False) -> str:
    """Say which cases fall or are dislocated, of one number from which on; "" if none is.

    Of what is damaged as given those that fall.
    """
    counts = [*_COUNTED][: 1 if damaged else 2]
    rows = found.worst.to_dict("records")
    failing = [row for row in rows if any(row[count] for count in counts)]
    if not failing:
        return ""
    does = " or ".join(_COUNTED[x][0] for x in counts if any(row[x] for row in failing))
    at, key = list_first([*map(found.label, failing)], MAX_NAMES), found.keys[0]
    if len(found.keys) == 1 and found.table[key].dtype.kind in "fi" and len(failing) < len(rows):
        low, high = (choose(failing, key=lambda row: row[key]) for choose in (min, max))
        others = [row[key] for row in rows if row not in failing]
        if high[key] < min(others):
            at = f"{found.label(high)} and below"
        elif low[key] > max(others):
            at = f"{found.label(low)} and above"
    return f"{does} at {at}"


def say_below_site(found: StudyFindings) -> Iterator[str]:
    """Yield a sentence on the cases of a study that move below the site's acceleration, if any."""
    rows = found.worst.to_dict("records")
    # undefined without a demand
    below = [row for row in rows if row.get(OVER_SITE, np.nan) < 1.0]
    if below:
        listed = [f"{found.label(x)}, at {_format_finding(x, OVER_SITE)} of it" for x in below]
        count = f"{len(below)} of {len(rows)} cases begin{'s' * (len(below) == 1)} to move"
        yield f"{count} below the site's acceleration: {list_first(listed, MAX_NAMES, '; ')}"


def find_least(
    studies: Sequence[StudyFindings], name: str
) -> tuple[float, tuple[str, str], str, str]:
    """Return the least value of a finding in studies, its words, its case and its study.

    It is infinite without one. The words are a push in g, if it is one, and the value.
    """
    rows = list[tuple[float, tuple[str, str], str, str]]()
    for found in (each for each in studies if name in each.names):
        known = [row for row in found.worst.to_dict("records") if row[name] == row[name]]
        for row in sorted(known, key=lambda x: x[name])[:1]:
            push = row.get("least_push", np.nan) if name == OVER_SITE else np.nan
            words = f", {push:.3g} g," * (push == push), mark_bound(row, name, f"{row[name]:.3g}")
            rows.append((row[name], words, found.place(row, name), found.name))
    return min(rows, default=(np.inf, ("", ""), "", ""))


def _look_beside(found: StudyFindings, rows: list[Any], row: Any) -> tuple[list[str], float]:
    """Return the swept keys of which a case has the first or last number, and the largest step.

    Keys are swept over three numbers or more; the step is to a neighbour between ends, over the
    case's finding.
    """
    swept = {key: found.table[key].values for key in found.keys if key in found.table.dims}
    numbers = {k: sorted(v) for k, v in swept.items() if v.dtype.kind in "if" and len(v) > 2}
    # seeds are labels, with nothing between or beyond
    for key in (*found.list_tied(row, found.decides), *(k for k in swept if k.endswith("seed"))):
        numbers.pop(key, None)
    ends, step = [k for k, v in numbers.items() if row[k] in (v[0], v[-1])], 0.0
    for key in numbers.keys() - {*ends}:
        at = numbers[key].index(row[key])
        beside = numbers[key][at - 1], numbers[key][at + 1]
        line = (x for x in rows if all(x[k] == row[k] for k in found.keys if k != key))
        sizes = [x[found.decides] for x in line if x[key] in beside]
        steps = (abs(x / row[found.decides] - 1.0) for x in sizes if row[found.decides])
        step = max([step, *steps])
    return ends, step


def _compare_cases(found: StudyFindings, rows: list[Any], given: Any) -> str:
    """Say which of some cases changes the finding that decides most; "" if none does by much.

    Of factors both the least and the largest are said.
    """
    name, first = found.decides, rows[0]
    least, words = name in _FACTORS, name.replace("_", " ")
    extreme = (min if least else max)(rows, key=lambda row: row[name])
    unit = found.table[name].attrs.get("units", "")

    def show(row: Any) -> str:
        size = format_mm(row[name]) if unit == "m" else f"{row[name]:.3g} {unit}".strip()
        return mark_bound(row, name, size)

    if found.keys != ("case",) or first is not given:  # none of them is the given one
        end, beyond = ("least", "less") if least else ("largest", "more")
        ends, step = _look_beside(found, rows, extreme)
        of = f" of {join_words(ends)}" * (len(found.keys) > 1)
        place = found.place(extreme, name)
        place += f", where the sweep{of} ends: {beyond} may lie beyond" * bool(ends)
        if least and step > MIN_STEP:
            place += f"; neighbours differ by up to {step:.0%}: take smaller steps there"
        return f"the {words} is {end}, {show(extreme)}, at {place}"
    verb = "lowers" if least else "raises"
    changes = list[str]()
    if extreme is first:
        changes.append(f"none {verb} the {words} of {found.label(first)}, {show(first)}")
    elif abs(extreme[name] - first[name]) >= MIN_CHANGE * abs(first[name]):
        change = f"from {show(first)} of {found.label(first)} to {show(extreme)}"
        changes.append(f"{found.label(extreme)} {verb} the {words} most, {change}")
        nearest = json.loads(found.table.attrs.get("nearest", "{}")).get(extreme["case"])
        near = [row for row in rows[1:] if row["case"] == nearest]
        changes += [f"{found.label(x)}, which differs least from it, {show(x)}" for x in near]
    largest = max(rows, key=lambda row: row[name])
    if least and largest[name] - first[name] >= MIN_CHANGE * abs(first[name]):
        changes.append(f"{found.label(largest)} raises the {words} most, to {show(largest)}")
    return "; ".join(changes)


def list_studied(found: StudyFindings) -> set[str]:
    """Return what a study varies, in the words of the conclusion."""
    keys = str(found.table.attrs["varied"]).split("; ")
    return {word for word, key in _VARIED.items() if any(re.match(key, each) for each in keys)}
