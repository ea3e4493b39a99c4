"""One analysis as a value, read from a TOML file.

Numbers are SI (angles in degrees), or quantities with a unit such as "1.48 MPa/mm". An unknown key,
a wrong unit or an impossible geometry is an error that names the key and the remedy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from archfem._validation import check_words, validate_arguments
from archfem.cases import analysis_keys, motion_keys
from archfem.cases.analysis_keys import AssessmentSettings, LimitAnalysis
from archfem.cases.provenance import load_extensions_of
from archfem.cases.structure_keys import cached_structure, parse_stages
from archfem.cases.toml_file import Table, apply_change, check_table, read_with_base, refuse_unknown
from archfem.dynamics.schemes import MIN_TIME_STEP, EffectiveDamping, Scheme, Viscous
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.construction import Stage
from archfem.masonry.structure import Structure
from archfem.models.discretisation import Discretisation
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite

# Keywords of `build`, and the error tolerance of fidelity "auto".
MODEL_KEYS = {
    **{"fidelity": (str, dict), "cells": [int], "cell": str, "max_cell_size": "m", "degree": int},
    **{"quadrature": str, "quadrature_points": int, "tolerance": "1", "displacements": str},
    "mesh_file": str,
}


@dataclass(frozen=True)
class Case:
    """One analysis: structure, model, motion, and settings of the analysis.

    Attributes:
        title: title of the case, which is also the name of the structure.
        structure: blocks and joints.
        model: keywords of `build`.
        motion: checked keys of [motion], or None.
        suite: checked keys of [suite], or None; without motion and suite only the dead load is
            analysed.
        analysis: checked keys of [analysis]: time step, scheme, damping, when to stop.
        criteria: criteria of joint failure, and the number of failed joints of a mechanism.
        limit: limit analysis, or None.
        rating: arguments of `archfem.rate` from [rating].
        assessment: kinematic assessment; without [assessment] that of the case's motion or suite.
        output: checked keys of [output]: records, pictures and films.
        settings: tables of the case as they were read, changes included.
        folder: folder that relative file names start from.
    """

    title: str
    structure: Structure
    model: dict[str, Any]
    motion: dict[str, Any] | None
    suite: dict[str, Any] | None
    analysis: dict[str, Any]
    criteria: Criteria
    limit: LimitAnalysis | None
    rating: Table
    assessment: AssessmentSettings
    output: dict[str, Any]
    settings: dict[str, Any] = field(repr=False)
    folder: Path = Path()

    @classmethod
    @validate_arguments
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Case":
        """Read a case file.

        With `base = "other.toml"` a file contains only its differences from another one: its
        tables are merged over those of the base key by key, after the keys of
        `remove = ["section.key", …]` have been removed from the base. Relative file names start
        from the folder of the file.

        Args:
            path: TOML file.
            changes: "section.key=value" each, which replaces a value of the file.

        Returns:
            The case.

        Raises:
            InvalidInput: a key or value is invalid; the message names it and the remedy.
            InvalidStructure: the lengths of the structure contradict each other.
        """
        path = Path(path)
        settings = read_with_base(path)
        for text in changes:
            apply_change(settings, text)
        try:
            return cls.of(settings, path.parent)
        except ArchfemError as error:
            raise type(error)(f"{path}: {error}") from error

    @classmethod
    @validate_arguments
    def of(cls, settings: Table, folder: Path = Path()) -> "Case":
        """Return the case of tables such as a TOML file contains.

        Args:
            settings: tables by section.
            folder: folder that relative file names start from.

        Returns:
            The case.

        Raises:
            InvalidInput: a key or value is invalid; the message names it and the remedy.
            InvalidStructure: the lengths of the structure contradict each other.
        """
        if "structure" not in settings and {"case", "cases"} & set(settings):
            raise InvalidInput("this is a study of cases: compute it by `archfem study`")
        sections = (
            *("structure", "materials", "contacts", "model", "motion", "suite", "analysis"),
            *("criteria", "limit", "rating", "assessment", "dead_load", "output"),
        )
        refuse_unknown(settings, ("title", "extensions", *sections))
        load_extensions_of(settings, folder)
        check_words(settings.get("title", ""), "title", 'write words in quotes: title = "…"')
        for key in sections:
            if not isinstance(settings.get(key, {}), dict):
                raise InvalidInput(f"{key} = {settings[key]!r} is not a table: write [{key}]")
        model = check_table(settings.get("model", {}), MODEL_KEYS, "model")
        keys: Table = {"hinge": "1", "failures": int, "friction": "1", "duration": "s"}
        criteria = check_table(settings.get("criteria", {}), keys, "criteria")
        keys = {"save_every": int, "save_fields_every": int, "joints": [(int, str)]}
        keys |= {"animation": bool, "free_body": str}
        motion, suite, limit = (settings.get(key) for key in ("motion", "suite", "limit"))
        if motion is not None and suite is not None:
            raise InvalidInput("a case has either one motion or a suite: take out one of the two")
        case = cls(
            title=settings.get("title", "case"),
            structure=cached_structure(settings, folder),
            model=model,
            motion=None if motion is None else motion_keys.parse_motion(motion),
            suite=None if suite is None else motion_keys.parse_suite(suite),
            analysis=analysis_keys.parse_analysis(settings.get("analysis", {})),
            criteria=Criteria(**criteria),
            limit=None if limit is None else analysis_keys.parse_limit(limit),
            rating=analysis_keys.parse_rating(settings.get("rating", {})),
            assessment=analysis_keys.parse_assessment(settings.get("assessment", {})),
            output=check_table(settings.get("output", {}), keys, "output"),
            settings=dict(settings),
            folder=folder,
        )
        case._check()
        return case

    def _check(self) -> None:
        """Refuse settings whose errors would otherwise appear after the dead load only."""
        # These properties parse and check their settings.
        _ = self.discretisation, self.tolerance, self.damping, self.scheme, self.joints
        _ = self.stages
        analysis_keys.check_scheme(self.analysis, self.structure, self.discretisation.displacements)
        step = self.analysis.get("dt", MIN_TIME_STEP)
        if not MIN_TIME_STEP <= step <= 0.1:
            raise InvalidInput(
                f"analysis.dt = {step:g} s is not between {MIN_TIME_STEP:g} and 0.1 s"
            )
        if "free_body" in self.output:
            self.structure.block_number(self.output["free_body"])

    @cached_property
    def stages(self) -> Sequence[Stage] | None:
        """Construction stages of the structure; None if it is built at once."""
        return parse_stages(self.settings.get("dead_load", {}), self.structure)

    @property
    def has_motion(self) -> bool:
        """Whether the case has a ground motion or a suite."""
        return self.motion is not None or self.suite is not None

    @property
    def selects_model(self) -> bool:
        """Whether the model is selected by its predicted error, fidelity = "auto"."""
        return self.model.get("fidelity") == "auto"

    @cached_property
    def discretisation(self) -> Discretisation:
        """Fidelity, mesh and quadrature; with fidelity = "auto" the default ones."""
        unused = {"tolerance", "fidelity"} if self.selects_model else {"tolerance"}
        keywords = {key: value for key, value in self.model.items() if key not in unused}
        if "mesh_file" in keywords:
            if self.selects_model:
                raise InvalidInput(
                    "model.mesh_file is one mesh, and fidelity = 'auto' chooses: name a fidelity"
                )
            keywords["mesh_file"] = self.folder / keywords["mesh_file"]
        return Discretisation(**keywords)

    @property
    def tolerance(self) -> float:
        """Permitted error of the largest |e| of every joint with fidelity = "auto" [-]."""
        tolerance = float(self.model.get("tolerance", 0.005))
        if not 0.0 < tolerance < 1.0:
            raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
        return tolerance

    @property
    def damping(self) -> Viscous | EffectiveDamping | None:
        """Damping of the time history; `EffectiveDamping` takes its frequencies from the modes."""
        return analysis_keys.parse_damping(self.analysis)

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joints to draw over time; empty if the case names none."""
        return tuple(map(self.structure.joint_number, self.output.get("joints", ())))

    @property
    def scheme(self) -> Scheme:
        """Time integration scheme."""
        return analysis_keys.parse_scheme(self.analysis)

    def ground_motion(self) -> Motion:
        """Return the ground motion, read or synthetic.

        Returns:
            The motion as applied: resampled, cut and scaled.

        Raises:
            InvalidInput: the case has none, or its file cannot be read.
        """
        if self.motion is None:
            raise InvalidInput("the case has no [motion]: give a file, or synthetic = { seed = 1 }")
        return motion_keys.build_motion(self.motion, self.folder)

    def ground_suite(self) -> Suite:
        """Return the suite of ground motions, matched to its target if the case says so.

        Returns:
            The suite.

        Raises:
            InvalidInput: the case has none, or a pair cannot be read or matched.
            DidNotConverge: spectral matching of a pair did not converge.
        """
        if self.suite is None:
            raise InvalidInput("the case has no [suite]: give a table for each of its pairs")
        return motion_keys.build_suite(self.suite, self.folder)

    def check_ground(self) -> None:
        """Refuse motions that cannot be read, before anything is computed.

        Raises:
            InvalidInput: a file cannot be read.
        """
        if self.motion is not None:
            self.ground_motion()
        if self.suite is not None:
            motion_keys.build_pairs(self.suite, self.folder)

    @property
    def target(self) -> DesignSpectrum | None:
        """Target spectrum of the suite, or None."""
        return motion_keys.build_target_spectrum(self.suite or {})

    def alone(self, *pairs: str) -> "Case":
        """Return the case with some pairs of its suite alone.

        Args:
            pairs: names of the pairs; they stay in the order of the suite.

        Returns:
            The changed copy.

        Raises:
            InvalidInput: the case has no such pair.
        """
        if self.suite is None:
            raise InvalidInput("the case has no [suite] to take pairs of: give a table for each")
        refuse_unknown(dict.fromkeys(pairs), self.suite["pairs"], "suite.pairs")
        # Checked keys and original tables must agree: the digest is that of the tables.
        suite, table = (
            {**keys, "pairs": {key: pair for key, pair in keys["pairs"].items() if key in pairs}}
            for keys in (self.suite, self.settings["suite"])
        )
        return replace(self, suite=suite, settings={**self.settings, "suite": table})

    def text(self) -> str:
        """Return the case as TOML, changes included."""
        return tomli_w.dumps(self.settings)
