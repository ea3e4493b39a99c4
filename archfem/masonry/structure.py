"""Structures: blocks in contact along straight dry joints, and their rigid-body motions.

A rigid motion of a block has three coordinates: two translations of its centroid and a rotation.
"""

import difflib
import hashlib
import inspect
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from itertools import pairwise
from numbers import Integral
from typing import Any, Protocol, TypeVar

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from archfem._display import ResultDisplay
from archfem._typing import Array, Flags, Metres, MetresPerSecondSquared, Numbers
from archfem._validation import check_between, check_fields, check_type
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.block import Block, Point, as_point, check_overlaps, say_place
from archfem.masonry.materials import Contact
from archfem.masonry.parts import assign_roles, find_misplaced, select_assessed_parts
from archfem.units import Ends, G


def find_number(kind: str, names: Sequence[str], requested: str | int) -> int:
    """Return the number of a block or joint, given by name or by number."""
    if isinstance(requested, str):
        if requested in names:
            return list(names).index(requested)
        near = suggest_name(requested, names, 0.0)
        others = difflib.get_close_matches(requested, list(names), 4, 0.7)[1:]
        also = f" Or one of {others}" if others else ""
        raise InvalidInput(f"there is no {kind} '{requested}': {near}{also}")
    if not isinstance(requested, Integral) or not 0 <= requested < len(names):
        raise InvalidInput(
            f"there is no {kind} {requested}: give a number from 0 to {len(names) - 1}, or a name "
            f"such as '{names[0]}'"
        )
    return int(requested)


def suggest_name(word: str, known: Iterable[str], likeness: float = 0.6) -> str:
    """Suggest the name most similar to a misspelt one; empty where none is similar."""
    folded = {name.casefold(): name for name in known}
    near = difflib.get_close_matches(word.casefold(), folded, 1, likeness)
    return f"did you mean '{folded[near[0]]}'?" if near else ""


def merge_levels(ends: Array) -> Array:
    """Return lower and upper ends of stones (n, 2), those of one bed at the lowest of them [m]."""
    # beds of a survey are level within its noise only; a stone keeps its height
    near = min(LEVEL_TOLERANCE * np.ptp(ends), 0.5 * np.diff(ends, axis=1).min())
    merged, rest = ends.copy(), ends >= ends.min()
    while rest.any():
        level = ends[rest].min()
        merged[rest & (ends <= level + near)] = level
        rest &= ends > level + near
    return merged


def join_names(names: Sequence[str], comma: str = ", ") -> str:
    """Join names to a list, shortened in the middle where it is long."""
    return _shorten_list(names, comma.join, comma)


def list_first(names: Sequence[str], most: int, comma: str = ", ") -> str:
    """Join the first names to a list, and count the others."""
    more = f" and {len(names) - most} more" * (len(names) > most)
    return f"{comma.join(names[:most])}{more}"


def join_words(words: Sequence[str]) -> str:
    """Join words to "a, b and c"."""
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def join_joint_names(names: Sequence[str], most: int = 8) -> str:
    """Join names of joints, as in "north pier, base; main arch, joints 0, 5 and 11"."""
    return _shorten_list(names, _group_by_stem, "; ", most)


# Of hinges of a mechanism of many joints, most of which turn by little
CLEAR_TURNS = "drawn in the picture where they turn clearly"


def list_or_count(names: Sequence[str], drawn: str = "drawn in the picture") -> str:
    """List the joints of a mechanism, or count them where a picture alone shows so many."""
    if len(names) > 16:
        return f"{len(names)} joints, {drawn}"
    return join_joint_names(names)


def _shorten_list(
    names: Sequence[str], put: Callable[[Sequence[str]], str], comma: str, most: int = 8
) -> str:
    """Join a list; of a long one both ends, with its length."""
    # longer lists of names in messages lose their middle
    if len(names) <= most:
        return put(names)
    return f"{put(names[:4])}{comma}…{comma}{put(names[-4:])} ({len(names)} in all)"


