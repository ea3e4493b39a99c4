"""Pictures are saved whole."""

import re
import struct
from dataclasses import replace
from html import escape
from io import BytesIO
from itertools import combinations
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from pictures import history

import archfem as af
from archfem.view import save
from archfem.view.style import (
    Colour,
    Page,
    add_legend,
    new_figure,
    set_title,
    structure_axes,
    structure_figure,
    write_name,
)


@pytest.mark.parametrize(
    ("suffix", "start"),
    [(".png", b"\x89PNG"), pytest.param(".pdf", b"%PDF", marks=pytest.mark.slow)],
)
def test_a_figure_is_saved_whole(ring, low_resolution, tmp_path, suffix, start):
    path = save(af.view.draw_structure(ring), tmp_path / "new" / f"ring{suffix}")
    assert path.read_bytes().startswith(start)
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_a_vector_graphic_is_the_same_at_every_run(ring, tmp_path):
    paths = [save(af.view.draw_structure(ring), tmp_path / f"{name}.svg") for name in "ab"]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert b"<dc:date>" not in paths[0].read_bytes()


def test_coordinates_of_a_survey_are_shown_whole():
    outlines = (((45230.0 + x, y) for x, y in ((0, z), (2, z), (2, z + 1), (0, z + 1)))
                for z in (237.0, 238.0))  # fmt: skip
    rock, stone = (af.Block(tuple(x), af.STONE, n) for x, n in zip(outlines, "ab", strict=True))
    made = af.masonry.assembled([replace(rock, fixed=True), stone], af.Contact(1e9, 4e8))
    figure = af.view.draw_structure(made)
    figure.draw_without_rendering()
    axis = figure.axes[0].xaxis
    assert axis.get_major_formatter().get_offset() == ""
    assert "45231" in " ".join(each.get_text() for each in axis.get_ticklabels())


def test_an_unknown_suffix_is_refused(ring, tmp_path):
    with pytest.raises(af.InvalidInput, match=r"suffix '\.xyz': use one of .*'png'"):
        save(af.view.draw_structure(ring), tmp_path / "ring.xyz")
    assert list(tmp_path.iterdir()) == []


def test_a_title_is_words_and_no_formula(tmp_path):
    figure = structure_figure(af.column(breadth=1.0, heights=[1.0]))
    figure.subplots().set_title("$$ a bridge worth $5 {")
    assert save(figure, tmp_path / "dear.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("worth $5 or $6", marks=pytest.mark.slow),
        "a $\\frac{ bridge",
        "back\\slash_{x}",
    ],
)
def test_names_are_words_wherever_they_are_drawn(name, tmp_path):
    """Also where matplotlib writes the page itself, as notebooks do."""
    stones = replace(af.column(breadth=1.0, heights=[1.0]), name=name)
    page = af.view.draw_structure(stones)
    page.savefig(tmp_path / "page.svg")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        page.savefig(tmp_path / "page.svg")
    assert escape(name) in (tmp_path / "page.svg").read_text(encoding="utf-8")


def test_powers_of_ten_at_an_axis_and_letters_of_a_legend_need_no_mathematical_fonts(
    ring, low_resolution, monkeypatch, tmp_path
):
    """Those of matplotlib may be missing, which took 21 lines of a log."""

    def refuse(*_, **options):
        raise AssertionError("mathematical text")

    monkeypatch.setattr("matplotlib.mathtext.MathTextParser.parse", refuse)
    page = Page()
    left, right = page.subplots(1, 2)
    left.set(yscale="log", ylim=(1e-3, 1e3), title="worth $5 or $6")
    right.set(yscale="log", ylim=(2.0, 30.0))
    page.savefig(tmp_path / "page.png")
    written = [text.get_text() for text in left.get_yticklabels()]
    assert written[1:-1] == ["10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹", "10²", "10³"]
    assert right.get_yticklabels(minor=True)[0].get_text() == "2×10⁰"
    save(af.view.draw_dead_load(af.dead_load(af.build(ring, fidelity="rigid"))), tmp_path / "d.png")


def boxes_of_marks(axes):
    """Boxes of the marks of a line of hinges [pixels]."""
    half = 0.4 * axes.lines[0].get_markersize() * axes.figure.dpi / 72.0
    places = axes.transData.transform(axes.lines[0].get_xydata())
    return [Bbox([place - half, place + half]) for place in places]


def test_names_beside_points_cover_neither_each_other_nor_hinges():
    """Three near hinges of one stone, and a fourth at the edge of the axes."""
    stones = af.column(breadth=4.0, heights=[1.0, 1.0])
    axes = structure_axes(stones)
    places = {"stone 1": 0.0, "7": 0.12, "base": 0.24, "stone 22": -2.0}
    axes.plot([*places.values()], [1.0] * 4, "o", ms=7.0)
    names = [write_name(axes, name, (x, 1.0), (-1.0, 0.0)) for name, x in places.items()]
    for kind, covered in (("at", True), ("beside", False)):
        for name in names:
            name.set_gid(kind)
        axes.figure.draw_without_rendering()
        boxes, marks = [name.get_window_extent() for name in names], boxes_of_marks(axes)
        pairs = [*combinations(boxes, 2), *((box, mark) for box in boxes for mark in marks)]
        assert any(a.overlaps(b) for a, b in pairs) is covered
    assert all(axes.bbox.containsx(x) for box in boxes for x in (box.x0, box.x1))
    placed = [name.xyann for name in names]
    axes.figure.draw_without_rendering()
    assert [name.xyann for name in names] == placed
    axes.figure.savefig(BytesIO(), format="svg")  # of other pixels
    assert [name.xyann for name in names] == placed


