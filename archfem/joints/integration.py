"""What a quadrature rule makes of the traction along the joints: springs or facets.

Springs at the points of a rule give f = W t, facets the exact integral of t. Along the joints every
point is a spring of its own either way.
"""

from archfem.joints.facets import Facets
from archfem.joints.points import JointPoints
from archfem.joints.quadrature import Quadrature
from archfem.joints.springs import Springs

Law = Springs | Facets


def law_of(rule: Quadrature, points: JointPoints) -> Law:
    """Return the law that a quadrature rule asks for.

    Args:
        rule: quadrature on each facet.
        points: that it has put on the joints.
    """
    return Facets(points) if rule.rule == "exact" else Springs(points)
