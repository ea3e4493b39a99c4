"""IFC files, written by ifcopenshell: read as the structure they were made of."""

import sys

import numpy as np
import pytest

import archfem as af
from archfem.errors import NotInstalled

RING = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=9, chords=1)
LAYERS = {
    "IfcMember": af.masonry.Layer(part="arch", role="ring"),
    "IfcFooting": af.masonry.Layer(part="rock", fixed=True),
}


def write_ifc(path, blocks, width=0.8, tapered=()):
    """Write prisms in millimetres, along y, as swept solids; every second one as facets."""
    ifcopenshell = pytest.importorskip("ifcopenshell")
    file = ifcopenshell.file(schema="IFC4")

    def new(kind, *values):
        return file.create_entity(kind, *values)

    def point(*values):
        return new("IfcCartesianPoint", [1000.0 * float(value) for value in values])

    unit = new("IfcUnitAssignment", [new("IfcSIUnit", None, "LENGTHUNIT", "MILLI", "METRE")])
    axes = new("IfcAxis2Placement3D", point(0.0, 0.0, 0.0))
    context = new("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, axes)
    guid = ifcopenshell.guid.new
    file.create_entity("IfcProject", guid(), RepresentationContexts=[context], UnitsInContext=unit)
    # the profile's y is upwards, and it is swept along the building's y
    turned = new("IfcAxis2Placement3D", point(0.0, width, 0.0))
    turned.Axis = new("IfcDirection", [0.0, -1.0, 0.0])
    turned.RefDirection = new("IfcDirection", [1.0, 0.0, 0.0])
    for number, block in enumerate(blocks):
        outline = block.points.tolist()
        if number % 2:
            ends = [(x, y, z) for y in (0.0, width) for x, z in outline]
            if number in tapered:
                ends[-1] = ends[-1][0], 0.5 * width, ends[-1][2]
            count = len(outline)
            sides = [[k, (k + 1) % count, count + (k + 1) % count, count + k] for k in range(count)]
            faces = [list(range(count)), [2 * count - 1 - k for k in range(count)], *sides]
            loops = [new("IfcPolyLoop", [point(*ends[k]) for k in face]) for face in faces]
            bounds = [new("IfcFaceOuterBound", loop, True) for loop in loops]
            shell = new("IfcClosedShell", [new("IfcFace", [bound]) for bound in bounds])
            solid, kind = new("IfcFacetedBrep", shell), "Brep"
        else:
            line = new("IfcPolyline", [point(*each) for each in [*outline, outline[0]]])
            profile = new("IfcArbitraryClosedProfileDef", "AREA", None, line)
            up = new("IfcDirection", [0.0, 0.0, 1.0])
            solid, kind = (
                new("IfcExtrudedAreaSolid", profile, turned, up, 1000.0 * width),
                "SweptSolid",
            )
        shape = new("IfcShapeRepresentation", context, "Body", kind, [solid])
        shapes = new("IfcProductDefinitionShape", None, None, [shape])
        place = new("IfcLocalPlacement", None, axes)
        file.create_entity(
            "IfcFooting" if block.fixed else "IfcMember",
            guid(),
            Name=block.name,
            ObjectPlacement=place,
            Representation=shapes,
        )
    file.write(str(path))


def test_solids_of_one_width_are_an_elevation(tmp_path):
    write_ifc(path := tmp_path / "ring.ifc", RING.blocks)
    found = af.masonry.surveyed(path, layers=LAYERS, width=0.8)
    assert [block.name for block in found.blocks] == [block.name for block in RING.blocks]
    assert [block.fixed for block in found.blocks] == [block.fixed for block in RING.blocks]
    areas = [block.area for block in RING.blocks]
    assert [block.area for block in found.blocks] == pytest.approx(areas, rel=1e-9)
    centroids = [block.centroid for block in RING.blocks]
    np.testing.assert_allclose([block.centroid for block in found.blocks], centroids, atol=1e-9)
    load = af.BodyForce(1.0, 0.0)
    expected = af.collapse_factor(RING, live=load).factor
    assert af.collapse_factor(found, live=load).factor == pytest.approx(expected, rel=1e-6)
    with pytest.raises(af.InvalidInput, match="states its unit"):
        af.masonry.surveyed(path, layers=LAYERS, unit="mm")
    # a class that is ignored is not read
    ignored = dict.fromkeys(LAYERS, af.masonry.Layer(ignore=True))
    with pytest.raises(af.InvalidInput, match="no closed outlines"):
        af.masonry.surveyed(path, layers=ignored)


def test_other_solids_and_files_are_refused(tmp_path):
    write_ifc(path := tmp_path / "ring.ifc", RING.blocks, tapered=(3,))
    name = RING.blocks[3].name
    with pytest.raises(af.InvalidInput, match=f"it is not plane: across y '{name}'"):
        af.masonry.surveyed(path, layers=LAYERS)
    path.write_text("ISO-10303-21; and no more")
    with pytest.raises(af.InvalidInput, match="it is no IFC file that ifcopenshell reads"):
        af.masonry.surveyed(path, layers=LAYERS)


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    (path := tmp_path / "ring.ifc").write_text("ISO-10303-21;")
    with pytest.raises(NotInstalled, match=r"pip install 'archfem\[ifc\]'"):
        af.masonry.surveyed(path, layers=LAYERS)
