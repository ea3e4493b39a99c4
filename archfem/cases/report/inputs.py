"""Inputs of a report: each value with its mark given, default or inferred."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from inspect import Parameter, signature
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import declared_keys
from archfem.cases import defaults, structure_keys
from archfem.cases.motion_keys import MADE, find_matched_band
from archfem.cases.report.report_data import STATIC_RESULTS, ReportData
from archfem.cases.toml_file import format_key, split_key_path
from archfem.dynamics.schemes import EffectiveDamping, Rayleigh, interpret_damping
from archfem.limit.collapse import collapse_factor
from archfem.masonry.joint_closing import FINISHED_KEYS
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.materials import Contact, Material
from archfem.masonry.out_of_plane import describe_lengths, find_openings
from archfem.masonry.shapes.bridge_parts import Backfill
from archfem.masonry.structure import Structure, describe_piers, find_clear_spans, join_words
from archfem.masonry.survey.joint_faces import LEAST_OPENING, Chip, find_chips
from archfem.motion.design_spectra import CodeSpectrum
from archfem.statics.mechanism_assessment import kinematic_assessment
from archfem.statics.pushover import pushover
from archfem.units import Ends, in_unit, kN
from archfem.view.pages.document import Grid

Row = tuple[str, ...]  # quantity, value, mark, and the key of the case if it has one

# Their arguments are keys of the sections
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "limit": collapse_factor,
    "pushover": pushover,
    "assessment": kinematic_assessment,
}

# Most cases whose inputs stand side by side; a page cuts more off
MAX_CASES_ABREAST = 4

# Arguments of shapes that have rows of their own, or no influence
_OWN_ROWS = {"width", "gravity", "name"}

# Keys that say little alone, in words
_WORDS = {
    "measured": "span and rise are those of the",
    "hump": "length without erosion to either side of the crown",
    "spandrels": "thickness of the spandrel walls in all",
}

_RATING_KEYS = {"live", "impact", "dead", "width", "area_load"}

# Properties that limit analysis of rigid blocks does not use, beside a strength that is a default
_UNUSED = {"young", "poisson", "normal_stiffness", "shear_stiffness", "finish"}

# Sources of the defaults of an assessment, which may be of another norm than the report's
_SOURCES = {
    "q": "Circolare 7/2019, C8.7.1.2.1.7",
    "confidence_factor": "of LC1, Circolare 7/2019, C8.5.4.1, from memory",
}

_WEIGHT, _YOUNG = (defaults.DECIDING_VALUES[key][0] for key in ("unit_weight", "young"))

# Keys of a spectrum given by points
_TABLE_KEYS = ("periods", "values", "vertical_values")

# Quantities of which a row may state a range, by their words
_VARIED = {_WEIGHT: "unit_weight", "k_n": "normal_stiffness", "k_s": "shear_stiffness"}

# Formula of stiffnesses that follow from a fill
_IN_SERIES = " (1/k: that of the joint, plus d/E of the fill up to the centres of its pieces)"

# Properties that may be left out: name in texts, and unit
_FURTHER_PROPERTIES = {
    "poisson": ("ν", 1.0, ""),
    "cohesion": ("cohesion", 1e3, " kPa"),
    "tension": ("tensile strength", 1e3, " kPa"),
    "dilatancy": ("dilatancy", 1.0, ""),
    "fracture_energy": ("fracture energy", 1.0, " N/m"),
    "shear_fracture_energy": ("fracture energy in shear", 1.0, " N/m"),
}

_CAPTION = (
    "Inputs. Given: the case states it. Default: archfem's, since the case does not, or Python was "
    "given the same. Inferred: it follows from the others."
)


def tabulate_inputs(data: ReportData) -> Grid:
    """Tabulate all inputs with their marks."""
    rows = [row for row in _structure_rows(data) if row[1]]
    rows += [*_property_rows(data), *_command_rows(data)]
    if not data.is_static:
        rows += [*_motion_rows(data), *_model_rows(data), *_criteria_rows(data)]
    elif data.case.target is not None and data.statements.keys() & {"limit", "assessment"}:
        rows += _target_rows(data)
    return Grid((), _add_sources(rows, _read_sources(data), data.case.settings), _CAPTION)


def compare_inputs(parts: Mapping[str, ReportData]) -> list[Grid]:
    """Tabulate inputs of several cases: those of all, of one alone, and a column for each."""
    tables = {label: tabulate_inputs(data).rows for label, data in parts.items()}
    same, differing, alone = (list[Sequence[str]]() for _ in range(3))
    for quantity in dict.fromkeys(row[0] for rows in tables.values() for row in rows):
        own = {label: tuple(x for x in tables[label] if x[0] == quantity) for label in parts}
        having = [label for label, rows in own.items() if rows]
        if len({*own.values()}) == 1:
            same += own[having[0]]
        elif len(having) == 1:
            alone += [(having[0], *row) for row in own[having[0]]]
        else:
            texts = ("; ".join(map(_join_mark, rows)) for rows in own.values())
            differing.append((quantity, *(text or "-" for text in texts)))
    head = ["", *parts]
    if len(parts) > MAX_CASES_ABREAST:
        head, differing = ["", "", "cases"], [*_list_values(differing, [*parts])]
    several = Grid(head, differing, "Inputs that differ between the cases", "words")
    alone.sort(key=lambda row: [*parts].index(row[0]))
    single = Grid(("case", "", "", ""), alone, "Inputs of one case alone", "words")
    return [each for each in (Grid((), same, _CAPTION), several, single) if each.rows]


def _list_values(rows: Sequence[Sequence[str]], labels: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield each value of a quantity in a row of its own, with the cases that have it."""
    for quantity, *texts in rows:
        for text in dict.fromkeys(texts):
            having = [label for label, own in zip(labels, texts, strict=True) if own == text]
            yield quantity, text, join_words(having)
            quantity = ""  # of the rows below too


