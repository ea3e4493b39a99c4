"""The README's Python runs as it stands, and prints what it says."""

import re
from functools import reduce
from pathlib import Path

import pytest

import archfem as af

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_python_blocks_run_and_print_what_follows(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (printed,) = re.findall(r"prints\n\n```text\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.strip() == printed.strip()
    assert (tmp_path / "out" / "ring.nc").is_file()


def test_commands_are_targets_of_the_makefile():
    targets = (Path(__file__).parents[1] / "Makefile").read_text(encoding="utf-8")
    for command in set(re.findall(r"`?make (demo|test[a-z-]*|lint|[a-z]+-[a-z]+)", README)):
        assert re.search(rf"^{command}:", targets, re.MULTILINE)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"\baf\.([A-Za-z_][\w.]*\w)", README))))
def test_names_in_the_text_are_there(name):
    reduce(getattr, name.split("."), af)
