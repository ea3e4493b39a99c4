"""Cost of `fidelity="auto"`, and its predicted error beside the actual one: 23 scenes, 12 blind.

    python tests/benchmarks/predicted_error.py [--blind] [--tolerance 0.005] [SCENE …]

The last six scenes were added for the present rule.

The cost of choosing is that of `build`, the models that it builds included; the cost of running is
that of the whole motion in the chosen steps. Both are processor times without compilation. The
actual error is that of this run in the largest |e| of the worst joint. Its reference has 12 × 12
cells on each stone and steps of 0.625 ms, with soil 12 × 12 and 1.25 ms.
"""

import logging
from collections.abc import Callable, Sequence
from time import process_time

from scenes import arch_on_piers, ring, with_friction
from setting import plain_options
from timing import table

import archfem as af
from archfem.dynamics.accuracy import time_run
from archfem.dynamics.error_estimation import default_damping, largest_difference
from archfem.dynamics.model_selection import TRIED_SETTINGS, exact_discretisation
from archfem.masonry.stiffness_ratio import find_soft_blocks
from archfem.models.builder import build as build_model
from archfem.models.fem.mesh import _recent_meshes

FINEST_STEP = 0.000625
"""Time step of the reference without soil [s]."""

STIFF = af.Contact(1.48e10, 0.3e10)
"""Joints a third as soft as the stones."""


def thin_ring() -> af.Structure:
    """Build a thin segmental ring."""
    return af.circular_arch(radius=4.0, thickness=0.4, embrace=120.0, voussoirs=15)


def stiff_ring() -> af.Structure:
    """Build a ring of few voussoirs on stiff joints."""
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9, contact=STIFF)


def semicircle() -> af.Structure:
    """Build a semicircular ring."""
    return af.circular_arch(radius=3.0, thickness=0.6, embrace=180.0, voussoirs=15)


def small_bridge() -> af.Structure:
    """Build an arch under backfill."""
    arch = af.shapes.Arch(measured="centre line", span=4.0, rise=1.5, thickness=0.45, voussoirs=11)
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4), width=4.0)


def pointed_arch() -> af.Structure:
    """Build a pointed arch without a keystone."""
    return af.shapes.pointed_arch(span=4.0, rise=2.6, thickness=0.5, voussoirs=14)


def shallow_ring() -> af.Structure:
    """Build a shallow segmental ring."""
    return af.circular_arch(radius=6.0, thickness=0.6, embrace=80.0, voussoirs=13)


def tall_piers() -> af.Structure:
    """Build an arch on piers taller than its rise."""
    return af.shapes.buttressed_arch(
        measured="centre line",
        span=4.0,
        thickness=0.5,
        voussoirs=13,
        breadth=1.5,
        height=3.0,
        embrace=150.0,
    )


def two_spans() -> af.Structure:
    """Build an arcade of two arches on three piers."""
    return af.shapes.arcade(
        measured="centre line",
        spans=(3.0, 3.0),
        heights=2.0,
        breadths=1.2,
        thicknesses=0.4,
        voussoirs=11,
        embraces=150.0,
    )


def segment() -> af.Structure:
    """Build a segmental ring of a span and a rise."""
    return af.circular_arch(span=5.0, rise=2.0, thickness=0.5, voussoirs=21)


def ring_of_25() -> af.Structure:
    """Build a ring of many voussoirs."""
    return af.circular_arch(radius=3.5, thickness=0.6, embrace=150.0, voussoirs=25)


def low_piers() -> af.Structure:
    """Build an arch on piers lower than its rise."""
    return af.shapes.buttressed_arch(
        measured="centre line",
        span=3.5,
        thickness=0.5,
        voussoirs=11,
        breadth=1.6,
        height=1.5,
        embrace=130.0,
    )


def steep_arch() -> af.Structure:
    """Build a steep pointed arch."""
    return af.shapes.pointed_arch(span=3.0, rise=2.2, thickness=0.45, voussoirs=16)


