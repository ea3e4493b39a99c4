"""Section [risk]: hazard of the site, sampling, and alternatives of the structure."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from archfem._validation import check_number
from archfem.cases.toml_file import check_table
from archfem.errors import InvalidInput
from archfem.motion.hazard import MEASURES, Hazard
from archfem.units import in_unit

# Intensities are in the unit of the measure, or have their own; the source is that of the curve
HAZARD_KEYS: dict[str, Any] = {"return_periods": ["1"], "rates": ["1"], "intensities": list}
HAZARD_KEYS |= {"factor": "1", "exponent": "1", "file": str, "site": int, "measure": str}
HAZARD_KEYS |= {"period": "s", "source": str}
RISK_KEYS: dict[str, Any] = {"hazard": dict, "samples": int, "precision": "1", "seed": int}
RISK_KEYS |= {"alternatives": dict}
ALTERNATIVE_KEYS: dict[str, Any] = {"weight": "1", "set": [str]}


@dataclass(frozen=True)
class RiskSettings:
    """Risk analysis of a case."""

    hazard: Hazard
    # by label, weight and changed values of the case, as `--set`
    alternatives: Mapping[str, tuple[float, tuple[str, ...]]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)  # of `collapse_risk`


def parse_risk(table: Any, folder: Path) -> RiskSettings:
    """Return the risk analysis of a case."""
    values = check_table(table, RISK_KEYS, "risk")
    if "hazard" not in values:
        raise InvalidInput(
            "risk has no hazard: give hazard = { return_periods = [475, 2475], intensities = "
            '["4 m/s**2", "7 m/s**2"] }, rates in place of periods, factor and exponent, or a file'
        )
    hazard = parse_hazard(values.pop("hazard"), folder)
    alternatives = {}
    for label, row in values.pop("alternatives", {}).items():
        given = check_table(row, ALTERNATIVE_KEYS, f"risk.alternatives.{label}")
        weight = check_number(given.get("weight", 1.0), f"weight of {label!r}", minimum=0.0)
        alternatives[str(label)] = weight, tuple(given.get("set", ()))
    return RiskSettings(hazard, alternatives, values)


def parse_hazard(table: Any, folder: Path) -> Hazard:
    """Return a hazard curve from its table."""
    values = check_table(table, HAZARD_KEYS, "risk.hazard")
    source = values.pop("source", "")
    options: Any = {key: values.pop(key) for key in ("measure", "period") if key in values}
    if set(values) <= {"file", "site"} and "file" in values:
        if options:
            raise InvalidInput("risk.hazard: a file names its measure and period: leave them out")
        return Hazard.read(folder / values["file"], values.get("site", 0), source)
    options["source"] = source
    if set(values) == {"factor", "exponent"}:
        return Hazard.power(values["factor"], values["exponent"], **options)
    unit = MEASURES.get(options.get("measure", "pga"), "m/s²").replace("²", "**2")
    numbers = [in_unit(x, unit, "risk.hazard.intensities") for x in values.pop("intensities", [])]
    if set(values) == {"return_periods"} and len(numbers) == len(values["return_periods"]):
        points = dict(zip(values["return_periods"], numbers, strict=True))
        return Hazard.from_return_periods(points, **options)
    if set(values) == {"rates"} and len(numbers) == len(values["rates"]):
        return Hazard(np.array(numbers), np.array(values["rates"]), **options)
    raise InvalidInput(
        f"risk.hazard has {sorted(values)}: give intensities with as many return_periods or rates, "
        "factor and exponent, or a file"
    )
