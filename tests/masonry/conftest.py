"""A viaduct, and a drawing of it."""

import pytest

import archfem as af


@pytest.fixture(scope="session")
def viaduct():
    """The viaduct from which the shipped survey was made."""
    ring = {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 13}
    wall = {"length": 1.5, "height": 2.4, "above": 0.8}
    return af.bridge(
        arches=[
            af.shapes.Arch(measured="centre line", name="west arch", **ring),
            af.shapes.Arch(measured="centre line", name="east arch", **ring),
        ],
        piers=[af.shapes.Pier(name="pier", gap=0.9, height=2.4)],
        sidewalls=[
            af.shapes.Sidewall(name="west sidewall", **wall),
            af.shapes.Sidewall(name="east sidewall", **wall),
        ],
        backfill=af.shapes.Backfill(cover=0.5),
        width=4.0,
    )


@pytest.fixture(scope="session")
def drawing(viaduct, tmp_path_factory):
    """The viaduct as GeoJSON."""
    path = tmp_path_factory.mktemp("survey") / "viaduct.geojson"
    af.masonry.write_outlines(viaduct, path)
    return path
