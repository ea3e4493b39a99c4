"""Film the page that shakes an arch, as Chromium shows it: called by `docs/pictures.py`."""

import shutil
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image
from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

import archfem as af

# Screen of the page, and width of the film [pixels]
SCREEN = {"width": 1000, "height": 800, "deviceScaleFactor": 1, "mobile": False}
WIDTH = 800

CHANGE = """
const input = document.querySelector(`#${arguments[0]}`);
input.value = arguments[1];
input.dispatchEvent(new Event("input", { bubbles: true }));
"""
FALLEN = "return document.querySelector('.arch').live.runs[0].fell"
SHOW = "document.querySelector('.arch').live.show(arguments[0])"
RUNS = "return Number(document.querySelector('.arch').dataset.runs) >= 20"
BOTTOM = "return document.querySelector('.live-columns').getBoundingClientRect().bottom"


def film_page(path: Path) -> None:
    """Film the ring of 17 stones as a reader makes it thinner and shakes it."""
    ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
    analysis = af.Analysis(replace(ring, name="Does this arch fall?"), fidelity="rigid")
    driver = open_browser()
    try:
        with TemporaryDirectory() as folder:
            analysis.page(page := Path(folder) / "page.html")
            driver.get(page.as_uri())
            frames = list(take_frames(driver))
    finally:
        driver.quit()
    images = [image for image, _ in frames]
    # one palette for all, of a picture in which everything is, with more of the few red points
    sample = images[-1].copy()
    sample.paste("#d7261e", (0, 0, 60, 60))
    palette = sample.quantize(64, dither=Image.Dither.NONE)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    lengths = [milliseconds for _, milliseconds in frames]
    first.save(path, save_all=True, append_images=rest, duration=lengths, loop=0, optimize=True)


def open_browser() -> Any:
    """Return Debian's Chromium with a screen of that size."""
    options = webdriver.ChromeOptions()
    for option in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(option)
    options.binary_location = shutil.which("chromium") or ""
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", SCREEN)
    return driver


def take_frames(driver: Any) -> Any:
    """Yield pictures, and how long each is shown [ms]."""

    def wait() -> None:
        WebDriverWait(driver, 300, 0.1).until(lambda found: found.execute_script(RUNS))

    def take() -> Image.Image:
        picture = Image.open(BytesIO(driver.get_screenshot_as_png())).convert("RGB")
        bottom = round(driver.execute_script(BOTTOM)) + 8
        picture = picture.crop((0, 0, picture.width, min(bottom, picture.height)))
        height = round(WIDTH * picture.height / picture.width)
        return picture.resize((WIDTH, height), Image.Resampling.LANCZOS)

    wait()
    driver.execute_script("document.documentElement.style.overflow = 'hidden'")
    yield take(), 1800
    for millimetres in range(530, 410, -20):
        driver.execute_script(CHANGE, "thickness", 1e-3 * millimetres)
        yield take(), 150
    wait()
    yield take(), 1200
    end = driver.execute_script(FALLEN) + 1.6
    for tenth in range(int(10 * end)):
        driver.execute_script(SHOW, 0.1 * tenth)
        yield take(), 100
    yield take(), 2500
