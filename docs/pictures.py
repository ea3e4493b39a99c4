"""Draw the pictures of the gallery, and the films of the first page: `python docs/pictures.py`.

Each script in `docs/gallery` ends with a `figure`, which is saved beside it. `make pictures` draws
these, those of the notebooks by `docs/execute.py`, and the figures of theory and evidence. A file
beside them has the digest of the code by which each was drawn, so that a test finds those which are
older than it.
"""

import base64
import hashlib
import json
import runpy
import sys
import tempfile
from functools import partial
from pathlib import Path

import archfem as af

ROOT = Path(__file__).resolve().parents[1]
GALLERY = ROOT / "docs" / "gallery"
FIGURES = ROOT / "notebooks" / "figures"
DIGESTS = FIGURES / "digests.json"
TEMPLATES = ROOT / "archfem" / "view" / "pages" / "templates" / "live"

SOURCES = {
    "thrust_line": ("structure",),
    "stress": ("stress",),
    "modes": ("statics",),
    "collapse": ("collapse",),
    "assessment": ("collapse",),
    "rating": ("collapse",),
    "envelope": ("histories",),
    "joint": ("histories",),
    "fall": ("collapse",),
    "verdict_range": ("verdicts",),
    "fragility": ("studies",),
    "accuracy": ("studies",),
    "programs": (),
    "hinges": ("films/frames", "films/film"),
    "page": ("pages/live",),
}
"""Pictures, and the modules of `archfem.view` that draw them, beside its style."""

VECTOR = ("thrust_line", "collapse", "envelope")
"""Pictures that are shipped as SVG, too."""


def digest(name: str) -> str:
    """Return the digest of the code that draws a picture."""
    scripts = {"hinges": Path(__file__), "page": ROOT / "docs" / "page_film.py"}
    paths = [scripts.get(name, GALLERY / f"{name}.py")]
    paths += [ROOT / f"archfem/view/{source}.py" for source in (*SOURCES[name], "style")]
    paths += sorted(TEMPLATES.iterdir()) if name == "page" else []
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def draw(name: str) -> None:
    """Run a script of the gallery, and save its figure beside it."""
    from execute import smaller  # beside this script; needs what executes notebooks

    figure = runpy.run_path(str(GALLERY / f"{name}.py"))["figure"]
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "picture.png"
        figure.savefig(drawn, dpi=150)
        png = smaller(base64.b64encode(drawn.read_bytes()).decode())
    (GALLERY / f"{name}.png").write_bytes(base64.b64decode(png))
    if name in VECTOR:
        af.view.save(figure, GALLERY / f"{name}.svg")


def film_hinges() -> None:
    """Film the first seconds of the shipped ring under a strong earthquake."""
    ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
    settings = {"displacements": "large", "damping": "effective", "dt": 0.005}
    analysis = af.Analysis(ring, fidelity="rigid", record=af.Record(fields_every=4), **settings)
    run = analysis.run(af.Motion.synthetic(duration=6.0, pga=6.0, seed=3))
    options = {"size": (800, 450), "fps": 8.0, "seconds": 6.0}
    af.view.film(analysis.model, run, FIGURES / "hinges.gif", **options)


def draw_page() -> None:
    """Film the page that shakes an arch, which needs Chromium."""
    from page_film import film_page  # beside this script

    film_page(FIGURES / "page.gif")


def main() -> None:
    """Draw all pictures, or those that are named."""
    digests = json.loads(DIGESTS.read_text(encoding="utf-8")) if DIGESTS.exists() else {}
    for name in sys.argv[1:] or SOURCES:
        {"hinges": film_hinges, "page": draw_page}.get(name, partial(draw, name))()
        digests[name] = digest(name)
        print(name, flush=True)
    kept = {name: digests[name] for name in SOURCES if name in digests}
    DIGESTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
