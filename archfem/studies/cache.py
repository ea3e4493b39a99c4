"""What a process remembers between points: models under dead load, damping, steppers, motions.

Points of a study often differ in little. What a later point shares with an earlier one, by all that
the case and its files say of it, is taken from here.

Steppers that runs under many motions share: their matrices are ordered and factorised once.

What a run leaves in its matrices, such as which rows of a compliance it has found, is its own: each
run is given a copy of them as they were made, so that it does not depend on those before it.

Compiled code, loaded once a process, and compiled once a machine, not once a worker.
"""

import fcntl
import hashlib
import json
import os
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from archfem._typing import Array
from archfem.cases.case import Case
from archfem.cases.provenance import hash_file, list_input_files
from archfem.cases.run import DeadLoadResult, damping_of, dead_load_of_case
from archfem.dynamics.schemes import Conserving
from archfem.dynamics.solvers.base import StepSolver
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.selection import select_solver
from archfem.dynamics.state import State
from archfem.dynamics.warm_up import compile_variant
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.modes import Modes, modes
from archfem.studies.parameter_space import MODEL

# How many lengths of steps there are kept matrices of: as many as a run of its own pace has
KEPT = 8


@dataclass(frozen=True, eq=False)
class Ready:
    """A way to step a model with some damping and scheme, ready for any motion."""

    equation: Equation  # of motion, under any motion
    solver: StepSolver | None  # takes the steps; None where SNES takes them all
    _systems: dict[float, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, equation: Equation) -> "Ready":
        """Select the solver of an equation of motion."""
        return cls(equation, select_solver(equation))

    def under(self, motion: Motion) -> Stepper:
        """Return a fresh stepper for a run."""
        return Shared(replace(self.equation, motion=motion), self.solver, self._systems)


class Shared(Stepper):
    """A stepper whose matrices are copies of those that others have made."""

    def __init__(
        self, equation: Equation, solver: StepSolver | None, systems: dict[float, Any]
    ) -> None:
        super().__init__(equation, solver)
        self._made = systems

    def allocate_batch(self, state: State, dt: float, times: Array) -> tuple[Any, ...]:
        """Return what `base.advance` takes, as `Stepper.allocate_batch` does."""
        if dt not in self._systems:
            assert self.solver is not None
            if dt not in self._made:
                self._made[dt] = self.solver.system(dt)
                while len(self._made) > KEPT:
                    del self._made[next(iter(self._made))]
            self._systems[dt] = self.solver.copy_system(self._made[dt])
        return super().allocate_batch(state, dt, times)


# What most cases step by, of the kinds that are compiled apart from each other
USUAL = "compliance, Conserving"


@cache
def preload() -> None:
    """Step a small arch once; where code is to be compiled for it, one process goes first."""
    with _alone():
        compile_variant(USUAL)


@contextmanager
def _alone() -> Iterator[None]:
    """Let one process go first, unless one has before since the sources were last changed."""
    done = Path(tempfile.gettempdir()) / f"archfem-{os.getuid()}-{_sources()}.warm"
    if done.exists():
        yield
        return
    with done.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
        done.touch()


def _sources() -> str:
    """What tells this state of the modules that are compiled from any other."""
    rooms = Path(__file__).parents[1]
    times = [
        f"{path} {path.stat().st_mtime_ns}"
        for room in ("dynamics", "joints")
        for path in sorted((rooms / room).rglob("*.py"))
    ]
    return hashlib.sha256("\n".join(times).encode()).hexdigest()[:16]


Made = TypeVar("Made")

# How many models are kept, which may be large, and how many of anything else
MODELS, OTHERS = 4, 64

GROUND = ("motion", "suite")
ANALYSIS = ("analysis", "criteria")

# What a case says of a motion, or a suite, that is read and matched without it all the same
FACTORS = ("scale", "reduction", "reversed")

_kept: dict[str, OrderedDict[str, Any]] = {}


