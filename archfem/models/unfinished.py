"""A structure while it is being built: some blocks are not there yet, others rest on centring."""

from collections.abc import Iterable
from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.masonry.actions import Action
from archfem.models.jointed import Jointed

Flags = NDArray[np.bool_]


class Unfinished(Jointed):
    """A model of which a part stands, with the coordinates of the whole.

    Joints to blocks that are not there bear nothing. A block comes without stress onto what
    stands: its joints begin at the gaps and slips that they have then, and its displacements count
    from there. Coordinates of blocks that are missing, or on centring, are held at zero; forces
    and loads on them are left out.

    Attributes:
        whole: the model of all blocks, as built in one go.
        there: which blocks stand, fixed ones among them (n_blocks,).
        centred: which blocks centring holds (n_blocks,).
    """

    def __init__(self, whole: Jointed) -> None:
        vars(self).update(vars(whole))
        self.whole = whole
        self.there: Flags = np.array([block.fixed for block in whole.structure.blocks])
        self.centred: Flags = np.zeros_like(self.there)
        self._last = None
        lift = whole.cells.lift.tocoo()
        moving = lift.data != 0.0
        self._owner = np.zeros(whole.size, dtype=np.intp)
        self._owner[lift.col[moving]] = whole.cells.block[lift.row[moving] // 2]
        self._rows = np.repeat(np.arange(whole.size), np.diff(whole.mass.indptr))
        self._unit = float(np.mean(whole.closed().diagonal()))

    def placed(self, blocks: Iterable[int], q: Array, *, centring: bool = False) -> "Unfinished":
        """Return the model with further blocks.

        Args:
            blocks: their numbers.
            q: coordinates at which they are placed (n,).
            centring: whether it holds them.
        """
        other = copy(self)
        new = np.zeros_like(self.there)
        new[list(blocks)] = True
        other.there = self.there | new
        other.centred = self.centred | (new & centring)
        begin = other._borne & ~self._borne
        gaps = np.stack([self.operator.openings(q), self.operator.slips(q)])
        built = np.zeros_like(gaps) if self.built is None else self.built
        return other.begun(np.where(begin, built - gaps, built))

    def struck(self) -> "Unfinished":
        """Return the model without its centring."""
        other = copy(self)
        other.centred = np.zeros_like(self.centred)
        other._last = None
        return other

    def finished(self) -> Jointed:
        """Return the model of all blocks, its joints as they began and with what they remember."""
        whole = self.whole.moved(self.supports).remembering(self.memory)
        return whole if self.built is None else whole.begun(self.built)

    @property
    def _borne(self) -> Flags:
        """Which points lie between blocks that both stand (p,)."""
        pairs = self.structure.pairs[self.operator.points.joint]
        borne: Flags = self.there[pairs].all(axis=1)
        return borne

    @property
    def _moves(self) -> Flags:
        """Which coordinates are those of blocks that stand freely (n,)."""
        moves: Flags = (self.there & ~self.centred)[self._owner]
        return moves

    def matrix(self, share: float, stiffness: Array) -> sparse.csr_matrix:
        """Return the stiffness of what stands; coordinates that are held resist on their own.

        Args:
            share: factor of that of the blocks [-].
            stiffness: of the joints, as by `JointOperator.stiffness` (m,) [N/m].
        """
        borne, moves, first = self._borne, self._moves, self.operator.law.entries[0]
        parts = [borne[first], borne, *([borne[first]] if self.operator.slides else [])]
        matrix = super().matrix(share, np.where(np.concatenate(parts), stiffness, 0.0))
        rows, columns = self._rows, matrix.indices
        held = np.where((rows == columns) & ~moves[rows], self._unit, 0.0)
        matrix.data = np.where(moves[rows] & moves[columns], matrix.data, held)
        return matrix

    def force(self, q: Array) -> Array:
        """Return the internal forces of what stands (n,).

        Args:
            q: coordinates (n,).
        """
        forces = self.blocks @ q + self.operator.pushed(*self._tractions(q))
        return np.where(self._moves, forces, self._unit * q)

    def _tractions(self, q: Array) -> tuple[Array, Array]:
        """Normal and shear forces at the points, where both blocks stand, each (p,) [N]."""
        normal, shear = self.operator.tractions(q)
        return np.where(self._borne, normal, 0.0), np.where(self._borne, shear, 0.0)

    def energy(self, q: Array) -> float:
        """Return the potential energy of what stands, if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        joints, borne = self.operator, self._borne
        opening, shear = joints.felt(q), joints.elastic(q)
        stored = opening * joints.law.forces(opening) + shear**2 / joints.points.shear
        if joints.bonds is not None:
            stored = stored + 2.0 * joints.bonds.stored(opening)
        return 0.5 * float(q @ (self.blocks @ q)) + 0.5 * float(np.sum(stored[borne]))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, zero where a block is missing (n_joints, 3).

        Args:
            q: coordinates (n,).
        """
        return self.operator.summed(*self._tractions(q))

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember once the model is at q, as `memory`.

        Args:
            q: coordinates (n,).
        """
        found = super().remembered(q)
        return np.where(np.resize(self._borne, len(found)), found, 0.0)

    def load(self, action: Action) -> Array:
        """Return the generalised forces of an action on the blocks that stand freely (n,).

        Args:
            action: body force or point load.
        """
        return np.where(self._moves, super().load(action), 0.0)
