"""Solids of IFC files, swept or faceted, by ifcopenshell."""

from collections import Counter
from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np

from archfem._optional import require_package
from archfem.masonry.survey.assemblies import Polyhedron


def load_ifc_reader() -> Callable[[Path, Collection[str]], list[tuple[Polyhedron, str]]]:
    """Return a function that reads the solids of a file as polyhedra, and their IFC classes."""
    with require_package("ifcopenshell"):
        import ifcopenshell
        from ifcopenshell import geom

    def read(path: Path, ignored: Collection[str]) -> list[tuple[Polyhedron, str]]:
        file = ifcopenshell.open(str(path))  # its elements do not keep it alive
        elements = [
            element
            for element in sorted(file.by_type("IfcElement"), key=lambda each: int(each.id()))
            if element.Representation
            and element.is_a() not in ignored
            # openings and the like are parts of other elements
            and not element.is_a("IfcFeatureElement")
        ]
        settings = geom.settings()
        settings.set("use-world-coords", True)
        count = Counter(element.Name for element in elements)
        solids = []
        for number, element in enumerate(elements, 1):
            mesh = geom.create_shape(settings, element).geometry
            points = np.array(mesh.verts, dtype=float).reshape(-1, 3)  # [m], whatever the file has
            faces = np.array(mesh.faces, dtype=int).reshape(-1, 3).tolist()
            own = element.Name if count[element.Name] == 1 else None
            name = own or f"{element.Name or element.is_a()} {number}"
            solids.append((Polyhedron(name, points, faces, fixed=False), element.is_a()))
        return solids

    return read
