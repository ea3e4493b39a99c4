"""Sliding walls against LMGC90: time of a step at equal displacement, over its tolerance.

    python tests/benchmarks/walls.py [PYTHON] [--tolerances 1e-2 1e-3 1e-4] [--steps 50]

PYTHON is an interpreter with compas_lmgc90, as prisms.py says; without it only archfem runs. Walls
in running bond of 51, 105 and 405 stones slide on their foundation and in their beds under a
constant ground acceleration of 0.8 g at a friction of 0.6. Given are the largest displacement of a
stone relative to the ground, and the processor time of a step in the same minute. Steps of archfem
whose impulses did not settle are counted.
"""

from collections.abc import Sequence

import numpy as np
from prisms import by_lmgc90
from scenes import wall
from setting import plain_options, print_left_out
from timing import stopwatch, table

import archfem as af

WALLS = {51: (6, 6.4), 105: (14, 5.6), 405: (30, 10.4)}
"""Courses and length [m] by the number of stones."""

DT, PEAK, FRICTION = 1e-3, 0.8 * 9.81, 0.6
"""Time step [s], ground acceleration [m/s²] and coefficient of friction."""


def by_archfem(structure: af.Structure, steps: int) -> tuple[float, float, float]:
    """Return the largest displacement [m], time of a step [ms], and share of unsettled steps."""
    simulation = af.dynamics.RigidBlockSimulation(structure, dt=DT)
    ground = af.Motion(np.full(steps + 1, PEAK), DT)
    start = af.dynamics.LooseBlocks.as_built(structure)
    simulation.final_frame(start, 2.0 * DT, ground)  # compiles
    spent = []
    for count in (1, steps):
        watch = stopwatch()
        end = simulation.final_frame(start, count * DT, ground)
        spent.append(1e3 * watch()[0])
    # the first step has no impulses to begin with, and is left out for LMGC90 too
    moved = float(np.abs(end.poses[:, 0]).max())
    return moved, (spent[1] - spent[0]) / (steps - 1), end.settling.unsettled_share


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each wall and tolerance."""
    parser = plain_options(__doc__)
    parser.add_argument("python", nargs="?", help="interpreter with compas_lmgc90")
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-2, 1e-3, 1.666e-4])
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--walls", nargs="+", type=int, default=list(WALLS), choices=list(WALLS))
    chosen = parser.parse_args(arguments)
    if chosen.python is None:
        print_left_out("LMGC90, as no Python interpreter with compas_lmgc90 is given")
    if chosen.quick:
        chosen.walls, chosen.steps, chosen.tolerances = [51], 5, [1e-2]
    rows = []
    for count in chosen.walls:
        structure = wall(*WALLS[count])
        assert len(structure.free) == count, len(structure.free)
        moved, spent, unsettled = by_archfem(structure, chosen.steps)
        rows.append([f"{count}", "archfem", f"{1e3 * moved:.2f}", f"{spent:.2f}", ""])
        rows[-1].append(f"{unsettled:.3f}")
        if chosen.python is None:
            continue
        times = DT * np.arange(chosen.steps + 2)
        for tolerance in chosen.tolerances:
            path, step = by_lmgc90(
                *(chosen.python, structure, FRICTION, DT, chosen.steps),
                (times, PEAK * times),
                tolerance,
            )
            relative = path[-1, :, 0] - path[-1, 0, 0]
            row = [f"{count}", f"LMGC90, {tolerance:g}", f"{1e3 * np.abs(relative).max():.2f}"]
            rows.append([*row, f"{step:.1f}", f"{step / spent:.0f}", ""])
            print(*rows[-1], flush=True)
    print(table(["stones", "program", "moved [mm]", "step [ms]", "times", "unsettled"], rows))


if __name__ == "__main__":
    main()
