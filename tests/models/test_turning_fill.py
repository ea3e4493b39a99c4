"""Large motion of stones that bend and of fill: joints in pieces, a fill that does not turn."""

import logging

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import archfem as af

SOIL = {"backfill": "full", "rest": "rigid"}

CASES = [
    ("ring", "condensed"),
    ("ring", "full"),
    ("bridge", SOIL),
    ("bridge", {"backfill": "full", "rest": "faces"}),
    ("bridge", "full"),
]
HALF = [*CASES[::2], *(pytest.param(*each, marks=pytest.mark.slow) for each in CASES[1::2])]
"""All of them, every second one of which is slow."""


@pytest.fixture(autouse=True)
def quiet(caplog):
    caplog.set_level(logging.ERROR)


@pytest.fixture(scope="module")
def structures():
    """A ring, and one under a fill."""
    arch = af.shapes.Arch(
        measured="centre line", span=4.0, embrace=159.0, thickness=0.5, voussoirs=7, name="arch"
    )
    return {
        "ring": af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, chords=1),
        "bridge": af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4)),
    }


def leaning(model):
    """Coordinates under weight that leans, with all joints closed: some would open, or slide."""
    small = model.small
    return spsolve(small.closed_tangent().tocsc(), small.load(af.BodyForce(0.6, -1.0)))


@pytest.mark.parametrize(("name", "fidelity"), HALF)
def test_small_motions_give_the_model_of_small_displacements(structures, name, fidelity):
    """The difference is of second order: it falls with the motion."""
    model = af.build(structures[name], fidelity=fidelity, displacements="large", cells=(2, 2))
    small, whole = model.small, leaning(model)
    for part, most in ((1e-3, 1e-5), (1e-7, 1e-9)):
        q = part * whole
        for found, known in (
            (model.force(q), small.force(q)),
            (model.resultants(q), small.resultants(q)),
            (model.tangent(q).toarray(), small.tangent(q).toarray()),
            (model.energy(q), small.energy(q)),
        ):
            assert np.abs(found - known).max() < most * np.abs(known).max()


@pytest.mark.parametrize("fidelity", ["faces", "condensed", "full"])
def test_strained_blocks_that_turn_together_stay_as_strained(structures, fidelity):
    """By a radian: the forces between them do not change."""
    model = af.build(structures["ring"], fidelity=fidelity, displacements="large", cells=(2, 2))
    q = leaning(model)
    turned, angle = q.copy(), 1.0
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for block, first in zip(model.structure.free, model.block_starts[:-1], strict=True):
        place = model.centres[block] + q[first : first + 2]
        turned[first : first + 2] = spin @ place - model.centres[block]
        turned[first + 2] += angle
    free = np.isin(model.structure.pairs, model.structure.free).all(axis=1)
    found, known = (model.resultants(each)[free] for each in (turned, q))
    np.testing.assert_allclose(found, known, atol=1e-8 * np.abs(known).max())


def test_a_load_on_a_body_that_does_not_turn_is_linear(structures):
    """Its work is a linear function of the coordinates, however large."""
    model = af.build(structures["bridge"], fidelity=SOIL, displacements="large", cells=(2, 2))
    push = af.PointLoad(0.5 * model.structure.size, (2e3, -3e3))
    q = np.random.default_rng(4).normal(size=model.size)
    number, place = push.place(model.structure)
    assert model.structure.blocks[number].part == "backfill"
    rows = model.small.cells.displacement_rows(number, place)
    assert model.work(push, q) == pytest.approx(rows.toarray() @ q @ push.force)
    assert model.load(push, q) == pytest.approx(rows.T @ np.array(push.force))
    assert model.load_rate(push, q).nnz == 0


