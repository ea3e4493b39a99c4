"""A command whose processes are killed at random moments gives the same bits as an undisturbed one.

    python tests/benchmarks/study_kills.py --points 160 --kills 30
    python tests/benchmarks/study_kills.py --what run --kills 15
    python tests/benchmarks/study_kills.py --what suite --kills 15

The study varies thickness and scale of a rigid ring, on two processes. The driver, its workers and
the fork server are killed in turn with SIGKILL, equally often, after a time drawn evenly; a killed
driver is started again. Should the command end before, it begins anew in another folder, which is
compared as well. At the end no process is left, and no draft of a file.

The run has one motion and one process; the suite has four pairs on two. Their folders hold another
run before. After each kill of a driver they hold all files of one run, the earlier or the new one.
"""

import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from setting import plain_options

import archfem as af

CASE = """
title = "a small ring"
[structure]
shape = "circular_arch"
radius = 3.0
thickness = 0.6
embrace = 150.0
voussoirs = 9
[model]
fidelity = "rigid"
[analysis]
dt = 0.005
damping = { ratio = 0.05, frequency = 8.0 }
[motion]
synthetic = { seed = 1, duration = 4.0, pga = 3.0 }
"""
PAIRS = "".join(
    f"pair{seed} = {{ synthetic = {{ seed = {seed}, duration = 4.0, pga = 3.0 }} }}\n"
    for seed in range(1, 5)
)


def driver(
    folder: Path, out: Path, what: str = "study", workers: int = 2, change: str = ""
) -> "subprocess.Popen[bytes]":
    """Start the command."""
    command = [sys.executable, "-m", "archfem", "study" if what == "study" else "run"]
    command += [str(folder / f"{what}.toml"), "--out", str(out), "--workers", str(workers)]
    command += ["--set", change] if change else []
    with (folder / "log.txt").open("a") as log:
        return subprocess.Popen(command, stdout=log, stderr=log)


def servers(process: int) -> list[int]:
    """Fork servers that a driver has started."""
    return [each for each in children(process) if is_fork_server(each)]


def is_fork_server(process: int) -> bool:
    """Whether a process is a fork server, or a worker, which has its command line."""
    return b"multiprocessing.forkserver" in read(process, "cmdline")


def workers(process: int) -> list[int]:
    """Workers that these have forked."""
    return [each for server in servers(process) for each in children(server)]


def children(process: int) -> list[int]:
    """Processes that a process has started."""
    return [int(word) for word in read(process, f"task/{process}/children").split()]


def read(process: int, name: str) -> bytes:
    """Content of a file of /proc; empty for a process that has ended."""
    try:
        return Path(f"/proc/{process}/{name}").read_bytes()
    except OSError:
        return b""


def rows(out: Path) -> int:
    """Points or pairs that are finished."""
    return len(list(out.glob("points/*/*.json"))) or len(list(out.rglob("history.nc")))


def visible(out: Path) -> dict[str, str]:
    """Digests of the files of a folder, without drafts and without the progress of a study."""
    files = (path for path in out.rglob("*") if path.is_file())
    names = {path.relative_to(out).as_posix(): path for path in files}
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in names.items()
        if not name.startswith(".") and name not in ("progress.json", "workers.log")
    }


def check_between(out: Path, allowed: Sequence[dict[str, str]]) -> None:
    """End the script unless a folder holds one of some runs, as whoever reads it finds it."""
    af.cases.open_results(out)  # completes what a killed command had finished
    if visible(out) not in allowed:
        raise SystemExit(f"{out} holds files of several runs")


def disturbed(
    folder: Path,
    out: Path,
    what: str,
    kills: dict[str, int],
    most: float,
    chance: random.Random,
    allowed: Sequence[dict[str, str]],
) -> set[int]:
    """Carry out a command, killing for as long as there is something left; return who was met."""
    met: set[int] = set()
    process = driver(folder, out, what)
    while process.poll() is None:
        left = [kind for kind, count in kills.items() if count]
        if not left:
            process.wait()
            break
        kind = chance.choice(left)
        time.sleep(chance.uniform(0.0, most))
        begun = {"server": servers(process.pid), "worker": workers(process.pid)}
        met.update(each for some in begun.values() for each in some)
        victims = begun.get(kind, [process.pid])
        if process.poll() is not None or not victims:
            continue
        os.kill(chance.choice(victims), signal.SIGKILL)
        kills[kind] -= 1
        print(f"killed a {kind} with {rows(out)} finished", flush=True)
        if kind == "driver":
            process.wait()
            if allowed:
                check_between(out, allowed)
            process = driver(folder, out, what)
    if process.returncode:
        log = (folder / "log.txt").read_text()[-3000:]
        raise SystemExit(f"{log}\nthe command ended with {process.returncode}")
    return met


def write_cases(folder: Path, points: int) -> None:
    """Write the files of a case, a suite and a study."""
    (folder / "run.toml").write_text(CASE)
    suite = CASE.split("[motion]")[0] + f"[suite.pairs]\n{PAIRS}"
    (folder / "suite.toml").write_text(suite)
    scales = [round(0.5 + 0.01 * k, 2) for k in range(points // 4)]
    (folder / "study.toml").write_text(
        f'case = "run.toml"\n[vary]\nstructure.thickness = [0.5, 0.55, 0.6, 0.05]\n'
        f"motion.scale = {scales}\n"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare a command left alone with others that were not."""
    parser = plain_options(__doc__)
    parser.add_argument("--what", choices=("study", "run", "suite"), default="study")
    parser.add_argument("--points", type=int, default=160)
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    if given.quick:
        given.points, given.kills = 4, 0
    what, chance = given.what, random.Random(given.seed)
    each = 0 if what == "run" else given.kills // 3
    kills = {"driver": given.kills - 2 * each, "worker": each, "server": each}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_cases(folder, given.points)
        alone, before = folder / "alone", folder / "before"
        if what != "study":
            assert driver(folder, before, what, change="structure.thickness=0.62").wait() == 0
        begun = time.monotonic()
        assert driver(folder, alone, what, 1 if given.quick else 2).wait() == 0
        spent = time.monotonic() - begun
        print(f"left alone: {rows(alone)} in {spent:.1f} s", flush=True)
        commands, total = 0, given.kills
        while any(kills.values()):
            out = folder / f"disturbed {commands}"
            allowed = []
            if what != "study":
                shutil.copytree(before, out)
                allowed = [visible(before), visible(alone)]
            # a study goes on where it was, a run of one motion begins anew
            most = {"study": 0.25, "suite": 0.6, "run": 1.1}[what] * spent
            met = disturbed(folder, out, what, kills, most, chance, allowed)
            commands += 1
            differing = sorted({name for name, _ in visible(alone).items() ^ visible(out).items()})
            print(f"{what} {commands}: {rows(out)} finished, differing: {differing}", flush=True)
            if differing or list(out.rglob(".*")):  # drafts
                raise SystemExit(f"this {what} is not as if it had been left alone")
            deadline = time.monotonic() + 30.0  # they end when they notice that the driver has
            while left := [each for each in met if is_fork_server(each)]:
                if time.monotonic() > deadline:
                    raise SystemExit(f"processes {left} are left of it")
                time.sleep(0.1)
    print(f"{total} kills over {commands} commands: the same bits in all, and nothing left")


if __name__ == "__main__":
    main()
