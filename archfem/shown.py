"""Things with a picture of their own, which are told in a line or two."""

from html import escape
from importlib import import_module
from typing import Any


class Shown:
    """Something with a picture of its own, that says in a line or two what it is.

    A class names the function of `archfem.view` that draws it. It is looked up when a picture is
    asked for, so that no room knows those that come after it.
    """

    _picture = ""

    def __init_subclass__(cls, picture: str = "") -> None:
        """Note which picture the things of a class have.

        Args:
            picture: module of `archfem.view` and function in it, such as "modes.draw_modes".
        """
        super().__init_subclass__()
        cls._picture = picture or cls._picture

    def plot(self, **how: Any) -> Any:
        """Draw it.

        Args:
            how: options of the function of `archfem.view` that draws such things: `draw_structure`,
                `draw_dead_load`, `draw_joints` for a history, `draw_pushover`, `draw_collapse`,
                `draw_modes` or `draw_motion`.

        Returns:
            The page, a figure of matplotlib, which `archfem.view.save` writes.
        """
        module, _, function = self._picture.partition(".")
        return getattr(import_module(f"archfem.view.{module}"), function)(self, **how)

    def _words(self) -> str:
        """What it is, in a line or two."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._words()

    def _repr_html_(self) -> str:
        """The same for notebooks; names are words, though they hold a <."""
        return f"<pre>{escape(self._words())}</pre>"
