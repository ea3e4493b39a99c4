"""Blocks that were built by small displacements and move far from then on."""

import numpy as np

from archfem.models.jointed import Jointed
from archfem.models.moving import Moving
from archfem.models.turning_joints import hands


def on_site(model: Moving) -> Jointed:
    """Return the model of small displacements, in the same coordinates, on supports as built.

    Args:
        model: whose blocks move as far as they like.
    """
    return model.at_rest.moved(np.zeros_like(model.supports))


def taken_over(model: Moving, small: Jointed) -> Moving:
    """Return a model whose joints know how those of small displacements began, and have slid.

    Args:
        model: whose blocks move as far as they like, on the same supports.
        small: the same in small displacements, as by `on_site`, with what it has gone through.
    """
    hand = hands(model.structure)[small.operator.points.joint]
    if small.built is not None:
        model = model.begun(small.built)
    return model.remembering(hand * small.memory)
