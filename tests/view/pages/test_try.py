"""The page that starts from examples, photos and drawings: against Python, and by clicks."""

import itertools
import re
import sys
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from chromium import browser, complaints
from live_scripts import run_in_node, wait_for_runs
from PIL import Image

import archfem as af
from archfem.masonry.materials import STONE_TO_STONE
from archfem.view.pages import live

DOCS = Path(__file__).parents[3] / "docs"
SHAPES = {
    "circle": af.circular_arch,
    "ellipse": af.shapes.elliptical_arch,
    "pointed": af.shapes.pointed_arch,
}
DRAWN = """
(() => {
  const ring = drawRing(given.drawn), design = { factor: 1, stones: given.stones, friction: 0.6 };
  const arch = cutRing(ring, design, given.parameters);
  return { mass: arch.bodies.mass, factor: new Equilibrium(arch).weakest().factor };
})()
"""
READ = """
(() => {
  const read = given.dxf ? readDxf : readGeoJson;
  const arch = assembleOutlines(read(given.text), given.unit ?? 1, given.parameters);
  const areas = arch.bodies.mass.map(([mass]) => mass / STONE);
  const area = areas.reduce((sum, each) => sum + each);
  return { joints: arch.joints.length, area, factor: new Equilibrium(arch).weakest().factor };
})()
"""
LARGE = """
(() => {
  const { text, parameters, arch } = given;
  const own = text ? assembleOutlines(readGeoJson(text), 1, parameters) : arch;
  const state = new Equilibrium(own), factors = [1, -1].map((side) => state.collapse(side).factor);
  return { factors, hasLine: state.thrust(0) !== null };
})()
"""
CHANGE = """
const input = document.querySelector(`#${arguments[0]}`);
input.value = arguments[1];
input.dispatchEvent(new Event("input", { bubbles: true }));
"""
# Offset of the crown that a reader marked from the middle of the picture [pixels]
PIXELS = """
const { tools, stage: { svg, layers } } = document.querySelector('.arch').live;
const { x, y } = new DOMPoint(...tools.marks[2]).matrixTransform(layers.getScreenCTM());
const box = svg.getBoundingClientRect();
return [Math.round(x - box.left - box.width / 2), Math.round(y - box.top - box.height / 2)];
"""
WRONG = "(() => { try { %s; } catch (error) { return error.message; } })()"


def load_try_page():
    """Return the script that writes the page of the documentation."""
    sys.path.insert(0, str(DOCS))
    try:
        import try_page
    finally:
        sys.path.remove(str(DOCS))
    return try_page


@pytest.fixture(scope="module")
def parameters():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=5)
    return live.describe_arch(ring)["parameters"]


def weakest(structure):
    live_loads = [af.BodyForce(side, 0.0) for side in (1.0, -1.0)]
    return min(af.collapse_factor(structure, live=each).factor for each in live_loads)


@pytest.mark.parametrize(("kind", "rise"), [("circle", 1.5), ("ellipse", 2.4), ("pointed", 3.2)])
def test_a_drawn_arch_is_that_of_its_shape(parameters, kind, rise):
    size = {"span": 5.0, "rise": rise, "thickness": 0.5}
    drawn = size | {"kind": kind, "left": [1.0, 2.0]}
    found = run_in_node({"drawn": drawn, "stones": 14, "parameters": parameters}, DRAWN)
    options = {} if kind == "circle" else {"chords": 16}
    structure = SHAPES[kind](**size, voussoirs=14, **options)
    masses = [structure.density(b) * b.area * structure.width for b in structure.blocks]
    free = [mass for mass, block in zip(masses, structure.blocks, strict=True) if not block.fixed]
    # a curve is kept at 25 joints, between which it is a circle; stones of a pointed arch are cut
    # along the middle here, and along the intrados there
    near = {"circle": 1e-3, "ellipse": 0.01, "pointed": 0.03}[kind]
    assert sum(m for m, _ in found["mass"]) == pytest.approx(sum(free), rel=near)
    assert found["factor"] == pytest.approx(weakest(structure), rel=near)