def _group_by_stem(names: Sequence[str]) -> str:
    """Join names of joints and write a common stem once."""
    groups: list[tuple[str, list[str]]] = []
    for name in names:
        stem, _, number = name.rpartition(" ")
        if not (stem.endswith("joint") and re.fullmatch(r"\d+", number)):
            groups.append((name, []))
        elif groups and groups[-1][1] and groups[-1][0] == stem:
            groups[-1][1].append(number)
        else:
            groups.append((stem, [number]))
    texts = []
    for stem, numbers in groups:
        several = f"{stem}s {', '.join(numbers[:-1])} and " if len(numbers) > 1 else f"{stem} "
        texts.append(several + numbers[-1] if numbers else stem)
    return "; ".join(texts)


Shape = TypeVar("Shape", bound=Callable[..., "Structure"])


def describe_assessment(
    faces: Sequence[str], parts: Sequence[str], judged: Flags, heads: Flags
) -> str:
    """Describe which joints are assessed, and which are not; empty where all are.

    Chords of one curved face, which have its name, count as one joint.
    """
    if judged.all():
        return ""
    keys = [*zip(faces, judged.tolist(), strict=True)]
    first = sorted({key: k for k, key in reversed([*enumerate(keys)])}.values())
    judged, heads = judged[first], heads[first]
    labels = np.array([parts[k] or "unnamed" for k in first])
    left_out = [str(faces[k]) for k, own in zip(first, judged, strict=True) if not own]
    if len(left_out) > 4:  # too many to be named
        words = np.where(heads, "head joints ", "")[~judged]
        counts = Counter(zip(words, labels[~judged], strict=True))
        left_out = [
            f"{count} {word.replace('joints', 'joint') if count == 1 else word}of {part}"
            for (word, part), count in counts.items()
        ]
    return (
        f"assessed: {np.count_nonzero(judged)} of {len(judged)} joints (rings and piers: "
        f"{join_names(list(dict.fromkeys(labels[judged])))}); not assessed: "
        f"{join_names(left_out, '; ')}"
    )


LARGE_STONE = 3.0  # median diagonal above which the unit is probably wrong [m]

# Distance of two coincident points, relative to the size of the structure
CONTACT_TOLERANCE = 1e-6

# Distance of the ends of stones at one bed, relative to the height of the structure
LEVEL_TOLERANCE = 0.005


@dataclass(frozen=True)
class Joint:
    """A straight dry joint between two blocks.

    Attributes:
        blocks: numbers of the two blocks it separates, in either order.
        intrados: its end on the inner face [m].
        extrados: its end on the outer face [m]; eccentricity is positive toward it.
        contact: stiffness and friction.
        name: name in tables and messages.
        part: the part of the structure it belongs to; mechanisms are counted by part.
        role: role of that part: "ring" or "pier", which are assessed, or "other". By default the
            structure derives it, as for a block.
    """

    blocks: tuple[int, int]
    intrados: Point
    extrados: Point
    contact: Contact
    name: str
    part: str = ""
    role: str = ""

    def __post_init__(self) -> None:
        """Check the types of the fields, and convert numbers to those of Python."""
        check_fields(self)
        object.__setattr__(self, "blocks", tuple(map(int, self.blocks)))
        object.__setattr__(self, "intrados", as_point(self.intrados))
        object.__setattr__(self, "extrados", as_point(self.extrados))

    @property
    def lower(self) -> int:
        """The block of lower number; the joint's normal points away from it."""
        return min(self.blocks)

    @property
    def higher(self) -> int:
        """The block of higher number."""
        return max(self.blocks)

    @cached_property
    def ends(self) -> Array:
        """Both ends, intrados first (2, 2) [m]."""
        return np.array([self.intrados, self.extrados], dtype=float)

    @cached_property
    def middle(self) -> Array:
        """Mid-point, from which eccentricity is measured (2,) [m]."""
        return 0.5 * (self.ends[0] + self.ends[1])  # a mean of arrays takes ten times as long

    @cached_property
    def depth(self) -> float:
        """Length h from intrados to extrados [m]."""
        return float(np.linalg.norm(self.ends[1] - self.ends[0]))

    @cached_property
    def tangent(self) -> Array:
        """Unit vector from intrados to extrados (2,)."""
        return (self.ends[1] - self.ends[0]) / self.depth

    def name_face(self, side: str) -> str:
        """Return "intrados" or "extrados", or which face that is of a bed in a pier."""
        across, up = self.tangent
        if self.role != "pier" or abs(up) > abs(across):
            return side
        return ("left" if (across > 0.0) == (side == "intrados") else "right") + " face"