def _join_mark(row: Sequence[str]) -> str:
    """Return value and mark of a row as one text."""
    mark = row[2].replace(" (", ": ", 1).removesuffix(")")
    return f"{row[1]} ({mark})"


def _read_sources(data: ReportData) -> dict[str, str]:
    """Return the sources that the case states, by the paths of their keys."""
    stated = data.case.report.get("sources", {}).items()
    return {".".join(map(format_key, split_key_path(key))): text for key, text in stated}


def _lies_in(key: str, above: str) -> bool:
    """Return whether the path of a key is another one, or lies below it."""
    return f"{key}.".startswith(f"{above}.")


def _add_sources(
    rows: Sequence[Row], sources: Mapping[str, str], settings: Mapping[str, Any]
) -> list[Row]:
    """Return quantity, value and mark of rows, what is given with its source; then other sources.

    Those are of keys without a row, such as ones of a result that is not in the report.
    """
    keys, added, left = [key for row in rows for key in row[3:]], list[Row](), [*sources]
    parts = [path for path in sources if not any(_lies_in(key, path) for key in keys)]
    for name, value, mark, *own in rows:
        found = list[str]()
        # nobody but archfem is the source of a default; a drawing is that of its blocks
        for key in own if mark == "given" or own == ["structure"] else ():
            above = sorted((path for path in sources if _lies_in(key, path)), key=len)[-1:]
            found += [sources[path] for path in above]
            within = [path for path in parts if _lies_in(path, key)]
            left = [path for path in left if path not in (*above, *within)]
            found += [f"{path.removeprefix(key)[1:]}: {sources[path]}" for path in within]
        added.append((name, value, f"{mark} ({'; '.join(found)})" if found else mark))
    for path in left:
        stated = reduce(lambda table, key: table.get(key, {}), split_key_path(path), settings)
        text = "-" if stated == {} else describe_value(stated)  # that of a drawing is not kept
        added.append((path, text, f"given ({sources[path]})"))
    return added


def _mark(given: bool) -> str:
    """Return the mark of a value that is given, or a default."""
    return "given" if given else "default"


def _mark_key(table: Mapping[str, Any], path: str) -> tuple[str, str]:
    """Return the mark of a key, given if its table has it, and its path."""
    return _mark(path.rpartition(".")[2] in table), path


