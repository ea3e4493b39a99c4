"""Data of a report: case, runs, files of the folder, and the model rebuilt for the player."""

from collections.abc import Mapping, Sequence
from csv import reader
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem import _files
from archfem._display import DOUBT_MARK
from archfem.cases.answers import RESULTS, Statement, cut_remedy
from archfem.cases.case import Case
from archfem.cases.provenance import STRUCTURE_SECTIONS
from archfem.cases.report.study_findings import StudyFindings, read_study
from archfem.cases.run import CASE_FILE, MOTION_VARIABLE, RATING_FILE
from archfem.cases.toml_file import Table, parse_tables
from archfem.dynamics.history import History
from archfem.dynamics.rigid_body.rocking_body import FirstFall
from archfem.dynamics.verdict_range import VerdictRange
from archfem.dynamics.walls_across import find_falls_across
from archfem.errors import ArchfemError
from archfem.masonry.out_of_plane import find_transverse_push
from archfem.masonry.structure import join_names, join_words
from archfem.models.builder import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.view.pages.document import FigureBlock, TextBlock
from archfem.view.pages.live import LivePage, describe_arch, list_motions
from archfem.view.pages.player import Player
from archfem.view.pages.player_data import MAX_PACKED_BYTES, Scene

# Results that the report shows, and does not state
SHOWN_RESULTS = ("modes", "accuracy", "verdict_range")

# Results of limit analysis, for which blocks are rigid
STATIC_RESULTS = ("limit", "thickness", "rating", "assessment")


