"""Modal analysis about a state, with joints as open or closed as they are there."""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from numbers import Integral
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem._display import ResultDisplay
from archfem._files import align_columns
from archfem._optional import require_package
from archfem._threads import single_threaded
from archfem._typing import Array
from archfem._validation import check_type
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models.model import Model, check_model
from archfem.statics import dense_eigensolver
from archfem.statics.equilibrium import Equilibrium

_mode_cache: OrderedDict[str, tuple[Array, Array]] = OrderedDict()


@dataclass(frozen=True, eq=False, repr=False)
class Modes(ResultDisplay):
    """Lowest modes of vibration of a model.

    Attributes:
        model: vibrating model.
        frequencies: natural frequencies f, ascending (k,) [Hz].
        shapes: mode shapes φ, in columns, with φᵀ M φ = 1 (n, k).
        masses: mass that can move along x and y, in all modes together (2,) [kg].
    """

    model: Model
    frequencies: Array
    shapes: Array
    masses: Array

    def _summary(self) -> str:
        """Describe the modes in one or two lines."""
        share, low, high = self.mass_ratios.sum(axis=0), *self.frequencies[[0, -1]]
        return (
            f"Modes of '{self.model.structure.name}': {len(self.frequencies)} from {low:.2f} to "
            f"{high:.2f} Hz, with {share[0]:.0%} of the mass along x and {share[1]:.0%} along y"
        )

    @property
    def periods(self) -> Array:
        """Natural periods T (k,) [s]."""
        return 1.0 / self.frequencies

    @cached_property
    def participation(self) -> Array:
        """Participation factors φᵀ M r along x and y (k, 2) [√kg]."""
        return self.shapes.T @ self.model.mass_influence

    @cached_property
    def effective_masses(self) -> Array:
        """Effective masses along x and y, (φᵀ M r)², which add up to `masses` (k, 2) [kg]."""
        return self.participation**2

    @cached_property
    def mass_ratios(self) -> Array:
        """Effective masses as shares of the mass that can move (k, 2) [-]."""
        return self.effective_masses / self.masses

    def table(self) -> str:
        """Return a line for each mode: frequency, period, mass shares along x and y, their sums."""
        head = ["mode", "frequency", "period", "mass x", "mass y", "sum x", "sum y"]
        ratios = np.hstack([self.mass_ratios, np.cumsum(self.mass_ratios, axis=0)])
        rows = [
            [str(number), f"{f:.4g} Hz", f"{1.0 / f:.4g} s", *(f"{share:.1%}" for share in shares)]
            for number, (f, shares) in enumerate(zip(self.frequencies, ratios, strict=True), 1)
        ]
        return align_columns(head, rows)


@single_threaded
def modes(model: Model, count: int, about: Equilibrium | None = None) -> Modes:
    """Find the lowest modes of small vibrations about a state, K φ = ω² M φ.

    K is the tangent of blocks and joints: a joint point that is open has no stiffness, and stays
    open as long as vibrations are small. Shapes have a sign: they move with the ground along +x;
    where their mass share along x is below a thousandth along +y; and where both are, their first
    component of at least half the largest one is positive.

    Args:
        model: of any fidelity; its damping plays no part.
        count: number of modes, from 1 to the number of coordinates.
        about: the state, such as the dead load of this model; None: all joints closed.

    Returns:
        The modes, the lowest first.

    Raises:
        InvalidInput: there are not so many modes, or the state is another model's.
        DidNotConverge: the structure is a mechanism there and does not vibrate, or the eigensolver
            failed; `last` is the state.
        NotInstalled: SLEPc is missing, and the model too large for LAPACK.

    References:
        Clough and Penzien, Dynamics of structures (1993), chapters 11 and 26-3, for participation
        and effective mass.

    Example:
        >>> model = af.build(af.column(breadth=0.6, heights=[2.4]), fidelity="rigid")
        >>> af.modes(model, 3).frequencies.round(2).tolist()
        [10.56, 79.23, 87.53]
    """
    check_model(model)
    if about is not None:
        check_type(about, Equilibrium, "about", "give dead_load(model), or None")
    check_type(count, Integral, "number of modes", "give a whole number")
    if not 1 <= count <= model.size:
        raise InvalidInput(
            f"{count} modes of a model with {model.size} coordinates: ask for 1 to {model.size}"
        )
    try:
        squares, shapes = _find_cached_modes(_tangent_about(model, about), model.mass, count)
    except DidNotConverge as error:
        state = "with all joints closed" if about is None else "about the given state"
        raise DidNotConverge(f"no modes {state}: {error}", last=about) from error
    influence = model.mass_influence
    masses = np.sum(influence * splu(model.mass.tocsc()).solve(influence), axis=0)
    signs = _shape_signs(shapes, shapes.T @ influence, masses)
    return Modes(model, np.sqrt(squares) / (2.0 * np.pi), shapes * signs, masses)


def _find_cached_modes(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int, cache_size: int = 6
) -> tuple[Array, Array]:
    """Return the lowest ω² and their shapes, from the cache where all bits of K and M agree."""
    by_slepc = find_spec("slepc4py") is not None
    digest = hashlib.sha256(str((count, stiffness.shape, by_slepc)).encode())
    for matrix in (stiffness, mass):
        for part in (matrix.indptr, matrix.indices, matrix.data):
            digest.update(part.tobytes())
    key = digest.hexdigest()
    if key not in _mode_cache:
        solver: Any = dense_eigensolver
        if by_slepc:
            with require_package("SLEPc"):
                solver = import_module("archfem.statics.slepc_eigensolver")
        _mode_cache[key] = solver.find_lowest_modes(stiffness, mass, count)
        if len(_mode_cache) > cache_size:
            _mode_cache.popitem(last=False)
    _mode_cache.move_to_end(key)
    return _mode_cache[key]


def _tangent_about(model: Model, about: Equilibrium | None) -> sparse.csr_matrix:
    """Return the stiffness with joints as in a state."""
    if about is None:
        return model.closed_tangent()
    if about.model.fidelity != model.fidelity or len(about.q) != model.size:
        raise InvalidInput(
            f"the state is of a model '{about.model.fidelity}' with {len(about.q)} coordinates, "
            f"the modes of '{model.fidelity}' with {model.size}: give the same model's"
        )
    # With the memory updated, sliding points stick: they do as soon as they move back.
    return about.model.with_memory(about.model.updated_memory(about.q)).tangent(about.q)


def _shape_signs(
    shapes: Array, participation: Array, masses: Array, min_mass_share: float = 1e-3
) -> Array:
    """Return the sign of each shape, 1 or -1 (k,)."""
    sizeable = np.abs(shapes) >= 0.5 * np.abs(shapes).max(axis=0)
    sign = shapes[np.argmax(sizeable, axis=0), np.arange(shapes.shape[1])]
    # x last, so that it takes precedence; a smaller mass share may be round-off
    for axis in (1, 0):
        along = participation[:, axis]
        sign = np.where(along**2 / masses[axis] >= min_mass_share, along, sign)
    return np.where(sign < 0.0, -1.0, 1.0)
