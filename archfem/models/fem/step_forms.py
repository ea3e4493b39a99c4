"""Weak forms of a step in time, along which displacements go straight from u_0 to u_1.

Tractions are those of `joints.law` averaged over the step, and for all v internal forces are

    ∫ w σ(ū):ε(v) + Σ_joints ∫ w (<t_n> ⟦v⟧·n + <t_s> ⟦v⟧·t),    ū = (½ - λ) u_0 + (½ + λ) u_1,

with λ = β/Δt of damping that lags by β: gaps, too, are felt from g + λ Δg on. Friction over the
step is limited by μ |<t_n>| + c times the part of it for which the joint is closed.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import ufl
from dolfinx import fem
from scipy import sparse

from archfem.arrays import Array
from archfem.models.fem import _fenicsx
from archfem.models.fem.forms import Forms
from archfem.models.fem.joint_facets import Reading
from archfem.models.fem.joint_forms import Fields


@dataclass(frozen=True)
class Begun:
    """How a step begins.

    Attributes:
        displacement: of all nodes at its start (2 m,) [m].
        slid: how far each joint point has slid for good before it (p,) [m].
        late: lag of damping over the length of the step [-].
    """

    displacement: Array
    slid: Array
    late: float


@dataclass(frozen=True, eq=False)
class StepForms:
    """Weak forms of a step, compiled when first asked for.

    Attributes:
        forms: those of an instant.
    """

    forms: Forms

    @cached_property
    def _step(self) -> Fields:
        """Displacements at its start and its end."""
        functions = self.forms.space.functions
        return fem.Function(functions), fem.Function(functions)

    @cached_property
    def _late(self) -> Any:
        return _fenicsx.constant(self.forms.space.mesh.grid, 0.0)

    def _placed(self, begun: Begun, end: Array) -> None:
        """Give all forms the step."""
        self._step[0].x.array[:] = begun.displacement
        self._step[1].x.array[:] = end
        self._late.value = begun.late
        self.forms.facets.carry(begun.slid)

    @cached_property
    def _work(self) -> Any:
        """Work of the mean forces on a displacement v, a UFL form."""
        (start, end), late, forms = self._step, self._late, self.forms
        v = ufl.TestFunction(forms.space.functions)
        mean = (0.5 - late) * start + (0.5 + late) * end
        pushed = forms.pushed([faces.means(self._step, late) for faces in forms.faces], v)
        return forms.bodies(mean, v) + pushed

    @cached_property
    def _force(self) -> Any:
        return fem.form(self._work)

    def force(self, begun: Begun, end: Array) -> Array:
        """Return the mean of the assembled internal forces (2 m,) [N].

        Args:
            begun: how the step begins.
            end: displacement of all nodes at its end (2 m,) [m].
        """
        self._placed(begun, end)
        return _fenicsx.assembled_vector(self._force)

    @cached_property
    def _tangent(self) -> Any:
        return fem.form(ufl.derivative(self._work, self._step[1]))

    def tangent(self, begun: Begun, end: Array) -> sparse.csr_matrix:
        """Return the assembled derivative of `force` by the displacement at the end [N/m].

        Args:
            begun: how the step begins.
            end: displacement of all nodes at its end (2 m,) [m].
        """
        self._placed(begun, end)
        return _fenicsx.assembled_matrix(self._tangent)

    @cached_property
    def _tractions(self) -> Reading:
        step, late = self._step, self._late
        return self.forms.reading(
            [[*f.means(step, late), f.slid_over(step, late)] for f in self.forms.faces]
        )

    def tractions(self, begun: Begun, end: Array) -> Array:
        """Return means of what acts at the points of each joint facet, and their slip at the end.

        Args:
            begun: how the step begins.
            end: displacement of all nodes at its end (2 m,) [m].

        Returns:
            Mean tractions across and along the joint [Pa], and how far the points have slid for
            good [m], as `Forms.tractions` (3, f, k).
        """
        self._placed(begun, end)
        return self.forms.facets.read(self._tractions)

    @cached_property
    def _lost(self) -> Any:
        step, late, forms = self._step, self._late, self.forms
        moved = step[1] - step[0]
        rubbed = forms.over_joints([faces.lost(step, late) for faces in forms.faces])
        return fem.form(late * forms.bodies(moved, moved) + rubbed)

    def lost(self, begun: Begun, end: Array) -> float:
        """Return the energy that friction and the lag of damping take [J].

        Args:
            begun: how the step begins.
            end: displacement of all nodes at its end (2 m,) [m].
        """
        self._placed(begun, end)
        return float(fem.assemble_scalar(self._lost))