def test_no_room_is_left_below_a_drawing_that_is_less_high():
    """The legend of a long low structure follows the axis; the title of a report is removed."""
    page = af.column(breadth=12.0, heights=[1.0]).plot()
    axes = page.axes[0]
    axes.plot([], [], label="thrust line")
    add_legend(axes)
    page.suptitle("")
    axes.set_title("")
    page.draw_without_rendering()
    room = axes.xaxis.label.get_window_extent().y0 - page.legends[0].get_window_extent().y1
    assert 0.0 <= room < 0.15 * page.dpi


def test_long_titles_take_several_lines():
    page = structure_figure(af.column(breadth=0.2, heights=[1.0, 1.0]))
    axes = page.subplots()
    set_title(axes, "a column with a title that is by far too long for a page as slim as its own")
    assert axes.get_title().count("\n") >= 1
    page.draw_without_rendering()
    wide = axes.title.get_window_extent().width
    assert wide < page.bbox.width


def test_titles_of_capitals_fit_the_figure():
    figure = structure_figure(af.column(breadth=1.0, heights=[1.0] * 4))
    axes = figure.subplots()
    stones = [f"ZWICKELMAUERWERK {k} to ÜBERMAUERUNG {k}" for k in (9, 13, 15)]
    set_title(axes, f"mechanism of 47 stones, with hinges at {'; '.join(stones)}")
    figure.draw_without_rendering()
    box = axes.title.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1


@pytest.mark.parametrize(
    "breadth",
    [
        5.0,
        pytest.param(5.7, marks=pytest.mark.slow),
        6.4,
        pytest.param(7.1, marks=pytest.mark.slow),
        8.2,
    ],
)  # of higher and of wider figures
def test_a_title_of_two_lines_and_a_legend_fit_a_drawing_true_to_scale(breadth):
    page = af.column(breadth=breadth, heights=[1.0] * 4).plot()
    axes = page.axes[0]
    axes.plot([], [], label="thrust line")
    add_legend(axes)
    set_title(
        axes, "a drawing " + "of which the title takes two lines " * 2 + "since its words are many"
    )
    page.draw_without_rendering()
    title, label = (text.get_window_extent() for text in (axes.title, axes.xaxis.label))
    assert axes.get_title().count("\n") == 1
    assert title.y1 <= page.bbox.y1
    assert page.legends[0].get_window_extent().y1 <= label.y0


def drawings(bridge, run, runs):
    """Figures of all layouts: one panel, panels side by side, true to scale, legends below."""
    states = {"first hinge": 2.0, "mechanism": 3.0, "fall": 4.0}
    shares = np.linspace(0.0, 1.0, 50)
    curves = {name: (shares**k, 0.9 * shares**k, shares ** (0.9 * k)) for name, k in states.items()}
    sizes = np.array([4.0, 2.0, 1.0])
    ranges = {"friction": (1.0, 3.0), "normal stiffness of all joints": (1.5, 2.2)}
    factors = {name: {"verified": np.array([0.5, 0.8])} for name in ("as built", "restored")}
    motion = af.Motion.synthetic(duration=2.0, seed=3)
    history_of_bridge = af.History(history(bridge, 0.3).dataset, bridge)
    view = af.view
    yield view.draw_names(bridge)
    yield view.draw_envelope({"run": history_of_bridge})
    yield view.draw_envelope(runs)
    yield view.draw_joints(run)
    yield view.draw_motion(motion)
    yield view.draw_spectra([motion])
    yield view.draw_fragility(curves, 5.0 * shares)
    yield view.draw_tornado(ranges, 2.0, "factor [-]")
    yield view.draw_study(factors, title="the motions at which mechanisms begin, by structure")
    yield view.draw_convergence(dict.fromkeys(("cells", "steps"), (sizes, sizes, 0.0, 0.5)))


