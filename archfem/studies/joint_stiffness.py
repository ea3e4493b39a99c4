"""Stiffness of dry joints: ranges from properties of stone and faces, and their influence.

Faces touch at their asperities. Joints are therefore much softer than stone, and stiffer under a
larger stress. The relations are those of rock joints at the stress of the structure. The faces of
two voussoirs are cut separately and do not match, which halves their stiffness.

Two assumptions are judgements, not taken from publications on masonry: roughness and strength of
faces for "dressed", "hewn" and "weathered", and that the divisor for mismatched rock joints, cited
from memory, holds for separately cut faces. Measurements of dry joints are to be preferred to both.

References:
    Bandis, Lumsden and Barton, Int. J. Rock Mech. Min. Sci. 20 (1983) 249-268: closure, initial
    stiffness, joints that do not match. Barton and Bandis, Proc. 23rd US Symp. Rock Mech. (1982)
    739-760: aperture. Barton and Choubey, Rock Mech. 10 (1977) 1-54: shear stiffness to the peak,
    and profiles of JRC 0.4, 2.8, 5.8, 6.7, 9.5, 10.8, 12.8, 14.5, 16.7 and 18.7, with which the eye
    compares a face. Vlachakis, Colombo, Giouvanidis, Savalle and Lourenço, Constr. Build. Mater.
    (2023) 130880: stiffness and damping of dry joints, measured. Costa et al., Buildings 14 (2024)
    3744: contacts of dry stone, measured.
    Lourenço, Computational strategies for masonry structures, Delft (1996): k_s by elasticity.
    Demirel and Aldemir, Buildings 11 (2021): 1.48 and 0.30 MPa/mm, of which the first is below the
    range of these relations for weathered faces.
"""

from dataclasses import dataclass
from math import log10, radians, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns
from archfem._validation import check_number, validate_arguments, validate_methods
from archfem.cases.case import Case
from archfem.cases.toml_file import check_choice
from archfem.errors import InvalidInput
from archfem.masonry.materials import Contact
from archfem.studies.study import Study
from archfem.units import MPa, mm


@validate_methods
@dataclass(frozen=True)
class JointStiffness:
    """Low, usual and high value of the normal and shear stiffness of a joint.

    Attributes:
        normal: normal stiffness k_n [Pa/m].
        shear: shear stiffness k_s [Pa/m].
        sources: sources of the relations.
    """

    normal: tuple[float, float, float]
    shear: tuple[float, float, float]
    sources: tuple[str, ...] = (
        "k_n: Bandis, Lumsden and Barton (1983), aperture by Barton and Bandis (1982), mismatched",
        "JRC and strength of the faces by their condition, and their mismatch: judgement",
        "k_s, low: Barton and Choubey (1977), secant to the peak at 1 % of the length",
        "k_s, high: k_n / (2 (1 + ν)), Lourenço (1996); usual: 0.2 k_n, Demirel and Aldemir (2021)",
    )

    def contact(self, friction: float | None = 0.6, name: str = "stone to stone") -> Contact:
        """Return a contact with the usual stiffness.

        Args:
            friction: coefficient of friction [-].
            name: name of the contact.
        """
        return Contact(self.normal[1], self.shear[1], friction, name)

    def table(self) -> str:
        """Return the ranges in MPa/mm and their sources as text."""
        ranges = {"k_n": self.normal, "k_s": self.shear}
        rows = [[key, *(f"{value * mm / MPa:.3g}" for value in ranges[key])] for key in ranges]
        return "\n".join([align_columns(["MPa/mm", "low", "usual", "high"], rows), *self.sources])


