"""Time stepping that uses what is special here: everything is linear but the joints.

With all joints closed the structure is linear and, under Rayleigh damping on its mass and closed
stiffness, falls into independent modes. In their coordinates η, all of which are kept, a step is

    Δη = H (forces + Bᵀ λ),    z = z₀ + F λ,    λ = J(z) z,

with H diagonal, B = G Φ the modes' openings at the joint points, F = c B H Bᵀ their compliance over
one step, and λ the forces that take tension out of the closed joints. J is block-diagonal
and vanishes where a joint is closed, so a step costs one product B ξ and a small dense problem in
the open points alone. The idea is Wilson's fast nonlinear analysis (Three-dimensional static and
dynamic analysis of structures, 2002, chapter 18), here without truncation: the history is that of
the equilibrium solves of `dynamics`, to rounding.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from archfem.compiled import kernel
from archfem.compiled.batches import POINT, STEPS, Room, compiled_law, shear_resultants
from archfem.compiled.modal_energy import energies
from archfem.dynamics import Stepper
from archfem.models.jointed import Jointed
from archfem.schemes import Rayleigh
from archfem.structure import Array

LARGEST = 1200
"""Coordinates up to which all modes are computed and kept."""


def applies(model: Jointed, damping: Rayleigh | None) -> bool:
    """Whether the closed structure falls into modes, few enough to keep all of them."""
    proportional = damping is None or damping.joints != "none"
    return proportional and model.operator.offset is None and model.size <= LARGEST


def work(model: Jointed) -> float:
    """About how long a step takes with joints that open often, set-up included [µs]."""
    points, size = model.operator.opening.shape[0], model.size
    return 10.0 + POINT * points + 0.5e-3 * points * size + 0.5e-3 * size**3 / STEPS


@dataclass(frozen=True, eq=False)
class _Modes:
    """The closed structure in its modes.

    Attributes:
        shapes: Φ, unit modal masses (n, n).
        back: M Φ, from displacements to modes (n, n).
        squares: ω² (n,) [1/s²].
        opening: B = G Φ (p, n).
        shear: shear resultant of each joint (n_joints, n).
        weight: modal self-weight (n,).
        body: modal force per unit ground acceleration (n, 2).
    """

    shapes: Array
    back: Array
    squares: Array
    opening: Array
    shear: Array
    weight: Array
    body: Array

    @classmethod
    def of(cls, model: Jointed, weight: Array) -> "_Modes":
        squares, shapes = eigh(model.closed().toarray(), model.mass.toarray())
        joints = model.operator
        return cls(
            shapes,
            model.mass @ shapes,
            squares,
            np.ascontiguousarray(joints.opening @ shapes),
            np.ascontiguousarray(shear_resultants(model) @ shapes),
            shapes.T @ weight,
            shapes.T @ model.body,
        )


class ContactMethod:
    """Steps in the modes of a model's closed state.

    Args:
        exact: the same steps, and what they are made of.
        damping: None is undamped.
    """

    name = "contact"

    def __init__(self, exact: Stepper, damping: Rayleigh | None) -> None:
        assert isinstance(exact.model, Jointed)
        self._scheme = exact.scheme
        self._lag = exact.lag
        self._modes = _Modes.of(exact.model, exact.weight)
        self._law = compiled_law(exact.model)
        rate = damping.stiffness if damping else 0.0
        self._rates = (damping.mass if damping else 0.0) + rate * self._modes.squares
        self._step: tuple[float, kernel.Coefficients, Array] | None = None

    def enter(self, vectors: Array) -> Array:
        """From displacements, velocities, … to modes (3, n)."""
        return np.asarray(vectors @ self._modes.back)

    def leave(self, vectors: Array) -> Array:
        """Back from modes (3, n)."""
        return np.stack([self._modes.shapes @ each for each in vectors])

    def take(self, dt: float, room: Room) -> int:
        """Take steps up to the last, or up to one whose open points do not settle."""
        coefficients, compliance = self._prepared(dt)
        modes = self._modes
        gaps = np.empty((len(room.series), len(room.gap)))
        gaps[0] = room.gap
        count = kernel.advance(
            room.series,
            gaps,
            room.resultants,
            room.iterations,
            modes.weight - room.seen @ modes.body.T,
            (modes.opening, modes.shear, compliance),
            coefficients,
            self._law,
        )
        room.energy[:count] = energies(
            room.series[: count + 1],
            gaps[: count + 1],
            (modes.weight, -room.mean[:count] @ modes.body.T),
            modes.opening,
            coefficients,
            self._law,
        )
        return int(count)

    def _prepared(self, dt: float) -> tuple["kernel.Coefficients", Array]:
        """What a step of this length needs."""
        if self._step is None or self._step[0] != dt:
            scheme, modes = self._scheme, self._modes
            numbers = kernel.coefficients(
                dt,
                (scheme.beta, scheme.gamma, scheme.alpha),
                self._lag,
                (modes.squares, self._rates),
            )
            compliance = (modes.opening * (numbers.seen * numbers.gain)) @ modes.opening.T
            self._step = (dt, numbers, np.ascontiguousarray(compliance))
        return self._step[1:]
