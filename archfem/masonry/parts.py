"""Roles of parts (ring, pier, other) and directions of rings and piers.

Blocks and joints may state the role of their part (`Block.role`, `Joint.role`). Otherwise words of
the part's name decide, with a warning where they are ambiguous.

The direction of a ring orders and names its joints. A circle is fitted to the mid-points of the
joints between its stones (Kåsa, IEEE Transactions on Instrumentation and Measurement 25 (1976) 8).
For few stones it is fitted to their centroids as well. Only directions are derived from it, so
elliptic and pointed arches are covered.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, dataclass, replace
from itertools import combinations, product
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from archfem._typing import Array, Numbers
from archfem.errors import InvalidStructure, logger
from archfem.masonry.block import Block, as_point, rotate, say_place
from archfem.units import format_mm

# Rings and piers are assessed; other parts follow their support.
PART_ROLES = ("ring", "pier", "other")

# Span of a stone, and hollow of its inner face, over depths, above which several were drawn as one
# [-]. Voussoirs as long as deep have a hollow of 0.02, and short keystones of pointed arches have
# 0.4. Rings of five stones, with 2.8 and 0.26, bore 1.1 to 1.5 times the push of rings of many.
MAX_SPAN, MAX_HOLLOW = 2.5, 0.25

# Cosine of the slope up to which a bed is level as drawn, and a springer has none towards its ring
MIN_LEVEL_COSINE = 0.999

# Cosine of the angle up to which faces of a springing are parallel [-]
PARALLEL = 0.98


class Member(Protocol):
    """A block or joint as a member of a part."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def name(self) -> str:
        """Name in tables and messages."""

    @property
    def part(self) -> str:
        """Part of the structure."""

    @property
    def role(self) -> str:
        """Role of that part, one of `PART_ROLES`, or empty."""


AnyMember = TypeVar("AnyMember", bound=Member)


def assign_roles(
    members: Sequence[AnyMember], others: Sequence[Member] = ()
) -> tuple[AnyMember, ...]:
    """Return blocks or joints with the roles of their parts, derived where none is given."""
    # a role given for one member holds for its part; without any, the name of the part decides
    roles = _collect_roles((*members, *others))
    for each in members:
        if each.part not in roles:
            # nothing depends on the role of a support
            fixed = all(getattr(m, "fixed", False) for m in members if m.part == each.part)
            roles[each.part] = infer_role(each.part, warn=not fixed)
    return tuple(each if each.role else replace(each, role=roles[each.part]) for each in members)


def _collect_roles(members: Sequence[Member]) -> dict[str, str]:
    """Collect the roles that members state for their parts."""
    first: dict[str, Member] = {}
    for each in members:
        if not each.role:
            continue
        if each.role not in PART_ROLES:
            raise InvalidStructure(
                f"'{each.name}' of part '{each.part}' has role {each.role!r}, which is not known: "
                f"use one of {list(PART_ROLES)}"
            )
        other = first.setdefault(each.part, each)
        if other.role != each.role:
            raise InvalidStructure(
                f"of part '{each.part}', '{other.name}' has role '{other.role}' and "
                f"'{each.name}' has role '{each.role}': give all blocks and joints of a part one "
                "role, or put them into different parts"
            )
    return {part: member.role for part, member in first.items()}


def infer_role(part: str, *, warn: bool = True) -> str:
    """Infer the role of a part from the words of its name; warn where they are ambiguous."""
    # words of the name of a part, in the singular, that identify its role
    role_words = {
        "ring": frozenset({"arch", "ring", "architrave", "beam", "lintel"}),
        "pier": frozenset({"pier", "column", "jamb", "pillar", "post"}),
        "other": frozenset({"abutment", "base", "foundation", "footing", "ground", "rock", "slab"})
        | {"backfill", "backing", "earth", "fill", "filling", "infill", "soil"}
        | {"parapet", "sidewall", "spandrel", "wall", "wingwall"}
        | {"ballast", "deck", "pavement", "paver", "paving", "road"},
    }
    # A name without any of `role_words` is neither ring nor pier; a name with words of several
    # roles has the first of `PART_ROLES`. A part without a name is a ring.
    if not part:
        return "ring"
    words = re.findall(r"[^\W\d_]+", part.lower())
    singular = {word.removesuffix(plural) for word in words for plural in ("", "s", "es")}
    named = [role for role in PART_ROLES if singular & role_words[role]]
    role = named[0] if named else "other"
    if warn and len(named) != 1:
        why = f"has words of {' and '.join(named)}" if named else "has no word of a known role"
        logger.warning(
            "part '%s' is taken for %s: its name %s. Set its role to ring, pier or other: "
            'Block(role="ring"), or in a survey role = "ring" as a property of its outlines or of '
            "their layer in [structure.layers]",
            part,
            {"ring": "a ring", "pier": "a pier", "other": "neither ring nor pier"}[role],
            why,
        )
    return role


