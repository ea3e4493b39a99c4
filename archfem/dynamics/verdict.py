"""Verdict of a run: outcome, doubts, displacements, and the first mechanism by each definition."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from archfem._display import DOUBT_MARK
from archfem._threads import single_threaded
from archfem._typing import Array
from archfem.dynamics.collapse_state import (
    DISLOCATION,
    FALLEN_STATES,
    STILL_MOVES,
    CollapseState,
    shallowest_part,
)
from archfem.joints.criteria import (
    Criteria,
    assessed_joints,
    find_failed_joints,
    longest_duration,
    step_lengths,
    with_failure_flags,
)
from archfem.limit.mechanism_count import (
    OVER_RECORD,
    Mechanism,
    counted_mechanisms,
    demirel_aldemir_mechanism,
    duration_text,
    has_counted_mechanism,
    leave_out_walls,
)
from archfem.limit.mechanism_kinematics import first_verified_mechanism
from archfem.masonry.parts import find_backs, find_directions
from archfem.masonry.standing import find_bodies, list_own_stones
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_joint_names, join_names, join_words
from archfem.models.model import Doubt
from archfem.units import format_mm, mm

MECHANISM_DEFINITIONS = (
    "any joints at once",
    "one part at once",
    "ring and pier at once",
    OVER_RECORD,
    "verified",
)
"""Definitions of a mechanism, in the order of tables."""

# Criterion of `demirel_aldemir_mechanism`
PUBLISHED_DEFINITION = "Demirel and Aldemir"

ALL_DEFINITIONS = (*MECHANISM_DEFINITIONS, PUBLISHED_DEFINITION)

# Words of the doubt of a motion without a mechanism, with |e| and the displacement
ROCKS_SOFTLY = (
    "no joints permit a mechanism, with |e| up to {:.3g}, though a corner moved by {:mm}: joints "
    "as soft as these let blocks rock before |e| counts as a hinge"
)

# Displacement up to which a mechanism is too small to matter, over the depth of the shallowest
# part, a hundredth of a dislocation [-]
SMALL_DISPLACEMENT = 0.001

# Why a fall by hinges may have no verified mechanism before
HELD = ", as joints that had not failed, assessed or not, held it"

# What a run without doubts still leaves open
NO_RANGE = "one motion, one set of properties: range not computed"


@dataclass(frozen=True, kw_only=True, repr=False)
class Verdict:
    """Assessment of a run, from which all summaries are written.

    Attributes:
        outcome: "stands", "dislocated", "partly fallen" or "fallen" with large displacements, see
            `CollapseState`, and "unknown" where such a run was broken off, or ended while that was
            not decided; "mechanism" or "no mechanism" with small ones, by any of the definitions.
        doubts: reasons why the result may be wrong, each with its remedy.
        displacement: largest displacement of any corner of a block relative to the ground, from its
            place at the start of the run, under dead load [m]. Backfill and bodies that stand on
            the structure do not count. NaN of a record of joints alone.
        residual: the same at the end of the run [m].
        farthest: blocks of both; none where blocks came loose.
        mechanisms: first mechanism, or None, by each definition of `MECHANISM_DEFINITIONS` that
            applies, and by the criterion of Demirel and Aldemir; "verified" only where the
            structure is known and the run was not interrupted.
        fall: state of collapse with large displacements, or None.
        until: until when joints were followed, such as " until 4.85 s", where blocks were loose
            after it; "" otherwise.
        incomplete: how the run was broken off, such as "failed at 1.2 s"; "" otherwise.
        assessed: which joints the verdict is based on, and which it leaves out; "" if none.
        remarks: further sentences on the run: ending, places of the largest values, mechanisms too
            short to count.
    """

    outcome: str
    doubts: tuple[Doubt, ...]
    displacement: float
    residual: float
    mechanisms: Mapping[str, Mechanism | None]
    fall: CollapseState | None = None
    incomplete: str = ""
    assessed: str = ""
    farthest: tuple[str, ...] = ()
    until: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def headline(self) -> str:
        """Outcome and number of doubts, in one line."""
        return self._add_doubts(self._outcome_text) + f"; {NO_RANGE}" * (not self.doubts)

    @property
    def brief(self) -> str:
        """Outcome and number of doubts, without lost blocks and the remark on a range."""
        fall = self.fall and replace(self.fall, time=None)
        return self._add_doubts(fall.text if fall else self._outcome_text)

    def _add_doubts(self, text: str) -> str:
        """Return an outcome with how the run was broken off, and the number of doubts."""
        text += f", but the run {self.incomplete}" if self.incomplete else ""
        count = len(self.doubts)
        return f"{text}; {count} doubt{'s' * (count > 1)}" if count else text

    @property
    def said_displacement(self) -> str:
        """Largest displacement, with the time from which it lacks elastic joints."""
        lacks = self.fall is not None and self.fall.lacks_joints
        return format_mm(self.displacement) + f" (with joints{self.until})" * lacks

    @property
    def _outcome_text(self) -> str:
        """Outcome with the definitions by which there is a mechanism, or with the fallen blocks."""
        if self.fall is not None:
            return self.fall.text
        if self.outcome != "mechanism":
            moves = any(doubt.words == STILL_MOVES for doubt in self.doubts)
            return self.outcome + ", not decided: still moving" * moves
        met = {name: found is not None for name, found in self.mechanisms.items()}
        text = f"mechanism by {join_names([name for name in met if met[name]])}"
        if all(met.values()):
            return text
        return f"{text}; none by {join_names([name for name in met if not met[name]])}"

    def __str__(self) -> str:
        """Verdict in words: outcome, doubts, displacements, and a line for each mechanism."""
        lines = [self.headline, *(f"{DOUBT_MARK}{doubt}" for doubt in self.doubts)]
        lines += [self.assessed] if self.assessed else []
        if not np.isnan(self.displacement):
            # what still rocks has no residual displacement
            moves = self.fall is not None and not self.fall.resting
            most, left = [f" ({name})" for name in self.farthest] or ("", "")
            end = f"{format_mm(self.residual)}{left}"
            end = f"{end} at the end, while blocks still move" if moves else f"residual {end}"
            lines.append(
                f"largest displacement of a corner {self.said_displacement}{most}, {end}; "
                "not varied"
            )
        # definitions with the same mechanism share a line
        groups: dict[str, list[str]] = {}
        for name, found in self.mechanisms.items():
            groups.setdefault("none" if found is None else str(found), []).append(name)
        lines += self.remarks
        for words, names in groups.items():
            subject, until = ("mechanism by ", self.until) if words == "none" else ("", "")
            fell = self.fall is not None and self.fall.kind in FALLEN_STATES
            held = HELD * (fell and words == "none" and "verified" in names)
            lines.append(f"{subject}{join_names(names)}: {words}{until}{held}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Headline."""
        return f"Verdict({self.headline!r})"


