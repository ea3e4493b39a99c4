"""Draw the pictures of the pages that no notebook draws: `python docs/pictures.py [FOLDER]`.

`make pictures` draws these and the notebooks'. A ring on its way to the ground and the film of a
shaken ring take a minute. The two studies of the bridge take hours; their results are stored
beside the pictures, and are only drawn here. `make studies` computes them anew.
"""

from pathlib import Path

import archfem as af

FIGURES = Path(__file__).resolve().parents[1] / "notebooks" / "figures"

STUDIES = {"bridge_retrofit": "prusias_retrofit", "bridge_sensitivity": "prusias_sensitivity"}
"""Pictures of studies, and the names of their case files."""


def draw_falls(folder: Path) -> None:
    """Draw a thin ring under a strong motion, from the first hinge to the ground."""
    ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.40, voussoirs=17)
    analysis = af.Analysis(ring, damping=af.StiffnessDamping(0.05, 8.0))
    motion = af.Motion.synthetic(duration=6.0, pga=6.0, seed=3)
    af.view.draw_fall(analysis.run(motion)).savefig(folder / "falls.png", dpi=110)
