"""Use of the blocks' strength: by the stress in them, or by N and e of the joints alone.

Stress in time histories is elastic: it is without the blocks' viscous part. Resultants, and so
the edge stress from them, hold that of the joints where damping is "closed".
"""

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure
from archfem.models.model import Model
from archfem.statics.stress import at_corners, check_state, principal_values
from archfem.tables import aligned
from archfem.units import MPa


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
    check_state(model, q)
    return _use(model.structure, _peaks(model, q[None])[0])


def strength_use_over(model: Model, run: xr.Dataset) -> xr.Dataset:
    """Largest compression and tension in each block over a run, and how much strength they use.

    Only the instants whose fields were kept are looked at; `utilisation` covers all, from the
    resultants alone.

    Args:
        model: that was shaken, with a mesh.
        run: the `dataset` of a history, with fields.

    Returns:
        As by `strength_use`, and when they occur, `compression_time` and `tension_time` [s].

    Raises:
        InvalidInput: the blocks are rigid, or the run kept no fields, or those of another model.
    """
    if "q" not in run:
        raise InvalidInput(
            "the run kept no fields, so stress is not known: run it with "
            "record=Record(fields_every=10), or ask utilisation of the joints alone"
        )
    fields = run["q"].values
    check_state(model, fields[0])
    peaks, times = _peaks(model, fields), run["frame_time"].values
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

    In a ring it lies some per cent above the peak of a converged field, 5 % at |e| = 0.4, where a
    field on 4 × 4 cells a stone is 20 % below. It grows without bound as |e| nears 0.5: a block
    that turns about a line. In an open joint it is zero.

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
    edge: xr.DataArray = (mean * (1.0 + 6.0 * size)).where(size <= 1.0 / 6.0, beyond)
    edge = edge.where(normal > 0.0, 0.0).transpose(*normal.dims)
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
    """Return a line for each part: the largest compression and tension in its blocks, and where.

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
    """Return the largest compression and tension of all blocks, in words.

    Args:
        use: as made by `strength_use`.
    """
    hard, torn = _worst(use, "compression"), _worst(use, "tension")
    share = float(hard["use"])
    strength = f"{float(hard['strength']) / MPa:.3g} MPa"
    of = "" if np.isnan(share) else f" ({share:.2%} of strength {strength})"
    return (
        f"largest compression {float(hard['compression']) / MPa:.3f} MPa in {_where(hard)}{of}, "
        f"largest tension {float(torn['tension']) / MPa:.3f} MPa in {_where(torn)}"
    )


def utilisation_sentence(structure: Structure, joints: xr.Dataset) -> str:
    """Return the largest use of strength over a run, in words.

    Joints that hinge just then are left out: a hinge rests on a strip whose width N and e do not
    tell.

    Args:
        structure: whose joints they are.
        joints: over time and joint, with their flags.
    """
    use = utilisation(structure, joints).where((joints["hinge"] == 0) & ~joints["open"])
    if not use.notnull().any():
        return "no use of strength is known: all joints hinge or are open, or no strength is given"
    step, number = np.unravel_index(np.nanargmax(use.values), use.shape)
    stress = float(joint_stress(structure, joints)[step, number]) / MPa
    return (
        f"largest compression at the edge of a joint that does not hinge: {stress:.3f} MPa, "
        f"{float(use[step, number]):.2%} of strength, in {joints['name'].values[number]} "
        f"at {float(joints['time'][step]):.3f} s"
    )


def _worst(use: xr.Dataset, key: str) -> xr.Dataset:
    """The block with the largest of something."""
    return use.isel(block=int(np.argmax(use[key].values)))


def _where(block: xr.Dataset) -> str:
    """A block's name, which in a bridge begins with its part."""
    name, part = str(block["name"].values), str(block["part"].values)
    return name if not part or name.startswith(part) else f"{part}, {name}"


def _peaks(model: Model, fields: Array) -> Array:
    """Largest compression and tension in each free block, never negative (frames, 2, blocks)."""
    cells, free = model.cells, model.structure.free
    operator = at_corners(cells)
    corners = np.unique(np.concatenate(cells.polygons))
    owner = np.searchsorted(free, cells.block[corners])
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
