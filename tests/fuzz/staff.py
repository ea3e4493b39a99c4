"""Trials in a process of their own, with limits on memory and on time without an answer."""

import importlib
import os
import resource
import tempfile
import time
from collections.abc import Iterable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from fuzz.trial import FOREIGN, HUNG, Came

PATIENCE = 20.0
"""CPU time after which a trial counts as hung [s]; the machine may be shared."""

WAIT = 4.5
"""Time after which a trial counts as hung even if it does nothing at all, of that CPU time [-]."""

MEMORY = 3 * 2**30
"""Memory of trials, beyond that of a process after its imports [bytes]."""


def carried_out(campaign: str, seed: int, numbers: Iterable[int]) -> Iterator[tuple[int, Came]]:
    """Carry out trials of a campaign, each with its number.

    Args:
        campaign: name of its module in this package.
        seed: of the campaign.
        numbers: of the trials.

    Yields:
        Number of a trial and its result.
    """
    worker: _Worker | None = None
    try:
        for number in numbers:
            worker = worker or _Worker(campaign, seed)
            came = worker.carry_out(number)
            yield number, came
            if worker.ended:
                worker = None
    finally:
        if worker is not None:
            worker.end()


class _Worker:
    """A process that carries out trials."""

    def __init__(self, campaign: str, seed: int) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, campaign, seed), daemon=True)
        self.process.start()
        theirs.close()
        self.ended = False
        self.pipe.recv()  # once it has imported its modules

    def carry_out(self, number: int) -> Came:
        """Carry out one trial."""
        self.pipe.send(number)
        spent, begun = self._cpu(), time.monotonic()
        while not self.pipe.poll(0.5):
            waited = self._cpu() - spent, (time.monotonic() - begun) / WAIT
            if max(waited) > PATIENCE:
                self.end()
                return Came(HUNG, f"no answer after {PATIENCE:g} s of CPU, or {WAIT:g} times")
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            self.ended = True
            return Came(FOREIGN, f"the process ended with {self.process.exitcode}")

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.ended = True

    def _cpu(self) -> float:
        """CPU time that the process has taken [s]."""
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _serve(pipe: Connection, campaign: str, seed: int) -> None:
    """Carry out trials as their numbers arrive, in a folder of their own, without output."""
    module = importlib.import_module(f"fuzz.{campaign}")
    module.ready()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, now + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pipe.send("ready")
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        while True:
            try:
                number = pipe.recv()
            except EOFError:
                return
            pipe.send(module.trial(seed, number, Path(place)))
