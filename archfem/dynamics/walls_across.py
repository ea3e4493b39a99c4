"""Walls across their plane: scales of motions at which they fall as one rigid body."""

from collections.abc import Mapping
from functools import lru_cache

from archfem.dynamics.rigid_body.rocking_body import FirstFall, describe_first_fall, find_first_fall
from archfem.errors import ArchfemError, InvalidInput, logger
from archfem.masonry.out_of_plane import columns_across
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

# Multiples of a motion at which a wall may fall across its plane [-]
SCALES_ACROSS = 0.1, 2.0


def find_falls_across(
    structure: Structure, motions: Mapping[str, Motion]
) -> dict[str, tuple[FirstFall, str]]:
    """Return the least first fall of each column of a wall across its plane, and its motion.

    Each is one rigid body, held by nothing else. It is an error if neither rocks. There are none of
    what has no bond.
    """
    if not structure.heads.any():
        return {}
    found = dict[str, tuple[FirstFall, str]]()
    for name, motion in motions.items():
        for key, first in _find_falls(structure, motion).items():
            if first and (key not in found or first.scale < found[key][0].scale):
                found[key] = first, name
    if motions and not found:
        raise InvalidInput(
            "as one rigid body no column of the wall rocks: it slides before, or its joints "
            "resist tension; run a case of its courses, made by archfem.masonry.columns_across"
        )
    return found


@lru_cache(maxsize=8)  # a run states its own, and those of all motions follow
def _find_falls(structure: Structure, motion: Motion) -> dict[str, FirstFall | None]:
    """Return the first falls of the columns of a wall under a motion; None of what slides."""
    columns = columns_across(structure).items()
    return {key: find_first_fall(column, motion, SCALES_ACROSS) for key, column in columns}


def check_across(structure: Structure, motions: Mapping[str, Motion]) -> tuple[str, str]:
    """Return in a line at which scales a wall falls across its plane, and for a headline below 1.

    Both are empty of what is no wall in bond, and of what does not rock, which is logged.
    """
    try:
        found = find_falls_across(structure, motions)
    except ArchfemError as error:  # what was run is kept
        logger.warning("the wall was not checked against the motions across its plane: %s", error)
        return "", ""
    if not found:
        return "", ""
    body, (first, name) = min(found.items(), key=lambda fall: fall[1][0].scale)
    of = f"'{name}'" if len(motions) > 1 else "the motion"
    falls = f"; across its plane the {body} {describe_first_fall(first, motions[name].pga, of)}"
    return describe_falls_across(found, motions), falls * (first.scale <= 1.0)


def describe_falls_across(
    found: Mapping[str, tuple[FirstFall, str]], motions: Mapping[str, Motion]
) -> str:
    """Describe the result of `find_falls_across` in one line."""
    scales = f"{SCALES_ACROSS[0]:g} to {SCALES_ACROSS[1]:g} × the motion"
    falls = (
        f"under '{name}' the {key} {describe_first_fall(first, motions[name].pga)}"
        for key, (first, name) in found.items()
    )
    bodies = "across its plane, as one rigid body held by nothing else"
    return f"{bodies}, at {scales}: {'; '.join(falls)}"
