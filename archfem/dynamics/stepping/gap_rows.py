"""Which gaps of the joints are followed: those of which all others are linear.

Between plane faces the opening is linear along the joint, so two rows tell those of all its points.
Elsewhere it is linear along exact facets, of which neighbours share the gap where they meet, and
springs are followed one by one. Points whose slips are the same share a row of those.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.facets import Facets
from archfem.joints.operator import JointOperator

SAME = 1e-9
"""Difference of two rows of gaps, relative to the largest entry of their joint, below which they
are one."""


class GapRows(NamedTuple):
    """Rows of gaps, openings before slips, and how the gaps at the points follow from them.

    The joints are cut into stretches of points, of which each has the opening

        g = (1 - ξ) z[near] + ξ z[far].

    Attributes:
        rows: of the gaps (r, n).
        offset: gaps before anything moves (r,) [m].
        openings: how many of the rows are openings.
        begin: number of the first point of each stretch, and how many points there are (s + 1,).
        near: row of one end of each stretch (s,).
        far: row of its other end, the same where it has but one (s,).
        share: ξ of each point (p,) [-].
        group: row of each point's slip, -1 where slips are not followed (p,).
    """

    rows: sparse.csr_matrix
    offset: Array
    openings: int
    begin: Any
    near: Any
    far: Any
    share: Array
    group: Any

    @property
    def stretch(self) -> Any:
        """To which stretch each point belongs (p,)."""
        return np.repeat(np.arange(len(self.near)), np.diff(self.begin))

    @property
    def sizes(self) -> Any:
        """How many points each row of slips has (g,)."""
        return np.bincount(self.group[self.group >= 0], minlength=len(self.offset))[self.openings :]


def gap_rows(joints: JointOperator) -> GapRows:
    """Return the rows of gaps of some joints.

    Args:
        joints: whose slips are followed where any of them can slide.
    """
    points = joints.points
    offset = np.zeros((2, len(points.arm))) if joints.offset is None else joints.offset
    kept: list[int] = []
    slipping: list[int] = []
    stretches: list[Any] = []
    share, group = np.zeros(len(points.arm)), np.full(len(points.arm), -1)
    for joint in range(points.count):
        own = np.flatnonzero(points.joint == joint)
        gaps = _dense(joints.opening[own], offset[0][own])
        first, parts, share[own] = _stretches(joints, own, gaps)
        stretches.append(parts + np.array([own[0], len(kept), len(kept)]))
        kept += own[first].tolist()
        if joints.slides:
            first, number = _distinct(_dense(joints.slip[own], offset[1][own]))
            group[own] = number + len(slipping)
            slipping += own[first].tolist()
    begin, near, far = np.concatenate(stretches).T
    return GapRows(
        sparse.vstack([joints.opening[kept], joints.slip[slipping]], "csr"),
        np.concatenate([offset[0][kept], offset[1][slipping]]),
        len(kept),
        np.append(begin, len(points.arm)),
        near,
        far,
        share,
        np.where(group < 0, group, group + len(kept)),
    )


def _stretches(joints: JointOperator, own: Any, gaps: Array) -> tuple[Any, Any, Array]:
    """Rows kept of a joint; where its stretches begin, near and far row (s, 3); ξ of its points."""
    ends, shares = _between(joints.points.arm[own])
    if np.abs(gaps - (1.0 - shares) * gaps[ends[0]] - shares * gaps[ends[1]]).max() <= SAME:
        return np.array(ends), np.array([[0, 0, 1]]), shares.ravel()
    first, number = _distinct(gaps)
    step = 2 if isinstance(joints.law, Facets) else 1
    places = np.arange(len(own))
    parts = [places[::step], number[::step], number[step - 1 :: step]]
    return first, np.stack(parts, axis=1), (places % step).astype(float)


def _dense(rows: sparse.csr_matrix, offset: Array) -> Array:
    """Rows without their empty columns, and their offsets, each in parts of the largest (k, m)."""
    parts = rows[:, np.unique(rows.indices)].toarray(), offset[:, None]
    return np.hstack([each / max(np.abs(each).max(initial=0.0), 1e-300) for each in parts])


def _between(arm: Array) -> tuple[tuple[int, int], Array]:
    """The outermost of some points, and where the others lie between them (k, 1) [-]."""
    ends = int(arm.argmin()), int(arm.argmax())
    length = arm[ends[1]] - arm[ends[0]]
    return ends, ((arm - arm[ends[0]]) / (length if length > 0.0 else 1.0))[:, None]


def _distinct(rows: Array) -> tuple[Any, Any]:
    """The first of each kind of row, and of which kind each is (k,)."""
    found: list[int] = []
    number = np.empty(len(rows), int)
    for row, values in enumerate(rows):
        same = [k for k, first in enumerate(found) if np.abs(rows[first] - values).max() <= SAME]
        if not same:
            found.append(row)
        number[row] = same[0] if same else len(found) - 1
    return np.array(found), number
