"""Entities of DXF files, read by ezdxf: polylines, texts and others, also of inserted blocks."""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

# Entities that are read as outlines
POLYLINES = ("LWPOLYLINE", "POLYLINE")
MAX_ENTITIES = 100_000  # blocks inserted into blocks may be any number


@dataclass(frozen=True, eq=False)
class Entity:
    """Entity of a DXF file: a polyline, a text or another curve."""

    kind: str
    layer: str
    points: list[tuple[float, ...]]  # vertices, or the place of a text, in drawing units
    text: str = ""
    closed: bool = False
    is_mesh: bool = False
    # tangent of a quarter of the angle of each edge, positive where its arc turns left
    bulges: tuple[float, ...] = ()


def load_dxf(path: Path, ignored: Counter[str]) -> tuple[list[Entity], tuple[float, str] | None]:
    """Load entities of a DXF file but ignored and hidden ones, and its unit [m] and its name."""
    from ezdxf import units  # slow to import
    from ezdxf.enums import InsertUnits
    from ezdxf.filemanagement import readfile

    drawing: Any = readfile(path)
    entities = []
    hidden = {
        each.dxf.name.casefold(): each.is_frozen()
        for each in drawing.layers
        if each.is_off() or each.is_frozen()
    }
    walk = _walk_dxf(drawing.modelspace(), ignored, hidden)
    for entity, layer in islice(walk, MAX_ENTITIES + 1):
        kind = entity.dxftype()
        if kind in POLYLINES:
            light = kind == "LWPOLYLINE"
            points = map(tuple, entity.vertices_in_wcs() if light else entity.points_in_wcs())
            is_mesh = not (light or entity.is_2d_polyline or entity.is_3d_polyline)
            # a mirrored polyline has its normal downwards, and arcs on the other side
            sense = -1.0 if entity.dxf.extrusion.z < 0.0 else 1.0
            row = [v[0] for v in entity.get_points("b")] if light else entity.vertices
            bulges = tuple(sense * (v if light else v.dxf.get("bulge", 0.0)) for v in row)
            kinds = entity.is_closed, is_mesh, bulges
            entities.append(Entity(kind, layer, list(points), "", *kinds))
        elif kind in ("TEXT", "MTEXT"):
            place = entity.dxf.insert if kind == "MTEXT" else entity.get_placement()[1]
            text = " ".join(entity.plain_text().split())
            entities.append(Entity(kind, layer, [(place.x, place.y)], text))
        else:
            entities.append(Entity(kind, layer, []))
    known = drawing.units  # 0 where the drawing has none
    if known == InsertUnits.USSurveyFeet:  # which ezdxf does not convert
        return entities, (1200.0 / 3937.0, "US survey ft")
    with suppress(TypeError, ValueError):  # of other units that it does not convert
        factor = float(units.conversion_factor(known, InsertUnits.Meters))
        return entities, (factor, units.decode(known) or "units")
    return entities, None


def _walk_dxf(
    space: Any, ignored: Counter[str], hidden: Mapping[str, bool], parent: str | None = None
) -> Iterator[tuple[Any, str]]:
    """Yield entities and their layers, also those of inserted blocks, but ignored and hidden ones.

    Layers that are off or frozen are hidden, with True for frozen ones.
    """
    lost: list[tuple[Any, str]] = []  # of a block, which ezdxf does not transform

    def keep(part: Any, _: str) -> None:
        lost.append((part, part.dxf.layer))

    for entity in space:
        # within a block, layer 0 is that of the insert
        layer = parent if parent is not None and entity.dxf.layer == "0" else entity.dxf.layer
        if layer in ignored:
            ignored[layer] += entity.dxftype() in POLYLINES
            continue
        is_insert, state = entity.dxftype() == "INSERT", hidden.get(layer.casefold())
        # of an insert on a layer that is off, parts on other layers are shown
        if entity.dxf.get("invisible") == 1 or state or (state is not None and not is_insert):
            if is_insert or entity.dxftype() in POLYLINES:
                ignored[f"{layer} (hidden)"] += 1
            continue
        copied = is_insert and entity.mcount > 1
        for each in entity.multi_insert() if copied else (entity,):
            yield each, layer
            if each.dxftype() == "INSERT":
                parts = each.virtual_entities(skipped_entity_callback=keep)
                yield from _walk_dxf(parts, ignored, hidden, layer)
    yield from lost
