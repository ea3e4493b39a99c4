"""Chains and friction cones of the linear programme, against the same programme written in full."""

from dataclasses import replace
from itertools import pairwise
from time import process_time

import numpy as np
import pytest
from kinematics import gaps
from scipy import sparse
from scipy.optimize import linprog

import archfem as af
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.self_weight import self_weight_programme

SIDEWAYS = af.BodyForce(1.0)


def contact(friction=0.6, cohesion=0.0):
    return af.Contact(1.48e9, 0.3e9, friction=friction, cohesion=cohesion)


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**(given | changes))


def bonded_wall(courses, stones, breadth=0.4, height=0.2):
    """Build courses in running bond on rock; every other course ends in half stones."""
    length = stones * breadth
    outlines = [(-1.0, length + 1.0, -height, 0.0)]
    for course in range(courses):
        cuts = np.arange(stones + 1) * breadth
        if course % 2:
            cuts = np.array([0.0, *(cuts[:-1] + 0.5 * breadth), length])
        levels = (course * height, (course + 1) * height)
        outlines += [(*span, *levels) for span in pairwise(cuts.tolist())]
    blocks = [
        af.Block(((a, b), (c, b), (c, d), (a, d)), af.STONE, f"stone {k}", fixed=k == 0)
        for k, (a, c, b, d) in enumerate(outlines)
    ]
    return af.masonry.assembled(blocks, lambda a, b: contact(0.65))


def factor_in_full(structure, live):
    """Collapse factor with N, V and M of every joint for unknowns, in N and m."""
    blocks, joints = RigidBlocks(structure), len(structure.joints)
    half, one, none = structure.depths / 2.0, sparse.identity(joints), None
    friction, cohesion = structure.friction, structure.cohesion
    slides = np.isfinite(friction)
    # |M| <= N h/2 and |V| <= c A + μ N as rows, equilibrium of each block as an equation
    slope, shear = sparse.diags(np.where(slides, friction, 0.0)), sparse.diags(1.0 * slides)
    arm = sparse.diags(half)
    rows = sparse.bmat(
        [[-arm, none, one], [-arm, none, -one], [-slope, shear, none], [-slope, -shear, none]]
    )
    ends = sparse.bmat(
        [
            [0.5 * one, none, sparse.diags(-0.5 / half)],
            [0.5 * one, none, sparse.diags(0.5 / half)],
            [none, one, none],
        ]
    )
    load = -blocks.dimensionless(RigidBlocks(structure).load([live]))[:, None]
    found = linprog(
        np.concatenate([np.zeros(3 * joints), [-1.0]]),
        A_ub=sparse.hstack([rows, sparse.csr_matrix((4 * joints, 1))], "csr"),
        b_ub=np.concatenate([np.zeros(2 * joints), np.tile(cohesion / blocks.force_unit, 2)]),
        A_eq=sparse.hstack([blocks.balance @ ends, load], "csr"),
        b_eq=blocks.dimensionless(RigidBlocks(structure).load([af.BodyForce(0.0, -1.0)])),
        bounds=[(None, None)] * (3 * joints) + [(0.0, None)],
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert found.status == 0, found.message
    return -found.fun


STRUCTURES = {
    "ring": ring(),
    "slick ring": ring(contact=contact(0.31)),
    "ring that never slides": ring(contact=contact(None)),
    "ring with cohesion": ring(contact=contact(0.3, 5e3)),
    "column": af.column(breadth=0.6, heights=[0.8, 0.8, 0.8]),
    "arch on piers": af.shapes.buttressed_arch(
        measured="centre line",
        span=5.0,
        thickness=0.6,
        voussoirs=15,
        breadth=2.0,
        height=2.4,
        embrace=140.0,
    ),
    "wall": bonded_wall(4, 4),
}
# built where it is tested: every worker imports this file
LARGE_WALL = pytest.param(lambda: bonded_wall(16, 14), id="wall by the interior point")


@pytest.mark.parametrize(
    "structure",
    [
        *(pytest.param(each, id=name) for name, each in STRUCTURES.items()),
        pytest.param(*LARGE_WALL.values, id=LARGE_WALL.id, marks=pytest.mark.slow),
    ],
)
def test_reduced_programmes_have_the_factor_of_the_full_one(structure):
    """Both are solved to 1e-9 block weights or better, and multiply that by some ten of them."""
    structure = structure() if callable(structure) else structure
    found = af.collapse_factor(structure, live=SIDEWAYS)
    assert found.factor == pytest.approx(factor_in_full(structure, SIDEWAYS), rel=1e-8)


@pytest.mark.parametrize(
    "structure",
    [
        *(STRUCTURES[name] for name in ("ring", "slick ring", "arch on piers", "wall")),
        LARGE_WALL,
    ],
)
def test_motions_of_eliminated_blocks_do_the_work_of_the_factor(structure):
    """Kinematic theorem: joints nowhere close, and the loads do no work at the factor."""
    structure = structure() if callable(structure) else structure
    found = af.collapse_factor(structure, live=SIDEWAYS)
    motion = found.motion[list(structure.free)].ravel()
    dead, live = (
        RigidBlocks(structure).load([load]) @ motion for load in (af.BodyForce(0.0, -1.0), SIDEWAYS)
    )
    intrados, extrados, slip = np.moveaxis(gaps(structure, found.motion), -1, 0)
    assert np.minimum(intrados, extrados) == pytest.approx(
        np.maximum(np.minimum(intrados, extrados), structure.friction * np.abs(slip)), abs=1e-9
    )
    assert -dead / live == pytest.approx(found.factor, rel=1e-8)


@pytest.mark.slow
def test_large_walls_and_rings_take_seconds():
    """A wall of 975 stones and a ring of 3000: 4 s and 0.3 s here, 30 and 10 s in full."""
    for structure, limit in ((bonded_wall(30, 32), 10.0), (ring(voussoirs=3000), 3.0)):
        start = process_time()
        found = af.collapse_factor(structure, live=SIDEWAYS)
        assert found.outcome == "collapses"
        assert process_time() - start < limit


@pytest.mark.parametrize(
    ("structure", "different"), [(ring(), 6), (bonded_wall(3, 3), 7)], ids=["ring", "wall"]
)
def test_kept_parts_of_a_programme_serve_other_loads_and_costs(structure, different):
    """Each optimum is that of blocks on which nothing was solved before, to the last digit.

    The ring hinges: more cohesion does not change its factor.
    """
    _, dead = self_weight_programme(structure, "coulomb", None, None)
    programme = dead.with_load_factor(RigidBlocks(structure).load([SIDEWAYS]))
    weights = np.random.default_rng(1).random(3 * len(structure.joints))
    changes = (
        {},
        {"load": 2.0 * programme.load},
        {"force_cost": weights},
        {"cohesion": programme.cohesion + 0.1},
        {"friction": 0.5 * programme.friction},
        {"upper_bounds": np.array([0.05])},
        {"columns": 3.0 * programme.columns},
    )
    values = []
    for change in (*changes, *changes):
        kept = replace(programme, **change).solve()
        fresh = replace(programme, blocks=RigidBlocks(structure), **change).solve()
        np.testing.assert_array_equal(kept.forces, fresh.forces)
        np.testing.assert_array_equal(kept.multipliers, fresh.multipliers)
        np.testing.assert_array_equal(kept.unknowns, fresh.unknowns)
        values.append(kept.value)
    assert len({round(value, 9) for value in values}) == different
