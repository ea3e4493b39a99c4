"""OpenSees: rigid stones on rows of springs without tension, small displacements."""

from importlib.metadata import version as installed
from math import pi
from typing import Any

import openseespy.opensees as ops
from scene_tools import area_and_centroid, history, polar_moment

needs = ["openseespy"]
settings: dict[str, list[dict[str, Any]]] = {
    "sideways": [{"springs": 2, "stiffness": 1e11}, {"springs": 5, "stiffness": 1e12}],
    "motion": [{"dt": 1e-3}, {"dt": 2e-3}],
}

cannot = {
    "S10": "springs of this adapter do not slide, and these walls do",
    "S06": "displacements are small: nothing falls",
    "S08": "displacements are small: nothing falls",
}


def version() -> str:
    """Return the version of OpenSeesPy."""
    return f"openseespy {installed('openseespy')}"


def row_of_springs(count: int) -> list[tuple[float, float]]:
    """Return positions along a joint, from 0 to 1, and shares of its area (trapezoidal rule)."""
    places = [k / (count - 1) for k in range(count)]
    shares = [(0.5 if k in (0, count - 1) else 1.0) / (count - 1) for k in range(count)]
    return list(zip(places, shares, strict=True))


def build(scene: dict[str, Any], springs: int, stiffness: float | None) -> list[int]:
    """Build the model and return the tags of the stones, which are those of their nodes.

    Args:
        scene: to build.
        springs: number of them in each joint.
        stiffness: of joints of rigid blocks; None takes that of the scene [Pa/m].
    """
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for tag, block in enumerate(scene["blocks"], 1):
        area, x, y = area_and_centroid(block["outline"])
        density = block["density"] * scene["width"]
        mass = density * area
        ops.node(tag, x, y)
        ops.mass(tag, mass, mass, density * polar_moment(block["outline"]))
        if block["fixed"]:
            ops.fix(tag, 1, 1, 1)
    for number, joint in enumerate(scene["joints"]):
        _add_joint(scene, number, joint, springs, stiffness)
    return [tag for tag, block in enumerate(scene["blocks"], 1) if not block["fixed"]]


def _add_joint(
    scene: dict[str, Any], number: int, joint: dict[str, Any], springs: int, stiffness: float | None
) -> None:
    """Add rigid arms from both centroids to the springs of a joint, and the springs."""
    law = scene["laws"][joint["law"]]
    (x0, y0), (x1, y1) = joint["ends"]
    depth = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    tangent = ((x1 - x0) / depth, (y1 - y0) / depth)
    normal = (tangent[1], -tangent[0])
    lower, higher = min(joint["blocks"]) + 1, max(joint["blocks"]) + 1
    centres = [ops.nodeCoord(tag) for tag in (lower, higher)]
    way = [b - a for a, b in zip(*centres, strict=True)]
    if way[0] * normal[0] + way[1] * normal[1] < 0.0:  # from the lower block to the higher one
        normal = (-normal[0], -normal[1])
    for k, (place, share) in enumerate(row_of_springs(springs)):
        base = 1000 * (number + 1) + 10 * k
        area = depth * scene["width"] * share
        point = (x0 + place * (x1 - x0), y0 + place * (y1 - y0))
        for side, owner in enumerate((lower, higher)):
            ops.node(base + side, *point)
            ops.rigidLink("beam", owner, base + side)
        kn, ks = (stiffness or law[key] for key in ("normal_stiffness", "shear_stiffness"))
        ops.uniaxialMaterial("ENT", base, kn * area)
        ops.uniaxialMaterial("Elastic", base + 1, ks * area)
        axes = [*normal, 0.0, -normal[1], normal[0], 0.0]
        pair = ["-mat", base, base + 1, "-dir", 1, 2]
        ops.element("zeroLength", base, base, base + 1, *pair, "-orient", *axes, "-doRayleigh", 1)


def load_weight(scene: dict[str, Any], stones: list[int], steps: int = 20) -> None:
    """Apply the self-weight in steps and hold it."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for tag in stones:
        ops.load(tag, 0.0, -ops.nodeMass(tag, 1) * scene["gravity"], 0.0)
    solver()
    ops.integrator("LoadControl", 1.0 / steps)
    ops.analysis("Static")
    if ops.analyze(steps) != 0:
        raise RuntimeError("no equilibrium under self-weight")
    ops.loadConst("-time", 0.0)


def solver(tolerance: float = 1e-10, iterations: int = 100) -> None:
    """Choose the solver of linear equations and the test of convergence."""
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", tolerance, iterations)
    ops.algorithm("Newton")


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    questions = {"sideways": find_factor, "motion": find_displacement}
    return questions[scene["action"]["kind"]](scene, settings)


def find_factor(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Push the crown sideways in small steps, and take the largest factor up to 10 mm."""
    stones = build(scene, settings["springs"], settings["stiffness"])
    load_weight(scene, stones)
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 2, 2)
    for tag in stones:
        ops.load(tag, ops.nodeMass(tag, 1) * scene["gravity"], 0.0, 0.0)
    top = max(stones, key=lambda tag: ops.nodeCoord(tag, 2))
    solver(1e-9)
    ops.analysis("Static")
    peak, step, moved = 0.0, 1e-6, 0.0
    while moved < 0.01:
        ops.integrator("DisplacementControl", top, 1, step)
        if ops.analyze(1) != 0:
            step *= 0.25
            if step < 1e-9:
                break
            continue
        moved += step
        step = min(1.3 * step, 2e-4)
        peak = max(peak, ops.getLoadFactor(2))
    said = f"pushed until the crown had moved by {1e3 * moved:.2g} mm; joints do not slide"
    return {"values": {"factor": peak}, "said": said}


def find_displacement(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Shake the base, and find the largest displacements of the observed point to both sides."""
    (law,) = scene["laws"].values()
    stones = build(scene, law.get("points", 2), None)
    load_weight(scene, stones)
    action, dt = scene["action"], settings["dt"]
    ops.timeSeries("Path", 2, "-time", *action["times"], "-values", *action["accelerations"])
    ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
    if damping := scene.get("damping"):
        # proportional to the present stiffness, so that open joints are not damped
        ops.rayleigh(0.0, 0.0, 0.0, damping["ratio"] / (pi * damping["frequency"]))
    solver(1e-9, 50)
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    tag, arm = _observed_point(scene)
    start = ops.nodeDisp(tag)
    times, moved = [0.0], [0.0]
    for step in range(round(action["end"] / dt)):
        if ops.analyze(1, dt) != 0:
            raise RuntimeError(f"no equilibrium at {step * dt:.3f} s")
        x, _, turn = (a - b for a, b in zip(ops.nodeDisp(tag), start, strict=True))
        times.append((step + 1) * dt)
        moved.append(1e3 * (x - turn * arm))
    return history(times, moved, "small displacements; joints do not slide")


def _observed_point(scene: dict[str, Any]) -> tuple[int, float]:
    """Return the tag of the observed stone, and the height of the point above its centroid."""
    block = scene["blocks"][scene["observe"]["block"]]
    points = [block["outline"][k] for k in scene["observe"]["points"]]
    _, _, y = area_and_centroid(block["outline"])
    return scene["observe"]["block"] + 1, sum(point[1] for point in points) / len(points) - y
