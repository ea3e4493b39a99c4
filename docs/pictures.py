"""Draw the pictures of the pages that no notebook draws: `python docs/pictures.py`.

`make pictures` draws these, and by `docs/execute.py` those of the notebooks. A file beside them has
the digest of the code by which each was drawn, so that a test finds those which are older than it.
"""

import hashlib
import json
import sys
from pathlib import Path

import archfem as af

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "notebooks" / "figures"
DIGESTS = FIGURES / "digests.json"

LIVE = [
    str(path.relative_to(ROOT))
    for path in sorted((ROOT / "archfem/view/pages/templates/live").iterdir())
]

SOURCES = {
    "falls.png": ("archfem/view/collapse.py", "archfem/view/style.py"),
    "hinges.gif": ("archfem/view/films/frames.py", "archfem/view/films/film.py"),
    "page.gif": ("docs/page_film.py", "archfem/view/pages/live.py", *LIVE),
}
"""Pictures, and the modules that draw them; this script draws all."""


def digest(name: str) -> str:
    """Return the digest of the code that draws a picture."""
    paths = [Path(__file__), *(ROOT / source for source in SOURCES[name])]
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def draw_falls(path: Path) -> None:
    """Draw a thin ring under a strong motion, from its first hinge to the ground."""
    ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.40, voussoirs=17)
    analysis = af.Analysis(ring, fidelity="rigid", displacements="large", damping="effective")
    run = analysis.run(af.Motion.synthetic(duration=6.0, pga=9.0, seed=3))
    af.view.draw_fall(run).savefig(path, dpi=150)


def draw_hinges(path: Path) -> None:
    """Film the first seconds of the shipped ring under a strong earthquake."""
    ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
    settings = {"displacements": "large", "damping": "effective", "dt": 0.005}
    analysis = af.Analysis(ring, fidelity="rigid", record=af.Record(fields_every=4), **settings)
    run = analysis.run(af.Motion.synthetic(duration=6.0, pga=6.0, seed=3))
    options = {"size": (800, 450), "fps": 8.0, "seconds": 6.0}
    af.view.film(analysis.model, run, path, **options)


def draw_page(path: Path) -> None:
    """Film the page that shakes an arch, which needs Chromium."""
    from page_film import film_page

    film_page(path)


def main() -> None:
    """Draw all pictures, or those that are named."""
    digests = json.loads(DIGESTS.read_text(encoding="utf-8")) if DIGESTS.exists() else {}
    for name in sys.argv[1:] or SOURCES:
        {"falls.png": draw_falls, "hinges.gif": draw_hinges, "page.gif": draw_page}[name](
            FIGURES / name
        )
        digests[name] = digest(name)
        print(FIGURES / name)
    DIGESTS.write_text(json.dumps(digests, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
