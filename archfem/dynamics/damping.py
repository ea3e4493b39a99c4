"""Damping from the effective modes of a structure, or from the restitution of a rocking block.

*Effective modes.* Codes take as many modes, the lowest first, as together have 90 % of the mass
that can move (EN 1998-1, 4.3.3.3.1(3); ASCE 7-16, 12.9.1.1). The last of them is the last effective
mode here. The first effective mode is the lowest up to which the sum is 5 %. The same clause of EN
1998-1 does not permit such a share to be neglected. Both are independent of the mesh. Two other
definitions are not: modes with 5 % each, since neighbouring modes exchange their mass; and 90 % by
decreasing mass, which with hundreds of small modes of a fill depends on the number computed.

*Restitution.* A rigid block on rigid ground that lands without bouncing keeps its angular momentum
about the new edge. Its angular velocity decreases to r = 1 - 3/2 sin² α of that before, with
tan α = breadth / height (Housner, Bull. Seismol. Soc. Am. 53 (1963) 403). On a joint of finite
stiffness the block rolls over its edge instead, and r depends on damping: near 1 without, and less
with more. There is no closed form, so r is measured on a block released from a tilt.
"""

from dataclasses import dataclass, replace
from math import atan, exp, log, pi, sqrt, tau

import numpy as np
from scipy.optimize import brentq

from archfem._typing import Array
from archfem._validation import check_between, check_number, check_type, validate_arguments
from archfem.dynamics.schemes import (
    EFFECTIVE_MASS_SHARE,
    EffectiveDamping,
    Rayleigh,
    StiffnessDamping,
    Viscous,
    interpret_damping,
)
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.selection import stepper_for
from archfem.errors import InvalidInput, logger
from archfem.joints.quadrature import Quadrature
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.rings import column
from archfem.models.linear_blocks import build_rigid_model
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Start, Subject, dead_load, resolve_start, self_weight
from archfem.statics.modes import Modes, modes
from archfem.units import G

# Share of the mass along x up to the first effective mode (EN 1998-1, 4.3.3.3.1(3)) [-]
FIRST_MASS_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class EffectiveModeRange:
    """First and last mode effective along x."""

    modes: Modes  # all modes computed
    first: int  # number of the first, counted from 1
    last: int  # number of the last

    @property
    def frequencies(self) -> tuple[float, float]:
        """Frequencies of the first and the last mode [Hz]."""
        low, high = self.modes.frequencies[[self.first - 1, self.last - 1]]
        return float(low), float(high)

    @property
    def mass_share(self) -> float:
        """Share of the mass along x of all modes up to the last [-]."""
        return float(self.modes.mass_ratios[: self.last, 0].sum())

    @property
    def text(self) -> str:
        """First and last effective mode as text, and the four modes up to it with most mass."""
        ratios, frequencies = self.modes.mass_ratios[: self.last, 0], self.modes.frequencies
        large = ", ".join(
            f"{number + 1} ({frequencies[number]:.2f} Hz, {100.0 * ratios[number]:.1f} %)"
            for number in np.sort(np.argsort(-ratios)[:4])
        )
        return (
            f"modes {self.first} and {self.last}, the first and the last effective along x; up to "
            f"the last they have {100.0 * self.mass_share:.1f} % of the mass, most of it {large}"
        )


def effective_mode_range(
    model: Model,
    start: Start = None,
    *,
    mass_share: float = EFFECTIVE_MASS_SHARE,
    initial_count: int = 32,
    max_count: int = 1024,
) -> EffectiveModeRange:
    """Find the first and the last mode effective along x; the number of modes doubles as needed."""
    check_between(mass_share, "share of the mass [-]", FIRST_MASS_SHARE, 1.0)
    computed, shares = _modes_with_share(model, start, mass_share, initial_count, max_count)
    first = int(np.searchsorted(shares, FIRST_MASS_SHARE)) + 1
    last = min(int(np.searchsorted(shares, mass_share)) + 1, len(shares))
    if first >= last:
        raise InvalidInput(
            f"mode {last} alone has {100.0 * computed.mass_ratios[last - 1, 0]:.1f} % of the mass "
            "along x, and Rayleigh damping needs two modes: raise the share, give the frequencies, "
            "or take damping of kind 'stiffness'"
        )
    return EffectiveModeRange(computed, first, last)


