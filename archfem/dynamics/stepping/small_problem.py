"""The small problem of a step, in the joint points that open or slide alone; what solves it.

With z the gaps at the joint points, z₀ those if all joints held tension and nothing slid, and F
their compliance over a step,

    z = z₀ + F λ,    λ = λ(z),

λ what joints do not carry of that. It is `open_points` that solves it where joints open, at an
instant, and `sliding_points` where they open and slide, over a step: which, the type of the law
says as numba compiles what calls these.
"""

from collections.abc import Callable
from typing import Any

from numba.extending import overload

SETTLED = 1e-12
"""Error of a contact force, relative to the largest of all joints as if closed, that ends the
passes."""

ROUNDED = 10.0
"""How much more may be left once it does not fall any further: near a mechanism rounding weighs."""

EXACT = SETTLED * ROUNDED
"""The same that is left to rounding once the gaps of the whole structure are known."""

AHEAD = 2.0
"""Steps ahead for which it is foreseen which points may open."""


def expected(law: Any, gap: Any, before: Any, force: Any) -> Any:
    """Return which rows are at work, or will be soon if they go on as they did (p,).

    Args:
        law: of the joints.
        gap: that the law saw at the end of the last step (p,) [m].
        before: the same a step earlier (p,) [m].
        force: λ at the end of the last step (p,) [N].
    """
    raise NotImplementedError


def release(law: Any, start: Any, rows: Any, compliance: Any, force: Any, enough: Any) -> Any:
    """Find λ where it may differ from zero.

    Args:
        law: of the joints.
        start: z₀ (p,), of which the rows are used.
        rows: that may be at work, in order; of a facet both ends.
        compliance: `Compliance`, of which these rows and columns are used.
        force: λ, as a first guess (p,); changed at the rows.
        enough: error of λ that is left [N].

    Returns:
        Passes; -1 if it does not settle.
    """
    raise NotImplementedError


def unload(law: Any, gap: Any, rows: Any, compliance: Any, force: Any) -> None:
    """Take from gaps what λ opens, to have those if all joints held tension, z₀ = z - F λ.

    Args:
        law: of the joints.
        gap: z, then z₀, of which the rows are used (p,).
        rows: that may be at work, among them all of which λ is not zero.
        compliance: `Compliance`, of which these rows and columns are used.
        force: λ (p,).
    """
    raise NotImplementedError


def exact(law: Any, gap: Any, force: Any, near: Any) -> Any:
    """Return whether the gaps ask for the λ they were found with.

    Args:
        law: of the joints.
        gap: of the whole structure (p,) [m].
        force: λ (p,) [N].
        near: rows taken to be at work; those found to be, of a facet both ends, are added (p,).
    """
    raise NotImplementedError


def shift(law: Any, gap: Any) -> None:
    """Add to gaps found from displacements those before anything moves.

    Args:
        law: of the joints.
        gap: of all rows, changed (r,) [m].
    """
    raise NotImplementedError


def add_held(law: Any, opening: Any, right: Any) -> None:
    """Add to a right side what joints would carry more had nothing slid before the step.

    Args:
        law: of the joints.
        opening: rows of their gaps (r, n).
        right: side of the equation of a step, changed (n,).
    """
    raise NotImplementedError


def largest(law: Any, gap: Any) -> Any:
    """Return the largest force of a point if all joints held tension [N].

    Args:
        law: of the joints.
        gap: that the law saw at the end of the last step (p,) [m].
    """
    raise NotImplementedError


def is_of(law: Any, kind: type) -> bool:
    """Return whether this is the type of a kind of law.

    Args:
        law: as numba types it, or None where there is none.
        kind: of laws, a NamedTuple.
    """
    return getattr(law, "instance_class", None) is kind


def solved_by(kind: type, *solutions: tuple[Callable[..., Any], Callable[..., Any]]) -> None:
    """Say what solves the problem for a kind of law.

    Args:
        kind: of laws, a NamedTuple.
        *solutions: functions of this module, each with what to compile in its place.
    """
    for function, solution in solutions:

        def typed(law: Any, *_: Any, solution: Any = solution) -> Any:
            return solution if is_of(law, kind) else None

        overload(function, strict=False)(typed)
