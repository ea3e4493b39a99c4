"""Results that tests verify, as rows of a table: `pytest --verified=docs/verification.json`.

A test with the fixture `verified` passes it computed values beside references that are independent
of this package. With the option only those tests run, and the values are written to the file,
from which the documentation makes its table. Numbers are rounded to the digits of the table.
Differences that are round-off are rounded up to a power of ten: every machine writes the same.
Cases of one name are one row, with the largest of their differences.
"""

import ast
import json
from math import ceil, log10
from pathlib import Path

import numpy as np
import pytest

DIGITS = 5
"""Of numbers in the table."""

ROUND_OFF = 1e-6
"""Relative difference below which only its order is written: digits below differ by machine."""


def rounded(number):
    """A number with as many digits as the table shows."""
    return float(f"{number:.{DIGITS}g}")


def order(difference):
    """A difference with one digit or two; where it is round-off the next of 1e-6, 1e-9, 1e-12."""
    if difference >= ROUND_OFF:
        return float(f"{difference:.{1 if difference < 1e-3 else 2}g}")
    return 10.0 ** max(3 * ceil(log10(max(difference, 1e-300)) / 3.0), -12)


def relative(computed, reference):
    """Largest difference, each relative to its reference; as it is where that is zero."""
    off = np.abs(np.subtract(computed, reference))
    return float(np.max(off / np.where(np.equal(reference, 0.0), 1.0, np.abs(reference))))


def json_value(value):
    """A value as JSON has it: words, or numbers that are rounded."""
    if isinstance(value, str):
        return value
    numbers = [rounded(number) for number in np.atleast_1d(value)]
    return numbers if len(numbers) > 1 else numbers[0]


def merged(rows):
    """Rows of which those of one case are one, with the largest of their differences."""
    kept = {}
    for row in rows:
        one = kept.setdefault((row["test"], row["case"]), {**row, "times": 0})
        one["times"] += 1
        if row["difference"] is not None:
            one["difference"] = max(one["difference"], row["difference"])
    return list(kept.values())


@pytest.fixture
def verified(request):
    """A function that records a computed value beside its reference; it asserts nothing."""

    def record(case, reference, source, computed, *, difference=None):
        if difference is None:
            words = isinstance(computed, str)
            difference = None if words else relative(computed, reference)
        row = {
            "case": case,
            "reference": json_value(reference),
            "source": source,
            "computed": json_value(computed),
            "difference": difference if difference is None else order(difference),
        }
        request.node.user_properties.append(("verified", row))

    return record


class Table:
    """Keeps rows of tests that passed, and writes them when all have run."""

    def __init__(self, path):
        self.path, self.rows = Path(path), []

    def pytest_runtest_logreport(self, report):
        if report.when == "call" and report.passed:
            file, line, _ = report.location
            for name, row in report.user_properties:
                if name == "verified":
                    self.rows.append(((file, line, report.nodeid), {**row, "test": file}))

    def pytest_sessionfinish(self, exitstatus):
        if exitstatus:
            return
        rows = merged(row for _, row in sorted(self.rows, key=lambda each: each[0]))
        for row in rows:
            text = Path(row["test"]).read_text(encoding="utf-8")
            row["of"] = ast.get_docstring(ast.parse(text)).splitlines()[0]
        self.path.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", "utf-8")
