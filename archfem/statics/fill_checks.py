"""Doubts about fill: in one piece that tension holds, or in pieces so coarse that they lock."""

from functools import lru_cache
from math import sqrt

import numpy as np

from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.fill_strength import Fill
from archfem.limit.linear_programme import NoEquilibrium
from archfem.limit.self_weight import self_weight_programme, stands
from archfem.masonry.backfill import TILE_AREA, jointed_fill
from archfem.masonry.loads import PointLoad
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure, join_names
from archfem.models.model import Doubt
from archfem.units import kN, kPa

# Strength of loose soil, with the cohesion with which a fill meets load tests of bridges [°], [Pa]
SOIL_ANGLE, SOIL_COHESION = 30.0, 5e3


def fill_doubts(structure: Structure) -> tuple[Doubt, ...]:
    """Return a doubt about a fill of runs, in one piece or in several."""
    return doubt_whole_fill(structure) or doubt_pieces(structure)


@lru_cache(maxsize=8)
def doubt_pieces(structure: Structure, most: float = 2.0) -> tuple[Doubt, ...]:
    """Return a doubt where pieces of fill are so coarse that they lock a ring.

    A push on the stones of rings alone fails them at a factor that pieces raise over all of their
    passive pressure: for five bridges by 1.2 to 1.8 in pieces of 1.6 times the depth of the ring or
    less, by 1.8 to 15 in those of three times that depth or more. Fine pieces that dilate, as
    this analysis lets them, may lock between high walls as well: they are not doubted.
    """
    grain = np.array([block.grain for block in structure.blocks])
    laws = [joint.contact for joint in structure.joints if grain[list(joint.blocks)].all()]
    rings = [k for k in structure.free if structure.blocks[k].role == "ring"]
    if not laws or not rings:
        return ()
    areas = [structure.blocks[k].area for k in np.flatnonzero(grain)]
    if sqrt(max(areas) / TILE_AREA) <= 2.0 * np.median(structure.depths[structure.judged]):
        return ()
    loads = [PointLoad(x, (1.0 * kN, 0.0), y) for x, y in structure.centroids[rings]]
    angle = float(np.degrees(np.arctan(laws[0].coefficient)))
    pressure = Fill(friction_angle=angle, cohesion=laws[0].cohesion, mobilisation=1.0)
    factors = []
    for fill in (None, pressure):
        stones, dead = self_weight_programme(structure, "coulomb", None, fill)
        try:
            found = dead.with_load_factor(stones.load(loads)).solve(forces=False)
        except NoEquilibrium:  # it does not stand, as others say
            return ()
        factors.append(np.inf if found is None else -found.value)
    if (ratio := factors[0] / factors[1]) <= most or np.isnan(ratio):
        return ()
    return (
        Doubt(
            "coarse pieces of fill lock the ring: a push on its stones alone fails it at {:.3g} "
            f"times the push with all passive pressure of the fill, and fine pieces at {most:g} "
            "times or less: runs and pushovers stand longer than the structure",
            "cut smaller pieces, such as half the size",
            (float(ratio),),
        ),
    )


@lru_cache(maxsize=8)
def doubt_whole_fill(structure: Structure) -> tuple[Doubt, ...]:
    """Return a doubt where fill in one piece holds itself as no soil does.

    Fill in one piece carries tension. Cut into pieces whose joints carry none, with the strength of
    loose soil, it must hold too.
    """
    angle, cohesion = SOIL_ANGLE, SOIL_COHESION
    fill = find_yielding_blocks(structure)
    if not fill or any(structure.blocks[number].grain for number in fill):
        return ()
    # about 150 pieces; with 50 to 300 the answer was the same for 15 bridges
    size = sqrt(8.0 / sqrt(3.0) * sum(structure.blocks[n].area for n in fill) / 100.0)
    pieces = jointed_fill(structure, size, friction_angle=angle, cohesion=cohesion)
    if stands_as_rigid_blocks(pieces):
        return ()
    heights = [height for number in fill for height in _free_end_heights(structure, number)]
    ends = f", and it ends in free faces of {join_names(heights)} m" if heights else ""
    return (
        Doubt(
            f"fill in one piece holds itself by tension: as soil of {angle:g}° and "
            f"{cohesion / kPa:g} kPa it does not stand under its own weight{ends}",
            "hold its ends by sidewalls ([structure.sidewalls] in a case), and compare with pieces "
            '(law = "jointed", friction_angle and piece_size in [structure.fill])',
        ),
    )


def _free_end_heights(structure: Structure, number: int) -> list[str]:
    """Return the heights of the upright ends of a fill that nothing touches, as text [m]."""
    outline, near = structure.blocks[number].drawn(), CONTACT_TOLERANCE * structure.size
    faces = [joint.ends for joint in structure.joints if number in joint.blocks]
    heights = []
    for end in (outline[:, 0].min(), outline[:, 0].max()):
        height = float(np.ptp(outline[np.abs(outline[:, 0] - end) <= near, 1]))
        held = any((np.abs(face[:, 0] - end) <= near).all() for face in faces)
        heights += [] if held or height <= near else [f"{height:.3g}"]
    return heights


def stands_as_rigid_blocks(structure: Structure) -> bool:
    """Return whether limit analysis finds it standing, or does not apply."""
    try:
        return stands(structure, strength=np.inf)
    except (InvalidInput, DidNotConverge):  # soft bodies, bonds: no comparison is possible
        return True
