"""Models that may be chosen, the cheapest first, and the finer ones that they are compared with."""

from collections.abc import Iterator
from typing import NamedTuple

from archfem.masonry.softness import soft_blocks
from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation


class Level(NamedTuple):
    """Models that are compared with one finer than all of them.

    Attributes:
        rungs: rungs and meshes, the cheapest first.
        best: the finer one.
    """

    rungs: tuple[tuple[str, tuple[int, int]], ...]
    best: tuple[str, tuple[int, int]]


LEVELS = (
    Level(
        (
            ("rigid", (1, 1)),
            ("faces", (2, 2)),
            ("faces", (4, 4)),
            ("condensed", (4, 4)),
        ),
        ("condensed", (8, 8)),
    ),
    Level((("faces", (8, 8)), ("condensed", (8, 8))), ("condensed", (12, 12))),
)
"""The second is looked at where all models of the first err too much. On a ring whose joints slide
faces 2×2, 4×4 and 8×8 err by 0.014, 0.006 and 0.002, condensed 4×4 and 8×8 by 0.005 and 0.001."""


def candidates(structure: Structure, level: Level) -> Iterator[Discretisation]:
    """Yield the models of a level; where there is soil, those whose blocks have cells.

    Args:
        structure: what stands.
        level: one of `LEVELS`.
    """
    soil = bool(soft_blocks(structure))
    for rung, cells in level.rungs:
        if not (soil and rung == "rigid"):
            yield exact(structure, rung, cells)


def best(structure: Structure, level: Level) -> Discretisation:
    """Return the model that those of a level are compared with.

    Args:
        structure: what stands.
        level: one of `LEVELS`.
    """
    return exact(structure, *level.best)


def exact(structure: Structure, rung: str, cells: tuple[int, int]) -> Discretisation:
    """Return a rung for all blocks but the soft ones, which keep all their nodes; exact joints.

    Args:
        structure: what stands.
        rung: of the stones.
        cells: through the thickness and along each block.
    """
    return Discretisation(stones(structure, rung), cells, quadrature="exact")


def stones(structure: Structure, rung: str) -> str | dict[str, str]:
    """Return a rung for all blocks but the soft ones, which keep all their nodes.

    Args:
        structure: what stands.
        rung: of the stones.
    """
    soft = [structure.blocks[number].name for number in soft_blocks(structure)]
    return {**dict.fromkeys(soft, "full"), "rest": rung} if soft else rung


def label(asked: Discretisation) -> str:
    """Return a model in a few words.

    Args:
        asked: its rung, mesh, and rule on the joints.
    """
    fidelity = asked.fidelity
    rung = fidelity if isinstance(fidelity, str) else fidelity["rest"] + " + soil"
    rule = asked.rule.rule + (f" {asked.points}" if asked.points else "")
    return f"{rung} {asked.through}×{asked.along} {rule}"
