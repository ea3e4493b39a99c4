"""Change physics in a copy of the package, one place at a time, and run the tests that execute it.

    python -m mutants [--count 60] [--seed 0] [--only dynamics/damping]

A line for each change: the test that noticed it, or that none did. First all default tests run
once, in some minutes, and record the statements that they execute in `out/reached.json`. The file
is kept until a source or a test changes. Only tests that execute the statement of a change run on
it, those of its own module and the shortest first, until one fails.

Changes that no test can notice, for they change no number, are listed with their reason in
`known.toml`, and do not count. Modules that numba compiles are left out unless `--only` names
their path: each change of theirs takes a minute to compile.
"""

import argparse
import json
import random
import resource
import shutil
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

from archfem._numba import source_digest
from mutants.changes import Change, changed, changes, marked
from mutants.noticing import Reached, failing, get_ready, reached

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "out" / "reached.json"
KNOWN = Path(__file__).with_name("known.toml")
ROOMS = ("motion", "masonry", "joints", "limit", "models", "statics", "dynamics")
ROOMS += ("studies", "cases")
IDLE = ("dynamics/warm_up",)
"""Modules whose numbers are never used: runs that are made to compile the kernels of steps."""

TESTS = [f"tests/{room}" for room in (*ROOMS, "view", "commands", "validation", "verification")]
TESTS += ["tests/test_doctests.py", "tests/test_wrong_arguments.py"]

DIGEST = Path("archfem/_numba.py")
"""Module that tells by a digest whether compiled code is as new as what stands beside kernels."""

DEFAULTS = "tests/verification/test_defaults.py"
"""Tests of values that a module has once it is imported: they execute no statement of it."""

FIRST, FILES = 4.0, 8
"""CPU time [s] and number of files of the tests that run first: most changes go no further."""

LIMIT = 25.0
"""CPU time [s] of the tests that run then, as they take on what is not changed."""

