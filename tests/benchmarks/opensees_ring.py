"""Time and compare the validation ring in OpenSees and in archfem, in the same process.

    python tests/benchmarks/opensees_ring.py [--record FILE --column 2 --units cm/s2 --dt 0.005]

All take the same 10 s in steps of 5 ms, with damping on the initial stiffness. "Set-up" is what a
stepper prepares before the first step. Eccentricities are compared with OpenSees on the same
equations (all nodes, nodal springs, lumped mass), and with a converged solution of the same ring.
"""

from dataclasses import dataclass

import numpy as np
import opensees_model as opensees  # before archfem: its own MPI breaks after PETSc's
from setting import DAMPING, DT, ground_motion, largest, lumped, options, ring
from stepping import Run, warm_up
from timing import Clock, least, table

import archfem as af

SETTINGS = {
    "quad, Newton, BandGeneral": {},
    "quad, Newton, BandSPD": {"system": ("BandSPD",)},
    "quad, KrylovNewton, BandGeneral": {"algorithm": ("KrylovNewton",)},
    "quad, Newton, SuperLU": {"system": ("SuperLU",)},
    "SSPquad, Newton, BandGeneral": {"element": "SSPquad"},
}
"""Of the analysis, each different from the first in what is named."""

CASES = [
    ("full", "nodal", "lumped", "snes"),
    ("full", "nodal", "lumped", "contact"),
    ("full", "nodal", "consistent", "snes"),
    ("full", "nodal", "consistent", "contact"),
    ("condensed", "nodal", "consistent", "contact"),
    ("faces", "nodal", "consistent", "snes"),
    ("faces", "nodal", "consistent", "contact"),
    ("rigid", "nodal", "consistent", "contact"),
    ("full", "lobatto", "consistent", "contact"),
    ("faces", "lobatto", "consistent", "contact"),
    ("full", "exact", "consistent", "contact"),
    ("faces", "exact", "consistent", "contact"),
    ("rigid", "exact", "consistent", "contact"),
]
"""Fidelity, quadrature, mass and method of archfem's runs."""

SAME = 1e-4
"""Difference in max|e| up to which an answer is the same."""


@dataclass(frozen=True)
class Row:
    """One line of the table: what ran, its set-up [s], time of a step, max|e|."""

    name: str
    setup: float | None
    clock: Clock
    largest: float


def opensees_rows(motion: af.Motion, repeat: int) -> list[Row]:
    """Run OpenSees with all its settings."""
    model = lumped(af.build(ring(), fidelity="full", cells=(4, 4), quadrature="nodal"))
    steps, rows = round(motion.duration / DT), []
    for name, settings in SETTINGS.items():

        def run(keep: bool = False, settings: dict = settings):
            return opensees.shake(model, motion, DAMPING, DT, settings=settings, keep=keep)

        states = run(keep=True).states
        resultants = np.array([model.resultants(q) for q in states])
        clock = least(lambda run=run: run().seconds, steps, repeat)
        rows.append(Row(f"OpenSees: {name}", None, clock, largest(model.structure, resultants)))
    return rows


def archfem_row(case: tuple[str, str, str, str], motion: af.Motion, repeat: int) -> Row:
    """Run archfem with one fidelity, quadrature, mass and method."""
    fidelity, rule, mass, method = case
    model = af.build(ring(), fidelity=fidelity, cells=(4, 4), quadrature=rule)
    run = Run(lumped(model) if mass == "lumped" else model, motion, method)
    reached = largest(model.structure, run.resultants())
    return Row(f"archfem: {', '.join(case)}", run.setup, run.clock(repeat), reached)


def converged(motion: af.Motion) -> float:
    """Find max|e| on a fine mesh with exact integration along the joints."""
    fine = af.build(ring(), fidelity="condensed", cells=(16, 8), quadrature="exact")
    return largest(fine.structure, Run(fine, motion, "contact").resultants())


def report(motion: af.Motion, repeat: int) -> str:
    """Run everything and write the table."""
    warm_up(motion)
    others = opensees_rows(motion, repeat)
    same, answer = others[0].largest, converged(motion)
    best = min(row.clock.cpu for row in others if abs(row.largest - same) < SAME)
    any_best = min(row.clock.cpu for row in others)
    rows = [*others, *(archfem_row(case, motion, repeat) for case in CASES)]
    head = ["", "set-up s", "wall ms/step", "cpu ms/step", "× OpenSees", "× any", "max|e|"]
    lines = [
        [
            row.name,
            "" if row.setup is None else f"{row.setup:.3f}",
            f"{row.clock.wall:.4f}",
            f"{row.clock.cpu:.4f}",
            f"{best / row.clock.cpu:.1f}",
            f"{any_best / row.clock.cpu:.1f}",
            f"{row.largest:.5f}",
            f"{row.largest - same:+.1e}",
            f"{row.largest - answer:+.1e}",
        ]
        for row in rows
    ]
    return "\n\n".join(
        [
            f"{motion.name}: peak {motion.pga:.2f} m/s², {motion.duration:g} s in steps of {DT} s. "
            f"Converged max|e| {answer:.5f} (16 × 8 cells, exact).",
            table([*head, "to OpenSees", "error"], lines),
            f"× OpenSees: times faster (processor time) than its fastest settings within {SAME:g} "
            "of the first line; × any: than its fastest whatever the answer.",
        ]
    )


if __name__ == "__main__":
    chosen = options(__doc__.splitlines()[0]).parse_args()
    print(report(ground_motion(chosen), chosen.repeat))
