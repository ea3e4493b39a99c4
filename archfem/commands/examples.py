"""The commands for the cases that archfem brings."""

import argparse
import sys
from pathlib import Path

from archfem.cases.shipped import copy_shipped, shipped_text, shipped_titles


def examples(given: argparse.Namespace) -> None:
    """Print the names of the cases, and what each is.

    Args:
        given: nothing.
    """
    titles = shipped_titles()
    width = max(map(len, titles))
    for name, title in titles.items():
        print(f"{name.ljust(width)}  {title}")


def example(given: argparse.Namespace) -> None:
    """Print a case, or copy it with all that it refers to.

    Args:
        given: `name` of the case; `out`, a folder to copy it to, or None.
    """
    if given.out is not None:
        for path in copy_shipped(given.name, Path(given.out)):
            print(f"wrote {path}")
        return
    text, beside = shipped_text(given.name)
    print(text, end="")
    if beside:
        names = ", ".join(path.name for path in beside)
        print(
            f"archfem: it refers to {names} where archfem is installed; "
            f"`archfem example {given.name} --out DIR` copies all of them",
            file=sys.stderr,
        )
