"""Earth pressure against a fill of rigid triangles: an upper bound of limit analysis.

Triangles that slide on one another by Coulomb's law, with dilatancy, bound the collapse load of a
rigid-plastic soil from above.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from backfilled import SOIL, arch_bridge, fill_of, rectangle, retaining_wall

import archfem as af

EXACT = 1e-6
"""Relative: the programme is solved to 1e-9 block weights, corners count as one within 1e-6."""

FIRM = replace(SOIL, young=af.STONE.young, name="rigid soil")
"""Weighs as much, but each triangle is rigid."""

PUSH = af.PointLoad(-3.0, (1e3, 0.0))
"""On a wall so broad that it slides; a body force would pull at the triangles too."""


def in_triangles(structure, triangles, angle, ends=(), loose=()):
    """A structure with triangles in place of its fill, on smooth stones and between smooth ends."""
    inside = replace(af.masonry.SOIL_TO_STONE, friction=np.tan(np.radians(angle)))
    smooth = replace(inside, friction=0.0)
    kept = [block for block in structure.blocks if block is not fill_of(structure)]
    contacts = {
        frozenset(structure.blocks[number].name for number in joint.blocks): joint.contact
        for joint in structure.joints
    }
    soil = [
        af.Block(tuple(map(tuple, each)), FIRM, f"soil {k}", part="fill", role="other")
        for k, each in enumerate(triangles)
    ]

    def touch(a, b):
        if {a.part, b.part} == {"fill"} or {a.name, b.name} & set(loose):
            return inside
        if "fill" in (a.part, b.part):
            return smooth
        return contacts.get(frozenset((a.name, b.name)), smooth)

    return af.masonry.assembled([*kept, *ends, *soil], touch)


def test_a_wedge_of_triangles_resists_a_wall_as_rankine_has_it():
    """Triangles cut at 45° - φ/2 have the exact wedge among their mechanisms."""
    angle, height, layers = 30.0, 2.0, 4
    wall = retaining_wall(6.0, height, friction=0.3)
    step = np.array([np.tan(np.radians(45.0 + angle / 2.0)), 1.0]) * height / layers
    corners = [np.array([column, row]) for column in range(2 * layers) for row in range(layers)]
    triangles = [
        (corner + np.array(other)) * step
        for corner in corners
        for other in (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1)))
    ]
    far = 2 * layers * step[0]
    ground = [
        rectangle(6.0, -1.0, far + 1.0, 0.0, "more rock", fixed=True),
        rectangle(far, 0.0, far + 1.0, height, "end", fixed=True),
    ]
    cut = in_triangles(wall, triangles, angle, ground)
    bound = af.collapse_factor(cut, live=PUSH).factor
    weight, pressure = 12.0 * af.STONE.unit_weight, 3.0 * SOIL.unit_weight * height**2 / 2.0
    assert bound * 1e3 == pytest.approx(0.3 * weight + pressure, rel=EXACT)
    fill = af.limit.Fill(friction_angle=angle, mobilisation=1.0)
    assert af.collapse_factor(wall, live=PUSH, fill=fill).factor == pytest.approx(bound, rel=EXACT)


@pytest.mark.slow
def test_an_arch_under_a_footing_is_below_the_upper_bound():
    """The bound has all passive pressure, shear in the fill, and a footing to spread the load."""
    structure, layers, x = arch_bridge(), 3, 3.25
    outline = fill_of(structure).points
    top = outline[:, 1].max()
    bottom = sorted(map(tuple, outline[outline[:, 1] < top - 1e-9]))
    triangles = []
    for (left, low), (right, high) in pairwise(bottom):
        for k, up in pairwise(np.linspace(0.0, 1.0, layers + 1)):
            quad = np.array(
                [
                    (left, low + k * (top - low)),
                    (right, high + k * (top - high)),
                    (right, high + up * (top - high)),
                    (left, low + up * (top - low)),
                ]
            )
            triangles += [(quad[n], quad[(n + 1) % 4], tuple(quad.mean(axis=0))) for n in range(4)]
    ends = [
        rectangle(bottom[0][0] - 1.0, bottom[0][1], bottom[0][0], top, "left end", fixed=True),
        rectangle(bottom[-1][0], bottom[-1][1], bottom[-1][0] + 1.0, top, "right end", fixed=True),
        rectangle(x - 0.6, top, x + 0.6, top + 0.01, "footing"),
    ]
    cut = in_triangles(structure, triangles, 35.0, ends, loose=("footing",))
    load = af.PointLoad(x, (0.0, -1e3))
    bound = af.collapse_factor(cut, live=load).factor
    by_part = [
        af.collapse_factor(
            structure,
            live=load,
            fill=af.limit.Fill(friction_angle=35.0, spread=40.0, mobilisation=part),
        ).factor
        for part in (1.0 / 3.0, 1.0)
    ]
    assert by_part[0] < by_part[1] < bound < 3.0 * by_part[0]