def _modes_with_share(
    model: Model, start: Start, mass_share: float, initial_count: int = 32, max_count: int = 1024
) -> tuple[Modes, Array]:
    """Return modes that reach a share of the mass along x, and their cumulative shares (modes,)."""
    model, state = resolve_start(model, start)
    count = 0
    while count < min(max_count, model.size):
        count = min(max(initial_count, 2 * count), max_count, model.size)
        computed = modes(model, count, state)
        shares = np.cumsum(computed.mass_ratios[:, 0])
        if shares[-1] >= mass_share:
            break
    else:
        logger.warning(
            "%d modes, up to %.1f Hz, have only %.1f %% of the mass along x, not %.0f %%: the last "
            "of them is taken for the last effective one",
            *(count, computed.frequencies[-1], 100.0 * shares[-1], 100.0 * mass_share),
        )
    return computed, shares


@validate_arguments
def effective_damping(
    model: Model | Subject,
    ratio: float = 0.05,
    start: Start = None,
    *,
    kind: str = "stiffness",
    joints: str = "closed",
    mass_share: float = EFFECTIVE_MASS_SHARE,
) -> Viscous:
    """Return stiffness or Rayleigh damping with a ratio at modes effective along x.

    Stiffness damping drags no mass, so that blocks fly, rock and fall freely. The ratio is set at
    the first effective mode since most of the mass oscillates in it: in rings and arches on piers
    whose joints do not yet separate, the largest |e| is within 0.02 of that by Rayleigh damping.
    Set at the last effective mode it would be about 1 % at the first. Higher modes and landing
    blocks lose more than the ratio. At 5 % a block of 0.6 m by 2.4 m on a joint of 1 MPa/mm keeps
    0.965 of its angular velocity between landings. It keeps 0.912 by rigid impacts and 0.46 by
    Rayleigh damping (see `restitution`).

    Kind "rayleigh" sets the ratio at the first and the last effective mode, with less between them
    (Demirel and Aldemir, Buildings 11 (2021), section 2). Its mass part also drags loose blocks.

    Args:
        model: model of any fidelity, or an `archfem.Analysis`.
        ratio: damping ratio [-].
        start: state to linearise at: an equilibrium of this model; None for its dead load, which
            is computed first; "closed" for all joints closed.
        kind: "stiffness", or "rayleigh" for a mass part too.
        joints: bodies on which the stiffness part acts, as in `Rayleigh`.
        mass_share: with "rayleigh", share of the mass that can move along x of the modes up to the
            last effective one [-].

    Returns:
        The damping.

    Raises:
        InvalidInput: a value is out of range, or a single mode has the share.
        DidNotConverge: the structure is a mechanism in that state, or modes were not computed.
    """
    settings = EffectiveDamping(ratio, kind, joints, mass_share)
    return _find_frequencies(settings, *resolve_start(model, start))[0]


def resolve_effective_damping(
    given: Viscous | EffectiveDamping | str | None, model: Model, start: Start
) -> tuple[Viscous | None, str]:
    """Return damping with its frequencies, and a sentence on these and on where they are from."""
    damping = interpret_damping(given)
    if damping is None:
        return None, "damping: none"
    origin = ""
    if isinstance(damping, EffectiveDamping):
        damping, origin = _find_frequencies(damping, model, start)
    text = f"damping: {100.0 * damping.ratio:g} % at"
    if isinstance(damping, StiffnessDamping):
        return damping, f"{text} {damping.frequency:.2f} Hz, proportional to stiffness{origin}"
    low, high = damping.frequencies
    return damping, f"{text} {low:.2f} and {high:.2f} Hz{origin}"


def damping_kind(damping: Viscous | None) -> str:
    """Return the kind of a damping in words."""
    return "mass and stiffness" if isinstance(damping, Rayleigh) else "stiffness"


def vary_damping(
    given: Viscous | EffectiveDamping | str | None,
    model: Model,
    start: Start,
    kind: str | None,
    factor: float,
) -> Viscous | None:
    """Return damping of a kind, or of its own with None, with a multiple of the ratio."""
    damping, _ = resolve_effective_damping(given, model, start)
    if damping is None:
        return None
    ratio = factor * damping.ratio
    if kind in (None, damping_kind(damping)):
        return replace(damping, ratio=ratio)
    # the other kind has its frequencies from the effective modes too, or from the one that is given
    if isinstance(given, EffectiveDamping):
        other = "stiffness" if kind == "stiffness" else "rayleigh"
        effective = replace(given, ratio=ratio, kind=other)
        return _find_frequencies(effective, model, start)[0]
    if isinstance(damping, Rayleigh):
        return StiffnessDamping(ratio, damping.frequencies[0], damping.joints)
    return Rayleigh(ratio, (damping.frequency, 2.0 * damping.frequency), damping.joints)