@pytest.mark.parametrize(("name", "fidelity"), HALF)
def test_the_tangent_of_a_step_is_the_derivative_of_its_force(structures, name, fidelity):
    """By central differences in one direction, of a step by which joints open and slide.

    Gauss's rule is not exact on facets that open on the way, and by a little less so for rates.
    """
    model = af.build(structures[name], fidelity=fidelity, displacements="large", cells=(2, 2))
    rng, begin = np.random.default_rng(1), leaning(model)
    size = np.abs(begin).max()
    end = begin + 0.3 * size * rng.normal(size=model.size)
    passage, way = model.begin_step(begin, 0.1), rng.normal(size=model.size)
    step = 1e-6 * size
    difference = passage.force(end + step * way) - passage.force(end - step * way)
    rate = passage.tangent(end) @ way
    assert np.abs(difference / (2.0 * step) - rate).max() < 1e-3 * np.abs(rate).max()


@pytest.mark.parametrize(
    ("name", "fidelity"), [CASES[0], pytest.param(*CASES[2], marks=pytest.mark.slow)]
)
def test_energy_is_kept(structures, name, fidelity):
    """Without damping: the work of the ground is stored, kinetic, or lost by friction."""
    model = af.build(structures[name], fidelity=fidelity, displacements="large", cells=(2, 2))
    shake = af.Motion.synthetic(duration=0.5, pga=4.0, seed=3)
    run = af.time_history(model, shake, dt=0.005)
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-7
    assert run.fall is not None
    assert run.fall.kind == "stands"


def test_springs_between_faces_that_bend_are_refused(structures):
    with pytest.raises(af.InvalidInput, match="exact quadrature"):
        af.build(
            structures["ring"],
            fidelity="full",
            cells=(2, 2),
            quadrature="nodal",
            displacements="large",
        )


def test_a_fill_hands_over_its_momentum(structures):
    """It falls as one body, which moves as its mass does on the mean."""
    from archfem.dynamics import State, release_blocks

    model = af.build(structures["bridge"], fidelity=SOIL, displacements="large", cells=(2, 2))
    number = model.structure.block_number("backfill")
    own = slice(*model.block_starts[list(model.structure.free).index(number) :][:2])
    velocity = np.zeros(model.size)
    velocity[own] = np.random.default_rng(0).normal(size=own.stop - own.start)
    found = release_blocks(model, State(0.0, np.zeros(model.size), velocity, np.zeros(model.size)))
    momentum = model.mass_influence.T @ velocity
    block = model.structure.blocks[number]
    mass = model.structure.density(block) * model.structure.width * block.area
    held = mass * found.start.velocities[number, :2]
    turn = found.start.velocities[number, 2]
    assert held == pytest.approx(momentum, rel=1e-3, abs=1e-3 * mass * abs(turn))


def test_slip_of_faces_is_stated_in_facets():
    """A stone whose face may bend, moved along its bed: over facets of 0.3 m, to either side."""
    tower = af.column(breadth=0.6, heights=[0.5, 0.5])
    model = af.build(tower, fidelity="full", displacements="large", cells=(2, 1))
    first = int(model.cells.turns[model.cells.block == 2][0]) - 2
    for slip in (0.06, -0.06):
        q = np.zeros(model.size)
        q[first] = slip
        assert model.face_mismatch(q) == (pytest.approx(0.2), "joint 1")
    plane = af.build(tower, fidelity="rigid", displacements="large")
    assert plane.face_mismatch(np.full(plane.size, 0.1)) == (0.0, "")


@pytest.mark.slow
def test_one_triangle_on_each_stone_leaves_no_facets_to_slide():
    """Quadrilaterals have two facets or more on each stone, at any number of cells."""
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=11)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)
    fidelity = {"backfill": "full", "rest": "rigid"}
    meshes = {"quadrilateral": {(4, 4): 4, (2, 2): 2, (1, 1): 2}, "triangle": {(1, 1): 0}}
    for cell, facets in meshes.items():
        for cells, count in facets.items():
            model = af.build(
                bridge, fidelity=fidelity, displacements="large", cells=cells, cell=cell
            )
            assert model.joints.face_law.paired.sum() == 11 * count
    assert model.face_mismatch(np.full(model.size, 0.1)) == (0.0, "")
