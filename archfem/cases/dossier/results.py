"""What a report is written from: a case, its runs, and a folder with what else was found."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from archfem.cases.case import Case
from archfem.dynamics.history import History
from archfem.motion.motion import Motion
from archfem.view.pages.document import Plate, Words


@dataclass(frozen=True, eq=False)
class Results:
    """A case, its runs, and a folder with what else was found.

    Attributes:
        case: what was asked.
        runs: what to call each run, and the run, which knows its structure.
        folder: with tables and pictures of earlier commands; None where there is none.
        missing: names of the pairs of its suite that were not run.
    """

    case: Case
    runs: Mapping[str, History]
    folder: Path | None = None
    missing: tuple[str, ...] = ()

    @cached_property
    def dead(self) -> xr.Dataset | None:
        """Joints under dead load, where runs start (joint); None without a run."""
        for run in self.runs.values():
            return run.joints.isel(time=0, drop=True)
        return None

    @cached_property
    def grounds(self) -> dict[str, Motion]:
        """Motions as they were applied, by the accelerations that the runs kept."""
        return {name: applied(run, name) for name, run in self.runs.items()}

    def quoted(self, name: str) -> str | None:
        """Return the text of a file of the folder; None where there is none.

        Args:
            name: of the file.
        """
        if self.folder is None or not (path := self.folder / name).is_file():
            return None
        return path.read_text(encoding="utf-8").strip()

    def shown(self, name: str, caption: str) -> list[Plate]:
        """Return the picture of a file of the folder; nothing where there is none.

        Args:
            name: of the file.
            caption: below it.
        """
        if self.folder is None or not (path := self.folder / name).is_file():
            return []
        return [Plate.read(path, caption)]


def applied(run: History, name: str) -> Motion:
    """Return the motion of the ground that a run kept, at even steps.

    Args:
        run: with the acceleration at each recorded step; between them it goes straight.
        name: what to call the motion.
    """
    times, ground = run.time, run.dataset["ground"].values
    dt = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    even = times[0] + dt * np.arange(round((times[-1] - times[0]) / dt) + 1)
    level, upright = (np.interp(even, times, column) for column in ground.T)
    return Motion(level, dt, upright if upright.any() else None, name)


def not_held(what: str, remedy: str) -> Words:
    """Return the words for what the results do not hold.

    Args:
        what: is missing.
        remedy: what finds it.
    """
    return Words(f"Not among the results: {what}. {remedy}", "missing")
