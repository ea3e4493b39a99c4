"""Models that may be chosen: which there are, in which order, and what they are compared with."""

import pytest

import archfem as af
from archfem.dynamics.candidates import LEVELS, best, candidates, label
from archfem.models.build import build

FIRST = ["rigid 1×1 exact", "faces 2×2 exact", "faces 4×4 exact", "condensed 4×4 exact"]
SECOND = ["faces 8×8 exact", "condensed 8×8 exact"]
FINER = ["condensed 8×8 exact", "condensed 12×12 exact"]
"""Another copy of what `build` with "auto" goes through, the cheapest first."""


def test_models_come_the_cheapest_first(ring):
    found = [[label(each) for each in candidates(ring, level)] for level in LEVELS]
    assert found == [FIRST, SECOND]
    assert [label(best(ring, level)) for level in LEVELS] == FINER
    sizes = [
        build(af.column(breadth=1.0, heights=[1.0]), each).size
        for each in candidates(ring, LEVELS[0])
    ]
    assert sizes == sorted(sizes)


def test_soil_keeps_its_nodes_and_is_never_rigid():
    stack = af.column(breadth=1.0, heights=[1.0])
    soft = af.Block(
        ((-0.5, 1.0), (0.5, 1.0), (0.5, 2.0), (-0.5, 2.0)), af.masonry.BACKFILL, "soil", part="fill"
    )
    contact = af.masonry.SOIL_TO_STONE
    bed = af.Joint((1, 2), (-0.5, 1.0), (0.5, 1.0), contact, "bed", "fill", "other")
    structure = af.Structure((*stack.blocks, soft), (*stack.joints, bed))
    found = [label(each) for each in candidates(structure, LEVELS[0])]
    assert found == [f"{each.replace(' ', ' + soil ', 1)}" for each in FIRST[1:]]
    (first, *_) = candidates(structure, LEVELS[0])
    assert first.fidelity == {"soil": "full", "rest": "faces"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fidelity": "full", "cells": (3, 5), "quadrature": "gauss", "points": 4}, "3×5 gauss 4"),
        ({"fidelity": "faces", "cells": (2, 1), "quadrature": "nodal"}, "faces 2×1 nodal"),
    ],
)
def test_a_model_in_a_few_words(given, words):
    assert label(af.models.Discretisation(**given)).endswith(words)
