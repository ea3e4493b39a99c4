"""History of a run: recorded joints and fields, first mechanisms, verdict, and its file."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from operator import index
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import ResultDisplay, call_late_bound
from archfem._netcdf import read_dataset, write_dataset
from archfem._typing import Array
from archfem._validation import check_type, validate_arguments, validate_methods
from archfem.dynamics.collapse_state import (
    COLLAPSE_STATES,
    CollapseState,
    describe_dislocation,
    explain_residual,
)
from archfem.dynamics.export import write_vtk, write_xdmf
from archfem.dynamics.verdict import (
    ALL_DEFINITIONS,
    Verdict,
    add_larger_mechanism,
    brief_mechanism_remarks,
    describe_failed_joints,
    detect_mechanisms,
    doubt_soft_joints,
    doubt_unassessed_joints,
    extremes_remark,
    find_farthest,
    total_duration_remark,
)
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import (
    FACE_COORDINATE,
    HEAD_COORDINATE,
    Criteria,
    describe_assessed_joints,
    with_failure_flags,
)
from archfem.joints.resultants import select_joint, write_joint_table
from archfem.limit.mechanism_count import Mechanism, counted_mechanism, demirel_aldemir_mechanism
from archfem.limit.mechanism_kinematics import (
    VerifiedMechanism,
    first_verified_mechanism,
    verified_mechanism,
)
from archfem.masonry.joint_closing import describe_closing
from archfem.masonry.structure import Structure, join_names
from archfem.models.model import Doubt, Model, read_doubts, write_doubts
from archfem.units import kPa

SIGN_CONVENTION = (
    "N > 0 compression; eccentricity and M > 0 toward the extrados; V > 0 where the joint's "
    "higher block slips toward the extrados; rotation > 0 opens the intrados; "
    "gravity along -y; displacements relative to the ground"
)

# Words of the doubt of blocks that were loose while the ground still shook, with the time and the
# share of Arias intensity left, and its remedy where stones met
LOOSE_BLOCKS = (
    "from {:.2f} s on, with {:.0%} of the Arias intensity to come, blocks were followed as loose "
    "rigid ones: with elastic joints they may move farther, and mechanisms were sought until then"
)
MEETING_REMEDY = (
    "join these stones by a joint or make them one, end a bed away from a corner that they share, "
    "or leave a gap that they do not close"
)

# Kind of the file of a history
FILE_KIND = "history file"


class Ending(StrEnum):
    """How a run ended.

    Attributes:
        FINISHED: at the end of its motion.
        EVENT: by the event given as `until`.
        INTERRUPTED: by Ctrl-C.
        FAILED: at a step without equilibrium.
        PARTED: by separation of blocks, whose fall was then followed to the ground.
        MET: by stones that met outside their joints; loose blocks were followed from before that.
    """

    FINISHED = "finished"
    EVENT = "event"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    PARTED = "parted"
    MET = "met"

    @property
    def is_complete(self) -> bool:
        """Whether the run was neither interrupted nor failed."""
        return self not in (Ending.INTERRUPTED, Ending.FAILED)

    @property
    def is_loose(self) -> bool:
        """Whether loose blocks were followed from there on, without joints."""
        return self in (Ending.PARTED, Ending.MET)


def _read_number(value: Any) -> float:
    """Return a number; a text that looks like one is none."""
    return float(value + 0.0)


# Functions that refuse a value which an attribute of a file cannot have
ATTRIBUTE_KINDS: dict[str, Callable[[Any], Any]] = {
    **dict.fromkeys(("pga", "energy_drift", "displacement", "residual"), _read_number),
    **dict.fromkeys(("last_time", "predicted_error", "admissible_step"), _read_number),
    **dict.fromkeys(("fill_tension", "fill_tension_time"), _read_number),
    **dict.fromkeys(("fall_time", "fall_residual", "fall_resting"), _read_number),
    "fall_loose_share": _read_number,
    **dict.fromkeys(("criteria_hinge", "criteria_duration", "criteria_friction"), _read_number),
    **dict.fromkeys(("halved_steps", "steps", "criteria_failures"), index),
    **dict.fromkeys(("structure", "fidelity", "fall_blocks"), str.strip),
    "ended": Ending,
    "fall": COLLAPSE_STATES.index,
    "displacements": ("small", "large").index,
}

# Dimensions of variables, which every file has but for the ground's motion, and texts of joints
DIMENSIONS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("N", "V", "M", "eccentricity", "friction"), ("time", "joint")),
    **dict.fromkeys(("hinge", "slide", "open"), ("time", "joint")),
    **dict.fromkeys(("name", "part", "role", "judged", "depth", "height"), ("joint",)),
    "friction_limit": ("joint",),
    "time": ("time",),
    "ground": ("time", "axis"),
}
TEXTS = ("name", "part", "role", FACE_COORDINATE)


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class History(ResultDisplay):
    """Record of one run.

    Attributes:
        dataset: all recorded variables with units, signs, library versions, failure criteria and,
            if there is one, the case. Resultants and flags are over (time, joint), fields over
            (frame, coordinate).
        structure: structure of the run, which the file does not contain. Motions of the blocks
            cannot be verified without it.
    """

    dataset: xr.Dataset
    structure: Structure | None = None

    @property
    def joints(self) -> xr.Dataset:
        """N, V, M, eccentricity, friction, opening, rotation, slip and flags, by time and joint."""
        dataset = self.dataset
        return dataset[[k for k in dataset.data_vars if "joint" in dataset.variables[k].dims]]

    @property
    def displacement(self) -> xr.DataArray:
        """Displacements of the corners of the free blocks (time, point, xy) [m].

        Raises:
            InvalidInput: the run has no fields.
        """
        if "displacement" not in self.dataset:
            raise InvalidInput(
                "the run has no displacements of points: record fields with "
                "time_history(..., record=Record(fields_every=10)), or run it again"
            )
        values = self.dataset["displacement"].drop_vars("frame_time", errors="ignore")
        names = {"corner_block": "block", "corner_x": "x", "corner_y": "y"}
        values = values.rename({"frame": "time", "corner": "point", "axis": "xy", **names})
        times = self.dataset["frame_time"].values
        return values.assign_coords(time=("time", times, {"units": "s"}))

    @property
    def criteria(self) -> Criteria:
        """Failure criteria of joints, and number of failed joints of a mechanism."""
        return Criteria.of(self.dataset)

    @validate_arguments
    def with_criteria(self, criteria: Criteria) -> "History":
        """Return the same run with other failure criteria.

        Args:
            criteria: criteria in place of those of the run; its ending does not change.
        """
        return History(with_failure_flags(self.dataset, criteria), self.structure)

    @property
    def time(self) -> Array:
        """Times of the recorded steps (steps,) [s]."""
        return self.dataset["time"].values

    @property
    def outcome(self) -> str:
        """How the run ended, in words."""
        return str(self.dataset.attrs.get("outcome", "ended with its record"))

    @property
    def ending(self) -> Ending:
        """How the run ended; a record of joints alone is finished."""
        return Ending(self.dataset.attrs.get("ended", Ending.FINISHED))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the run may be wrong, each with its remedy.

        They concern energy drift above 5 % at any step; rotations and displacements too large for a
        model of small displacements; damping that drags loose blocks; a record that drifts; a
        missed tolerance of the steps; steps that are long for sliding, or with a fifth of which the
        displacement differs; a fidelity that does not suit a block; a predicted error above its
        tolerance; a run that was broken off; blocks that were loose before strong motion was over,
        and did not fall; soft blocks that fall in one piece; a stack that as one rigid body falls,
        stands or moves otherwise; joints between stones that fail and are not assessed; and soft
        joints that let blocks rock before they hinge. The last two need the structure.
        """
        stored = read_doubts(str(self.dataset.attrs.get("doubts", "[]")))
        return (*stored, *self._doubts_of_run)

    @cached_property
    def _doubts_of_run(self) -> list[Doubt]:
        """Doubts of a run broken off or without joints, and of failing joints not assessed."""
        joints, structure = self.joints, self.structure
        doubts = [] if structure is None else doubt_unassessed_joints(joints, structure)
        if structure is not None and (fall := self.fall) is not None:
            soft = doubt_soft_joints(joints, structure, fall)
            doubts += [doubt for doubt in soft if not any(self.mechanisms.values())]
        if self.fall is not None and self.fall.lacks_joints:
            example, met = self.outcome.partition(": ")[2], self.ending is Ending.MET
            remedy = MEETING_REMEDY if met else "state that blocks come loose, and not how far"
            values = float(self.time[-1]), self.fall.loose_share
            doubts.append(Doubt(LOOSE_BLOCKS, remedy, values, example=example))
        if not self.ending.is_complete:
            cause = f"the run {self.outcome.partition(':')[0]}, and what comes after is not known"
            doubts.append(Doubt(cause, "run the motion again, to its end"))
        return doubts

    def with_doubts(self, doubts: Iterable[Doubt]) -> "History":
        """Return the same run with other doubts.

        Args:
            doubts: doubts in place of those of the run; repeated ones count once.
        """
        stored = [each for each in dict.fromkeys(doubts) if each not in self._doubts_of_run]
        return History(self.dataset.assign_attrs(doubts=write_doubts(stored)), self.structure)

    @cached_property
    def mechanism(self) -> Mechanism | None:
        """First mechanism by count, or None; with the blocks that can then move, if any."""
        counted = counted_mechanism(self.joints)
        if counted is None or self.structure is None:
            return counted
        motion = verified_mechanism(self.structure, self.joints.sel(time=counted.time))
        if motion.kind == "none":
            return counted
        moved = motion.moved
        return replace(counted, blocks=moved.blocks, block_names=moved.block_names)

    @cached_property
    def verified(self) -> VerifiedMechanism | None:
        """First mechanism verified by a motion of the blocks, or None.

        Raises:
            InvalidInput: the history has no structure.
        """
        if self.structure is None:
            raise InvalidInput(
                "this history has no structure, so that motions of its blocks cannot be verified: "
                "read it with History.read(path, structure)"
            )
        return first_verified_mechanism(self.structure, self.joints)

    @cached_property
    def demirel_aldemir(self) -> Mechanism | None:
        """First mechanism by the criterion of `demirel_aldemir_mechanism`, or None."""
        return demirel_aldemir_mechanism(self.joints)

    @cached_property
    def fall(self) -> CollapseState | None:
        """State of collapse at the end of the run; None for small displacements."""
        attrs = self.dataset.attrs
        if "fall" not in attrs:
            return None
        time, mechanism = float(attrs["fall_time"]), ""
        if not np.isnan(time) and "fall_pose" in self.dataset:  # pictures show this instant too
            loose = float(self.dataset["fall_time"][0])
            mechanism = describe_failed_joints(self.joints.sel(time=loose, method="nearest"))
        return CollapseState(
            str(attrs["fall"]),
            None if np.isnan(time) else time,
            tuple(name for name in str(attrs["fall_blocks"]).split("\n") if name),
            float(attrs["displacement"]),
            float(attrs["fall_residual"]),
            bool(attrs["fall_resting"]),
            float(attrs.get("admissible_step", np.inf)),
            float(attrs["fall_loose_share"]),
            mechanism,
        )

    @cached_property
    def mechanisms(self) -> dict[str, Mechanism | None]:
        """First mechanism by each definition that applies, or None."""
        # of a long run of a wall verification takes minutes, and Ctrl-C wants the end
        structure = None if self.ending is Ending.INTERRUPTED else self.structure
        found = detect_mechanisms(self.joints, structure)
        if structure is not None and (verified := found.get("verified")):
            found["verified"] = add_larger_mechanism(self.joints, structure, verified)
        return found

    @cached_property
    def verdict(self) -> Verdict:
        """Assessment of the run; `str(run.verdict)` describes it in words."""
        attrs, joints, mechanisms = self.dataset.attrs, self.joints, self.mechanisms
        remarks = [] if self.ending is Ending.FINISHED else [f"the run {self.outcome}"]
        if self.ending is Ending.INTERRUPTED:
            remarks[0] += ", and no mechanism was verified"
        if self.fall is not None and self.fall.mechanism:
            remarks.append(f"it falls {self.fall.mechanism}")
        if self.structure is not None and self.fall is not None and self.fall.time is None:
            remarks.append(describe_dislocation(self.structure))
        farthest, standing = find_farthest(self.dataset, self.structure)
        remarks += [words for _, words in standing]
        remarks += extremes_remark(self.dataset, self.structure)
        if (tension := attrs.get("fill_tension")) is not None:
            when = f"at {attrs['fill_tension_time']:.3f} s"
            remarks.append(
                f"largest tension in elastic fill {tension / kPa:.3g} kPa, {when}: soil has none"
            )
        remarks += brief_mechanism_remarks(joints, self.structure, mechanisms)
        if mechanisms["any joints at once"] is not None:
            remarks.append(total_duration_remark(joints))
        if self.structure is not None and (law := describe_closing(self.structure)):
            remarks.append(
                f"{law}, which was not varied{explain_residual(self.structure, self.fall)}"
            )
        return Verdict(
            outcome=classify_outcome(self),
            doubts=self.doubts,
            displacement=float(attrs.get("displacement", np.nan)),
            residual=float(attrs.get("residual", np.nan)),
            mechanisms=mechanisms,
            fall=self.fall,
            assessed=describe_assessed_joints(joints),
            farthest=farthest,
            incomplete="" if self.ending.is_complete else self.outcome.partition(":")[0],
            until=f" until {self.time[-1]:.2f} s" * self.ending.is_loose,
            remarks=tuple(remarks),
        )

    def _summary(self) -> str:
        title, times = self.dataset.attrs.get("title", ""), self.time
        return (
            f"History '{title}': {len(times)} records to {times[-1]:.4g} s; {self.verdict.headline}"
        )

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return the variables of one joint over time.

        Args:
            joint: name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return select_joint(self.joints, joint)

    def save(self, path: str | Path) -> Path:
        """Write a NetCDF file atomically: an interrupted write does not damage an existing file.

        Variables of the joints are written in single precision, which rounds them by at most 6e-8
        of their value. Flags, fields and the state at the end are exact.

        Args:
            path: file to write; folders are created.

        Returns:
            The file.

        Raises:
            InvalidInput: it cannot be written, or is a result of `archfem run`.
        """
        encoding: dict[Any, dict[str, Any]] = {
            name: {"zlib": True} for name, variable in self.dataset.items() if variable.ndim > 1
        }
        for name, variable in self.dataset.items():
            if variable.dtype == np.float64 and "joint" in variable.dims:
                encoding.setdefault(name, {})["dtype"] = "float32"
        with np.errstate(over="ignore", under="ignore"):  # |V| / N just before a joint opens
            return write_dataset(self.dataset, Path(path), FILE_KIND, encoding)

    @classmethod
    @validate_arguments
    def read(cls, path: str | Path, structure: Structure | None = None) -> "History":
        """Read a file written by `save`.

        Args:
            path: file to read.
            structure: structure of the run, for `verified`, for the blocks of `mechanism` and for
                the roles of its parts.

        Raises:
            InvalidInput: there is no such file, or it is damaged, something else, or of another
                structure or version of archfem.
        """
        dataset = read_dataset(path, FILE_KIND)
        _check_content(path, dataset)
        if structure is not None:
            _check_structure(path, dataset, structure)
            roles = [joint.role for joint in structure.joints]
            dataset = dataset.assign_coords(
                role=("joint", roles), judged=("joint", structure.judged)
            )
            if structure.heads.any():
                dataset.coords[HEAD_COORDINATE] = "joint", structure.heads
        for values in dataset.data_vars.values():
            # arithmetic with single precision would round again; one by one, for they are large
            if values.dtype == np.float32:
                values.data = values.data.astype(np.float64)
        return cls(dataset, structure)

    def to_vtk(self, model: Model, path: str | Path) -> Path:
        """Write a series for ParaView: blocks, and joints as the gaps between their faces.

        Blocks share no points, so that openings remain. Points have `displacement` [m], cells the
        number of their `block` and, where blocks deform, mean stresses `stress_xx`, `stress_yy`,
        `stress_xy` [Pa]. Joints are quadrilaterals, flat at rest, with N, V, M, eccentricity,
        opening, slip and flags.

        Args:
            model: model of the run, which must have fields.
            path: list to write, *.pvd; the files it names are in a folder beside it.

        Returns:
            The list.

        Raises:
            InvalidInput: the run has no fields or another model, or the name ends otherwise.
        """
        return write_vtk(model, self.dataset, path)

    def to_xdmf(self, model: Model, path: str | Path) -> Path:
        """Write the fields as XDMF and HDF5: displacements [m] and mean stresses [Pa].

        Blocks share no points, so that openings remain.

        Args:
            model: model of the run, which must have fields.
            path: text file to write, *.xdmf; the numbers get the same name with .h5.

        Returns:
            The text file.

        Raises:
            InvalidInput: the run has no fields or another model, or the name ends otherwise.
        """
        return write_xdmf(model, self.dataset, path)

    def to_table(self, path: str | Path) -> Path:
        """Write the joint results as a table with one row per joint and step.

        Args:
            path: *.csv, *.parquet or *.xlsx.

        Returns:
            The file.

        Raises:
            InvalidInput: the name ends otherwise, the package that writes such files is not
                installed, or there are more rows than a sheet has.
        """
        return write_joint_table(self.joints, path)

    def player(self, model: Model | None = None, *, title: str = "") -> Any:
        """Return the player of the run, see `archfem.view.player`.

        Args:
            model: model of the run; required if the run has fields.
            title: title above the picture; by default the run's own.

        Returns:
            The player, which displays itself in a notebook and can be saved as a page.

        Raises:
            InvalidInput: as in `archfem.view.player`.
        """
        return call_late_bound("History.player", self, model, title=title)

    def report(self, path: str | Path) -> Path:
        """Write an HTML report of the run and of its case, in one file for print.

        Args:
            path: file to write, .html, or .docx for Word; folders are created.

        Returns:
            The file.

        Raises:
            InvalidInput: the run was made in Python, without a case.
        """
        return call_late_bound("History.report", self, path)


