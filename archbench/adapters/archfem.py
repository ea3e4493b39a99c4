"""archfem: limit analysis, elastic joints in large displacements, and rigid blocks."""

import contextlib
from dataclasses import replace
from importlib.metadata import version as installed
from typing import Any

import numpy as np
from scene_tools import (
    at_thickness,
    bisect,
    bracketed,
    first_failure,
    history,
    impact_time,
    rocking_ratio,
)

import archfem as af

needs: list[str] = []
python = "bench"

# Of each action: values of what is not physics, or of what nobody measured. "variant" marks runs
# beside the answer, with another law of joints than the scene's.
settings: dict[str, list[dict[str, Any]]] = {
    "thickness": [{"width": 1e-6}, {"width": 1e-4}],
    # solved exactly by a linear programme, in which nothing but physics is set
    "sideways": [{}],
    "spread": [{"tolerance": 1e-5}, {"tolerance": 1e-3}],
    # mobilised share of passive pressure and cohesion of the fill [Pa]; share of the ring's
    # thickness; change of the cover [m]; share of the strength
    "load": [
        {"mobilisation": 0.3333},
        {"mobilisation": 0.0, "cohesion": 0.0},
        {"mobilisation": 1.0, "cohesion": 0.0},
        {"mobilisation": 1.0, "cohesion": 7e3},
        {"mobilisation": 0.3333, "thickness": 0.9},
        {"mobilisation": 0.3333, "thickness": 1.1},
        {"mobilisation": 0.3333, "cover": -0.1},
        {"mobilisation": 0.3333, "cover": 0.1},
        {"mobilisation": 0.3333, "strength": 0.5},
        {"plastic": True, "cohesion": 5e3, "gap": 0.1},
        {"mobilisation": 0.3333, "crushing": False, "variant": "no crushing"},
        {"mobilisation": 0.3333, "bond": 5e4, "variant": "bond of 50 kPa"},
    ],
    # joints as stiff as in the scene and half of that; sliding with and without dilatancy
    "push": [
        {"stiffness": 1.0, "friction": "coulomb"},
        {"stiffness": 0.5, "friction": "nonassociated"},
    ],
    "motion": [
        {"joints": "points", "dt": 1e-3},
        {"joints": "points", "dt": 2e-3},
        {"joints": "exact", "dt": 1e-3, "variant": "exact"},
        {"joints": "lobatto", "dt": 1e-3, "variant": "two points"},
        {"joints": "rigid", "dt": 2e-4, "variant": "rigid"},
    ],
    "scaled motion": [
        {"joints": "points", "dt": 2e-3, "width": 0.01},
        {"joints": "points", "dt": 4e-3, "width": 0.01},
        {"joints": "exact", "dt": 2e-3, "width": 0.01, "variant": "exact"},
        {"joints": "lobatto", "dt": 2e-3, "width": 0.01, "variant": "two points"},
        {"joints": "rigid", "dt": 5e-4, "width": 0.01, "variant": "rigid"},
    ],
    "rocking": [{"dt": 2e-4}, {"dt": 4e-4}],
    # which law of the range of a finish, from the softest to the stiffest
    "closing": [{"law": 1}, {"law": 0}, {"law": 2}],
}

cannot = {
    "S28": "mortar of 7 MPa and of unknown bond carries it",
    "S29": "mortar of 7 MPa and of unknown bond carries it",
}


def version() -> str:
    """Return the version of archfem."""
    return f"archfem {installed('archfem')}"


