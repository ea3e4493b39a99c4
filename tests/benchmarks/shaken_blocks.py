"""A shaken ring of loose stones against LMGC90: who stands, how far it moves, what it costs.

    python tests/benchmarks/shaken_blocks.py PYTHON [--record FILE --column 2] [--scales 0.5 1]

PYTHON has what prisms.py says. LMGC90 has no acceleration of the ground: its fixed blocks are
driven by the ground's velocity, and displacements are counted from theirs, which is the same
motion. The ring is the validation ring of chords, whose joints slide at 0.60: by joints of its
stiffness and of a hundred times that (`turning`), and by archfem's own rigid stones (`Falling`),
whose scheme is that of LMGC90. "Down" is a stone that has sunk by half the root of its area.
"""

from dataclasses import replace

import numpy as np
from prisms import by_lmgc90
from setting import ground_motion, options
from timing import stopwatch, table

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for
from archfem.masonry.materials import STONE_TO_STONE

FRICTION = 0.6

DT, RIGID = 5e-3, 1e-3
"""Steps of joints that give, and of rigid stones [s]."""

DAMPING = af.StiffnessDamping(0.05, 8.0)

SUNK = 0.5


def ring(stiffer: float = 1.0) -> af.Structure:
    """The validation ring of chords."""
    contact = replace(
        STONE_TO_STONE,
        normal_stiffness=stiffer * STONE_TO_STONE.normal_stiffness,
        shear_stiffness=stiffer * STONE_TO_STONE.shear_stiffness,
        friction=FRICTION,
    )
    return af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1, contact=contact
    )


def told(arch: af.Structure, paths: np.ndarray) -> tuple[str, float, float]:
    """Who stands, and the largest displacement there was and is [mm].

    Args:
        arch: of blocks.
        paths: displacements of the free blocks (times, n, 2) [m].
    """
    sizes = np.sqrt([arch.blocks[number].area for number in arch.free])
    far = 1e3 * np.hypot(paths[..., 0], paths[..., 1]).max(axis=1)
    down = (paths[..., 1] < -SUNK * sizes).any()
    return ("down" if down else "stands"), far.max(), far[-1]


def by_joints(stiffer: float, motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """By joints that give: what there is to tell, and the time of a step [ms]."""
    arch = ring(stiffer)
    model = af.build(arch, fidelity="rigid", displacements="large")
    kept = af.Record(fields_every=1)
    run = af.time_history(model, motion, dt=DT, damping=DAMPING, record=kept)
    paths = run.dataset["q"].values.reshape(len(run.dataset["q"]), -1, 3)[..., :2]
    if "fall_pose" in run.dataset:
        after = run.dataset["fall_pose"].values[:, list(arch.free), :2]
        paths = np.concatenate([paths, after])
    equation = af.dynamics.Equation(model, motion, DAMPING)
    dead = af.dead_load(model)
    start = equation.at_rest(dead.q, memory=dead.model.memory)
    stepper, end = stepper_for("turning", equation, start, DT), run.dataset.attrs["last_time"]
    list(stepper.batches(start, DT, 4.0 * DT))  # compiled, and loaded
    watch = stopwatch()
    list(stepper.batches(start, DT, end))
    return told(arch, paths), 1e3 * watch()[1] / run.dataset.attrs["steps"]


def by_stones(motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """By rigid stones: what there is to tell, and the time of a step [ms]."""
    arch = ring()
    falling, start = (
        af.dynamics.Falling(arch, dt=RIGID, level=-100.0),
        af.dynamics.Loose.built(arch),
    )
    falling.last(start, 10.0 * RIGID, motion)  # compiles
    watch = stopwatch()
    frames = list(falling.frames(start, motion.duration, motion, spacing=0.005))
    spent = watch()[1]
    paths = np.array([frame.poses[list(arch.free), :2] for frame in frames])
    return told(arch, paths), 1e3 * spent / round(frames[-1].time / RIGID)


def driven(python: str, motion: af.Motion) -> tuple[tuple[str, float, float], float]:
    """By LMGC90: what there is to tell, and the time of a step [ms]."""
    arch, steps = ring(), round(motion.duration / RIGID)
    times = RIGID * np.arange(steps + 2)
    pushed = motion.at(np.minimum(times, motion.duration))[:, 0]
    speed = np.append(0.0, np.cumsum(0.5 * RIGID * (pushed[1:] + pushed[:-1])))
    paths, spent = by_lmgc90(python, arch, FRICTION, RIGID, steps, (times, speed))
    return told(arch, (paths - paths[:, :1])[:, list(arch.free)]), spent


def main(python: str, motion: af.Motion, scales: list[float]) -> None:
    """Print a table."""
    head = [
        "scale, by",
        "it",
        "peak mm",
        "end mm",
        "Δt ms",
        "ms a step",
        "ms a second",
        "LMGC90 / it",
    ]
    rows = []
    for scale in scales:
        shaking = motion.scaled(scale)
        theirs = driven(python, shaking)
        found = {
            "joints × 1": (by_joints(1.0, shaking), DT),
            "joints × 100": (by_joints(100.0, shaking), DT),
            "Falling": (by_stones(shaking), RIGID),
            "LMGC90": (theirs, RIGID),
        }
        for name, (((kind, peak, end), spent), dt) in found.items():
            rows.append(
                [
                    f"{scale:g}, {name}",
                    kind,
                    f"{peak:.1f}",
                    f"{end:.1f}",
                    1e3 * dt,
                    f"{spent:.4f}",
                    f"{spent / dt:.1f}",
                    f"{theirs[1] / spent:.0f}",
                ]
            )
    print(table(head, rows))


if __name__ == "__main__":
    made = options(__doc__.splitlines()[0])
    made.add_argument("python")
    made.add_argument("--scales", type=float, nargs="+", default=[0.5, 1.0, 1.5, 2.0])
    chosen = made.parse_args()
    main(chosen.python, ground_motion(chosen), chosen.scales)