def select_assessed_parts(roles: Mapping[str, str]) -> tuple[str, ...]:
    """Return the parts whose failures and motions are assessed, in their order."""
    # rings and piers; without any, as in a single wall, all parts
    return tuple(part for part, role in roles.items() if role != "other") or tuple(roles)


def find_misplaced(
    blocks: Sequence[Block], owners: Sequence[Member], pairs: Numbers, normals: Array, depths: Array
) -> dict[int, str]:
    """Find stones that may be on a wrong layer of a drawing, and describe each.

    `owners` are the joints, which have the part across which they lie.
    """
    found = _find_strays(blocks, pairs, normals, depths)
    found |= _find_voussoirs(blocks, owners, pairs, normals, depths)
    found |= _find_courses(blocks, pairs, normals, depths)
    found |= _find_pier_tops(blocks, pairs, normals, depths)
    return {
        number: f"'{blocks[number].name}' at {say_place(as_point(blocks[number].centroid))} m is a "
        f"stone of '{blocks[number].part}', {why}: it may be one of {part}"
        for number, (why, part) in found.items()
    }


def _find_strays(
    blocks: Sequence[Block], pairs: Numbers, normals: Array, depths: Array
) -> dict[int, tuple[str, str]]:
    """Find stones apart from others of their ring or pier: why, and other parts.

    A few stones apart carry a pier, lie on one as piers do, or stand between voussoirs. The last
    stone of a ring is as broad as its pier at one end alone, or carries the ring on a level joint.
    """
    parts = np.array(["" if b.fixed or b.role == "other" else b.part for b in blocks])
    sides = parts[pairs]
    same, moving = sides[:, 0] == sides[:, 1], (sides != "").all(axis=1)
    links = np.ones(np.count_nonzero(same & moving)), pairs[same & moving].T
    pieces = connected_components(coo_matrix(links, (len(blocks), len(blocks))), directed=False)[1]
    sizes = np.bincount(pieces)[pieces]
    largest = {part: sizes[parts == part].max() for part in {*parts}}
    # other arches of one part are no strays
    small = [2 * n <= largest[part] for n, part in zip(sizes, parts, strict=True)]
    touched: dict[tuple[int, str], list[tuple[int, int, Array]]] = {}
    found = {}
    for number in np.flatnonzero(~same & moving):
        pair, normal, depth = pairs[number].tolist(), normals[number], depths[number]
        for (a, b), away in ((pair, normal), (pair[::-1], -normal)):
            # a stray within a ring cuts it into pieces, which may be small too
            if small[a] and not (small[b] and sizes[b] < sizes[a]):
                touched.setdefault((int(pieces[a]), parts[b]), []).append((a, b, away))
            elif (blocks[a].role, blocks[b].role) == ("ring", "pier") and away[1] < -0.5:
                mine = (sides == parts[a]).any(axis=1) & moving
                usual = float(np.median(depths[mine & same])) if (mine & same).any() else np.inf
                one_end = depths[mine & ~same].min() < 1.15 * usual
                # a springer has a sloping joint towards the ring, the top of a pier a level one
                inner = normals[same & (pairs == a).any(axis=1), 1]
                is_top = min(abs(away[1]), np.abs(inner).min(initial=1.0)) > MIN_LEVEL_COSINE
                if (one_end or is_top) and depth > max(
                    1.3 * usual, np.ptp(blocks[b].points[:, 0]) / 1.05
                ):
                    why = f"{format_mm(depth)} broad as '{blocks[b].name}' below, where its joints"
                    found[a] = f"{why} are {format_mm(usual)} deep", f"'{parts[b]}'"
    for (piece, _), faces in touched.items():
        (a, b, _), away = faces[0], np.array([face for *_, face in faces])
        # a ring lies on piers, and a pier carries rings: neither is the other way round
        bed = (np.abs(away) if blocks[a].role == "pier" else away)[:, 1].max() > 0.5
        others = np.array([face for key in touched if key[0] == piece for *_, face in touched[key]])
        if bed if blocks[b].role == "pier" else (away @ others.T).min() < -0.7:
            beside = " or ".join(f"'{part}'" for other, part in touched if other == piece)
            found[a] = "apart from most others of it", beside
    return found


