"""What a structure is modelled by: a rung of the ladder, a mesh, and a rule on its joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from archfem.arguments import among, real, row, said, whole
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature

RUNGS = ("rigid", "faces", "condensed", "full")
"""What a block may be, the cheapest first."""

FIDELITIES = (*RUNGS, "monolithic")
"""What a whole structure may be: the ladder, and the slow reference."""

DISPLACEMENTS = ("small", "large")
"""What displacements may be."""

SHAPES = ("quadrilateral", "triangle")
"""Of cells."""

MOST = 1000
"""Cells across a block, either way, beyond which nobody means it."""


@dataclass(frozen=True)
class Discretisation:
    """A rung of the ladder, a mesh and a rule on the joints, checked when made.

    Numbers of cells are least ones: a side gets more where a neighbour needs them, where it bends
    or is touched at more points, or where cells of a polygon would be longer than twice its
    thickness.

    Attributes:
        fidelity: one of `FIDELITIES`, or one of `RUNGS` by block name or part, with "rest" for
            all others.
        cells: through the thickness (facets on a joint) and along each block (a sector's faces get
            as many chords).
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners, such as backfill [m]; where it is not
            given, half of the block's mean thickness 2 A / P, A its area and P its perimeter.
        degree: of the elements, 1 or 2.
        quadrature: rule on each joint facet, "exact", "lobatto", "nodal" or "gauss"; None takes the
            exact one, and Lobatto's where there is none: of degree 2, and for "monolithic".
        points: on each facet, 3 where not given.
        displacements: "small", or "large" where blocks may turn and slide as far as they like, on
            all rungs but "monolithic"; those of a fill with nodes stay small.
        file: a mesh of one's own, as `read_mesh` takes it, in place of `cells`, `cell` and
            `coarse`; not on the rung "rigid", which has no mesh.
    """

    fidelity: str | Mapping[str, str] = "full"
    cells: tuple[int, int] = (4, 4)
    cell: str = "quadrilateral"
    coarse: float | None = None
    degree: int = 1
    quadrature: str | None = None
    points: int | None = None
    displacements: str = "small"
    file: str | Path | None = None

    def __post_init__(self) -> None:
        """Refuse unknown words, impossible numbers, and what does not go together."""
        _check_fidelity(self.fidelity)
        object.__setattr__(self, "cells", _two(self.cells))
        if not among(self.cell, SHAPES):
            raise InvalidInput(f"cell {said(self.cell)} is not known: use one of {SHAPES}")
        if self.coarse is not None and not real(self.coarse, "coarse [m]") > 0.0:
            raise InvalidInput(f"coarse = {self.coarse!r} m: give a length above 0, e.g. 0.5")
        if not among(self.displacements, DISPLACEMENTS):
            given = said(self.displacements)
            raise InvalidInput(f"displacements {given} are not known: use one of {DISPLACEMENTS}")
        if self.displacements == "large" and self.fidelity == "monolithic":
            raise InvalidInput(
                "displacements are large, which the rung 'monolithic' does not know: use 'full', "
                "which is the same model, or displacements = 'small'"
            )
        if self.file is not None and self.fidelity == "rigid":
            raise InvalidInput(f"file = {str(self.file)!r}: the rung 'rigid' has no mesh to read")
        if not among(self.degree, (1, 2)):
            raise InvalidInput(f"degree {said(self.degree)}: elements are of degree 1 or 2")
        if self.rule.rule == "exact" and (self.degree != 1 or self.fidelity == "monolithic"):
            raise InvalidInput(
                "exact quadrature needs openings that are linear along a facet, and is not written "
                "in UFL: use degree 1 and a rung other than monolithic"
            )

    @property
    def through(self) -> int:
        """Cells through the thickness."""
        return self.cells[0]

    @property
    def along(self) -> int:
        """Cells along each block."""
        return self.cells[1]

    @property
    def rule(self) -> Quadrature:
        """The rule on each joint facet."""
        if self.quadrature is not None:
            return Quadrature(self.quadrature, self.points)
        exact = self.degree == 1 and self.fidelity != "monolithic" and self.points is None
        return Quadrature("exact" if exact else "lobatto", self.points)

    @property
    def name(self) -> str:
        """The fidelity in words."""
        if isinstance(self.fidelity, str):
            return self.fidelity
        return ", ".join(f"{block}: {rung}" for block, rung in self.fidelity.items())


def _check_fidelity(fidelity: object) -> None:
    """Refuse rungs that there are not."""
    if isinstance(fidelity, Mapping):
        unknown = sorted({str(rung) for rung in fidelity.values() if not among(rung, RUNGS)})
        if unknown:
            raise InvalidInput(f"rungs {unknown} are not known: use some of {RUNGS}")
    elif among(fidelity, ("modal",)):
        raise InvalidInput(
            "fidelity 'modal' is no longer known, for 'faces' is faster and errs less: use one of "
            f"{FIDELITIES}"
        )
    elif not among(fidelity, FIDELITIES):
        raise InvalidInput(
            f"fidelity {said(fidelity)} is not known: use one of {FIDELITIES}, or 'auto' in `build`"
        )


def _two(cells: object) -> tuple[int, int]:
    """Two whole numbers."""
    through, along = row(cells, "cells through the thickness and along each block", 2)
    for key, count in (("through", through), ("along", along)):
        if whole(count, f"cells {key}") > MOST:
            raise InvalidInput(f"cells {key} = {count!r}: give at most {MOST}")
    return int(through), int(along)
