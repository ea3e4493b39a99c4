"""Block materials and joint contacts, with presets of Demirel and Aldemir (2021)."""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from math import inf, nextafter
from typing import Annotated, Any

from archfem._typing import (
    Friction,
    Metres,
    NewtonsPerCubicMetre,
    NewtonsPerMetre,
    Pascals,
    PascalsPerMetre,
)
from archfem._validation import check_between, check_number, check_words, is_one_of
from archfem.errors import InvalidInput
from archfem.units import G, GPa, MPa, StatedWeight, Usual, kN

# Largest closing of a joint [m]: those measured are below 1 mm, so that more is in millimetres
MAX_CLOSURE = 0.02

# Coefficient of friction of dry joints where none is given [-]
USUAL_FRICTION = Usual(0.60)


def _check_range(item: Any, key: str, low: float, high: float, remedy: str) -> None:
    """Check that a field is a number between two values."""
    name = f"{key} of '{item.name}'"
    check_between(getattr(item, key), name, low, high, ends="[]", remedy=remedy)


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic block material in plane stress.

    Attributes:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        unit_weight: weight per volume [N/m³].
        strength: compressive strength [Pa], or None where unknown.
        name: name in tables and files.
        stands_for: thing that a block of it stands for besides itself, such as "press" for a beam
            with the weight of its load, or "floor"; then it may weigh more than any material, or,
            as of a course less broad than the width, less.
    """

    young: Pascals
    poisson: float
    unit_weight: NewtonsPerCubicMetre
    strength: Pascals | None = None
    name: str = "material"
    stands_for: str | None = None

    def __post_init__(self) -> None:
        """Check that the values are possible, which detects wrong units."""
        check_words(self.name, "name of a material")
        if self.stands_for is not None:
            check_words(self.stands_for, f"stands_for of '{self.name}'")
        heaviest = (1e6 if self.stands_for else 250.0) * kN
        heavy = "give a weight, not a density, in N/m³, e.g. 20 * kN"
        heavy += "; a block that carries more than itself says so, stands_for='press'"
        inside = nextafter(-1.0, 0.0), nextafter(0.5, 0.0)  # the bounds of ν make no material
        _check_range(self, "young", 1e3, 1e13, "give it in Pa, e.g. 30 * GPa")
        _check_range(self, "poisson", *inside, "stone has about 0.2")
        _check_range(self, "unit_weight", 1e-3, heaviest, heavy)
        # no building material weighs as little in N/m³ as soils and stones do in these units
        for low, high, unit, factor in ((1e3, 4e3, "kg/m³", G), (5.0, 50.0, "kN/m³", kN)):
            is_stated = self.stands_for is not None or isinstance(self.unit_weight, StatedWeight)
            if low <= self.unit_weight <= high and not is_stated:
                number = f"{self.unit_weight:.4g}"
                raise InvalidInput(
                    f"unit_weight {number} N/m³ of '{self.name}' looks like {unit}: give it in "
                    f"N/m³: {number} {unit} have {self.unit_weight * factor:.4g}; that of a "
                    f"course across the plane, scaled by its length, needs stands_for = "
                    f"'{COURSE_LENGTH}'"
                )
        if self.strength is not None:
            check_strength(self.strength, f"strength of '{self.name}'")


def check_strength(strength: float, name: str, most: float = 5e8) -> None:
    """Refuse a compressive strength that no masonry has, by a wrong unit [Pa]."""
    # lumps of dry clay have ten times the least, and basalt up to 400 MPa (from memory)
    check_number(strength, f"{name} [Pa], of which 5 MPa are 5e6,", minimum=5e4, maximum=most)


@dataclass(frozen=True)
class Contact:
    """Contact of two faces along a joint: dry, or bonded by mortar until the bond breaks.

    Dilatancy by saw teeth: after a slip s a point of a rough face is raised by tan ψ |s|, and
    lowered again as it slides back (Patton, Proc. 1st Congr. ISRM 1 (1966) 509-513). μ is the
    total resistance in either direction, with the effect of the teeth. Friction dissipates
    (μ - tan ψ) N |s| on the way up and (μ + tan ψ) N |s| on the way down.

    A bond is linear elastic in tension up to f_t; its shear limit is μ |t_n| + c in compression and
    c - μ t_n in tension. Without fracture energy it is brittle at each point: where either is
    exceeded, tensile strength and cohesion are lost irreversibly, and the point is dry with
    friction μ (Itasca, 3DEC: Mohr-Coulomb joint model with zero residual values). Breaking is
    checked at the end of each load step or time step.

    With fracture energies a bond softens linearly. Strengths are (1 - D) f_t and (1 - D) c. The
    damage D, up to 1, follows from the irreversible opening κ_n and all slip κ_s of a point:

        D = κ_n f_t / (2 G_I) + κ_s c / (2 G_II).

    Opening alone takes G_I to full separation, and slip alone G_II beside friction. This is the
    isotropic softening of Lourenço (Delft, 1996, section 4.2), with his exponential as a line.
    Unloading is elastic; faces touch again where the joint is closed, and pull again from κ_n on. D
    grows at the end of each load step, until it is in balance, or of each time step.

    Attributes:
        normal_stiffness: compression per closing of the joint, k_n [Pa/m].
        shear_stiffness: shear traction per elastic slip, k_s [Pa/m].
        friction: Coulomb's coefficient μ: the joint slides where |t_s| reaches μ |t_n| + c, and
            its slip is irreversible. None, stored as infinity, never slides: its shear is elastic
            in open and closed joints, as in Demirel and Aldemir (2021).
        name: name in tables and files.
        cohesion: c, over the closed part of the joint; without tension it persists as the joint
            slides, with tension it belongs to the bond, and is lost with it [Pa].
        dilatancy: tan ψ of the saw teeth, from 0 to μ; 0 slides flat [-].
        tension: tensile strength f_t of the bond, up to c / μ, the apex of Coulomb's limit; 0 has
            no bond [Pa].
        law: law of the user in place of this one, as `archfem.joints.JointLaw`, or None. The
            stiffnesses are then those of modes and damping, and friction is that of limit analysis
            and of the criteria; cohesion, dilatancy and tension are left to the law.
        closure: largest closing δ_m of a joint that stiffens as it closes, σ = k_n δ / (1 - δ/δ_m),
            whose tangent is k_n (1 + σ / (k_n δ_m))²; from 98 % of δ_m on the tangent stays. k_n is
            then the stiffness of a joint that just touches (Bandis, Lumsden and Barton 1983).
            None closes linearly [m].
        fracture_energy: G_I of a bond, at least f_t² / (2 k_n); None for brittle bonds [N/m].
        shear_fracture_energy: G_II, at least c² / (2 k_s); None takes G_I [N/m].

    Example:
        >>> af.Contact(1.48e9, 0.30e9, friction=0.6, cohesion=5e3).slides
        True
    """

    normal_stiffness: PascalsPerMetre
    shear_stiffness: PascalsPerMetre
    friction: Friction = USUAL_FRICTION
    name: str = "contact"
    cohesion: Pascals = 0.0
    dilatancy: float = 0.0
    tension: Pascals = 0.0
    law: Annotated[Any, dict] = None
    closure: Metres | None = None
    fracture_energy: NewtonsPerMetre | None = None
    shear_fracture_energy: NewtonsPerMetre | None = None

    def __post_init__(self) -> None:
        """Check that the values are possible, which detects wrong units."""
        check_words(self.name, "name of a contact")
        if is_one_of(self.friction, (None, inf)):
            object.__setattr__(self, "friction", inf)
        else:
            remedy = "give the coefficient, not the angle, or None for a joint that never slides"
            _check_range(self, "friction", 0.0, 10.0, remedy)
        for key in ("normal_stiffness", "shear_stiffness"):
            _check_range(self, key, 1e3, 1e16, "give it in Pa/m: 1 MPa/mm is 1e9")
        _check_range(self, "cohesion", 0.0, 1e9, "give it in Pa, e.g. 5 * kPa")
        # teeth are less steep than friction, and a bond ends at the apex of Coulomb's limit
        steepest = self.coefficient if self.slides else 0.0
        remedy = (
            "give tan ψ, not the angle, up to the coefficient of friction, which includes it; a "
            "joint that never slides does not dilate"
        )
        _check_range(self, "dilatancy", 0.0, steepest, remedy)
        apex = self.cohesion / self.coefficient if 0.0 < self.coefficient < inf else 1e9
        remedy = (
            "give the tensile strength in Pa, up to cohesion / friction, where Coulomb's limit ends"
        )
        _check_range(self, "tension", 0.0, apex, remedy)
        if self.closure is not None:
            remedy = "give the largest closing in m, e.g. 0.1e-3, or None for a linear joint"
            _check_range(self, "closure", 1e-7, MAX_CLOSURE, remedy)
            if self.tension > 0.0:
                raise InvalidInput(
                    f"tension {self.tension:.3g} Pa of '{self.name}' beside a closure: a bonded "
                    "joint closes linearly: leave out one of them"
                )
        self._check_fracture_energies()
        if self.law is not None:
            self._check_law()

    def _check_fracture_energies(self) -> None:
        """Check that a bond with fracture energies has at least the energy at its strength."""
        if self.fracture_energy is None and self.shear_fracture_energy is None:
            return
        if self.tension == 0.0 or self.fracture_energy is None:
            raise InvalidInput(
                f"fracture_energy {self.fracture_energy} of '{self.name}' beside a tension of "
                f"{self.tension:.3g} Pa and shear_fracture_energy {self.shear_fracture_energy}: a "
                "bond that softens has tension and fracture_energy: give both, or leave all out"
            )
        rows = [("fracture_energy", self.tension, self.normal_stiffness)]
        if self.slides:
            rows += [("shear_fracture_energy", self.cohesion, self.shear_stiffness)]
        for key, strength, stiffness in rows:
            value, least = getattr(self, key), 0.5 * strength**2 / stiffness
            value = self.fracture_energy if value is None else value
            if not check_number(value, f"{key} of '{self.name}'") > least:
                raise InvalidInput(
                    f"{key} {value:.3g} N/m of '{self.name}' is not above {least:.3g} N/m, the "
                    f"elastic energy of {stiffness:.3g} Pa/m at {strength:.3g} Pa: give more, "
                    "stiffer joints, or no fracture energies, for bonds that break at once"
                )

    def _check_law(self) -> None:
        """Check that a law of the user is frozen, and that it alone has cohesion and the like."""
        if not isinstance(self.law, Hashable) or isinstance(self.law, str | type):
            raise InvalidInput(
                f"law {self.law!r} of '{self.name}' is no frozen object: give an object of a class "
                "with @dataclass(frozen=True)"
            )
        for key in ("cohesion", "dilatancy", "tension", "closure", "fracture_energy"):
            if getattr(self, key):
                raise InvalidInput(
                    f"{key} {getattr(self, key):.3g} of '{self.name}' beside a law: leave it out: "
                    "it is part of the law"
                )

    def in_series(self, across: float, along: float) -> "Contact":
        """Return the contact with further compliances in series, across and along it [m/Pa]."""
        if self.closure is not None and across > 0.0:
            raise InvalidInput(
                f"'{self.name}' has a closure, and stone or soil in series with it: no such law "
                "exists: leave out the closure, or model the blocks with fidelity 'faces' or 'full'"
            )
        normal = 1.0 / (1.0 / self.normal_stiffness + across)
        shear = 1.0 / (1.0 / self.shear_stiffness + along)
        return replace(self, normal_stiffness=normal, shear_stiffness=shear)

    @property
    def damage_rates(self) -> tuple[float, float]:
        """Damage of a bond by irreversible opening and by slip; 0 of a brittle one [1/m]."""
        first, second = self.fracture_energy, self.shear_fracture_energy
        if first is None:
            return 0.0, 0.0
        return 0.5 * self.tension / first, 0.5 * self.cohesion / (second or first)

    @property
    def coefficient(self) -> float:
        """Coulomb's coefficient μ, infinite where the joint never slides [-]."""
        return inf if self.friction is None else self.friction

    @property
    def slides(self) -> bool:
        """Whether the joint can slide."""
        return self.coefficient < inf


# What a block of a wall across its plane stands for, whose weight is that of a course less broad
# than the wall
COURSE_LENGTH = "its length"

# Presets, Table 2 of Demirel and Aldemir (2021); it gives no μ for soil. The shear modulus of
# 2.60 MPa that it prints for backfill is that of an isotropic material, E / 2 (1 + ν).
STONE = Material(Usual(30.0 * GPa), Usual(0.2), Usual(20.0 * kN), Usual(56.0 * MPa), "stone")
BACKFILL = Material(Usual(6.25 * MPa), Usual(0.2), Usual(18.0 * kN), None, "backfill")
STONE_TO_STONE = Contact(Usual(1.48e9), Usual(0.30e9), USUAL_FRICTION, "stone to stone")
SOIL_TO_STONE = Contact(Usual(0.30e9), Usual(0.24e9), USUAL_FRICTION, "soil to stone")

# Named presets
MATERIAL_PRESETS = {material.name: material for material in (STONE, BACKFILL)}
CONTACT_PRESETS = {contact.name: contact for contact in (STONE_TO_STONE, SOIL_TO_STONE)}
