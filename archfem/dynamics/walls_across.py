"""Walls across their plane: scales of motions at which they fall as one rigid body."""

from collections.abc import Mapping

from archfem.dynamics.rigid_body.rocking_body import (
    FirstFall,
    describe_first_fall,
    find_first_fall,
)
from archfem.errors import InvalidInput
from archfem.masonry.shapes.rings import columns_across
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

# Multiples of a motion at which a wall may fall across its plane [-]
SCALES_ACROSS = 0.1, 2.0


def find_falls_across(
    structure: Structure, motions: Mapping[str, Motion]
) -> dict[str, tuple[FirstFall, str]]:
    """Return the least first fall of strip and whole of a wall across its plane, and its motion.

    Each is one rigid body, held by nothing else. It is an error if neither rocks.
    """
    found = dict[str, tuple[FirstFall, str]]()
    for key, column in columns_across(structure).items():
        for name, motion in motions.items():
            first = find_first_fall(column, motion, SCALES_ACROSS)
            if first and (key not in found or first.scale < found[key][0].scale):
                found[key] = first, name
    if motions and not found:
        raise InvalidInput(
            "as one rigid body neither strip nor whole rocks: it slides before, or its joints "
            "resist tension; run a case of its courses, made by archfem.masonry.columns_across"
        )
    return found


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
