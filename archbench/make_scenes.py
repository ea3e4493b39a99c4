"""Write the scenes of the bench from a few lengths each: `python -m archbench.make_scenes`.

The files in `scenes/` are what programs read; this module only saves typing their coordinates.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from math import asin, cos, degrees, pi, radians, sin, sqrt
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
    depth = sqrt((high[0] - low[0]) ** 2 + (high[1] - low[1]) ** 2) / 2.0
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


def family(build: Callable[[float], tuple[list[Scene], list[Scene]]]) -> tuple[list[Scene], list[Scene]]:
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
        parts = family(lambda t, n=stones, c=chords: ring(1.0, t, 180.0, n, 2000.0, c))
        yield scene(
            f"S01_{stones:02d}",
            f"semicircle of {stones} stones under its weight",
            parts,
            {"kind": "thickness", "between": [0.05, 0.2]},
            THICKNESS,
            laws=law(10.0),
            note="Joints do not slide. The radius of the centre line is 1 m.",
        )
    for friction in (0.33, 0.35, 0.40, 0.60):
        yield scene(
            f"S02_{round(100 * friction):03d}",
            f"semicircle of 27 stones, friction {friction:g}",
            family(lambda t: ring(1.0, t, 180.0, 27, 2000.0, 1)),
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


def scenes() -> Iterator[Scene]:
    """Yield all scenes."""
    yield from least_thickness()
    yield from sideways()


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