@pytest.mark.slow
@pytest.mark.parametrize("millimetres", [85.0, 170.0])
def test_figures_fit_a_column_and_a_page_with_type_of_seven_points(bridge, run, runs, millimetres):
    """The width is what is printed: no type is scaled, and none is cut off."""
    with af.view.limit_width(millimetres):
        for figure in drawings(bridge, run, runs):
            assert figure.get_figwidth() <= millimetres / 25.4
            figure.draw_without_rendering()
            ticks = {
                id(label)
                for axes in figure.axes
                for axis in (axes.xaxis, axes.yaxis)
                for label in axis.get_ticklabels(which="both")
            }
            texts = [text for text in figure.findobj(Text) if text.get_text().strip()]
            assert min(text.get_fontsize() for text in texts) >= 7.0
            for text in texts:
                # ticks beyond the ends of an axis are not drawn
                if id(text) not in ticks:
                    box, page = text.get_window_extent(), figure.bbox
                    assert page.x0 - 1 <= box.x0 <= box.x1 <= page.x1 + 1, text
                    assert page.y0 - 1 <= box.y0 <= box.y1 <= page.y1 + 1, text
    assert new_figure(20.0, 3.0).get_figwidth() == 170.0 / 25.4


def test_pictures_of_the_gallery_are_as_small_as_paper_prints_them():
    """At 150 dots per inch: type of seven points and more would shrink with a larger picture."""
    folder = Path(__file__).parents[2]
    style = (folder / "archfem/view/pages/templates/page.css").read_text(encoding="utf-8")
    (high,) = re.findall(r"\.plate img \{ max-height: (\d+)mm", style)
    pictures = [*(folder / "docs" / "gallery").glob("*.png")]
    assert len(pictures) > 10
    for picture in pictures:
        width, height = struct.unpack(">II", picture.read_bytes()[16:24])
        assert width / 150.0 * 25.4 <= 170.0, picture.name
        assert height / 150.0 * 25.4 <= float(high), picture.name


def test_tall_structures_are_drawn_as_high_as_paper_prints_them():
    tower = af.column(breadth=1.0, heights=[2.0] * 10)
    assert af.view.draw_structure(tower).get_figheight() == pytest.approx(107.0 / 25.4)


@pytest.mark.parametrize("millimetres", [10.0, 500.0])
def test_a_width_that_is_no_page_is_refused(millimetres):
    with pytest.raises(af.InvalidInput, match=r"below 60|above 170"):
        af.view.limit_width(millimetres)


# Sight of linear RGB without one of three cones: Machado, Oliveira and Fernandes (2009), Table 1
SIGHT = {
    "all": np.eye(3),
    "no long": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "no middle": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "no short": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}


def cielab(colour, sight="all"):
    """L*, a* and b* of a colour in sRGB (CIE 1976), D65."""
    encoded = np.array(matplotlib.colors.to_rgb(colour))
    rgb = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = xyz @ np.clip(np.array(SIGHT[sight]) @ rgb, 0.0, 1.0) / xyz.sum(axis=1)
    fx, fy, fz = (
        t ** (1 / 3) if t > (6 / 29) ** 3 else t / 3 * (29 / 6) ** 2 + 4 / 29 for t in (x, y, z)
    )
    return np.array([116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)])


def test_lines_differ_in_grey_and_without_any_of_the_cones():
    """A difference of 2.3 is just noticeable; thin lines need several times as much."""
    assert cielab("#777777") == pytest.approx([50.03, 0.0, 0.0], abs=0.05)  # of tables
    lightness = sorted(cielab(colour)[0] for colour in Colour.LINES)
    assert min(np.diff(lightness)) >= 12.0
    for sight in SIGHT:
        seen = [cielab(colour, sight) for colour in Colour.LINES]
        apart = [np.linalg.norm(one - other) for one, other in combinations(seen, 2)]
        assert min(apart) >= 20.0, sight


@pytest.mark.slow
def test_panels_have_letters_in_their_order_and_a_single_one_has_none():
    figure = new_figure(6.0, 4.0)
    (first, second), (third, hidden) = figure.subplots(2, 2)
    hidden.set_visible(False)
    first.set_title("of the ring")
    second.twinx()  # a second scale, and a colour bar, are no panels
    figure.colorbar(third.imshow(np.eye(2)), ax=third)
    for _ in range(2):  # a figure that is drawn again keeps its letters
        figure.draw_without_rendering()
    places = ("center", "left", "left")
    titles = [axes.get_title(loc=loc) for axes, loc in zip(figure.axes, places, strict=False)]
    assert titles == ["(a) of the ring", "(b)", "(c)"]
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert sum(text.startswith("(") for text in texts) == 3
    alone = new_figure(3.0, 2.0)
    alone.subplots()
    alone.draw_without_rendering()
    assert not any(text.get_text().startswith("(") for text in alone.findobj(Text))


@pytest.mark.slow
def test_a_title_has_room_for_the_letter_of_its_panel():
    """A first line with its letter is no longer than the other lines may be."""
    title = "NTC-2018 SLV: passes by an upper bound alone, 1.01 with one weight a body"
    words = title.split()
    first, others = [], []
    for skipped in range(0, len(words), 2):
        figure = new_figure(6.9, 4.2)
        for axes in figure.subplots(1, 2):
            set_title(axes, " ".join(words[skipped:] + words[:skipped]))
        figure.draw_without_rendering()
        lines = figure.axes[1].get_title().splitlines()
        assert lines[0].startswith("(b) ")
        first.append(len(lines[0]))
        others += map(len, lines[1:])
    assert max(first) <= max(others)