def _structure_rows(data: ReportData) -> Iterator[Row]:
    """Yield the keys of [structure]; width and gravity also where they are defaults."""
    table, structure = data.case.settings.get("structure", {}), data.case.structure
    kinds = structure_keys.shape_keys(table["shape"])
    parts = {**structure_keys.PARTS_BY_NAME.get(table["shape"], {}), "backfill": Backfill}
    drawn = ("blocks", "joints") if "drawing.txt" in data.files else ()
    free, alone = len(structure.free), data.runs and not data.folder
    counts = {"blocks": f"{free} and {len(structure.blocks) - free} fixed"}
    counts["joints"] = f"{len({*structure.face_names})}"
    corners = ", maybe of a drawing: a history keeps their corners alone" if alone else ""
    for key, value in table.items():
        if key in ("material", "contact", "width", "gravity"):
            continue
        mark = "inferred" if key in drawn else "given"
        text = describe_value(value, kinds.get(key))
        if key == "shape":
            text = "outlines" if drawn else f"{_say_key(value)}{corners * (value == 'blocks')}"
        if key in ("blocks", "joints"):
            text = f"{counts[key]}, by their corners"
        yield key.replace("_", " "), text, mark, "structure" if key in drawn else f"structure.{key}"
        if key in parts:
            own = [set(each) for each in value.values() if isinstance(each, Mapping)]
            given = set(value).union(set.intersection(*own) if own else ())
            yield key, _list_left_out(parts[key], given), "default"
    if table["shape"] in ("blocks", "outlines"):
        yield from _measure_rows(structure)
    elif "measured" in kinds:  # lengths to an inner face are not those to the springing
        for part, words in describe_piers(structure).items():
            yield part or "pier", words, "inferred"
    shape = structure_keys.list_shapes()[table["shape"]]
    yield "structure", _list_left_out(shape, {*table}), "default"
    length = f"{structure.width:g} m{describe_lengths(structure)}"
    yield "width", length, *_mark_key(table, "structure.width")
    yield "gravity", f"{structure.gravity:g} m/s²", *_mark_key(table, "structure.gravity")
    if "joints" not in table and table["shape"] in ("blocks", "outlines"):
        yield "joints", f"{counts['joints']}, where outlines touch", "inferred"


def _measure_rows(structure: Structure) -> Iterator[Row]:
    """Yield lengths of rings and piers that are given block by block, and sizes of stones."""
    touches = [(*joint.blocks, joint.ends) for joint in structure.joints]
    chips = find_chips([block.points for block in structure.blocks], touches, LEAST_OPENING)
    for part, (low, high) in find_clear_spans(structure).items():
        own = [each for each in structure.joints if each.role == "ring" and each.part == part]
        stones = [block.points for block in structure.blocks if block.part == part]
        rise = _find_crown(stones, low, high, chips) - min(joint.intrados[1] for joint in own)
        depths = Ends.of(joint.depth for joint in own)
        depth = f", rise {rise:.3g} m, thickness" if rise > 1e-6 else ", bearings"
        text = f"clear span {high - low:.3g} m{depth} {depths:.3g} m"
        yield part or "ring", text, "inferred"
    for part, words in describe_piers(structure).items():
        yield part or "pier", words, "inferred"
    for left, sill, right, head in find_openings(structure):
        size = f"{right - left:.3g} m wide and {head - sill:.3g} m high"
        yield "opening", f"{size}, from x = {left:.3g} m, y = {sill:.3g} m", "inferred"
    areas = Ends.of(structure.blocks[number].area for number in structure.free)
    yield "stones", f"{len(structure.free)} that can move, of {areas:.2g} m²", "inferred"