def _find_frequencies(damping: EffectiveDamping, model: Model, start: Start) -> tuple[Viscous, str]:
    """Return damping at the effective modes about a state, and text on these modes."""
    if damping.kind == "rayleigh":
        both = effective_mode_range(model, start, mass_share=damping.mass_share)
        return Rayleigh(damping.ratio, both.frequencies, damping.joints), f"; {both.text}"
    computed, shares = _modes_with_share(model, start, FIRST_MASS_SHARE)
    first = min(int(np.searchsorted(shares, FIRST_MASS_SHARE)), len(shares) - 1)
    mass = f"has {100.0 * computed.mass_ratios[first, 0]:.1f} % of the mass"
    frequency = float(computed.frequencies[first])
    text = f"; mode {first + 1}, the first effective along x, {mass}"
    return StiffnessDamping(damping.ratio, frequency, damping.joints), text


@dataclass(frozen=True)
class _RockingBlock:
    """A rectangular block, one metre wide, on a joint."""

    breadth: float
    height: float
    contact: Contact
    material: Material

    def __post_init__(self) -> None:
        check_type(self.contact, Contact, "contact", "give a Contact")
        check_type(self.material, Material, "material", "give a Material")
        # squares of lengths that nobody means leave the range of floats
        breadth = check_number(self.breadth, "breadth [m]", maximum=1e4)
        height = check_number(self.height, "height [m]", maximum=1e4)
        min_slenderness = 1.2  # a block as broad as high barely rocks
        if breadth <= 0.0 or height < min_slenderness * breadth:
            raise InvalidInput(
                f"a block {breadth} m broad and {height} m high does not rock: its height must be "
                f"{min_slenderness} times its breadth at least"
            )
        min_friction = 0.75 * breadth * height / (breadth**2 + height**2)
        if self.contact.coefficient < min_friction:
            raise InvalidInput(
                f"a block {breadth} m broad and {height} m high slides before it turns back where "
                f"the coefficient of friction is {self.contact.coefficient:g}: it needs "
                f"{min_friction:.2f}"
            )

    @property
    def model(self) -> Model:
        """Rigid model of the block with exact joint integrals."""
        structure = column(
            breadth=self.breadth,
            heights=[self.height],
            contact=self.contact,
            material=self.material,
        )
        return build_rigid_model(structure, rule=Quadrature("exact"))

    @property
    def tilt(self) -> float:
        """Rotation at release, half way to overturning [rad]."""
        return 0.5 * atan(self.breadth / self.height)

    @property
    def bounce(self) -> float:
        """Circular frequency of the block bouncing on its whole base [rad/s]."""
        mass = self.material.unit_weight * self.height / G
        return sqrt(self.contact.normal_stiffness / mass)

    @property
    def rocking(self) -> float:
        """Frequency of rotation about the middle of the closed base [Hz]."""
        return self.bounce * self.breadth / (2.0 * sqrt(self.breadth**2 + self.height**2)) / tau

    @property
    def housner(self) -> float:
        """Restitution of rigid impacts by Housner [-]."""
        return 1.0 - 1.5 * self.breadth**2 / (self.breadth**2 + self.height**2)

    def damping(self, ratio: float) -> StiffnessDamping:
        """Return damping with a ratio in bouncing on the base, stated at the rocking frequency."""
        lag = 2.0 * ratio / self.bounce
        return StiffnessDamping(pi * lag * self.rocking, self.rocking)

    def measure_restitution(self, damping: Viscous | None, impacts: int = 2) -> float:
        """Return the mean restitution of the first impacts, from energies at the turning points."""
        # 20 steps in a period of the bounce, and at most 1 ms on soft joints
        model, dt = self.model, min(1e-3, tau / self.bounce / 20.0)
        dead, weight = dead_load(model), -float(self_weight(model)[1])
        inertia = weight / G * (self.breadth**2 + self.height**2) / 3.0
        swing = sqrt(2.0 * self.tilt * inertia / (weight * self.breadth / 2.0))
        end = (2.0 * impacts + 0.5) * swing
        equation = Equation(model, Motion(np.zeros(2), end), damping)
        start = equation.at_rest(self.tilt_coordinates(weight), memory=dead.model.memory)
        angle, energy = [self.tilt], [equation.energy(start)]
        for batch in stepper_for("auto", equation).batches(start, dt, end):
            angle += [-batch.state(k).q[2] for k in range(len(batch.times))]
            energy += list(batch.energy)
        rest = equation.energy(equation.at_rest(dead.q, memory=dead.model.memory))
        above = np.array(energy)[:, :2].sum(axis=1) - rest[:2].sum()
        return _restitution_from_energies(np.array(angle), above, impacts)

    def tilt_coordinates(self, weight: float) -> Array:
        """Return the coordinates of the block on its right edge, which carries its weight."""
        # a compressed strip s at the edge: k_n tilt s²/2 is the weight
        strip = sqrt(2.0 * weight / (self.contact.normal_stiffness * self.tilt))
        lift = self.tilt * (self.breadth / 2.0 - strip)
        return np.array([self.tilt * self.height / 2.0, lift, -self.tilt])


