"""Reference pages of the public names, room by room, from the `__init__.pyi` of the package.

The package loads its names at first use, so only these lists define the public names. A page for
each room is written into `docs/api` before Sphinx starts.
"""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.ext.autodoc.mock import mock

import archfem

# Large packages without which the pages can be built, as by a hosted builder
LARGE = ("dolfinx", "petsc4py", "mpi4py", "ufl", "basix", "gmsh", "pyvista", "imageio")
MISSING = [name for name in LARGE if find_spec(name) is None]

PACKAGE = Path(archfem.__file__).parent
ROOMS = {
    "motion": "ground motions: records, synthetic motions, spectra, matching, suites",
    "masonry": "structures and loads: blocks, joints, materials, shapes, surveys",
    "joints": "mechanics of dry joints: contact law, quadrature, resultants, criteria",
    "limit": "limit analysis of rigid blocks: collapse factor, least thickness, mechanisms",
    "models": "discrete models of a structure at five fidelities",
    "statics": "statics of a model: dead load, pushover, modes, stress",
    "dynamics": "time histories of a model: schemes, damping, events, histories, falls",
    "view": "figures and films",
    "cases": "analyses as files",
    "studies": "many cases: parameters, incremental dynamic analysis, fragility, convergence",
    "commands": "the command line",
}
# Placeholder of a colon while docstrings are split
COLON = "\ue000"

PLAIN = {
    "errors": "exceptions, one class for each remedy",
    "units": "factors to SI units, and parsing of quantities",
}
# Packages whose names are shown without links, so that a build needs no network
FOREIGN = (
    "numpy",
    "scipy",
    "xarray",
    "matplotlib",
    "collections",
    "contextlib",
    "pathlib",
    "typing",
    "enum",
    "re",
    "pandas",
    "pd",
    "dolfinx",
    "petsc4py",
    "mpi4py",
    "np",
    "xr",
    "abc",
    "types",
    "datetime",
    "os",
    "dataclasses",
    "logging",
)


def listed(stub: Path) -> dict[str, str]:
    """Return the public names of a stub and the module of each ("" for a room)."""
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    found = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or "" for node in found for alias in node.names}


@contextmanager
def replace_missing() -> Iterator[None]:
    """Replace packages that are not installed, while modules that import them are loaded."""
    with mock(MISSING):
        yield


@replace_missing()
def public() -> dict[str, dict[str, Any]]:
    """Return the public values of each room by their shortest dotted names."""
    top = {name: module for name, module in listed(PACKAGE / "__init__.pyi").items() if module}
    found: dict[str, dict[str, Any]] = {}
    for room in ROOMS:
        mine = [name for name, module in top.items() if module.split(".")[0] == room]
        names = {f"archfem.{name}": getattr(archfem, name) for name in mine}
        if (PACKAGE / room / "__init__.pyi").is_file():
            place = importlib.import_module(f"archfem.{room}")
            for name in listed(PACKAGE / room / "__init__.pyi"):
                if name not in top:
                    names[f"archfem.{room}.{name}"] = getattr(place, name)
        found[room] = {n: v for n, v in names.items() if not isinstance(v, ModuleType)}
    shapes = importlib.import_module("archfem.masonry.shapes")
    known = {id(value) for value in found["masonry"].values()}
    for name, value in vars(shapes).items():
        if (
            getattr(value, "__module__", "").startswith("archfem.masonry")
            and id(value) not in known
        ):
            found["masonry"][f"archfem.masonry.shapes.{name}"] = value
    seen: set[int] = set()  # a class that two rooms list has its page in the first
    for room, values in found.items():
        found[room] = {n: v for n, v in values.items() if id(v) not in seen or not callable(v)}
        seen |= {id(value) for value in values.values()}
    return found


def title(text: str, under: str = "=") -> list[str]:
    """Return the lines of a heading."""
    return [text, under * len(text), ""]


def table(names: list[str]) -> list[str]:
    """Return a summary table of names with links to their pages."""
    rows = [f"   {name}" for name in names]
    return [".. autosummary::", "   :toctree: generated", "   :nosignatures:", "", *rows, ""]


def write_pages(folder: Path) -> None:
    """Write the page of each room, and of `errors` and `units`, into a folder.

    Args:
        folder: created if missing; unchanged pages are not rewritten.
    """
    folder.mkdir(exist_ok=True)
    for room, values in public().items():
        lines = [*title(room), f"``archfem.{room}``: {ROOMS[room]}.", ""]
        lines += table(sorted(values, key=lambda name: (name.count("."), name.lower())))
        docstring = inspect.getdoc(importlib.import_module(f"archfem.{room}")) or ""
        modules = [line for line in docstring.splitlines() if line.startswith("    ")]
        lines += [*title("Its modules", "-"), ".. code-block:: text", "", *modules, ""]
        keep(folder / f"{room}.rst", lines)
    for name, says in PLAIN.items():
        module = f"archfem.{name}"
        lines = [*title(name), f"``{module}``: {says}.", "", f".. automodule:: {module}"]
        keep(folder / f"{name}.rst", [*lines, "   :members:", "   :show-inheritance:", ""])


