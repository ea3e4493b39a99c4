"""Which rows of gaps are at work in a step: those that open or slide, and what presses on them.

They are foreseen before the step, and looked for again at the gaps that come out.
"""

from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.small_problem import AHEAD, EXACT, largest
from archfem.joints.moving.compiled import computing

LATER = 2.0
"""How much farther than to the guess gaps may go with what then works foreseen."""

RUBBING = 0.5
"""Share of its limit from which on the shear of a point that may open is taken to reach it."""


def foreseen(law, gap, before, force):  # type: ignore
    """Return which rows are at work, or will be soon if they go on as they did (r,).

    Args:
        law: `PathLaw`, of which the guess is made.
        gap: z of the last step (r,) [m].
        before: of the step before (r,) [m].
        force: λ of the last step (r,) [N].
    """
    works, near, openings = force != 0.0, force != 0.0, len(law.stiffness)
    if law.chain.half > 0:
        near[:] = True
    guess, start, speed = law.guess, law.start, law.speed
    for row in range(len(gap)):
        guess[row] = start[row] + speed[row] / law.gain
        if row < openings and gap[row] + AHEAD * (gap[row] - before[row]) > 0.0:
            works[row] = True
    if law.chain.half > 0:
        return near
    for part in law.stretches:
        if works[part.near] or works[part.far]:
            near[part.near] = near[part.far] = True
    _work_at(law, start + LATER * (guess - start), near, True)
    _add_rubbing(law, near)
    _involve(law, near)
    return near


@computing
def _add_rubbing(law, near):  # type: ignore
    """Add slips of stretches at work that are not far from their limit, as found last."""
    points, pressed = law.points, law.work.points
    for part in law.stretches:
        if not (near[part.near] and near[part.far]):
            continue
        for k in range(part.begin, part.end):
            point, found = points[k], pressed[k]
            limit = point.cohesion * found.area - point.friction * found.normal
            if point.group >= 0 and abs(found.shear) > RUBBING * limit:
                near[point.group] = True


@computing
def _involve(law, near):  # type: ignore
    """Add to rows of slips at work the openings that press on their points."""
    points, stretches = law.points, law.stretches
    for k in range(len(points)):
        if points[k].group >= 0 and near[points[k].group]:
            stretch = stretches[points[k].stretch]
            near[stretch.near] = near[stretch.far] = True


def fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds rows at work to near.

    Of rows that are near, λ is known to fit the guess, so that the gaps need but be that.

    Args:
        law: `PathLaw`, whose guess the gaps become.
        gap: z (r,) [m].
        force: λ (r,) [N].
        near: rows taken to be at work (r,).
    """
    across, along, guess, off = law.stiffness, law.along, law.guess, 0.0
    for row in range(len(gap)):
        if near[row]:
            stiffness = across[row] if row < len(across) else along[row - len(across)]
            off = max(off, stiffness * abs(gap[row] - guess[row]))
        guess[row] = gap[row]
    whole = off > EXACT * largest(law, gap)
    if _work_at(law, gap, near, whole):
        return not whole
    return False


@computing
def _work_at(law, gap, near, whole):  # type: ignore
    """Add to near what further rows are at work at some gaps.

    Looks at all rows if it is to, else at those that are not near.

    Returns:
        Whether there are none.
    """
    openings, more = len(law.stiffness), False
    count, other = _others(law, near, whole)
    stretches, slips = law.work.some[:count], law.work.slips[:other]
    press(law, gap, stretches)
    slide(law, gap, slips)
    parts, found, along = law.stretches, law.work.stretches, law.work.along
    for number in stretches:
        part, carried = parts[number], found[number]
        if carried.near != 0.0 or carried.far != 0.0:
            more = more or not (near[part.near] and near[part.far])
            near[part.near] = near[part.far] = True
    for row in slips:
        if along[row - openings, 0] != 0.0:
            more = more or not near[row]
            near[row] = True
    _involve(law, near)
    return not more


@computing
def _others(law, near, whole):  # type: ignore
    """Name stretches of which not both ends are near, and slips that are not; how many of each."""
    some, slips, count, other = law.work.some, law.work.slips, 0, 0
    for number in range(len(law.stretches)):
        part = law.stretches[number]
        if whole or not (near[part.near] and near[part.far]):
            some[count] = number
            count += 1
    for row in range(len(law.stiffness), len(near)):
        if whole or not near[row]:
            slips[other] = row
            other += 1
    return count, other