def test_outlines_of_a_drawing_have_the_joints_that_archfem_finds(parameters, tmp_path):
    structure = af.arch_on_piers(
        radius=2.5, thickness=0.5, voussoirs=9, pier_breadth=1.4, courses=[0.8, 0.8], chords=1
    )
    af.masonry.write_outlines(structure, path := tmp_path / "arch.geojson")
    given = {"text": path.read_text(), "parameters": parameters}
    found = run_in_node(given, READ)
    assert found["joints"] == len(structure.joints)
    assert found["factor"] == pytest.approx(weakest(structure), rel=1e-4)


def dxf(*rings):
    """Closed polylines as DXF."""
    lines = ["0", "SECTION", "2", "ENTITIES"]
    for ring in rings:
        lines += ["0", "LWPOLYLINE", "8", "STONES", "70", "1"]
        lines += [word for x, y in ring for word in ("10", str(x), "20", str(y))]
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF"])


def box(left, low, right, high):
    return (left, low), (right, low), (right, high), (left, high)


def test_a_column_in_dxf_falls_at_its_slenderness(parameters):
    text = dxf(box(-1, -1, 2, 0), box(0, 0, 0.5, 1), box(0, 1, 0.5, 2))
    found = run_in_node({"text": text, "dxf": True, "parameters": parameters}, READ)
    assert found["joints"] == 2
    assert found["factor"] == pytest.approx(0.25, rel=1e-9)  # breadth over height


def test_stones_that_no_support_holds_do_not_stand(parameters):
    """Two stones beside a column touch each other alone."""
    column = [box(0, 0, 1, 1), box(0, 1, 1, 2)]
    given = {"text": dxf(*column, box(5, 2, 6, 3), box(5, 1, 6, 2)), "parameters": parameters}
    assert run_in_node(given | {"dxf": True}, READ)["factor"] == -1
    stands = given | {"text": dxf(*column), "dxf": True}
    assert run_in_node(stands, READ)["factor"] == pytest.approx(0.6)  # it slides


def build_wall(columns, courses):
    """A wall in running bond, whose many joints share the weight in countless ways."""
    rows = [("ground", -1.0, columns + 1.0, -0.5)]
    for course in range(courses):
        cuts = np.clip(np.arange(columns + 2) - 0.5 * (course % 2), 0.0, columns)
        rows += [(f"{course}", *ends, 0.5 * course) for ends in itertools.pairwise(cuts)]
    blocks = [
        af.Block(box(left, low, right, low + 0.5), af.STONE, f"{name}, {left}", name == "ground")
        for name, left, right, low in rows
        if right > left
    ]
    return af.masonry.assembled(blocks, STONE_TO_STONE)


def bridge_of_the_page():
    return load_try_page().list_examples()["a Roman bridge without fill"]


@pytest.mark.parametrize(
    ("build", "stones", "drawn"),
    [
        (bridge_of_the_page, 56, False),
        pytest.param(lambda: build_wall(9, 6), 57, True, marks=pytest.mark.slow),
    ],
    ids=["bridge", "wall"],
)
def test_large_structures_fall_where_limit_analysis_says(
    parameters, tmp_path, build, stones, drawn
):
    """The largest preset, and as many stones as a drawing may have: both sides, thrust line."""
    structure = build()
    assert len(structure.free) == stones
    given = {"parameters": parameters, "arch": live.describe_arch(structure)}
    if drawn:
        af.masonry.write_outlines(structure, path := tmp_path / "wall.geojson")
        given["text"] = path.read_text()
    found = run_in_node(given, LARGE)
    loads = [af.BodyForce(side, 0.0) for side in (1.0, -1.0)]
    expected = [af.collapse_factor(structure, live=each).factor for each in loads]
    assert found["factors"] == pytest.approx(expected, rel=1e-6)
    assert found["hasLine"] is not drawn  # the page has no thrust line of a wall


