"""Fall of loose blocks: from joints with large displacements to rigid blocks on the ground.

The fall begins once a joint has turned or slid so far that its blocks are loose, or stones meet
outside their joints. All blocks then continue as free rigid blocks until they rest
(`dynamics.rigid_body`), from the positions and the momentum of the model.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from archfem._display import ProgressReport
from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.collapse_state import (
    COLLAPSE_STATES,
    FALLEN_STATES,
    MAX_UNSETTLED,
    RANGE_REMEDY,
    STILL_MOVES,
    UNDECIDED,
    CollapseState,
    classify_collapse,
    doubt_collapse,
    doubt_soft_blocks,
    follow_until_lost,
    mark_lost,
)
from archfem.dynamics.history import Ending, History, with_fall
from archfem.dynamics.loose_fill import Field, interpolate_field, loosen_fill
from archfem.dynamics.rigid_body.bodies import FallFrame, LooseBlocks, masses_of
from archfem.dynamics.rigid_body.rocking_body import doubt_courses
from archfem.dynamics.rigid_body.simulation import (
    MAX_COMPARED_BLOCKS,
    MAX_STEP_CHANGE,
    TRIED_STEPS,
    RigidBlockSimulation,
)
from archfem.dynamics.rigid_body.time_stepping import MAX_ENERGY_GAIN
from archfem.dynamics.schemes import StiffnessDamping, Viscous
from archfem.dynamics.separation import is_overturning, is_resting, swings_little
from archfem.dynamics.state import State
from archfem.errors import DidNotConverge, logger
from archfem.masonry.block import rotate
from archfem.masonry.materials import Contact
from archfem.masonry.stiffness_ratio import find_yielding_blocks, list_stones, mark_stone_joints
from archfem.masonry.structure import Structure, join_names, with_contacts
from archfem.models.model import Doubt, Model
from archfem.motion.motion import Motion
from archfem.units import STANDARD_GRAVITY

# Coefficient of friction of loose stones where their joints never slide: that of rough stone
ASSUMED_FRICTION = 0.6

# Words of the doubt of a fall that rigid blocks do not have, with the peak of the motion [g]
RIGID_STAND = (
    "blocks fall with these joints, and as rigid blocks none falls under this motion of {:.3g} g: "
    "the fall depends on how the joints close, and with stiffer ones it may not occur"
)

# Remedy of a fall beside the fixed blocks
GROUND_BESIDE = (
    'draw the ground farther, of a shape without ground by `shape = "blocks"`: it may not fall then'
)


@dataclass(frozen=True, eq=False)
class ReleasedBlocks:
    """Loose rigid blocks in place of a model, and the energies at the transition."""

    start: LooseBlocks  # poses and velocities of all blocks
    kinetic_before: float  # of the model, elastic modes of the blocks included [J]
    kinetic_after: float  # of the rigid blocks [J]


@validate_arguments
def release_blocks(model: Model, state: State) -> ReleasedBlocks:
    """Return the blocks of a model as loose rigid blocks with the same positions and momentum.

    Args:
        model: model of large displacements.
        state: state in the coordinates of the model, with the memory of its joints.

    Raises:
        InvalidInput: the model's displacements are small.
    """
    poses, velocities = model.rigid_motions(state.q, state.velocity)
    loaded = model if state.memory is None else model.with_memory(state.memory)
    mass = masses_of(model.structure)
    inertia = np.column_stack([mass[:, 0], mass])
    return ReleasedBlocks(
        LooseBlocks(state.time, poses, velocities, strain_energy=loaded.energy(state.q)),
        0.5 * float(state.velocity @ (model.mass @ state.velocity)),
        0.5 * float(np.sum(inertia * velocities**2)),
    )


def follow_fall(
    history: History,
    model: Model,
    states: tuple[State, State],
    motion: Motion,
    damping: Viscous | None,
    whole: bool,
) -> History:
    """Add the fall of loose or overturning blocks, and the state of collapse, to a history.

    The states are those at the start, from which displacements count, and at the end of the run.
    Not whole, the fall ends once a block is lost for good, and is not compared with rigid blocks.
    Where it could not be followed to its end and no block was lost, or blocks still move out of
    their places, there is no state of collapse.
    Ctrl-C and SIGTERM end it with what was computed.
    """
    (start, state), structure, ending = states, model.structure, history.ending
    rocking_ratio = damping.restitution if isinstance(damping, StiffnessDamping) else None
    origin, _ = model.rigid_motions(start.q, start.velocity)
    tilts = ending is Ending.FINISHED and is_overturning(model, state)
    doubts: list[Doubt] = []
    if tilts or ending.is_loose:
        try:
            dataset, frames = simulate_fall(model, state, motion, rocking_ratio, whole)
        except KeyboardInterrupt:  # before the first step
            return mark_interrupted(history, f"{state.time:.4g} s")
        fall = classify_collapse(structure, frames, origin)
        fall = replace(fall, loose_share=_measure_share_left(motion, state.time))
        dataset.attrs["fall_unsettled_early"] = fall.unsettled
        history = History(history.dataset.merge(dataset, combine_attrs="no_conflicts"), structure)
        doubts += _doubt_fall(structure, dataset)
        if (failure := dataset.attrs["fall_failure"]) == "interrupted":
            history = mark_interrupted(history, f"{frames[-1].time:.4g} s, in a fall")
        else:
            doubts += _doubt_end(fall, frames[-1].time, failure)
        if fall.kind == UNDECIDED or (failure and fall.time is None):
            return history.with_doubts((*history.doubts, *doubts))
    else:
        frame = LooseBlocks(state.time, *model.rigid_motions(state.q, state.velocity))
        resting = is_resting(model, state, shaken=ending is not Ending.FINISHED)
        resting = resting or swings_little(history)
        fall = replace(classify_collapse(structure, [frame], origin, joined=True), resting=resting)
    # frames begin where blocks became loose, and a rocking block may have come back before
    fall = replace(fall, displacement=max(fall.displacement, history.dataset.attrs["displacement"]))
    # throughout the last fifth, in which a record changes its sign
    push = motion.horizontal * np.sign(motion.horizontal[-1])
    held = bool(push[-len(push) // 5 :].min() > 0.5 * np.abs(push).max())
    rest = motion.duration - motion.dt * np.flatnonzero(motion.horizontal).max(initial=0)
    doubts += doubt_collapse(structure, fall, held, rest)
    if whole and start.time == 0.0 and ending is not Ending.EVENT:
        doubts += doubt_courses(structure, fall, motion)
    history = with_fall(history, fall).with_doubts((*history.doubts, *doubts))
    if fall.kind not in FALLEN_STATES or not whole or history.ending is Ending.INTERRUPTED:
        return history
    return _compare_rigid_blocks(history, structure, motion, start.time)


def _doubt_end(fall: CollapseState, time: float, failure: str) -> Iterator[Doubt]:
    """Yield the doubt of a fall that was followed to a time, and not for long enough."""
    if failure:
        words = "loose blocks were followed until {:.2f} s alone, and what comes after is not known"
        remedy = "compare with another dt, or with archfem.dynamics.RigidBlockSimulation"
        yield Doubt(f"{words}: {{}}", remedy, (time, failure))
    elif fall.kind == UNDECIDED:
        remedy = "follow them longer: let the ground rest at the end, `--set motion.rest=60`"
        yield Doubt(STILL_MOVES, remedy, (join_names(fall.blocks), time))


def _measure_share_left(motion: Motion, time: float) -> float:
    """Return the share of the Arias intensity of both components after a time [-]."""
    times = motion.dt * np.arange(round(motion.duration / motion.dt) + 1)
    squares = np.square(motion.at(times)).sum(axis=1)
    return float(squares[times > time].sum() / max(squares.sum(), np.finfo(float).tiny))


def _compare_rigid_blocks(
    history: History, structure: Structure, motion: Motion, start: float
) -> History:
    """Return a history of a fall with a doubt where rigid blocks have none."""
    try:
        compared = list(_doubt_joints(structure, motion, start))
    except KeyboardInterrupt:
        return mark_interrupted(history, "its comparison with rigid blocks, after the fall")
    return history.with_doubts((*history.doubts, *compared))


def state_rigid_falls(doubt: Doubt, falls: Sequence[tuple[float, Sequence[Doubt]]]) -> Doubt:
    """Return the doubt that rigid blocks stand with a larger scale at which they fall too, if any.

    Falls that were compared are by their scale, with the doubts of each; other doubts are returned
    as they are.
    """
    alone = [scale for scale, doubts in falls if any(x.words == RIGID_STAND for x in doubts)]
    both = [scale for scale, _ in falls if scale > max(alone, default=0.0)]
    if doubt.words != RIGID_STAND or not both:
        return doubt
    words = f"{doubt.words}; where it falls at {{:#.3g}} × the motion, they fall too"
    return replace(doubt, words=words, values=(*doubt.values, min(both)))


def mark_interrupted(history: History, when: str) -> History:
    """Return a history as one that Ctrl-C or SIGTERM ended, and log that it is kept."""
    outcome = f"interrupted at {when}"
    logger.warning("%s: what was computed is kept", outcome, extra={"of_run": True})
    attrs = {"ended": str(Ending.INTERRUPTED), "outcome": outcome}
    return replace(history, dataset=history.dataset.assign_attrs(attrs))


def simulate_fall(
    model: Model,
    state: State,
    motion: Motion,
    rocking_ratio: float | None = None,
    whole: bool = True,
) -> tuple[xr.Dataset, list[FallFrame]]:
    """Follow loose blocks until they rest, or until 20 s after the motion has ended.

    Not whole, they are followed by one length of step until a block is lost for good. The ratio is
    that of `RigidBlockSimulation`. Where they cannot be followed to the end, the frames until then
    are returned, and `fall_failure` has the reason.
    """
    released = release_blocks(model, state)
    end = max(motion.duration, state.time) + 20.0
    structure, fields = with_sliding_joints(model.structure), _interpolate_deformed(model, state)
    loose = loosen_fill(structure, released.start, fields)
    # grains are many, and where each of them goes depends on the step anyhow
    dt = None if whole and loose.structure is structure else TRIED_STEPS[0]
    simulation = RigidBlockSimulation(loose.structure, dt=dt, rocking_ratio=rocking_ratio)
    found, failure = list[FallFrame](), ""
    try:
        frames = simulation.frames(loose.start, end, motion, spacing=0.02)
        for each in frames if whole else follow_until_lost(structure, frames, loose.restore):
            found.append(each)
    except (DidNotConverge, KeyboardInterrupt) as error:
        found = found or [*getattr(error, "last", ())]
        if not found:  # interrupted before the first step
            raise
        failure = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
    placed = [loose.restore(each) for each in found]
    grains = loose.describe_grains([each.poses for each in found])
    dataset = _fall_dataset(placed, motion, released).merge(grains)
    return dataset.assign_attrs(fall_failure=failure), placed


def _interpolate_deformed(model: Model, state: State) -> dict[int, Field]:
    """Return the fields of bodies of fill that have deformed."""
    cells, fields = model.cells, dict[int, Field]()
    for number in find_yielding_blocks(model.structure):
        if np.count_nonzero(cells.coordinate_owner == number) == 3:
            continue  # rigid
        nodes = np.flatnonzero(cells.block == number)
        shapes = cells.shapes_at(nodes)
        values = [(shapes @ each).reshape(-1, 2) for each in (state.q, state.velocity)]
        fields[number] = interpolate_field(cells.places[nodes], *values)
    return fields


def _fall_dataset(
    frames: Sequence[FallFrame], motion: Motion, released: ReleasedBlocks
) -> xr.Dataset:
    """Return the frames of a fall as a dataset."""
    times = np.array([frame.time for frame in frames])
    poses = np.array([frame.poses for frame in frames])
    last = frames[-1]
    attributes = {
        "long_name": "displacement of a block's centroid, and its turn, from where it was built",
        "units": "m, m, rad",
    }
    ground = {"units": "m/s2", "long_name": "acceleration of the ground"}
    return xr.Dataset(
        {
            "fall_pose": (("fall_frame", "block", "pose"), poses, attributes),
            "fall_ground": (("fall_frame", "axis"), motion.at(times), ground),
        },
        {"fall_time": ("fall_frame", times, {"units": "s"}), "pose": ["x", "y", "turn"]},
        {
            "handover_strain": released.start.strain_energy,
            "handover_kinetic": np.array([released.kinetic_before, released.kinetic_after]),
            "fall_unsettled": last.settling.unsettled_share,
            "fall_step": (last.time - frames[0].time) / max(last.settling.steps, 1),
            "fall_step_change": last.step_change,
            "fall_gained_share": last.energy.gained_share,
        },
    )


def _doubt_joints(structure: Structure, motion: Motion, start: float) -> Iterator[Doubt]:
    """Yield a doubt of a fall if rigid blocks, from where they were built, lose none.

    Only falls without them are compared: no cohesion, no soft bodies and no laws of the user.
    """
    is_rigid = not (structure.cohesion.any() or structure.tension.any() or structure.has_own_laws)
    is_rigid = is_rigid and not find_yielding_blocks(structure)
    if not is_rigid or len(structure.free) > MAX_COMPARED_BLOCKS:
        return
    simulation = RigidBlockSimulation(with_sliding_joints(structure), dt=TRIED_STEPS[0])
    at_rest, end = LooseBlocks.as_built(structure, start), motion.duration + 2.0
    # without convergence there is nothing to compare with
    with suppress(DidNotConverge), ProgressReport("compared", None, rarely=True) as progress:
        progress.show("rigid blocks from rest")
        frames = simulation.frames(at_rest, end, motion, spacing=0.02)
        found = classify_collapse(structure, follow_until_lost(structure, frames))
        if found.kind in COLLAPSE_STATES[:2]:
            yield Doubt(
                RIGID_STAND,
                f"{RANGE_REMEDY}, and check the stiffness of the joints",
                (motion.pga / STANDARD_GRAVITY,),
            )


def _list_slid_off(structure: Structure, poses: Array) -> list[str]:
    """List the stones whose foot was beyond the ends of all fixed blocks when they were lost."""
    blocks, stones, places = structure.blocks, list_stones(structure), structure.centroids
    ground = np.concatenate([block.points[:, 0] for block in blocks if block.fixed])
    lost, names = np.array([*map(mark_lost(structure), poses)]), []
    for joint in structure.joints:
        a, b = sorted(joint.blocks, key=lambda k: blocks[k].fixed)
        if not blocks[b].fixed or a not in stones or not (gone := lost[:, stones.index(a)])[-1]:
            continue
        pose = poses[gone.argmax(), a]
        foot = places[a] + pose[:2] + rotate(joint.middle - places[a], pose[2])
        if not ground.min() < foot[0] < ground.max():
            names.append(blocks[a].name)
    return names


def with_sliding_joints(structure: Structure) -> Structure:
    """Return the structure with friction, and no cohesion, in joints that never slide."""

    def slide(given: Contact) -> Contact:
        return given if given.slides else replace(given, friction=ASSUMED_FRICTION, cohesion=0.0)

    return with_contacts(structure, slide)


def _doubt_fall(structure: Structure, dataset: xr.Dataset) -> Iterator[Doubt]:
    """Yield doubts of a fall: unsettled impulses, energy gained, steps, and other properties.

    Loose blocks may keep more at impacts, and slide otherwise, than the joints of the model.
    """
    yield from doubt_soft_blocks(structure)
    if off := _list_slid_off(structure, dataset["fall_pose"].values):
        words = "{} slid beyond the ends of all fixed blocks, and fell there"
        yield Doubt(words, GROUND_BESIDE, (join_names(off),))
    share, early = (dataset.attrs[f"fall_{key}"] for key in ("unsettled", "unsettled_early"))
    unsettled = "impulses of loose blocks did not settle in"
    if early > MAX_UNSETTLED:
        words = f"it is in doubt whether blocks fall: {unsettled} {{:.0%}} of the steps before the "
        yield Doubt(f"{words}first was lost", RANGE_REMEDY, (early,))
    elif share > MAX_UNSETTLED:
        words = "it is in doubt where blocks come to rest, and not that they fall: "
        words += f"{unsettled} {{:.0%}} of the steps, of those before the first was lost {{:.0%}}"
        yield Doubt(words, "state that it falls, and not how its blocks lie", (share, early))
    if (gained := dataset.attrs["fall_gained_share"]) > MAX_ENERGY_GAIN:
        words = "loose blocks gained {:.2g} of the energy exchanged, by errors of the steps"
        yield Doubt(words, RANGE_REMEDY, (gained,))
    if (change := dataset.attrs["fall_step_change"]) > MAX_STEP_CHANGE:
        words = "half the step changes how far a block falls or moves by {:.0%}"
        yield Doubt(words, RANGE_REMEDY, (change,))
    joints = [structure.joints[k] for k in np.flatnonzero(mark_stone_joints(structure))]
    if held := [joint.name for joint in joints if not joint.contact.slides]:
        yield Doubt(
            f"loose stones have a coefficient of friction of {ASSUMED_FRICTION:g} where their "
            f"joints never slide: {join_names(held)}",
            "give these joints a coefficient of friction",
        )
    if cohesive := [j.name for j in joints if j.contact.slides and j.contact.cohesion > 0.0]:
        yield Doubt(
            "loose stones have cohesion on all of their faces that touch at both ends, also where "
            f"the force is eccentric: {join_names(cohesive)}",
            "compare with joints without cohesion throughout",
        )
