"""A stack of blocks as one rigid body that rocks on its weakest joint.

A body of mass m and moment of inertia I about its centroid c turns by θ about an end P of its foot,
with r = c - P turned by θ. With the ground's acceleration a and I_P = I + m r²,

    I_P θ'' = m [r_y a_x - r_x (g + a_y)].

Where θ returns to zero, the body lands on the other end Q without bouncing. The angular momentum
about Q remains: θ' is multiplied by (I + m r_P·r_Q) / I_Q.

References:
    Housner, Bull. Seismol. Soc. Am. 53 (1963) 403.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, isfinite, log, pi, sin
from typing import NamedTuple

import numpy as np

from archfem._numba import entry, kernel
from archfem._typing import Array
from archfem.dynamics.collapse_state import (
    DISLOCATION,
    FALLEN_STATES,
    RANGE_REMEDY,
    CollapseState,
    shallowest_part,
)
from archfem.dynamics.rigid_body.bodies import masses_of
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, list_stack
from archfem.models.model import Doubt
from archfem.motion.motion import Motion
from archfem.units import STANDARD_GRAVITY, Ends

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
    rocks: float = inf  # from which it rocks, by the horizontal peak alone [-]


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

    def rock(self, motion: Motion) -> Rocking | None:
        """Return the response to a motion; None if the body slides."""
        return self._rock_on(_sample_ground(motion))

    def first_fall(self, motion: Motion, between: tuple[float, float]) -> FirstFall | None:
        """Return the first fall over multiples of a motion; None if it slides at a smaller one."""
        lower, upper = between
        count = int(np.ceil(log(upper / lower) / log(SCALE_RATIO))) + 1
        scales, ground = np.geomspace(lower, upper, count).tolist(), _sample_ground(motion)
        found = [self._rock_on(ground, scale) for scale in scales]
        first = next((k for k, x in enumerate(found) if x and x.time < inf), count)
        if None in found[:first]:
            return None
        after = zip(scales[first:], found[first:], strict=True)
        again = [scale for scale, x in after if x and x.time == inf]
        ends, rocks = (again[0], again[-1]) if again else None, self.start / max(motion.pga, 1e-3)
        return FirstFall([*scales, inf][first], ends, rocks)

    def _rock_on(self, ground: Array, scale: float = 1.0) -> Rocking | None:
        """Return the response to a multiple of a sampled motion; None if the body slides."""
        body = self.arms, self.reach, self.foot, self.inertia, self.gravity, self.friction
        time, displacement, slides = rock_steps(ground, scale, body)
        return None if slides else Rocking(time, displacement)


def _sample_ground(motion: Motion) -> Array:
    """Return the accelerations in the middles of steps, of a motion and rest after it (k, 2)."""
    return motion.at(STEP * (np.arange(int((motion.duration + REST) / STEP)) + 0.5))


@entry
def rock_steps(ground, scale, body):  # type: ignore
    """Return when a body falls under a multiple of a motion, its displacement, whether it slides.

    The body is of the fields of `RockingBody`, with the direction of its foot.
    """
    arms, reach, _, inertia, gravity, _ = body
    angle, speed, side, displacement = 0.0, 0.0, 0, 0.0
    for k in range(len(ground)):
        across, up = scale * ground[k, 0], scale * ground[k, 1] + gravity
        # at rest: about the left end, or else the right one
        if angle == 0.0 and speed == 0.0:
            side = int(arms[1][1] * across > arms[1][0] * up)
        turn, slips = _accelerate(body, (angle, speed, side), across, up)
        if slips:
            return inf, displacement, True
        before, speed = angle, speed + STEP * turn
        angle += STEP * speed
        if before != 0.0 and angle * before <= 0.0:
            share = before / (before - angle)  # of the step until it lands
            speed, side = _land(arms, inertia, gravity, side, speed)
            angle = (1.0 - share) * STEP * speed
        displacement = max(displacement, 2.0 * reach[side] * sin(0.5 * abs(angle)))
        if abs(angle) > LOST:
            return STEP * (k + 1), displacement, False
    return inf, displacement, False


@kernel
def _accelerate(body, state, across, up):  # type: ignore
    """Return θ'' under accelerations of ground and weight, and whether it slides or lifts."""
    arms, _, foot, inertia, _, friction = body
    angle, speed, side = state
    # arm from the end to the centroid, turned
    c, s = cos(angle), sin(angle)
    x, y = arms[side][0] * c - arms[side][1] * s, arms[side][0] * s + arms[side][1] * c
    turn = (y * across - x * up) / (inertia + x * x + y * y)
    # at rest the foot supports what would turn it inwards
    if angle == 0.0 and speed == 0.0 and turn * (2 * side - 1) <= 0.0:
        turn = 0.0
    # the force on the foot, over the mass, along it and normal to it
    right, rise = across - y * turn - x * speed**2, up + x * turn - y * speed**2
    along, normal = right * foot[0] + rise * foot[1], rise * foot[0] - right * foot[1]
    return turn, abs(along) > friction * normal


@kernel
def _land(arms, inertia, gravity, side, speed):  # type: ignore
    """Return the speed kept at an impact, 0 where it comes to rest, and the end about it turns."""
    (x, y), (other, high) = arms[side], arms[1 - side]
    # the angular momentum about the other end is kept
    moment = inertia + other * other + high * high
    kept = speed * max(inertia + x * other + y * high, 0.0) / moment
    # slower than what the weight stops within a step
    if abs(kept) < STEP * gravity * abs(other) / moment:
        return 0.0, side
    return kept, 1 - side


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


def say_scale(scale: float, pga: float | None, of: str = "the motion") -> str:
    """Return a scale in words: as a peak acceleration where that of the motion is known."""
    if pga is None:
        return f"{scale:#.3g} × {of}"
    return f"{scale * pga / STANDARD_GRAVITY:#.3g} g ({scale:#.3g} × {of})"


def say_again(scales: Sequence[float]) -> str:
    """Say at which scales beyond a fall a structure does not fall, which it may between them."""
    ends = f"{Ends.of(scales):#.3g} ×"
    return f"does not fall at {'some scales from ' * (' to ' in ends)}{ends}"


def describe_first_fall(first: FirstFall, pga: float | None = None, of: str = "the motion") -> str:
    """Say at which scales of a motion a body falls, and beyond does not."""
    falls = f"first falls at {say_scale(first.scale, pga, of)}"
    falls = falls if first.scale < inf else "falls at none"
    return falls + (f", and {say_again(first.again)}" if first.again else "")


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
    stack = list_stack(structure)
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
