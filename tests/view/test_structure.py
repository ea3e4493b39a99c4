"""Pictures of structures show states by the criteria, at the joints, with units."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import APART, HINGES, WEIGHT, drawn, history, resultants

import archfem as af
from archfem.view import draw_backbones, draw_instants, draw_structure


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


def test_a_long_structure_takes_a_flat_page(ring, bridge):
    """A page of A4 prints 170 mm."""
    pages = [draw_structure(each).get_size_inches() for each in (ring, bridge)]
    assert [wide for wide, _ in pages] == [170.0 / 25.4] * 2
    assert pages[1][1] < 2.5 < pages[0][1]


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


def test_a_count_without_a_motion_is_stated(ring):
    """Four hinges at one face permit no motion (Heyman, 1966); at alternating faces they do."""

    def hinged(sides):
        rows = np.tile([WEIGHT, 0.0, 0.0], (18, 1))
        for number, side in sides.items():
            rows[number, 2] = 0.48 * side * WEIGHT * ring.joints[number].depth
        return af.joints.joint_dataset(ring, rows)

    states = {
        "one face": hinged({1: 1.0, 6: 1.0, 11: 1.0, 16: 1.0}),
        "both": hinged({0: -1.0, 6: 1.0, 12: -1.0, 17: 1.0}),
        "three": hinged({0: -1.0, 6: 1.0, 12: -1.0}),
    }
    figure = draw_instants({name: (ring, joints) for name, joints in states.items()})
    assert [axes.get_title() for axes in figure.axes] == [
        "one face: 4 failed joints; no motion verified",
        "both: 4 failed joints; local mechanism verified",
        "three",
    ]


def pieces(figure, name):
    """Segments of a line of a picture (n, 2, 2)."""
    return drawn(figure, name).get_xydata().reshape(-1, 3, 2)[:, :2]


def test_backbones_join_the_extreme_thrust_of_neighbouring_joints(ring):
    """e is 0.3, then -0.3: the band reaches over 0.6 of the depth at both ends of each stone."""
    run = af.History(history(ring, 0.3).dataset, ring)
    dead = af.joints.joint_dataset(ring, np.tile([WEIGHT, 0.0, 0.0], (18, 1)))
    figure = draw_backbones(run, dead=dead)
    reach = 0.3 * ring.depths[:, None] * ring.tangents
    low, high = ring.middles - reach, ring.middles + reach
    corners = np.stack([low[:-1], high[:-1], high[1:], low[1:]], axis=1)
    bands = [path.vertices[:4] for path in drawn(figure, "band").get_paths()]
    assert np.array(bands) == pytest.approx(corners)
    sides = np.stack([corners[:, [0, 3]], corners[:, [1, 2]]], axis=1).reshape(-1, 2, 2)
    assert pieces(figure, "backbones") == pytest.approx(sides)
    middles = np.stack([ring.middles[:-1], ring.middles[1:]], axis=1)
    assert pieces(figure, "dead load") == pytest.approx(middles)
    assert figure.axes[0].get_title() == f"{ring.name}: thrust lines from 0 to 1 s"


def test_backbones_have_hinges_and_gaps_of_all_instants(ring, run):
    run = af.History(run.dataset, ring)
    figure = draw_backbones({"one": run, "other": run})
    intrados = [ring.joints[number].intrados for number, e in HINGES.items() if e < 0.0]
    extrados = [ring.joints[number].extrados for number, e in HINGES.items() if e > 0.0]
    hinges = drawn(figure, "hinges").get_xydata()
    assert hinges == pytest.approx(np.array([*intrados, *extrados]))
    assert pieces(figure, "gaps") == pytest.approx(np.array([ring.joints[n].ends for n in APART]))
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "hinge at some instant" in names
    assert len(figure.axes) == 2


def test_backbones_need_structures(ring, run):
    with pytest.raises(af.InvalidInput, match="0 of 1 runs have a structure to draw"):
        draw_backbones(run)
    with pytest.raises(af.InvalidInput, match="0 of 0 runs have a structure"):
        draw_backbones({})
    one = {"one": af.History(run.dataset, ring)}
    with pytest.raises(af.InvalidInput, match=r"of \['two'\], but the runs are \['one'\]"):
        draw_backbones(one, dead={"two": run.joints.isel(time=0)})
