"""What was recorded of a time history, and its file."""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from archfem.annotated import as_annotated
from archfem.arrays import Array
from archfem.dynamics.corners import displacement_of
from archfem.dynamics.exports import Exports
from archfem.dynamics.falling.verdict import Fall
from archfem.dynamics.sentences import extremes, in_a_line, mechanism_lines
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria, flagged
from archfem.joints.duration import step_lengths
from archfem.joints.resultants import one_joint
from archfem.limit.counted import Mechanism, counted_mechanism, demirel_aldemir_mechanism
from archfem.limit.verified import (
    VerifiedMechanism,
    first_verified_mechanism,
    verified_mechanism,
)
from archfem.masonry.structure import Structure
from archfem.netcdf import read_dataset, write_dataset
from archfem.shown import Shown

SIGNS = (
    "N > 0 compression; eccentricity and M > 0 toward the extrados; V > 0 where the joint's "
    "higher block slips toward the extrados; rotation > 0 opens the intrados; "
    "gravity along -y; displacements relative to the ground"
)


class Ending(StrEnum):
    """How a run ended.

    Attributes:
        FINISHED: at the end of its motion.
        EVENT: by the event that it was to run until.
        INTERRUPTED: by Ctrl-C.
        FAILED: at a step without equilibrium.
        PARTED: because blocks came loose, and were followed to the ground.
    """

    FINISHED = "finished"
    EVENT = "event"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    PARTED = "parted"

    @property
    def by_itself(self) -> bool:
        """Whether the run came to its end, and was not broken off."""
        return self in (Ending.FINISHED, Ending.EVENT, Ending.PARTED)


