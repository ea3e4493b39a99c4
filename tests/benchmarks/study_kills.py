"""A study whose processes are killed at random moments gives the same bits as an undisturbed one.

    python tests/benchmarks/study_kills.py --points 160 --kills 30

The study varies thickness and scale of a rigid ring, on two processes. The driver, its workers and
the fork server are killed in turn with SIGKILL, ten times each, after a time drawn evenly; a killed
driver is started again. Should the study end before, it begins anew in another folder, which is
compared as well. At the end no process is left.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from setting import plain_options

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
SAME = ("results.nc", "results.csv")


def driver(folder: Path, out: Path, workers: int = 2) -> "subprocess.Popen[bytes]":
    """Start the command of the study."""
    command = [sys.executable, "-m", "archfem", "study", "--own-code", str(folder / "study.toml")]
    with (folder / "log.txt").open("a") as log:
        return subprocess.Popen(
            [*command, "--out", str(out), "--workers", str(workers)], stdout=log, stderr=log
        )


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
    """Points of a study that are finished."""
    return len(list(out.glob("points/*/*.json")))


def disturbed(folder: Path, out: Path, kills: dict[str, int], most: float, chance: random.Random):
    """Carry out a study, killing for as long as there is something left; return who was met."""
    met: set[int] = set()
    process = driver(folder, out)
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
        print(f"killed a {kind} with {rows(out)} points done", flush=True)
        if kind == "driver":
            process.wait()
            process = driver(folder, out)
    if process.returncode:
        log = (folder / "log.txt").read_text()[-3000:]
        raise SystemExit(f"{log}\nthe study ended with {process.returncode}")
    return met


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare a study left alone with others that were not."""
    parser = plain_options(__doc__)
    parser.add_argument("--points", type=int, default=160)
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    if given.quick:
        given.points, given.kills = 4, 0
    chance = random.Random(given.seed)
    each = given.kills // 3
    kills = {"driver": each, "worker": given.kills - 2 * each, "server": each}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "ring.toml").write_text(CASE)
        scales = [round(0.5 + 0.01 * k, 2) for k in range(given.points // 4)]
        (folder / "study.toml").write_text(
            f'case = "ring.toml"\n[vary]\nstructure.thickness = [0.5, 0.55, 0.6, 0.05]\n'
            f"motion.scale = {scales}\n"
        )
        begun = time.monotonic()
        assert driver(folder, folder / "alone", 1 if given.quick else 2).wait() == 0
        spent = time.monotonic() - begun
        print(f"left alone: {rows(folder / 'alone')} points in {spent:.1f} s", flush=True)
        studies, total = 0, given.kills
        while any(kills.values()):
            out = folder / f"disturbed {studies}"
            met = disturbed(folder, out, kills, 0.25 * spent, chance)
            same = [
                (folder / "alone" / name).read_bytes() == (out / name).read_bytes() for name in SAME
            ]
            studies += 1
            print(f"study {studies}: {rows(out)} points, the same bits: {all(same)}", flush=True)
            if not all(same):
                raise SystemExit("a study that was killed and gone on with differs")
            if left := [each for each in met if is_fork_server(each)]:
                raise SystemExit(f"processes {left} are left of it")
    print(f"{total} kills over {studies} studies: the same bits in all, and nobody left")


if __name__ == "__main__":
    main()
