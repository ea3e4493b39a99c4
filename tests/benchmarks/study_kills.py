"""A command whose processes are killed at random moments gives the same bits as an undisturbed one.

    python tests/benchmarks/study_kills.py --kills 60
    python tests/benchmarks/study_kills.py --what suite --kills 20 --seed 2

Commands are a run of one motion, a suite of three pairs, a study, an incremental dynamic analysis,
a range of verdicts, and `run_case` in Python. The process that was started, its workers and their
fork server are ended in turn, by SIGKILL and by SIGTERM, after a time drawn evenly; a command whose
own process was ended is started again. Should it end before, it begins anew in another folder,
which is compared as well.

Folders of runs, suites and verdicts hold results of another case before. After each kill they hold
all files of the one or of the other, as whoever reads them finds them. At the end all files have
the bits of an undisturbed command, and no process, draft, lock or temporary file is left.
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
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
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
synthetic = { seed = 1, duration = 1.0, pga = 3.0 }
"""
PAIRS = "".join(
    f"pair{seed} = {{ synthetic = {{ seed = {seed}, duration = 1.0, pga = 3.0 }} }}\n"
    for seed in range(1, 4)
)
CALLS = """
import sys
import archfem as af

if __name__ == "__main__":
    what, case, folder, workers, *changes = sys.argv[1:]
    case = af.Case.read(case, changes)
    if what == "ida":
        af.ida(case, folder=folder, precision=0.1, workers=int(workers))
    else:
        list(af.cases.run_case(case, folder))
"""

# Case or study of each command, and killed processes: itself, workers, their fork server
COMMANDS = {
    "run": ("run.toml", ("driver",)),
    "suite": ("suite.toml", ("driver", "worker", "server")),
    "study": ("study.toml", ("driver", "worker", "server")),
    "ida": ("suite.toml", ("driver", "worker", "server")),
    "verdict": ("run.toml", ("driver", "worker", "server")),
    "python": ("suite.toml", ("driver",)),
}

# Change of the case that the folder holds before; none where finished points are kept
CHANGE = "structure.thickness=0.62"
RESUMED = ("study", "ida")


@dataclass
class Command:
    """A command, its undisturbed results, and those that its folder holds before."""

    what: str
    folder: Path  # of cases and results
    workers: int = 2
    spent: float = 0.0  # by the undisturbed command [s]
    allowed: list[dict[str, str]] = field(default_factory=list)
    ended: Counter[str] = field(default_factory=Counter)
    commands: int = 0

    def start(self, out: Path, *changes: str) -> "subprocess.Popen[bytes]":
        """Start the command with temporary files in a folder of its own."""
        case = str(self.folder / COMMANDS[self.what][0])
        if self.what in ("ida", "python"):
            script = str(self.folder / "calls.py")
            words = [script, self.what, case, str(out), str(self.workers), *changes]
        else:
            name = self.what if self.what in ("study", "verdict") else "run"
            words = ["-m", "archfem", name, case, "--out", str(out)]
            words += [] if self.what == "run" else ["--workers", str(self.workers)]
            words += [word for change in changes for word in ("--set", change)]
        environment = os.environ | {"TMPDIR": str(self.temporary)}
        with (self.folder / "log.txt").open("a") as log:
            return subprocess.Popen(
                [sys.executable, *words], stdout=log, stderr=log, env=environment
            )

    @property
    def temporary(self) -> Path:
        """Folder of temporary files."""
        folder = self.folder / "temporary"
        folder.mkdir(exist_ok=True)
        return folder

    def fail(self, words: str) -> None:
        """End the script, with the last lines of the command's output."""
        raise SystemExit(f"{(self.folder / 'log.txt').read_text()[-3000:]}\n{self.what}: {words}")

    def prepare(self) -> None:
        """Carry out the command undisturbed, and on the case that was there before."""
        if self.what not in RESUMED:
            if self.start(self.folder / "before", CHANGE).wait():
                self.fail("the case before failed")
            self.allowed = [visible(self.folder / "before")]
        begun = time.monotonic()
        if self.start(self.folder / "alone").wait():
            self.fail("the undisturbed command failed")
        self.spent = time.monotonic() - begun
        self.allowed.append(visible(self.folder / "alone"))

    def disturb(self, kills: list[tuple[str, int]], chance: random.Random) -> None:
        """Carry out the command in a new folder, ending processes of it while kills are left."""
        out = self.folder / f"disturbed {self.commands}"
        self.commands += 1
        if self.what not in RESUMED:
            shutil.copytree(self.folder / "before", out)
        met: set[int] = set()
        process = self.start(out)
        while process.poll() is None:
            if not kills:
                process.wait()
                break
            kind, number = kills[0]
            # a command that continues where it was would end before a late kill
            time.sleep(chance.uniform(0.0, (0.9 if self.what == "run" else 0.6) * self.spent))
            begun = {"server": servers(process.pid), "worker": workers(process.pid)}
            met.update(each for some in begun.values() for each in some)
            victims = begun.get(kind, [process.pid])
            if process.poll() is not None or not victims:
                continue
            os.kill(chance.choice(victims), number)
            self.ended[f"{kind} {signal.Signals(number).name}"] += 1
            kills.pop(0)
            if kind == "driver":
                process.wait()
                print(f"{self.what}: {sum(self.ended.values())} kills", flush=True)
                self.check_between(out)
                process = self.start(out)
        if process.returncode:
            self.fail(f"the command ended with {process.returncode}")
        self.check_end(out, met)

    def check_between(self, out: Path) -> None:
        """End the script unless a folder holds one of two runs, as whoever reads it finds it."""
        if self.what in RESUMED:
            return
        if self.what != "verdict":
            af.cases.open_results(out)  # completes the results of a killed command
        found = visible(out)
        if self.what == "python":  # whose pairs appear one by one
            del found["archfem.json"]
            whole = any(found.items() <= each.items() for each in self.allowed)
        else:
            whole = found in self.allowed or (out / ".finished").exists()
        if not whole:
            self.fail(f"{out} holds files of several runs")

    def check_end(self, out: Path, met: set[int]) -> None:
        """End the script if results differ, or something is left."""
        differing = sorted({name for name, _ in self.allowed[-1].items() ^ visible(out).items()})
        left = [path.name for path in out.rglob(".*")]
        temporary = [path.name for path in self.temporary.iterdir()]
        # Open MPI leaves its own folders
        left += [name for name in temporary if name[:5] != "ompi."]
        if differing or left:
            self.fail(f"differing: {differing}; left: {left}")
        deadline = time.monotonic() + 30.0  # they end when they notice that the driver has
        while remaining := [each for each in met if is_fork_server(each)]:
            if time.monotonic() > deadline:
                self.fail(f"processes {remaining} are left")
            time.sleep(0.1)
        shutil.rmtree(out)


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


