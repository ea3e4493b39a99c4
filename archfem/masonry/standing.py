"""Bodies that stand on a structure, such as a lorry on a bridge: loads whose mass is pushed.

A body is a rigid block on the joint below its base. A vehicle is one on a foot below each axle. The
lengths of feet are in proportion to the axle loads: pressed evenly, they bear just these.

On an elastic fill, limit analysis and assessments take it column by column, as they take the fill:
its weight and its horizontal force go to the stones straight below each foot, with the moment of
that force about the road.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from json import dumps
from numbers import Real

import numpy as np

from archfem._typing import Array, Metres, Newtons
from archfem._validation import check_between, check_fields, check_numbers, validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.assembly import name_joints, touching
from archfem.masonry.block import Block, as_point
from archfem.masonry.materials import COURSE_LENGTH, SOIL_TO_STONE, Contact, Material
from archfem.masonry.stiffness_ratio import list_stones
from archfem.masonry.structure import CONTACT_TOLERANCE, Joint, Structure, join_names, join_words
from archfem.units import GPa, kN

# Least weight of a body [N]
MIN_WEIGHT = 100.0


def parse_axles(axles: float | Sequence[float], spacings: Sequence[float]) -> Array:
    """Return the weight of each axle, and its place before the middle (n_axles, 2) [N, m]."""
    weights = np.array(check_numbers([axles] if isinstance(axles, Real) else axles, "axles [N]"))
    gaps = np.array(check_numbers(spacings, "spacings [m]"))
    if not len(weights) or (weights <= 0.0).any() or (gaps <= 0.0).any():
        raise InvalidInput(
            f"axles {weights.tolist()} N with spacings {gaps.tolist()} m: give weights and "
            "spacings above 0, and at least one axle"
        )
    if len(gaps) != len(weights) - 1:
        raise InvalidInput(
            f"{len(weights)} axles and {len(gaps)} spacings: give one between each two axles, "
            "as in spacings = [1.3] m"
        )
    behind = np.concatenate([[0.0], np.cumsum(gaps)])
    return np.stack([weights, behind[-1] / 2.0 - behind], axis=1)


def is_light(axles: Sequence[float]) -> bool:
    """Return whether loads [N] are so small that they can only be in a wrong unit."""
    return min(axles) < 1e3 and max(axles) != 1.0  # the factor of 1 N is a load


@dataclass(frozen=True, kw_only=True)
class StandingBody:
    """A rigid body on a level top, such as a lorry on a road.

    Attributes:
        x: middle of its base, below its centre of gravity; or between first and last axle [m].
        length: length of its base along the structure, or of the wheels of its heaviest axle, those
            of others being in proportion to their loads [m].
        weight: weight, which is accelerated as a mass [N]; None with axles, whose sum it is.
        centre_of_gravity: height of its centre of gravity above the base [m].
        axles: load of each axle, from left to right, below whose sum its centre of gravity is; none
            for a body that rests on all its length [N].
        spacings: distances between the axles, one fewer [m].
        width: width of the structure, out of plane, that carries it [m]; None for all of it. On
            less its weight counts more, by the whole width over this one.
        contact: contact of its base.
        name: name of the block, and of its part.

    Raises:
        InvalidInput: a value is no number, not above zero, or too large to be metres and newtons;
            neither weight nor axles are given, or both; or wheels overlap.
    """

    x: Metres
    length: Metres
    weight: Newtons | None = None
    centre_of_gravity: Metres
    axles: Sequence[Newtons] = ()
    spacings: Sequence[Metres] = ()
    width: Metres | None = None
    contact: Contact = SOIL_TO_STONE
    name: str = "body"

    def __post_init__(self) -> None:
        """Check that the values are possible."""
        check_fields(self)
        if (self.weight is None) != bool(self.axles):
            raise InvalidInput(f"'{self.name}': give either its weight, or axles, whose sum it is")
        for key in ("axles", "spacings"):
            object.__setattr__(self, key, tuple(getattr(self, key)))  # lists of a case
        check_between(self.total, f"'{self.name}': weight [N]", 0.0, 1e9, remedy="give newtons")
        # a small statue weighs less than any axle
        if is_light(self.axles) if self.axles else self.total < MIN_WEIGHT:
            loads = join_words([f"{load:g} N" for load in self.axles or (self.total,)])
            raise InvalidInput(
                f"'{self.name}' presses with {loads}: that can only be a wrong unit; so small a "
                "body is a weight of `loads`"
            )
        for key in ("length", "centre_of_gravity", "width"):
            if (value := getattr(self, key)) is not None:
                check_between(value, f"'{self.name}': {key} [m]", 0.0, 100.0, remedy="give metres")
        if (overlap := float(np.max(self.feet[:-1, 1] - self.feet[1:, 0], initial=-1.0))) >= 0.0:
            raise InvalidInput(
                f"'{self.name}': its wheels overlap by {overlap:.3g} m: give less length, that of "
                "the wheels of the heaviest axle"
            )

    @property
    def total(self) -> float:
        """Weight, or the sum of the axles [N]."""
        return float(sum(self.axles)) if self.weight is None else self.weight

    @property
    def feet(self) -> Array:
        """Ends of the base, or of the wheels of each axle, from left to right (n, 2) [m]."""
        rows = parse_axles(self.axles or (self.total,), self.spacings)
        half = 0.5 * self.length * rows[:, 0] / rows[:, 0].max()
        return (self.x - rows[:, 1] + [-half, half]).T

    def place(self, structure: Structure) -> Block:
        """Return the block of this body on the top of a structure.

        Args:
            structure: whose highest point below the middles of its feet is the level of the base.

        Raises:
            InvalidInput: it stands beside the structure, or on less width than there is.
        """
        level, width = self._find_level(structure), self.width or structure.width
        if width > structure.width:
            raise InvalidInput(
                f"'{self.name}': width {width:.4g} m, and the structure has {structure.width:.4g} "
                "m: leave it out"
            )
        outline, area = self._outline()
        corners = tuple((float(x), float(level + y)) for x, y in outline)
        # it stands for itself, at any weight
        unit_weight = self.total / (area * width)
        material = Material(30.0 * GPa, 0.2, unit_weight, None, self.name, stands_for=self.name)
        return Block(corners, material, self.name, part=self.name, role="other")

    def _find_level(self, structure: Structure) -> float:
        """Return the level of the base on a structure, its highest point below a foot [m]."""
        places = self.feet.mean(axis=1)
        below = [[block.top(x) for block in structure.blocks] for x in places]
        tops = [top for each in below for top in each if top is not None]
        if not tops:
            raise InvalidInput(
                f"'{self.name}' stands at x = {self.x:.4g} m beside the structure: move it onto a "
                "block"
            )
        beyond = [x for x, each in zip(places, below, strict=True) if each.count(None) == len(each)]
        if beyond:
            raise InvalidInput(
                f"'{self.name}': its axle at x = {beyond[0]:.4g} m is beyond the structure: make "
                "the sidewalls longer; or give only the axles on the bridge, with their spacings "
                "and x halfway between them"
            )
        return max(tops)

    def _outline(self) -> tuple[list[tuple[float, float]], float]:
        """Return the corners, above the base [m], and the area [m²] about its centre of gravity."""
        feet, mass = self.feet, self.centre_of_gravity
        lengths = np.ptp(feet, axis=1)
        # the outline is as long on both sides of the centre of gravity, but for round-off
        middle = np.average(feet.mean(axis=1), weights=lengths)
        lean = round(float(feet[0, 0] + feet[-1, 1] - 2.0 * middle), 9)
        left, right = feet[0, 0] - max(lean, 0.0), feet[-1, 1] - min(lean, 0.0)
        leg = 0.1 * mass if len(feet) > 1 else 0.0
        # height above the legs, with the centroid of both at the centre of gravity
        legs, above = leg * lengths.sum(), mass - leg
        height = above + np.sqrt(above**2 + 2.0 * legs * (mass - 0.5 * leg) / (right - left))
        base = [(x, y) for a, b in feet for x, y in ((a, leg), (a, 0.0), (b, 0.0), (b, leg))]
        base = [(left, leg), *base, (right, leg), (right, leg + height), (left, leg + height)]
        return [*dict.fromkeys(base)], float(legs + height * (right - left))


def find_bodies(structure: Structure) -> list[str]:
    """Return the names of the bodies that stand on a structure."""
    return [block.name for block in structure.blocks if block.material.stands_for == block.name]


def list_own_stones(structure: Structure) -> list[int]:
    """Return the stones of a structure without the bodies on it, or all where there are no more."""
    stones, bodies = list_stones(structure), find_bodies(structure)
    return [number for number in stones if structure.blocks[number].name not in bodies] or stones


def describe_carried(structure: Structure) -> str:
    """Describe masses that count at the middle of blocks which stand for them; empty for none."""
    own = {*find_bodies(structure), COURSE_LENGTH}
    words = (structure.blocks[number].material.stands_for for number in structure.free)
    carried = sorted({each for each in words if each is not None and each not in own})
    if not carried:
        return ""
    return (
        f"the mass of {join_names(carried)} counts at the middle of each block that stands for it: "
        "where it is higher, the structure moves at less than computed; as blocks of its own, or "
        "in an assessment as [assessment] loads, it acts at its height"
    )


def describe_widths(structure: Structure) -> str:
    """Describe at which weight bodies on less than the whole width count; empty for none."""
    _, arguments = structure.origin or ("", {})
    words = [
        f"'{body.name}' of {body.total / kN:.4g} kN counts as "
        f"{body.total / kN * structure.width / body.width:.4g} kN: by the whole width of "
        f"{structure.width:g} m over its {body.width:g} m"
        for body in arguments.get("standing", ())
        if body.width and body.width < structure.width
    ]
    return "; ".join(words)


def describe_axles(structure: Structure, axles: Mapping[float, float], width: float) -> list[str]:
    """Return the line of a case with the axles that stand on a structure as those of a body.

    The weight of each [N] is given by its x [m], on some width [m].
    """
    tops = [block.top for block in structure.blocks]
    on = [axle for axle in sorted(axles.items()) if any(top(axle[0]) is not None for top in tops)]
    if not on:
        return []
    x, loads = np.array(on).T
    keys = {
        "x": f"{0.5 * (x[0] + x[-1]):.6g} m",
        "axles": [f"{load / kN:.6g} kN" for load in loads],
        "spacings": [f"{gap:.6g} m" for gap in np.diff(x)],
        "width": f"{width:.6g} m" if width < structure.width else "",
    }
    table = ", ".join(f"{key} = {dumps(value)}" for key, value in keys.items() if value)
    begin = "there in [structure.standing], axles from left to right"
    return [f"{begin} (add length and centre_of_gravity): vehicle = {{ {table} }}"]


@validate_arguments
def carrying(structure: Structure, bodies: Sequence[StandingBody]) -> Structure:
    """Stand bodies on a structure, each on what is level below it.

    Args:
        structure: structure of any kind; a fill that shall be in pieces is cut before.
        bodies: from the lower to the upper one where they stand on each other.

    Returns:
        The structure with a block for each body, and a joint to each block below it.

    Raises:
        InvalidInput: a body stands beside the structure, or on no level top.
        InvalidStructure: it overlaps what is there, or has a name that is used.
    """
    carrier = structure
    for body in bodies:
        carrier = _stand(carrier, body)
    if structure.origin is None:
        return carrier
    shape, arguments = structure.origin
    return replace(carrier, origin=(shape, {**arguments, "standing": [*bodies]}))


def _stand(structure: Structure, body: StandingBody) -> Structure:
    """Return a structure with one body on it."""
    number, block = len(structure.blocks), body.place(structure)
    blocks, base = (*structure.blocks, block), float(np.ptp(body.feet, axis=1).sum())
    touches = [touch for touch in touching(blocks) if number in touch[:2]]
    level = block.points[:, 1].min() + CONTACT_TOLERANCE * structure.size
    stands = sum(float(np.ptp(ends[:, 0])) for *_, ends in touches if ends[:, 1].max() < level)
    if stands < base - 4.0 * len(touches) * CONTACT_TOLERANCE * structure.size:
        reason = (
            f"top of the structure beside x = {body.x:.4g} m is not level: make it shorter, move "
            "it, or give the structure a fill or a paving"
        )
        corners = np.concatenate([each.points[:, 0] for each in structure.blocks])
        for end, over in ((corners.min(), -1.0), (corners.max(), 1.0)):
            if (over * (body.feet - end)).max() > 0.0:
                reason = f"structure ends at x = {end:.4g} m: make the sidewalls longer, or move it"
        raise InvalidInput(
            f"'{body.name}' stands on {stands:.4g} m of its {base:.4g} m, as the {reason}"
        )
    joints = [
        Joint((a, b), as_point(ends[0]), as_point(ends[1]), body.contact, "", body.name, "other")
        for a, b, ends in touches
    ]
    joints = [*structure.joints, *name_joints(joints, blocks)]
    return replace(structure, blocks=blocks, joints=tuple(joints))
