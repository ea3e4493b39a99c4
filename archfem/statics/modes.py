"""Modal analysis about a state, with its open and closed joints.

K x = ω² M x is solved by shift-and-invert and the Lanczos method of ARPACK, for many of all modes
by LAPACK. By Sylvester's law of inertia the number of negative pivots of K - σ M equals the number
of ω² below σ: this detects negative stiffness, and modes that were missed.

References: Lehoucq, Sorensen and Yang, ARPACK users' guide (1998).
"""

from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from typing import Literal

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, SuperLU, eigsh, splu

from archfem._display import DOUBT_MARK, ResultDisplay
from archfem._files import align_columns
from archfem._threads import single_threaded
from archfem._typing import Array, Flags
from archfem._validation import check_type
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.stiffness_ratio import estimate_lowest_inner
from archfem.models.model import Doubt, Model
from archfem.statics.equilibrium import Equilibrium, Start, Subject, resolve_start

# Share of the lowest frequency of a stone that its joints hold fast, above which frequencies are
# doubted that lack inertia inside of blocks [-]. Of columns and rings they were up to 5 % too high
# below it, and up to a multiple above
MAX_INNER_SHARE = 0.3


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

    @cached_property
    def local(self) -> Flags:
        """Whether other parts, such as fill, move over twice as far as any ring or pier (k,)."""
        cells, blocks = self.model.cells, self.model.structure.blocks
        assessed = np.array([blocks[number].role != "other" for number in cells.block])
        moves = [np.linalg.norm(cells.displacement(shape), axis=1) for shape in self.shapes.T]
        # without rings and piers, as in a single wall, there is nothing else to move
        return np.array([assessed.any() and 2.0 * u[assessed].max() < u.max() for u in moves])

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubt where blocks vibrate by themselves, which all fidelities but "full" leave out."""
        whole = any(name in self.model.fidelity for name in ("rigid", "faces", "condensed"))
        inner = estimate_lowest_inner(self.model.structure) if whole else np.inf
        if self.frequencies[-1] <= MAX_INNER_SHARE * inner:
            return ()
        words = "a block vibrates by itself from about {:.3g} Hz on: frequencies above "
        words += f"{MAX_INNER_SHARE:g} of that may be too high by more than 5 %"
        return (Doubt(words, "take them as upper bounds, or use fidelity 'full'", (inner,)),)

    def table(self) -> str:
        """Return a line for each mode: frequency, period, mass shares along x and y, their sums.

        Frequencies in doubt stand behind "≤", and the doubt below the lines.
        """
        head = ["mode", "frequency", "period", "mass x", "mass y", "sum x", "sum y"]
        ratios = np.hstack([self.mass_ratios, np.cumsum(self.mass_ratios, axis=0)])
        limit = min((MAX_INNER_SHARE * doubt.values[0] for doubt in self.doubts), default=np.inf)
        said = [f"{'≤ ' * bool(f > limit)}{f:.4g} Hz" for f in self.frequencies]
        numbered = enumerate(zip(said, self.periods, ratios, strict=True), 1)
        rows = [
            [str(number), frequency, f"{period:.4g} s", *map("{:.1%}".format, shares)]
            for number, (frequency, period, shares) in numbered
        ]
        return "\n".join([align_columns(head, rows), *(f"{DOUBT_MARK}{x}" for x in self.doubts)])


@single_threaded
def modes(model: Model | Subject, count: int, start: Start = None) -> Modes:
    """Find the lowest modes of small vibrations about a state, K φ = ω² M φ.

    K is the tangent of blocks and joints: a joint point that is open has no stiffness, and stays
    open as long as vibrations are small. Shapes have a sign: they move with the ground along +x;
    where their mass share along x is below a thousandth along +y; and where both are, their first
    component of at least half the largest one is positive.

    Args:
        model: model of any fidelity, or an `archfem.Analysis`; damping plays no part.
        count: number of modes, from 1 to the number of coordinates.
        start: the state: an equilibrium of this model; by default its dead load; or "closed" for
            all joints closed.

    Returns:
        The modes, the lowest first.

    Raises:
        InvalidInput: there are not so many modes, or the state is another model's.
        DidNotConverge: the structure is a mechanism there and does not vibrate, or the eigensolver
            failed; `last` is the state.

    References:
        Clough and Penzien, Dynamics of structures (1993), chapters 11 and 26-3, for participation
        and effective mass.

    Example:
        >>> model = af.build(af.column(breadth=0.6, heights=[2.4]), fidelity="rigid")
        >>> af.modes(model, 3).frequencies.round(2).tolist()
        [10.56, 79.23, 87.53]
    """
    model, state = resolve_start(model, start)
    check_type(count, Integral, "number of modes", "give a whole number")
    if not 1 <= count <= model.size:
        raise InvalidInput(
            f"{count} modes of a model with {model.size} coordinates: ask for 1 to {model.size}"
        )
    try:
        squares, shapes = find_lowest_modes(_tangent_at(model, state), model.mass, count)
    except DidNotConverge as error:
        if not isinstance(state, Equilibrium):
            raise DidNotConverge(f"no modes with all joints closed: {error}") from error
        which = "the dead load" if start is None else "the given state"
        raise DidNotConverge(f"no modes about {which}: {error}", last=state) from error
    influence = model.mass_influence
    masses = np.sum(influence * splu(model.mass.tocsc()).solve(influence), axis=0)
    signs = _shape_signs(shapes, shapes.T @ influence, masses)
    return Modes(model, np.sqrt(squares) / (2.0 * np.pi), shapes * signs, masses)


def find_lowest_modes(
    stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, count: int, max_restarts: int = 200
) -> tuple[Array, Array]:
    """Find the lowest ω² and their shapes, with φᵀ M φ = 1."""
    size = mass.shape[0]
    zero = zero_threshold(stiffness, mass)
    _check_lowest(0.0, -zero)
    if 2 * count >= size:
        dense = stiffness.toarray()
        symmetric = 0.5 * (dense + dense.T)
        squares, shapes = eigh(symmetric, mass.toarray(), subset_by_index=(0, count - 1))
        _check_lowest(float(squares[0]), zero)
        return squares, shapes
    # a shift just below zero: K + zero M is regular for any structure that stands
    factors = _factorise(stiffness, mass, -zero)
    inverse = LinearOperator(mass.shape, factors.solve)
    # a start of noise has a part of every mode, and the same seed gives the same bits
    start = np.random.default_rng(0).standard_normal(size)
    options = {"sigma": -zero, "OPinv": inverse, "v0": start, "maxiter": max_restarts}
    try:
        squares, shapes = eigsh(stiffness, count, mass, **options)
    except ArpackNoConvergence as error:
        raise DidNotConverge(
            f"ARPACK found {len(error.eigenvalues)} of {count} modes in {max_restarts} restarts: "
            "ask for fewer, or check units"
        ) from error
    _check_lowest(float(squares[0]), zero, _count_negative_pivots(factors))
    # Count modes below the highest one; those within 1e-6 of it count as equal and are left out.
    edge = float(squares[-1]) * (1.0 - 1e-6)
    below, expected = int(np.sum(squares < edge)), count_modes_below(stiffness, mass, edge)
    if expected != below:
        raise DidNotConverge(
            f"ARPACK found {below} modes below {np.sqrt(edge) / (2.0 * np.pi):.4g} Hz where there "
            f"are {expected}: ask for a few more or fewer"
        )
    return squares, shapes


def count_modes_below(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, square: float) -> int:
    """Return the number of ω² below a value, by Sylvester's law."""
    return _count_negative_pivots(_factorise(stiffness, mass, square))


