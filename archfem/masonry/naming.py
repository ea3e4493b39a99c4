"""Things found by name or by number, what was meant where there is none, and lists of names."""

import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from numbers import Integral

from archfem.errors import InvalidInput

SHOWN = 8
"""Names in a list, beyond which those in the middle are left out."""


def number_of(kind: str, names: Sequence[str], wanted: str | int) -> int:
    """Return the number of a thing, given by its name or by that number.

    Args:
        kind: what it is, "joint" or "block".
        names: of all there are, in order.
        wanted: name or number.

    Raises:
        InvalidInput: there is none; the nearest name is suggested.
    """
    if isinstance(wanted, str):
        if wanted in names:
            return list(names).index(wanted)
        near = did_you_mean(wanted, names, 0.0)
        others = difflib.get_close_matches(wanted, list(names), 4, 0.7)[1:]
        also = f" Or one of {others}" if others else ""
        raise InvalidInput(f"there is no {kind} '{wanted}': {near}{also}")
    if not isinstance(wanted, Integral) or not 0 <= wanted < len(names):
        raise InvalidInput(
            f"there is no {kind} {wanted}: give a number from 0 to {len(names) - 1}, or a name "
            f"such as '{names[0]}'"
        )
    return int(wanted)


def did_you_mean(word: str, known: Iterable[str], likeness: float = 0.6) -> str:
    """Return a question after the known word nearest to a misspelt one; empty where none is near.

    Args:
        word: which is not known.
        known: words.
        likeness: of the nearest word, at least, from 0 for any to 1 for the same.
    """
    near = difflib.get_close_matches(word, list(known), 1, likeness)
    return f"did you mean '{near[0]}'?" if near else ""


def listed(names: Sequence[str], comma: str = ", ") -> str:
    """Return names as a list, without its middle where it is long.

    Args:
        names: of things.
        comma: between them.
    """
    return comma.join(names) if len(names) <= SHOWN else _cut(names, comma.join, comma)


def listed_joints(names: Sequence[str]) -> str:
    """Return names of joints as a short list: "north pier, base; main arch, joints 0, 5 and 11".

    What names of neighbours in the list have in common is told once; the middle of a long list is
    left out.

    Args:
        names: in the order of the joints.
    """
    return _together(names) if len(names) <= SHOWN else _cut(names, _together, "; ")


def _cut(names: Sequence[str], put: Callable[[Sequence[str]], str], comma: str) -> str:
    """Both ends of a list, and how many names there are."""
    half = SHOWN // 2
    return f"{put(names[:half])}{comma}…{comma}{put(names[-half:])} ({len(names)} in all)"


def _together(names: Sequence[str]) -> str:
    """Names of joints, those that differ in a number alone in one."""
    groups: list[tuple[str, list[str]]] = []
    for name in names:
        stem, _, number = name.rpartition(" ")
        if not (stem.endswith("joint") and re.fullmatch(r"\d+", number)):
            groups.append((name, []))
        elif groups and groups[-1][1] and groups[-1][0] == stem:
            groups[-1][1].append(number)
        else:
            groups.append((stem, [number]))
    return "; ".join(
        f"{stem}s {', '.join(own[:-1])} and {own[-1]}" if len(own) > 1 else " ".join([stem, *own])
        for stem, own in groups
    )
