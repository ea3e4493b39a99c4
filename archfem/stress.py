"""Stress in the blocks: principal stresses from a model's field, edge stress from resultants alone.

Blocks are linear elastic in plane stress. A cell's mean stress is that at its centre, where it is
most accurate; compression peaks at the blocks' faces. Peaks are therefore taken from stress
recovered at the cells' corners, by a linear fit to the cells around each corner within its block:
in a ring with 4 × 4 cells a stone under dead load, centres miss 14 % of the peak and corners 4 %.
Reduced models recover the structure's peak to 4 %, that of a single block to 13 %. Tension at the
corners of stones converges more slowly. Reference: Zienkiewicz and Zhu, Int. J. Numer. Methods
Eng. 33 (1992) 1331-1364.

Stress in time histories is elastic: it is without the blocks' viscous part. Resultants, and so
the edge stress from them, hold that of the joints where damping is "closed".
"""

import numpy as np
import xarray as xr
from scipy import sparse

from archfem.errors import InvalidInput
from archfem.history import History
from archfem.models import Model
from archfem.models.shape import Shape
from archfem.structure import Array, Structure
from archfem.summary import aligned
from archfem.units import MPa

PATCH = 4
"""Least number of cells to which stress at a corner is fitted: one more than a plane has."""


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
    shape, structure = model.shape, model.structure
    across, up, shear = cell_stress(model, q).T
    largest, least = principal_values(across, up, shear)
    centre = np.array([shape.places[cell].mean(axis=0) for cell in shape.cells])
    blocks = [structure.blocks[number] for number in shape.owner]
    return xr.Dataset(
        {
            "s1": ("cell", largest, {"units": "Pa", "long_name": "larger principal stress"}),
            "s2": ("cell", least, {"units": "Pa", "long_name": "smaller principal stress"}),
            "angle": ("cell", 0.5 * np.arctan2(2.0 * shear, across - up), {"units": "rad"}),
        },
        {
            "block": ("cell", shape.owner),
            "name": ("cell", [block.name for block in blocks]),
            "part": ("cell", [block.part for block in blocks]),
            "x": ("cell", centre[:, 0], {"units": "m"}),
            "y": ("cell", centre[:, 1], {"units": "m"}),
        },
    )


def cell_stress(model: Model, q: Array) -> Array:
    """Stress at the centres of all cells, σ_xx, σ_yy, σ_xy (cells, 3) [Pa].

    Args:
        model: any rung with a mesh.
        q: coordinates (n,).

    Raises:
        InvalidInput: the blocks are rigid, or q is not one vector of coordinates.
    """
    _check_state(model, q)
    return (_stress(model.shape) @ q).reshape(-1, 3)


def principal_values(across: Array, up: Array, shear: Array) -> tuple[Array, Array]:
    """Larger and smaller principal stress of plane stresses σ_xx, σ_yy, σ_xy, of any one shape."""
    middle, radius = 0.5 * (across + up), np.hypot(0.5 * (across - up), shear)
    return middle + radius, middle - radius


def at_corners(shape: Shape) -> sparse.csr_matrix:
    """Stress at the cells' corners, (σ_xx, σ_yy, σ_xy) in turn, from coordinates (3 m, n).

    Each value lies on the plane that fits the centres of the cells around the corner best; where
    these are too few, as at the faces of a block, their neighbours are taken in. No fit reaches
    across a joint. A linear stress field is recovered exactly.

    Args:
        shape: of a model with a mesh.

    Raises:
        InvalidInput: the blocks are rigid.
    """
    return (sparse.kron(_fit(shape), sparse.identity(3)) @ _stress(shape)).tocsr()


def strength_use(model: Model, q: Array) -> xr.Dataset:
    """Largest compression and tension in each block, and how much of its strength they use.

    Args:
        model: any rung with a mesh.
        q: coordinates (n,).

    Returns:
        Over block: compression and tension [Pa], both positive; strength [Pa], and use,
        compression over strength [-], NaN where the strength is not known.

    Raises:
        InvalidInput: the blocks are rigid, or q is not one vector of coordinates.
    """
    _check_state(model, q)
    return _use(model.structure, _peaks(model, q[None])[0])


