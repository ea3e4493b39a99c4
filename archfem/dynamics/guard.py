"""Doubts about a run while it goes on: energy from nowhere, displacements that are not small.

Energy is judged after every step, whatever takes the steps and however many at a time: a stepper
that hands on 128 of them is judged as one that hands on each, where a bound is passed.
"""

import logging

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.energy import Balance
from archfem.dynamics.steps import Batch, State
from archfem.errors import DidNotConverge
from archfem.models.gauges import Gauges
from archfem.models.model import Model
from archfem.models.moving import Moving

logger = logging.getLogger("archfem")

DOUBTFUL = 0.05
"""Drift of energy at any step, either way and relative to the largest exchanged until then, above
which a run is doubted aloud: amplitudes, which go with its root, are then off by 2.5 %."""

WRONG = 0.5
"""The same above which a run is wrong: half of what moves is the scheme's own, or has gone nowhere.
What a scheme takes that damps by itself, as HHT does, is only doubted."""

TURNED = 0.01
"""Turn of a joint above which a run with small displacements is doubted aloud: from there on those
of six arches and columns erred by 0.01 to 0.03 in the largest |e| [rad]."""

LOOK = 32
"""Steps between two looks at displacements."""

PAIRED = 0.1
"""Slip over the length of a facet beyond which it is doubtful that faces are paired as meshed; by a
whole one it is wrong."""


class Guard:
    """Watches over a run: warns once of each doubt, and ends what is certainly wrong.

    Args:
        model: that moves.
        start: its state at the start, as a batch of one.
        damps: whether the scheme takes energy by itself, as it is meant to.

    Attributes:
        worst: largest drift of energy at any step so far, as a fraction of the largest exchanged
            until then [-].
        largest_displacement: of the middle of any block at any step, and of any point of a block
            at the looks taken [m].
        largest_turn: of any joint at any step [rad].
        doubts: what is doubtful so far, those of the model included, a sentence each.
    """

    def __init__(self, model: Model, start: Batch, *, damps: bool = False) -> None:
        self.model = model
        self.worst, self._worst_time = 0.0, 0.0
        self.largest_displacement = 0.0
        self.largest_turn = 0.0
        self._balance = Balance(*start.energy[0, :2])
        self._damps = damps
        self._wrong: tuple[float, float] | None = None
        self._gauges = Gauges.on(model)
        self._small = not isinstance(model, Moving)
        self._mismatch = (0.0, "")
        self._depth = float(model.structure.depths.min())
        self._last, self._before = start.state(0), start.state(0)
        self._steps = 0
        self._told = {f"rung {k}": words for k, words in enumerate(model.doubts)}

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is doubtful so far, a sentence each, as it is known now."""
        return tuple(self._told.values())

    def add(self, batch: Batch, readings: Array) -> Array:
        """Look at the next steps.

        Args:
            batch: steps that follow those seen so far; the first is the start, alone.
            readings: of the model's gauges at their ends (steps, r).

        Returns:
            The drift of energy after each step (steps,) [J].
        """
        drift, fractions = self._balance.add(batch.energy)
        far = int(np.abs(fractions).argmax())  # a NaN is the largest
        if not abs(fractions[far]) <= abs(self.worst):
            self.worst, self._worst_time = float(fractions[far]), float(batch.times[far])
        if self._wrong is None:
            beyond = np.flatnonzero((fractions if self._damps else np.abs(fractions)) > WRONG)
            if len(beyond):
                first = int(beyond[0])
                self._wrong = float(batch.times[first]), float(fractions[first])
        moved = float(np.linalg.norm(self._gauges.middles(readings), axis=-1).max())
        self.largest_displacement = max(self.largest_displacement, moved)
        if self._small:
            turned = float(np.abs(self._gauges.faces(readings)[:, 1]).max())
            self.largest_turn = max(self.largest_turn, turned)
        for k in range(-self._steps % LOOK, len(batch.times), LOOK):
            self._look(batch.state(k))
        self._steps += len(batch.times)
        self._before, self._last = self._last, batch.state(len(batch.times) - 1)
        return drift

    def _look(self, state: State) -> None:
        moved = np.abs(self.model.cells.displacement(state.q)).max()
        self.largest_displacement = max(self.largest_displacement, float(moved))
        if isinstance(self.model, Moving):
            self._mismatch = max(self._mismatch, self.model.mismatch(state.q))

    def judge(self) -> None:
        """Warn of what is doubtful in what was added.

        Raises:
            DidNotConverge: most of the energy came from nowhere, or blocks moved farther than the
                structure is large; `last` is the state before the steps added last.
        """
        time, size = self._last.time, self.model.structure.size
        if not np.isfinite(self.worst):
            raise DidNotConverge(
                f"by t = {time:.4g} s displacements or speeds are not numbers any more: the start "
                "cannot be meant, or the run needs damping or a smaller dt",
                last=self._before,
            )
        if self._wrong is not None:
            when, share = self._wrong
            raise DidNotConverge(
                f"by t = {when:.4g} s {abs(share):.0%} of the energy had "
                f"{'come from' if share > 0.0 else 'gone'} nowhere, so the history is wrong: use "
                "the scheme Conserving, or damping and a smaller dt",
                last=self._before,
            )
        if self._small and self.largest_displacement > size:
            raise DidNotConverge(
                f"by t = {time:.4g} s blocks had moved {self.largest_displacement:.3g} m, more "
                f"than the size of the structure, {size:.3g} m: it has fallen apart; end the run "
                "at its mechanism, with until=CountedMechanism(), or let displacements be large",
                last=self._before,
            )
        self._judge_facets(time)
        self._doubt(time)

    def _doubt(self, time: float) -> None:
        """Warn of what is doubtful, though nothing tells that it is wrong."""
        if abs(self.worst) > DOUBTFUL:
            what = "had come from nowhere" if self.worst > 0.0 else "was lost to the scheme"
            self._tell(
                "energy",
                f"energy drifts: by t = {self._worst_time:.4g} s {abs(self.worst):.0%} of the "
                f"largest exchanged {what}; compare with the scheme Conserving, with a smaller dt, "
                "or with more damping",
            )
        if self._small and self.largest_turn > TURNED:
            self._tell(
                "turn",
                f"by t = {time:.4g} s a joint had turned by {self.largest_turn:.2g} rad: to take "
                "displacements as small errs by 0.01 and more in |e| there; compare with "
                "build(…, displacements='large')",
            )
        if self._small and self.largest_displacement > self._depth:
            self._tell(
                "displacement",
                f"by t = {time:.4g} s blocks had moved {self.largest_displacement:.3g} m, more "
                f"than a joint is deep, {self._depth:.3g} m: what follows is beyond the small "
                "displacements that this model assumes; read it as collapse, or follow it with "
                "build(…, displacements='large')",
            )

    def _judge_facets(self, time: float) -> None:
        """Doubt joints that are in pieces once those have slid far past each other."""
        slip, name = self._mismatch
        if slip <= PAIRED:
            return
        words = (
            f"by t = {time:.4g} s the faces of '{name}' had slid by {slip:.2g} of a facet, though "
            "they are paired as meshed: take fewer cells, fidelity 'faces' or 'rigid' for stones, "
            "or cut the fill with jointed_fill"
        )
        if slip > 1.0:
            raise DidNotConverge(words, last=self._before)
        self._tell("facets", words)

    def _tell(self, kind: str, words: str) -> None:
        """Warn of each kind of doubt once a run, and keep what is known of it last."""
        if kind not in self._told:
            logger.warning("%s", words)
        self._told[kind] = words
