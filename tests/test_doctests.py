"""Examples in docstrings of public names run, and print the output that they show."""

import doctest
from importlib import import_module

import archfem as af

ROOMS = ["", "joints", "limit", "masonry", "motion", "statics", "dynamics", "studies", "units"]
"""`view` is left out: its examples are the gallery, and pyvista takes its time to load."""


def examples():
    """Doctests of every public value that has any, each once."""
    finder, found = doctest.DocTestFinder(recurse=False), {}
    for room in ROOMS:
        place = import_module(f"archfem.{room}".rstrip("."))
        for name in getattr(place, "__all__", ["in_unit"]):
            value = getattr(place, name)
            if getattr(value, "__module__", "").startswith("archfem."):
                for test in finder.find(value, name, globs={"af": af}):
                    found[value.__module__, name] = test
    return [test for test in found.values() if test.examples]


def test_examples_print_the_output_that_they_show():
    printed, ran = [], examples()
    runner = doctest.DocTestRunner()
    for example in ran:
        runner.run(example, out=printed.append)
    assert not runner.failures, "".join(printed)
    assert len(ran) >= 15