@dataclass(frozen=True, repr=False)
class Structure(ResultDisplay):
    """Blocks in contact along dry joints.

    Attributes:
        blocks: the bodies; fixed ones are abutments. Missing roles of blocks and joints are
            derived from their parts.
        joints: the contacts between them.
        width: out-of-plane width w [m].
        gravity: acceleration of gravity, along -y [m/s²].
        name: name in titles and files.
        origin: name and arguments of the shape function that made it, or None; not compared, and
            of a changed copy still that of the original.
        above: height of the foot of a column of a wall across its plane, `columns_across`, above
            the ground; None of what is no such column [m].
    """

    blocks: tuple[Block, ...]
    joints: tuple[Joint, ...]
    width: Metres = 1.0
    gravity: MetresPerSecondSquared = G
    name: str = "structure"
    origin: tuple[str, Mapping[str, Any]] | None = field(default=None, compare=False)
    above: Metres | None = None

    def __post_init__(self) -> None:
        """Assign roles; check the values, supports and outlines."""
        check_fields(self)
        object.__setattr__(self, "blocks", assign_roles(self.blocks, self.joints))
        object.__setattr__(self, "joints", assign_roles(self.joints, self.blocks))
        remedy = "give metres; a longer vault is computed by a strip of 1 m"
        check_between(
            self.width, "width [m]", 1e-3, 300.0, ends="[)", remedy=remedy, error=InvalidStructure
        )
        check_between(self.gravity, "gravity [m/s²]", 0.1, 1e3, ends="[)", error=InvalidStructure)
        for kind, things in (("block", self.blocks), ("joint", self.joints)):
            counts = Counter(thing.name for thing in things)
            if twice := sorted(name for name, count in counts.items() if count > 1):
                raise InvalidStructure(f"{kind} names {twice} are used twice: name each once")
        if all(block.fixed for block in self.blocks):
            raise InvalidStructure("no block is free to move: leave at least one not fixed")
        smallest = min(float(np.ptp(self.blocks[k].drawn(), axis=0).max()) for k in self.free)
        if smallest > 100.0:
            raise InvalidStructure(f"the smallest stone is {smallest:.4g} m large: give metres")
        _ = self.normals
        self._check_outlines()
        self._check_support()

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around all blocks [m]."""
        points = np.concatenate([block.drawn() for block in self.blocks])
        return float(np.linalg.norm(np.ptp(points, axis=0)))

    @cached_property
    def has_own_laws(self) -> bool:
        """Whether any joint has a law of the user."""
        return any(joint.contact.law is not None for joint in self.joints)

    @cached_property
    def fingerprint(self) -> str:
        """Digest of the geometry, rounded to a billionth of its size."""
        points = [*(block.points for block in self.blocks), *(joint.ends for joint in self.joints)]
        places = np.round(np.concatenate(points) / self.size, 9) + 0.0  # -0.0 becomes 0.0
        sizes = f"{self.size:.9g} {self.width:.9g} {[len(each) for each in points]}"
        return hashlib.sha256(sizes.encode() + places.tobytes()).hexdigest()[:16]

    @cached_property
    def normals(self) -> Array:
        """Unit normals of the joints, from the lower to the higher block (n_joints, 2)."""
        return np.array([self._normal(joint) for joint in self.joints]).reshape(-1, 2)

    @cached_property
    def tangents(self) -> Array:
        """Unit vectors of the joints, from intrados to extrados (n_joints, 2)."""
        return np.array([joint.tangent for joint in self.joints])

    @cached_property
    def ends(self) -> Array:
        """Ends of the joints, intrados first (n_joints, 2, 2) [m]."""
        return np.array([joint.ends for joint in self.joints])

    @cached_property
    def middles(self) -> Array:
        """Mid-points of the joints (n_joints, 2) [m]."""
        return np.array([joint.middle for joint in self.joints])

    @cached_property
    def depths(self) -> Array:
        """Depths h of the joints (n_joints,) [m]."""
        return np.array([joint.depth for joint in self.joints])

    @cached_property
    def friction(self) -> Array:
        """Coefficients μ of the joints (n_joints,) [-]."""
        return np.array([joint.contact.coefficient for joint in self.joints])

    @cached_property
    def cohesion(self) -> Array:
        """Shear resistance by cohesion of fully closed joints, c A (n_joints,) [N]."""
        return self.width * self.depths * [joint.contact.cohesion for joint in self.joints]

    @cached_property
    def tension(self) -> Array:
        """Tensile strengths f_t of the joints (n_joints,) [Pa]."""
        return np.array([joint.contact.tension for joint in self.joints])

    @cached_property
    def pairs(self) -> Numbers:
        """Numbers of the two blocks at each joint, the lower first (n_joints, 2)."""
        return np.array([(joint.lower, joint.higher) for joint in self.joints], dtype=np.intp)

    @cached_property
    def face_spans(self) -> Array:
        """Where faces of lower and higher blocks begin and end (2, n_joints, 2) [m].

        Distances are from the intrados of each joint. A face ends with the outline of its block,
        also that of a support, whatever ground is beside it. Where both faces extend beyond an end
        of the joint they do not touch there, and it ends both.
        """
        near = CONTACT_TOLERANCE * self.size
        spans = np.empty((2, len(self.joints), 2))
        for number, joint in enumerate(self.joints):
            for side, block in enumerate((joint.lower, joint.higher)):
                spans[side, number] = self.blocks[block].face_span(joint.ends, near)
        built = np.column_stack([np.zeros(len(self.joints)), self.depths])
        return np.where((np.abs(spans - built) > near).all(axis=0), built, spans)

    @cached_property
    def end_slips(self) -> Array:
        """Slips at which both faces end together, at intrados and extrados (n_joints, 2) [m].

        Zero where both faces end with the joint; slip is positive toward the extrados.
        """
        slips = self.face_spans[0] - self.face_spans[1]
        return np.where(np.abs(slips) > CONTACT_TOLERANCE * self.size, slips, 0.0)

    def overlaps(self, slip: Array) -> tuple[Array, Array]:
        """Return length and middle of the overlap of both faces of joints that have slid.

        Args:
            slip: slip of the higher block, positive toward the extrados (…, n_joints) [m].

        Returns:
            Length of the overlap, at least 0, and its middle (…, n_joints) [m]. The middle is
            measured toward the extrados, from the mean of both places of the joint's middle, on
            either face.
        """
        # Each end of the overlap is that of the face which ends first. It moves by half the slip
        # with either face, relative to the mean of both.
        inner, outer = np.moveaxis(self.end_slips, -1, 0)
        at_inner = 0.5 * (np.abs(slip - inner) - np.abs(inner))
        at_outer = 0.5 * (np.abs(slip - outer) - np.abs(outer))
        return np.maximum(self.depths - (at_inner + at_outer), 0.0), 0.5 * (at_inner - at_outer)

    def _normal(self, joint: Joint) -> Array:
        """Outward normal of the lower block along an edge that both blocks share."""
        if not 0 <= joint.lower < joint.higher < len(self.blocks):
            raise InvalidStructure(
                f"joint '{joint.name}' is between blocks {joint.blocks}: "
                f"give two different numbers from 0 to {len(self.blocks) - 1}"
            )
        near = CONTACT_TOLERANCE * self.size
        if joint.depth <= near:
            raise InvalidStructure(
                f"joint '{joint.name}' is {joint.depth:.3g} m long: its two ends are one point"
            )
        sides = [self.blocks[number].side_of(joint.ends, near) for number in sorted(joint.blocks)]
        if sides[0] * sides[1] >= 0:
            names = [self.blocks[number].name for number in sorted(joint.blocks)]
            raise InvalidStructure(
                f"joint '{joint.name}' lists blocks {names}, which share no face along "
                f"{joint.intrados}-{joint.extrados} within {near:.1e} m: check which blocks it "
                "joins and where its ends are"
            )
        return float(sides[0]) * np.array([joint.tangent[1], -joint.tangent[0]])

    def _check_support(self) -> None:
        """Check that every block is connected, through others, to a fixed one."""
        held = find_supported_blocks(self, range(len(self.blocks)))
        if loose := [block for k, block in enumerate(self.blocks) if k not in held]:
            points = [block.drawn() for block in self.blocks]
            breadth, height = np.ptp(np.concatenate(points), axis=0)
            typical = np.median([np.hypot(*np.ptp(outline, axis=0)) for outline in points])
            question = f"of {breadth:.3g} × {height:.3g} m in all, is the unit wrong?"
            # what is said first is what a reader tries first
            before = f"{question} Or else " if typical > LARGE_STONE else ""
            after = f"; or {question}" if not before and len(loose) == len(self.free) else ""
            gaps = {self.blocks[k].name: loose[0].distance_to(self.blocks[k]) for k in held}
            nearest = min(gaps, key=gaps.__getitem__, default=None)
            away = ""
            if nearest is not None:
                away = f", {1e3 * gaps[nearest]:.3g} mm from '{nearest}', "
                away += "which a larger snap of a drawing joins"
            names = join_names([f"'{block.name}'" for block in loose])
            remedy = "join each, through others, to"
            if not held:
                remedy = "no block is fixed; add the ground, a closed outline and no line, as"
                level = "as ground = '0 m' in [structure], or as the argument ground"
                after = f"; or give a drawing its level, {level}{after}"
            raise InvalidStructure(
                f"{before}blocks {names} rest on nothing: {remedy} a fixed block, which has fixed "
                "= true, in a drawing by its layer; "
                f"'{loose[0].name}' is at {say_place(as_point(loose[0].centroid))}{away}{after}"
            )

    def _check_outlines(self) -> None:
        """Check that outlines neither cross themselves nor overlap."""
        outlines = [block.drawn() for block in self.blocks]
        # fixed blocks are one body
        body = np.array([-1 if block.fixed else k for k, block in enumerate(self.blocks)])
        check_overlaps(outlines, [block.name for block in self.blocks], body=body)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Numbers of the blocks that move."""
        return tuple(number for number, block in enumerate(self.blocks) if not block.fixed)

    @cached_property
    def first_coordinates(self) -> Numbers:
        """First of the three coordinates of each free block, -1 of a fixed one (n_blocks,)."""
        first = np.full(len(self.blocks), -1)
        first[list(self.free)] = 3 * np.arange(len(self.free))
        return first

    @cached_property
    def centroids(self) -> Array:
        """Centroids of the blocks (n_blocks, 2) [m]."""
        return np.array([block.centroid for block in self.blocks])

    @cached_property
    def heads(self) -> Flags:
        """Whether each joint is a head joint of a wall (n_joints,).

        That is a joint nearer to the vertical than to the horizontal, between two stones of one
        part that is no ring, and no fill in pieces. Both stones have bed joints.
        """
        steep = np.abs(self.normals[:, 0]) > np.abs(self.normals[:, 1])
        stones = {number for number in self.free if not self.blocks[number].grain}
        bedded = {k for pair in self.pairs[~steep].tolist() for k in pair} & stones
        parts = [block.part for block in self.blocks]
        inner = [
            joint.role != "ring" and bedded >= {a, b} and parts[a] == parts[b]
            for joint, (a, b) in zip(self.joints, self.pairs.tolist(), strict=True)
        ]
        return steep & np.array(inner, dtype=bool)

    @cached_property
    def judged(self) -> Flags:
        """Whether each joint counts: of a ring or pier, and no head joint (n_joints,)."""
        parts = select_assessed_parts({joint.part: joint.role for joint in self.joints})
        return ~self.heads & np.array([joint.part in parts for joint in self.joints], dtype=bool)

    @cached_property
    def face_names(self) -> list[str]:
        """Names of joints; those along chords of one curved face have that of the face."""
        names, chords = [joint.name for joint in self.joints], dict[tuple[int, int], list[int]]()
        for number, joint in enumerate(self.joints):
            chords.setdefault(joint.blocks, []).append(number)
        for numbers in chords.values():
            turns = (self.normals[a] @ self.normals[b] for a, b in pairwise(numbers))
            # a step, of 90°, has two faces
            if len(numbers) > 1 and min(turns) > 0.5:
                for number in numbers:
                    names[number] = re.sub(r", \d+$", "", names[number])
        return names

    @cached_property
    def misplaced(self) -> dict[int, str]:
        """Stones that may be of another part than theirs, and why in words, by number."""
        return find_misplaced(self.blocks, self.joints, self.pairs, self.normals, self.depths)

    @cached_property
    def assessment(self) -> str:
        """Which joints are assessed, and what is not, in words; empty where all are."""
        parts = [joint.part for joint in self.joints]
        return describe_assessment(self.face_names, parts, self.judged, self.heads)

    @cached_property
    def weight(self) -> float:
        """Weight of the blocks that move, for the whole width [N]."""
        free = (self.blocks[number] for number in self.free)
        return self.width * sum(block.area * block.material.unit_weight for block in free)

    def _summary(self) -> str:
        """Describe the structure in one line."""
        free, count = len(self.free), len(self.blocks)
        return (
            f"Structure '{self.name}': {free} blocks that move, {count - free} fixed, "
            f"{len(self.joints)} joints; size {self.size:.3g} m, width {self.width:.3g} m, "
            f"weight {self.weight / 1e3:.4g} kN"
        )

    def density(self, block: Block) -> float:
        """Return the density of a block's material under this structure's gravity [kg/m³].

        Args:
            block: one of the structure, or any other.
        """
        return block.material.unit_weight / self.gravity

    def joint_number(self, joint: int | str) -> int:
        """Return the number of a joint.

        Args:
            joint: number or name.

        Raises:
            InvalidInput: there is no such joint; the nearest name is suggested.
        """
        return find_number("joint", [each.name for each in self.joints], joint)

    def block_number(self, block: int | str) -> int:
        """Return the number of a block.

        Args:
            block: number or name.

        Raises:
            InvalidInput: there is no such block; the nearest name is suggested.
        """
        return find_number("block", [each.name for each in self.blocks], block)