def unequal_spans() -> af.Structure:
    """Build an arcade of a small and a large arch."""
    return af.shapes.arcade(
        measured="centre line",
        spans=(2.5, 4.0),
        heights=1.5,
        breadths=1.4,
        thicknesses=0.45,
        voussoirs=9,
        embraces=140.0,
    )


SCENES: dict[str, tuple[Callable[[], af.Structure], float | None, float, float, int]] = {
    "ring, held": (ring, None, 20.0, 2.5, 11),
    "ring": (ring, 0.6, 20.0, 2.5, 12),
    "ring, slippery": (ring, 0.3, 25.0, 2.0, 13),
    "stiff ring": (stiff_ring, 0.6, 15.0, 2.0, 14),
    "thin ring, held": (thin_ring, None, 20.0, 2.0, 15),
    "thin ring, slippery": (thin_ring, 0.3, 20.0, 2.0, 16),
    "semicircle": (semicircle, 0.6, 30.0, 0.8, 17),
    "piers, held": (arch_on_piers, None, 20.0, 2.0, 18),
    "piers, slippery": (arch_on_piers, 0.3, 20.0, 2.0, 19),
    "column": (lambda: af.column(breadth=1.0, heights=[1.0] * 3), 0.6, 20.0, 1.6, 20),
    "column, slippery": (lambda: af.column(breadth=1.2, heights=[0.6] * 4), 0.3, 20.0, 3.5, 21),
    "bridge": (small_bridge, 0.6, 15.0, 2.5, 22),
    "pointed arch": (pointed_arch, 0.6, 18.0, 2.0, 31),
    "shallow ring": (shallow_ring, 0.35, 20.0, 3.0, 33),
    "tall piers": (tall_piers, 0.6, 20.0, 1.5, 34),
    "two spans": (two_spans, 0.5, 15.0, 1.5, 35),
    "column of six": (lambda: af.column(breadth=1.2, heights=[0.5] * 6), 0.5, 20.0, 2.0, 36),
    "segment, held": (segment, None, 18.0, 2.5, 51),
    "ring of 25": (ring_of_25, 0.4, 20.0, 2.5, 52),
    "low piers, slippery": (low_piers, 0.35, 20.0, 2.5, 53),
    "steep arch, held": (steep_arch, None, 20.0, 2.0, 54),
    "column of five": (lambda: af.column(breadth=1.0, heights=[0.4] * 5), 0.3, 20.0, 2.5, 55),
    "unequal spans, held": (unequal_spans, None, 15.0, 1.5, 56),
}
"""Structure, friction of all joints [-], and duration [s], peak [m/s²] and seed of the motion."""


BLIND = {
    "blind ring of 9": (lambda: blind_ring(2.0, 0.4, 140.0, 9), 0.6, 16.0, 2.2, 101, 0.005),
    "blind ring, held": (lambda: blind_ring(5.0, 0.7, 150.0, 19), None, 22.0, 1.8, 102, 0.003),
    "blind shallow, 0.3": (lambda: blind_ring(4.5, 0.5, 90.0, 13), 0.3, 18.0, 2.5, 103, 0.005),
    "blind ring, 0.35": (lambda: blind_ring(3.2, 0.6, 150.0, 15), 0.35, 20.0, 2.2, 104, 0.008),
    "blind piers, 0.35": (lambda: blind_piers(4.5, 2.0, 1.8), 0.35, 15.0, 2.0, 105, 0.005),
    "blind piers, held": (lambda: blind_piers(3.0, 2.5, 1.2), None, 18.0, 1.6, 106, 0.01),
    "blind piers, 0.3": (lambda: blind_piers(4.0, 1.8, 2.0), 0.3, 20.0, 2.2, 107, 0.008),
    "blind column of two": (lambda: blind_column(0.9, 1.1, 2), 0.6, 20.0, 2.0, 108, 0.005),
    "blind column, 0.3": (lambda: blind_column(1.4, 0.7, 3), 0.3, 16.0, 3.5, 109, 0.005),
    "blind column, 0.25": (lambda: blind_column(1.1, 0.5, 4), 0.25, 20.0, 2.8, 110, 0.003),
    "blind pointed arch": (lambda: blind_pointed_arch(), 0.6, 20.0, 1.8, 111, 0.005),
    "blind bridge": (lambda: blind_bridge(), 0.6, 12.0, 2.0, 112, 0.008),
}
"""As `SCENES`, with the tolerance; written before, and run once after, the rule was settled."""


