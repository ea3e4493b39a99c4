"""Drawings of outlines, as files that tests read, and a comparison of a structure with them."""

import json
import re

import ezdxf
import numpy as np
import pytest
import shapely

import archfem as af


def square(x, y, size=1.0):
    return [[x, y], [x + size, y], [x + size, y + size], [x, y + size]]


def geojson(path, outlines, **more):
    """Write outlines: name, points and further properties of each."""
    features = [
        {
            "type": "Feature",
            "properties": {"name": name, "fixed": k == 0} | more,
            "geometry": {"type": "Polygon", "coordinates": [[*points, points[0]]]},
        }
        for k, (name, points) in enumerate(outlines.items())
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def dxf(path, structure, factor=1.0, units=6):
    """Write a structure's blocks on layers by part, and their names as texts."""
    drawing = ezdxf.new()
    drawing.units = units
    space = drawing.modelspace()
    for block in structure.blocks:
        layer = f"{block.part}-fixed" if block.fixed else block.part
        points = factor * block.points
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
        at = shapely.Polygon(points).representative_point().coords[0]
        space.add_text(block.name, dxfattribs={"insert": at, "layer": "TEXT"})
    drawing.saveas(path)
    return path


def layers_of(structure):
    found = {}
    for block in structure.blocks:
        name = f"{block.part}-fixed" if block.fixed else block.part
        found[name] = af.masonry.Layer(
            part=block.part, material=block.material.name, fixed=block.fixed
        )
    return found


def assert_same(found, given, tolerance):
    """All joints of rings and piers by name, all others by their blocks, with the same ends."""
    assert [block.name for block in found.blocks] == [block.name for block in given.blocks]
    assert len(found.joints) == len(given.joints)
    named = {joint.name: joint for joint in found.joints}
    for joint in given.joints:
        if joint.role == "other":
            others = [each for each in found.joints if set(each.blocks) == set(joint.blocks)]
            away = [np.abs(each.ends - joint.ends).max() for each in others]
            mine = others[int(np.argmin(away))]
        else:
            mine = named[joint.name]
        assert set(mine.blocks) == set(joint.blocks)
        assert mine.ends == pytest.approx(joint.ends, abs=tolerance)
        assert (mine.part, mine.role) == (joint.part, joint.role)
        assert mine.contact == joint.contact


PORTAL = """
[structure]
shape = "outlines"
file = "portal.dxf"
snap = "4 mm"
[structure.layers]
RING = { part = "arch", role = "ring" }
WEST = { part = "west pier", role = "pier" }
EAST = { part = "east pier", role = "pier" }
SLAB = { part = "slab", fixed = true }
[model]
fidelity = "rigid"
"""


def draw_portal(folder, moved=(), change=None, header=4, on_piers=False):
    """Draw an arch on piers of three courses in mm, off by up to 1.5 mm, and write its case.

    Stones are named by layer and number; `moved` puts some on other layers, and `change` may edit
    the polygons by these names. `on_piers` has both piers on one layer.
    """
    sizes = {"radius": 1.6, "thickness": 0.3, "voussoirs": 11, "pier_breadth": 0.45}
    drawn = af.arch_on_piers(**sizes, courses=[0.4, 0.45, 0.5], chords=1)
    layers = {"arch": "RING", "left pier": "WEST", "right pier": "EAST"}
    stones, chance = {}, np.random.default_rng(5)
    for block in drawn.blocks:
        if not block.fixed:
            layer = layers[block.part]
            number = 1 + sum(name.startswith(layer) for name in stones)
            stones[f"{layer} {number}"] = 1e3 * block.points
    low = min(points[:, 1].min() for points in stones.values())
    stones["SLAB 1"] = np.array(
        [[-2500.0, low - 300.0], [2500.0, low - 300.0], [2500.0, low], [-2500.0, low]]
    )
    stones = {name: at + chance.uniform(-1.5, 1.5, at.shape) for name, at in stones.items()}
    if change is not None:
        change(stones)
    drawing = ezdxf.new()
    drawing.units = header
    for name, points in stones.items():
        layer = dict(moved).get(name, name.split()[0])
        layer = "PIERS" if on_piers and layer in ("WEST", "EAST") else layer
        drawing.modelspace().add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    drawing.saveas(folder / "portal.dxf")
    text = PORTAL
    if on_piers:
        text = re.sub("WEST.*\nEAST.*", 'PIERS = { part = "piers", role = "pier" }', text)
    (case := folder / "portal.toml").write_text(text)
    return case
