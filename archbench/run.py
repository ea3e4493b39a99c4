"""Run programs on scenes and store their answers: `python -m archbench.run`.

Each program answers a scene in a process of its own with a time limit. A program that hangs, dies
or gives no number is reported in its results, and on the last lines printed.
"""

import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Self

from archbench.programs import Program, programs
from archbench.scene import HERE, BenchError, read_references, read_scene, scene_names
from archbench.worker import load

ROOT = HERE.parent
RESULTS = HERE / "results"

# A run beyond this is ended [s]
TIME_LIMIT = 60.0

Answer = dict[str, Any]


class Process:
    """A process of a program that answers a scene, by one settings after another.

    It starts at its first request, and anew after it died or was ended.
    """

    def __init__(self, program: Program, scene: dict[str, Any], limit: float = TIME_LIMIT) -> None:
        """Prepare a process.

        Args:
            program: to run.
            scene: as read.
            limit: on the time of each answer [s].
        """
        self.program, self.scene, self.limit = program, scene, limit
        self.process: subprocess.Popen[str] | None = None
        self.count = 0

    def __enter__(self) -> Self:
        """Make a folder for the files."""
        self.folder = Path(tempfile.mkdtemp())
        (self.folder / "scene.json").write_text(json.dumps(self.scene), encoding="utf-8")
        return self

    def __exit__(self, *_: object) -> None:
        """End the process and remove its files."""
        self._end()
        shutil.rmtree(self.folder)

    def ask(self, settings: dict[str, Any]) -> Answer:
        """Return the answer of the adapter with its settings. Without one, "failed" says why."""
        found: Answer = {"settings": settings}
        self.count += 1
        path = self.folder / f"answer {self.count}.json"
        try:
            process = self._start()
            assert process.stdin is not None
            print(json.dumps({"settings": settings, "answer": str(path)}), file=process.stdin)
            process.stdin.flush()
        except BrokenPipeError:
            failed = self._failure()
        except OSError as error:
            failed = f"does not start: {error}"
        else:
            failed = self._wait(process, path)
        if not failed:
            found |= json.loads(path.read_text(encoding="utf-8"))
            failed = _missing_numbers(found, self.scene)
        return found | ({"failed": failed} if failed else {})

    def _start(self) -> "subprocess.Popen[str]":
        """Start the process where there is none, and return it."""
        if self.process is None:
            worker, scene = str(HERE / "worker.py"), str(self.folder / "scene.json")
            one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
            paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
            with (self.folder / "errors.txt").open("w") as errors:
                self.process = subprocess.Popen(
                    [str(self.program.executable), worker, str(self.program.adapter), scene],
                    cwd=self.folder,
                    env={**os.environ, **one_thread, "PYTHONPATH": paths},
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=errors,
                    text=True,
                )
        return self.process

    def _wait(self, process: "subprocess.Popen[str]", path: Path, pause: float = 0.01) -> str:
        """Wait for an answer; return why there is none, or nothing."""
        latest = time.monotonic() + self.limit
        while not path.exists():
            if process.poll() is not None:
                # it may have ended right after its answer
                return "" if path.exists() else self._failure()
            if time.monotonic() > latest:
                self._end()
                return f"no answer within {self.limit:g} s"
            time.sleep(pause)
        return ""

    def _failure(self) -> str:
        """Return why a process ended without an answer."""
        assert self.process is not None
        code = self.process.wait()
        self._end()
        if code < 0:
            return f"died of signal {-code}"
        text = (self.folder / "errors.txt").read_text(encoding="utf-8", errors="replace")
        return (text.strip().splitlines() or [f"exit code {code}"])[-1]

    def _end(self) -> None:
        """End the process where there is one."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
        self.process = None


def _missing_numbers(found: Answer, scene: dict[str, Any]) -> str:
    """Return which quantities have no finite number; empty where one has, and none is infinite."""
    values = found.get("values", {})
    given = [name for name in scene["quantities"] if name in values]
    missing = [
        name
        for name in given or scene["quantities"]
        if not isinstance(values.get(name), int | float) or not math.isfinite(values[name])
    ]
    return f"no number for {', '.join(missing)}" if missing else ""


def run_scene(chosen: Sequence[Program], name: str, limit: float = TIME_LIMIT) -> dict[str, Answer]:
    """Run programs on a scene with each of their settings; return the answers by program.

    The first settings of each other program run in turn with those of archfem. The processor times
    of both are the "cost" of the answer.
    """
    scene = read_scene(name)
    kind = scene["action"]["kind"]
    found: dict[str, Answer] = {}
    (archfem,) = (program for program in programs() if program.name == "archfem")
    with Process(archfem, scene, limit) as beside:
        for program in chosen:
            if why := program.refusal(scene):
                found[program.name] = {"cannot": why}
                continue
            first, *others = program.settings[kind]
            if program.name == "archfem":
                found["archfem"] = {"runs": [beside.ask(each) for each in (first, *others)]}
                continue
            with Process(program, scene, limit) as process:
                answer, cost = process.ask(first), {}
                if "failed" not in answer and not archfem.refusal(scene):
                    other = archfem.settings[kind][0]
                    cost = {"cost": times_in_turn((process, first, answer), (beside, other))}
                runs = [answer, *map(process.ask, others)]
                found[program.name] = {"runs": runs, **cost}
    return found


def times_in_turn(
    own: tuple[Process, dict[str, Any], Answer],
    archfem: tuple[Process, dict[str, Any]],
    turns: int = 3,
    long: float = 3.0,
) -> dict[str, list[float]]:
    """Return processor times of a program and of archfem, run in turn [s].

    Args:
        own: process, settings and first answer of the program.
        archfem: process and settings of archfem.
        turns: number of runs of each.
        long: a program whose answer takes longer is not run again [s].
    """
    (process, settings, answer), (beside, others) = own, archfem
    found: dict[str, list[float]] = {"own": [], "archfem": []}
    for _ in range(turns):
        if answer["cpu_s"] <= long:
            answer = process.ask(settings)
        run = beside.ask(others)
        if "failed" in answer or "failed" in run:
            break
        found["own"].append(answer["cpu_s"])
        found["archfem"].append(run["cpu_s"])
        if answer["cpu_s"] > long:
            break
    return found


def results_of(program: str, folder: Path = RESULTS) -> dict[str, Answer]:
    """Return stored answers of a program by scene; empty where there are none."""
    path = folder / f"{program}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def store(program: str, answers: dict[str, Answer], folder: Path = RESULTS) -> None:
    """Store answers of a program, one file a program, in order of scenes."""
    lines = []
    for name in sorted(answers):
        text = json.dumps(_short(answers[name]), ensure_ascii=False)
        # one run a line: differences between versions stay readable
        lines.append(f'"{name}": ' + text.replace('{"settings"', '\n {"settings"'))
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    (folder / f"{program}.json").write_text(text, encoding="utf-8")


def _short(value: Any) -> Any:
    """Return a value with floats of five digits."""
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {key: _short(each) for key, each in value.items()}
    return [_short(each) for each in value] if isinstance(value, list | tuple) else value


def check_inputs(names: Sequence[str]) -> list[str]:
    """Return the faults of scenes and references."""
    found = []
    for name in names:
        try:
            read_references(name)
        except BenchError as error:
            found.append(str(error))
    return found


def failures(program: str, answers: dict[str, Answer]) -> list[str]:
    """Return the runs without an answer, one line each."""
    return [
        f"{program} {name}: {run['failed']}"
        for name, answer in answers.items()
        for run in answer.get("runs", ())
        if "failed" in run
    ]


def compare_with_stored(cost: float = 2.0, tolerance: float = 1e-3) -> tuple[list[str], int]:
    """Run archfem again in this process, each scene by each of its settings.

    Args:
        cost: stored runs that took longer are left out [s].
        tolerance: relative difference from the stored answer; brackets are not finer.

    Returns:
        The differences, one line each, and the number of runs.
    """
    (program,) = (each for each in programs() if each.name == "archfem")
    adapter, differences, count = load(program.adapter), [], 0
    for name, answer in results_of("archfem").items():
        for stored in answer.get("runs", ()):
            if "failed" in stored or stored["cpu_s"] > cost:
                continue
            found = adapter.run(read_scene(name), stored["settings"])["values"]
            count += 1
            what = f"{name}, {stored['settings']}"
            differences += [
                f"{what}, {quantity}: {found[quantity]:.6g}, stored {value:.6g}"
                for quantity, value in stored["values"].items()
                if not math.isclose(found[quantity], value, rel_tol=tolerance)
            ]
    return differences, count


def main(arguments: Sequence[str] | None = None) -> int:
    """Run programs on scenes and store the answers; return how many things went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", nargs="+", metavar="NAME", help="only these programs")
    parser.add_argument("--scene", nargs="+", metavar="NAME", help="only these scenes")
    parser.add_argument("--install", action="store_true", help="install what is missing")
    parser.add_argument("--workers", type=int, default=2, help="runs at a time")
    parser.add_argument("--limit", type=float, default=TIME_LIMIT, help="of each run [s]")
    parser.add_argument("--quick", action="store_true", help="archfem against stored answers")
    chosen = parser.parse_args(arguments)
    if chosen.quick:
        differences, count = compare_with_stored()
        print(*differences, f"archfem: {count} runs, {len(differences)} changed", sep="\n")
        return len(differences)
    names = [n for n in scene_names() if not chosen.scene or n.startswith(tuple(chosen.scene))]
    wrong = check_inputs(names)
    ready = []
    for program in programs():
        if chosen.program and program.name not in chosen.program:
            continue
        why = program.install() if chosen.install else ""
        if why or not program.is_installed():
            print(f"{program.name}: skipped, not installed. {why}".rstrip())
        else:
            ready.append(program)
    start = time.monotonic()
    wrong += run_all(ready, names, chosen.limit, chosen.workers)
    print(*wrong, f"{len(wrong)} things went wrong", sep="\n")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{used.ru_utime + used.ru_stime:.0f} s of processor time in "
        f"{time.monotonic() - start:.0f} s, {chosen.workers} scenes at a time"
    )
    return len(wrong)


