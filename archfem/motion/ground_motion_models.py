"""Peak ground acceleration from magnitude, distance and ground, by published models of pygmm."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from math import exp
from typing import Any, Literal

from archfem._optional import require_package
from archfem._validation import check_number, validate_arguments
from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY

# Models for shallow earthquakes of active crust, by the name of their class in pygmm
GROUND_MOTION_MODELS: Mapping[str, str] = {
    "ASK14": "AbrahamsonSilvaKamai2014",
    "ASB14": "AkkarSandikkayaBommer2014",
    "BSSA14": "BooreStewartSeyhanAtkinson2014",
    "CB14": "CampbellBozorgnia2014",
    "CY14": "ChiouYoungs2014",
    "DBC14": "DerrasBardCotton2014",
    "I14": "Idriss2014",
}


@dataclass(frozen=True)
class PeakAccelerationEstimate:
    """Estimate of a peak ground acceleration, with a lognormal distribution.

    Attributes:
        model: name of the ground-motion model.
        median: median of the horizontal peak ground acceleration [m/s²].
        scatter: standard deviation of its natural logarithm, between and within events [-].
    """

    model: str
    median: float
    scatter: float

    @property
    def interval(self) -> tuple[float, float]:
        """Values that 84 % and 16 % of the peaks exceed: one standard deviation [m/s²]."""
        return self.median * exp(-self.scatter), self.median * exp(self.scatter)


@validate_arguments
def peak_ground_acceleration(
    magnitude: float,
    distance: float,
    *,
    v_s30: float,
    model: str = "BSSA14",
    mechanism: Literal["strike-slip", "normal", "reverse"] = "strike-slip",
    region: str | None = None,
    depth: float = 10e3,
) -> PeakAccelerationEstimate:
    """Estimate the peak ground acceleration at a site by a published ground-motion model.

    The one distance stands for every distance of a model: to the rupture, to its projection, and
    across a vertical fault. Only ASB14 has coefficients for the epicentral distance, which are
    used. Where a large rupture comes nearer than its epicentre, the estimate is too low.

    Args:
        magnitude: moment magnitude.
        distance: distance from the site [m].
        v_s30: mean shear wave velocity of the upper 30 m of the ground [m/s].
        model: one of `GROUND_MOTION_MODELS`.
        mechanism: mechanism of the fault.
        region: such as "turkey" with BSSA14; None takes the model's own default.
        depth: depth of the hypocentre [m]; of these models CB14 and DBC14 use it.

    Returns:
        Median and scatter.

    Raises:
        InvalidInput: the model or region is unknown, or a value is outside the model's range.
        NotInstalled: pygmm is missing.

    References:
        Gregor et al., Comparison of NGA-West2 GMPEs, Earthquake Spectra 30 (2014), for ASK14,
        BSSA14, CB14, CY14 and I14. Akkar, Sandıkkaya, Bommer (ASB14) and Derras, Bard, Cotton
        (DBC14), Bull. Earthquake Engineering 12 (2014).
    """
    if model not in GROUND_MOTION_MODELS:
        raise InvalidInput(
            f"ground-motion model {model!r} is unknown: use {', '.join(GROUND_MOTION_MODELS)}"
        )
    for key, value in (("distance", distance), ("depth", depth)):
        if 0.0 < check_number(value, f"{key} [m]", minimum=0.0) < 300.0:
            raise InvalidInput(f"{key} {value:g} m looks like kilometres: give metres")
    away = distance / 1e3
    names = ("dist_epi",) if model == "ASB14" else ("dist_jb", "dist_rup", "dist_x")
    keys: dict[str, Any] = dict.fromkeys(names, away)
    keys |= {"mag": check_number(magnitude, "magnitude"), "v_s30": v_s30, "dip": 90.0}
    keys["depth_hyp"] = depth / 1e3
    keys["mechanism"] = {"strike-slip": "SS", "normal": "NS", "reverse": "RS"}[mechanism]
    keys |= {} if region is None else {"region": region}
    with require_package("pygmm"):
        package = import_module("pygmm")
    kind = getattr(package, GROUND_MOTION_MODELS[model])
    _check_range(model, kind.PARAMS, keys)
    answer = kind(package.Scenario(**keys))
    median = float(answer.pga) * STANDARD_GRAVITY
    return PeakAccelerationEstimate(model, median, float(answer.ln_std_pga))


def _check_range(model: str, parameters: Any, keys: Mapping[str, Any]) -> None:
    """Refuse values outside the range of a model, which pygmm would only warn of."""
    known = {each.name: each for each in parameters}
    if "region" in keys and "region" not in known:
        raise InvalidInput(f"{model} has no regions: leave out region = {keys['region']!r}")
    for name in known.keys() & keys.keys():
        value, options = keys[name], getattr(known[name], "options", None)
        if options is not None:
            if value not in options:
                raise InvalidInput(f"{model}: {name} {value!r} is none of {options}")
            continue
        low, high = known[name].min, known[name].max
        if (low is not None and value < low) or (high is not None and value > high):
            raise InvalidInput(
                f"{model}: {name} = {value:g} is outside its range from {low} to {high} "
                "(distances and depths in km, velocities in m/s): choose another model"
            )
