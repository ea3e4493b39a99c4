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
from archfem.dynamics.stepping.chain import NO_CHAIN, Chain
from archfem.dynamics.stepping.gap_rows import GapRows, gap_rows
from archfem.dynamics.stepping.joint_law import Law, law_of
from archfem.dynamics.stepping.newmark import Numbers
from archfem.joints.operator import JointOperator

POINT = np.dtype(
    [
        ("stretch", np.int64),  # to which it belongs
        ("group", np.int64),  # row of its slip, -1 where slips are not followed
        ("share", float),  # of the far end in its opening, as in `gap_rows` [-]
        ("stiffness", float),  # across the joint; of a facet, that of the whole [N/m]
        ("near", float),  # its normal force if closed, by the openings at the near end of its
        ("far", float),  # stretch and at the far end [N/m]
        ("whole", float),  # its area; of a facet, that of the whole [m²]
        ("friction", float),  # μ [-]
        ("cohesion", float),  # c [Pa]
        ("elastic", float),  # shear force per slip [N/m]
        ("slid", float),  # how far it has slid for good before the step [m]
    ],
    align=True,
)
"""What is known of a point of a joint."""

PRESSED = np.dtype(
    [
        ("normal", float),  # mean normal force, positive where it pulls [N]
        ("area", float),  # mean closed area [m²]
        ("near", float),  # derivative of λ by z at the near end of its stretch
        ("far", float),  # and at the far end [N/m]
        ("shear", float),  # mean shear force [N]
        ("slides", float),  # over the step [m]
        ("by_change", float),  # derivative of the mean shear by its elastic change [-]
        ("by_limit", float),  # and by the limit [-]
        ("lost", float),  # energy that friction and damping take along it [J]
    ],
    align=True,
)
"""What a point does over a step."""

STRETCH = np.dtype(
    [
        ("begin", np.int64),  # its first point
        ("end", np.int64),  # the first one that is not its own
        ("near", np.int64),  # row of the opening at one end
        ("far", np.int64),  # and at the other
    ],
    align=True,
)
"""Points of a joint between which gaps are linear."""

CARRIED = np.dtype(
    [
        ("near", float),  # λ as of its near end [N]
        ("far", float),  # and of its far end
        ("first", float),  # derivative of the former by z there [N/m]
        ("mixed", float),  # of each by the other
        ("last", float),  # and of the latter
    ],
    align=True,
)
"""What a stretch does over a step."""


class Work(NamedTuple):
    """What joints do over a step, as found last; filled anew by `press` and `slide`.

    Attributes:
        points: records `PRESSED` (p,).
        stretches: records `CARRIED` (s,).
        along: λ of each row of slips [N], and its derivative by z there [N/m] (g, 2).
        places: room for rows and columns of the derivatives of λ (m, 2).
        values: room for those derivatives (m,) [N/m].
        some: room for numbers of stretches (s,).
        slips: room for numbers of rows of slips (g,).
    """

    points: Any
    stretches: Any
    along: Array
    places: Any
    values: Array
    some: Any
    slips: Any


