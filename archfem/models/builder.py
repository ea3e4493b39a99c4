"""Building a model of a structure from its discretisation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from archfem._threads import single_threaded
from archfem.errors import InvalidInput, logger
from archfem.masonry.stiffness_ratio import (
    SOFT_JOINTS,
    estimate_bending,
    estimate_block_stiffness,
    estimate_locking,
    find_soft_blocks,
    list_stones,
)
from archfem.masonry.structure import Structure, join_names
from archfem.models.condensed import condense_blocks
from archfem.models.discretisation import Discretisation
from archfem.models.linear_blocks import build_rigid_model
from archfem.models.model import Doubt, Model


@single_threaded
def build(structure: Structure, settings: Discretisation) -> Model:
    """Build a model of a structure."""
    model = _build_small(structure, settings)
    if settings.displacements == "large":
        # imported here: its compiled functions take a while to load
        from archfem.models.large.model import LargeDisplacementModel

        model = LargeDisplacementModel(model)
    fidelities = list_fidelities(structure, settings.fidelity)
    doubts = [*_doubt_soft_blocks(structure, fidelities)]
    if settings.degree == 1 and settings.mesh_file is None:
        doubts += _doubt_long_cells(structure, fidelities, settings.along)
    model.doubts = tuple(doubts)
    for doubt in model.doubts:
        logger.warning("%s", doubt)
    return model


def _build_small(structure: Structure, settings: Discretisation) -> Model:
    """Build a model of small displacements."""
    if structure.has_own_laws:
        settings = _use_quadrature_points(settings)
    fidelities = list_fidelities(structure, settings.fidelity)
    if settings.fidelity == "monolithic":
        _check_plain_joints(structure)
    if settings.fidelity == "rigid":
        return build_rigid_model(structure, settings.through, settings.rule)
    # imported here: rigid models do not need DOLFINx
    from archfem.models.fem.mesh import get_mesh, read_mesh
    from archfem.models.fem.space import build_broken_space
    from archfem.models.reference import MonolithicModel, build_full_model

    given = settings.mesh_file
    mesh = get_mesh(structure, settings) if given is None else read_mesh(structure, given)
    space = build_broken_space(mesh, settings.degree)
    if settings.fidelity == "monolithic":
        return MonolithicModel(space, settings.rule)
    model = build_full_model(space, settings.rule)
    return (
        model if settings.fidelity == "full" else condense_blocks(model, fidelities, settings.name)
    )


def list_fidelities(structure: Structure, fidelity: str | Mapping[str, str]) -> list[str]:
    """Return the fidelity of each block."""
    if isinstance(fidelity, str):
        return [fidelity] * len(structure.blocks)
    names = {block.name for block in structure.blocks} | {block.part for block in structure.blocks}
    unknown = sorted(set(fidelity) - names - {"rest"})
    if unknown:
        raise InvalidInput(
            f"fidelity names {unknown}, which are no blocks or parts: {sorted(names)}"
        )
    default = fidelity.get("rest", "full")
    return [fidelity.get(b.name, fidelity.get(b.part, default)) for b in structure.blocks]


def _use_quadrature_points(settings: Discretisation) -> Discretisation:
    """Return settings with the points that laws of the user need, or refuse where none can act."""
    what = "contacts have a law of their own, which "
    if settings.displacements == "large":
        raise InvalidInput(f"{what}does not exist with large displacements: use 'small'")
    if settings.fidelity == "monolithic":
        raise InvalidInput(f"{what}is not written in UFL: use fidelity='full', the same model")
    if settings.quadrature == "exact":
        raise InvalidInput(
            f"{what}acts at points, and 'exact' quadrature has none: leave quadrature out, or use "
            "'lobatto', 'trapezoidal', 'nodal' or 'gauss'"
        )
    return replace(settings, quadrature=settings.quadrature or "lobatto")


def _check_plain_joints(structure: Structure) -> None:
    """Refuse joints whose law is not written as weak forms."""
    contacts = {joint.contact for joint in structure.joints}
    names = {x.name for x in contacts if x.dilatancy > 0.0 or x.tension > 0.0}
    if names:
        raise InvalidInput(
            f"contacts {sorted(names)} have dilatancy or tension, which fidelity='monolithic' does "
            "not write: use 'full', which is the same model"
        )


def _doubt_soft_blocks(structure: Structure, fidelities: Sequence[str]) -> Iterator[Doubt]:
    """Yield doubts about blocks too soft for their fidelity."""
    soft = find_soft_blocks(structure)
    for fidelity in ("rigid", "faces", "condensed"):
        if numbers := [number for number in soft if fidelities[number] == fidelity]:
            found = [estimate_block_stiffness(structure, number) for number in numbers]
            yield Doubt(
                f"own modes of soft blocks begin near {min(each.inner for each in found):.0f} Hz, "
                f"in the seismic band, and they are {min(each.ratio for each in found):.2g} times "
                f"as stiff as their joints or more: "
                f"{join_names([structure.blocks[number].name for number in numbers])}",
                f"'{fidelity}' is wrong for them, use 'full'",
            )
    # energy of earthquakes ends near 25 Hz
    slender = {
        number: frequency
        for number in structure.free
        if number not in soft and fidelities[number] in ("rigid", "faces", "condensed")
        if (frequency := estimate_bending(structure, number)) < 25.0
        and estimate_block_stiffness(structure, number).ratio < SOFT_JOINTS
    }
    if slender:
        yield Doubt(
            f"slender blocks bend at {min(slender.values()):.2g} Hz or more, in the seismic band, "
            f"which their fidelity leaves out: "
            f"{join_names([structure.blocks[number].name for number in slender])}",
            "use 'full' with degree = 2 for them, or cut them into courses",
        )


def _doubt_long_cells(
    structure: Structure, fidelities: Sequence[str], along: int
) -> Iterator[Doubt]:
    """Yield a doubt about slender blocks whose cells of degree 1 are long."""
    stones = [number for number in list_stones(structure) if fidelities[number] != "rigid"]
    errors = {number: estimate_locking(structure, number, along) for number in stones}
    if names := [structure.blocks[number].name for number, x in errors.items() if x > 0.05]:
        words = "cells of degree 1 raise frequencies of bending of slender blocks by about "
        words += f"{max(errors.values()):.0%}: {join_names(names)}"
        yield Doubt(words, "take degree = 2, or more cells along them")