@dataclass(frozen=True, eq=False)
class ReportData:
    """Case, runs, and the folder with files of other commands."""

    case: Case
    runs: Mapping[str, History]  # by the names of their motions
    folder: Path | None = None
    missing: tuple[str, ...] = ()  # names of the pairs of the suite without a run
    study_folders: Sequence[Path] = ()  # without any, that of the results, which may have one
    label: str = ""  # in a report of several cases, with inputs and signatures of all
    shared: Sequence[Path] = ()  # studies, of which the least margin is of no or another case
    elsewhere: Sequence[Path] = ()  # studies that stand with another case
    # of several cases, those of a wall across its plane, or in its plane of a stack that is across
    other_plane: tuple[str, str] | None = None  # which plane they are of, and their labels

    @cached_property
    def studies(self) -> list[StudyFindings]:
        """Findings of the studies, also of other structures."""
        own = [self.folder] if self.folder and (self.folder / "study.txt").is_file() else []
        folders, case = [*self.study_folders] or own, self.case
        folders += own if self.label and self.study_folders else []
        if not folders:
            return []
        # a case in a folder of results has the blocks of its drawing
        given = _files.hash_value(case.structure), case.hash_sections(STRUCTURE_SECTIONS)
        found = [read_study(place, given) for place in folders if place not in self.elsewhere]
        # of several cases each has those of its structure
        return [self._name_rated(each) for each in found if each.is_own or not self.label]

    def _name_rated(self, study: StudyFindings) -> StudyFindings:
        """Return a study of ratings with the vehicle of the case, if it varies none."""
        given = self.case.rating.get("vehicle")
        rates = study.is_own and "geometric" in study.table and given is not None
        if not rates or "vehicle" in study.table.attrs["varied"]:
            return study
        of = f" for {getattr(given, 'name', given)}"
        return replace(study, title=study.title + of, name=study.name + of)

    @property
    def name(self) -> str:
        """Label and title of the case, its folder, and what stands on the structure."""
        standing = join_names([*self.case.settings["structure"].get("standing", {})])
        on = f", with {standing} on it" * bool(standing)
        return f"{self.label}: {self.case.title} ({self.folder}){on}"

    @property
    def is_shaken(self) -> bool:
        """Whether it has results of earthquakes."""
        return bool(self.runs or self.statements.keys() - {"rating"})

    @property
    def is_rated(self) -> bool:
        """Whether it has a rating for the vehicle of its case."""
        given = self.case.settings.get("rating", {}).get("vehicle")
        return "rating" in self.statements and self.read_table("rating").get("vehicle") == given

    @property
    def own_studies(self) -> list[StudyFindings]:
        """Findings of the studies of the structure of the case."""
        return [each for each in self.studies if each.is_own]

    @cached_property
    def dead(self) -> xr.Dataset | None:
        """Joints under dead load (joint), at the first instant of a run; None without a run."""
        for run in self.runs.values():
            return run.joints.isel(time=0, drop=True)
        return None

    @cached_property
    def motions(self) -> dict[str, Motion]:
        """Ground motions as applied, whole."""
        return {name: read_motion(run, name) for name, run in self.runs.items()}

    @cached_property
    def across(self) -> tuple[dict[str, tuple[FirstFall, str]], str]:
        """Least first falls of a wall in bond across its plane, and why they are not known."""
        structure = self.case.structure
        try:
            return find_falls_across(structure, self.motions) if structure.heads.any() else {}, ""
        except ArchfemError as error:  # one paragraph fails, and no report
            return {}, f"; not checked against the motions across: {error}"

    @cached_property
    def transverse_push(self) -> float:
        """Push across the plane that begins to overturn a body; NaN for a single stack [g]."""
        return find_transverse_push(self.case.structure)[0]

    @cached_property
    def transverse_slide(self) -> float:
        """Push across the plane at which the supports slide with the thrust at rest [g].

        Each joint resists by the friction that N and V leave over, sqrt((μ N)² - V²). It is
        infinite where it is unknown: without a run, and of a single stack.
        """
        structure, dead = self.case.structure, self.dead
        if dead is None or np.isnan(self.transverse_push) or len(dead["N"]) != len(structure.pairs):
            return np.inf
        bears = [any(structure.blocks[number].fixed for number in pair) for pair in structure.pairs]
        friction = np.array([joint.contact.coefficient for joint in structure.joints])
        if np.isinf(friction[bears]).any():  # they do not slide
            return np.inf
        left = (friction * dead["N"].values.clip(0.0)) ** 2 - dead["V"].values ** 2
        return float(np.sqrt(left.clip(0.0))[bears].sum() / structure.weight)

    @cached_property
    def fidelity(self) -> str:
        """Fidelity of the runs, which "auto" has selected; without runs that of the case."""
        recorded = {run.dataset.attrs["fidelity"] for run in self.runs.values()}
        return ", ".join(sorted(recorded)) or self.case.analysis.discretisation.name

    def read_table(self, section: str) -> Table:
        """Return a section of the case; that of a rating is as the command took it."""
        if section == "rating" and (text := self.read_text(RATING_FILE)) is not None:
            table = dict(parse_tables(text)["rating"])
            names = [row[0] for row in reader((self.read_text("vehicles.csv") or "").splitlines())]
            return table | ({"vehicle": ", ".join(names[1:])} if names else {})
        return dict(self.case.settings.get(section, {}))

    @property
    def is_static(self) -> bool:
        """Whether there are limit analysis, a rating or an assessment alone, without a model."""
        found = {name for name in RESULTS if self.list_parts(f"{name}.txt")}
        modelled = found & {"pushover", "scale", "risk"} or self.runs
        return not modelled and bool(found.intersection(STATIC_RESULTS))

    @cached_property
    def pairs(self) -> tuple[str, ...]:
        """Names of the pairs of the case's suite, of which each may have results of its own."""
        return tuple((self.case.suite or {}).get("pairs", ()))

    @property
    def shows_all(self) -> bool:
        """Whether each pair has its run shown, and not the worst alone."""
        return self.case.report.get("pairs") == "all"

    def list_parts(self, name: str) -> dict[str, str]:
        """List the files of a result in the folder, by pair; that of all pairs is under ""."""
        places = {"": name, **{pair: f"{pair}/{name}" for pair in self.pairs}}
        return {pair: place for pair, place in places.items() if place in self.files}

    @cached_property
    def verdict_ranges(self) -> tuple[VerdictRange, ...]:
        """Ranges of the verdict in the folder, at most one for each motion."""
        parts = self.list_parts("verdict_range.nc").values()
        return tuple(VerdictRange.read(self.files[place]) for place in parts)

    def read_result(
        self, name: str, caption: str = "", figure: str = "", table: str = ""
    ) -> list[Any]:
        """Return text, under the caption of a table, and picture of a command, or an empty list.

        Without a caption there is no picture.
        """
        # a report shows what other commands left in the folder, and computes nothing itself
        lines = self.read_text(f"{name}.txt")
        if lines is None:
            return []
        drawn = self.read_figure(figure or f"{name}.png", caption) if caption else []
        return [TextBlock(lines, "lines", table), *drawn]

    @cached_property
    def statements(self) -> dict[str, Statement]:
        """What the commands state of their results, by the names of their files."""
        found = dict[str, Statement]()
        for name in RESULTS:
            places = self.list_parts(f"{name}.json").items()
            by_pair = {pair: Statement.read(self.read_text(place) or "") for pair, place in places}
            found |= {name: _join_statements(by_pair)} if by_pair else {}
        return found

    @property
    def inputs(self) -> str:
        """Digest of the case of the folder as it was computed; "" without one."""
        owner = self.folder and _files.group_of(_files.read_file_list(self.folder), CASE_FILE)
        return owner.inputs if owner else ""

    @cached_property
    def files(self) -> dict[str, Path]:
        """Files of the folder by name that have the inputs of its case; the others are left out."""
        listed = {} if self.folder is None else _files.read_file_list(self.folder)
        if self.folder is None or (owner := _files.group_of(listed, CASE_FILE)) is None:
            return {}
        groups = [group for group in listed.values() if group.inputs == owner.inputs]
        names = [name for group in groups for name in sorted(group.files)]
        paths = {name: _files.path_inside(self.folder, name) for name in names}
        return {name: path for name, path in paths.items() if path.is_file()}

    @cached_property
    def deleted(self) -> str:
        """Say which listed files of the folder are missing; "" if none is."""
        return "" if self.folder is None else _files.describe_deleted(self.folder)

    def read_text(self, name: str) -> str | None:
        """Return the text of a file of the folder, or None; its doubts are without remedies."""
        if name not in self.files:
            return None
        _files.check_listed(self.files[name], content := self.files[name].read_bytes())
        lines = content.decode("utf-8").strip().splitlines()
        return "\n".join(cut_remedy(x) if x.startswith(DOUBT_MARK) else x for x in lines)

    def read_figure(self, name: str, caption: str) -> list[FigureBlock]:
        """Return the picture of a file of the folder, or an empty list."""
        if name not in self.files:
            return []
        _files.check_listed(self.files[name], self.files[name].read_bytes())
        return [FigureBlock.read(self.files[name], caption)]


