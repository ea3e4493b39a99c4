"""Results that have a report and a player."""

from pathlib import Path
from typing import TYPE_CHECKING

from archfem.errors import InvalidInput

if TYPE_CHECKING:
    from archfem.cases.dossier.results import Results
    from archfem.view.pages.player import Player


class Reportable:
    """Results that have a report and a player; what these show is loaded when it is asked for."""

    def results(self) -> "Results":
        """Return what a report is written from."""
        raise NotImplementedError

    def report(self, path: str | Path) -> Path:
        """Write a report: one HTML file with all that it needs, to hand in and to print.

        Args:
            path: the file, .html; folders are made.

        Returns:
            The file.
        """
        from archfem.cases.dossier.writing import write_report  # loads matplotlib, which is slow

        return write_report(self.results(), path)

    def player(self, run: str | None = None) -> "Player":
        """Return the player of a run: it shows itself in a notebook, and can be saved as a page.

        Args:
            run: its name; needed where there are several.

        Raises:
            InvalidInput: there is no run, or none of that name, or several and none is named.
        """
        from archfem.cases.dossier.display import player_of

        results = self.results()
        names = list(results.runs)
        name = names[0] if run is None and len(names) == 1 else run
        if name is None or name not in names:
            asked = "no run is named" if run is None else f"there is no run '{run}'"
            raise InvalidInput(f"{asked}: there are {names}")
        return player_of(results.case, results.runs[name], results.case.title)
