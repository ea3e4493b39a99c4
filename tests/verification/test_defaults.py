"""Default values of the arguments of the physics.

A script that leaves an argument out relies on its default as on any other number. The tables are a
second copy: a changed default changes the results of scripts, and is to be changed here too.
"""

import inspect
from importlib import import_module

from archfem.units import Usual

G = 9.81

STRUCTURE = {"width": 1.0, "gravity": G}
STEPS = {"cells": ((2, 2), (4, 4), (8, 8)), "steps": (0.01, 0.005, 0.0025)}
PERCENT = {"damping": 0.05}
PIERS = {"course": 0.4, "chords": 1}

MOTION = {
    "design_spectra.Eurocode8": {"type": 1, **PERCENT},
    "matching.matched": {"band": (0.05, 2.0), "tolerance": 0.05, **PERCENT},
    "matching.spectral_misfit": {"band": (0.05, 2.0), **PERCENT},
    "motion.Motion.synthetic": {
        **{"duration": 20.0, "pga": 0.3 * 9.80665, "seed": 0, "dt": 0.005},
        "vertical_ratio": 2.0 / 3.0,
    },
    "motion.Motion.held": {"rise": 1.0, "duration": 10.0, "dt": 0.005},
    "motion.Motion.significant": {"low": 0.05, "high": 0.95},
    "motion.Motion.baseline_corrected": {"degree": 6},
    "motion.Motion.band_passed": {"order": 4},
    "design_spectra.Ntc2018": {"topography": 1.0, **PERCENT},
    "design_spectra.Eurocode2024": {"topography": 1.0},
    "signal_processing.correct_baseline": {"degree": 6},
    "signal_processing.filter_band": {"order": 4},
    "signal_processing.find_significant_window": {"low": 0.05, "high": 0.95},
    "ground_motion_models.peak_ground_acceleration": {"depth": 10e3},
    "record_selection.select_records": {"count": 7, "scales": (1.0 / 3.0, 3.0)},
    "response_spectra.response_spectrum": PERCENT,
    "response_spectra.rotated_spectrum": {"percentile": 50.0, **PERCENT},
    "response_spectra.scaled_to_spectrum": PERCENT,
    "suite.Suite": {"scale": 1.0, "reduction": 1.0},
    "suite.Suite.paired": {"scale": 1.0, "reduction": 1.0},
    "suite.Suite.synthetic": {
        **{"horizontals": 6, "verticals": 3, "seed": 0, "duration": 20.0, "reduction": 1.0}
    },
    "suite.Suite.spectra": PERCENT,
}

MASONRY = {
    "loads.BodyForce": {"vertical": 0.0},
    "loads.AttachedLoad": {"weight": 0.0, "force": (0.0, 0.0)},
    "assembly.assembled": STRUCTURE,
    "block.Block.drawn": {"pieces": 16},
    "backfill.jointed_fill": {"cohesion": 0.0},
    "joint_closing.joint_stiffness": {"strength": 56e6, "stress": 5e4, "poisson": 0.2},
    "materials.Contact": {"friction": 0.6, "cohesion": 0.0, "dilatancy": 0.0, "tension": 0.0},
    "shapes.bridges.buttressed_arch": PIERS | STRUCTURE,
    "shapes.bridges.arcade": PIERS | STRUCTURE,
    "shapes.bridges.bridge": {"chords": 1} | STRUCTURE,
    "shapes.rings.pointed_arch": {"chords": 4} | STRUCTURE,
    "shapes.rings.elliptical_arch": {"chords": 4} | STRUCTURE,
    "shapes.rings.flat_arch": STRUCTURE,
    "shapes.rings.arch_along": {"chords": 4} | STRUCTURE,
    "shapes.bridge_parts.Pier": {"course": 0.4},
    "shapes.bridge_parts.Sidewall": {"course": 0.4, "above": 0.0, "setback": 0.4},
    "shapes.bridge_parts.Backfill": {"erosion": 0.0, "hump": 1.0, "spandrels": 0.0},
    "shapes.bridge_parts.Paving": {"length": 1.0},
    "shapes.rings.circular_arch": STRUCTURE,
    "shapes.rings.column": STRUCTURE,
    "shapes.rings.arch_on_piers": STRUCTURE,
    "construction.usual_stages": {"layers": 4},
    "structure.Structure": STRUCTURE,
    "survey.outlines.read_outlines": {"snap": 1e-3},
    "survey.outlines.surveyed": {"snap": 1e-3} | STRUCTURE,
}

