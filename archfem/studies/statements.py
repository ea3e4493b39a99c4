"""Statements of a publication on some cases, beside the findings of a comparison, row by row.

A study file names of each statement the case that it is about and the finding that answers it.
Columns are changes that all cases get, such as another law of the joints.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns
from archfem._typing import Array
from archfem.cases.case import Case
from archfem.cases.run import DeadLoadResult
from archfem.cases.toml_file import read_object
from archfem.dynamics.history import History
from archfem.dynamics.verdict import ALL_DEFINITIONS
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints, part_roles
from archfem.masonry.structure import Structure, suggest_name
from archfem.masonry.survey.circle_fit import fitted_circle
from archfem.statics.pushover import pushover
from archfem.studies.cache import lowest_modes
from archfem.units import G, MPa

Rows = Mapping[str, Mapping[str, Any]]
"""Findings of one case and column by pair of motions, "" where there is none."""


@dataclass(frozen=True)
class Statement:
    """A statement of a publication, and the finding beside it.

    Attributes:
        where: section, figure or table.
        words: the statement.
        published: value as printed.
        case: name of the case in the study file.
        finding: one of `FINDINGS`.
        definition: definition of mechanisms.
        pair: pair of motions; the first one by default.
        joint: name, for the finding "joint"; of `output.joints` of the case.
    """

    where: str
    words: str
    published: str
    case: str
    finding: str
    definition: str = "any joints at once"
    pair: str = ""
    joint: str = ""

    def __post_init__(self) -> None:
        """Check finding and definition."""
        for key, known in (("finding", FINDINGS), ("definition", ALL_DEFINITIONS)):
            if (value := getattr(self, key)) not in known:
                hint = suggest_name(value, known) or f"use one of {list(known)}"
                raise InvalidInput(f"statements: {key} '{value}' is unknown: {hint}")


def read_statements(settings: Mapping[str, Any]) -> tuple[Statement, ...]:
    """Return the statements of a study file, each about one of its cases."""
    tables, cases = settings.get("statements", []), settings.get("cases", {})
    read = tuple(read_object(Statement, each, f"statements[{n}]") for n, each in enumerate(tables))
    if unknown := sorted({each.case for each in read} - set(cases)):
        raise InvalidInput(
            f"statements are about {unknown}, but the cases are {list(cases)}: name one of these"
        )
    return read


def column_label(case: str, column: str) -> str:
    """Return the name of a case with the changes of a column."""
    return f"{case}, {column}" if column else case


def statement_table(
    statements: Sequence[Statement], columns: Sequence[str], rows: Mapping[str, Rows]
) -> str:
    """Return a table with a line for each statement: the published value, and those of the columns.

    Args:
        statements: statements of the study.
        columns: names of the columns.
        rows: findings by `column_label`.
    """
    lines = [
        [each.words, each.where, each.published, *(_answer(each, rows, name) for name in columns)]
        for each in statements
    ]
    return align_columns(["statement", "where", "published", *columns], lines)


def _answer(statement: Statement, rows: Mapping[str, Rows], column: str) -> str:
    """Return the finding of a case on a statement; a dash where one of its points has failed."""
    own = rows.get(column_label(statement.case, column))
    return FINDINGS[statement.finding](own, statement) if own else "-"


def dead_load_findings(result: DeadLoadResult) -> dict[str, Any]:
    """Return findings of a structure under dead load that statements are about."""
    dead, structure = result.dead, result.dead.model.structure
    joints = assessed_joints(dead.joints)
    depth = structure.depths[joints["joint"].values]
    stress = joints["N"].values / (structure.width * depth)
    found = lowest_modes(result, 3)
    return {
        "compression": float(np.nanmax(stress * edge_factor(joints["eccentricity"].values))),
        "dead friction": float(joints["friction"].max()),
        "fill modes": int(found.local.sum()),
        **{f"mode: {n}": f for n, f in enumerate(found.frequencies.tolist(), 1)},
        **{f"rise: {ring}": rise for ring, rise in _rises(structure, joints).items()},
    }


def edge_factor(eccentricity: Array) -> Array:
    """Return the stress at a joint's edge over its mean, of a linear or triangular distribution."""
    away = np.abs(eccentricity)
    # the last strip has no width: its stress is large, and finite
    return np.where(away < 1.0 / 6.0, 1.0 + 6.0 * away, 2.0 / (3.0 * np.maximum(0.5 - away, 1e-9)))


def _rises(structure: Structure, joints: xr.Dataset) -> dict[str, float]:
    """Return the rise of each ring: of a circle through its joints' middles above the first [m]."""
    places = np.array([structure.joints[n].middle for n in joints["joint"].values])
    rings = [part for part, role in part_roles(joints).items() if role == "ring"]
    middles = {ring: places[joints["part"].values == ring] for ring in rings}
    circles = {ring: fitted_circle(own) for ring, own in middles.items()}
    return {k: float(x.centre[1] + x.radius - middles[k][0, 1]) for k, x in circles.items()}


