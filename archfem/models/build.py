"""From a structure to a model on the rung that was asked for."""

import logging
from collections.abc import Iterator, Mapping, Sequence

from archfem.errors import InvalidInput
from archfem.masonry.softness import soft_blocks, softness
from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.models.reduced import reduced
from archfem.models.rigid import rigid
from archfem.threads import on_one_thread

logger = logging.getLogger("archfem")


@on_one_thread
def build(structure: Structure, asked: Discretisation) -> Model:
    """Build a model of a structure.

    Args:
        structure: what stands.
        asked: rung, or rungs by block, mesh, and rule on the joints. Of the ladder, "rigid" has
            rigid blocks and no mesh: all compliance is in the joints; "faces" lets each joint face
            move as a plane and condenses the rest statically; "condensed" keeps all nodes on
            joints and condenses the rest; "full" keeps all nodes; "monolithic" does, too, and
            assembles the UFL forms at each iteration.

    Returns:
        The model; where a rung is too low for a soft block, a warning is logged, and is among its
        `doubts`.

    Raises:
        InvalidInput: a rung is asked for blocks that there are not, or "monolithic" for joints that
            dilate or resist tension.
        MeshError: the blocks cannot be cut as asked.
    """
    if asked.displacements == "large":
        from archfem.models.moving import Moving  # compiled: it takes a while to import

        made: Model = Moving(_small(structure, asked))
    else:
        made = _small(structure, asked)
    made.doubts = tuple(_doubts(structure, _rungs(structure, asked.fidelity)))
    for words in made.doubts:
        logger.warning("%s", words)
    return made


def _small(structure: Structure, asked: Discretisation) -> Model:
    """Build a model of small displacements."""
    rungs = _rungs(structure, asked.fidelity)
    if asked.fidelity == "monolithic":
        _check_plain(structure)
    if asked.fidelity == "rigid":
        return rigid(structure, asked.through, asked.rule)
    from archfem.models.fem.mesh import read_mesh  # FEniCSx is needed from here on only
    from archfem.models.fem.meshes import mesh_of
    from archfem.models.fem.space import broken_space
    from archfem.models.full import full
    from archfem.models.monolithic import Monolithic

    made = mesh_of(structure, asked) if asked.file is None else read_mesh(structure, asked.file)
    space = broken_space(made, asked.degree)
    if asked.fidelity == "monolithic":
        return Monolithic(space, asked.rule)
    model = full(space, asked.rule)
    return model if asked.fidelity == "full" else reduced(model, rungs, asked.name)


def _rungs(structure: Structure, fidelity: str | Mapping[str, str]) -> list[str]:
    """Rung of each block."""
    if isinstance(fidelity, str):
        return [fidelity] * len(structure.blocks)
    known = {block.name for block in structure.blocks} | {block.part for block in structure.blocks}
    unknown = sorted(set(fidelity) - known - {"rest"})
    if unknown:
        raise InvalidInput(
            f"fidelity names {unknown}, which are no blocks or parts: {sorted(known)}"
        )
    rest = fidelity.get("rest", "full")
    return [fidelity.get(b.name, fidelity.get(b.part, rest)) for b in structure.blocks]


def _check_plain(structure: Structure) -> None:
    """Refuse joints whose law is not written as weak forms."""
    names = {
        joint.contact.name
        for joint in structure.joints
        if joint.contact.dilatancy > 0.0 or joint.contact.tension > 0.0
    }
    if names:
        raise InvalidInput(
            f"contacts {sorted(names)} have dilatancy or tension, which fidelity='monolithic' does "
            "not write: use 'full', which is the same model"
        )


def _doubts(structure: Structure, rungs: Sequence[str]) -> Iterator[str]:
    """Where a rung is too low for a block."""
    for number in soft_blocks(structure):
        if rungs[number] in ("rigid", "faces", "condensed"):
            found = softness(structure, number)
            yield (
                f"block '{structure.blocks[number].name}' is soft: its own modes begin near "
                f"{found.inner:.0f} Hz, in the seismic band, and it is {found.ratio:.2g} times as "
                f"stiff as its joints; '{rungs[number]}' is wrong for it, use 'full'"
            )
