"""Deciding values that no table of a case gives: results mark them as defaults."""

from collections.abc import Iterator
from itertools import groupby
from math import inf, isclose
from typing import NamedTuple

from archfem._display import NOTE_MARK
from archfem._validation import declared_keys
from archfem.cases.analysis_keys import find_given_strength
from archfem.cases.case import Case
from archfem.cases.structure_keys import find_table
from archfem.cases.toml_file import Table
from archfem.limit.fill_strength import has_backing
from archfem.limit.instability import describe_friction, describe_geometric_factor, least_friction
from archfem.masonry.backfill import describe_held_ends
from archfem.masonry.joint_closing import USUAL_STRESS, finish_range, usual_depth
from archfem.masonry.materials import Contact, Material
from archfem.masonry.structure import Structure, join_names, join_words
from archfem.models.builder import list_fidelities
from archfem.motion.design_spectra import FloorSpectrum
from archfem.units import GPa, MPa, format_mm, in_unit, kN, kPa, mm

HINGE_REASON = "8 % short of the edge, as in Demirel and Aldemir (2021)"

# Coefficients of friction of dry joints of stone [-]
DRY_FRICTION = 0.4, 0.8

_PAPER = "table 2 of Demirel and Aldemir (2021)"

_OF_STRESS = (
    "of stress alone, as only a strength that is given counts in limit analyses and ratings"
)

_OF_HELD = (
    "so that a ring stands longer: state its limits by `archfem limit` too, with all and a third "
    "of the passive pressure"
)

_OF_DRY = "dry stone has {:g} to {:g}".format(*DRY_FRICTION)

# Values of materials and contacts that decide: name in texts, unit as number and text, and source
DECIDING_VALUES = {
    "young": ("E", GPa, " GPa", f"{_PAPER}; unused where blocks are rigid"),
    "unit_weight": ("weight", kN, " kN/m³", f"{_PAPER}; stones weigh 16 to 27 kN/m³"),
    "strength": ("strength", MPa, " MPa", f"{_PAPER}; {_OF_STRESS}"),
    "normal_stiffness": ("k_n", 1e9, " MPa/mm", f"{_PAPER}; measured ones differ tenfold"),
    "shear_stiffness": ("k_s", 1e9, " MPa/mm", f"{_PAPER}; measured ones differ tenfold"),
    "friction": ("μ", 1.0, "", f"{_OF_DRY}; 0.6 is customary"),
}


def value_text(key: str, value: float | None) -> str:
    """Return a deciding value with its unit; E of soils is in MPa."""
    _, unit, name, _ = DECIDING_VALUES[key]
    if value is None or value == inf:
        return "not known" if value is None else "never slides"
    if key == "young" and value < 0.1 * GPa:
        unit, name = MPa, " MPa"
    return f"{value / unit:.4g}{name}"


# Values of a fill on which factors depend most
_DECIDING_OF_FILL = ("cohesion", "mobilisation", "active")


class Default(NamedTuple):
    """A value that a case does not give."""

    subject: str  # material or contact, or ""
    words: str  # quantity and value
    key: str  # of the case that gives another value
    reason: str  # where the value is from, or what it means


def list_materials_and_contacts(case: Case) -> list[Material | Contact]:
    """Return the materials and contacts of a case, without those of bodies that stand on it."""
    structure, standing = case.structure, case.settings["structure"].get("standing", {})
    items: list[Material | Contact] = [
        block.material for block in structure.blocks if block.name not in standing
    ]
    items += [joint.contact for joint in structure.joints]
    return [*dict.fromkeys(items)]


def list_default_keys(case: Case, item: Material | Contact) -> list[str]:
    """Return the deciding values of a material or contact that the case does not give."""
    own = find_table(case.settings, item)
    return [
        key
        for key in DECIDING_VALUES
        if key not in own.given
        and (value := getattr(item, key, None)) is not None
        # other values follow from a finish, or from the shape; E of the pieces of a fill is that of
        # its preset in their joints
        and (key == "young" or value == getattr(own.preset or type(item), key, None))
    ]


def read_young(case: Case, item: Material) -> float:
    """Return E as the case or a preset gives it, of pieces of a fill that of their joints [Pa]."""
    own = find_table(case.settings, item)
    return in_unit(own.given.get("young", (own.preset or item).young), "Pa", "young")


