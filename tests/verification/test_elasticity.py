"""Is the equation solved? Patch test, ties to the conforming space, manufactured solution."""

from itertools import product

import numpy as np
import pytest
import ufl
from dolfinx import fem
from orders import observed_order
from repeats import each_once
from scipy import sparse
from scipy.sparse.linalg import spsolve

import archfem as af
from archfem.joints.contact_law import is_closed
from archfem.models.fem import _fenicsx
from archfem.models.fem.forms import Forms, plane_stress
from archfem.models.fem.mesh import generate_mesh
from archfem.models.fem.space import build_broken_space, build_joint_operator

RULES = [
    af.joints.Quadrature(),
    af.joints.Quadrature("trapezoidal"),
    af.joints.Quadrature("nodal"),
    af.joints.Quadrature("gauss"),
    af.joints.Quadrature("lobatto", 4),
]


@pytest.mark.parametrize(("cell", "degree"), each_once(("quadrilateral", "triangle"), (1, 2)))
def test_patch(ring, cell, degree):
    """A linear displacement: constant stress, no force inside a block, none across a joint."""
    space = build_broken_space(
        generate_mesh(ring, af.models.Discretisation(cells=(2, 3), cell=cell)), degree
    )
    forms = Forms(space, af.joints.Quadrature())
    gradient = np.array([[1.0, -2.0], [0.5, 3.0]]) * 1e-4
    u = (space.places @ gradient.T).ravel()
    strain = 0.5 * (gradient + gradient.T)
    young, poisson = af.STONE.young, af.STONE.poisson
    plane = young * poisson / (1.0 - poisson**2)
    stress = young / (1.0 + poisson) * strain + plane * np.trace(strain) * np.eye(2)
    found = (forms.stress() @ u).reshape(-1, 3)
    scale = np.abs(stress).max()
    assert np.abs(found - [stress[0, 0], stress[1, 1], stress[0, 1]]).max() < 1e-9 * scale

    force = (forms.force(u)).reshape(-1, 2)
    inside = _inside(space)
    assert inside.any()
    assert np.abs(force[inside]).max() < 1e-9 * np.abs(force).max()
    joints = build_joint_operator(space, af.joints.Quadrature())
    closing = joints.opening @ u[space.free]
    inner = ~np.isin(joints.points.joint, [0, len(ring.joints) - 1])
    assert np.abs(closing[inner]).max() < 1e-15


def _inside(space):
    """Nodes that lie on no edge of their block."""
    count = np.zeros(len(space.places), dtype=int)
    corners = {}
    for cell in space.cells:
        ring_of = [0, 1, 3, 2] if len(cell) in (4, 9) else [0, 1, 2]
        nodes = cell[ring_of]
        for a, b in zip(nodes, np.roll(nodes, -1), strict=True):
            key = (min(a, b), max(a, b))
            corners[key] = corners.get(key, 0) + 1
    for (a, b), seen in corners.items():
        count[[a, b]] += seen == 1
    vertices = np.unique([node for edge in corners for node in edge])
    result = np.zeros(len(space.places), dtype=bool)
    result[vertices] = count[vertices] == 0
    return result


@pytest.mark.parametrize("degree", [1, 2])
def test_broken_space_tied_together_is_the_conforming_one(stack, degree):
    """Bᵀ K_broken B = K_conforming, with B the Boolean matrix that ties nodes at one place."""
    grid = generate_mesh(stack, af.models.Discretisation(cells=(2, 2)))
    space = build_broken_space(grid, degree)
    places, number = np.unique(space.places.round(9), axis=0, return_inverse=True)
    tie = sparse.csr_matrix((np.ones(len(number)), (np.arange(len(number)), number.ravel())))
    tied = sparse.kron(tie, sparse.identity(2)).tocsr()
    broken = Forms(space, af.joints.Quadrature()).stiffness

    whole = _fenicsx.vector_space(grid.grid, "Lagrange", degree, 2)
    u, v = ufl.TrialFunction(whole), ufl.TestFunction(whole)
    form = ufl.inner(
        plane_stress(u, af.STONE.young, af.STONE.poisson), ufl.sym(ufl.grad(v))
    ) * ufl.dx(domain=grid.grid)
    conforming = _fenicsx.assemble_matrix(fem.form(form))
    at = whole.tabulate_dof_coordinates()[:, :2].round(9)
    order = [int(np.flatnonzero(np.all(places == point, axis=1))[0]) for point in at]
    shuffle = np.column_stack([2 * np.array(order), 2 * np.array(order) + 1]).ravel()
    ours = (tied.T @ broken @ tied).tocsr()[shuffle][:, shuffle]
    assert ours.shape == conforming.shape
    assert abs(ours - conforming).max() < 1e-12 * abs(conforming).max()


