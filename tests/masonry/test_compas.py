"""Plane assemblies of compas, in its three layouts: read as the structures they were made of."""

import json

import numpy as np
import pytest

import archfem as af

RING = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=9, chords=1)
LAYERS = {"blocks": af.masonry.Layer(role="ring")}


def prism(points, width=0.8, turned=False, triangles=False):
    """The data of a compas mesh: an outline extruded along y, or along x."""
    count = len(points)
    ends = [(x, depth, z) for depth in (0.1, 0.1 + width) for x, z in points]
    keys = "yxz" if turned else "xyz"
    vertex = {str(k): dict(zip(keys, each, strict=True)) for k, each in enumerate(ends)}
    front = list(range(count))
    sides = [[k, count + k, count + (k + 1) % count, (k + 1) % count] for k in range(count)]
    fronts = [[0, k, k + 1] for k in range(1, count - 1)] if triangles else [front]
    faces = [*fronts, [count + k for k in reversed(front)], *sides]
    return {"vertex": vertex, "face": {str(k): face for k, face in enumerate(faces)}}


def lay_out(kind, meshes, fixed):
    """The document of an assembly."""
    if kind == "old":
        vertex = {str(k): {"is_support": each} for k, each in enumerate(fixed)}
        return {"assembly": {"vertex": vertex}, "blocks": dict(enumerate(meshes))}
    if kind == "assembly":
        pairs = enumerate(zip(meshes, fixed, strict=True))
        node = {str(k): {"block": {"data": m}, "is_support": f} for k, (m, f) in pairs}
        data = {"graph": {"data": {"node": node}}}
        return {"dtype": "compas_assembly.datastructures/Assembly", "data": data}
    # moved back by the transformation of each element
    matrix = np.eye(4)
    matrix[0, 3] = 2.0
    moved = {"dtype": "compas.geometry/Transformation", "data": {"matrix": matrix.tolist()}}
    elements = {}
    for number, (mesh, support) in enumerate(zip(meshes, fixed, strict=True)):
        for place in mesh["vertex"].values():
            place["x"] -= 2.0
        data = {"geometry": {"data": mesh}, "is_support": support, "transformation": moved}
        elements[f"guid {number}"] = {"dtype": "compas_dem.elements/Block", "data": data}
    return {"dtype": "compas_dem.models/BlockModel", "data": {"elements": elements, "graph": {}}}


@pytest.mark.parametrize("kind", ["old", "assembly", "model"])
def test_a_plane_assembly_is_its_elevation(tmp_path, kind):
    shape = {"turned": kind == "old", "triangles": kind == "assembly"}
    meshes = [prism(block.points.tolist(), **shape) for block in RING.blocks]
    document = lay_out(kind, meshes, [block.fixed for block in RING.blocks])
    (path := tmp_path / "ring.json").write_text(json.dumps(document))
    found = af.masonry.surveyed(path, layers=LAYERS, width=0.8)
    assert len(found.joints) == len(RING.joints)
    assert [block.fixed for block in found.blocks] == [block.fixed for block in RING.blocks]
    areas = [block.area for block in RING.blocks]
    assert [block.area for block in found.blocks] == pytest.approx(areas, rel=1e-9)
    load = af.BodyForce(1.0, 0.0)
    expected = af.collapse_factor(RING, live=load).factor
    assert af.collapse_factor(found, live=load).factor == pytest.approx(expected, rel=1e-6)


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def wedge(place=0.0):
    """A block whose back is smaller than its front."""
    mesh = prism([(place + x, z) for x, z in SQUARE])
    mesh["vertex"]["5"]["x"] -= 0.2
    return mesh


NARROW = [(0.6 * x, z + 1.0) for x, z in SQUARE]


@pytest.mark.parametrize(
    ("meshes", "words"),
    [
        ([prism(SQUARE), wedge()], "it is not plane: across y 'block 1'"),
        ([wedge(3e3)], "it is not plane"),
        ([prism(SQUARE), prism(NARROW, width=0.5)], "have not the width of all blocks"),
        ([], "it has no blocks"),
        ([{"vertex": {"0": {"x": 0.0}}, "face": {}}], "'block 0' is no mesh of compas"),
        ([{"vertex": {}, "face": {}}], "'block 0' has 0 finite vertices"),
    ],
)
def test_other_assemblies_are_refused_in_words(tmp_path, meshes, words):
    document = lay_out("assembly", meshes, [False] * len(meshes))
    (path := tmp_path / "vault.json").write_text(json.dumps(document))
    with pytest.raises(af.errors.InvalidInput, match=words):
        af.masonry.read_outlines(path)


def test_a_result_without_blocks_is_no_assembly(tmp_path):
    (path := tmp_path / "result.json").write_text('{"dtype": "compas_dem.problem", "data": {}}')
    with pytest.raises(af.errors.InvalidInput, match="it is no assembly as compas_assembly"):
        af.masonry.read_outlines(path)
