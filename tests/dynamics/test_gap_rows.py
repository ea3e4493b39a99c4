"""Rows of gaps from which those of all points follow, and the joint law on them."""

import numpy as np
import pytest
from kernels import from_python

import archfem as af
from archfem.dynamics.solvers import joint_law as law_kernels
from archfem.dynamics.solvers.joint_law import (
    gap_rows,
    joint_law,
    open_forces,
)
from archfem.dynamics.solvers.newmark import step_numbers

collect_released = from_python(law_kernels.collect_released)
evaluate_openings = from_python(law_kernels.evaluate_openings)

CELLS = 4


def rubbing(fidelity, rule):
    """A ring whose joints slide, with its supports moved."""
    contact = af.Contact(1.48e9, 0.3e9, 0.6)
    arch = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, contact=contact
    )
    model = af.build(arch, fidelity=fidelity, cells=(CELLS, 2), quadrature=rule)
    return model.settled(af.Settlement(0, (2e-3, -1e-3, 1e-3)))


@pytest.mark.parametrize("rule", ["exact", "lobatto", "gauss"])
@pytest.mark.parametrize("fidelity", ["rigid", "faces", "condensed"])
def test_gaps_at_all_points_follow_from_the_rows(fidelity, rule):
    """Gaps agree to rounding of the coordinates, here metres; supports moved by millimetres."""
    joints = rubbing(fidelity, rule).operator
    rows = gap_rows(joints)
    q = np.random.default_rng(1).standard_normal(joints.opening.shape[1])
    gaps = rows.rows @ q + rows.offset
    near, far = gaps[rows.near[rows.segment]], gaps[rows.far[rows.segment]]
    found = (1.0 - rows.share) * near + rows.share * far
    assert found == pytest.approx(joints.openings(q), abs=1e-12)
    assert gaps[rows.group] == pytest.approx(joints.slips(q), abs=1e-12)


@pytest.mark.parametrize(
    ("fidelity", "rule", "each"),
    [
        ("rigid", "exact", 2),
        ("rigid", "gauss", 2),
        ("faces", "exact", 2),
        ("condensed", "exact", 5),
    ],
)
def test_rows_are_as_few_as_the_faces_allow(fidelity, rule, each):
    """Two openings a joint between plane faces; else one wherever two facets meet."""
    joints = rubbing(fidelity, rule).operator
    assert gap_rows(joints).openings == each * joints.points.joint_count


# kernels are compiled anew where tests call them from Python; `test_ladder` compares histories
@pytest.mark.slow
@pytest.mark.parametrize("rule", ["exact", "lobatto"])
@pytest.mark.parametrize("fidelity", ["rigid", "condensed"])
def test_forces_at_an_instant_are_those_of_the_operator(fidelity, rule):
    """Normal forces of points, half of them open, and forces that open joints release; two ways."""
    contact = af.Contact(1.48e9, 0.3e9, None)
    arch = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, contact=contact
    )
    joints = af.build(arch, fidelity=fidelity, cells=(CELLS, 2), quadrature=rule).operator
    numbers = step_numbers(0.005, (0.25, 0.5, 0.0), 1e-3, 0.0)
    law, rows, _ = joint_law(joints, numbers, 0.005, conserving=False)
    q = np.random.default_rng(1).standard_normal(joints.opening.shape[1])
    gap = rows @ q
    released, same = np.zeros((2, len(gap)))
    selection = np.arange(len(gap)), np.arange(len(law.segments)), np.arange(0)
    evaluate_openings(law, gap, selection[1])
    expected = joints.law.forces(joints.openings(q))
    assert 0.2 < np.mean(expected == 0.0) < 0.8
    assert law.point_states["normal"] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    collect_released(law, selection, released)
    from_python(open_forces)(law, gap, same)
    assert released == pytest.approx(same, abs=1e-12 * np.abs(same).max())


@pytest.mark.parametrize("part", np.geomspace(1e-9, 1e-5, 5))
def test_a_facet_that_opens_by_a_little_releases_as_little(part, each_way):
    """An opening so small that the integral at its nearer end is all rounding."""
    stone = af.column(breadth=1.0, heights=[1.0], contact=af.Contact(1e9, 3e8, None))
    joints = af.build(stone, fidelity="rigid", quadrature="exact").operator
    numbers = step_numbers(0.005, (0.25, 0.5, 0.0), 0.0, 0.0)
    law, _, _ = joint_law(joints, numbers, 0.005, conserving=False)
    gap, released = np.array([-1.0, part / (1.0 - part)]), np.zeros(2)
    each_way(open_forces)(law, gap, released)
    assert (released >= 0.0).all()
    assert released.max() <= 2.0 * part * 1e9
