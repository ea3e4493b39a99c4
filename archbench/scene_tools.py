"""Helpers that adapters of several programs share; standard library only."""

from collections.abc import Callable
from itertools import pairwise
from math import cos, sin
from typing import Any


def bisect(
    holds: Callable[[float], bool], low: float, high: float, width: float
) -> tuple[float, float]:
    """Return a bracket of the value at which a property ceases to hold, by bisection.

    Args:
        holds: true at `low`, false at `high`.
        low: lower end.
        high: upper end.
        width: of the final bracket, relative to its upper end.

    Raises:
        ValueError: the property does not change between the ends.
    """
    if not holds(low) or holds(high):
        raise ValueError(f"no change between {low:g} and {high:g}: there is nothing to bracket")
    return bisect_within(holds, low, high, width)


def bisect_within(
    holds: Callable[[float], bool], low: float, high: float, width: float
) -> tuple[float, float]:
    """Halve a bracket whose ends are known."""
    while high - low > width * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high


def first_failure(
    holds: Callable[[float], bool], low: float, high: float, width: float
) -> tuple[float, float]:
    """Return a bracket of the least value at which a property fails, searched upward.

    Values rise by half until the property fails, so that none is far beyond the first failure.

    Raises:
        ValueError: it fails at `low` already, or nowhere up to `high`.
    """
    if not holds(low):
        raise ValueError(f"it fails at {low:g} already")
    while low < high:
        above = min(1.5 * low, high)
        if not holds(above):
            return bisect_within(holds, low, above, width)
        low = above
    raise ValueError(f"it holds up to {high:g}")


def bracketed(name: str, bracket: tuple[float, float], said: str = "") -> dict[str, Any]:
    """Return an answer at the middle of a bracket."""
    return {"values": {name: 0.5 * sum(bracket)}, "brackets": {name: bracket}, "said": said}


def history(times: list[float], moved: list[float], said: str) -> dict[str, Any]:
    """Return an answer from the displacements of an observed point [mm], with about 200 of them."""
    peak = max(moved, key=abs)
    sense = 1.0 if peak > 0.0 else -1.0
    values = {"peak": abs(peak), "rebound": max(-sense * u for u in moved)}
    every = max(1, len(times) // 200)
    series = {"time": times[::every], "u": moved[::every]}
    return {"values": values, "series": series, "said": said}


def at_time(action: dict[str, Any], time: float) -> float:
    """Return the acceleration of the ground at a time; of equal times the later counts."""
    times, samples = action["times"], action["accelerations"]
    if time >= times[-1]:
        return 0.0
    k = max(k for k, each in enumerate(times) if each <= time)
    share = (time - times[k]) / (times[k + 1] - times[k])
    return samples[k] + share * (samples[k + 1] - samples[k])


def ground_velocity(
    action: dict[str, Any], dt: float, factor: float = 1.0
) -> tuple[list[float], list[float]]:
    """Return times and velocities of the ground, by the midpoint rule, from rest [s, m/s]."""
    times, speeds = [0.0], [0.0]
    for step in range(round(action["end"] / dt)):
        speeds.append(speeds[-1] + dt * factor * at_time(action, (step + 0.5) * dt))
        times.append((step + 1) * dt)
    return times, speeds


def turned(scene: dict[str, Any], angle: float) -> dict[str, Any]:
    """Return a scene turned clockwise about the origin: gravity then pulls toward +x [rad]."""
    c, s = cos(angle), sin(angle)

    def place(points: list[list[float]]) -> list[list[float]]:
        return [[c * x + s * y, -s * x + c * y] for x, y in points]

    blocks = [{**block, "outline": place(block["outline"])} for block in scene["blocks"]]
    joints = [{**joint, "ends": place(joint["ends"])} for joint in scene["joints"]]
    return {**scene, "blocks": blocks, "joints": joints}


def at_thickness(scene: dict[str, Any], value: float) -> dict[str, Any]:
    """Return the member of a family of structures: points are outline + value × growth."""

    def moved(thing: dict[str, Any], key: str) -> list[list[float]]:
        pairs = zip(thing[key], thing["growth"], strict=True)
        return [[x + value * dx, y + value * dy] for (x, y), (dx, dy) in pairs]

    blocks = [{**block, "outline": moved(block, "outline")} for block in scene["blocks"]]
    joints = [{**joint, "ends": moved(joint, "ends")} for joint in scene["joints"]]
    return {**scene, "blocks": blocks, "joints": joints}


def area_and_centroid(outline: list[list[float]]) -> tuple[float, float, float]:
    """Return the area of a polygon and its centroid."""
    area = x = y = 0.0
    for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True):
        twice = x0 * y1 - x1 * y0
        area += 0.5 * twice
        x += (x0 + x1) * twice / 6.0
        y += (y0 + y1) * twice / 6.0
    return area, x / area, y / area


def polar_moment(outline: list[list[float]]) -> float:
    """Return the second polar moment of a polygon about its centroid [m⁴]."""
    area, cx, cy = area_and_centroid(outline)
    total = 0.0
    for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True):
        twice = x0 * y1 - x1 * y0
        total += twice * (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1) / 12.0
    return total - area * (cx * cx + cy * cy)


def rocking_ratio(angles: list[float], slenderness: float, impacts: int) -> float:
    """Return the mean ratio of angular velocities at impacts, from the peaks between them.

    A rigid block of slenderness α, at rest at an angle θ on its edge, has an energy proportional
    to cos(α - θ) - cos α above that at which it passes the upright position.
    """
    parts: list[list[float]] = [[]]
    for before, after in pairwise(angles):
        parts[-1].append(abs(before))
        if before * after < 0.0:
            parts.append([])
    peaks = [max(part) for part in parts[: impacts + 1] if part]
    if len(parts) <= impacts + 1:
        raise RuntimeError(f"only {len(parts) - 1} impacts, not {impacts + 1}")
    energy = [cos(slenderness - peak) - cos(slenderness) for peak in peaks]
    return float((energy[-1] / energy[0]) ** (0.5 / impacts))


def impact_time(times: list[float], angles: list[float], number: int) -> float:
    """Return when a rocking block passes the upright position for the n-th time [s]."""
    pairs = zip(pairwise(times), pairwise(angles), strict=True)
    found = [t + (u - t) * a / (a - b) for (t, u), (a, b) in pairs if a * b < 0.0]
    if len(found) < number:
        raise RuntimeError(f"only {len(found)} impacts, not {number}")
    return found[number - 1]


def is_convex(outline: list[list[float]], tolerance: float = 1e-9) -> bool:
    """Return whether an anticlockwise polygon is convex."""
    count = len(outline)
    for k in range(count):
        (ax, ay), (bx, by), (cx, cy) = (outline[(k + i) % count] for i in range(3))
        if (bx - ax) * (cy - by) - (by - ay) * (cx - bx) < -tolerance:
            return False
    return True
