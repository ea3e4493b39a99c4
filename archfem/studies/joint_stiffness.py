"""Which stiffness has a dry joint? Ranges by the stone and its faces, and what hangs on them.

Faces touch at their asperities, so that joints are softer than stone by far, and stiffer the more
they are pressed. The relations are those of rock joints at the stress of the structure; faces cut
apart do not match each other, which halves their stiffness.

Two things are judgements of ours, not found in print for masonry: what roughness and strength of
faces "dressed", "hewn" and "weathered" stand for, and that the divisor for joints that do not
match, of dislocated rock joints and cited from memory, holds for faces cut apart. What was measured
of dry joints goes before both.

References:
    Bandis, Lumsden and Barton, Int. J. Rock Mech. Min. Sci. 20 (1983) 249-268: closure, initial
    stiffness, joints that do not match. Barton and Bandis, Proc. 23rd US Symp. Rock Mech. (1982)
    739-760: aperture. Barton and Choubey, Rock Mech. 10 (1977) 1-54: shear stiffness to the peak,
    and profiles of JRC 0.4, 2.8, 5.8, 6.7, 9.5, 10.8, 12.8, 14.5, 16.7 and 18.7, with which the eye
    compares a face. Vlachakis, Colombo, Giouvanidis, Savalle and Lourenço, Constr. Build. Mater.
    (2023) 130880: stiffness and damping of dry joints, measured. Costa et al., Buildings 14 (2024)
    3744: contacts of dry stone, measured.
    Lourenço, Computational strategies for masonry structures, Delft (1996): k_s by elasticity.
    Demirel and Aldemir, Buildings 11 (2021): 1.48 and 0.30 MPa/mm, of which the first is below what
    these relations give of weathered faces.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log10, radians, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns
from archfem._validation import check_number
from archfem.cases.case import Case
from archfem.cases.toml_file import check_choice
from archfem.errors import InvalidInput
from archfem.masonry.materials import Contact
from archfem.studies.study import Study
from archfem.units import MPa, mm

# Joint roughness coefficients JRC from and to, and the strength of the faces over the stone's: as
# we judge them, between the second and the fifth of the profiles of Barton and Choubey (1977), and
# sound; between the third and the seventh, and weaker; as rough, and of a third of the strength
CONDITIONS = {
    "dressed": ((4.0, 8.0), 1.0),
    "hewn": ((6.0, 12.0), 0.6),
    "weathered": ((6.0, 12.0), 0.33),
}

# Friction angle of flat faces [degree]
RESIDUAL = 30.0

# Usual k_s / k_n, as 0.30 / 1.48 in Demirel and Aldemir (2021) [-]
SHEAR = 0.2

SOURCES = (
    "k_n: Bandis, Lumsden and Barton (1983), aperture by Barton and Bandis (1982), without match",
    "JRC and strength of the faces by their condition, and that none match: a judgement of ours",
    "k_s, low: Barton and Choubey (1977), secant to the peak at 1 % of the length",
    "k_s, high: k_n / (2 (1 + ν)), Lourenço (1996); usual: 0.2 k_n, Demirel and Aldemir (2021)",
)


@dataclass(frozen=True)
class JointStiffness:
    """What the stiffness of a joint may be: a low, a usual and a high value of each.

    Attributes:
        normal: k_n [Pa/m].
        shear: k_s [Pa/m].
        sources: of the relations.
    """

    normal: tuple[float, float, float]
    shear: tuple[float, float, float]
    sources: tuple[str, ...] = SOURCES

    def contact(self, friction: float | None = 0.6, name: str = "stone to stone") -> Contact:
        """Return a contact of the usual stiffness.

        Args:
            friction: of the contact [-].
            name: likewise.
        """
        return Contact(self.normal[1], self.shear[1], friction, name)

    def table(self) -> str:
        """The ranges in MPa/mm, and their sources."""
        rows = [
            [name, *(f"{value * mm / MPa:.3g}" for value in values)]
            for name, values in (("k_n", self.normal), ("k_s", self.shear))
        ]
        return "\n".join([align_columns(["MPa/mm", "low", "usual", "high"], rows), *self.sources])


def joint_stiffness(
    young: float,
    spacing: float,
    condition: str = "dressed",
    *,
    strength: float = 56.0 * MPa,
    stress: float = 0.05 * MPa,
    poisson: float = 0.2,
    rigid: bool = False,
) -> JointStiffness:
    """Return what the stiffness of dry joints may be, by the stone, its faces and its stress.

    With JRC the roughness, JCS the strength of the faces, σ_c that of the stone [MPa] and a the
    aperture [mm], the stiffness at no stress and the largest closure of matching faces are

        a = JRC / 5 (0.2 σ_c / JCS - 0.1),   k_i = -7.15 + 1.75 JRC + 0.02 JCS / a,
        v = -0.1032 - 0.0074 JRC + 1.135 (JCS / a)^-0.251,
        k_n = k_i (1 - σ / (v k_i + σ))^-2 / (2 + 0.0004 JRC JCS σ),

    the last divisor for faces that do not match. That it holds for faces cut apart, JRC, 4 to 8 of
    dressed faces and 6 to 12 of hewn and weathered ones, and JCS / σ_c, 1, 0.6 and 0.33, are
    judgements of ours. Of rigid blocks a joint also stands for the blocks between it and the next,
    in series: 1 / k = 1 / k_n + spacing / E.

    Args:
        young: modulus of the blocks [Pa].
        spacing: of the joints, taken for the length of their faces too [m].
        condition: of the faces, "dressed", "hewn" or "weathered".
        strength: of the stone [Pa].
        stress: normal to the joints, as under dead load [Pa].
        poisson: ratio of the blocks [-].
        rigid: whether the blocks are taken as rigid, and the joints for their flexibility too.

    Returns:
        Ranges and their sources. They are wide: ask for `stiffness_report` what hangs on them.

    Raises:
        InvalidInput: the condition is not known, or a value cannot be meant.

    Example:
        >>> low, usual, high = af.joint_stiffness(30e9, 0.5, "weathered").normal
        >>> low < usual < high
        True
    """
    (least, most), weathering = CONDITIONS[check_choice(condition, CONDITIONS, "condition")]
    for name, value in (("young", young), ("spacing", spacing), ("strength", strength)):
        if check_number(value, name, minimum=0.0) == 0.0:
            raise InvalidInput(f"{name} = {value!r} is not above 0: give it in SI")
    if not 0.0 < check_number(stress, "stress") < strength:
        raise InvalidInput(
            f"stress {stress!r} Pa is not between 0 and the strength {strength!r} Pa"
        )
    roughness = np.linspace(least, most, 21)
    alone = [_normal(each, strength, strength * weathering, stress) for each in roughness]
    low, high = min(alone), max(alone)
    shear = [_shear(each, strength * weathering, stress, spacing) for each in (least, most)]
    usual = sqrt(low * high)
    blocks = spacing / young if rigid else 0.0
    slide = 2.0 * (1.0 + poisson)
    normals = tuple(1.0 / (1.0 / each + blocks) for each in (low, usual, high))
    shears = tuple(
        1.0 / (1.0 / each + slide * blocks)
        for each in (min(*shear, SHEAR * low), SHEAR * usual, high / slide)
    )
    return JointStiffness((normals[0], normals[1], normals[2]), (shears[0], shears[1], shears[2]))


def stiffness_report(
    case: Case,
    stiffness: JointStiffness,
    find: Any = "history",
    *,
    contact: str = "stone to stone",
    folder: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Find what of a case hangs on the stiffness of its joints.

    Args:
        case: of the structure.
        stiffness: what it may be.
        find: what is to be found, as for `Study.of`.
        contact: whose stiffness it is.
        folder: as for `Study.run`, and `workers`.
        workers: likewise.

    Returns:
        The findings, over `point`: the usual values, then k_n low and high, then k_s low and high;
        `archfem.view.draw_tornado` draws it.

    Raises:
        InvalidInput: the findings cannot be meant.
    """
    keys = tuple(f"contacts.{contact}.{kind}_stiffness" for kind in ("normal", "shear"))
    ranges = (stiffness.normal, stiffness.shear)
    usual = {key: values[1] for key, values in zip(keys, ranges, strict=True)}
    points: Sequence[dict[str, float]] = [
        usual,
        *(usual | {key: v[end]} for key, v in zip(keys, ranges, strict=True) for end in (0, 2)),
    ]
    return Study.of(case, points, find).run(folder, workers=workers)


def _normal(roughness: float, strength: float, faces: float, stress: float) -> float:
    """Normal stiffness of faces that do not match [Pa/m]."""
    stone, wall, pressed = strength / MPa, faces / MPa, stress / MPa
    aperture = 0.2 * roughness * (0.2 * stone / wall - 0.1)
    initial = max(-7.15 + 1.75 * roughness + 0.02 * wall / aperture, 0.1)
    closure = -0.1032 - 0.0074 * roughness + 1.135 * (wall / aperture) ** -0.251
    pressing = (1.0 - pressed / (max(closure, 1e-3) * initial + pressed)) ** -2
    apart = 2.0 + 0.0004 * roughness * wall * pressed
    return float(initial * pressing / apart * MPa / mm)


def _shear(roughness: float, faces: float, stress: float, length: float) -> float:
    """Shear stiffness as the secant to the peak, at a hundredth of the length [Pa/m]."""
    angle = min(roughness * log10(faces / stress) + RESIDUAL, 70.0)
    return stress * tan(radians(angle)) * 100.0 / length
