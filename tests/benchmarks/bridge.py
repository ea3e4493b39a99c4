"""The three-span bridge with its backfill: time of a step, set-up, memory and error of each rung.

    python tests/benchmarks/bridge.py [--record FILE --column 2 --vertical 1 --units cm/s2]

Rungs run 20 s at a third of the motion and at all of it, each in a process of its own; memory is
what that process grew by, at its peak, beyond what it held after a small model. Errors are of the
largest |e| of each ring and pier joint against all nodes. On the second about the peak every rung
is compared with "monolithic" by its moments, relative to the largest, and so is its speed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scaling import peak
from timing import stopwatch, table

import archfem as af
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.equation import Equation
from archfem.joints.resultants import joint_dataset

DT = 0.005
"""Time step [s]."""

DURATION = 20.0
"""Of the motion [s]."""

DAMPING = af.Rayleigh(0.05, (3.0, 12.0))

SCENE = Path(__file__).parents[2] / "meshes" / "prusias.toml"

SOIL = "backfill"

RUNGS = {
    "monolithic": ("monolithic", "snes"),
    "full, snes": ("full", "snes"),
    "full": ("full", "auto"),
    "faces, full soil": ({SOIL: "full", "rest": "faces"}, "auto"),
    "rigid, full soil": ({SOIL: "full", "rest": "rigid"}, "auto"),
}
"""Fidelity and method of each rung."""

SLOW = ("monolithic", "full, snes")
"""Rungs that run on the short window only."""


def motion(chosen: argparse.Namespace) -> af.Motion:
    """Read the record that was asked for, or make a motion as strong as Erzincan 1992."""
    if chosen.record is None:
        return af.Motion.synthetic(duration=DURATION, pga=4.9, seed=3, vertical_ratio=0.5)
    given = {"units": chosen.units, "dt": chosen.dt}
    across = af.Motion.read(chosen.record, column=chosen.column, **given)
    up = af.Motion.read(chosen.record, column=chosen.vertical, **given)
    vertical = 0.5 * up.horizontal
    return af.Motion(across.horizontal, across.dt, vertical).cut(0.0, DURATION)


def window(whole: af.Motion) -> af.Motion:
    """Cut out the second about the peak."""
    middle = whole.dt * int(np.argmax(np.abs(whole.horizontal)))
    return whole.cut(max(0.0, middle - 0.5), max(0.0, middle - 0.5) + 1.0)


def measured(rung: str, whole: af.Motion, scale: float, folder: Path) -> dict:
    """Run a rung on the window and, unless it is slow, on the whole motion."""
    fidelity, method = RUNGS[rung]
    af.dead_load(af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="full"))
    before = peak()
    model = af.build(af.Case.read(SCENE).structure, fidelity=fidelity)
    dead = af.dead_load(model)
    found = {"size": model.size}
    parts = {"window": window(whole), **({} if rung in SLOW else {"whole": whole})}
    for name, part in parts.items():
        for again in range(2 if rung not in SLOW else 1):  # the first may compile
            watch = stopwatch()
            equation = Equation(model, part.scaled(scale), DAMPING)
            start = equation.at_rest(dead.q, memory=dead.model.memory)
            stepper = stepper_for(method, equation, start, DT)
            next(iter(stepper.batches(start, DT, DT)))
            setup = watch()[0]
            watch = stopwatch()
            batches = stepper.batches(start, DT, part.duration)
            kept = [batch.resultants for batch in batches]
            cpu = watch()[1]
            if again and name == "window":
                break
        resultants = np.concatenate([model.resultants(dead.q)[None], *kept])
        found[name] = 1e3 * cpu / (len(resultants) - 1)
        np.save(folder / f"{rung}, {scale:.3f}, {name}.npy", resultants)
    return found | {"method": stepper.name, "setup": setup, "memory": peak() - before}


def in_own_process(rung: str, scale: float, folder: Path) -> dict:
    """Measure in a process of its own, under the same options."""
    case = json.dumps([rung, scale, str(folder)])
    command = [sys.executable, str(Path(__file__)), *sys.argv[1:], "--one", case]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def peaks(structure: af.Structure, resultants: np.ndarray) -> np.ndarray:
    """Largest |e| of every ring and pier joint [-]."""
    times = DT * np.arange(len(resultants))
    e = joint_dataset(structure, resultants, times)["eccentricity"].values
    return np.nanmax(np.abs(e[:, structure.judged]), axis=0)


def report(scale: float, folder: Path) -> str:
    """Run all rungs at one scale and write their table."""
    structure = af.Case.read(SCENE).structure
    found = {rung: in_own_process(rung, scale, folder) for rung in RUNGS}

    def kept(rung: str, name: str) -> np.ndarray:
        return np.load(folder / f"{rung}, {scale:.3f}, {name}.npy")

    exact, moments = peaks(structure, kept("full", "whole")), kept("monolithic", "window")[..., 2]
    rows = []
    for rung, each in found.items():
        off = np.abs(kept(rung, "window")[..., 2] - moments).max() / np.abs(moments).max()
        row = [rung, each["method"], each["size"], f"{each['setup']:.2f}"]
        row += [f"{each['window']:.3f}", f"{found['monolithic']['window'] / each['window']:.0f}"]
        row += [f"{off:.1e}", f"{each['memory']:.0f}"]
        if "whole" in each:
            error = np.abs(peaks(structure, kept(rung, "whole")) - exact)
            row += [f"{each['whole']:.3f}", f"{error.max():.4f}", f"{np.median(error):.4f}"]
        rows.append([*row, *["-"] * (11 - len(row))])
    head = ["rung", "method", "coordinates", "set-up [s]", "1 s: ms/step", "times faster"]
    head += ["off in M", "memory [MB]", "20 s: ms/step", "largest error in e", "median"]
    return f"Scale {scale:.3f}\n\n{table(head, rows)}\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--record", help="file with a ground motion; by default one is made")
    parser.add_argument("--column", type=int, help="column of the record, counted from 1")
    parser.add_argument("--vertical", type=int, help="column whose half is the vertical motion")
    parser.add_argument("--units", help="unit of plain columns: g, m/s2, cm/s2 or gal")
    parser.add_argument("--dt", type=float, help="time between samples of plain columns [s]")
    parser.add_argument("--scales", type=float, nargs="+", default=[1.0 / 3.0, 1.0])
    parser.add_argument("--one", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        rung, scale, folder = json.loads(chosen.one)
        print(json.dumps(measured(rung, motion(chosen), scale, Path(folder))))
    else:
        with tempfile.TemporaryDirectory() as folder:
            for scale in chosen.scales:
                print(report(scale, Path(folder)), flush=True)