@single_threaded
def detect_mechanisms(
    joints: xr.Dataset, structure: Structure | None
) -> dict[str, Mechanism | None]:
    """Find the first mechanism by each definition that applies.

    "Verified" needs the structure, and "ring and pier at once" needs both. No joints of walls in
    bond are counted.
    """
    counted = leave_out_walls(joints)
    first: dict[str, Mechanism | None] = dict(counted_mechanisms(counted))
    if not {"ring", "pier"} <= set(joints["role"].values.astype(str)):
        del first["ring and pier at once"]
    if structure is not None:
        verified = first_verified_mechanism(structure, joints)
        first["verified"] = None if verified is None else verified.moved
    first[PUBLISHED_DEFINITION] = demirel_aldemir_mechanism(counted)
    return first


def add_larger_mechanism(joints: xr.Dataset, structure: Structure, found: Mechanism) -> Mechanism:
    """Return a verified mechanism, one too small to matter with the first that moves farther."""
    below = SMALL_DISPLACEMENT * shallowest_part(structure)[0]
    if found.opening is None or found.displacement > below:
        return found
    larger = first_verified_mechanism(structure, joints, beyond=below)
    return replace(found, below=below, larger=None if larger is None else larger.moved)


def brief_mechanism_remarks(
    joints: xr.Dataset, structure: Structure | None, detected: Mapping[str, Mechanism | None]
) -> list[str]:
    """Return remarks on earlier mechanisms that are shorter than the criteria require."""
    criteria = Criteria.of(joints)
    if step_lengths(joints["time"].values).min() >= criteria.duration:
        return []
    loose = with_failure_flags(joints, replace(criteria, duration=0.0))
    begins: dict[float | None, list[str]] = {}
    verified = structure if "verified" in detected else None
    for name, brief in detect_mechanisms(loose, verified).items():
        counted = detected[name]
        # over the record each joint counts only once its failure has lasted: it is never brief
        if name == OVER_RECORD or brief is None:
            continue
        if counted is None or brief.time != counted.time:
            begins.setdefault(brief.time, []).append(name)
    return [
        f"{join_names(names)}: what begins at {time:.4f} s lasts less than "
        f"{duration_text(criteria.duration)}, and does not count"
        for time, names in begins.items()
    ]


