"""Drawings as DXF: closed polylines and lines on layers, in metres."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from archfem.arrays import Array
from archfem.files import in_one_stroke

TEXT = 0.05
"""Height of names [m]."""


def write_dxf(
    path: str | Path,
    outlines: Mapping[str, Sequence[tuple[str, Array]]],
    lines: Mapping[str, Sequence[tuple[str, Array]]] | None = None,
) -> Path:
    """Write a drawing that `read_outlines` reads, and any program for drawings.

    Args:
        path: of the file, *.dxf; folders are made.
        outlines: by layer the names and vertices of closed polygons, each (n, 2) [m]; a name stands
            in its polygon, on the layer of the same name with " names" behind it.
        lines: by layer the names and vertices of open lines, each (n, 2) [m].

    Returns:
        The file.
    """
    import ezdxf
    import shapely

    drawing = ezdxf.new("R2010", units=ezdxf.units.M)  # type: ignore[attr-defined]
    space = drawing.modelspace()
    for layer, polygons in outlines.items():
        for name, points in polygons:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, close=True, dxfattribs={"layer": layer})
            inside = shapely.Polygon(given).representative_point()
            note = {"layer": f"{layer} names", "height": TEXT, "insert": (inside.x, inside.y)}
            space.add_text(name, dxfattribs=note)
    for layer, runs in (lines or {}).items():
        for _, points in runs:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, dxfattribs={"layer": layer})
    with in_one_stroke(Path(path)) as draft:
        drawing.saveas(draft)
    return Path(path)
