"""The README and the pages of the documentation: code runs, and names and files exist."""

import json
import re
import tomllib
from functools import reduce
from pathlib import Path

import pytest

import archfem as af

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MADE = ("made", "build", "notebooks")
PAGES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if path.parent.name not in MADE
}
WORDS = "\n".join(PAGES.values())

RUN = re.compile(r"```python\n(.*?)```(?:(?:(?!```).)*?```text\n(.*?)```)?", re.DOTALL)
"""A block of Python, and the output that the next block shows, if it does."""


SLOW = tuple(f"docs/{page}.md" for page in ("tutorial",)) + tuple(
    f"docs/howto/{page}.md" for page in ("capacity", "falls")
)
"""Pages whose code other tests or the README's lines run as well."""


def run_blocks(page, capsys):
    """Run a page's Python from first to last, each block with the names of those before."""
    space = {"__name__": "__main__"}
    for code, printed in RUN.findall(PAGES[page]):
        exec(compile(code, page, "exec"), space)
        output = capsys.readouterr().out
        if printed:
            assert output.strip() == printed.strip()


def with_python():
    for page, text in PAGES.items():
        # others show lines alone, and test_tasks.py runs the tasks
        if "```python\nimport" in text and page not in ("README.md", "docs/howto/tasks.md"):
            yield pytest.param(page, marks=pytest.mark.slow if page in SLOW else ())


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 200


def test_python_blocks_run_and_print_the_following_block(tmp_path, monkeypatch, capsys):
    assert README.count("```python") == 1
    monkeypatch.chdir(tmp_path)
    run_blocks("README.md", capsys)
    assert af.Case.read(tmp_path / "out" / "ring.toml").analysis.displacements == "large"


@pytest.mark.parametrize("page", list(with_python()))
def test_pages_run_and_print_the_following_blocks(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks(page, capsys)


def test_commands_are_targets_of_the_makefile():
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    found = set(re.findall(r"`make ([a-z0-9-]+)", WORDS)) | set(
        re.findall(r"^make ([\w-]+)", WORDS, re.M)
    )
    assert {"demo", "test", "docs", "notebooks", "verification"} <= found
    for command in found:
        assert re.search(rf"^{command}:", targets, re.MULTILINE), command


def test_files_of_commands_are_there():
    for name in set(re.findall(r"(?:meshes|tests/benchmarks)/\w+\.(?:toml|py)", WORDS)):
        assert (ROOT / name).is_file(), name


def test_commands_are_those_of_the_command_line(capsys):
    with pytest.raises(SystemExit):
        af.commands.main(["--help"])
    known = capsys.readouterr().out
    shell = "\n".join(re.findall(r"```sh\n(.*?)```", WORDS, re.DOTALL))
    found = re.findall(r"^archfem (\w+)", shell, re.MULTILINE) + re.findall(
        r"`archfem (\w+)", WORDS
    )
    assert {"run", "study", "motion"} <= set(found)
    for command in set(found):
        assert f" {command} " in known, command


def test_names_in_the_text_are_there():
    """By their lists: loading the modules of films takes seconds."""
    missing = []
    for name in set(re.findall(r"\baf\.([A-Za-z_][\w.]*\w)", WORDS)):
        *places, last = name.split(".")
        if last not in dir(reduce(getattr, places, af)):
            missing.append(name)
    assert missing == []


def test_the_table_of_verification_names_tests_that_record_results():
    for row in json.loads((ROOT / "docs" / "verification.json").read_text(encoding="utf-8")):
        assert "verified(" in (ROOT / row["test"]).read_text(encoding="utf-8")


def test_the_address_of_the_repository_is_stated_in_one_file():
    """Whoever hosts the project fills it in there."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project["urls"]["Homepage"].removeprefix("https://")
    texts = [*ROOT.glob("*.*"), *(ROOT / ".github").rglob("*.*"), *(ROOT / "docs").glob("*.*")]
    texts = [path for path in texts if path.suffix in (".md", ".cff", ".py", ".toml", ".yml")]
    assert [path.name for path in texts if address in path.read_text(encoding="utf-8")] == [
        "pyproject.toml"
    ]


def test_links_of_the_readme_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target