def total_duration_remark(joints: xr.Dataset) -> str:
    """Return a sentence on the total and the longest time with enough failed joints."""
    subject, *durations = _measure_failures(joints)
    total, longest = map(duration_text, durations)
    return f"{subject} for {total} in all, {longest} at the longest"


def _measure_failures(joints: xr.Dataset) -> tuple[str, float, float]:
    """Return in words that enough joints fail at once, and for how long in all, at the longest."""
    flags = has_counted_mechanism(joints).expand_dims(joint=[0])
    steps = step_lengths(flags["time"].values)
    total = float(steps[flags.transpose("joint", "time").values[0]].sum())
    longest = float(longest_duration(flags)[0])
    required, word = Criteria.of(joints).failures, _adjective_of_joints(joints)
    subject = f"{required}{word} joints and more fail at once"
    if required == 1:
        subject = f"one{word} joint or more fails"
    return subject, total, longest


def _adjective_of_joints(joints: xr.Dataset) -> str:
    """Return the adjective of joints that count, where others do not."""
    return "" if joints["judged"].values.all() else " assessed"


def doubt_unassessed_joints(joints: xr.Dataset, structure: Structure) -> list[Doubt]:
    """Return a doubt where joints of stones fail, by the criteria of a run, and do not count."""
    judged = joints["judged"].values
    if judged.all():
        return []
    soft, carrying = set(find_yielding_blocks(structure)), set(joints["role"].values[judged])
    # large displacements follow every stone: there only joints at rings and piers matter
    is_large, blocks = joints.attrs.get("displacements") == "large", structure.blocks
    touches = [(*joint.blocks, joint.ends) for joint in structure.joints]
    backs = find_backs(blocks, touches, find_directions(blocks, touches))
    # what lies on the back of a ring, or bears nothing at rest, is no hinge
    out = judged | structure.heads | joints["open"].isel(time=0).values
    left_out = [
        number
        for number, (a, b, _) in enumerate(touches)
        if not (out[number] or soft & {a, b} or number in backs)
        and (not is_large or carrying & {blocks[a].role, blocks[b].role})
    ]
    own = joints.isel(joint=left_out)
    flags = find_failed_joints(own)
    lasts = longest_duration(flags).values >= (1.0 - 1e-6) * Criteria.of(joints).duration
    own = own.isel(joint=lasts & flags.any("time").values)
    if not own.sizes["joint"]:
        return []
    sizes = abs(own["eccentricity"]).max("time").fillna(0.5)  # open throughout
    one = own.isel(joint=int(sizes.values.argmax()))
    opens = ", open" * bool(one["open"].any())
    friction = float(one["friction"].max())
    example = f"{one['name'].item()} (|e| {float(sizes.max()):.3f}, V/N {friction:.3g}{opens})"
    words, values = "joints that are not assessed fail: {}", list[float]([own.sizes["joint"]])
    counted = joints.isel(joint=judged | np.isin(joints["joint"], own["joint"]))
    counted.coords["judged"] = ("joint", np.full(counted.sizes["joint"], True))
    if has_counted_mechanism(counted).any():
        subject, *durations = _measure_failures(counted)
        words += f"; with them counted, {subject} for {{:.3g}} s in all, {{:.3g}} s at the longest"
        values += durations
    parts = join_names([f"'{part}'" for part in dict.fromkeys(own["part"].values.astype(str))])
    remedy = f"give the blocks of part {parts} role='pier' or 'ring', and they count"
    return [Doubt(words, remedy, tuple(values), example=example)]


def doubt_soft_joints(
    joints: xr.Dataset, structure: Structure, fall: CollapseState
) -> Iterator[Doubt]:
    """Yield the doubt of a run in which blocks are displaced, and no criterion has a mechanism.

    An elastic joint without tension is open over half of its depth at |e| = 1/3. Where it is soft,
    the moment about a displaced structure has its maximum before the joint counts as a hinge.
    """
    largest = float(abs(assessed_joints(joints)["eccentricity"]).max())
    moved, limit = fall.displacement, DISLOCATION * shallowest_part(structure)[0]
    if fall.time is None and moved > limit and largest > 1.0 / 3.0:
        remedy = "count hinges from a smaller |e|, `criteria.hinge`, and see `archfem limit`"
        yield Doubt(ROCKS_SOFTLY, remedy, (largest, moved))


