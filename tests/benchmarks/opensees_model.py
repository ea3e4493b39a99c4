"""A ring in OpenSees: the same nodes, quads, springs, masses and loads as a model of archfem."""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import openseespy.opensees as ops
from timing import stopwatch

from archfem.statics import self_weight

SETTINGS = {
    "element": "quad",
    "system": ("BandGeneral",),
    "algorithm": ("Newton",),
    "test": ("NormUnbalance", 1e-2, 30),
}


def build(model, element: str = "quad") -> None:
    """Bring a model with nodal quadrature and lumped mass into OpenSees.

    Args:
        model: with all nodes; its mass must be diagonal.
        element: "quad" (four Gauss points) or "SSPquad" (one, stabilised).
    """
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    masses = model.mass.diagonal().reshape(-1, 2)
    for tag, (place, mass) in enumerate(zip(model.cells.places, masses, strict=True), start=1):
        ops.node(tag, *map(float, place))
        ops.mass(tag, *map(float, mass))
    structure = model.structure
    stone = structure.blocks[model.cells.owner[0]].material
    ops.nDMaterial("ElasticIsotropic", 1, stone.young, stone.poisson)
    for tag, cell in enumerate(model.cells.polygons, start=1):
        corners = [int(node) + 1 for node in _anticlockwise(model.cells.places, cell)]
        if element == "SSPquad":
            ops.element("SSPquad", tag, *corners, 1, "PlaneStress", structure.width)
        else:
            ops.element("quad", tag, *corners, structure.width, "PlaneStress", 1)
    _springs(model)


def _anticlockwise(places, cell):
    a, b, c = places[cell[:3]]
    turn = (b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0]
    return cell if turn > 0.0 else cell[::-1]


def _springs(model) -> None:
    """Put a pair of springs at each joint point, between coinciding nodes or node and ground."""
    points, count = model.operator.points, len(model.cells.places)
    normals = model.structure.normals[points.joint]
    tangents = np.array([joint.tangent for joint in model.structure.joints])[points.joint]
    for point, (normal, tangent) in enumerate(zip(normals, tangents, strict=True)):
        lower, higher = _ends(model.operator.opening[point], normal)
        if lower is None or higher is None:
            count += 1
            ops.node(count, *map(float, model.cells.places[higher if lower is None else lower]))
            ops.fix(count, 1, 1)
        pair = [count if node is None else node + 1 for node in (lower, higher)]
        tag = len(model.cells.polygons) + 1 + point
        area, contact = points.weight[point], points.contact
        ops.uniaxialMaterial("ENT", 2 * point + 1, float(contact.normal_stiffness[point] * area))
        ops.uniaxialMaterial("Elastic", 2 * point + 2, float(contact.shear_stiffness[point] * area))
        axes = [*map(float, normal), 0.0, *map(float, tangent), 0.0]
        springs = ["-mat", 2 * point + 1, 2 * point + 2, "-dir", 1, 2]
        ops.element("zeroLength", tag, *pair, *springs, "-doRayleigh", 1, "-orient", *axes)


def _ends(row, normal) -> tuple[int | None, int | None]:
    """Nodes on the lower and the higher side; None is the ground."""
    found: list[int | None] = [None, None]
    for column, value in zip(row.indices, row.data, strict=True):
        found[int(value * normal[column % 2] > 0.0)] = int(column) // 2
    return found[0], found[1]


def load_dead(model) -> None:
    """Bring on the self-weight and hold it."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for tag, force in enumerate(self_weight(model).reshape(-1, 2), start=1):
        ops.load(tag, *map(float, force))
    _solver({**SETTINGS, "test": ("NormUnbalance", 1e-6, 50)})
    ops.integrator("LoadControl", 0.25)
    ops.analysis("Static", "-noWarnings")
    assert ops.analyze(4) == 0, "no equilibrium under dead load"
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()


class Shaken(NamedTuple):
    """The result of a run.

    Attributes:
        seconds: of stepping alone, by the wall and of the processor.
        states: displacements of the free nodes at the start and after every step (steps + 1, n),
            or None.
    """

    seconds: tuple[float, float]
    states: np.ndarray | None


def shake(model, motion, damping, dt, *, settings=None, keep: bool = False) -> Shaken:
    """Build, load and shake.

    Args:
        model: with nodal quadrature and lumped mass.
        motion: of the ground, of which the horizontal is taken.
        damping: on the initial stiffness.
        dt: time step [s].
        settings: of the analysis, over `SETTINGS`; "element" chooses the element.
        keep: keep the displacements of every step (which takes time).
    """
    chosen = {**SETTINGS, **(settings or {})}
    build(model, chosen["element"])
    load_dead(model)
    nodes = range(1, len(model.cells.places) + 1)
    first = [value for tag in nodes for value in ops.nodeDisp(tag)]
    ops.timeSeries("Path", 2, "-dt", motion.dt, "-values", *map(float, motion.horizontal))
    ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
    _damp(model, damping, chosen["element"] == "SSPquad")
    _solver(chosen)
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient", "-noWarnings")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "displacements"
        if keep:
            ops.recorder("Node", "-binary", str(path), "-node", *nodes, "-dof", 1, 2, "disp")
        watch = stopwatch()
        failed = ops.analyze(round(motion.duration / dt), dt)
        seconds = watch()
        assert not failed, f"OpenSees failed with {chosen}"
        ops.wipe()
        states = np.vstack([first, _recorded(path, 2 * len(nodes))]) if keep else None
    return Shaken(seconds, states)


def _damp(model, damping, committed: bool) -> None:
    """Damp by mass and initial stiffness.

    The committed stiffness of the stones is their initial one, and never changes; an element that
    works out its initial stiffness anew at each iteration is spared that if it is given.
    """
    if not committed:
        ops.rayleigh(damping.mass, 0.0, damping.stiffness, 0.0)
        return
    count = len(model.cells.polygons)
    stones = [tag for tag in ops.getEleTags() if tag <= count]
    springs = [tag for tag in ops.getEleTags() if tag > count]
    nodes = range(1, len(model.cells.places) + 1)
    ops.region(1, "-nodeOnly", *nodes, "-rayleigh", damping.mass, 0.0, 0.0, 0.0)
    ops.region(2, "-eleOnly", *stones, "-rayleigh", 0.0, 0.0, 0.0, damping.stiffness)
    ops.region(3, "-eleOnly", *springs, "-rayleigh", 0.0, 0.0, damping.stiffness, 0.0)


def _recorded(path: Path, columns: int) -> np.ndarray:
    """Read a binary recorder: each row ends in one more byte, for the end of the line."""
    rows = np.fromfile(path, dtype=[("values", float, columns), ("end", "S1")])
    return rows["values"]


def _solver(settings) -> None:
    ops.constraints("Plain")
    ops.numberer("RCM")
    for name in ("system", "test", "algorithm"):
        getattr(ops, name)(*settings[name])
