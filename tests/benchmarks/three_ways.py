"""Random structures three ways: by elastic joints, as loose stones, and as mirror images.

    python tests/benchmarks/three_ways.py [--first 0] [--count 200]

Eight kinds in turn: walls with openings, portals, cracked lintels, pinnacles, columns of drums,
battered walls, stones on two others, and arches on piers; joints, friction and the motion are
random too. A line for each structure has the outcome and the residual displacement of each way.
Where outcomes differ, the motion is repeated at 0.98 and 1.02 times its size: a difference that
stays should be doubted by the verdict of the joints. 200 take 15 minutes on one core.
"""

import argparse
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from setting import plain_options

import archfem as af

Corners = list[tuple[float, float]]


def box(left: float, low: float, right: float, high: float) -> Corners:
    """Return the corners of a rectangle."""
    return [(left, low), (right, low), (right, high), (left, high)]


def wall_with_opening(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield courses on both sides of an opening, and a lintel between two stones above it."""
    half, height, gap = rng.uniform(0.4, 0.7), rng.uniform(0.2, 0.35), rng.uniform(0.6, 1.2)
    count = int(rng.integers(2, 4))
    for course in range(count):
        cuts = [0.0, 0.5, 1.5, 2.0] if course % 2 else [0.0, 1.0, 2.0]
        for start in (0.0, 2.0 * half + gap):
            for a, b in pairwise(cuts):
                low = course * height
                yield box(start + a * half, low, start + b * half, low + height)
    low, high = count * height, (count + 1) * height
    left = 2.0 * half - rng.uniform(0.2, 0.6) * half
    right = 2.0 * half + gap + rng.uniform(0.2, 0.6) * half
    yield box(left, low, right, high)
    yield box(0.0, low, left, high)
    yield box(right, low, 4.0 * half + gap, high)


def portal(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield two posts of some stones and a lintel."""
    breadth, height, gap = rng.uniform(0.3, 0.6), rng.uniform(0.8, 2.0), rng.uniform(0.6, 1.5)
    count = int(rng.integers(1, 4))
    for start in (0.0, breadth + gap):
        for k in range(count):
            yield box(start, height * k / count, start + breadth, height * (k + 1) / count)
    out = rng.uniform(0.0, 0.2)
    yield box(-out, height, 2.0 * breadth + gap + out, height + rng.uniform(0.2, 0.5))


def cracked_lintel(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield two posts, and two halves of a lintel that lean on each other."""
    breadth, height = rng.uniform(0.5, 0.8), rng.uniform(0.6, 1.5)
    gap, depth = rng.uniform(0.2, 0.6) * breadth, rng.uniform(0.2, 0.4)
    middle, end = breadth + gap * rng.uniform(0.4, 0.6), 2.0 * breadth + gap
    yield box(0.0, 0.0, breadth, height)
    yield box(breadth + gap, 0.0, end, height)
    yield box(-0.1, height, middle, height + depth)
    yield box(middle, height, end + 0.1, height + depth)


def pinnacle(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield stones on each other, each narrower than the one below."""
    breadth, low = rng.uniform(0.4, 0.9), 0.0
    for _ in range(int(rng.integers(2, 5))):
        high, top = low + breadth * rng.uniform(0.5, 1.2), breadth * rng.uniform(0.6, 0.95)
        a, b = 0.5 * breadth, 0.5 * top
        yield [(-a, low), (a, low), (b, high), (-b, high)]
        breadth, low = top, high


def drums(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield the drums of a column."""
    breadth, low = rng.uniform(0.4, 1.0), 0.0
    for _ in range(int(rng.integers(2, 6))):
        high = low + breadth * rng.uniform(0.3, 1.2)
        yield box(-0.5 * breadth, low, 0.5 * breadth, high)
        low = high


def battered_wall(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield the courses of a wall with one sloping face."""
    breadth, slope, height = rng.uniform(0.6, 1.2), rng.uniform(0.03, 0.15), rng.uniform(0.25, 0.5)
    for k in range(int(rng.integers(2, 5))):
        low, high = k * height, (k + 1) * height
        yield [(low * slope, low), (breadth, low), (breadth, high), (high * slope, high)]


def stone_on_two(rng: np.random.Generator) -> Iterator[Corners]:
    """Yield two stones beside each other, and one or two on both."""
    first, second, low = rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.8), rng.uniform(0.3, 1.2)
    start = first + rng.uniform(0.0, 0.4)
    yield box(0.0, 0.0, first, low)
    yield box(start, 0.0, start + second, low)
    left, right = rng.uniform(0.0, 0.6) * first, start + second * rng.uniform(0.4, 1.0)
    for _ in range(int(rng.integers(1, 3))):
        high = low + rng.uniform(0.3, 1.0) * (right - left)
        yield box(left, low, right, high)
        low = high


KINDS: tuple[Callable[[np.random.Generator], Iterator[Corners]] | None, ...] = (
    *(wall_with_opening, portal, cracked_lintel, pinnacle, drums, battered_wall, stone_on_two),
    None,
)
"""Kinds of structures by their stones; None stands for an arch on piers."""


def structure(number: int) -> tuple[af.Structure, af.Motion]:
    """Make the structure and the motion of a number."""
    rng = np.random.default_rng(9000 + number)
    kind = KINDS[number % len(KINDS)]
    stones = None if kind is None else list(kind(rng))
    radius, pier = rng.uniform(1.0, 2.5), rng.uniform(0.3, 0.6)
    stiffness = 10.0 ** rng.uniform(9.0, 11.0)
    contact = af.Contact(stiffness, rng.uniform(0.2, 0.6) * stiffness, rng.uniform(0.3, 0.9))
    pga, seed = rng.uniform(0.5, 9.0), int(rng.integers(1000))
    motion = af.Motion.synthetic(duration=3.0, pga=pga, seed=seed)
    if stones is None:
        made = af.arch_on_piers(
            radius=radius,
            thickness=0.24 * radius,
            voussoirs=11,
            pier_breadth=pier * radius,
            courses=[pier * radius] * 2,
            contact=contact,
        )
        return made, motion
    x = [corner[0] for corners in stones for corner in corners]
    ground = af.Block(
        tuple(box(min(x) - 8.0, -1.0, max(x) + 8.0, 0.0)), af.STONE, "ground", fixed=True
    )
    blocks = [
        af.Block(tuple(corners), af.STONE, f"stone {k}", part="wall", role="pier")
        for k, corners in enumerate(stones)
    ]
    return af.masonry.assembled([ground, *blocks], contact), motion


def mirrored(made: af.Structure) -> af.Structure:
    """Return the mirror image of a structure."""
    blocks = [
        replace(
            block,
            outline=tuple(map(tuple, (block.points * [-1.0, 1.0])[::-1].tolist())),
            centre=None if block.centre is None else (-block.centre[0], block.centre[1]),
        )
        for block in made.blocks
    ]
    contact = made.joints[0].contact
    return af.masonry.assembled(blocks, contact, width=made.width, gravity=made.gravity)


def by_joints(made: af.Structure, motion: af.Motion) -> tuple[str, float, int]:
    """Return outcome, residual displacement [m] and number of doubts by elastic joints."""
    try:
        model = af.build(made, fidelity="rigid", displacements="large")
        run = af.time_history(model, motion, dt=0.005, damping=af.StiffnessDamping(0.05, 8.0))
    except af.ArchfemError as error:
        return type(error).__name__, np.nan, 1
    assert run.fall is not None
    return run.fall.kind, run.fall.residual, len(run.verdict.doubts)


def as_loose_stones(made: af.Structure, motion: af.Motion) -> tuple[str, float]:
    """Return outcome and residual displacement [m] of loose stones."""
    simulation = af.dynamics.RigidBlockSimulation(made)
    start = af.dynamics.LooseBlocks.as_built(made)
    try:
        frames = list(simulation.frames(start, motion.duration + 20.0, motion))
    except af.ArchfemError as error:
        return type(error).__name__, np.nan
    found = af.dynamics.classify_collapse(made, frames)
    return found.kind, found.residual


def compare(number: int) -> bool:
    """Print the three ways of a structure; return whether they differ without a doubt."""
    made, motion = structure(number)
    kind = KINDS[number % len(KINDS)]
    name = "arch on piers" if kind is None else kind.__name__.replace("_", " ")
    if not af.stands(made):
        print(f"{number} {name}: does not stand", flush=True)
        return False
    image = replace(motion, horizontal=-motion.horizontal)
    joints, loose = by_joints(made, motion), as_loose_stones(made, motion)
    mirror = by_joints(mirrored(made), image)
    differ = len({joints[0], loose[0], mirror[0]}) > 1
    words = [f"{kind} {1e3 * left:.1f} mm" for kind, left, *_ in (joints, loose, mirror)]
    print(f"{number} {name}: {'; '.join(words)}; {joints[2]} doubts", flush=True)
    if differ:
        for scale in (0.98, 1.02):
            scaled = motion.scaled(scale)
            print(
                f"    {scale} ×: {by_joints(made, scaled)[0]}; {as_loose_stones(made, scaled)[0]}"
            )
    return differ and not joints[2]


def options() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    parser = plain_options(__doc__)
    parser.add_argument("--first", type=int, default=0, help="number of the first structure")
    parser.add_argument("--count", type=int, default=200, help="number of structures")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare structures, and count the differences without a doubt."""
    chosen = options().parse_args(arguments)
    logging.getLogger("archfem").setLevel(logging.ERROR)
    first, count = (4, 1) if chosen.quick else (chosen.first, chosen.count)
    without = [number for number in range(first, first + count) if compare(number)]
    print(f"{len(without)} of {count} differ without a doubt: {without}")


if __name__ == "__main__":
    main()