class HasStructure(Protocol):
    """A value of which a structure is a part, such as an `archfem.Analysis`."""

    @property
    def structure(self) -> Structure:
        """Blocks and joints."""


def structure_of(subject: Structure | HasStructure) -> Structure:
    """Return a structure, or that of an analysis."""
    found: Any = getattr(subject, "structure", subject)
    check_type(found, Structure, "structure", "give a Structure, e.g. circular_arch(…)")
    return found


def record_origin(shape: Shape) -> Shape:
    """Decorate a shape function so that its structures record its name and their arguments."""

    @wraps(shape)
    def wrapper(*args: Any, **options: Any) -> Structure:
        structure = shape(*args, **options)
        arguments = inspect.signature(shape).bind(*args, **options).arguments
        object.__setattr__(structure, "origin", (shape.__name__, arguments))
        return structure

    return wrapper  # type: ignore[return-value]


def with_contacts(structure: Structure, change: Callable[[Contact], Contact]) -> Structure:
    """Return the structure with other contacts of its joints."""
    joints = (replace(joint, contact=change(joint.contact)) for joint in structure.joints)
    return replace(structure, joints=tuple(joints))


def find_supported_blocks(structure: Structure, blocks: Iterable[int]) -> set[int]:
    """Return those of some blocks that are joined to a fixed one through others of them."""
    own, pairs = [*blocks], structure.pairs.reshape(-1, 2)
    links = pairs[np.isin(pairs, own).all(axis=1)].T
    graph = coo_matrix((np.ones(links.shape[1]), links), 2 * [len(structure.blocks)])
    pieces = connected_components(graph, directed=False)[1]
    held = {pieces[number] for number in own if structure.blocks[number].fixed}
    return {number for number in own if pieces[number] in held}


