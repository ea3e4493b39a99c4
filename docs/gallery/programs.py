"""Five programs and archfem push the same ring sideways: the stored answers of Arch-Bench."""

import json
from pathlib import Path

from matplotlib.figure import Figure

import archfem as af
from archfem.view.style import Colour

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
push = af.collapse_factor(ring, live=af.BodyForce(1.0))
names = {"archfem": "archfem", "opensees": "OpenSees", "hybridfem": "HybriDFEM", "rbe": "RBE"}
names |= {"lmgc90": "LMGC90", "siconos": "Siconos"}

figure = Figure(figsize=(6.4, 2.4), layout="constrained")
axes = figure.subplots()
for place, program in enumerate(names):
    path = Path(af.__file__).parents[1] / "archbench" / "results" / f"{program}.json"
    runs = json.loads(path.read_text(encoding="utf-8"))["S04"]["runs"]
    factors = [run["values"]["factor"] for run in runs if "failed" not in run]
    axes.plot([min(factors), max(factors)], [place, place], lw=3, color="0.6")
    axes.plot(factors, [place] * len(factors), "o", color=Colour.THRUST)
axes.axvline(push.factor, color="k", lw=0.8, label="limit analysis")
axes.set_yticks(range(len(names)), names.values())
axes.invert_yaxis()
axes.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)
axes.set_xlabel("horizontal acceleration at collapse [g]")
