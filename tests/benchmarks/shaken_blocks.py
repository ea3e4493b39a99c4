"""A shaken ring of rigid blocks against LMGC90: collapse, displacements, and time of a step.

    python tests/benchmarks/shaken_blocks.py [PYTHON] [--record FILE --column 2] [--scales 0.5 1]

PYTHON is an interpreter with compas_lmgc90, as prisms.py says; without it only archfem runs. LMGC90
has no ground acceleration: its fixed blocks follow the ground's velocity, and displacements are
relative to theirs, which is the same motion. The ring is the validation ring of chords with a
friction of 0.60: with large displacements and joints of its stiffness and of a hundred times that,
and as rigid blocks in contact (`Falling`), with the same scheme as LMGC90. "Down" is a block that
has sunk by half the square root of its area.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from prisms import by_lmgc90
from setting import ground_motion, options, print_left_out
from stepping import SteppedRun
from timing import stopwatch, table

import archfem as af

FRICTION = 0.6

DT, RIGID = 5e-3, 1e-3
"""Time steps with elastic joints, and of rigid blocks [s]."""

DAMPING = af.StiffnessDamping(0.05, 8.0)

SUNK = 0.5


def ring(stiffer: float = 1.0) -> af.Structure:
    """Build the validation ring of chords, with joints stiffer by a factor."""
    contact = replace(
        af.masonry.STONE_TO_STONE,
        normal_stiffness=stiffer * af.masonry.STONE_TO_STONE.normal_stiffness,
        shear_stiffness=stiffer * af.masonry.STONE_TO_STONE.shear_stiffness,
        friction=FRICTION,
    )
    return af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1, contact=contact
    )


def outcome(arch: af.Structure, paths: np.ndarray) -> tuple[str, float, float]:
    """Return whether the ring stands, the peak displacement and that at the end [mm].

    Args:
        arch: the ring.
        paths: displacements of the free blocks (times, n, 2) [m].
    """
    sizes = np.sqrt([arch.blocks[number].area for number in arch.free])
    far = 1e3 * np.hypot(paths[..., 0], paths[..., 1]).max(axis=1)
    down = (paths[..., 1] < -SUNK * sizes).any()
    return ("down" if down else "stands"), far.max(), far[-1]


def run_elastic_joints(stiffer: float, motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """Run with elastic joints and large displacements: outcome, and time of a step [ms]."""
    arch = ring(stiffer)
    model = af.build(arch, fidelity="rigid", displacements="large")
    settings = {"dt": DT, "damping": DAMPING, "record": af.Record(fields_every=1, repeat=False)}
    dead = af.dead_load(model)
    stepped = SteppedRun(lambda: af.time_history(model, motion, start=dead, **settings))
    run = stepped.history
    paths = run.dataset["q"].values.reshape(len(run.dataset["q"]), -1, 3)[..., :2]
    if "fall_pose" in run.dataset:
        after = run.dataset["fall_pose"].values[:, list(arch.free), :2]
        paths = np.concatenate([paths, after])
    return outcome(arch, paths), stepped.time_steps(1).cpu


def run_rigid_blocks(motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """Run as rigid blocks in contact: outcome, and time of a step [ms]."""
    arch = ring()
    falling, start = (
        af.dynamics.RigidBlockSimulation(arch, dt=RIGID, level=-100.0),
        af.dynamics.LooseBlocks.as_built(arch),
    )
    falling.final_frame(start, 10.0 * RIGID, motion)  # compiles
    watch = stopwatch()
    frames = list(falling.frames(start, motion.duration, motion, spacing=0.005))
    spent = watch()[1]
    paths = np.array([frame.poses[list(arch.free), :2] for frame in frames])
    return outcome(arch, paths), 1e3 * spent / round(frames[-1].time / RIGID)


def run_lmgc90(python: str, motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """Run in LMGC90: outcome, and time of a step [ms]."""
    arch, steps = ring(), round(motion.duration / RIGID)
    times = RIGID * np.arange(steps + 2)
    pushed = motion.at(np.minimum(times, motion.duration))[:, 0]
    speed = np.append(0.0, np.cumsum(0.5 * RIGID * (pushed[1:] + pushed[:-1])))
    paths, spent = by_lmgc90(python, arch, FRICTION, RIGID, steps, (times, speed))
    return outcome(arch, (paths - paths[:, :1])[:, list(arch.free)]), spent


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    made = options(__doc__)
    made.add_argument("python", nargs="?", help="interpreter with compas_lmgc90")
    made.add_argument("--scales", type=float, nargs="+", default=[0.5, 1.0, 1.5, 2.0])
    chosen = made.parse_args(arguments)
    if chosen.python is None:
        print_left_out("LMGC90, as no Python interpreter with compas_lmgc90 is given")
    motion, rows = ground_motion(chosen), []
    for scale in chosen.scales[:1] if chosen.quick else chosen.scales:
        shaking = motion.scaled(scale)
        results = {
            "joints × 1": (run_elastic_joints(1.0, shaking), DT),
            "joints × 100": (run_elastic_joints(100.0, shaking), DT),
            "Falling": (run_rigid_blocks(shaking), RIGID),
        }
        if chosen.python:
            results["LMGC90"] = (run_lmgc90(chosen.python, shaking), RIGID)
        for name, (((kind, peak, end), spent), dt) in results.items():
            row = [f"{scale:g}, {name}", kind, f"{peak:.1f}", f"{end:.1f}", 1e3 * dt]
            row += [f"{spent:.4f}", f"{spent / dt:.1f}"]
            if chosen.python:
                # Both times are those of a second of motion.
                row.append(f"{results['LMGC90'][0][1] / RIGID / (spent / dt):.0f}")
            rows.append(row)
    head = ["scale, by", "ring", "peak mm", "end mm", "Δt ms", "ms a step", "ms a second"]
    print(table([*head, *(["LMGC90 / it"] if chosen.python else [])], rows))


if __name__ == "__main__":
    main()
