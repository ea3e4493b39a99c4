"""The player and the report in a browser: drawings agree with the history."""

import re
from dataclasses import replace

import numpy as np
import pytest
from chromium import BROWSER, browser, complaints, opened, printed
from matplotlib.figure import Figure

import archfem as af
from archfem.cases.result_text import tabulate_motions
from archfem.cases.run import carry_out, replace_run
from archfem.view.pages.document import (
    Document,
    FigureBlock,
    Grid,
    Section,
    TextBlock,
    print_page,
    write_page,
)
from archfem.view.pages.player_data import Outlines
from archfem.view.style import new_figure

pytestmark = pytest.mark.slow

SCALE = """
const p = document.querySelector("figure.player").player;
return [p.scene.box[0][0], p.scene.box[1][1], p.scale, p.by, p.time];
"""
SET = """
const [name, value] = arguments, slider = document.querySelector(`.player-${name}`);
slider.value = value;
slider.dispatchEvent(new Event("input", { bubbles: true }));
"""


def corners(driver, block):
    """Corners of a block as drawn, back in metres, with their magnification."""
    found = driver.find_element("css selector", f"[data-block='{block}']").get_attribute("d")
    drawn = np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", found), float)
    left, top, scale, by, time = driver.execute_script(SCALE)
    return np.column_stack([left + drawn[:, 0] / scale, top - drawn[:, 1] / scale]), by, time, scale


def test_the_player_draws_the_states_of_the_history(rocked, tmp_path):
    model, run = rocked
    path = af.view.player(run, model).save(tmp_path / "player.html")
    outlines = Outlines(model.structure)
    with browser() as driver:
        opened(driver, path)
        pictures = set()
        for frame in (20, 40):
            driver.execute_script(SET, "time", float(run.dataset["frame_time"][frame]))
            moved = outlines.displacements(model, run.dataset["q"].values[frame][None])[0]
            pictures.add(driver.find_element("css selector", ".player-stage").screenshot_as_base64)
            for block in range(len(model.structure.blocks)):
                found, by, time, scale = corners(driver, block)
                assert time == pytest.approx(float(run.dataset["frame_time"][frame]), abs=1e-9)
                own = outlines.block == block
                expected = outlines.points[own] + by * moved[own]
                # quantum of displacements, of coordinates, and of what is drawn
                close = by * np.abs(moved).max() / 4000 + 1e-4 + 0.01 / scale
                assert np.abs(found - expected).max() < close
        assert len(pictures) == 2
        driver.execute_script(SET, "magnification", 0.0)
        assert corners(driver, 0)[1] == 1.0
        hinge = int(np.argmax((run.joints["hinge"].values != 0).sum(axis=1)))
        driver.execute_script(SET, "time", float(run.time[hinge]))
        discs = driver.find_elements("css selector", ".hinges circle")
        assert len(discs) == (run.joints["hinge"].values[hinge] != 0).sum() > 0
        assert complaints(driver) == []


def test_a_player_without_fields_opens_at_the_largest_displacement(rocked, tmp_path):
    """Elsewhere blocks stand where they were built, with openings between them."""
    model, run = rocked
    run = af.History(run.dataset.drop_vars("q"), model.structure)
    path = af.view.player(run).save(tmp_path / "player.html")
    outlines, number = Outlines(model.structure), model.structure.free[-1]
    own = outlines.points[outlines.block == number]
    with browser() as driver:
        opened(driver, path)
        said = driver.find_element("css selector", ".player-state")
        assert "largest displacement" in said.text
        assert "displacements ×" in said.text
        found, by, *_ = corners(driver, number)
        farthest = np.linalg.norm(found - own, axis=1).max() / by
        assert farthest == pytest.approx(run.verdict.displacement, rel=0.1)
        driver.execute_script(SET, "time", 0.0)
        assert "openings ×" in said.text
        assert np.abs(corners(driver, number)[0] - own).max() < 1e-3
        assert complaints(driver) == []


def test_a_click_on_a_joint_shows_it_and_play_moves_on(rocked, tmp_path):
    model, run = rocked
    path = af.view.player(run, model).save(tmp_path / "player.html")
    find = "css selector"
    with browser() as driver:
        opened(driver, path)
        curves = []
        for number, joint in enumerate(model.structure.joints):
            driver.find_element(find, f"[data-joint='{number}']").click()
            words = driver.find_element(find, ".player-readout").text
            assert joint.name in words
            time = driver.execute_script(SCALE)[4]
            e = run.joints["eccentricity"].isel(joint=number).sel(time=time, method="nearest")
            shown = re.search(r"e = (\S+)", words)[1].replace("−", "-")
            assert float(shown) == pytest.approx(float(e), abs=1e-3)
            curves.append(driver.find_element(find, ".player-e .curve").get_attribute("d"))
        assert curves[0] != curves[1]
        driver.execute_script(SET, "time", 0.0)
        driver.find_element(find, ".player-play").click()
        driver.implicitly_wait(1)
        assert (
            driver.execute_async_script(
                "const done = arguments[0]; setTimeout(() => done("
                "document.querySelector('figure.player').player.time), 400)"
            )
            > 0.05
        )
        assert complaints(driver) == []


