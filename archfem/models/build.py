"""From a structure to a model on the rung that was asked for."""

import logging
from collections.abc import Mapping, Sequence

from archfem.arguments import whole
from archfem.errors import InvalidInput
from archfem.models import Model
from archfem.models.reduce import modal, reduced
from archfem.models.rigid import rigid
from archfem.quadrature import Quadrature
from archfem.soft import soft_blocks, softness
from archfem.structure import Structure

logger = logging.getLogger("archfem")

FIDELITIES = ("rigid", "modal", "faces", "condensed", "full", "monolithic")
"""The ladder, the cheapest rung first."""

MODAL_LIMIT = 25.0
"""Frequency up to which "modal" keeps modes [Hz]."""


def build(
    structure: Structure,
    *,
    fidelity: str | Mapping[str, str] = "full",
    cells: tuple[int, int] = (4, 4),
    cell: str = "quadrilateral",
    coarse: float | None = None,
    degree: int = 1,
    quadrature: str = "lobatto",
    points: int | None = None,
) -> Model:
    """Build a model of a structure.

    Args:
        structure: what stands.
        fidelity: a rung of the ladder:
            "rigid": rigid blocks, no mesh; all compliance is in the joints;
            "modal": vibration shapes of the closed structure up to 25 Hz and static rest at the
            joints; "faces": each joint face moves as a plane, the rest statically condensed;
            "condensed": all nodes on joints, the rest statically condensed; "full": all nodes;
            "monolithic": all nodes, UFL forms assembled at each iteration.
            Or rungs by block name or part, with "rest" for all others, for example
            {"backfill": "full", "rest": "faces"}.
        cells: through the thickness (facets on a joint) and along each block, at least.
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners, such as backfill [m]; where it is not
            given, half of the block's mean thickness.
        degree: of the elements, 1 or 2.
        quadrature: rule on each joint facet, "lobatto", "nodal", "gauss" or "exact".
        points: on each facet, 3 where not given.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be cut as asked.
    """
    rule = Quadrature(quadrature, points)
    if not hasattr(cells, "__len__") or len(cells) != 2:
        raise InvalidInput(f"cells {cells!r}: give two numbers, through the thickness and along")
    for count in cells:
        whole(count, f"a number of cells {cells!r}")
    if isinstance(fidelity, str) and fidelity not in FIDELITIES:
        raise InvalidInput(f"fidelity '{fidelity}' is not known: use one of {FIDELITIES}")
    if rule.rule == "exact" and (degree != 1 or fidelity == "monolithic"):
        raise InvalidInput(
            "exact quadrature needs openings that are linear along a facet, and is not written in "
            "UFL: use degree 1 and a rung other than monolithic"
        )
    rungs = _rungs(structure, fidelity)
    _doubt(structure, rungs)
    if fidelity == "rigid":
        return rigid(structure, cells[0], rule)
    from archfem.mesh import Meshing, mesh  # FEniCSx is needed from here on only
    from archfem.models.full import full
    from archfem.models.monolithic import Monolithic
    from archfem.space import broken_space

    space = broken_space(mesh(structure, Meshing(*cells, cell, coarse)), degree)
    if fidelity == "monolithic":
        return Monolithic(space, rule)
    model = full(space, rule)
    if fidelity == "modal":
        return modal(model, MODAL_LIMIT)
    return model if fidelity == "full" else reduced(model, rungs, _name(fidelity))


def _rungs(structure: Structure, fidelity: str | Mapping[str, str]) -> list[str]:
    """Rung of each block."""
    if isinstance(fidelity, str):
        return [fidelity] * len(structure.blocks)
    known = {block.name for block in structure.blocks} | {block.part for block in structure.blocks}
    unknown = sorted(set(fidelity) - known - {"rest"})
    if unknown:
        raise InvalidInput(
            f"fidelity names {unknown}, which are no blocks or parts: {sorted(known)}"
        )
    rest = fidelity.get("rest", "full")
    return [fidelity.get(b.name, fidelity.get(b.part, rest)) for b in structure.blocks]


def _doubt(structure: Structure, rungs: Sequence[str]) -> None:
    """Say where a rung is too low for a block."""
    for number in soft_blocks(structure):
        if rungs[number] in ("rigid", "faces", "condensed"):
            found = softness(structure, number)
            logger.warning(
                "block '%s' is soft: its own modes begin near %.0f Hz, in the seismic band, and it "
                "is %.2g times as stiff as its joints; '%s' is wrong for it, use 'full'",
                structure.blocks[number].name,
                found.inner,
                found.ratio,
                rungs[number],
            )


def _name(fidelity: str | Mapping[str, str]) -> str:
    if isinstance(fidelity, str):
        return fidelity
    return ", ".join(f"{key}: {rung}" for key, rung in fidelity.items())
