"""Change physics in a copy of the package, one place at a time, and let the tests of its room run.

    python -m mutants [--count 60] [--seed 0] [--only dynamics/damping]

Prints a line for each change that no test has noticed, and the share that was. Modules that numba
compiles are left out: each change of theirs would take minutes to compile.
"""

import argparse
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from functools import cache
from pathlib import Path

from mutants.changes import changed, changes

ROOT = Path(__file__).parents[2]
ROOMS = ("motion", "masonry", "joints", "limit", "models", "statics", "dynamics")
LIMIT = 300
"""CPU time of one run of tests [s]: a change that makes them so slow is noticed."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="modules whose path contains this")
    given = parser.parse_args()
    rng, tally = random.Random(given.seed), Counter[str]()
    modules = [path for path in _modules() if given.only in str(path)]
    with tempfile.TemporaryDirectory() as place:
        for name in ("archfem", "tests", "meshes"):
            shutil.copytree(ROOT / name, Path(place) / name)
        shutil.copy(ROOT / "pyproject.toml", place)
        for _ in range(given.count):
            path = rng.choice(modules)
            for tests in _tests_of(Path(place), path):
                _failing(Path(place), tests)
            source = (Path(place) / path).read_text(encoding="utf-8")
            number, (line, words) = rng.choice(list(enumerate(changes(source))))
            (Path(place) / path).write_text(changed(source, number), encoding="utf-8")
            came = "killed" if _noticed(Path(place), path) else "SURVIVED"
            (Path(place) / path).write_text(source, encoding="utf-8")
            tally[came] += 1
            print(f"{came:8} {path}:{line}: {words}", flush=True)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    share = tally["killed"] / tally.total()
    print(
        f"{tally['killed']} of {tally.total()} changes were noticed, {share:.0%}; "
        f"{spent.ru_utime + spent.ru_stime:.0f} s of CPU time"
    )


def _modules() -> list[Path]:
    """Modules of physics that can be changed without compiling."""
    paths = [path for room in ROOMS for path in (ROOT / "archfem" / room).glob("*.py")]
    return [
        path.relative_to(ROOT)
        for path in sorted(paths)
        if "numba" not in (text := path.read_text(encoding="utf-8")) and changes(text)
    ]


def _tests_of(place: Path, path: Path) -> list[Path]:
    """Tests that should notice: first those named after the module, then those of its room."""
    room = Path("tests") / path.parts[1]
    own = room / f"test_{path.stem}.py"
    return [own, room] if (place / own).exists() else [room]


def _noticed(place: Path, path: Path) -> bool:
    """Whether a test fails that passes on what is not changed."""
    return any(
        _run(place, tests, "-x", *_failing(place, tests)).returncode
        for tests in _tests_of(place, path)
    )


@cache
def _failing(place: Path, tests: Path) -> list[str]:
    """Options that leave out what fails before anything is changed: it would notice whatever is."""
    said = _run(place, tests, "-rfE").stdout.splitlines()
    failed = [line.split()[1] for line in said if line.startswith(("FAILED", "ERROR"))]
    if failed:
        print(f"left out, for they fail as it is: {', '.join(failed)}", flush=True)
    return [f"--deselect={name}" for name in failed]


def _run(place: Path, tests: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run tests on the copy."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tests), *options],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(place)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
    )


if __name__ == "__main__":
    main()
