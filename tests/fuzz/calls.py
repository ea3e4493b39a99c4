"""Public functions and classes with odd arguments."""

import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import archfem as af
from fuzz import odd
from fuzz.case_files import BASES, DRAWING, RECORD
from fuzz.trial import Came, judged

CALLS: dict[str, tuple[Callable[..., Any], Callable[[], Mapping[str, Any]]]] = {}
"""Functions by name, and makers of their arguments, all of which are valid."""


def ready() -> None:
    """Make the arguments of calls, and compile kernels."""
    quake, model, run = af.Motion.synthetic(duration=0.5, pga=1.0), _model(), _run()
    wave = af.Motion.synthetic(duration=4.0, pga=1.0, dt=0.01)
    ring, column, dead = _ring(), _column(), af.dead_load(model)
    lengths = {"thickness": 0.55, "voussoirs": 7, "width": 1.0, "gravity": 9.81, "chords": None}
    block = {"outline": ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), "material": af.STONE, "name": "a"}
    stiff = {"normal_stiffness": 1e9, "shear_stiffness": 1e9, "friction": 0.6, "cohesion": 0.0}
    joint = {"blocks": (0, 1), "intrados": (0.0, 0.0), "extrados": (1.0, 0.0)}
    target = af.Tbec2018(1.0, 0.3, "ZC")
    at = {"structure": ring}
    for function, given in (
        (af.circular_arch, {"radius": 2.95, "embrace": 159.0, **lengths}),
        (af.circular_arch, {"span": 3.0, "rise": 1.0, **lengths}),
        (af.column, {"breadth": 1.0, "heights": [1.0, 1.0], "width": 1.0, "gravity": 9.81}),
        (
            af.arch_on_piers,
            {"radius": 2.0, "pier_breadth": 1.0, "courses": [1.0, 1.0], **lengths},
        ),
        (af.shapes.Arch, {"name": "a", "span": 3.0, "rise": 1.0, "thickness": 0.4, "voussoirs": 7}),
        (af.shapes.Pier, {"name": "p", "gap": 1.0, "height": 2.0, "course": 0.5}),
        (
            af.shapes.Backfill,
            {"cover": 0.3, "erosion": 0.0, "hump": 0.0, "material": af.STONE},
        ),
        (
            af.bridge,
            {
                "arches": [
                    af.shapes.Arch(
                        measured="centre line",
                        name="a",
                        span=3.0,
                        rise=1,
                        thickness=0.4,
                        voussoirs=7,
                    )
                ],
                "width": 4.0,
                "gravity": 9.81,
                "chords": 2,
            },
        ),
        (af.Material, {"young": 3e10, "poisson": 0.2, "unit_weight": 2.6e4, "strength": 1e7}),
        (af.Contact, {**stiff, "dilatancy": 0.0, "tension": 0.0, "name": "c"}),
        (af.Block, {**block, "fixed": False, "part": "p", "role": "pier", "corners": None}),
        (af.Joint, {**joint, "contact": af.Contact(1e9, 1e9), "name": "joint"}),
        (af.Structure, {"blocks": column.blocks, "joints": column.joints, "width": 1.0}),
        (af.BodyForce, {"horizontal": 0.1, "vertical": 0.0}),
        (af.PointLoad, {"x": 0.1, "force": (0.0, -1.0)}),
        (af.Settlement, {"block": 0, "motion": (0.0, 0.0, 0.0)}),
        (af.Criteria, {"hinge": 0.46, "failures": 4, "friction": 0.6, "duration": 0.0}),
        (af.CountedMechanism, {"criteria": af.Criteria(failures=4), "kinds": ("local",)}),
        (af.Rayleigh, {"ratio": 0.05, "frequencies": (8.0, 16.0), "joints": "closed"}),
        (af.StiffnessDamping, {"ratio": 0.05, "frequency": 8.0, "joints": "closed"}),
        (af.HHT, {"alpha": -0.1}),
        (af.Record, {"every": 1, "fields_every": None}),
        (af.statics.Newton, {"tolerance": 1e-9, "petsc": {}}),
        (af.Motion, {"horizontal": np.zeros(5), "dt": 0.01, "vertical": np.zeros(5), "name": "a"}),
        (
            af.Motion.synthetic,
            {"duration": 1.0, "pga": 1.0, "seed": 1, "dt": 0.01, "vertical_ratio": 0.5},
        ),
        (quake.scaled, {"factor": 2.0}),
        (quake.cut, {"start": 0.1, "end": 0.4}),
        (quake.resampled, {"dt": 0.005}),
        (quake.with_vertical, {"other": quake}),
        (quake.at, {"times": np.zeros(3)}),
        (af.Suite, {"name": "s", "pairs": (quake,), "scale": 1.0, "reduction": 1.0}),
        (af.Tbec2018, {"ss": 1.0, "s1": 0.3, "site": "ZC"}),
        (af.Eurocode8, {"ag": 0.3, "ground": "B", "type": 1}),
        (target.horizontal, {"periods": [0.1, 1.0]}),
        (af.response_spectrum, {"motion": quake, "periods": [0.1, 1.0], "damping": 0.05}),
        (af.matched, {"motion": wave, "spectrum": target, "band": (0.1, 1.0), "damping": 0.05}),
        (af.build, {**at, "fidelity": "rigid", "cells": (2, 1), "degree": 1, "quadrature": None}),
        (
            af.build,
            {
                **at,
                "fidelity": "faces",
                "cells": (2, 1),
                "quadrature_points": 3,
                "max_cell_size": 0.5,
            },
        ),
        (af.dead_load, {"model": model, "newton": None}),
        (af.modes, {"model": model, "count": 2, "start": dead}),
        (af.pushover, {"model": _column_model(), "live": af.BodyForce(0.1), "start": None}),
        (af.collapse_factor, {**at, "live": af.BodyForce(0.1), "friction": None, "fill": None}),
        (af.stands, {**at, "friction": "coulomb"}),
        (af.moving_load, {**at, "axles": [1e4, 1e4], "spacings": [0.5], "positions": [0.0, 0.3]}),
        (af.rate, {**at, "vehicle": "LM1", "live": 1.5, "dead": 1.0, "friction": None}),
        (af.minimum_thickness, {"build": _of_thickness, "friction": "coulomb", "tolerance": 1e-3}),
        (af.verified_mechanism, {**at, "joints": dead.joints}),
        (af.first_mechanisms, {"run": run}),
        (run.joint, {"joint": "joint 1"}),
        (run.with_criteria, {"criteria": af.Criteria()}),
        (
            af.time_history,
            {
                "model": model,
                "motion": quake,
                "dt": 0.01,
                "start": dead,
                "damping": af.StiffnessDamping(0.05, 8.0),
                "scheme": None,
                "record": af.Record(),
                "until": None,
                "criteria": None,
                "newton": None,
                "method": "auto",
            },
        ),
        (af.mechanism_scales, {"model": model, "motion": quake, "dt": 0.01, "between": (0.5, 2.0)}),
        (af.Case.of, {"settings": tomllib.loads(BASES[0]), "folder": Path()}),
        (af.Case.read, {"path": "case.toml", "changes": ()}),
        (af.Motion.read, {"path": "record.txt", "column": None, "units": "g", "dt": 0.01}),
        (af.History.read, {"path": "history.nc", "structure": None}),
        (af.read_outlines, {"path": "drawing.geojson", "unit": "m", "snap": 1e-3, "layers": None}),
        (af.units.in_unit, {"value": "1 m", "unit": "m", "key": "x"}),
        (
            af.joint_stiffness,
            {"young": 3e10, "spacing": 0.5, "strength": 5e7, "poisson": 0.2, "rigid": False},
        ),
        (af.motion.TableSpectrum, {"periods": [0.1, 1.0], "values": [0.5, 0.2]}),
        (af.motion.scaled_to_spectrum, {"motion": quake, "value": 1.0, "period": 0.5}),
        (af.motion.Ntc2018, {"ag": 0.3, "f0": 2.5, "tc_star": 0.3, "site": "B"}),
        (af.motion.Asce2022, {"sds": 1.0, "sd1": 0.5, "tl": 6.0}),
        (af.masonry.fitted_circle, {"points": [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]}),
        (af.masonry.usual_stages, {**at, "layers": 2}),
        (af.masonry.assembled, {"blocks": column.blocks, "contact": af.Contact(1e9, 1e9)}),
        (
            af.shapes.pointed_arch,
            {"span": 3.0, "rise": 2.0, "thickness": 0.4, "voussoirs": 8, "chords": 2},
        ),
        (
            af.shapes.elliptical_arch,
            {"span": 3.0, "rise": 1.0, "thickness": 0.4, "voussoirs": 8, "chords": 2},
        ),
        (
            af.shapes.flat_arch,
            {"span": 2.0, "thickness": 0.4, "voussoirs": 7, "skewback": 30.0, "width": 1.0},
        ),
        (af.limit.Fill, {"friction_angle": 35.0, "cohesion": 0.0, "active": 1.0, "spread": 30.0}),
        (af.limit.counted_mechanism, {"joints": dead.joints, "kinds": ("local",)}),
        (af.joints.thrust_line, {**at, "joints": dead.joints}),
        (af.joints.joint_table, {"joints": dead.joints}),
        (af.statics.forces_on, {**at, "joints": dead.joints, "block": 1}),
        (af.statics.Stop, {"slope": 1e-6, "displacement": 0.1, "hinges": None, "steps": 10}),
        (
            af.models.Discretisation,
            {"fidelity": "rigid", "cells": (2, 1), "quadrature_points": None},
        ),
        (af.effective_damping, {"model": model, "ratio": 0.05, "start": dead}),
        (af.studies.converged, {"sizes": [4.0, 2.0, 1.0], "values": [1.0, 1.1, 1.12]}),
        (
            af.studies.stripe_fragility,
            {"levels": [1.0, 2.0, 3.0], "failures": [1, 3, 7], "motions": 10, "resamples": 20},
        ),
        (af.studies.parameter_axes, {"over": {"model.cells": [1, 2]}, "samples": None}),
    ):
        name = f"{len(CALLS)}: {getattr(function, '__qualname__', function)}"
        CALLS[name] = function, dict(given).copy