def _find_voussoirs(
    blocks: Sequence[Block], owners: Sequence[Member], pairs: Numbers, normals: Array, depths: Array
) -> dict[int, tuple[str, str]]:
    """Find stones of piers, or of neither, with joints as deep as those of a ring beside them."""
    sides = np.array(["" if b.fixed else b.part for b in blocks])[pairs]
    of = np.array([owner.part for owner in owners])
    found = dict[int, tuple[str, str]]()
    for ring in dict.fromkeys(owner.part for owner in owners if owner.role == "ring"):
        inner = (sides == ring).all(axis=1)
        usual = float(np.median(depths[inner])) if inner.any() else np.inf
        # faces of stones of neither: the part beside them, and away from the stone
        faces: dict[int, list[tuple[str, Array]]] = {}
        beds, links = dict[int, Array](), list[tuple[int, int, Array]]()
        for number in np.flatnonzero((np.abs(depths / usual - 1.0) < 0.05) & ~inner):
            pair, normal = pairs[number].tolist(), normals[number]
            for (a, b), away in ((pair, normal), (pair[::-1], -normal)):
                stone, near = blocks[a], blocks[b]
                if stone.fixed or near.fixed or near.role == "other":
                    continue
                links.append((a, b, away))
                broad = bool(np.median(depths[of == near.part].tolist() or [0.0]) > 1.3 * usual)
                if stone.role == "other" and (of[number] == ring or broad):
                    faces.setdefault(a, []).append((near.part, away))
                elif stone.part == near.part and stone.role == "pier" and broad and away[1] < 0.0:
                    beds[a] = away
        # a loose stone beside the springing touches the back of the ring at most
        up = {(a, b) for a, b, away in links if a in beds and beds[a] @ away < -0.7}
        own = {*pairs[inner].ravel().tolist()}
        while more := {a for a, b in up if b in own} - own:
            own |= more
            why = f"whose joint is as deep as those of '{ring}'"
            found |= dict.fromkeys(more, (why, f"'{ring}'"))
        for a, touched in faces.items():
            towards = np.array([away for _, away in touched])
            if ring in dict(touched) and (towards @ towards.T).min() < -0.7:
                between = " and ".join(dict.fromkeys(f"'{part}'" for part, _ in touched))
                why = f"between {between} by joints as deep as those of '{ring}'"
                found[a] = why, f"'{ring}'"
    return found


def _find_courses(
    blocks: Sequence[Block], pairs: Numbers, normals: Array, depths: Array
) -> dict[int, tuple[str, str]]:
    """Find stones as broad as the pier on them, of a part whose other stones project."""
    piers, projecting = dict[int, str](), set[str]()
    for pair, normal, depth in zip(pairs.tolist(), normals, depths, strict=True):
        below, above = pair if normal[1] > 0.0 else pair[::-1]
        low, high = blocks[below], blocks[above]
        if abs(normal[1]) < 0.5 or low.role != "other" or low.fixed or high.fixed:
            continue
        if np.ptp(low.points[:, 0]) > 1.05 * depth:
            projecting.add(low.part)
        elif high.role == "pier":
            piers[below] = high.part
    return {
        number: (f"as broad as '{pier}' on it, where others of it project", f"'{pier}'")
        for number, pier in piers.items()
        if blocks[number].part in projecting
    }


