"""Joint resultants N, V, M, eccentricity, opening, rotation, slip, thrust line, and their tables.

Signs: N > 0 is compression; M and eccentricity are positive toward the extrados; V is positive
where the higher block is pushed toward the extrados by its slip.

Faces of elastic blocks do not stay plane. Their opening and rotation are those of the plane nearest
to the openings at the joint points, by least squares with the points' areas. Their slip is the
mean. For rigid blocks both are exact.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy import sparse

from archfem._files import atomic_write
from archfem._typing import Array, Numbers
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.criteria import (
    FACE_COORDINATE,
    HEAD_COORDINATE,
    TENSION_COORDINATE,
    Criteria,
    failure_flags,
    sliding_ratio,
    tension_margin,
)
from archfem.joints.operator import JointOperator
from archfem.masonry.structure import Structure, find_number

if TYPE_CHECKING:
    import pandas as pd


def face_matrix(operator: JointOperator) -> tuple[sparse.csr_matrix, Array]:
    """Return the matrix from coordinates to gap, rotation and slip of all joints, and its offset.

    g and s are the opening and slip at the points of a joint, r their offsets and w their areas:

        min Σ w (g - g_0 + θ r)²  over g_0 and θ,      s_0 = Σ w s / Σ w.

    θ > 0 opens the intrados, as the moment of a positive eccentricity does.
    """
    points = operator.points
    mean, slope = _fit_matrices(points.joint, points.weight, points.offset, points.joint_count)
    middle = mean - sparse.diags(mean @ points.offset) @ slope
    fit = sparse.block_diag([sparse.vstack([middle, -slope]), mean], "csr")
    matrix = fit @ sparse.vstack([operator.opening, operator.slip], "csr")
    gaps = operator.gap_offset
    gaps = np.zeros((2, len(points.offset))) if gaps is None else gaps
    return matrix, np.asarray(fit @ gaps.ravel())


def _fit_matrices(
    joint: Numbers, weight: Array, offset: Array, joint_count: int
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return matrices (n_joints, p) to the weighted mean over each joint and the slope along it."""
    entries, shape = (joint, np.arange(len(joint))), (joint_count, len(joint))
    total = np.bincount(joint, weight, joint_count)
    mean = sparse.csr_matrix((weight / total[joint], entries), shape)
    centred = offset - (mean @ offset)[joint]
    inertia = np.bincount(joint, weight * centred**2, joint_count)[joint]
    # zero slope of a joint with one point
    slope = np.divide(weight * centred, inertia, np.zeros_like(centred), where=inertia > 0)
    return mean, sparse.csr_matrix((slope, entries), shape)


def eccentricity_and_friction(resultants: Array, depth: Array) -> tuple[Array, Array]:
    """Return eccentricity and mobilised friction of joints; undefined (NaN) where they are open."""
    normal, shear, moment = np.moveaxis(resultants, -1, 0)
    # the product: half the smallest positive number is zero
    pressed = np.where(normal * depth > 0.0, normal, np.nan)
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
    without compression is open, unless a bond carries tension: its eccentricity and friction are
    undefined (NaN). Opening, rotation and slip follow from displacements alone: `opening` is the
    largest gap between the faces, at the end that is more open (0 where they touch all over).
    `rotation` is that of the higher face relative to the lower one, positive where it opens the
    intrados. `slip` is the mean displacement of the higher block along the joint, positive toward
    the extrados.

    Args:
        structure: structure of the joints.
        resultants: N, V, M for the whole width, (n_joints, 3) or (steps, n_joints, 3)
            [N, N, N m].
        time: of the steps (steps,) [s], for the second shape.
        criteria: failure criteria; by default `Criteria()`.
        faces: gaps at mid-depth, rotations and slips, as by `face_matrix`, (3, n_joints) or
            (steps, 3, n_joints) [m, rad, m]; None without displacements.
        moved: whether displacements may be large: eccentricity is then from the middle of the
            overlap of both faces, as a fraction of its length, and cohesion acts on that length.

    Returns:
        Variables N, V, M, eccentricity and friction, `opening`, `rotation` and `slip` if `faces`
        is given, and `failure_flags`, over joint, or over time and joint. The coordinates are
        names, parts, roles, depths, heights of the middles, coefficients of friction and
        resistances by cohesion of the joints; whether they are assessed; and in walls whether they
        are head joints. The attributes are the criteria.
    """
    return xr.Dataset(*joint_variables(structure, resultants, time, criteria, faces, moved))


def joint_variables(
    structure: Structure,
    resultants: Array,
    time: Array | None,
    criteria: Criteria | None,
    faces: Array | None,
    moved: bool,
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return variables, coordinates and attributes of `joint_dataset`."""
    dims = ("joint",) if time is None else ("time", "joint")
    depth, criteria = structure.depths, criteria or Criteria()
    values = dict(zip(("N", "V", "M"), np.moveaxis(resultants, -1, 0), strict=True))
    if faces is not None:
        values |= {"rotation": faces[..., 1, :], "slip": faces[..., 2, :]}
    derive = partial(_derive_variables, structure, criteria, moved)
    variables = {key: _with_units(key, dims, value) for key, value in values.items()}
    variables |= _derive_in_parts(derive, resultants, faces)
    coordinates = {
        "joint": np.arange(len(structure.joints)),
        "name": ("joint", [joint.name for joint in structure.joints]),
        "part": ("joint", [joint.part for joint in structure.joints]),
        "role": ("joint", [joint.role for joint in structure.joints]),
        "judged": ("joint", structure.judged),
        "depth": ("joint", depth, {"units": "m"}),
        "height": ("joint", structure.middles[:, 1], {"units": "m"}),
        "friction_limit": ("joint", structure.friction),
        "cohesion_limit": ("joint", structure.cohesion, {"units": "N"}),
    }
    if moved and faces is not None and structure.cohesion.any():
        limits = _cohesion(structure, structure.overlaps(faces[..., 2, :])[0])
        coordinates["cohesion_limit"] = dims, limits, {"units": "N"}
    if structure.tension.any():
        coordinates[TENSION_COORDINATE] = "joint", structure.tension, {"units": "Pa"}
    if structure.heads.any():
        coordinates[HEAD_COORDINATE] = "joint", structure.heads
    if (chords := structure.face_names) != [joint.name for joint in structure.joints]:
        coordinates[FACE_COORDINATE] = "joint", chords
    if time is not None:
        coordinates["time"] = ("time", time, {"units": "s"})
    return variables, coordinates, criteria.attributes


