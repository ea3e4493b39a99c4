"""Quadrature points on joint facets in weak forms: values set there, and values read there.

UFL integrates functions and has no point values. Quadrature elements, the idiom of DOLFINx for the
history of a material, have the points of cells, not of facets between cells; nor does
`fem.Expression` take both sides of a facet. A value at each point of a facet is therefore a
function that is constant around the point. A quadrature rule with the same points integrates it
exactly. The values of a facet are stored in the cells at its sides. Where a cell has several facets
on joints, each has a colour of its own. Integrals against such functions give values at the points.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from archfem._typing import Array, Numbers
from archfem.joints.quadrature import Quadrature
from archfem.masonry.materials import Contact
from archfem.models.fem import _fenicsx
from archfem.models.fem.space import BrokenSpace
from archfem.models.linear_blocks import joint_orientation

# Values that describe a facet before those of its points: x and y of its beginning, direction over
# length (x, y), and the sign of its tangent
FACET_VALUE_COUNT = 5


@dataclass(frozen=True)
class Patch:
    """The facets of one contact and one colour, none of which share a cell."""

    contact: Contact
    colour: int
    measure: Any  # UFL measure over them with the quadrature rule


@dataclass(frozen=True, eq=False)
class PointReader:
    """A compiled form that evaluates n expressions at the k points of all facets."""

    form: Any  # linear, on functions constant in each cell
    places: Numbers  # entries of the assembled vector, for each facet and side (f, 2, n k)


@dataclass(frozen=True, eq=False)
class JointFacets:
    """The facets on all joints, in the order of their joints, along each of them."""

    space: BrokenSpace  # of the displacements
    rule: Quadrature  # quadrature on each facet, of k points

    @property
    def size(self) -> int:
        """Number k of points on a facet."""
        return self.rule.count(self.space.degree)

    @property
    def joint(self) -> Numbers:
        """Number of each facet's joint (f,)."""
        return self.space.facets.joint

    @property
    def _ends(self) -> Array:
        """Offsets of both ends of each facet from the joint's mid-depth (f, 2) [m]."""
        return self.space.facets.offsets[:, [0, -1]]

    @cached_property
    def colours(self) -> Numbers:
        """Colours of the facets, such that no cell has two of one colour (f,)."""
        # greedy colouring, facet by facet
        taken: dict[int, set[int]] = {}
        colours = []
        for cells in self.space.facets.cells:
            used = set().union(*(taken.setdefault(cell, set()) for cell in cells))
            colours.append(next(c for c in range(len(used) + 1) if c not in used))
            for cell in cells:
                taken[cell].add(colours[-1])
        return np.array(colours)

    @property
    def _colour_count(self) -> int:
        """Number of colours."""
        return int(self.colours.max()) + 1

    @cached_property
    def offsets(self) -> Array:
        """Offset of each facet's points from the joint's mid-depth (f, k) [m]."""
        first, last = self._ends.T[..., None]
        return first + (last - first) * self.rule.on_facet(self.space.degree)[0]

    @cached_property
    def _lengths(self) -> Array:
        """Quadrature weights of each facet's points (f, k) [m]."""
        return np.diff(self._ends, axis=1) * self.rule.on_facet(self.space.degree)[1]

    @cached_property
    def points(self) -> Numbers:
        """Numbers of each facet's points among all joint points of a `JointOperator` (f, k)."""
        # a point that neighbouring facets share has one number
        numbers, count = np.empty(self.offsets.shape, dtype=np.intp), 0
        for joint in range(len(self.space.mesh.structure.joints)):
            facets = self.joint == joint
            ends = self._ends[facets]
            along = self.rule.on_joint(np.append(ends[:, 0], ends[-1, 1]), self.space.degree)[0]
            distance = np.abs(self.offsets[facets][..., None] - along)
            numbers[facets] = count + distance.argmin(axis=-1)
            count += len(along)
        return numbers

    @property
    def count(self) -> int:
        """Number p of joint points."""
        return int(self.points.max()) + 1

    @cached_property
    def patches(self) -> list[Patch]:
        """The facets, by contact and colour."""
        grid, joints = self.space.mesh.grid, self.space.mesh.structure.joints
        contacts = list(dict.fromkeys(joint.contact for joint in joints))
        of_joint = np.array([contacts.index(joint.contact) for joint in joints])
        count = self._colour_count
        numbers = of_joint[self.joint] * count + self.colours
        tags = _fenicsx.tag_entities(grid, 1, self.space.facets.numbers, numbers)
        # FFCx's name of the rule, and the degree of the polynomials it integrates exactly
        name, loss = ("default", 1) if self.rule.rule == "gauss" else ("GLL", 3)
        metadata = {"quadrature_rule": name, "quadrature_degree": 2 * self.size - loss}
        dS = ufl.Measure("dS", domain=grid, subdomain_data=tags, metadata=metadata)
        return [Patch(contacts[k // count], k % count, dS(k)) for k in np.unique(numbers).tolist()]

    def _cellwise_space(self, size: int) -> tuple[Any, Numbers]:
        """Space of cellwise constants, `size` for each colour; entries of facets (f, 2, size)."""
        functions = _fenicsx.vector_space(self.space.mesh.grid, "DG", 0, size * self._colour_count)
        nodes = _fenicsx.cell_dofs(functions)[self.space.facets.cells, 0]
        number = nodes.astype(np.intp) * self._colour_count + self.colours[:, None]
        return functions, size * number[..., None] + np.arange(size)

    @cached_property
    def _values(self) -> tuple[Any, Numbers]:
        """Function with geometry and point values of each facet; entries of the point values."""
        functions, entries = self._cellwise_space(FACET_VALUE_COUNT + self.size)
        structure = self.space.mesh.structure
        start, length = self._ends[:, :1], np.diff(self._ends, axis=1)
        along = structure.tangents[self.joint]
        begin = structure.middles[self.joint] + start * along
        signs = joint_orientation(structure)[self.joint]
        place = np.hstack([begin, along / length, signs[:, None]])
        function = fem.Function(functions)
        function.x.array[entries[..., :FACET_VALUE_COUNT]] = place[:, None]
        return function, entries[..., FACET_VALUE_COUNT:]

    def set_point_values(self, values: Array) -> None:
        """Set the values at all joint points (p,), which forms read through `point_values`."""
        function, entries = self._values
        function.x.array[entries] = values[self.points][:, None]

    def _facet_values(self, colour: int) -> list[Any]:
        """Return the values of a facet of a colour, UFL expressions."""
        size = FACET_VALUE_COUNT + self.size
        return [self._values[0]("+")[colour * size + k] for k in range(size)]

    def tangent_sign(self, colour: int) -> Any:
        """Return 1 where the normal, rotated to the left, points to the extrados, else -1."""
        return self._facet_values(colour)[FACET_VALUE_COUNT - 1]

    def point_values(self, colour: int) -> Any:
        """Return the values set at the points, a UFL expression."""
        values = self._facet_values(colour)[FACET_VALUE_COUNT:]
        pairs = zip(values, self._indicators(colour), strict=True)
        return sum(value * indicator for value, indicator in pairs)

    def _indicators(self, colour: int) -> list[Any]:
        """Return a UFL expression for each point of a facet, one around it and zero elsewhere."""
        x = ufl.SpatialCoordinate(self.space.mesh.grid)("+")
        x0, y0, dx, dy = self._facet_values(colour)[:4]
        place = (x[0] - x0) * dx + (x[1] - y0) * dy  # 0 to 1 along the facet
        points = self.rule.on_facet(self.space.degree)[0]
        middles = 0.5 * (points[1:] + points[:-1])
        beyond = [ufl.conditional(ufl.gt(place, float(m)), 1.0, 0.0) for m in middles]
        ends = zip([1.0, *beyond], [*beyond, 0.0], strict=True)
        return [before - after for before, after in ends]

    def point_reader(self, values: list[tuple[Patch, list[Any]]]) -> PointReader:
        """Compile the form that evaluates expressions at the points of all facets."""
        size = len(values[0][1]) * self.size
        functions, places = self._cellwise_space(size)
        test = ufl.TestFunction(functions)("+")
        terms = []
        for patch, expressions in values:
            indicators = self._indicators(patch.colour)
            products = [value * indicator for value in expressions for indicator in indicators]
            of_colour = [test[patch.colour * size + k] for k in range(size)]
            pairs = zip(products, of_colour, strict=True)
            terms.append(sum(value * each for value, each in pairs) * patch.measure)
        return PointReader(fem.form(sum(terms)), places)

    def read(self, reader: PointReader) -> Array:
        """Return values at the points of each facet (n, f, k)."""
        sides = _fenicsx.assemble_vector(reader.form)[reader.places]
        sums = sides.sum(axis=1)  # "+" is one of the sides; the other has zeros
        return sums.reshape(len(sums), -1, self.size).swapaxes(0, 1) / self._lengths

    def gather(self, values: Array) -> Array:
        """Return values at all joint points from those of each facet (p,)."""
        gathered = np.empty(self.count)
        gathered[self.points] = values
        return gathered

    def resultants(self, normal: Array, shear: Array) -> Array:
        """Return N, V, M of every joint from tractions (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r
        """
        structure = self.space.mesh.structure
        resultants = np.zeros((len(structure.joints), 3))
        density = structure.width * np.stack([-normal, shear, -normal * self.offsets], axis=-1)
        np.add.at(resultants, self.joint, np.sum(density * self._lengths[..., None], axis=1))
        return resultants
