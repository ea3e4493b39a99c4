"""Walls of loose stones: time of a step, settling of impulses, and LMGC90 at equal displacement.

    python tests/benchmarks/walls.py [PYTHON] [--tolerances 1e-2 1e-3 1e-4] [--steps 50]
    python tests/benchmarks/walls.py --sine 2 --steps 500

PYTHON is an interpreter with compas_lmgc90, as prisms.py says; without it only archfem runs. Walls
in running bond stand under a constant ground acceleration, or a sine, at a friction of 0.6. Given
are the largest displacement of a stone relative to the ground, the processor time of a step, the
sweeps over the contacts in the median step, and the share of steps whose impulses did not settle.
Walls up to 405 stones under a constant 0.8 g, which slide on their foundation and in their beds,
are compared with LMGC90 at several of its tolerances, in the same run.
"""

from collections.abc import Sequence

import numpy as np
from prisms import by_lmgc90
from scenes import wall
from setting import plain_options, print_left_out
from timing import stopwatch, table

import archfem as af

WALLS = {51: (6, 6.4), 103: (9, 8.8), 405: (30, 10.4), 1602: (36, 35.2)}
"""Courses and length [m] by the number of stones."""

DT, G, FRICTION = 1e-3, 9.81, 0.6
"""Time step [s], gravity [m/s²] and coefficient of friction."""

PEAKS = (0.3, 0.6, 0.8)
"""Ground accelerations, over gravity."""

COMPARED = 405
"""Stones of the largest wall given to LMGC90."""


def by_archfem(structure: af.Structure, accelerations: np.ndarray) -> list[float]:
    """Return displacement [mm], time of a step [ms], sweeps of the median step, share unsettled."""
    steps = len(accelerations) - 1
    simulation = af.dynamics.RigidBlockSimulation(structure, dt=DT)
    ground = af.Motion(accelerations, DT)
    start = af.dynamics.LooseBlocks.as_built(structure)
    simulation.final_frame(start, 2.0 * DT, ground)  # compiles
    spent = []
    for count in (1, steps):
        watch = stopwatch()
        end = simulation.final_frame(start, count * DT, ground)
        spent.append(1e3 * watch()[1])
    frames = list(simulation.frames(start, steps * DT, ground, spacing=DT))
    sweeps = np.diff([frame.settling.sweeps for frame in frames])
    # the first step has no impulses to begin with, and is left out for LMGC90 too
    return [
        1e3 * max(float(np.abs(frame.poses[:, 0]).max()) for frame in frames),
        (spent[1] - spent[0]) / (steps - 1),
        float(np.median(sweeps[1:])),
        end.settling.unsettled_share,
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each wall, acceleration and tolerance."""
    parser = plain_options(__doc__)
    parser.add_argument("python", nargs="?", help="interpreter with compas_lmgc90")
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-2, 1e-3, 1.666e-4])
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--walls", nargs="+", type=int, default=list(WALLS), choices=list(WALLS))
    parser.add_argument("--peaks", nargs="+", type=float, default=list(PEAKS))
    parser.add_argument("--sine", type=float, help="frequency, else constant [Hz]")
    chosen = parser.parse_args(arguments)
    if chosen.python is None:
        print_left_out("LMGC90, as no Python interpreter with compas_lmgc90 is given")
    if chosen.quick:
        chosen.walls, chosen.steps, chosen.tolerances, chosen.peaks = [51], 5, [1e-2], [0.8]
    shape = np.ones(chosen.steps + 1)
    if chosen.sine:
        shape = np.sin(2.0 * np.pi * chosen.sine * DT * np.arange(chosen.steps + 1))
    rows = []
    for count in chosen.walls:
        structure = wall(*WALLS[count])
        assert len(structure.free) == count, len(structure.free)
        for peak in chosen.peaks:
            moved, spent, sweeps, unsettled = by_archfem(structure, peak * G * shape)
            row = [f"{count}", f"{peak:g}", "archfem", f"{moved:.2f}", f"{spent:.2f}", ""]
            rows.append([*row, f"{sweeps:.0f}", f"{unsettled:.3f}"])
            print(*rows[-1], flush=True)
        if chosen.python is None or chosen.sine or count > COMPARED or peak < 0.8:
            continue
        times = DT * np.arange(chosen.steps + 2)
        for tolerance in chosen.tolerances:
            path, step = by_lmgc90(
                *(chosen.python, structure, FRICTION, DT, chosen.steps),
                (times, peak * G * times),
                tolerance,
            )
            relative = 1e3 * np.abs(path[-1, :, 0] - path[-1, 0, 0]).max()
            row = [f"{count}", f"{peak:g}", f"LMGC90, {tolerance:g}", f"{relative:.2f}"]
            rows.append([*row, f"{step:.1f}", f"{step / spent:.0f}", "", ""])
            print(*rows[-1], flush=True)
    head: list[object] = ["stones", "peak [g]", "program", "moved [mm]", "step [ms]", "times"]
    print(table([*head, "median sweeps", "unsettled"], rows))


if __name__ == "__main__":
    main()
