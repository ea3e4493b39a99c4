"""Which rung, mesh and time step a scene needs: the cheapest whose error stays below a tolerance.

The error is predicted, not assumed: candidates are run on the strongest part of the motion and
compared with a finer model on the same part. What is compared is the largest |e|, joint by joint,
since that is what hinges are judged by.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.probe import (
    largest_difference,
    peaks,
    severe_motion,
    strongest,
    usual_damping,
)
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.stepping.modal import LARGEST
from archfem.errors import DidNotConverge, InvalidInput
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

SAFETY = 1.5
"""By how much an error elsewhere in the motion may exceed that in the window: 1.0 to 2.1 times in
the rings and columns tried, once 4.7 times."""

SAFETY_WITH_SOIL = 1.2
"""The same where models are compared on one mesh: 0.65 to 1.02 times on a bridge of three spans
under six motions."""

STEPS = (0.005, 0.0025)
"""Time steps considered [s]."""

REFERENCE = (("condensed", (6, 6)), ("condensed", (4, 4)), ("faces", (4, 4)))
"""Models against which errors are measured, the best first; the first that is small enough."""

WITH_SOIL = ("full", (4, 4))
"""The same where there is soil, whose nodes are all kept: errors are then those of the rung, and of
coarser meshes, against this mesh."""

CANDIDATES = (
    ("rigid", (1, 1)),
    ("faces", (2, 2)),
    ("faces", (4, 4)),
    ("condensed", (4, 4)),
)
"""Rungs and meshes considered, the cheapest first."""


@dataclass(frozen=True)
class Setting:
    """A model and a time step.

    Attributes:
        discretisation: rung, mesh, and rule on the joints.
        dt: time step [s].
    """

    discretisation: Discretisation
    dt: float

    @property
    def label(self) -> str:
        """The setting in a few words."""
        asked, fidelity = self.discretisation, self.discretisation.fidelity
        rung = fidelity if isinstance(fidelity, str) else fidelity["rest"] + " + soil"
        rule = asked.rule.rule + (f" {asked.points}" if asked.points else "")
        return f"{rung} {asked.through}×{asked.along} {rule} {1e3 * self.dt:g} ms"


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
            Or "auto": the cheapest rung, mesh and time step whose predicted error stays below the
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
            is asked once, of the finest that candidates are compared with.
        dt: for "auto", the time step of the run to come [s]; errors are then those of the model
            alone. Without it the step is chosen too, and its error counts.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be cut as asked.
    """
    if not 0.0 < tolerance < 1.0:
        raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
    if fidelity == "auto":
        return choose(structure, tolerance, motion, damping, dt)
    asked = Discretisation(fidelity, cells, cell, coarse, degree, quadrature, points)
    return plain.build(structure, asked)


def choose(
    structure: Structure,
    tolerance: float,
    motion: Motion | None = None,
    damping: Damping = None,
    dt: float | None = None,
    *,
    builder: Builder = plain.build,
) -> Model:
    """Return the cheapest model, and time step, whose predicted error is within a tolerance.

    Where none is, the best is given, and a warning says so.

    Args:
        structure: what stands.
        tolerance: of the largest |e| of every joint [-].
        motion: to come; without it a synthetic one is used that brings |e| to 0.4.
        damping: of the run to come, or a function that finds it of the finest model.
        dt: time step of the run to come [s]; without it the step is chosen too.
        builder: makes the models.

    Raises:
        DidNotConverge: the finest model failed.
    """
    yardstick = _yardstick(structure, motion, damping, builder, finer=0.5 if dt is None else 1.0)
    considered: list[tuple[Setting, float, Model]] = []
    for setting in _candidates(structure, STEPS if dt is None else (dt,)):
        model = builder(structure, setting.discretisation)
        error = yardstick.error(model, setting.dt)
        considered.append((setting, error, model))
        if error <= tolerance:
            break
    setting, error, model = min(considered, key=lambda found: (found[1] > tolerance, found[1]))
    tried = tuple((each.label, found) for each, found, _ in considered)
    if error > tolerance:
        logger.warning(
            "no rung of the ladder is predicted to err by less than %g in |e|: the best is %s with "
            "%.2g; a motion past the first mechanism cannot be followed more closely",
            tolerance,
            setting.label,
            error,
        )
    return model.predicted(Prediction(error, tolerance, setting.dt, tried))


