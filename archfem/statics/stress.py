"""Principal stresses in the blocks, and the use of their strength.

Blocks are linear elastic in plane stress. A cell's mean stress is that at its centre, where it is
most accurate; compression peaks at the blocks' faces. Peaks are therefore taken from stress
recovered at the cells' corners, by a linear fit to the cells around each corner within its block:
in a ring with 4 × 4 cells a stone under dead load, centres miss 14 % of the peak and corners 4 %.
Reduced models recover the structure's peak to 4 %, that of a single block to 13 %. Tension at the
corners of stones converges more slowly. Reference: Zienkiewicz and Zhu, Int. J. Numer. Methods
Eng. 33 (1992) 1331-1364.

The use of strength follows from the stress in the blocks, or from N and e of the joints alone. In
time histories stress is elastic, without the blocks' viscous part. Resultants, and so the edge
stress from them, include that of the joints where damping is "closed".
"""

from collections.abc import Callable

import numpy as np
import xarray as xr
from scipy import sparse

from archfem._files import align_columns
from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.materials import STONE
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.model import Cells, Model
from archfem.units import MPa


def cell_stress(model: Model, q: Array) -> Array:
    """Return the stress at the centres of all cells, σ_xx, σ_yy, σ_xy (cells, 3) [Pa]."""
    check_state(model, q)
    return (_cell_stress_operator(model.cells) @ q).reshape(-1, 3)


@validate_arguments
def principal_stresses(model: Model, q: Array) -> xr.Dataset:
    """Compute the principal stresses at the centres of all cells.

    Args:
        model: model of any fidelity with a mesh.
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
    centre = _cell_centres(cells)
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
    """Return the larger and the smaller principal stress, each of the arguments' shape [Pa]."""
    middle, radius = 0.5 * (across + up), np.hypot(0.5 * (across - up), shear)
    return middle + radius, middle - radius


@validate_arguments
def strength_use(model: Model, q: Array) -> xr.Dataset:
    """Compute the largest compression and tension in each block, and the use of its strength.

    Args:
        model: model of any fidelity with a mesh.
        q: coordinates (n,).

    Returns:
        Over block: compression and tension [Pa], both positive; strength [Pa], and use,
        compression over strength [-], NaN where the block has no strength. All are NaN in rigid
        blocks beside meshed ones.

    Raises:
        InvalidInput: the blocks are rigid, or q is not one vector of coordinates.
    """
    check_state(model, q)
    return _label_use(model.structure, _peak_stresses(model, q[None])[0])


@validate_arguments
def strength_use_over(model: Model, run: xr.Dataset) -> xr.Dataset:
    """Compute the largest compression and tension in each block over a run, and their use.

    Only instants with recorded fields count; `utilisation` covers all, from the resultants alone.

    Args:
        model: model of the run, with a mesh.
        run: the `dataset` of a history, with fields.

    Returns:
        As by `strength_use`, with the instants of both, `compression_time` and `tension_time` [s].

    Raises:
        InvalidInput: the blocks are rigid, or the run has no fields, or those of another model.
    """
    if "q" not in run:
        raise InvalidInput(
            "the run kept no fields, so stress is not known: run it with "
            "record=Record(fields_every=10), or ask utilisation of the joints alone"
        )
    fields = run["q"].values
    check_state(model, fields[0])
    peaks, times = _peak_stresses(model, fields), run["frame_time"].values
    result = _label_use(model.structure, peaks.max(axis=0))
    for row, name in enumerate(("compression", "tension")):
        instant = times[peaks[:, row].argmax(axis=0)]
        result[f"{name}_time"] = ("block", instant, {"units": "s"})
    return result