def blind_ring(radius: float, thickness: float, embrace: float, voussoirs: int) -> af.Structure:
    """Build a ring of the blind test."""
    return af.circular_arch(
        radius=radius, thickness=thickness, embrace=embrace, voussoirs=voussoirs
    )


def blind_piers(span: float, height: float, breadth: float) -> af.Structure:
    """Build an arch on piers of the blind test."""
    return af.shapes.buttressed_arch(
        measured="centre line",
        span=span,
        thickness=0.5,
        voussoirs=13,
        breadth=breadth,
        height=height,
        embrace=140.0,
    )


def blind_column(breadth: float, height: float, blocks: int) -> af.Structure:
    """Build a column of the blind test."""
    return af.column(breadth=breadth, heights=[height] * blocks)


def blind_pointed_arch() -> af.Structure:
    """Build the pointed arch of the blind test."""
    return af.shapes.pointed_arch(span=5.0, rise=3.0, thickness=0.7, voussoirs=12)


def blind_bridge() -> af.Structure:
    """Build the bridge of the blind test."""
    arch = af.shapes.Arch(measured="centre line", span=3.0, rise=1.2, thickness=0.4, voussoirs=9)
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)


def compare(name: str, tolerance: float | None, duration: float | None) -> list[str]:
    """Return one row: largest |e|, choice, costs, predicted and actual error."""
    scene = BLIND[name] if name in BLIND else (*SCENES[name], 0.005)
    shape, friction, seconds, pga, seed, own = scene
    tolerance = tolerance or own
    structure = with_friction(shape(), friction)
    motion = af.Motion.synthetic(duration=duration or seconds, pga=pga, seed=seed)
    finest = build_model(structure, exact_discretisation(structure, "condensed", (12, 12)))
    damping = default_damping(finest)

    def choose(motion: af.Motion) -> af.models.Model:
        _recent_meshes.clear()
        return af.build(
            structure, fidelity="auto", tolerance=tolerance, motion=motion, damping=damping
        )

    choose(motion.cut(0.0, 0.5))  # compiles and loads kernels of the timed choice
    begin = process_time()
    prediction = choose(motion).prediction
    choosing = process_time() - begin
    chosen = next(setting[:2] for setting in TRIED_SETTINGS[1:] if setting[2] <= prediction.dt)
    model = build_model(structure, exact_discretisation(structure, *chosen))
    run = time_run(model, motion, prediction.dt, damping=damping)
    step = FINEST_STEP * (2 if find_soft_blocks(structure) else 1)
    reference = time_run(finest, motion, step, damping=damping).peaks
    actual = largest_difference(run.peaks, reference)
    return [
        name,
        f"{run.peaks.max():.2f}",
        f"{chosen[0]} {chosen[1][0]}, {1e3 * prediction.dt:g} ms",
        f"{choosing:.2f}",
        f"{choosing / run.seconds:.2f}",
        f"{prediction.error:.4f}",
        f"{actual:.4f}",
        f"{prediction.error / actual:.2f}" + ("" if prediction.is_met else ", not met"),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = plain_options(__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--tolerance", type=float, help="of the largest |e|; by default 0.005")
    parser.add_argument("--blind", action="store_true", help="run the scenes of the blind test")
    given = parser.parse_args(arguments)
    logging.disable(logging.WARNING)
    head = ["structure", "largest |e|", "choice", "choosing [s]", "over running"]
    head += ["predicted", "actual", "ratio"]
    scenes, duration = (
        (["column"], 1.0) if given.quick else (list(BLIND) if given.blind else given.scenes, None)
    )
    print(table(head, [compare(name, given.tolerance, duration) for name in scenes]))


if __name__ == "__main__":
    main()
