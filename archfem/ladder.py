"""Which rung, mesh and time step a scene needs: the cheapest whose error stays below a tolerance.

The error is predicted, not assumed: candidates are run on the strongest part of the motion and
compared with a finer model on the same part. What is compared is the envelope of |e|, joint by
joint, since that is what hinges are judged by.
"""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import eigsh

from archfem.actions import BodyForce
from archfem.criteria import judged
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models import Model
from archfem.models import build as plain
from archfem.models.jointed import Jointed, Prediction
from archfem.models.rigid import rigid
from archfem.motion import Motion
from archfem.quadrature import Quadrature
from archfem.runs import time_history
from archfem.schemes import Rayleigh
from archfem.soft import soft_blocks
from archfem.statics import equilibrium, self_weight
from archfem.stepping.modal import LARGEST
from archfem.structure import Array, Structure

logger = logging.getLogger("archfem")

WINDOW = 8.0
"""Length of the part of a motion on which errors are predicted, its peak in the middle [s]."""

SAFETY = 1.5
"""By how much an error elsewhere in the motion may exceed that in the window: 1.0 to 2.1 times in
the rings and columns tried, once 4.7 times."""

SAFETY_WITH_SOIL = 1.2
"""The same where models are compared on one mesh: 0.65 to 1.02 times on a bridge of three spans
under six motions."""

