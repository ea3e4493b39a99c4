"""Building of models, and selection of the cheapest model and time step within a tolerance.

The selection predicts errors from runs over the strongest window of the motion
(`dynamics.error_estimation`): candidate models against a finer reference model, and time steps
against steps half as long. Only the source of the error is refined.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from archfem._validation import check_number, check_type
from archfem.dynamics.error_estimation import (
    ErrorEstimator,
    StepSettings,
    default_damping,
    severe_motion,
    small_displacement_error,
    strongest_window,
)
from archfem.dynamics.schemes import Viscous
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature
from archfem.masonry.stiffness_ratio import find_soft_blocks
from archfem.masonry.structure import Structure
from archfem.models import builder as plain
from archfem.models.discretisation import Discretisation
from archfem.models.model import Doubt, Model, Prediction
from archfem.models.rigid import build_rigid_model
from archfem.motion.motion import Motion

logger = logging.getLogger("archfem")

# Damping of the run, or a function that returns it for the reference model
DampingChoice = Viscous | Callable[[Model], Viscous | None] | None

Builder = Callable[[Structure, Discretisation], Model]


class Level(NamedTuple):
    """Candidate models and their reference model, which is finer than all of them."""

    candidates: tuple[tuple[str, tuple[int, int]], ...]  # fidelities and meshes, cheapest first
    reference: tuple[str, tuple[int, int]]


# The second level is tried if all models of the first exceed the tolerance. On a ring with sliding
# joints, errors of faces 2×2, 4×4 and 8×8 are 0.014, 0.006 and 0.002, of condensed 4×4 and 8×8
# 0.005 and 0.001
MODEL_LEVELS = (
    Level(
        (("rigid", (1, 1)), ("faces", (2, 2)), ("faces", (4, 4)), ("condensed", (4, 4))),
        ("condensed", (8, 8)),
    ),
    Level((("faces", (8, 8)), ("condensed", (8, 8))), ("condensed", (12, 12))),
)

# Smallest tolerance on |e| for steps of varying length: about 0.5 ms where a ring is shaken [-]
MIN_STEP_TOLERANCE = 1e-4


def build(  # noqa: PLR0913  (keywords of a discretisation, and of the selection)
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
    damping: DampingChoice = None,
    dt: float | None = None,
    displacements: str = "small",
    file: str | Path | None = None,
) -> Model:
    """Build a model of a structure, of a given fidelity or of one selected by predicted error.

    Args:
        structure: structure of blocks and joints.
        fidelity: kinematics of the blocks:
            "rigid": rigid blocks, no mesh; all compliance is in the joints;
            "faces": each joint face moves as a plane, the rest statically condensed;
            "condensed": all nodes on joints, the rest statically condensed; "full": all nodes;
            "monolithic": all nodes, UFL forms assembled at each iteration.
            Or fidelities by block name or part, with "rest" for all others, for example
            {"backfill": "full", "rest": "faces"}.
            Or "auto": the cheapest fidelity, mesh and time step with a predicted error below the
            tolerance, stored as `prediction` of the model; mesh and quadrature are then selected
            too.
        cells: minimum number of cells through the thickness (facets on a joint) and along each
            block.
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners, such as backfill [m]; by default half of
            the block's mean thickness.
        degree: degree of the elements, 1 or 2.
        quadrature: rule on each joint facet, "exact", "lobatto", "trapezoidal", "nodal" (springs at
            mesh nodes) or "gauss"; by default "exact", or "lobatto" with a number of points or
            where there is no exact rule (degree 2, "monolithic").
        points: quadrature points on each facet, 3 by default, with "trapezoidal" 2; with
            "trapezoidal" and fidelity "rigid" those of each whole joint.
        tolerance: for "auto", tolerance on the largest |e| of every joint [-].
        motion: for "auto", ground motion of the analysis; without it the prediction is less
            reliable, from a synthetic motion that brings |e| to 0.4.
        damping: for "auto", damping of the analysis, or a function that returns it for a model; it
            is called once, for the first reference model.
        dt: for "auto", time step of the analysis [s]; without it steps vary in length, by a
            tolerance that is selected too. Their error counts either way.
        displacements: "small", or "large" for finite rotations, sliding and falls; not with
            fidelity "monolithic". With "auto" the selection uses small displacements, and is valid
            until blocks separate.
        file: mesh file, as for `read_mesh`, in place of `cells`, `cell` and `coarse`; not with
            "rigid" and "auto".

    Returns:
        The model.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be meshed with these cells.
    """
    check_type(structure, Structure, "structure", "give a Structure, e.g. circular_arch(…)")
    if not 0.0 < check_number(tolerance, "tolerance on |e| [-]") < 1.0:
        raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
    if isinstance(fidelity, str) and fidelity == "auto":
        if file is not None:
            raise InvalidInput(
                f"file = {str(file)!r} is one mesh, and 'auto' chooses: name a fidelity"
            )
        return select_model(structure, tolerance, motion, damping, dt, displacements=displacements)
    settings = Discretisation(
        fidelity, cells, cell, coarse, degree, quadrature, points, displacements, file
    )
    return plain.build(structure, settings)


def candidate_discretisations(structure: Structure, level: Level) -> Iterator[Discretisation]:
    """Yield the candidates of a level, the cheapest first; soil excludes the rigid one."""
    soil = bool(find_soft_blocks(structure))
    for fidelity, cells in level.candidates:
        if not (soil and fidelity == "rigid"):
            yield exact_discretisation(structure, fidelity, cells)


def reference_discretisation(structure: Structure, level: Level) -> Discretisation:
    """Return the reference model of a level."""
    return exact_discretisation(structure, *level.reference)


def exact_discretisation(
    structure: Structure, fidelity: str, cells: tuple[int, int]
) -> Discretisation:
    """Return a discretisation with exact quadrature and a fidelity for stones."""
    return Discretisation(stone_fidelity(structure, fidelity), cells, quadrature="exact")


def stone_fidelity(structure: Structure, fidelity: str) -> str | dict[str, str]:
    """Return a fidelity for all blocks but soft ones, which are modelled with all nodes."""
    soft = [structure.blocks[number].name for number in find_soft_blocks(structure)]
    return {**dict.fromkeys(soft, "full"), "rest": fidelity} if soft else fidelity


def discretisation_label(settings: Discretisation) -> str:
    """Return fidelity, mesh and quadrature as short text."""
    fidelity = settings.fidelity
    name = fidelity if isinstance(fidelity, str) else fidelity["rest"] + " + soil"
    rule = settings.rule.rule + (f" {settings.points}" if settings.points else "")
    return f"{name} {settings.through}×{settings.along} {rule}"


def select_model(
    structure: Structure,
    tolerance: float,
    motion: Motion | None = None,
    damping: DampingChoice = None,
    dt: float | None = None,
    *,
    displacements: str = "small",
    builder: Builder = plain.build,
) -> Model:
    """Return the cheapest model and time step with a predicted error within a tolerance.

    Without any, the most accurate is returned with a warning.
    """
    Discretisation(displacements=displacements)  # refuses values other than small and large
    reference = builder(structure, reference_discretisation(structure, MODEL_LEVELS[0]))
    # usually eight runs: two of time steps, one or two of models, four of nearby motions
    with tqdm(total=8, unit="run", disable=None, leave=False, desc="choosing a model") as bar:
        estimator = _make_estimator(reference, motion, damping, partial(_count_run, bar))
        steps, step_error, tried = _select_steps(estimator, tolerance, dt)
        # time steps may use half of the tolerance, models the rest
        allowed, models = max(tolerance - step_error, tolerance / 2.0), []
        for settings, model, error in _candidate_models(structure, estimator, steps, builder):
            models.append((error, settings, model))
            tried.append((discretisation_label(settings), error + step_error))
            if error <= allowed:
                break
        # impacts are judged on the cheapest model that did not fail, or the first
        cheapest = next((model for error, _, model in models if error < np.inf), models[0][2])
        spread = estimator.chaotic_spread(cheapest, steps)
    model_error, settings, model = min(models, key=lambda each: (each[0] > allowed, each[0]))
    if displacements == "large":
        small, model = 0.0, builder(structure, replace(settings, displacements=displacements))
    else:
        small = small_displacement_error(estimator, steps)
    error, candidates = max(model_error, spread) + step_error, tuple(tried)
    prediction = Prediction(
        *(error, step_error, tolerance, steps.dt, steps.step_tolerance, candidates, small, spread)
    )
    model, doubts = model.with_prediction(prediction), _doubts(prediction, model_error, allowed)
    for doubt in doubts:
        logger.warning("%s", doubt)
    model.doubts = (*model.doubts, *doubts)
    return model


def _make_estimator(
    reference: Model, motion: Motion | None, damping: DampingChoice, callback: Callable[[], object]
) -> ErrorEstimator:
    """Return the error estimator; unknown motion and damping are assumed."""
    structure = reference.structure
    soil = bool(find_soft_blocks(structure))
    probe = reference if soil else build_rigid_model(structure, rule=Quadrature("exact"))
    return ErrorEstimator(
        reference,
        strongest_window(motion) if motion is not None else severe_motion(probe),
        resolve_damping(reference, damping) or default_damping(probe),
        callback,
    )


def resolve_damping(model: Model, damping: DampingChoice) -> Viscous | None:
    """Return damping, or that which a function returns for a model."""
    return damping(model) if callable(damping) else damping


def _count_run(bar: tqdm) -> None:
    """Update the progress bar, with at least one more run to come."""
    bar.total = max(bar.total, bar.n + 2)
    bar.update()


def _select_steps(
    estimator: ErrorEstimator, tolerance: float, dt: float | None
) -> tuple[StepSettings, float, list[tuple[str, float]]]:
    """Return the longest steps within half of the tolerance, their error, and all tried."""
    tried: list[tuple[float, StepSettings]] = []
    for steps in _candidate_steps(tolerance, dt):
        tried.append((estimator.time_step_error(steps), steps))
        if tried[-1][0] <= tolerance / 2.0:
            break
    error, steps = min(tried, key=lambda each: each[0])
    return steps, error, [(f"{each.label}, in time alone", error) for error, each in tried]


def _candidate_steps(tolerance: float, dt: float | None) -> Iterator[StepSettings]:
    """Yield a prescribed time step, or steps of varying length, each about half as long."""
    if dt is not None:
        yield StepSettings(dt, None)
        return
    step_tolerance = max(tolerance / 2.0, MIN_STEP_TOLERANCE)
    while step_tolerance >= MIN_STEP_TOLERANCE:
        yield StepSettings(None, step_tolerance)
        step_tolerance /= 4.0


def _candidate_models(
    structure: Structure, estimator: ErrorEstimator, steps: StepSettings, builder: Builder
) -> Iterator[tuple[Discretisation, Model, float]]:
    """Yield models, the cheapest first, with their errors relative to the reference of a level."""
    first = reference_discretisation(structure, MODEL_LEVELS[0])
    first_model = estimator.model
    for level in MODEL_LEVELS:
        if level is not MODEL_LEVELS[0]:
            reference = builder(structure, reference_discretisation(structure, level))
            estimator = estimator.with_reference(reference)
        for settings in candidate_discretisations(structure, level):
            # the reference of the first level is a candidate of the second
            model = first_model if settings == first else builder(structure, settings)
            yield settings, model, estimator.model_error(model, steps)


def _doubts(prediction: Prediction, model_error: float, allowed: float) -> list[Doubt]:
    """Return doubts about a selection."""
    doubts = []
    if not prediction.is_met:
        doubts.append(_doubt_unmet_tolerance(prediction, model_error, allowed))
    error, tolerance = prediction.small_displacement_error, prediction.tolerance
    if error > tolerance:
        effect = f"errs by {error:.2g} in |e|" if error < 1.0 else "lets stand what falls"
        doubts.append(
            Doubt(
                f"to take displacements as small {effect}, and the tolerance is {tolerance:g}: "
                "joints turn and slide too far",
                "build(…, displacements='large') follows them",
            )
        )
    return doubts


def _doubt_unmet_tolerance(prediction: Prediction, model_error: float, allowed: float) -> Doubt:
    """Return why a tolerance is not met, and the remedy."""
    if prediction.chaotic_spread > max(model_error, allowed):
        remedy = (
            "impacts decide: by motions 1 and 2 % weaker and stronger so much of the largest |e| "
            "is chance, which no finer model lessens; shake by several motions, and judge by all"
        )
    elif model_error > allowed:
        remedy = "no finer mesh is tried: prescribe one by fidelity and cells, and compare"
    elif prediction.dt:
        remedy = "the time step errs: leave dt out, and steps choose their length"
    else:
        remedy = "no shorter steps are tried: results of impacts depend on more than the steps"
    return Doubt(f"no setting meets the tolerance; the best is {prediction.text}", remedy)
