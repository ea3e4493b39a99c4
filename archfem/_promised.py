"""Modules that scripts were told to import from before archfem had rooms, and still can.

`from archfem.events import MovingMechanism` stands in scripts; what it names is now in a room. A
finder gives the room's module for the name that was promised.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

PLACES = {
    "actions": "masonry.actions",
    "analysis": "cases.run",
    "capacity": "limit.thickness",
    "cases.cli": "commands.line",
    "criteria": "joints.criteria",
    "events": "dynamics.events",
    "freebody": "statics.freebody",
    "push": "statics.pushover",
    "shapes": "masonry.shapes",
    "strength": "statics.strength",
    "view.capacity": "view",
    "view.compare": "view",
    "view.plots": "view",
    "view.scenes": "view",
    "view.tradeoff": "view",
}
"""Where the names of each such module are now."""

RENAMED = {
    "view.capacity": {"capacity_figure": "draw_capacity", "collapse_figure": "draw_collapse"},
}
"""Names that such a module had, by which something is not known any more."""


class _Finder:
    """Finds modules by the names that were promised, and loads those of today in their place."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A specification of a module that was promised, None for any other."""
        if name.removeprefix("archfem.") not in PLACES:
            return None
        return ModuleSpec(name, cls)  # type: ignore[arg-type]

    @staticmethod
    def create_module(spec: ModuleSpec) -> None:
        """Leave it to the import system to make an empty one."""

    @staticmethod
    def exec_module(module: ModuleType) -> None:
        """Put the module of today in the place of the empty one, or names of it under old ones."""
        name = module.__name__.removeprefix("archfem.")
        place = import_module(f"archfem.{PLACES[name]}")
        if name in RENAMED:
            vars(module).update({old: getattr(place, new) for old, new in RENAMED[name].items()})
        else:
            sys.modules[module.__name__] = place


def keep() -> None:
    """Let promised modules be found from now on."""
    if _Finder not in sys.meta_path:
        sys.meta_path.append(_Finder)
