"""The interface of all models of a structure: generalised coordinates, forces, mass and loads.

Masonry, joint laws and meshes serve to build a `Model`; statics, dynamics, pictures and cases use
it through this interface alone, whatever its fidelity and whether displacements are small or large.
"""

import json
import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem.errors import InvalidInput, filter_log
from archfem.joints.operator import JointOperator
from archfem.masonry.loads import Action, BodyForce, Settlement
from archfem.masonry.structure import Structure
from archfem.units import Ends


@dataclass(frozen=True, eq=False)
class Cells:
    """Polygons that cover the free blocks, and their displacements and stresses.

    Attributes:
        places: points before anything moves (m, 2) [m].
        block: number of the block of each point (m,).
        polygons: point numbers of each polygon's corners, in order.
        shape_functions: displacements of the points, x and y in turn, from coordinates (2 m, n).
        stress: mean stress of each polygon, (σ_xx, σ_yy, σ_xy) in turn, from coordinates
            (3 n_polygons, n) [Pa]; None where blocks are rigid.
    """

    places: Array
    block: Numbers
    polygons: tuple[Numbers, ...]
    shape_functions: sparse.csr_matrix
    stress: sparse.csr_matrix | None = None

    @cached_property
    def owner(self) -> Numbers:
        """Number of the block of each polygon (n_polygons,)."""
        return self.block[[polygon[0] for polygon in self.polygons]]

    @cached_property
    def coordinate_owner(self) -> Numbers:
        """Number of the block of each coordinate: the one whose points it displaces (n,)."""
        shapes = self.shape_functions.tocoo()
        moving = shapes.data != 0.0
        owner = np.zeros(shapes.shape[1], dtype=np.intp)
        owner[shapes.col[moving]] = self.block[shapes.row[moving] // 2]
        return owner

    def shapes_at(self, points: Numbers) -> sparse.csr_matrix:
        """Return the matrix from coordinates to the displacements of some points (2 k, n)."""
        return self.shape_functions[np.add.outer(2 * points, (0, 1)).ravel()]

    def corners(self, structure: Structure) -> Numbers:
        """Return the points nearest to the corners of the free blocks, block by block (c,).

        Args:
            structure: structure that the cells cover.
        """
        points = []
        for number in structure.free:
            own = np.flatnonzero(self.block == number)
            corners = np.asarray(structure.blocks[number].points)
            away = np.linalg.norm(self.places[own] - corners[:, None], axis=2)
            points.append(own[away.argmin(axis=1)])
        return np.concatenate(points)

    def displacement(self, q: Array) -> Array:
        """Return the displacements of all points (m, 2) [m].

        Args:
            q: coordinates (n,).
        """
        return (self.shape_functions @ q).reshape(-1, 2)

    @cached_property
    def _edges(self) -> tuple[Numbers, Numbers]:
        """Edges of all polygons (e, 2) and their blocks (e,)."""
        edges = np.concatenate([np.column_stack([p, np.roll(p, -1)]) for p in self.polygons])
        return edges, np.repeat(self.owner, [len(polygon) for polygon in self.polygons])

    @cached_property
    def outline_edges(self) -> Numbers:
        """Edges along the outlines of the blocks, in the sense of their polygon (e, 2)."""
        # an edge on the outline belongs to one polygon, an inner one to two
        edges, _ = self._edges
        pairs = np.sort(edges, axis=1)
        _, first, count = np.unique(pairs, axis=0, return_index=True, return_counts=True)
        return edges[first[count == 1]]

    def displacement_rows(self, block: int, point: Array) -> sparse.csr_matrix:
        """Return the matrix from coordinates to the displacement of a point of a block's surface.

        Displacements are linear between the ends of the nearest edge. A point beside the edge, as
        where chords replace an arc, rotates with it, so that rigid motions are exact.

        Args:
            block: number of the block.
            point: on its surface or near it (2,) [m].

        Returns:
            Rows of the displacements along x and y (2, n).
        """
        edge, weights = self.edge_weights(block, point)
        return sparse.csr_matrix(weights) @ self.shapes_at(edge)

    def edge_weights(self, block: int, point: Array) -> tuple[Numbers, Array]:
        """Return the edge of a block nearest to a point, and the map from its ends to the point.

        The point's offset from the edge turns with the edge, by any rotation.

        Args:
            block: number of the block.
            point: on its surface or near it (2,) [m].

        Returns:
            Point numbers of the edge's ends (2,); and the matrix from the displacements of both
            ends, x and y in turn, to that of the point (2, 4).
        """
        edge, fraction, beside = self.nearest_edge(block, point)
        along = self.places[edge[1]] - self.places[edge[0]]
        # offset over edge as complex numbers: its product with what the edge moves by
        turn = complex(*beside) / complex(*along)
        rotation = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
        end = fraction * np.eye(2) + rotation
        return edge, np.hstack([np.eye(2) - end, end])

    def nearest_edge(self, block: int, point: Array) -> tuple[Numbers, float, Array]:
        """Return the edge of a block nearest to a point, and the point's position relative to it.

        Args:
            block: number of the block.
            point: on its surface or near it (2,) [m].

        Returns:
            Point numbers of the edge's ends (2,); fraction of its length at which the nearest place
            lies, 0 to 1; and the vector from that place to the point (2,) [m].
        """
        edges, owner = self._edges
        edges = edges[owner == block]
        start, step = self.places[edges[:, 0]], np.diff(self.places[edges], axis=1)[:, 0]
        fraction = np.sum((point - start) * step, axis=1) / np.sum(step * step, axis=1)
        fraction = np.clip(fraction, 0.0, 1.0)
        distance = np.linalg.norm(start + fraction[:, None] * step - point, axis=1)
        nearest = int(np.argmin(distance))
        beside = point - start[nearest] - fraction[nearest] * step[nearest]
        return edges[nearest], float(fraction[nearest]), beside


@dataclass(frozen=True)
class Doubt:
    """Reason why a result may be wrong."""

    words: str  # what was found, with a field of `str.format` for each value
    remedy: str = ""  # what to do about it
    values: tuple[Any, ...] = ()  # numbers, the ends of their ranges over several runs, and names
    place: str = ""  # of which of several runs, in words
    example: str = ""  # one of what was found, by name

    @property
    def cause(self) -> str:
        """What was found, with the values and an example."""
        values = (x if isinstance(x, str) else Ends(list_ends(x)) for x in self.values)
        text = self.words.format(*values) if self.values else self.words
        return f"{text}; for example {self.example}" if self.example else text

    @property
    def kind(self) -> tuple[str, ...]:
        """What doubts that differ in numbers and examples alone have in common."""
        return (self.words, *(x for x in self.values if isinstance(x, str)))

    def __str__(self) -> str:
        """Place, cause and remedy as one sentence."""
        text = f"{self.place}: {self.cause}" if self.place else self.cause
        return f"{text}; {self.remedy}" if self.remedy else text


def list_ends(value: Any) -> tuple[float, ...]:
    """Return the ends of a range, or a number alone."""
    return value if isinstance(value, tuple) else (value,)


def group_doubts(doubts: Iterable[Doubt]) -> Iterable[list[Doubt]]:
    """Return doubts in groups that differ in numbers alone."""
    found: dict[tuple[str, ...], list[Doubt]] = {}
    for doubt in doubts:
        found.setdefault(doubt.kind, []).append(doubt)
    return found.values()


def merge_doubts(doubts: Sequence[Doubt], place: str = "") -> Doubt:
    """Return doubts of one kind as one, with the ends of each of their numbers."""
    values: list[Any] = []
    for column in zip(*(doubt.values for doubt in doubts), strict=True):
        text, numbers = isinstance(column[0], str), [end for x in column for end in list_ends(x)]
        values.append(column[0] if text else (min(numbers), max(numbers)))
    return replace(doubts[0], values=tuple(values), place=place)


@contextmanager
def log_doubts_once() -> Iterator[None]:
    """Log the doubts of several runs once where they differ in numbers alone."""
    logged = set[tuple[str, ...]]()

    def is_new(record: logging.LogRecord) -> bool:
        kinds = {x.kind for x in record.args or () if isinstance(x, Doubt)}
        known = bool(kinds) and kinds <= logged
        logged.update(kinds)
        return not known

    with filter_log(is_new):
        yield


def write_doubts(doubts: Iterable[Doubt]) -> str:
    """Return doubts as JSON, each once, as results keep them."""
    return json.dumps([astuple(doubt) for doubt in dict.fromkeys(doubts)])


def read_doubts(text: str) -> tuple[Doubt, ...]:
    """Return the doubts that `write_doubts` wrote."""
    found = (Doubt(*row) for row in json.loads(text))
    return tuple(
        replace(each, values=tuple(tuple(x) if isinstance(x, list) else x for x in each.values))
        for each in found
    )


@dataclass(frozen=True)
class Prediction:
    """Predicted errors of a model chosen by `build(fidelity="auto")`, and its time step.

    Attributes:
        error: estimated error of the largest |e| of the worst joint, of model and time step [-].
        tolerance: requested tolerance of the largest |e| [-].
        dt: time step with which the error is met [s].
        candidates: names and estimated errors of the settings tried, in order.
        small_displacement_error: estimated error of assuming small displacements, the same for
            every fidelity [-].
    """

    error: float
    tolerance: float
    dt: float
    candidates: tuple[tuple[str, float], ...]
    small_displacement_error: float = 0.0

    @property
    def is_met(self) -> bool:
        """Whether both errors, of model and time step and of small displacements, are within it."""
        return max(self.error, self.small_displacement_error) <= self.tolerance

    @property
    def text(self) -> str:
        """Summary of the prediction and of all settings tried."""
        tried = "; ".join(f"{name}: {error:.2g}" for name, error in self.candidates)
        return (
            f"predicted error {self.error:.2g} in the largest |e| by model and steps of "
            f"{1e3 * self.dt:g} ms, and {self.small_displacement_error:.2g} by the assumption of "
            f"small displacements; tolerance {self.tolerance:g} (tried: {tried})"
        )


class ModelStep(Protocol):
    """A time step of a model from a known state, with displacements linear in time.

    Forces are means over the step. Their work is the change of the stored energy plus the loss by
    friction and damping. Damping with the time lag β acts as forces at u + β v.
    """

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,)."""

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n)."""

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m]."""

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory at the end of the step, as `Model.memory`."""

    def with_dilatancy(self, q: Array) -> "ModelStep":
        """Return the step with the dilatancy opening due to the slip on the way to q, if any."""
        return self

    def dissipation(self, q: Array) -> float:
        """Return the energy lost to friction, broken bonds and damping [J]; never negative."""