def _derive_in_parts(
    derive: Callable[[Array, Array | None], dict[str, Any]],
    resultants: Array,
    faces: Array | None,
    size: int = 8192,
) -> dict[str, Any]:
    """Derive variables some steps at a time: those of a long record need no large temporaries."""
    steps = len(resultants)
    if resultants.ndim < 3 or steps <= size:
        return derive(resultants, faces)
    variables: dict[str, Any] = {}
    for start in range(0, steps, size):
        part = slice(start, start + size)
        some = derive(resultants[part], None if faces is None else faces[part])
        for name, (dims, values, attributes) in some.items():
            if name not in variables:
                whole = np.empty((steps, *values.shape[1:]), values.dtype)
                variables[name] = dims, whole, attributes
            variables[name][1][part] = values
    return variables


def _derive_variables(
    structure: Structure, criteria: Criteria, moved: bool, resultants: Array, faces: Array | None
) -> dict[str, Any]:
    """Return eccentricity, friction, opening and failure flags of joints as variables."""
    dims = ("time", "joint")[3 - resultants.ndim :]
    normal, length = resultants[..., 0], structure.depths
    middle = np.zeros_like(length)
    if moved and faces is not None:
        length, middle = structure.overlaps(faces[..., 2, :])
    ratios = eccentricity_and_friction(resultants, length)
    values = dict(zip(("eccentricity", "friction"), ratios, strict=True))
    if faces is not None:
        # half the depth, not the overlap: faces as long as the joint have ends beside each other
        gap, rotation = faces[..., 0, :], faces[..., 1, :]
        half = 0.5 * np.maximum(length, structure.depths)
        values["opening"] = np.maximum(gap - rotation * middle + half * np.abs(rotation), 0.0)
    variables = {key: _with_units(key, dims, value) for key, value in values.items()}
    cohesion = criteria.cohesions(_cohesion(structure, length))
    limits = sliding_ratio(normal, ratios[0], criteria.coefficients(structure.friction), cohesion)
    margin = tension_margin(normal, structure.tension)
    return variables | failure_flags(dims, margin, ratios, limits, criteria.hinge)


def _with_units(name: str, dims: tuple[str, ...], values: Array) -> tuple[Any, ...]:
    """Return a variable of a dataset with its unit and meaning."""
    meanings = {
        "N": ("N", "normal force, compression positive"),
        "V": ("N", "shear force"),
        "M": ("N m", "moment about mid-depth, positive toward the extrados"),
        "eccentricity": ("1", "M / (N h), +0.5 at the extrados; undefined in an open joint"),
        "friction": ("1", "mobilised friction |V| / N; undefined in an open joint"),
        "opening": (
            "m",
            "largest gap between the faces, at the end that is more open; 0 where closed",
        ),
        "rotation": ("rad", "turn of the higher face, positive where it opens the intrados"),
        "slip": ("m", "mean slip of the higher block, positive toward the extrados"),
    }
    attributes = dict(zip(("units", "long_name"), meanings[name], strict=True))
    return dims, values, attributes


