"""JSON schema of case and study files, from the declarations by which they are read.

Editors complete and check keys by it. `case.schema.json` beside this module is the output of
`archfem schema`.
"""

import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from archfem._typing import NumberOrWord
from archfem._validation import declared_keys, is_number
from archfem.cases import analysis_keys, analysis_tables, case, motion_keys, structure_keys
from archfem.cases.risk_keys import ALTERNATIVE_KEYS, HAZARD_KEYS
from archfem.cases.verdict_keys import RANGES
from archfem.dynamics import schemes
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.events import EVENTS
from archfem.dynamics.recorder import Record
from archfem.joints.criteria import Criteria
from archfem.limit.collapse import collapse_factor
from archfem.limit.rating import rate
from archfem.limit.vehicles import VEHICLES, Vehicle
from archfem.masonry.block import Block
from archfem.masonry.construction import Stage
from archfem.masonry.joint_closing import CONDITIONS
from archfem.masonry.loads import AttachedLoad, BodyForce, PointLoad, Settlement
from archfem.masonry.materials import Contact, Material
from archfem.masonry.parts import PART_ROLES
from archfem.masonry.standing import StandingBody
from archfem.masonry.structure import Joint
from archfem.masonry.survey.layers import Layer
from archfem.models.discretisation import MODEL_FIDELITIES
from archfem.motion.design_spectra import registered_spectra
from archfem.motion.hazard import MEASURES
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.assessment_checks import LimitState
from archfem.statics.mechanism_assessment import kinematic_assessment
from archfem.statics.newton import Newton
from archfem.statics.pushover import Stop, pushover
from archfem.studies.statements import Statement
from archfem.studies.study import STUDIED_CASE_KEYS, STUDY_KEYS
from archfem.studies.variations import verdict_range

Schema = dict[str, Any]

_MOTION, _SPECTRUM, _CRITERIA, _STANDING, _FILL = (
    {"$ref": f"#/definitions/{name}"}
    for name in ("motion", "spectrum", "criteria", "standing", "fill")
)


def format_schema() -> str:
    """Return the schema as text, as the shipped file has it."""
    return json.dumps(build_schema(), indent=1, ensure_ascii=False) + "\n"


def build_schema() -> Schema:
    """Return the schema (draft 7) of case and study files."""
    study: Schema = {"cases": _by_name(_table(STUDIED_CASE_KEYS)), "columns": {"type": "object"}}
    study["statements"] = _list(_table_of(Statement))
    top = {key: _value(kind) for key, kind in STUDY_KEYS.items()} | study
    top |= {"title": {"type": "string", "description": "title of the case, or of the study"}}
    words = _list({"type": "string"})
    # but those that a module of the user has registered
    spectra = [each for each in registered_spectra.items() if "archfem" in each[1].__module__]
    top |= {"extensions": words, "base": {"type": "string"}, "remove": words}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "case or study of archfem",
        "type": "object",
        "properties": top | _case_sections(),
        "additionalProperties": False,
        "definitions": {
            "motion": _motion(),
            "spectrum": _any(_spectrum(*each) for each in spectra),
            "criteria": _table_of(Criteria),
            "standing": _parts_by_name(StandingBody),
            "fill": _table(structure_keys.fill_keys(), law=_choice("elastic", "jointed")),
        },
    }


# Classes and functions with the descriptions and defaults of the keys of a section
_DECLARATIONS: Mapping[str, Any] = {
    **dict.fromkeys(analysis_tables.SECTION_FIELDS, Analysis),
    "suite": Suite,
    "record": Record,
    "limit": (analysis_keys.LimitAnalysis, collapse_factor, BodyForce),
    "pushover": (pushover, BodyForce),
    "rating": rate,
    "assessment": (kinematic_assessment, analysis_keys.AssessmentSettings),
    "verdict": verdict_range,
}


def _case_sections() -> dict[str, Schema]:
    """Return the schema of each section of a case."""
    own = _analysis_values() | _other_values()
    contact = _table(structure_keys.CONTACT_KEYS, Contact, finish=_choice(*CONDITIONS))
    tables = {
        section: _table(keys, _DECLARATIONS.get(section, ()), **own)
        for section, keys in case.section_keys().items()
    }
    described = {
        "structure": _any([*map(_shape, structure_keys.list_shapes()), _partial_structure()]),
        "materials": _by_name(_table(structure_keys.MATERIAL_KEYS, Material)),
        "contacts": _by_name(contact),
    }
    words = {"pairs": _choice("worst", "all"), "sources": _by_name({"type": "string"})}
    report = _table(case.section_keys()["report"], **words)
    return described | tables | {"motion": _MOTION, "criteria": _CRITERIA, "report": report}


