"""The three-span bridge with its backfill: time of a step, set-up, memory and error by fidelity.

    python tests/benchmarks/bridge.py [--record FILE --column 2 --vertical 1 --units cm/s2]

Each fidelity runs 20 s at a third of the motion and at all of it, in a process of its own. Memory
is the growth of its peak beyond that with a small model. Errors are those of the largest |e| of
each ring and pier joint against all nodes. On the second about the peak every fidelity is compared
with "monolithic" by its moments, relative to the largest, and so is its speed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scenes import BRIDGE_DAMPING, DT, bridge_case
from setting import plain_options, quick_motion
from stepping import SteppedRun, peak_memory
from timing import table

import archfem as af

SOIL = "backfill"

FIDELITIES = {
    "monolithic": ("monolithic", "snes"),
    "full, snes": ("full", "snes"),
    "full": ("full", "auto"),
    "faces, full soil": ({SOIL: "full", "rest": "faces"}, "auto"),
    "rigid, full soil": ({SOIL: "full", "rest": "rigid"}, "auto"),
}
"""Fidelity and method by name."""

SLOW = ("monolithic", "full, snes")
"""Fidelities that run on the short window only."""


def ground_motion(chosen: argparse.Namespace, duration: float = 20.0) -> af.Motion:
    """Read the chosen record, or make a motion as strong as that of Erzincan 1992."""
    if chosen.quick:
        return quick_motion(4.9)
    if chosen.record is None:
        return af.Motion.synthetic(duration=duration, pga=4.9, seed=3, vertical_ratio=0.5)
    given = {"units": chosen.units, "dt": chosen.dt}
    across = af.Motion.read(chosen.record, column=chosen.column, **given)
    up = af.Motion.read(chosen.record, column=chosen.vertical, **given)
    vertical = 0.5 * up.horizontal
    return af.Motion(across.horizontal, across.dt, vertical).cut(0.0, duration)


def window(whole: af.Motion) -> af.Motion:
    """Cut out the second about the peak."""
    middle = whole.dt * int(np.argmax(np.abs(whole.horizontal)))
    return whole.cut(max(0.0, middle - 0.5), max(0.0, middle - 0.5) + 1.0)


def measure(name: str, whole: af.Motion, scale: float, folder: Path) -> dict:
    """Run a fidelity on the window and, unless it is slow, on the whole motion."""
    fidelity, method = FIDELITIES[name]
    af.dead_load(af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="full"))
    before = peak_memory()
    model = af.build(bridge_case().structure, fidelity=fidelity)
    settings = {"start": af.dead_load(model), "damping": BRIDGE_DAMPING, "dt": DT}
    result = {"size": model.size}
    parts = {"window": window(whole), **({} if name in SLOW else {"whole": whole})}
    for part, motion in parts.items():
        shaking = motion.scaled(scale)
        run = SteppedRun(lambda m=shaking: af.time_history(model, m, method=method, **settings))
        # A slow fidelity is timed once, with its set-up and recording.
        clock = run.time_call(1) if name in SLOW else run.time_steps(1)
        result[part] = clock.cpu
        joints = run.history.joints
        resultants = np.stack([joints[key].values for key in "NVM"], axis=-1)
        np.save(folder / f"{name}, {scale:.3f}, {part}.npy", resultants)
        e = joints["eccentricity"].values[:, model.structure.judged]
        np.save(folder / f"{name}, {scale:.3f}, {part}, peaks.npy", np.nanmax(np.abs(e), axis=0))
    return result | {
        "method": run.method,
        "setup": float("nan") if name in SLOW else run.setup,
        "memory": peak_memory() - before,
    }


def measure_in_process(name: str, scale: float, folder: Path, options: Sequence[str]) -> dict:
    """Measure in a process of its own, with the same options."""
    case = json.dumps([name, scale, str(folder)])
    command = [sys.executable, str(Path(__file__)), *options, "--one", case]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def report(scale: float, folder: Path, options: Sequence[str]) -> str:
    """Run all fidelities at one scale and write their table."""
    results = {name: measure_in_process(name, scale, folder, options) for name in FIDELITIES}

    def load(name: str, part: str) -> np.ndarray:
        return np.load(folder / f"{name}, {scale:.3f}, {part}.npy")

    exact, moments = load("full", "whole, peaks"), load("monolithic", "window")[..., 2]
    rows = []
    for name, result in results.items():
        off = np.abs(load(name, "window")[..., 2] - moments).max() / np.abs(moments).max()
        row = [name, result["method"], result["size"], f"{result['setup']:.2f}"]
        row += [f"{result['window']:.3f}"]
        row += [f"{results['monolithic']['window'] / result['window']:.0f}"]
        row += [f"{off:.1e}", f"{result['memory']:.0f}"]
        if "whole" in result:
            error = np.abs(load(name, "whole, peaks") - exact)
            row += [f"{result['whole']:.3f}", f"{error.max():.4f}", f"{np.median(error):.4f}"]
        rows.append([*row, *["-"] * (11 - len(row))])
    head = ["fidelity", "method", "coordinates", "set-up [s]", "1 s: ms/step", "times faster"]
    head += ["off in M", "memory [MB]", "20 s: ms/step", "largest error in e", "median"]
    return f"Scale {scale:.3f}\n\n{table(head, rows)}\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each scale."""
    parser = plain_options(__doc__)
    parser.add_argument("--record", help="file with a ground motion; the default is synthetic")
    parser.add_argument("--column", type=int, help="column of the record, counted from 1")
    parser.add_argument("--vertical", type=int, help="column whose half is the vertical motion")
    parser.add_argument("--units", help="unit of plain columns: g, m/s2, cm/s2 or gal")
    parser.add_argument("--dt", type=float, help="time between samples of plain columns [s]")
    parser.add_argument("--scales", type=float, nargs="+", default=[1.0 / 3.0, 1.0])
    parser.add_argument("--one", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    motion = ground_motion(chosen)
    with tempfile.TemporaryDirectory() as temporary:
        if chosen.one:
            name, scale, folder = json.loads(chosen.one)
            print(json.dumps(measure(name, motion, scale, Path(folder))))
        elif chosen.quick:
            print(measure("rigid, full soil", motion, 1.0, Path(temporary)))
        else:
            options = sys.argv[1:] if arguments is None else arguments
            for scale in chosen.scales:
                print(report(scale, Path(temporary), options), flush=True)


if __name__ == "__main__":
    main()