@validate_arguments
def joint_stress(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Compute the largest compression at the edge of each joint, from N and e, without tension.

    The traction is linear along the joint. It acts over the whole depth while the resultant stays
    in the middle third. Beyond it, it acts over three times the distance to the nearer edge:

        σ = N / (w h) (1 + 6 |e|)   for |e| <= 1/6,   σ = 2 N / (3 w h (1/2 - |e|))   above.

    In a ring it lies some per cent above the peak of a converged field, 5 % at |e| = 0.4. A field
    on 4 × 4 cells a stone is 20 % below there. It grows without bound as |e| nears 0.5: a block
    that turns about a line. In an open joint it is zero.

    Args:
        structure: structure of the joints.
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
    edge: xr.DataArray = (mean * (1.0 + 6.0 * size)).where(size <= 1.0 / 6.0, beyond)
    edge = edge.where(normal > 0.0, 0.0).transpose(*normal.dims)
    return edge.rename("stress").assign_attrs(units="Pa", long_name="largest edge compression")


@validate_arguments
def utilisation(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Compute the share of the blocks' compressive strength used at the edge of each joint.

    It needs no field, so it covers each step of a time history with any model, also a rigid one.

    Args:
        structure: structure of the joints.
        joints: as made by `joint_dataset`, at one instant or over time.

    Returns:
        `joint_stress` over the strength of the weaker of the two blocks, over joint, or time and
        joint [-]; NaN where neither has a strength.
    """
    strength = np.array([block.material.strength or np.nan for block in structure.blocks])
    weaker = xr.DataArray(np.fmin(*strength[structure.pairs].T), dims="joint")
    share = joint_stress(structure, joints) / weaker
    return share.rename("utilisation").assign_attrs(units="1")


@validate_arguments
def strength_use_table(use: xr.Dataset) -> str:
    """Return a line for each part: largest compression and tension in its blocks, and their blocks.

    Args:
        use: as made by `strength_use`.
    """
    head = ["part", "compression", "in", "of strength", "tension", "in"]
    rows = []
    for part in dict.fromkeys(use["part"].values):
        in_part = use.isel(block=np.flatnonzero(use["part"].values == part))
        if in_part["compression"].isnull().all():
            rows.append([str(part) or "(no name)", "not computed (rigid)", *["-"] * 4])
            continue
        pressed, pulled = _largest(in_part, "compression"), _largest(in_part, "tension")
        share = _say_share(float(pressed["use"]), float(pressed["strength"])).partition(" ")[0]
        row = [str(part) or "(no name)", _in_mpa(pressed["compression"])]
        row += [str(pressed["name"].values), share or "-"]
        rows.append([*row, _in_mpa(pulled["tension"]), str(pulled["name"].values)])
    return align_columns(head, rows)


def strength_use_text(use: xr.Dataset) -> str:
    """Return the largest compression and tension of all blocks as text."""
    pressed, pulled = _largest(use, "compression"), _largest(use, "tension")
    share = _say_share(float(pressed["use"]), float(pressed["strength"]))
    of = f" ({share})" * bool(share)
    return (
        f"largest compression {_in_mpa(pressed['compression'])} in {_block_label(pressed)}{of}, "
        f"largest tension {_in_mpa(pulled['tension'])} in {_block_label(pulled)}"
    )


def _say_share(share: float, strength: float) -> str:
    """Return a share of a strength [Pa] as text; "" without one, and of that of the preset."""
    given = strength > 0.0 and not np.isclose(strength, STONE.strength or 0.0)
    return f"{share:.2%} of the stones' strength, {strength / MPa:.3g} MPa" * bool(given)


def _in_mpa(stress: xr.DataArray) -> str:
    """Return a stress as text."""
    return f"{float(stress) / MPa:.3f} MPa"


def utilisation_text(structure: Structure, joints: xr.Dataset) -> str:
    """Return the largest use of strength over a run as text, without joints that hinge."""
    largest, found = -np.inf, None
    steps = 8192  # at a time: a long record has no room for more of its size
    for start in range(0, joints.sizes["time"], steps):
        some = joints.isel(time=slice(start, start + steps))
        # A hinge rests on a strip whose width does not follow from N and e.
        use = utilisation(structure, some).where((some["hinge"] == 0) & ~some["open"])
        if use.notnull().any() and float(use.max()) > largest:
            step, number = np.unravel_index(np.nanargmax(use.values), use.shape)
            largest, found = float(use[step, number]), some.isel(time=step, joint=number)
            stress = float(joint_stress(structure, some)[step, number])
    if found is None:
        return "no use of strength is known: all joints hinge or are open, or no strength is given"
    unknown = "; at hinges it is not computed" * bool((joints["hinge"] != 0).any())
    share = _say_share(largest, stress / largest) if largest > 0.0 else ""
    return (
        "largest compression at the edge of a joint that does not hinge: "
        f"{stress / MPa:.3f} MPa{f', {share}' * bool(share)}, in "
        f"{found['name'].values} at {float(found['time']):.3f} s{unknown}"
    )


def check_state(model: Model, q: Array) -> None:
    """Refuse arrays that are not one vector of a model's coordinates."""
    if np.shape(q) != (model.size,):
        raise InvalidInput(
            f"q has shape {np.shape(q)}, the model {model.size} coordinates: give one state of "
            "this model, e.g. dead.q or run.dataset['q'].values[-1]"
        )


def corner_stress_operator(cells: Cells) -> sparse.csr_matrix:
    """Return the matrix from coordinates to corner stresses, σ_xx, σ_yy, σ_xy in turn (3 m, n)."""
    fit = sparse.kron(_fit_planes(cells), sparse.identity(3))
    return (fit @ _cell_stress_operator(cells)).tocsr()


def _cell_stress_operator(cells: Cells) -> sparse.csr_matrix:
    """Return the matrix from coordinates to the mean stresses of the cells."""
    if cells.stress is None:
        raise InvalidInput(
            "rigid blocks have no stress: build the model with fidelity='faces' or a higher one, "
            "or take joint_stress, which needs only N and e"
        )
    return cells.stress


def _cell_centres(cells: Cells) -> Array:
    """Return the centres of the cells (cells, 2) [m]."""
    return np.array([cells.places[cell].mean(axis=0) for cell in cells.polygons])


def _fit_planes(cells: Cells, min_cells: int = 4) -> sparse.csr_matrix:
    """Return values at cell corners of planes fitted to values at cell centres (m, cells)."""
    # Each plane is fitted to the cells around a corner, by least squares. Where these are too few,
    # as at the faces of a block, their neighbours are included; `min_cells` is one more than a
    # plane needs. No fit reaches across a joint. A linear stress field is recovered exactly.
    sizes, shape = [len(cell) for cell in cells.polygons], (len(cells.places), len(cells.polygons))
    entries = (np.concatenate(cells.polygons), np.repeat(np.arange(len(sizes)), sizes))
    touching = sparse.csr_matrix((np.ones(sum(sizes)), entries), shape)
    few = sparse.diags((np.diff(touching.indptr) < min_cells).astype(float))
    row, column = (touching + few @ touching @ (touching.T @ touching)).nonzero()
    # centroid of the centres around each corner, and second moments about it
    count = np.bincount(row, minlength=len(cells.places))[:, None].clip(1)
    centre = _cell_centres(cells)
    middle = np.stack([np.bincount(row, c[column], len(cells.places)) for c in centre.T], 1) / count
    arm = centre[column] - middle[row]
    moments = np.zeros((len(cells.places), 2, 2))
    np.add.at(moments, row, arm[:, :, None] * arm[:, None, :])
    # centres in one line have no slope across it: the pseudo-inverse leaves it zero
    slope = np.linalg.pinv(moments, rcond=1e-6, hermitian=True)
    reach = cells.places - middle
    share = 1.0 / count[row, 0] + np.einsum("pi,pij,pj->p", reach[row], slope[row], arm)
    return sparse.csr_matrix((share, (row, column)), touching.shape)


def _largest(use: xr.Dataset, key: str) -> xr.Dataset:
    """Return the block with the largest known value of a variable."""
    return use.isel(block=int(np.nanargmax(use[key].values)))


def _block_label(block: xr.Dataset) -> str:
    """Return a block's name, preceded by its part unless the name begins with it."""
    name, part = str(block["name"].values), str(block["part"].values)
    return name if not part or name.startswith(part) else f"{part}, {name}"


def _peak_stresses(model: Model, fields: Array) -> Array:
    """Return the largest compression and tension of free blocks, at least 0 (frames, 2, blocks).

    Stresses of rigid blocks beside meshed ones are NaN.
    """
    cells, free = model.cells, model.structure.free
    operator = corner_stress_operator(cells)
    corners = np.unique(np.concatenate(cells.polygons))
    owner = np.searchsorted(free, cells.block[corners])
    # but for round-off, rigid motions give no stress; others give about E over the size of a cell
    entries = np.asarray(abs(_cell_stress_operator(cells)).sum(axis=1)).reshape(-1, 3)
    young = np.array([block.material.young for block in model.structure.blocks])
    meshed = entries.max(axis=1) > 1e-6 * young[cells.owner]
    rigid = ~np.isin(free, cells.owner[meshed])
    peaks = np.zeros((len(fields), 2, len(free)))
    for (compression, tension), q in zip(peaks, fields, strict=True):
        largest, least = principal_values(*(operator @ q).reshape(-1, 3)[corners].T)
        np.maximum.at(compression, owner, -least)
        np.maximum.at(tension, owner, largest)
    peaks[:, :, rigid] = np.nan
    return peaks


def observe_fill_tension(model: Model) -> Callable[[Array], float] | None:
    """Return a function from coordinates to the largest tension in fill in one piece [Pa].

    None where there is no such fill, or where it is rigid or cut into pieces.
    """
    cells, blocks = model.cells, model.structure.blocks
    fill = [number for number in find_yielding_blocks(model.structure) if not blocks[number].grain]
    own = [cells.polygons[k] for k in np.flatnonzero(np.isin(cells.owner, fill))]
    if cells.stress is None or not own:
        return None
    rows = 3 * np.unique(np.concatenate(own))[:, None] + np.arange(3)
    operator = corner_stress_operator(cells)[rows.ravel()]
    return lambda q: float(principal_values(*(operator @ q).reshape(-1, 3).T)[0].max())


def _label_use(structure: Structure, peaks: Array) -> xr.Dataset:
    """Return the peak stresses of the free blocks (2, blocks) as a dataset."""
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
