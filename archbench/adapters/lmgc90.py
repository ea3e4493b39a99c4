"""LMGC90 by compas_lmgc90: rigid prisms with impacts and friction, by the scheme of Moreau and Jean."""

import os
from importlib.metadata import version as installed
from math import atan, hypot
from typing import Any

import numpy as np
from scene_tools import at_thickness, bisect, bracketed, is_convex, turned
from compas_lmgc90.solver import Solver

needs = ["compas_lmgc90==0.1.11"]
settings: dict[str, list[dict[str, Any]]] = {
    "sideways": [{"dt": 5e-3, "width": 5e-3}, {"dt": 2.5e-3, "width": 5e-3}],
}


def version() -> str:
    """Return the version of compas_lmgc90."""
    return f"compas_lmgc90 {installed('compas_lmgc90')}"


def prisms(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """Return blocks as vertices and faces, upright along z, widths along y."""
    found = []
    for block in scene["blocks"]:
        outline = block["outline"]
        count = len(outline)
        vertices = [[x, side, y] for side in (0.0, scene["width"]) for x, y in outline]
        faces = [list(range(count)), list(range(2 * count - 1, count - 1, -1))]
        faces += [[k, count + k, count + (k + 1) % count, (k + 1) % count] for k in range(count)]
        found.append({"vertices": vertices, "faces": faces})
    return found


def start(scene: dict[str, Any], dt: float) -> Solver:
    """Return a solver at the start of a scene."""
    if not all(is_convex(block["outline"]) for block in scene["blocks"]):
        raise NotImplementedError("stones with curved faces are not convex")
    solver = Solver(dt=dt, theta=0.5, density=scene["blocks"][0]["density"])
    solver.geometry_from_v_f(prisms(scene), [block["density"] for block in scene["blocks"]])
    solver.supports = [block["fixed"] for block in scene["blocks"]]
    for number, fixed in enumerate(solver.supports):
        if fixed:
            solver.v_drvdof[number] = {freedom: np.zeros(6) for freedom in range(1, 7)}
    friction = {law["friction"] for law in scene["laws"].values()}
    solver.contact_law("IQS_CLB", friction.pop())
    return solver


def centres(result: Any) -> Any:
    """Return the centroids of all blocks in the plane (n, 2) [m]."""
    return np.array([list(place) for place in result.bodies])[:, [0, 2]]


def stands(scene: dict[str, Any], dt: float, end: float = 1.0) -> bool:
    """Return whether no block moves by more than a hundredth of the structure in a second."""
    solver = start(scene, dt)
    solver.preprocess()
    points = np.array([point for block in scene["blocks"] for point in block["outline"]])
    allowed = 0.01 * hypot(*np.ptp(points, axis=0))
    first = centres(solver.lmgc90.compute_one_step())
    for _ in range(round(end / dt)):
        moved = centres(solver.lmgc90.compute_one_step()) - first
        if np.max(np.abs(moved)) > allowed:
            return False
    return True


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    bracket = bisect(
        lambda f: stands(turned(scene, atan(f)), settings["dt"]), 0.0, 2.0, settings["width"]
    )
    return bracketed("factor", bracket, "tilted")
