"""How a case file says that time is stepped: damping and scheme."""

from archfem.cases.settings import Table
from archfem.dynamics.schemes import (
    HHT,
    Conserving,
    EffectiveDamping,
    Newmark,
    Rayleigh,
    Scheme,
    StiffnessDamping,
    Viscous,
    check_sliding,
    check_turning,
)
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure


def damping_asked(analysis: Table) -> Viscous | EffectiveDamping | None:
    """Return the damping that a case asks for; its frequencies may be left to the modes.

    Args:
        analysis: the table of that name.

    Raises:
        InvalidInput: it says too little, or too much.
    """
    if "damping" not in analysis:
        return None
    given = dict(analysis["damping"])
    keys = set(given) - {"joints"}
    if {"ratio", "modes"} <= keys <= {"ratio", "modes", "kind", "share"}:
        if given.pop("modes") == "effective" and (
            "share" not in given or given.get("kind") == "rayleigh"
        ):
            return EffectiveDamping(**given)
    elif keys == {"ratio", "frequency"}:
        return StiffnessDamping(**given)
    elif keys == {"ratio", "frequencies"} and len(given["frequencies"]) == 2:
        return Rayleigh(**{**given, "frequencies": tuple(given["frequencies"])})
    raise InvalidInput(
        f"analysis.damping = {analysis['damping']}: give a ratio and a frequency, e.g. "
        "{ ratio = 0.05, frequency = 8.0 }, two for Rayleigh damping, frequencies = [8.0, "
        '16.0], or modes = "effective" for them, with kind = "rayleigh" (and a share) for two'
    )


def scheme_asked(analysis: Table) -> Scheme:
    """Return the scheme that a case asks for.

    Args:
        analysis: the table of that name.

    Raises:
        InvalidInput: there is no such scheme, or it has no alpha.
    """
    name, alpha = analysis.get("scheme", "conserving"), analysis.get("alpha")
    known = {"conserving": Conserving, "newmark": Newmark, "hht": HHT}
    if name not in known or (alpha is not None and name != "hht"):
        raise InvalidInput(
            f"analysis.scheme = {name!r} with alpha {alpha}: use 'conserving', 'newmark', or "
            "'hht' and alpha"
        )
    return known[name]() if alpha is None else HHT(alpha)


def check_scheme(analysis: Table, structure: Structure, displacements: str = "small") -> None:
    """Refuse a scheme that cannot follow what the contacts say, in the words of the file.

    Args:
        analysis: the table of that name.
        structure: whose joints they are.
        displacements: "small" or "large".

    Raises:
        InvalidInput: joints slide or break, and the scheme has no memory; or blocks turn far, and
            it does not keep their energy.
    """
    if displacements == "large":
        check_turning(scheme_asked(analysis))
    try:
        check_sliding(scheme_asked(analysis), structure)
    except InvalidInput as error:
        name = analysis.get("scheme", "conserving")
        raise InvalidInput(
            f'analysis.scheme = {name!r}: {error}; in a case file, scheme = "conserving", or '
            'friction = "none" and no tension in the table of each of its [contacts]'
        ) from error
