# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Five programs, one arch
#
# A result is believed once it was compared. Here archfem and five other programs push the same dry
# ring sideways until it falls: OpenSees and HybriDFEM with springs, RBE with corner forces, LMGC90
# and Siconos with impacts. **Do they agree, and how far does each depend on settings that are not
# physics?**

# %%
# %matplotlib inline
import json
from pathlib import Path
from statistics import median

import matplotlib.pyplot as plt

import archfem as af

bench = Path(af.__file__).parents[1] / "archbench"
scene = json.loads((bench / "scenes" / "S04.json").read_text())
scene["title"]

# %% [markdown]
# ## The scene
#
# A scene of Arch-Bench is a file of plain numbers: outlines of blocks, ends of joints, a
# friction, an action. No program needs another one to read it. This one is a ring of 17 stones
# with straight faces. As a structure of archfem it is one line.

# %%
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
corners = [point for block in scene["blocks"][1:-1] for point in block["outline"]]
same = [point for block in ring.blocks[1:-1] for point in block.outline]
largest = max(
    abs(a - b) for p, q in zip(corners, same, strict=True) for a, b in zip(p, q, strict=True)
)
af.view.draw_structure(ring)

# %%
f"corners of the scene and of the structure differ by {largest:.0e} m"

# %% [markdown]
# ## The equation
#
# Pushed by a part $\lambda$ of its weight, a ring of rigid blocks becomes a mechanism of four
# hinges. The work of all forces on it is then zero,
#
# $$ \lambda \sum_i w_i\, \dot u_i + \sum_i w_i\, \dot v_i = 0 , $$
#
# and the least $\lambda$ of all such mechanisms is the factor at collapse. A test tries all 3060
# sets of four joints, in both orders of their faces: $\lambda = 0.45775$.

# %%
push = af.collapse_factor(ring, live=af.BodyForce(1.0))
af.view.draw_collapse(ring, push)

# %% [markdown]
# ## The programs
#
# - **archfem** solves one linear programme.
# - **OpenSees** has rigid stones on rows of springs without tension. It pushes the crown by
#   displacement control.
# - **HybriDFEM** does the same with springs that slide.
# - **RBE** (compas_cra) finds the least tension at corners of faces. The ring is tilted until
#   tension is needed.
# - **LMGC90** and **Siconos** simulate rigid blocks with impacts in time, on a ring that is
#   tilted more and more.
#
# Each has its settings: number of springs, tolerance on tension, time step. The bench runs at
# least two values of them.

# %%
answers = {}
for path in sorted((bench / "results").glob("*.json")):
    stored = json.loads(path.read_text()).get("S04", {})
    factors = [run["values"]["factor"] for run in stored.get("runs", []) if "failed" not in run]
    if factors:
        answers[path.stem] = factors, stored.get("cost")

figure, axes = plt.subplots(figsize=(6.5, 2.6), layout="constrained")
for place, (factors, _) in enumerate(answers.values()):
    axes.plot([min(factors), max(factors)], [place, place], lw=3, color="0.6")
    axes.plot(factors[0], place, "o", color="C0")
axes.axvline(push.factor, color="k", lw=0.8)
axes.set_yticks(range(len(answers)), answers)
axes.set_xlabel("factor at collapse [g]")
plt.close(figure)
figure

# %% [markdown]
# Springs and limit analysis agree to all digits, because the joints of this ring do not slide.
# Its hinges are at the ends of joints, where the outermost spring is. RBE's answer depends on the
# tension that counts as none. Programs with impacts depend on whether their impulses have
# converged, and on what counts as a fall.

#
# Every program was run in turn with archfem. The ratio of processor times is that of the medians.

# %%
times = {name: cost for name, (_, cost) in answers.items() if cost}
{
    name: f"{median(each['own']) / median(each['archfem']):.3g} × the time of archfem"
    for name, each in times.items()
}

# %% [markdown]
# ## Check
#
# OpenSees has another method, other code and other authors. The ratio of archfem's factor to its
# factor should be one.

# %%
checked = push.factor / answers["opensees"][0][0]
f"archfem over OpenSees: {checked:.6f}"

# %% [markdown]
# ## What to try next
#
# - `S05.json` is an arch under a half sine. There the programs differ much more, and archfem
#   itself does by its joint rules: see its page in the documentation.
# - `python -m archbench.run --scene S04 --install` runs it again with all programs that can be
#   installed.
# - Write an adapter for your own program: one function and one manifest.