def list_fill_values(case: Case) -> Iterator[tuple[str, str, bool]]:
    """Yield path, value, and whether the case gives it, of each value of a fill's strength."""
    fills = {"limit": case.limit.fill, "assessment": case.assessment.options.get("fill")}
    for section, fill in fills.items():
        # an assessment may have the fill of the limit analysis
        if (given := case.settings.get(section, {}).get("fill")) is None:
            continue
        backed = given.keys() & {"backing", "backing_height"}
        unused = {"backing_height", "backing"} - backed if backed else {"backing_height"}
        unused |= set() if backed else {"backing_strength"}
        for key, unit in {"law": "", **declared_keys(type(fill))}.items():
            if key in unused - given.keys():
                continue
            value = getattr(fill, key, given.get("law", "pressure"))  # the law is a class
            number = isinstance(value, float)
            text = f"{value:.3g} {unit}".removesuffix(" 1") if number else str(value).lower()
            if unit == "Pa" and number:
                text = f"{value / MPa:.3g} MPa" if value >= MPa else f"{value / kPa:.3g} kPa"
            yield f"{section}.fill.{key}", text, key in given


def list_defaults(case: Case) -> list[Default]:
    """Return the deciding values that a case does not give, with key and reason."""
    # a fill in pieces has a contact with stone for each depth of soil
    return [*dict.fromkeys([*_list_properties(case), *_list_settings(case)])]


def _list_properties(case: Case) -> Iterator[Default]:
    """List the default values of materials, contacts and the width."""
    fidelities = list_fidelities(case.structure, case.analysis.fidelity)
    blocks = zip(case.structure.blocks, fidelities, strict=True)
    # the E of rigid blocks is not used, but for that of a fill in the joints of its pieces
    elastic = {block.material for block, x in blocks if x != "rigid" or block.grain}
    for item in list_materials_and_contacts(case):
        for key in list_default_keys(case, item):
            word, *_, reason = DECIDING_VALUES[key]
            value = getattr(item, key)
            if key == "young" and isinstance(item, Material):
                if item not in elastic:
                    continue
                value = read_young(case, item)
                reason = reason if value == item.young else f"{_PAPER}; displacements depend on it"
            path = f"{find_table(case.settings, item).path}.{key}"
            yield Default(item.name, f"{word} {value_text(key, value)}", path, reason)
    if "width" not in case.settings["structure"]:
        reason = "across the plane; what overturns it there is in proportion to the width"
        yield Default("", f"width {case.structure.width:g} m", "structure.width", reason)


def _list_settings(case: Case) -> Iterator[Default]:
    """List the default settings of motion, damping, criteria and model."""
    analysis, criteria = case.analysis, case.analysis.failure_criteria
    if case.has_motion:
        if _has_default_vertical(case):
            matched = ", before matching" if (case.suite or {}).get("matched") else ""
            words = f"vertical motion 2/3 of the horizontal{matched}"
            key, reason = "motion.synthetic.vertical_ratio", "the classical ratio of the peaks"
            yield Default("", words, key, reason)
        if analysis.damping is None:
            reason = 'friction and impacts alone dissipate; "effective" adds 5 %'
            yield Default("", "no damping", "analysis.damping", reason)
    given = case.settings.get("criteria", {})
    if "hinge" not in given:
        words = f"hinge at |e| {criteria.hinge:g}"
        yield Default("", words, "criteria.hinge", HINGE_REASON)
    if "failures" not in given:
        words, reason = f"mechanism of {criteria.failures} joints", "Heyman (1966): four hinges"
        yield Default("", words, "criteria.failures", reason)
    for path, text, is_given in list_fill_values(case):
        subject, _, key = path.rpartition(".")
        if key in _DECIDING_OF_FILL and not is_given:
            words = f"{key.replace('_', ' ')} {text}"
            yield Default(subject, words, path, "limit analyses and ratings depend on it")
    yield from list_spectrum_defaults(case)
    reasons = {
        "fidelity": 'elastic blocks, all nodes; "rigid" is quicker, and blocks have no mesh',
        "displacements": 'equilibrium where the blocks stood; "large" follows slips and falls',
    }
    for key, reason in reasons.items():
        if key not in case.settings.get("model", {}):
            yield Default("", f"{key} '{getattr(analysis, key)}'", f"model.{key}", reason)