def structure(scene: dict[str, Any]) -> af.Structure:
    """Return the structure of a scene."""
    laws = {
        name: af.Contact(law["normal_stiffness"], law["shear_stiffness"], law["friction"], name)
        for name, law in scene["laws"].items()
    }
    materials = {
        block["density"]: af.Material(3e10, 0.2, block["density"] * scene["gravity"])
        for block in scene["blocks"]
    }
    blocks = tuple(
        af.Block(
            tuple((x, y) for x, y in block["outline"]),
            materials[block["density"]],
            block["name"],
            fixed=block["fixed"],
            role="ring",
        )
        for block in scene["blocks"]
    )
    joints = []
    for number, joint in enumerate(scene["joints"]):
        (first, second), (start, end) = joint["blocks"], joint["ends"]
        places = (start[0], start[1]), (end[0], end[1])
        name = f"joint {number}"
        law = laws[joint["law"]]
        joints.append(af.Joint((first, second), *places, law, name, role="ring"))
    return af.Structure(blocks, tuple(joints), scene["width"], scene["gravity"], scene["id"])


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    return QUESTIONS[scene["action"]["kind"]](scene, settings)


def find_thickness(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the least thickness by bisection of limit analyses."""
    low, high = scene["action"]["between"]

    def falls(thickness: float) -> bool:
        return not af.stands(structure(at_thickness(scene, thickness)))

    return bracketed("thickness", bisect(falls, low, high, settings["width"]), "limit analysis")


def find_factor(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the horizontal acceleration at collapse by limit analysis."""
    ring = structure(scene)
    rules = {"factor": "coulomb", "associated": "coulomb", "flat": "nonassociated"}
    found = {
        name: af.collapse_factor(ring, live=af.BodyForce(1.0), friction=rules[name])
        for name in scene["quantities"]
    }
    # without a state the factor is a bound, which is no answer
    values = {
        name: result.factor
        for name, result in found.items()
        if result.solutions is None or np.isfinite(result.solutions.between[0])
    }
    return {"values": values, "said": "; ".join(str(result) for result in found.values())}


def find_spread(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the largest movement of a support, over the span of the centre line."""
    ring = structure(scene)
    support = scene["blocks"][scene["action"]["block"]]["name"]
    movement = af.Settlement(support, (*scene["action"]["direction"], 0.0))
    found = af.limit.largest_movement(ring, movement, tolerance=settings["tolerance"])
    span = ring.joints[-1].middle[0] - ring.joints[0].middle[0]
    return {"values": {"spread": 100.0 * found.largest / span}, "said": str(found)}


def find_load(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the largest load on a patch of the road, over a fill or on the bare ring."""
    given, fill = scene["action"]["fill"], None
    if given:
        scene = with_lengths(scene, settings.get("thickness", 1.0), settings.get("cover", 0.0))
        fill = fill_of(given, settings)
    stones = structure(scene)
    if given:
        stones = with_fill(stones, scene["action"]["fill"], scene["gravity"])
    elif "bond" in settings:
        stones = bonded(stones, settings["bond"])
    left, right = scene["action"]["patch"]
    count = 7 if right > left else 1
    live = [af.PointLoad(x, (0.0, -1e3 / count)) for x in np.linspace(left, right, count)]
    strength = scene["action"]["strength"] if settings.get("crushing", True) else None
    strength = strength and strength * settings.get("strength", 1.0)
    found = af.collapse_factor(stones, live=live, fill=fill, strength=strength)
    brackets = {"brackets": {"load": (found.lower, found.upper)}} if "gap" in settings else {}
    return {"values": {"load": found.factor}, "said": str(found), **brackets}


def fill_of(
    given: dict[str, Any], settings: dict[str, Any]
) -> af.limit.Fill | af.limit.PlasticFill:
    """Return the strength of a fill."""
    angle = given["friction_angle"]
    cohesion = settings.get("cohesion", given["cohesion"])
    if settings.get("plastic"):
        gap = settings["gap"]
        return af.limit.PlasticFill(friction_angle=angle, cohesion=cohesion, gap=gap)
    mobilisation = settings["mobilisation"]
    return af.limit.Fill(friction_angle=angle, mobilisation=mobilisation, cohesion=cohesion)


def bonded(stones: af.Structure, strength: float) -> af.Structure:
    """Return a structure whose joints have a tensile strength, and at least its cohesion [Pa]."""
    joints = []
    for joint in stones.joints:
        cohesion = max(1.0, joint.contact.coefficient) * strength
        bond = replace(joint.contact, tension=strength, cohesion=cohesion)
        joints.append(replace(joint, contact=bond))
    return replace(stones, joints=tuple(joints))


def with_lengths(scene: dict[str, Any], thickness: float, cover: float) -> dict[str, Any]:
    """Return a ring whose extrados is moved to a share of its thickness, and its cover changed."""
    moved = {}
    for joint in scene["joints"]:
        (x, y), (u, v) = joint["ends"]
        moved[u, v] = [x + thickness * (u - x), y + thickness * (v - y)]

    def place(points: list[list[float]]) -> list[list[float]]:
        return [moved.get((x, y), [x, y]) for x, y in points]

    rise = max(v for _, v in moved.values()) - max(v for _, v in moved)
    action, fill = scene["action"], scene["action"]["fill"]
    fill = {**fill, "surface": fill["surface"] + rise + cover}
    blocks = [{**block, "outline": place(block["outline"])} for block in scene["blocks"]]
    joints = [{**joint, "ends": place(joint["ends"])} for joint in scene["joints"]]
    return {**scene, "blocks": blocks, "joints": joints, "action": {**action, "fill": fill}}


def find_push(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the largest multiple of a force, and that at displacements of its point."""
    action, blocks = scene["action"], structure(scene)
    (x, y), dead = action["point"], [point_load(**load) for load in action["dead"]]
    live = af.PointLoad(x, tuple(action["force"]), y=y)
    values, places = {}, action["displacements"]
    if places:
        joints = tuple(
            replace(joint, contact=stiffened(joint.contact, settings["stiffness"]))
            for joint in blocks.joints
        )
        blocks = replace(blocks, joints=joints)
        model = af.build(blocks, fidelity="rigid", displacements="large")
        stop = af.statics.Stop(displacement=1.1 * max(places.values()) / blocks.size)
        path = af.pushover(model, live, dead=dead, stop=stop).curve
        moved, factors = path["displacement"].values, path["factor"].values
        # beyond the end of the path there is no answer
        values = {
            name: float(np.interp(place, moved, factors, right=np.nan))
            for name, place in places.items()
        }
    others = [name for name in scene["quantities"] if name not in places]
    if others:
        found = af.collapse_factor(blocks, live=live, dead=dead, friction=settings["friction"])
        values |= dict.fromkeys(others, found.factor)
    return {"values": values, "said": "pushed" if places else str(found)}


def point_load(point: list[float], force: list[float]) -> af.PointLoad:
    """Return a load of a scene."""
    return af.PointLoad(point[0], (force[0], force[1]), y=point[1])


def stiffened(contact: af.Contact, factor: float) -> af.Contact:
    """Return a contact with stiffnesses times a factor."""
    normal, shear = factor * contact.normal_stiffness, factor * contact.shear_stiffness
    return replace(contact, normal_stiffness=normal, shear_stiffness=shear)


def with_fill(ring: af.Structure, given: dict[str, Any], gravity: float) -> af.Structure:
    """Return a ring with fill on its back up to a level road."""
    soil = replace(af.masonry.BACKFILL, unit_weight=given["density"] * gravity)
    back = [joint.extrados for joint in ring.joints]
    level = given["surface"]
    outline = (*back, (back[-1][0], level), (back[0][0], level))
    body = af.Block(outline, soil, "fill", part="fill", role="other")
    return af.masonry.assembled(
        [*ring.blocks, body],
        af.masonry.SOIL_TO_STONE,
        joints=ring.joints,
        width=ring.width,
        gravity=gravity,
    )


def ground_motion(scene: dict[str, Any], factor: float = 1.0, dt: float = 1e-3) -> af.Motion:
    """Return the motion of the ground, sampled; jumps lie midway between samples."""
    action = scene["action"]
    times = np.arange(0.0, action["end"] + dt, dt) + 0.5 * dt
    samples = np.interp(times, action["times"], action["accelerations"], right=0.0)
    return af.Motion(factor * samples, dt)


def model_of(scene: dict[str, Any], joints: str) -> Any:
    """Return the model of elastic joints: exact, at the points of the scene, or at two points."""
    laws = [law.get("points") for law in scene["laws"].values()]
    rules: dict[str, dict[str, Any]] = {
        "points": {"quadrature": "trapezoidal", "quadrature_points": laws[0] or 2},
        "exact": {"quadrature": "exact"},
        "lobatto": {"quadrature": "lobatto", "quadrature_points": 2},
    }
    return af.build(
        structure(scene), fidelity="rigid", displacements="large", cells=(1, 1), **rules[joints]
    )


def damping_of(scene: dict[str, Any]) -> Any:
    """Return the damping of a scene, or None."""
    given = scene.get("damping")
    return af.dynamics.StiffnessDamping(given["ratio"], given["frequency"]) if given else None


def find_displacement(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the largest displacements of the observed point to both sides."""
    motion, dt = ground_motion(scene), settings["dt"]
    if settings["joints"] == "rigid":
        times, moved, said = rigid_history(scene, motion, dt)
    else:
        model = model_of(scene, settings["joints"])
        run = shaken(scene, model, motion, dt, af.Record(fields_every=1, repeat=False))
        times, moved = run.displacement["time"].values, observed(scene, run)
        said = run.verdict.headline
    return history(times.tolist(), (1e3 * moved).tolist(), said)


def shaken(
    scene: dict[str, Any], model: Any, motion: af.Motion, dt: float, record: Any = None
) -> Any:
    """Return the history of a model; where a step fails, by varying or by smaller steps."""
    # other programs take each step once
    given = {"damping": damping_of(scene), "record": record or af.Record(repeat=False)}
    for step in (dt, None, dt / 2.0):
        with contextlib.suppress(af.DidNotConverge):
            return af.time_history(model, motion, dt=step, **given)
    return af.time_history(model, motion, dt=dt / 4.0, **given)


def observed(scene: dict[str, Any], run: Any) -> Any:
    """Return the mean horizontal displacement of the observed corners (frames,) [m]."""
    block = scene["observe"]["block"]
    outline = np.array(scene["blocks"][block]["outline"])[scene["observe"]["points"]]
    moved = run.displacement
    places = np.column_stack([moved["x"].values, moved["y"].values])
    owner = np.asarray(moved["block"].values)
    name = scene["blocks"][block]["name"]
    columns = [
        int(np.argmin(np.linalg.norm(places - point, axis=1) + 1e3 * (owner != name)))
        for point in outline
    ]
    still = moved.isel(time=0)
    return (moved - still).values[:, columns, 0].mean(axis=1)


def rigid_history(scene: dict[str, Any], motion: af.Motion, dt: float) -> tuple[Any, Any, str]:
    """Simulate rigid blocks, and return times and displacements of the observed corners."""
    ring = structure(scene)
    simulation = af.dynamics.RigidBlockSimulation(ring, dt=dt)
    start = af.dynamics.LooseBlocks.as_built(ring)
    number = scene["observe"]["block"]
    block = ring.blocks[number]
    arm = (block.points[scene["observe"]["points"]] - block.centroid).mean(axis=0)
    frames = list(simulation.frames(start, scene["action"]["end"], motion, spacing=5 * dt))
    poses = np.array([frame.poses[number] for frame in frames])
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    moved = poses[:, 0] + (c - 1.0) * arm[0] - s * arm[1]
    said = af.dynamics.classify_collapse(ring, frames).text
    return np.array([frame.time for frame in frames]), moved, said


def find_scale(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the least factor on a motion at which a block falls, by bisection."""
    low, high = scene["action"]["between"]
    falls = rigid_falls if settings["joints"] == "rigid" else elastic_falls
    bracket = first_failure(
        lambda factor: not falls(scene, factor, settings), low, high, settings["width"]
    )
    return bracketed("scale", bracket, "first fall, searched upward")


def rigid_falls(scene: dict[str, Any], factor: float, settings: dict[str, Any]) -> bool:
    """Return whether a rigid block falls."""
    ring = structure(scene)
    simulation = af.dynamics.RigidBlockSimulation(ring, dt=settings["dt"])
    start = af.dynamics.LooseBlocks.as_built(ring)
    motion = ground_motion(scene, factor)
    frames = list(simulation.frames(start, scene["action"]["end"], motion))
    return af.dynamics.classify_collapse(ring, frames).time is not None


def elastic_falls(scene: dict[str, Any], factor: float, settings: dict[str, Any]) -> bool:
    """Return whether a block on elastic joints falls."""
    model = model_of(scene, settings["joints"])
    # an amplitude at which a step fails is replaced by one within 0.2 %
    for near in (1.0, 1.002, 0.998):
        with contextlib.suppress(af.DidNotConverge):
            run = shaken(scene, model, ground_motion(scene, near * factor), settings["dt"])
            if run.fall is not None:
                return run.fall.time is not None
    raise RuntimeError(f"no answer at {factor:g}")


def find_rocking(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Release a tilted rigid block; angular velocities at impacts from the energy of its peaks."""
    ring, action, dt = structure(scene), scene["action"], settings["dt"]
    block, tilt = ring.blocks[1], action["tilt"]
    start = af.dynamics.LooseBlocks.as_built(ring)
    arm = block.centroid - block.points[1]  # from the edge about which it is tilted
    c, s = np.cos(tilt), np.sin(tilt)
    start.poses[1] = *(np.array([[c, s], [-s, c]]) @ arm - arm), -tilt
    simulation = af.dynamics.RigidBlockSimulation(ring, dt=dt, rocking_ratio=action["ratio"])
    frames = list(simulation.frames(start, 6.0, spacing=dt))
    times = [float(frame.time) for frame in frames]
    turn = [-float(frame.poses[1, 2]) for frame in frames]
    slender = float(np.arctan2(-arm[0], arm[1]))
    find = {
        "ratio": lambda: rocking_ratio(turn, slender, action["impacts"]),
        "first impact": lambda: impact_time(times, turn, 1),
        "seventh impact": lambda: impact_time(times, turn, 7),
    }
    return {"values": {name: find[name]() for name in scene["quantities"]}, "said": "rigid impacts"}


def find_modulus(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Press a stack of rigid stones with the law of closing of its finish; add their own strain."""
    stack, action, number = structure(scene), scene["action"], settings["law"]
    pressure, depth = action["pressure"], stack.joints[0].depth
    given = {"strength": action["strength"], "stress": pressure}
    laws = af.joint_stiffness(action["young"], depth, action["finish"], **given)
    friction, closure = stack.joints[0].contact.friction, laws.closure[number]
    contact = af.Contact(laws.initial[number], laws.shear[number], friction, closure=closure)
    joints = tuple(replace(joint, contact=contact) for joint in stack.joints)
    top = stack.blocks[-1]
    weight = pressure * depth / top.area
    press = replace(top.material, unit_weight=weight, stands_for="press")
    blocks = (*stack.blocks[:-1], replace(top, material=press))
    dead = af.dead_load(af.build(replace(stack, blocks=blocks, joints=joints), fidelity="rigid"))
    shortening = -float(dead.q[-2])  # of the centroid of the highest stone
    height = len(joints) * top.area / depth
    modulus = pressure / (shortening / height + pressure / action["young"])
    return {"values": {"modulus": modulus / 1e6}, "said": f"law {number} of its finish"}


QUESTIONS = {
    "thickness": find_thickness,
    "sideways": find_factor,
    "spread": find_spread,
    "load": find_load,
    "push": find_push,
    "motion": find_displacement,
    "scaled motion": find_scale,
    "rocking": find_rocking,
    "closing": find_modulus,
}