class Observer(Protocol):
    """Displacements of joint faces and blocks, read from coordinates at every step.

    One row of readings holds gaps at mid-depth, rotations and slips of all joints, then the
    displacements of the corners of the free blocks.

    Attributes:
        joint_count: number of joints.
        corner_blocks: number of the block of each corner, block by block (c,).
    """

    joint_count: int
    corner_blocks: Numbers

    def read(self, q: Array) -> Array:
        """Return gaps, rotations and slips of joints, then corner displacements, in a row (r,)."""

    def read_many(self, states: Array, faces: Array | None = None) -> Array:
        """Return the rows of `read` for many states (steps, r).

        `faces` are gaps, twice the sines of half the rotations, and slips of the joints, where they
        are known (steps, 3, n_joints).
        """

    def joint_ends(self, q: Array) -> Array:
        """Return the displacements of both ends of each joint (n_joints, 2, 2) [m].

        An end is midway between the two blocks.
        """

    def faces(self, readings: Array) -> Array:
        """Return gaps at mid-depth, rotations and slips of the joints (…, 3, n_joints)."""
        of_joints = readings[..., : 3 * self.joint_count]
        return of_joints.reshape(*readings.shape[:-1], 3, self.joint_count)

    def corners(self, readings: Array) -> Array:
        """Return displacements of the corners of the free blocks (…, c, 2) [m]."""
        return readings[..., 3 * self.joint_count :].reshape(*readings.shape[:-1], -1, 2)