def _check_content(path: str | Path, dataset: xr.Dataset) -> None:
    """Refuse a file whose variables and attributes are not those of a history."""
    shapes = {name: values.dims for name, values in dataset.variables.items()}
    shapes.setdefault("ground", DIMENSIONS["ground"])
    wrong = [name for name, dims in DIMENSIONS.items() if shapes.get(name) != dims]
    for name, values in dataset.variables.items():
        dims = values.dims
        is_strange = "joint" in dims and dims not in DIMENSIONS.values()
        is_text = {"time", "joint"} & {*dims} and values.dtype.kind in "OSUM"
        wrong += [str(name)] if is_strange or (is_text and name not in TEXTS) else []
    needed = ["cohesion_limit", *["slip"] * ("rotation" in shapes)]
    wrong += [name for name in needed if name not in shapes]
    required = [name for name in ATTRIBUTE_KINDS if "fall" in dataset.attrs and name[:5] == "fall_"]
    for name, kind in ATTRIBUTE_KINDS.items():
        try:
            if name in dataset.attrs or name in required:
                kind(dataset.attrs[name])
        except (KeyError, TypeError, ValueError):
            wrong.append(f"attribute {name}")
    if wrong:
        names = join_names(list(dict.fromkeys(wrong)))
        raise InvalidInput(
            f"{path} is not a time history that archfem wrote: it lacks {names}, or has something "
            "else in its place; run again"
        )


