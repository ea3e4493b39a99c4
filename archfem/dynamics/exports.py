"""What a run is written as, for other programs and for people: a base of `History`."""

from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from archfem.dynamics.series import write_vtk, write_xdmf
from archfem.joints.table import write_joint_table
from archfem.models.model import Model


class Exports:
    """Files of a run for other programs, and pages of it for people.

    Pages are looked up when they are asked for, so that this room knows none that comes after it.
    """

    dataset: xr.Dataset

    def to_vtk(self, model: Model, path: str | Path) -> Path:
        """Write a series for ParaView, openings intact, as by `write_vtk`.

        Args:
            model: that made the run, with fields.
            path: of the list, *.pvd; the files it names stand in a folder beside it.

        Returns:
            The list.

        Raises:
            InvalidInput: the run has no fields, or is another model's; or the name ends otherwise.
        """
        return write_vtk(model, self.dataset, path)

    def to_xdmf(self, model: Model, path: str | Path) -> Path:
        """Write the fields as XDMF and HDF5, openings intact, as by `write_xdmf`.

        Args:
            model: that made the run, with fields.
            path: of the text, *.xdmf; the numbers get the same name with .h5.

        Returns:
            The text.

        Raises:
            InvalidInput: the run has no fields, or is another model's; or the name ends otherwise.
        """
        return write_xdmf(model, self.dataset, path)

    def to_table(self, path: str | Path) -> Path:
        """Write what the joints did as a table, a row for each at each step.

        Args:
            path: *.csv, *.parquet or *.xlsx.

        Returns:
            The file.

        Raises:
            InvalidInput: the name ends otherwise, what writes such files is not installed, or there
                are more rows than a sheet has.
        """
        names = [name for name, values in self.dataset.items() if "joint" in values.dims]
        return write_joint_table(self.dataset[names], path)

    def player(self, model: Model | None = None, *, title: str = "") -> Any:
        """Return the player of the run, as `archfem.view.player` does.

        Args:
            model: that made the run; needed where it has fields.
            title: above the picture; by default the run's own.

        Returns:
            The player: it shows itself in a notebook, and can be saved as a page.

        Raises:
            InvalidInput: as `archfem.view.player` does.
        """
        return import_module("archfem.view.pages.player").player(self, model, title=title)

    def report(self, path: str | Path) -> Path:
        """Write a report of the run and the case that it is of: one HTML file, to print.

        Args:
            path: the file, .html; folders are made.

        Returns:
            The file.

        Raises:
            InvalidInput: the run was made in Python, and knows of no case.
        """
        written: Path = import_module("archfem.cases.dossier.writing").report_of(self, path)
        return written
