"""Drawings of outlines, as files that tests read, and a comparison of a structure with them."""

import json

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
