"""Structures as input of other programs: run by OpenSees; blocks of 3DEC and UDEC by hand."""

import ast
import re
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.masonry.materials import STONE_TO_STONE

RING = {"radius": 3.0, "thickness": 0.5, "embrace": 150.0, "voussoirs": 7, "width": 1.5}


def rest_in_opensees(folder, friction):
    """The ring, and what a process of its own says: OpenSees has to be imported before PETSc."""
    if find_spec("openseespy") is None:
        pytest.skip("there is no OpenSees: pip install openseespy")
    ring = af.circular_arch(**RING, contact=replace(STONE_TO_STONE, friction=friction))
    path = af.models.write_model(ring, folder / "ring.py", points=3)
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=60)
    head, *rows = done.stdout.strip().splitlines()
    return ring, head, np.array([line.split()[1:] for line in rows], dtype=float)


@pytest.mark.parametrize(("friction", "near"), [(None, 1e-6), (0.6, 2e-3)])
def test_a_ring_rests_in_opensees_as_in_archfem(tmp_path, friction, near):
    ring, head, found = rest_in_opensees(tmp_path, friction)
    assert head == "stands under its weight"
    options = {"quadrature": "lobatto", "quadrature_points": 3, "cells": (1, 1)}
    model = af.build(ring, fidelity="rigid", **options)
    expected, free = af.dead_load(model).q.reshape(-1, 3), list(ring.free)
    # both solve the same equations; points that are hardly pressed slip by the steps of the load
    assert found[free] == pytest.approx(expected, abs=near * np.abs(expected).max())
    assert (np.delete(found, free, axis=0) == 0.0).all()


def test_a_ring_of_too_little_friction_does_not_rest_in_opensees(tmp_path):
    ring, head, _ = rest_in_opensees(tmp_path, 0.15)
    assert not af.limit.stands(ring)
    assert head == "no equilibrium was found"


def read_polyhedra(text):
    """Faces of each block of 3DEC, and its group."""
    found = []
    for command in re.findall(r"block create polyhedron ((?:.*\.\.\.\n)*.*)", text):
        group = re.match(r"group '(.*?)'", command)[1]
        faces = re.findall(r"face (.*?)(?: \.\.\.|$)", command, re.MULTILINE)
        found.append((group, [[ast.literal_eval(f"({p})") for p in f.split()] for f in faces]))
    return found


def test_polyhedra_of_3dec_are_the_blocks(tmp_path):
    ring = af.circular_arch(**RING, chords=1)
    path = af.models.write_model(ring, tmp_path / "ring.3ddat")
    found = read_polyhedra(path.read_text())
    assert [group for group, _ in found] == ["supports", *["arch"] * 7, "supports"]
    for block, (_, faces) in zip(ring.blocks, found, strict=True):
        volume = 0.0
        for face in np.array(faces, dtype=object):
            points = np.array(face.tolist(), dtype=float)
            rest = points[1:] - points[0]
            inward = sum(np.cross(a, b) for a, b in pairwise(rest))
            # clockwise as seen from outside: by the right hand the normal points inwards
            volume -= points[0] @ inward / 6.0
        assert volume == pytest.approx(block.area * 1.5, rel=1e-7)


def test_polygons_of_udec_are_the_blocks_clockwise(tmp_path):
    ring = af.circular_arch(**RING, chords=1)
    text = af.models.write_model(ring, tmp_path / "ring.dat").read_text()
    found = re.findall(r"^block create polygon (.*)$", text, re.MULTILINE)
    for block, corners in zip(ring.blocks, found, strict=True):
        x, y = np.array([ast.literal_eval(f"({p})") for p in corners.split()]).T
        # the area by the formula of the trapezia is negative clockwise
        area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
        assert area == pytest.approx(-block.area, rel=1e-7)
    assert text.count(", a support: fix it") == 2
    # corners are rounded by one per cent of the shortest edge, which must precede the blocks
    head, _ = text.split("block create polygon", 1)
    length = float(re.search(r"^block tolerance corner-round-length (.*)$", head, re.MULTILINE)[1])
    edges = [np.linalg.norm(b.points - np.roll(b.points, 1, axis=0), axis=1) for b in ring.blocks]
    assert length == pytest.approx(0.01 * min(map(min, edges)), rel=1e-5)


def test_other_joints_and_blocks_are_refused_in_words(tmp_path):
    for key, value, name in (("cohesion", 1e4, "ring.py"), ("closure", 1e-4, "ring.3ddat")):
        ring = af.circular_arch(**RING, contact=replace(STONE_TO_STONE, **{key: value}))
        with pytest.raises(af.errors.InvalidInput, match=f"has {key} = {value}, which files"):
            af.models.write_model(ring, tmp_path / name)
    angle = ((0, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3))
    blocks = [af.Block(((0, 0), (2, 0), (2, 1), (0, 1)), af.STONE, "base", fixed=True, role="pier")]
    blocks.append(af.Block(angle, af.STONE, "angle", role="pier"))
    structure = af.masonry.assembled(blocks, STONE_TO_STONE)
    with pytest.raises(af.errors.InvalidInput, match="'angle' is not convex"):
        af.models.write_model(structure, tmp_path / "angle.3ddat")
    with pytest.raises(af.errors.InvalidInput, match="suffix of the file"):
        af.models.write_model(structure, tmp_path / "angle.inp")
