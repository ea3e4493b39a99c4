"""Run programs on scenes and store their answers: `python -m archbench.run`.

Each run is a process of its own with a time limit. A program that hangs, dies or gives no number
is reported in its results, and on the last lines printed.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from archbench.programs import Program, programs
from archbench.scene import HERE, BenchError, read_references, read_scene, scene_names
from archbench.worker import load

RESULTS = HERE / "results"

# A run beyond this is ended [s]
TIME_LIMIT = 90.0

Answer = dict[str, Any]


def run_once(
    program: Program, scene: dict[str, Any], settings: dict[str, Any], limit: float = TIME_LIMIT
) -> Answer:
    """Run a program on a scene with given settings.

    Args:
        program: to run.
        scene: as read.
        settings: of the program.
        limit: on the time of the process [s].

    Returns:
        The answer of the adapter with its settings. Without one, "failed" says why.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = {name: Path(folder) / f"{name}.json" for name in ("scene", "settings", "answer")}
        files["scene"].write_text(json.dumps(scene), encoding="utf-8")
        files["settings"].write_text(json.dumps(settings), encoding="utf-8")
        worker = str(HERE / "worker.py")
        command = [str(program.executable), worker, str(program.adapter), *map(str, files.values())]
        failed = _run_process(command, Path(folder), limit)
        found: Answer = {"settings": settings}
        if not failed and files["answer"].exists():
            found |= json.loads(files["answer"].read_text(encoding="utf-8"))
            failed = _missing_numbers(found, scene)
        return found | ({"failed": failed} if failed else {})


def _run_process(command: Sequence[str], folder: Path, limit: float) -> str:
    """Run a command; return why it failed, or nothing."""
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    paths = [str(HERE.parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, **one_thread, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=limit,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {limit:g} s"
    except OSError as error:
        return f"does not start: {error}"
    if done.returncode == 0:
        return ""
    if done.returncode < 0:
        return f"died of signal {-done.returncode}"
    return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


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


def run_scene(program: Program, name: str, limit: float = TIME_LIMIT) -> Answer:
    """Run a program on a scene with each of its settings."""
    scene = read_scene(name)
    if why := program.refusal(scene):
        return {"cannot": why}
    settings = program.settings[scene["action"]["kind"]]
    return {"runs": [run_once(program, scene, each, limit) for each in settings]}


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
    """Return what is wrong with scenes and references."""
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
    """Run archfem again in this process, each scene by its first settings.

    Args:
        cost: scenes whose stored run took longer are left out [s].
        tolerance: relative difference from the stored answer; brackets are not finer.

    Returns:
        The differences, one line each, and the number of scenes that were run.
    """
    (program,) = (each for each in programs() if each.name == "archfem")
    adapter, differences, count = load(program.adapter), [], 0
    for name, answer in results_of("archfem").items():
        runs = answer.get("runs")
        if not runs or "failed" in runs[0] or runs[0]["cpu_s"] > cost:
            continue
        stored = runs[0]
        found = adapter.run(read_scene(name), stored["settings"])["values"]
        count += 1
        for quantity, value in stored["values"].items():
            if not math.isclose(found[quantity], value, rel_tol=tolerance):
                differences.append(f"{name}, {quantity}: {found[quantity]:.6g}, stored {value:.6g}")
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
        print(*differences, f"archfem: {count} scenes, {len(differences)} changed", sep="\n")
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
    # all programs run a scene at about the same time, so that their costs compare
    pairs = [(program, name) for name in names for program in ready]
    found: dict[str, dict[str, Answer]] = {
        program.name: results_of(program.name) for program in ready
    }
    with ThreadPoolExecutor(chosen.workers) as pool:
        runs = [pool.submit(run_scene, *pair, chosen.limit) for pair in pairs]
        for (program, name), run in zip(pairs, runs, strict=True):
            found[program.name][name] = run.result()
            store(program.name, found[program.name])
            print(f"{name} {program.name}: {summary(found[program.name][name])}", flush=True)
    for program in ready:
        fresh = {name: found[program.name][name] for name in names}
        wrong += failures(program.name, fresh)
    print(*wrong, f"{len(wrong)} things went wrong", sep="\n")
    return len(wrong)


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
