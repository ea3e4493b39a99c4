"""Mechanics of dry joints: contact law, quadrature, resultants and failure criteria.

    contact_law       traction of a dry joint, instant and step mean; dilatancy and bonds
    criteria          Criteria, failure flags, durations
    large             joints between blocks with large displacements and rotations, compiled
    operator          joint operator G, forces, tangent, slip memory
    own_law           joint laws of the user: tractions, tangent and history
    quadrature        quadrature rules and points
    resultants        N, V, M, e; opening, rotation, slip; tables
    rigid_kinematics  G of rigid blocks
    step_average      joint forces averaged over a time step

Imports `masonry` and the support modules. Start reading at `operator`, then at `resultants`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
