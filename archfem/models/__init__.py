"""Discrete models of a structure: coordinates, matrices and joints at five fidelities.

    builder         build
    condensed       faces and condensed blocks by static condensation
    construction    partly built structures
    discretisation  Discretisation
    export          DXF, VTU and meshio files of one state
    fem             finite elements: gmsh meshes, function spaces and UFL forms
    full            all nodes
    large           models with large displacements, in corotational coordinates
    linear_blocks   linear blocks between joints
    model           protocol Model, Prediction, cells for drawing
    observation     joint and block displacements from coordinates
    reference       reference model: UFL forms assembled at every iteration
    rigid           rigid blocks

Imports `masonry`, `joints` and the support modules. Start reading at `model`, then at `rigid`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