def history_findings(run: History, case: Case) -> dict[str, Any]:
    """Return largest |e| and friction over a run of the joints that a case names."""
    named, findings = run.joints.isel(joint=list(case.joints)), dict[str, Any]()
    for size in ("eccentricity", "friction"):
        largest = abs(named[size]).max("time").fillna(inf).values.tolist()
        names = (f"{size} of {joint}" for joint in named["name"].values.tolist())
        findings |= zip(names, largest, strict=True)
    return findings


def capacity_findings(case: Case) -> dict[str, Any]:
    """Return the capacity of a case by limit analysis and by pushover, and the order of hinges."""
    collapse = case.limit.solve(case.structure)
    push = pushover(case.analysis, case.limit.live, dead=case.limit.dead)
    steps: dict[int, list[int]] = {}
    for (joint, _), step in zip(push.hinges, push.hinge_steps, strict=True):
        steps.setdefault(step, []).append(joint)
    order = " then ".join(" and ".join(map(str, sorted(each))) for each in steps.values())
    factors = {"factor": float(collapse.factor), "factor_at_most": float(collapse.upper)}
    return {**factors, "peak": push.factor, "order": order}


def _first(rows: Rows, pair: str = "") -> Mapping[str, Any]:
    """Return the findings under a pair; by default the first, for those the same under all."""
    return rows[pair] if pair else next(iter(rows.values()))


def _values(row: Mapping[str, Any], prefix: str) -> list[float]:
    """Return the findings with a prefix; NaN stands for what only other cases have."""
    return [each for name, each in row.items() if name.startswith(prefix) and each == each]


def _describe_mechanisms(rows: Rows, statement: Statement) -> str:
    """Return how many pairs have a mechanism, and of which classes."""
    kinds = [row.get(f"mechanism: {statement.definition}", "") for row in rows.values()]
    found = [kind for kind in kinds if kind]
    classes = ", ".join(f"{found.count(kind)} {kind}" for kind in dict.fromkeys(found))
    return f"{len(found)} of {len(kinds)}" + (f" ({classes})" if found else "")


def _describe_instant(rows: Rows, statement: Statement) -> str:
    """Return class and time of the first mechanism under a pair."""
    row = _first(rows, statement.pair)
    kind = row.get(f"mechanism: {statement.definition}", "")
    return f"{kind} at {row[f'time: {statement.definition}']:.3f} s" if kind else "none"


def _describe_joint(rows: Rows, statement: Statement) -> str:
    """Return the largest |e| and |V|/N of a joint under a pair."""
    row = _first(rows, statement.pair)
    e, used = (row[f"{size} of {statement.joint}"] for size in ("eccentricity", "friction"))
    return f"|e| {e:.2f}, |V|/N {used:.2f}"


def _describe_envelope(rows: Rows, statement: Statement) -> str:
    """Return the median over the pairs of the largest |e| of each ring and pier."""
    medians = np.median([_values(row, "eccentricity: ") for row in rows.values()], axis=0)
    return ", ".join(f"{each:.2f}" for each in medians)


def _describe_dead_load(rows: Rows, statement: Statement) -> str:
    """Return the largest |e| and |V|/N under dead load."""
    row = _first(rows)
    largest = max(_values(row, "dead: "))
    return f"|e| {largest:.2f}, |V|/N {row['dead friction']:.2f}"


def _describe_modes(rows: Rows, statement: Statement) -> str:
    """Return the first frequencies, and how many of these modes are of the fill alone."""
    row = _first(rows)
    listed = ", ".join(f"{f:.2f}" for f in _values(row, "mode: "))
    return f"{row['fill modes']:.0f} local ({listed} Hz)"


def _describe_capacity(rows: Rows, statement: Statement) -> str:
    """Return the largest load factor by pushover, and that of limit analysis."""
    row = _first(rows)
    bounded = np.isnan(row["factor"])
    known = f"at most {row['factor_at_most']:.4g}" if bounded else f"{row['factor']:.4g}"
    return f"pushover {row['peak']:.4g}, limit analysis {known}"


FINDINGS: Mapping[str, Callable[[Rows, Statement], str]] = {
    "rises": lambda rows, _: ", ".join(f"{h:.2f}" for h in _values(_first(rows), "rise: ")) + " m",
    "peak acceleration": lambda rows, _: f"{np.mean([r['pga'] for r in rows.values()]) / G:.3f} g",
    "largest compression": lambda rows, _: f"{_first(rows)['compression'] / MPa:.2f} MPa",
    "dead load": _describe_dead_load,
    "modes": _describe_modes,
    "mechanisms": _describe_mechanisms,
    "first mechanism": _describe_instant,
    "joint": _describe_joint,
    "envelope": _describe_envelope,
    "capacity": _describe_capacity,
    "order of hinges": lambda rows, _: f"joints {_first(rows)['order']}",
}
"""What a statement may ask for: functions from findings to words."""