@validate_arguments
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
    """Estimate the range of the stiffness of dry joints from stone, faces and stress.

    With JRC the roughness, JCS the strength of the faces, σ_c that of the stone [MPa] and a the
    aperture [mm], the initial stiffness k_i and the largest closure v of matching faces are

        a = JRC / 5 (0.2 σ_c / JCS - 0.1),   k_i = -7.15 + 1.75 JRC + 0.02 JCS / a,
        v = -0.1032 - 0.0074 JRC + 1.135 (JCS / a)^-0.251,
        k_n = k_i (1 - σ / (v k_i + σ))^-2 / (2 + 0.0004 JRC JCS σ),

    where the last divisor is for mismatched faces. Judgements are: that it holds for separately cut
    faces; JRC from 4 to 8 for dressed faces and from 6 to 12 for hewn and weathered ones; JCS / σ_c
    of 1, 0.6 and 0.33. A joint between rigid blocks also includes the flexibility of the stone up
    to the next joint, in series: 1 / k = 1 / k_n + spacing / E.

    Args:
        young: Young's modulus of the blocks [Pa].
        spacing: spacing of the joints, also taken for the length of their faces [m].
        condition: condition of the faces, "dressed", "hewn" or "weathered".
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
    # Smallest and largest joint roughness coefficient JRC, and strength of the faces over that of
    # the stone. Judgement: dressed faces are sound and between profiles 2 and 5 of Barton and
    # Choubey (1977); hewn ones are weaker and between profiles 3 and 7; weathered have a third.
    faces = {"dressed": (4.0, 8.0, 1.0), "hewn": (6.0, 12.0, 0.6), "weathered": (6.0, 12.0, 0.33)}
    least, most, weathering = faces[check_choice(condition, faces, "condition")]
    for name, value in (("young", young), ("spacing", spacing), ("strength", strength)):
        if check_number(value, name, minimum=0.0) == 0.0:
            raise InvalidInput(f"{name} = {value!r} is not above 0: give it in SI")
    if not 0.0 < check_number(stress, "stress") < strength:
        raise InvalidInput(
            f"stress {stress!r} Pa is not between 0 and the strength {strength!r} Pa"
        )
    check_number(poisson, "poisson", minimum=0.0, maximum=0.499)
    roughness = np.linspace(least, most, 21)
    # the stiffness is not monotonic in the roughness
    normal = [_normal(jrc, strength, strength * weathering, stress) for jrc in roughness]
    low, high = min(normal), max(normal)
    shear = [_shear(jrc, strength * weathering, stress, spacing) for jrc in (least, most)]
    usual = sqrt(low * high)
    ratio = 0.2  # usual k_s / k_n, as 0.30 / 1.48 in Demirel and Aldemir (2021)
    elastic = 2.0 * (1.0 + poisson)  # E / G, and k_n / k_s of an elastic layer
    flexibility = spacing / young if rigid else 0.0
    normals = tuple(1.0 / (1.0 / k + flexibility) for k in (low, usual, high))
    shears = tuple(
        1.0 / (1.0 / k + elastic * flexibility)
        for k in (min(*shear, ratio * low), ratio * usual, high / elastic)
    )
    return JointStiffness((normals[0], normals[1], normals[2]), (shears[0], shears[1], shears[2]))


@validate_arguments
def stiffness_report(
    case: Case,
    stiffness: JointStiffness,
    find: Any = "history",
    *,
    contact: str = "stone to stone",
    folder: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Compute the influence of the joint stiffness on the findings of a case.

    Args:
        case: case of the structure.
        stiffness: range of the stiffness.
        find: function to evaluate, as `compute` of a `Study`.
        contact: name of the contact whose stiffness is varied.
        folder: folder for finished points, as for `Study.run`.
        workers: number of processes, as for `Study.run`.

    Returns:
        The findings over `point`: usual values, k_n low, k_n high, k_s low, k_s high;
        `archfem.view.draw_tornado` draws them.

    Raises:
        InvalidInput: the function is invalid.
    """
    ranges = {
        f"contacts.{contact}.normal_stiffness": stiffness.normal,
        f"contacts.{contact}.shear_stiffness": stiffness.shear,
    }
    usual = {key: values[1] for key, values in ranges.items()}
    points = [usual, *(usual | {key: ranges[key][end]} for key in ranges for end in (0, 2))]
    return Study(case, points, find).run(folder, workers=workers)


def _normal(roughness: float, strength: float, faces: float, stress: float) -> float:
    """Normal stiffness of mismatched faces [Pa/m]."""
    stone, jcs, sigma = strength / MPa, faces / MPa, stress / MPa
    aperture = 0.2 * roughness * (0.2 * stone / jcs - 0.1)  # [mm]
    # the regressions are limited to positive values
    initial = max(-7.15 + 1.75 * roughness + 0.02 * jcs / aperture, 0.1)  # [MPa/mm]
    closure = max(-0.1032 - 0.0074 * roughness + 1.135 * (jcs / aperture) ** -0.251, 1e-3)  # [mm]
    matching = initial * (1.0 - sigma / (closure * initial + sigma)) ** -2  # hyperbolic closure
    return float(matching / (2.0 + 0.0004 * roughness * jcs * sigma) * MPa / mm)


def _shear(roughness: float, faces: float, stress: float, length: float) -> float:
    """Shear stiffness as the secant to the peak, at a hundredth of the length [Pa/m]."""
    residual_angle = 30.0  # of flat faces [degree]
    angle = min(roughness * log10(faces / stress) + residual_angle, 70.0)
    return stress * tan(radians(angle)) * 100.0 / length
