"""What can be found of a case, by name: each a function from a case to a flat table."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.cases.run import Rest, shaken
from archfem.cases.told import told_of
from archfem.dynamics.history import Ending, History
from archfem.dynamics.scales import mechanism_scales
from archfem.dynamics.verdicts import DEFINITIONS, first_mechanisms
from archfem.errors import InvalidInput
from archfem.joints.criteria import judged
from archfem.limit.counted import Mechanism
from archfem.motion.motion import Motion
from archfem.studies.memory import first_mode, ground_motion, resting, stepper_of

Found = dict[str, Any]


def at_rest(case: Case) -> Found:
    """Return what there is to say of a case before the ground moves.

    Args:
        case: what is asked.

    Returns:
        The largest |e| of a ring or pier under dead load, `eccentricity` [-], its largest V / N,
        `friction` [-], the least N [N], and of the first mode `frequency` [Hz] and `mass`, the
        share of the mass along x [-].

    Raises:
        DidNotConverge: the structure does not stand.
    """
    rest = resting(case)
    dead = rest.dead
    joints, first = judged(dead.joints), first_mode(rest)
    return {
        "eccentricity": float(abs(joints["eccentricity"]).fillna(0.5).max()),
        "friction": float(joints["friction"].max()),
        "N": float(joints["N"].min()),
        "frequency": float(first.frequencies[0]),
        "mass": float(first.mass_ratios[0, 0]),
    }


def history(case: Case) -> Found:
    """Return what a run of a case came to.

    Args:
        case: with one motion, or a suite of one pair.

    Returns:
        As `of_history`.

    Raises:
        InvalidInput: it has no motion, or several.
        DidNotConverge: the structure does not stand, or a step of the run failed.
        KeyboardInterrupt: on Ctrl-C, which leaves nothing of the point.
    """
    rest, motion = resting(case), ground_motion(case)
    return of_history(run_of(rest, motion))


def run_of(rest: Rest, motion: Motion) -> History:
    """Return a whole time history of a case, stepped in the same way each time.

    Args:
        rest: the case under its dead load.
        motion: of the ground.

    Raises:
        DidNotConverge: a step failed.
        KeyboardInterrupt: on Ctrl-C.
    """
    stepper = stepper_of(rest, motion)
    run = shaken(rest.case, motion, rest.dead, rest.damping[0], method=stepper)
    if run.ended is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return run


def of_history(run: History, mechanisms: Mapping[str, Mechanism | None] | None = None) -> Found:
    """Return the findings of a run.

    Args:
        run: what happened.
        mechanisms: its first ones, as by `first_mechanisms`, which finds them if they are not told.

    Returns:
        The largest of rings and piers: `eccentricity`, |e| [-], 0.5 where a joint is open;
        `friction`, |V| / N [-]; `rotation` [rad], `opening` [m] and `slip` [m] of a joint; the
        largest and the residual `displacement` [m] of a block; by each definition of a mechanism
        the time of the first [s], infinite where there is none, and its class; how the run
        `ended`; what is left, `fall`, where displacements may be large; the largest drift of its
        energy at any step, of what was exchanged, `energy_drift` [-], and how many `doubts` it has.
    """
    found: Found = {
        "eccentricity": _largest(run, "eccentricity", 0.5),
        "friction": _largest(run, "friction", np.inf),
        **{name: _largest(run, name) for name in ("rotation", "opening", "slip")},
    }
    for name in ("largest_displacement", "residual_displacement"):
        found[name] = float(run.dataset[name].max())
    for definition, met in (mechanisms or first_mechanisms(run)).items():
        found[definition] = np.inf if met is None or met.time is None else met.time
        found[f"{definition}, class"] = "" if met is None else str(met.kind)
    found |= {"ended": str(run.ended), "fall": "" if run.fall is None else run.fall.kind}
    drift = float(run.dataset.attrs["energy_drift"])
    return found | {"energy_drift": drift, "doubts": float(len(run.doubts))}


def _largest(run: History, name: str, undefined: float = -np.inf) -> float:
    """Largest size of something of the joints of rings and piers; what stands for it where NaN."""
    sizes = np.abs(run.dataset[name].values[..., run.dataset["judged"].values])
    return float(np.where(np.isnan(sizes), undefined, sizes).max())


def scales(
    case: Case, precision: float = 0.05, between: tuple[float, float] = (0.05, 5.0)
) -> Found:
    """Return by what factor on the motion of a case each definition of a mechanism is first met.

    Args:
        case: with one motion, or a suite of one pair.
        precision: relative width of the last brackets [-].
        between: least and largest factor tried [-].

    Returns:
        By definition the least factor found to fail, infinite where none is, and with ", survives"
        behind its name the largest below that was found not to [-].

    Raises:
        InvalidInput: it has no motion, or several, or precision and factors cannot be meant.
        DidNotConverge: the structure does not stand.
        KeyboardInterrupt: on Ctrl-C, which leaves nothing of the point.
    """
    rest, motion = resting(case), ground_motion(case)
    return of_scales(rest, motion, precision=precision, between=between)


def of_scales(rest: Rest, motion: Motion, **options: Any) -> Found:
    """Return the factors on a motion at which mechanisms begin, as `scales` does.

    Args:
        rest: the case under its dead load.
        motion: of the ground.
        options: of `mechanism_scales`.

    Raises:
        KeyboardInterrupt: on Ctrl-C.
    """
    options["between"] = tuple(options.get("between", (0.05, 5.0)))
    with told_of(rest.case.title, motion.name):
        found = mechanism_scales(
            rest.dead.model,
            motion,
            start=rest.dead,
            damping=rest.damping[0],
            dt=rest.case.analysis.get("dt"),
            criteria=rest.case.criteria,
            method=partial(stepper_of, rest),
            **options,
        )
    if found.interrupted:
        raise KeyboardInterrupt
    brackets = {definition: found[definition] for definition in DEFINITIONS}
    return {name: each.upper for name, each in brackets.items()} | {
        f"{name}, survives": each.lower for name, each in brackets.items()
    }


def limit(case: Case) -> Found:
    """Return what limit analysis finds of a case.

    Args:
        case: with a table [limit].

    Returns:
        The collapse `factor` [-], the `outcome`, and how many joints hinge and slide.

    Raises:
        InvalidInput: it has no such table.
    """
    if case.limit is None:
        raise InvalidInput("the case has no [limit]: give horizontal = 1.0, or a point load")
    found = case.limit.of(case.structure)
    return {
        "factor": float(found.factor),
        "outcome": str(found.outcome.name).lower(),
        "hinges": len(found.hinges),
        "slides": len(found.sliding),
    }


FINDERS: Mapping[str, Callable[..., Found]] = {
    "history": history,
    "scales": scales,
    "dead load": at_rest,
    "limit": limit,
}
"""What a study may ask for by name."""
