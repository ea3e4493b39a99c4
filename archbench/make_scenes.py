"""Write the scenes of the bench from a few lengths each: `python -m archbench.make_scenes`.

Programs read the files in `scenes/`; this module only saves typing their coordinates.
"""

import json
import random
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import atan, cos, degrees, hypot, pi, radians, sin, tau
from typing import Any

from archbench.scene import HERE

Scene = dict[str, Any]
Point = tuple[float, float]

G = 9.81

# Stiff joints of programs that need a stiffness where the question is of rigid blocks [Pa/m]
STIFF = 1e12


def law(friction: float, normal: float = STIFF, shear: float = STIFF) -> dict[str, Any]:
    """Return the law of dry joints by one name."""
    values = {"friction": friction, "normal_stiffness": normal, "shear_stiffness": shear}
    return {"dry": values}


def rounded(points: Sequence[Point]) -> list[list[float]]:
    """Return points as lists, without digits of round-off."""
    return [[round(x, 9) + 0.0, round(y, 9) + 0.0] for x, y in points]


def ring(
    radius: float,
    thickness: float,
    embrace: float,
    stones: int,
    density: float,
    chords: int = 1,
) -> tuple[list[Scene], list[Scene]]:
    """Return blocks and joints of a circular ring about the origin, abutments first and last.

    Args:
        radius: of the centre line [m].
        thickness: from intrados to extrados [m].
        embrace: angle between the springings [degrees].
        stones: number of stones.
        density: of the stones [kg/m³].
        chords: straight pieces of each face of a stone.
    """
    half = radians(embrace) / 2.0
    count = stones * chords
    angles = [half * (2.0 * k / count - 1.0) for k in range(count + 1)]

    def on(r: float, angle: float) -> Point:
        return r * sin(angle), r * cos(angle)

    inner, outer = radius - thickness / 2.0, radius + thickness / 2.0
    blocks = [_abutment("left abutment", on(inner, -half), on(outer, -half), -half, density)]
    for k in range(stones):
        part = angles[k * chords : (k + 1) * chords + 1]
        outline = [on(inner, a) for a in part] + [on(outer, a) for a in reversed(part)]
        blocks.append(block(f"stone {k + 1}", outline, density))
    blocks.append(_abutment("right abutment", on(inner, half), on(outer, half), half, density))
    joints = [
        joint(k, k + 1, on(inner, angles[k * chords]), on(outer, angles[k * chords]))
        for k in range(stones + 1)
    ]
    return blocks, joints


def block(name: str, outline: Sequence[Point], density: float, fixed: bool = False) -> Scene:
    """Return a block by its outline, anticlockwise."""
    return {"name": name, "outline": rounded(outline), "density": density, "fixed": fixed}


def joint(lower: int, higher: int, start: Point, end: Point) -> Scene:
    """Return a dry joint between two blocks, from the intrados to the extrados."""
    return {"blocks": [lower, higher], "ends": rounded([start, end]), "law": "dry"}


def _abutment(name: str, low: Point, high: Point, angle: float, density: float) -> Scene:
    """Return a fixed block behind a springing joint, half as long as the joint is deep."""
    depth = hypot(high[0] - low[0], high[1] - low[1]) / 2.0
    back = (depth * cos(angle), -depth * sin(angle))  # along the axis of the ring
    if angle < 0.0:
        back = (-back[0], -back[1])
    behind = [(x + back[0], y + back[1]) for x, y in (low, high)]
    outline = [low, high, behind[1], behind[0]]
    return block(name, outline if angle < 0.0 else outline[::-1], density, fixed=True)


def scene(
    name: str,
    title: str,
    parts: tuple[list[Scene], list[Scene]],
    action: Scene,
    quantities: dict[str, tuple[str, str]],
    **others: Any,
) -> Scene:
    """Return a scene; quantities are unit and meaning by name."""
    blocks, joints = parts
    return {
        "id": name,
        "title": title,
        "gravity": G,
        "width": 1.0,
        "blocks": blocks,
        "joints": joints,
        "laws": law(0.6),
        "action": action,
        "quantities": {
            key: {"unit": unit, "meaning": meaning} for key, (unit, meaning) in quantities.items()
        },
        **others,
    }


