"""How dry joints answer: law, quadrature, the operator G, resultants N V M e, criteria.

    law         tractions from opening and slip
    quadrature  rules that integrate the traction along a joint
    points      points on the joints, and forces there by springs or exact integrals
    operator    the joint operator G, from coordinates to forces
    faces       opening, rotation and slip of whole joints
    rigid       G of rigid blocks
    sparsity    one sparsity pattern for a family of matrices
    resultants  N, V, M, eccentricity, mobilised friction, thrust line
    criteria    hinged, sliding, open: `Criteria`, and flags of joints by them

It imports from `masonry` and the ground. Start reading at `operator`, then at `resultants`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