def _check_structure(path: str | Path, dataset: xr.Dataset, structure: Structure) -> None:
    """Refuse a file of another structure, by names of joints and by fingerprint."""
    names = dataset["name"].values.astype(str).tolist()
    if names != [joint.name for joint in structure.joints]:
        raise InvalidInput(
            f"{path} is of another structure: it has {len(names)} joints from '{names[0]}' to "
            f"'{names[-1]}', and '{structure.name}' has others; give the one that was shaken"
        )
    if dataset.attrs.get("structure", structure.fingerprint) != structure.fingerprint:
        raise InvalidInput(
            f"{path} is of another structure: its joints have the names of those of "
            f"'{structure.name}', but blocks are elsewhere; give the one that was shaken"
        )


def with_fall(history: History, fall: CollapseState) -> History:
    """Return a history with the state of collapse at its end."""
    dataset = history.dataset.assign_attrs(
        displacement=fall.displacement,
        residual=fall.residual,
        fall=fall.kind,
        fall_time=np.nan if fall.time is None else fall.time,
        fall_blocks="\n".join(fall.blocks),
        fall_residual=fall.residual,
        fall_resting=int(fall.resting),
        fall_loose_share=fall.loose_share,
    )
    return History(dataset, history.structure)


@validate_arguments
def partial_history(error: DidNotConverge) -> History:
    """Return the history up to the failed step of a run.

    Args:
        error: error raised by `time_history`.

    Raises:
        DidNotConverge: that error, if it has no history since no step was recorded.
    """
    if not isinstance(error.history, History):
        raise error
    return error.history


