"""From a structure that parts to what lies on the ground: the end of a run, and what it left.

While joints hold, forces are those of `joints.moved`. Once a joint has turned or slid so far that
its blocks are loose, `falling` takes them as they are and as they move, to the ground and to rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.dynamics.falling.engine import STILL, Falling
from archfem.dynamics.falling.handover import Handover, released
from archfem.dynamics.falling.state import Loose
from archfem.dynamics.falling.verdict import Fall, fall_of
from archfem.dynamics.steps import Batch, State
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.gauges import Gauges
from archfem.models.moving import Moving
from archfem.motion.motion import Motion

TURNED = 0.3
"""Turn of a joint beyond which its blocks are loose: a voussoir is then about to tumble [rad]."""

TILTED = 0.05
"""Turn of a joint at the end of a motion beyond which blocks that still move are followed on
[rad]."""

SETTLING = 20.0
"""Time after the motion in which what falls may come to rest [s]."""

SPACING = 0.02
"""Time between two frames of a fall [s]."""


@dataclass(frozen=True, eq=False)
class Parting:
    """Says in which step of a run a joint lets its blocks go.

    A joint between stones does once it has turned far or slid off its face. Fill fits itself to
    what it lies on, and its pieces tumble on the spot or crumble off its ends: that is no fall.

    Attributes:
        model: whose joints.
    """

    model: Moving

    def step(self, batch: Batch) -> tuple[int, str] | None:
        """Return the first step of a batch after which blocks are loose, and why; or None.

        Args:
            batch: steps of a run.
        """
        gauges, structure = Gauges.on(self.model), self.model.structure
        _, turn, slip = np.moveaxis(gauges.faces(batch.read(gauges)), -2, 0)
        loose = (np.abs(turn) > TURNED) | (np.abs(slip) >= structure.depths)
        loose &= _between_stones(structure)
        if not loose.any():
            return None
        k = int(np.argmax(loose.any(axis=1)))
        joint = int(np.argmax(loose[k]))
        name = structure.joints[joint].name
        if abs(turn[k, joint]) > TURNED:
            return k, f"'{name}' had turned by {abs(turn[k, joint]):.2g} rad"
        return k, f"'{name}' had slid by {abs(slip[k, joint]):.2g} m, off its face"


def _between_stones(structure: Structure) -> NDArray[np.bool_]:
    """Whether joints have no fill on either side (j,)."""
    found: NDArray[np.bool_] = ~np.isin(structure.pairs, yielding_blocks(structure)).any(axis=1)
    return found


FRICTION = 0.6
"""Coefficient between loose stones whose joint was one that never slides [-]."""


def tilting(model: Moving, state: State) -> bool:
    """Return whether blocks are on their way to fall, or back.

    Args:
        model: that has not parted.
        state: at the end of its motion.
    """
    stones = _between_stones(model.structure)
    turned = float(np.abs(model.measures(state.q)[stones, 2]).max(initial=0.0))
    return turned > TILTED and not left_standing(model, state).resting


def fallen(model: Moving, state: State, motion: Motion) -> tuple[xr.Dataset, Fall]:
    """Let the blocks of a structure that has parted fall until they rest.

    Args:
        model: that has parted.
        state: in which it did.
        motion: of the ground, which goes on.

    Returns:
        Poses of all blocks over frames, and what the fall has left.
    """
    given = released(model, state)
    end = max(motion.duration, state.time) + SETTLING
    falling = Falling(_rubbing(model.structure))
    frames = list(falling.frames(given.start, end, motion, spacing=SPACING))
    return _as_dataset(frames, motion, given), fall_of(model.structure, frames)


def _as_dataset(frames: Sequence[Loose], motion: Motion, given: Handover) -> xr.Dataset:
    """Frames of a fall."""
    times = np.array([frame.time for frame in frames])
    poses = np.array([frame.poses for frame in frames])
    about = {
        "long_name": "displacement of a block's centroid, and its turn, from where it was built",
        "units": "m, m, rad",
    }
    ground = {"units": "m/s2", "long_name": "acceleration of the ground"}
    return xr.Dataset(
        {
            "fall_pose": (("fall_frame", "block", "pose"), poses, about),
            "fall_ground": (("fall_frame", "axis"), motion.at(times), ground),
        },
        {
            "fall_time": ("fall_frame", times, {"units": "s"}),
            "pose": ["x", "y", "turn"],
        },
        {
            "handover_strain": given.strain,
            "handover_kinetic": np.array([given.before, given.after]),
        },
    )


def left_standing(model: Moving, state: State) -> Fall:
    """Return what a run has left of a structure whose blocks have held together.

    Args:
        model: that has not parted.
        state: at the end.
    """
    loose = released(model, state).start
    resting = bool(np.abs(loose.velocities[:, :2]).max() <= STILL)
    return replace(fall_of(model.structure, [loose]), resting=resting)


def _rubbing(structure: Structure) -> Structure:
    """The structure with joints that can all slide, and whose cohesion is broken."""
    joints = []
    for joint in structure.joints:
        friction = joint.contact.coefficient if joint.contact.slides else FRICTION
        contact = replace(joint.contact, friction=friction, cohesion=0.0)
        joints.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints))
