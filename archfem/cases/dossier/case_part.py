"""Case, assumptions, units and signs, and geometry."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.cases.dossier.results import Results
from archfem.dynamics.history import SIGNS
from archfem.dynamics.schemes import EffectiveDamping, Rayleigh
from archfem.masonry.materials import Contact, Material
from archfem.masonry.structure import Structure
from archfem.units import MPa, kN
from archfem.view.names import draw_names
from archfem.view.pages.document import Grid, Plate, Section, Words

RUNGS = {
    "rigid": "rigid; all compliance is in the joints",
    "faces": "elastic; each face of a joint moves as a plane, the rest is condensed statically",
    "condensed": "elastic; all nodes on joints are kept, the rest is condensed statically",
    "full": "elastic finite elements, all nodes kept",
    "monolithic": "elastic finite elements, all nodes kept, weak forms assembled each time",
}
"""What blocks are taken as, by the rung of the model."""


def case_sections(results: Results) -> list[Section]:
    """Return the sections on what was asked and assumed.

    Args:
        results: of which the report is.
    """
    case = results.case
    asked = [
        (key, value)
        for section, table in case.settings.items()
        if section not in ("title", "structure", "materials", "contacts")
        for key, value in _flat(section, table)
    ]
    assumed = Grid((), _assumptions(results), "What the analysis takes for granted")
    pieces: list[Any] = [assumed]
    if asked:
        pieces.append(Grid((), asked, "What the case asks for beside its structure"))
    signs = Grid(
        (),
        [
            ("units", "SI: m, kg, s, N, Pa, where no other unit stands beside a number"),
            ("signs", SIGNS),
            ("e", "eccentricity M / (N h), h the depth of the joint: ±0.5 at its edges"),
            ("V / N", "mobilised friction |V| / N: at its limit μ, with c A / N added, it slides"),
        ],
    )
    return [
        Section("Case and assumptions", pieces),
        Section("Units and signs", [signs]),
        Section("Geometry and materials", _geometry(case)),
    ]


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    """Keys of nested tables, with dots between them, and what they are set to."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}", inner)
    elif isinstance(value, list | tuple):
        yield name, ", ".join(str(each) for each in value)
    elif isinstance(value, bool):
        yield name, "yes" if value else "no"
    else:
        yield name, str(value)


def _assumptions(results: Results) -> list[tuple[str, str]]:
    """What is assumed, and how it is meant."""
    case = results.case
    told = {str(run.dataset.attrs.get("fidelity", "")) for run in results.runs.values()}
    rung = ", ".join(sorted(told)) if told else case.discretisation.name
    large = case.discretisation.displacements == "large"
    rule = case.criteria
    sliding = "its own limit, μ + c A / N" if rule.friction is None else f"{rule.friction:g}"
    return [
        ("structure", "plane; forces are those of the whole width"),
        ("blocks", RUNGS.get(rung, f"by part: {rung}")),
        ("joints", "dry: no tension but where a bond is given; Coulomb friction; no crushing"),
        ("displacements", "of any size" if large else "small: equilibrium where blocks stood"),
        ("ground", "rigid, moves as one; abutments and foundations are fixed to it"),
        ("damping", _damping(case)),
        ("time steps", f"{type(case.scheme).__name__.lower()} scheme, {_step(case)}"),
        ("a joint hinges", f"where |e| ≥ {rule.hinge:g}"),
        ("a joint slides", f"where |V| / N reaches {sliding}"),
        (
            "a mechanism by count",
            f"{rule.failures} joints of rings and piers that hinge or slide at once, for "
            f"{rule.duration:g} s at least",
        ),
    ]


def _damping(case: Case) -> str:
    """Damping in words."""
    damping = case.damping
    if damping is None:
        return "none but that of friction"
    ratio = f"{100.0 * damping.ratio:g} % of critical"
    if isinstance(damping, EffectiveDamping):
        return f"{ratio} at the effective modes, {damping.kind}, joints {damping.joints}"
    if isinstance(damping, Rayleigh):
        low, high = damping.frequencies
        return f"{ratio} at {low:.3g} and {high:.3g} Hz (Rayleigh), joints {damping.joints}"
    return (
        f"{ratio} at {damping.frequency:.3g} Hz, proportional to stiffness, joints {damping.joints}"
    )


def _step(case: Case) -> str:
    """The time step in words."""
    dt = case.analysis.get("dt")
    return "steps of a length that the error chooses" if dt is None else f"steps of {1e3 * dt:g} ms"


def _geometry(case: Case) -> list[Any]:
    """Figure with the joints' names, parts, materials, contacts."""
    structure = case.structure
    figure = Plate.of(
        draw_names(structure), "The structure, and the numbers of the joints that are judged."
    )
    points = np.concatenate([block.drawn() for block in structure.blocks])
    wide, high = np.ptp(points, axis=0)
    extent = (
        f"{wide:.3g} m long, {high:.3g} m high and {structure.width:g} m wide; "
        f"{len(structure.free)} blocks that can move, weighing {structure.weight / kN:.4g} kN, and "
        f"{len(structure.joints)} joints. Gravity is {structure.gravity:g} m/s²."
    )
    return [Words(extent), figure, _parts(structure), *_materials(structure)]


def _parts(structure: Structure) -> Grid:
    """A row for each part."""
    rows = []
    for part in dict.fromkeys(block.part for block in structure.blocks):
        own = [block for block in structure.blocks if block.part == part]
        free = [block for block in own if not block.fixed]
        depths = [joint.depth for joint in structure.joints if joint.part == part]
        weight = structure.width * sum(block.area * block.material.unit_weight for block in free)
        rows.append(
            [
                part or "–",
                own[0].role or "–",
                str(len(own)),
                str(len(own) - len(free)),
                ", ".join(dict.fromkeys(block.material.name for block in own)),
                f"{weight / kN:.4g}",
                f"{min(depths):.3g} – {max(depths):.3g}" if depths else "–",
            ]
        )
    head = ["part", "role", "blocks", "of them fixed", "material", "weight [kN]", "joints [m]"]
    return Grid(head, rows, "Parts; the last column is the depth of their joints")


def _materials(structure: Structure) -> list[Grid]:
    """Tables of what blocks and joints are made of."""
    stuffs: dict[Material, None] = dict.fromkeys(block.material for block in structure.blocks)
    touches: dict[Contact, None] = dict.fromkeys(joint.contact for joint in structure.joints)
    materials = [
        [
            each.name,
            f"{each.young / MPa:.6g}",
            f"{each.poisson:g}",
            f"{each.unit_weight / kN:g}",
            "not known" if each.strength is None else f"{each.strength / MPa:g}",
        ]
        for each in stuffs
    ]
    contacts = [
        [
            each.name,
            f"{each.normal_stiffness / 1e9:.3g}",
            f"{each.shear_stiffness / 1e9:.3g}",
            f"{each.coefficient:g}" if each.slides else "never slides",
            f"{each.cohesion / 1e3:g}",
            f"{each.tension / 1e3:g}",
            f"{each.dilatancy:g}",
        ]
        for each in touches
    ]
    of_blocks = ["material", "E [MPa]", "ν [–]", "weight [kN/m³]", "strength [MPa]"]
    of_joints = ["contact", "normal [MPa/mm]", "shear [MPa/mm]", "μ [–]", "c [kPa]"]
    of_joints += ["tension [kPa]", "dilatancy [–]"]
    return [Grid(of_blocks, materials, "Blocks"), Grid(of_joints, contacts, "Joints")]