def _find_crown(
    stones: Sequence[Array], low: float, high: float, chips: Sequence[Chip] = ()
) -> float:
    """Return the highest level of the underside in a clear span, but that of chips [m]."""
    edges = np.concatenate([np.stack([x, np.roll(x, -1, axis=0)], axis=1) for x in stones])
    a, b = np.moveaxis(edges[edges[:, 0, 0] != edges[:, 1, 0]], 1, 0)
    # the apex of a pointed arch may be within the face of a stone
    at = np.unique(np.clip(edges[..., 0], low, high))
    share = (at[:, None] - a[:, 0]) / (b - a)[:, 0]
    levels = np.where(np.abs(share - 0.5) <= 0.5 + 1e-9, a[:, 1] + share * (b - a)[:, 1], np.inf)
    underside = levels.min(axis=1)
    places = np.column_stack([at, underside])[np.isfinite(underside)]
    whole = [place[1] for place in places if not any(chip.holds(place) for chip in chips)]
    return float(max(whole or places[:, 1]))


def _list_left_out(declaration: Callable[..., Any], given: set[str]) -> str:
    """List the lengths and words of a shape, or of its part, that the case leaves to defaults."""
    kinds, found = structure_keys.keys_of_part(declaration), signature(declaration).parameters
    values = {key: each.default for key, each in found.items() if key not in given | _OWN_ROWS}
    return "; ".join(
        f"{_say_key(key)} {describe_value(value, kinds.get(key))}"
        for key, value in values.items()
        if isinstance(value, int | float | str)
    )


def _say_key(key: str) -> str:
    """Return a key in words."""
    return _WORDS.get(key, key.replace("_", " "))


def describe_value(value: Any, kind: Any = None) -> str:
    """Return a value of a case in words, numbers with the unit of their key; lists by number."""
    if isinstance(value, Mapping):
        if value.get("code") == "table":  # each value at its period
            rows = zip(*(value[k] for k in _TABLE_KEYS if k in value), strict=True)
            pairs = (" ".join(map(describe_value, row)) for row in rows)
            return f"table of period [s] and accelerations [g]: {'; '.join(pairs)}"
        kinds = kind if isinstance(kind, Mapping) else {}
        own = [
            f"{_say_key(key)} {describe_value(each, kinds.get(key))}" for key, each in value.items()
        ]
        return "; ".join(own) or "as all"
    if isinstance(value, list):
        return ", ".join(map(describe_value, value)) if len(value) < 7 else f"{len(value)} values"
    number = isinstance(value, int | float) and not isinstance(value, bool)
    unit = f" {kind}" if number and isinstance(kind, str) and kind not in ("", "1") else ""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return (text + unit).replace("**2", "²")


def _property_rows(data: ReportData) -> Iterator[Row]:
    """Yield the values of materials and contacts, equal ones once."""
    groups = dict[Any, list[tuple[Material | Contact, list[Row]]]]()
    items = defaults.list_materials_and_contacts(data.case)
    names = Counter(item.name for item in items if isinstance(item, Contact))
    sources = _read_sources(data)
    for item in items:
        rows, load = [*_list_given(data, item)], getattr(item, "stands_for", None)
        # what carries more than itself may differ in weight alone from its neighbour, and joints of
        # one name in stiffness alone, which depends on the pieces of fill beside them
        own = structure_keys.find_table(data.case.settings, item)
        several = isinstance(item, Contact) and names[item.name] > 1 and "finish" not in own.given
        varied = ("k_n", "k_s") if several else (_WEIGHT,) if load is not None else ()
        same = tuple(row[:3] for row in rows if row[0] not in varied)
        sourced = own.path * any(_lies_in(source, own.path) for source in sources)
        kind = type(item), item.name * several, varied, load, same, sourced
        groups.setdefault(kind, []).append((item, rows))
    for (cls, _, varied, load, *_), group in groups.items():
        (first, rows), *others = group
        own = structure_keys.find_table(data.case.settings, first)
        name = first.name + f" and {len(others)} more" * bool(others)
        if load is not None:
            yield f"{name}: stands also for", load, "given", f"{own.path}.stands_for"
        for word, text, mark, *path in rows:
            if word in varied and others:
                key = _VARIED[word]
                values = [getattr(each, key) for each, _ in group]
                ends = (defaults.value_text(key, x) for x in (min(values), max(values)))
                text = " to ".join(dict.fromkeys(ends))
                if cls is Contact and mark == "given":  # pieces of fill beside joints add to theirs
                    alone = defaults.value_text(key, in_unit(own.given[key], "Pa/m", key))
                    yield f"{name}: {word}", alone, mark, *path
                    word, mark = f"{word} with its pieces of fill", "inferred"
                text += _IN_SERIES * (cls is Contact and mark == "inferred")
            yield f"{name}: {word}", text, mark, *path


