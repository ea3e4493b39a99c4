"""Building of models, and selection of a model and time step by predicted error.

The selection runs settings over the strongest part of the motion, each with half the time step of
the one before. It ends when the predicted error is within the tolerance
(`dynamics.error_estimation`). The first two settings share one model, and the second runs about the
peaks of the first alone. A selection therefore takes about as long as the run for which it selects.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tqdm import tqdm

from archfem._validation import check_between, check_type
from archfem.dynamics import error_estimation
from archfem.dynamics.damping import resolve_effective_damping
from archfem.dynamics.schemes import EffectiveDamping, Viscous
from archfem.errors import InvalidInput, logger
from archfem.joints.quadrature import Quadrature
from archfem.masonry.stiffness_ratio import find_soft_blocks
from archfem.masonry.structure import Structure
from archfem.models import builder as plain
from archfem.models.discretisation import Discretisation
from archfem.models.linear_blocks import build_rigid_model
from archfem.models.model import Doubt, Model, Prediction
from archfem.motion.motion import Motion

# Fidelity, cells and time step [s] of the settings tried. The first two share a mesh: the error of
# the step is the larger, and a second mesh costs as much to build as the window to run
TRIED_SETTINGS = (
    ("faces", (8, 8), 0.005),
    ("faces", (8, 8), 0.0025),
    ("condensed", (8, 8), 0.00125),
    ("condensed", (16, 16), 0.000625),
)


def build(  # noqa: PLR0913  (keywords of a discretisation, and of the selection)
    structure: Structure,
    *,
    fidelity: str | Mapping[str, str] = "full",
    cells: tuple[int, int] = (4, 4),
    cell: str = "quadrilateral",
    max_cell_size: float | None = None,
    degree: int = 1,
    quadrature: str | None = None,
    quadrature_points: int | None = None,
    tolerance: float = 0.005,
    motion: Motion | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | None = None,
    displacements: str = "small",
    mesh_file: str | Path | None = None,
) -> Model:
    """Build a model of a structure, of a given fidelity or of one selected by predicted error.

    Args:
        structure: structure of blocks and joints.
        fidelity: kinematics of the blocks:
            "rigid": rigid blocks, no mesh; all compliance is in the joints;
            "faces": each joint face moves as a plane, the rest statically condensed;
            "condensed": all nodes on joints, the rest statically condensed; "full": all nodes;
            "monolithic": all nodes, UFL forms of joints assembled at each iteration.
            Or fidelities by block name or part, with "rest" for all others, for example
            {"backfill": "full", "rest": "faces"}.
            Or "auto": fidelity, mesh and time step with a predicted error below the tolerance,
            stored as `prediction` of the model; selected by short runs, the cheapest first.
        cells: minimum number of cells through the thickness (facets on a joint) and along each
            block.
        cell: "quadrilateral" or "triangle".
        max_cell_size: largest size of cells inside blocks without corners, such as backfill [m]; by
            default twice the block's mean thickness over the number of cells along it.
        degree: degree of the elements, 1 or 2.
        quadrature: rule on each joint facet, "exact", "lobatto", "trapezoidal", "nodal" (springs at
            mesh nodes) or "gauss"; by default "exact", or "lobatto" with a number of points or
            where there is no exact rule (degree 2, "monolithic").
        quadrature_points: number on each facet, 3 by default, with "trapezoidal" 2; with
            "trapezoidal" and fidelity "rigid" those of each whole joint.
        tolerance: for "auto", tolerance on the largest |e| of every joint [-].
        motion: for "auto", ground motion of the analysis; without it the prediction is less
            reliable, from a synthetic motion that brings |e| to 0.4.
        damping: for "auto", damping of the analysis, as for `time_history`; effective modes are
            those of the first model tried.
        dt: for "auto", time step of the analysis [s]; without it a time step is selected too. Its
            error counts either way.
        displacements: "small", or "large" for finite rotations, sliding and falls; not with
            fidelity "monolithic". With "auto" the selection uses small displacements, and is valid
            until blocks separate.
        mesh_file: as for `read_mesh`, in place of `cells`, `cell` and `max_cell_size`; not with
            "rigid" and "auto".

    Returns:
        The model.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be meshed with these cells.
        DidNotConverge: for "auto", the structure does not stand under its own weight.
    """
    check_type(structure, Structure, "structure", "give a Structure, e.g. circular_arch(…)")
    check_between(tolerance, "tolerance on |e| [-]", 0.0, 1.0, remedy="try 0.005")
    if isinstance(fidelity, str) and fidelity == "auto":
        if mesh_file is not None:
            raise InvalidInput(
                f"mesh_file = {str(mesh_file)!r} is one mesh, and 'auto' chooses: name a fidelity"
            )
        return select_model(structure, tolerance, motion, damping, dt, displacements=displacements)
    unused = {"motion": motion, "damping": damping, "dt": dt}
    if given := [name for name, value in unused.items() if value is not None]:
        raise InvalidInput(
            f"{given} select a model with fidelity 'auto' alone: give them to an Analysis"
        )
    settings = Discretisation(
        *(fidelity, cells, cell, max_cell_size, degree, quadrature, quadrature_points),
        *(displacements, mesh_file),
    )
    return plain.build(structure, settings)


def exact_discretisation(
    structure: Structure, fidelity: str, cells: tuple[int, int]
) -> Discretisation:
    """Return a discretisation with exact quadrature and a fidelity for all blocks but soft ones."""
    return Discretisation(stone_fidelity(structure, fidelity), cells, quadrature="exact")


def stone_fidelity(structure: Structure, fidelity: str) -> str | dict[str, str]:
    """Return a fidelity for all blocks but soft ones, which are modelled with all nodes."""
    soft = [structure.blocks[number].name for number in find_soft_blocks(structure)]
    return {**dict.fromkeys(soft, "full"), "rest": fidelity} if soft else fidelity


def discretisation_label(settings: Discretisation) -> str:
    """Return fidelity, mesh and quadrature as short text."""
    fidelity = settings.fidelity
    name = fidelity if isinstance(fidelity, str) else fidelity["rest"] + " + soil"
    points = f" {settings.quadrature_points}" if settings.quadrature_points else ""
    return f"{name} {settings.through}×{settings.along} {settings.rule.rule}{points}"


@dataclass(frozen=True)
class Setting:
    """A discretisation and a time step."""

    discretisation: Discretisation
    dt: float  # time step [s]

    @property
    def label(self) -> str:
        """Discretisation and time step as short text."""
        return f"{discretisation_label(self.discretisation)} {1e3 * self.dt:g} ms"


def select_model(
    structure: Structure,
    tolerance: float,
    motion: Motion | None = None,
    damping: Viscous | EffectiveDamping | str | None = None,
    dt: float | None = None,
    *,
    displacements: str = "small",
) -> Model:
    """Return a model and time step with a predicted error within a tolerance.

    Without any, the most accurate of those tried is returned with a warning.
    """
    Discretisation(displacements=displacements)  # refuses values other than small and large
    trials, history = _try_settings(structure, tolerance, motion, damping, dt)
    if dt is None:
        trial, error = _select_trial(trials, history[-1], tolerance)
    else:
        trial, error = trials[-1], history[-1][-1]
    names = (Setting(each.settings, each.dt).label for each in trials)
    # change of |e| by large displacements, over the rotation of a joint [1/rad]: median of eleven
    # structures under two motions each, with values from 0.5 to 8.5
    error_per_rotation = 3.0
    model, small = trial.model, error_per_rotation * max(each.run.rotation for each in trials)
    if displacements == "large":
        model, small = plain.build(structure, replace(trial.settings, displacements="large")), 0.0
    candidates = tuple(zip(names, history[-1], strict=True))
    prediction = Prediction(error, tolerance, trial.dt, candidates, small)
    model = model.with_prediction(prediction)
    doubts = tuple(_doubts(prediction, stagnates=_stagnates(history), prescribed=dt is not None))
    doubts += tuple(_doubt_rocking(structure, trial.run))
    for doubt in doubts:
        logger.warning("%s", doubt)
    model.doubts = (*model.doubts, *doubts)
    return model


def _settings_to_try(structure: Structure, dt: float | None) -> list[tuple[Discretisation, float]]:
    """Return discretisations and steps to try, coarsest first; a given `dt` is tried after 2 dt."""
    steps = [setting[2] for setting in TRIED_SETTINGS] if dt is None else [2.0 * dt, dt]
    return [
        (exact_discretisation(structure, fidelity, cells), step)
        for (fidelity, cells, _), step in zip(TRIED_SETTINGS, steps, strict=False)
    ]


@dataclass(frozen=True, eq=False)
class _Trial:
    """A setting that was run over the strongest part of the motion."""

    settings: Discretisation
    dt: float  # time step [s]
    model: Model
    run: error_estimation.RunPeaks
    share: float  # of the motion that was run [-]


def _try_settings(
    structure: Structure,
    tolerance: float,
    motion: Motion | None,
    damping: Viscous | EffectiveDamping | str | None,
    dt: float | None,
) -> tuple[list[_Trial], list[list[float]]]:
    """Return settings tried until one is accurate enough, and all errors after each trial."""
    trials: list[_Trial] = []
    history: list[list[float]] = []
    excitation: tuple[Motion, Viscous | None, float] | None = None
    settings = _settings_to_try(structure, dt)
    bar = tqdm(settings, unit="run", disable=None, leave=False, desc="choosing a model")
    for discretisation, step in bar:
        parts, same = None, trials and trials[-1].settings == discretisation
        model = trials[-1].model if same else plain.build(structure, discretisation)
        excitation = excitation or _resolve_excitation(model, motion, damping)
        window, viscous, share = excitation
        if trials and trials[0].run.peaks is not None:
            parts = error_estimation.parts_about_peaks(trials[0].run)
            window = window.cut(0.0, min(max(parts[-1][1], window.dt), window.duration))
        run = error_estimation.run_peaks(model, window, viscous, step, parts if same else None)
        trials.append(_Trial(discretisation, step, model, run, share))
        runs = [trial.run for trial in trials]
        order = error_estimation.convergence_order(runs, tolerance)
        history.append(error_estimation.estimate_errors(runs, order))
        if history[-1][-1] <= tolerance or _stagnates(history):
            break
    return trials, history


def _select_trial(
    trials: Sequence[_Trial], errors: Sequence[float], tolerance: float
) -> tuple[_Trial, float]:
    """Return the coarsest setting within the tolerance that is worth its choice, and its error."""
    last, error = trials[-1], errors[-1]
    # the share of the motion up to which running the coarser of two settings takes longer than
    # finding it: the second takes 1.6 times as long as the first, the third five times the second
    if last.share > (0.4 if len(trials) == 2 else 0.25) or error > tolerance:
        return last, error
    if len(trials) > 2:
        chosen = next(number for number, each in enumerate(errors) if each <= tolerance)
        return trials[chosen], errors[chosen]
    # one model in two steps: by its order its error is known for all steps between, and near the
    # tolerance it is that of the steps; far below, errors of plane faces and of steps cancel
    order = error_estimation.convergence_order([trial.run for trial in trials], tolerance)
    longest = last.dt * (tolerance / max(error, tolerance / 2.0**order)) ** (1.0 / order)
    dt = max(last.dt, 0.0005 * math.floor(longest / 0.0005 + 1e-6))  # multiples of 0.5 ms
    return replace(last, dt=dt), error * (dt / last.dt) ** order


def _resolve_excitation(
    model: Model, motion: Motion | None, damping: Viscous | EffectiveDamping | str | None
) -> tuple[Motion, Viscous | None, float]:
    """Return the strongest part of a motion, the damping, and this part's share of the duration."""
    structure, (viscous, _) = model.structure, resolve_effective_damping(damping, model, None)
    if motion is None or viscous is None:
        soil = bool(find_soft_blocks(structure))
        probe = model if soil else build_rigid_model(structure, rule=Quadrature("exact"))
        motion = error_estimation.severe_motion(probe) if motion is None else motion
        viscous = viscous or error_estimation.default_damping(probe)
    window = error_estimation.strongest_window(motion)
    return window, viscous, window.duration / motion.duration