SEVERE = 0.40
"""|e| to which a probing motion is scaled where none is given."""

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
        fidelity: rung, or rungs by block.
        cells: through the thickness and along each block.
        quadrature: rule on the joints.
        dt: time step [s].
        points: of the rule, on a facet.
    """

    fidelity: str | Mapping[str, str]
    cells: tuple[int, int]
    quadrature: str
    dt: float
    points: int | None = None

    @property
    def label(self) -> str:
        """The setting in a few words."""
        rung = (
            self.fidelity if isinstance(self.fidelity, str) else self.fidelity["rest"] + " + soil"
        )
        rule = self.quadrature + (f" {self.points}" if self.points else "")
        return f"{rung} {self.cells[0]}×{self.cells[1]} {rule} {1e3 * self.dt:g} ms"

    def build(self, structure: Structure) -> Model:
        """The model of a structure."""
        return plain.build(
            structure,
            fidelity=self.fidelity,
            cells=self.cells,
            quadrature=self.quadrature,
            points=self.points,
        )


def build(  # noqa: PLR0913  (as `models.build`, and what the choice needs)
    structure: Structure,
    *,
    fidelity: str | Mapping[str, str] = "full",
    cells: tuple[int, int] = (4, 4),
    cell: str = "quadrilateral",
    coarse: float | None = None,
    degree: int = 1,
    quadrature: str = "lobatto",
    points: int | None = None,
    tolerance: float = 0.005,
    motion: Motion | None = None,
    damping: Rayleigh | None = None,
    dt: float | None = None,
) -> Model:
    """Build a model of a structure, on a rung that is named or chosen.

    Args:
        structure: what stands.
        fidelity: a rung as in `models.build`, or "auto": the cheapest rung, mesh and time step
            whose predicted error stays below the tolerance. What was predicted is the model's
            `prediction`; cells, quadrature and points are then chosen too.
        cells: through the thickness (facets on a joint) and along each block.
        cell: "quadrilateral" or "triangle".
        coarse: largest cell inside blocks without corners [m].
        degree: of the elements, 1 or 2.
        quadrature: rule on each joint facet, "lobatto", "nodal", "gauss" or "exact".
        points: on each facet, 3 where not given.
        tolerance: for "auto", of the largest |e| of every joint [-].
        motion: for "auto", the ground motion to come; without it a synthetic one is used that
            brings |e| to 0.4, and the prediction is the less certain.
        damping: for "auto", that of the run to come.
        dt: for "auto", the time step of the run to come [s]; errors are then those of the model
            alone. Without it the step is chosen too, and its error counts.

    Raises:
        InvalidInput: an option is not one of those above.
        MeshError: the blocks cannot be cut as asked.
    """
    if not 0.0 < tolerance < 1.0:
        raise InvalidInput(f"tolerance {tolerance:g} on |e| is not between 0 and 1: try 0.005")
    rungs = ("auto", *plain.FIDELITIES)
    if isinstance(fidelity, str) and fidelity not in rungs:
        raise InvalidInput(f"fidelity '{fidelity}' is not known: use one of {rungs}")
    if fidelity == "auto":
        return choose(structure, tolerance, motion, damping, dt)
    return plain.build(
        structure,
        fidelity=fidelity,
        cells=cells,
        cell=cell,
        coarse=coarse,
        degree=degree,
        quadrature=quadrature,
        points=points,
    )


def choose(
    structure: Structure,
    tolerance: float,
    motion: Motion | None = None,
    damping: Rayleigh | None = None,
    dt: float | None = None,
) -> Model:
    """Find the cheapest model, and time step, whose predicted error is within a tolerance.

    Where none is, the best is given, and a warning says so.
    """
    best = finest(structure).build(structure)
    soil = bool(soft_blocks(structure))
    safety = SAFETY_WITH_SOIL if soil else SAFETY
    probe = best if soil else rigid(structure, rule=Quadrature("exact"))
    assert isinstance(probe, Jointed)
    damping = damping or _usual_damping(probe)
    window = strongest(motion) if motion is not None else _probe(probe)
    references: dict[float, Array] = {}
    considered: list[tuple[Setting, float, Model]] = []
    for setting in _candidates(structure, STEPS if dt is None else (dt,)):
        model = setting.build(structure)
        if setting.dt not in references:
            step = setting.dt / 2.0 if dt is None else dt
            references[setting.dt] = envelope(best, window, damping, step)
        try:
            found = envelope(model, window, damping, setting.dt)
            error = safety * largest_difference(found, references[setting.dt])
        except DidNotConverge:
            error = np.inf
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
    assert isinstance(model, Jointed)
    model.prediction = Prediction(error, tolerance, setting.dt, tried)
    return model


def envelope(model: Model, motion: Motion, damping: Rayleigh | None, dt: float) -> Array:
    """Largest |e| of each joint that is judged over a run (n,); 0.5 where it came apart."""
    joints = judged(time_history(model, motion, damping=damping, dt=dt).joints)
    return abs(joints["eccentricity"]).fillna(0.5).max("time").values


def largest_difference(first: Array, second: Array) -> float:
    """Error in eccentricity: the largest difference of two envelopes over the joints."""
    return float(np.abs(first - second).max())


def strongest(motion: Motion) -> Motion:
    """The part of a motion around its peak."""
    peak = float(motion.times()[np.argmax(np.abs(motion.horizontal))])
    start = max(0.0, min(peak - WINDOW / 2.0, motion.duration - WINDOW))
    return motion.cut(start, min(start + WINDOW, motion.duration))


def _mixed(structure: Structure, rung: str) -> str | dict[str, str]:
    """A rung for all blocks but the soft ones, which keep all their nodes."""
    soft = [structure.blocks[number].name for number in soft_blocks(structure)]
    return {**dict.fromkeys(soft, "full"), "rest": rung} if soft else rung


def _candidates(structure: Structure, steps: tuple[float, ...]) -> Iterator[Setting]:
    """Settings to try, the cheapest first; without soil, small enough for the contact stepper."""
    soil = bool(soft_blocks(structure))
    rungs = CANDIDATES[1:] if soil else CANDIDATES
    for dt in steps:
        for rung, cells in rungs:
            fits = soil or rung == "rigid" or _size(structure, rung, cells) <= LARGEST
            if fits or (rung, cells) == CANDIDATES[1]:
                yield Setting(_mixed(structure, rung), cells, "exact", dt)


def finest(structure: Structure) -> Setting:
    """The model against which errors are measured, with half the smallest step.

    Without soil the finest that the contact stepper still takes.
    """
    small = (each for each in REFERENCE if _size(structure, *each) <= LARGEST)
    rung, cells = WITH_SOIL if soft_blocks(structure) else next(small, REFERENCE[-1])
    return Setting(_mixed(structure, rung), cells, "exact", min(STEPS) / 2.0)


def _size(structure: Structure, rung: str, cells: tuple[int, int]) -> int:
    """About how many coordinates a rung has."""
    sides = np.bincount(
        [block for joint in structure.joints for block in joint.blocks],
        minlength=len(structure.blocks),
    )
    each = 3 if rung == "faces" else 2 * (cells[0] + 1)
    return each * int(sum(sides[number] for number in structure.free))


def _usual_damping(model: Jointed) -> Rayleigh:
    """Five per cent at the first closed frequency and at three times that."""
    square = eigsh(
        model.closed().tocsc(), 1, model.mass.tocsc(), sigma=0.0, return_eigenvectors=False
    )[0]
    first = float(np.sqrt(square) / (2.0 * np.pi))
    return Rayleigh(0.05, (first, 3.0 * first))


def _probe(model: Jointed) -> Motion:
    """A synthetic motion whose peak, acting statically, brings |e| to a severe value."""
    weight, low, high = self_weight(model), 0.0, 2.0
    for _ in range(10):
        middle = 0.5 * (low + high)
        try:
            joints = equilibrium(model, weight + model.load(BodyForce(middle))).joints
            severe = float(abs(judged(joints)["eccentricity"]).max()) > SEVERE
        except DidNotConverge:
            severe = True
        low, high = (low, middle) if severe else (middle, high)
    pga = max(low, 0.02) * model.structure.gravity
    return Motion.synthetic(duration=WINDOW, pga=pga, seed=1)
