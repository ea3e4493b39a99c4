"""Processor time of a step by every solver, over structures, friction and fidelities.

    python tests/benchmarks/solvers.py [--groups small newmark shipped large] [--only TEXT]
    python tests/benchmarks/solvers.py --against PATH [--methods newton compliance ...]

Each line is a scene of `scenes.py`. All solvers start from dead load, in steps of 5 ms. "step" is
the least processor time of a step in `Stepper.batches` over some runs. "call" is the least time of
a whole `time_history` with method "auto", divided by the number of steps: it includes set-up,
selection of the solver, and recording. "error" is the largest difference of N from SNES relative
to the largest N, over a few steps from the state at the peak of the motion.

With `--against PATH` the same scenes run on another checkout as well. One process for each
checkout waits for commands, and both run by turns, so that both see the same load of the machine.
Ratios are times of this checkout divided by times of the other: of the best method of each, of
the method that each selects, and of whole calls. A method that a checkout does not offer, or that
does not apply to a scene, is left out there.
"""

import argparse
import contextlib
import json
import logging
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from scenes import DT, SITES, Scene, all_scenes
from setting import plain_options
from stepping import SteppedRun
from timing import least, table, watched

import archfem as af

ROOT = Path(__file__).parents[2]

METHODS = ("newton", "compliance")
"""Methods that are timed by default."""

CHECKED_STEPS = 5
"""Steps over which methods are compared with SNES."""

MIN_TIMED = 0.2
"""Processor time over which the steps of a method are repeated in each turn, at least [s]."""


class Worker:
    """Commands of the process that runs one checkout."""

    def __init__(self) -> None:
        self._scenes = {scene.name: scene for scene in all_scenes()}
        self._runs: dict[str, SteppedRun] = {}

    def imported(self) -> str:
        """Return the file from which archfem was imported."""
        return str(af.__file__)

    def open(self, scene: str, steps: int | None, methods: list[str]) -> dict[str, Any]:
        """Build a scene and prepare all methods that apply."""
        self._scene = self._scenes.pop(scene)
        self._steps = steps or self._scene.step_count
        self._runs, failures = {}, {}
        for method in methods:
            try:
                self._runs[method] = self._run(method)
            except af.InvalidInput:
                continue  # not offered by this checkout, or not for this scene
            except af.DidNotConverge as error:
                failures[method] = str(error)
        auto = self._run("auto")
        return {
            "methods": list(self._runs),
            "auto": auto.method,
            "failures": failures,
            "size": self._scene.model.size,
            "steps": self._steps,
        }

    def _run(self, method: str) -> SteppedRun:
        """Run the scene by one method."""
        return SteppedRun(lambda: self._scene.history(self._steps, method))

    def step(self, method: str) -> dict[str, float]:
        """Time the steps of a method [ms]."""
        run, milliseconds, spent = self._runs[method], float("inf"), 0.0
        while spent < MIN_TIMED:
            once = run.time_steps(1).cpu
            milliseconds, spent = min(milliseconds, once), spent + 1e-3 * once * run.steps
        return {"step": milliseconds, "iterations": run.iterations, "fallbacks": run.fallbacks}

    def call(self) -> float:
        """Time a whole call with method "auto", a step [ms]."""
        return least(watched(lambda: self._scene.history(self._steps, "auto")), self._steps, 1).cpu

    def errors(self) -> dict[str, float]:
        """Compare N with SNES over a few steps from the state at the peak of the motion."""
        motion = SITES[self._scene.site].motion().cut(0.0, (self._steps - CHECKED_STEPS) * DT)
        peak = max(1, int(np.argmax(np.abs(motion.horizontal)) * motion.dt / DT))
        before = self._scene.history(peak, "auto")
        start = af.dynamics.last_state(before)

        def normal_forces(method: str) -> np.ndarray:
            run = self._scene.history(peak + CHECKED_STEPS, method, start=start)
            return run.joints["N"].values

        exact = normal_forces("snes")
        scale = np.abs(exact).max()
        return {
            method: float(np.abs(normal_forces(method) - exact).max() / scale)
            for method in self._runs
        }