def _of_thickness(thickness: float) -> af.Structure:
    return af.circular_arch(radius=2.0, thickness=thickness, embrace=170.0, voussoirs=9)


@cache
def _ring() -> af.Structure:
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)


@cache
def _run() -> af.History:
    return af.time_history(_model(), af.Motion.synthetic(duration=0.5, pga=1.0), dt=0.01)


@cache
def _column() -> af.Structure:
    return af.column(breadth=1.0, heights=[1.0, 1.0])


@cache
def _model() -> Any:
    return af.build(_ring(), fidelity="rigid")


@cache
def _column_model() -> Any:
    return af.build(_column(), fidelity="rigid")


def trial(seed: int, number: int, folder: Path) -> Came:
    """Call one function with one or two odd arguments."""
    if not (folder / "case.toml").exists():
        (folder / "record.txt").write_text(RECORD)
        (folder / "drawing.geojson").write_text(DRAWING)
        (folder / "case.toml").write_text(BASES[0])
        _run().save(folder / "history.nc")
    rng = np.random.default_rng((seed, number))
    name = list(CALLS)[number % len(CALLS)]
    function, made = CALLS[name]
    given, odds = dict(made()), odd.NUMBERS + odd.WORDS + odd.OBJECTS
    for _ in range(rng.choice([1, 1, 2])):
        key = list(given)[int(rng.integers(len(given)))]
        given[key] = odds[int(rng.integers(len(odds)))]
    call_text = f"{name}({', '.join(f'{key}={_said(value)}' for key, value in given.items())})"

    def call() -> str | None:
        return _nonsense(function(**given))

    return judged(call, call_text)


def _said(value: Any) -> str:
    try:
        return repr(value)[:300]
    except ValueError:
        return "a huge number"


def _nonsense(answer: Any) -> str | None:
    """Whether a returned number is none."""
    if isinstance(answer, af.Structure):
        areas = [block.area for block in answer.blocks]
        return None if np.all(np.isfinite(areas)) and min(areas) > 0.0 else f"areas {areas}"
    if isinstance(answer, af.History):
        answer = answer.dataset[["N", "V", "M"]]
    if isinstance(answer, af.Motion):
        answer = np.append(answer.horizontal, answer.dt)
    if isinstance(answer, xr.Dataset):
        arrays = [answer[key].values for key in ("N", "V", "M") if key in answer]
    elif isinstance(answer, float | np.ndarray) and not np.ma.isMaskedArray(answer):
        arrays = [np.asarray(answer)]
    else:
        return None
    for values in arrays:
        if values.dtype.kind in "fc" and not np.isfinite(values).all():
            return f"numbers that are none: {values.ravel()[:5]}"
    return None
