"""Closing of dry joints: stiffness and largest closing, by the finish of faces or by a test.

Faces touch at their asperities. Joints are therefore softer than stone, and stiffen as they close:

    σ = k_i δ / (1 - δ/δ_m),   dσ/dδ = k_i (1 + σ/p_0)²,   p_0 = k_i δ_m,

the law of `Contact` with a `closure`. k_i and δ_m follow from the roughness and strength of the
faces by relations of mated rock joints. Faces of voussoirs are cut separately and do not mate. Such
a joint closes further by one factor at any stress: k_i is divided by it, δ_m multiplied, and p_0 is
that of mated faces. The factor is 1 by walls of sawn granite, and 3 to 4 by those of sandstone;
Bandis, Lumsden and Barton have about 2. The range here is from 1 to 4.

Judgements, not taken from publications on masonry, are roughness and strength of the faces for each
finish. Measurements are to be preferred: `fit_closing` takes them.

References:
    Bandis, Lumsden and Barton, Int. J. Rock Mech. Min. Sci. 20 (1983) 249-268: closure, initial
    stiffness, joints that do not match. Barton and Bandis, Proc. 23rd US Symp. Rock Mech. (1982)
    739-760: aperture. Barton and Choubey, Rock Mech. 10 (1977) 1-54: shear stiffness to the peak;
    profiles with which the eye compares a face, of JRC 0.4, 2.8, 5.8, 6.7, 9.5, 10.8, 12.8, 14.5,
    16.7 and 18.7. Vanin, Zaganelli, Penna and Beyer (2017), doi 10.1007/s10518-017-0188-5: moduli
    of the walls of Vasconcelos and Lourenço (2009) and Lourenço et al. (2005) by their stress.
    Lourenço, Computational strategies for masonry structures, Delft (1996): k_s by elasticity.
    Demirel and Aldemir, Buildings 11 (2021): 1.48 and 0.30 MPa/mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import log10, radians, sqrt, tan

import numpy as np

from archfem._files import align_columns
from archfem._typing import Array
from archfem._validation import (
    check_array,
    check_choice,
    check_number,
    validate_arguments,
    validate_methods,
)
from archfem.errors import InvalidInput
from archfem.masonry.materials import MAX_CLOSURE, Contact, Material
from archfem.masonry.structure import Joint, Structure, join_names
from archfem.units import GPa, MPa, mm

# Least and largest values of stones, beyond which units are wrong
SI_RANGES = {
    "young": (1e6, 1e13),
    "strength": (1e4, 1e11),
    "face_strength": (1e4, 1e11),
    "stress": (1.0, 1e9),
    "spacing": (1e-3, 100.0),
    "aperture": (1e-7, 0.02),
}

# Least and largest joint roughness coefficient JRC, and strength of the faces over that of the
# stone. Judgement: sawn faces are between profiles 1 and 3 of Barton and Choubey (1977), dressed
# ones between 2 and 5; hewn ones are weaker and between 3 and 7; weathered have a third.
FINISHES = {
    "sawn": (2.0, 4.0, 1.0),
    "dressed": (4.0, 8.0, 1.0),
    "hewn": (6.0, 12.0, 0.6),
    "weathered": (6.0, 12.0, 0.33),
}

# Factor on the closing of mated faces, from sawn granite to the sandstone that closes furthest [-]
MISMATCH = 1.0, 4.0

# Parameters of a contact that follow from a finish
FINISHED_KEYS = "normal_stiffness", "shear_stiffness", "closure"

# Strength of stones for which none is given [Pa]
USUAL_STRENGTH = 56.0 * MPa

# Stress at which the range of a finish is taken [Pa]
USUAL_STRESS = 0.05 * MPa

# Blocks softer than this are soil, whose faces have no finish [Pa]
LEAST_STONE_MODULUS = 1.0 * GPa

# Young's modulus of weak lime mortar [Pa] and thickness of its bed [m]: judgement
MORTAR_MODULUS = 0.1 * GPa, 1.0 * GPa
BED_THICKNESS = 10.0 * mm

# Finishes of faces, and a bed that fills their gap
CONDITIONS = *FINISHES, "mortar"


@validate_methods
@dataclass(frozen=True)
class JointStiffness:
    """Low, usual and high value of the stiffness and closure of a joint.

    Attributes:
        normal: normal stiffness k_n at the given stress [Pa/m].
        shear: shear stiffness k_s [Pa/m].
        initial: normal stiffness k_i of a joint that just touches [Pa/m].
        closure: largest closing δ_m [m]; infinite for mortar, which closes linearly. The softest
            joint closes furthest.
        sources: sources of the relations.
    """

    normal: tuple[float, float, float]
    shear: tuple[float, float, float]
    initial: tuple[float, float, float]
    closure: tuple[float, float, float]
    sources: tuple[str, ...] = (
        "k_i and δ_m: Bandis, Lumsden and Barton (1983), aperture by Barton and Bandis (1982)",
        "faces that do not mate: 1 to 4 times their closing, by walls of granite and sandstone",
        "JRC and strength of the faces by their condition: judgement",
        "k_s, low: Barton and Choubey (1977), secant to the peak at 1 % of the length",
        "k_s, high: k_n / (2 (1 + ν)), Lourenço (1996); usual: 0.2 k_n, Demirel and Aldemir (2021)",
    )

    def contact(self, friction: float | None = 0.6, name: str = "stone to stone") -> Contact:
        """Return a linear contact with the usual stiffness at the given stress.

        Args:
            friction: coefficient of friction [-].
            name: name of the contact.
        """
        return Contact(self.normal[1], self.shear[1], friction, name)

    def closing_contact(
        self, friction: float | None = 0.6, name: str = "stone to stone"
    ) -> Contact:
        """Return a contact with the usual stiffness, which stiffens as it closes.

        Args:
            friction: coefficient of friction [-].
            name: name of the contact.
        """
        closure = self.closure[1] if np.isfinite(self.closure[1]) else None
        return Contact(self.initial[1], self.shear[1], friction, name, closure=closure)

    def table(self) -> str:
        """Return the ranges in MPa/mm and mm, and their sources, as text."""
        ranges = {"k_n": self.normal, "k_s": self.shear, "k_i": self.initial}
        rows = [[key, *(f"{value * mm / MPa:.3g}" for value in ranges[key])] for key in ranges]
        rows.append(["δ_m [mm]", *(f"{value / mm:.3g}" for value in self.closure)])
        return "\n".join([align_columns(["MPa/mm", "low", "usual", "high"], rows), *self.sources])


@validate_methods
@dataclass(frozen=True)
class ClosingFit:
    """Law of closing fitted to a test.

    Attributes:
        stiffness: stiffness k_i of a joint that just touches [Pa/m].
        closure: largest closing δ_m [m].
        misfit: largest difference of the law from the test, relative to the test [-].
        stresses: least and largest stress of the test; below and above the law extrapolates [Pa].
    """

    stiffness: float
    closure: float
    misfit: float
    stresses: tuple[float, float]

    def contact(
        self, shear_stiffness: float, friction: float | None = 0.6, name: str = "stone to stone"
    ) -> Contact:
        """Return a contact with this law.

        Args:
            shear_stiffness: k_s [Pa/m].
            friction: coefficient of friction [-].
            name: name of the contact.
        """
        return Contact(self.stiffness, shear_stiffness, friction, name, closure=self.closure)

    def __str__(self) -> str:
        """Law, misfit and range of the test."""
        low, high = (stress / MPa for stress in self.stresses)
        return (
            f"k_i = {self.stiffness / GPa:.3g} GPa/m, δ_m = {self.closure / mm:.3g} mm; largest "
            f"misfit {self.misfit:.1%} from {low:.3g} to {high:.3g} MPa"
        )


@validate_arguments
def face_closing(
    roughness: float,
    face_strength: float,
    aperture: float | None = None,
    *,
    strength: float | None = None,
) -> tuple[float, float]:
    """Return the stiffness and the closure of mated faces from their roughness and strength.

    JRC is the roughness, JCS the strength of the faces, σ_c that of the stone [MPa] and a the
    aperture without load [mm]:

        a = JRC / 5 (0.2 σ_c / JCS - 0.1),   k_i = -7.15 + 1.75 JRC + 0.02 JCS / a [GPa/m],
        δ_m = -0.1032 - 0.0074 JRC + 1.135 (JCS / a)^-0.251 [mm].

    Both are cut off, at 0.1 GPa/m and 1 µm. The regressions are of joints that were loaded three
    times.

    Args:
        roughness: joint roughness coefficient JRC, 0.4 to 20 [-].
        face_strength: compressive strength of the faces JCS [Pa].
        aperture: aperture without load, or None for that of the first relation [m].
        strength: compressive strength of the stone σ_c; by default that of the faces [Pa].

    Returns:
        k_i [Pa/m] and δ_m [m].

    Raises:
        InvalidInput: a value is out of range.

    Reference:
        Bandis, Lumsden and Barton (1983); Barton and Bandis (1982).

    Example:
        >>> stiffness, closure = af.masonry.face_closing(4.0, 50e6)
        >>> round(stiffness / 1e9, 2), round(closure * 1e3, 3)
        (12.35, 0.093)
    """
    check_number(roughness, "roughness", minimum=0.4, maximum=20.0)
    jcs = _check_si(face_strength, "face_strength [Pa]") / MPa
    stone = jcs if strength is None else _check_si(strength, "strength [Pa]") / MPa
    if aperture is None:
        gap = 0.2 * roughness * (0.2 * stone / jcs - 0.1)  # [mm]
        if gap <= 0.0:
            raise InvalidInput(
                f"face_strength {face_strength:.3g} Pa is at least twice the strength of the "
                f"stone, {strength:.3g} Pa: the relation gives no aperture: give it in m"
            )
    else:
        gap = _check_si(aperture, "aperture [m]") / mm
    # the regressions are limited to positive values
    initial = max(-7.15 + 1.75 * roughness + 0.02 * jcs / gap, 0.1)  # [MPa/mm]
    closure = max(-0.1032 - 0.0074 * roughness + 1.135 * (jcs / gap) ** -0.251, 1e-3)  # [mm]
    return initial * MPa / mm, closure * mm


@validate_arguments
def joint_stiffness(
    young: float,
    spacing: float,
    condition: str = "dressed",
    *,
    strength: float = USUAL_STRENGTH,
    stress: float = USUAL_STRESS,
    poisson: float = 0.2,
    rigid: bool = False,
) -> JointStiffness:
    """Estimate the range of stiffness and closure of joints from stone, finish and stress.

    JRC is 2 to 4 for sawn faces, 4 to 8 for dressed and 6 to 12 for hewn and weathered ones. JCS
    over σ_c is 1, 1, 0.6 and 0.33. Both are judgement. `face_closing` gives the law of mated faces,
    and others close 1 to 4 times as far. The usual law is the geometric mean of the softest and the
    stiffest at the stress. A bed of weak mortar fills the aperture: 0.1 to 1 GPa on 10 mm, linear.

    A joint between rigid blocks also includes the flexibility of the stone up to the next joint, in
    series: 1 / k = 1 / k_n + spacing / E. Such a joint follows no hyperbola: k_i and δ_m are those
    with its tangents without stress and at the stress.

    Args:
        young: Young's modulus of the blocks [Pa].
        spacing: spacing of the joints, also taken for the length of their faces [m].
        condition: finish of the faces, "sawn", "dressed", "hewn" or "weathered", or "mortar".
        strength: compressive strength of the stone [Pa].
        stress: compressive stress normal to the joints, as under dead load [Pa].
        poisson: Poisson's ratio of the blocks [-].
        rigid: whether the model has rigid blocks, so that joints include their flexibility.

    Returns:
        Ranges and their sources. They are wide: `stiffness_report` computes their influence.

    Raises:
        InvalidInput: the condition is unknown, or a value is out of range.

    Example:
        >>> low, usual, high = af.joint_stiffness(30e9, 0.5, "weathered").normal
        >>> low < usual < high
        True
    """
    check_choice(condition, "condition", CONDITIONS)
    given = {"young [Pa]": young, "spacing [m]": spacing, "strength [Pa]": strength}
    for name, value in (given | {"stress [Pa]": stress}).items():
        _check_si(value, name)
    if stress >= strength:
        raise InvalidInput(f"stress {stress!r} Pa is not below the strength {strength!r} Pa")
    check_number(poisson, "poisson", minimum=0.0, maximum=0.499)
    elastic = 2.0 * (1.0 + poisson)  # E / G, and k_n / k_s of an elastic layer
    flexibility = spacing / young if rigid else 0.0
    if condition == "mortar":
        return _mortar_bed(elastic, flexibility)
    laws = _finish_laws(condition, strength, stress)
    low, usual, high = (_tangent(k, closing, stress) for k, closing in laws)
    least, most, weathering = FINISHES[condition]
    shear = [_shear(jrc, strength * weathering, stress, spacing) for jrc in (least, most)]
    ratio = 0.2  # usual k_s / k_n, as 0.30 / 1.48 in Demirel and Aldemir (2021)
    shears = [min(*shear, ratio * low), ratio * usual, high / elastic]
    initial = [_in_series(law[0], flexibility) for law in laws]
    normal = [_in_series(k, flexibility) for k in (low, usual, high)]
    # of the law with both tangents: k = k_i (1 + σ / (k_i δ_m))²
    closure = [
        stress / (k * (sqrt(tangent / k) - 1.0)) for k, tangent in zip(initial, normal, strict=True)
    ]
    shears = [_in_series(k, elastic * flexibility) for k in shears]
    return JointStiffness(_three(normal), _three(shears), _three(initial), _three(closure))


@validate_arguments
def with_finish(structure: Structure, finish: str, contact: Contact | None = None) -> Structure:
    """Return a structure whose joints of stones have the usual law of closing of a finish.

    Stiffnesses and closure are those of `joint_stiffness` at 0.05 MPa, by the strength of the
    weaker stone of a joint. It is 56 MPa where none is given. All else of its contact stays.

    Args:
        structure: structure of the joints.
        finish: "sawn", "dressed", "hewn" or "weathered", or "mortar", a linear bed.
        contact: contact of the joints that are changed; None changes all joints of stones.

    Raises:
        InvalidInput: the finish is unknown, or a joint of the contact is one of soil.

    Example:
        >>> ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
        >>> contact = af.masonry.with_finish(ring, "dressed").joints[0].contact
        >>> round(contact.normal_stiffness / 1e9, 2), round(contact.closure * 1e3, 3)
        (6.62, 0.181)
    """
    check_choice(finish, "finish", CONDITIONS)
    laws: dict[Contact, set[Contact]] = {}
    joints = list(structure.joints)
    for number, joint in enumerate(joints):
        if joint.contact == contact or (contact is None and _weaker_stone(structure, joint)):
            law = contact_of_finish(structure, joint, finish)
            laws.setdefault(joint.contact, set()).add(law)
            joints[number] = replace(joint, contact=law)
    origin = structure.origin
    if origin is not None:  # files name the shape, where its contact has one law
        single = {given: law for given, (law, *others) in laws.items() if not others}
        given = {k: single.get(v, v) if isinstance(v, Contact) else v for k, v in origin[1].items()}
        origin = origin[0], given
    return replace(structure, joints=tuple(joints), origin=origin)


def contact_of_finish(structure: Structure, joint: Joint, finish: str) -> Contact:
    """Return the contact of a joint of stones with the usual law of a finish."""
    stone = _weaker_stone(structure, joint)
    if stone is None:
        raise InvalidInput(
            f"'{joint.name}' of '{joint.contact.name}' is a joint of soil, below "
            f"{LEAST_STONE_MODULUS / GPa:g} GPa, which has no finish: give its stiffnesses"
        )
    law = usual_law(finish, stone.strength or USUAL_STRENGTH)
    stiffnesses = {key: getattr(law, key) for key in FINISHED_KEYS}
    return replace(joint.contact, **stiffnesses)


@cache
def usual_law(finish: str, strength: float = USUAL_STRENGTH) -> Contact:
    """Return the contact with the usual law of a finish."""
    # modulus and spacing serve the range of k_s and rigid blocks alone
    return joint_stiffness(30.0 * GPa, 0.5, finish, strength=strength).closing_contact()


def _weaker_stone(structure: Structure, joint: Joint) -> Material | None:
    """Return the weaker stone at a joint; None where one of its blocks is soil."""
    stones = [structure.blocks[number].material for number in joint.blocks]
    if min(stone.young for stone in stones) < LEAST_STONE_MODULUS:
        return None
    return min(stones, key=lambda stone: stone.strength or USUAL_STRENGTH)


def find_finish(structure: Structure, joint: Joint) -> str | None:
    """Return the finish whose usual law a joint of stones has, or None."""
    stone, contact = _weaker_stone(structure, joint), joint.contact
    if stone is None or contact.law is not None:
        return None
    for name in CONDITIONS:
        law = usual_law(name, stone.strength or USUAL_STRENGTH)
        if all(getattr(law, key) == getattr(contact, key) for key in FINISHED_KEYS):
            return name
    return None


def finish_range(structure: Structure, joint: Joint, finish: str) -> JointStiffness:
    """Return the range of the law of a finish by the stones of a joint and `usual_depth`."""
    stone = _weaker_stone(structure, joint)
    assert stone is not None  # a joint of soil has no finish
    strength, depth = stone.strength or USUAL_STRENGTH, usual_depth(structure, joint.contact)
    return joint_stiffness(stone.young, depth, finish, strength=strength)


def usual_depth(structure: Structure, contact: Contact) -> float:
    """Return the median depth of the joints of a contact, whose range has one least k_s [m]."""
    return float(np.median([each.depth for each in structure.joints if each.contact == contact]))


def describe_closing(structure: Structure) -> str:
    """Say in one sentence how joints of stones close, which decides whether thin arches fall."""
    texts, linear = dict[str, list[str]](), dict[str, list[float]]()
    joints = [each for each in structure.joints if _weaker_stone(structure, each) is not None]
    for joint in joints:
        contact, finish = joint.contact, find_finish(structure, joint)
        if contact.law is None and contact.closure is None and not finish:
            # pieces of a fill have a stiffness for each size of two neighbours
            linear.setdefault(contact.name, []).append(contact.normal_stiffness / GPa)
            continue
        words = _describe_law(contact, finish)
        names = texts.setdefault(words, [])
        names += [] if contact.name in names else [contact.name]
    for name, values in linear.items():
        ends = dict.fromkeys(f"{each:.3g}" for each in (min(values), max(values)))
        texts.setdefault(f"linearly with {' to '.join(ends)} MPa/mm", []).append(name)
    if len(texts) == 1:
        return f"joints close {next(iter(texts))}"
    laws = [f"'{join_names(names)}' {words}" for words, names in texts.items()]
    return f"joints close: {'; '.join(laws)}" if laws else ""


def _describe_law(contact: Contact, finish: str | None) -> str:
    """Describe the law of closing of a contact as an adverb."""
    if contact.law is not None:
        return "by a law of the user"
    stiffness = f"{contact.normal_stiffness / GPa:.3g} MPa/mm"
    if contact.closure is None:
        return f"linearly with {stiffness}, of a bed of mortar"
    law = f"the law of {finish} faces" if finish else "a law that stiffens"
    return f"by {law} ({stiffness} at first, {contact.closure / mm:.2g} mm at most)"


@validate_arguments
def fit_closing(
    stresses: Sequence[float] | Array,
    closings: Sequence[float] | Array | None = None,
    *,
    secants: Sequence[float] | Array | None = None,
    tangents: Sequence[float] | Array | None = None,
) -> ClosingFit:
    """Fit the law of closing to a test of a joint.

    Secants from the unloaded joint σ/δ = k_i + σ/δ_m, and roots of tangents √k = √k_i (1 + σ/p_0),
    are straight over the stress: least squares of relative differences.

    Args:
        stresses: compressive stresses (n,) [Pa].
        closings: closing of the joint from no stress, without that of the stone (n,) [m].
        secants: stiffness from no stress, in place of closings (n,) [Pa/m].
        tangents: stiffness at the stress, in place of closings (n,) [Pa/m].

    Returns:
        Law and misfit.

    Raises:
        InvalidInput: not one of closings, secants and tangents is given, a value is not above 0, or
            the joint does not stiffen.

    Example:
        >>> fit = af.masonry.fit_closing([0.5e6, 0.875e6, 1.25e6], secants=[26.2e9, 34e9, 41.1e9])
        >>> str(fit)
        'k_i = 16.3 GPa/m, δ_m = 0.05 mm; largest misfit 0.7% from 0.5 to 1.25 MPa'
    """
    given = {"closings": closings, "secants": secants, "tangents": tangents}
    named = {name: values for name, values in given.items() if values is not None}
    if len(named) != 1:
        raise InvalidInput(f"{len(named)} of {list(given)} are given: give one of them")
    ((name, values),) = named.items()
    stress, measured = check_array(stresses, "stresses"), check_array(values, name)
    if stress.ndim != 1 or stress.shape != measured.shape or len(np.unique(stress)) < 2:
        raise InvalidInput(
            f"stresses {stress.shape} and {name} {measured.shape}: give as many of both, at two "
            "stresses or more"
        )
    if min(stress.min(), measured.min()) <= 0.0:
        raise InvalidInput(f"stresses or {name} are not above 0: leave out the unloaded joint")
    # the measured quantity, of closings over the stress, is this power of a line in the stress
    power = {"closings": -1.0, "secants": 1.0, "tangents": 2.0}[name]
    line = stress / measured if name == "closings" else measured ** (1.0 / power)
    rows = np.stack([np.ones_like(stress), stress], axis=1) / line[:, None]
    (start, slope), *_ = np.linalg.lstsq(rows, np.ones_like(stress), rcond=None)
    # a growth of a millionth over the test is round-off of a linear joint
    linear = slope * stress.max() < 1e-6 * abs(start)
    if linear or start <= 0.0:
        remedy = "it closes linearly: leave out the closure" if linear else "add low stresses"
        raise InvalidInput(
            f"{name} over stresses give k_i or 1/δ_m below 0 ({start:.3g}, {slope:.3g}): {remedy}"
        )
    stiffness = float(start**2 if name == "tangents" else start)
    closure = float(1.0 / (start * slope) if name == "tangents" else 1.0 / slope)
    if name == "closings" and closure > MAX_CLOSURE:
        raise InvalidInput(
            f"closings have a limit of {closure:.3g} m: give them in m, stress in Pa"
        )
    misfit = float(abs((rows @ (start, slope)) ** power - 1.0).max())
    return ClosingFit(stiffness, closure, misfit, (float(stress.min()), float(stress.max())))


def _check_si(value: float, name: str) -> float:
    """Return a number that can be in the SI unit of its name."""
    least, most = SI_RANGES[name.split()[0]]
    return check_number(value, name, minimum=least, maximum=most)


def _finish_laws(condition: str, strength: float, stress: float) -> list[tuple[float, float]]:
    """Return k_i and δ_m of the softest joint at a stress, the usual and the stiffest."""
    least, most, weathering = FINISHES[condition]
    # the stiffness is not monotonic in the roughness
    mated = [
        face_closing(float(jrc), strength * weathering, strength=strength)
        for jrc in np.linspace(least, most, 21)
    ]
    mated.sort(key=lambda law: _tangent(law[0], law[1], stress))
    soft, stiff = mated[0], mated[-1]
    closest, furthest = MISMATCH
    laws = [(soft[0] / furthest, soft[1] * furthest), (stiff[0] / closest, stiff[1] * closest)]
    usual = sqrt(laws[0][0] * laws[1][0]), sqrt(laws[0][1] * laws[1][1])
    return [laws[0], usual, laws[1]]


def _tangent(stiffness: float, closure: float, stress: float) -> float:
    """Return the tangent of the law of closing at a stress [Pa/m]."""
    return stiffness * (1.0 + stress / (stiffness * closure)) ** 2


def _in_series(stiffness: float, flexibility: float) -> float:
    """Return a stiffness in series with a flexibility [Pa/m]."""
    return 1.0 / (1.0 / stiffness + flexibility)


def _mortar_bed(elastic: float, flexibility: float) -> JointStiffness:
    """Return the range of a bed of weak mortar, an elastic layer."""
    low, high = (modulus / BED_THICKNESS for modulus in MORTAR_MODULUS)
    layers = low, sqrt(low * high), high
    normal = [_in_series(k, flexibility) for k in layers]
    shear = [_in_series(k / elastic, elastic * flexibility) for k in layers]
    sources = ("k_n: 0.1 to 1 GPa of weak mortar on 10 mm, judgement; k_s: an elastic layer",)
    linear = np.inf, np.inf, np.inf
    return JointStiffness(_three(normal), _three(shear), _three(normal), linear, sources)


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    """Return three values as a tuple of that length."""
    low, usual, high = values
    return low, usual, high


def _shear(roughness: float, faces: float, stress: float, length: float) -> float:
    """Return the shear stiffness as the secant to the peak, at a hundredth of the length [Pa/m]."""
    residual_angle = 30.0  # of flat faces [degree]
    angle = min(roughness * log10(faces / stress) + residual_angle, 70.0)
    return stress * tan(radians(angle)) * 100.0 / length
