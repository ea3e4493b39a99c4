"""Finite elements: gmsh meshes, function spaces and UFL forms.

    _fenicsx      DOLFINx version differences
    forms         UFL forms of blocks and joints
    joint_facets  facets of joints and their two sides
    mesh          cells along edges, conforming gmsh mesh
    space         space broken across joints

Only this package imports gmsh and FEniCSx.
"""

from archfem._optional import require_package

with require_package("FEniCSx"):
    from archfem.models.fem import _fenicsx as _fenicsx
