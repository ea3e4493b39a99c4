"""Pictures of structures show states by the criteria, at the joints, with units."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import APART, HINGES, WEIGHT, drawn, resultants

import archfem as af
from archfem.view import draw_instants, draw_structure


def test_hinges_are_drawn_by_the_criteria_given_or_carried(ring, joints):
    sharp = af.Criteria(hinge=0.47, friction=2.0)
    for figure in (
        draw_structure(ring, joints, criteria=sharp),
        draw_structure(ring, af.joints.joint_dataset(ring, resultants(ring), criteria=sharp)),
    ):
        assert len(drawn(figure, "hinges").get_xydata()) == 2
        assert drawn(figure, "slips") is None


def test_each_hinge_is_a_circle_at_the_face_in_contact(ring, joints):
    circles = drawn(draw_structure(ring, joints), "hinges").get_xydata()
    assert len(circles) == int((joints["hinge"] != 0).sum()) == 3
    ends = [
        ring.joints[n].extrados if e > 0 else ring.joints[n].intrados for n, e in HINGES.items()
    ]
    assert circles == pytest.approx(np.array(ends))


def test_thrust_line_is_drawn_where_it_is_and_interrupted_at_open_joints(ring, joints):
    line = drawn(draw_structure(ring, joints), "thrust").get_xydata()
    assert line == pytest.approx(af.joints.thrust_line(ring, joints).values, nan_ok=True)
    assert np.flatnonzero(np.isnan(line[:, 0])).tolist() == APART
    pieces = drawn(draw_structure(ring, joints), "links").get_xydata().reshape(-1, 3, 2)[:, :2]
    joined = [k for k in range(17) if k not in APART and k + 1 not in APART]
    assert pieces == pytest.approx(np.array([line[[k, k + 1]] for k in joined]))


def test_sliding_and_open_joints_have_their_own_marks(ring, joints):
    figure = draw_structure(ring, joints)
    assert len(drawn(figure, "slips").get_paths()) == 2 * int(joints["slide"].sum()) == 4
    gaps = drawn(figure, "gaps").get_xydata().reshape(-1, 3, 2)[:, :2]
    assert int(joints["open"].sum()) == len(gaps) == 2
    assert gaps == pytest.approx(np.array([ring.joints[number].ends for number in APART]))


def test_nothing_failed_leaves_only_the_thrust_line(ring):
    still = af.joints.joint_dataset(ring, np.tile([WEIGHT, 0.0, 0.0], (len(ring.joints), 1)))
    figure = draw_structure(ring, still)
    assert [drawn(figure, name) for name in ("hinges", "slips", "gaps")] == [None] * 3
    assert figure.axes[0].get_title() == ring.name


def test_structure_is_drawn_true_to_scale_with_units_and_time(ring, joints):
    figure = draw_structure(ring, joints)
    axes = figure.axes[0]
    assert len(drawn(figure, "blocks").get_paths()) == len(ring.blocks)
    assert axes.get_aspect() == 1.0
    assert "[m]" in axes.get_xlabel()
    assert "[m]" in axes.get_ylabel()
    assert "3.660 s" in axes.get_title()


def test_a_long_structure_has_a_wide_page_and_a_ring_has_not(ring, bridge):
    pages = [draw_structure(each).get_size_inches() for each in (ring, bridge)]
    assert pages[0][0] < 6.5
    assert pages[1][0] > 10.5
    assert pages[1][1] < 4.0


def test_drawing_into_given_axes_returns_their_figure(ring, joints):
    page = Figure()
    left, right = page.subplots(1, 2)
    assert draw_structure(ring, joints, axes=left) is page
    assert len(right.lines) == 0


def test_several_instants_are_refused(ring, run):
    with pytest.raises(af.InvalidInput, match=r"give one instant of the 18 joints"):
        draw_structure(ring, run.joints)


def test_structures_one_below_the_other(runs):
    states = {name: (run.structure, run.joints.isel(time=-1)) for name, run in runs.items()}
    figure = draw_instants({**states, "bare": (states["thin"][0], None)})
    assert [axes.get_title() for axes in figure.axes] == [
        "thick, t = 2.000 s",
        "thin, t = 2.000 s",
        "bare",
    ]
    lines = [[line.get_gid() for line in axes.lines] for axes in figure.axes]
    assert "thrust" in lines[0]
    assert "thrust" not in lines[2]
