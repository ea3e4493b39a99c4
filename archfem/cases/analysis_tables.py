"""An analysis as tables of a case file: [model], [analysis], [criteria], [record], [dead_load].

The keys are the keywords of `archfem.Analysis` and of the objects that it holds, and each table is
read and written by the same declaration. A value that equals its default is not written.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

from archfem._validation import check_choice, declared_keys, given_fields
from archfem.cases.provenance import name_from
from archfem.cases.toml_file import Table, check_table, read_object, split_key_path
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.events import EVENTS, StopCondition, registered_criteria
from archfem.dynamics.recorder import Record
from archfem.dynamics.schemes import SCHEMES, EffectiveDamping, Rayleigh, StiffnessDamping, Viscous
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.construction import Stage, usual_stages
from archfem.masonry.structure import Structure
from archfem.statics.newton import Newton

# Fields of `Analysis` by the section of a case file that has them as keys
SECTION_FIELDS: Mapping[str, tuple[str, ...]] = {
    "model": (
        *("fidelity", "cells", "cell", "max_cell_size", "degree", "quadrature"),
        *("quadrature_points", "displacements", "mesh_file", "tolerance"),
    ),
    "analysis": ("dt", "damping", "scheme", "method", "newton", "until"),
}

DEAD_LOAD_KEYS: Mapping[str, Any] = {"stages": (str, [dict]), "layers": int}


def find_section(keyword: str) -> str:
    """Return the section of a keyword of `Analysis`, or "" if it is none."""
    return next((name for name, keys in SECTION_FIELDS.items() if keyword in keys), "")


def complete_path(path: str) -> str:
    """Return the path of a value in a case; a keyword of an analysis has its section before it."""
    section = find_section(split_key_path(path)[0])
    return f"{section}.{path}" if section else path


def analysis_keys() -> dict[str, Any]:
    """Return the keys of an analysis, of all sections."""
    named = ("damping", "scheme", "until")  # by a word, or a table
    return declared_keys(Analysis) | dict.fromkeys(named, (str, dict))


def read_analysis(settings: Table, structure: Structure, folder: Path) -> Analysis:
    """Return the analysis of a structure that the tables of a case describe."""
    readers: Mapping[str, Callable[[Any], Any]] = {
        "mesh_file": lambda file: folder / file,
        "damping": _read_damping,
        "scheme": lambda scheme: _read_named(scheme, SCHEMES, "analysis.scheme"),
        "until": _read_event,
        "newton": lambda table: read_object(Newton, table, "analysis.newton"),
    }
    values: dict[str, Any] = {}
    known = analysis_keys()
    for section, names in SECTION_FIELDS.items():
        keys = {name: known[name] for name in names}
        for name, value in check_table(settings.get(section, {}), keys, section).items():
            values[name] = readers[name](value) if name in readers else value
    for name, cls in (("criteria", Criteria), ("record", Record)):
        if name in settings:
            values[name] = read_object(cls, settings[name], name)
    values["stages"] = _read_stages(settings.get("dead_load", {}), structure)
    return Analysis(structure, **values)


def write_analysis_tables(analysis: Analysis, folder: Path | None) -> dict[str, Any]:
    """Return the tables of an analysis, but for its structure; files are named from a folder."""
    tables, given = dict[str, Any](), given_fields(analysis)
    del given["structure"]
    writers: Mapping[str, Callable[[Any], Any]] = {
        "mesh_file": lambda file: name_from(file, folder),
        "damping": _write_damping,
        "scheme": lambda scheme: _write_named(scheme, SCHEMES),
        "until": _write_event,
    }
    for name, value in given.items():
        written = writers.get(name, write_value)(value)
        if name == "stages":
            tables["dead_load"] = {"stages": written}
        elif section := find_section(name):
            tables.setdefault(section, {})[name] = written
        else:
            tables[name] = written
    return tables


def write_value(value: Any) -> Any:
    """Return a value of a table: of an object its fields but for those that equal their default."""
    if is_dataclass(value):
        return {name: write_value(own) for name, own in given_fields(value).items()}
    return [write_value(each) for each in value] if isinstance(value, tuple) else value


def _read_damping(given: str | Table) -> Viscous | EffectiveDamping:
    """Return damping, whose kind follows from the keys of its table."""
    if isinstance(given, str):
        check_choice(given, "analysis.damping", ("effective",))
        return EffectiveDamping()
    kinds = {"modes": EffectiveDamping, "frequency": StiffnessDamping, "frequencies": Rayleigh}
    table, cls = dict(given), next((kinds[key] for key in kinds if key in given), EffectiveDamping)
    effective = table.pop("modes", "") == "effective"
    misplaced = {*kinds}.union(*map(declared_keys, kinds.values())) - declared_keys(cls).keys()
    # the share of mass selects the second mode, which stiffness damping has not
    misplaced |= set() if table.get("kind") == "rayleigh" else {"mass_share"}
    known = (effective or "ratio" in table) and misplaced.isdisjoint(table)
    if (cls is EffectiveDamping) != effective or not known:
        raise InvalidInput(
            f"analysis.damping = {given}: write "
            '{ ratio = 0.05, modes = "effective" }, or a frequency = 8.0 in place of modes; for '
            'Rayleigh damping frequencies = [8.0, 16.0], or kind = "rayleigh" (and a mass_share) '
            'beside modes = "effective"'
        )
    return read_object(cls, table, "analysis.damping")


def _write_damping(damping: Viscous | EffectiveDamping) -> dict[str, Any]:
    """Return the table of damping; an effective ratio that is the default is left out."""
    if isinstance(damping, EffectiveDamping):
        return {**write_value(damping), "modes": "effective"}
    return {"ratio": damping.ratio, **write_value(damping)}


def _read_named(given: str | Table, known: Mapping[str, type], section: str) -> Any:
    """Return the object of a word, or of a table with this word as `name`."""
    table = {"name": given} if isinstance(given, str) else dict(given)
    name = check_choice(table.pop("name", None), section, known)
    return read_object(known[name], table, section)


def _write_named(value: Any, known: Mapping[str, type]) -> Any:
    """Return the word of an object, with its fields if some differ from their defaults."""
    name = next(word for word, cls in known.items() if type(value) is cls)
    own = write_value(value)
    return {"name": name, **own} if own else name


def _read_event(given: str | Table) -> StopCondition:
    """Return an event, or a criterion that a module of the user has registered."""
    if isinstance(given, str) and given in registered_criteria:
        return registered_criteria[given]
    table = {"name": given} if isinstance(given, str) else dict(given)
    criteria = table.pop("criteria", None)
    if isinstance(given, str):
        check_choice(given, "analysis.until", (*EVENTS, *registered_criteria))
    event: Any = _read_named(table, EVENTS, "analysis.until")
    if criteria is None:
        return event
    criteria = read_object(Criteria, criteria, "analysis.until.criteria")
    return replace(event, criteria=criteria)


def _write_event(event: StopCondition) -> Any:
    """Return the word or table of an event, or the name of a registered criterion."""
    if name := next((name for name, own in registered_criteria.items() if own is event), ""):
        return name
    if type(event) not in EVENTS.values():
        raise InvalidInput(
            f"until = {event!r} has no name in a file: register it by "
            "archfem.dynamics.register_criterion, and give what is registered"
        )
    return _write_named(event, EVENTS)


def _read_stages(table: Any, structure: Structure) -> Sequence[Stage] | None:
    """Return the construction stages of [dead_load]; None if the structure is built at once."""
    listed = isinstance(table, Mapping) and isinstance(table.get("stages"), list)
    keys = {**DEAD_LOAD_KEYS, "stages": [dict] if listed else str}
    values = check_table(table, keys, "dead_load")
    given = values.get("stages", "none")
    if listed:
        if "layers" in values:
            raise InvalidInput("dead_load has stages of its own: take out layers, or the stages")
        return [
            read_object(Stage, {"name": f"stage {k}", **stage}, f"dead_load.stages[{k}]")
            for k, stage in enumerate(given)
        ]
    usual = check_choice(given, "dead_load.stages", ("none", "usual")) == "usual"
    if "layers" in values and not usual:
        raise InvalidInput("dead_load.layers needs stages = 'usual': add that, or take layers out")
    return usual_stages(structure, values.get("layers", 4)) if usual else None
