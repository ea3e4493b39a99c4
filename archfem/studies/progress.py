"""How far a study has come: on a terminal, and in a file that another process reads."""

import json
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from time import monotonic

from tqdm import tqdm

from archfem.files import in_one_stroke
from archfem.studies.store import Store, told_when_full

PROGRESS = "progress.json"

EVERY = 1.0
"""Seconds between two writings of the file."""


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes:
        total: how many points it has.
        done: points that are finished, failed ones among them.
        failed: points that ended in an error.
        rate: points a second, of the latest driver; 0 where it has finished none.
        running: whether a driver is at work.
    """

    total: int
    done: int
    failed: int
    rate: float = 0.0
    running: bool = False

    @property
    def remaining(self) -> float:
        """Time that the other points take at this rate [s]; infinite where none is known."""
        left = self.total - self.done
        return 0.0 if not left else left / self.rate if self.rate > 0.0 else inf

    def __str__(self) -> str:
        """The same in words."""
        words = [f"{self.done} of {self.total} points done", f"{self.failed} failed"]
        if self.done < self.total:
            words.append(f"{self.rate:.3g} a second")
            words.append(f"{self.remaining:.0f} s remaining" if self.rate else "time unknown")
        words.append("running" if self.running else "not running")
        return ", ".join(words)


class Progress:
    """Counts points as they are finished.

    Args:
        total: how many there are.
        done: that were finished before.
        failed: of those.
        folder: for the file; None writes none.
    """

    def __init__(self, total: int, done: int, failed: int, folder: Path | None) -> None:
        self._total, self._before, self._failed, self._folder = total, done, failed, folder
        self._done, self._begun, self._written = 0, monotonic(), -inf
        self._bar = tqdm(
            total=total, initial=done, unit="point", disable=None, leave=False, desc="study"
        )

    def add(self, *, failed: bool) -> None:
        """Count one point more.

        Args:
            failed: whether it ended in an error.
        """
        self._done += 1
        self._failed += failed
        self._bar.set_postfix(failed=self._failed, refresh=False)
        self._bar.update()
        if monotonic() - self._written >= EVERY:
            self._write()

    def close(self) -> None:
        """Say for the last time how far it has come."""
        self._bar.close()
        self._write()

    def _write(self) -> None:
        self._written = monotonic()
        spent = self._written - self._begun
        now = Status(
            self._total,
            self._before + self._done,
            self._failed,
            self._done / spent if spent > 0.0 else 0.0,
        )
        if self._folder is not None:
            with told_when_full(self._folder), in_one_stroke(self._folder / PROGRESS) as draft:
                draft.write_text(json.dumps(asdict(now)), encoding="utf-8")


def status(folder: str | Path) -> Status:
    """Return how far the study in a folder has come, whether a driver is at work or not.

    Args:
        folder: of the study.

    Raises:
        InvalidInput: there is no study in it.
    """
    store = Store(Path(folder))
    digests = list(dict.fromkeys(store.plan()["points"]))
    rows = store.finished(digests)
    try:
        rate = float(json.loads((store.folder / PROGRESS).read_text(encoding="utf-8"))["rate"])
    except (OSError, ValueError, KeyError):
        rate = 0.0
    failed = sum(bool(row["error"]) for row in rows.values())
    return Status(len(digests), len(rows), failed, rate, store.busy)