def strength_use_over(model: Model, run: History) -> xr.Dataset:
    """Largest compression and tension in each block over a run, and how much strength they use.

    Only the instants whose fields were kept are looked at; `utilisation` covers all, from the
    resultants alone.

    Args:
        model: that was shaken, with a mesh.
        run: with fields.

    Returns:
        As by `strength_use`, and when they occur, `compression_time` and `tension_time` [s].

    Raises:
        InvalidInput: the blocks are rigid, or the run kept no fields, or those of another model.
    """
    if "q" not in run.dataset:
        raise InvalidInput(
            "the run kept no fields, so stress is not known: run it with "
            "record=Record(fields_every=10), or ask utilisation of the joints alone"
        )
    fields = run.dataset["q"].values
    _check_state(model, fields[0])
    peaks, times = _peaks(model, fields), run.dataset["frame_time"].values
    result = _use(model.structure, peaks.max(axis=0))
    for row, name in enumerate(("compression", "tension")):
        instant = times[peaks[:, row].argmax(axis=0)]
        result[f"{name}_time"] = ("block", instant, {"units": "s"})
    return result


def joint_stress(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Largest compression at the edge of each joint, from N and e alone, where nothing pulls.

    With traction linear along the joint, over its whole depth while the resultant stays in the
    middle third and over three times the distance to the nearer edge beyond it,

        σ = N / (w h) (1 + 6 |e|)   for |e| <= 1/6,   σ = 2 N / (3 w h (1/2 - |e|))   above.

    It grows without bound as |e| nears 0.5: a block that turns about a line. In an open joint
    it is zero.

    Args:
        structure: whose joints they are.
        joints: as made by `joint_dataset`, at one instant or over time.

    Returns:
        Over joint, or time and joint [Pa].

    References:
        Heyman, The masonry arch (1982).
    """
    normal, size = joints["N"], abs(joints["eccentricity"])
    mean = normal / (structure.width * joints["depth"])
    to_edge = (0.5 - size).clip(min=0.0)
    beyond = 2.0 * mean / (3.0 * to_edge)
    edge = xr.where(size <= 1.0 / 6.0, mean * (1.0 + 6.0 * size), beyond)
    edge = xr.where(normal > 0.0, edge, 0.0).transpose(*normal.dims)
    return edge.rename("stress").assign_attrs(units="Pa", long_name="largest edge compression")


def utilisation(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Share of the blocks' compressive strength that the edge of each joint uses.

    Needs no field, so it is there for each step of a time history on any rung, the rigid one too.

    Args:
        structure: whose joints they are.
        joints: as made by `joint_dataset`, at one instant or over time.

    Returns:
        `joint_stress` over the strength of the weaker of the two blocks, over joint, or time and
        joint [-]; NaN where neither has a known strength.
    """
    known = [
        [strength for k in joint.blocks if (strength := structure.blocks[k].material.strength)]
        for joint in structure.joints
    ]
    weaker = xr.DataArray([min(each, default=np.nan) for each in known], dims="joint")
    share = joint_stress(structure, joints) / weaker
    return share.rename("utilisation").assign_attrs(units="1")


def use_table(use: xr.Dataset) -> str:
    """One line a part: the largest compression and tension in its blocks, and where.

    Args:
        use: as made by `strength_use`.
    """
    head = ["part", "compression", "in", "of strength", "tension", "in"]
    rows = []
    for part in dict.fromkeys(use["part"].values):
        own = use.isel(block=np.flatnonzero(use["part"].values == part))
        hard, torn = _worst(own, "compression"), _worst(own, "tension")
        share = float(hard["use"])
        rows.append(
            [
                str(part) or "(no name)",
                f"{float(hard['compression']) / MPa:.3f} MPa",
                str(hard["name"].values),
                "-" if np.isnan(share) else f"{share:.2%}",
                f"{float(torn['tension']) / MPa:.3f} MPa",
                str(torn["name"].values),
            ]
        )
    return aligned(head, rows)


def use_sentence(use: xr.Dataset) -> str:
    """The largest compression and tension of all blocks, in words."""
    hard, torn = _worst(use, "compression"), _worst(use, "tension")
    share = float(hard["use"])
    strength = f"{float(hard['strength']) / MPa:.3g} MPa"
    of = "" if np.isnan(share) else f" ({share:.2%} of strength {strength})"
    return (
        f"largest compression {float(hard['compression']) / MPa:.3f} MPa in {_where(hard)}{of}, "
        f"largest tension {float(torn['tension']) / MPa:.3f} MPa in {_where(torn)}"
    )


def _worst(use: xr.Dataset, key: str) -> xr.Dataset:
    """The block with the largest of something."""
    return use.isel(block=int(np.argmax(use[key].values)))


def _where(block: xr.Dataset) -> str:
    """A block's name, which in a bridge begins with its part."""
    name, part = str(block["name"].values), str(block["part"].values)
    return name if not part or name.startswith(part) else f"{part}, {name}"


def _stress(shape: Shape) -> sparse.csr_matrix:
    """Mean stress of the cells, from coordinates."""
    if shape.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: build the model with fidelity='faces' or a higher rung, "
            "or take joint_stress, which needs only N and e"
        )
    return shape.stress