@runtime_checkable
class Model(Protocol):
    """A structure in generalised coordinates q: M q̈ + f(q) = p - M ι a, with joints inside f.

    The matrices of one model share one sparsity pattern: `indices` and `indptr` are the same
    arrays, so that matrices are added by their `data`. Methods named `with_…` return a changed
    copy. Methods with a body here are those of small displacements.

    Attributes:
        structure: structure that is modelled.
        fidelity: name of the model, such as "rigid" or "full".
        large_displacements: whether blocks may rotate and slide far.
        size: number n of coordinates.
        mass: mass matrix M; the kinetic energy is ½ q̇ᵀ M q̇ (n, n).
        block_stiffness: stiffness matrix of the blocks without joints (n, n).
        mass_influence: M ι, inertia forces per unit acceleration of the ground along x and y
            (n, 2) [kg, where the coordinate is a displacement].
        cells: polygons that cover the blocks, and their displacements.
        operator: joint operator, from coordinates to joint forces; None where joint forces come
            from weak forms or from large displacements.
        support_motion: motions of the fixed blocks, zero for the others (n_blocks, 3)
            [m, m, rad].
        initial_gaps: opening and slip of the joint points at q = 0, due to construction in stages
            (2, p) [m]; None where all blocks were placed at once.
        prediction: predicted errors, if the model was chosen by them, or None.
        doubts: reasons why this fidelity may be wrong for the structure.
    """

    structure: Structure
    fidelity: str
    large_displacements: bool
    size: int
    mass: sparse.csr_matrix
    block_stiffness: sparse.csr_matrix
    mass_influence: Array
    cells: Cells
    operator: JointOperator | None
    support_motion: Array
    initial_gaps: Array | None = None
    prediction: Prediction | None = None
    doubts: tuple[Doubt, ...] = ()

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`; unsymmetric where joints slide (n, n).

        Args:
            q: coordinates (n,).

        Returns:
            The same object as in the last call if nothing has changed since, so that its
            factorisation can be used again.
        """

    def support_forces(self, q: Array, motion: Array) -> Array:
        """Return the linearised change of `force` due to a small motion of the supports (n,).

        Args:
            q: coordinates (n,).
            motion: motion of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """

    def closed_tangent(self) -> sparse.csr_matrix:
        """Return the tangent with every joint closed over its whole depth (n, n)."""

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints without further slip [J].

        Args:
            q: coordinates (n,).
        """

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates (n,).
        """

    def observer(self) -> Observer:
        """Return the observer of joint faces and block displacements."""

    @property
    def memory(self) -> Array:
        """Irreversible slip of each joint point (p,) [m].

        Where any joint has tensile strength, the damage of bonds follows, 1 if broken (2 p,). Where
        any joint softens, the irreversible openings of bonds follow too (3 p,) [m].
        """

    def with_memory(self, memory: Array) -> Self:
        """Return the model with another joint memory, from which further slip is measured.

        Args:
            memory: as `memory`.
        """

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory once the model is at q, as `memory`.

        Args:
            q: coordinates (n,).
        """

    def begin_step(self, start: Array, damping_lag: float) -> ModelStep:
        """Return a time step from a state with the present joint memory.

        Args:
            start: coordinates at its start (n,).
            damping_lag: time lag of stiffness-proportional damping over the length of the step,
                β/Δt [-].
        """

    def with_support_motion(self, motion: Array) -> Self:
        """Return the model with supports displaced from where they were built.

        Args:
            motion: motion of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """

    def with_initial_gaps(self, gaps: Array) -> Self:
        """Return the model with gaps and slips of its joints at q = 0, due to construction.

        Args:
            gaps: opening and slip of the joint points (2, p) [m].

        Raises:
            InvalidInput: this fidelity cannot be built in stages.
        """

    def settled(self, settlement: Settlement) -> Self:
        """Return the model with the motion of a support added to `support_motion`.

        Args:
            settlement: the support and its motion.

        Raises:
            InvalidInput: the block is not a support.
        """
        return self.with_support_motion(settlement.added(self.structure, self.support_motion))

    def with_prediction(self, prediction: Prediction) -> Self:
        """Return the model with predicted errors.

        Args:
            prediction: stored as `prediction`.
        """
        return self.copy_with(prediction=prediction)

    @property
    def derived(self) -> dict[str, Any]:
        """Results by name that depend on the model but for the memory of its joints.

        Copies with another memory share them, and no others do.
        """
        return vars(self).setdefault("_derived", {})

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes of a copy, to which what was derived may not apply."""
        return {name: value for name, value in vars(self).items() if name != "_derived"}

    def copy_with(self, **attributes: Any) -> Self:
        """Return a copy with other attributes; arrays and matrices are shared."""
        other = copy(self)
        vars(other).update(attributes)
        return other

    def small_displacement_model(self) -> "Model":
        """Return the model of small displacements in the same coordinates."""
        return self

    def with_joint_state(self, built: "Model") -> Self:
        """Return the model with initial gaps and memory of its model of small displacements.

        Args:
            built: `small_displacement_model`, after construction.
        """
        model = self if built.initial_gaps is None else self.with_initial_gaps(built.initial_gaps)
        return model.with_memory(built.memory)

    def load(self, action: Action, q: Array | None = None) -> Array:
        """Return the generalised forces of an action (n,).

        Args:
            action: body force or point load.
            q: coordinates (n,), on which point loads on rotating blocks depend; by default zero.

        Raises:
            InvalidInput: a point load misses the structure.
        """
        if isinstance(action, BodyForce):
            multiples = np.array([action.horizontal, action.vertical])
            return (self.mass_influence @ multiples) * self.structure.gravity
        block, point = action.place(self.structure)
        return self.cells.displacement_rows(block, point).T @ np.array(action.force)

    def load_rate(self, action: Action, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `load` by the coordinates (n, n).

        Args:
            action: body force or point load.
            q: coordinates (n,).
        """
        return sparse.csr_matrix((self.size, self.size))

    def work(self, action: Action, q: Array) -> float:
        """Return the work of an action since before anything moved [J].

        Args:
            action: body force or point load.
            q: coordinates (n,).
        """
        return float(self.load(action) @ q)

    def face_mismatch(self, q: Array) -> tuple[float, str]:
        """Return the largest slip between paired facets, over their length, and its joint.

        Zero where joints are integrated over whole faces.

        Args:
            q: coordinates (n,).
        """
        return 0.0, ""

    def rigid_motions(self, q: Array, velocity: Array) -> tuple[Array, Array]:
        """Return displacement and velocity of each block as a rigid body.

        Args:
            q: coordinates (n,).
            velocity: their rates (n,).

        Returns:
            Displacement of the centroid and rotation (n_blocks, 3) [m, m, rad]; their rates.

        Raises:
            InvalidInput: the displacements of the model are small.
        """
        raise InvalidInput(
            f"the displacements of this model '{self.fidelity}' are small: build it for large "
            "displacements, with displacements='large'"
        )


def check_model(model: object) -> None:
    """Refuse objects that are no model, such as a structure that has not been built."""
    if not isinstance(model, Model):
        raise InvalidInput(
            f"model is a {type(model).__name__}: build one, e.g. build(structure, fidelity='rigid')"
        )


def check_coordinate_count(model: Model, count: int) -> None:
    """Refuse a number of coordinates that is not that of the model."""
    if count != model.size:
        raise InvalidInput(
            f"there are {count} coordinates, and the model has {model.size}: give the model, of "
            "the same cells and degree, that they were computed with"
        )