def family(
    build: Callable[[float], tuple[list[Scene], list[Scene]]],
) -> tuple[list[Scene], list[Scene]]:
    """Return blocks and joints whose points grow linearly with a thickness.

    Args:
        build: blocks and joints at a thickness; all points are linear in it.
    """
    low, high = build(0.1), build(0.2)

    def grow(at_low: list[list[float]], at_high: list[list[float]]) -> tuple[Any, Any]:
        rates = [
            (10.0 * (u - x), 10.0 * (v - y)) for (x, y), (u, v) in zip(at_low, at_high, strict=True)
        ]
        start = [(x - 0.1 * u, y - 0.1 * v) for (x, y), (u, v) in zip(at_low, rates, strict=True)]
        return rounded(start), rounded(rates)

    for things, key in ((0, "outline"), (1, "ends")):
        for thing, grown in zip(low[things], high[things], strict=True):
            thing[key], thing["growth"] = grow(thing[key], grown[key])
    return low


FACTOR = {"factor": ("g", "horizontal acceleration, constant in time, at which it collapses")}
THICKNESS = {"thickness": ("-", "least ratio of thickness to radius at which it stands")}


def least_thickness() -> Iterator[Scene]:
    """S01, S02: semicircles of few stones, and of 27 by friction."""
    for stones in (7, 11, 17, 27, 50):
        # sectors of a circle, by chords of 1.5 degrees at most
        chords = round(180.0 / stones / 1.5)
        yield scene(
            f"S01_{stones:02d}",
            f"semicircle of {stones} stones under its weight",
            family(partial(ring, 1.0, embrace=180.0, stones=stones, density=2e3, chords=chords)),
            {"kind": "thickness", "between": [0.05, 0.2]},
            THICKNESS,
            laws=law(10.0),
            note="Joints do not slide. The radius of the centre line is 1 m.",
        )
    for friction in (0.325, 0.35, 0.375, 0.60):
        yield scene(
            f"S02_{round(1000 * friction):03d}",
            f"semicircle of 27 stones, friction {friction:g}",
            family(partial(ring, 1.0, embrace=180.0, stones=27, density=2e3)),
            {"kind": "thickness", "between": [0.05, 0.4]},
            THICKNESS,
            laws=law(friction),
            note="Stones have straight faces. The radius of the centre line is 1 m.",
        )


def sideways() -> Iterator[Scene]:
    """S03, S04: two rings under a horizontal acceleration."""
    yield scene(
        "S03",
        "arch of 157.5°, seven stones, t/R = 0.15, pushed sideways",
        ring(10.0, 1.5, 157.5, 7, 2000.0, 15),
        {"kind": "sideways"},
        FACTOR,
        laws=law(10.0),
        note="Joints do not slide.",
    )
    yield scene(
        "S04",
        "ring of 17 stones with straight faces, pushed sideways",
        ring(2.95, 0.55, 159.0, 17, 2000.0),
        {"kind": "sideways"},
        FACTOR,
    )


def lemos_arch() -> tuple[list[Scene], list[Scene]]:
    """Return the arch of Lemos: a semicircle of 17 stones, 0.5 m thick about a radius of 4 m."""
    return ring(4.0, 0.5, 180.0, 17, 2700.0)


def half_sine(duration: float, pieces: int = 50) -> tuple[list[float], list[float]]:
    """Return times [s] and accelerations of a half sine of peak 1."""
    shares = [k / pieces for k in range(pieces + 1)]
    return [duration * s for s in shares], [sin(pi * s) for s in shares]


def made_motion(seed: int = 7, duration: float = 8.0) -> tuple[list[float], list[float]]:
    """Return times [s] and accelerations of a made motion of peak 1: 40 sines in an envelope."""
    draw, dt = random.Random(seed), 0.01
    # frequencies from 0.5 to 12 Hz, equal in the logarithm
    sines = [(0.5 * 24.0 ** (k / 39), tau * draw.random()) for k in range(40)]
    times = [k * dt for k in range(round(duration / dt) + 1)]

    def at(time: float) -> float:
        rise, fall = min(time / 1.5, 1.0), min((duration - time) / 3.0, 1.0)
        # amplitudes of the upper frequencies decrease, as in spectra of rock
        return rise * fall * sum(sin(tau * f * time + p) / (1.0 + f / 4.0) for f, p in sines)

    samples = [at(time) for time in times]
    peak = max(map(abs, samples))
    return [round(t, 6) for t in times], [round(a / peak, 5) for a in samples]


