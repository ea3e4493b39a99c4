"""A study whose driver and workers are killed at random moments ends in the bits of one left alone.

    python tests/benchmarks/study_kills.py --points 160 --kills 20

The study goes over thickness and scale of a rigid ring, on two processes. Driver and workers are
killed in turn with SIGKILL, ten each, after a time drawn evenly; a killed driver is started again.
Should the study end before, it begins anew in another folder, which is compared as well.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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


def driver(folder: Path, out: Path) -> "subprocess.Popen[bytes]":
    """The study's command, begun."""
    command = [sys.executable, "-m", "archfem", "study", "--own-code", str(folder / "study.toml")]
    with (folder / "log.txt").open("a") as log:
        return subprocess.Popen(
            [*command, "--out", str(out), "--workers", "2"], stdout=log, stderr=log
        )


def workers(process: "subprocess.Popen[bytes]") -> list[int]:
    """Processes that a driver has begun."""
    try:
        text = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
    except OSError:
        return []
    commands = {int(word): Path(f"/proc/{word}/cmdline") for word in text.split()}
    return [pid for pid, command in commands.items() if b"studies.worker" in _read(command)]


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def rows(out: Path) -> int:
    """Points of a study that are finished."""
    return len(list(out.glob("points/*/*.json")))


def disturbed(folder: Path, out: Path, kills: dict[str, int], most: float, chance: random.Random):
    """Carry out a study, killing for as long as there is something left to kill."""
    process = driver(folder, out)
    while process.poll() is None:
        left = [kind for kind, count in kills.items() if count]
        if not left:
            process.wait()
            break
        kind = chance.choice(left)
        time.sleep(chance.uniform(0.0, most))
        victims = workers(process) if kind == "worker" else [process.pid]
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


def main() -> None:
    """Compare a study left alone with others that were not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=160)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    chance = random.Random(given.seed)
    kills = {"driver": given.kills // 2, "worker": given.kills - given.kills // 2}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "ring.toml").write_text(CASE)
        scales = [round(0.5 + 0.01 * k, 2) for k in range(given.points // 4)]
        (folder / "study.toml").write_text(
            f'case = "ring.toml"\n[over]\nstructure.thickness = [0.5, 0.55, 0.6, 0.05]\n'
            f"motion.scale = {scales}\n"
        )
        begun = time.monotonic()
        assert driver(folder, folder / "alone").wait() == 0
        spent = time.monotonic() - begun
        print(f"left alone: {rows(folder / 'alone')} points in {spent:.1f} s", flush=True)
        studies, total = 0, given.kills
        while any(kills.values()):
            out = folder / f"disturbed {studies}"
            disturbed(folder, out, kills, 0.25 * spent, chance)
            same = [
                (folder / "alone" / name).read_bytes() == (out / name).read_bytes() for name in SAME
            ]
            studies += 1
            print(f"study {studies}: {rows(out)} points, the same bits: {all(same)}", flush=True)
            if not all(same):
                raise SystemExit("a study that was killed and gone on with differs")
    print(f"{total} kills over {studies} studies: all ended in the same bits")


if __name__ == "__main__":
    main()