@pytest.mark.parametrize("way", ["bulges", "heavy", "lines and arcs"])
def test_arcs_of_a_drawing_are_those_of_the_ring(parameters, tmp_path, way):
    """Stones of a ring as polylines with arcs, or as lines and arcs that stones share."""
    radii, angles = (2.7, 3.3), np.radians(np.linspace(165.0, 15.0, 12))
    places = np.array([[[r * np.cos(a), r * np.sin(a)] for r in radii] for a in angles])
    bulge = np.tan(np.radians(150.0 / 11.0) / 4.0)
    document = ezdxf.new()
    drawn = document.modelspace()
    for k, ((a, b), (c, d)) in enumerate(itertools.pairwise(places)):
        corners = [(*a, -bulge), (*c, 0.0), (*d, bulge), (*b, 0.0)]
        if way == "bulges":
            drawn.add_lwpolyline(corners, format="xyb", close=True)
        elif way == "heavy":
            drawn.add_polyline2d(corners, format="xyb", close=True)
        else:
            for radius in radii:
                drawn.add_arc((0, 0), radius, *np.degrees(angles[[k + 1, k]]))
            drawn.add_line(a, b)
    if way == "lines and arcs":
        drawn.add_line(*places[-1])
    for (a, b), side in ((places[0], -1.0), (places[-1], 1.0)):
        back = 0.3 * side * (b - a)[::-1] * [1.0, -1.0]
        support = [a, b, b + back, a + back]
        drawn.add_lwpolyline(support, close=True, dxfattribs={"layer": "supports"})
    document.saveas(path := tmp_path / "ring.dxf")
    given = {"text": path.read_text(), "dxf": True, "parameters": parameters}
    found = run_in_node(given, READ)
    ring = af.circular_arch(radius=3.0, embrace=150.0, thickness=0.6, voussoirs=11)
    assert found["joints"] == 12
    # arcs of chords of 3 degrees
    area = sum(block.area for block in ring.blocks if not block.fixed)
    assert found["area"] == pytest.approx(area, rel=1e-3)
    assert found["factor"] == pytest.approx(weakest(ring), rel=2e-3)


@pytest.mark.parametrize(
    ("rings", "words"),
    [
        ([box(0, 0, 1, 1)], "has no closed outlines"),
        ([box(0, 0, 1, 1), ((0, 1), (1, 2), (1, 1), (0, 2.2))], "outline 2 crosses itself"),
        ([box(0, 0, 2, 1), ((0, 1), (2, 1), (2, 3), (1, 1.5), (0, 3))], "is not convex"),
        ([box(0, 0, 1, 1), box(0, 0.5, 1, 2)], "are in each other by 500 mm"),
        ([box(0, 0, 1, 1), box(0, 1.5, 1, 2)], "outline 2 touches no other"),
        ([box(0, 0, 1000, 1), box(0, 1, 1000, 2)], "choose its unit"),
    ],
)
def test_bad_drawings_get_words(parameters, rings, words):
    given = {"text": dxf(*rings), "parameters": parameters}
    program = WRONG % "assembleOutlines(readDxf(given.text), 1, given.parameters)"
    assert words in run_in_node(given, program)


@pytest.mark.parametrize(
    ("drawn", "words"),
    [
        ({"kind": "circle", "span": 4.0, "rise": 3.0}, "choose a pointed arch or an ellipse"),
        ({"kind": "pointed", "span": 4.0, "rise": 1.0}, "choose a circle or an ellipse"),
        ({"kind": "circle", "span": 4.0, "rise": -1.0}, "the crown above them"),
    ],
)
def test_marks_that_are_no_arch_get_words(drawn, words):
    drawn |= {"thickness": 0.4, "left": [0.0, 0.0]}
    assert words in run_in_node({"drawn": drawn}, WRONG % "drawRing(given.drawn)")