def _list_given(data: ReportData, item: Material | Contact) -> Iterator[Row]:
    """Yield the values of a material or contact; stiffer ones of pieces of fill are inferred."""
    for word, text, mark, *path in _list_properties(data, item):
        if isinstance(item, Material) and word == _YOUNG:
            own = defaults.value_text("young", defaults.read_young(data.case, item))
            if not text.startswith(own):
                yield word, own, mark, *path
                text = f"{defaults.value_text('young', item.young)}, practically rigid"
                text += ", as their joints have the E of the fill"
                word, mark = f"{word} of its pieces", "inferred"
        stated = (_FURTHER_PROPERTIES["poisson"][0], *[_YOUNG] * (mark == "given"))
        text += " (unused: blocks are rigid)" * (word in stated and data.fidelity == "rigid")
        yield word, text, mark, *path


def _list_properties(data: ReportData, item: Material | Contact) -> Iterator[Row]:
    """Yield the values of a material or contact."""
    open_keys = defaults.list_default_keys(data.case, item)
    _, given, path, known = structure_keys.find_table(data.case.settings, item)
    unused = _UNUSED | ({"strength"} - given.keys()) if data.is_static else set()
    follows = {*FINISHED_KEYS} if "finish" in given else set()
    for key in (key for key in defaults.DECIDING_VALUES if hasattr(item, key)):
        (word, *_, reason), value = defaults.DECIDING_VALUES[key], getattr(item, key)
        text, mark = defaults.value_text(key, value), _mark(key in given)
        if word == _WEIGHT and key in given:
            own = defaults.value_text(key, in_unit(given[key], "N/m**3", key))
            text = text if own == text else f"{own}, {text} with the spandrels"
        if key in open_keys:
            text += f" ({reason if key == 'young' else reason.partition(';')[0]})"
        elif mark == "default" and value is not None:
            mark = "inferred"  # from the shape
            text += _IN_SERIES * (word in ("k_n", "k_s"))
        if key not in unused | follows:
            yield word, text, mark, f"{path}.{key}"
    if "finish" in given.keys() - unused and isinstance(item, Contact):
        yield "finish", _describe_finish(given["finish"]), "given", f"{path}.finish"
        ranges = defaults.list_finish_ranges(data.case.structure, item, given["finish"])
        yield from ((word, text, "inferred") for word, text in ranges.values())
    for key, (word, unit, name) in _FURTHER_PROPERTIES.items():
        if (key in given or getattr(item, key, None)) and key not in unused:
            usual = getattr(known or type(item), key, None)
            derived = key not in given and getattr(item, key) != usual
            mark = "inferred" if derived else _mark(key in given)
            yield word, f"{getattr(item, key) / unit:g}{name}", mark, f"{path}.{key}"
    if isinstance(item, Contact) and item.law is not None:
        yield "law", str(item.law), "given", f"{path}.law"


def _describe_finish(finish: str) -> str:
    """Return a finish, with what a rough one means."""
    words = "; rougher faces are stiffer under little stress, so that they may move less"
    return finish + f"{words}, and close further" * (finish in ("hewn", "weathered"))


