"""How dry joints answer: law, quadrature, the operator G, resultants N V M e, criteria.

    law         tractions from opening and slip
    quadrature  rules that integrate the traction along a joint
    points      points on the joints, where openings and slips are taken
    springs     normal forces of points that are springs of their own
    facets      normal forces of facets, integrated exactly
    bonds       saw teeth that dilate, bonds that break: what they add to the law
    integration which of both a quadrature rule asks for
    kinematics  the joint operator G, from coordinates to openings and slips, and back
    operator    the same with forces from openings and slips, and memory
    passage     a step of the joints: means of their forces, and what they remember
    moving      joints between blocks that move as far as they like, compiled
    faces       opening, rotation and slip of whole joints
    given_limits  joints whose limits of friction stay as they are
    rigid       G of rigid blocks
    sparsity    one sparsity pattern for a family of matrices
    resultants  N, V, M, eccentricity, mobilised friction, thrust line
    table       what joints carry as CSV, Parquet or Excel
    duration    how long something holds, over steps of any lengths
    criteria    hinged, sliding, open: `Criteria`, and flags of joints by them

It imports from `masonry` and the ground. Start reading at `operator`, then at `resultants`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