BLOCKS = {
    "joints.criteria.Criteria": {"hinge": 0.46, "failures": 4, "duration": 1e-3},
    "limit.backfill.Fill": {
        "cohesion": 0.0,
        "mobilisation": 1.0 / 3.0,
        "active": 1.0,
        "spread": 30.0,
        "lever": 0.0,
        "backing_strength": 1e6,
    },
    "limit.support_movement.largest_movement": {"tolerance": 1e-4},
    "limit.thickness.minimum_thickness": {"tolerance": 1e-6},
    "models.discretisation.Discretisation": {"cells": (4, 4), "degree": 1},
    "models.fem.space.build_broken_space": {"degree": 1},
    "models.export.write_state": {"magnification": 1.0},
    "models.linear_blocks.build_rigid_model": {"cells": 4},
    "models.model.Prediction": {"small_displacement_error": 0.0},
    "statics.mechanism_assessment.kinematic_assessment": {
        **{"direction": 1.0, "q": 2.0, "confidence_factor": 1.35}
    },
    "statics.pushover.Stop": {"slope": 1e-6, "displacement": 0.1, "steps": 400},
    "statics.newton.Newton": {"tolerance": 1e-10},
}

SHAKEN = {
    "motion_scaling.collapse_scale": {"precision": 0.05, "between": (0.1, 10.0)},
    "damping.effective_mode_range": {"mass_share": 0.9, "initial_count": 32, "max_count": 1024},
    "damping.effective_damping": {"ratio": 0.05, "mass_share": 0.9},
    "model_selection.build": {"cells": (4, 4), "degree": 1, "tolerance": 0.005},
    "motion_scaling.mechanism_scales": {"precision": 0.05, "between": (0.05, 5.0)},
    "schemes.Newmark": {"beta": 0.25, "gamma": 0.5},
    "schemes.HHT": {"alpha": -0.1},
    "time_history.Record": {"every": 1},
    "accuracy.accuracy": STEPS,
    "analysis.Analysis": {"cells": (4, 4), "degree": 1, "tolerance": 0.005},
    "accuracy.candidate_settings": {"meshes": STEPS["cells"], "steps": STEPS["steps"]},
}

BOOTSTRAP = {"resamples": 500, "seed": 0}

STUDIES = {
    "convergence.mesh_sensitivity": {"cells": (2, 4, 8), "steps": STEPS["steps"]},
    "fragility.fragility": BOOTSTRAP,
    "fragility.stripe_fragility": BOOTSTRAP,
    "fragility.Fragility.band": {"share": 0.9},
    "fragility.Fragility.interval": {"share": 0.9},
    "evaluators.evaluate_scales": {"precision": 0.05, "between": (0.05, 5.0)},
    "result_store.format_table": {"max_rows": 50},
    "ida.ida": {"precision": 0.05, "between": (0.05, 10.0)},
    "variations.verdict_range": {"samples": 236, "seed": 0, "workers": 1},
}

VIEW = {
    "films.film.film": {"fps": 20.0, "size": (1280, 720)},
    "films.film.picture": {"size": (1280, 720)},
    "films.film.film_modes": {"swings": 1},
    "motions.draw_spectra": PERCENT,
    "structure.draw_displaced": {"magnification": 1.0},
    "studies.draw_study": {"reduction": 1.0},
}

CASES = {"run.DeadLoadResult": {"seconds": 0.0}, "run.Run": {"seconds": 0.0}}

TABLES = {"motion": MOTION, "masonry": MASONRY, "": BLOCKS, "dynamics": SHAKEN, "studies": STUDIES}
TABLES |= {"view": VIEW, "cases": CASES}
DEFAULTS = {
    f"{room}.{name}".lstrip("."): given
    for room, table in TABLES.items()
    for name, given in table.items()
}


def found(name):
    """The object of a path of names."""
    module, *inner = name.split(".")
    place = import_module("archfem")
    for each in (module, *inner):
        own = f"{getattr(place, '__name__', '')}.{each}"
        place = (
            import_module(own) if inspect.ismodule(place) and is_module(own) else vars(place)[each]
        )
    return place


def is_module(name):
    try:
        import_module(name)
    except ModuleNotFoundError:
        return False
    return True


def is_number(value):
    members = value if isinstance(value, tuple) else (value,)
    return bool(members) and all(
        is_number(each) if isinstance(each, tuple) else type(each) in (int, float, Usual)
        for each in members
    )


def default_numbers(name):
    """The arguments of a function whose default is a number, with that number."""
    function = found(name)
    function = getattr(function, "__func__", function)
    return {
        key: each.default
        for key, each in inspect.signature(function).parameters.items()
        if is_number(each.default)
    }


def test_defaults_are_those_of_this_table():
    """All numbers among them: a new default is to be added here too."""
    assert {name: default_numbers(name) for name in DEFAULTS} == DEFAULTS