def _factorise(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, square: float) -> SuperLU:
    """Return the factors of K - σ M, with the diagonal entries as pivots."""
    shifted = stiffness - square * mass
    # where joints can slide the pattern has slips coupled with openings, but not the reverse
    symmetric = (0.5 * (shifted + shifted.T)).tocsc()
    options = {"SymmetricMode": True}
    try:
        return splu(symmetric, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:  # SuperLU: a pivot is zero
        raise DidNotConverge(f"the stiffness less {square:.3g} M is singular: {error}") from error


def _count_negative_pivots(factors: SuperLU) -> int:
    """Return the number of negative pivots of a symmetric matrix."""
    if not np.array_equal(factors.perm_r, factors.perm_c):  # a zero on the diagonal was passed over
        raise DidNotConverge("modes cannot be counted where a pivot vanishes: ask for one more")
    return int(np.sum(factors.U.diagonal() < 0.0))


def zero_threshold(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix) -> float:
    """Return the largest ω² that may be round-off of zero [1/s²]."""
    # relative to the largest ω² of a single coordinate; round-off stays well below 1e-13 of it
    return 1e-13 * float(np.max(stiffness.diagonal() / mass.diagonal()))


def _check_lowest(square: float, zero: float, negative: int = 0) -> None:
    """Refuse a structure with a motion of no stiffness.

    By its lowest ω² [1/s²], or by the number of those below zero, which a search may have missed.
    """
    if square <= zero or negative:
        size = f"with ω² = {square:.1e} 1/s² where rounding makes up to {zero:.0e}: a mechanism"
        if negative:
            size = f"with {negative} ω² below 0: a mechanism, or pieces on facets of millimetres"
        raise DidNotConverge(
            f"the stiffness is singular or negative, {size}; check supports and joints, give "
            "another piece_size of a fill, or take another state"
        )


def _tangent_at(model: Model, state: Equilibrium | Literal["closed"]) -> sparse.csr_matrix:
    """Return the stiffness with joints as in a state."""
    if not isinstance(state, Equilibrium):
        return model.closed_tangent()
    if state.model.fidelity != model.fidelity or len(state.q) != model.size:
        raise InvalidInput(
            f"the state is of a model '{state.model.fidelity}' with {len(state.q)} coordinates, "
            f"the modes of '{model.fidelity}' with {model.size}: give the same model's"
        )
    # With the memory updated, sliding points stick: they do as soon as they move back.
    return state.model.with_memory(state.model.updated_memory(state.q)).tangent(state.q)


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