def scaled(samples: Sequence[float], factor: float) -> list[float]:
    """Return accelerations times a factor, without digits of round-off."""
    return [round(factor * a, 6) for a in samples]


CROWN = {
    "peak": ("mm", "largest horizontal displacement of the crown relative to the ground"),
    "rebound": ("mm", "largest displacement of the crown in the opposite direction"),
}


def arches_in_motion() -> Iterator[Scene]:
    """S05, S06, S07: the arch of Lemos under a half sine and under a made motion."""
    g = 10.0
    common = {
        "gravity": g,
        "laws": {"dry": {**law(0.70021, 1e10, 1e10)["dry"], "points": 3}},
        "damping": {"ratio": 0.05, "frequency": 11.0},
        # the crown is the mean of the outer corners of the ninth stone
        "observe": {"block": 9, "points": [2, 3]},
    }
    times, shape = half_sine(0.25)
    note = (
        "Contact at three points of each face, weights 1/4, 1/2, 1/4; stiffness damping of 5 % at "
        "11 Hz; friction tan 35°."
    )
    yield scene(
        "S05",
        "arch of 17 stones under a half sine of 0.15 g and 0.25 s",
        lemos_arch(),
        {
            "kind": "motion",
            "times": times,
            "accelerations": scaled(shape, 0.15 * g),
            "end": 2.0,
        },
        CROWN,
        **common,
        note=note,
    )
    yield scene(
        "S06",
        "the same arch: least half sine of 0.25 s under which it falls",
        lemos_arch(),
        {
            "kind": "scaled motion",
            "times": times,
            "accelerations": scaled(shape, g),
            "end": 4.0,
            "between": [0.05, 0.4],
        },
        {"scale": ("g", "least peak of the half sine under which a stone falls")},
        **common,
        note=note,
    )
    times, shape = made_motion()
    yield scene(
        "S07",
        "the same arch under a made motion of 8 s and 0.10 g",
        lemos_arch(),
        {"kind": "motion", "times": times, "accelerations": scaled(shape, 0.1 * g), "end": 8.0},
        CROWN,
        **common,
        note=note,
    )


def column() -> tuple[list[Scene], list[Scene]]:
    """Return the column of Dimitri, De Lorenzis and Zavarise: seven drums and a cap on a base."""
    height, cap, foot, top, density = 5.95, 0.21, 1.11, 0.90, 2620.0
    levels = [k * (height - cap) / 7 for k in range(8)] + [height]
    halves = [0.5 * (foot - (foot - top) * y / height) for y in levels]
    blocks = [
        block("base", [(-1.25, -0.75), (1.25, -0.75), (1.25, 0.0), (-1.25, 0.0)], density, True)
    ]
    joints = []
    for k in range(8):
        (low, high), (a, b) = levels[k : k + 2], halves[k : k + 2]
        blocks.append(block(f"drum {k + 1}", [(-a, low), (a, low), (b, high), (-b, high)], density))
        joints.append(joint(k, k + 1, (-a, low), (a, low)))
    return blocks, joints


def overturned_column() -> Iterator[Scene]:
    """S08: a column under a pulse of two rectangles, by the duration of the first."""
    # about a third and twice of published amplitudes [g]
    between = {
        0.2: [0.6, 2.7],
        0.3: [0.4, 1.6],
        0.35: [0.2, 1.4],
        0.4: [0.15, 0.6],
        0.5: [0.15, 0.5],
        1.0: [0.1, 0.4],
    }
    for duration, bracket in between.items():
        ends = [0.0, duration, duration, 3.0 * duration, 3.0 * duration]
        yield scene(
            f"S08_{round(100 * duration):03d}",
            f"column of eight drums, pulse of {duration:g} s: least amplitude that overturns it",
            column(),
            {
                "kind": "scaled motion",
                "times": [round(end, 6) for end in ends],
                "accelerations": [G, G, -0.5 * G, -0.5 * G, 0.0],
                "end": round(3.0 * duration + 4.0, 6),
                "between": bracket,
            },
            {"scale": ("g", "least acceleration a under which a drum falls")},
            laws={"dry": {**law(0.7, 1e10, 1e10)["dry"], "points": 2}},
            note="Acceleration a for t_p, then -a/2 for 2 t_p. Equal times are jumps.",
        )


