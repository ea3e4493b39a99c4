"""archfem: does a dry-stone arch or bridge survive an earthquake?

    import archfem as af

    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    model = af.build(ring, fidelity="full", cells=(4, 4))
    dead = af.dead_load(model)
    run = af.time_history(model, af.Motion.read("file.AT2"), start=dead)

SI units throughout. N > 0 is compression, eccentricity > 0 toward the extrados, gravity along -y.
Names that are slow to import, or need PETSc or FEniCSx, are loaded when first used, so that the
masonry side (structures, motions, limit analysis) works without them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from archfem import shapes as shapes
from archfem.actions import BodyForce as BodyForce
from archfem.actions import PointLoad as PointLoad
from archfem.actions import Settlement as Settlement
from archfem.assembly import assembled as assembled
from archfem.codes import Eurocode8 as Eurocode8
from archfem.codes import TableSpectrum as TableSpectrum
from archfem.codes import Tbec2018 as Tbec2018
from archfem.counted import Mechanism as Mechanism
from archfem.criteria import Criteria as Criteria
from archfem.errors import ArchfemError as ArchfemError
from archfem.errors import DidNotConverge as DidNotConverge
from archfem.errors import InvalidInput as InvalidInput
from archfem.errors import InvalidStructure as InvalidStructure
from archfem.materials import STONE as STONE
from archfem.materials import STONE_TO_STONE as STONE_TO_STONE
from archfem.materials import Contact as Contact
from archfem.materials import Material as Material
from archfem.motion import Motion as Motion
from archfem.resultants import thrust_line as thrust_line
from archfem.schemes import HHT as HHT
from archfem.schemes import Newmark as Newmark
from archfem.schemes import Rayleigh as Rayleigh
from archfem.shapes import arch_on_piers as arch_on_piers
from archfem.shapes import bridge as bridge
from archfem.shapes import circular_arch as circular_arch
from archfem.shapes import column as column
from archfem.spectra import response_spectrum as response_spectrum
from archfem.structure import Block as Block
from archfem.structure import Joint as Joint
from archfem.structure import Structure as Structure

if TYPE_CHECKING:
    from archfem.capacity import minimum_thickness as minimum_thickness
    from archfem.case import Case as Case
    from archfem.events import CountedMechanism as CountedMechanism
    from archfem.history import History as History
    from archfem.ladder import build as build
    from archfem.limit import collapse_factor as collapse_factor
    from archfem.limit import stands as stands
    from archfem.matching import matched as matched
    from archfem.mechanism import verified_mechanism as verified_mechanism
    from archfem.modal import modes as modes
    from archfem.modal_damping import effective_damping as effective_damping
    from archfem.newton import Newton as Newton
    from archfem.push import pushover as pushover
    from archfem.runs import Record as Record
    from archfem.runs import time_history as time_history
    from archfem.scales import mechanism_scales as mechanism_scales
    from archfem.statics import dead_load as dead_load
    from archfem.suite import Suite as Suite
    from archfem.survey import read_outlines as read_outlines
    from archfem.tradeoff import accuracy as accuracy
    from archfem.verdicts import first_mechanisms as first_mechanisms

__version__ = "0.1.0"

_LATER = {
    "minimum_thickness": "capacity",
    "Case": "case",
    "CountedMechanism": "events",
    "History": "history",
    "collapse_factor": "limit",
    "stands": "limit",
    "matched": "matching",
    "verified_mechanism": "mechanism",
    "build": "ladder",
    "modes": "modal",
    "effective_damping": "modal_damping",
    "Newton": "newton",
    "pushover": "push",
    "mechanism_scales": "scales",
    "Record": "runs",
    "time_history": "runs",
    "dead_load": "statics",
    "Suite": "suite",
    "read_outlines": "survey",
    "accuracy": "tradeoff",
    "first_mechanisms": "verdicts",
}


def __getattr__(name: str) -> Any:
    """Load a name when it is first used."""
    if name not in _LATER:
        raise AttributeError(f"module 'archfem' has no attribute {name!r}")
    return getattr(import_module(f"archfem.{_LATER[name]}"), name)
