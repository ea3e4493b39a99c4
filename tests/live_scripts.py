"""Scripts of the page that shakes an arch, run by Node with data of a test."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from archfem.view.pages import live

SCRIPTS = Path(live.__file__).parent / "templates" / "live"
NODE = shutil.which("node")


def run_in_node(given, program):
    """The value of a program, an expression or a promise of JavaScript, with the data `given`."""
    if NODE is None:
        pytest.skip("there is no node: apt-get install nodejs")
    names = ("engine", "statics", "closing", "shapes", "outlines")
    scripts = "\n".join((SCRIPTS / f"{name}.js").read_text() for name in names)
    source = f"{scripts}\nconst given = {json.dumps(given)};\n"
    source += f"Promise.resolve({program.strip()}).then((r) => console.log(JSON.stringify(r)));"
    done = subprocess.run([NODE, "-"], input=source, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def wait_for_runs(driver, runs):
    """Wait until a page has finished so many runs."""
    from selenium.webdriver.support.ui import WebDriverWait

    done = "return Number(document.querySelector('.arch').dataset.runs ?? 0)"
    WebDriverWait(driver, 300, poll_frequency=0.05).until(lambda d: d.execute_script(done) >= runs)