def test_records_are_read_as_archfem_reads_them(at2, tmp_path):
    samples = 0.3 * np.sin(np.arange(200) * 0.2)
    at2(path := tmp_path / "record.AT2", samples, 0.01)
    columns = "\n".join(f"{0.01 * k:.2f} {value:.6f}" for k, value in enumerate(samples))
    expected = af.Motion.read(path)
    for text in (path.read_text(), columns):
        found = run_in_node({"text": text}, 'readRecord(given.text, "a record")')
        assert found["dt"] == pytest.approx(expected.dt)
        # this page has g = 9.81 m/s², and archfem 9.80665
        assert found["x"] == pytest.approx(expected.horizontal.tolist(), abs=2e-3)
    in_metres = run_in_node({"text": columns}, 'readRecord(given.text, "a record", 1.0)')
    assert in_metres["x"] == pytest.approx(samples.tolist(), abs=1e-6)
    program = WRONG % 'readRecord(given.text, "a record", 9.81)'
    strong = columns.replace(" 0.", " 9.").replace(" -0.", " -9.")
    assert "choose the unit of its values" in run_in_node({"text": strong}, program)
    assert "give two columns" in run_in_node({"text": "no record\n" * 20}, program)


def test_the_page_of_the_documentation_is_that_of_the_scripts():
    """All but the packed examples, which take seconds to compute."""
    try_page = load_try_page()
    stored = try_page.PAGE.read_text(encoding="utf-8")
    written = try_page.build_page([{"ring": {"stones": 1}, "thrust": None}])
    bare = [re.sub(r'(id="data">)[^<]*', r"\1", text) for text in (stored, written)]
    assert bare[0] == bare[1], "run `make wasm`, and commit what it writes"
    assert len(stored) < 0.5e6


