"""Siconos: rigid polygons with impacts and friction, found by Bullet, by the scheme of Moreau."""

import contextlib
import io
import tempfile
from math import atan, hypot
from pathlib import Path
from typing import Any

import numpy as np
import siconos.kernel
import siconos.numerics
from scene_tools import (
    area_and_centroid,
    bisect,
    impact_time,
    is_convex,
    polar_moment,
    rocking_ratio,
    turned,
)
from siconos.io.mechanics_run import MechanicsHdf5Runner
from siconos.mechanics.collision.bullet import SiconosBulletOptions
from siconos.mechanics.collision.tools import Contactor

needs = ["python3-siconos of Debian"]
python = "/usr/bin/python3"
settings: dict[str, list[dict[str, Any]]] = {
    "sideways": [{"dt": 5e-3, "width": 0.01}, {"dt": 2.5e-3, "width": 0.01}],
    "rocking": [{"dt": 1e-3}, {"dt": 5e-4}],
}

cannot = {
    "S03": "its blocks are convex, and stones with curved faces are not",
    "S05": "its arch is locked while the ground moves: contacts of the adapter fail",
    "S07": "its arch is locked while the ground moves: contacts of the adapter fail",
    "S10": "a wall takes it minutes",
    "S12_1r": "its impacts take no ratio of angular velocities",
    "S12_2r": "its impacts take no ratio of angular velocities",
    "S12_3r": "its impacts take no ratio of angular velocities",
}


def version() -> str:
    """Return the version of Siconos."""
    return "siconos 4.4.0"


class Ended(Exception):
    """The run may end: blocks have moved further than allowed."""


def simulate(
    scene: dict[str, Any], dt: float, end: float, allowed: float = np.inf
) -> list[tuple[float, Any]]:
    """Return times and poses of the free blocks at all steps.

    Args:
        scene: whose blocks are convex.
        dt: time step [s].
        end: of the run [s].
        allowed: displacement of a block that ends the run [m].
    """
    if not all(is_convex(block["outline"]) for block in scene["blocks"]):
        raise NotImplementedError("stones with curved faces are not convex")
    bodies: list[Any] = []
    frames: list[tuple[float, Any]] = []
    gravity = scene["gravity"]

    def weigh(body: Any) -> None:
        body.setFExtPtr([0.0, -body.scalarMass() * gravity, 0.0])
        bodies.append(body)

    def before(runner: Any) -> None:
        frames.append((runner.current_time(), np.array([body.q() for body in bodies])))
        if np.max(np.abs(frames[-1][1] - frames[0][1])[:, :2]) > allowed:
            raise Ended

    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = str(Path(folder) / "scene.hdf5")
        with MechanicsHdf5Runner(mode="w", io_filename=path) as made:
            _describe(made, scene)
        options = siconos.kernel.solver_options_create(siconos.numerics.SICONOS_FRICTION_2D_NSGS)
        options.iparam[siconos.numerics.SICONOS_IPARAM_MAX_ITER] = 300
        options.dparam[siconos.numerics.SICONOS_DPARAM_TOL] = 1e-6
        bullet = SiconosBulletOptions()
        bullet.dimension = 1  # of the enumeration: two-dimensional
        bullet.contactBreakingThreshold = 0.02
        bullet.worldScale = 1.0
        bullet.perturbationIterations = 0
        bullet.minimumPointsPerturbationThreshold = 0
        with (
            contextlib.suppress(Ended),
            MechanicsHdf5Runner(mode="r+", io_filename=path, set_external_forces=weigh) as runner,
        ):
            runner.run(
                with_timer=False,
                bullet_options=bullet,
                t0=0.0,
                T=end,
                h=dt,
                theta=0.5,
                Newton_max_iter=1,
                solver_options=options,
                output_frequency=10**9,
                set_external_forces=weigh,
                start_run_iteration_hook=before,
                verbose=False,
            )
    return frames


def _describe(made: Any, scene: dict[str, Any]) -> None:
    """Write the blocks and the law of their contact."""
    (law,) = scene["laws"].values()
    made.add_Newton_impact_friction_nsl("contact", mu=law["friction"], e=0.0)
    for number, block in enumerate(scene["blocks"]):
        outline = block["outline"]
        area, x, y = area_and_centroid(outline)
        name = f"block {number}"
        points = [[px - x, py - y] for px, py in outline]
        made.add_convex_shape(name, points, insideMargin=0.0, outsideMargin=0.0)
        density = block["density"] * scene["width"]
        mass = {} if block["fixed"] else {"mass": density * area}
        if mass:
            mass["inertia"] = density * polar_moment(outline)
        made.add_object(name, [Contactor(name)], translation=[x, y], **mass)


def stands(scene: dict[str, Any], dt: float, end: float = 1.0) -> bool:
    """Return whether no block moves by more than a hundredth of the structure in a second."""
    points = np.array([point for block in scene["blocks"] for point in block["outline"]])
    allowed = 0.01 * hypot(*np.ptp(points, axis=0))
    frames = simulate(scene, dt, end, allowed=allowed)
    return frames[-1][0] >= end - 2.0 * dt


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    return QUESTIONS[scene["action"]["kind"]](scene, settings)


def find_factor(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Tilt the scene until it falls; joints slide without dilating."""
    bracket = bisect(
        lambda f: stands(turned(scene, atan(f)), settings["dt"]), 0.0, 2.0, settings["width"]
    )
    values = {name: 0.5 * sum(bracket) for name in scene["quantities"]}
    return {"values": values, "brackets": dict.fromkeys(values, bracket), "said": "tilted"}


def find_rocking(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Release a tilted block, and find its angular velocities from the peaks between impacts."""
    tilt = scene["action"]["tilt"]
    base, block = scene["blocks"]
    edge = block["outline"][1]
    shifted = [[x - edge[0], y - edge[1]] for x, y in block["outline"]]
    (tilted,) = turned({"blocks": [{**block, "outline": shifted}], "joints": []}, tilt)["blocks"]
    outline = [[x + edge[0], y + edge[1]] for x, y in tilted["outline"]]
    start = {**scene, "blocks": [base, {**block, "outline": outline}]}
    frames = simulate(start, settings["dt"], 6.0)
    angles = [tilt - float(pose[0, 2]) for _, pose in frames]
    (left, low), (right, _), (_, high) = block["outline"][:3]
    slenderness = float(np.arctan2(right - left, high - low))
    times = [time for time, _ in frames]
    find = {
        "ratio": lambda: rocking_ratio(angles, slenderness, scene["action"]["impacts"]),
        "first impact": lambda: impact_time(times, angles, 1),
        "seventh impact": lambda: impact_time(times, angles, 7),
    }
    said = "peaks of the rotation"
    return {"values": {name: find[name]() for name in scene["quantities"]}, "said": said}


QUESTIONS = {
    "sideways": find_factor,
    "rocking": find_rocking,
}
