"""Incremental dynamic analysis: motions are scaled up until limit states are reached.

References:
    Vamvatsikos and Cornell, Earthq. Eng. Struct. Dyn. 31 (2002) 491-514, and Earthq. Spectra 20
    (2004) 523-553 for hunt and fill.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import ResultDisplay
from archfem._typing import Array
from archfem._validation import check_choice, validate_arguments, validate_methods
from archfem.cases.case import Case, case_of
from archfem.cases.motion_keys import write_motion
from archfem.cases.run import DeadLoadResult
from archfem.dynamics.analysis import Analysis, with_one_facet
from archfem.dynamics.collapse_state import CollapseState, doubt_soft_blocks
from archfem.dynamics.events import applicable_definitions
from archfem.dynamics.history import Ending, partial_history
from archfem.dynamics.scale_search import (
    COLLAPSE_DEFINITION,
    ScaledRun,
    check_search,
    search_scales,
)
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.limit.mechanism_count import Mechanism, counted_mechanism
from archfem.models.model import Doubt
from archfem.motion.motion import Motion, admissible_range
from archfem.motion.response_spectra import measure_intensity, response_spectrum
from archfem.studies.cache import dead_load_of, ground_motion, lowest_modes
from archfem.studies.evaluators import Evaluator, Findings, largest_values, run_motion
from archfem.studies.fragility import Fragility, fragility
from archfem.studies.parameter_space import PAIR_KEY, Axis, Point
from archfem.studies.shared_results import compute_once
from archfem.studies.study import Study

# A joint of a ring or pier hinges; four of them fail at once; the failed joints permit a motion of
# the blocks; blocks fall, for large displacements
LIMIT_STATES = ("first hinge", "four failures", "verified", COLLAPSE_DEFINITION)

# Intensity measures, with their names on an axis
MEASURE_LABELS = {
    "pga": "peak ground acceleration [m/s²]",
    "pgv": "peak ground velocity [m/s]",
    "sa": "spectral acceleration at the first mode, 5 % [m/s²]",
    "arias": "Arias intensity [m/s]",
}

# Findings of a run that are stored for the curves, with their names on an axis
DEMAND_LABELS = {
    "eccentricity": "largest |e| of a joint [-]",
    "rotation": "largest rotation of a joint [rad]",
    "slip": "largest slip of a joint [m]",
    "largest_displacement": "largest displacement of a corner [m]",
    "residual_displacement": "residual displacement of a corner [m]",
}


def search_limit_states(
    case: Case, limits: Sequence[str] | None, precision: float, between: Sequence[float]
) -> Findings:
    """Return the scales of its motion at which a case reaches limit states, and the demands."""
    result, motion = dead_load_of(case), ground_motion(case)
    limits = _applicable_limits(result, limits)
    demands: dict[float, Findings] = {}

    inputs = case.hash_inputs(presentation=False)

    def run_scaled(scale: float) -> ScaledRun:
        # kept one by one: a search that is ended loses the run that it is in
        run = compute_once(
            "runs", f"{inputs} {scale!r}", lambda: _run(result, motion.scaled(scale))
        )
        demands[scale] = run["demands"]
        met = Mechanism("", "", (), None)
        reached = {limit: met if is_met else None for limit, is_met in run["reached"].items()}
        fall = CollapseState(run["fall"], None, (), nan, nan, True) if run["fall"] else None
        return ScaledRun(scale, reached, Ending(run["ending"]), run["outcome"], fall)

    reach = admissible_range(between, motion)
    brackets = search_scales(run_scaled, limits, precision, reach)
    if brackets.interrupted:
        raise KeyboardInterrupt
    # Fill: up to four runs in the middle of the widest gap of the curve, unless it is narrow.
    for _ in range(4):
        gaps = pairwise(sorted(demands))
        low, high = max(gaps, key=lambda gap: gap[1] / gap[0], default=(1.0, 1.0))
        if high > 1.2 * low:
            brackets = brackets.with_run(run_scaled(sqrt(low * high)))
    period = 1.0 / float(lowest_modes(result).frequencies[0])
    measured = measure_intensity(motion)
    findings: Findings = {"period": period, "pga": measured.pga, "pgv": measured.pgv}
    findings["sa"] = float(response_spectrum(motion, np.array([period]))[0])
    findings["arias"] = measured.arias
    for limit in limits:
        bracket = brackets[limit]
        findings |= {limit: bracket.upper, f"{limit}, survives": bracket.lower}
        findings[f"{limit}, survives above"] = len(bracket.above)
    findings["scale"] = scales = sorted(demands)
    return findings | {name: [demands[scale][name] for scale in scales] for name in DEMAND_LABELS}


def _run(result: DeadLoadResult, motion: Motion) -> dict[str, Any]:
    """The limit states that a run reaches, its end, and its demands, infinite if incomplete."""
    try:
        # demands of a run whose blocks fall are infinite: its first lost block tells all
        run = run_motion(result, motion, whole_fall=False)
        complete = not run.ending.is_loose
    except DidNotConverge as error:
        run, complete = partial_history(error), False
    demands = dict.fromkeys(DEMAND_LABELS, inf)
    if complete:
        findings = largest_values(run)
        demands = {name: findings[name] for name in DEMAND_LABELS}
    joints = run.joints
    reached = {
        "first hinge": bool(assessed_joints(joints)["hinge"].values.any()),
        "four failures": counted_mechanism(joints) is not None,
        "verified": run.verified is not None,
    }
    fall = None if run.fall is None else run.fall.kind
    end = {"ending": str(run.ending), "outcome": run.outcome, "fall": fall}
    return {"reached": reached, "demands": demands, **end}


def _applicable_limits(result: DeadLoadResult, limits: Sequence[str] | None) -> tuple[str, ...]:
    """The limit states to search; by default all that the structure and model permit."""
    large = result.case.analysis.displacements == "large"
    counts = applicable_definitions(result.case.structure, result.case.analysis.failure_criteria)
    possible = {"first hinge", "verified"}
    possible |= {"four failures"} if "any joints at once" in counts else set()
    possible |= {COLLAPSE_DEFINITION} if large else set()
    chosen = tuple(limit for limit in LIMIT_STATES if limit in (limits or possible))
    if impossible := [limit for limit in chosen if limit not in possible]:
        raise InvalidInput(
            f"limit state {impossible[0]!r} cannot be met: collapse needs displacements = "
            "'large', four failures as many joints in rings and piers"
        )
    return chosen


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class Ida(ResultDisplay):
    """Result of incremental dynamic analysis.

    Attributes:
        table: over `motion` the intensity measures of the unscaled motions, the `period` of the
            first mode [s], and by limit state the smallest failing scale. Names with ", survives"
            have the largest surviving scale below it; those with ", survives above" the number of
            surviving runs above it. Over `motion` and `entry` the `scale` and the demands of each
            run.
        doubts: reasons why scales of collapse may be wrong, each with its remedy.
    """

    table: xr.Dataset
    doubts: tuple[Doubt, ...] = ()

    def _summary(self) -> str:
        """Return the peak accelerations at which limit states are reached."""
        tops = {limit: self.capacities(limit)[1] for limit in self.limits}
        words = (f"{x} at {high.min():.3g} to {high.max():.3g} m/s²" for x, high in tops.items())
        found = self.table["error"].values if "error" in self.table else ()
        errors = [str(error) for error in found if error]
        without = f"; {len(errors)} without an answer, as {errors[0]}" if errors else ""
        return f"Ida: {self.table.sizes['motion']} motions, by PGA: {', '.join(words)}{without}"

    @property
    def limits(self) -> tuple[str, ...]:
        """Limit states that were searched."""
        return tuple(limit for limit in LIMIT_STATES if limit in self.table)

    def capacities(self, limit: str, measure: str = "pga") -> tuple[Array, Array]:
        """Return the bracket of the intensity at which each motion reaches a limit state.

        Args:
            limit: limit state, one of `limits`.
            measure: "pga", peak ground acceleration [m/s²]; "pgv", peak ground velocity [m/s];
                "sa", spectral acceleration at the first mode, 5 % [m/s²]; "arias", Arias intensity
                [m/s].

        Returns:
            The largest surviving intensity below the smallest failing one (motions,), and the
            smallest failing one, infinite if none fails (motions,); without motions whose search
            failed.

        Raises:
            InvalidInput: limit state or measure are unknown.
        """
        check_choice(limit, "limit", self.limits)
        unscaled, power = self._measure(measure)
        valid = np.isfinite(unscaled)
        low, high = (self.table[name].values for name in (f"{limit}, survives", limit))
        return (unscaled * low**power)[valid], (unscaled * high**power)[valid]

    def fragility(self, limit: str, measure: str = "pga", **options: Any) -> Fragility:
        """Return the fragility curve of a limit state, with the record-to-record dispersion.

        Args:
            limit: limit state, one of `limits`.
            measure: intensity measure, as for `capacities`.
            options: keywords `resamples` and `seed` of the bootstrap.

        Raises:
            InvalidInput: as for `capacities`, or the capacities determine no curve.
        """
        low, high = self.capacities(limit, measure)
        return fragility(high, low, **options)

    def curves(
        self, measure: str = "pga", demand: str = "rotation"
    ) -> Iterator[tuple[str, Array, Array]]:
        """Yield the curve of demand over intensity of each motion, which need not be monotonic.

        Args:
            measure: intensity measure, as for `capacities`.
            demand: "rotation" [rad], "eccentricity" [-], "slip", "largest_displacement" or
                "residual_displacement" [m].

        Yields:
            Name of the motion, intensities and demands (runs,) by increasing scale. The demand of
            an incomplete run is infinite.

        Raises:
            InvalidInput: measure or demand are unknown.
        """
        unscaled, power = self._measure(measure)
        check_choice(demand, "demand", DEMAND_LABELS)
        for k, name in enumerate(self.table["motion"].values):
            scale = self.table["scale"].values[k]
            valid = np.isfinite(scale)  # shorter rows are padded
            intensity = unscaled[k] * scale[valid] ** power
            yield str(name), intensity, self.table[demand].values[k][valid]

    def _measure(self, measure: str) -> tuple[Array, int]:
        """A measure of the unscaled motions, and the power of the scale with which it grows."""
        check_choice(measure, "measure", MEASURE_LABELS)
        return self.table[measure].values, 2 if measure == "arias" else 1

    def fractiles(self, intensity: Array, measure: str = "pga", demand: str = "rotation") -> Array:
        """Return the 16, 50 and 84 % fractiles of the demand at intensities.

        Args:
            intensity: intensities above 0 (n,).
            measure: intensity measure, as for `curves`.
            demand: demand, as for `curves`.

        Returns:
            Demands (3, n), interpolated linearly between runs. A curve counts as infinite above an
            incomplete run and above its last one: its motion has met the limit states, and a
            fractile does not turn back where it ends. NaN if fewer than half of the motions were
            run at such an intensity.
        """
        curves = []
        for _, x, y in self.curves(measure, demand):
            if len(x):
                # an incomplete run is the end of its curve: the demand stays infinite
                end = inf if np.isinf(y[-1]) else np.nan
                curves.append(np.interp(intensity, [0, *x], [0, *y], right=end))
        demands = np.array(curves)
        valid = ~np.isnan(demands)
        # the median, and one standard deviation to either side
        fractiles = np.full((3, demands.shape[1]), np.nan)
        for k in np.flatnonzero(2 * valid.sum(axis=0) >= len(demands)):
            column = np.where(valid[:, k], demands[:, k], inf)
            fractiles[:, k] = np.quantile(column, (0.16, 0.50, 0.84), method="nearest")
        return fractiles

    def not_monotonic(self, limit: str) -> list[str]:
        """Return the motions that survive a scale above one at which they fail.

        Args:
            limit: limit state, one of `limits`.
        """
        above = self.table[f"{limit}, survives above"].values
        return [str(name) for name in self.table["motion"].values[above > 0.0]]


def draw_ida_result(found: Ida, measure: str = "pga", demand: str = "rotation") -> Any:
    """Draw the curves, fractiles and limit states of an IDA."""
    from archfem.view.studies import draw_ida  # matplotlib is slow to import

    curves = list(found.curves(measure, demand))  # which refuse other words
    intensity = np.linspace(0.0, max(float(x.max(initial=0.0)) for _, x, _ in curves), 301)[1:]
    return draw_ida(
        curves,
        {limit: found.capacities(limit, measure) for limit in found.limits},
        fractiles=(intensity, found.fractiles(intensity, measure, demand)),
        measure=MEASURE_LABELS[measure],
        demand=DEMAND_LABELS[demand],
    )


@validate_arguments
def ida(
    subject: Analysis | Case,
    motions: Motion | str | Path | Sequence[Any] | Mapping[str, Any] | None = None,
    *,
    limits: Sequence[str] | None = None,
    precision: float = 0.05,
    between: tuple[float, float] = (0.05, 10.0),
    folder: str | Path | None = None,
    workers: int | None = None,
    client: Any = None,
) -> Ida:
    """Scale each motion up until each limit state is reached, and narrow the bracket of the scale.

    The search begins at scale 1 and multiplies or divides by √2 until a limit state is bracketed.
    Then the brackets are halved, gaps below a collapse filled as by `collapse_scale`, and the
    widest gaps of the curves. Every run takes the whole motion. A run without equilibrium counts as
    failed.

    Args:
        subject: analysis, or case of the structure; with `displacements="large"` collapse is a
            limit state, for which fill in one piece has one facet on each stone.
        motions: motions by name or in a sequence, each a `Motion`, the file of a record, relative
            to the case's folder, or a table as [motion]; a single `Motion` or file; by default the
            pairs of the suite, scaled and reduced as the case says.
        limits: limit states, "first hinge", "four failures", "verified", "collapse"; by default all
            that the structure and model permit.
        precision: relative width of the final brackets [-].
        between: smallest and largest scale [-]; no ground motion may exceed 5 g.
        folder: folder for finished runs, also those of unfinished motions, as for `Study.run`.
        workers: number of processes, as for `Study.run`.
        client: client of Dask, as for `Study.run`.

    Returns:
        Capacities, curves and fragility by any intensity measure.

    Raises:
        InvalidInput: there are no motions, a limit state is unknown, or precision or scales are out
            of range.
        StudyStopped: as for `Study.run`.

    References:
        Vamvatsikos and Cornell, Earthq. Eng. Struct. Dyn. 31 (2002) 491-514, and Earthq. Spectra 20
        (2004) 523-553 for hunt and fill.
    """
    for limit in limits or ():
        check_choice(limit, "limits", LIMIT_STATES)
    check_search(precision, between)
    options: Findings = {"limits": None if limits is None else list(limits), "precision": precision}
    options["between"] = [float(scale) for scale in between]
    case = case_of(subject)
    large = case.analysis.displacements == "large"
    falls = large and COLLAPSE_DEFINITION in (limits or LIMIT_STATES)
    if falls and (coarse := with_one_facet(case.analysis)) is not case.analysis:
        facets = ("model.cells", [*coarse.cells]), ("model.cell", coarse.cell)
        case = Point.of(case, facets).case
    names, points = _points(case, motions)
    axis = Axis("motion", ("motion",), tuple((name,) for name in names))
    evaluator = Evaluator(search_limit_states, options)
    study = Study.of_points(f"{case.title}: IDA", evaluator, (axis,), points)
    table = study.run(folder, workers=workers, client=client)
    return Ida(table, doubt_soft_blocks(case.structure) if falls else ())


def _points(
    case: Case, motions: Motion | str | Path | Sequence[Any] | Mapping[str, Any] | None
) -> tuple[list[str], tuple[Point, ...]]:
    """Names of motions, and the case under each of them."""
    if motions is None:
        names = list((case.suite or {}).get("pairs", ()))
        if not names:
            raise InvalidInput("no motions were given, and the case has no [suite] of them")
        changes = [((PAIR_KEY, name),) for name in names]
        return names, tuple(Point.of(case, change) for change in changes)
    if isinstance(motions, Motion | str | Path):
        motions = [motions]
    if isinstance(motions, Mapping):
        named = dict(motions)
    else:
        named = {_motion_name(motion, k): motion for k, motion in enumerate(motions, start=1)}
    if not named or len(named) < len(motions):
        raise InvalidInput(f"{len(motions)} motions under {len(named)} names: give each its own")
    tables = {name: write_motion(motion) for name, motion in named.items()}
    still = case.without("suite", "motion")
    return list(tables), tuple(Point.of(still, [("motion", table)]) for table in tables.values())


def _motion_name(motion: Any, number: int) -> str:
    """Name of a motion that was given without one."""
    if isinstance(motion, Motion):
        return motion.name or f"motion {number}"
    table = write_motion(motion)
    if "file" in table:
        return Path(table["file"]).stem
    seed = table.get("synthetic", {}).get("seed")
    return f"motion {number}" if seed is None else f"seed {seed}"
