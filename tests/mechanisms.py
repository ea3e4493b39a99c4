"""Structures whose joints fail, shared by tests of mechanisms."""

from dataclasses import replace

import numpy as np
import xarray as xr

import archfem as af

WEIGHT = 1e4
"""Normal force in every joint [N]: only signs and ratios matter."""

FOUR = {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5}
"""Hinges of the ring on two courses, and of the foot of its right pier."""

ALTERNATING = {0: -0.5, 6: 0.5, 12: -0.5, 17: 0.5}
"""Four hinges of a ring of 17 voussoirs that are a mechanism."""


def arch(voussoirs=17):
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=voussoirs)


def piers(courses=2, **given):
    """A ring on two piers."""
    return af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * courses, **given
    )


def filled(material=af.masonry.BACKFILL, part="backfill"):
    """The ring on piers with a body on its five upper voussoirs, and two pavers on that."""
    bare = piers(chords=1)
    stones = [block for block in bare.blocks if block.part == "arch"][5:10]
    back = [stones[0].outline[3], *(stone.outline[2] for stone in stones)]  # from left to right
    (left, _), (right, _), top = back[0], back[-1], 4.0
    contact = replace(af.masonry.SOIL_TO_STONE, name="soil")
    body = af.Block((*back, (right, top), (left, top)), material, "fill", part=part)
    pavers = [
        af.Block(((a, top), (b, top), (b, 4.2), (a, 4.2)), af.STONE, name, part="paving")
        for name, a, b in (("left paver", left, 0.0), ("right paver", 0.0, right))
    ]

    def touch(a, b):
        return contact if "fill" in (a.name, b.name) else af.masonry.STONE_TO_STONE

    return af.masonry.assembled([*bare.blocks, body, *pavers], touch, joints=bare.joints)


def beside(part):
    """The ring on piers and, apart from it, a pile of two stones."""
    bare = piers(chords=1)
    low = min(point[1] for block in bare.blocks for point in block.outline)

    def stone(level, name, fixed=False):
        outline = ((9.0, level), (9.5, level), (9.5, level + 0.5), (9.0, level + 0.5))
        return af.Block(outline, af.STONE, name, fixed, part=part)

    pile = [stone(low, "ground", True), stone(low + 0.5, "first"), stone(low + 1.0, "second")]
    return af.masonry.assembled(
        [*bare.blocks, *pile], af.masonry.STONE_TO_STONE, joints=bare.joints
    )


def failing(structure, hinges=(), sliding=(), apart=()):
    """Joints in compression, some hinging {joint: e}, sliding {joint: V/N} or without contact."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint, e in dict(hinges).items():
        resultants[joint, 2] = e * WEIGHT * structure.joints[joint].depth
    for joint, ratio in dict(sliding).items():
        resultants[joint, 1] = ratio * WEIGHT
    resultants[list(apart)] = 0.0
    return af.joints.joint_dataset(structure, resultants)


def history(structure, instants):
    """Joints over time, one state a second, with an eccentricity for each joint given."""
    steps = [failing(structure, hinges) for hinges in instants]
    return xr.concat(steps, dim="time", coords="minimal", compat="override").assign_coords(
        time=np.arange(len(instants), dtype=float)
    )


def twitching(part):
    """The ring beside a pile that hinges at 1 s by 0.01 mm; the ring moves by 3 mm from 3 s on."""
    structure = beside(part)
    joints = history(structure, [{}, {len(structure.joints) - 1: 0.5}, {}, FOUR, FOUR, {}])
    opening = np.zeros(joints["N"].shape)
    opening[1, -1], opening[3:5, list(FOUR)] = 1e-5, [[1e-3], [3e-3]]
    slip = np.full_like(opening, 0.1)  # at rest already
    dims = joints["N"].dims
    return structure, joints.assign(opening=(dims, opening), slip=(dims, slip))