@pytest.mark.slow
def test_an_arch_is_drawn_on_a_photo_and_taken_away(tmp_path):
    """Photo, scale, three marks; then the case, and the link."""
    photo = tmp_path / "photo.png"
    Image.new("RGB", (400, 300), "grey").save(photo)
    (tmp_path / "large.png").write_bytes(b"0" * 21_000_000)
    (tmp_path / "none.png").write_bytes(b"no picture")
    record = tmp_path / "record.txt"
    times = 0.01 * np.arange(300)
    np.savetxt(record, np.column_stack([times, 3.0 * np.sin(times * np.pi)]), fmt="%.4f")
    find = "css selector"
    with browser(wide=1280) as driver:
        from selenium.webdriver import ActionChains

        def message():
            return driver.find_element(find, "#message").text

        def click(x, y):
            """Click at shares of the picture, from its left and its top."""
            stage = driver.find_element(find, "#stage")
            wide, high = stage.size["width"], stage.size["height"]
            drawn = min(wide, high * 4 / 3), min(high, wide * 3 / 4)
            offset = round((x - 0.5) * drawn[0]), round(high / 2 - (1.0 - y) * drawn[1])
            ActionChains(driver).move_to_element_with_offset(stage, *offset).click().perform()

        driver.get((DOCS / "try" / "index.html").resolve().as_uri())
        wait_for_runs(driver, 1)
        for details in driver.find_elements(find, ".arch > :is(section, div) summary"):
            details.click()
        driver.find_element(find, "#mark").click()
        assert message() == "place a photo or an elevation first"
        for name, words in (("large", "has 21 MB"), ("none", "is no picture")):
            driver.find_element(find, "#photo").send_keys(str(tmp_path / f"{name}.png"))
            wait(driver, lambda words=words: words in message())
        driver.find_element(find, "#photo").send_keys(str(photo))
        wait(driver, lambda: "Click two points" in message())
        driver.execute_script("scrollTo(0, 0)")  # the verdict stays above what is scrolled
        driver.find_element(find, "#mark").click()
        assert "no scale yet" in message()
        driver.find_element(find, "#scale").click()
        click(0.2, 0.8)
        click(0.8, 0.8)
        driver.find_element(find, "#length").send_keys("6\n")
        for x, y in ((0.2, 0.8), (0.8, 0.8), (0.5, 0.5), (0.5, 0.4)):
            click(x, y)
        wait(driver, lambda: "drag the three points" in message())
        script = "return document.querySelector('.arch').live.tools.source.drawn"
        drawn = driver.execute_script(script)
        # a pixel is 2 cm
        sizes = [drawn[name] for name in ("span", "rise", "thickness")]
        assert sizes == pytest.approx([6.0, 2.25, 0.75], abs=0.05)
        case = driver.execute_script(
            "return document.querySelector('.arch').live.tools.writeCase()"
        )
        (tmp_path / "arch.toml").write_text(case)
        structure = af.Case.read(tmp_path / "arch.toml").structure
        shown = float(driver.find_element(find, "#collapse").text.split()[0])
        assert shown == pytest.approx(weakest(structure), abs=2e-3)
        # the reader's record and the other choices stay where the crown is dragged
        driver.find_element(find, "#record").send_keys(str(record))
        wait(driver, lambda: "3.00 g" in message())
        unit = driver.find_element(find, "#record-unit option[value='1']")
        unit.click()
        wait(driver, lambda: "up to 0.31 g" in message())
        strength = driver.find_element(find, "#strength-value").text
        assert strength == "0.31 g (1.00 × as recorded)"
        verdict = driver.find_element(find, "#verdict").text
        assert verdict == "Shaking …" or verdict.startswith(f"record.txt, {strength}: this arch")
        driver.execute_script(CHANGE, "friction", 0.5)
        stage = driver.find_element(find, "#stage")
        driver.execute_script("arguments[0].scrollIntoView({ block: 'center' })", stage)
        crown = driver.execute_script(PIXELS)
        drag = ActionChains(driver).move_to_element_with_offset(stage, *crown).click_and_hold()
        drag.move_by_offset(0, -5).release().perform()
        kept = driver.execute_script("return document.querySelector('.arch').live.design")
        assert (kept["friction"], kept["strength"]) == (0.5, 0.31)
        script_of_motion = "return document.querySelector('#motion').selectedOptions[0].text"
        assert driver.execute_script(script_of_motion) == "record.txt"
        drawn = driver.execute_script(script)
        assert drawn["rise"] > 2.3
        shown = float(driver.find_element(find, "#collapse").text.split()[0])
        written = "return document.querySelector('.arch').live.tools.writeCase()"
        (tmp_path / "arch.toml").write_text(driver.execute_script(written))
        motion = af.Case.read(tmp_path / "arch.toml").ground_motion()
        assert motion.horizontal == pytest.approx(np.loadtxt(record)[:, 1], abs=1e-4)
        # the files that it saves: the case, and a picture with photo, stones and thrust line
        folder = {"behavior": "allow", "downloadPath": str(tmp_path / "saved")}
        driver.execute_cdp_cmd("Browser.setDownloadBehavior", folder)
        for name, saved in (("case", "arch.toml"), ("png", "arch.png")):
            driver.find_element(find, f"#{name}").click()
            wait(driver, (tmp_path / "saved" / saved).exists)
        assert (tmp_path / "saved" / "arch.toml").read_text() == (
            tmp_path / "arch.toml"
        ).read_text()
        with Image.open(tmp_path / "saved" / "arch.png") as picture:
            colours = {colour for _, colour in picture.convert("RGB").getcolors(2**20)}
        assert {(128, 128, 128), (11, 79, 138)} < colours
        driver.find_element(find, "#link").click()
        wait(driver, lambda: "holds the arch" in message())
        assert "leaves out the photo" in message()
        address = driver.current_url
        driver.get("about:blank")
        driver.get(address)
        wait_for_runs(driver, 1)
        wait(driver, lambda: driver.execute_script(script) == drawn)
        assert float(driver.find_element(find, "#collapse").text.split()[0]) == shown
        assert driver.execute_script(script_of_motion) == "record.txt"
        driver.save_screenshot(str(tmp_path / "drawn.png"))
        assert complaints(driver) == []