@pytest.mark.parametrize(
    ("rule", "space"),
    [
        *each_once(RULES, ((1, "quadrilateral"), (2, "triangle"))),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in product(RULES, ((1, "triangle"), (2, "quadrilateral")))
        ),
    ],
    ids=lambda each: f"{each.rule}{each.points or ''}" if hasattr(each, "rule") else str(each),
)
def test_operator_equals_forms(ring, rule, space, verified):
    """Force and tangent of the sparse products and of the compiled UFL forms."""
    from archfem.models.reference import build_full_model

    degree, cell = space
    space = build_broken_space(
        generate_mesh(ring, af.models.Discretisation(cells=(3, 2), cell=cell)), degree
    )
    forms, model = Forms(space, rule), build_full_model(space, rule)
    random = np.random.default_rng(7)
    q = 1e-4 * random.standard_normal(model.size)  # about half of the points open
    everywhere = np.zeros(2 * len(space.places))
    everywhere[space.free] = q
    force = forms.force(everywhere)[space.free]
    tangent = forms.tangent(everywhere)[space.free][:, space.free]
    closed = is_closed(model.operator.effective_gaps(q))
    assert 0.3 < closed.mean() < 0.7
    assert np.abs(model.force(q) - force).max() < 1e-12 * np.abs(force).max()
    assert abs(model.tangent(q) - tangent).max() < 1e-12 * abs(tangent).max()
    off = max(
        np.abs(model.force(q) - force).max() / np.abs(force).max(),
        abs(model.tangent(q) - tangent).max() / abs(tangent).max(),
    )
    case = "operator path, force and tangent: cells, degrees, rules"
    verified(case, "equal", "compiled UFL forms", "equal", difference=off)


ALPHA, BETA = 1e-4, 3e-4


def exact(x, z, sin, cos):
    """Displacements below and above a joint at z = 0 across which they jump by its springs.

    Below, u = (α sin x (1 + z)², -β (2 + cos x) z). Above, a field is added whose stress vanishes
    on the joint and which there equals (σ_xy / k_s, σ_yy / k_n). Written for NumPy and for UFL.
    """
    young, poisson = af.STONE.young, af.STONE.poisson
    a0 = young / (1.0 + poisson) * ALPHA / af.masonry.STONE_TO_STONE.shear_stiffness
    c0 = young / (1.0 - poisson**2) / af.masonry.STONE_TO_STONE.normal_stiffness
    b = c0 * (-BETA * (2.0 + cos(x)) + poisson * ALPHA * cos(x))
    db = c0 * (BETA - poisson * ALPHA) * sin(x)
    below = (ALPHA * sin(x) * (1.0 + z) ** 2, -BETA * (2.0 + cos(x)) * z)
    above = (below[0] + a0 * sin(x) - z * db, below[1] + b - z * poisson * a0 * cos(x))
    return below, above


def jump_error(cells, degree, cell):
    """L2 error of the displacement on a mesh of so many cells a side, relative to its size."""
    grid = generate_mesh(
        af.column(breadth=1.0, heights=[1.0, 1.0]),
        af.models.Discretisation(cells=(cells, cells), cell=cell),
    )
    space = build_broken_space(grid, degree)
    x = ufl.SpatialCoordinate(grid.grid)
    fields = [ufl.as_vector(u) for u in exact(x[0], x[1] - 1.0, ufl.sin, ufl.cos)]
    number = np.arange(len(grid.blocks), dtype=np.int32)
    tags = _fenicsx.tag_entities(grid.grid, 2, number, grid.blocks)
    dx = ufl.Measure("dx", domain=grid.grid, subdomain_data=tags)
    parts = [dx(k, metadata={"quadrature_degree": 8}) for k in (1, 2)]

    v = ufl.TestFunction(space.functions)
    forces = [
        ufl.inner(-ufl.div(plane_stress(u, af.STONE.young, af.STONE.poisson)), v) for u in fields
    ]
    load = _fenicsx.assemble_vector(
        fem.form(sum(force * part for force, part in zip(forces, parts, strict=True)))
    )
    pressed = np.zeros((len(space.places), 2))
    pressed[:, 1] = -1e-3 * space.owner  # the higher a block the lower it sits: joints are closed
    tangent = Forms(space, af.joints.Quadrature()).tangent(pressed.ravel())

    px, py = space.places.T
    below, above = exact(px, py - 1.0, np.sin, np.cos)
    values = np.where((space.owner == 2)[:, None], np.stack(above, 1), np.stack(below, 1)).ravel()
    edge = (np.abs(np.abs(px) - 0.5) < 1e-9) | (py < 1e-9) | (py > 2.0 - 1e-9)
    held, free = np.repeat(edge, 2), ~np.repeat(edge, 2)
    rest = load - tangent[:, held] @ values[held]
    values[free] = spsolve(tangent[free][:, free].tocsc(), rest[free])

    found = fem.Function(space.functions)
    found.x.array[:] = values
    error, size = (
        sum(fem.assemble_scalar(fem.form(ufl.inner(w, w) * part)) for w, part in terms)
        for terms in (
            [(found - u, part) for u, part in zip(fields, parts, strict=True)],
            list(zip(fields, parts, strict=True)),
        )
    )
    return np.sqrt(error / size)


@pytest.mark.parametrize(
    ("degree", "cell", "bound"),
    [
        pytest.param(1, "quadrilateral", 1.5e-4, marks=pytest.mark.slow),
        pytest.param(1, "triangle", 1.7e-4, marks=pytest.mark.slow),
        pytest.param(2, "quadrilateral", 5e-7, marks=pytest.mark.slow),
        (2, "triangle", 7e-7),
    ],
)
def test_manufactured_solution_with_a_jump(degree, cell, bound, verified):
    """Order degree + 1 in L2, within 0.1, and a bound on the finest error itself."""
    cells = np.array([4, 8, 16])
    errors = [jump_error(int(n), degree, cell) for n in cells]
    assert observed_order(1.0 / cells, errors)[-1] == pytest.approx(degree + 1, abs=0.1)
    assert errors[-1] < bound
    case = f"manufactured solution with a jump, {cell}s of degree {degree}: order in L2"
    order = observed_order(1.0 / cells, errors)[-1]
    off = abs(order / (degree + 1) - 1.0)
    verified(case, degree + 1, "theory", round(order, 2), difference=off)