def _restitution_from_energies(angle: Array, energy: Array, impacts: int = 2) -> float:
    """Return the ratio of ω after and before an impact, from energies at the largest tilts."""
    landings = np.flatnonzero(angle[1:] * angle[:-1] < 0.0) + 1
    sides = np.split(np.arange(len(angle)), landings)
    if len(sides) <= impacts:
        return 0.0
    turns = [side[np.argmax(np.abs(angle[side]))] for side in sides[: impacts + 1]]
    # energy varies with ω², and the ratio spans all impacts
    return float((energy[turns[-1]] / energy[turns[0]]) ** (0.5 / impacts))


def restitution(
    damping: Viscous | None,
    breadth: float,
    height: float,
    *,
    contact: Contact = STONE_TO_STONE,
    material: Material = STONE,
) -> float:
    """Measure the restitution of a rocking block, the ratio of ω after to ω before an impact.

    A rigid block on exact joints is released half way to its overturning. r is the mean of the
    first two impacts, each the square root of the ratio of energies at the turning points. It is
    insensitive to the tilt while the bounce of the block is less than critically damped.

    Args:
        damping: damping of the block and its joint; None is undamped.
        breadth: breadth of the block [m].
        height: height of the block [m], 1.2 times its breadth at least.
        contact: contact of its joint.
        material: material of the block.

    Returns:
        r, about 1 where nothing is lost [-]; 0 where the block comes to rest before.

    Raises:
        InvalidInput: such a block would slide, or barely rock.
        DidNotConverge: a step failed.
    """
    return _RockingBlock(breadth, height, contact, material).measure_restitution(damping)


def restitution_damping(
    coefficient: float | None,
    breadth: float,
    height: float,
    *,
    contact: Contact = STONE_TO_STONE,
    material: Material = STONE,
) -> StiffnessDamping:
    """Return the stiffness damping that gives a rocking block a prescribed restitution.

    It is found by runs of the block, as by `restitution`, to 1e-4 of r. It holds for one block and
    contact only: the impact on a stiffer joint is shorter. With large displacements r is the same
    to 0.005. Where stones come loose, they rock on with the coefficient (`rocking_ratio`).

    Args:
        coefficient: restitution, ω after over ω before [-]; None is Housner's, 1 - 3/2 sin² α.
        breadth: breadth of the block [m].
        height: height of the block [m], 1.2 times its breadth at least.
        contact: contact of its joint.
        material: material of the block.

    Returns:
        The damping, its ratio at the frequency of rotation on the closed base.

    Raises:
        InvalidInput: no damping gives that coefficient, or such a block would slide or barely rock.
        DidNotConverge: a step failed.
    """
    block = _RockingBlock(breadth, height, contact, material)
    target = block.housner if coefficient is None else check_number(coefficient, "restitution [-]")

    def difference(logarithm: float) -> float:
        return block.measure_restitution(block.damping(exp(logarithm))) - target

    # Damping ratio of the bounce: below 0.05 the joint still rings at the next impact, above 3 the
    # losses of the swing between impacts show
    low, high = log(0.05), log(3.0)
    largest, smallest = difference(low), difference(high)
    if not smallest <= 0.0 <= largest:
        raise InvalidInput(
            f"restitution {target:.4g} of a block {breadth} m by {height} m is out of reach of "
            f"damping: with k_n = {contact.normal_stiffness:.3g} Pa/m it goes from "
            f"{smallest + target:.3f} to {largest + target:.3f}: give a value between"
        )
    found = block.damping(exp(brentq(difference, low, high, xtol=1e-3)))
    return replace(found, restitution=coefficient)
