"""Warnings of limit analysis: why a factor may be an upper estimate, or no bound."""

from collections.abc import Sequence
from math import hypot

from archfem._typing import Array
from archfem.errors import logger
from archfem.limit.nonassociated import NonassociatedBounds
from archfem.masonry.loads import Action, PointLoad
from archfem.masonry.structure import Structure, join_joint_names
from archfem.units import Ends, Usual, kN


def warn_lift(loads: Sequence[Action]) -> None:
    """Warn of a load at a point that lifts, as one does whose sign is wrong."""
    for load in loads:
        if isinstance(load, PointLoad) and load.force[1] > 0.0:
            logger.warning(
                "the point load at x = %.4g m acts upwards by %.4g kN, and lifts the structure: a "
                "weight is negative, as in (0, -1)",
                *(load.x, load.force[1] / kN),
            )


def warn_dilatancy(structure: Structure) -> None:
    """Warn of contact dilatancy that sliding without dilatancy neglects."""
    steepest = max(joint.contact.dilatancy for joint in structure.joints)
    if steepest > 0.0:
        logger.warning(
            "joints dilate by up to %.3g, which friction='nonassociated' neglects: the factor is "
            "that of joints which slide flat; 'coulomb' gives that of joints which dilate by μ",
            steepest,
        )


def warn_sliding(structure: Structure, sliding: Sequence[int], factor: float) -> bool:
    """Warn of joints that slide and dilate, of curved faces as one; return if there are any."""
    if names := [*dict.fromkeys(structure.face_names[k] for k in sliding)]:
        logger.warning(
            "joints slide (%s): with the dilatancy of associated flow the factor %.4g is an "
            "upper estimate; friction='nonassociated' does without it",
            *(join_joint_names(names), factor),
        )
    return bool(names)


def warn_locking(structure: Structure, friction: str | None, fill: object) -> None:
    """Warn of a fill in pieces, which associated flow may lock so that no load is too large."""
    if friction is not None and fill is None and any(block.grain for block in structure.blocks):
        logger.warning(
            "an infinite factor is that of a fill in pieces which dilates by tan φ as it slides: "
            "it may lock between the stones, as soil does not; cut smaller pieces, or give "
            "fill=af.limit.Fill(…)"
        )


def warn_lost_solution(solutions: NonassociatedBounds) -> None:
    """Warn where the weakest was found by chance, or the factor rises suddenly with friction."""
    least, tried = solutions.between[0], solutions.starts[0]
    if solutions.interrupted:
        words = "a weaker solution without dilatancy may exist: the search was interrupted after %d"
        logger.warning(f"{words} starting states; run it to its end", tried)
    elif solutions.may_be_less and solutions.agreeing < 2:
        found = f"only one of {tried} starting states led to the least found, {least:.4g}"
        if not solutions.agreeing:
            found = (
                f"the least found, {least:.4g}, is below what all {tried} starting states led to: "
                "a descent from the least of these found it"
            )
        logger.warning(
            "a weaker solution without dilatancy may exist: %s; hold a push a tenth below, by "
            "[motion] held",
            found,
        )
    if solutions.jumps:
        share, factor = solutions.path[-1]
        logger.warning(
            "a weaker solution without dilatancy is likely: the least found is %.4g, but %.4g with "
            "%.3g times the friction, from which the factor should rise little",
            *(least, factor, share),
        )


def describe_closing(thrusts: Array, structure: Structure) -> str:
    """Say that joints are rigid, and by how much elastic ones would shorten a ring, Σ N/(k_n A)."""
    closing, stiffness = dict[str, float](), set[float]()
    for joint, thrust in zip(structure.joints, thrusts, strict=True):
        if joint.role == "ring" and thrust > 0.0:
            each, (a, b) = joint.contact.normal_stiffness, (joint.intrados, joint.extrados)
            area = structure.width * hypot(b[0] - a[0], b[1] - a[1])
            closing[joint.part] = closing.get(joint.part, 0.0) + thrust / (each * area)
            stiffness.add(each)
    words = "joints are rigid; elastic ones close, so that a ring sinks and bears less"
    if not stiffness:
        return words
    usual = " (default)" * all(isinstance(each, Usual) for each in stiffness)
    by, of = 1e3 * max(closing.values()), f"{Ends.of([k / 1e9 for k in stiffness]):.3g}"
    return f"{words}: with k_n {of} MPa/mm{usual} the thrust shortens it by {by:.2g} mm"
