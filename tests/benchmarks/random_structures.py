"""Random structures under random motions: every run ends in an answer or in an error of ours.

    python tests/benchmarks/random_structures.py [--count 200] [--seed 0] [--displacements large]
    python tests/benchmarks/random_structures.py --neighbours [--count 200] [--seed 0]

Rings, arches on piers and columns of stones, of random shapes, joints and friction, under made
motions of up to 2 g, where displacements are large to the ground or to rest; a line for each that
is not plain, or for each, and the totals. Energy that rises by more than 1e-4 of what was exchanged
is wrong; loose stones that gain more than that end in an error of ours.

Neighbours are stacks of stones side by side with gaps up to 10 cm, and walls of running bond, half
of them beside a fixed wall. Each is simulated with joints, and as rigid blocks from the start.
Printed are the verdicts, and the deepest overlaps by separating axes: while joints hold, of stones
without a joint, and of those with one beyond its compression; then both of loose stones. Where the
verdicts differ, both are simulated again at scales of 0.98 to 1.02, to show whether the case is at
an edge.
"""

import logging
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from setting import plain_options

import archfem as af

DT = 0.005

RISE = 1e-4
"""Energy from nowhere, relative to the largest exchanged, from which a run is wrong."""

WIDTH = 160
"""Most letters of an outcome."""


def contact(rng: np.random.Generator) -> af.Contact:
    """Joints from soft to nearly rigid, from slippery to such that never slide."""
    stiff = 10.0 ** rng.uniform(8.5, 11.0)
    friction = None if rng.random() < 0.15 else rng.uniform(0.3, 0.9)
    return af.Contact(stiff, rng.uniform(0.1, 0.6) * stiff, friction)


def structure(rng: np.random.Generator) -> af.Structure:
    """A ring, an arch on piers, or a column."""
    joints, kind = contact(rng), rng.integers(3)
    if kind == 0:
        radius = rng.uniform(1.0, 8.0)
        return af.circular_arch(
            radius=radius,
            thickness=radius * rng.uniform(0.1, 0.3),
            embrace=rng.uniform(100.0, 180.0),
            voussoirs=int(rng.integers(5, 26)),
            contact=joints,
        )
    if kind == 1:
        radius = rng.uniform(1.0, 4.0)
        return af.arch_on_piers(
            radius=radius,
            thickness=radius * rng.uniform(0.15, 0.3),
            voussoirs=int(rng.integers(7, 18)),
            pier_breadth=radius * rng.uniform(0.4, 0.8),
            courses=[radius * rng.uniform(0.2, 0.5)] * int(rng.integers(1, 5)),
            contact=joints,
        )
    breadth = rng.uniform(0.3, 1.5)
    return af.column(
        breadth=breadth,
        heights=[breadth * rng.uniform(0.4, 2.0) for _ in range(rng.integers(1, 6))],
        contact=joints,
    )


@dataclass(frozen=True)
class Came:
    """The result of a run.

    Attributes:
        kind: in a word.
        words: the outcome or the error.
        steps: that were taken.
        halved: of those, that had to be halved.
        left: steps that a strategy left to SNES.
        drift: of energy, relative to the largest exchanged [-].
        spent: CPU time of a step, fallen blocks included [ms].
    """

    kind: str
    words: str
    steps: int = 0
    halved: int = 0
    left: int = 0
    drift: float = 0.0
    spent: float = 0.0