def _shape(name: str) -> Schema:
    """Return the schema of [structure] for a shape."""
    own = {"shape": {"const": name}, **_parts_of_structure(name)}
    schema = _table(structure_keys.shape_keys(name), structure_keys.list_shapes()[name], **own)
    return {"title": name, **schema, "required": ["shape"]}


def _parts_of_structure(name: str) -> dict[str, Schema]:
    """Return the schemas of the tables in [structure]."""
    parts: dict[str, Schema] = {"standing": _STANDING}
    if name == "blocks":
        rows = {"blocks": Block, "joints": Joint}
        return parts | {key: _list(_part(cls)) for key, cls in rows.items()}
    parts["fill"] = _FILL
    if name == "outlines":
        parts |= {"layers": _by_name(_part(Layer)), "contacts": {"type": "object"}}
    elif name == "bridge":
        parts |= {key: _part(part) for key, part in structure_keys.SINGLE_PARTS.items()}
    by_name = structure_keys.PARTS_BY_NAME.get(name, {})
    return parts | {key: _parts_by_name(part) for key, part in by_name.items()}


def _parts_by_name(declaration: Callable[..., Any]) -> Schema:
    """Return the schema of common keys of all parts, and a table for each under its name."""
    schema = _part(declaration)
    return {**schema, "additionalProperties": schema}


def _part(declaration: Callable[..., Any]) -> Schema:
    """Return the schema of a block, joint or part of a bridge."""
    keys = structure_keys.keys_of_part(declaration)
    role = {"role": _choice(*PART_ROLES)} if "role" in keys else {}
    return _table(keys, declaration, **role)


def _partial_structure() -> Schema:
    """Return the schema of a [structure] that changes that of a base: keys of any shape."""
    merged: dict[str, Schema] = {}
    for name in structure_keys.list_shapes():
        merged |= _shape(name)["properties"]
    del merged["shape"]
    return {"title": "changes of a base", **_object(merged)}


def _analysis_values() -> dict[str, Schema]:
    """Return the schemas of values in [model] and [analysis]."""
    kinds = (schemes.EffectiveDamping, schemes.StiffnessDamping, schemes.Rayleigh)
    damping = _merge_tables(kinds, modes=_choice("effective"))
    return {
        "fidelity": _any([_choice(*MODEL_FIDELITIES, "auto"), {"type": "object"}]),
        "displacements": _choice("small", "large"),
        "damping": _any([_choice("effective"), damping]),
        "scheme": _object_by_name(schemes.SCHEMES),
        "until": _object_by_name(EVENTS, criteria=_CRITERIA),
        "newton": _table_of(Newton),
    }


def _other_values() -> dict[str, Schema]:
    """Return the schemas of words and tables in other sections; a key has one meaning in all."""
    # names of vehicles are read in any case of letters
    vehicle = _any([{"type": "string", "examples": [*VEHICLES]}, _table_of(Vehicle)])
    laws = analysis_keys.FILL_LAWS
    return {
        "pairs": _by_name(_MOTION),
        "target": _SPECTRUM,
        "spectrum": _SPECTRUM,
        "point": _one_or_several(_table_of(PointLoad)),
        "friction": _choice(*analysis_keys.FRICTION_LAWS),
        "fill": _merge_tables(laws.values(), law=_choice(*laws)),
        "control": _choice("displacement", "arc length", "path", "force"),
        "stop": _table_of(Stop),
        "settlement": _table_of(Settlement),
        "vehicle": _one_or_several(vehicle),
        "loads": _list(_table_of(AttachedLoad)),
        "limit_state": _any([{"type": "string"}, _table_of(LimitState)]),
        "hazard": _table(HAZARD_KEYS, measure=_choice(*MEASURES)),
        "alternatives": _by_name(_table(ALTERNATIVE_KEYS)),
        "vary": _object({name: _range_of(*labels) for name, labels in RANGES.items()}),
        "stages": _any([_choice("none", "usual"), _list(_table_of(Stage))]),
    }