@pytest.mark.slow
def test_stones_are_moved_by_a_finger_and_by_keys(tmp_path):
    """A drag and keys move a stone with its neighbours' corners; blocks that cross get words."""
    with browser(wide=1280) as driver:
        from selenium.webdriver import ActionChains, Keys

        def run(expression, *given):
            script = "const live = document.querySelector('.arch').live, { tools, stage } = live;"
            return driver.execute_script(script + expression, *given)

        def pixels(point):
            """Offset of a point of the drawing from the middle of the canvas."""
            script = "const screen = stage.layers.getScreenCTM();"
            script += "const { x, y } = new DOMPoint(...arguments[0]).matrixTransform(screen);"
            script += "const box = stage.svg.getBoundingClientRect();"
            script += "return [x - box.left - box.width / 2, y - box.top - box.height / 2];"
            return [round(each) for each in run(script, [float(value) for value in point])]

        driver.get((DOCS / "try" / "index.html").resolve().as_uri())
        wait_for_runs(driver, 1)
        driver.find_element("css selector", "#stones-move").click()
        stage = driver.find_element("css selector", "#stage")
        before = run("return tools.source.outlines")
        centre = np.mean(before[9]["points"], axis=0)
        there = np.subtract(pixels((centre[0], centre[1] + 0.1)), pixels(centre)).tolist()
        drag = ActionChains(driver).move_to_element_with_offset(stage, *pixels(centre))
        drag.click_and_hold().move_by_offset(*there).release().perform()
        after = run("return tools.source.outlines")
        moved = np.subtract(after[9]["points"], before[9]["points"])
        pixel = run("return stage.pixel")
        assert moved == pytest.approx(np.tile([0.0, 0.1], (4, 1)), abs=1.1 * pixel)
        assert after[0] == before[0]
        assert sum(a != b for a, b in zip(after, before, strict=True)) == 3  # and its neighbours
        # the fourth choice is stone 4; by 2 cm to the right
        stage.send_keys(Keys.ENTER * 4 + Keys.ARROW_RIGHT * 2)
        by_keys = np.subtract(run("return tools.source.outlines[3].points"), after[3]["points"])
        assert by_keys == pytest.approx(np.tile([0.02, 0.0], (4, 1)), abs=1e-9)
        # archfem reads the stones, and finds the same push
        (tmp_path / "arch.toml").write_text(run("return tools.writeCase()"))
        (tmp_path / "stones.geojson").write_text(run("return writeGeoJson(tools.source.outlines)"))
        structure = af.Case.read(tmp_path / "arch.toml").structure
        shown = float(driver.find_element("css selector", "#collapse").text.split()[0])
        assert shown == pytest.approx(weakest(structure), abs=2e-3)
        # a corner dragged through its stone
        kept = run("return tools.source.outlines")
        (x, y), far = kept[3]["points"][0], np.mean(kept[5]["points"], axis=0)
        start, end = pixels((x, y)), pixels(far)
        drag = ActionChains(driver).move_to_element_with_offset(stage, *start).click_and_hold()
        drag.move_by_offset(*np.subtract(end, start).tolist()).release().perform()
        words = driver.find_element("css selector", "#message").text
        assert re.search(r"crosses itself|is not convex|in each other by", words), words
        assert complaints(driver) == []