def describe_failed_joints(joints: xr.Dataset) -> str:
    """Return the assessed joints that have failed at an instant in words; "" without any."""
    own = assessed_joints(joints)
    kinds = {"hinges": own["hinge"] != 0, "slides": own["slide"], "gaps": own["open"]}
    words = [
        f"{kind} ({join_joint_names(own['name'].values[flags.values].tolist(), most=16)})"
        for kind, flags in kinds.items()
        if flags.any()
    ]
    at = f" at {float(joints['time']):.3f} s, when blocks come loose"
    return f"by {join_words(words)}{at}" if words else ""


def find_farthest(
    dataset: xr.Dataset, structure: Structure | None
) -> tuple[tuple[str, ...], list[tuple[float, str]]]:
    """Return the stones of the largest and last displacement, and size and words of each body's."""
    if structure is None or "largest_displacement" not in dataset or "fall_pose" in dataset:
        return (), []
    most, left = (dataset[f"{key}_displacement"].values for key in ("largest", "residual"))
    stones, bodies = list_own_stones(structure), find_bodies(structure)
    names = [structure.blocks[stones[each[stones].argmax()]].name for each in (most, left)]
    moved = []
    for name in bodies:
        size, end = (float(each[structure.block_number(name)]) for each in (most, left))
        words = f"'{name}', which stands on it, was displaced by up to {format_mm(size)}"
        moved.append((size, f"{words}, {format_mm(end)} at the end"))
    return tuple(names), moved


def extremes_remark(dataset: xr.Dataset, structure: Structure | None) -> list[str]:
    """Return a sentence on the largest hinge rotation and slip, with what of that remains."""
    if "rotation" not in dataset:
        return []
    # rotations of joints while they hinge, slips of all joints, both of rings and piers
    names = ["rotation", "hinge", "slide", "slip", "V", "eccentricity"]
    joints = assessed_joints(dataset[names]).transpose("time", "joint")
    rotations, slips = (np.abs(joints[name].values) for name in ("rotation", "slip"))
    rotations = np.where(joints["hinge"].values != 0, rotations, 0.0)
    if rotations.max() > 0.0:
        rotation = f"largest hinge rotation {_peak_text(joints, rotations, 1e-3, 'mrad')}"
    else:
        rotation = f"no{_adjective_of_joints(dataset)} joint hinges"
    number, part = _find_peak(slips)[1], ""
    if not joints["slide"].values[:, number].any():
        part = ", elastic: |V| stays below its limit there"
        place = int(joints["joint"][number])
        if structure is not None and structure.friction[place] < np.inf:
            slip, shear, size = (joints[name].values[:, number] for name in names[-3:])
            # less the elastic slip V / (k_s A), on the closed length that |e| leaves
            closed = np.clip(1.5 - 3.0 * abs(size[[0, -1]]), 1e-9, 1.0)
            area = closed * float(joints["depth"][number]) * structure.width
            elastic = shear[[0, -1]] / area / structure.joints[place].contact.shear_stiffness
            # V is the mean over a step; of joints that never slid up to 6 % were left
            left = abs(slip[-2:].mean() - slip[0] - np.diff(elastic).item())
            if left > 0.1 * slips.max():
                part = f", of which {left / mm:.3g} mm remain, as part of the face slid"
                part += ": |V| stays below its limit"
    return [f"{rotation}, largest slip {_peak_text(joints, slips, mm, 'mm')}{part}"]


def _find_peak(values: Array) -> tuple[int, int]:
    """Return instant and joint of the largest value."""
    instant, joint = np.unravel_index(int(values.argmax()), values.shape)
    return int(instant), int(joint)


def _peak_text(joints: xr.Dataset, values: Array, unit: float, name: str) -> str:
    """Return the largest of values over time and joint, with the joint and the time."""
    instant, joint = _find_peak(values)
    largest, time = float(values[instant, joint]), float(joints["time"].values[instant])
    return f"{largest / unit:.3g} {name} ({joints['name'].values[joint]}, {time:.3f} s)"
