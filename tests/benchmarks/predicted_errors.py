"""Errors predicted by `fidelity="auto"` beside actual errors: ten structures, a motion each.

    python tests/benchmarks/predicted_errors.py [--tolerance 0.005] [--dt 0.005] [SCENE …]

The actual error is that in the largest |e| of every joint over a whole motion of 12 s, against
16 × 16 cells on each stone and steps with an error of 0.0005. The prediction uses 8 s of it.
"""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

from setting import plain_options
from timing import table

import archfem as af
from archfem.dynamics.error_estimation import default_damping, largest_difference, run_peaks
from archfem.dynamics.model_selection import exact_discretisation
from archfem.models.builder import build as plain

STIFF = af.Contact(1.48e10, 0.3e10, friction=0.6)
HOLDS = replace(af.masonry.STONE_TO_STONE, friction=None)
RING = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0}
ARCH = af.shapes.Arch(span=5.0, rise=2.0, thickness=0.5, voussoirs=13)

SCENES = {
    "ring": (af.circular_arch(**RING, voussoirs=17), 1.7),
    "ring, joints hold": (af.circular_arch(**RING, voussoirs=17, contact=HOLDS), 1.7),
    "ring, stiff joints": (af.circular_arch(**RING, voussoirs=9, contact=STIFF), 1.7),
    "ring, hinged": (af.circular_arch(**RING, voussoirs=17), 3.0),
    "semicircle": (af.circular_arch(radius=3.0, thickness=0.6, embrace=180.0, voussoirs=15), 0.6),
    "flat arch": (af.circular_arch(radius=5.0, thickness=0.5, embrace=120.0, voussoirs=21), 2.5),
    "thick arch": (af.circular_arch(radius=5.0, thickness=1.0, embrace=150.0, voussoirs=15), 3.0),
    "column": (af.column(breadth=1.0, heights=[1.0, 1.0, 1.0]), 1.6),
    "block": (af.column(breadth=0.6, heights=[2.4]), 1.8),
    "ring under fill": (
        af.bridge(arches=[ARCH], backfill=af.shapes.Backfill(cover=0.5), width=4.0),
        2.5,
    ),
}
"""Structures, and the peak of the motion that shakes each [m/s²]."""

PACE = 5e-4
"""Tolerance in |e| by which the reference steps [-]."""


def compared(name: str, tolerance: float, dt: float | None, duration: float) -> list[str]:
    """Return one row: chosen model, time of the choice, predicted and actual errors."""
    structure, pga = SCENES[name]
    motion = af.Motion.synthetic(duration=duration, pga=pga, seed=1 + list(SCENES).index(name))
    finest = plain(structure, exact_discretisation(structure, "condensed", (16, 16)))
    damping = default_damping(finest)
    start = perf_counter()
    model = af.build(
        structure, fidelity="auto", tolerance=tolerance, motion=motion, damping=damping, dt=dt
    )
    seconds, told = perf_counter() - start, model.prediction
    own = run_peaks(model, motion, damping, told.dt, tolerance=told.step_tolerance)
    reference = run_peaks(finest, motion, damping, None, tolerance=PACE)
    actual = largest_difference(own, reference)
    return [
        name,
        f"{reference.max():.2f}",
        min(told.candidates[::-1], key=lambda each: abs(each[1] - told.error))[0],
        f"{told.dt or told.step_tolerance:.2g}",
        f"{seconds:.0f}",
        f"{told.error:.4f}",
        f"{told.time_step_error:.4f}",
        f"{actual:.4f}",
        f"{told.error / actual:.1f}" + ("" if told.is_met else ", not met"),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = plain_options(__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--tolerance", type=float, default=0.005, help="of the largest |e|")
    parser.add_argument("--dt", type=float, help="time step [s]; by default steps of any length")
    given = parser.parse_args(arguments)
    head = ["structure", "largest |e|", "chosen", "steps", "s"]
    head += ["predicted", "in time", "actual", "ratio"]
    scenes, duration = (["block"], 0.5) if given.quick else (given.scenes, 12.0)
    print(table(head, [compared(name, given.tolerance, given.dt, duration) for name in scenes]))


if __name__ == "__main__":
    main()
