"""Discrete models of a structure: coordinates, matrices and joints at five fidelities.

    builder         build
    condensed       faces and condensed blocks by static condensation
    construction    partly built structures
    discretisation  Discretisation
    export          DXF, VTU and meshio files of one state
    fem             finite elements: gmsh meshes, function spaces and UFL forms
    large           models with large displacements, in corotational coordinates
    linear_blocks   linear or rigid blocks between joints, and their stress
    model           protocol Model, Prediction, cells for drawing
    programs        input of OpenSees and 3DEC
    reference       all nodes; reference model: UFL forms of joints assembled anew

Imports `masonry`, `joints` and the support modules. Start reading at `model`, then at
`linear_blocks`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