def pressed_stack() -> Iterator[Scene]:
    """S40: stones of the dry granite walls of Vasconcelos and Lourenço, stacked and pressed."""
    breadth, height, density = 0.2, 0.15, 2000.0
    corners = [(0.0, -height), (breadth, -height), (breadth, 0.0), (0.0, 0.0)]
    blocks = [block("base", corners, density, fixed=True)]
    for k in range(1, 9):
        outline = [(x, y + k * height) for x, y in corners]
        blocks.append(block(f"stone {k}", outline, density))
    joints = [joint(k, k + 1, (0.0, k * height), (breadth, k * height)) for k in range(8)]
    yield scene(
        "S40",
        "modulus of dry sawn granite under 0.5 MPa",
        (blocks, joints),
        {
            "kind": "closing",
            "pressure": 5e5,
            "finish": "sawn",
            "young": 2.02e10,
            "strength": 69.2e6,
        },
        {"modulus": ("MPa", "pressure over the mean strain from no pressure")},
        laws=law(0.65),
        note="Stiffness of the joints is part of the question. Weight is negligible.",
    )


def wall(
    courses: Sequence[Sequence[float]],
    length: float = 0.4,
    height: float = 0.175,
    density: float = 1000.0,
) -> tuple[list[Scene], list[Scene]]:
    """Return a wall of courses from below, in blocks of a length; negative ones are openings."""
    width = length * sum(map(abs, courses[0]))
    blocks = [
        block("base", [(0.0, -height), (width, -height), (width, 0.0), (0.0, 0.0)], density, True)
    ]
    joints = []
    below = [(0, 0.0, width)]
    for row, course in enumerate(courses):
        low, x = row * height, 0.0
        here: list[tuple[int, float, float]] = []
        for part in course:
            end = x + length * abs(part)
            if part > 0.0:
                number = len(blocks)
                outline = [(x, low), (end, low), (end, low + height), (x, low + height)]
                blocks.append(block(f"block {number}", outline, density))
                for other, left, right in below:
                    if min(end, right) - max(x, left) > 1e-6:
                        bed = (max(x, left), low), (min(end, right), low)
                        joints.append(joint(other, number, *bed))
                if here and abs(here[-1][2] - x) < 1e-6:
                    joints.append(joint(here[-1][0], number, (x, low), (x, low + height)))
                here.append((number, x, end))
            x = end
        below = here
    return blocks, joints


def walls() -> Iterator[Scene]:
    """S10: walls of Ferris and Tin-Loi, after tests by Ceradini, pushed sideways."""
    half, whole = [0.5, 1.0, 1.0, 1.0, 1.0, 0.5], [1.0] * 5
    full_even, full_odd = [1.0] * 4, [0.5, 1.0, 1.0, 1.0, 0.5]
    window_even, window_odd = [1.0, 0.5, -1.0, 0.5, 1.0], [0.5, 1.0, -1.0, 1.0, 0.5]
    doors_odd, doors_even = [1.0, -1.0, 1.0, -1.0, 1.0], [0.5, 0.5, -1.0, 0.5, 0.5, -1.0, 0.5, 0.5]
    tower_even, tower_odd = [0.5, 1.0, 1.0, 0.5], [1.0] * 3
    slit_odd, slit_even = [1.0, -1.0, 1.0], [0.5, 0.5, -1.0, 0.5, 0.5]
    house_even, house_odd = [0.5, *[1.0] * 6, 0.5], [1.0] * 7
    panes_odd = [0.5, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 0.5]
    panes_even = [1.0, 0.5, -1.0, 0.5, 1.0, 0.5, -1.0, 0.5, 1.0]
    windows = [window_odd, window_even, window_odd, window_even, window_odd]
    slits = [slit_odd, slit_even, slit_odd, slit_even, slit_odd]
    doors = [doors_odd, doors_even, doors_odd, doors_even, doors_odd]
    panes = [panes_odd, panes_even, panes_odd, panes_even, panes_odd]
    tower = [tower_even, tower_odd, tower_even]
    patterns: list[list[list[float]]] = [
        [half, whole] * 3,
        [half, whole] * 5,
        [full_even, full_odd, full_even, *windows, full_even, full_odd, full_even],
        [half, whole, half, *doors, half, whole, half],
        [*tower, *slits, *tower, *slits, *tower],
        [
            *(house_even, house_odd, house_even, house_odd, *panes),
            *(
                house_odd,
                house_even,
                house_odd,
                *panes,
                house_odd,
                house_even,
                house_odd,
                house_even,
            ),
        ],
    ]
    meanings = {
        "associated": ("g", "acceleration at collapse if joints dilate by their friction"),
        "flat": ("g", "acceleration at collapse if joints slide without dilating"),
    }
    for number, courses in enumerate(patterns, 1):
        yield scene(
            f"S10_{number}",
            f"dry wall {number} of Ferris and Tin-Loi, pushed sideways",
            wall(courses),
            {"kind": "sideways"},
            meanings,
            laws=law(0.65),
        )