def _check_state(model: Model, q: Array) -> None:
    """There must be one coordinate each."""
    if np.shape(q) != (model.size,):
        raise InvalidInput(
            f"q has shape {np.shape(q)}, the model {model.size} coordinates: give one state of "
            "this model, e.g. dead.q or run.dataset['q'].values[-1]"
        )


def _peaks(model: Model, fields: Array) -> Array:
    """Largest compression and tension in each free block, never negative (frames, 2, blocks)."""
    shape, free = model.shape, model.structure.free
    operator = at_corners(shape)
    corners = np.unique(np.concatenate(shape.cells))
    owner = np.searchsorted(free, shape.block[corners])
    peaks = np.zeros((len(fields), 2, len(free)))
    for found, q in zip(peaks, fields, strict=True):
        largest, least = principal_values(*(operator @ q).reshape(-1, 3)[corners].T)
        np.maximum.at(found[0], owner, -least)
        np.maximum.at(found[1], owner, largest)
    return peaks


def _use(structure: Structure, peaks: Array) -> xr.Dataset:
    """Label the largest compression and tension of the free blocks (2, blocks)."""
    blocks = [structure.blocks[number] for number in structure.free]
    strength = np.array([block.material.strength or np.nan for block in blocks])
    pascal = {"units": "Pa"}
    return xr.Dataset(
        {
            "compression": ("block", peaks[0], pascal),
            "tension": ("block", peaks[1], pascal),
            "strength": ("block", strength, pascal),
            "use": ("block", peaks[0] / strength, {"units": "1"}),
        },
        {
            "block": list(structure.free),
            "name": ("block", [block.name for block in blocks]),
            "part": ("block", [block.part for block in blocks]),
        },
    )


def _fit(shape: Shape) -> sparse.csr_matrix:
    """Values at the cells' corners of planes fitted to values at their centres (m, cells)."""
    sizes = [len(cell) for cell in shape.cells]
    entries = (np.concatenate(shape.cells), np.repeat(np.arange(len(sizes)), sizes))
    touching = sparse.csr_matrix(
        (np.ones(sum(sizes)), entries), (len(shape.places), len(shape.cells))
    )
    few = sparse.diags((np.diff(touching.indptr) < PATCH).astype(float))
    row, column = (touching + few @ touching @ (touching.T @ touching)).nonzero()
    count = np.bincount(row, minlength=len(shape.places))[:, None].clip(1)
    centre = np.array([shape.places[cell].mean(axis=0) for cell in shape.cells])
    middle = np.stack([np.bincount(row, c[column], len(shape.places)) for c in centre.T], 1) / count
    arm = centre[column] - middle[row]
    moments = np.zeros((len(shape.places), 2, 2))
    np.add.at(moments, row, arm[:, :, None] * arm[:, None, :])
    slope = np.linalg.pinv(moments, rcond=1e-6, hermitian=True)
    reach = shape.places - middle
    share = 1.0 / count[row, 0] + np.einsum("pi,pij,pj->p", reach[row], slope[row], arm)
    return sparse.csr_matrix((share, (row, column)), touching.shape)