# What codes leave to the user of a spectrum
_OF_SPECTRUM = {
    "type": "2 is for sites where magnitudes above 5.5 contribute little",
    "topography": "level ground: slopes and ridges amplify",
}


def list_spectrum_defaults(case: Case) -> Iterator[Default]:
    """List the default values of the spectra of codes."""
    spectra = {"assessment.spectrum": case.assessment.spectrum, "suite.target": case.target}
    for path, spectrum in spectra.items():
        section, name = path.split(".")
        given = case.settings.get(section, {}).get(name) or {}
        if isinstance(spectrum, FloorSpectrum) and spectrum.period is None:
            words, reason = f"T_1 {spectrum.own_period:.3g} s", "0.05 H^(3/4), that of masonry"
            yield Default("spectrum", words, f"{path}.period", reason)
        spectrum = getattr(spectrum, "ground_spectrum", spectrum)
        given = given.get("ground_spectrum", given)
        for key, reason in _OF_SPECTRUM.items():
            if key not in given and hasattr(spectrum, key):
                words = f"{key} {getattr(spectrum, key)}"
                yield Default("spectrum", words, f"{path}.{key}", reason)


def describe_spectrum_defaults(case: Case) -> str:
    """Describe the values that the site's spectrum has by default; empty if it has none."""
    path = "assessment.spectrum" if case.assessment.spectrum else "suite.target"
    own = (each.words for each in list_spectrum_defaults(case) if each.key.startswith(path))
    return ", ".join(own)


def describe_defaults(case: Case) -> str:
    """Describe the deciding values that a case does not give; empty if it gives all."""
    texts: list[str] = []
    # values of one material or contact stand together behind its name
    for subject, group in groupby(list_defaults(case), lambda each: each.subject):
        words = dict.fromkeys(each.words for each in group)
        texts += [f"'{subject}' {', '.join(words)}"] if subject else [*words]
    return f"defaults, where the case gives no value: {'; '.join(texts)}" if texts else ""


def describe_fill_defaults(case: Case) -> str:
    """Describe the values of a fill that decide and that the case does not give; or empty."""
    values = [
        (path.rpartition(".")[2], text, given) for path, text, given in list_fill_values(case)
    ]
    has = {key for key, text, _ in values if text != "none"}
    words = dict.fromkeys(
        f"{key.replace('_', ' ')} {text}" for key, text, given in values if key in has and not given
    )
    return f"fill, by default: {', '.join(words)}" if words else ""


def explain_defaults(case: Case) -> str:
    """Explain each default in a line: its key, its value, and where it is from."""
    lines = [f"  {each.key}: {each.words}: {each.reason}" for each in list_defaults(case)]
    lines = ["defaults, which the case may give instead:", *lines] if lines else []
    return "\n".join([*lines, *_explain_finishes(case)])


def _explain_finishes(case: Case) -> Iterator[str]:
    """Explain each finish of the case in a line: its key, its law with the range, and sources."""
    structure = case.structure
    for contact in dict.fromkeys(joint.contact for joint in structure.joints):
        own = find_table(case.settings, contact)
        if (finish := own.given.get("finish")) is None:
            continue
        ranges = list_finish_ranges(structure, contact, finish)
        values = ", ".join(f"{word} {text}" for word, text in ranges.values())
        yield f'{own.path}.finish = "{finish}": {values}'


def list_finish_ranges(
    structure: Structure, contact: Contact, finish: str
) -> dict[str, tuple[str, str]]:
    """Return name, and value with range and source, of what follows from a finish, by key."""
    joint = next(joint for joint in structure.joints if joint.contact == contact)
    law = finish_range(structure, joint, finish)
    # mortar has one source of both
    along = [x for x in law.sources if x.startswith("k_s")] or law.sources
    across = f" ({'; '.join(x for x in law.sources if not x.startswith('k_s'))})"
    first = f"{_range_text(law.initial, 1e9)} MPa/mm at first{across}"
    found = {"normal_stiffness": ("k_n", first)}
    if contact.closure:
        found["closure"] = "closing", f"{_range_text(law.closure, mm)} mm at most (as k_n)"
    depth = format_mm(usual_depth(structure, contact))
    of = f"at {USUAL_STRESS / MPa:g} MPa on joints {depth} deep, their median ({'; '.join(along)})"
    return found | {"shear_stiffness": ("k_s", f"{_range_text(law.shear, 1e9)} MPa/mm {of}")}


