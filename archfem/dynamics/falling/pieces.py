"""Outlines cut into convex pieces: ears cut off, and put together again where that stays convex.

Ears after Meisters (American Mathematical Monthly 82 (1975) 648), merged as by Hertel and Mehlhorn
(1983), which gives at most four times the fewest pieces.
"""

from itertools import combinations

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidStructure

STRAIGHT = 1e-7
"""Turn of an outline at a vertex [rad] up to which the vertex is left out."""

Piece = tuple[int, ...]


def corners_of(points: Array) -> Array:
    """Return an outline without vertices at which it runs straight on (m, 2) [m].

    Args:
        points: vertices, anticlockwise (n, 2) [m].
    """
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    kept: Array = points[np.abs(turn) > STRAIGHT * lengths]
    return kept


def convex_pieces(points: Array) -> list[Piece]:
    """Return convex pieces that make up an outline, as numbers of its vertices, anticlockwise.

    Args:
        points: vertices of a simple polygon, anticlockwise, none on a straight edge (n, 2) [m].

    Raises:
        InvalidStructure: it crosses itself.
    """
    if _convex(points, tuple(range(len(points)))):
        return [tuple(range(len(points)))]
    pieces = _triangles(points)
    while (merged := _merged(points, pieces)) is not None:
        pieces = merged
    return pieces


def _turn(points: Array, a: int, b: int, c: int) -> float:
    """Twice the area of a triangle, positive if it runs anticlockwise."""
    (ux, uy), (vx, vy) = points[b] - points[a], points[c] - points[b]
    return float(ux * vy - uy * vx)


def _convex(points: Array, piece: Piece) -> bool:
    """Whether a piece turns left at each of its vertices, and once round."""
    n = len(piece)
    turns = [_turn(points, piece[k - 1], piece[k], piece[(k + 1) % n]) for k in range(n)]
    return min(turns) > 0.0


def _triangles(points: Array) -> list[Piece]:
    """Cut off one ear after another."""
    left = list(range(len(points)))
    found: list[Piece] = []
    while len(left) > 2:
        ear = next((k for k in range(len(left)) if _is_ear(points, left, k)), None)
        if ear is None:
            raise InvalidStructure(
                f"an outline of {len(points)} vertices near {points[left[0]]} crosses itself: "
                "correct it there"
            )
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return found


def _is_ear(points: Array, left: list[int], k: int) -> bool:
    """Whether the triangle at a vertex lies inside, with no other vertex in it."""
    a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
    if _turn(points, a, b, c) <= 0.0:
        return False
    return not any(
        min(_turn(points, *edge, other) for edge in ((a, b), (b, c), (c, a))) >= 0.0
        for other in left
        if other not in (a, b, c)
    )


def _merged(points: Array, pieces: list[Piece]) -> list[Piece] | None:
    """The pieces with two of them made one, or None where no two make a convex one."""
    for one, other in combinations(pieces, 2):
        union = _union(one, other)
        if union is not None and _convex(points, union):
            return [piece for piece in pieces if piece not in (one, other)] + [union]
    return None


def _union(one: Piece, other: Piece) -> Piece | None:
    """Two pieces across the edge that they share, or None where they share none."""
    for k in range(len(one)):
        start, end = one[k], one[(k + 1) % len(one)]
        if start in other and other[(other.index(start) - 1) % len(other)] == end:
            first = other.index(start)
            around = other[first:] + other[:first]  # from start, all the way to end
            turned = one[k + 1 :] + one[: k + 1]  # from end, all the way to start
            return turned[:-1] + around[:-1]
    return None
