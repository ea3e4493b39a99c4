"""Points on the joints, where openings and slips are taken."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.masonry.structure import Structure

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class JointPoints:
    """Quadrature points on the joints of a structure.

    Attributes:
        joint: number of the joint each point lies on (p,).
        arm: distance from the joint's mid-point toward the extrados (p,) [m].
        weight: joint area that each point stands for, width included (p,) [m²].
        normal_stiffness: k_n (p,) [Pa/m].
        shear_stiffness: k_s (p,) [Pa/m].
        friction: μ, infinite where a point never slides (p,) [-].
        cohesion: c (p,) [Pa].
        count: number of joints.
        dilatancy: tan ψ (p,) [-]; None where no point has saw teeth.
        tension: f_t (p,) [Pa]; None where no point has a bond.
    """

    joint: Numbers
    arm: Array
    weight: Array
    normal_stiffness: Array
    shear_stiffness: Array
    friction: Array
    cohesion: Array
    count: int
    dilatancy: Array | None = None
    tension: Array | None = None

    @classmethod
    def on(cls, structure: Structure, rules: list[tuple[Array, Array]]) -> "JointPoints":
        """Return points put on the joints of a structure.

        Args:
            structure: whose joints they lie on.
            rules: of each joint, the arms of its points and the length that each stands for (p,)
                [m].
        """
        sizes = [len(arms) for arms, _ in rules]
        joint = np.repeat(np.arange(len(rules)), sizes)
        contacts = [each.contact for each in structure.joints]
        return cls(
            joint,
            np.concatenate([arms for arms, _ in rules]),
            np.concatenate([lengths for _, lengths in rules]) * structure.width,
            np.array([each.normal_stiffness for each in contacts])[joint],
            np.array([each.shear_stiffness for each in contacts])[joint],
            np.array([each.coefficient for each in contacts])[joint],
            np.array([each.cohesion for each in contacts])[joint],
            len(rules),
            _where_any([each.dilatancy for each in contacts], joint),
            _where_any([each.tension for each in contacts], joint),
        )

    def chosen(self, rows: Numbers, weight: Array) -> "JointPoints":
        """Return some of the points.

        Args:
            rows: numbers of those (r,).
            weight: joint area that each of those stands for (r,) [m²].
        """
        return JointPoints(
            self.joint[rows],
            self.arm[rows],
            weight,
            self.normal_stiffness[rows],
            self.shear_stiffness[rows],
            self.friction[rows],
            self.cohesion[rows],
            self.count,
            None if self.dilatancy is None else self.dilatancy[rows],
            None if self.tension is None else self.tension[rows],
        )

    @property
    def plain(self) -> bool:
        """Whether all slide flat, and none has a bond."""
        return self.dilatancy is None and self.tension is None

    @cached_property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each point can slide (p,)."""
        return np.isfinite(self.friction)

    @cached_property
    def shear(self) -> Array:
        """Elastic shear force of each point per slip (p,) [N/m]."""
        return self.weight * self.shear_stiffness


def _where_any(values: list[float], joint: Numbers) -> Array | None:
    """Values of the joints at their points (p,); None where all are zero."""
    return np.array(values)[joint] if any(values) else None
