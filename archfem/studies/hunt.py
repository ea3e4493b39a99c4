"""Hunt and fill: scales of one motion at which a case meets limit states, and what runs came to.

References:
    Vamvatsikos and Cornell, Earthq. Spectra 20 (2004) 523-553.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf, sqrt
from typing import Any

from archfem.cases.case import Case
from archfem.cases.run import Rest
from archfem.dynamics.events import possible_counts
from archfem.dynamics.history import Ending, History, history_of
from archfem.dynamics.scales import COLLAPSE, ScaledRun, largest_scale, search
from archfem.dynamics.verdicts import first_mechanisms
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import flagged, judged
from archfem.limit.counted import Mechanism
from archfem.motion.motion import Motion
from archfem.studies.finders import Found, of_history, run_of
from archfem.studies.intensity import intensities
from archfem.studies.memory import first_mode, ground_motion, resting

LIMITS = ("first hinge", "four failures", "verified", COLLAPSE)
"""Limit states: a joint of a ring or pier hinges; four of them fail at once; the failed joints
permit a motion of the blocks; blocks fall, where displacements are large."""

DEMANDS = ("eccentricity", "rotation", "slip", "largest_displacement", "residual_displacement")
"""What is kept of each run for the curves."""

PRECISION, BETWEEN = 0.05, (0.05, 10.0)

FILL, NARROW = 4, 1.2
"""Most runs that fill gaps between others, and the ratio of two scales that are near enough."""


def searched(
    case: Case,
    limits: Sequence[str] | None = None,
    precision: float = PRECISION,
    between: Sequence[float] = BETWEEN,
) -> Found:
    """Return at which scales of its motion a case meets limit states, and what each run came to.

    Args:
        case: with one motion, or a suite of one pair.
        limits: of `LIMITS`; None for all that there are.
        precision: relative width of the last brackets [-].
        between: least and largest scale tried [-].

    Raises:
        InvalidInput: collapse is asked for of displacements that are small.
        DidNotConverge: the structure does not stand.
        KeyboardInterrupt: on Ctrl-C.
    """
    rest, motion = resting(case), ground_motion(case)
    asked = _asked(rest, limits)
    made: dict[float, Found] = {}

    def shaken(scale: float) -> ScaledRun:
        run, met, made[scale] = _run(rest, motion.scaled(scale))
        return ScaledRun(scale, met, run.ended, run.outcome, run.fall)

    least, largest = between
    reach = (least, max(least, min(largest, largest_scale(motion))))
    found = search(shaken, asked, precision, reach)
    if found.interrupted:
        raise KeyboardInterrupt
    for _ in range(FILL):
        if (scale := _gap(sorted(made))) is not None:
            found = found.with_run(shaken(scale))
    period = 1.0 / float(first_mode(rest).frequencies[0])
    told: Found = {"period": period, **intensities(motion, period)}
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


def _run(rest: Rest, motion: Motion) -> tuple[History, dict[str, Mechanism | None], dict[str, Any]]:
    """A whole run, which limit states it has met, and demands, infinite where it broke off."""
    try:
        run = run_of(rest, motion)
    except DidNotConverge as error:
        run = history_of(error)
        return run, _met(run, first_mechanisms(run)), dict.fromkeys(DEMANDS, inf)
    mechanisms = first_mechanisms(run)
    found = of_history(run, mechanisms)
    if run.ended is Ending.PARTED:
        found |= dict.fromkeys(DEMANDS, inf)
    return run, _met(run, mechanisms), {name: found[name] for name in DEMANDS}


def _met(run: History, mechanisms: Mapping[str, Mechanism | None]) -> dict[str, Mechanism | None]:
    """Which limit states a run has met; words for a first hinge are those of a mechanism."""
    hinges = judged(flagged(run.joints))["hinge"] != 0
    first = Mechanism("local", "", (), None) if bool(hinges.any()) else None
    return {
        "first hinge": first,
        "four failures": mechanisms["any four joints"],
        "verified": mechanisms["verified"],
    }


def _asked(rest: Rest, limits: Sequence[str] | None) -> tuple[str, ...]:
    """Limit states that can be looked for."""
    large = rest.case.discretisation.displacements == "large"
    counts = possible_counts(rest.case.structure, rest.case.criteria)
    possible = {"first hinge", "verified"}
    possible |= {"four failures"} if "any four joints" in counts else set()
    possible |= {COLLAPSE} if large else set()
    asked = tuple(limit for limit in LIMITS if limit in (limits or possible))
    if strange := [limit for limit in asked if limit not in possible]:
        raise InvalidInput(
            f"limit state {strange[0]!r} cannot be met: collapse needs model.displacements = "
            "'large', four failures as many joints in rings and piers"
        )
    return asked
