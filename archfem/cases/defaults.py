"""Values of a case that decide and that none of its tables gives: results mark them as defaults."""

from archfem.cases.case import Case
from archfem.cases.toml_file import Table
from archfem.masonry.materials import Contact, Material
from archfem.units import GPa, MPa, kN

# Values of materials and contacts that decide: name in texts, unit as number and text
DECIDING_VALUES = {
    "materials": {
        "young": ("E", GPa, " GPa"),
        "unit_weight": ("weight", kN, " kN/m³"),
        "strength": ("strength", MPa, " MPa"),
    },
    "contacts": {
        "normal_stiffness": ("k_n", 1e9, " MPa/mm"),
        "shear_stiffness": ("k_s", 1e9, " MPa/mm"),
        "friction": ("μ", 1.0, ""),
    },
}


def list_default_keys(case: Case, item: Material | Contact) -> list[str]:
    """Return the deciding values of a material or contact that the case does not give."""
    section = "materials" if isinstance(item, Material) else "contacts"
    given = case.settings.get(section, {}).get(item.name, {})
    keys = DECIDING_VALUES[section]
    return [key for key in keys if key not in given and getattr(item, key) is not None]


def describe_defaults(case: Case) -> str:
    """Describe the deciding values that a case does not give; empty if it gives all."""
    structure, analysis = case.structure, case.analysis
    items = dict.fromkeys(
        [block.material for block in structure.blocks]
        + [joint.contact for joint in structure.joints]
    )
    texts = []
    for item in items:
        section = DECIDING_VALUES["materials" if isinstance(item, Material) else "contacts"]
        values = []
        for key in list_default_keys(case, item):
            word, unit, name = section[key]
            values.append(f"{word} {getattr(item, key) / unit:g}{name}")
        texts += [f"'{item.name}' {', '.join(values)}"] if values else []
    if case.has_motion:
        texts += ["vertical motion 2/3 of the horizontal"] if _has_default_vertical(case) else []
        texts += [] if analysis.damping is not None else ["no damping"]
    given, criteria = case.settings.get("criteria", {}), analysis.failure_criteria
    texts += [f"hinge at |e| {criteria.hinge:g}"] if "hinge" not in given else []
    texts += [f"mechanism of {criteria.failures} joints"] if "failures" not in given else []
    for key in ("fidelity", "displacements"):
        if key not in case.settings.get("model", {}):
            texts.append(f"{key} '{getattr(analysis, key)}'")
    return f"defaults, where the case gives no value: {'; '.join(texts)}" if texts else ""


def _has_default_vertical(case: Case) -> bool:
    """Return whether a synthetic motion has a vertical component that no table gives."""
    motions: list[Table] = [case.motion] if case.motion else [*(case.suite or {})["pairs"].values()]
    return any(
        "synthetic" in each and "vertical_ratio" not in each["synthetic"] and "vertical" not in each
        for each in motions
    )