def dead_load_of(case: Case) -> DeadLoadResult:
    """Return a case under its dead load, damping found, on a model made before if there is one.

    Args:
        case: what is asked.

    Raises:
        DidNotConverge: the structure does not stand.
    """
    preload()
    key = _model_key(case)
    dead: Equilibrium = _remembered("models", key, lambda: dead_load_of_case(case), MODELS)
    rest = DeadLoadResult(case, dead)
    damped = f"{key} {case.analysis.get('damping')!r}"
    found = _remembered("damping", damped, lambda: damping_of(case, dead))
    rest.__dict__["damping"] = found  # where the cached property would put it
    return rest


def first_mode(rest: DeadLoadResult) -> Modes:
    """Return the first mode about a dead load."""
    dead = rest.dead
    key = _model_key(rest.case)
    return _remembered("modes", key, lambda: modes(dead.model, 1, about=dead), MODELS)


def ground_motion(case: Case) -> Motion:
    """Return the motion of a case, or that of the only pair of its suite, matched if it is to be.

    Args:
        case: what is asked.

    Raises:
        InvalidInput: there is none, more than one, or it cannot be read or matched.
        DidNotConverge: it cannot be matched.
    """
    if case.suite is not None and len(pairs := list(case.suite["pairs"])) > 1:
        raise InvalidInput(
            f"the suite has {len(pairs)} pairs and a point of a study is about one: go over "
            f'"suite.pair" = {pairs}'
        )
    if case.suite is not None:
        return ground_suite(case).motions[0]
    if case.motion is None:
        return case.ground_motion()  # which says that there is none
    plain = replace(case, motion=_without(case.motion, ("scale",)))
    whole = _remembered("motions", _ground_key(case), plain.ground_motion)
    return whole.scaled(case.motion.get("scale", 1.0))


def ground_suite(case: Case) -> Suite:
    """Return the suite of a case, read and matched before if it was, at whatever scale."""
    if (told := case.suite) is None:
        return case.ground_suite()  # likewise
    plain = replace(case, suite=_without(told, FACTORS))
    found = _remembered("suites", _ground_key(case), plain.ground_suite)
    factors = {name: told.get(name, 1.0) for name in ("scale", "reduction")}
    scaled = replace(found, **factors)
    return scaled.reversed() if told.get("reversed", False) else scaled


def stepper_of(rest: DeadLoadResult, motion: Motion) -> Stepper:
    """Return a fresh stepper for a run, the way it steps chosen whatever else the machine does."""
    dead, damping, scheme = rest.dead, rest.damping[0], rest.case.scheme or Conserving()

    def ready() -> Ready:
        equation = Equation(dead.transfer_memory(dead.model), motion, damping, scheme)
        return Ready.of(equation)

    key = f"{_model_key(rest.case)} {damping!r} {scheme!r}"
    return _remembered("steppers", key, ready, MODELS).under(motion)


def _model_key(case: Case) -> str:
    """Everything that makes the model of a case; the motion too, where it is chosen for that."""
    return _key(case, (*MODEL, *GROUND, *ANALYSIS) if case.selects_model else MODEL)


def _ground_key(case: Case) -> str:
    """Everything that a case says of the ground, but for factors."""
    left_out = {"motion": ("scale",), "suite": FACTORS}
    return _key(case, GROUND, left_out)


def _key(
    case: Case, sections: Sequence[str], left_out: Mapping[str, Collection[str]] | None = None
) -> str:
    """What tells everything that some sections of a case say, files included."""
    told = {
        name: _without(case.settings[name], (left_out or {}).get(name, ()))
        for name in sections
        if name in case.settings
    }
    files = [(str(p), hash_file(p)) for p in list_input_files(told, case.folder)]
    text = json.dumps([told, files], default=str)  # arches and piers stand in their order
    return hashlib.sha256(text.encode()).hexdigest()


def _without(table: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    """A table without some of its keys."""
    return {key: value for key, value in table.items() if key not in keys}


def _remembered(kind: str, key: str, make: Callable[[], Made], most: int = OTHERS) -> Made:
    """What was made before under a key, or what is made now; of many the oldest is forgotten."""
    kept = _kept.setdefault(kind, OrderedDict())
    if key not in kept:
        kept[key] = make()
        while len(kept) > most:
            kept.popitem(last=False)
    kept.move_to_end(key)
    return kept[key]
