"""Write docs/try/index.html, the page that starts from examples, photos and drawings.

Run as `make wasm`, which also builds the kernels.
"""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import archfem as af
from archfem.masonry.materials import STONE_TO_STONE
from archfem.view.pages.live import LivePage, describe_arch, list_motions

PAGE = Path(__file__).parent / "try" / "index.html"
MESHES = Path(__file__).parents[1] / "meshes"


def list_examples() -> dict[str, af.Structure]:
    """Return the structures that a reader can start from, by their names."""
    circle: dict[str, Any] = {"thickness": 0.55, "voussoirs": 17}
    springing: dict[str, Any] = {"heights": 1.6, "breadths": 1.2, "thicknesses": 0.5}
    # the bridge of Demirel and Aldemir (2021): its rings and piers, without fill and sidewalls
    _, parts = af.Case.read(MESHES / "prusias.toml").structure.origin or ("", {})
    bridge = af.bridge(arches=parts["arches"], piers=parts["piers"], width=parts["width"])
    return {
        "a ring of 17 stones": af.circular_arch(radius=2.95, embrace=159.0, **circle),
        "a semicircle": af.circular_arch(radius=3.0, embrace=180.0, thickness=0.5, voussoirs=13),
        "a segment": af.circular_arch(span=6.0, rise=1.5, thickness=0.5, voussoirs=13),
        "a pointed arch": af.shapes.pointed_arch(span=4.0, rise=3.2, thickness=0.5, voussoirs=14),
        "an arch on piers": af.arch_on_piers(
            radius=2.0, thickness=0.45, voussoirs=11, pier_breadth=1.2, courses=[0.6, 0.6, 0.6]
        ),
        "two spans": af.shapes.arcade(spans=[3.0, 3.0], voussoirs=9, rises=1.2, **springing),
        "a portal": build_portal(),
        "a column": af.column(breadth=0.8, heights=[0.8] * 5),
        "a Roman bridge without fill": bridge,
    }


def build_portal() -> af.Structure:
    """Return two posts with a lintel."""

    def box(left: float, low: float, right: float, high: float, name: str) -> af.Block:
        corners = ((left, low), (right, low), (right, high), (left, high))
        part = name if name in ("ground", "lintel") else f"{name} pier"
        role = {"ground": "other", "lintel": "ring"}.get(name, "pier")
        return af.Block(corners, af.STONE, name, fixed=name == "ground", part=part, role=role)

    boxes = [(-1.0, -0.4, 4.0, 0.0, "ground"), (0.0, 0.0, 0.5, 2.2, "left")]
    boxes += [(2.5, 0.0, 3.0, 2.2, "right"), (-0.2, 2.2, 3.2, 2.7, "lintel")]
    return af.masonry.assembled([box(*each) for each in boxes], STONE_TO_STONE)


def describe_example(name: str, structure: af.Structure) -> dict[str, Any]:
    """Return the data of an example, with its case file."""
    analysis = af.Analysis(structure, fidelity="rigid", displacements="large", damping="effective")
    with TemporaryDirectory() as folder:
        text = analysis.write(Path(folder) / "case.toml").read_text()
    return describe_arch(structure) | {"name": name, "case": text}


def build_page(examples: Sequence[dict[str, Any]]) -> str:
    """Return the page of examples."""
    return LivePage("Does your arch fall?", examples, list_motions()).render("live/try.html")


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    examples = [describe_example(*each) for each in list_examples().items()]
    PAGE.write_text(build_page(examples), encoding="utf-8")
