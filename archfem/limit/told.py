"""What a limit analysis warns of: strength that joints might not have."""

import logging
from collections.abc import Sequence

import numpy as np
import xarray as xr

from archfem.limit.closed import closed_shares
from archfem.masonry.structure import Structure

logger = logging.getLogger("archfem")

BEYOND = 1e-6
"""Shear beyond what a joint holds, relative to that, above which it is told."""


def tell_of_dilatancy(structure: Structure) -> None:
    """Warn of saw teeth that sliding without dilatancy leaves out.

    Args:
        structure: whose joints may have them.
    """
    steepest = max(joint.contact.dilatancy for joint in structure.joints)
    if steepest > 0.0:
        logger.warning(
            "joints dilate by up to %.3g, which friction='nonassociated' leaves out: the factor is "
            "that of joints which slide flat, 'coulomb' gives that of joints which dilate by μ",
            steepest,
        )


def tell_of_sliding(sliding: Sequence[int], names: Sequence[str], factor: float) -> None:
    """Warn of joints that slide and, by associated flow, dilate.

    Args:
        sliding: numbers of the joints that slide; without any there is nothing to tell.
        names: of these joints.
        factor: that was found [-].
    """
    if sliding:
        logger.warning(
            "joints %s (%s) slide: with the dilatancy of associated flow the factor %.4g is an "
            "upper estimate; friction='nonassociated' does without it",
            list(sliding),
            ", ".join(names),
            factor,
        )


def tell_of_cohesion(
    structure: Structure, failing: Sequence[int], joints: xr.Dataset, factor: float
) -> None:
    """Warn of joints that fail, held by cohesion on more of them than is closed.

    Args:
        structure: whose joints they are.
        failing: numbers of the joints that turn or slide.
        joints: N, V, M at the factor found.
        factor: that was found [-].
    """
    normal, shear, moment = (joints[key].values for key in "NVM")
    held = structure.cohesion * closed_shares(structure, normal, moment)
    slides = np.isfinite(structure.friction)
    held[slides] += structure.friction[slides] * normal[slides]
    beyond = slides & (np.abs(shear) > (1.0 + BEYOND) * held + BEYOND * structure.cohesion)
    told = [number for number in sorted(failing) if beyond[number]]
    if told:
        name = structure.joints[told[0]].name
        logger.warning(
            "%d joints such as '%s' fail partly open, held by cohesion on all their area: the "
            "factor %.4g is an upper estimate; af.limit.closed_cohesion leaves it to what is "
            "closed in a state, as at the end of a pushover",
            len(told),
            name,
            factor,
        )