def _command_rows(data: ReportData) -> Iterator[Row]:
    """Yield the keys of static analyses and of the risk that are in the report."""
    for section in (*STATIC_RESULTS, "pushover", "risk"):
        table = data.read_table(section)
        # a rating has joints and fill of [limit]
        users = ("limit", "thickness", "rating") if section == "limit" else (section,)
        if not any(f"{name}.txt" in data.files for name in users):
            continue
        for key, value in table.items():
            if section == "assessment" and key == "loads":
                yield from _load_rows(data.case.assessment.options[key])
            elif key != "fill":
                unit = "× the weight" * (key in ("horizontal", "vertical"))
                text = describe_value(value, unit)
                yield f"{section}: {key.replace('_', ' ')}", text, "given", f"{section}.{key}"
        if section in _FUNCTIONS:
            inherited = data.case.assessment.of_limit if section == "assessment" else ()
            yield from _default_rows(section, {**dict.fromkeys(inherited), **table})
        yield from _further_rows(data, section, table)
    if any(f"{name}.txt" in data.files for name in STATIC_RESULTS):
        for path, text, given in defaults.list_fill_values(data.case):
            section, _, key = path.split(".")
            yield f"{section}: fill, {key.replace('_', ' ')}", text, _mark(given), path


def _load_rows(loads: Sequence[AttachedLoad]) -> Iterator[Row]:
    """Yield the attached loads of an assessment."""
    for number, load in enumerate(loads, start=1):
        words = [f"on {load.block} at {_say_pair(load.point)} m"]
        words += [f"weight {load.weight / kN:g} kN"] * (load.weight > 0.0)
        if any(load.force):
            what = "tie of at most" if load.passive else "constant force"
            words.append(f"{what} {_say_pair(np.array(load.force) / kN)} kN")
        if load.anchor_point is not None:
            words.append(f"held by {load.anchor} at {_say_pair(load.anchor_point)} m")
        elif load.passive:
            words.append("held by the ground")
        words += [f"{load.free_length} m of it free"] * (load.free_length is not None)
        yield f"assessment: load {number}", "; ".join(words), "given", "assessment.loads"


def _say_pair(pair: Iterable[float]) -> str:
    """Return components along x and y."""
    return f"({', '.join(f'{value:.4g}' for value in pair)})"


def _further_rows(data: ReportData, section: str, table: Mapping[str, Any]) -> Iterator[Row]:
    """Yield what a spectrum, the fill of an assessment and the vehicle of a rating imply."""
    if section == "assessment" and "spectrum" in table:
        yield from _spectrum_rows(data, "assessment", data.case.assessment.spectrum)
    if section == "assessment":
        for key in data.case.assessment.of_limit:
            yield f"assessment: {key}", "that of the limit analysis", "inferred"
    # a vehicle of one's own may have factors
    vehicle = table.get("vehicle")
    of_vehicle = set(vehicle) if isinstance(vehicle, Mapping) else set()
    if section == "rating" and (own := _RATING_KEYS - table.keys() - of_vehicle):
        words = ", ".join(sorted(own)).replace("_", " ")
        whose = "1, none or by rule" if of_vehicle else "of the code"
        yield f"rating: {words}", f"{whose}, see below", "default"


def _default_rows(section: str, table: Mapping[str, Any]) -> Iterator[Row]:
    """Yield the arguments of the function of a section that its table does not give."""
    if section == "assessment" and "spectrum" not in table:
        yield "assessment: spectrum", "of the motions or their target", "inferred"
    words = {"direction": "right and left"} if section == "assessment" else {}
    if section == "assessment" and table.get("loads"):
        words["friction"] = "coulomb, as none without dilatancy is searched with loads"
    for key, argument in signature(_FUNCTIONS[section]).parameters.items():
        # an empty value stands for none, and is no input
        if key not in table and argument.default not in (Parameter.empty, None, ()):
            value = words.get(key, describe_value(argument.default))
            if section == "assessment" and key in _SOURCES:
                value += f" ({_SOURCES[key]})"
            yield f"{section}: {key.replace('_', ' ')}", value, "default"


