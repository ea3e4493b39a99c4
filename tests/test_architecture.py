"""The architecture: a room imports only from rooms to its left and from the support modules."""

import ast
import inspect
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import get_args

import pytest

import archfem
from archfem import _display

ROOT = Path(archfem.__file__).parent
SUPPORT_MODULES = {"errors", "units", "_display", "_files", "_netcdf", "_numba", "_optional"}
SUPPORT_MODULES |= {"_petsc", "_recent", "_threads", "_typing", "_validation"}
ROOMS = ["motion", "masonry", "joints", "limit", "models", "statics", "dynamics", "view", "cases"]
ROOMS += ["studies", "commands"]
ENTRANCES = {"__init__", "__main__"}
# `motion` imports no structures, and rooms about structures at rest need no motion.
INDEPENDENT_ROOMS = {
    "motion": {"masonry"},
    "masonry": {"motion"},
    "joints": {"motion"},
    "limit": {"motion"},
}

# A third-party package may be imported in these rooms or modules, and in what lies in them.
ALLOWED_IN = {
    "gmsh": "models.fem",
    "dolfinx": ("models.fem", "models.reference"),
    "ufl": ("models.fem", "models.reference"),
    "basix": "models.fem",
    "petsc4py": "_petsc",
    "numba": ("_numba", "dynamics.solvers", "dynamics.rigid_body", "joints.large"),
    "llvmlite": "joints.large.lanes",
    "matplotlib": "view",
    "pyvista": "view.films",
    "imageio": "view.films",
    "imageio_ffmpeg": "view.films",
    "highspy": "limit.linear_programme",
    "jinja2": "view.pages",
    "ifcopenshell": "masonry.survey.ifc",
    "docx": "view.pages.word",
    "markupsafe": "view.pages",
    "pint": "units",
    "shapely": "masonry",
    "ezdxf": "masonry",
    "netCDF4": "_netcdf",
    "tomllib": ("cases", "limit.vehicles", "studies"),
    "argparse": "commands",
    "obspy": "motion.records.waveforms",
    "distributed": "studies.cluster",
    "pygmm": "motion.ground_motion_models",
}

MAX_CODE_LINES_PER_MODULE = 500
MAX_CODE_LINES_PER_FUNCTION = 40

MODULES = sorted(ROOT.rglob("*.py"))


def dotted(path):
    """Name of a module below `archfem`, "" for `archfem` itself."""
    return (
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix("__init__").strip(".")
    )


NAMES = {dotted(path): path for path in MODULES}