# Joints of the granite walls [Pa/m], from the modulus of the walls at their first loading
GRANITE_STIFFNESS = {40: 26.2e9, 100: 26.2e9, 175: 34.0e9, 250: 41.1e9}


def granite_walls() -> Iterator[Scene]:
    """S32: dry walls of granite under a press, pushed at their top beam."""
    courses = [[1.0] * 5, [0.5, 1.0, 1.0, 1.0, 1.0, 0.5]] * 4
    length, top, push, thickness = 1.0, 1.2, 1.325, 0.2
    for press, stiffness in GRANITE_STIFFNESS.items():
        # 20 kN/m³, as in the data base
        blocks, joints = wall(courses, 0.2, 0.15, 20e3 / G)
        beam = [(0.0, top), (length, top), (length, 2.0 * push - top), (0.0, 2.0 * push - top)]
        weight = 20e3 * length * 2.0 * (push - top) * thickness
        ends = [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, length]
        joints += [
            joint(len(blocks) - 6 + k, len(blocks), (ends[k], top), (ends[k + 1], top))
            for k in range(6)
        ]
        blocks.append(block("beam", beam, 20e3 / G))
        capacity = "largest force at the top beam, where the load was raised"
        quantities = {"monotonic": ("kN", f"{capacity} once")}
        if press > 40:
            quantities["cyclic"] = ("kN", f"{capacity} to and fro, mean of both ways")
        yield scene(
            f"S32_{press:03d}",
            f"dry granite wall under {press} kN, pushed in its plane",
            (blocks, joints),
            {
                "kind": "push",
                "point": [0.0, push],
                "force": [1e3, 0.0],
                "dead": [{"point": [0.5, push], "force": [0.0, round(weight - 1e3 * press, 6)]}],
                "displacements": {},
            },
            quantities,
            width=thickness,
            laws=law(0.62, stiffness, 0.4 * stiffness),
            note="The beam is a block that weighs 1 kN of the load. It may turn and rise. Friction "
            "is assumed; 0.65 changes the load by 0.1 kN.",
        )


def wall_out_of_plane() -> Iterator[Scene]:
    """S33: wall 12 of Griffith et al., held at its head, pushed at mid-height."""
    thickness, height, courses, density = 0.11, 1.5, 18, 1800.0
    blocks, joints = wall([[1.0]] * courses, thickness, height / courses, density)
    stop = [(thickness, 1.48), (0.16, 1.48), (0.16, height), (thickness, height)]
    # from the intrados to the extrados, upwards as the other joints are from the left
    side = joint(courses, courses + 1, (thickness, 1.48), (thickness, height))
    blocks.append(block("stop", stop, density, fixed=True))
    weight = round(thickness * height * density * G, 6)
    places = {"at 0.08": 0.0752, "at 0.19": 0.1889, "at 0.36": 0.3621, "at 0.55": 0.5507}
    yield scene(
        "S33",
        "brick wall held at its head, pushed out of its plane",
        (blocks, [*joints, {**side, "law": "smooth"}]),
        {
            "kind": "push",
            "point": [0.0, 0.5 * height],
            "force": [weight, 0.0],
            "dead": [],
            "displacements": {k: round(share * thickness, 9) for k, share in places.items()},
        },
        {
            key: ("weights", f"force where mid-height has moved by {share:g} of the thickness")
            for key, share in places.items()
        },
        laws={**law(0.7, 2e10, 8e9), "smooth": law(1e-6, 2e10, 8e9)["dry"]},
        note="Joints are dry; their stiffness, 20 GPa/m, is assumed.",
    )


