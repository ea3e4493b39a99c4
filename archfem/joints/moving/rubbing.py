"""Shear of a joint point over a step, held by friction and cohesion or sliding, compiled.

At each point a spring in series with a stop holds the shear, as `law.shear_over_step`.
"""

import numpy as np

from archfem.joints.moving.compiled import inlined
from archfem.joints.moving.means import closed_means, shear_means
from archfem.joints.operator import TOUCHING


@inlined
def limits(faces, point, joint, pressed, lagged, late):  # type: ignore
    """Return Coulomb's limits of a facet over a step per length of the overlap, μ N + c A.

    A is the mean area on which a facet is closed, shared among its ends.

    Args:
        faces: `Faces`.
        point: first of the facet, or a spring.
        joint: its number.
        pressed: mean closing, and its derivatives, as `overlap.carried` returns them.
        lagged: gaps of both ends at the start, and of both at the end, that the law sees [m].
        late: lag of damping over the length of the step [-].

    Returns:
        At both ends, and derivatives as those of `pressed`.
    """
    (n0, n1), (k00, k01, k11) = pressed
    scale, hold = -faces.friction[joint] * faces.normal[joint], faces.cohesion[joint]
    if scale == -np.inf:
        return (np.inf, np.inf), (0.0, 0.0, 0.0)
    scale *= faces.share[point]
    ends, rates = (scale * n0, scale * n1), (scale * k00, scale * k01, scale * k11)
    if hold == 0.0:
        return ends, rates
    hold *= faces.share[point]
    time, by = closed_means(lagged, late, 1.0 + late, faces.facets)
    ends = ends[0] + hold * time[0], ends[1] + hold * time[1]
    return ends, (rates[0] + hold * by[0], rates[1] + hold * by[1], rates[2] + hold * by[2])


@inlined
def rubbed(first, change, late, limit):  # type: ignore
    """Return what `shear_means` gives of a point whether it slides or not, also over no step.

    Args:
        first: elastic shear at the start [N].
        change: of it, if the point did not slide [N].
        late: lag of damping over the length of the step [-].
        limit: Coulomb's [N].
    """
    trial = first + (0.5 + late) * change
    touching = change == 0.0 and abs(first) <= (1.0 + TOUCHING) * limit
    if touching or max(abs(first), abs(first + change), abs(trial)) <= limit:
        return trial, 0.0, 0.5 + late, 0.0, late * change * change
    found = shear_means(first, change, late, limit)
    if change == 0.0 and abs(first) > limit:
        return found[0], found[1], 0.0, np.sign(found[0]), found[4]
    return found