def _join_statements(by_pair: Mapping[str, Statement]) -> Statement:
    """Join what is stated of a result under each pair of a suite, the place of its doubts."""
    named = [
        (f"under '{pair}': " if pair else "", statement) for pair, statement in by_pair.items()
    ]
    return Statement(
        [text for _, each in named for text in each.sentences],
        [row for _, each in named for row in each.rows],
        # their place within a search stands with the result
        [replace(x, place=pair) for pair, each in by_pair.items() for x in each.doubts],
        [f"{under}{note}" for under, each in named for note in each.notes],
    )


def label_parts(cases: Sequence[ReportData]) -> dict[str, ReportData]:
    """Label cases A, B and so on; a stack as broad as another case is wide is the plane across."""
    labels = [chr(ord("A") + k % 26) * (k // 26 + 1) for k in range(len(cases))]
    parts = {label: replace(x, label=label) for label, x in zip(labels, cases, strict=True)}
    across: dict[str, list[str]] = {}  # stacks of each wall
    for label, stack in parts.items():
        ends = np.concatenate([x.points[:, 0] for x in stack.case.structure.blocks if not x.fixed])
        for other, each in parts.items():
            broad = np.isclose(np.ptp(ends), each.case.structure.width, rtol=0.01)
            alone = np.isnan(stack.transverse_push) > np.isnan(each.transverse_push)
            if broad and alone and stack.is_shaken and each.is_shaken:
                across.setdefault(other, []).append(label)
    for label, part in parts.items():
        walls = [wall for wall, stacks in across.items() if label in stacks]
        plane, found = ("in", walls) if walls else ("across", across.get(label, []))
        if found:
            parts[label] = replace(part, other_plane=(f"{plane} its plane", join_words(found)))
    # studies of each case by whether they change this very case, and rate the vehicle of its rating
    varied = {
        label: {each.folder: (part.inputs in each.digests, part.is_rated) for each in part.studies}
        for label, part in parts.items()
    }
    first = {k: max(varied, key=lambda x: varied[x].get(k, ())) for x in varied for k in varied[x]}
    for label, own in varied.items():
        others = [each for name, each in varied.items() if name != label]
        shared = [k for k, fits in own.items() if any(x.get(k, ()) >= fits for x in others)]
        elsewhere = [k for k in own if first[k] != label]
        parts[label] = replace(parts[label], shared=shared, elsewhere=elsewhere)
    return parts


def read_motion(run: History, name: str) -> Motion:
    """Return the whole motion of a run."""
    samples = run.dataset[MOTION_VARIABLE]
    horizontal, vertical = samples.values.T
    dt = float(samples.attrs["dt"])
    return Motion(horizontal, dt, vertical if vertical.any() else None, name)


def build_player(case: Case, run: History, title: str, players: int = 1) -> Player:
    """Return the player of a run; blocks stand still if it has no recorded displacements."""
    model, reason = _rebuild_model(case, run)
    # Players of one page share its size, but each stays legible.
    max_bytes = max(MAX_PACKED_BYTES // players, 800_000)
    return Player(Scene(case.structure, run, model, title, max_bytes, reason))


def build_live_page(data: ReportData) -> LivePage:
    """Return the page that shakes the structure of a case, under the motions of its runs."""
    thrust = None if data.dead is None else data.dead["eccentricity"].values
    arch = describe_arch(data.case.structure, thrust)
    return LivePage(data.case.title, [arch], list_motions([*data.motions.values()]))


def _rebuild_model(case: Case, run: History) -> tuple[Model | None, str]:
    """Return the model of the recorded coordinates; None and the reason if there is none."""
    if "q" not in run.dataset:
        return None, ""
    try:
        model = build(case.structure, _discretisation_of(case, run))
    except (ArchfemError, ImportError) as error:
        return None, f"Stones are drawn where they stand, for their model cannot be built: {error}"
    # A case that was changed after its run may have another mesh.
    if model.size != run.dataset.sizes["coordinate"]:
        return None, (
            "Stones are drawn where they stand: the run was made with a model of "
            f"{run.dataset.sizes['coordinate']} coordinates, and its case gives one of "
            f"{model.size}."
        )
    return model, ""


def _discretisation_of(case: Case, run: History) -> Discretisation:
    """Return the discretisation of a run; one selected by "auto" is read from its attributes."""
    if not case.analysis.selects_model:
        return case.analysis.discretisation
    fidelity = str(run.dataset.attrs["fidelity"])
    displacements = case.analysis.discretisation.displacements
    # "backfill: full, rest: faces", as `Discretisation.name` writes it.
    by_part = dict(part.rsplit(": ", 1) for part in fidelity.split(", ") if ": " in part)
    return Discretisation(by_part or fidelity, displacements=displacements)