def rocking_block(breadth: float, height: float) -> tuple[list[Scene], list[Scene]]:
    """Return a block on a wide base."""
    base = [(-4.0 * height, -0.5), (4.0 * height, -0.5), (4.0 * height, 0.0), (-4.0 * height, 0.0)]
    half = 0.5 * breadth
    outline = [(-half, 0.0), (half, 0.0), (half, height), (-half, height)]
    blocks = [block("base", base, 2650.0, True), block("block", outline, 2650.0)]
    return blocks, [joint(0, 1, (-half, 0.0), (half, 0.0))]


RATIO = ("-", "angular velocity after an impact over that before, mean of the impacts")


SEVENTH = ("s", "time from release to the seventh impact")


def rocking() -> Iterator[Scene]:
    """S11, S12, S13: blocks released from half of the angle at which they overturn."""
    # breadth and height [m], description, ratio of angular velocities that is given
    blocks: dict[str, tuple[float, float, str, float | None]] = {
        "S11": (0.6, 2.4, "block 0.6 by 2.4 m, rigid impacts", None),
        "S12_1": (0.25, 1.0, "granite block 0.25 by 1.0 m", None),
        "S12_2": (0.17, 1.0, "granite block 0.17 by 1.0 m", None),
        "S12_3": (0.12, 1.0, "granite block 0.12 by 1.0 m", None),
        "S12_1r": (0.25, 1.0, "granite block 0.25 by 1.0 m, ratio 0.936 given", 0.936),
        "S12_2r": (0.17, 1.0, "granite block 0.17 by 1.0 m, ratio 0.973 given", 0.973),
        "S12_3r": (0.12, 1.0, "granite block 0.12 by 1.0 m, ratio 0.978 given", 0.978),
        "S13_3": (1.0 / 3.0, 1.0, "block of aspect ratio 3 on concrete", None),
        "S13_5": (0.2, 1.0, "block of aspect ratio 5 on concrete", None),
    }
    for name, (breadth, height, title, ratio) in blocks.items():
        quantities = {"seventh impact": SEVENTH} if ratio else {"ratio": RATIO}
        others: Scene = {}
        if name == "S11":
            quantities["first impact"] = ("s", "time from release to the first impact")
        elif name.startswith("S12"):
            quantities["seventh impact"] = SEVENTH
            others["from_memory"] = ["sizes", "ratio"] if ratio else ["sizes"]
        yield scene(
            name,
            f"free rocking: {title}",
            rocking_block(breadth, height),
            {
                "kind": "rocking",
                "tilt": round(0.5 * atan(breadth / height), 9),
                "impacts": 4,
                "ratio": ratio,
            },
            quantities,
            laws=law(5.0),
            note="The block does not slide.",
            **others,
        )


def spreading() -> Iterator[Scene]:
    """S15: semicircles whose left support moves outward until they fall."""
    for ratio in (0.12, 0.15):
        yield scene(
            f"S15_{round(100 * ratio)}",
            f"semicircle of 8 stones, t/R = {ratio:g}, left support moves outward",
            ring(1.0, ratio, 180.0, 8, 2000.0, 16),
            {"kind": "spread", "block": 0, "direction": [-1.0, 0.0]},
            {"spread": ("% of span", "largest movement, over the span of the centre line")},
            laws=law(10.0),
            note="Joints do not slide. The span of the centre line is 2 m.",
        )


def segment(
    span: float, rise: float, thickness: float, stones: int, density: float
) -> tuple[list[Scene], list[Scene]]:
    """Return a ring by clear span and rise, with its springings at y = 0 and the span centred."""
    inner = (0.25 * span**2 + rise**2) / (2.0 * rise)
    embrace = 2.0 * degrees(2.0 * atan(2.0 * rise / span))
    blocks, joints = ring(inner + thickness / 2.0, thickness, embrace, stones, density)
    for thing, key in [*((b, "outline") for b in blocks), *((j, "ends") for j in joints)]:
        thing[key] = rounded([(x, y - inner + rise) for x, y in thing[key]])
    return blocks, joints