def keep(path: Path, lines: list[str]) -> None:
    """Write a file unless it contains these lines already."""
    text = "\n".join(lines)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def plain(_app: Sphinx, kind: str, _name: str, value: Any, _options: Any, lines: list[str]) -> None:
    """Convert a docstring to reStructuredText: formulas verbatim, no mark-up but backticks."""
    output, before, outer, inside, section = [], "", 0, 0, False
    for line in without_types(lines):
        indent, blank = len(line) - len(line.lstrip()), not line.strip()
        if not blank and not indent:
            section = bool(re.fullmatch(r"[A-Z]\w*( \w+)?:", line.strip()))
        if not blank and indent < inside:
            inside = 0
        if not blank and not section and not inside and indent >= outer + 4 and not before.strip():
            output += [" " * outer + ".. code-block:: text", ""]
            inside = indent
        if not blank and not inside:
            outer = indent
        output.append(line if inside or line.lstrip().startswith((">>>", "...")) else escaped(line))
        before = line
    if kind == "data":
        output = [f"A `{type(value).__name__}`."]
    if kind in {"property", "attribute"}:  # text before a colon there is not a type
        output = [line.replace(":", COLON) for line in output]
    lines[:] = output


def without_units(
    _app: Sphinx,
    _kind: str,
    _name: str,
    _value: Any,
    _options: Any,
    signature: str | None,
    returned: str | None,
) -> tuple[str | None, str | None]:
    """Return a signature without the units of its types, which the texts of arguments have."""
    kind = r"'[^']*'|dict|None|~?[\w.]*NumberOrWord\([^)]*\)"
    shown = [
        text and re.sub(rf"~?[\w.]*Annotated\[(.+?), (?:{kind})\]", r"\1", text)
        for text in (signature, returned)
    ]
    return shown[0], shown[1]


def restored(
    _app: Sphinx, _kind: str, _name: str, _value: Any, _options: Any, lines: list[str]
) -> None:
    """Restore the colons of properties."""
    lines[:] = [line.replace(COLON, ":") for line in lines]


def without_types(lines: list[str]) -> list[str]:
    """Join the first line of a return description to its heading, so that it is not a type."""
    kept: list[str] = []
    for line in lines:
        begins = bool(kept) and kept[-1] in {"Returns:", "Yields:"}
        if begins:
            kept[-1] = f":{kept[-1].lower()}"
            kept[-1] += " " + line.strip()
        else:
            kept.append(line)
    return kept


def escaped(line: str) -> str:
    """Escape bars, stars and final underscores of a line, except around *words*."""
    parts = re.split(r"(``[^`]*``|`[^`]*`|(?<!\S)\*[^\W\d][\w ]*\*)", line)
    for k in range(0, len(parts), 2):
        parts[k] = re.sub(r"([|*]|_(?!\w))", r"\\\1", parts[k])
    return "".join(parts)


def aliases() -> dict[str, str]:
    """Map definitions and last parts of names to the public names."""
    found: dict[str, str] = {}
    for values in public().values():
        for name, value in values.items():
            if hasattr(value, "__qualname__"):
                found[f"{value.__module__}.{value.__qualname__}"] = name
            found[name.rpartition(".")[2]] = name
            short = name.removeprefix("archfem.")
            # users write af.shapes for the module of masonry
            for written in (short, short.replace("masonry.shapes.", "shapes.")):
                found["af." + written] = found["archfem." + written] = name
    return found


def resolved(app: Sphinx, env: Any, node: Any, content: nodes.Node) -> nodes.Node | None:
    """Resolve a name to the page of its value."""
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"].removesuffix("()")
    names = app.archfem_names  # type: ignore[attr-defined]
    stem, _, last = target.rpartition(".")
    for name in (names.get(target), f"{names[stem]}.{last}" if stem in names else None):
        if name is not None and name != target:
            found = env.get_domain("py").resolve_xref(
                env, node["refdoc"], app.builder, "obj", name, node, content
            )
            if found is not None:
                return found
    if node["reftype"] == "obj" or target.split(".")[0] in FOREIGN or internal(target):
        return content
    return None


@cache
def classes() -> set[str]:
    """Return the names of all classes of the package, which annotations may contain."""
    texts = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")]
    return {name for text in texts for name in re.findall(r"^class (\w+)", text, re.MULTILINE)}


def internal(target: str) -> bool:
    """Return whether a name is an internal one of the package, or a Python builtin."""
    if not target.startswith("archfem."):
        return hasattr(__builtins__, target) or target in {"Array", "NDArray", "Any"} | classes()
    module, _, name = target.rpartition(".")
    try:
        return hasattr(importlib.import_module(module), name)
    except ImportError:
        return False


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages, and register the handlers of docstrings and names."""
    write_pages(Path(app.srcdir) / "api")
    app.archfem_names = aliases()  # type: ignore[attr-defined]
    app.connect("autodoc-process-signature", without_units)
    app.connect("autodoc-process-docstring", plain, priority=400)
    app.connect("autodoc-process-docstring", restored, priority=600)
    app.connect("missing-reference", resolved, priority=400)
    return {"parallel_read_safe": True}