def tried(seed: int, displacements: str, duration: float = 4.0) -> Came:
    """Run one structure under one motion."""
    rng = np.random.default_rng(seed)
    try:
        built = structure(rng)
        motion = af.Motion.synthetic(
            duration=duration, pga=rng.uniform(0.5, 20.0), seed=int(rng.integers(1000))
        )
        damping = None if rng.random() < 0.3 else af.StiffnessDamping(0.05, 8.0)
        fidelity = ("rigid", "faces")[int(rng.random() < 0.15)]
        model = af.build(built, fidelity=fidelity, cells=(2, 2), displacements=displacements)
        begun = time.process_time()
        run = af.time_history(model, motion, dt=DT, damping=damping)
        spent = 1e3 * (time.process_time() - begun)
    except af.ArchfemError as error:
        return Came(type(error).__name__, str(error)[:WIDTH])
    except Exception as error:  # an error that is not archfem's own
        return Came("FOREIGN", f"{type(error).__name__}: {error}"[:WIDTH])
    summary, finite = run.dataset.attrs, bool(np.isfinite(run.joints["N"]).all())
    steps, drift = summary["steps"], float(summary["energy_drift"])
    counts = steps, summary["halved_steps"], summary["fallback_steps"], drift
    words = f"{built.name}, {fidelity}: {run.fall.text if run.fall else run.outcome}"[:WIDTH]
    kind = run.fall.kind if run.fall else "answer"
    wrong = not finite or abs(drift) > RISE
    return Came("WRONG" if wrong else kind, words, *counts, spent / steps)


Lines = list[tuple[tuple[int, int], tuple[float, float], tuple[float, float]]]
"""Blocks and ends of joints."""


def rectangle(name: str, left: float, low: float, right: float, high: float, **options) -> af.Block:
    """Build a rectangular stone."""
    return af.Block(
        ((left, low), (right, low), (right, high), (left, high)), af.STONE, name, **options
    )


def stacks(rng: np.random.Generator, blocks: list[af.Block], count: int) -> tuple[Lines, float]:
    """Add stacks on block 0; return their joints, and where the next begins."""
    joints: Lines = []
    left = 0.0
    for stack in range(count):
        breadth, low, below = rng.uniform(0.3, 0.9), 0.0, 0
        for course in range(rng.integers(1, 5)):
            high, right, name = (
                low + breadth * rng.uniform(0.4, 1.6),
                left + breadth,
                (stack, course),
            )
            joints.append(((below, len(blocks)), (left, low), (right, low)))
            below = len(blocks)
            blocks.append(rectangle(f"stone {name}", left, low, right, high, part=f"stack {stack}"))
            low = high
        left += breadth + rng.uniform(0.0, 0.1)
    return joints, left


def running_bond(rng: np.random.Generator, blocks: list[af.Block]) -> tuple[Lines, float]:
    """Add a wall without joints in its courses; return its joints, and where the next begins."""
    length, courses = int(rng.integers(3, 6)), int(rng.integers(3, 5))
    breadth, height = rng.uniform(0.3, 0.6), rng.uniform(0.15, 0.3)
    joints: Lines = []
    below = [(0, -np.inf, np.inf)]
    for course in range(courses):
        shifted = [0.0, *(np.arange(length) + 0.5), length]
        ends = breadth * np.array(shifted if course % 2 else np.arange(length + 1.0))
        low, row = course * height, []
        for left, right in pairwise(ends.tolist()):
            number, name = len(blocks), f"stone {(course, len(row))}"
            blocks.append(rectangle(name, left, low, right, low + height, part="bond"))
            row.append((number, left, right))
            for lower, start, end in below:
                shared = max(left, start), min(right, end)
                if shared[1] - shared[0] > 1e-9:
                    joints.append(((lower, number), (shared[0], low), (shared[1], low)))
        below = row
    return joints, length * breadth + rng.uniform(0.0, 0.1)


def neighbours(rng: np.random.Generator) -> af.Structure:
    """Build stacks side by side, or a wall of running bond, half of them beside a fixed wall."""
    stiff = 10.0 ** rng.uniform(9.5, 11.0)
    joint = af.Contact(stiff, rng.uniform(0.2, 0.6) * stiff, rng.uniform(0.3, 0.9))
    blocks, walled = [rectangle("floor", -6.0, -1.0, 12.0, 0.0, fixed=True)], rng.random() < 0.5
    if rng.random() < 0.67:
        lines, place = stacks(rng, blocks, int(rng.integers(1 if walled else 2, 4)))
    else:
        lines, place = running_bond(rng, blocks)
    if walled:
        high = rng.uniform(0.5, 3.0)
        blocks.append(rectangle("wall", place, 0.0, place + 1.0, high, fixed=True))
    joints = [af.Joint(*line, joint, f"joint {k}") for k, line in enumerate(lines)]
    return af.Structure(tuple(blocks), tuple(joints), name="walled" if walled else "open")


