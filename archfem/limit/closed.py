"""Cohesion of joints that are partly open: the part of a joint that a state leaves closed.

Faces of rigid blocks press on an elastic joint linearly, over c = 3 (h/2 - |e|) where the thrust is
outside the middle third, whatever the stiffness. A gap holds no shear: cohesion acts on that part,
as it does in elastic joints. Limit analysis has it on the whole joint, which is a strength that no
load has put to the test: what a joint loses by opening depends on where its thrust is.
"""

from dataclasses import replace

import numpy as np
import xarray as xr

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.joints.resultants import check_instant
from archfem.masonry.structure import Structure


def closed_cohesion(structure: Structure, joints: xr.Dataset) -> Structure:
    """Return a structure with cohesion only on the part of its joints that a state leaves closed.

    Its limit analysis is that of joints which lose cohesion where they open, in this state: give
    the last one of a pushover, and compare with the limit to which that tends.

    Args:
        structure: whose joints have cohesion.
        joints: N, V, M of a state of it, e.g. `push.joints.isel(step=-1)`.

    Returns:
        The same blocks; each joint has its cohesion times the part of it that is closed.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.

    Example:
        >>> stone = af.Contact(1.48e9, 0.30e9, friction=0.3, cohesion=6e3)
        >>> block = af.column(breadth=1.0, heights=[1.0], contact=stone)
        >>> push = af.pushover(af.build(block, fidelity="rigid"), af.BodyForce(1.0))
        >>> less = af.limit.closed_cohesion(block, push.joints.isel(step=-1))
        >>> each = (push, *(af.collapse_factor(b, live=af.BodyForce(1.0)) for b in (less, block)))
        >>> [round(found.factor, 4) for found in each]
        [0.5172, 0.5172, 0.6]
    """
    instance(structure, Structure, "structure", "give that whose joints these are")
    instance(joints, xr.Dataset, "joints", "give those of an instant, e.g. dead.joints")
    check_instant(structure, joints)
    normal, moment = (joints[key].values for key in "NM")
    shares = closed_shares(structure, normal, moment)
    made = (
        replace(each, contact=replace(each.contact, cohesion=each.contact.cohesion * float(share)))
        for each, share in zip(structure.joints, shares, strict=True)
    )
    return replace(structure, joints=tuple(made))


def closed_shares(structure: Structure, normal: Array, moment: Array) -> Array:
    """Return the closed part of each joint, by a linear pressure; 0 without any (n_joints,).

    Args:
        structure: whose joints they are.
        normal: N (n_joints,) [N].
        moment: M (n_joints,) [N m].
    """
    pressed = normal > 0.0
    arm = np.abs(moment) / np.where(pressed, normal, 1.0) / structure.depths
    return np.where(pressed, np.clip(3.0 * (0.5 - arm), 0.0, 1.0), 0.0)
