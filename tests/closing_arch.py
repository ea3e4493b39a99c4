"""Arch of rigid stones on joints that close along a hyperbola, explicit in time.

A formulation of its own, which imports nothing of archfem. A closing u has the pressure
σ = k u / (1 - u / c), and follows its tangent from 0.98 c on. Joints are integrated by Gauss's
rule on the closed part of their faces, where the pressure is smooth. Damping proportional to k is
the linear part of the law at u + b u'. Shear is that of a spring and a slider over the closed part
of the face. Forces follow from the virtual power of opening, slip and rotation.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Law:
    """Law of the joints; a closure of 0 is linear."""

    stiffness: float  # k, at the first touch [Pa/m]
    closure: float = 0.0  # c, the largest closing [m]
    shear: float = 1e10  # [Pa/m]
    friction: float = 0.70021
    share: float = 0.98  # closing over c beyond which the law is linear
    lag: float = 0.0  # b of damping proportional to k [s]

    @property
    def numbers(self):
        """Stiffness, closure, closing where the hyperbola ends, shear, friction and lag."""
        end = self.share * self.closure
        return np.array([self.stiffness, self.closure, end, self.shear, self.friction, self.lag])


class Arch:
    """Stones and joints of a scene of Arch-Bench whose first and last blocks are supports."""

    def __init__(self, path):
        scene = json.loads(Path(path).read_text(encoding="utf-8"))
        self.gravity = scene["gravity"]
        stones = [np.array(block["outline"]) for block in scene["blocks"][1:-1]]
        density = scene["blocks"][1]["density"] * scene["width"]
        self.inertia, self.centroids = map(np.array, zip(*map(_measure, stones), strict=True))
        self.inertia *= density
        ends = np.array([joint["ends"] for joint in scene["joints"]])  # inner, outer
        across = ends[:, 1] - ends[:, 0]
        self.depths = np.hypot(*across.T)
        self.angles = np.arctan2(across[:, 1], across[:, 0])
        self.middles = ends.mean(axis=1)

    def at_rest(self, law):
        """Positions, velocities and slips under gravity alone, after 3 s with strong drag."""
        state = *np.zeros((2, len(self.centroids), 3)), np.zeros(len(self.depths))
        self._march(law, state, (0.0, 0.0, 0.0, 40.0), 3.0)
        return state

    def falls(self, law, state, peak, end=4.0, pulse=0.25):
        """Whether a stone drops under a half sine of the ground with a peak in g."""
        state = tuple(part.copy() for part in state)
        return self._march(law, state, (peak * self.gravity, pulse, 0.0, 0.0), end)[0] < end

    def static_peak(self, law, state, end=32.0, way=0.016):
        """Largest horizontal acceleration in equilibrium, in g.

        A spring at the centre of mass draws all stones sideways, and its force passes the peak as
        its end moves on. Below 1 mm/s inertia and damping raise it by less than one per cent.
        """
        state = tuple(part.copy() for part in state)
        return self._march(law, state, (0.0, 0.0, way, 0.0), end)[1] / self.gravity

    def _march(self, law, state, action, end):
        """Integrate to an end, or to the fall of a stone; return the time and the largest pull."""
        places = self.centroids, self.middles, self.angles, self.depths
        numbers = law.numbers, np.array(action), self.gravity
        return march(places, self.inertia, state, numbers, end)


def _measure(outline):
    """Area and polar moment of area about the centroid, and the centroid."""
    x, y = outline.T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    area = cross.sum() / 2.0
    centroid = np.array([((x + u) * cross).sum(), ((y + v) * cross).sum()]) / (6.0 * area)
    polar = ((x * x + x * u + u * u + y * y + y * v + v * v) * cross).sum() / 12.0
    return (abs(area), abs(polar - area * (centroid @ centroid))), centroid


@numba.njit(cache=True)
def excess(closing, law):
    """Pressure of a closing in excess of the linear one, and its derivative."""
    k, c = law[0], law[1]
    inside = min(closing, law[2])
    rest = 1.0 - inside / c
    tangent = k / rest**2
    return k * inside / rest + tangent * (closing - inside) - k * closing, tangent - k


@numba.njit(cache=True)
def closed_part(middle, slope, depth):
    """Ends of the part of a face on which middle + slope y is above 0, y from its middle."""
    low, high = -0.5 * depth, 0.5 * depth
    if slope > 0.0:
        low = min(max(low, -middle / slope), high)
    elif slope < 0.0:
        high = max(min(high, -middle / slope), low)
    elif middle <= 0.0:
        high = low
    return low, high


@numba.njit(cache=True)
def press(middle, slope, rate, turning, depth, law):
    """Force and moment of the pressure on a face, its stiffness, and its closed length.

    The closing is middle + slope y, and its rate rate + turning y, y from the middle outward.
    """
    # linear law at the lagged closing
    middle_late, slope_late = middle + law[5] * rate, slope + law[5] * turning
    low, high = closed_part(middle_late, slope_late, depth)
    first, second, third = high - low, (high**2 - low**2) / 2.0, (high**3 - low**3) / 3.0
    force = law[0] * (middle_late * first + slope_late * second)
    moment = law[0] * (middle_late * second + slope_late * third)
    low, high = closed_part(middle, slope, depth)
    stiffness = law[0] * max(first, high - low)
    if law[1] > 0.0 and high > low:
        # the excess has a kink at its limit: each side by its own rule
        bend = low if slope == 0.0 else min(max((law[2] - middle) / slope, low), high)
        for start, stop in ((low, bend), (bend, high)):
            half = 0.5 * (stop - start)
            if half > 0.0:
                for k in range(len(NODES)):
                    y = start + half * (1.0 + NODES[k])
                    traction, tangent = excess(middle + slope * y, law)
                    weight = half * WEIGHTS[k]
                    force += weight * traction
                    moment += weight * traction * y
                    stiffness += weight * tangent
    return force, moment, stiffness, high - low


@numba.njit(cache=True)
def face_motion(b, j, places, motion):
    """Rotation and its rate of a stone; arm, displacement and velocity of its face at a joint."""
    (centroids, middles), (q, v) = places[:2], motion[:2]
    if b < 0 or b >= len(q):
        return 0.0, 0.0, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)
    c, s, rate = np.cos(q[b, 2]), np.sin(q[b, 2]), v[b, 2]
    x, y = middles[j, 0] - centroids[b, 0], middles[j, 1] - centroids[b, 1]
    arm = c * x - s * y, s * x + c * y
    moved = q[b, 0] + arm[0] - x, q[b, 1] + arm[1] - y
    return q[b, 2], rate, arm, moved, (v[b, 0] - rate * arm[1], v[b, 1] + rate * arm[0])


@numba.njit(cache=True)
def join(j, places, motion, law, forces):
    """Add the forces of a joint to those of its stones, and return its stiffness.

    Opening and slip are those of the later face relative to the earlier, in a frame at the mean
    of both angles: e outward along the face, n from the earlier to the later.
    """
    angles, depths, slips = places[2], places[3], motion[2]
    turn, turning, arm, at, going = face_motion(j - 1, j, places, motion)
    turn_after, turning_after, arm_after, at_after, going_after = face_motion(j, j, places, motion)
    x, y = at_after[0] - at[0], at_after[1] - at[1]
    xr, yr = going_after[0] - going[0], going_after[1] - going[1]
    angle = angles[j] + 0.5 * (turn + turn_after)
    e0, e1 = np.cos(angle), np.sin(angle)
    n0, n1 = e1, -e0
    half, mean = 0.5 * (turn_after - turn), 0.5 * (turning_after + turning)
    gap, slip = n0 * x + n1 * y, e0 * x + e1 * y
    slope, lever = 2.0 * np.sin(half), np.cos(half)
    # rates: the frame turns with the mean angle
    gap_rate, slip_rate = n0 * xr + n1 * yr + mean * slip, e0 * xr + e1 * yr - mean * gap
    slope_rate = lever * (turning_after - turning)
    face = press(-gap, slope, -gap_rate, slope_rate, depths[j], law)
    force, moment, stiffness, length = face
    shear = 0.0
    if length > 0.0:
        # elastic shear of the closed length, which slides at Coulomb's limit; then damping
        most, spring = law[4] * force, law[3] * length
        shear = min(max(spring * (slip - slips[j]), -most), most)
        slips[j] = slip - shear / spring
        shear = min(max(shear + law[5] * spring * slip_rate, -most), most)
    else:
        slips[j] = slip
    # virtual power: -force gap' + moment slope' + shear slip'
    f0, f1 = force * n0 - shear * e0, force * n1 - shear * e1
    couple = 0.5 * (force * slip + shear * gap)
    if j > 0:
        forces[j - 1, 0] -= f0
        forces[j - 1, 1] -= f1
        forces[j - 1, 2] -= arm[0] * f1 - arm[1] * f0 - moment * lever - couple
    if j < len(forces):
        forces[j, 0] += f0
        forces[j, 1] += f1
        forces[j, 2] += arm_after[0] * f1 - arm_after[1] * f0 - moment * lever + couple
    return stiffness


@numba.njit(cache=True)
def march(places, inertia, motion, numbers, end):
    """March positions and velocities of the stones, and slips of the joints, by symplectic Euler.

    The action is the peak and the time of a half sine, the way of the spring and the drag. The
    step follows the stiffest joint. Returns are the time at which a stone has dropped by 0.5 m, or
    that of the end, and the largest pull of the spring.
    """
    (law, action, gravity), (q, v, _) = numbers, motion
    forces, mass = np.zeros(q.shape), inertia[:, 0]
    time, largest, dt = 0.0, 0.0, 1e-6
    while time < end:
        ground = action[0] * np.sin(np.pi * time / action[1]) if time < action[1] else 0.0
        # a spring of 300 1/s² on the centre of mass, whose end is drawn away
        pull = 0.0
        if action[2] > 0.0:
            pull = 300.0 * (action[2] * (time / end) ** 2 - (mass * q[:, 0]).sum() / mass.sum())
        largest = max(largest, pull)
        forces[:, :2] = -action[3] * v[:, :2]
        forces[:, 0] += pull - ground
        forces[:, 1] -= gravity
        for b in range(len(q)):
            forces[b, :2] *= mass[b]
            forces[b, 2] = -inertia[b, 1] * action[3] * v[b, 2]
        stiffest = 0.0
        for j in range(len(q) + 1):
            stiffest = max(stiffest, join(j, places, motion, law, forces))
        for b in range(len(q)):
            for k in range(3):
                v[b, k] += dt * forces[b, k] / inertia[b, k // 2]
                q[b, k] += dt * v[b, k]
        time += dt
        # two stones that turn about the ends of a face have a quarter of the mass of one
        damped = law[5] * 4.0 * law[0] * places[3].max() / mass.min()
        dt = min(2e-5, 0.5 / (np.sqrt(4.0 * stiffest / mass.min()) + damped))
        if q[:, 1].min() < -0.5:
            break
    return time, largest