LENGTHS = ["rise", "thickness", "width", "cover"]

# span, rise, thickness, width, cover [m], density of stones [kg/m³], position of the load
BRIDGES = {
    "S20": ("Prestwood bridge", 6.55, 1.428, 0.22, 3.80, 0.165, 1800.0, 0.25),
    "S21_torksey": ("Torksey bridge", 4.90, 1.150, 0.343, 7.80, 0.246, 2100.0, 0.25),
    "S21_shinafoot": ("Shinafoot bridge", 6.16, 1.190, 0.542, 7.03, 0.215, 2300.0, 0.25),
    "S21_strathmashie": ("Strathmashie bridge", 9.42, 2.99, 0.60, 5.81, 0.41, 2300.0, 0.25),
    "S21_barlae": ("Barlae bridge", 8.53, 1.69, 0.45, 9.80, 0.295, 2300.0, 0.25),
    "S21_cr155": ("bridge in a laboratory", 4.0, 2.0, 0.25, 6.0, 0.25, 2200.0, 0.25),
    "S22": ("Bridgemill bridge", 18.29, 2.840, 0.711, 8.30, 0.203, 2300.0, 0.25),
}


def bridges() -> Iterator[Scene]:
    """S20, S21, S22: bridges under a line load over their width until they collapsed."""
    from_memory = {"S20": ["cover"], "S22": ["span", *LENGTHS], "S21_cr155": LENGTHS[1:]}
    for name, (place, span, rise, thickness, width, cover, density, share) in BRIDGES.items():
        x = (share - 0.5) * span
        notes = {"S20": "Densities, strength and fill as published."}
        known = "Densities, strength and fill assumed."
        skew = " The skew of 29° is neglected." if name == "S21_barlae" else ""
        yield scene(
            name,
            f"{place}, line load on the road at a quarter of its span",
            segment(span, rise, thickness, 40, density),
            {
                "kind": "load",
                "patch": [round(x - 0.15, 6), round(x + 0.15, 6)],
                "fill": {
                    "surface": round(rise + thickness + cover, 6),
                    "density": 2040.0,
                    "friction_angle": 30.0 if name == "S20" else 37.0,
                    "cohesion": 5e3 if name == "S20" else 0.0,
                },
                "strength": 4.5e6 if name == "S20" else 5e6,
            },
            {"load": ("kN", "largest load over the whole width")},
            width=width,
            note=notes.get(name, known) + skew,
            from_memory=from_memory.get(name, LENGTHS),
        )


def elliptical_bridge() -> Iterator[Scene]:
    """S21: the bridge at Preston, a half ellipse loaded at a third of its span."""
    span, rise, thickness, cover = 5.18, 1.64, 0.36, 0.38
    x = -span / 6.0
    yield scene(
        "S21_preston",
        "Preston bridge, line load on the road at a third of its span",
        half_ellipse(span / 2.0, rise, thickness, 40, 2300.0),
        {
            "kind": "load",
            "patch": [round(x - 0.375, 6), round(x + 0.375, 6)],
            "fill": {
                "surface": round(rise + thickness + cover, 6),
                "density": 2040.0,
                "friction_angle": 37.0,
                "cohesion": 0.0,
            },
            "strength": 5e6,
        },
        {"load": ("kN", "largest load over the whole width")},
        width=5.7,
        note="Densities, strength and fill assumed. Its ring crushed below the load.",
        from_memory=["span", "rise", "width", "cover"],
    )


def half_ellipse(
    half_span: float, rise: float, thickness: float, stones: int, density: float
) -> tuple[list[Scene], list[Scene]]:
    """Return a ring about a half ellipse, with joints normal to it."""
    inner, outer = [], []
    for k in range(stones + 1):
        angle = pi * k / stones
        x, y = -half_span * cos(angle), rise * sin(angle)
        normal = (x / half_span**2, y / rise**2)
        size = hypot(*normal)
        inner.append((x, y))
        outer.append((x + thickness * normal[0] / size, y + thickness * normal[1] / size))
    blocks = [_abutment("left abutment", inner[0], outer[0], -pi / 2.0, density)]
    blocks += [
        block(f"stone {k + 1}", [inner[k], inner[k + 1], outer[k + 1], outer[k]], density)
        for k in range(stones)
    ]
    blocks.append(_abutment("right abutment", inner[-1], outer[-1], pi / 2.0, density))
    return blocks, [joint(k, k + 1, inner[k], outer[k]) for k in range(stones + 1)]


