"""LMGC90 by compas_lmgc90: rigid prisms with impacts and friction (Moreau and Jean)."""

from importlib.metadata import version as installed
from math import atan, hypot
from typing import Any

import numpy as np
from compas_lmgc90.solver import Solver
from scene_tools import (
    area_and_centroid,
    bisect,
    bracketed,
    first_failure,
    ground_velocity,
    history,
    is_convex,
    turned,
)

needs = ["compas_lmgc90==0.1.11"]
settings: dict[str, list[dict[str, Any]]] = {
    "sideways": [{"dt": 5e-3, "width": 5e-3}, {"dt": 2.5e-3, "width": 5e-3}],
    "motion": [{"dt": 2e-3}, {"dt": 1e-3}],
    "scaled motion": [{"dt": 5e-3, "width": 0.02}, {"dt": 2.5e-3, "width": 0.02}],
}

cannot = {
    "S03": "its blocks are convex, and stones with curved faces are not",
    "S10_2": "walls of more stones take it minutes",
    "S10_3": "walls of more stones take it minutes",
    "S10_4": "walls of more stones take it minutes",
    "S10_5": "walls of more stones take it minutes",
    "S10_6": "walls of more stones take it minutes",
    "S11": "a tilted block falls through its base: the faces are not found to touch",
    "S12": "a tilted block falls through its base: the faces are not found to touch",
    "S13": "a tilted block falls through its base: the faces are not found to touch",
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


def frames_of(result: Any) -> Any:
    """Return the frames of all bodies (n, 3, 3)."""
    return np.array([list(frame) for frame in result.body_frames]).reshape(-1, 3, 3)


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
    return QUESTIONS[scene["action"]["kind"]](scene, settings)


def find_factor(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Tilt the scene until it falls; joints slide without dilating."""
    bracket = bisect(
        lambda f: stands(turned(scene, atan(f)), settings["dt"]), 0.0, 2.0, settings["width"]
    )
    values = {name: 0.5 * sum(bracket) for name in scene["quantities"] if name != "associated"}
    return {"values": values, "brackets": dict.fromkeys(values, bracket), "said": "tilted"}


def shake(
    scene: dict[str, Any], dt: float, factor: float, lowest: Any = -np.inf
) -> tuple[Any, Any, Any]:
    """Move the fixed blocks with the ground; return times, centroids relative to it, and rotations.

    Gravity of the program is 9.81 m/s², so accelerations are scaled to that of the scene.

    Args:
        scene: to shake.
        dt: time step [s].
        factor: on the accelerations.
        lowest: heights of the centroids below which the run ends (n,) [m].
    """
    solver = start(scene, dt)
    times, speeds = ground_velocity(scene["action"], dt, factor)
    for number, fixed in enumerate(solver.supports):
        if fixed:
            solver.apply_velocity(number, "Vx", np.array([times, speeds]))
    solver.preprocess()
    places, turns = [], []
    for _ in range(round(scene["action"]["end"] / dt)):
        result = solver.lmgc90.compute_one_step()
        places.append(centres(result))
        turns.append(frames_of(result))
        if np.any(places[-1][:, 1] < lowest):
            break
    steps = len(places)
    ground = np.cumsum(np.array(speeds[1 : steps + 1]) * dt)
    moved = np.array(places)
    moved[:, :, 0] -= ground[:, None]
    # rotations from the first frames to the present ones
    turn = np.einsum("tbji,bjk->tbik", np.array(turns), turns[0])
    return dt * np.arange(1, steps + 1), moved, np.arctan2(turn[:, :, 0, 2], turn[:, :, 0, 0])


def find_displacement(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Shake, and find the largest displacements of the observed point to both sides."""
    times, places, turns = shake(scene, settings["dt"], 9.81 / scene["gravity"])
    number = scene["observe"]["block"]
    outline = np.array(scene["blocks"][number]["outline"])
    arm = outline[scene["observe"]["points"]].mean(axis=0) - places[0, number]
    turn = turns[:, number]  # clockwise
    moved = places[:, number, 0] - places[0, number, 0]
    moved = moved + arm[0] * (np.cos(turn) - 1.0) + arm[1] * np.sin(turn)
    return history(times.tolist(), (1e3 * moved).tolist(), "rigid blocks; gravity 9.81 m/s²")


def find_scale(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the least factor on a motion at which a block falls, by bisection."""
    low, high = scene["action"]["between"]

    # as in archfem: a centroid has sunk by more than half the root of the block's area
    measured = [area_and_centroid(block["outline"]) for block in scene["blocks"]]
    lowest = np.array([y - 0.5 * area**0.5 for area, _, y in measured])

    def remains(factor: float) -> bool:
        _, places, _ = shake(scene, settings["dt"], factor * 9.81 / scene["gravity"], lowest)
        return bool(np.all(places[-1, :, 1] >= lowest))

    bracket = first_failure(remains, low, high, settings["width"])
    return bracketed("scale", bracket, "first fall, searched upward; gravity 9.81 m/s²")


QUESTIONS = {
    "sideways": find_factor,
    "motion": find_displacement,
    "scaled motion": find_scale,
}
