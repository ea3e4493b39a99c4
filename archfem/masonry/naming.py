"""Things found by name or by number, and what was meant where there is none of that name."""

import difflib
from collections.abc import Iterable, Sequence
from numbers import Integral

from archfem.errors import InvalidInput


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
        raise InvalidInput(f"there is no {kind} '{wanted}': {did_you_mean(wanted, names, 0.0)}")
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
