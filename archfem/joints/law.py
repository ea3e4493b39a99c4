"""Tractions of a dry joint from its opening and slip.

Written with arithmetic and `abs` alone, so that one definition serves NumPy arrays and UFL
expressions. Openings are positive where the joint is open, tractions where they pull.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def negative(x: Any) -> Any:
    """Return the negative part of a value: x where x < 0, else 0.

    Args:
        x: numbers, or a UFL expression.
    """
    return 0.5 * (x - abs(x))


def normal_traction(opening: Any, stiffness: Any) -> Any:
    """Return the traction across a joint that closes elastically and opens freely [Pa].

        t_n = k_n <g>_-      (compression only)

    Args:
        opening: gap g between the faces [m], positive where open.
        stiffness: k_n [Pa/m]; times an area [N/m] it gives forces [N].
    """
    return stiffness * negative(opening)


def shear_traction(slip: Any, stiffness: Any) -> Any:
    """Return the traction along a joint, t_s = k_s s [Pa].

    Elastic whether the joint is open or closed, as in Demirel and Aldemir (2021): a spring that
    acts only while the joint is closed is a discontinuous law, on which Newton's method fails.

    Args:
        slip: relative displacement s along the joint [m].
        stiffness: k_s [Pa/m].
    """
    return stiffness * slip


def is_closed(opening: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where the normal spring acts; a joint that just touches is closed.

    Otherwise the first tangent of a structure at rest would be singular.

    Args:
        opening: gaps, of any shape [m].
    """
    return opening <= 0.0
