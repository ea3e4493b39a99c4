"""From a model of jointed blocks that move as far as they like to loose rigid ones."""

from dataclasses import dataclass

import numpy as np

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.dynamics.falling.bodies import bodies_of
from archfem.dynamics.falling.state import Loose
from archfem.dynamics.steps import State
from archfem.models.moving import Moving


@dataclass(frozen=True, eq=False)
class Handover:
    """Loose blocks in place of a model of jointed ones, and the energy that is left behind.

    Attributes:
        start: poses and velocities of all blocks.
        strain: energy stored in joints and blocks, which rigid ones do not keep [J].
        before: kinetic energy of the model, elastic modes of the blocks included [J].
        after: kinetic energy of the rigid blocks [J].
    """

    start: Loose
    strain: float
    before: float
    after: float


def released(model: Moving, state: State) -> Handover:
    """Return the blocks of a model as loose rigid ones, where they are and as they move.

    Args:
        model: whose blocks move as far as they like.
        state: in its coordinates, with what its joints remember.

    Raises:
        InvalidInput: the model's displacements are small.
    """
    instance(model, Moving, "model", "give a Moving, one of large displacements")
    structure = model.structure
    poses, velocities = np.array(model.supports, dtype=float), np.zeros((len(structure.blocks), 3))
    centres = _centres(model)
    for block, first in zip(structure.free, model.starts[:-1], strict=True):
        pose, speed = state.q[first : first + 3], state.velocity[first : first + 3]
        arm = structure.blocks[block].centroid - centres[block]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        turned = np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
        poses[block] = *(pose[:2] + turned - arm), pose[2]
        velocities[block] = *(speed[:2] + speed[2] * np.array([-turned[1], turned[0]])), speed[2]
    known = model if state.memory is None else model.remembering(state.memory)
    mass = bodies_of(structure, 0.0).mass
    inertia = np.column_stack([mass[:, 0], mass])
    return Handover(
        Loose(state.time, poses, velocities),
        known.energy(state.q),
        0.5 * float(state.velocity @ (model.mass @ state.velocity)),
        0.5 * float(np.sum(inertia * velocities**2)),
    )


def _centres(model: Moving) -> dict[int, Array]:
    """About which point the turn of each free block is written, before it moves (2,) [m]."""
    structure, sides = model.structure, model.joints.sides
    return {
        int(block): structure.middles[joint] - sides.arm[joint, side]
        for joint, pair in enumerate(structure.pairs)
        for side, block in enumerate(pair)
        if sides.start[joint, side] >= 0
    }
