"""Joint resultants and what follows from them: eccentricity, mobilised friction, thrust line.

Signs: N > 0 is compression; M and eccentricity are positive toward the extrados; V is positive
where the higher block is pushed toward the extrados by its slip.
"""

import numpy as np
import xarray as xr

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.criteria import BONDED, Criteria, borne, flags, ratio_at_sliding
from archfem.joints.faces import MEASURES, measures
from archfem.masonry.naming import number_of
from archfem.masonry.structure import Structure

UNITS = {
    "N": ("N", "normal force, compression positive"),
    "V": ("N", "shear force"),
    "M": ("N m", "moment about mid-depth, positive toward the extrados"),
    "eccentricity": ("1", "M / (N h), +0.5 at the extrados; undefined in an open joint"),
    "friction": ("1", "mobilised friction |V| / N; undefined in an open joint"),
}


def ratios(resultants: Array, depth: Array) -> tuple[Array, Array]:
    """Return eccentricity and mobilised friction of joints; undefined (NaN) where they are open.

    Args:
        resultants: N, V, M for the whole width (…, n_joints, 3) [N, N, N m].
        depth: of the joints (n_joints,) [m].

    Returns:
        M / (N h) and |V| / N (…, n_joints) [-].
    """
    normal, shear, moment = np.moveaxis(resultants, -1, 0)
    pressed = np.where(normal * depth > 0.0, normal, np.nan)  # the least of numbers, halved, is 0
    return moment / (pressed * depth), np.abs(shear) / pressed


def joint_dataset(
    structure: Structure,
    resultants: Array,
    time: Array | None = None,
    criteria: Criteria | None = None,
    *,
    faces: Array | None = None,
    moved: bool = False,
) -> xr.Dataset:
    """Return labelled resultants, with eccentricity, mobilised friction and flags of failure.

    Eccentricity is e = M / (N h), from mid-depth, as a fraction of the joint's depth h. A joint
    without compression is open, unless a bond holds it: its eccentricity and friction are
    undefined (NaN). Opening,
    rotation and slip follow from displacements alone: `opening` is the largest gap between the
    faces, at the end that is more open (0 where they touch all over), `rotation` the turn of the
    higher face relative to the lower one, positive where it opens the intrados, `slip` the mean
    displacement of the higher block along the joint, positive toward the extrados.

    Args:
        structure: whose joints they are.
        resultants: N, V, M for the whole width, (n_joints, 3) or (steps, n_joints, 3)
            [N, N, N m].
        time: of the steps (steps,) [s], for the second shape.
        criteria: by which joints fail; by default the usual ones.
        faces: gaps at mid-depth, rotations and slips, as by `face_matrix`, (3, n_joints) or
            (steps, 3, n_joints) [m, rad, m]; None where displacements are not known.
        moved: whether the faces may have moved far: eccentricity is then from the middle of what
            still lies over the other face, as a fraction of its length h - |slip|.

    Returns:
        Variables N, V, M, eccentricity and friction, `opening`, `rotation` and `slip` where they
        are known, and `flags` of failure, over joint, or over time and joint, with the joints'
        names, parts, roles, depths, coefficients of friction and what cohesion holds, and whether
        they are judged, as coordinates, and the criteria as attributes.
    """
    dims = ("joint",) if time is None else ("time", "joint")
    depth, criteria = structure.depths, criteria or Criteria()
    found = ratios(resultants, _overlap(depth, faces) if moved else depth)
    values = zip(UNITS.items(), (*np.moveaxis(resultants, -1, 0), *found), strict=True)
    variables = {
        key: (dims, value, {"units": units, "long_name": words})
        for (key, (units, words)), value in values
    }
    if faces is not None:
        for key, value in measures(faces, depth).items():
            units, words = MEASURES[key]
            variables[key] = dims, value, {"units": units, "long_name": words}
    laws = criteria.coefficients(structure.friction), criteria.cohesions(structure.cohesion)
    limits = ratio_at_sliding(resultants[..., 0], found[0], *laws)
    carried = borne(resultants[..., 0], structure.tension)
    variables |= flags(dims, carried, found, limits, criteria.hinge)
    coordinates = {
        "joint": np.arange(len(structure.joints)),
        "name": ("joint", [joint.name for joint in structure.joints]),
        "part": ("joint", [joint.part for joint in structure.joints]),
        "role": ("joint", [joint.role for joint in structure.joints]),
        "judged": ("joint", structure.judged),
        "depth": ("joint", depth, {"units": "m"}),
        "friction_limit": ("joint", structure.friction),
        "cohesion_limit": ("joint", structure.cohesion, {"units": "N"}),
    }
    if structure.tension.any():
        coordinates[BONDED] = "joint", structure.tension, {"units": "Pa"}
    if time is not None:
        coordinates["time"] = ("time", time, {"units": "s"})
    return xr.Dataset(variables, coordinates, criteria.attributes)


def _overlap(depth: Array, faces: Array | None) -> Array:
    """Length over which the faces of joints lie on each other (…, n_joints) [m]."""
    return depth if faces is None else np.maximum(depth - np.abs(faces[..., 2, :]), 0.0)


def check_instant(structure: Structure, joints: xr.Dataset) -> None:
    """Refuse joints that are not of one instant of this structure.

    Args:
        structure: whose joints they should be.
        joints: as made by `joint_dataset`.

    Raises:
        InvalidInput: they have several instants, or are of another structure.
    """
    if joints["N"].dims != ("joint",) or joints.sizes["joint"] != len(structure.joints):
        raise InvalidInput(
            f"joints have dimensions {dict(joints.sizes)}: give one instant of the "
            f"{len(structure.joints)} joints of this structure, e.g. joints.isel(time=-1)"
        )


def one_joint(joints: xr.Dataset, joint: str | int) -> xr.Dataset:
    """Return what is known of one joint, over time where the joints are.

    Args:
        joints: as made by `joint_dataset`, all of them.
        joint: name or number.

    Raises:
        InvalidInput: there is no such joint.
    """
    names = [str(name) for name in joints["name"].values]
    return joints.isel(joint=number_of("joint", names, joint))


def thrust_line(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Return the points where the resultant crosses each joint, in space.

    Args:
        structure: whose joints they are.
        joints: as made by `joint_dataset`.

    Returns:
        (…, joint, axis) [m], axis "x", "y"; undefined (NaN) in an open joint.

    Raises:
        InvalidInput: either is something else.

    Example:
        >>> block = af.column(breadth=0.6, heights=[2.4])
        >>> pushed = af.collapse_factor(block, live=af.BodyForce(1.0)).joints
        >>> af.joints.thrust_line(block, pushed).values.round(6).tolist()
        [[0.3, 0.0]]
    """
    instance(structure, Structure, "structure", "give that whose joints these are")
    instance(joints, xr.Dataset, "joints", "give those of an instant, e.g. dead.joints")
    middle, along = (
        xr.DataArray(each, {"axis": ["x", "y"]}, ("joint", "axis"))
        for each in (structure.middles, structure.tangents * structure.depths[:, None])
    )
    line = middle + joints["eccentricity"] * along
    line.attrs = {"units": "m", "long_name": "thrust line"}
    return line.transpose(..., "joint", "axis")
