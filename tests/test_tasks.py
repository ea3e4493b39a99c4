"""The how-to of tasks: its case files, commands and Python run, and print the shown output."""

import re
import shlex
import sys
from pathlib import Path

import numpy as np
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

QUICK = ("Two measures compared", "A lorry stands on it in an earthquake")
"""Tasks by limit analysis alone; the others compute and draw histories."""


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


@pytest.mark.parametrize(
    ("opening", "area"),
    [
        ((-0.45, 0.45, 0.9, 2.7), 17.1),  # its head is a third of a course below the eaves
        ((-0.45, 0.45, 2.9, 4.1), 17.64),
        ((-2.3, -1.4, 0.9, 2.1), None),  # beside the edge there is no room for a jamb
        ((1.5, 2.6, 0.9, 2.1), None),
    ],
)
def test_a_wall_of_the_page_has_the_area_of_its_outline_less_its_opening(
    opening, area, tmp_path, monkeypatch
):
    """4.8 m broad, 2.8 m to the eaves and 5 m to the ridge: 18.72 m²."""
    monkeypatch.chdir(tmp_path)
    (code,) = (code for _, code, _ in BLOCK.findall(PAGE) if "def write_wall" in code)
    exec(code.partition('\nwrite_wall("gable.toml"')[0], space := {})
    *opening, head = opening
    wall = "wall.toml", lambda y: min(2.4, 2.4 * (5.0 - y) / 2.2), [2.8, 5.0], [opening], head
    if area is None:
        with pytest.raises(ValueError, match=r"stones of 18\.\d\d m² for a wall of 17\.\d\d m²"):
            space["write_wall"](*wall)
        return
    space["write_wall"](*wall)
    structure = af.Case.read("wall.toml").structure
    assert sum(structure.blocks[k].area for k in structure.free) == pytest.approx(area)


@pytest.mark.parametrize(
    ("openings", "head", "eaves"),
    [
        ([], 0.0, 2.5),
        ([(-0.75, 0.25, 0.0)], 2.0, 2.5),
        ([(0.2, 1.0, 1.0)], 2.0, 2.4),
        ([(0.2, 1.0, 0.75)], 2.0, 2.4),
        ([(-0.5, 0.5, 1.0)], 1.75, 2.5),
        ([(-1.9, -0.9, 0.0), (0.4, 1.5, 0.9)], 2.0, 2.5),  # a door and a window
    ],
)
def test_walls_of_the_page_are_in_running_bond(openings, head, eaves, tmp_path, monkeypatch):
    """No head joint is above another, also where a lintel ends; a mirrored wall is the same."""
    monkeypatch.chdir(tmp_path)
    (code,) = (code for _, code, _ in BLOCK.findall(PAGE) if "def write_wall" in code)
    exec(code.partition('\nwrite_wall("gable.toml"')[0], space := {})
    ridge, walls = eaves + 1.8, []
    for each in (openings, [(-right, -left, sill) for left, right, sill in openings]):
        roof = (lambda y: min(2.6, 2.6 * (ridge - y) / 1.8), [eaves, ridge])
        space["write_wall"]("wall.toml", *roof, each, head)
        walls.append(af.Case.read("wall.toml").structure)
    found = [
        np.array([j.ends for j, head in zip(w.joints, w.heads, strict=True) if head]) for w in walls
    ]
    places, low, high = (found[0][:, :, 0].mean(axis=1), *np.sort(found[0][:, :, 1], axis=1).T)
    above = np.isclose(high[:, None], low)
    assert above.any()
    assert np.abs(places[:, None] - places)[above].min() > 0.15
    other = np.sort((found[1].mean(axis=1) * [-1.0, 1.0]).round(6).view(complex), axis=0)
    assert np.allclose(np.sort(found[0].mean(axis=1).round(6).view(complex), axis=0), other)
    lintels = [b.points for b in walls[0].blocks if b.name.startswith("lintel")]
    for (left, right, sill), points in zip(openings, lintels, strict=True):
        assert points[:, 0].min() < left - 0.2
        assert points[:, 0].max() > right + 0.2
        assert points[:, 1].min() == head
        inside = np.array([(left + right) / 2.0, (sill + head) / 2.0])
        assert not any(
            (b.points.min(0) < inside).all() and (b.points.max(0) > inside).all()
            for b in walls[0].blocks
        )
