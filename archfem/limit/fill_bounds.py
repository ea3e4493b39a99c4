"""Bounds on the collapse factor of rigid stones around a fill that is a plastic continuum.

The fill is a Mohr-Coulomb body without tension in plane strain. Its stress is linear in each
triangle of `fill_mesh` and within the strength at the corners, and so everywhere in the triangle:

    √((σ_x - σ_y)² + 4 τ²) <= 2 c cos φ - (σ_x + σ_y) sin φ,   <= -(σ_x + σ_y).

*From below* (Sloan, 1988): stresses in equilibrium at every point, with equal tractions on both
sides of each edge, prove that the load is carried. *From above* (Makrodimopoulos and Martin, 2007):
velocities are quadratic in each triangle, so that strain rates are linear. The power that they
dissipate is at most that of the rates at the corners. The programme of this bound is solved in its
dual form: stresses at the corners that are in equilibrium with all such velocities. Between fill
and stones the velocities of both differ by a quadratic jump; its Bernstein coefficients obey the
flow rule, and so the jump does everywhere. Both are second-order cone programmes of the same
unknowns, maximised over the factor λ, and differ in their equations alone.

Joints of the stones are those of `linear_programme`. Lengths are in mean joint depths, forces in
mean block weights, stresses in both.

References: Sloan, Int. J. Numer. Anal. Meth. Geomech. 12 (1988) 61-77. Makrodimopoulos and Martin,
Int. J. Numer. Anal. Meth. Geomech. 31 (2007) 835-865.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, sin
from typing import Any

import numpy as np
import xarray as xr
from scipy import sparse

from archfem._display import ProgressReport
from archfem._typing import Array, Flags, Numbers
from archfem.errors import DidNotConverge, InvalidInput, logger
from archfem.limit.backfill import (
    SELF_WEIGHT,
    BlocksWithFill,
    hold_backed,
    refuse_missing_fill,
    sum_body_forces,
)
from archfem.limit.cone_programme import Rows, solve_cones
from archfem.limit.fill_mesh import HELD, SURFACE, FillMesh, mesh_fill
from archfem.limit.fill_strength import PlasticFill, as_pressure, place_backing
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.mechanism_kinematics import RigidRegions, find_rigid_regions
from archfem.limit.self_weight import check_options
from archfem.masonry.loads import Action, BodyForce, PointLoad
from archfem.masonry.standing import find_bodies
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure


@dataclass(frozen=True, eq=False)
class Bound:
    """Solution of one of the programmes."""

    factor: float  # infinite where the load is always carried, NaN where there is no equilibrium
    stress: Array  # at the corners of the triangles, σ_x, σ_y, τ (t, 3, 3) [Pa]
    forces: Array  # at the ends of the joints, and shear (3 n_joints,) [mean block weights]
    motion: Array  # velocities of the free stones (3 n_free,) [programme's units]
    # of the equations of the fill, from above the velocities of the nodes that move (m,)
    multipliers: Array


@dataclass(frozen=True, eq=False)
class FilledBlocks:
    """Rigid stones and the fill between them, with the loads on both."""

    blocks: RigidBlocks
    mesh: FillMesh
    fill: PlasticFill
    regions: RigidRegions  # the stones in the whole structure
    live: Array  # generalised forces on the free stones that grow (3 n_free,) [mean block weights]
    pull: Array  # multiple of the fill's weight that grows, along x and y (2,) [-]
    dead: Array  # generalised forces on the free stones that stay (3 n_free,) [mean block weights]
    dead_pull: Array  # multiple of the fill's weight that stays, along x and y (2,) [-]
    friction: Array  # coefficients of the joints, inf where they do not slide (n_joints,) [-]
    strength: float  # compressive strength of the stones, infinite for no limit [Pa]

    @property
    def stress_unit(self) -> float:
        """Unit of stress [Pa]."""
        return self.blocks.force_unit / (self.blocks.length_unit * self.blocks.structure.width)

    @cached_property
    def points(self) -> Array:
        """Corners of the triangles (n, 2) [mean joint depths]."""
        return self.mesh.points / self.blocks.length_unit

    @cached_property
    def weight(self) -> Array:
        """Weight of the fill per area (t,) [programme's units]."""
        blocks = self.mesh.structure.blocks
        unit_weights = np.array([block.material.unit_weight for block in blocks])
        return unit_weights[self.mesh.owner] * self.blocks.length_unit / self.stress_unit

    @property
    def stress_count(self) -> int:
        """Number of unknown stresses."""
        return 9 * len(self.mesh.triangles)

    @cached_property
    def contacts(self) -> tuple[Numbers, Numbers]:
        """Sides of triangles on blocks, and the block of each among the stones (k,)."""
        on_block = self.mesh.touches >= 0
        return self.mesh.boundary[on_block], self.regions.place[self.mesh.touches[on_block]]

    def bound_below(self) -> Bound:
        """Return the largest factor with stresses in equilibrium at every point."""
        equations, limits, stones = Rows(), Rows(), Rows()
        first = self.stress_count
        self._balance_triangles(equations, first + 3 * len(self.friction))
        self._balance_edges(equations)
        sides, owner = self.contacts
        normal, length = self._normals(sides)
        columns = self.stress_at_ends(sides)
        for end in range(2):
            self._limit_traction(limits, columns[:, end], normal)
        # a linear traction acts at the ends by thirds: (2 t_1 + t_2) / 6 and (t_1 + 2 t_2) / 6
        ends = self.points[self.mesh.sides[sides]]
        for at in range(2):
            for of in range(2):
                share = -length * (2.0 if at == of else 1.0) / 6.0
                for axis in range(2):
                    entries, values = _traction(columns[:, of], normal, axis)
                    force = share[:, None] * values
                    self._push_stones(stones, owner, ends[:, at], axis, entries, force)
        return self._solve(equations, limits, stones, first)

    def bound_above(self) -> Bound:
        """Return the largest factor with stresses in equilibrium with all quadratic velocities."""
        equations, limits, stones = Rows(), Rows(), Rows()
        sides, _ = self.contacts
        first = self.stress_count + 6 * len(sides)
        self._balance_velocities(equations, stones, first + 3 * len(self.friction))
        _, length = self._normals(sides)
        adhesion = self._adhesion * length / 3.0
        for point in range(3):
            pressure = self.stress_count + 6 * np.arange(len(sides)) + 2 * point
            limits.add(pressure[:, None], -1.0)
            for sense in (1.0, -1.0):
                both = np.stack([pressure, pressure + 1], axis=1)
                limits.add(both, np.array([-self.fill.contact_friction, sense]), adhesion)
        return self._solve(equations, limits, stones, first)

    @property
    def _adhesion(self) -> float:
        """Cohesion along stones [programme's units]."""
        return self.fill.adhesion * self.fill.cohesion / self.stress_unit

    def _normals(self, sides: Numbers) -> tuple[Array, Array]:
        """Return outward normals and lengths of sides."""
        normal, length = self.mesh.normals(sides)
        return normal, length / self.blocks.length_unit

    def stress_at_ends(self, sides: Numbers) -> Numbers:
        """Return the unknown stresses at both ends of sides (k, 2, 3)."""
        triangle, corner = np.divmod(sides, 3)
        corners = np.stack([corner, (corner + 1) % 3], axis=1)
        return 9 * triangle[:, None, None] + 3 * corners[..., None] + np.arange(3)

    def _balance_triangles(self, equations: Rows, factor: int) -> None:
        """Add the balance of stress and weight within each triangle."""
        gradient = self.mesh.gradients * self.blocks.length_unit
        start = 9 * np.arange(len(gradient))[:, None] + 3 * np.arange(3)
        loads = np.full((len(gradient), 1), factor)
        for axis, pair in enumerate(((0, 2), (2, 1))):
            columns = np.concatenate([start + pair[0], start + pair[1], loads], axis=1)
            pull = (self.weight * self.pull[axis])[:, None]
            values = np.concatenate([gradient[..., 0], gradient[..., 1], pull], axis=1)
            equations.add(columns, values, -self.weight * self.dead_pull[axis])

    def _balance_edges(self, equations: Rows) -> None:
        """Add equal tractions on both sides of edges, and none on the surface."""
        here, there = self.mesh.pairs.T
        normal, _ = self._normals(here)
        first, second = self.stress_at_ends(here), self.stress_at_ends(there)[:, ::-1]
        bare = self.mesh.boundary[self.mesh.touches == SURFACE]
        outward, _ = self._normals(bare)
        free = self.stress_at_ends(bare)
        for end in range(2):
            for axis in range(2):
                columns, values = _traction(first[:, end], normal, axis)
                others, opposite = _traction(second[:, end], -normal, axis)
                both = np.concatenate([columns, others], axis=1)
                equations.add(both, np.concatenate([values, opposite], axis=1))
                equations.add(*_traction(free[:, end], outward, axis))

    def _limit_traction(self, limits: Rows, columns: Numbers, normal: Array) -> None:
        """Add the limits of the traction of the fill on a block at places (k, 3)."""
        across, along = contact_components(normal)
        limits.add(columns, across)
        for sense in (1.0, -1.0):
            limits.add(columns, sense * along + self.fill.contact_friction * across, self._adhesion)

    def _push_stones(
        self,
        stones: Rows,
        owner: Numbers,
        points: Array,
        axis: int,
        columns: Numbers,
        values: Array,
    ) -> None:
        """Add forces along an axis at points of stones to the sums of forces on these."""
        structure = self.blocks.structure
        free = structure.first_coordinates[owner]
        moves = free >= 0
        arm = points - structure.centroids[owner] / self.blocks.length_unit
        lever = -arm[:, 1] if axis == 0 else arm[:, 0]
        for offset, factor in ((axis, np.ones(len(arm))), (2, lever)):
            row = np.repeat((free + offset)[moves], columns.shape[1])
            stones.put(row, columns[moves].ravel(), (factor[:, None] * values)[moves].ravel())

    def _balance_velocities(self, equations: Rows, stones: Rows, factor: int) -> None:
        """Add the power balance of each quadratic velocity, of corners and middles of sides."""
        edge_points, edge = self.mesh.edges
        middles = len(self.points) + edge.reshape(-1, 3)
        unit = 3.0 * self.blocks.length_unit**2
        area, load = self.mesh.areas / unit, self.weight * self.mesh.areas / unit
        right = np.zeros((len(self.points) + len(edge_points), 2))
        entries = Rows()
        start = 9 * np.arange(len(middles))
        for corner, node, slope in self._shape_gradients():
            for axis, pair in enumerate(((0, 2), (2, 1))):
                for direction, component in enumerate(pair):
                    stress = start + 3 * corner + component
                    entries.put(2 * node + axis, stress, area * slope[:, direction])
        # the weight acts on the middles alone: the shapes of corners have no mean
        for middle in middles.T:
            for axis in range(2):
                np.add.at(right, (middle, axis), load * self.dead_pull[axis])
                columns = np.full(len(middle), factor)
                entries.put(2 * middle + axis, columns, -load * self.pull[axis])
        self._add_contacts(entries, stones)
        # nodes of held ends have no velocity
        kept = self._moving
        number = np.cumsum(kept) - 1
        rows, columns, values = map(np.concatenate, (entries.row, entries.column, entries.value))
        inside = kept[rows]
        equations.put(number[rows[inside]], columns[inside], values[inside])
        equations.right.append(right.ravel()[kept])

    def _shape_gradients(self) -> Iterator[tuple[int, Numbers, Array]]:
        """Yield a corner, the node of each triangle, and the gradient there of its shape (t, 2)."""
        gradient = self.mesh.gradients * self.blocks.length_unit
        middles = len(self.points) + self.mesh.edges[1].reshape(-1, 3)
        for a in range(3):
            b = (a + 1) % 3
            for corner in range(3):
                yield (
                    corner,
                    self.mesh.triangles[:, a],
                    (4.0 * (corner == a) - 1.0) * gradient[:, a],
                )
            yield a, middles[:, a], 4.0 * gradient[:, b]
            yield b, middles[:, a], 4.0 * gradient[:, a]

    def _add_contacts(self, entries: Rows, stones: Rows) -> None:
        """Add forces of blocks on the fill, by the Bernstein coefficients of the jump."""
        sides, owner = self.contacts
        normal, _ = self._normals(sides)
        start, end = self.mesh.sides[sides].T
        nodes = np.stack([start, len(self.points) + self.mesh.edges[1][sides], end])
        ends = self.points[start], self.points[end]
        places = ends[0], 0.5 * (ends[0] + ends[1]), ends[1]
        # coefficients of the jump: those at the ends, and 2 v_middle - (v_start + v_end) / 2
        shares = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        for point in range(3):
            pressure = self.stress_count + 6 * np.arange(len(sides)) + 2 * point
            for unknown, direction in ((pressure, -normal), (pressure + 1, along)):
                for axis in range(2):
                    for node, share in zip(nodes, shares[point], strict=True):
                        entries.put(2 * node + axis, unknown, -share * direction[:, axis])
                    back = -direction[:, axis, None]
                    self._push_stones(stones, owner, places[point], axis, unknown[:, None], back)

    @cached_property
    def _moving(self) -> Flags:
        """Whether each component of the nodes' velocities is free: not where ends are held."""
        held = self.mesh.boundary[self.mesh.touches == HELD]
        edge_points, edge = self.mesh.edges
        moves = np.ones(len(self.points) + len(edge_points), dtype=bool)
        moves[self.mesh.sides[held].ravel()] = False
        moves[len(self.points) + edge[held]] = False
        return np.repeat(moves, 2)

    def velocities(self, above: Bound) -> Array:
        """Return velocities of corners and middles of edges, of the bound from above (n + e, 2)."""
        found = np.zeros(len(self._moving))
        found[self._moving] = above.multipliers
        return found.reshape(-1, 2)

    def strain_rates(self, above: Bound) -> Array:
        """Return gradients of the velocities of the bound from above, by corner (t, 3, 2, 2)."""
        velocity = self.velocities(above)
        rates = np.zeros((len(self.mesh.triangles), 3, 2, 2))
        for corner, node, slope in self._shape_gradients():
            rates[:, corner] += velocity[node][:, :, None] * slope[:, None, :]
        return rates

    def _solve(self, equations: Rows, limits: Rows, stones: Rows, first: int) -> Bound:
        """Add balance and limits of the stones, and solve the programme."""
        blocks, count = self.blocks, len(self.friction)
        factor, weight = first + 3 * count, self.dead
        size = factor + 1
        parts = sparse.csr_matrix((len(weight), first)), blocks.balance, -self.live[:, None]
        balance = sparse.hstack(parts, format="csr") - stones.matrix(size, len(weight))
        self._limit_joints(limits, first)
        matrices = [equations.matrix(size), balance, limits.matrix(size)]
        rights = [equations.bounds, weight, limits.bounds]
        cones = [("zero", equations.count + len(weight)), ("positive", limits.count)]
        for matrix, right in (*self._strength_cones(size), *self._crushing_cones(first, size)):
            matrices.append(matrix)
            rights.append(right)
            cones += [("second order", 3)] * (len(right) // 3)
        cost = np.zeros(size)
        cost[factor] = -1.0
        solution = solve_cones(
            cost, sparse.vstack(matrices, format="csc"), np.concatenate(rights), cones
        )
        if solution is None:
            raise DidNotConverge(
                "the second-order cone programme of the fill did not converge: give a coarser gap, "
                "or look whether stones, fill and loads have sensible sizes"
            )
        status, x, multipliers = solution
        value = {"solved": x[factor], "infeasible": np.nan, "unbounded": np.inf}[status]
        # velocities are the multipliers of the balance, with a power of the live load of 1
        fill, motion = np.split(-multipliers[: equations.count + len(weight)], [equations.count])
        stress = x[: self.stress_count].reshape(-1, 3, 3) * self.stress_unit
        return Bound(float(value), stress, x[first:factor], motion, fill)

    def _limit_joints(self, limits: Rows, first: int) -> None:
        """Add compression and friction of the joints."""
        count = len(self.friction)
        ends = first + np.arange(2 * count)
        limits.add(ends[:, None], -1.0, self.blocks.bond[: 2 * count])
        slides = np.flatnonzero(np.isfinite(self.friction))
        columns = first + slides[:, None] + count * np.array([2, 0, 1])
        friction = self.friction[slides]
        for sense in (1.0, -1.0):
            values = np.stack([np.full(len(slides), sense), -friction, -friction], axis=1)
            limits.add(columns, values, self.blocks.cohesion[slides])

    def _strength_cones(self, size: int) -> list[tuple[sparse.csr_matrix, Array]]:
        """Return the strength of the fill at every corner, and that it bears no tension."""
        angle, cohesion = self.fill.angle, self.fill.cohesion / self.stress_unit
        cones = [(sin(angle), 2.0 * cohesion * cos(angle))]
        if cohesion > 0.0 or angle == 0.0:
            cones.append((1.0, 0.0))
        start = 3 * np.arange(3 * len(self.mesh.triangles))
        found = []
        for slope, constant in cones:
            rows = Rows()
            rows.add(start[:, None] + [0, 1], np.array([slope, slope]), constant)
            rows.add(start[:, None] + [0, 1], np.array([-1.0, 1.0]))
            rows.add(start[:, None] + [2], -2.0)
            found.append(rows.cones(size))
        return found

    def _crushing_cones(self, first: int, size: int) -> list[tuple[sparse.csr_matrix, Array]]:
        """Return N² <= 2 σ w h F at both ends of the joints, by which stones crush."""
        if np.isinf(self.strength):
            return []
        count, tension = len(self.friction), self.blocks.tension
        crushing = 2.0 * self.blocks.crushing_forces(self.strength)
        found = []
        for end in range(2):
            rows, own = Rows(), first + np.arange(count)
            # a + F >= |(a - F, 2 N)|, with F and N counted from the tension of bonds on
            rows.add((own + end * count)[:, None], -1.0, crushing + 0.5 * tension)
            rows.add((own + end * count)[:, None], 1.0, crushing - 0.5 * tension)
            rows.add(np.stack([own, own + count], axis=1), -2.0, 2.0 * tension)
            found.append(rows.cones(size))
        return found


def contact_components(normal: Array) -> tuple[Array, Array]:
    """Return coefficients of σ_x, σ_y, τ in the stress across and along faces (k, 3) each."""
    (x, y), product = normal.T, normal[:, 0] * normal[:, 1]
    across = np.stack([x * x, y * y, 2.0 * product], axis=1)
    return across, np.stack([-product, product, x * x - y * y], axis=1)


def _traction(columns: Numbers, normal: Array, axis: int) -> tuple[Numbers, Array]:
    """Return unknowns and coefficients of a traction along an axis, of stresses (k, 3)."""
    pair = [0, 2] if axis == 0 else [2, 1]
    return columns[:, pair], normal


@dataclass(frozen=True, eq=False)
class FillBounds:
    """Bounds from below and above on one mesh."""

    filled: FilledBlocks
    below: Bound
    above: Bound

    @property
    def lower(self) -> float:
        """Factor from below [-]."""
        return self.below.factor

    @property
    def gap(self) -> float:
        """Distance of the bounds over the upper one [-]."""
        if self.below.factor == self.above.factor:
            return 0.0
        return (self.above.factor - self.below.factor) / abs(self.above.factor)

    def widest(self) -> Flags:
        """Return triangles that make half of the gap, as far as it is within triangles (t,)."""
        # The gap is the power of the difference of both states of stress on the velocities from
        # above, a sum of terms >= 0 (Ciria, Peraire and Bonet, Int. J. Numer. Meth. Eng. 75 (2008)
        # 1740-1772): within triangles, along stones, and in joints. Along stones meshes are refined
        # with the triangles beside.
        difference = self.above.stress - self.below.stress
        rates = self.filled.strain_rates(self.above)
        rates = np.stack([rates[..., 0, 0], rates[..., 1, 1], rates[..., 0, 1] + rates[..., 1, 0]])
        power = self.filled.mesh.areas * np.einsum("tck,ktc->t", difference, rates)
        order = np.argsort(-power)
        total = np.cumsum(power[order])
        chosen = np.zeros(len(order), dtype=bool)
        chosen[order[: np.searchsorted(total, 0.5 * total[-1]) + 1]] = True
        return chosen

    @property
    def contact_stress(self) -> xr.Dataset:
        """Stress between fill and stones, of the bound from below, over contact and end."""
        filled = self.filled
        sides, owner = filled.contacts
        stress, (normal, _) = self.below.stress.reshape(-1, 3), filled.mesh.normals(sides)
        ends = stress[filled.stress_at_ends(sides)[..., 0] // 3]
        across, along = (np.einsum("kej,kj->ke", ends, each) for each in contact_components(normal))
        points = filled.mesh.points[filled.mesh.sides[sides]]
        both, pascals = ("contact", "end"), {"units": "Pa"}
        return xr.Dataset(
            {"pressure": (both, -across, pascals), "shear": (both, along, pascals)},
            {
                "block": ("contact", np.array(filled.regions.blocks)[owner]),
                "x": (both, points[..., 0], {"units": "m"}),
                "y": (both, points[..., 1], {"units": "m"}),
            },
        )

    @property
    def fill_motion(self) -> xr.Dataset:
        """Velocities of the fill's triangles and their strain rates, of the bound from above."""
        mesh = self.filled.mesh
        velocity = self.filled.velocities(self.above)[: len(mesh.points)]
        rates = self.filled.strain_rates(self.above)
        sizes = np.linalg.norm(rates + np.swapaxes(rates, 2, 3), axis=(2, 3))
        strain = sizes.max(axis=1)
        return xr.Dataset(
            {
                "velocity": (("point", "axis"), velocity),
                "strain": ("triangle", strain / max(float(strain.max()), 1e-300)),
            },
            {
                "x": ("point", mesh.points[:, 0], {"units": "m"}),
                "y": ("point", mesh.points[:, 1], {"units": "m"}),
                "corners": (("triangle", "corner"), mesh.triangles),
            },
        )


def refine_bounds(
    structure: Structure,
    live: Sequence[Action],
    friction: str | None,
    strength: float | None,
    fill: PlasticFill,
    dead: Sequence[Action] = (),
    first: int = 250,
    most: int = 5000,
) -> Iterator[FillBounds]:
    """Yield bounds of the factor of live actions, on finer and finer meshes until they are near.

    Each mesh contains the stresses of the ones before, so that bounds from below never decrease.

    Args:
        structure: structure with its fill.
        live: actions that grow together.
        friction: friction of the joints, "coulomb" or None.
        strength: as for `collapse_factor` [Pa].
        fill: strength of the fill.
        dead: actions beside self-weight that do not grow.
        first: number of triangles of the first mesh, about.
        most: number of triangles beyond which no mesh is made.

    Raises:
        InvalidInput: there is no fill, or the friction has no associated flow.
        DidNotConverge: whether it stands without live actions is not known on the finest mesh.
    """
    strength = check_options(structure, friction, strength)
    structure = hold_backed(structure, place_backing(fill, structure).backing)
    regions = find_rigid_regions(structure)
    soil = tuple(number for number in structure.free if number not in regions.blocks)
    _check_bounded(structure, soil, friction)
    area = sum(structure.blocks[number].area for number in soil)
    # equilateral triangles of side s have the area √3 s² / 4
    size = float(np.sqrt(4.0 / np.sqrt(3.0) * area / first))
    mesh = mesh_fill(structure, soil, size, fill.holds_ends)
    stones = BlocksWithFill(structure, as_pressure(fill), regions)  # for the fan of loads
    blocks = RigidBlocks(regions.structure)

    def forces(actions: Sequence[Action]) -> tuple[Array, Array]:
        pulls = [action for action in actions if isinstance(action, BodyForce)]
        points = [action for action in actions if isinstance(action, PointLoad)]
        load = blocks.dimensionless(blocks.load(pulls) + stones.load(points))
        return load, np.array(sum_body_forces(pulls))

    rough = np.full(len(regions.structure.joints), np.inf)
    coefficients = rough if friction is None else regions.structure.friction
    loads = *forces(live), *forces([SELF_WEIGHT, *dead])
    filled = FilledBlocks(blocks, mesh, fill, regions, *loads, coefficients, strength)
    best = None
    while best is None or len(best.filled.mesh.triangles) <= most:
        try:
            best = FillBounds(filled, filled.bound_below(), filled.bound_above())
        except DidNotConverge:
            if best is None:
                raise
            break
        yield best
        # no equilibrium with all velocities of this mesh is none with those of a finer one
        if best.gap <= fill.gap or np.isnan(best.above.factor):
            return
        filled = replace(filled, mesh=filled.mesh.refined(best.widest()))
    _doubt_bounds(best, fill.gap)


def _check_bounded(structure: Structure, soil: Sequence[int], friction: str | None) -> None:
    """Refuse structures without fill, bodies on it, and friction without dilatancy."""
    refuse_missing_fill({*soil} & {*find_yielding_blocks(structure)})
    if bodies := set(find_bodies(structure)) & {structure.blocks[number].name for number in soil}:
        raise InvalidInput(
            f"{sorted(bodies)} on a plastic fill would be a part of it: give the fill by law "
            "'pressure', or weight without mass as a load that stays"
        )
    if friction == "nonassociated":
        raise InvalidInput(
            "friction = 'nonassociated' and a plastic fill: bounds need associated flow in both; "
            "take friction='coulomb'"
        )


def _doubt_bounds(best: FillBounds, gap: float) -> None:
    """Warn of bounds that are far apart on the finest mesh; refuse where there is no lower one."""
    count = len(best.filled.mesh.triangles)
    if np.isnan(best.below.factor):
        raise DidNotConverge(
            f"whether it stands under its own weight is not known: on the finest mesh, of "
            f"{count} triangles, no equilibrium was found and none is "
            "excluded; give the fill some cohesion, or gap = 0.1 and look at the structure"
        )
    logger.warning(
        "bounds %.4g and %.4g are further apart than the gap of %.2g: both hold, and finer meshes "
        "than %d triangles are not solved",
        *(best.below.factor, best.above.factor, gap, count),
    )


def bound_least_factor(searches: Mapping[Any, Iterator[FillBounds]]) -> dict[Any, FillBounds]:
    """Return bounds of several loads, of which the one of the least factor is as near as required.

    Bounds from below grow on finer meshes. A load whose bound exceeds the least one is therefore
    not the worst, and keeps its coarse mesh. Ctrl-C leaves the bounds that were found, once all
    loads have some.
    """
    found: dict[Any, FillBounds] = {}
    lower = np.nan
    with ProgressReport("plastic fill", len(searches)) as progress:
        try:
            for load, search in searches.items():
                found[load] = next(search)
                progress.show(f"place {len(found)} of {len(searches)}", 1)
            while True:
                # without equilibrium on its mesh, NaN, a load comes first
                least = min(found, key=lambda load: np.nan_to_num(found[load].lower, nan=-1.0))
                bounds = found[least]
                lower, upper = bounds.lower, bounds.above.factor
                count = len(bounds.filled.mesh.triangles)
                progress.show(f"least factor {lower:.4g} to {upper:.4g}, {count} triangles")
                if (finer := next(searches[least], None)) is None:
                    return found
                found[least] = finer
        except KeyboardInterrupt:
            if np.isnan(lower):
                raise
            logger.warning(
                "interrupted: the factor %.4g is the least of bounds from below that all hold; "
                "finer meshes would raise it, at most to %.4g",
                *(lower, min(each.above.factor for each in found.values())),
            )
            return found
