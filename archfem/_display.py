"""Text, HTML and pictures of result classes; functions that draw are imported when called.

A result such as a history is defined left of the room that draws it. Its methods `plot`, `player`
and `report` are therefore bound when they are called, through one table that a test resolves.
"""

import io
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from enum import StrEnum
from html import escape
from importlib import import_module
from multiprocessing import parent_process
from time import monotonic
from typing import Any, ClassVar, NamedTuple, Self, TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

# Time between lines of progress where the output is no terminal [s]: of searches, and of motions
PROGRESS_INTERVAL = 5.0
MOTION_INTERVAL = 20.0

# Before lines on what may change an answer, and on what it assumes or leaves out on the safe side
DOUBT_MARK, NOTE_MARK = "in doubt: ", "note: "

# "Class.method": "module:function" below archfem; the function takes the instance first.
LATE_BOUND_METHODS: Mapping[str, str] = {
    "Analysis.accuracy": "dynamics.accuracy:accuracy",
    "Analysis.ida": "studies.ida:ida",
    "Analysis.mesh_sensitivity": "studies.convergence:mesh_sensitivity",
    "Analysis.page": "view.pages.live:page",
    "Analysis.run": "dynamics.time_history:run_analysis",
    "Analysis.scale": "dynamics.motion_scaling:collapse_scale",
    "Analysis.verdict_range": "studies.variations:verdict_range",
    "Analysis.write": "cases.case:write_analysis",
    "CaseResult.page": "cases.report.report:write_page_of_case",
    "CaseResult.player": "cases.report.report:player_of_case",
    "CaseResult.report": "cases.report.report:write_report_of_case",
    "Collapse.plot": "view.collapse:draw_collapse_result",
    "CollapseRisk.plot": "studies.collapse_risk:draw_risk_result",
    "CollapseScale.verdict_range": "studies.variations:verdict_range_of_bracket",
    "Ensemble.plot": "studies.ensemble:draw_ensemble_result",
    "Equilibrium.plot": "view.statics:draw_dead_load",
    "History.player": "view.pages.player:player",
    "History.plot": "view.histories:draw_joints",
    "History.report": "cases.report.report:write_report_of_history",
    "Ida.plot": "studies.ida:draw_ida_result",
    "KinematicAssessment.plot": "view.collapse:draw_kinematic_assessment",
    "Modes.plot": "view.statics:draw_modes",
    "Motion.plot": "view.motions:draw_motion",
    "MovingLoad.plot": "view.collapse:draw_moving_load",
    "Pushover.plot": "view.statics:draw_pushover",
    "Rating.plot": "view.collapse:draw_rating",
    "RecordSelection.plot": "view.motions:draw_selection",
    "Structure.plot": "view.structure:draw_structure",
    "VerdictRange.plot": "view.verdicts:draw_verdict_range",
}


def call_late_bound(method: str, *args: Any, **options: Any) -> Any:
    """Call the function which `LATE_BOUND_METHODS` names for a method."""
    module, _, function = LATE_BOUND_METHODS[method].partition(":")
    return getattr(import_module(f"archfem.{module}"), function)(*args, **options)


class ExplainedWord(StrEnum):
    """A word for an outcome, with its meaning as a sentence."""

    sentence: str

    def __new__(cls, word: str, sentence: str) -> Self:
        """Create a word and its sentence."""
        member = str.__new__(cls, word)
        member._value_, member.sentence = word, sentence
        return member


class ResultDisplay:
    """Mixin for result classes: one-line `repr`, notebook HTML and `.plot()`."""

    def plot(self, **options: Any) -> Any:
        """Draw the result with the function of `archfem.view` for its class.

        Args:
            options: options of that function: `draw_structure`, `draw_dead_load`, `draw_joints` for
                a history, `draw_pushover`, `draw_collapse`, `draw_modes`, `draw_motion` or
                `draw_selection`; of an IDA `measure` and `demand` as for `Ida.curves`.

        Returns:
            A matplotlib figure, which `archfem.view.save` writes.
        """
        return call_late_bound(f"{type(self).__name__}.plot", self, **options)

    def _summary(self) -> str:
        """Describe the result in one or two lines."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._summary()

    def _repr_html_(self) -> str:
        """Return the summary as HTML; names may contain a <."""
        return f"<pre>{escape(self._summary())}</pre>"


def write_progress_line(name: str, text: str) -> None:
    """Write a line of progress, but not into a notebook."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr.write(f"{name}: {text}\n")
        sys.stderr.flush()


class Reached(NamedTuple):
    """How far a worker of a study is."""

    share: float  # of its outermost search or motion, 0 if it is unknown
    text: str


# Sends how far a worker is to its driver
send_progress: Callable[[Reached], None] | None = None


class ProgressReport:
    """Progress of a search of five seconds and more: a bar on a terminal, elsewhere lines.

    The total is None if it is unknown. A line of a search within another one begins with the texts
    of the outer ones, and is written however short the inner one is. Motions within a search are
    shown rarely. A worker of a study sends the lines to its driver.
    """

    _open: ClassVar[list["ProgressReport"]] = []  # from the outermost to the innermost

    def __init__(self, name: str, total: float | None, *, rarely: bool = False) -> None:
        layout = "{desc}: |{bar}| {n_fmt} of {total_fmt}{postfix}"
        look: dict[str, Any] = {"bar_format": layout, "desc": name, "leave": False}
        self._bar = tqdm(total=total, disable=None, delay=PROGRESS_INTERVAL, **look)
        self._name, self._text, self._rarely = name, "", rarely
        self._done, self._total = 0.0, total  # the bar counts nothing where it is disabled
        self._shown = self._drawn = monotonic()

    def __enter__(self) -> Self:
        self._open.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._open.remove(self)
        self._bar.close()

    def show(self, text: str, done: float = 0) -> None:
        """Show a text, and count the steps done since the last one."""
        now = monotonic()
        self._bar.update(done)
        self._done += done
        # a motion shows thousands of texts a second
        self._bar.set_postfix_str(text, refresh=not self._rarely or now - self._drawn > 0.1)
        self._drawn = now if now - self._drawn > 0.1 else self._drawn
        self._text, first = text, (*self._open, self)[0]
        if self._rarely and parent_process() is not None and send_progress is None:
            return
        interval = MOTION_INTERVAL if self._rarely else PROGRESS_INTERVAL
        if self._bar.disable and now - first._shown >= interval:
            inner = [f"{each._name}: {each._text}" for each in self._open[1:] if each._text]
            words = "; ".join(filter(None, [first._text, *inner]))
            if send_progress is None:
                write_progress_line(first._name, words)
            else:
                share = first._done / first._total if first._total else 0.0
                send_progress(Reached(share, f"{first._name}: {words}"))
            first._shown = now


def track_progress(name: str, items: Collection[Item]) -> Iterator[Item]:
    """Yield items, and show how many of them are done."""
    with ProgressReport(name, len(items)) as progress:
        for number, item in enumerate(items):
            yield item
            progress.show(f"{number + 1} of {len(items)}", 1)
