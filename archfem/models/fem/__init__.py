"""Meshes, spaces and forms: the one place that knows FEniCSx and gmsh.

edges      edges that touching blocks share
division   into how many cells each edge is cut
mesh       one conforming mesh of all blocks
space      the Lagrange space broken across joints
forms      weak forms in UFL
_fenicsx   what differs between versions of DOLFINx

Start reading at `mesh`, then at `space`.
"""
