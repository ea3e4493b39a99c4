"""Dry wall WS of sawn granite, by Vasconcelos and Lourenço (2009), with the beam of its press."""

from itertools import pairwise

import numpy as np

import archfem as af


def granite_wall():
    """1.0 x 1.2 x 0.2 m of 8 courses of five stones, bonded; the beam weighs 1 kN."""

    def box(left, right, low, high, name, **options):
        outline = ((left, low), (right, low), (right, high), (left, high))
        return af.Block(outline, af.STONE, name, **options)

    blocks = [box(-0.5, 1.5, -0.2, 0.0, "base", fixed=True)]
    for course in range(8):
        edges = np.linspace(0.0, 1.0, 6)
        edges = np.array([0.0, *(edges[:-1] + 0.1), 1.0]) if course % 2 else edges
        levels = 0.15 * course, 0.15 * (course + 1)
        blocks += [box(*pair, *levels, f"{course} {pair[0]:.1f}") for pair in pairwise(edges)]
    blocks.append(box(0.0, 1.0, 1.2, 1.45, "beam"))
    contact = af.Contact(1.48e9, 0.30e9, 0.62)
    return af.masonry.assembled(blocks, lambda a, b: contact, width=0.2)
