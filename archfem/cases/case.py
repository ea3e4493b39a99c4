"""One analysis as a value, read from a TOML file.

Numbers are SI (angles in degrees), or quantities with a unit such as "1.48 MPa/mm". An unknown key,
a wrong unit or an impossible geometry is an error that names the key and the remedy.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from archfem._files import atomic_write
from archfem._validation import check_words, declared_keys, validate_arguments
from archfem.cases import analysis_keys, analysis_tables, motion_keys, provenance, toml_file
from archfem.cases.analysis_keys import AssessmentSettings, LimitAnalysis, PushoverSettings
from archfem.cases.risk_keys import RISK_KEYS, RiskSettings, parse_risk
from archfem.cases.structure_keys import cached_structure, shape_keys, write_structure
from archfem.cases.verdict_keys import VERDICT_KEYS, parse_verdict
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.recorder import Record
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.structure import Structure
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite

OUTPUT_KEYS: toml_file.Table = {"joints": [(int, str)], "animation": bool, "free_body": str}

# Who signs what, against which demand: head and conclusion of a report
REPORT_KEYS: toml_file.Table = dict.fromkeys(
    ("project", "place", "author", "checked_by", "date", "version", "norm", "demand"), str
)

# The same, of which pairs of a suite it shows the run: "worst" or "all", and sources by key
_REPORT_KEYS: toml_file.Table = {**REPORT_KEYS, "pairs": str, "sources": dict}


@dataclass(frozen=True)
class Case:
    """One analysis: structure, model, motion, and settings of the analysis.

    Attributes:
        title: title of the case, which is also the name of the structure.
        analysis: all but the ground motion.
        motion: checked keys of [motion], or None.
        suite: checked keys of [suite], or None; without motion and suite only the dead load is
            analysed.
        limit: limit analysis, with the joints, stones and fill of a rating. Without [limit] it has
            no load.
        pushover: pushover from the dead load, or None.
        rating: arguments of `archfem.rate` from [rating].
        assessment: kinematic assessment; without [assessment] that of the case's motion or suite.
        risk: hazard, alternatives and sampling of `archfem.collapse_risk`, or None.
        verdict: arguments of `archfem.verdict_range` from [verdict].
        output: checked keys of [output]: pictures and films.
        report: checked keys of [report]: project, place and the like, which a report shows.
        settings: tables of the case as they were read, changes included.
        folder: folder that relative file names start from.
    """

    title: str
    analysis: Analysis
    motion: dict[str, Any] | None
    suite: dict[str, Any] | None
    limit: LimitAnalysis
    pushover: PushoverSettings | None
    rating: toml_file.Table
    assessment: AssessmentSettings
    risk: RiskSettings | None
    verdict: dict[str, Any]
    output: dict[str, Any]
    report: dict[str, Any]
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
            changes: "section.key=value" each, which replaces a value of the file, or
                'remove=["section.key", …]'.

        Returns:
            The case.

        Raises:
            InvalidInput: a key or value is invalid; the message names it and the remedy.
            InvalidStructure: the lengths of the structure contradict each other.
        """
        path = Path(path)
        settings = read_settings(path, changes)
        try:
            case = cls.of(settings, path.parent)
            _check_sources(settings, case.report.get("sources", ()))
            return case
        except ArchfemError as error:
            raise type(error)(f"{path}: {error}") from error

    @classmethod
    @validate_arguments
    def of(cls, settings: toml_file.Table, folder: Path = Path()) -> "Case":
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
        _check_sections(settings)
        provenance.load_extensions_of(settings, folder)
        check_words(settings.get("title", ""), "title", 'write words in quotes: title = "…"')
        output = toml_file.check_table(settings.get("output", {}), OUTPUT_KEYS, "output")
        report = _read_report(settings)
        motion, suite, push = (settings.get(key) for key in ("motion", "suite", "pushover"))
        if motion is not None and suite is not None:
            raise InvalidInput("a case has either one motion or a suite: take out one of the two")
        structure = cached_structure(settings, folder)
        analysis = analysis_tables.read_analysis(settings, structure, folder)
        strength = analysis_keys.find_given_strength(structure, settings)
        limit = analysis_keys.parse_limit(settings.get("limit", {}), strength)
        assessed = settings.get("assessment", {})
        if output.get("animation", False) and analysis.record.fields_every is None:
            # a film of each tenth step
            analysis = replace(analysis, record=replace(analysis.record, fields_every=10))
        case = cls(
            title=settings.get("title", "case"),
            analysis=analysis,
            motion=None if motion is None else motion_keys.parse_motion(motion),
            suite=None if suite is None else motion_keys.parse_suite(suite),
            limit=limit,
            pushover=None if push is None else analysis_keys.parse_pushover(push),
            rating=analysis_keys.parse_rating(settings.get("rating", {})),
            assessment=analysis_keys.parse_assessment(assessed, limit, structure),
            risk=None if (risk := settings.get("risk")) is None else parse_risk(risk, folder),
            verdict=parse_verdict(settings.get("verdict", {})),
            output=output,
            report=report,
            settings=dict(settings),
            folder=folder,
        )
        _ = case.joints  # refuses names of no joint
        loads = case.assessment.options.get("loads", ())
        for block in (*filter(None, [output.get("free_body")]), *(load.block for load in loads)):
            structure.block_number(block)  # refuses names of no block
        return case

    @property
    def structure(self) -> Structure:
        """Blocks and joints of the analysis."""
        return self.analysis.structure

    @property
    def has_motion(self) -> bool:
        """Whether the case has a ground motion or a suite."""
        return self.motion is not None or self.suite is not None

    @property
    def parapets(self) -> float:
        """Weight of parapets along a bridge, which ratings alone have [N/m]."""
        return float(self.rating.get("parapets", 0.0))

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joints to draw over time; empty if the case names none."""
        return tuple(map(self.structure.joint_number, self.output.get("joints", ())))

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

    @property
    def demand(self) -> DesignSpectrum | Motion | None:
        """Target spectrum of the suite, or else the motion, that an assessment is for, or None."""
        if self.target is None and self.motion is not None:
            return self.ground_motion()
        return self.target

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
        toml_file.refuse_unknown(dict.fromkeys(pairs), self.suite["pairs"], "suite.pairs")
        # Checked keys and original tables must agree: the digest is that of the tables.
        suite, table = (
            {**keys, "pairs": {key: pair for key, pair in keys["pairs"].items() if key in pairs}}
            for keys in (self.suite, self.settings["suite"])
        )
        return replace(self, suite=suite, settings={**self.settings, "suite": table})

    def without(self, *paths: str) -> "Case":
        """Return the case without some sections or keys; it need not have them.

        Args:
            paths: "section", or "section.key".

        Returns:
            The changed copy.
        """
        settings = deepcopy(self.settings)
        for path in paths:
            with suppress(InvalidInput):  # there is no such key
                toml_file.remove_key(settings, path)
        return Case.of(settings, self.folder)

    def text(self) -> str:
        """Return the case as TOML, changes included, with the blocks of a drawing for its file."""
        if "file" not in self.settings.get("structure", ()):
            return toml_file.format_tables(self.settings)
        # results must not need the drawing beside them
        blocks = write_structure(self.structure)
        given = self.settings["structure"]
        # also where they equal their defaults, which are not written
        blocks["structure"] |= {key: given[key] for key in ("width", "gravity") if key in given}
        tables = blocks | self.settings | {"structure": blocks["structure"]}
        with suppress(ArchfemError):
            if cached_structure(tables) == self.structure:
                return toml_file.format_tables(tables)
        # materials of the case under other names than theirs
        return toml_file.format_tables(self.settings | blocks)

    def signed(self, changes: Sequence[str]) -> "Case":
        """Return the case with other values of [report], which change no result.

        Args:
            changes: "report.key=words" each.

        Returns:
            The changed copy.

        Raises:
            InvalidInput: a change is of another section, or of no key of [report].
        """
        settings = sign(self.settings, changes)
        report, known = settings.get("report", {}), self.report.get("sources", {})
        # a case in a folder of results may lack what a drawing had
        _check_sources(settings, [x for x in report.get("sources", {}) if x not in known])
        return replace(self, report=report, settings=settings)

    def hash_inputs(self, *, presentation: bool = True) -> str:
        """Return the SHA-256 of the case, its input files and the program.

        Args:
            presentation: whether title, pictures and films count, which change no number.
        """
        settings = self.settings if presentation else provenance.remove_presentation(self.settings)
        return provenance.hash_inputs(settings, self.folder)

    def hash_sections(self, sections: Sequence[str], left_out: Sequence[str] = ()) -> str:
        """Return the SHA-256 of sections of the case and their input files.

        Args:
            sections: names of sections.
            left_out: keys of these that do not count.
        """
        return provenance.hash_sections(self.settings, self.folder, sections, left_out)


def read_settings(path: Path, changes: Sequence[str] = ()) -> dict[str, Any]:
    """Read the tables of a case file, with its base and with changed values."""
    settings = toml_file.read_with_base(path)
    for text in changes:
        path_of_value, value = toml_file.parse_change(text)
        toml_file.apply_change(settings, analysis_tables.complete_path(path_of_value), value)
    return settings


@cache
def section_keys() -> Mapping[str, toml_file.Table]:
    """Return the keys and kinds of each section whose keys do not depend on others in it."""
    analysis, fields = analysis_tables.analysis_keys(), analysis_tables.SECTION_FIELDS.items()
    return {
        **{name: {key: analysis[key] for key in own} for name, own in fields},
        "motion": motion_keys.motion_keys(),
        "suite": motion_keys.suite_keys(),
        "criteria": declared_keys(Criteria),
        "record": declared_keys(Record),
        "limit": analysis_keys.limit_keys(),
        "pushover": analysis_keys.pushover_keys(),
        "rating": analysis_keys.rating_keys(),
        "assessment": analysis_keys.assessment_keys(),
        "risk": RISK_KEYS,
        "verdict": VERDICT_KEYS,
        "dead_load": analysis_tables.DEAD_LOAD_KEYS,
        "output": OUTPUT_KEYS,
        "report": _REPORT_KEYS,
    }


def _check_sections(settings: toml_file.Table) -> None:
    """Refuse sections that are no tables, unknown ones, and keys that only other sections have."""
    known = section_keys()
    sections = ("structure", "materials", "contacts", *known)
    for key in sections:
        if not isinstance(settings.get(key, {}), dict):
            raise InvalidInput(f"{key} = {settings[key]!r} is not a table: write [{key}]")
    tables = {"": settings, **{name: settings.get(name, {}) for name in known}}
    for section, table in tables.items():
        own = known[section] if section else {"title", "extensions", "base", "remove", *sections}
        for key in set(table).difference(own):
            if homes := [f"{name}.{key}" for name, keys in known.items() if key in keys]:
                place = f"{section}.{key}" if section else key
                raise InvalidInput(f"unknown key '{place}': it is {' or '.join(homes)}")
    toml_file.refuse_unknown(settings, ("title", "extensions", *sections))


def sign(settings: dict[str, Any], changes: Sequence[str]) -> dict[str, Any]:
    """Return the tables of a case with other values of [report], as `Case.signed` takes them."""
    signed = deepcopy(settings)
    for path, words in map(toml_file.parse_change, changes):
        if not path.startswith("report."):
            raise InvalidInput(f"'{path}' changes results: run the case again with it")
        toml_file.set_value(signed, path, str(words))
    _read_report(signed)
    return signed


def _read_report(settings: toml_file.Table) -> dict[str, Any]:
    """Return the keys of [report]."""
    report = toml_file.check_table(settings.get("report", {}), _REPORT_KEYS, "report")
    texts = {key: words for key, words in report.items() if key != "sources"}
    texts |= {f"sources.{key}": words for key, words in report.get("sources", {}).items()}
    for key, words in texts.items():
        check_words(words, f"report.{key}", 'give words, a key with dots in quotes: "a.b" = "…"')
    if (pairs := report.get("pairs", "worst")) not in ("worst", "all"):
        raise InvalidInput(f'report.pairs = {pairs!r} must be "worst" or "all"')
    return report


def _check_sources(settings: toml_file.Table, paths: Iterable[str]) -> None:
    """Refuse sources of keys that a case does not have."""
    # results have the blocks of a drawing in place of its keys
    structure = settings["structure"]
    drawn = shape_keys("outlines") if "blocks" in structure else {}
    for path in paths:
        table: Any = {**settings, "structure": {**drawn, **structure}}
        above = ""
        try:
            for name in toml_file.split_key_path(path):
                keys = table if isinstance(table, Mapping) else ()
                toml_file.refuse_unknown({name: None}, keys, above)
                table, above = table[name], f"{above}.{name}".removeprefix(".")
        except InvalidInput as error:
            raise InvalidInput(f"report.sources: {error}") from None


def case_of(subject: Case | Analysis, motion: Any = None, folder: Path | None = None) -> Case:
    """Return a case, or the case of an analysis; with a motion, in place of its own."""
    if isinstance(subject, Case):
        settings, place = subject.settings, subject.folder
        if motion is None:
            return subject
    else:
        place = Path() if folder is None else folder
        settings = write_structure(subject.structure)
        settings |= analysis_tables.write_analysis_tables(subject, folder)
        laws = [joint.contact.law for joint in subject.structure.joints]
        if own := provenance.find_extensions([subject.until, *map(type, laws)], folder):
            settings = {"extensions": own, **settings}
    if motion is not None:
        others = {key: value for key, value in settings.items() if key not in ("motion", "suite")}
        settings = {**others, "motion": motion_keys.write_motion(motion)}
    return Case.of(settings, place)


def write_analysis(analysis: Analysis, path: str | Path) -> Path:
    """Write an analysis as a case file, which has every bit of it."""
    path = Path(path)
    case = case_of(analysis, folder=path.parent)
    if case.analysis.fingerprint != analysis.fingerprint:
        raise InvalidInput(f"{analysis!r} has values that no case file describes")
    with atomic_write(path) as draft:
        draft.write_text(case.text(), encoding="utf-8")
    return path