def serve() -> None:
    """Answer commands from the standard input, a line of JSON each."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # other output must not mix with the answers
    logging.disable(logging.WARNING)
    worker = Worker()
    for line in sys.stdin:
        command, arguments = json.loads(line)
        try:
            answer = {"answer": getattr(worker, command)(*arguments)}
        except Exception as error:  # reported by the process that waits for the answer
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


class Checkout:
    """A process that runs scenes with one checkout of archfem."""

    def __init__(self, path: Path) -> None:
        environment = os.environ | {
            "PYTHONPATH": str(path),
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
        }
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve()), "--serve"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            cwd=path,
            text=True,
        )
        imported = Path(self.ask("imported"))
        assert imported.is_relative_to(path), f"{imported} was imported in place of {path}"

    def ask(self, command: str, *arguments: Any) -> Any:
        """Send a command and wait for its answer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps([command, arguments]) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        answer = json.loads(line) if line else {"error": "the process has ended"}
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer["answer"]

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


class ThisProcess:
    """The checkout that this process has imported, with the methods of `Checkout`."""

    def __init__(self) -> None:
        self._worker = Worker()

    def ask(self, command: str, *arguments: Any) -> Any:
        """Carry out a command."""
        return getattr(self._worker, command)(*arguments)

    def close(self) -> None:
        """Do nothing."""


@contextlib.contextmanager
def checkouts(paths: list[Path], *, here: bool) -> Iterator[Sequence[Checkout | ThisProcess]]:
    """Start a process for each checkout, and end them all; or stay in this one."""
    started = [ThisProcess()] if here else [Checkout(path) for path in paths]
    try:
        yield started
    finally:
        for checkout in started:
            checkout.close()


def measure(
    trees: Sequence[Checkout | ThisProcess], scene: Scene, chosen: argparse.Namespace
) -> list[dict]:
    """Time a scene on each checkout by turns: size, methods, times, errors."""
    results = [tree.ask("open", scene.name, chosen.steps, chosen.methods) for tree in trees]
    for result in results:
        result["scene"], result["group"] = scene.name, scene.group
        result["step"] = dict.fromkeys(result["methods"], float("inf"))
        result["iterations"], result["fallbacks"], result["call"] = {}, {}, float("inf")
    for _ in range(chosen.repeat):
        turns = zip_longest(*(result["methods"] for result in results))
        for turn in turns:
            for tree, result, method in zip(trees, results, turn, strict=True):
                if method is not None:
                    run = tree.ask("step", method)
                    result["step"][method] = min(result["step"][method], run["step"])
                    result["iterations"][method] = run["iterations"]
                    result["fallbacks"][method] = run["fallbacks"]
        for tree, result in zip(trees, results, strict=True):
            result["call"] = min(result["call"], tree.ask("call"))
    for tree, result in zip(trees, results, strict=True):
        result["error"] = tree.ask("errors") if chosen.errors else {}
        # "auto" may select a method that was not timed by its name, such as SNES.
        result["auto_step"] = result["step"].get(result["auto"], float("nan"))
        result["best"] = min(result["step"], key=result["step"].__getitem__, default=None)
        result["best_step"] = result["step"].get(result["best"], float("nan"))
    return results


def ratios(own: dict, other: dict) -> dict[str, float]:
    """Divide the times of one checkout by those of another."""
    pairs = {
        "best": (own["best_step"], other["best_step"]),
        "auto": (own["auto_step"], other["best_step"]),
        "auto / auto": (own["auto_step"], other["auto_step"]),
        "call": (own["call"], other["call"]),
    }
    return {key: a / b for key, (a, b) in pairs.items()}


def method_cells(result: dict, methods: list[str]) -> list[str]:
    """Write the time of a step by each method, the selected one with a star."""
    cells = []
    for method in methods:
        star = "*" if method == result["auto"] else ""
        text = f"{result['step'][method]:.4f}{star}" if method in result["step"] else "-"
        if result["fallbacks"].get(method):
            text += f" ({result['fallbacks'][method]} SNES)"
        cells.append("fails" if method in result["failures"] else text)
    return cells


