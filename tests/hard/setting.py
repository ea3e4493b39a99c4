"""Hard cases: their definition, their required results, and structures that many of them use."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

import archfem as af
from archfem.dynamics import Ending, Equation, State
from archfem.dynamics.solvers.snes import SnesSolver
from archfem.masonry import STONE_TO_STONE
from archfem.statics import Equilibrium, Newton
from archfem.statics.newton import load_magnitude

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
DT = 0.005
IN_BALANCE = 1e-9
"""What a step may lack to balance, of the weight, and N, V, M may err by, of the largest. Found
1.5e-12 and 7e-11; motion, damping or friction that is off by a millionth makes 4e-9 or more."""
logger = logging.getLogger("archfem")


@dataclass(frozen=True)
class Found:
    """The result of a case.

    Attributes:
        outcome: in words.
        right: whether the outcome is the expected one.
        error: against the reference, or None.
        run: the history that the effort is read from, or None for statics.
    """

    outcome: str
    right: bool
    error: float | None = None
    run: af.History | None = None


@dataclass(frozen=True)
class Case:
    """One line of the table.

    Attributes:
        name: of the case.
        hard: the difficulty of the case.
        study: runs the case, and judges the result.
        quick: a second or so, and part of the default tests.
    """

    name: str
    hard: str
    study: Callable[[], Found]
    quick: bool

    def row(self) -> tuple[list[str], bool]:
        """Cells of the table, and whether the case passes."""
        start = perf_counter()
        warnings = _Warnings()
        try:
            with warnings:
                found = self.study()
        except af.ArchfemError as error:
            found = Found(f"{type(error).__name__}: {error}", False, run=_history(error))
        except (ArithmeticError, ValueError, AssertionError, np.linalg.LinAlgError) as error:
            found = Found(f"crashed with {type(error).__name__}: {error}", False)
        taken = perf_counter() - start
        silent = found.run is not None and "energy" not in warnings.words and _drifts(found.run)
        right = found.right and not silent
        outcome = found.outcome + ("; drift of energy not warned of" if silent else "")
        cells = [self.name, self.hard, outcome if right else f"**{outcome}**"]
        rest = [", ".join(sorted(warnings.words)), _number(found.error), f"{taken:.1f}"]
        return [*cells, *effort(found.run), *rest], right


class _Warnings(logging.Handler):
    """Collects the subjects of archfem's warnings: "energy", "displacements"."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.words: set[str] = set()

    def __enter__(self) -> "_Warnings":
        logger.addHandler(self)
        logger.propagate = False
        return self

    def __exit__(self, *_: object) -> None:
        logger.removeHandler(self)
        logger.propagate = True

    def emit(self, record: logging.LogRecord) -> None:
        said = record.getMessage()
        self.words |= {word for word in ("energy", "displacements") if word in said}


def _drifts(run: af.History) -> bool:
    """Whether a run reached its end with a drift of which archfem must warn."""
    return (
        abs(run.dataset.attrs["energy_drift"]) > 0.05  # the monitor warns above
        and run.ending is not Ending.FAILED
    )


CASES: list[Case] = []
HEAD = [
    "case",
    "what is hard",
    "outcome",
    "iterations",
    "smallest step [s]",
    "halved",
    "left to SNES",
    "energy drift",
    "warned of",
    "error",
    "time [s]",
]


def case(name: str, hard: str, *, quick: bool = False, **given: object) -> Callable:
    """Make a function that returns a `Found` one line of the table, with arguments given here."""

    def keep(study: Callable[..., Found]) -> Callable[..., Found]:
        CASES.append(Case(name, hard, partial(study, **given), quick))
        return study

    return keep


def _history(error: af.ArchfemError) -> af.History | None:
    return getattr(error, "history", None)


def effort(run: af.History | None) -> list[str]:
    """Most iterations in a step, smallest step, steps halved, left to SNES, drift of energy."""
    if run is None:
        return ["", "", "", "", ""]
    attributes = run.dataset.attrs
    return [
        str(int(run.dataset["iterations"].max())),
        f"{float(run.dataset['smallest_step'].min()):.3g}",
        str(attributes["halved_steps"]),
        str(attributes["fallback_steps"]),
        f"{100.0 * attributes['energy_drift']:+.2g} %",
    ]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2g}"


def sound(run: af.History) -> None:
    """Nothing stored may be nonsense: numbers throughout, e undefined in open joints alone."""
    for name in ("N", "V", "M", "energy_drift", "last_q", "last_velocity", "last_acceleration"):
        assert np.isfinite(run.dataset[name].values).all(), f"{name} is not a number somewhere"
    e, normal = run.joints["eccentricity"].values, run.joints["N"].values
    assert (np.isnan(e) == (normal <= 0.0)).all(), "e is undefined in a closed joint"
    assert np.nanmax(np.abs(e)) <= 0.5 + 1e-9, "the thrust leaves a joint"
    assert (normal >= 0.0).all(), "a joint holds tension"


