"""What a part is to a mechanism: a ring, a pier, or something that follows what carries it.

Blocks and joints say it themselves (`Block.role`, `Joint.role`). Where nothing of a part does, the
words of its name decide, and a name that leaves it open is warned of.
"""

import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import Field, replace
from typing import Any, ClassVar, Protocol, TypeVar

from archfem.errors import InvalidStructure

ROLES = ("ring", "pier", "other")
"""What a part can be. Rings and piers are judged; anything else follows what carries it."""

WORDS = {
    "ring": frozenset({"arch", "ring"}),
    "pier": frozenset({"pier", "column"}),
    "other": frozenset({"abutment", "base", "foundation", "footing", "ground", "rock"})
    | {"backfill", "backing", "earth", "fill", "filling", "infill", "soil"}
    | {"parapet", "sidewall", "spandrel", "wall", "wingwall"}
    | {"ballast", "deck", "pavement", "paver", "paving", "road"},
}
"""Words by which the name of a part tells its role, in the singular."""

TAKEN = {"ring": "a ring", "pier": "a pier", "other": "neither ring nor pier"}

logger = logging.getLogger("archfem")


class Member(Protocol):
    """A block or a joint: something that belongs to a part."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def name(self) -> str:
        """How a person finds it."""

    @property
    def part(self) -> str:
        """The part of the structure it belongs to."""

    @property
    def role(self) -> str:
        """What that part is, one of `ROLES`; empty where it was not told."""


AnyMember = TypeVar("AnyMember", bound=Member)


def with_roles(
    members: Sequence[AnyMember], others: Sequence[Member] = ()
) -> tuple[AnyMember, ...]:
    """Return blocks or joints with the roles of their parts, filled in where they do not tell them.

    What one of a part tells goes for all of it. Where none does, its name decides (`part_role`).

    Args:
        members: blocks or joints.
        others: of the same structure, that may tell roles too.

    Raises:
        InvalidStructure: a role is not known, or two of one part tell different ones.
    """
    told = _told((*members, *others))
    open_parts = dict.fromkeys(each.part for each in members if each.part not in told)
    roles = told | {part: part_role(part) for part in open_parts}
    return tuple(each if each.role else replace(each, role=roles[each.part]) for each in members)


def _told(members: Sequence[Member]) -> dict[str, str]:
    """Roles of those parts of which a member tells it."""
    first: dict[str, Member] = {}
    for each in members:
        if not each.role:
            continue
        if each.role not in ROLES:
            raise InvalidStructure(
                f"'{each.name}' of part '{each.part}' has role {each.role!r}, which is not known: "
                f"use one of {list(ROLES)}"
            )
        other = first.setdefault(each.part, each)
        if other.role != each.role:
            raise InvalidStructure(
                f"of part '{each.part}', '{other.name}' has role '{other.role}' and "
                f"'{each.name}' has role '{each.role}': give all blocks and joints of a part one "
                "role, or put them into different parts"
            )
    return {part: member.role for part, member in first.items()}


def part_role(part: str) -> str:
    """Tell the role of a part by the words of its name, and warn where they leave it open.

    A ring is called an arch or a ring ("main arch", "Arches_2"), a pier a pier or a column ("north
    pier"); `WORDS` lists what else is known. A name without any of these words is taken for
    neither, one with words of several roles for the first of `ROLES`; both are warned of. Without
    a name a part counts as a ring.

    Args:
        part: its name.

    Returns:
        One of `ROLES`.
    """
    if not part:
        return "ring"
    words = re.findall(r"[^\W\d_]+", part.lower())
    singular = {word.removesuffix(plural) for word in words for plural in ("", "s", "es")}
    named = [role for role in ROLES if singular & WORDS[role]]
    role = named[0] if named else "other"
    if len(named) != 1:
        why = f"speaks of {' and '.join(named)}" if named else "has no word that says what it is"
        logger.warning(
            "part '%s' is taken for %s: its name %s. Set its role to ring, pier or other: "
            'Block(role="ring"), or in a survey role = "ring" as a property of its outlines or of '
            "their layer in [structure.layers]",
            part,
            TAKEN[role],
            why,
        )
    return role


def judged_parts(roles: Mapping[str, str]) -> tuple[str, ...]:
    """Return the parts whose failures and motions are judged: rings and piers, in their order.

    Where there is neither, as in a wall by itself, every part is judged.

    Args:
        roles: of the parts, by name.
    """
    return tuple(part for part, role in roles.items() if role != "other") or tuple(roles)