def _find_pier_tops(
    blocks: Sequence[Block], pairs: Numbers, normals: Array, depths: Array
) -> dict[int, tuple[str, str]]:
    """Find stones of rings that are broad on a level bed, and narrow towards the ring."""
    found = {}
    for pair, normal, depth in zip(pairs.tolist(), normals, depths, strict=True):
        below, above = pair if normal[1] > 0.0 else pair[::-1]
        low, high, least = blocks[below], blocks[above], depths[(pairs == above).any(axis=1)].min()
        one_ring = low.part == high.part and high.role == "ring" and not low.fixed
        if one_ring and abs(normal[1]) > MIN_LEVEL_COSINE and depth > 1.3 * least:
            why = (
                f"{format_mm(depth)} broad on '{low.name}' and {format_mm(least)} at its other end"
            )
            found[above] = why, "a pier below the ring, which needs a part of its own"
    return found


def find_undivided(
    blocks: Sequence[Block], owners: Sequence[Member], pairs: Numbers, ends: Array
) -> dict[int, tuple[float, float]]:
    """Find stones of rings that could hinge inside: their span and hollow, relative to depths.

    The hollow is that of the inner face below the chord of its ends, over the depth there. In an
    arc of constant depth a straight thrust from joint to joint is that eccentric halfway.
    """
    faces: dict[int, list[Array]] = {}
    for number in (k for k, owner in enumerate(owners) if owner.role == "ring"):
        for k in pairs[number].tolist():
            if blocks[k].role == "ring" and not blocks[k].fixed:
                faces.setdefault(k, []).append(ends[number])
    found = {}
    for k, own in faces.items():
        measured = (_measure_hollow(blocks[k], *pair) for pair in combinations(own, 2))
        span, hollow = max(measured, default=(0.0, 0.0))
        if span > MAX_SPAN and hollow > MAX_HOLLOW:
            found[k] = span, hollow
    return found


def _measure_hollow(block: Block, one: Array, other: Array) -> tuple[float, float]:
    """Return the distance of two joints and the hollow of a stone between, relative to depths."""
    span = float(np.linalg.norm((other - one).mean(axis=0)) / np.linalg.norm(one[1] - one[0]))
    # the ends of an inner face are nearest to one another
    start, end = min(product(one, other), key=lambda pair: float(np.linalg.norm(pair[1] - pair[0])))
    middle, chord = 0.5 * (start + end), float(np.linalg.norm(end - start))
    if chord == 0.0:  # a wedge, with both joints about one corner
        return span, 0.0
    side = rotate(end - start, 0.5 * np.pi) / chord * 10.0 * np.ptp(block.points, axis=0).max()
    across = shapely.LineString([middle - side, middle + side])
    sections = shapely.get_parts(shapely.intersection(shapely.Polygon(block.drawn()), across))
    section = min(sections, key=shapely.Point(middle).distance)
    return span, float(section.distance(shapely.Point(middle)) / max(section.length, 1e-9))


@dataclass(frozen=True, eq=False)
class Direction:
    """Direction of a ring or pier."""

    middle: Array  # mean position of its stones (2,) [m]
    centre: Array | None  # of the fitted circle (2,) [m]; None if straight
    upright: bool  # whether it is straight and vertical

    def outward(self, place: Array) -> Array:
        """Return the unit vector (2,) from the inner to the outer face, rightwards in a pier."""
        if self.centre is None:
            return np.array([1.0, 0.0] if self.upright else [0.0, 1.0])
        arm = place - self.centre
        return arm / np.linalg.norm(arm)

    def separates(self, line: Array) -> bool:
        """Return whether a line crosses the direction, as joints between its stones do."""
        step = line[1] - line[0]
        return bool(2.0 * (step @ self.outward(line.mean(axis=0))) ** 2 > step @ step)

    def along(self, place: Array) -> float:
        """Return a point's coordinate along the part: rightwards, upwards, or clockwise angle."""
        # angles start at the gap between the springings, so at the left springing
        if self.centre is None:
            return float(place[1] if self.upright else place[0])
        gap, arm = self.centre - self.middle, place - self.centre
        clockwise = np.arctan2(gap[1] * arm[0] - gap[0] * arm[1], gap @ arm) % (2.0 * np.pi)
        return float(clockwise if gap[1] <= 0.0 else -clockwise)


