"""Mechanics of dry joints: contact law, quadrature, resultants and failure criteria.

    contact_law       tractions of a dry joint, at an instant and mean over a step
    criteria          Criteria, failure flags, durations
    large             joints between blocks with large displacements and rotations, compiled
    normal_law        normal forces by springs or exact facets; dilatancy and bonds
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