def _object_by_name(known: Mapping[str, type], **own: Schema) -> Schema:
    """Return the schema of a word, or a table with this word as its name."""
    table = _merge_tables(known.values(), name=_choice(*known), **own)
    return _any([_choice(*known), table])


def _motion() -> Schema:
    """Return the schema of one motion."""
    synthetic = _table_of(Motion.synthetic)
    vertical = _table(motion_keys.source_keys(), Motion.read, synthetic=synthetic)
    own = {"synthetic": synthetic, "vertical": _any([{"type": "string"}, vertical])}
    own["held"] = _table_of(Motion.held)
    return _table(motion_keys.motion_keys(), Motion.read, **own)


def _spectrum(code: str, spectrum: Any) -> Schema:
    """Return the schema of the design spectrum of a code."""
    schema = _table(declared_keys(spectrum), spectrum, ground_spectrum=_SPECTRUM)
    schema["properties"]["code"] = {"const": code}
    return {"title": code, **schema, "required": ["code"]}


def _table_of(declaration: Callable[..., Any]) -> Schema:
    """Return the schema of a table whose keys a class or function declares."""
    return _table(declared_keys(declaration), declaration)


def _merge_tables(declarations: Iterable[Callable[..., Any]], **own: Schema) -> Schema:
    """Return the schema of a table that has the keys of one of several declarations."""
    merged = dict(own)
    for each in declarations:
        merged = _table_of(each)["properties"] | merged
    return _object(merged)


def _table(keys: Mapping[str, Any], declarations: Any = (), **own: Schema) -> Schema:
    """Return the schema of a table; texts and defaults are those of the declarations.

    Schemas in `own` of other keys are left out.
    """
    unpacked = declarations if isinstance(declarations, tuple) else (declarations,)
    texts = {key: text for each in unpacked for key, text in _describe_keys(each).items()}
    values = {key: own.get(key) or _value(kind) for key, kind in keys.items()}
    return _object({key: value | texts.get(key, {}) for key, value in values.items()})


def _describe_keys(declaration: Callable[..., Any]) -> dict[str, Schema]:
    """Return description and default of each argument, from the docstring and the signature."""
    lines = (inspect.getdoc(declaration) or "").split("\n")
    parameters = inspect.signature(declaration).parameters.values()
    found: dict[str, Schema] = {
        each.name: {"default": each.default}
        for each in parameters
        if isinstance(each.default, str | bool) or is_number(each.default)
    }
    name = ""
    for line in lines:
        if match := re.match(r"    (\w+): (.*)", line):
            name = match[1]
            found.setdefault(name, {})["description"] = match[2]
        elif name and line.startswith(" " * 8):
            found[name]["description"] += f" {line.strip()}"
        else:
            name = ""
    return found


def _value(kind: Any) -> Schema:
    """Return the schema of a value of a kind of `check_table`."""
    if isinstance(kind, str):
        # a quantity begins with its number, which a unit follows
        return {"type": ["number", "string"], "pattern": r"^\s*[-+.]?\d"}
    if isinstance(kind, NumberOrWord):
        return _any([_value(kind.unit), {"const": kind.word}])
    if isinstance(kind, list):
        return _list(_value(kind[0]))
    if isinstance(kind, tuple):
        return _any(map(_value, kind))
    types = {int: "integer", str: "string", bool: "boolean", dict: "object", list: "array"}
    return {"type": types[kind]}


def _any(schemas: Iterable[Schema]) -> Schema:
    """Return the schema of a value that one of several describes."""
    return {"anyOf": list(schemas)}


def _choice(*words: str) -> Schema:
    """Return the schema of one of some words."""
    return {"enum": list(words)}


def _list(schema: Schema) -> Schema:
    """Return the schema of a list of values."""
    return {"type": "array", "items": schema}


def _one_or_several(schema: Schema) -> Schema:
    """Return the schema of a value, or a list of such."""
    return _any([schema, _list(schema)])


def _range_of(*labels: Any) -> Schema:
    """Return the schema of some labels, or of the ends of a range of numbers."""
    return _one_or_several(_choice(*labels) if isinstance(labels[0], str) else {"type": "number"})


def _by_name(schema: Schema) -> Schema:
    """Return the schema of a table of tables by name."""
    return {"type": "object", "additionalProperties": schema}


def _object(properties: dict[str, Schema]) -> Schema:
    """Return the schema of a table that has no other keys."""
    return {"type": "object", "properties": properties, "additionalProperties": False}