def visible(out: Path) -> dict[str, str]:
    """Digests of the files of a folder, without drafts and without the progress of a study."""
    files = (path for path in out.rglob("*") if path.is_file())
    names = {path.relative_to(out).as_posix(): path for path in files}
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in names.items()
        if not name.startswith(".") and name not in ("progress.json", "workers.log")
    }


def write_cases(folder: Path, points: int) -> None:
    """Write the files of a case, a suite, a study and a script."""
    folder.mkdir()
    (folder / "run.toml").write_text(CASE)
    suite = CASE.split("[motion]")[0] + f"[suite.pairs]\n{PAIRS}"
    (folder / "suite.toml").write_text(suite)
    scales = [round(0.5 + 0.01 * k, 2) for k in range(points // 4)]
    (folder / "study.toml").write_text(
        f'case = "run.toml"\n[vary]\nstructure.thickness = [0.5, 0.55, 0.6, 0.05]\n'
        f"motion.scale = {scales}\n"
    )
    (folder / "calls.py").write_text(CALLS)


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare commands left alone with others that were not."""
    parser = plain_options(__doc__)
    parser.add_argument("--what", choices=COMMANDS, action="append", help="by default all")
    parser.add_argument("--points", type=int, default=40)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    chosen = given.what or list(COMMANDS)
    if given.quick:
        given.points, given.kills, chosen = 4, 0, ["study"]
    chance, lines = random.Random(given.seed), []
    with tempfile.TemporaryDirectory() as name:
        for place, what in enumerate(chosen):
            count = given.kills * (place + 1) // len(chosen) - given.kills * place // len(chosen)
            numbers, kinds = (signal.SIGKILL, signal.SIGTERM), COMMANDS[what][1]
            every = [(kind, number) for number in numbers for kind in kinds]
            kills = [every[k % len(every)] for k in range(count)]
            command = Command(what, Path(name) / what, 1 if given.quick else 2)
            write_cases(command.folder, given.points)
            command.prepare()
            while kills:
                command.disturb(kills, chance)
            ended = ", ".join(f"{kind} {number}" for kind, number in sorted(command.ended.items()))
            lines.append(f"{what:8} {count:5} {command.commands:9} {command.spent:6.1f} s  {ended}")
            print(lines[-1], flush=True)
    print(f"\n{'what':8} {'kills':>5} {'commands':>9} {'alone':>8}  ended processes and signals")
    print("\n".join(lines))
    print(f"{given.kills} kills: the same bits in all, and nothing left")


if __name__ == "__main__":
    main()
