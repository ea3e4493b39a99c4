"""HybriDFEM: rigid blocks on rows of springs, from a folder that the user has fetched.

The repository thlgrs/HybriDFEM-3.1 has no licence and no packaging, so nothing of it is installed
here: the environment variable HYBRIDFEM names the folder that contains its package `Legacy`.
"""

import contextlib
import io
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np

sys.path.append(os.environ.get("HYBRIDFEM", "."))

from Legacy.Objects import Structure, Surface

needs: list[str] = []
python = "bench"
settings: dict[str, list[dict[str, Any]]] = {
    "sideways": [{"points": 2, "stiffness": 1e9}, {"points": 2, "stiffness": 3e9}],
}

cannot = {
    "S03": "contact of faces in several chords takes its interface search too long",
    "S10": "its walls are among the references",
}


def version() -> str:
    """Return the version, which is the name of the repository."""
    return "HybriDFEM 3.1, Legacy"


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Push the crown sideways by up to 4 mm, and take the largest factor."""
    model = Structure.Structure_2D()
    for block in scene["blocks"]:
        model.add_block(np.array(block["outline"], dtype=float), block["density"], scene["width"])
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:
        model.make_nodes()
        stiffness = settings["stiffness"]
        (law,) = scene["laws"].values()
        surface = Surface.Coulomb(stiffness, stiffness, law["friction"])
        places = np.linspace(-1.0, 1.0, settings["points"]).tolist()
        model.make_cfs(True, nb_cps=places, offset=-1, surface=surface)
        stones = [k for k, block in enumerate(scene["blocks"]) if not block["fixed"]]
        for number, block in enumerate(scene["blocks"]):
            if block["fixed"]:
                model.fixNode(number, [0, 1, 2])
        weights = {k: model.list_blocks[k].m * scene["gravity"] for k in stones}
        for k, weight in weights.items():
            model.loadNode(k, [1], -weight)
        model.solve_forcecontrol(5, tol=10.0, max_iter=50, dir_name=folder)
        model.reset_loading()
        for k, weight in weights.items():
            model.loadNode(k, [1], -weight, fixed=True)
            model.loadNode(k, [0], weight)
        top = stones[len(stones) // 2]
        model.solve_dispcontrol(40, 4e-3, top, 0, tol=10.0, max_iter=60, dir_name=folder)
        (result,) = Path(folder).glob("*DispControl*")
        with h5py.File(result) as stored:
            forces = np.array(stored["P_r_conv"])
    # stones are pushed by the factor times their weight
    factors = forces[3 * top] / weights[top]
    if np.max(factors) < 1e-6:
        raise RuntimeError("no step of displacement control converged")
    return {"values": {"factor": float(np.max(factors))}, "said": "springs that slide"}
