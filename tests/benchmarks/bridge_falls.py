"""Fall of the three-span bridge: the stones left by scale, on models whose blocks move far.

    python tests/benchmarks/bridge_falls.py [--restored] [--pair pair-1 | --record FILE --column 2
        --units cm/s2 --dt 0.005 --vertical FILE] [--fill elastic jointed] [--scales 0.333 1 2]

Stones are rigid. The fill is either elastic, with all its nodes and small displacements of its own,
or cut into rigid pieces that slide with 35° and 15 kPa. A made pair is taken at R = 1, so that
scale 1/3 is the R = 3 of the study. It says of each run what is left, when the first stone was
lost, the largest opening and slip between stones, what energy came from nowhere, and the time of a
step. The bridge stood through the two earthquakes of 1999.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from setting import plain_options, quick_motion
from timing import table

import archfem as af
from archfem.cases import damping_of
from archfem.masonry.stiffness_ratio import mark_stone_joints
from archfem.units import mm

MESHES = Path(__file__).parents[2] / "meshes"

PIECES = {"piece_size": 0.8, "friction_angle": 35.0, "cohesion": 15e3}
"""Of the fill that is cut."""

HEAD = ["fill", "scale", "the bridge", "at [s]", "stones lost", "opening [mm]", "slip [mm]"]
HEAD += ["residual [mm]", "drift", "ms/step", "the run"]


def motion(chosen: argparse.Namespace, path: Path) -> af.Motion:
    """Read the chosen record, or make the chosen pair."""
    if chosen.quick:
        return quick_motion(4.9)
    if chosen.record is None:
        suite = af.Case.read(path, ["suite.reduction=1"]).ground_suite()
        return next(each for each in suite.motions if each.name == chosen.pair)
    plain = {"column": chosen.column, "units": chosen.units, "dt": chosen.dt}
    across = af.Motion.read(chosen.record, **{k: v for k, v in plain.items() if v is not None})
    if chosen.vertical is None:
        return across.cut(0.0, min(chosen.end, across.duration))
    read = af.Motion.read(chosen.vertical)
    up = read.horizontal if read.vertical is None else read.vertical
    count = min(len(across.horizontal), len(up))
    both = af.Motion(across.horizontal[:count], across.dt, up[:count])
    return both.cut(0.0, min(chosen.end, both.duration))


def built(case: af.Case, fill: str, cells: int) -> tuple[af.Structure, object]:
    """Build the model with its fill elastic or in pieces."""
    if fill == "elastic":
        fidelity = {"backfill": "full", "rest": "rigid"}
        model = af.build(
            case.structure, fidelity=fidelity, displacements="large", cells=(cells, cells)
        )
        return case.structure, model
    cut = af.masonry.jointed_fill(case.structure, **PIECES)
    return cut, af.build(cut, fidelity="rigid", displacements="large", quadrature="exact")


def row(fill: str, scale: float, run: af.History, stones: np.ndarray, cost: float) -> list[str]:
    """Write the row of a run."""
    data, fall = run.dataset, run.fall
    opening, slip = (
        float(np.abs(data[key].values[:, stones]).max()) for key in ("opening", "slip")
    )
    return [
        fill,
        f"{scale:.3g}",
        fall.kind if fall else "-",
        f"{fall.time:.2f}" if fall and fall.time is not None else "-",
        str(len(fall.blocks) * (fall.time is not None)) if fall else "-",  # those lost
        f"{opening / mm:.1f}",
        f"{slip / mm:.1f}",
        f"{fall.residual / mm:.1f}" if fall else "-",
        f"{data.attrs['energy_drift']:.0e}",
        f"{cost:.1f}",
        run.outcome,
    ]


def run_scales(chosen: argparse.Namespace) -> None:
    """Run all scales on the models that were chosen, and print each row when it is ready."""
    path = MESHES / f"prusias{'_restored' if chosen.restored else ''}.toml"
    case, rows = af.Case.read(path), []
    shake = motion(chosen, path)
    for fill in chosen.fill:
        structure, model = built(case, fill, chosen.cells)
        dead = af.dead_load(model)
        damping = damping_of(case, dead)[0]
        stones = mark_stone_joints(structure)
        for scale in chosen.scales:
            begun = time.process_time()
            try:
                given = {"start": dead, "damping": damping, "dt": chosen.step}
                run = af.time_history(model, shake.scaled(scale), **given)
            except af.DidNotConverge as error:
                run = af.dynamics.partial_history(error)
            cost = 1e3 * (time.process_time() - begun) / max(1, run.dataset.attrs["steps"])
            rows.append(row(fill, scale, run, stones, cost))
            print(*rows[-1], sep=" | ", flush=True)
    print(f"\n{table(HEAD, rows)}")


def options() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    parser = plain_options(__doc__)
    parser.add_argument("--restored", action="store_true", help="the bridge after its restoration")
    parser.add_argument("--pair", default="pair-1", help="made pair to take without a record")
    parser.add_argument("--record", type=Path, help="file with a ground motion")
    parser.add_argument("--column", type=int, help="column of the record, counted from 1")
    parser.add_argument("--units", help="unit of plain columns: g, m/s2, cm/s2 or gal")
    parser.add_argument("--dt", type=float, help="time between samples of plain columns [s]")
    parser.add_argument("--vertical", type=Path, help="file with the vertical motion")
    parser.add_argument("--end", type=float, default=20.0, help="of the motion [s]")
    parser.add_argument("--fill", nargs="+", default=["elastic"], choices=["elastic", "jointed"])
    parser.add_argument("--cells", type=int, default=2, help="facets on a joint, elastic fill")
    parser.add_argument("--step", type=float, default=0.005, help="time step [s]")
    parser.add_argument("--scales", type=float, nargs="+", default=[1.0 / 3.0, 1.0, 2.0])
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run all scales on the models that were chosen."""
    chosen = options().parse_args(arguments)
    if chosen.quick:
        chosen.scales = [1.0 / 3.0]
    run_scales(chosen)


if __name__ == "__main__":
    main()
