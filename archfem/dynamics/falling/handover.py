"""From a model of jointed blocks that move as far as they like to loose rigid ones."""

from dataclasses import dataclass

import numpy as np

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.dynamics.falling.bodies import bodies_of
from archfem.dynamics.falling.state import Loose
from archfem.dynamics.steps import State
from archfem.masonry.rigid_motion import motion_of
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
    for number, block in enumerate(structure.free):
        own = slice(*model.starts[number : number + 2])
        pose, speed = state.q[own], state.velocity[own]
        centre = model.centres[block]
        if not model.turning[number]:
            mean = _as_rigid(model, block, own)
            pose, speed = mean @ pose, mean @ speed
        arm = structure.blocks[block].centroid - centre
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


def _as_rigid(model: Moving, block: int, own: slice) -> Array:
    """What gives the rigid motion of a fill that has its momentum, about its centre (3, s)."""
    cells = model.at_rest.cells
    nodes = np.flatnonzero(cells.block == block)
    rows = (2 * nodes[:, None] + np.arange(2)).ravel()
    lift = cells.lift[rows][:, own].toarray()
    motion = motion_of(cells.places[nodes], model.centres[block]).reshape(-1, 3)
    rigid = np.linalg.lstsq(lift, motion, rcond=None)[0]
    mass = rigid.T @ model.mass[own, own]
    found: Array = np.linalg.solve(mass @ rigid, mass)
    return found