@cache
def nodes(path):
    """Nodes of the syntax tree of a file, the module first."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def imported(path):
    """Dotted names of everything that a file imports, also inside its functions."""
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if whole.removeprefix("archfem.") in NAMES else node.module


def may_import(here, there):
    """Whether one room, or one support module, may import from another."""
    if there in SUPPORT_MODULES or here == there:
        return True
    if here not in ROOMS or there not in ROOMS or there in INDEPENDENT_ROOMS.get(here, ()):
        return here in ENTRANCES
    return ROOMS.index(there) < ROOMS.index(here)


def forbidden_imports(name):
    """What is wrong with the imports of a module, each in words."""
    here = name.split(".")[0] or "__init__"
    if here not in {*SUPPORT_MODULES, *ROOMS, *ENTRANCES}:
        yield f"{name} is in no room"
    for found in imported(NAMES[name]):
        package, _, rest = found.partition(".")
        if package == "archfem":
            if not may_import(here, rest.split(".")[0]):
                yield f"{name} may not import {found}"
            is_module = rest in NAMES and NAMES[rest].name != "__init__.py"
            if not is_module and here not in ENTRANCES:
                yield f"{name}: import from the defining module, {found}"
        homes = ALLOWED_IN.get(package, "")
        homes = (homes,) if isinstance(homes, str) else homes
        if not any(f"{name}.".startswith(f"{home}.".lstrip(".")) for home in homes):
            yield f"{package} is kept out of {name}"


def test_a_room_imports_from_its_left():
    assert [wrong for name in NAMES for wrong in forbidden_imports(name)] == []


def test_there_are_no_circles():
    graph = {
        name: {found.removeprefix("archfem.") for found in imported(path)} & set(NAMES) - {name}
        for name, path in NAMES.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"modules import each other in a circle: {error.args[1]}")


def count_code_lines(node, lines):
    """Lines of a node that are neither blank, nor a comment alone, nor part of a docstring."""
    strings = {
        number
        for each in ast.walk(node)
        if isinstance(each, ast.Expr)
        and isinstance(each.value, ast.Constant)
        and isinstance(each.value.value, str)
        for number in range(each.lineno, each.end_lineno + 1)
    }
    # the signature of a function does not count
    first = node.body[0].lineno if isinstance(node, ast.FunctionDef) else 1
    last = getattr(node, "end_lineno", len(lines))
    return sum(
        bool(lines[number - 1].strip())
        and not lines[number - 1].lstrip().startswith("#")
        and number not in strings
        for number in range(first, last + 1)
    )


def excesses(name):
    """What of a module is too long or has no docstring, each in words."""
    lines = NAMES[name].read_text(encoding="utf-8").splitlines()
    tree, *inner = nodes(NAMES[name])
    if not ast.get_docstring(tree):
        yield f"{name}: no docstring"
    length = count_code_lines(tree, lines)
    if length > MAX_CODE_LINES_PER_MODULE:
        yield f"{name}: {length} lines"
    for node in inner:
        if isinstance(node, ast.FunctionDef):
            length = count_code_lines(node, lines)
            if length > MAX_CODE_LINES_PER_FUNCTION:
                yield f"{name}.{node.name}: {length} lines"


def test_modules_and_functions_are_small_and_documented():
    assert [wrong for name in NAMES for wrong in excesses(name)] == []


# Modules of one name in several packages treat one topic in each of them.
SHARED_TOPICS = {
    "accuracy", "backfill", "blocks", "collapse", "columns", "construction", "export", "joints",
    "model", "motion", "newton", "run", "snes", "statics", "stress", "structure", "studies",
    "study",
}  # fmt: skip


def test_a_module_name_has_one_meaning():
    tails = [name.rpartition(".")[2] for name, path in NAMES.items() if path.stem != "__init__"]
    repeated = {tail for tail in tails if tails.count(tail) > 1} - {"__main__"}
    assert repeated <= SHARED_TOPICS


def imported_by_string(path):
    """Names of modules that `import_module` is called with; "*" stands for computed parts."""
    for node in nodes(path):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "import_module":
            match node.args[0]:
                case ast.Constant(value=str(name)):
                    yield name
                case ast.JoinedStr(values=[ast.Constant(value=str(start)), *_]):
                    yield f"{start}*"
                case _:
                    yield "*"


def test_imports_by_string_go_to_the_left():
    """Only the table of late-bound methods reaches rooms to the right."""
    assert [
        f"{name} imports {found}"
        for name in set(NAMES) - {"_display"}
        for found in imported_by_string(NAMES[name])
        if found.startswith("archfem.")
        and not may_import(name.split(".")[0] or "__init__", found.split(".")[1].rstrip("*"))
    ] == []


@cache
def class_names():
    """Names of the classes of all modules."""
    return [node.name for path in MODULES for node in nodes(path) if isinstance(node, ast.ClassDef)]


@pytest.mark.parametrize("method", _display.LATE_BOUND_METHODS)
def test_late_bound_methods_resolve(method):
    """The class has the method, and the function takes an instance of the class first."""
    owner, _, name = method.partition(".")
    module, _, function = _display.LATE_BOUND_METHODS[method].partition(":")
    target = getattr(import_module(f"archfem.{module}"), function)
    first = next(iter(inspect.signature(target).parameters.values()))
    kinds = [first.annotation, *get_args(first.annotation)]
    bases = {base.__name__ for kind in kinds for base in getattr(kind, "__mro__", ())}
    assert owner in bases
    assert class_names().count(owner) == 1
    assert all(hasattr(kind, name) for kind in kinds if getattr(kind, "__name__", "") == owner)


def test_the_docstring_of_a_room_lists_its_modules():
    missing = []
    for folder in (ROOT / room for room in ROOMS):
        text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
        inside = {path.stem for path in folder.iterdir() if path.suffix == ".py"} - {"__init__"}
        inside |= {path.name for path in folder.iterdir() if (path / "__init__.py").is_file()}
        missing += [f"{folder.name}: {name}" for name in inside if f"\n    {name} " not in text]
    assert missing == []


@pytest.mark.parametrize("room", ["", *ROOMS])
def test_public_names_load_and_hide_no_module(room):
    package = import_module(f"archfem.{room}".rstrip("."))
    assert set(package.__all__) <= set(dir(package))
    for name in package.__all__:
        value = getattr(package, name)
        assert isinstance(value, ModuleType) or f"{room}.{name}".lstrip(".") not in NAMES


def test_public_names_are_about_fifty():
    values = {name: getattr(archfem, name) for name in archfem.__all__}
    assert set(ROOMS) | {"errors", "shapes", "units"} <= set(values)
    ours = [name for name, value in values.items() if hasattr(value, "__module__")]
    assert len(ours) <= 60


def test_importing_archfem_loads_no_library():
    slow = {"numpy", "scipy", "xarray", "numba", "matplotlib", "pint", "gmsh", "pyvista"}
    script = f"import sys, archfem; print(*({slow} & set(sys.modules)))"
    ran = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert ran.stdout.split() == []


def test_rigid_stones_need_no_fenicsx():
    """Four rooms as a whole; dead load, modes and histories. What is more says what it needs."""
    script = """
import pkgutil, sys
from importlib import import_module
for name in ("dolfinx", "petsc4py", "mpi4py", "ufl", "basix", "gmsh"):
    sys.modules[name] = None
import numpy as np
import archfem as af
for room in (af.motion, af.masonry, af.joints, af.limit):
    for found in pkgutil.walk_packages(room.__path__, room.__name__ + "."):
        import_module(found.name)
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
assert abs(af.collapse_factor(ring, live=af.BodyForce(1.0, 0.0)).factor - 0.457) < 5e-4
assert af.Motion.synthetic(duration=2.0, seed=1).pga > 0
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=3)
model = af.build(ring, fidelity="rigid")
dead, motion = af.dead_load(model), af.Motion(np.full(4, 0.5), 0.005)
assert 8.0 < af.modes(model, 2, start=dead).frequencies[0] < 200.0
given = {"start": dead, "dt": 0.005, "damping": af.StiffnessDamping(0.05, 9.0)}
runs = [af.time_history(model, motion, method=method, **given) for method in ("snes", "compliance")]
one, two = (run.joints["M"].values for run in runs)
assert np.abs(one - two).max() < 1e-6 * np.abs(one).max()
try:
    af.build(ring, fidelity="faces")
except af.ArchfemError as error:
    assert "apt-get install python3-dolfinx" in str(error)
else:
    raise AssertionError
"""
    subprocess.run([sys.executable, "-c", script], check=True)