@dataclass(frozen=True, eq=False)
class _Yardstick:
    """The finest model under the strongest part of a motion, with which others are compared.

    Attributes:
        model: the finest.
        window: the part of the motion.
        damping: of all runs.
        safety: factor on what is found.
        finer: its time step, as a share of that of the model compared.
    """

    model: Model
    window: Motion
    damping: Viscous
    safety: float
    finer: float
    _known: dict[float, Array] = field(default_factory=dict)

    def error(self, model: Model, dt: float) -> float:
        """Error of a model stepped by dt [s]; infinite where its run fails."""
        if dt not in self._known:
            self._known[dt] = peaks(self.model, self.window, self.damping, self.finer * dt)
        try:
            found = peaks(model, self.window, self.damping, dt)
        except DidNotConverge:
            return np.inf
        return self.safety * largest_difference(found, self._known[dt])


def _yardstick(
    structure: Structure, motion: Motion | None, damping: Damping, builder: Builder, *, finer: float
) -> _Yardstick:
    """Build the finest model; what is not known of the run is assumed."""
    best = builder(structure, finest(structure).discretisation)
    soil = bool(soft_blocks(structure))
    probe = best if soil else rigid(structure, rule=Quadrature("exact"))
    return _Yardstick(
        best,
        strongest(motion) if motion is not None else severe_motion(probe),
        damping_for(best, damping) or usual_damping(probe),
        SAFETY_WITH_SOIL if soil else SAFETY,
        finer,
    )


def damping_for(model: Model, damping: Damping) -> Viscous | None:
    """Return the damping of a run, asked of a model where it is yet to be found.

    Args:
        model: the finest.
        damping: or a function that finds it of a model; None is undamped.
    """
    return damping(model) if callable(damping) else damping


def _exact(structure: Structure, rung: str, cells: tuple[int, int]) -> Discretisation:
    """A rung for all blocks but the soft ones, which keep all their nodes; exact joints."""
    soft = [structure.blocks[number].name for number in soft_blocks(structure)]
    fidelity = {**dict.fromkeys(soft, "full"), "rest": rung} if soft else rung
    return Discretisation(fidelity, cells, quadrature="exact")


def _candidates(structure: Structure, steps: tuple[float, ...]) -> Iterator[Setting]:
    """Settings to try, the cheapest first; without soil, with modes few enough to keep all."""
    soil = bool(soft_blocks(structure))
    rungs = CANDIDATES[1:] if soil else CANDIDATES
    for dt in steps:
        for rung, cells in rungs:
            fits = soil or rung == "rigid" or _size(structure, rung, cells) <= LARGEST
            if fits or (rung, cells) == CANDIDATES[1]:
                yield Setting(_exact(structure, rung, cells), dt)


def finest(structure: Structure) -> Setting:
    """Return the model against which errors are measured, with half the smallest step.

    Without soil it is the finest whose modes are still few enough to keep all.

    Args:
        structure: what stands.
    """
    small = (each for each in REFERENCE if _size(structure, *each) <= LARGEST)
    rung, cells = WITH_SOIL if soft_blocks(structure) else next(small, REFERENCE[-1])
    return Setting(_exact(structure, rung, cells), min(STEPS) / 2.0)


def _size(structure: Structure, rung: str, cells: tuple[int, int]) -> int:
    """About how many coordinates a rung has."""
    sides = np.bincount(
        [block for joint in structure.joints for block in joint.blocks],
        minlength=len(structure.blocks),
    )
    each = 3 if rung == "faces" else 2 * (cells[0] + 1)
    return each * int(sum(sides[number] for number in structure.free))
