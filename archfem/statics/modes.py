"""Modal analysis about a state: joints stay as open or closed as they are then."""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from numbers import Integral

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models.model import Model, check_model
from archfem.packages import needed
from archfem.shown import Shown
from archfem.statics import dense_eigen
from archfem.statics.equilibrium import Equilibrium
from archfem.tables import aligned
from archfem.threads import on_one_thread

SEEN = 1e-3
"""Share of the mass from which a mode's sense along an axis is clear of rounding."""

KEPT = 6
"""How many solutions are kept, of those found last."""

_kept: OrderedDict[str, tuple[Array, Array]] = OrderedDict()


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Shown, picture="modes.draw_modes"):
    """The lowest modes of a model.

    Attributes:
        model: what vibrates.
        frequencies: ascending (k,) [Hz].
        shapes: columns φ with φᵀ M φ = 1 (n, k).
        masses: what can move along x and y, by all modes together (2,) [kg].
    """

    model: Model
    frequencies: Array
    shapes: Array
    masses: Array

    def _words(self) -> str:
        """What it is, in a line or two."""
        share, low, high = self.mass_ratios.sum(axis=0), *self.frequencies[[0, -1]]
        return (
            f"Modes of '{self.model.structure.name}': {len(self.frequencies)} from {low:.2f} to "
            f"{high:.2f} Hz, with {share[0]:.0%} of the mass along x and {share[1]:.0%} along y"
        )

    @property
    def periods(self) -> Array:
        """Periods (k,) [s]."""
        return 1.0 / self.frequencies

    @cached_property
    def participation(self) -> Array:
        """Participation factors φᵀ M r along x and y (k, 2) [√kg]."""
        return self.shapes.T @ self.model.body

    @cached_property
    def effective_masses(self) -> Array:
        """Effective masses along x and y, (φᵀ M r)², which add up to `masses` (k, 2) [kg]."""
        return self.participation**2

    @cached_property
    def mass_ratios(self) -> Array:
        """Effective masses as shares of what can move (k, 2) [-]."""
        return self.effective_masses / self.masses

    def table(self) -> str:
        """One line a mode: frequency, period, share of the mass along x and y, and their sums."""
        head = ["mode", "frequency", "period", "mass x", "mass y", "sum x", "sum y"]
        ratios = np.hstack([self.mass_ratios, np.cumsum(self.mass_ratios, axis=0)])
        rows = [
            [str(number), f"{f:.4g} Hz", f"{1.0 / f:.4g} s", *(f"{share:.1%}" for share in shares)]
            for number, (f, shares) in enumerate(zip(self.frequencies, ratios, strict=True), 1)
        ]
        return aligned(head, rows)


@on_one_thread
def modes(model: Model, count: int, about: Equilibrium | None = None) -> Modes:
    """Find the lowest modes of small vibrations about a state, K φ = ω² M φ.

    K is the tangent of blocks and joints: a joint point that is open has no stiffness, and stays
    open as long as vibrations are small. Shapes have a sense: they move with the ground along +x,
    where they hardly move along x along +y, and where along neither, their first component of any
    size is positive. Reference: Clough and Penzien, Dynamics of structures (1993), chapters 11
    and 26-3 for participation and effective mass.

    Args:
        model: any rung of the ladder; its damping plays no part.
        count: how many modes, from 1 to the number of coordinates.
        about: the state, such as the dead load of this model; None: all joints closed.

    Returns:
        The modes, the lowest first.

    Raises:
        InvalidInput: there are not so many modes, or the state is another model's.
        DidNotConverge: the structure is a mechanism there and does not vibrate, or modes were not
            found; `last` is the state.
        NotInstalled: SLEPc is not there, and the model too large to do without.

    Example:
        >>> model = af.build(af.column(breadth=0.6, heights=[2.4]), fidelity="rigid")
        >>> af.modes(model, 3).frequencies.round(2).tolist()
        [10.56, 79.23, 87.53]
    """
    check_model(model)
    if about is not None:
        instance(about, Equilibrium, "about", "give dead_load(model), or None")
    instance(count, Integral, "number of modes", "give a whole number")
    if not 1 <= count <= model.size:
        raise InvalidInput(
            f"{count} modes of a model with {model.size} coordinates: ask for 1 to {model.size}"
        )
    try:
        squares, shapes = _lowest(_tangent(model, about), model.mass, count)
    except DidNotConverge as error:
        state = "with all joints closed" if about is None else "about the given state"
        raise DidNotConverge(f"no modes {state}: {error}", last=about) from error
    masses = np.sum(model.body * splu(model.mass.tocsc()).solve(model.body), axis=0)
    sense = _sense(shapes, shapes.T @ model.body, masses)
    return Modes(model, np.sqrt(squares) / (2.0 * np.pi), shapes * sense, masses)


def _lowest(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int
) -> tuple[Array, Array]:
    """The lowest ω² and their shapes, found once of the same matrices to the last bit."""
    by_slepc = find_spec("slepc4py") is not None
    told = hashlib.sha256(str((count, stiffness.shape, by_slepc)).encode())
    for matrix in (stiffness, mass):
        for part in (matrix.indptr, matrix.indices, matrix.data):
            told.update(part.tobytes())
    key = told.hexdigest()
    if key not in _kept:
        _kept[key] = _solved(stiffness, mass, count)
        while len(_kept) > KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]


def _solved(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int
) -> tuple[Array, Array]:
    """The same by SLEPc, or where that is not installed by LAPACK."""
    if find_spec("slepc4py") is None:
        return dense_eigen.lowest(stiffness, mass, count)
    with needed("SLEPc"):
        from archfem.statics import eigen
    return eigen.lowest(stiffness, mass, count)


def _tangent(model: Model, about: Equilibrium | None) -> sparse.csr_matrix:
    """Stiffness with joints as in a state; what slides there holds as soon as it moves back."""
    if about is None:
        return model.closed()
    if about.model.fidelity != model.fidelity or len(about.q) != model.size:
        raise InvalidInput(
            f"the state is of a model '{about.model.fidelity}' with {len(about.q)} coordinates, "
            f"the modes of '{model.fidelity}' with {model.size}: give the same model's"
        )
    return about.model.remembering(about.model.remembered(about.q)).tangent(about.q)


def _sense(shapes: Array, participation: Array, masses: Array) -> Array:
    """Sign of each shape, 1 or -1 (k,)."""
    sizeable = np.abs(shapes) >= 0.5 * np.abs(shapes).max(axis=0)
    sense = shapes[np.argmax(sizeable, axis=0), np.arange(shapes.shape[1])]
    for axis in (1, 0):
        along = participation[:, axis]
        sense = np.where(along**2 / masses[axis] >= SEEN, along, sense)
    return np.where(sense < 0.0, -1.0, 1.0)