def summary(results: list[list[dict]]) -> str:
    """Write the median and worst ratio over all scenes: of methods, or of checkouts."""
    lines = []
    if len(results[0]) == 2:
        found = [(ratios(*pair), pair[0]["scene"]) for pair in results]
        for key in found[0][0]:
            values = [(each[key], scene) for each, scene in found if np.isfinite(each[key])]
            if values:
                worst, scene = max(values)
                lines.append(
                    f"{key}: median {np.median([value for value, _ in values]):.3f}, "
                    f"mean {np.mean([value for value, _ in values]):.3f}, "
                    f"worst {worst:.3f} ({scene}), {len(values)} scenes"
                )
    for number, tree in enumerate(zip(*results, strict=True)):
        own = [each for each in tree if each["step"]]
        kept = {}
        for method in sorted({method for each in own for method in each["step"]}):
            kept[method] = [
                each["step"][method] / each["best_step"] for each in own if method in each["step"]
            ]
        kept["auto"] = [each["auto_step"] / each["best_step"] for each in own]
        for method, values in kept.items():
            finite = [value for value in values if np.isfinite(value)]
            if finite:
                lines.append(
                    f"checkout {'AB'[number]}, {method} over the best of its scene: median "
                    f"{np.median(finite):.3f}, worst {max(finite):.3f}, {len(finite)} scenes"
                )
        errors = [value for each in own for value in each["error"].values()]
        if errors:
            lines.append(f"checkout {'AB'[number]}, largest error of N: {max(errors):.1e}")
    return "\n".join(lines)


def row(results: list[dict], methods: list[str]) -> list[object]:
    """Write one line of the table."""
    cells: list[object] = [results[0]["scene"], results[0]["size"]]
    for result in results:
        cells += method_cells(result, methods)
        cells.append(f"{result['call']:.4f}")
        cells.append(f"{max(result['error'].values(), default=float('nan')):.0e}")
    if len(results) == 2:
        cells += [f"{value:.2f}" for value in ratios(*results).values()]
    else:
        cells.append(f"{results[0]['auto_step'] / results[0]['best_step']:.2f}")
    return cells


def head(trees: int, methods: list[str]) -> list[object]:
    """Write the names of the columns."""
    names: list[object] = ["scene", "size"]
    for letter in "AB"[:trees]:
        names += [f"{letter} {name}" for name in (*methods, "call", "error")]
    return [*names, *(["best", "auto", "auto/auto", "call"] if trees == 2 else ["auto/best"])]


def parser() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    made = plain_options(__doc__)
    add = made.add_argument
    groups = tuple(dict.fromkeys(scene.group for scene in all_scenes()))
    add("--groups", nargs="+", choices=groups, default=list(groups), help="tables to print")
    add("--only", nargs="+", default=[""], help="scenes whose name contains all of these texts")
    add("--methods", nargs="+", default=list(METHODS), help="methods that are timed")
    add("--against", type=Path, help="another checkout to run by turns with this one")
    add("--tree", type=Path, default=ROOT, help="the checkout to time in place of this one")
    add("--repeat", type=int, default=3, help="turns, of which the least time counts")
    add("--steps", type=int, help="time steps of each run; by default those of the scene")
    add("--no-errors", dest="errors", action="store_false", help="no comparison with SNES")
    add("--json", type=Path, help="file for all results")
    add("--serve", action="store_true", help=argparse.SUPPRESS)
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Time all scenes that were chosen, and print tables and summaries."""
    chosen = parser().parse_args(arguments)
    if chosen.serve:
        serve()
        return
    scenes = [
        scene
        for scene in all_scenes()
        if scene.group in chosen.groups and all(text in scene.name for text in chosen.only)
    ]
    if chosen.quick:
        scenes, chosen.steps, chosen.repeat = scenes[:1], chosen.steps or 20, 1
    here = chosen.quick and chosen.tree == ROOT and not chosen.against
    paths = [
        Path(af.__file__).parents[1] if here else chosen.tree.resolve(),
        *([chosen.against.resolve()] if chosen.against else []),
    ]
    for letter, path in zip("AB", paths, strict=False):
        print(f"{letter}: {path}")
    everything = []
    with checkouts(paths, here=here) as trees:
        for group in dict.fromkeys(scene.group for scene in scenes):
            results = []
            for scene in (each for each in scenes if each.group == group):
                try:
                    results.append(measure(trees, scene, chosen))
                except (RuntimeError, af.ArchfemError) as error:
                    print(f"{scene.name} fails: {error}", flush=True)
                    continue
                print(*row(results[-1], chosen.methods), sep=" | ", file=sys.stderr, flush=True)
                if chosen.json:
                    chosen.json.write_text(json.dumps([*everything, *results], indent=1))
            if not results:
                continue
            everything += results
            print(f"\n## {group}: processor time of a step [ms], * selected by 'auto'\n")
            print(
                table(head(len(trees), chosen.methods), [row(r, chosen.methods) for r in results])
            )
            print(f"\n{summary(results)}", flush=True)


if __name__ == "__main__":
    main()
