"""Meshes made lately, for structures of the same shapes whatever they are made of."""

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import fields, replace

from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation
from archfem.models.fem.mesh import Mesh, mesh

KEPT = 4
"""How many meshes are kept."""

_kept: OrderedDict[Hashable, Mesh] = OrderedDict()


def mesh_of(structure: Structure, asked: Discretisation) -> Mesh:
    """Return the mesh of a structure, as it was made for one of the same shapes if it was.

    Args:
        structure: what to mesh.
        asked: number and kind of cells.

    Raises:
        MeshError: the blocks cannot be cut conformingly as asked.
    """
    cut = (asked.through, asked.along, asked.cell, asked.coarse, asked.degree)
    key = (*map(_shape, (*structure.blocks, *structure.joints)), cut)
    try:
        hash(key)
    except TypeError:  # outlines may be given as lists
        return mesh(structure, asked)
    if key not in _kept:
        _kept[key] = mesh(structure, asked)
        while len(_kept) > KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return replace(_kept[key], structure=structure)


def _shape(thing: object) -> Hashable:
    """All of a block or joint but what it is made of, and how it answers."""
    names = (field.name for field in fields(thing))  # type: ignore[arg-type]
    told = tuple(getattr(thing, name) for name in names if name not in ("material", "contact"))
    return type(thing).__name__, told
