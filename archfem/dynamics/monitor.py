"""Energy balance and validity of a run, checked after every step.

The work of the ground must be stored or dissipated. T is the kinetic energy, E the potential energy
of blocks and joints, and p the weight. Over a step

    Δ(T + E(u) - p·u) = W - D,
    W = -Δu · M r ½ Σ a_g,    D = Δu · ½ Σ (C v + f(u + β v) - f(u)).

Sums are over both ends of the step. Average acceleration satisfies this balance exactly while no
joint opens or closes. Across such an event the trapezoidal rule has an error, and over thousands of
impacts the errors may add up. The difference of both sides, summed from the start, is the energy
drift. It is negative for a scheme with numerical damping, such as HHT.

The checks do not depend on how many steps a solver takes at a time: bounds are evaluated at each
step of a batch.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
from scipy.integrate import trapezoid

from archfem._typing import Array
from archfem.dynamics.separation import MeetingMonitor
from archfem.dynamics.state import Batch, State
from archfem.errors import DidNotConverge, InvalidInput, logger
from archfem.masonry.standing import list_own_stones
from archfem.models.model import Doubt, Model, Observer
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.fill_checks import SOIL_ANGLE, SOIL_COHESION
from archfem.statics.stress import observe_fill_tension
from archfem.units import kPa

# Largest tension that loose soil bears: where Mohr's circle touches the limit,
# 2 c cos φ / (1 + sin φ) [Pa]
SOIL_TENSION = 2.0 * SOIL_COHESION * cos(radians(SOIL_ANGLE)) / (1.0 + sin(radians(SOIL_ANGLE)))

# Words of the doubt about a fill that holds itself, and the stones, by more tension than that
FILL_TENSION = (
    "elastic fill bears {:.3g} kPa of tension, at t = {:.4g} s: soil has next to none, "
    f"{SOIL_TENSION / kPa:.2g} kPa with a cohesion of {SOIL_COHESION / kPa:g} kPa"
)

# What leaves the results of such a fill in doubt
PULLED = f"in doubt, as the elastic fill bears tension of over {SOIL_TENSION / kPa:.2g} kPa"


def refuse_fill_in_tension(start: Equilibrium) -> None:
    """Refuse a search of scales where elastic fill bears more tension at rest than soil."""
    observe = observe_fill_tension(start.model)
    if observe is not None and (tension := observe(start.q)) > SOIL_TENSION:
        raise InvalidInput(
            f"elastic fill bears {tension / kPa:.3g} kPa of tension under dead load alone, and "
            f"soil at most {SOIL_TENSION / kPa:.2g} kPa, so that no scale would count: cut the "
            'fill into pieces, jointed_fill (law = "jointed" in [structure.fill] of a case)'
        )


class EnergyBalance:
    """Sum of the energies of a run, its drift, and the largest energy exchanged so far [J]."""

    def __init__(self, kinetic: float, potential: float) -> None:
        self._stored = kinetic + potential
        self._work = self.loss = 0.0
        # Smaller exchanges than 1e-3 of the energy stored under self-weight are neglected: forces
        # vary with its root, that is by 3 % of the weight
        self.largest_exchange = max(kinetic, 1e-3 * abs(potential), 1e-300)

    def add(self, steps: Array) -> tuple[Array, Array]:
        """Add steps; return the drift at each [J], and relative to the largest exchange [-]."""
        kinetic, potential, work, loss = steps.T
        change = kinetic + potential - self._stored
        works, losses = self._work + np.cumsum(work), self.loss + np.cumsum(loss)
        drift: Array = change - works + losses
        self._work, self.loss = works[-1], losses[-1]
        exchanged = np.max([kinetic, np.abs(change), np.abs(works), losses], axis=0)
        largest = np.maximum.accumulate(np.maximum(exchanged, self.largest_exchange))
        self.largest_exchange = float(largest[-1])
        return drift, drift / largest


class CornerDisplacements:
    """Largest and present displacement of each free block's corners, from the start of a run."""

    def __init__(self, observer: Observer, start: State, stones: Sequence[int]) -> None:
        self._observer = observer
        self._start = observer.corners(observer.read(start.q))
        self.blocks, self._first = np.unique(observer.corner_blocks, return_index=True)
        self.stones = np.isin(self.blocks, stones)  # those of the structure
        self.time = np.full(len(self.blocks), start.time)  # of the largest displacement [s]
        # displacement of the farthest corner of each block, of all steps and of the last (b,) [m]
        self.largest, self.residual = np.zeros((2, len(self.blocks)))
        # time of the largest displacement of a stone [s], and those of corners then (c, 2) [m]
        self.peak = start.time, self._start

    def add(self, times: Array, readings: Array) -> None:
        """Add the times of the next steps, and the readings of the observer at these (steps, r)."""
        moved = np.linalg.norm(self._observer.corners(readings) - self._start, axis=2)
        farthest = np.maximum.reduceat(moved, self._first, axis=1)
        largest, self.residual = farthest.max(axis=0), farthest[-1]
        of_stones = farthest[:, self.stones]
        if of_stones.max() > self.largest[self.stones].max():
            step = int(of_stones.max(axis=1).argmax())
            # a copy, for the readings are a part of the memory of all steps
            self.peak = float(times[step]), self._observer.corners(readings[step]).copy()
        self.time = np.where(largest > self.largest, times[farthest.argmax(axis=0)], self.time)
        self.largest = np.maximum(self.largest, largest)