class PathLaw(NamedTuple):
    """The joint law over steps of one length, and the joints at the start of the step at hand.

    What belongs to one point or stretch is a record: compiled functions take few arrays so.

    Attributes:
        still: the law at an instant.
        gain: change of a gap over the step per change of z [-].
        late: lag of damping over the length of the step [-].
        points: records `POINT` (p,).
        stretches: records `STRETCH` (s,).
        first: where in `members` the points of each row of slips begin (g + 1,).
        members: points, sorted by their rows of slips (p,).
        stiffness: of rows of openings, the largest of their points (o,) [N/m].
        along: of rows of slips, the sum of their points (g,) [N/m].
        offset: gaps before anything moves, of all rows (r,) [m].
        start: gaps at the start of the step, of all rows (r,) [m].
        speed: change of the gaps per step at their rates there (r,) [m].
        guess: of z at all rows (r,) [m].
        stored: energy of joints before anything moves, if they held tension [J].
        chain: of the joints, where blocks make one.
        work: room for what joints do over it.
    """

    still: Law
    gain: float
    late: float
    points: Any
    stretches: Any
    first: Any
    members: Any
    stiffness: Array
    along: Array
    offset: Array
    start: Array
    speed: Array
    guess: Array
    stored: float
    chain: Chain
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
    members = np.argsort(gaps.group, kind="stable")
    law = PathLaw(
        still,
        numbers.gain,
        numbers.lag / dt,
        _points(joints, gaps, still),
        _records(STRETCH, gaps.begin[:-1], gaps.begin[1:], gaps.near, gaps.far),
        np.append(0, np.cumsum(gaps.sizes)),
        members[gaps.group[members] >= 0],
        _largest(gaps, still.stiffness),
        _sheared(gaps, points.shear),
        gaps.offset,
        np.zeros(rows),
        np.zeros(rows),
        np.zeros(rows),
        0.5 * float(np.sum(offset * joints.bonded(offset))),
        NO_CHAIN,
        _room(count, len(gaps.near), len(gaps.sizes)),
    )
    return law, gaps.rows


def _records(kind: np.dtype[Any], *columns: Any) -> Any:
    """Records from one array, or one number, for each of their fields."""
    records = np.zeros(len(columns[0]), kind)
    for name, column in zip(kind.names or (), columns, strict=True):
        records[name] = column
    return records


def _points(joints: JointOperator, gaps: GapRows, still: Law) -> Any:
    """What is known of the points (p,)."""
    points = joints.points
    return _records(
        POINT,
        gaps.stretch,
        gaps.group,
        gaps.share,
        still.stiffness,
        *_closed(still, gaps.share).T,
        still.stiffness / points.normal_stiffness,
        points.friction,
        points.cohesion,
        points.shear,
        0.0,
    )


def _largest(gaps: GapRows, stiffness: Array) -> Array:
    """The largest stiffness of the points of each row of openings (o,) [N/m]."""
    largest: Array = np.zeros(gaps.openings)
    for ends in (gaps.near, gaps.far):
        np.maximum.at(largest, ends[gaps.stretch], stiffness)
    return largest


def _sheared(gaps: GapRows, shear: Array) -> Array:
    """The stiffness of each row of slips, of all its points (g,) [N/m]."""
    follows = gaps.group >= 0
    group = gaps.group[follows] - gaps.openings
    sheared: Array = np.bincount(group, shear[follows], len(gaps.sizes)).astype(float)
    return sheared


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
    most = 4 * stretches + slips + 2 * points
    return Work(
        np.zeros(points, PRESSED),
        np.zeros(stretches, CARRIED),
        np.zeros((slips, 2)),
        np.zeros((most, 2), np.int64),
        np.zeros(most),
        np.zeros(stretches, np.int64),
        np.zeros(slips, np.int64),
    )


def pairs_of(law: PathLaw) -> tuple[Any, Array]:
    """Return rows of gaps at which λ changes, and by which: of stretches, then of slips.

    Args:
        law: of the joints.

    Returns:
        Their numbers (q, 2), and the derivatives where joints are open and slide (q,) [N/m].
    """
    parts, points, found = law.stretches, law.points, []
    opens = np.zeros((len(parts), 4))
    for number, (begin, end, near, far) in enumerate(parts.tolist()):
        own = points[begin:end]
        first, last = (own["near"], own["far"])
        opens[number] = 0.0
        opens[number, 0] = (1 - own["share"]) @ first
        opens[number, 1:3] = (1 - own["share"]) @ last
        opens[number, 3] = own["share"] @ last
        found += [(near, near), (near, far), (far, near), (far, far)]
    values, stretch, openings = [*opens.ravel()], points["stretch"], len(law.stiffness)
    for group, along in enumerate(law.along):
        row, last = openings + group, -1
        found.append((row, row))
        values.append(along)
        for point in law.members[law.first[group] : law.first[group + 1]]:
            if stretch[point] != last:
                last = stretch[point]
                found += [(row, parts["near"][last]), (row, parts["far"][last])]
                values += [0.0, 0.0]
    return np.array(found, np.int64), np.array(values)