def rigid_motion_matrix(points: Array, centroid: Array) -> Array:
    """Return the displacements of points for unit rigid motions of their block (p, 2, 3)."""
    # small motion (u, v, θ), θ anticlockwise: (u - θ (y - y_c), v + θ (x - x_c))
    arm = points - centroid
    motion = np.zeros((len(points), 2, 3))
    motion[:, 0, 0] = motion[:, 1, 1] = 1.0
    motion[:, 0, 2], motion[:, 1, 2] = -arm[:, 1], arm[:, 0]
    return motion


def largest_displacement(outlines: Sequence[Array], centroids: Array, motion: Array) -> float:
    """Return the largest displacement of a corner by small motions of blocks (n_blocks, 3) [m]."""
    counts = [len(points) for points in outlines]
    own, velocity = (np.repeat(each, counts, axis=0) for each in (centroids, motion))
    moved = rigid_motion_matrix(np.concatenate(outlines), own) @ velocity[:, :, None]
    return float(np.linalg.norm(moved, axis=1).max())


def find_clear_spans(structure: Structure) -> dict[str, tuple[float, float]]:
    """Return the clear span of each ring, from its left to its right end [m].

    It is between the inner ends of the outermost joints, for those of a lintel are as long as its
    bearings. A joint of the extrados, as below a gable, begins where that at the springing does,
    and is less broad. Where the upper stone of a pier is a springer, the span is that of the piers.
    """
    ends: dict[str, list[tuple[float, float, Joint]]] = {}
    for joint in structure.joints:
        if joint.role == "ring":
            low, high = sorted((joint.intrados[0], joint.extrados[0]))
            ends.setdefault(joint.part, []).append((low, high, joint))
    spans = {}
    for part, own in ends.items():
        _, low, left = min(own, key=lambda each: (round(each[0], 9), -each[1]))
        high, _, right = max(own, key=lambda each: (round(each[1], 9), -each[0]))
        low = min([low, *(end for _, end in _list_springer_beds(structure, left))])
        spans[part] = low, max([high, *(end for end, _ in _list_springer_beds(structure, right))])
    return spans


