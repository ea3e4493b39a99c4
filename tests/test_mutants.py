"""Places of a module that `make mutants` changes, places that it leaves, and the tests it runs."""

import builtins
import re
import tomllib
from collections import defaultdict
from pathlib import Path

from mutants.__main__ import DEFAULTS, KNOWN, _chosen
from mutants.changes import changed, changes, marked

ROOT = Path(__file__).parents[1]

SOURCE = '''
"""A module of 3 words."""
LIMIT = 0.5
def f(x: float = 2) -> float:
    """Of 1."""
    if x < 0:
        raise ValueError(f"{x + 1}")
    return max(x, -LIMIT) * 3
def g(x):
    bar.update(x + 1)
    return x.reshape(-1, 2), np.reshape(x, (-1, 3))
'''


def test_the_next_seed_was_not_used():
    lines = KNOWN.with_name("seeds.txt").read_text(encoding="utf-8").splitlines()
    used = [int(line.split()[0]) for line in lines if not line.startswith("#")]
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert int(re.search(r"the next is (\d+)", guide)[1]) == max(used) + 1


def test_every_number_and_operator_of_the_physics_is_changed_once():
    words = [f"{each.function}: {each.words}" for each in changes(SOURCE)]
    assert sorted(words) == [
        ": LIMIT = 0.5 → LIMIT = 0.55",
        "f: 2 → 3",
        "f: return max(x, -LIMIT) * 3 → return max(x, -LIMIT) * 4",
        "f: return max(x, -LIMIT) * 3 → return max(x, -LIMIT) / 3",
        "f: return max(x, -LIMIT) * 3 → return max(x, LIMIT) * 3",
        "f: return max(x, -LIMIT) * 3 → return min(x, -LIMIT) * 3",
        "g: return (x.reshape(-1, 2), np.reshape(x, (-1, 3))) → "
        "return (x.reshape(-1, 2), np.reshape(x, (-1, 4)))",
        "g: return (x.reshape(-1, 2), np.reshape(x, (-1, 3))) → "
        "return (x.reshape(-1, 3), np.reshape(x, (-1, 3)))",
    ]
    for number in range(len(words)):
        text = changed(SOURCE, number)
        assert text != changed(SOURCE, number - 1)
        compile(text, "changed", "exec")
        assert text.count("raise ValueError") == 1


def test_a_marked_module_reports_the_changes_that_it_executes(monkeypatch):
    space, came = {}, []
    monkeypatch.setattr(builtins, "_reached", came.append, raising=False)
    exec(marked(SOURCE, "own.py"), space)
    assert came == []
    assert space["f"](1.0) == 3.0
    assert came == [("own.py", 6), ("own.py", 8)]  # the first statement, and one with changes
    assert {each.statement and each.statement.lineno for each in changes(SOURCE)} == {None, 8, 11}


def test_a_change_runs_its_own_tests_and_those_that_execute_it_shortest_first():
    path = Path("archfem/joints/law.py")
    change = changes("def f(x):\n    return 2 * x\n")[0]
    here, elsewhere = ["archfem/joints/law.py", 2], ["archfem/joints/law.py", 9]
    tests = {
        "tests/a/test_any.py::long": (9.0, [here]),
        "tests/a/test_any.py::short": (0.2, [here]),
        "tests/a/test_any.py::idle": (0.1, [elsewhere]),
        "tests/joints/test_law.py::own": (0.3, []),
    }
    first = ["tests/joints/test_law.py::own", "tests/a/test_any.py::short"]
    assert _chosen(path, change, tests) == [first, ["tests/a/test_any.py::long"]]


def test_a_default_runs_the_tests_of_defaults_which_execute_no_statement():
    path, default = Path("archfem/joints/law.py"), changes("def f(x=2):\n    return x\n")[0]
    own, other = f"{DEFAULTS}::own", "tests/a/test_any.py::idle"
    assert default.statement is None
    assert (ROOT / DEFAULTS).exists()
    assert _chosen(path, default, {own: (0.1, []), other: (0.1, [])}) == [[own]]


def test_known_changes_of_no_number_exist_and_have_a_reason():
    known = defaultdict(lambda: defaultdict(set))
    for entry in tomllib.loads(KNOWN.read_text(encoding="utf-8"))["change"]:
        path, function, words = entry["what"].split(": ", 2)
        known[path][function].add(words)
        assert entry["why"]
    for path, functions in known.items():
        found = defaultdict(set)
        for change in changes((ROOT / path).read_text(encoding="utf-8")):
            if (function := change.function) in functions:  # words of others take most of the time
                found[function].add(change.words)
        for function, words in functions.items():
            assert words <= found[function], words - found[function]
