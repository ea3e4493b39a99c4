"""Principal stresses in the blocks, from a model's coordinates.

Blocks are linear elastic in plane stress. A cell's mean stress is that at its centre, where it is
most accurate; compression peaks at the blocks' faces. Peaks are therefore taken from stress
recovered at the cells' corners, by a linear fit to the cells around each corner within its block:
in a ring with 4 × 4 cells a stone under dead load, centres miss 14 % of the peak and corners 4 %.
Reduced models recover the structure's peak to 4 %, that of a single block to 13 %. Tension at the
corners of stones converges more slowly. Reference: Zienkiewicz and Zhu, Int. J. Numer. Methods
Eng. 33 (1992) 1331-1364.
"""

import numpy as np
import xarray as xr
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.models.cells import Cells
from archfem.models.model import Model

PATCH = 4
"""Least number of cells to which stress at a corner is fitted: one more than a plane has."""


def cell_stress(model: Model, q: Array) -> Array:
    """Return the stress at the centres of all cells, σ_xx, σ_yy, σ_xy (cells, 3) [Pa].

    Args:
        model: any rung with a mesh.
        q: coordinates (n,).

    Raises:
        InvalidInput: the blocks are rigid, or q is not one vector of coordinates.
    """
    check_state(model, q)
    stress: Array = _stress(model.cells) @ q
    return stress.reshape(-1, 3)


def principal(model: Model, q: Array) -> xr.Dataset:
    """Principal stresses at the centres of all cells.

    Args:
        model: any rung with a mesh.
        q: coordinates (n,).

    Returns:
        Over cell: s1 >= s2 [Pa], tension positive; angle of s1's direction from the x axis,
        anticlockwise, between -π/2 and π/2 [rad]. Coordinates: number, name and part of the
        block, and the cell's centre x, y [m].

    Raises:
        InvalidInput: the blocks are rigid, or q is not one vector of coordinates.
    """
    cells, structure = model.cells, model.structure
    across, up, shear = cell_stress(model, q).T
    largest, least = principal_values(across, up, shear)
    centre = np.array([cells.places[cell].mean(axis=0) for cell in cells.polygons])
    blocks = [structure.blocks[number] for number in cells.owner]
    return xr.Dataset(
        {
            "s1": ("cell", largest, {"units": "Pa", "long_name": "larger principal stress"}),
            "s2": ("cell", least, {"units": "Pa", "long_name": "smaller principal stress"}),
            "angle": ("cell", 0.5 * np.arctan2(2.0 * shear, across - up), {"units": "rad"}),
        },
        {
            "block": ("cell", cells.owner),
            "name": ("cell", [block.name for block in blocks]),
            "part": ("cell", [block.part for block in blocks]),
            "x": ("cell", centre[:, 0], {"units": "m"}),
            "y": ("cell", centre[:, 1], {"units": "m"}),
        },
    )


def principal_values(across: Array, up: Array, shear: Array) -> tuple[Array, Array]:
    """Return the larger and the smaller principal stress, each of the arguments' shape [Pa].

    Args:
        across: σ_xx, of any shape [Pa].
        up: σ_yy, of the same [Pa].
        shear: σ_xy, of the same [Pa].
    """
    middle, radius = 0.5 * (across + up), np.hypot(0.5 * (across - up), shear)
    return middle + radius, middle - radius


def at_corners(cells: Cells) -> sparse.csr_matrix:
    """Return stress at the cells' corners, (σ_xx, σ_yy, σ_xy) in turn, from coordinates (3 m, n).

    Each value lies on the plane that fits the centres of the cells around the corner best; where
    these are too few, as at the faces of a block, their neighbours are taken in. No fit reaches
    across a joint. A linear stress field is recovered exactly.

    Args:
        cells: of a model with a mesh.

    Raises:
        InvalidInput: the blocks are rigid.
    """
    return (sparse.kron(_fit(cells), sparse.identity(3)) @ _stress(cells)).tocsr()


def _stress(cells: Cells) -> sparse.csr_matrix:
    """Mean stress of the cells, from coordinates."""
    if cells.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: build the model with fidelity='faces' or a higher rung, "
            "or take joint_stress, which needs only N and e"
        )
    return cells.stress


def check_state(model: Model, q: Array) -> None:
    """Refuse what is not one vector of a model's coordinates.

    Args:
        model: whose coordinates they should be.
        q: what was given for them.

    Raises:
        InvalidInput: q has another shape.
    """
    if np.shape(q) != (model.size,):
        raise InvalidInput(
            f"q has shape {np.shape(q)}, the model {model.size} coordinates: give one state of "
            "this model, e.g. dead.q or run.dataset['q'].values[-1]"
        )


def _fit(cells: Cells) -> sparse.csr_matrix:
    """Values at the cells' corners of planes fitted to values at their centres (m, cells)."""
    sizes = [len(cell) for cell in cells.polygons]
    entries = (np.concatenate(cells.polygons), np.repeat(np.arange(len(sizes)), sizes))
    touching = sparse.csr_matrix(
        (np.ones(sum(sizes)), entries), (len(cells.places), len(cells.polygons))
    )
    few = sparse.diags((np.diff(touching.indptr) < PATCH).astype(float))
    row, column = (touching + few @ touching @ (touching.T @ touching)).nonzero()
    count = np.bincount(row, minlength=len(cells.places))[:, None].clip(1)
    centre = np.array([cells.places[cell].mean(axis=0) for cell in cells.polygons])
    middle = np.stack([np.bincount(row, c[column], len(cells.places)) for c in centre.T], 1) / count
    arm = centre[column] - middle[row]
    moments = np.zeros((len(cells.places), 2, 2))
    np.add.at(moments, row, arm[:, :, None] * arm[:, None, :])
    slope = np.linalg.pinv(moments, rcond=1e-6, hermitian=True)
    reach = cells.places - middle
    share = 1.0 / count[row, 0] + np.einsum("pi,pij,pj->p", reach[row], slope[row], arm)
    return sparse.csr_matrix((share, (row, column)), touching.shape)
