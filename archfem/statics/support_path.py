"""Paths of equilibrium under the dead load, over a support that moves step by step."""

from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.blocks import RigidBlocks
from archfem.masonry.actions import Settlement
from archfem.models.gauges import Gauges, MovedGauges
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium, self_weight
from archfem.statics.newton import Solver
from archfem.statics.path import FIRST, TOLERANCE
from archfem.statics.search import followed, found_or_crept


@dataclass(eq=False)
class SupportPath:
    """Equilibria under the dead load over a support that moves, as `LoadPath`.

    Attributes:
        model: at the last step.
        supports: motions of the supports before this one moves (n_blocks, 3) [m, m, rad].
        motion: of all blocks, per unit (n_blocks, 3) [m, m, rad].
        dead: generalised forces of the self-weight (n,).
        reach: displacement of the support's fastest corner, per unit [m].
        unit: displacement, and change of the factor, in the first step.
        parts: multiples of the motion at each step [-].
        states: coordinates at each step (n,).
        resisted: N, V, M of every joint at each step (n_joints, 3) [N, N, N m].
        iterations: of Newton's method in each step.
        units: of the factors.
        moving: what it is whose displacement is told.
    """

    model: Model
    supports: Array
    motion: Array
    dead: Array
    reach: float
    unit: tuple[float, float]
    parts: list[float]
    states: list[Array]
    resisted: list[Array]
    iterations: list[int]
    units = "N m"
    moving = "support"

    @classmethod
    def of(cls, model: Model, settlement: Settlement, start: Equilibrium) -> "SupportPath":
        """Begin at the dead load's equilibrium.

        Args:
            model: whose support moves.
            settlement: a unit of its motion.
            start: the equilibrium under the dead load.

        Returns:
            A path of this one state.

        Raises:
            InvalidInput: the block is not a support, or does not move.
        """
        motion = settlement.added(model.structure, np.zeros_like(model.supports))
        reach = RigidBlocks(model.structure).reach(motion)
        if reach == 0.0:
            raise InvalidInput(f"the settlement of '{settlement.block}' is zero: give it a motion")
        unit, first = (FIRST * model.structure.size, np.inf), [model.resultants(start.q)]
        dead, supports = self_weight(model), model.supports
        return cls(model, supports, motion, dead, reach, unit, [0.0], [start.q], first, [0])

    @property
    def displacements(self) -> Array:
        """Of the support's fastest corner, since the dead load (steps,) [m]."""
        return self.reach * np.array(self.parts)

    @property
    def resultants(self) -> Array:
        """N, V, M of every joint (steps, n_joints, 3) [N, N, N m]."""
        return np.array(self.resisted)

    @property
    def faces(self) -> Array:
        """Gaps at mid-depth, rotations and slips of every joint (steps, 3, n_joints) [m, rad, m].

        Those that the motion alone would cause grow with it.
        """
        still = Gauges.on(self._moved(0.0))
        if isinstance(still, MovedGauges):
            placed = [Gauges.on(self._moved(part)) for part in self.parts]
            readings = [gauges.read(q) for gauges, q in zip(placed, self.states, strict=True)]
            return still.faces(np.array(readings))
        parts, whole = np.array(self.parts)[:, None], Gauges.made_for(self._moved(1.0))
        own = np.array([still.read(q) for q in self.states])
        return still.faces(own + parts * (whole.offset - still.offset))

    @property
    def factors(self) -> Array:
        """Work of the weights on a unit of the motion (steps,) [N m].

        It is F·o - V·s, with o and s the openings and slips that the motion alone would cause and
        F the compressions at both ends of each joint.
        """
        blocks = RigidBlocks(self.model.structure)
        intrados, extrados, slip = blocks.gaps(self.motion)
        normal, shear, moment = np.moveaxis(self.resultants, -1, 0)
        middle, turn = 0.5 * (intrados + extrados), (extrados - intrados) / blocks.structure.depths
        work: Array = normal @ middle + moment @ turn - shear @ slip
        return work

    def advance(self, border: Array, distance: float) -> bool:
        """Move the support on, and add the equilibrium there.

        Args:
            border: of no use here, for a support moves by displacement alone.
            distance: in units of the first step.

        Returns:
            Whether there is one.
        """
        part = self.parts[-1] + distance * self.unit[0] / self.reach
        model, solver = self._moved(part), Solver(self.model.size)
        try:
            model, solved = found_or_crept(solver, model, self.dead, self._ahead(part))
        except DidNotConverge:
            return False
        self.parts.append(part)
        self.states.append(solved.q)
        self.model = model
        self.resisted.append(model.resultants(solved.q))
        self.iterations.append(solved.iterations)
        if len(self.parts) == 2:
            before, after = self.factors
            change = abs(float(after - before))
            self.unit = (self.unit[0], change if change > TOLERANCE * abs(before) else np.inf)
        return True

    def _ahead(self, part: float) -> Array:
        """Coordinates if the structure went on as in its last step, a first guess (n,)."""
        last = self.states[-1]
        if len(self.parts) < 2:
            return followed(self.model, last, (part - self.parts[-1]) * self.motion)
        going = (last - self.states[-2]) / (self.parts[-1] - self.parts[-2])
        ahead: Array = last + (part - self.parts[-1]) * going
        return ahead

    def _moved(self, part: float) -> Model:
        """The model with its support moved by a multiple of the motion."""
        return self.model.moved(self.supports + part * self.motion)
