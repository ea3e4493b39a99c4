"""Rows of gaps: how few tell those of all points, and that they tell them right."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.stepping.gap_rows import gap_rows

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
    """To rounding of the coordinates, here metres; supports have moved by millimetres."""
    joints = rubbing(fidelity, rule).operator
    rows = gap_rows(joints)
    q = np.random.default_rng(1).standard_normal(joints.opening.shape[1])
    gaps = rows.rows @ q + rows.offset
    near, far = gaps[rows.near[rows.stretch]], gaps[rows.far[rows.stretch]]
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
    assert gap_rows(joints).openings == each * joints.points.count