def _motion_rows(data: ReportData) -> Iterator[Row]:
    """Yield the sources of the motions, their components and factors."""
    # as the case writes them, with their units
    motion, suite = (data.case.settings.get(key) for key in ("motion", "suite"))
    if suite is not None:
        names = f"{len(suite['pairs'])} pairs: {', '.join(suite['pairs'])}"
        yield "motions", names, "given", "suite.pairs"
        before = ", before matching" if suite.get("matched") else ""
        for part, values, mark in _source_rows(list(suite["pairs"].values())):
            yield f"{part}{before}", values, mark
        yield from _target_rows(data)
        matched = "matched to the target" if suite.get("matched") else "as they are"
        yield "motions are", matched, *_mark_key(suite, "suite.matched")
        if band := find_matched_band(data.case.suite):
            text = "from {:g} to {:g} s".format(*band)
            yield "motions are matched", text, *_mark_key(suite, "suite.band")
        for key, name in (("scale", "scale of the motions"), ("reduction", "reduction factor R")):
            yield name, str(suite.get(key, 1.0)), *_mark_key(suite, f"suite.{key}")
        if "reversed" in suite:
            text = describe_value(suite["reversed"])
            yield "motions are reversed", text, "given", "suite.reversed"
    elif motion is not None:
        own = {key: value for key, value in motion.items() if key != "scale"}
        for row in _source_rows([own]):
            yield *row, row[0].replace("vertical motion", "motion.vertical").replace(", ", ".")
        scale = str(motion.get("scale", 1.0))
        yield "scale of the motion", scale, *_mark_key(motion, "motion.scale")


def _target_rows(data: ReportData) -> Iterator[Row]:
    """Yield the target spectrum of a suite, which may be the demand of static analyses alone."""
    target = data.case.settings.get("suite", {}).get("target")
    text = describe_value(target) if target else "none"
    yield "target spectrum", text, _mark(bool(target)), "suite.target"
    yield from _spectrum_rows(data, "suite", data.case.target)


def _spectrum_rows(data: ReportData, section: str, spectrum: Any) -> Iterator[Row]:
    """Yield the default values of a spectrum, and what follows from its code."""
    name = {"assessment": "assessment: spectrum", "suite": "target spectrum"}[section]
    for each in defaults.list_spectrum_defaults(data.case):
        if each.key.startswith(section):
            yield name, each.words, "default"
    if isinstance(spectrum, CodeSpectrum):
        text = spectrum.describe()
        if section == "assessment" or data.is_static:
            text = text.partition("; vertical")[0]  # pushes are horizontal
        yield f"{name}, by the code", text, "inferred"