def run_all(
    chosen: Sequence[Program], names: Sequence[str], limit: float, workers: int
) -> list[str]:
    """Run programs on scenes, store and print the answers; return the runs without one."""
    found = {program.name: results_of(program.name) for program in chosen}

    def cost(name: str) -> float:
        return sum(stored_cost(answers.get(name, {})) for answers in found.values())

    fresh: list[str] = []
    with ThreadPoolExecutor(workers) as pool:
        # the longest scenes first, so that no worker is left with one at the end
        order = sorted(names, key=cost, reverse=True)
        runs = {pool.submit(run_scene, chosen, name, limit): name for name in order}
        for run in as_completed(runs):
            name = runs[run]
            for program, answer in run.result().items():
                found[program][name] = answer
                store(program, found[program])
                fresh += failures(program, {name: answer})
                print(f"{name} {program}: {summary(answer)}", flush=True)
    return fresh


def stored_cost(answer: Answer) -> float:
    """Return the processor time of a stored answer; a failed run counts its limit [s]."""
    return sum(run.get("cpu_s", TIME_LIMIT) for run in answer.get("runs", ()))


def summary(answer: Answer) -> str:
    """Return an answer in one line."""
    if "cannot" in answer:
        return f"cannot: {answer['cannot']}"
    texts = []
    for run in answer["runs"]:
        values = ", ".join(f"{name} {value:.5g}" for name, value in run.get("values", {}).items())
        texts.append(run.get("failed") or f"{values} ({run['cpu_s']:.2g} s)")
    return "; ".join(texts)


if __name__ == "__main__":
    wrong = main(sys.argv[1:])
    # programs may fail, and the table shows it; changed answers of archfem are an error
    sys.exit(min(wrong, 1) if "--quick" in sys.argv else 0)