def find_directions(
    blocks: Sequence[Block], lines: Iterable[tuple[int, int, Array]]
) -> dict[str, Direction]:
    """Find the directions of named rings and piers, by the names of their parts."""
    stones: dict[str, list[Array]] = {}
    beds: dict[str, list[Array]] = {}
    roles = {block.part: block.role for block in blocks}
    for block in blocks:
        if block.part and not block.fixed and block.role != "other":
            stones.setdefault(block.part, []).append(block.centroid)
    for a, b, line in lines:
        part = blocks[a].part
        if part in stones and part == blocks[b].part and not blocks[a].fixed | blocks[b].fixed:
            beds.setdefault(part, []).append(line.mean(axis=0))
    for part, centroids in stones.items():
        middles = beds.get(part, [])
        stones[part] = middles if len(middles) > 2 else [*middles, *centroids]
    return {part: _fit_direction(np.array(places), roles[part]) for part, places in stones.items()}


def find_backs(
    blocks: Sequence[Block],
    lines: Iterable[tuple[int, int, Array]],
    directions: Mapping[str, Direction],
) -> set[int]:
    """Return the numbers of joints of free stones along outer faces of rings, no hinges of these.

    A stone of a spandrel or a pier is beyond. Faces across the ring are of its back too, as
    shoulders of a keystone, where the next voussoir is on that side; or where they turn away from
    the springing on that side. A flat bed below a springing is not.
    """
    backs, voussoirs = set[int](), set[tuple[int, bool]]()
    # faces across the ring by side of a stone: height over it, tangent, number, if of a support
    across: dict[tuple[int, bool], list[tuple[float, Array, int, bool]]] = {}
    for number, (a, b, line) in enumerate(lines):
        for k, next_to in ((a, b), (b, a)):
            stone, near = blocks[k], blocks[next_to]
            way, middle = directions.get(stone.part), line.mean(axis=0)
            # an upright ring has no back
            if way is None or stone.role != "ring" or stone.fixed or way.upright:
                continue
            outward, tangent = way.outward(middle), line[1] - line[0]
            if near.part == stone.part and not near.fixed:
                along = rotate(way.outward(stone.centroid), 0.5 * np.pi)
                voussoirs.add((k, bool((near.centroid - stone.centroid) @ along > 0.0)))
            elif near.role != "ring" and way.separates(line):
                tangent, away = tangent / np.linalg.norm(tangent), middle - stone.centroid
                normal = rotate(tangent, 0.5 * np.pi)
                side = (away @ normal) * (rotate(outward, 0.5 * np.pi) @ normal) > 0.0
                face = outward @ away, tangent, number, near.fixed
                across.setdefault((k, bool(side)), []).append(face)
            elif near.role != "ring" and not near.fixed and outward @ (near.centroid - middle) > 0:
                backs.add(number)
    for key, faces in across.items():
        lowest = min(faces, key=lambda face: face[0])[1]
        for _, tangent, number, is_support in faces:
            # parallel faces are a springing on several stones
            if not is_support and (key in voussoirs or abs(tangent @ lowest) < PARALLEL):
                backs.add(number)
    return backs


def _fit_direction(places: Array, role: str) -> Direction:
    """Fit the direction of a part through points (n, 2)."""
    middle = places.mean(axis=0)
    arms = places - middle
    _, spread, axes = np.linalg.svd(np.append(arms, np.zeros((2, 2)), axis=0))
    upright = bool(abs(axes[0, 1]) > abs(axes[0, 0]))
    # a circle embracing 2.5° has a spread of 0.5 % across its chord: flatter ones are straight
    if role == "pier" or spread[1] <= 0.005 * spread[0]:
        return Direction(middle, None, role == "pier" or upright)
    design = np.column_stack([2.0 * arms, np.ones(len(arms))])
    solution = np.linalg.lstsq(design, np.sum(arms**2, axis=1), rcond=None)[0]
    return Direction(middle, middle + solution[:2], upright=False)
