"""Incremental dynamic analysis: motions scaled up until limit states are met, by hunt and fill.

Hunt and fill: scales of one motion at which a case meets limit states, and what runs came to.

References:
    Vamvatsikos and Cornell, Earthq. Spectra 20 (2004) 523-553.

Intensity measures of a motion as incremental dynamic analysis scales it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._typing import Array
from archfem.cases.case import Case
from archfem.cases.run import DeadLoadResult
from archfem.cases.toml_file import check_choice
from archfem.dynamics.events import applicable_definitions
from archfem.dynamics.history import Ending, History, first_mechanisms, partial_history
from archfem.dynamics.motion_scaling import (
    COLLAPSE_DEFINITION,
    ScaledRun,
    largest_allowed_scale,
    search_scales,
)
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import assessed_joints, with_failure_flags
from archfem.limit.mechanism_count import Mechanism
from archfem.motion import signal_processing
from archfem.motion.motion import Motion
from archfem.motion.response_spectra import response_spectrum
from archfem.studies.cache import dead_load_of, first_mode, ground_motion
from archfem.studies.evaluators import Evaluator, Findings, of_history, run_motion
from archfem.studies.fragility import Fragility, fragility
from archfem.studies.parameter_space import PAIR_KEY, Axis, Point
from archfem.studies.study import Study

# By name what each is, its unit, and the power of a scale on the motion with which it grows
MEASURES: Mapping[str, tuple[str, str, int]] = {
    "pga": ("peak ground acceleration", "m/s²", 1),
    "pgv": ("peak ground velocity", "m/s", 1),
    "sa": ("spectral acceleration at the first mode, 5 %", "m/s²", 1),
    "arias": ("Arias intensity", "m/s", 2),
}


def intensities(motion: Motion, period: float) -> dict[str, float]:
    """Return the measures of the horizontal component of a motion."""
    samples = motion.component("horizontal")
    return {
        "pga": float(np.abs(samples).max()),
        "pgv": float(np.abs(motion.velocity("horizontal")).max()),
        "sa": float(response_spectrum(motion, np.array([period]))[0]),
        "arias": float(signal_processing.integrate_arias(samples, motion.dt)[-1]),
    }


def scaled_intensity(measure: str, whole: Array, scale: Array) -> Array:
    """Return a measure of motions that are multiplied by scales."""
    power = MEASURES[measure][2]
    return whole * scale**power


# Limit states: a joint of a ring or pier hinges; four of them fail at once; the failed joints
# permit a motion of the blocks; blocks fall, where displacements are large
LIMITS = ("first hinge", "four failures", "verified", COLLAPSE_DEFINITION)

# What is kept of each run for the curves
DEMANDS = ("eccentricity", "rotation", "slip", "largest_displacement", "residual_displacement")

PRECISION, BETWEEN = 0.05, (0.05, 10.0)

# Most runs that fill gaps between others, and the ratio of two scales that are near enough
FILL, NARROW = 4, 1.2


def search_limit_states(
    case: Case,
    limits: Sequence[str] | None = None,
    precision: float = PRECISION,
    between: Sequence[float] = BETWEEN,
) -> Findings:
    """Return at which scales of its motion a case meets limit states, and what each run came to."""
    rest, motion = dead_load_of(case), ground_motion(case)
    asked = _asked(rest, limits)
    made: dict[float, Findings] = {}

    def shaken(scale: float) -> ScaledRun:
        run, met, made[scale] = _run(rest, motion.scaled(scale))
        return ScaledRun(scale, met, run.ending, run.outcome, run.fall)

    least, largest = between
    reach = (least, max(least, min(largest, largest_allowed_scale(motion))))
    found = search_scales(shaken, asked, precision, reach)
    if found.interrupted:
        raise KeyboardInterrupt
    for _ in range(FILL):
        if (scale := _gap(sorted(made))) is not None:
            found = found.with_run(shaken(scale))
    period = 1.0 / float(first_mode(rest).frequencies[0])
    told: Findings = {"period": period, **intensities(motion, period)}
    for limit in asked:
        bracket = found[limit]
        told |= {limit: bracket.upper, f"{limit}, survives": bracket.lower}
        told[f"{limit}, survives above"] = len(bracket.above)
    told["scale"] = scales = sorted(made)
    return told | {name: [made[scale][name] for scale in scales] for name in DEMANDS}


def _gap(scales: Sequence[float]) -> float | None:
    """The scale in the middle of the widest gap between runs; None where all are narrow."""
    low, high = max(pairwise(scales), key=lambda pair: pair[1] / pair[0], default=(1.0, 1.0))
    return sqrt(low * high) if high > NARROW * low else None


def _run(
    rest: DeadLoadResult, motion: Motion
) -> tuple[History, dict[str, Mechanism | None], dict[str, Any]]:
    """A whole run, which limit states it has met, and demands, infinite where it broke off."""
    try:
        run = run_motion(rest, motion)
    except DidNotConverge as error:
        run = partial_history(error)
        return run, _met(run, first_mechanisms(run)), dict.fromkeys(DEMANDS, inf)
    mechanisms = first_mechanisms(run)
    found = of_history(run, mechanisms)
    if run.ending is Ending.PARTED:
        found |= dict.fromkeys(DEMANDS, inf)
    return run, _met(run, mechanisms), {name: found[name] for name in DEMANDS}


def _met(run: History, mechanisms: Mapping[str, Mechanism | None]) -> dict[str, Mechanism | None]:
    """Which limit states a run has met; words for a first hinge are those of a mechanism."""
    hinges = assessed_joints(with_failure_flags(run.joints))["hinge"] != 0
    first = Mechanism("local", "", (), None) if bool(hinges.any()) else None
    return {
        "first hinge": first,
        "four failures": mechanisms["any four joints"],
        "verified": mechanisms["verified"],
    }


def _asked(rest: DeadLoadResult, limits: Sequence[str] | None) -> tuple[str, ...]:
    """Limit states that can be looked for."""
    large = rest.case.discretisation.displacements == "large"
    counts = applicable_definitions(rest.case.structure, rest.case.criteria)
    possible = {"first hinge", "verified"}
    possible |= {"four failures"} if "any four joints" in counts else set()
    possible |= {COLLAPSE_DEFINITION} if large else set()
    asked = tuple(limit for limit in LIMITS if limit in (limits or possible))
    if strange := [limit for limit in asked if limit not in possible]:
        raise InvalidInput(
            f"limit state {strange[0]!r} cannot be met: collapse needs model.displacements = "
            "'large', four failures as many joints in rings and piers"
        )
    return asked


# Fractiles that are usual: the median, and one standard deviation to either side
SHARES = (0.16, 0.50, 0.84)


@dataclass(frozen=True, eq=False)
class Ida:
    """What incremental dynamic analysis found.

    Attributes:
        table: over `motion`: the measures of each as it is, `period` of the first mode [s], by
            limit state the least scale found to fail, ", survives" the largest below that did not,
            and ", survives above" how many beyond survived all the same; over motion and `entry`
            the runs: `scale`, and what each came to.
    """

    table: xr.Dataset

    @property
    def limits(self) -> tuple[str, ...]:
        """Limit states that were looked for."""
        return tuple(limit for limit in LIMITS if limit in self.table)

    def capacities(self, limit: str, measure: str = "pga") -> tuple[Array, Array]:
        """Return between which intensities each motion meets a limit state.

        Args:
            limit: one of `limits`.
            measure: "pga" [m/s²], "pgv" [m/s], "sa" [m/s²] or "arias" [m/s].

        Returns:
            Largest that survives below the least that fails, and that, infinite where none was
            found (motions,); without motions whose search failed.

        Raises:
            InvalidInput: limit state or measure are not known.
        """
        check_choice(limit, self.limits, "limit")
        check_choice(measure, MEASURES, "measure")
        whole = self.table[measure].values
        ends = (
            scaled_intensity(measure, whole, self.table[name].values)
            for name in (f"{limit}, survives", limit)
        )
        low, high = (each[np.isfinite(whole)] for each in ends)
        return low, high

    def fragility(self, limit: str, measure: str = "pga", **options: Any) -> Fragility:
        """Return the fragility curve of a limit state, record-to-record.

        Args:
            limit: one of `limits`.
            measure: as for `capacities`.
            options: of `fragility`.

        Raises:
            InvalidInput: as for `capacities`, or the capacities tell no curve.
        """
        low, high = self.capacities(limit, measure)
        return fragility(high, low, **options)

    def curves(
        self, measure: str = "pga", demand: str = "rotation"
    ) -> Iterator[tuple[str, Array, Array]]:
        """Give the curve of each motion, as it is: it need not rise.

        Args:
            measure: as for `capacities`.
            demand: "rotation" [rad], "eccentricity" [-], "slip", "largest_displacement" or
                "residual_displacement" [m].

        Yields:
            Name of the motion, intensities and demands (runs,) in order of the scale; a run that
            broke off has an infinite demand.

        Raises:
            InvalidInput: measure or demand are not known.
        """
        check_choice(measure, MEASURES, "measure")
        check_choice(demand, DEMANDS, "demand")
        for k, name in enumerate(self.table["motion"].values):
            scale = self.table["scale"].values[k]
            made = np.isfinite(scale)
            whole = self.table[measure].values[k]
            intensity = scaled_intensity(measure, whole, scale[made])
            yield str(name), intensity, self.table[demand].values[k][made]

    def fractiles(self, intensity: Array, measure: str = "pga", demand: str = "rotation") -> Array:
        """Return the 16, 50 and 84 % fractiles of the demand at intensities.

        Args:
            intensity: values above 0 (n,).
            measure: as for `curves`.
            demand: likewise.

        Returns:
            Demands (3, n), between runs on straight lines; infinite beyond runs that broke off,
            NaN where fewer than half of the motions were taken so far.
        """
        found = np.array(
            [
                np.interp(
                    intensity, [0.0, *x], [0.0, *y], right=y[-1] if np.isinf(y[-1]) else np.nan
                )
                for _, x, y in self.curves(measure, demand)
                if len(x)
            ]
        )
        known = ~np.isnan(found)
        fractiles = np.full((len(SHARES), found.shape[1]), np.nan)
        for k in np.flatnonzero(2 * known.sum(axis=0) >= len(found)):
            fractiles[:, k] = np.quantile(found[known[:, k], k], SHARES, method="nearest")
        return fractiles

    def not_monotonic(self, limit: str) -> list[str]:
        """Return the motions that survive a scale beyond one at which they fail.

        Args:
            limit: one of `limits`.
        """
        beyond = self.table[f"{limit}, survives above"].values
        return [str(name) for name in self.table["motion"].values[beyond > 0.0]]


def ida(
    case: Case,
    motions: Sequence[Any] | Mapping[str, Any] | None = None,
    *,
    limits: Sequence[str] | None = None,
    precision: float = PRECISION,
    between: tuple[float, float] = BETWEEN,
    folder: str | Path | None = None,
    workers: int | None = None,
    client: Any = None,
) -> Ida:
    """Scale each motion up until each limit state is met, and narrow down where.

    Scales are hunted for from 1 by factors of √2, then brackets are halved, and the widest gaps
    between runs are filled. Every run goes over the whole motion. A run without equilibrium counts
    as failed.

    Args:
        case: of the structure; with `model.displacements = "large"` collapse is a limit state too.
        motions: each a `Motion`, a record's file that the case's folder leads to, or a table as
            under [motion], by name or in a row; by default the pairs of the case's suite, as scaled
            and reduced.
        limits: of `LIMITS`; by default all that the structure has joints for.
        precision: relative width of the last brackets [-].
        between: least and largest scale tried [-]; no ground motion may exceed 5 g.
        folder: as for `Study.run`, and `workers` and `client`: where one ended, it goes on.
        workers: likewise.
        client: likewise.

    Returns:
        Capacities, curves and fragility by any measure.

    Raises:
        InvalidInput: there are no motions, or a limit state is not known.
        StudyStopped: as for `Study.run`.

    References:
        Vamvatsikos and Cornell, Earthq. Eng. Struct. Dyn. 31 (2002) 491-514, and Earthq. Spectra 20
        (2004) 523-553 for hunt and fill.
    """
    for limit in limits or ():
        check_choice(limit, LIMITS, "limits")
    options = {
        "limits": None if limits is None else list(limits),
        "precision": precision,
        "between": [float(each) for each in between],
    }
    names, points = _points(case, motions)
    axis = Axis("motion", ("motion",), tuple((name,) for name in names))
    study = Study(f"{case.title}: IDA", Evaluator(search_limit_states, options), (axis,), points)
    return Ida(study.run(folder, workers=workers, client=client))


def _points(
    case: Case, motions: Sequence[Any] | Mapping[str, Any] | None
) -> tuple[list[str], tuple[Point, ...]]:
    """Names of motions, and the case under each."""
    if motions is None:
        names = list((case.suite or {}).get("pairs", ()))
        if not names:
            raise InvalidInput("no motions were given, and the case has no [suite] of them")
        changes: list[tuple[tuple[str, Any], ...]] = [((PAIR_KEY, name),) for name in names]
        return names, tuple(Point(case.settings, case.folder, each) for each in changes)
    named = motions if isinstance(motions, Mapping) else _named(motions)
    if not named or len(named) < len(motions):
        raise InvalidInput(f"{len(motions)} motions under {len(named)} names: give each its own")
    base = {key: value for key, value in case.settings.items() if key not in ("suite", "motion")}
    points = tuple(Point(base, case.folder, (("motion", _table(each)),)) for each in named.values())
    return list(named), points


def _named(motions: Sequence[Any]) -> dict[str, Any]:
    """Motions by what each is called."""
    return {_name(each, place): each for place, each in enumerate(motions, start=1)}


def _table(motion: Any) -> dict[str, Any]:
    """A motion as under [motion]."""
    if isinstance(motion, str | Path):
        return {"file": str(motion)}
    if isinstance(motion, Mapping):
        return dict(motion)
    if isinstance(motion, Motion):
        upright = motion.vertical
        vertical = {} if upright is None else {"vertical": _samples(upright, motion.dt)}
        return _samples(motion.horizontal, motion.dt) | vertical
    raise InvalidInput(
        f"a motion is a {type(motion).__name__}: give a Motion, a record's file, or a table as "
        "under [motion]"
    )


def _samples(accelerations: Array, dt: float) -> dict[str, Any]:
    """One component as a table of its samples."""
    return {"samples": accelerations.tolist(), "dt": float(dt)}


def _name(motion: Any, place: int) -> str:
    """What to call a motion that was given without a name."""
    if isinstance(motion, Motion):
        return motion.name or f"motion {place}"
    table = _table(motion)
    if "file" in table:
        return Path(table["file"]).stem
    seed = table.get("synthetic", {}).get("seed")
    return f"motion {place}" if seed is None else f"seed {seed}"
