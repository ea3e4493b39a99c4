"""One analysis as one value, read from a TOML file.

Numbers are SI (angles in degrees), or quantities with a unit such as "1.48 MPa/mm". A key that is
not known, a wrong unit or an impossible geometry is an error that names the key and the remedy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from archfem.annotated import as_annotated
from archfem.arguments import instance
from archfem.cases import motions as ground
from archfem.cases.based import based_tables
from archfem.cases.building import stages_asked
from archfem.cases.limits import Limit, limit_asked
from archfem.cases.settings import Table, change, checked, refuse_unknown
from archfem.cases.stepping import check_scheme, damping_asked, scheme_asked
from archfem.cases.structures import structure_of
from archfem.dynamics.schemes import EffectiveDamping, Scheme, Viscous
from archfem.dynamics.time_history import LEAST_STEP
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.stages import Stage
from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite

MODEL = {
    "fidelity": (str, dict),
    "cells": [int],
    "cell": str,
    "coarse": "m",
    "degree": int,
    "quadrature": str,
    "points": int,
    "tolerance": "1",
    "displacements": str,
    "file": str,
}
"""What a `Discretisation` takes, which checks it, and a tolerance."""

DAMPING = {
    "ratio": "1",
    "frequency": "Hz",
    "frequencies": ["Hz"],
    "modes": str,
    "kind": str,
    "share": "1",
    "joints": str,
}
ANALYSIS = {"dt": "s", "scheme": str, "alpha": "1", "damping": dict, "halt": bool}
CRITERIA = {"hinge": "1", "failures": int, "friction": "1", "duration": "s"}
OUTPUT = {
    "every": int,
    "fields_every": int,
    "joints": [(int, str)],
    "animation": bool,
    "free_body": str,
}
SECTIONS = (
    "title",
    "structure",
    "materials",
    "contacts",
    "model",
    "motion",
    "suite",
    "analysis",
    "criteria",
    "limit",
    "dead_load",
    "output",
)


@dataclass(frozen=True)
class Case:
    """One analysis: structure, model, motion, and what to do with them.

    Attributes:
        title: in words.
        structure: what stands; its name is the title of the case.
        model: keywords of `build`.
        motion: what the file says of one ground motion, or None.
        suite: what it says of a suite of them, or None; without either there is dead load alone.
        analysis: what it says of the time history.
        criteria: what makes a joint fail, and how many failed joints make a mechanism.
        limit: what it asks of limit analysis, or None.
        output: what it says of what to keep and draw.
        settings: the whole case as it was understood, to be written again.
        folder: where relative file names start.
    """

    title: str
    structure: Structure
    model: dict[str, Any]
    motion: dict[str, Any] | None
    suite: dict[str, Any] | None
    analysis: dict[str, Any]
    criteria: Criteria
    limit: Limit | None
    output: dict[str, Any]
    settings: dict[str, Any] = field(repr=False)
    folder: Path = Path()

    @classmethod
    @as_annotated
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Case":
        """Read a case file.

        With `base = "other.toml"` a file says only what differs from another one: its tables go
        over those of the other, key by key, after `without = ["section.key", …]` has taken out
        what the other has and this one has not. Relative names start from the file's folder.

        Args:
            path: a TOML file.
            changes: "section.key=value" each, instead of what the file says.

        Returns:
            The case.

        Raises:
            InvalidInput: what cannot be meant, with the key, the value and the remedy.
            InvalidStructure: lengths that do not make a structure.
        """
        path = Path(path)
        settings = based_tables(path)
        for text in changes:
            change(settings, text)
        try:
            return cls.of(settings, path.parent)
        except ArchfemError as error:
            raise type(error)(f"{path}: {error}") from error

    @classmethod
    @as_annotated
    def of(cls, settings: Table, folder: Path = Path()) -> "Case":
        """Return a case of tables such as a TOML file holds.

        Args:
            settings: the tables by name.
            folder: where relative file names start.

        Raises:
            InvalidInput: what cannot be meant, with the key, the value and the remedy.
            InvalidStructure: lengths that do not make a structure.
        """
        refuse_unknown(settings, SECTIONS)
        instance(settings.get("title", ""), str, "title", 'write words in quotes: title = "…"')
        for key in set(SECTIONS) - {"title"}:
            if not isinstance(settings.get(key, {}), dict):
                raise InvalidInput(f"{key} = {settings[key]!r} is not a table: write [{key}]")
        analysis = checked(settings.get("analysis", {}), ANALYSIS, "analysis")
        if "damping" in analysis:
            analysis["damping"] = checked(analysis["damping"], DAMPING, "analysis.damping")
        motion, suite, limit = (settings.get(key) for key in ("motion", "suite", "limit"))
        if motion is not None and suite is not None:
            raise InvalidInput("a case has either one motion or a suite: take out one of the two")
        case = cls(
            title=settings.get("title", "case"),
            structure=structure_of(settings, folder),
            model=checked(settings.get("model", {}), MODEL, "model"),
            motion=None if motion is None else ground.motion_settings(motion),
            suite=None if suite is None else ground.suite_settings(suite),
            analysis=analysis,
            criteria=Criteria(**checked(settings.get("criteria", {}), CRITERIA, "criteria")),
            limit=None if limit is None else limit_asked(limit),
            output=checked(settings.get("output", {}), OUTPUT, "output"),
            settings=dict(settings),
            folder=folder,
        )
        case._check()
        return case

    def _check(self) -> None:
        """Refuse what would otherwise be found out only after the dead load."""
        _ = self.discretisation, self.tolerance, self.damping, self.scheme, self.joints
        _ = self.stages
        displacements = self.discretisation.displacements
        check_scheme(self.analysis, self.structure, displacements)
        step = self.analysis.get("dt", 0.005)
        if not LEAST_STEP <= step <= 0.1:
            raise InvalidInput(f"analysis.dt = {step:g} s is not between {LEAST_STEP:g} and 0.1 s")
        if "free_body" in self.output:
            self.structure.block_number(self.output["free_body"])

    @cached_property
    def stages(self) -> Sequence[Stage] | None:
        """In which the structure is built; None where it is in one go."""
        return stages_asked(self.settings.get("dead_load", {}), self.structure)

    @property
    def moves(self) -> bool:
        """Whether the ground moves, under one motion or a suite."""
        return self.motion is not None or self.suite is not None

    @property
    def chooses(self) -> bool:
        """Whether the model is to be chosen, by fidelity = "auto"."""
        return self.model.get("fidelity") == "auto"

    @cached_property
    def discretisation(self) -> Discretisation:
        """What the structure is modelled by; its mesh does not count where "auto" is to choose."""
        idle = {"tolerance", "fidelity"} if self.chooses else {"tolerance"}
        told = {key: self.model[key] for key in self.model if key not in idle}
        if "file" in told and self.chooses:
            raise InvalidInput("model.file is one mesh, and fidelity = 'auto' chooses: name a rung")
        told |= {key: self.folder / told[key] for key in ("file",) if key in told}
        return Discretisation(**told)

    @property
    def tolerance(self) -> float:
        """Error in the largest |e| of every joint that a model to be chosen may have [-]."""
        tolerance = float(self.model.get("tolerance", 0.005))
        if not 0.0 < tolerance < 1.0:
            raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
        return tolerance

    @property
    def damping(self) -> Viscous | EffectiveDamping | None:
        """Damping of the time history; its frequencies may be left to the modes."""
        return damping_asked(self.analysis)

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joints to draw over time, which the file may name; none if not said."""
        return tuple(map(self.structure.joint_number, self.output.get("joints", ())))

    @property
    def scheme(self) -> Scheme:
        """Time stepping of the time history."""
        return scheme_asked(self.analysis)

    def ground_motion(self) -> Motion:
        """Return the ground motion, read or made.

        Raises:
            InvalidInput: there is none, or its file cannot be read.
        """
        if self.motion is None:
            raise InvalidInput("the case has no [motion]: give a file, or synthetic = { seed = 1 }")
        return ground.ground_motion(self.motion, self.folder)

    def ground_suite(self) -> Suite:
        """Return the suite of ground motions, read or made, and matched where the case says so.

        Raises:
            InvalidInput: there is none, or a pair cannot be read or matched.
            DidNotConverge: a pair did not come near the target.
        """
        if self.suite is None:
            raise InvalidInput("the case has no [suite]: give a table for each of its pairs")
        return ground.ground_suite(self.suite, self.folder)

    def check_ground(self) -> None:
        """Refuse motions that cannot be read, before anything is computed (`InvalidInput`)."""
        if self.motion is not None:
            self.ground_motion()
        if self.suite is not None:
            ground.ground_pairs(self.suite, self.folder)

    @property
    def target(self) -> DesignSpectrum | None:
        """Target spectrum of the suite, or None."""
        return ground.target_spectrum(self.suite or {})

    def alone(self, *pairs: str) -> "Case":
        """Return the case with some of the pairs of its suite.

        Args:
            pairs: their names; they keep the order of the suite.

        Raises:
            InvalidInput: the case has no such pair.
        """
        if self.suite is None:
            raise InvalidInput("the case has no [suite] to take pairs of: give a table for each")
        refuse_unknown(dict.fromkeys(pairs), self.suite["pairs"], "suite.pairs")
        kept, told = (
            {**said, "pairs": {key: said["pairs"][key] for key in said["pairs"] if key in pairs}}
            for said in (self.suite, self.settings["suite"])
        )
        return replace(self, suite=kept, settings={**self.settings, "suite": told})

    def text(self) -> str:
        """The case as TOML, changes included."""
        return tomli_w.dumps(self.settings)
