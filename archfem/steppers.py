"""Which stepper takes a run: the fastest that gives the history of the equilibrium solves."""

from archfem import chain, contact
from archfem.chain import ChainStepper
from archfem.contact import ContactStepper
from archfem.dynamics import Stepper
from archfem.errors import InvalidInput
from archfem.models import Model
from archfem.models.jointed import Jointed
from archfem.motion import Motion
from archfem.newton import Newton
from archfem.schemes import Rayleigh, Scheme

METHODS = ("auto", "contact", "chain", "snes")

AnyStepper = Stepper | ContactStepper | ChainStepper


def stepper_for(
    method: str,
    model: Model,
    motion: Motion,
    *,
    damping: Rayleigh | None,
    scheme: Scheme | None,
    newton: Newton | None,
) -> AnyStepper:
    """The stepper of a run.

    Args:
        method: "snes", "contact", "chain", or "auto": of the last two the one with less work,
            where one applies.
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
            "both joints whose supports have not moved; use method='snes'"
        )
    if isinstance(model, Jointed) and chosen != "snes":
        kind = ContactStepper if chosen == "contact" else ChainStepper
        return kind(model, motion, damping=damping, scheme=scheme, newton=newton)
    return Stepper(model, motion, damping=damping, scheme=scheme, newton=newton)


def _fitting(model: Model, damping: Rayleigh | None) -> dict[str, float]:
    """Compiled steppers that apply, and about how much work a step is for each."""
    if not isinstance(model, Jointed):
        return {}
    fitting = {}
    if contact.applies(model, damping):
        fitting["contact"] = contact.work(model)
    _, width = chain.order(model)
    if chain.applies(model, width):
        fitting["chain"] = chain.work(model, width)
    return fitting
