"""The waist of the hourglass: what every model of a structure answers.

Everything to its left (masonry, joints, meshes and forms) exists to produce a `Model`; everything
to its right (statics, dynamics, pictures, cases) takes one by what is declared here, on whatever
rung it stands.
"""

from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

from scipy import sparse

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.operator import JointOperator
from archfem.masonry.actions import Action, Settlement
from archfem.masonry.structure import Structure
from archfem.models.cells import Cells


@dataclass(frozen=True)
class Prediction:
    """What was predicted of a model when it was chosen.

    Attributes:
        error: in the largest |e| of the worst joint, of the model and of its steps [-].
        in_time: what the steps have of it [-].
        tolerance: that was asked for [-].
        dt: time step with which the error is met [s]; None where steps choose their length.
        pace: tolerance of |e| by which they do so [-]; None where there is a time step.
        considered: settings that were tried, in that order, and the error predicted of each: of
            steps alone, then of models with the steps taken.
        of_small: error of taking displacements as small, which no finer model lessens [-];
            infinite where blocks fall that small displacements let stand.
        of_chance: what impacts leave to chance of the largest |e|, by how far it is from growing
            evenly over motions 1 and 2 % weaker and stronger [-]; no error is predicted below it.
    """

    error: float
    in_time: float
    tolerance: float
    dt: float | None
    pace: float | None
    considered: tuple[tuple[str, float], ...]
    of_small: float = 0.0
    of_chance: float = 0.0

    @property
    def met(self) -> bool:
        """Whether the error of model and steps is within the tolerance."""
        return self.error <= self.tolerance

    @property
    def text(self) -> str:
        """The prediction in words, and all that was tried."""
        steps = f"{1e3 * self.dt:g} ms" if self.dt else f"a length for {self.pace:.2g} in |e|"
        tried = "; ".join(f"{name}: {error:.2g}" for name, error in self.considered)
        return (
            f"predicted to err by {self.error:.2g} in the largest |e|, of which {self.in_time:.2g} "
            f"by steps of {steps}, and by {self.of_small:.2g} because displacements are taken as "
            f"small; {self.tolerance:g} was asked for (tried: {tried}); impacts leave "
            f"{self.of_chance:.2g} to chance"
        )


class Passage(Protocol):
    """A step of a model, from a state that is known, along which displacements go straight.

    Forces are means over the step, so that their work is the change of the stored energy, and what
    friction and damping take. Damping by a lag β is felt as forces of u + β v.
    """

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,).

        Args:
            q: coordinates at the end (n,).
        """

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n).

        Args:
            q: coordinates at the end (n,).
        """

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember at the end, as `Model.memory`.

        Args:
            q: coordinates at the end (n,).
        """

    def raising(self, q: Array) -> "Passage":
        """Return the same step with saw teeth where the slip on the way to q puts them.

        Args:
            q: coordinates at the end (n,).

        Returns:
            The very same object where they are there already, to rounding.
        """

    def lost(self, q: Array) -> float:
        """Return the energy that friction, bonds and the lag of damping take [J]; never negative.

        Args:
            q: coordinates at the end (n,).
        """


@runtime_checkable
class Model(Protocol):
    """A structure ready to be moved: generalised coordinates q and what they cost.

    The matrices of one model share their sparsity pattern: `indices` and `indptr` are the same
    arrays, so that sums are sums of `data`.

    Attributes:
        structure: what is modelled.
        fidelity: name of the rung of the ladder it stands on.
        size: number n of coordinates.
        mass: kinetic energy is ½ q̇ᵀ M q̇ (n, n).
        blocks: stiffness of the blocks without the joints (n, n).
        body: force per unit acceleration of the ground, M r, along x and y (n, 2) [kg, where the
            coordinate is a displacement].
        cells: polygons that cover the blocks, and how they move with q.
        supports: motions of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        prediction: what was predicted when it was chosen; None where it was asked for by name.
        doubts: why this rung may be wrong for the structure, a sentence each.
    """

    structure: Structure
    fidelity: str
    size: int
    mass: sparse.csr_matrix
    blocks: sparse.csr_matrix
    body: Array
    cells: Cells
    supports: Array
    prediction: Prediction | None
    doubts: tuple[str, ...]

    @property
    def operator(self) -> JointOperator | None:
        """From coordinates to the forces of the joints; None where weak forms give them."""

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`; not symmetric where joints slide (n, n).

        Args:
            q: coordinates (n,).

        Returns:
            Where a model can tell that nothing has changed since it was last asked, the very same
            object as then, which need not be factorised again.
        """

    def pulled(self, q: Array, motion: Array) -> Array:
        """Return the change of `force` by a small motion of the supports, as `tangent` has it (n,).

        Args:
            q: coordinates (n,).
            motion: of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """

    def closed(self) -> sparse.csr_matrix:
        """Return the tangent with every joint closed over its whole depth (n, n)."""

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates (n,).
        """

    @property
    def memory(self) -> Array:
        """How far each joint point has slid for good (p,) [m].

        Where any joint has tensile strength, then which bonds are broken, 1, else 0 (2 p,).
        """

    def remembering(self, memory: Array) -> Self:
        """Return the same model, whose joints have slid so far.

        Its `force` is that after a further change: elastic, but for what friction does not hold.

        Args:
            memory: as `memory`.
        """

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember once the model is at q, as `memory`.

        Args:
            q: coordinates (n,).
        """

    def passage(self, start: Array, late: float) -> Passage:
        """Return a step from a state that the joints remember.

        Args:
            start: coordinates at its start (n,).
            late: lag of damping over the length of the step, β/Δt [-].
        """

    def settled(self, settlement: Settlement) -> Self:
        """Return the same model with a support that has moved, further than before.

        Args:
            settlement: the support and its motion.

        Raises:
            InvalidInput: the block is not a support.
        """

    def moved(self, supports: Array) -> Self:
        """Return the same model with its supports moved so far from where they were built.

        Args:
            supports: motions of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """

    def predicted(self, prediction: Prediction) -> Self:
        """Return the same model, with what was predicted of it.

        Args:
            prediction: to be kept as `prediction`.
        """

    def load(self, action: Action) -> Array:
        """Return the generalised forces of an action (n,).

        Args:
            action: body force or point load.

        Raises:
            InvalidInput: a point load misses the structure.
        """


def check_model(model: object) -> None:
    """Refuse what is no model, such as the structure of which one is to be built.

    Args:
        model: what was given for one.

    Raises:
        InvalidInput: it does not answer what a model answers.
    """
    if not isinstance(model, Model):
        raise InvalidInput(
            f"model is a {type(model).__name__}: build one, e.g. build(structure, fidelity='rigid')"
        )
