"""Time and compare the validation ring in OpenSees and in archfem, in one process.

    python tests/benchmarks/opensees_ring.py [--record FILE --column 2 --units cm/s2 --dt 0.005]

All take the same 10 s in steps of 5 ms by the average acceleration method (Newmark), with damping
on the initial stiffness and joints that never slide. "step" is taken without recording; "call" is
a whole `time_history` from dead load, with set-up and recording. Eccentricities are compared with
OpenSees on the same equations (all nodes, nodal springs, lumped mass), and with a converged
solution of the same ring. The last line compares wall times of a plain `time_history` of the
condensed ring and of the fastest OpenSees analysis with the same answer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# OpenSees must be imported before archfem: its own MPI breaks after that of PETSc.
try:
    import opensees_model as opensees
except ImportError as error:
    opensees, missing = None, str(error)

from scenes import DT, ring, with_friction
from setting import DAMPING, ground_motion, largest_eccentricity, lumped, options, print_left_out
from stepping import SteppedRun
from timing import Clock, least, table

import archfem as af

SETTINGS = {
    "quad, Newton, BandGeneral": {},
    "quad, Newton, BandSPD": {"system": ("BandSPD",)},
    "quad, KrylovNewton, BandGeneral": {"algorithm": ("KrylovNewton",)},
    "quad, Newton, SuperLU": {"system": ("SuperLU",)},
    "SSPquad, Newton, BandGeneral": {"element": "SSPquad"},
}
"""Changes of each OpenSees analysis to the first."""

CLAIMED = ("condensed", "nodal", "consistent", "auto")

CASES = [
    ("full", "nodal", "lumped", "snes"),
    ("full", "nodal", "lumped", "auto"),
    ("full", "nodal", "consistent", "snes"),
    ("full", "nodal", "consistent", "auto"),
    CLAIMED,
    ("faces", "nodal", "consistent", "snes"),
    ("faces", "nodal", "consistent", "auto"),
    ("full", "lobatto", "consistent", "auto"),
    ("faces", "lobatto", "consistent", "auto"),
    ("full", "exact", "consistent", "auto"),
    ("faces", "exact", "consistent", "auto"),
    ("rigid", "exact", "consistent", "auto"),
]
"""Fidelity, quadrature, mass and method of archfem's runs."""

SAME_ANSWER = 1e-4
"""Difference in max|e| up to which an answer is the same [-]."""


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        name: program, model and method.
        step: time of a step without recording.
        call: time of a whole call divided by its steps; None of OpenSees.
        largest: largest |e| [-].
    """

    name: str
    step: Clock
    call: Clock | None
    largest: float


def elastic_ring() -> af.Structure:
    """Build the ring whose joints never slide."""
    return with_friction(ring(), None)


def opensees_rows(motion: af.Motion, repeat: int, settings: dict[str, dict]) -> list[Row]:
    """Run OpenSees with several settings."""
    model = lumped(af.build(elastic_ring(), fidelity="full", cells=(4, 4), quadrature="nodal"))
    steps, rows = round(motion.duration / DT), []
    for name, each in settings.items():

        def run(keep: bool = False, settings: dict = each) -> "opensees.Shaken":
            return opensees.shake(model, motion, DAMPING, DT, settings=settings, keep=keep)

        resultants = np.array([model.resultants(q) for q in run(keep=True).states])
        clock = least(lambda run=run: run().seconds, steps, repeat)
        largest = largest_eccentricity(model.structure, resultants)
        rows.append(Row(f"OpenSees: {name}", clock, None, largest))
    return rows


def stepped_ring(
    fidelity: str, rule: str, motion: af.Motion, *, mass: str, method: str, cells: tuple[int, int]
) -> SteppedRun:
    """Run archfem by a plain call of `time_history`."""
    model = af.build(elastic_ring(), fidelity=fidelity, cells=cells, quadrature=rule)
    model = lumped(model) if mass == "lumped" else model
    settings = {"dt": DT, "damping": DAMPING, "scheme": af.dynamics.Newmark(), "method": method}
    settings["record"] = af.Record(repeat=False)
    dead = af.dead_load(model)
    return SteppedRun(lambda: af.time_history(model, motion, start=dead, **settings))


def archfem_row(case: tuple[str, str, str, str], motion: af.Motion, repeat: int) -> Row:
    """Run archfem with one fidelity, quadrature, mass and method."""
    fidelity, rule, mass, method = case
    run = stepped_ring(fidelity, rule, motion, mass=mass, method=method, cells=(4, 4))
    name = f"archfem: {', '.join([fidelity, rule, mass, run.method])}"
    return Row(name, run.time_steps(repeat), run.time_call(repeat), run.largest_eccentricity)


def report(motion: af.Motion, repeat: int, *, quick: bool = False) -> str:
    """Run everything and write the table."""
    settings = dict(list(SETTINGS.items())[:1]) if quick else SETTINGS
    cases = [CLAIMED] if quick else CASES
    others = opensees_rows(motion, repeat, settings)
    same = others[0].largest
    fine = stepped_ring(
        "condensed",
        "exact",
        motion,
        mass="consistent",
        method="auto",
        cells=(4, 4) if quick else (16, 8),
    )
    answer = fine.largest_eccentricity
    equal = [row.step for row in others if abs(row.largest - same) < SAME_ANSWER]
    best = Clock(min(each.wall for each in equal), min(each.cpu for each in equal))
    own = {case: archfem_row(case, motion, repeat) for case in cases}
    lines = [row_cells(row, best, same, answer) for row in (*others, *own.values())]
    head = ["", "step: cpu ms", "call: cpu ms", "call: wall ms"]
    head += ["OpenSees / step", "OpenSees / call", "max|e|", "to OpenSees", "error"]
    call = own[CLAIMED].call
    assert call is not None
    return "\n\n".join(
        [
            f"{motion.name}: PGA {motion.pga:.2f} m/s², {motion.duration:g} s in steps of {DT} s. "
            f"Converged max|e| {answer:.5f} (16 × 8 cells, exact).",
            table(head, lines),
            f"OpenSees / step, / call: processor time of its fastest settings whose max|e| is "
            f"within {SAME_ANSWER:g} of the first line, divided by that of archfem.",
            f"A plain time_history of the condensed ring, wall time, {own[CLAIMED].name}: "
            f"{best.wall / call.wall:.1f} times faster than OpenSees "
            f"({call.wall:.4f} and {best.wall:.4f} ms a step).",
        ]
    )


def row_cells(row: Row, best: Clock, same: float, answer: float) -> list[object]:
    """Write one line of the table."""
    call = row.call
    return [
        row.name,
        f"{row.step.cpu:.4f}",
        "" if call is None else f"{call.cpu:.4f}",
        "" if call is None else f"{call.wall:.4f}",
        f"{best.cpu / row.step.cpu:.1f}",
        "" if call is None else f"{best.cpu / call.cpu:.1f}",
        f"{row.largest:.5f}",
        f"{row.largest - same:+.1e}",
        f"{row.largest - answer:+.1e}",
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    chosen = options(__doc__).parse_args(arguments)
    if opensees is None:
        print_left_out(f"OpenSeesPy is missing ({missing}): pip install -e '.[bench]'")
        return
    repeat = 1 if chosen.quick else chosen.repeat
    print(report(ground_motion(chosen), repeat, quick=chosen.quick))


if __name__ == "__main__":
    main()
