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
# # Speed against error
#
# A stone is some fifty times stiffer than its joints. So why give it nodes? Without nodes,
# **how much accuracy is lost, and how much time does accuracy cost?**

# %%
# %matplotlib inline
import os

import numpy as np

import archfem as af

quick = "ARCHFEM_QUICK" in os.environ  # a short motion: for tests

# %% [markdown]
# ## One formula for every fidelity
#
# Between joints everything is linear. With a basis $B$ of the displacements a block may have,
#
# $$ M \to B^T M B, \qquad K \to B^T K B, \qquad G \to G B, $$
#
# where $G$ maps displacements to openings and slips along the joints. Three rigid motions a block
# give the fidelity `rigid`; three of each joint face `faces`; all nodes on joints `condensed`.

# %%
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
motion = af.Motion.synthetic(duration=2.0 if quick else 8.0, pga=1.7, seed=1)
damping = af.Rayleigh(0.05, (8.0, 16.0))
for fidelity in ("rigid", "faces", "condensed", "full"):
    model = af.build(ring, fidelity=fidelity, quadrature="exact")
    print(f"{fidelity:10s} {model.size:4d} coordinates")

# %% [markdown]
# ## How they differ
#
# Five springs a joint, as in Demirel and Aldemir (2021), on all nodes, are compared with three
# coordinates a stone and the traction integrated in closed form. Rayleigh damping is the
# paper's too.

# %%
springs = af.build(ring, fidelity="full", quadrature="nodal")
stones = af.build(ring, fidelity="rigid", quadrature="exact")
runs = {
    "all nodes, five springs": af.time_history(springs, motion, damping=damping, dt=0.005),
    "rigid stones, exact joints": af.time_history(stones, motion, damping=damping, dt=0.005),
}
af.view.draw_envelope(runs, dead=af.dead_load(stones).joints)

# %% [markdown]
# ## All of it in one figure
#
# Fidelities, quadratures and time steps against a converged reference: 12 × 12 cells, exact facets,
# 1.25 ms. The shape of a mark is the fidelity, its colour the quadrature.

# %%
found = af.accuracy(ring, motion, damping=damping, cells=((4, 4),), steps=(0.005, 0.0025))
print(found.table())
af.view.draw_accuracy(found)

# %% [markdown]
# ## Automatic selection
#
# `fidelity="auto"` runs settings on the strongest part of the motion, cheapest first.
# It stops when the error it predicts for the largest $|e|$ of every joint is within the tolerance.

# %%
chosen = af.build(ring, fidelity="auto", tolerance=0.005, motion=motion, damping=damping)
print(chosen.fidelity, chosen.size, chosen.prediction.text)

# %% [markdown]
# ## Was the prediction honest?
#
# The ratio of the predicted error to the actual one should be near one.
# It is an estimate, and may be half or three times the actual error.

# %%
reference = af.build(ring, fidelity="condensed", cells=(12, 12), quadrature="exact")
histories = [
    af.time_history(reference, motion, damping=damping, dt=0.00125).joints["eccentricity"],
    af.time_history(chosen, motion, damping=damping).joints["eccentricity"],
]
largest = [abs(e).max("time").values for e in histories]
actual = float(np.abs(largest[0] - largest[1]).max())
ratio = chosen.prediction.error / actual
print(f"predicted {chosen.prediction.error:.4f}, actual {actual:.4f}, ratio {ratio:.2f}")

# %% [markdown]
# ## What to try next
#
# - A stronger motion (`pga=4.0`): beyond the first mechanism no fidelity follows another closely.
# - Joints ten times stiffer: the stones then deform noticeably, and `rigid` is less accurate than
#   `faces`.
# - A block of backfill among the stones: `auto` gives it all its nodes.
