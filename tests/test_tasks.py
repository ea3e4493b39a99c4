"""The how-to of tasks: its case files, commands and Python run, and print the shown output."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from chromium import BROWSER

import archfem as af
from archfem.commands.cli import ExitCode

PAGE = (Path(__file__).parents[1] / "docs" / "howto" / "tasks.md").read_text(encoding="utf-8")
TASKS = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE))

FILES = dict(
    match
    for kind, language in (("toml", "toml"), ("py", "python"))
    for match in re.findall(rf"`(\w+\.{kind})`[^`]*\n\n```{language}\n(.*?)```", PAGE, re.DOTALL)
)
"""Case files and modules of all tasks, under the name in the line above."""

BLOCK = re.compile(r"```(python|sh)\n(.*?)```(?:\n\n```text\n(.*?)```)?", re.DOTALL)

QUICK = ("Two measures compared",)
"""Tasks by limit analysis alone; the others compute and draw histories, or assess."""


def run_commands(lines, codes):
    """Run commands, whose exit codes may be these."""
    for line in lines.splitlines():
        program, *arguments = shlex.split(line, comments=True)
        assert program == "archfem"
        assert af.commands.main(arguments) in codes, line


def check_printed(shown, printed):
    """Every line shown is printed, in this order: the page shortens long output."""
    rest = iter(printed.splitlines())
    for line in shown.splitlines():
        assert any(line == other.rstrip() for other in rest), (line, printed)


def test_every_task_has_a_file_commands_and_python():
    assert len(TASKS) == 11
    assert set(QUICK) < set(TASKS)
    for task, text in TASKS.items():
        assert {"```toml", "```sh", "```python"} <= set(re.findall(r"```\w+", text)), task


@pytest.mark.parametrize(
    "task", [pytest.param(task, marks=() if task in QUICK else pytest.mark.slow) for task in TASKS]
)
def test_a_task_runs_and_prints_the_output_that_it_shows(task, tmp_path, monkeypatch, capsys):
    if "--pdf" in TASKS[task] and BROWSER is None:
        pytest.skip("there is no chromium: apt-get install chromium")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARCHFEM_OWN_CODE", "")  # permissions end with the test
    monkeypatch.setattr(sys, "path", list(sys.path))
    for name, content in FILES.items():
        Path(name).write_text(content, encoding="utf-8")
    space = {"__name__": "__main__"}
    # an answer in doubt is one of which the page says so
    codes = {0, ExitCode.DOUBTFUL} if "exit code 3" in TASKS[task] else {0}
    for kind, code, shown in BLOCK.findall(TASKS[task]):
        if kind == "sh":
            run_commands(code, codes)
        else:
            exec(compile(code, task, "exec"), space)
        check_printed(shown, capsys.readouterr().out)
