"""A stack of blocks as one rigid body that rocks on its weakest joint.

A body of mass m and moment of inertia I about its centroid c turns by θ about an end P of its foot,
with r = c - P turned by θ. With the ground's acceleration a and I_P = I + m r²,

    I_P θ'' = m [r_y a_x - r_x (g + a_y)].

Where θ returns to zero, the body lands on the other end Q without bouncing. The angular momentum
about Q remains: θ' is multiplied by (I + m r_P·r_Q) / I_Q.

References:
    Housner, Bull. Seismol. Soc. Am. 53 (1963) 403.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot, inf, isfinite, log, pi
from typing import NamedTuple

import numpy as np

from archfem._typing import Array, Numbers
from archfem.dynamics.collapse_state import (
    DISLOCATION,
    FALLEN_STATES,
    RANGE_REMEDY,
    CollapseState,
    shallowest_part,
)
from archfem.dynamics.rigid_body.bodies import masses_of
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.models.model import Doubt
from archfem.motion.motion import Motion

# Step of the integration, and time after a motion in which a body falls or comes to rest [s]: the
# least pulses that overturn a block are those of exact integration to 0.1 %
STEP, REST = 1e-3, 20.0

# Largest ratio of scales that are run for the first fall: between them a body may fall or stand [-]
SCALE_RATIO = 1.01

# Rotation from which a body is lost, as any block [rad]
LOST = pi / 4.0


class Rocking(NamedTuple):
    """Response of a rocking body."""

    time: float  # of its fall; infinite where it stands [s]
    displacement: float  # the largest of a corner [m]


class FirstFall(NamedTuple):
    """Smallest multiple of a motion at which a body falls, of some within 1 % of each other."""

    scale: float  # infinite where it falls at none [-]
    again: tuple[float, float] | None  # least and largest beyond, at which it stands [-]


@dataclass(frozen=True)
class RockingBody:
    """One rigid body on a foot, turning about its right or left end."""

    joint: str  # name of the joint on which it rocks
    arms: tuple[tuple[float, float], ...]  # from the right and the left end to the centroid [m]
    inertia: float  # moment of inertia about the centroid, over the mass [m²]
    reach: tuple[float, ...]  # distance of the farthest corner from these ends [m]
    gravity: float  # [m/s²]
    friction: float  # of the foot [-]

    @property
    def foot(self) -> tuple[float, float]:
        """Direction of the foot, from its left to its right end (2,)."""
        (right, high), (left, low) = self.arms
        length = hypot(left - right, low - high)
        return (left - right) / length, (low - high) / length

    @property
    def start(self) -> float:
        """Least horizontal acceleration that turns it [m/s²]."""
        return min(self.gravity * abs(x) / y for x, y in self.arms)

    def rock(self, motion: Motion, scale: float = 1.0) -> Rocking | None:
        """Return the response to a multiple of a motion; None if the body slides."""
        (time,), (displacement,), (slides,) = self.rock_scaled(motion, np.array([scale]))
        return None if slides else Rocking(float(time), float(displacement))

    def rock_scaled(self, motion: Motion, scales: Array) -> tuple[Array, Array, Array]:
        """Return times of fall, displacements, and what slides, by multiples of a motion (k,)."""
        ground = motion.at(STEP * (np.arange(int((motion.duration + REST) / STEP)) + 0.5))
        starts, k = self._find_starts(ground, scales.max()), 0
        times, farthest = np.full(scales.shape, inf), np.zeros(scales.shape)
        slides, side = np.zeros(scales.shape, bool), np.zeros(scales.shape, int)
        # angles of bodies that have fallen or slid are not a number
        angle, speed, (x, y) = np.zeros(scales.shape), np.zeros(scales.shape), self.arms[1]
        while k < len(ground):
            still = (angle == 0.0) & (speed == 0.0)
            if (still | np.isnan(angle)).all():
                later = starts[np.searchsorted(starts, k) :]
                if not still.any() or not later.size:
                    break
                k = int(later[0])
            across, up = ground[k, 0] * scales, ground[k, 1] * scales + self.gravity
            # about the left end, or else the right one
            side = np.where(still, y * across > x * up, side)
            turn, slipping = self._accelerate((angle, speed, side), across, up)
            slides |= slipping
            angle[slipping] = np.nan
            angle, speed, side = self._advance(angle, speed, side, turn)
            far = 2.0 * np.array(self.reach)[side] * np.sin(0.5 * np.abs(angle))
            farthest = np.fmax(farthest, far)
            lost = np.abs(angle) > LOST
            times[lost], angle[lost] = STEP * (k + 1), np.nan
            k += 1
        return times, farthest, slides

    def _find_starts(self, ground: Array, scale: float) -> Numbers:
        """Return the steps in which a body at rest may turn or slide, at any multiple up to one."""
        across, up = scale * ground[:, 0], scale * ground[:, 1] + self.gravity
        (right, high), (left, low) = self.arms
        turns = (low * across > left * up) | (high * across < right * up)
        along = across * self.foot[0] + up * self.foot[1]
        normal = up * self.foot[0] - across * self.foot[1]
        return np.flatnonzero(turns | (np.abs(along) > self.friction * normal))

    def _accelerate(
        self, state: tuple[Array, Array, Array], across: Array, up: Array
    ) -> tuple[Array, Array]:
        """Return θ'' under accelerations of ground and weight, and what slides or lifts."""
        angle, speed, side = state
        x, y = np.array(self.arms)[side].T
        c, s = np.cos(angle), np.sin(angle)
        x, y = x * c - y * s, x * s + y * c
        turn = (y * across - x * up) / (self.inertia + x * x + y * y)
        turn[(angle == 0.0) & (speed == 0.0) & (turn * (2 * side - 1) <= 0.0)] = 0.0
        # the force on the foot, over the mass, along it and normal to it
        force = across - y * turn - x * speed**2, up + x * turn - y * speed**2
        along = force[0] * self.foot[0] + force[1] * self.foot[1]
        normal = force[1] * self.foot[0] - force[0] * self.foot[1]
        return turn, np.abs(along) > self.friction * normal

    def _advance(
        self, angle: Array, speed: Array, side: Array, turn: Array
    ) -> tuple[Array, Array, Array]:
        """Return angles, speeds and the ends about which bodies turn a step later."""
        speed = speed + STEP * turn
        after = angle + STEP * speed
        landing = np.flatnonzero((angle != 0.0) & (after * angle <= 0.0))
        if not landing.size:
            return after, speed, side
        side = side.copy()
        arms = np.array(self.arms)
        (x, y), (other, high) = arms[side[landing]].T, arms[1 - side[landing]].T
        moment = self.inertia + other * other + high * high
        share = angle[landing] / (angle - after)[landing]  # of the step until it lands
        kept = speed[landing] * np.maximum(self.inertia + x * other + y * high, 0.0) / moment
        # slower than what the weight stops within a step
        rests = np.abs(kept) < STEP * self.gravity * np.abs(other) / moment
        speed[landing] = np.where(rests, 0.0, kept)
        after[landing] = (1.0 - share) * STEP * speed[landing]
        side[landing] = np.where(rests, side[landing], 1 - side[landing])
        return after, speed, side

    def first_fall(self, motion: Motion, between: tuple[float, float]) -> FirstFall | None:
        """Return the first fall over multiples of a motion; None if it slides at a smaller one."""
        lower, upper = between
        scales = np.geomspace(lower, upper, int(np.ceil(log(upper / lower) / log(SCALE_RATIO))) + 1)
        times, _, slides = self.rock_scaled(motion, scales)
        fell = np.isfinite(times)
        first = int(fell.argmax()) if fell.any() else len(scales)
        if slides[:first].any():
            return None
        again = scales[first:][~(fell | slides)[first:]].tolist()
        return FirstFall([*scales.tolist(), inf][first], (again[0], again[-1]) if again else None)


def find_first_fall(
    structure: Structure, motion: Motion, between: tuple[float, float]
) -> FirstFall | None:
    """Return the first fall of a stack as one rigid body.

    It is None of other structures, and where the body slides.
    """
    if (body := find_rocking_body(structure)) is None:
        return None
    # from half of the push that turns it on, which a vertical motion may lower
    least, largest = max(between[0], 0.5 * body.start / max(motion.pga, 1e-3)), between[1]
    return body.first_fall(motion, (min(least, largest), largest))


def describe_first_fall(first: FirstFall | None) -> str:
    """Describe the result of `find_first_fall` behind that of courses; "" without one."""
    if first is None:
        return ""
    falls = f"first falls at {first.scale:#.3g} ×" if first.scale < inf else "falls at none"
    if first.again:
        ends = " to ".join(dict.fromkeys(f"{scale:#.3g}" for scale in first.again))
        falls += f", and stands again at {ends} ×"
    return f"; as one rigid body it {falls}"


def doubt_courses(structure: Structure, fall: CollapseState, motion: Motion) -> Iterator[Doubt]:
    """Yield a doubt of a stack that as one rigid body falls, stands or moves otherwise."""
    if (body := find_rocking_body(structure)) is None:
        return
    remedy = (
        f"{RANGE_REMEDY}, and compare with fewer courses and stiffer joints: bonded or tall "
        "courses act as one body"
    )
    one, falls = body.rock(motion), fall.kind in FALLEN_STATES
    if one is None:
        return
    if isfinite(one.time) and not falls:
        values = body.joint, one.time, fall.displacement
        words = "as one rigid body on '{}' it falls, at {:.2f} s, and in courses it moves by {:mm}"
        yield Doubt(words, remedy, values)
    elif falls and not isfinite(one.time):
        words = "as one rigid body on '{}' it does not fall, and moves by {:mm}"
        yield Doubt(words, remedy, (body.joint, one.displacement))
    elif not falls and one.displacement > max(
        2.0 * fall.displacement, DISLOCATION * shallowest_part(structure)[0]
    ):
        words = "as one rigid body on '{}' it moves by {:mm}, and in courses by {:mm}"
        yield Doubt(words, remedy, (body.joint, one.displacement, fall.displacement))


def find_rocking_body(structure: Structure) -> RockingBody | None:
    """Return the part of a stack above its weakest joint as one body.

    It is None of other structures, and where joints resist tension.
    """
    stack = _list_stack(structure)
    if stack is None or structure.tension.any() or find_yielding_blocks(structure):
        return None
    masses, centroids, bodies = masses_of(structure), structure.centroids, []
    for k, (joint, _) in enumerate(stack):
        own = [block for _, block in stack[k:]]
        share = masses[own, 0] / masses[own, 0].sum()
        centre = share @ centroids[own]
        apart = ((centroids[own] - centre) ** 2).sum(axis=1)
        inertia = masses[own, 1].sum() / masses[own, 0].sum() + share @ apart
        ends = sorted(structure.ends[joint].tolist(), reverse=True)
        corners = [point for block in own for point in structure.blocks[block].points.tolist()]
        reach = tuple(max(hypot(x - a, y - b) for x, y in corners) for a, b in ends)
        arms = tuple((float(centre[0] - a), float(centre[1] - b)) for a, b in ends)
        given = structure.joints[joint].name, arms, float(inertia), reach, structure.gravity
        bodies.append(RockingBody(*given, float(structure.friction[joint])))
    return min(bodies, key=lambda body: body.start)


def _list_stack(structure: Structure) -> list[tuple[int, int]] | None:
    """Return joint and block of each course from the ground on; None unless there is one stack."""
    stack, block = list[tuple[int, int]](), None
    beside: dict[int, list[tuple[int, int]]] = {}
    for number, (a, b) in enumerate(structure.pairs.tolist()):
        beside.setdefault(a, []).append((number, b))
        beside.setdefault(b, []).append((number, a))
    onward = [x for k, each in beside.items() if structure.blocks[k].fixed for x in each]
    while len(onward) == 1:
        stack += onward
        joint, block = onward[0]
        onward = [each for each in beside[block] if each[0] != joint]
    return stack if not onward and 2 <= len(stack) == len(structure.free) else None