@pytest.mark.slow
def test_a_finger_places_points_by_taps_and_scrolls_by_swipes(tmp_path):
    """A swipe over the photo scrolls the page; a tap places a point; a mark is dragged."""
    photo = tmp_path / "photo.png"
    Image.new("RGB", (400, 300), "grey").save(photo)
    with browser() as driver:
        phone = {"width": 390, "height": 780, "deviceScaleFactor": 2, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
        driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
        live = "const live = document.querySelector('.arch').live, { tools, stage } = live;"

        def run(expression, *given):
            return driver.execute_script(live + expression, *given)

        def touch(*points):
            """Put a finger down at the first point of the screen, move it to the others."""
            for kind, point in zip(
                ["touchStart", *["touchMove"] * (len(points) - 1), "touchEnd"],
                [*points, None],
                strict=True,
            ):
                places = [] if point is None else [{"x": point[0], "y": point[1]}]
                given = {"type": kind, "touchPoints": places}
                driver.execute_cdp_cmd("Input.dispatchTouchEvent", given)

        def place(x, y):
            """Point of the screen at shares of the picture."""
            box = run(
                "const b = stage.svg.getBoundingClientRect();"
                "return [b.left, b.top, b.width, b.height]"
            )
            return box[0] + x * box[2], box[1] + y * box[3]

        driver.get((DOCS / "try" / "index.html").resolve().as_uri())
        wait_for_runs(driver, 1)
        for name in ("thickness", "time"):
            slider = f"const s = document.querySelector('#{name}'), b = s.getBoundingClientRect();"
            run(f"{slider} scrollBy(0, b.top - 500)")
            x, y, value, before = run(
                f"{slider} return [b.left + 0.8 * b.width, b.top + b.height / 2, s.value, scrollY]"
            )
            touch(*[(x, y - 15 * k) for k in range(8)])
            wait(driver, lambda before=before: run("return scrollY") > before + 50)
            assert run(f"{slider} return s.value") == value
            assert run("return live.time") == 0.0
            # a tap, and a move along the slider, change it
            wait(driver, lambda: run("const y = scrollY; scrollTo(0, 300); return y === 300"))
            place_of = f"{slider} return [b.left + arguments[0] * b.width, b.top + b.height / 2]"
            for shares in ([0.8], [0.8, 0.7, 0.6, 0.5, 0.4]):
                touch(*[run(place_of, share) for share in shares])
                read = f"{slider} return s.value"
                wait(driver, lambda value=value, read=read: run(read) != value)
                moved, value = value, run(read)
            assert float(value) < float(moved)
            assert run("return scrollY") == 300
        assert run("return live.time") == pytest.approx(float(value))
        run("scrollTo(0, 0)")
        driver.find_element("css selector", ".live-start summary").click()
        driver.find_element("css selector", "#photo").send_keys(str(photo))
        wait(driver, lambda: run("return tools.mode") == "scale")
        run("stage.svg.scrollIntoView({ block: 'center' })")
        before = run("return scrollY")
        (x, y), far = place(0.5, 0.8), -180
        touch((x, y), *[(x, y + share * far) for share in (0.2, 0.4, 0.6, 0.8, 1.0)])
        wait(driver, lambda: run("return scrollY") > before + 50)
        assert run("return tools.marks.length") == 0
        # a tap while the page still glides only stops it
        centre = "const y = scrollY; stage.svg.scrollIntoView({ block: 'center' });"
        wait(driver, lambda: run(f"{centre} return y === scrollY"))
        for k, point in enumerate(((0.2, 0.8), (0.8, 0.8))):
            touch(place(*point))
            wait(driver, lambda k=k: run("return tools.marks.length") == k + 1)
        driver.find_element("css selector", "#length").send_keys("6\n")
        wait(driver, lambda: run("return tools.mode") == "mark")
        run("stage.svg.scrollIntoView({ block: 'center' })")
        for k, point in enumerate(((0.2, 0.8), (0.8, 0.8), (0.5, 0.5))):
            touch(place(*point))
            wait(driver, lambda k=k: run("return tools.marks.length") == k + 1)
        touch(place(0.5, 0.4))
        wait(driver, lambda: run("return Boolean(tools.source.drawn)"))
        before, rise = run("return scrollY"), run("return tools.source.drawn.rise")
        (x, y), step = place(0.5, 0.5), 2
        touch((x, y), *[(x, y - step * k) for k in range(1, 9)])
        assert run("return tools.source.drawn.rise") > rise + 0.1
        assert run("return scrollY") == before
        assert complaints(driver) == []


@pytest.mark.slow
def test_mistakes_are_put_right_where_they_are_said(tmp_path):
    """A drawing is read again in another unit; a refused mark is dragged to its place."""
    column = [box(0.0, low, 500.0, low + 1000.0) for low in (0.0, 1000.0, 2000.0)]
    (drawing := tmp_path / "column.dxf").write_text(dxf(*column))
    Image.new("RGB", (400, 300), "grey").save(photo := tmp_path / "photo.png")
    with browser(wide=1280) as driver:
        from selenium.webdriver import Keys

        def run(expression):
            script = "const live = document.querySelector('.arch').live, { tools } = live;"
            return driver.execute_script(script + expression)

        def message():
            return driver.find_element("css selector", "#message").text

        driver.get((DOCS / "try" / "index.html").resolve().as_uri())
        wait_for_runs(driver, 1)
        for details in driver.find_elements("css selector", ".arch > :is(section, div) summary"):
            details.click()
        driver.find_element("css selector", "#drawing").send_keys(str(drawing))
        wait(driver, lambda: "3000 m large: choose its unit" in message())
        driver.find_element("css selector", "#unit option[value='0.001']").click()
        wait(driver, lambda: "2 joints" in message())
        assert driver.find_element("css selector", "#collapse").text.startswith("0.250 g")
        driver.find_element("css selector", "#photo").send_keys(str(photo))
        wait(driver, lambda: "Click two points" in message())
        run("for (const x of [1, 4]) tools.placePoint([x, 1])")
        driver.find_element("css selector", "#length").send_keys("6\n")
        wait(driver, lambda: "Click the left springing" in message())
        assert not driver.find_element("css selector", "#weight").is_displayed()
        place = "tools.attempt(() => tools.placePoint(p))"
        run(f"for (const p of [[2, 1], [8, 1], [5, 3], [5, 2]]) {place}")
        wait(driver, lambda: "outer side of the crown lies above" in message())
        run("tools.hold([5, 2])([5, 3.5])")
        assert run("return tools.source.drawn.thickness") == 0.5
        assert driver.find_element("css selector", "#weight").text.startswith("it stands")
        # marks of a moved arch come back with it
        marks = run("return tools.marks")
        driver.find_element("css selector", "#stones-move").click()
        stage = driver.find_element("css selector", "#stage")
        stage.send_keys(Keys.ENTER + Keys.ARROW_UP)
        assert run("return tools.source.moved")
        driver.find_element("css selector", "#undo").click()
        driver.find_element("css selector", "#undo").click()
        wait(driver, lambda: message() == "no stone was moved")
        driver.find_element("css selector", "#reset").click()
        assert run("return tools.marks") == marks
        # points are placed by keys, too: an arrow moves by 5 ‰ of the width
        driver.find_element("css selector", "#scale").click()
        stage.send_keys(Keys.ENTER + Keys.ARROW_RIGHT * 20 + Keys.ENTER)
        (x, y), (u, v) = run("return tools.marks")
        wide = run("return live.stage.box[2]")
        assert (u - x, v - y) == pytest.approx((0.1 * wide, 0.0))
        assert driver.switch_to.active_element.get_attribute("id") == "length"
        assert complaints(driver) == []


def wait(driver, condition):
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(driver, 60, poll_frequency=0.05).until(lambda _: condition())


@pytest.mark.slow
def test_every_example_is_a_case_that_archfem_reads(tmp_path):
    choose = "const e = document.querySelector('#example'); e.value = arguments[0];"
    with browser() as driver:
        phone = {"width": 390, "height": 900, "deviceScaleFactor": 1, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
        driver.get((DOCS / "try" / "index.html").resolve().as_uri())
        wait_for_runs(driver, 1)
        for number in range(len(driver.find_elements("css selector", "#example option"))):
            driver.execute_script(f"{choose} e.dispatchEvent(new Event('change'))", number)
            write = "return document.querySelector('.arch').live.tools.writeCase()"
            (tmp_path / "arch.toml").write_text(driver.execute_script(write))
            case = af.Case.read(tmp_path / "arch.toml")
            shown = float(driver.find_element("css selector", "#collapse").text.split()[0])
            assert shown == pytest.approx(weakest(case.structure), abs=2e-3)
            assert case.ground_motion().pga > 0.0
            assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        assert number == 8
        assert complaints(driver) == []
