"""Points on joint facets in weak forms: what they carry into integrals, and what is read there.

Forms know functions, not points. Here a number at each point of a facet is a function that is
constant around the point, which a quadrature rule with the same points sees as it is: facets carry
their numbers in the cells at their sides, in a colour of their own where a cell has several facets
on joints. Read the other way, the integral against such functions gives the values at points.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.joints.quadrature import Quadrature
from archfem.masonry.materials import Contact
from archfem.models.fem import _fenicsx
from archfem.models.fem.space import BrokenSpace

Numbers = NDArray[np.intp]

PLACE = 5
"""Numbers that place a facet: its beginning, direction over length, and sense of slips."""


@dataclass(frozen=True)
class Patch:
    """The facets of one contact and one colour, none of which share a cell.

    Attributes:
        contact: how their faces touch.
        colour: number of the set of facets.
        measure: integrates over them by the rule.
    """

    contact: Contact
    colour: int
    measure: Any


@dataclass(frozen=True, eq=False)
class Reading:
    """A compiled form that reads values at the points of all facets.

    Attributes:
        form: linear, on functions constant in each cell.
        places: of the n values at each facet's points, on either side, in what is assembled
            (f, 2, n k).
    """

    form: Any
    places: Numbers


@dataclass(frozen=True, eq=False)
class JointFacets:
    """The facets on all joints, in the order of their joints, along each of them.

    Attributes:
        space: of the displacements.
        rule: quadrature on each facet, of k points.
    """

    space: BrokenSpace
    rule: Quadrature

    @property
    def size(self) -> int:
        """Number k of points on a facet."""
        return self.rule.count(self.space.degree)

    @cached_property
    def _found(self) -> tuple[Numbers, Numbers, Array]:
        """Facets (f,), numbers of their joints (f,), and arms of their ends (f, 2) [m]."""
        facets, joint = self.space.mesh.joints
        arms = np.array([self._arms(*each) for each in zip(facets, joint, strict=True)])
        order = np.lexsort((arms[:, 0], joint))
        return facets[order], joint[order].astype(np.intp), arms[order]

    def _arms(self, facet: int, number: int) -> Array:
        """From where to where along its joint a facet goes (2,) [m]."""
        grid, joint = self.space.mesh.grid, self.space.mesh.structure.joints[number]
        cell = _fenicsx.connect(grid, 1, 2)(facet)[0]
        position = int(np.flatnonzero(_fenicsx.connect(grid, 2, 1)(cell) == facet)[0])
        nodes = self.space.cells[cell][_fenicsx.facet_nodes(self.space.functions)[position]]
        arms = (self.space.places[nodes] - joint.middle) @ joint.tangent
        return np.array([arms.min(), arms.max()])

    @property
    def numbers(self) -> Numbers:
        """Numbers of the facets in the mesh (f,)."""
        return self._found[0]

    @property
    def joint(self) -> Numbers:
        """Number of each facet's joint (f,)."""
        return self._found[1]

    @cached_property
    def _cells(self) -> Numbers:
        """Cells at each facet (f, 2)."""
        cells_at = _fenicsx.connect(self.space.mesh.grid, 1, 2)
        return np.array([cells_at(facet) for facet in self.numbers])

    @cached_property
    def colours(self) -> Numbers:
        """Colours of the facets, such that no cell has two of one colour (f,)."""
        taken: dict[int, set[int]] = {}
        found = []
        for cells in self._cells:
            used = set().union(*(taken.setdefault(cell, set()) for cell in cells))
            found.append(next(c for c in range(len(used) + 1) if c not in used))
            for cell in cells:
                taken[cell].add(found[-1])
        return np.array(found)

    @property
    def _colour_count(self) -> int:
        """Number of colours."""
        return int(self.colours.max()) + 1

    @cached_property
    def arms(self) -> Array:
        """Distance of each facet's points from the middle of its joint (f, k) [m]."""
        first, last = self._found[2].T[..., None]
        found: Array = first + (last - first) * self.rule.on_facet(self.space.degree)[0]
        return found

    @cached_property
    def _lengths(self) -> Array:
        """Length that each facet's points stand for (f, k) [m]."""
        length: Array = np.diff(self._found[2], axis=1)
        return length * self.rule.on_facet(self.space.degree)[1]

    @cached_property
    def points(self) -> Numbers:
        """Number among all joint points of each facet's points (f, k).

        They are numbered as those of a `JointOperator`: where neighbouring facets share a point,
        it has one number.
        """
        found, count = np.empty(self.arms.shape, dtype=np.intp), 0
        for number in range(len(self.space.mesh.structure.joints)):
            own = self.joint == number
            ends = self._found[2][own]
            along = self.rule.on_joint(np.append(ends[:, 0], ends[-1, 1]), self.space.degree)[0]
            off = np.abs(self.arms[own][..., None] - along)
            found[own] = count + off.argmin(axis=-1)
            count += len(along)
        return found

    @property
    def count(self) -> int:
        """Number p of joint points."""
        return int(self.points.max()) + 1

    @property
    def _senses(self) -> Array:
        """Whether the normal, turned left, shows each facet the way to the extrados (f,); ±1."""
        structure = self.space.mesh.structure
        x, y = structure.normals.T
        found: Array = np.sign(np.sum(np.stack([-y, x], 1) * structure.tangents, 1))[self.joint]
        return found

    @cached_property
    def patches(self) -> list[Patch]:
        """The facets, by contact and colour."""
        grid, joints = self.space.mesh.grid, self.space.mesh.structure.joints
        contacts = list(dict.fromkeys(joint.contact for joint in joints))
        of_joint = np.array([contacts.index(joint.contact) for joint in joints])
        count = self._colour_count
        numbers = of_joint[self.joint] * count + self.colours
        tags = _fenicsx.tags(grid, 1, self.numbers, numbers)
        dS = _fenicsx.jump_measure(grid, tags, *self._scheme)
        return [Patch(contacts[k // count], k % count, dS(k)) for k in np.unique(numbers).tolist()]

    @property
    def _scheme(self) -> tuple[str, int]:
        """Quadrature along joints as FFCx knows it, by the degree it integrates exactly."""
        if self.rule.rule == "gauss":
            return "default", 2 * self.size - 1
        return "GLL", 2 * self.size - 3

    def _blank(self, size: int) -> tuple[Any, Numbers]:
        """Functions constant in each cell, of so many numbers a colour; places (f, 2, size)."""
        functions = _fenicsx.space(self.space.mesh.grid, "DG", 0, size * self._colour_count)
        nodes = _fenicsx.cell_dofs(functions)[self._cells, 0]
        number = nodes.astype(np.intp) * self._colour_count + self.colours[:, None]
        return functions, size * number[..., None] + np.arange(size)

    @cached_property
    def _carried(self) -> tuple[Any, Numbers]:
        """A function with the place of each facet and a number for each of its points."""
        functions, where = self._blank(PLACE + self.size)
        structure = self.space.mesh.structure
        start, length = self._found[2][:, :1], np.diff(self._found[2], axis=1)
        along = structure.tangents[self.joint]
        begin = structure.middles[self.joint] + start * along
        place = np.hstack([begin, along / length, self._senses[:, None]])
        function = fem.Function(functions)
        function.x.array[where[..., :PLACE]] = place[:, None]
        return function, where[..., PLACE:]

    def carry(self, values: Array) -> None:
        """Give the points numbers that `carried` has in forms, such as how far they have slid.

        Args:
            values: of all joint points (p,).
        """
        function, where = self._carried
        function.x.array[where] = values[self.points][:, None]

    def _own(self, colour: int) -> list[Any]:
        """Numbers that a facet of a colour carries, UFL expressions."""
        size = PLACE + self.size
        return [self._carried[0]("+")[colour * size + k] for k in range(size)]

    def sense(self, colour: int) -> Any:
        """Return 1 where the normal, turned left, shows the way to the extrados, else -1.

        Args:
            colour: of the facets.
        """
        return self._own(colour)[PLACE - 1]

    def carried(self, colour: int) -> Any:
        """Return what the points carry, a UFL expression.

        Args:
            colour: of the facets.
        """
        values = self._own(colour)[PLACE:]
        return sum(value * mark for value, mark in zip(values, self._marks(colour), strict=True))

    def _marks(self, colour: int) -> list[Any]:
        """For each point of a facet, a UFL expression that is one around it, else zero."""
        x = ufl.SpatialCoordinate(self.space.mesh.grid)("+")
        own = self._own(colour)
        place = (x[0] - own[0]) * own[2] + (x[1] - own[1]) * own[3]
        points = self.rule.on_facet(self.space.degree)[0]
        middles = 0.5 * (points[1:] + points[:-1])
        beyond = [ufl.conditional(ufl.gt(place, float(m)), 1.0, 0.0) for m in middles]
        ends = zip([1.0, *beyond], [*beyond, 0.0], strict=True)
        return [before - after for before, after in ends]

    def reading(self, values: list[tuple[Patch, list[Any]]]) -> Reading:
        """Compile what reads values at the points of all facets.

        Args:
            values: for each patch, n UFL expressions.

        Returns:
            What `read` takes.
        """
        size = len(values[0][1]) * self.size
        functions, places = self._blank(size)
        test = ufl.TestFunction(functions)("+")
        terms = []
        for patch, expressions in values:
            marks = self._marks(patch.colour)
            products = [value * mark for value in expressions for mark in marks]
            own = [test[patch.colour * size + k] for k in range(size)]
            here = sum(value * each for value, each in zip(products, own, strict=True))
            terms.append(here * patch.measure)
        return Reading(fem.form(sum(terms[1:], terms[0])), places)

    def read(self, reading: Reading) -> Array:
        """Return values at the points of each facet (n, f, k).

        Args:
            reading: made by `reading`.
        """
        sides = _fenicsx.assembled_vector(reading.form)[reading.places]
        sums = sides.sum(axis=1)  # one side has all, the other nothing
        values: Array = sums.reshape(len(sums), -1, self.size).swapaxes(0, 1) / self._lengths
        return values

    def gathered(self, values: Array) -> Array:
        """Return values at all joint points from those of each facet (p,).

        Args:
            values: of one number wherever facets share a point (f, k).
        """
        found = np.empty(self.count)
        found[self.points] = values
        return found

    def resultants(self, normal: Array, shear: Array) -> Array:
        """Return N, V, M of every joint from tractions (n_joints, 3) [N, N, N m].

        N = -∫ w t_n,   V = ∫ w t_s,   M = -∫ w t_n r

        Args:
            normal: at the points of each facet, positive where they pull (f, k) [Pa].
            shear: at the same points, of the sign of slips (f, k) [Pa].
        """
        structure = self.space.mesh.structure
        found = np.zeros((len(structure.joints), 3))
        density = structure.width * np.stack([-normal, shear, -normal * self.arms], axis=-1)
        np.add.at(found, self.joint, np.sum(density * self._lengths[..., None], axis=1))
        return found
