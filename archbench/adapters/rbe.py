"""compas_cra: rigid-block equilibrium, the least tension at corners of faces (RBE)."""

import contextlib
import io
from importlib.metadata import version as installed
from math import atan
from typing import Any

from compas.geometry import Frame
from compas_assembly.datastructures import Block
from compas_cra.datastructures import CRA_Assembly
from compas_cra.equilibrium import rbe_solve
from scene_tools import area_and_centroid, at_thickness, bisect, bracketed, turned

needs = ["compas_cra==0.8.0"]

# Largest admissible share of tension in the forces of a state that stands
settings: dict[str, list[dict[str, Any]]] = {
    "thickness": [{"tension": 1e-4, "width": 2e-3}, {"tension": 1e-3, "width": 2e-3}],
    "sideways": [{"tension": 1e-4, "width": 2e-3}, {"tension": 1e-3, "width": 2e-3}],
}

cannot = {"S10": "a wall takes its solver minutes"}


def version() -> str:
    """Return the version of compas_cra."""
    return f"compas_cra {installed('compas_cra')}"


def assembly(scene: dict[str, Any]) -> CRA_Assembly:
    """Return the assembly of a scene: prisms along y, upright along z."""
    found, width = CRA_Assembly(), scene["width"]
    for number, block in enumerate(scene["blocks"]):
        outline = block["outline"]
        count = len(outline)
        vertices = [[x, side, y] for side in (0.0, width) for x, y in outline]
        faces = [list(range(count)), list(range(2 * count - 1, count - 1, -1))]
        faces += [[k, count + k, count + (k + 1) % count, (k + 1) % count] for k in range(count)]
        mesh = Block.from_vertices_and_faces(vertices, faces)
        found.add_block(mesh, node=number)
    found.set_boundary_conditions([k for k, b in enumerate(scene["blocks"]) if b["fixed"]])
    for joint in scene["joints"]:
        _add_interface(found, scene, joint)
    return found


def _add_interface(found: CRA_Assembly, scene: dict[str, Any], joint: dict[str, Any]) -> None:
    """Add the rectangle in which two blocks touch; its normal points from the first block."""
    (x0, y0), (x1, y1) = joint["ends"]
    lower, higher = sorted(joint["blocks"])
    _, ax, ay = area_and_centroid(scene["blocks"][lower]["outline"])
    _, bx, by = area_and_centroid(scene["blocks"][higher]["outline"])
    points = [[x0, 0.0, y0], [x1, 0.0, y1], [x1, scene["width"], y1], [x0, scene["width"], y0]]
    tangent = [x1 - x0, 0.0, y1 - y0]
    # x cross y of the frame is the normal; y along the width gives (-tz, 0, tx)
    if -(y1 - y0) * (bx - ax) + (x1 - x0) * (by - ay) < 0.0:
        tangent, points = [-t for t in tangent], points[::-1]
    centre = [sum(p[k] for p in points) / 4.0 for k in range(3)]
    depth = sum(t * t for t in tangent) ** 0.5
    frame = Frame(centre, tangent, [0.0, 1.0, 0.0])
    found.add_to_interfaces(lower, higher, depth * scene["width"], points, frame)


def stands(scene: dict[str, Any], tension: float) -> bool:
    """Return whether forces balance the weight with almost no tension."""
    blocks = assembly(scene)
    (law,) = scene["laws"].values()
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            rbe_solve(blocks, mu=law["friction"], density=scene["blocks"][0]["density"])
        except ValueError:  # the solver found no equilibrium
            return False
    forces = [
        force
        for edge in blocks.graph.edges()
        for interface in blocks.graph.edge_attribute(edge, "interfaces")
        for force in interface.forces
    ]
    pushed, pulled = (sum(force[key] for force in forces) for key in ("c_np", "c_nn"))
    return bool(pulled <= tension * pushed)


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    tension, width = settings["tension"], settings["width"]
    if scene["action"]["kind"] == "thickness":
        low, high = scene["action"]["between"]
        bracket = bisect(lambda t: not stands(at_thickness(scene, t), tension), low, high, width)
        return bracketed("thickness", bracket, "least tension")
    bracket = bisect(lambda f: stands(turned(scene, atan(f)), tension), 0.0, 2.0, width)
    name = "factor" if "factor" in scene["quantities"] else "associated"
    return bracketed(name, bracket, "tilted")