def overlap_depth(one: np.ndarray, two: np.ndarray) -> float:
    """Return the least width of the overlap of two rectangles across their edges [m]."""
    edges = np.concatenate([np.diff(one[:3], axis=0), np.diff(two[:3], axis=0)])
    across = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    a, b = one @ across.T, two @ across.T
    return float(np.minimum(a.max(0) - b.min(0), b.max(0) - a.min(0)).min())


def deepest_overlaps(
    built: af.Structure, frames: np.ndarray, own: np.ndarray
) -> tuple[float, float]:
    """Return the deepest overlaps of stones without a joint, and with one beyond its own [m].

    Args:
        built: stones, all of them rectangles.
        frames: poses (frames, n_blocks, 3) [m, m, rad].
        own: compression of the joints (frames, n_joints) [m].
    """
    centres = np.array([block.centroid for block in built.blocks])
    arms = np.array([block.points for block in built.blocks]) - centres[:, None]
    fixed = np.array([block.fixed for block in built.blocks])
    joined = {tuple(pair): k for k, pair in enumerate(built.pairs.tolist())}
    apart = beyond = 0.0
    for poses, compression in zip(frames, own, strict=True):
        c, s = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
        x, y = np.moveaxis(arms, -1, 0)
        corners = np.stack([c * x - s * y, s * x + c * y], axis=-1)
        corners += (centres + poses[:, :2])[:, None]
        low, high = corners.min(axis=1), corners.max(axis=1)
        meet = (np.minimum(high[:, None], high) - np.maximum(low[:, None], low)).min(axis=-1) > 0.0
        for one, two in np.argwhere(np.triu(meet & ~np.outer(fixed, fixed), 1)).tolist():
            depth = overlap_depth(corners[one], corners[two])
            if (one, two) in joined:
                beyond = max(beyond, depth - compression[joined[one, two]])
            else:
                apart = max(apart, depth)
    return apart, beyond


@dataclass(frozen=True)
class Compared:
    """Verdict of one simulation."""

    kind: str
    residual: float  # [m]
    words: str
    drift: float = 0.0  # of energy, relative to the largest exchanged [-]
    # while joints hold, of stones without a joint and beyond joints; the same of loose stones [m]
    overlaps: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


def by_joints(built: af.Structure, motion: af.Motion, *, measure: bool) -> Compared:
    """Simulate with joints and large displacements, and measure overlaps at every step."""
    model = af.build(built, fidelity="rigid", displacements="large")
    damping, record = af.StiffnessDamping(0.05, 8.0), af.Record(fields_every=1)
    try:
        run = af.time_history(model, motion, dt=DT, damping=damping, record=record)
    except af.ArchfemError as error:
        return Compared(type(error).__name__, np.nan, str(error))
    found = Compared(
        run.fall.kind, run.fall.residual, run.outcome, run.dataset.attrs["energy_drift"]
    )
    if not measure:
        return found
    states = run.dataset["q"].values
    gap, slip, turn = np.moveaxis(model.measures(states), -1, 0)
    own = 0.5 * np.maximum(built.depths - np.abs(slip), 0.0) * np.abs(turn) - gap
    poses = np.array([model.rigid_motions(q, q)[0] for q in states])
    overlaps = deepest_overlaps(built, poses, np.maximum(own, 0.0))
    loose = np.empty((0, len(built.blocks), 3))
    if "fall_pose" in run.dataset:
        # the first frame is of the joints, still compressed
        loose = run.dataset["fall_pose"].values[1:]
    after = deepest_overlaps(built, loose, np.zeros((len(loose), len(built.joints))))
    return replace(found, overlaps=(*overlaps, *after))