def _range_text(values: tuple[float, float, float], unit: float) -> str:
    """Return the usual value and the range in a unit."""
    low, usual, high = (f"{value / unit:.2g}" for value in sorted(values))
    return f"{usual} ({low} to {high})"


def _has_default_vertical(case: Case) -> bool:
    """Return whether a synthetic motion has a vertical component that no table gives."""
    motions: list[Table] = [case.motion] if case.motion else [*(case.suite or {})["pairs"].values()]
    return any(
        "synthetic" in each and "vertical_ratio" not in each["synthetic"] and "vertical" not in each
        for each in motions
    )


def say_loads_left_out(case: Case) -> str:
    """Say which loads that stay what is found at rest leaves out; "" if the case has none."""
    attached = [load for load in case.assessment.options.get("loads", ()) if not load.passive]
    loads = {"[assessment]": attached, "limit.dead": case.limit.dead}
    named = join_words([section for section, own in loads.items() if own])
    return f", without the loads of {named}" if named else ""


def note_loads_left_out(case: Case) -> list[str]:
    """Return a note that results have no loads of the assessment, if the case has any."""
    loads = case.assessment.options.get("loads", ())
    weight = sum(load.weight for load in loads)
    forces = any(any(load.force) and not load.passive for load in loads)
    ties = any(load.passive for load in loads)
    kinds = [f"{weight / kN:.4g} kN of weights"] * (weight > 0.0)
    kinds += ["constant forces"] * forces + ["ties"] * ties
    words = f"without the {join_words(kinds)} of [assessment], which limits and runs leave out"
    if weight:
        words += (
            ": give weights that are shaken as [structure.floors] of a wall, which columns across "
            "it have too, or as bodies, [structure.standing]"
        )
    return [f"{NOTE_MARK}{words}"] * bool(kinds)


def note_limit(case: Case) -> Iterator[str]:
    """Yield notes on what [limit] gives, and dead load and runs do not count, or other tables."""
    if has_backing(case.limit.fill):
        yield f"{NOTE_MARK}the backing of [limit] is fill here, in dead load and runs"
    given, crushing = find_given_strength(case.structure, case.settings), case.limit.strength or inf
    if given and crushing < inf and not isclose(given, crushing):
        words = f"{crushing / MPa:g} MPa of [limit], and stones of [materials] at {given / MPa:g}"
        yield f"{NOTE_MARK}joints crush at {words} MPa"


def describe_margins_at_rest(case: Case, structure: Structure) -> list[str]:
    """Describe from which friction and depth of joints it stands, with notes on these and fill."""
    contacts = {joint.contact for joint in structure.joints}
    most = max((x.coefficient for x in contacts if x.coefficient < inf), default=0.0)
    notes = [f"{NOTE_MARK}a coefficient of friction is {most:g}, and {_OF_DRY}"] * (most > 1.0)
    if held := describe_held_ends(structure):
        notes.append(f"{NOTE_MARK}{held} and do not yield, {_OF_HELD}")
    left_out, limit = say_loads_left_out(case), case.limit
    if depth := describe_geometric_factor(structure, limit.strength, limit.fill):
        notes.insert(0, f"{depth}{left_out}")
    if not (sentence := describe_friction(structure)):
        return notes
    least = least_friction(structure) or 0.0
    in_pieces = any(block.grain for block in structure.blocks)
    of_fill = ", that of the fill too" * in_pieces
    open_ones = {each.name for each in contacts if "friction" in list_default_keys(case, each)}
    lines = [f"as rigid blocks {sentence}{of_fill}{left_out}", *notes]
    if open_ones and least > DRY_FRICTION[0] and not in_pieces:
        names = join_names([f'contacts."{name}"' for name in sorted(open_ones)])
        words = f"friction decides whether it stands: {_OF_DRY}"
        lines.append(f"{NOTE_MARK}{words}, and the case gives none in {names}")
    return lines
