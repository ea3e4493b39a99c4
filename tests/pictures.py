"""Helpers of tests of pictures: joints that fail in known ways, and search for drawn objects."""

import numpy as np

import archfem as af

WEIGHT = 1e4  # normal force in every joint [N]: only signs and ratios matter
HINGES = {0: -0.5, 6: 0.48, 12: -0.46}
SLIDING = {3: 0.7, 9: -0.9}  # V / N beyond the coefficient 0.6
APART = [4, 15]


def resultants(ring):
    """N, V and M of the ring's 18 joints: three hinge, two slide, two have come apart."""
    found = np.zeros((len(ring.joints), 3))
    found[:, 0] = WEIGHT
    for number, e in HINGES.items():
        found[number, 2] = e * WEIGHT * ring.joints[number].depth
    for number, ratio in SLIDING.items():
        found[number, 1] = ratio * WEIGHT
    found[APART] = 0.0
    return found


def history(structure, e):
    """Two instants at which all joints have eccentricity e, then -e."""
    found = np.zeros((2, len(structure.joints), 3))
    found[..., 0] = WEIGHT
    depth = np.array([joint.depth for joint in structure.joints])
    found[0, :, 2], found[1, :, 2] = e * WEIGHT * depth, -e * WEIGHT * depth
    return af.History(af.joints.joint_dataset(structure, found, np.arange(2.0)))


def drawn(figure, name):
    """The one thing of a figure that is called so."""
    found = figure.findobj(lambda artist: artist.get_gid() == name)
    return found[0] if found else None
