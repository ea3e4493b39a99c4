"""An analysis as one value: structure, discretisation, damping, time steps, criteria and records.

It holds all but the ground motion. Each method calls the function of the same words, which takes an
analysis where it takes a structure or a model.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, wraps
from inspect import signature
from pathlib import Path
from typing import Any, Literal, TypeVar

from archfem._display import call_late_bound
from archfem._files import hash_value
from archfem._typing import Metres, Seconds
from archfem._validation import check_between, check_fields, given_fields, validate_methods
from archfem.dynamics import schemes
from archfem.dynamics.events import StopCondition, resolve_criteria
from archfem.dynamics.history import History
from archfem.dynamics.model_selection import select_model
from archfem.dynamics.recorder import Record
from archfem.dynamics.verdict_range import VerdictRange
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria
from archfem.masonry.construction import Stage, resolve_stages
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.builder import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.statics.modes import Modes, modes
from archfem.statics.newton import Newton

_DEFAULT_SCHEME, _DEFAULT_NEWTON, _DEFAULT_RECORD = schemes.Conserving(), Newton(), Record()


Function = TypeVar("Function", bound=Callable[..., Any])


@validate_methods
@dataclass(frozen=True, kw_only=True)
class Analysis:
    """All that determines a response, but for the ground motion.

    The same value is a case file: `archfem.Case.read(path).analysis` and `write` are inverse.
    Models and dead load are computed at first use and kept.

    Attributes:
        structure: blocks and joints.
        fidelity: as for `archfem.build`; with "auto" each motion selects model and time step.
        cells: as for `archfem.build`.
        cell: as for `archfem.build`.
        max_cell_size: as for `archfem.build` [m].
        degree: as for `archfem.build`.
        quadrature: as for `archfem.build`.
        quadrature_points: as for `archfem.build`.
        displacements: "small", or "large" for finite rotations, sliding and falls.
        mesh_file: as for `archfem.build`.
        tolerance: admissible error of |e| [-]: of the selection with fidelity "auto", and without
            `dt` of each step, which bounds no error of the result.
        dt: time step [s]; None for steps of varying length.
        damping: `StiffnessDamping`, `Rayleigh`, or `EffectiveDamping`, whose frequencies are those
            of modes about the dead load; "effective" is the last with its defaults; None is
            undamped.
        scheme: `Conserving`, `Newmark` or `HHT`.
        method: solver of the time steps, as for `archfem.time_history`.
        newton: settings of Newton's method.
        until: event that ends a run before its motion does.
        criteria: failure criteria of joints; None for those of `until`, or the default ones.
        record: which steps are recorded.
        stages: construction stages; None builds the structure in one go.

    Raises:
        InvalidInput: a value is out of range, or values exclude each other.

    Example:
        >>> ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
        >>> analysis = af.Analysis(ring, fidelity="rigid", damping="effective", dt=0.005)
        >>> analysis.run(af.Motion.synthetic(duration=1.0, pga=1.0)).ending.value
        'finished'
    """

    structure: Structure = field(kw_only=False)
    fidelity: str | Mapping[str, str] = "full"
    cells: tuple[int, int] = (4, 4)
    cell: str = "quadrilateral"
    max_cell_size: Metres | None = None
    degree: int = 1
    quadrature: str | None = None
    quadrature_points: int | None = None
    displacements: str = "small"
    mesh_file: str | Path | None = None
    tolerance: float = 0.005
    dt: Seconds | None = None
    damping: schemes.Viscous | schemes.EffectiveDamping | Literal["effective"] | None = None
    scheme: schemes.Scheme = _DEFAULT_SCHEME
    method: str = "auto"
    newton: Newton = _DEFAULT_NEWTON
    until: StopCondition | None = None
    criteria: Criteria | None = None
    record: Record = _DEFAULT_RECORD
    stages: Sequence[Stage] | None = None

    def __post_init__(self) -> None:
        """Check the values, and that they do not exclude each other."""
        object.__setattr__(self, "damping", schemes.interpret_damping(self.damping))
        check_fields(self)
        object.__setattr__(self, "cells", self.discretisation.cells)
        check_between(self.tolerance, "tolerance on |e| [-]", 0.0, 1.0)
        if self.dt is not None:
            schemes.check_time_step(self.dt)
        if self.selects_model and self.mesh_file is not None:
            raise InvalidInput(
                f"mesh_file = {str(self.mesh_file)!r} is one mesh, and fidelity 'auto' chooses: "
                "name a fidelity"
            )
        if self.displacements == "large":
            schemes.check_large_displacement_scheme(self.scheme)
        schemes.check_friction_scheme(self.scheme, self.structure)
        resolve_criteria(self.criteria, self.until)
        if self.stages is not None:
            object.__setattr__(self, "stages", tuple(self.stages))
            resolve_stages(self.structure, self.stages)

    def __hash__(self) -> int:
        """Return a hash of all values; those of equal analyses are equal."""
        return hash(self.fingerprint)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone: models are large, and built anew in other processes."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __repr__(self) -> str:
        """Structure, and the fields that differ from their defaults."""
        given = given_fields(self)
        del given["structure"]
        words = [self.structure.name, *(f"{name}={value!r}" for name, value in given.items())]
        return f"Analysis({', '.join(words)})"

    @cached_property
    def fingerprint(self) -> str:
        """Digest of all values, to the last bit; equal for a case file and its analysis."""
        return hash_value({each.name: getattr(self, each.name) for each in fields(self)})

    @property
    def selects_model(self) -> bool:
        """Whether the model is selected by its predicted error, fidelity "auto"."""
        return self.fidelity == "auto"

    @property
    def discretisation(self) -> Discretisation:
        """Fidelity, mesh and quadrature; with fidelity "auto" the default fidelity."""
        values = {each.name: getattr(self, each.name) for each in fields(Discretisation)}
        return Discretisation(**values | ({"fidelity": "full"} if self.selects_model else {}))

    @property
    def failure_criteria(self) -> Criteria:
        """The criteria by which joints are assessed."""
        return resolve_criteria(self.criteria, self.until)

    @property
    def model(self) -> Model:
        """The model; with fidelity "auto" that for a synthetic motion (`archfem.build`)."""
        return self.dead_load().model

    def dead_load(self, motion: Motion | None = None) -> Equilibrium:
        """Find the equilibrium under dead load, built in the stages of the analysis.

        Args:
            motion: motion for which fidelity "auto" selects the model.

        Returns:
            The equilibrium, with its model.

        Raises:
            DidNotConverge: the structure has no equilibrium.
        """
        if self.selects_model and motion is not None:
            return self._compute_dead_load(motion)
        return self._dead_load

    @cached_property
    def _dead_load(self) -> Equilibrium:
        """Equilibrium of the model that no motion has selected."""
        return self._compute_dead_load(None)

    def _compute_dead_load(self, motion: Motion | None) -> Equilibrium:
        """Build the model, and find its equilibrium."""
        if self.selects_model:
            settings = (self.tolerance, motion, self.damping, self.dt)
            model = select_model(self.structure, *settings, displacements=self.displacements)
        else:
            model = build(self.structure, self.discretisation)
        return dead_load(model, self.newton, stages=self.stages)

    def modes(self, count: int = 6) -> Modes:
        """Find the lowest modes of vibration about the dead load.

        Args:
            count: number of modes; at most the number of coordinates are found.

        Returns:
            The modes, the lowest first.

        Raises:
            DidNotConverge: the structure is a mechanism, and does not vibrate.
        """
        rest = self.dead_load()
        return modes(rest.model, min(count, rest.model.size), rest)

    def run(self, motion: Motion) -> History:
        """Compute the time history under a motion, as `archfem.time_history`.

        Args:
            motion: ground acceleration.

        Returns:
            The history.

        Raises:
            DidNotConverge: there is no equilibrium, or a step failed.
        """
        return call_late_bound("Analysis.run", self, motion)

    def scale(self, motion: Motion, **options: Any) -> Any:
        """Search the smallest scale of a motion at which the structure falls, among those it runs.

        Args:
            motion: motion to scale.
            options: as for `archfem.collapse_scale`, such as `precision`.

        Returns:
            The scales between which it falls, a `CollapseScale`.

        Raises:
            InvalidInput: displacements are small.
        """
        return call_late_bound("Analysis.scale", self, motion, **options)

    def ida(self, motions: Any, **options: Any) -> Any:
        """Scale motions up until limit states are reached (incremental dynamic analysis).

        Args:
            motions: as for `archfem.ida`.
            options: as for `archfem.ida`, such as `limits` and `workers`.

        Returns:
            Capacities, curves and fragility, an `Ida`.
        """
        return call_late_bound("Analysis.ida", self, motions, **options)

    def verdict_range(self, motion: Motion, **options: Any) -> VerdictRange:
        """Compute how often the structure falls over uncertain properties.

        Args:
            motion: ground acceleration.
            options: as for `archfem.verdict_range`, such as `vary` and `samples`.

        Returns:
            All runs, and their share of falls.
        """
        return call_late_bound("Analysis.verdict_range", self, motion, **options)

    def accuracy(self, motion: Motion | None = None, **options: Any) -> Any:
        """Compare processor time and error over fidelities, meshes, quadratures and time steps.

        Args:
            motion: ground acceleration; by default a synthetic one that brings |e| to 0.4.
            options: as for `archfem.accuracy`.

        Returns:
            All settings with times and errors, an `Accuracy`.
        """
        return call_late_bound("Analysis.accuracy", self, motion, **options)

    def mesh_sensitivity(self, motion: Motion | None = None, **options: Any) -> Any:
        """Compute how findings depend on mesh, time step, joint quadrature and fidelity.

        Args:
            motion: ground acceleration; None for findings of the dead load.
            options: as for `archfem.mesh_sensitivity`, such as `quantity`.

        Returns:
            Observed order, extrapolated value and error bar, a `MeshSensitivity`.
        """
        return call_late_bound("Analysis.mesh_sensitivity", self, motion=motion, **options)

    def page(self, path: str | Path | None = None, **options: Any) -> Any:
        """Return a page on which a reader changes the arch and shakes it, in any browser.

        Args:
            path: file to write, .html; None writes none.
            options: as for `archfem.view.page`, such as `motions`.

        Returns:
            The page, which a notebook shows, a `view.LivePage`.

        Raises:
            InvalidInput: stones are not rigid and dry, or too many.
        """
        return call_late_bound("Analysis.page", self, path, **options)

    def write(self, path: str | Path) -> Path:
        """Write the analysis as a case file, which `archfem.Case.read` reads.

        Args:
            path: file to write, .toml; folders are created.

        Returns:
            The file.

        Raises:
            InvalidInput: a law, an event or a criterion is not registered, so that no file can
                name it.
        """
        return call_late_bound("Analysis.write", self, path)


def with_one_facet(analysis: Analysis) -> Analysis:
    """Return an analysis whose fill in one piece has one facet on each stone.

    Stones slide past shorter facets, which ends a run of large displacements without an answer.
    """
    stones = analysis.structure
    if analysis.mesh_file is not None or all(
        stones.blocks[number].grain for number in find_yielding_blocks(stones)
    ):
        return analysis
    return replace(analysis, cells=(1, 1), cell="triangle")


def takes_falling_analysis(function: Function) -> Function:
    """Decorate a function as by `takes_analysis`, for which stones may slide far."""
    inner: Any = takes_analysis(function)

    @wraps(function)
    def wrapper(model: Any, motion: Any, **given: Any) -> Any:
        is_analysis = isinstance(model, Analysis)
        return inner(with_one_facet(model) if is_analysis else model, motion, **given)

    return wrapper  # type: ignore[return-value]


def takes_analysis(function: Function) -> Function:
    """Decorate a function of a model and a motion so that it takes an `Analysis` for the model.

    Settings of the analysis are keywords of the function, which begins at its dead load. A setting
    that is given replaces that of the analysis, as by `dataclasses.replace`.
    """
    names, known = [each.name for each in fields(Analysis)[1:]], {*signature(function).parameters}
    # a solver of the user and a row of steps are no settings
    kinds: Mapping[str, Any] = {"method": str, "dt": float | int | None}

    @wraps(function)
    def wrapper(model: Any, motion: Any, **given: Any) -> Any:
        if not isinstance(model, Analysis):
            return function(model, motion, **given)
        changes = {
            key: given.pop(key)
            for key in [*given]
            if key in names and isinstance(given[key], kinds.get(key, object))
        }
        analysis = replace(model, **changes) if changes else model
        start = given.pop("start", None) or analysis.dead_load(motion)
        settings = {name: getattr(analysis, name) for name in names}
        settings |= {"criteria": analysis.failure_criteria, "start": start, **given}
        if analysis.dt is not None or analysis.selects_model:
            settings["tolerance"] = None  # a step takes the place of a tolerance
        used = {key: v for key, v in settings.items() if v is not None and key in known | {*given}}
        # an equilibrium has its model, which would be built anew otherwise
        subject = start.model if isinstance(start, Equilibrium) else analysis.model
        return function(subject, motion, **used)

    return wrapper  # type: ignore[return-value]