class RunMonitor:
    """Validity checks of a run: one doubt per kind, and an error once the run is wrong."""

    def __init__(
        self, model: Model, start: Batch, *, damps: bool = False, mass_damping: float = 0.0
    ) -> None:
        self.model = model
        # largest drift at any step, relative to the largest exchange until then [-]
        self.worst_drift, self._worst_time = 0.0, 0.0
        self.displacements = CornerDisplacements(
            model.observer(), start.state(0), list_own_stones(model.structure)
        )
        self.largest_turn = 0.0  # of any joint at any step [rad]
        self._balance = EnergyBalance(*start.energy[0, :2])
        self._damps = damps  # whether the scheme has numerical damping, so that losses are expected
        self._drift_error: tuple[float, float] | None = None  # first time [s] and drift beyond it
        self._observer = model.observer()
        self._small = not model.large_displacements
        # whether facets are paired as meshed, of small displacements within large ones
        self._pairs_facets = not self._small and bool(model.face_mismatch(start.state(0).q)[1])
        self._meeting = MeetingMonitor(model, start.state(0))
        self._met: tuple[float, str] | None = None  # first time [s], and which stones
        self._observe_tension = observe_fill_tension(model)
        self.fill_tension = (0.0, 0.0)  # largest tension in elastic fill [Pa], and its time [s]
        self._mismatch = (0.0, "")  # slip over facet length, and the joint
        self._depth = float(model.structure.depths.min())
        self._last, self._before = start.state(0), start.state(0)
        self._steps = 0
        self._doubts = {doubt.words: doubt for doubt in model.doubts}
        self._mass_damping = mass_damping  # coefficient of the mass matrix [1/s]
        self._mass_damping_loss = 0.0  # [J]
        self._kinetic = start.energy[0, 0]

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts so far, those of the model included."""
        return tuple(self._doubts.values())

    @property
    def largest_displacement(self) -> float:
        """Largest displacement of any corner from the start of the run [m]."""
        return float(self.displacements.largest.max())

    @property
    def mass_damping_share(self) -> float:
        """Energy lost to damping proportional to mass, over all losses [-]."""
        return self._mass_damping_loss / max(self._balance.loss, 1e-300)

    def add(self, batch: Batch, readings: Array) -> Array:
        """Add the next steps and return the energy drift at each (steps,) [J]."""
        # steps between two checks of the slip of paired facets
        facet_check_interval = 32
        drift, fractions = self._balance.add(batch.energy)
        worst = int(np.abs(fractions).argmax())  # a NaN is the largest
        if not abs(fractions[worst]) <= abs(self.worst_drift):
            self.worst_drift = float(fractions[worst])
            self._worst_time = float(batch.times[worst])
        if self._drift_error is None:
            signed = fractions if self._damps else np.abs(fractions)
            # a run is wrong where half of the energy comes from the scheme
            beyond = np.flatnonzero(signed > 0.5)
            if len(beyond):
                first = int(beyond[0])
                self._drift_error = float(batch.times[first]), float(fractions[first])
        self.displacements.add(batch.times, readings)
        if self._mass_damping:
            # the power is a v·M v, with v·M v twice the kinetic energy
            kinetic = np.append(self._kinetic, batch.energy[:, 0])
            times = np.append(self._last.time, batch.times)
            power = 2.0 * self._mass_damping * kinetic
            self._mass_damping_loss += float(trapezoid(power, times))
            self._kinetic = kinetic[-1]
        if self._small:
            rotation = float(np.abs(self._observer.faces(readings)[:, 1]).max())
            self.largest_turn = max(self.largest_turn, rotation)
            if self._met is None:
                met = self._meeting.find_first(replace(batch, readings=readings))
                # time of the first meeting of stones outside their joints
                self._met = None if met is None else (float(batch.times[met[0]]), met[1])
        elif self._pairs_facets:  # these cost a product, hence not every step
            first = -self._steps % facet_check_interval
            for k in range(first, len(batch.times), facet_check_interval):
                slip = self.model.face_mismatch(batch.state(k).q)
                self._mismatch = max(self._mismatch, slip)
        self._add_tension(batch)
        self._steps += len(batch.times)
        self._before, self._last = self._last, batch.state(len(batch.times) - 1)
        return drift

    def _add_tension(self, batch: Batch, interval: int = 2) -> None:
        """Add the tension of fill at some of the next steps."""
        if self._observe_tension is not None:
            for k in range(-self._steps % interval, len(batch.times), interval):
                found = self._observe_tension(batch.state(k).q), float(batch.times[k])
                self.fill_tension = max(self.fill_tension, found)

    def check_run(self) -> None:
        """Raise an error if the steps added are wrong, and warn if they are doubtful."""
        time, size = self._last.time, self.model.structure.size
        if not np.isfinite(self.worst_drift):
            raise DidNotConverge(
                f"by t = {self._worst_time:.4g} s displacements, speeds or energies are not "
                "numbers any more: the start is unphysical, or the run needs the scheme "
                "Conserving, damping or another dt",
                last=self._before,
            )
        if self._drift_error is not None:
            when, share = self._drift_error
            raise DidNotConverge(
                f"by t = {when:.4g} s {abs(share):.0%} of the energy had "
                f"been {'gained without work' if share > 0.0 else 'lost to the scheme'}, so the "
                "history is wrong: use the scheme Conserving, or damping and a smaller dt",
                last=self._before,
            )
        if self._small and self.largest_displacement > size:
            raise DidNotConverge(
                f"by t = {time:.4g} s blocks had moved {self.largest_displacement:.3g} m, more "
                f"than the size of the structure, {size:.3g} m: it has fallen apart; end the run "
                "at its mechanism, with until=CountedMechanism() (in a case until = 'counted "
                "mechanism'), or let displacements be large",
                last=self._before,
            )
        self._check_facets(time)
        self._check_energy()
        self._check_tension()
        if self._small:
            self._check_small_displacements(time)

    def _check_energy(self, doubtful: float = 0.05) -> None:
        """Warn of energy drift, relative to the largest energy exchanged."""
        # amplitudes, which vary with the root of energy, are then off by 2.5 %
        if abs(self.worst_drift) > doubtful:
            self._add_doubt(
                "energy drifts: by t = {:.4g} s {:.0%} of the largest exchanged was {} the scheme",
                "compare with the scheme Conserving, with a smaller dt, or with more damping",
                self._worst_time,
                abs(self.worst_drift),
                "gained by" if self.worst_drift > 0.0 else "lost to",
            )

    def _check_tension(self) -> None:
        """Warn of a fill that bears more tension than soil."""
        tension, time = self.fill_tension
        if tension > SOIL_TENSION:
            self._add_doubt(
                FILL_TENSION,
                'compare with fill in pieces (law = "jointed", friction_angle, cohesion and '
                "piece_size in [structure.fill] of a case)",
                tension / kPa,
                time,
            )

    def _check_small_displacements(self, time: float, small_rotation: float = 0.01) -> None:
        """Warn of rotations [rad] and displacements that are not small."""
        # beyond that rotation the largest |e| of six arches and columns was wrong by 0.01 to 0.03
        if self.largest_turn > small_rotation:
            self._add_doubt(
                "by t = {:.4g} s a joint had turned by {:.2g} rad: to take displacements as small "
                "errs by 0.01 and more in |e| there",
                "compare with displacements='large'",
                time,
                self.largest_turn,
            )
        if self._met is not None:
            self._add_doubt(
                "at t = {:.4g} s {}, with which it shares no joint: small displacements let "
                "stones pass through each other",
                "follow them with displacements='large'",
                *self._met,
            )
        if self.largest_displacement > self._depth:
            self._add_doubt(
                "by t = {:.4g} s blocks had moved {:.3g} m, more than a joint is deep, "
                f"{self._depth:.3g} m: what follows is beyond the small displacements that this "
                "model assumes",
                "read it as collapse, or follow it with displacements='large'",
                time,
                self.largest_displacement,
            )

    def _check_facets(self, time: float, doubtful: float = 0.1) -> None:
        """Warn of facets that have slid by a share of their length; refuse a whole length."""
        slip, name = self._mismatch
        if slip <= doubtful:
            return
        # of "backfill: full, rest: rigid" too
        coarse = any(name in self.model.fidelity for name in ("rigid", "faces"))
        coarser = "" if coarse else ", fidelity 'faces' or 'rigid' for stones"
        fill = "; hold the fill's ends by sidewalls; or cut it with jointed_fill"
        fill = "" if any(block.grain for block in self.model.structure.blocks) else fill
        doubt = Doubt(
            "by t = {:.4g} s the faces of '{}' had slid by {:.2g} of a facet, though they are "
            "paired as meshed",
            "take fewer cells, down to cells=(1, 1) of cell='triangle', one facet on each stone "
            f"that is not slender{coarser}{fill}",
            (time, name, slip),
        )
        if slip > 1.0:
            raise DidNotConverge(str(doubt), last=self._before)
        self._add_doubt(doubt.words, doubt.remedy, *doubt.values)

    def _add_doubt(self, words: str, remedy: str, *values: float | str) -> None:
        """Log the first doubt of its words in a run, and store the latest."""
        doubt = Doubt(words, remedy, values)
        if words not in self._doubts:
            logger.warning("%s", doubt)
        self._doubts[words] = doubt