def _list_springer_beds(structure: Structure, springing: Joint) -> list[tuple[float, float]]:
    """Return both ends of the beds of a pier on which the springer at a joint stands [m]."""
    centres = dict(zip(springing.blocks, structure.centroids[[*springing.blocks], 1], strict=True))
    beds = (each for each in structure.joints if each.role == "pier")
    # a loose stone beside the ring stands on the springer
    below = (x for x in beds if any(centres.get(k, -np.inf) > x.middle[1] for k in x.blocks))
    ends = (sorted((bed.intrados[0], bed.extrados[0])) for bed in below)
    return [(low, high) for low, high in ends]


def describe_spans(structure: Structure) -> str:
    """Describe the clear span of each ring, and breadth and clear height of piers, in a line."""
    spans = find_clear_spans(structure)
    ends = (
        f"from {low:.2f} to {high:.2f} m{f' ({part!r})' if len(spans) > 1 else ''}"
        for part, (low, high) in spans.items()
    )
    piers = [f"'{part}' {words}" for part, words in describe_piers(structure).items()]
    return "; ".join([f"clear span {' and '.join(ends)}" if spans else "no ring", *piers])


def describe_piers(structure: Structure) -> dict[str, str]:
    """Describe breadth and clear height of each pier, below the ring that it bears."""
    piers = dict[str, str]()
    # the beds of a wall in bond are parts of its breadth
    walls = {structure.joints[number].part for number in np.flatnonzero(structure.heads)}
    beds = [j for j in structure.joints if j.role == "pier" and j.part not in walls]
    rings = [joint for joint in structure.joints if joint.role == "ring"]
    springers = {k for joint in rings for k in joint.blocks}.intersection(structure.free)
    for part in dict.fromkeys(joint.part for joint in beds):
        own = [joint for joint in beds if joint.part == part]
        # what is on a springer stands beside the ring
        on = [structure.centroids[k, 1] for bed in own for k in springers & {*bed.blocks}]
        own = [bed for bed in own if bed.middle[1] < max(on, default=np.inf)]
        if not own:
            continue
        parts = structure.blocks
        ends = [x.points[:, 1] for x in parts if x.part == part and not x.fixed]
        # a stone that rests on nothing has no bed below it
        base = min(*(joint.intrados[1] for joint in own), *map(min, ends), np.inf)
        clear = [
            joint.intrados[1] - base
            for joint in rings
            if part in {parts[number].part for number in joint.blocks}
        ]
        broad = Ends.of(joint.depth for joint in own)
        tall = max(map(max, ends), default=np.inf) - base
        high = f", more than {tall:.3g} m high" * bool(min(broad) > tall)
        high = f" and {min(clear):.3g} m high to the ring" if clear else high
        piers[part] = f"{broad:.4g} m broad{high}"
    return piers


def list_stack(structure: Structure) -> list[tuple[int, int]] | None:
    """Return joint and block of each course from the ground on; None unless there is one stack."""
    stack, block = list[tuple[int, int]](), None
    beside: dict[int, list[tuple[int, int]]] = {}
    for number, (a, b) in enumerate(structure.pairs.tolist()):
        beside.setdefault(a, []).append((number, b))
        beside.setdefault(b, []).append((number, a))
    onward = [x for k, each in beside.items() if structure.blocks[k].fixed for x in each]
    while len(onward) == 1:
        stack += onward
        joint, block = onward[0]
        onward = [each for each in beside[block] if each[0] != joint]
    return stack if not onward and 2 <= len(stack) == len(structure.free) else None
