"""One state of a model as a file: DXF, VTU, or whatever meshio writes."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.survey.plotted import write_dxf
from archfem.models.exchange.solids import Solids
from archfem.models.exchange.vtu import write_vtu
from archfem.models.model import Model


def write_state(model: Model, q: Array, path: str | Path, *, magnification: float = 1.0) -> Path:
    """Write where the blocks are, for programs that draw or mesh.

    As *.dxf: the outlines of all blocks where they have moved, each on the layer of its part, over
    those as built, and the joints as built. As *.vtu, or any format of meshio that has data (*.vtk,
    *.xdmf, *.e …): the cells as built, with displacements [m] at their points, and in each the
    number of its block and stresses [Pa]. Blocks share no points, so that openings stay.

    Args:
        model: what stands.
        q: coordinates (n,), e.g. `dead.q`.
        path: of the file; its end tells the format.
        magnification: of displacements in a drawing [-].

    Returns:
        The file.

    Raises:
        InvalidInput: q is another model's, meshio is not installed or does not know the format.
    """
    path, solids = Path(path), Solids(model)
    moved = solids.displacement(np.asarray(q, dtype=float))
    if path.suffix == ".dxf":
        return _drawn(solids, moved, path, magnification)
    data: dict[str, NDArray[Any]] = {"block": solids.owner.astype(np.int64)}
    stress = solids.stress(q)
    if stress is not None:
        names = ("stress_xx", "stress_yy", "stress_xy")
        data |= dict(zip(names, stress.T, strict=True))
    if path.suffix == ".vtu":
        write_vtu(path, solids.places, solids.polygons, {"displacement": moved}, data)
        return path
    return _by_meshio(solids, moved, data, path)


def _drawn(solids: Solids, moved: Array, path: Path, magnification: float) -> Path:
    """A drawing of the blocks as built and where they are."""
    structure = solids.model.structure
    places = solids.places + magnification * moved
    outlines: dict[str, list[tuple[str, Array]]] = {}
    for number, block in enumerate(structure.blocks):
        loop = _rim([cell for cell in solids.polygons if solids.block[cell[0]] == number])
        outlines.setdefault(block.part or "blocks", []).append((block.name, places[loop]))
    built = [(block.name, np.vstack([each, each[:1]])) for block in structure.blocks
             for each in [block.drawn()]]  # fmt: skip
    joints = [(joint.name, joint.ends) for joint in structure.joints]
    return write_dxf(path, outlines, {"as built": built, "joints": joints})


def _rim(cells: list[NDArray[np.intp]]) -> list[int]:
    """The points around a block, in order: edges of one cell only, one after another."""
    edges = {
        (int(a), int(b)) for cell in cells for a, b in zip(cell, np.roll(cell, -1), strict=True)
    }
    after = {a: b for a, b in edges if (b, a) not in edges}
    loop = [min(after)]
    while (following := after[loop[-1]]) != loop[0]:
        loop.append(following)
    return loop


def _by_meshio(solids: Solids, moved: Array, data: dict[str, NDArray[Any]], path: Path) -> Path:
    """A file in one of meshio's formats."""
    try:
        import meshio
    except ImportError as error:
        raise InvalidInput(
            f"{path.suffix} is written with meshio, which is not installed: pip install "
            "'archfem[exchange]', or write .dxf or .vtu"
        ) from error
    kinds: dict[str, list[int]] = {}
    for number, polygon in enumerate(solids.polygons):
        kind = {3: "triangle", 4: "quad"}.get(len(polygon), f"polygon{len(polygon)}")
        kinds.setdefault(kind, []).append(number)
    cells = [(kind, np.array([solids.polygons[k] for k in own])) for kind, own in kinds.items()]
    given = {name: [values[own] for own in kinds.values()] for name, values in data.items()}
    space = [np.column_stack([each, np.zeros(len(each))]) for each in (solids.places, moved)]
    mesh = meshio.Mesh(space[0], cells, {"displacement": space[1]}, given)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        mesh.write(path)
    except Exception as error:  # meshio and its formats raise all sorts
        raise InvalidInput(
            f"meshio does not write this model as {path}: {error}; try .vtu or .vtk"
        ) from error
    return path