def test_a_report_prints_without_cutting_a_figure(small, tmp_path):
    """Each figure is on one page: it may not break, and none is higher than a page."""
    case = af.Case.read(small, ["record.fields_every=10"])
    *_, run = af.cases.run_case(case, pairs=["first"])
    path = run.report(tmp_path / "report.html")
    with browser(wide=665) as driver:  # the width of the text on A4
        opened(driver, path)
        pages = [page.extract_text() for page in printed(driver).pages]
        (page,) = [text for text in pages if "ground acceleration [m/s²]" in text]
        assert "a column under two pairs" in page
        assert "V / N [–]" in page
        headings = "Structure and dead load", "Versions and digests"
        assert all(words in "".join(pages) for words in headings)
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        figures = driver.execute_script(
            "return [...document.querySelectorAll('figure')].map(f => "
            "[getComputedStyle(f).breakInside, f.offsetHeight, f.scrollWidth - f.clientWidth])"
        )
        assert len(figures) >= 4
        high = (297 - 15 - 17) / 25.4 * 96
        assert all(how == "avoid" and tall <= high and wide <= 0 for how, tall, wide in figures)
        assert complaints(driver) == []


LABELS = """
return [...document.querySelectorAll(".player-ground, .player-joint svg")].map(svg => {
  const axis = svg.querySelector(".axis").getBBox();
  const below = [...svg.querySelectorAll("text")].map(each => each.getBBox())
    .filter(box => box.y + box.height / 2 > axis.y + axis.height + 3);  // not the zero beside it
  return [axis.y + axis.height, Math.min(...below.map(box => box.y)), below.length];
});
"""


def test_motions_are_whole_on_paper_and_labels_lie_beside_the_plots(small, tmp_path):
    """Also where type is larger, in the small panels of several motions."""
    folder, report = tmp_path / "out", tmp_path / "report.html"
    case = af.Case.read(small, ["report.pairs=all"])
    with replace_run(case, folder) as draft:
        list(carry_out(case, draft))
    af.cases.open_results(folder).report(report)
    with browser(wide=665) as driver:  # the width of the text on A4
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        opened(driver, report)
        panels = driver.execute_script(LABELS)
        parts = driver.execute_script(
            "return [...document.querySelectorAll('.part .player')].map(p => "
            "getComputedStyle(p).breakInside)"
        )
    assert len(panels) == 6
    assert all(count > 2 and top >= bottom for bottom, top, count in panels)
    assert parts == ["avoid", "avoid"]


TYPE_ON_PAPER = """
const sizes = [];
for (const each of document.querySelectorAll("body *")) {
  const own = [...each.childNodes].some(node => node.nodeType === 3 && node.data.trim());
  if (!own || !each.getClientRects().length) continue;
  const size = parseFloat(getComputedStyle(each).fontSize);
  sizes.push([each.getScreenCTM ? size * each.getScreenCTM().a : size, each.textContent]);
}
const widths = [...document.querySelectorAll(".plate img")]
  .map(each => [parseFloat(each.style.width), each.getBoundingClientRect().width / 96]);
return [sizes, widths];
"""


def test_type_on_paper_has_seven_points_at_least(small, tmp_path):
    """Figures are printed at the size for which they were drawn, the widest and highest also."""
    case, folder = af.Case.read(small).alone("first"), tmp_path / "out"
    with replace_run(case, folder) as draft:
        list(carry_out(case, draft))
        (draft / "limit.txt").write_text("limit analysis")
        af.view.save(new_figure(9.0, 5.9), draft / "collapse.png")
    report = af.cases.open_results(folder).report()
    with browser(wide=665) as driver:  # the width of the text on A4
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        opened(driver, report)
        sizes, widths = driver.execute_script(TYPE_ON_PAPER)
    assert len(sizes) > 100
    small_type = [(0.75 * size, text) for size, text in sizes if 0.75 * size < 6.995]
    assert small_type == []
    assert max(drawn for drawn, _ in widths) == pytest.approx(170.0 / 25.4, abs=0.01)
    assert all(shown == pytest.approx(drawn, abs=0.02) for drawn, shown in widths)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("wide", [390, 1280])
