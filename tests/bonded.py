"""Walls of dry stones in running bond."""

from itertools import pairwise

import archfem as af


def bonded_wall(courses, half=2.0, course=0.25, length=0.5, friction=0.6):
    """Build a wall of stones in running bond on the ground."""
    ground = [(-half - 1.0, -0.5), (half + 1.0, -0.5), (half + 1.0, 0.0), (-half - 1.0, 0.0)]
    blocks = [af.Block(ground, af.STONE, "ground", fixed=True, part="ground", role="other")]
    for k in range(courses):
        count = int(half / length) + 1
        heads = [length * (i + 0.5 * (k % 2)) for i in range(-count, count + 1)]
        places = [-half, *(x for x in heads if abs(x) < half - 0.1), half]
        low, high = k * course, (k + 1) * course
        for a, b in pairwise(places):
            corners = [(a, low), (b, low), (b, high), (a, high)]
            name = f"course {k + 1}, stone {len(blocks)}"
            blocks.append(af.Block(corners, af.STONE, name, part="wall", role="pier"))
    return af.masonry.assembled(blocks, af.Contact(1.48e9, 0.3e9, friction=friction), width=0.4)
