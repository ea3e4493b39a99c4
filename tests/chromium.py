"""A headless Chromium, as Debian has it, driven by its own driver: nothing is downloaded."""

import base64
import shutil
from contextlib import contextmanager
from io import BytesIO

import pytest

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")

OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage")


@contextmanager
def browser(wide=1100, high=1400):
    """Give a browser with a window of that size [pixels]; skip the test where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver")
    if BROWSER is None or DRIVER is None:
        pytest.skip("there is no chromium with its driver: apt-get install chromium-driver")
    options = webdriver.ChromeOptions()
    for option in (*OPTIONS, f"--window-size={wide},{high}"):
        options.add_argument(option)
    options.binary_location = BROWSER
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


def opened(driver, path):
    """Open a page and wait until all its players are ready."""
    from selenium.webdriver.support.ui import WebDriverWait

    driver.get(path.resolve().as_uri())
    ready = "return [...document.querySelectorAll('figure.player')].every(f => f.dataset.ready)"
    WebDriverWait(driver, 30, poll_frequency=0.05).until(lambda d: d.execute_script(ready))


def complaints(driver):
    """Warnings and errors of the page in the console."""
    return [entry for entry in driver.get_log("browser") if entry["level"] != "INFO"]


def printed(driver):
    """The page as PDF, in the page size that it sets."""
    pypdf = pytest.importorskip("pypdf")
    found = driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    return pypdf.PdfReader(BytesIO(base64.b64decode(found["data"])))
