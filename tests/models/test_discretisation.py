"""Discretisations of a structure: stated once, checked when stated."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.models import Discretisation

BRIDGE = Path(__file__).parents[2] / "meshes" / "prusias.toml"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fidelity": "exact"}, "fidelity = 'exact' is not known: use one of .*'rigid'.*'auto'"),
        ({"fidelity": 3}, "fidelity = 3 is not known"),
        ({"fidelity": ["full"]}, "is not known"),
        ({"fidelity": {"rest": np.zeros(3)}}, r"fidelities \['\[0. 0. 0.\]'\] are not known"),
        ({"fidelity": "modal"}, "fidelity = 'modal' is not known: use one of .*'rigid'"),
        ({"fidelity": {"rest": "modal"}}, r"fidelities \['modal'\] are not known: use some of"),
        ({"fidelity": {"rest": "monolithic"}}, r"fidelities \['monolithic'\] are not known"),
        ({"cells": 4}, "cells through the thickness and along each block = 4 is not a row"),
        ({"cells": (4, 4, 4)}, r"= \(4, 4, 4\) has 3 values"),
        ({"cells": "44"}, "= '44' is not a row of values"),
        ({"cells": (0, 4)}, "cells through = 0 is not a whole number"),
        ({"cells": (2.5, 4)}, "cells through = 2.5"),
        ({"cells": (4, 2.5)}, "cells along = 2.5"),
        ({"cells": (4, 1001)}, "cells along = 1001"),
        ({"cell": "hexagon"}, "cell = 'hexagon' is not known"),
        ({"max_cell_size": 0.0}, r"max_cell_size \[m\] = 0.0 is not above 0"),
        ({"max_cell_size": float("nan")}, "max_cell_size \\[m\\] = nan"),
        ({"degree": 3}, r"degree = 3 is not known: use one of \[1, 2\]"),
        ({"quadrature": "simpson"}, "quadrature = 'simpson' is not known"),
        (
            {"quadrature": "gauss", "quadrature_points": 0},
            "gauss points on a facet = 0 is not a whole number",
        ),
        ({"quadrature": "nodal", "quadrature_points": 3}, "nodal quadrature has points of its own"),
        (
            {"quadrature": "trapezoidal", "quadrature_points": 3, "fidelity": "monolithic"},
            "trapezoidal quadrature with 3 points is not written in UFL",
        ),
        ({"quadrature": "exact", "degree": 2}, "linear along a facet"),
        ({"quadrature": "exact", "fidelity": "monolithic"}, "linear along a facet"),
        ({"displacements": "huge"}, "displacements = 'huge' is not known: use one of"),
        (
            {"displacements": "large", "fidelity": "monolithic"},
            "do not exist with fidelity 'monolithic': use 'full'",
        ),
    ],
)
def test_refusals(ring, given, says):
    """Both where it is made and by the keywords of `build`, before anything is meshed."""
    with pytest.raises(af.InvalidInput, match=says):
        Discretisation(**given)
    with pytest.raises(af.InvalidInput, match=says):
        af.build(ring, **given)


def test_given_settings_are_kept():
    discretisation = Discretisation(
        "faces", [2, np.int64(3)], quadrature="gauss", quadrature_points=2
    )
    assert discretisation.cells == (discretisation.through, discretisation.along) == (2, 3)
    assert discretisation.rule == af.joints.Quadrature("gauss", 2)
    assert discretisation == Discretisation(
        "faces", (2, 3), quadrature="gauss", quadrature_points=2
    )
    for fidelity in ("rigid", "faces", "condensed", "full", "monolithic"):
        assert Discretisation(fidelity).name == fidelity
    mixed = Discretisation({"backfill": "full", "rest": "faces"})
    assert mixed.name == "backfill: full, rest: faces"


def test_a_case_has_its_discretisation():
    changes = [
        "model={ fidelity = 'faces', cells = [2, 3], max_cell_size = '50 cm', tolerance = 0.01 }"
    ]
    discretisation = af.Case.read(BRIDGE, changes).analysis.discretisation
    assert discretisation == Discretisation("faces", (2, 3), max_cell_size=0.5)


def test_a_case_without_a_fidelity_may_state_its_mesh():
    case = af.Case.read(BRIDGE, ["model.cells=[2, 2]"])
    assert case.analysis.fidelity == "auto"
    assert case.analysis.discretisation == Discretisation(cells=(2, 2))


def test_a_thousand_cells_are_allowed():
    assert af.models.Discretisation(cells=(1000, 1000)).through == 1000
    for cells in ((1001, 1), (1, 1001), (0, 1)):
        with pytest.raises(af.InvalidInput, match="cells"):
            af.models.Discretisation(cells=cells)
