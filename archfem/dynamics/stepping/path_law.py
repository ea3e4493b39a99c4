"""The joint law over a step, compiled: what joints carry on the mean, and what they do not.

The same law as `archfem.joints.passage`, written for loops. A row of gaps is an opening at a point,
or the slip that some points of a joint have in common; with all joints closed and none sliding
forces are linear in them. The law takes out of those

    λ = K z - f̄(z),

z the gaps at the middle of the path that the joints feel, which is zero where a joint stays closed
and holds.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.gap_rows import GapRows, gap_rows
from archfem.dynamics.stepping.joint_law import Law, law_of
from archfem.dynamics.stepping.newmark import Numbers
from archfem.joints.operator import JointOperator


class Work(NamedTuple):
    """What joints do over a step, as found last; filled anew by `press` and `slide`.

    Attributes:
        normal: mean normal forces, positive where they pull (p,) [N].
        area: mean closed area (p,) [m²].
        taken: λ (p,) [N].
        rate: its derivatives by z at both ends of the point's stretch (p, 2) [N/m].
        ends: λ of each stretch as of its near and far end (s, 2) [N].
        rates: derivatives of those by z there: near by near, each by the other, far by far
            (s, 3) [N/m].
        along: λ of each row of slips [N], and its derivative by z there [N/m] (g, 2).
        shear: mean shear forces (p,) [N].
        slid: what points slide (p,) [m].
        held: derivatives of the mean shear by its elastic change and by the limit (p, 2) [-].
        lost: energy that friction and damping take along each point (p,) [J].
        places: room for rows and columns of the derivatives of λ (m, 2).
        values: room for those derivatives (m,) [N/m].
    """

    normal: Array
    area: Array
    taken: Array
    rate: Array
    ends: Array
    rates: Array
    along: Array
    shear: Array
    slid: Array
    held: Array
    lost: Array
    places: Any
    values: Array


class PathLaw(NamedTuple):
    """The joint law over steps of one length, and the joints at the start of the step at hand.

    Attributes:
        still: the law at an instant.
        gain: change of a gap over the step per change of z [-].
        late: lag of damping over the length of the step [-].
        begin: first point of each stretch, and how many points there are (s + 1,).
        near: row of the opening at one end of each stretch (s,).
        far: of that at its other end (s,).
        stretch: to which each point belongs (p,).
        share: of the far end in the opening at each point, as in `gap_rows` (p,) [-].
        closed: derivatives of the normal force at a closed point by the openings at the ends of
            its stretch (p, 2) [N/m].
        stiffness: of rows of openings, the largest of their points (o,) [N/m].
        area: of each point, that of the whole facet where facets are exact (p,) [m²].
        friction: μ (p,) [-].
        cohesion: c (p,) [Pa].
        shear: elastic shear force per slip (p,) [N/m].
        group: row of each point's slip, -1 where slips are not followed (p,).
        first: where in `members` the points of each row of slips begin (g + 1,).
        members: points, sorted by their rows of slips (p,).
        offset: gaps before anything moves, of all rows (r,) [m].
        start: gaps at the start of the step, of all rows (r,) [m].
        speed: change of the gaps per step at their rates there (r,) [m].
        slid: how far points have slid for good before (p,) [m].
        guess: of z at all rows (r,) [m].
        stored: energy of joints before anything moves, if they held tension [J].
        work: room for what joints do over it.
    """

    still: Law
    gain: float
    late: float
    begin: Any
    near: Any
    far: Any
    stretch: Any
    share: Array
    closed: Array
    stiffness: Array
    area: Array
    friction: Array
    cohesion: Array
    shear: Array
    group: Any
    first: Any
    members: Any
    offset: Array
    start: Array
    speed: Array
    slid: Array
    guess: Array
    stored: float
    work: Work


def path_law(joints: JointOperator, numbers: Numbers, dt: float) -> tuple[PathLaw, Any]:
    """Return the law of some joints over steps, and the rows of their gaps.

    Args:
        joints: whose slips are followed where any of them can slide.
        numbers: of the time step.
        dt: its length [s].

    Returns:
        The law, and the rows: openings, then slips (r, n).
    """
    points, still, gaps = joints.points, law_of(joints), gap_rows(joints)
    count, rows = len(points.arm), len(gaps.offset)
    offset = np.zeros((2, count)) if joints.offset is None else joints.offset
    law = PathLaw(
        still,
        numbers.gain,
        numbers.lag / dt,
        gaps.begin,
        gaps.near,
        gaps.far,
        gaps.stretch,
        gaps.share,
        _closed(still, gaps.share),
        _largest(gaps, still.stiffness),
        still.stiffness / points.normal_stiffness,
        points.friction,
        points.cohesion,
        points.shear,
        gaps.group,
        np.append(0, np.cumsum(gaps.sizes)),
        np.argsort(gaps.group, kind="stable"),
        gaps.offset,
        np.zeros(rows),
        np.zeros(rows),
        np.zeros(count),
        np.zeros(rows),
        0.5 * float(np.sum(offset * joints.bonded(offset))),
        _room(count, len(gaps.near), len(gaps.sizes)),
    )
    return law, gaps.rows


def _largest(gaps: GapRows, stiffness: Array) -> Array:
    """The largest stiffness of the points of each row of openings (o,) [N/m]."""
    largest: Array = np.zeros(gaps.openings)
    for ends in (gaps.near, gaps.far):
        np.maximum.at(largest, ends[gaps.stretch], stiffness)
    return largest


def _closed(still: Law, share: Array) -> Array:
    """Derivatives of normal forces at closed points by openings at the ends of stretches (p, 2)."""
    ends = np.stack([1.0 - share, share], axis=1)
    if still.facets:
        other = ends.reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2)
        ends = ends / 3.0 + other / 6.0
    closed: Array = still.stiffness[:, None] * ends
    return closed


def _room(points: int, stretches: int, slips: int) -> Work:
    """Room for what joints do over a step."""
    normal, area, taken, shear, slid, lost = np.zeros((6, points))
    rate, held = np.zeros((2, points, 2))
    ends, rates = np.zeros((stretches, 2)), np.zeros((stretches, 3))
    most = 4 * stretches + slips + 2 * points
    places, values = np.zeros((most, 2), np.int64), np.zeros(most)
    along = np.zeros((slips, 2))
    return Work(
        normal, area, taken, rate, ends, rates, along, shear, slid, held, lost, places, values
    )
