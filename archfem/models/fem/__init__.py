"""Meshes, spaces and forms: the one place that knows FEniCSx and gmsh.

edges         edges that touching blocks share
division      into how many cells each edge is cut
mesh          one conforming mesh of all blocks
meshes        those made lately, for structures of the same shapes
space         the Lagrange space broken across joints
joint_facets  what points on joint facets carry into forms, and what is read there
joint_forms   gap, slip and tractions of joints in UFL
forms         weak forms of blocks and joints
step_forms    the same, averaged over a step in time
_fenicsx      what differs between versions of DOLFINx

Start reading at `mesh`, then at `space`.
"""

from archfem.packages import needed

with needed("FEniCSx"):
    from archfem.models.fem import _fenicsx as _fenicsx
