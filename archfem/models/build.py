"""From a structure to a model on the rung that was asked for."""

from archfem.errors import InvalidInput
from archfem.models import Model
from archfem.models.rigid import rigid
from archfem.quadrature import Quadrature
from archfem.structure import Structure

FIDELITIES = ("rigid", "full")


def build(
    structure: Structure,
    *,
    fidelity: str = "full",
    cells: tuple[int, int] = (4, 4),
    cell: str = "quadrilateral",
    degree: int = 1,
    quadrature: str = "lobatto",
    points: int | None = None,
) -> Model:
    """Build a model of a structure.

    Args:
        structure: what stands.
        fidelity: "full" (elastic blocks, all nodes) or "rigid" (rigid blocks, no mesh).
        cells: through the thickness (facets on a joint) and along each block.
        cell: "quadrilateral" or "triangle".
        degree: of the elements, 1 or 2.
        quadrature: rule on each joint facet, "lobatto", "nodal" or "gauss".
        points: on each facet, 3 where not given.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be cut as asked.
    """
    rule = Quadrature(quadrature, points)
    if fidelity not in FIDELITIES:
        raise InvalidInput(f"fidelity '{fidelity}' is not known: use one of {FIDELITIES}")
    if len(tuple(cells)) != 2:
        raise InvalidInput(f"cells {cells!r}: give two numbers, through the thickness and along")
    if fidelity == "rigid":
        return rigid(structure, cells[0], rule)
    from archfem.mesh import Meshing, mesh  # FEniCSx is needed from here on only
    from archfem.models.full import full
    from archfem.space import broken_space

    return full(broken_space(mesh(structure, Meshing(*cells, cell)), degree), rule)
