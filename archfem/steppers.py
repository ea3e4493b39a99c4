"""Which stepper takes a run: the fastest that gives the history of the equilibrium solves."""

from archfem.compiled import chain, compliance, contact
from archfem.compiled.batches import CompiledStepper, Method
from archfem.compiled.chain import ChainMethod
from archfem.compiled.compliance import ComplianceMethod
from archfem.compiled.contact import ContactMethod
from archfem.dynamics import Stepper
from archfem.errors import InvalidInput
from archfem.models import Model
from archfem.models.jointed import Jointed
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.schemes import Rayleigh, Scheme

METHODS = ("auto", "contact", "chain", "compliance", "snes")

AnyStepper = Stepper | CompiledStepper


def stepper_for(
    method: str,
    model: Model,
    motion: Motion,
    *,
    damping: Rayleigh | None = None,
    scheme: Scheme | None = None,
    newton: Newton | None = None,
) -> AnyStepper:
    """The stepper of a run.

    Args:
        method: "snes", "contact", "chain", "compliance", or "auto": of the last three the
            fastest, by estimate, where one applies.
        model: any rung.
        motion: of the ground.
        damping: None is undamped.
        scheme: None is average acceleration.
        newton: settings of the equilibrium solves.

    Raises:
        InvalidInput: the method is not known, or does not apply to this model and damping.
    """
    if method not in METHODS:
        raise InvalidInput(f"method '{method}' is not known: use one of {METHODS}")
    fitting = {} if method == "snes" else _fitting(model, damping)
    if method == "auto":
        chosen = min(fitting, key=lambda name: fitting[name], default="snes")
    elif method == "snes" or method in fitting:
        chosen = method
    else:
        raise InvalidInput(
            f"the {method} stepper does not apply to a '{model.fidelity}' model of {model.size} "
            f"coordinates under this damping: contact needs at most {contact.LARGEST} of them and "
            f"damping on closed or initial joints, chain a bandwidth up to {chain.WIDEST}, and "
            "all three joints whose supports have not moved; use method='snes'"
        )
    exact = Stepper(model, motion, damping=damping, scheme=scheme, newton=newton)
    if chosen == "snes":
        return exact
    return CompiledStepper(_method(chosen, exact, damping), exact)


def _method(name: str, exact: Stepper, damping: Rayleigh | None) -> Method:
    if name == "chain":
        return ChainMethod(exact)
    if name == "compliance":
        return ComplianceMethod(exact, damping)
    return ContactMethod(exact, damping)


def _fitting(model: Model, damping: Rayleigh | None) -> dict[str, float]:
    """Compiled methods that apply, and about how long a step takes each [µs]."""
    if not isinstance(model, Jointed):
        return {}
    fitting = {}
    if contact.applies(model, damping):
        fitting["contact"] = contact.work(model)
    _, width = chain.order(model)
    if chain.applies(model, width):
        fitting["chain"] = chain.work(model, width)
    if compliance.applies(model):
        fitting["compliance"] = compliance.work(model)
    return fitting
