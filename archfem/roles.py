"""What a part is to a mechanism: a ring, a pier, or something that follows what carries it."""

import re
from collections.abc import Iterable

RING_WORDS, PIER_WORDS = frozenset({"arch", "ring"}), frozenset({"pier", "column"})
"""Words that make a part a ring or a pier; numbers after them do not matter ("arch 2")."""


def part_role(part: str) -> str:
    """What a part is to a mechanism, by the words of its name: "ring", "pier" or "other".

    A ring is called an arch or a ring ("main arch"), a pier a pier or a column ("north pier").
    Without a name a part counts as a ring. Anything else, such as backfill, side walls or
    abutments, follows what carries it and is not judged.
    """
    words = {word.rstrip("0123456789") for word in re.split(r"[\s_-]+", part.lower())}
    if words & RING_WORDS or not part:
        return "ring"
    return "pier" if words & PIER_WORDS else "other"


def judged_parts(parts: Iterable[str]) -> tuple[str, ...]:
    """Those parts whose failures and motions are judged: rings and piers, in the order given.

    Where there is neither, as in a wall by itself, every part is judged.
    """
    names = tuple(dict.fromkeys(parts))
    return tuple(name for name in names if part_role(name) != "other") or names