def by_rigid_blocks(built: af.Structure, motion: af.Motion) -> Compared:
    """Simulate as rigid blocks from the start."""
    simulation, start = (
        af.dynamics.RigidBlockSimulation(built),
        af.dynamics.LooseBlocks.as_built(built),
    )
    try:
        frames = list(simulation.frames(start, motion.duration + 20.0, motion))
    except af.ArchfemError as error:
        return Compared(type(error).__name__, np.nan, str(error))
    fall = af.dynamics.classify_collapse(built, frames)
    return Compared(fall.kind, fall.residual, fall.text)


def compare_neighbours(seeds: range, duration: float) -> None:
    """Print verdicts and overlaps of neighbours by both simulations, and the counts."""
    pairs, edges = [], 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        built, peak = neighbours(rng), rng.uniform(0.5, 12.0)
        motion = af.Motion.synthetic(duration=duration, pga=peak, seed=int(rng.integers(1000)))
        found, expected = by_joints(built, motion, measure=True), by_rigid_blocks(built, motion)
        pairs.append((found, expected))
        depths = " ".join(f"{1e3 * depth:.2f}" for depth in found.overlaps)
        print(
            f"{seed:5} {found.kind}, {found.residual:.3f} m; {expected.kind}, "
            f"{expected.residual:.3f} m; overlaps {depths} mm; {found.words[:WIDTH]}",
            flush=True,
        )
        if found.kind != expected.kind:
            scaled = [motion.scaled(scale) for scale in (0.98, 0.99, 1.01, 1.02)]
            near = [by_joints(built, each, measure=False).kind for each in scaled]
            rigid = [by_rigid_blocks(built, each).kind for each in scaled]
            edges += bool({found.kind, *near} & {expected.kind, *rigid})
            print(f"      at 0.98, 0.99, 1.01, 1.02: {near}; rigid blocks {rigid}", flush=True)
    same = sum(found.kind == expected.kind for found, expected in pairs)
    print(f"{same} of {len(pairs)} verdicts are equal, {edges} more within 2 % of the scale")
    print(dict(Counter(found.words.partition(" s by ")[2].partition(":")[0] for found, _ in pairs)))
    deepest = 1e3 * np.array([found.overlaps for found, _ in pairs])
    for name, depths in zip(
        ("apart", "beyond joints", "loose", "loose joints"), deepest.T, strict=True
    ):
        print(f"{name}: {depths.max():.2f} mm, {int(np.sum(depths > 1.0))} above 1 mm")
    print(f"largest drift {max(abs(found.drift) for found, _ in pairs):.1e}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print unusual runs, and the totals."""
    made = plain_options(__doc__)
    made.add_argument("--count", type=int, default=200)
    made.add_argument("--seed", type=int, default=0)
    made.add_argument("--displacements", default="small", choices=("small", "large"))
    made.add_argument("--neighbours", action="store_true", help="compare with rigid blocks")
    made.add_argument("--all", action="store_true", help="print a line for each run")
    chosen = made.parse_args(arguments)
    duration = 4.0
    if chosen.quick:
        chosen.count, duration = 2, 0.5
    logging.getLogger("archfem").setLevel(logging.ERROR)
    if chosen.neighbours or chosen.quick:
        compare_neighbours(range(chosen.seed, chosen.seed + chosen.count), duration)
    if chosen.neighbours:
        return
    runs = []
    for seed in range(chosen.seed, chosen.seed + chosen.count):
        came = tried(seed, chosen.displacements, duration)
        runs.append(came)
        if chosen.all or not came.steps or came.kind == "WRONG":
            print(
                f"{seed:5} {came.kind:16} {came.steps:4} steps, {came.halved} halved, "
                f"{came.left} by SNES, drift {came.drift:.1e}, {came.spent:.3f} ms; {came.words}",
                flush=True,
            )
    done = [came for came in runs if came.steps]
    print(dict(Counter(came.kind for came in runs)))
    print(
        f"{sum(came.steps for came in done)} steps, {sum(came.halved for came in done)} halved, "
        f"{sum(came.left for came in done)} by SNES in {sum(came.left > 0 for came in done)} runs; "
        f"largest drift {max(abs(came.drift) for came in done):.1e}; "
        f"median {np.median([came.spent for came in done]):.3f} ms a step"
    )


if __name__ == "__main__":
    main()
