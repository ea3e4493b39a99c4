"""The waist: a structure as coordinates, matrices and joints, on every rung of the ladder.

    model           the protocol `Model`, and what was predicted of one
    discretisation  rung, mesh and quadrature: what a model is made with
    build           from a structure to a model on the rung that was asked for
    gauges          what is read off the coordinates: joints' faces, blocks' displacements
    cells           polygons that cover the blocks, and how they move
    jointed         linear blocks between dry joints
    unfinished      a structure of which a part stands, while it is being built
    rigid           the lowest rung: rigid blocks, no mesh
    reduced         faces and condensed, by a Galerkin basis
    moving          blocks whose displacements may be large
    moving_passage  a step of such a model
    turning_stages  such a model built in stages
    turning_blocks  its blocks in coordinates of their own
    turning_joints  the joints between them, whole or in pieces as meshed
    turning_places  how points of its blocks move
    full            the rung with all nodes
    monolithic      the slow reference, assembled at every iteration
    exchange        states of a model as files of other programs
    fem             meshes, spaces and forms: all that knows FEniCSx and gmsh

It imports from `masonry`, `joints` and the ground. Start reading at `model`, then at `rigid`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