@dataclass(frozen=True, eq=False, repr=False)
class History(Exports, Shown, picture="joints.draw_joints"):
    """The record of one run.

    Attributes:
        dataset: everything that was recorded, with units, signs, versions, the criteria by which
            joints are judged and, where one was given, the case. Resultants and flags are over
            (time, joint), fields over (frame, coordinate).
        structure: what was shaken; the file does not hold it. Without it motions of the blocks
            are unknown.
    """

    dataset: xr.Dataset
    structure: Structure | None = None

    @property
    def joints(self) -> xr.Dataset:
        """N, V, M, eccentricity, friction, opening, rotation, slip and flags over time and joint.

        Files of earlier versions have no opening, rotation and slip.
        """
        names = [name for name, values in self.dataset.items() if "joint" in values.dims]
        return self.dataset[names]

    @property
    def displacement(self) -> xr.DataArray:
        """Displacements of corners of the blocks, as by `displacement_of` (time, point, xy) [m]."""
        return displacement_of(self.dataset)

    @property
    def criteria(self) -> Criteria:
        """What makes a joint fail, and how many failed joints make a mechanism."""
        return Criteria.of(self.dataset)

    @as_annotated
    def judged_by(self, criteria: Criteria) -> "History":
        """Return the same run, judged by other criteria.

        Args:
            criteria: instead of its own. What ended the run stays as it was.
        """
        return History(flagged(self.dataset, criteria), self.structure)

    @property
    def time(self) -> Array:
        """Times of the recorded steps (steps,) [s]."""
        return self.dataset["time"].values

    @property
    def outcome(self) -> str:
        """How the run ended, in words."""
        return str(self.dataset.attrs["outcome"])

    @property
    def ended(self) -> Ending:
        """How the run ended.

        Raises:
            InvalidInput: it was written by a version that kept words alone.
        """
        if "ended" not in self.dataset.attrs:
            raise InvalidInput(
                "this history tells only in words how its run ended, as earlier versions wrote it: "
                f"'{self.outcome}'; run it again"
            )
        return Ending(self.dataset.attrs["ended"])

    @property
    def doubts(self) -> tuple[str, ...]:
        """What makes the run doubtful, a sentence each.

        Energy that drifts by more than 5 % at any step, joints that turn or blocks that move too
        far for small displacements, a rung that is wrong for a block or whose predicted error is
        larger than was asked for. Files of earlier versions tell none.
        """
        told = str(self.dataset.attrs.get("doubts", ""))
        return tuple(words for words in told.split("\n") if words)

    @cached_property
    def mechanism(self) -> Mechanism | None:
        """The first mechanism by count, or None; with the blocks that can then move, if any."""
        found = counted_mechanism(self.joints)
        if found is None or self.structure is None:
            return found
        motion = verified_mechanism(self.structure, self.joints.sel(time=found.time))
        return found if motion.kind == "none" else replace(found, blocks=motion.moved.blocks)

    @cached_property
    def verified(self) -> VerifiedMechanism | None:
        """The first mechanism that the blocks' motion verifies, or None.

        Raises:
            InvalidInput: the structure is not known.
        """
        if self.structure is None:
            raise InvalidInput(
                "this history does not know its structure, so that no motion of its blocks can be "
                "looked for: read it with History.read(path, structure)"
            )
        return first_verified_mechanism(self.structure, self.joints)

    @cached_property
    def demirel_aldemir(self) -> Mechanism | None:
        """The first mechanism by the criterion of `demirel_aldemir_mechanism`, or None."""
        return demirel_aldemir_mechanism(self.joints)

    @cached_property
    def fall(self) -> Fall | None:
        """What the run has left of the structure; None where displacements were taken as small."""
        told = self.dataset.attrs
        if "fall" not in told:
            return None
        time = float(told["fall_time"])
        return Fall(
            str(told["fall"]),
            None if np.isnan(time) else time,
            tuple(name for name in str(told["fall_blocks"]).split("\n") if name),
            float(told["fall_residual"]),
            bool(told["fall_resting"]),
        )

    @cached_property
    def verdict(self) -> str:
        """What the run means, in words: a sentence, and a line for each way to find a mechanism.

        The sentence tells the largest hinge rotation, slip and displacement, and what is left at
        the end; the lines tell the first mechanism by count, by the words of Demirel and Aldemir
        and, where the structure is known, verified, each with its duration and its opening, and
        whether any before it was too short to count. A run that did not finish, and one that is in
        doubt, say so first.
        """
        names = None
        if self.structure is not None:
            names = [block.name for block in self.structure.blocks]
        told = self.dataset.attrs
        whole = told.get("ended") == Ending.FINISHED or "outcome" not in told
        lines = ["" if self.fall is None else f"the structure {self.fall.words}"]
        lines += [f"in doubt: {words}" for words in self.doubts]
        lines += ["" if whole else f"outcome: {self.outcome}", extremes(self.dataset)]
        lines += mechanism_lines(self.joints, self._first, names, self._first_of_any_duration)
        return "\n".join(line for line in lines if line)

    @property
    def _first(self) -> dict[str, Mechanism | None]:
        """The first mechanism, or None, by each way to look for one."""
        found = {"by count": self.mechanism, "by Demirel and Aldemir": self.demirel_aldemir}
        if self.structure is not None:
            found["verified"] = None if self.verified is None else self.verified.moved
        return found

    @property
    def _first_of_any_duration(self) -> dict[str, Mechanism | None]:
        """The same, however short they are."""
        if step_lengths(self.time).min() >= self.criteria.duration:
            return self._first
        return self.judged_by(replace(self.criteria, duration=0.0))._first

    @as_annotated
    def _words(self) -> str:
        """What it is, in a line or two."""
        return in_a_line(self.dataset)

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return what one joint did over time.

        Args:
            joint: name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return one_joint(self.joints, joint)

    def save(self, path: str | Path) -> Path:
        """Write one NetCDF file, in one stroke: a killed run leaves the old file or the new one.

        Args:
            path: the file; folders are made.

        Returns:
            The file.
        """
        encoding = {name: {"zlib": True} for name, v in self.dataset.items() if v.ndim > 1}
        return write_dataset(self.dataset, Path(path), encoding)

    @classmethod
    @as_annotated
    def read(cls, path: str | Path, structure: Structure | None = None) -> "History":
        """Return what `save` wrote; an earlier version's file is judged by the usual criteria.

        Args:
            path: the file.
            structure: what was shaken, for `verified` and the blocks of `mechanism`. It also says
                what roles its parts have.

        Raises:
            InvalidInput: there is no such file, or it is damaged, something else, or of another
                structure; or nothing tells the roles of the parts.
        """
        dataset = read_dataset(path, "history file")
        missing = {"N", "V", "M", "eccentricity", "name"} - set(dataset.variables)
        if missing:
            raise InvalidInput(f"{path} is not a time history: it lacks {sorted(missing)}")
        names = dataset["name"].values.astype(str).tolist()
        if structure is not None and names != [joint.name for joint in structure.joints]:
            raise InvalidInput(
                f"{path} is of another structure: it has {len(names)} joints from '{names[0]}' to "
                f"'{names[-1]}', and '{structure.name}' has others; give the one that was shaken"
            )
        if structure is not None and dataset.attrs.get("structure") not in (
            None,
            structure.fingerprint,
        ):
            raise InvalidInput(
                f"{path} is of another structure: its joints have the names of those of "
                f"'{structure.name}', but blocks are elsewhere; give the one that was shaken"
            )
        if structure is not None:
            roles = [joint.role for joint in structure.joints]
            dataset = dataset.assign_coords(role=("joint", roles))
        elif "role" not in dataset.coords:
            raise InvalidInput(
                f"{path} does not tell which parts are rings and piers, as files of earlier "
                "versions do not: give the structure that was shaken too"
            )
        return cls(flagged(dataset), structure)


def with_fall(history: History, fall: Fall) -> History:
    """Return a history that tells what its run has left of the structure.

    Args:
        history: of a run.
        fall: what it has left.
    """
    dataset = history.dataset.assign_attrs(
        fall=fall.kind,
        fall_time=np.nan if fall.time is None else fall.time,
        fall_blocks="\n".join(fall.blocks),
        fall_residual=fall.residual,
        fall_resting=int(fall.resting),
    )
    return History(dataset, history.structure)


def history_of(error: DidNotConverge) -> History:
    """Return the history up to a failure.

    Args:
        error: of a time history.

    Raises:
        DidNotConverge: that error, where it has no history: no step was recorded.
    """
    if not isinstance(error.history, History):
        raise error
    return error.history
