"""The architecture as a test: a module imports only from the layers below its own."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import archfem

ROOT = Path(archfem.__file__).parent
LAYERS = [
    "errors arrays tables files laws _petsc",
    "roles units naming arguments geometry",
    "criteria materials quadrature schemes signals oscillator records",
    "structure synthetic codes settings counted discretisation",
    "actions drawings polygons direction sparsity resultants motion softness rigid_motion",
    "assembly snapping",
    "shapes survey",
    "plans",
    "joints skeleton",
    "rigid_joints spectra",
    "rigid_blocks measures",
    "screen programme",
    "matching mechanism sliding",
    "limit suite events",
    "capacity ground",
    "_fenicsx edges",
    "division",
    "mesh",
    "space",
    "forms",
    "models",
    "newton energy states freebody stress eigen",
    "statics history",
    "path stepping verdicts",
    "guard summary",
    "strength modal",
    "modal_damping findings",
    "recorder",
    "runs push",
    "probe",
    "ladder scales",
    "tradeoff case",
    "analysis",
    "studies",
    "view",
    "commands",
    "cli",
    "__main__",
]
ONLY_IN = {
    "gmsh": {"mesh"},
    "pyvista": {"view"},
    "matplotlib": {"view"},
    "dolfinx": {"_fenicsx", "forms"},
    "ufl": {"_fenicsx", "forms"},
    "petsc4py": {"_petsc"},
    "slepc4py": {"_petsc"},
    "pint": {"units"},
    "ezdxf": {"drawings"},
    "shapely": {"drawings", "polygons", "snapping"},
}
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer.split()}
MODULES = [path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py"]


def home(path):
    """The module, or the family folder, that a file belongs to."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imported(path):
    """Dotted names of everything a file imports, also inside its functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_downwards(path):
    here = home(path)
    for name in imported(path):
        package, _, rest = name.partition(".")
        if package == "archfem" and rest:
            below = rest.split(".")[0]
            assert below == here or RANK[below] < RANK[here], f"{here} may not import {below}"
        assert here in ONLY_IN.get(package, {here}), f"{package} is kept out of {here}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_modules_are_small_and_say_what_they_are(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 330
    assert ast.get_docstring(ast.parse(text))


def test_public_names_are_few_and_load():
    values = {name: value for name, value in vars(archfem).items() if name[0] != "_"}
    ours = {
        name for name, value in values.items() if "archfem." in getattr(value, "__module__", "")
    }
    assert len(ours | set(archfem._LATER)) <= 51
    for name, module in archfem._LATER.items():
        assert getattr(archfem, name).__module__ == f"archfem.{module}"
        # A module of the same name would take the place of what it holds.
        assert not (ROOT / f"{name}.py").exists()


def test_importing_archfem_leaves_slow_libraries_alone():
    slow = {"scipy.signal", "scipy.stats", "numba", "matplotlib", "pint", "gmsh", "pyvista"}
    slow |= {"shapely", "ezdxf"}
    script = f"import sys, archfem; print(*({slow} & set(sys.modules)))"
    ran = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert ran.stdout.split() == []


def test_masonry_side_needs_no_fenicsx():
    """Structures, motions and the rigid model's kinematics, where FEniCSx and PETSc are barred."""
    script = """
import sys
for name in ("dolfinx", "petsc4py", "mpi4py", "gmsh", "ufl"):
    sys.modules[name] = None
import archfem as af
from archfem import criteria, limit, mechanism, resultants, rigid_joints
from archfem.discretisation import Discretisation
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
assert rigid_joints.rigid_joints(ring, 4, rigid_joints.Quadrature()).opening.shape == (162, 51)
assert af.Motion.synthetic(duration=2.0, seed=1).pga > 0
assert Discretisation("faces", (2, 2)).rule.count(1) == 3
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_rigid_model_needs_no_dolfinx():
    script = """
import sys
for name in ("dolfinx", "gmsh", "ufl"):
    sys.modules[name] = None
import archfem as af
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
assert abs(af.dead_load(af.build(ring, fidelity="rigid")).joints["N"].values.min() - 21.6e3) < 500
"""
    subprocess.run([sys.executable, "-c", script], check=True)
