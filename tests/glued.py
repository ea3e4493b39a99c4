"""Structures whose joints never slide, as Newmark's method and HHT require."""

from dataclasses import replace

import archfem as af

GLUED = replace(af.masonry.STONE_TO_STONE, friction=None)


def glued(structure):
    """The same structure, each joint as stiff as it was."""
    joints = [
        replace(joint, contact=replace(joint.contact, friction=None)) for joint in structure.joints
    ]
    return replace(structure, joints=tuple(joints))
