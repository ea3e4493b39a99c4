"""Which rung, mesh and steps a scene needs: the cheapest whose error stays below a tolerance.

The error is predicted, not assumed: candidates are run on the strongest part of the motion and
compared with a finer model on the same part, and steps with steps half as long. Only what errs is
refined.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from archfem.arguments import instance, real
from archfem.dynamics.candidates import LEVELS, best, candidates, label
from archfem.dynamics.probe import severe_motion, strongest, usual_damping
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.smallness import error_of_small
from archfem.dynamics.yardstick import Steps, Yardstick
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature
from archfem.masonry.softness import soft_blocks
from archfem.masonry.structure import Structure
from archfem.models import build as plain
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model, Prediction
from archfem.models.rigid import rigid
from archfem.motion.motion import Motion

Damping = Viscous | Callable[[Model], Viscous | None] | None
"""Of a run to come: known, or to be found of the finest model."""

Builder = Callable[[Structure, Discretisation], Model]

logger = logging.getLogger("archfem")

RUNS = 8
"""That a choice takes as a rule: two of steps, one or two of models, four of motions near by."""

FINEST = 1e-4
"""Smallest tolerance of |e| by which steps are tried: 0.5 ms or so where a ring is shaken [-]."""


def build(  # noqa: PLR0913  (a discretisation by keywords, and what the choice needs)
    structure: Structure,
    *,
    fidelity: str | Mapping[str, str] = "full",
    cells: tuple[int, int] = (4, 4),
    cell: str = "quadrilateral",
    coarse: float | None = None,
    degree: int = 1,
    quadrature: str | None = None,
    points: int | None = None,
    tolerance: float = 0.005,
    motion: Motion | None = None,
    damping: Damping = None,
    dt: float | None = None,
    displacements: str = "small",
    file: str | Path | None = None,
) -> Model:
    """Return a model of a structure, on a rung that is named or chosen.

    Args:
        structure: what stands.
        fidelity: a rung of the ladder:
            "rigid": rigid blocks, no mesh; all compliance is in the joints;
            "faces": each joint face moves as a plane, the rest statically condensed;
            "condensed": all nodes on joints, the rest statically condensed; "full": all nodes;
            "monolithic": all nodes, UFL forms assembled at each iteration.
            Or rungs by block name or part, with "rest" for all others, for example
            {"backfill": "full", "rest": "faces"}.
            Or "auto": the cheapest rung, mesh and steps whose predicted error stays below the
            tolerance. What was predicted is the model's `prediction`; what says how blocks and
            joints are cut is then chosen too.
        cells: through the thickness (facets on a joint) and along each block, at least.
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners, such as backfill [m]; where it is not
            given, half of the block's mean thickness.
        degree: of the elements, 1 or 2.
        quadrature: rule on each joint facet, "exact", "lobatto", "nodal" or "gauss"; where it is
            not given the exact one, or Lobatto's where points are given or there is no exact one
            (degree 2, "monolithic").
        points: on each facet, 3 where not given.
        tolerance: for "auto", of the largest |e| of every joint [-].
        motion: for "auto", the ground motion to come; without it a synthetic one is used that
            brings |e| to 0.4, and the prediction is the less certain.
        damping: for "auto", that of the run to come, or a function that finds it of a model: it
            is asked once, of the finest that candidates are first compared with.
        dt: for "auto", the time step of the run to come [s]. Without it steps choose their length,
            by a tolerance that is chosen too. Their error counts either way.
        displacements: "small", or "large" where blocks may turn and slide as far as they like,
            and fall; not on the rung "monolithic". With "auto" the choice is made by small
            displacements, and holds as long as blocks hold together.
        file: a mesh of one's own, as `read_mesh` takes it, in place of `cells`, `cell` and
            `coarse`; for "rigid" and "auto" there is none.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be cut as asked.
    """
    instance(structure, Structure, "structure", "give a Structure, e.g. circular_arch(…)")
    if not 0.0 < real(tolerance, "tolerance on |e| [-]") < 1.0:
        raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
    if isinstance(fidelity, str) and fidelity == "auto":
        if file is not None:
            raise InvalidInput(f"file = {str(file)!r} is one mesh, and 'auto' chooses: name a rung")
        return choose(structure, tolerance, motion, damping, dt, displacements=displacements)
    asked = Discretisation(
        fidelity, cells, cell, coarse, degree, quadrature, points, displacements, file
    )
    return plain.build(structure, asked)


def choose(
    structure: Structure,
    tolerance: float,
    motion: Motion | None = None,
    damping: Damping = None,
    dt: float | None = None,
    *,
    displacements: str = "small",
    builder: Builder = plain.build,
) -> Model:
    """Return the cheapest model, and its steps, whose predicted error is within a tolerance.

    Steps may have half of it, models what is left. Steps become finer while they err by more,
    models while they do. Where the tolerance is not met, the best is given, and a warning says so;
    so it does where displacements are too large to be taken as small.

    Args:
        structure: what stands.
        tolerance: of the largest |e| of every joint [-].
        motion: to come; without it a synthetic one is used that brings |e| to 0.4.
        damping: of the run to come, or a function that finds it of the finest model.
        dt: time step of the run to come [s]; without it steps choose their length.
        displacements: "small" or "large", of the model that is returned.
        builder: makes the models.

    Raises:
        InvalidInput: displacements are neither.
        DidNotConverge: the finest model failed.
    """
    Discretisation(displacements=displacements)  # refuses what is neither small nor large
    first = builder(structure, best(structure, LEVELS[0]))
    with tqdm(total=RUNS, unit="run", disable=None, leave=False, desc="choosing a model") as bar:
        yardstick = _yardstick(first, motion, damping, partial(_told, bar))
        steps, in_time, considered = _steps(yardstick, tolerance, dt)
        allowed, found = max(tolerance - in_time, tolerance / 2.0), []
        for asked, model, in_model in _climbed(structure, yardstick, steps, builder):
            found.append((in_model, asked, model))
            considered.append((label(asked), in_model + in_time))
            if in_model <= allowed:
                break
        by_chance = yardstick.by_chance(_cheapest(found), steps)
    in_model, asked, model = min(found, key=lambda each: (each[0] > allowed, each[0]))
    error = max(in_model, by_chance) + in_time
    if displacements == "large":
        small, model = 0.0, builder(structure, replace(asked, displacements=displacements))
    else:
        small = error_of_small(yardstick, steps)
    tried = tuple(considered)
    told = Prediction(error, in_time, tolerance, steps.dt, steps.pace, tried, small, by_chance)
    chosen, doubts = model.predicted(told), _doubts(told, in_model, allowed)
    for words in doubts:
        logger.warning("%s", words)
    chosen.doubts = (*model.doubts, *doubts)
    return chosen


def _told(bar: tqdm) -> None:
    """Count a run; where more are needed than was thought, another is to come."""
    bar.total = max(bar.total, bar.n + 2)
    bar.update()


def _steps(
    yardstick: Yardstick, tolerance: float, dt: float | None
) -> tuple[Steps, float, list[tuple[str, float]]]:
    """The longest steps that err by half of the tolerance, their error, and what was tried."""
    tried: list[tuple[float, Steps]] = []
    for steps in _shorter(tolerance, dt):
        tried.append((yardstick.in_time(steps), steps))
        if tried[-1][0] <= tolerance / 2.0:
            break
    error, steps = min(tried, key=lambda each: each[0])
    return steps, error, [(f"{each.label}, in time alone", found) for found, each in tried]


def _shorter(tolerance: float, dt: float | None) -> Iterator[Steps]:
    """Steps to try, each about half as long as those before; only those asked for, if any are."""
    if dt is not None:
        yield Steps(dt, None)
        return
    pace = max(tolerance / 2.0, FINEST)
    while pace >= FINEST:
        yield Steps(None, pace)
        pace /= 4.0


def _climbed(
    structure: Structure, yardstick: Yardstick, steps: Steps, builder: Builder
) -> Iterator[tuple[Discretisation, Model, float]]:
    """Models, the cheapest first, and what each errs by; those of a level against its best."""
    before = best(structure, LEVELS[0]), yardstick.model
    for level in LEVELS:
        if level is not LEVELS[0]:
            finer = builder(structure, best(structure, level))
            yardstick = yardstick.by(finer)
        for asked in candidates(structure, level):
            model = before[1] if asked == before[0] else builder(structure, asked)
            yield asked, model, yardstick.in_model(model, steps)


def _cheapest(found: list[tuple[float, Discretisation, Model]]) -> Model:
    """The first model that did not fail; the first of all where each did."""
    return next((model for error, _, model in found if error < np.inf), found[0][2])


def _doubts(told: Prediction, in_model: float, allowed: float) -> list[str]:
    """What is doubtful of a choice, a sentence each."""
    doubts = []
    if not told.met:
        doubts.append(_unmet(told, in_model, allowed))
    if told.of_small > told.tolerance:
        doubts.append(_far(told.of_small, told.tolerance))
    return doubts


def _unmet(told: Prediction, in_model: float, allowed: float) -> str:
    """Why a tolerance is not met, and what to do."""
    if told.of_chance > max(in_model, allowed):
        remedy = (
            "impacts decide: by motions 1 and 2 % weaker and stronger so much of the largest |e| "
            "is chance, which no finer model lessens; shake by several motions, and judge by all"
        )
    elif in_model > allowed:
        remedy = "no finer mesh is tried: ask for one by fidelity and cells, and compare"
    elif told.dt:
        remedy = "the time step errs: leave dt out, and steps choose their length"
    else:
        remedy = "no shorter steps are tried: what comes of impacts hangs on more than the steps"
    return f"no setting meets the tolerance; the best is {told.text}; {remedy}"


def _far(error: float, tolerance: float) -> str:
    """That displacements are not small, and what to do."""
    found = f"errs by {error:.2g} in |e|" if error < 1.0 else "lets stand what falls"
    return (
        f"to take displacements as small {found}, and {tolerance:g} was asked for: joints turn "
        "and slide too far; build(…, displacements='large') follows "
        "them"
    )


def _yardstick(
    finest: Model, motion: Motion | None, damping: Damping, told: Callable[[], object]
) -> Yardstick:
    """The finest model of the first level; what is not known of the run is assumed."""
    structure = finest.structure
    soil = bool(soft_blocks(structure))
    probe = finest if soil else rigid(structure, rule=Quadrature("exact"))
    return Yardstick(
        finest,
        strongest(motion) if motion is not None else severe_motion(probe),
        damping_for(finest, damping) or usual_damping(probe),
        told,
    )


def damping_for(model: Model, damping: Damping) -> Viscous | None:
    """Return the damping of a run, asked of a model where it is yet to be found.

    Args:
        model: the finest.
        damping: or a function that finds it of a model; None is undamped.
    """
    return damping(model) if callable(damping) else damping