def _stagnates(history: Sequence[Sequence[float]]) -> bool:
    """Return whether the last setting errs by no less than the one before did."""
    return len(history) > 2 and history[-1][-1] >= history[-2][-1]


def _doubts(prediction: Prediction, *, stagnates: bool, prescribed: bool) -> Iterator[Doubt]:
    """Yield doubts about a selection."""
    if prediction.error > prediction.tolerance:
        if stagnates:
            remedy = (
                "impacts decide, or sliding: finer cells and shorter steps change the largest |e| "
                "no less than coarser ones; shake by several motions, and judge by all"
            )
        elif prescribed:
            remedy = "leave dt out, and shorter steps and finer meshes are tried"
        else:
            remedy = "no finer setting is tried: prescribe fidelity, cells and dt, and compare"
        cause = f"no setting meets the tolerance; the best is {prediction.text}"
        yield Doubt(cause, remedy)
    if prediction.small_displacement_error > prediction.tolerance:
        yield Doubt(
            "to take displacements as small errs by about "
            f"{prediction.small_displacement_error:.2g} in |e|, and the tolerance is "
            f"{prediction.tolerance:g}: joints turn and slide too far",
            "displacements='large' follows them",
        )


def _doubt_rocking(structure: Structure, run: error_estimation.RunPeaks) -> Iterator[Doubt]:
    """Yield a doubt about the prediction where a stack of blocks rocks."""
    # a stack is determinate, so that nothing but impacts ends its rocking; uplift alone, |e| of 1/6
    # to 0.4, was followed by no such errors
    largest = 0.0 if run.peaks is None else float(run.peaks.max())
    if largest > 0.4 and len(structure.joints) == len(structure.free):
        yield Doubt(
            f"the blocks rock on their joints, with |e| up to {largest:.2f}: impacts decide the "
            "largest |e|, also long after the strongest part of the motion, and its error may be "
            "far larger than predicted",
            "shake by several motions, and judge by all",
        )