def _source_rows(motions: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    """Yield the sources of some motions; values that differ stand in the order of the motions."""
    values: dict[tuple[str, str, str], list[str]] = {}
    for motion in motions:
        for part, key, value, mark in _describe_motion(motion):
            values.setdefault((part, mark, key), []).append(value)
    rows: dict[tuple[str, str], list[str]] = {}
    for (part, mark, key), of_key in values.items():
        count = f" (of {len(of_key)} motion{'s' if len(of_key) > 1 else ''})"
        some = "" if len(of_key) == len(motions) else count
        words = f"{key.replace('_', ' ')} {', '.join(dict.fromkeys(of_key))}{some}"
        rows.setdefault((part, mark), []).append(words)
    for (part, mark), each in rows.items():
        yield part, "; ".join(each), mark


def _describe_motion(motion: Mapping[str, Any]) -> Iterator[tuple[str, str, str, str]]:
    """Yield component, key, value and mark of the sources of a motion, defaults included."""
    parts = {"motion": motion}
    if "vertical" in motion:
        vertical = motion["vertical"]
        parts["vertical motion"] = vertical if isinstance(vertical, Mapping) else {"file": vertical}
    for part, table in parts.items():
        for key, value in table.items():
            if key not in (*MADE, "vertical"):
                yield part, key, describe_value(value), "given"
        for source in MADE.keys() & table.keys():
            made, kinds = table[source], declared_keys(MADE[source])
            usual = {name: x.default for name, x in signature(MADE[source]).parameters.items()}
            ratio = (values := usual | made).pop("vertical_ratio", None)
            for key, value in values.items():
                if isinstance(value, float) and key not in made:
                    value = float(f"{value:.3g}")
                text = describe_value(value, kinds[key])
                yield f"{part}, {source}", key, text, _mark(key in made)
            if ratio is None or "vertical" in motion:
                continue
            mark = _mark("vertical_ratio" in made)
            yield "vertical motion, synthetic", "peak", f"{ratio:.3g} of the horizontal", mark


def _model_rows(data: ReportData) -> Iterator[Row]:
    """Yield fidelity, mesh, time steps and damping."""
    analysis, settings = data.case.analysis, data.case.settings
    model, own = settings.get("model", {}), settings.get("analysis", {})
    selected = analysis.selects_model and bool(data.runs)
    mark = "inferred" if selected else _mark("fidelity" in model)
    yield "fidelity", data.fidelity, mark, "model.fidelity"
    yield "displacements", analysis.displacements, *_mark_key(model, "model.displacements")
    if not analysis.selects_model:
        follows = {"quadrature_points"} & model.keys() and "quadrature" not in model
        mark = "inferred" if follows else _mark("quadrature" in model)
        yield "quadrature", analysis.discretisation.rule.rule, mark, "model.quadrature"
        for key, unit in {"quadrature_points": "", "max_cell_size": "m", "degree": ""}.items():
            if key in model:
                text = describe_value(model[key], unit)
                yield key.replace("_", " "), text, "given", f"model.{key}"
        if analysis.discretisation.fidelity != "rigid":
            through, along = analysis.discretisation.cells
            text, cell = f"{through} through, {along} along", f"{analysis.discretisation.cell}s"
            yield "cells a block", text, *_mark_key(model, "model.cells")
            yield "cells", cell, *_mark_key(model, "model.cell")
    if not data.case.has_motion:
        return
    scheme = type(analysis.scheme).__name__.lower()
    yield "scheme", scheme, *_mark_key(own, "analysis.scheme")
    if analysis.dt is None:
        error = f"by an error of {analysis.tolerance:g} in |e|"
        yield "time step", error, *_mark_key(model, "model.tolerance")
    else:
        yield "time step", f"{1e3 * analysis.dt:g} ms", "given", "analysis.dt"
    yield from _damping_rows(data, own.get("damping"))


def _damping_rows(data: ReportData, given: str | Mapping[str, Any] | None) -> Iterator[Row]:
    """Yield ratio, joints, kind and frequencies of damping, which a word or a table gives."""
    damping, path = interpret_damping(data.case.analysis.damping), "analysis.damping"
    if damping is None:
        yield "damping", "none but that of friction", _mark(given is not None), path
        return
    own = given if isinstance(given, Mapping) else {}
    ratio = f"{100.0 * damping.ratio:g} % of critical"
    yield "damping", ratio, *_mark_key(own, f"{path}.ratio")
    yield "damping, joints", damping.joints, *_mark_key(own, f"{path}.joints")
    if isinstance(damping, EffectiveDamping):
        yield "damping, kind", damping.kind, *_mark_key(own, f"{path}.kind")
        yield "damped at", "the effective modes about dead load", "given", path
    elif isinstance(damping, Rayleigh):
        low, high = damping.frequencies
        yield "damped at", f"{low:.3g} and {high:.3g} Hz (Rayleigh)", "given", path
    else:
        text = f"{damping.frequency:.3g} Hz, proportional to stiffness"
        yield "damped at", text, "given", path


def _criteria_rows(data: ReportData) -> Iterator[Row]:
    """Yield the criteria of failure."""
    criteria, settings = data.case.analysis.failure_criteria, data.case.settings
    until = settings.get("analysis", {}).get("until")
    own = until.get("criteria", {}) if isinstance(until, Mapping) else {}
    given = settings.get("criteria", own) or {}
    reason = "" if "hinge" in given else f" ({defaults.HINGE_REASON})"
    hinge = f"|e| ≥ {criteria.hinge:g}{reason}"
    yield "a joint hinges where", hinge, *_mark_key(given, "criteria.hinge")
    limit = "its own limit, μ + c A / N" if criteria.friction is None else f"{criteria.friction:g}"
    words = "a joint slides where |V| / N reaches"
    yield words, limit, *_mark_key(given, "criteria.friction")
    count = f"{criteria.failures} joints of rings and piers that fail at once"
    yield "mechanism by count", count, *_mark_key(given, "criteria.failures")
    duration = f"{1e3 * criteria.duration:g} ms"
    yield "failure lasts for", duration, *_mark_key(given, "criteria.duration")