def test_a_report_fits_its_screen_and_follows_the_colour_scheme(small, tmp_path, wide, scheme):
    """Wide tables scroll by themselves, and the page is as wide as the screen."""
    *_, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    path = run.report(tmp_path / "report.html")
    with browser(wide=wide) as driver:
        screen = {"width": wide, "height": 1400, "deviceScaleFactor": 1, "mobile": wide < 500}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        preference = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", preference)
        opened(driver, path)
        assert driver.execute_script("return document.documentElement.scrollWidth") <= wide
        paper = driver.execute_script("return getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, re.findall(r"\d+", paper))) < 200) == (scheme == "dark")
        assert complaints(driver) == []


def test_the_measures_of_motions_fit_a_page_of_1000_pixels(tmp_path):
    """All twelve columns, down to the length, are seen without scrolling."""
    motion = af.Motion.synthetic(duration=17.0, pga=4.0, vertical_ratio=0.7)
    table = Grid(*tabulate_motions([replace(motion, name="eq1")]), "Measures")
    page = Document("motions", "", (), [Section("Motions", [table])]).page
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with browser(wide=1000) as driver:
        opened(driver, tmp_path / "page.html")
        room, table = driver.execute_script(
            "const e = document.querySelector('.scroll'); return [e.clientWidth, e.scrollWidth]"
        )
    assert table <= room


def test_a_text_table_scrolls_and_sentences_wrap(tmp_path):
    """On a phone, a line of a table is a line, and the text below is read without scrolling."""
    table = "\n".join("mode  " + "  ".join(f"frequency {k}" for k in range(9)) for _ in range(4))
    text = f"{table}\n\n{'damping in a sentence ' * 9}"
    page = Document("modes", "", (), [Section("Modes", [TextBlock(text, "lines")])]).page
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with browser() as driver:
        screen = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        opened(driver, tmp_path / "page.html")
        (tall, wide, whole), (more, own, all_own) = driver.execute_script(
            "return [...document.querySelectorAll('pre span')]"
            ".map(e => [e.clientHeight, e.clientWidth, e.scrollWidth])"
        )
        assert whole > 2 * wide
        assert all_own == own == wide
        # lines of 18.2 pixels, and 8 for the scroll bar
        assert 4 * 18 < tall < 5 * 18 < more


NAMES = """
return [...document.querySelectorAll(".player-ground .name")].map((each) => {
  const box = each.getBoundingClientRect();
  return [each.textContent, box.left, box.right];
});
"""


WIDTHS = """
const lines = [...document.querySelectorAll(".player-stage .stone, .player-stage .link")];
return [...new Set(lines.map((each) => getComputedStyle(each).vectorEffect))];
"""


def test_lines_of_a_tall_structure_are_as_wide_as_those_of_others(column, toppled, tmp_path):
    """Its picture is smaller than its own units: a printed thrust line was hardly seen."""
    path = af.view.player(toppled, column).save(tmp_path / "player.html")
    with browser() as driver:
        opened(driver, path)
        assert driver.execute_script(WIDTHS) == ["non-scaling-stroke"]


def test_names_of_instants_do_not_overlap(column, hinged_late, tmp_path):
    """On paper, whose type is twice as large, near ones are one text, and none leaves the chart."""
    path = af.view.player(hinged_late, column).save(tmp_path / "player.html")
    with browser() as driver:
        opened(driver, path)
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        ((name, left, right),) = driver.execute_script(NAMES)
        assert name == "mechanism, blocks loose"
        low, high = driver.execute_script(
            "const box = document.querySelector('.player-ground').getBoundingClientRect();"
            "return [box.left, box.right];"
        )
        assert low < left < right < high
        assert complaints(driver) == []


def test_time_and_joint_of_the_player_are_set_by_keyboard(rocked, tmp_path):
    model, run = rocked
    path = af.view.player(run, model).save(tmp_path / "player.html")
    with browser() as driver:
        opened(driver, path)
        driver.execute_script(SET, "time", 0.0)
        slider = driver.find_element("css selector", ".player-time")
        slider.send_keys("\ue014")  # arrow to the right
        moved = driver.execute_script(SCALE)[4]
        # a round share of the run, from a hundredth to a five-hundredth
        assert float(run.time[-1]) / 500 <= moved <= float(run.time[-1]) / 100
        slider.send_keys("\ue00f")  # page down
        assert driver.execute_script(SCALE)[4] == 0.0
        driver.find_element("css selector", ".player-choice").send_keys(
            model.structure.joints[-1].name
        )
        readout = driver.find_element("css selector", ".player-readout").text
        assert model.structure.joints[-1].name in readout


def test_no_page_is_left_blank_before_a_listing_or_after_a_short_table(tmp_path):
    """A listing of more than a page; tables of one row and of two, above a heading."""
    pypdf = pytest.importorskip("pypdf")
    if BROWSER is None:
        pytest.skip("there is no chromium")
    short = [Grid(("a", "b"), [("row", "1")]), Grid(("a", "b"), [("row", "2"), ("row", "3")])]
    listing = TextBlock("\n".join(f"line {k}" for k in range(600)), "lines")
    sections = [
        Section("Tables", [*[TextBlock("words " * 40)] * 12, *short]),
        Section("Listing", [Grid(("a", "b"), [("row", f"{k}") for k in range(8)]), listing]),
    ]
    page = write_page(tmp_path / "page.html", Document("", "", [], sections).page)
    pages = pypdf.PdfReader(print_page(page, tmp_path / "page.pdf")).pages
    texts = [each.extract_text() for each in pages]
    assert "row 3" in texts[0]
    listed = [text for text in texts if "line " in text]
    assert len(listed) > 1
    assert "Listing" in listed[0]
    assert all(len(text.split()) > 20 for text in texts)


def printed_texts(folder, sections):
    """Texts of the pages of a document as PDF."""
    pypdf = pytest.importorskip("pypdf")
    if BROWSER is None:
        pytest.skip("there is no chromium")
    page = write_page(folder / "page.html", Document("", "", [], sections).page)
    pages = pypdf.PdfReader(print_page(page, folder / "page.pdf")).pages
    return [each.extract_text() for each in pages]


def test_the_last_rows_of_a_table_do_not_stand_alone_on_a_page(tmp_path):
    """A row more than a page holds takes two others with it; a page begins with the head."""

    def rows_of_pages(count):
        table = Grid(("head", "b"), [(f"row {k}", "1") for k in range(count)])
        return [x.count("row ") for x in printed_texts(tmp_path, [Section("", [table])])]

    full = rows_of_pages(100)[0]
    assert rows_of_pages(full)[0] == full
    assert rows_of_pages(full + 1) == [full - 2, 3]


def test_no_heading_stands_alone_at_the_end_of_a_page(tmp_path):
    """Sections of a figure, which may move to the next page, and a table end anywhere."""
    figure = FigureBlock.of(Figure(figsize=(4.0, 1.5)), "nothing")
    sections = [
        Section(f"Heading {n}", [figure, Grid((), [(f"T{n}R{k}", "w " * 30) for k in range(rows)])])
        for n, rows in enumerate([11, 12, 13, 14, 15, 16] * 3)
    ]
    texts = printed_texts(tmp_path, sections)
    assert len(texts) > 6
    for text in texts:
        assert {*re.findall(r"Heading (\d+)", text)} <= {*re.findall(r"T(\d+)R\d+", text)}


def test_a_report_is_printed_as_pdf(small, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    if BROWSER is None:
        pytest.skip("there is no chromium")
    *_, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    page = run.report(tmp_path / "report.html")
    printed_file = pypdf.PdfReader(print_page(page, tmp_path / "report.pdf"))
    pages = printed_file.pages
    assert len(pages) > 2
    # the contents are bookmarks, and take no room of the first page
    (title,) = [mark.title for mark in printed_file.outline if not isinstance(mark, list)]
    assert title == "a column under two pairs"
    assert "1. Conclusion" not in pages[0].extract_text()
    assert "signature" in pages[0].extract_text()
    assert "a column under two pairs" in pages[0].extract_text()
    text = "".join(each.extract_text() for each in pages)
    # players have drawn their data before the page is printed
    assert "reading …" not in text
    # how to record what moves is not on paper
    assert "fields_every = 8" in page.read_text(encoding="utf-8")
    assert "fields_every = 8" not in text
    assert "largest displacement" in text


def test_figures_leave_no_page_of_a_report_half_empty(tmp_path):
    """The lowest line on each page but the last is below seven tenths of its 265 mm."""
    pypdf = pytest.importorskip("pypdf")
    if BROWSER is None:
        pytest.skip("there is no chromium")
    *_, run = af.cases.run_case(af.Case.read("meshes/ring.toml"))
    page = run.report(tmp_path / "report.html")
    pages = pypdf.PdfReader(print_page(page, tmp_path / "report.pdf")).pages
    assert 4 < len(pages) <= 8
    for each in pages[:-1]:
        heights = []

        def keep(text, cm, tm, *_, kept=heights):
            if text.strip():
                kept.append(tm[4] * cm[1] + tm[5] * cm[3] + cm[5])

        each.extract_text(visitor_text=keep)
        # above the number of the page, in its margin of 17 mm; in points
        low = min(height for height in heights if height > 17.0 / 25.4 * 72.0)
        assert (282.0 - low / 72.0 * 25.4) / 265.0 > 0.7