def mortared_arches() -> Iterator[Scene]:
    """S28 to S31: arches of bricks in mortar under a load that was raised until they failed."""
    extrados = (3.30, 0.83)  # span and rise of the extrados of both arches of old bricks [m]
    bond = "The bond of the mortar was not measured; here joints are dry."
    weight = "The weight of the bricks is assumed."
    old = f"Span and rise of the extrados 3.30 m and 0.83 m. {bond} {weight}"
    # title, parts, width [m], place of the load [m], strength [Pa], note
    arches: dict[str, tuple[str, Any, float, float | None, float, str]] = {
        "S28": (
            "semicircle of bricks in mortar, load at the crown",
            ring(1.0 + 0.125 / 2.0, 0.125, 180.0, 50, 1807.0),
            *(0.25, 0.0, 6.63e6, f"Span 2.0 m. {bond}"),
        ),
        "S29": (
            "arch of 156° of bricks in mortar, load at a quarter of its span",
            ring(0.75 + 0.05 / 2.0, 0.05, 156.0, 59, 1800.0),
            *(0.45, -1.467 / 4.0, 9.1e6, f"Inner radius 0.75 m. {bond} {weight}"),
        ),
        "S30": (
            "arch of old bricks in lime mortar, load at 0.556 m from its springing",
            below(*extrados, 0.12, 50, 1800.0),
            *(0.25, None, 3.5e6, old),
        ),
        "S31": (
            "vault of old bricks in lime mortar, load at 0.556 m from its springing",
            below(*extrados, 0.06, 50, 1800.0),
            *(0.30, None, 3.5e6, old),
        ),
    }
    for name, (title, parts, width, place, strength, note) in arches.items():
        # from the inner end of the left springing where the test says so
        x = parts[1][0]["ends"][0][0] + 0.556 if place is None else place
        yield scene(
            name,
            title,
            parts,
            {"kind": "load", "patch": [round(x, 6)] * 2, "fill": None, "strength": strength},
            {"load": ("kN", "largest load")},
            width=width,
            note=note,
        )


def below(
    span: float, rise: float, thickness: float, stones: int, density: float
) -> tuple[list[Scene], list[Scene]]:
    """Return a ring by span and rise of its extrados."""
    outer = (0.25 * span**2 + rise**2) / (2.0 * rise)
    embrace = degrees(4.0 * atan(2.0 * rise / span))
    return ring(outer - thickness / 2.0, thickness, embrace, stones, density)


def point_load() -> Iterator[Scene]:
    """S27: a bare arch under a point load at a joint."""
    inner, thickness = 1.806, 0.1661 * 1.806
    outer, angle = inner + thickness, pi / 2.0 - 8.0 * pi / 27.0
    x = round(-outer * sin(angle), 6)
    yield scene(
        "S27",
        "semicircle of 27 stones, point load at the eighth joint",
        ring(inner + thickness / 2.0, thickness, 180.0, 27, 1530.0, 4),
        {"kind": "load", "patch": [x, x], "fill": None, "strength": None},
        {"load": ("kN", "largest load")},
        width=0.25,
        laws=law(10.0),
        note="Joints do not slide.",
    )


def scenes() -> Iterator[Scene]:
    """Yield all scenes."""
    for group in (
        *(least_thickness, sideways, arches_in_motion, overturned_column, walls, rocking),
        *(granite_walls, wall_out_of_plane, pressed_stack),
        *(spreading, bridges, elliptical_bridge, point_load, mortared_arches),
    ):
        yield from group()


def main() -> None:
    """Write all scenes."""
    folder = HERE / "scenes"
    for each in scenes():
        text = json.dumps(each, ensure_ascii=False, separators=(",", ":"))
        # one block or joint a line: differences between versions stay readable
        text = text.replace(',{"', ',\n{"').replace('":[{"', '":[\n{"')
        (folder / f"{each['id']}.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
