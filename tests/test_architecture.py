"""The architecture as a test: a room imports only from rooms to its left and from the ground."""

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import archfem

ROOT = Path(archfem.__file__).parent
GROUND = {"errors", "arguments", "annotated", "arrays", "units", "files", "netcdf", "tables"}
GROUND |= {"threads", "packages", "compiled", "shown", "_petsc"}
ROOMS = ["motion", "masonry", "joints", "limit", "models", "statics", "dynamics", "view", "cases"]
ROOMS += ["studies", "commands"]
ENTRANCES = {"__init__", "__main__", "_promised"}
BARRED = {"motion": {"masonry"}, "masonry": {"motion"}, "joints": {"motion"}, "limit": {"motion"}}
"""What stands to the left and is left alone: `motion` has nothing to do with stones."""

ONLY_IN = {
    "gmsh": "models.fem",
    "dolfinx": "models.fem",
    "ufl": "models.fem",
    "basix": "models.fem",
    "petsc4py": "_petsc",
    "slepc4py": "_petsc",
    "numba": ("compiled", "dynamics.stepping", "dynamics.falling", "joints.moving"),
    "matplotlib": "view",
    "pyvista": "view.films",
    "imageio": "view.films",
    "imageio_ffmpeg": "view.films",
    "jinja2": "view.pages",
    "markupsafe": "view.pages",
    "pint": "units",
    "shapely": "masonry",
    "ezdxf": "masonry",
    "netCDF4": "netcdf",
    "tomllib": ("cases", "studies"),
    "tomli_w": "cases",
    "argparse": "commands",
    "distributed": "studies.cluster",
}
"""Where a package may be imported: in this room, or module, or these, and what lies in them."""

MODULES = sorted(ROOT.rglob("*.py"))


def dotted(path):
    """Name of a module below `archfem`, "" for `archfem` itself."""
    return (
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix("__init__").strip(".")
    )


NAMES = {dotted(path): path for path in MODULES}


def imported(path):
    """Dotted names of everything that a file imports, also inside its functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if whole.removeprefix("archfem.") in NAMES else node.module


def may_import(here, there):
    """Whether one room, or one module of the ground, may import from another."""
    if there in GROUND or here == there:
        return True
    if here not in ROOMS or there not in ROOMS or there in BARRED.get(here, ()):
        return here in ENTRANCES
    return ROOMS.index(there) < ROOMS.index(here)


@pytest.mark.parametrize("name", NAMES)
def test_a_room_imports_from_its_left_and_from_the_ground(name):
    here = name.split(".")[0] or "__init__"
    assert here in {*GROUND, *ROOMS, *ENTRANCES}, f"{name} is in no room"
    for found in imported(NAMES[name]):
        package, _, rest = found.partition(".")
        if package == "archfem":
            assert may_import(here, rest.split(".")[0]), f"{here} may not import {found}"
            is_module = rest in NAMES and NAMES[rest].name != "__init__.py"
            assert is_module or here in ENTRANCES, (
                f"{name}: import from the defining module, {found}"
            )
        homes = ONLY_IN.get(package, "")
        homes = (homes,) if isinstance(homes, str) else homes
        at_home = any(f"{name}.".startswith(f"{home}.".lstrip(".")) for home in homes)
        assert at_home, f"{package} is kept out of {name}"


def test_there_are_no_circles():
    graph = {
        name: {found.removeprefix("archfem.") for found in imported(path)} & set(NAMES) - {name}
        for name, path in NAMES.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"modules import each other in a circle: {error.args[1]}")


@pytest.mark.parametrize("name", NAMES)
def test_modules_are_small_and_say_what_they_are(name):
    text = NAMES[name].read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 330
    assert ast.get_docstring(ast.parse(text))


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_tell_of_their_modules(room):
    """The docstring of a room has a line for each of its modules and folders."""
    folder = ROOT / room
    told = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    inside = {path.stem for path in folder.iterdir() if path.suffix == ".py"} - {"__init__"}
    inside |= {path.name for path in folder.iterdir() if (path / "__init__.py").is_file()}
    for name in inside:
        assert f"\n    {name} " in told, f"{room}/__init__.py says nothing of {name}"


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
    assert len(ours) <= 50


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
for name in ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "ufl", "basix", "gmsh"):
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
assert 8.0 < af.modes(model, 2, about=dead).frequencies[0] < 200.0
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


PROMISED = [
    "archfem.actions.BodyForce",
    "archfem.analysis.at_rest",
    "archfem.analysis.damping_of",
    "archfem.capacity.minimum_thickness",
    "archfem.cases.cli.main",
    "archfem.criteria.judged",
    "archfem.events.MovingMechanism",
    "archfem.freebody.forces_on",
    "archfem.limit.collapse_factor",
    "archfem.motion.Motion",
    "archfem.push.Stop",
    "archfem.shapes.circular_arch",
    "archfem.statics.self_weight",
    "archfem.strength.strength_use",
    "archfem.strength.use_table",
    "archfem.view.capacity.collapse_figure",
    "archfem.view.compare.draw_instants",
    "archfem.view.envelopes.draw_envelope",
    "archfem.view.plots.draw_structure",
    "archfem.view.pushover.draw_pushover",
    "archfem.view.scenes.picture",
    "archfem.view.tradeoff.draw_accuracy",
]
"""What scripts were told to import before there were rooms."""


def test_what_scripts_import_is_still_found():
    """In a process of its own, where nothing has been loaded under another name before.

    Before that: pictures on paper load nothing that films need, and a dead load needs no SLEPc.
    """
    script = """
import sys
sys.modules["slepc4py"] = None
import archfem as af
for name in af.view.__all__:
    if not name.startswith(("film", "picture", "viewer", "Viewer")):
        getattr(af.view, name)
assert not {"pyvista", "imageio", "vtk"} & set(sys.modules)
model = af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
assert af.dead_load(model).iterations > 0
"""
    lines = [
        f"from {module} import {thing}; assert {thing}.__module__.startswith('archfem.')"
        for module, _, thing in (name.rpartition(".") for name in PROMISED)
    ]
    subprocess.run([sys.executable, "-c", "\n".join([script, *lines])], check=True)
