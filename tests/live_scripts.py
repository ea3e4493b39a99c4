"""Scripts of the page that shakes an arch, run by Node with data of a test."""

import atexit
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from archfem.view.pages import live

SCRIPTS = Path(live.__file__).parent / "templates" / "live"
NODE = shutil.which("node")

# Answers lines with a program and its data; names of the scripts are in the scope of `eval`
ANSWER = """
const evaluate = async (given, program) => await eval(`(${program})`);
require("readline").createInterface({ input: process.stdin }).on("line", async (line) => {
  const { given, program } = JSON.parse(line);
  let said;
  try {
    said = { value: await evaluate(given, program) };
  } catch (error) {
    said = { error: String(error.stack) };
  }
  console.log(JSON.stringify(said));
});
"""


def run_in_node(given, program):
    """The value of a program, an expression or a promise of JavaScript, with the data `given`."""
    if NODE is None:
        pytest.skip("there is no node: apt-get install nodejs")
    node = start_node()
    node.stdin.write(json.dumps({"given": given, "program": program.strip()}) + "\n")
    node.stdin.flush()
    said = json.loads(node.stdout.readline())
    assert "error" not in said, said["error"]
    return said.get("value")


@cache
def start_node():
    """A process that serves all tests: its start takes longer than most programs."""
    names = ("engine", "statics", "closing", "shapes", "outlines")
    scripts = "\n".join((SCRIPTS / f"{name}.js").read_text() for name in names)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    node = subprocess.Popen([NODE, "-e", scripts + ANSWER], **pipes)
    atexit.register(node.communicate)  # which ends it
    return node


def wait_for_runs(driver, runs):
    """Wait until a page has finished so many runs."""
    from selenium.webdriver.support.ui import WebDriverWait

    done = "return Number(document.querySelector('.arch').dataset.runs ?? 0)"
    WebDriverWait(driver, 300, poll_frequency=0.05).until(lambda d: d.execute_script(done) >= runs)
