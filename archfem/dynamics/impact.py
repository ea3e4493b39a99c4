"""Impacts of a block that rocks: what damping loses of its turning, and damping for a wanted loss.

A rigid block on rigid ground that lands without bouncing keeps the angular momentum about its new
edge: its turning slows to r = 1 - 3/2 sin² α of what it was, tan α = breadth / height (Housner,
Bull. Seismol. Soc. Am. 53 (1963) 403). On a joint of finite stiffness the block rolls over its
edge instead, and r is what damping makes it, with no closed form: near 1 where there is hardly any,
and less the more there is. So it is measured, on the block let go from a tilt.
"""

from dataclasses import dataclass
from math import atan, exp, log, pi, sqrt, tau

import numpy as np
from scipy.optimize import brentq

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.dynamics.schemes import StiffnessDamping, Viscous
from archfem.dynamics.stepping.choice import stepper_for
from archfem.dynamics.stepping.equation import Equation
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.rings import column
from archfem.models.model import Model
from archfem.models.rigid import rigid
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import dead_load, self_weight
from archfem.units import G

TILT = 0.5
"""Tilt from which the block is let go, over α [-]."""

IMPACTS = 2
"""Impacts over which r is averaged."""

FINE = 20.0
"""Steps in a period of the block that bounces on its whole base."""

LONGEST = 1e-3
"""Step [s] that soft joints are not to exceed."""

RATIOS = (0.05, 3.0)
"""Least and largest damping of the bounce on the whole base, of critical [-]: below, the joint
still rings when the next impact comes; above, what the swing between loses shows."""

SLENDER = 1.2
"""Least height over breadth: a block as broad as high hardly rocks."""


@dataclass(frozen=True)
class _Block:
    """A rectangular block, one metre wide, on a joint."""

    breadth: float
    height: float
    contact: Contact
    material: Material

    def __post_init__(self) -> None:
        instance(self.contact, Contact, "contact", "give a Contact")
        instance(self.material, Material, "material", "give a Material")
        breadth, height = real(self.breadth, "breadth [m]"), real(self.height, "height [m]")
        if breadth <= 0.0 or height < SLENDER * breadth:
            raise InvalidInput(
                f"a block {breadth} m broad and {height} m high does not rock as a rule of impacts "
                f"asks: its height is to be {SLENDER} times its breadth at least"
            )
        least = 0.75 * breadth * height / (breadth**2 + height**2)
        if self.contact.coefficient < least:
            raise InvalidInput(
                f"a block {breadth} m broad and {height} m high slides before it turns back where "
                f"the coefficient of friction is {self.contact.coefficient:g}: it needs {least:.2f}"
            )

    @property
    def model(self) -> Model:
        """The block, rigid on an exact joint."""
        structure = column(
            breadth=self.breadth,
            heights=[self.height],
            contact=self.contact,
            material=self.material,
        )
        return rigid(structure, rule=Quadrature("exact"))

    @property
    def tilt(self) -> float:
        """From which the block is let go [rad]."""
        return TILT * atan(self.breadth / self.height)

    @property
    def bounce(self) -> float:
        """Circular frequency of the block on its whole base [rad/s]."""
        mass = self.material.unit_weight * self.height / G
        return sqrt(self.contact.normal_stiffness / mass)

    @property
    def rocking(self) -> float:
        """Frequency of turning about the middle of the closed base [Hz]."""
        return self.bounce * self.breadth / (2.0 * sqrt(self.breadth**2 + self.height**2)) / tau

    @property
    def housner(self) -> float:
        """Restitution of rigid impacts."""
        return 1.0 - 1.5 * self.breadth**2 / (self.breadth**2 + self.height**2)

    def damping(self, ratio: float) -> StiffnessDamping:
        """Damping with a ratio of the bounce, told at the frequency of turning."""
        lag = 2.0 * ratio / self.bounce
        return StiffnessDamping(pi * lag * self.rocking, self.rocking)

    def restitution(self, damping: Viscous | None) -> float:
        """Mean over some impacts, by the energies at the turning points."""
        model, dt = self.model, min(LONGEST, tau / self.bounce / FINE)
        dead, weight = dead_load(model), -float(self_weight(model)[1])
        inertia = weight / G * (self.breadth**2 + self.height**2) / 3.0
        swing = sqrt(2.0 * self.tilt * inertia / (weight * self.breadth / 2.0))
        end = (2.0 * IMPACTS + 0.5) * swing
        equation = Equation(model, Motion(np.zeros(2), end), damping)
        start = equation.at_rest(self.tilted(weight), memory=dead.model.memory)
        angle, energy = [self.tilt], [equation.energy(start)]
        for batch in stepper_for("contact", equation, start, dt).batches(start, dt, end):
            angle += [-batch.state(k).q[2] for k in range(len(batch.times))]
            energy += list(batch.energy)
        rest = equation.energy(equation.at_rest(dead.q, memory=dead.model.memory))
        above = np.array(energy)[:, :2].sum(axis=1) - rest[:2].sum()
        return _slowed(np.array(angle), above)

    def tilted(self, weight: float) -> Array:
        """Coordinates of the block tilted to the right about an edge that bears what it weighs."""
        strip = sqrt(2.0 * weight / (self.contact.normal_stiffness * self.tilt))
        lift = self.tilt * (self.breadth / 2.0 - strip)
        return np.array([self.tilt * self.height / 2.0, lift, -self.tilt])


