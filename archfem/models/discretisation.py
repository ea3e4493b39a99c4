"""Discretisation of a structure: fidelity, mesh, and quadrature on the joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from archfem._typing import Metres
from archfem._validation import (
    check_between,
    check_choice,
    check_integer,
    check_sequence,
    is_one_of,
)
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature

# Fidelities of a model: those of a block, the one with the fewest coordinates first, and the
# reference model
MODEL_FIDELITIES = ("rigid", "faces", "condensed", "full", "monolithic")


@dataclass(frozen=True)
class Discretisation:
    """Define fidelity, mesh and quadrature of a model.

    Numbers of cells are minima. A side has more where a neighbour needs them, or where it bends or
    touches at more points. Cells of a polygon are at most twice as long as its thickness.

    Attributes:
        fidelity: "rigid", "faces", "condensed", "full" or "monolithic"; or one of the first four
            by block name or part, with "rest" for all others.
        cells: numbers through the thickness (facets on a joint) and along each block (chords of
            the faces of a sector).
        cell: shape of the cells, "quadrilateral" or "triangle".
        max_cell_size: largest size of cells inside blocks without corners, such as backfill [m];
            None for 4 A / (P n), A the block's area, P its perimeter and n the number of cells
            along it: a square has n cells on each side.
        degree: polynomial degree of the elements, 1 or 2.
        quadrature: rule on each joint facet, "exact", "lobatto", "trapezoidal", "nodal" or "gauss";
            None for "exact", or "lobatto" with degree 2 or "monolithic", which have no exact rule.
        quadrature_points: number on each facet, by default 3, with "trapezoidal" 2; with
            "trapezoidal" and fidelity "rigid" on each whole joint: three are the rule of 3DEC,
            weights 1/4, 1/2, 1/4, five the springs of Demirel and Aldemir (2021).
        displacements: "small", or "large" where blocks may rotate and slide as far as they like,
            with every fidelity but "monolithic"; those of a fill with nodes stay small.
        mesh_file: for `read_mesh`, in place of `cells`, `cell` and `max_cell_size`; not with
            "rigid", which has no mesh.

    Raises:
        InvalidInput: a value is unknown or impossible, or values exclude each other.
    """

    fidelity: str | Mapping[str, str] = "full"
    cells: tuple[int, int] = (4, 4)
    cell: str = "quadrilateral"
    max_cell_size: Metres | None = None
    degree: int = 1
    quadrature: str | None = None
    quadrature_points: int | None = None
    displacements: str = "small"
    mesh_file: str | Path | None = None

    def __post_init__(self) -> None:
        """Check the values, and that they do not exclude each other."""
        _check_fidelity(self.fidelity)
        object.__setattr__(self, "cells", _check_cells(self.cells))
        check_choice(self.cell, "cell", ("quadrilateral", "triangle"))
        size, points = self.max_cell_size, self.quadrature_points
        if size is not None:
            check_between(size, "max_cell_size [m]", 0.0, remedy="give e.g. 0.5")
        check_choice(self.displacements, "displacements", ("small", "large"))
        if self.displacements == "large" and self.fidelity == "monolithic":
            raise InvalidInput(
                "large displacements do not exist with fidelity 'monolithic': use 'full', which is "
                "the same model, or displacements = 'small'"
            )
        if self.mesh_file is not None and self.fidelity == "rigid":
            raise InvalidInput(
                f"mesh_file = {str(self.mesh_file)!r}: fidelity 'rigid' has no mesh to read"
            )
        check_choice(self.degree, "degree", (1, 2))
        if self.rule.rule == "trapezoidal" and self.fidelity == "monolithic" and points:
            raise InvalidInput(
                f"trapezoidal quadrature with {points} points is not written in UFL: leave "
                "quadrature_points out, or use a fidelity other than monolithic"
            )
        if self.rule.rule == "exact" and (self.degree != 1 or self.fidelity == "monolithic"):
            raise InvalidInput(
                "exact quadrature needs openings that are linear along a facet, and is not written "
                "in UFL: use degree 1 and a fidelity other than monolithic"
            )

    @property
    def through(self) -> int:
        """Number of cells through the thickness."""
        return self.cells[0]

    @property
    def along(self) -> int:
        """Number of cells along each block."""
        return self.cells[1]

    @property
    def rule(self) -> Quadrature:
        """Quadrature rule on each joint facet."""
        points = self.quadrature_points
        if self.quadrature is not None:
            return Quadrature(self.quadrature, points)
        exact = self.degree == 1 and self.fidelity != "monolithic" and points is None
        return Quadrature("exact" if exact else "lobatto", points)

    @property
    def name(self) -> str:
        """Fidelity as text, of each block or part where they differ."""
        if isinstance(self.fidelity, str):
            return self.fidelity
        return ", ".join(f"{block}: {fidelity}" for block, fidelity in self.fidelity.items())


def _check_fidelity(fidelity: object) -> None:
    """Refuse unknown fidelities."""
    if isinstance(fidelity, Mapping):
        values = fidelity.values()
        of_blocks = MODEL_FIDELITIES[:-1]
        unknown = sorted({str(name) for name in values if not is_one_of(name, of_blocks)})
        if unknown:
            raise InvalidInput(f"fidelities {unknown} are not known: use some of {of_blocks}")
    else:
        check_choice(fidelity, "fidelity", MODEL_FIDELITIES, ", or 'auto' in `build`")


def _check_cells(cells: object) -> tuple[int, int]:
    """Return numbers of cells through the thickness and along a block; refuse impossible ones."""
    through, along = check_sequence(cells, "cells through the thickness and along each block", 2)
    for key, count in (("through", through), ("along", along)):
        check_integer(count, f"cells {key}", maximum=1000)
    return int(through), int(along)
