"""The waist of the hourglass: what every model of a structure answers.

Everything above (structure, mesh, forms) exists to produce a `Model`; everything below (statics,
dynamics, modal analysis) consumes one by what is declared here, on whatever rung it stands.
"""

from dataclasses import dataclass
from typing import Any, Protocol, Self

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
        error: in the largest |e| of the worst joint [-].
        tolerance: that was asked for [-].
        dt: time step with which the error is met [s].
        considered: settings that were tried, the cheapest first, and the error of each.
    """

    error: float
    tolerance: float
    dt: float
    considered: tuple[tuple[str, float], ...]

    @property
    def met(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.tolerance


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
        body: force per unit acceleration of the ground, M r, along x and y (n, 2) [kg …].
        cells: polygons that cover the blocks, and how they move with q.
        supports: motions of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        prediction: what was predicted when it was chosen; None where it was asked for by name.
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

    @property
    def operator(self) -> JointOperator | None:
        """From coordinates to the forces of the joints; None where weak forms give them."""

    def force(self, q: Array) -> Array:
        """Internal forces of blocks and joints (n,)."""

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Derivative of `force`; the very same object as before where nothing has changed."""

    def closed(self) -> sparse.csr_matrix:
        """Tangent with every joint closed over its whole depth."""

    def energy(self, q: Array) -> float:
        """Potential energy of blocks and joints, whose gradient is `force` [J]."""

    def resultants(self, q: Array) -> Array:
        """N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m]."""

    def settled(self, settlement: Settlement) -> Self:
        """The same model with a support that has moved, further than before."""

    def moved(self, supports: Array) -> Self:
        """The same model with its supports moved so far from where they were built."""

    def predicted(self, prediction: Prediction) -> Self:
        """The same model, with what was predicted of it."""

    def load(self, action: Action) -> Array:
        """Generalised forces of an action (n,)."""


def check_model(model: Any) -> None:
    """Refuse what is no model, such as the structure of which one is to be built.

    Args:
        model: what was given for one.

    Raises:
        InvalidInput: it does not answer what a model answers.
    """
    if not hasattr(model, "tangent") or not hasattr(model, "supports"):
        raise InvalidInput(
            f"model is a {type(model).__name__}: build one, e.g. build(structure, fidelity='rigid')"
        )