def shaken(model, motion: af.Motion, *, dt: float = DT, damping=DAMPING, **given) -> af.History:
    """Run a time history and check the stored results."""
    run = af.time_history(model, motion, dt=dt, damping=damping, **given)
    sound(run)
    return run


def peaks(run: af.History) -> np.ndarray:
    """Largest |e| of every joint (n_joints,)."""
    return np.nan_to_num(np.abs(run.joints["eccentricity"].values)).max(axis=0)


def off(run: af.History, other: af.History) -> float:
    """Largest difference of N, V and M, relative to the largest of each; the same times."""
    worst = 0.0
    for key in ("N", "V", "M"):
        first, second = run.joints[key].values, other.joints[key].values
        worst = max(worst, float(np.abs(first - second).max() / np.abs(second).max()))
    return worst


def unbalanced_steps(run: af.History, dead: Equilibrium, motion: af.Motion, damping) -> float:
    """What any step lacks to balance, of the weight, or its N, V and M err by, of the largest.

    From the displacements that a run by the default scheme has stored at every step: these alone
    give speeds, by the midpoint rule, and what joints remember. Other than a history by SNES this
    is one yardstick for every step, also for one that SNES only finds in halves: those are other
    equations, whose solution differs by far more than rounding, and so does all that follows.

    Of a step in halves the end of the first half is not stored: SNES solves for it, and the second
    half must balance from there to the stored end. Shorter parts of a step have no yardstick, and
    count as out of balance.
    """
    equation, dt = Equation(dead.model, motion, damping), float(run.time[1] - run.time[0])
    stored = np.stack([run.joints[key].values for key in ("N", "V", "M")], axis=-1)
    largest, scale = np.abs(stored).max(axis=(0, 1)), load_magnitude(equation.weight)
    before, worst = equation.at_rest(dead.q, memory=dead.model.memory), 0.0
    halves, parts = SnesSolver(equation, Newton(tolerance=1e-12)), run.dataset["smallest_step"]
    rows = zip(run.time, dt / parts.values, run.dataset["q"].values, stored, strict=True)
    for time, count, q, given in list(rows)[1:]:
        ends, means = [q], list[np.ndarray]()
        if round(float(count)) == 2:
            ends.insert(0, halves.whole(before, 0.5 * dt).state.q)
        elif round(float(count)) > 2:
            return np.inf
        step = dt / len(ends)
        for number, end in enumerate(ends, 1 - len(ends)):
            lacks, mean, before = _balance(equation, before, end, float(time) + number * step, step)
            means.append(mean)
            worst = max(worst, lacks / scale)
        worst = max(worst, float((np.abs(np.mean(means, axis=0) - given) / largest).max()))
    return worst


def _balance(
    equation: Equation, before: State, q: np.ndarray, time: float, dt: float
) -> tuple[float, np.ndarray, State]:
    """What a step lacks to balance [N], its N, V and M, and the state at its end."""
    passage = equation.with_memory(before).begin_step(before.q, equation.lag / dt)
    speed = 2.0 * (q - before.q) / dt - before.velocity
    change, drag = (speed - before.velocity) / dt, 0.5 * (speed + before.velocity)
    ground = equation.ground(np.array([time]), dt)[0, 0]
    load = equation.weight - equation.model.mass_influence @ ground
    moving = equation.model.mass @ change + equation.viscous @ drag
    lacks = float(np.linalg.norm(moving + passage.force(q) - load))
    return lacks, passage.resultants(q), State(time, q, speed, change, passage.updated_memory(q))


def answer(run: af.History, error: float, tolerance: float, words: str = "") -> Found:
    """An answer, right where its error is within the tolerance."""
    said = f"max e {peaks(run).max():.3f}{words}"
    if error > tolerance:
        said += f"; error above {tolerance:.2g}"
    return Found(said, error <= tolerance, error, run)


def refused(study: Callable[[], object], kind: type[af.ArchfemError], says: str) -> Found:
    """Right where archfem gives a named error that says so."""
    try:
        study()
    except kind as error:
        message = str(error).split(": ")[0]
        return Found(f"{kind.__name__}: {message}", says in str(error), run=_history(error))
    return Found("numbers, where there is no answer", False)


def ring(**given) -> af.Structure:
    """The validation ring, or one like it."""
    lengths = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**{**lengths, **given})


def joints(stiffer: float = 1.0, friction: float | None = 0.6) -> af.Contact:
    """Dry joints so many times stiffer than those of the validation ring."""
    return replace(
        STONE_TO_STONE,
        normal_stiffness=stiffer * STONE_TO_STONE.normal_stiffness,
        shear_stiffness=stiffer * STONE_TO_STONE.shear_stiffness,
        friction=friction,
    )


def quake(pga: float, duration: float = 6.0, seed: int = 3, vertical: float = 2 / 3) -> af.Motion:
    """An artificial motion [m/s², s]."""
    return af.Motion.synthetic(duration=duration, pga=pga, seed=seed, vertical_ratio=vertical)


def still(duration: float) -> af.Motion:
    """No motion at all."""
    return af.Motion(np.zeros(round(duration / DT) + 1), DT)