def _slowed(angle: Array, energy: Array) -> float:
    """Turning after an impact over that before, from energies at the largest tilts to each side."""
    landings = np.flatnonzero(angle[1:] * angle[:-1] < 0.0) + 1
    sides = np.split(np.arange(len(angle)), landings)
    if len(sides) <= IMPACTS:
        return 0.0
    turns = [side[np.argmax(np.abs(angle[side]))] for side in sides[: IMPACTS + 1]]
    return float((energy[turns[-1]] / energy[turns[0]]) ** (0.5 / IMPACTS))


def restitution(
    damping: Viscous | None,
    breadth: float,
    height: float,
    *,
    contact: Contact = STONE_TO_STONE,
    material: Material = STONE,
) -> float:
    """Return what a rocking block keeps of its turning at an impact, ω after over ω before.

    A rigid block on exact joints is let go half way to its overturning; r is the mean of the first
    two impacts, each the square root of the energies at the turning points after and before it. It
    hardly depends on the tilt while the bounce of the block is less than critically damped.

    Args:
        damping: of the block and its joint; None is undamped.
        breadth: of the block [m].
        height: of the block [m], 1.2 times its breadth at least.
        contact: of its joint.
        material: of the block.

    Returns:
        r, about 1 where nothing is lost [-]; 0 where the block comes to rest before.

    Raises:
        InvalidInput: such a block would slide, or hardly rock.
        DidNotConverge: a step failed.
    """
    return _Block(breadth, height, contact, material).restitution(damping)


def restitution_damping(
    coefficient: float | None,
    breadth: float,
    height: float,
    *,
    contact: Contact = STONE_TO_STONE,
    material: Material = STONE,
) -> StiffnessDamping:
    """Return damping by which a rocking block keeps a wanted part of its turning at an impact.

    It is found by runs of the block, as by `restitution`, to 1e-4 of r. What serves one block and
    contact does not serve another: the impact of a stiffer joint is shorter. It serves large
    displacements as well, where r is the same to 0.005.

    Args:
        coefficient: ω after over ω before [-]; None is Housner's, 1 - 3/2 sin² α.
        breadth: of the block [m].
        height: of the block [m], 1.2 times its breadth at least.
        contact: of its joint.
        material: of the block.

    Returns:
        The damping, its ratio told at the frequency at which the block turns on its closed base.

    Raises:
        InvalidInput: no damping gives that coefficient, such a block would slide, or hardly rock.
        DidNotConverge: a step failed.
    """
    block = _Block(breadth, height, contact, material)
    wanted = block.housner if coefficient is None else real(coefficient, "restitution [-]")

    def beyond(logarithm: float) -> float:
        return block.restitution(block.damping(exp(logarithm))) - wanted

    low, high = map(log, RATIOS)
    most, least = beyond(low), beyond(high)
    if not least <= 0.0 <= most:
        raise InvalidInput(
            f"restitution {wanted:.4g} of a block {breadth} m by {height} m is out of reach of "
            f"damping: with k_n = {contact.normal_stiffness:.3g} Pa/m it goes from "
            f"{least + wanted:.3f} to {most + wanted:.3f}: give a value between"
        )
    return block.damping(exp(brentq(beyond, low, high, xtol=1e-3)))
