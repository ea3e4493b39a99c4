"""Stonework of a bridge, block by block: rings, piers and sidewalls, and the paving."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from archfem.arguments import pieces
from archfem.errors import InvalidStructure
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import Contact, Material
from archfem.masonry.overlaps import check_apart, check_simple
from archfem.masonry.shapes.parts import Arch, Paving, Pier, Sidewall
from archfem.masonry.shapes.placed import Face, extrados_of, face_of, ring_of
from archfem.masonry.structure import Joint

DEEP = 0.2
"""Depth of the fixed blocks under piers and behind walls [m]; they do not deform."""

Courses = Pier | Sidewall
"""A part built up in courses."""


def ledge(face: Face, inward: float, walls: Sequence[Sidewall]) -> list[Point]:
    """Return what the fill lies on outside an outer springing, from the end of the deck inwards.

    Args:
        face: the springing joint.
        inward: 1 at the left end of the bridge, -1 at the right.
        walls: the sidewall behind it, or none: then the fill ends at the springing.
    """
    x, y = face[1]
    if not walls:
        return []
    wall = walls[0]
    centre = 0.5 * (face[0][0] + x)
    outer, step = centre - inward * wall.length, x - inward * wall.setback
    if wall.above <= 0.0:
        return [(outer, y)]
    return [(outer, y + wall.above), (step, y + wall.above), (step, y)]


class Site:
    """Blocks and joints of a bridge while it is being built."""

    def __init__(self, material: Material, contact: Contact, chords: int) -> None:
        self.material, self.contact, self.chords = material, contact, chords
        self.blocks: list[Block] = []
        self.joints: list[Joint] = []

    def build(
        self, arches: Sequence[Arch], piers: Sequence[Pier], sidewalls: Sequence[Sidewall]
    ) -> tuple[list[tuple[Face, Face]], list[list[Point]]]:
        """Build all stonework below the fill, from left to right.

        Args:
            arches: the rings.
            piers: between them, one fewer, or also under both ends, one more.
            sidewalls: left and right, or none.

        Returns:
            The two springing joints of each ring, and the points along its extrados [m].

        Raises:
            InvalidStructure: parts do not fit beside one another.
        """
        rings, x = [], sidewalls[0].length if sidewalls else 0.0
        ends: Sequence[Courses] = sidewalls
        if len(piers) > len(arches):
            ends, piers = (piers[0], piers[-1]), piers[1:-1]
        for number, arch in enumerate(arches):
            rings.append(ring_of(arch, x, self.material, self.contact, self.chords))
            x += arch.span + (piers[number].gap if number < len(piers) else 0.0)
        faces = [(ring.joints[0], ring.joints[-1]) for ring in rings]
        springings = [(face_of(left), face_of(right)) for left, right in faces]
        support = self._end(springings[0][0], 1.0, ends[:1], "left abutment")
        for number, (arch, ring) in enumerate(zip(arches, rings, strict=True)):
            first = len(self.blocks)
            self.blocks += ring.blocks[1:-1]
            last, right = len(self.blocks) - 1, springings[number][1]
            if number < len(piers):
                after = self._pier(piers[number], right, springings[number + 1][0])
            else:
                after = self._end(right, -1.0, ends[1:], "right abutment")
            stones = [support, *range(first, last + 1), after]
            for k, (pair, joint) in enumerate(zip(pairwise(stones), ring.joints, strict=True)):
                self._join(pair, face_of(joint), f"joint {k}", arch)
            support = after
        return springings, [extrados_of(ring) for ring in rings]

    def add(
        self,
        outline: Sequence[Point],
        name: str,
        material: Material | None = None,
        *,
        part: str | None = None,
        role: str = "other",
        fixed: bool = False,
        structured: bool = False,
    ) -> int:
        """Return the number of a block that is added.

        Args:
            outline: its vertices, either way round; repeated ones are dropped [m].
            name: of the block.
            material: by default that of all stones.
            part: it belongs to; by default one of its own, called as it is.
            role: of that part.
            fixed: whether it is an abutment or foundation.
            structured: whether its first four vertices are the corners of a structured mesh.
        """
        points = [(float(px), float(py)) for px, py in outline]
        points = [point for k, point in enumerate(points) if point != points[k - 1]]
        x, y = np.array(points).T
        if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0.0:
            points = [points[0], *reversed(points[1:])]
        corners = (0, 1, 2, 3) if structured else None
        self.blocks.append(
            Block(
                tuple(points),
                material or self.material,
                name,
                fixed,
                corners,
                part or name,
                role=role,
            )
        )
        return len(self.blocks) - 1

    def pave(self, surface: Sequence[Point], paving: Paving) -> None:
        """Lay paving stones on a surface.

        Args:
            surface: points along it, from left to right [m].
            paving: the stones, about as long as they are asked to be.
        """
        breaks, levels = np.array(surface).T
        parts = [
            np.linspace(a, b, pieces(b - a, paving.length, "paving stones") + 1)[:-1]
            for a, b in pairwise(breaks)
        ]
        x = np.append(np.concatenate(parts), breaks[-1])
        y = np.interp(x, breaks, levels)
        for k in range(len(x) - 1):
            low = [(x[k], y[k]), (x[k + 1], y[k + 1])]
            high = [(px, py + paving.thickness) for px, py in reversed(low)]
            self.add([*low, *high], f"paving stone {k + 1}", part="paving", structured=True)

    def check(self) -> None:
        """Refuse blocks that cross themselves or one another: their lengths do not go together.

        Raises:
            InvalidStructure: names the blocks.
        """
        outlines = [block.points for block in self.blocks]
        names = [block.name for block in self.blocks]
        for outline, name in zip(outlines, names, strict=True):
            check_simple(outline, name)
        check_apart(outlines, names)

    def _join(self, pair: tuple[int, int], ends: Face, words: str, part: Arch | Courses) -> None:
        name = f"{part.name}, {words}"
        self.joints.append(Joint(pair, *ends, self.contact, name, part.name, part.role))

    def _stone(
        self,
        outline: Sequence[Point],
        words: str,
        part: Courses,
        *,
        fixed: bool = False,
        structured: bool = False,
    ) -> int:
        """Add a block of a pier or a sidewall; its number."""
        name = f"{part.name}, {words}"
        return self.add(
            outline, name, part=part.name, role=part.role, fixed=fixed, structured=structured
        )

    def _pier(self, pier: Pier, left: Face, right: Face) -> int:
        """A pier under two springings; the number of its skewback."""
        (x0, y0), (x1, y1) = left[0], right[0]
        step = pier.height / pieces(pier.height, pier.course, f"courses of '{pier.name}'")
        if not left[1][0] < right[1][0] or min(y0, y1) <= -step:
            raise InvalidStructure(
                f"'{pier.name}': rings do not stand side by side on a gap of {pier.gap:.3g} m "
                f"and a course of {step:.3g} m: give a wider gap or higher courses"
            )
        below = self._courses((x0, x1), (-pier.height, -step), pier)
        outline = [(x0, -step), (x1, -step), right[0], right[1], left[1], left[0]]
        top = self._stone(outline, "skewback", pier)
        self._bed((below, top), (x0, x1), -step, pier)
        return top

    def _courses(
        self, sides: tuple[float, float], levels: tuple[float, float], part: Courses
    ) -> int:
        """A foundation and courses between two levels; the number of the uppermost."""
        low = levels[0]
        under = [(sides[0], low - DEEP), (sides[1], low - DEEP), (sides[1], low), (sides[0], low)]
        below = self._stone(under, "foundation", part, fixed=True)
        return self._stack(below, sides, levels, part)

    def _stack(
        self,
        below: int,
        sides: tuple[float, float],
        levels: tuple[float, float],
        part: Courses,
    ) -> int:
        """Courses on a block, between two levels; the number of the uppermost."""
        low, high = levels
        if high - low < 1e-9:
            return below
        count = pieces(high - low, part.course, f"courses of '{part.name}'")
        for y, top in pairwise(np.linspace(low, high, count + 1)):
            number = self._course(sides, (y, top), part)
            self._bed((below, number), sides, y, part)
            below = number
        return below

    def _course(
        self, sides: tuple[float, float], levels: tuple[float, float], part: Courses
    ) -> int:
        """One rectangular course."""
        (left, right), (low, top) = sorted(sides), levels
        count = sum(block.part == part.name and not block.fixed for block in self.blocks)
        outline = [(left, top), (left, low), (right, low), (right, top)]
        return self._stone(outline, f"course {count + 1}", part, structured=True)

    def _bed(
        self, pair: tuple[int, int], sides: tuple[float, float], level: float, part: Courses
    ) -> None:
        """A level joint between two courses."""
        left, right = ((float(x), float(level)) for x in sorted(sides))
        count = sum(joint.part == part.name for joint in self.joints)
        self._join(pair, (left, right), f"joint {count}" if count else "base", part)

    def _end(self, face: Face, inward: float, walls: Sequence[Courses], bare: str) -> int:
        """What an outer springing bears on; the number of the block at the joint."""
        if not walls:
            outer, inner = face[1], face[0]
            radial = np.subtract(outer, inner)
            back = inward * 0.5 * np.array([-radial[1], radial[0]])
            far = [tuple(np.add(point, back)) for point in (outer, inner)]
            return self.add([inner, outer, *far], bare, fixed=True, structured=True)
        if isinstance(walls[0], Pier):
            return self._end_pier(walls[0], face, inward)
        return self._wall(walls[0], face, inward)

    def _end_pier(self, pier: Pier, face: Face, inward: float) -> int:
        """A pier under the only springing at an end; the number of its skewback."""
        (x, y), (edge, level) = face
        outer = 0.5 * (x + edge) - inward * pier.gap
        step = pier.height / max(1, round(pier.height / pier.course))
        if not inward * (edge - outer) >= 0.0 or y <= -step:
            raise InvalidStructure(
                f"'{pier.name}': a ring does not stand on a gap of {pier.gap:.3g} m and a course "
                f"of {step:.3g} m: give a wider gap or higher courses"
            )
        below = self._courses((outer, x), (-pier.height, -step), pier)
        outline = [(outer, -step), (x, -step), (x, y), (edge, level), (outer, level)]
        top = self._stone(outline, "skewback", pier)
        self._bed((below, top), (outer, x), -step, pier)
        return top

    def _wall(self, wall: Sidewall, face: Face, inward: float) -> int:
        """A sidewall; the number of its skewback."""
        (x, y), (edge, level) = face
        steps = ledge(face, inward, [wall])
        outer = steps[0][0]
        back = edge - inward * wall.setback
        room = inward * (back - outer)
        if room <= 0.0:
            raise InvalidStructure(
                f"'{wall.name}': nothing is left of its length {wall.length:.3g} m behind the ring "
                f"and the setback of {wall.setback:.3g} m: give it more length or less setback"
            )
        if wall.state == "fixed":
            outline = [(outer, -wall.height), (x, -wall.height), (x, y), (edge, level)]
            return self.add([*outline, *reversed(steps)], wall.name, role=wall.role, fixed=True)
        step = wall.height / pieces(wall.height, wall.course, f"courses of '{wall.name}'")
        below = self._courses((outer, x), (-wall.height, -step), wall)
        corner = [(back, level)] if wall.setback > 0.0 else []
        outline = [(back, -step), (x, -step), (x, y), (edge, level), *corner]
        skewback = self._stone(outline, "skewback", wall)
        self._bed((below, skewback), (back, x), -step, wall)
        behind = self._course((outer, back), (-step, level), wall)
        self._bed((below, behind), (outer, back), -step, wall)
        high = level + wall.above
        self._stack(behind, (outer, back), (level, high), wall)
        if wall.state == "retained":
            far = outer - inward * DEEP
            corners = [(outer, -wall.height), (outer, high), (far, high), (far, -wall.height)]
            self._stone(corners, "retaining wall", wall, fixed=True)
        return skewback