def classify_outcome(run: History) -> str:
    """Return the outcome of a run, as of `Verdict`."""
    if run.fall is not None:
        return run.fall.kind
    if run.dataset.attrs.get("displacements") == "large":
        return "unknown"
    return "mechanism" if any(run.mechanisms.values()) else "no mechanism"


def first_mechanisms(run: History, criteria: Criteria | None = None) -> dict[str, Mechanism | None]:
    """Find the first mechanism of a run by each definition.

    - "any joints at once": four joints of rings and piers, anywhere, hinge or slide at once;
    - "one part at once": four of one ring or one pier do, whatever else fails (local);
    - "ring and pier at once": four of one ring and one pier do, at least one of each (semi-global);
    - "one part over the record": four of one ring or one pier do, each at some time;
    - "verified": the failed joints permit a motion of rings or piers, however many they are;
    - "Demirel and Aldemir": as they word it, four of one ring, its class by the failures of piers.

    The number four is `Criteria.failures`.

    Args:
        run: history with its structure.
        criteria: failure criteria of joints; by default those of the run.

    Returns:
        By definition, the mechanism with its time, joints and class, or None.

    Raises:
        InvalidInput: the history has no structure.
    """
    check_type(run, History, "run", "give what time_history returns")
    if run.structure is None:
        raise InvalidInput(
            "this history has no structure, which a verified mechanism needs: read it with "
            "History.read(path, structure)"
        )
    judged = run if criteria is None else run.with_criteria(criteria)
    return {name: judged.mechanisms.get(name) for name in ALL_DEFINITIONS}