SLOWER, READING, COMPILING = 10.0, 20.0, 400.0
"""A change that makes tests so many times slower is noticed, beyond the CPU time [s] of reading all
that they import, and of compiling.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="modules whose path contains this")
    given = parser.parse_args()
    drawn = _draw(given.count, given.seed, given.only)
    get_ready()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name in ("archfem", "tests", "meshes", "docs", "archbench"):
            shutil.copytree(ROOT / name, place / name)
        shutil.copy(ROOT / "pyproject.toml", place)
        known, tests, tally = _known(), _reached(place), Counter[str]()
        for path, number, change in drawn:
            key = f"{path}: {change.function}: {change.words}"
            start = _spent()
            if key in known:
                came, why = "known", known[key]
            else:
                test = _noticed(place, path, number, change, tests)
                came, why = ("killed", f"by {test}") if test else ("SURVIVED", "")
            tally[came] += 1
            print(
                f"{came:8} {key} (line {change.line}, {_spent() - start:.0f} s) {why}", flush=True
            )
    counted = tally["killed"] + tally["SURVIVED"]
    print(
        f"{tally['killed']} of {counted} changes were noticed, {tally['killed'] / counted:.0%}; "
        f"{tally['known']} more change no number; {_spent():.0f} s of CPU time"
    )


def _draw(count: int, seed: int, only: str) -> list[tuple[Path, int, Change]]:
    """Changes by chance: each module is as likely as any other."""
    rng, found = random.Random(seed), []
    modules = {path: changes((ROOT / path).read_text(encoding="utf-8")) for path in _modules(only)}
    modules = {path: each for path, each in modules.items() if each}
    for _ in range(count):
        path = rng.choice(list(modules))
        number, change = rng.choice(list(enumerate(modules[path])))
        found.append((path, number, change))
    return found


def _modules(only: str) -> list[Path]:
    """Modules of physics; those that are compiled only where they are named."""
    paths = sorted(path for room in ROOMS for path in (ROOT / "archfem" / room).rglob("*.py"))
    own = [path.relative_to(ROOT) for path in paths]
    own = [path for path in own if not path.with_suffix("").as_posix().endswith(IDLE)]
    return [path for path in own if only in str(path) and (not _compiled(path) or only)]


def _compiled(path: Path) -> bool:
    """Whether numba compiles functions of a module."""
    source = (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).exists() else ""
    return any(f"{decorator}\ndef " in source for decorator in ("kernel", "@entry", "_entry"))


def _known() -> dict[str, str]:
    """Changes that change no number, each with its reason."""
    entries = tomllib.loads(KNOWN.read_text(encoding="utf-8"))["change"]
    return {entry["what"]: entry["why"] for entry in entries}


def _reached(place: Path) -> Reached:
    """Statements that each test executes, found now or kept from before."""
    sources = [path for name in ("archfem", "tests") for path in (ROOT / name).rglob("*.py")]
    sources = [path for path in sources if path.parent != KNOWN.parent]
    if KEPT.exists() and KEPT.stat().st_mtime > max(path.stat().st_mtime for path in sources):
        return json.loads(KEPT.read_text())
    print("all default tests run once, and record the statements that they execute", flush=True)
    for path in _modules(""):
        source = (ROOT / path).read_text(encoding="utf-8")
        (place / path).write_text(marked(source, path.as_posix()), encoding="utf-8")
    _keep_compiled(place)
    reached(place, TESTS)
    for path in _modules(""):
        shutil.copy2(ROOT / path, place / path)
    KEPT.parent.mkdir(exist_ok=True)
    shutil.copy(place / "reached.json", KEPT)
    return json.loads(KEPT.read_text())


def _noticed(place: Path, path: Path, number: int, change: Change, tests: Reached) -> str | None:
    """Name of a test that fails with a change and passes without; None where there is none."""
    source = (ROOT / path).read_text(encoding="utf-8")
    (place / path).write_text(changed(source, number), encoding="utf-8")
    if _compiled(path):
        shutil.copy2(ROOT / DIGEST, place / DIGEST)
    else:
        _keep_compiled(place)
    try:
        for chosen in _chosen(path, change, tests):
            limit = SLOWER * sum(tests[test][0] for test in chosen)
            if found := failing(place, chosen, limit + (COMPILING if _compiled(path) else READING)):
                return found
        return None
    finally:
        shutil.copy2(ROOT / path, place / path)


def _keep_compiled(place: Path) -> None:
    """Let compiled code of the copy count as new, though modules beside the kernels change."""
    source = (ROOT / DIGEST).read_text(encoding="utf-8")
    now = source.replace("return digest.hexdigest()[:16]", f"return {source_digest()!r}")
    (place / DIGEST).write_text(now, encoding="utf-8")


def _chosen(path: Path, change: Change, tests: Reached) -> list[list[str]]:
    """Tests that execute a change: those that run first, and those that run then."""
    executing = sorted(
        (
            test
            for test in tests
            if _own(test, path) or _executes(test, tests[test][1], path, change)
        ),
        key=lambda test: (not (_own(test, path) or test.startswith(DEFAULTS)), tests[test][0]),
    )
    first, then, early, spent = [], [], set(), 0.0
    for test in executing:
        file, taken = _file(test), tests[test][0]
        if spent + taken < FIRST and len(early | {file}) <= FILES:
            early.add(file)
            first.append(test)
        elif spent + taken < LIMIT:
            then.append(test)
        spent += taken
    # Those of one file together: they share what is made once for all of them.
    rank = {
        file: number for number, file in enumerate(dict.fromkeys(_file(test) for test in executing))
    }
    return [sorted(each, key=lambda test: rank[_file(test)]) for each in (first, then) if each]


def _executes(test: str, places: list[list[str | int]], path: Path, change: Change) -> bool:
    """Whether a test executes a change, as far as that is known."""
    if _compiled(path):
        return test.startswith((f"tests/{path.parts[1]}/", "tests/verification"))
    if change.statement is None:
        return test.startswith(DEFAULTS) or any(place[0] == path.as_posix() for place in places)
    return [path.as_posix(), change.statement.lineno] in places


def _own(test: str, path: Path) -> bool:
    return _file(test).endswith(f"/test_{path.stem}.py")


def _file(test: str) -> str:
    return test.split("::")[0]


def _spent() -> float:
    """CPU time of all tests so far [s]."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


if __name__ == "__main__":
    main()