def _cohesion(structure: Structure, length: Array) -> Array:
    """Return the shear resistance by cohesion of joints closed on a length (…, n_joints) [N]."""
    return structure.cohesion * (length / structure.depths)


def check_instant(structure: Structure, joints: xr.Dataset) -> None:
    """Refuse joints that are not of one instant of this structure."""
    if joints["N"].dims != ("joint",) or joints.sizes["joint"] != len(structure.joints):
        raise InvalidInput(
            f"joints have dimensions {dict(joints.sizes)}: give one instant of the "
            f"{len(structure.joints)} joints of this structure, e.g. joints.isel(time=-1)"
        )


@validate_arguments
def select_joint(joints: xr.Dataset, joint: str | int) -> xr.Dataset:
    """Return the variables of one joint, at one instant or over time.

    Args:
        joints: results of all joints, as made by `joint_dataset`.
        joint: name or number.

    Raises:
        InvalidInput: there is no such joint.
    """
    names = [str(name) for name in joints["name"].values]
    return joints.isel(joint=find_number("joint", names, joint))


@validate_arguments
def thrust_line(structure: Structure, joints: xr.Dataset) -> xr.DataArray:
    """Return the points where the resultant crosses each joint, in space.

    Args:
        structure: structure of the joints.
        joints: as made by `joint_dataset`.

    Returns:
        Places (…, joint, axis) [m], axis "x", "y"; undefined (NaN) in an open joint.

    Raises:
        InvalidInput: an argument has another type.

    Example:
        >>> block = af.column(breadth=0.6, heights=[2.4])
        >>> pushed = af.collapse_factor(block, live=af.BodyForce(1.0)).joints
        >>> af.joints.thrust_line(block, pushed).values.round(6).tolist()
        [[0.3, 0.0]]
    """
    middle, along = (
        xr.DataArray(vectors, {"axis": ["x", "y"]}, ("joint", "axis"))
        for vectors in (structure.middles, structure.tangents * structure.depths[:, None])
    )
    line = middle + joints["eccentricity"] * along
    line.attrs = {"units": "m", "long_name": "thrust line"}
    return line.transpose(..., "joint", "axis")


@validate_arguments
def joint_table(joints: xr.Dataset) -> "pd.DataFrame":
    """Return joint variables as a table with a row for each joint, at each instant if several.

    Args:
        joints: e.g. `run.joints`, `dead.joints` or `pushover.joints`.

    Returns:
        Columns `time` or other dimensions of the dataset, `joint` (its number), name, part and
        role, and a column for each quantity, in its own unit.
    """
    others = [name for name in joints.dims if name != "joint"]
    names = [name for name, values in joints.items() if set(values.dims) <= {*others, "joint"}]
    numbered = joints[names]
    if "joint" not in numbered.coords:
        numbered = numbered.assign_coords(joint=range(joints.sizes["joint"]))
    frame = numbered.to_dataframe(dim_order=[*others, "joint"]).reset_index()
    first = [*others, "joint", *(key for key in ("name", "part", "role") if key in frame)]
    return frame[[*first, *(key for key in frame if key not in first)]]


@validate_arguments
def write_joint_table(joints: xr.Dataset, path: str | Path) -> Path:
    """Write joint variables as a table.

    Args:
        joints: as for `joint_table`.
        path: *.csv, *.parquet or *.xlsx; missing folders are created.

    Returns:
        The file.

    Raises:
        InvalidInput: the suffix is another one, the package that writes such files is not
            installed, or there are more rows than a sheet has.
    """
    path, packages = Path(path), {".csv": "pandas", ".parquet": "pyarrow", ".xlsx": "openpyxl"}
    if path.suffix not in packages:
        raise InvalidInput(f"{path}: a table is written as {', '.join(packages)}")
    table = joint_table(joints)
    max_rows = 1_048_575  # of a sheet of Excel below its header
    if path.suffix == ".xlsx" and len(table) > max_rows:
        raise InvalidInput(
            f"{len(table)} rows do not fit into a sheet of Excel, which has {max_rows}: write "
            ".parquet or .csv, or fewer steps"
        )
    try:
        with atomic_write(path) as draft:
            if path.suffix == ".csv":
                table.to_csv(draft, index=False)
            elif path.suffix == ".parquet":
                table.to_parquet(draft, index=False, engine="pyarrow")
            else:
                table.to_excel(draft, index=False, sheet_name="joints", engine="openpyxl")
    except ImportError as error:
        raise InvalidInput(
            f"{path.suffix} is written with {packages[path.suffix]}, which is not installed: "
            "pip install 'archfem[tables]', or write .csv"
        ) from error
    return path
