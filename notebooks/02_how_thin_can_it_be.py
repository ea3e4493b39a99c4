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
# # How thin can it be, and how much does it carry?
#
# A dry-stone arch has no mortar and no tension. It stands as long as a line of thrust fits inside
# its ring. So it stands by its shape alone: neither the stiffness nor the weight of the stone
# matters. Then there is a thinnest semicircle that stands at all. **How thin is it?** And
# **how much does an arch carry that is thicker, and in which order do its hinges form?**

# %%
# %matplotlib inline
import os
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr

import archfem as af

quick = "ARCHFEM_QUICK" in os.environ  # a map of few points: for tests

# %% [markdown]
# ## The thinnest semicircle
#
# A semicircle of 50 voussoirs with radius 1 m; a thickness in metres is then the ratio $t/R$. The
# radius could be 10 m as well: there is no scale in this problem.


# %%
def semicircle(thickness):
    return af.circular_arch(radius=1.0, thickness=thickness, embrace=180.0, voussoirs=50)


af.view.draw_structure(semicircle(0.15))

# %% [markdown]
# Each joint of depth $h$ carries a compression at its intrados end, $F_i$, one at its extrados end,
# $F_e$, and a shear force $V$. The thrust stays within the joint, $|M| \le N h/2$, if and only if
# $F_i, F_e \ge 0$. Milankovitch's question of 1907 is then whether the linear equations of
# equilibrium have a solution with non-negative compressions:
#
# $$ -G_o^\mathsf{T} F + G_s^\mathsf{T} V = f_\text{weight}, \qquad F \ge 0 . $$
#
# Heyman's *safe theorem* (1966) says that one such solution is enough: if we can find a line of
# thrust, so can the arch. A linear programme finds one, or proves that there is none. Bisection of
# a bracket of thicknesses finds the least one with a solution.

# %%
least = af.minimum_thickness(semicircle, friction=None)
f"a semicircle stands down to t/R = {least:.4f}"

# %% [markdown]
# At that thickness a single line of thrust is left. It touches the extrados at the crown, the
# intrados at the haunches and the extrados at the springings. These are five hinges, one more than
# a mechanism needs, since the arch is symmetric. A small movement of a support selects this line:
# an arch on spreading supports has its least thrust.

# %%
thinnest = semicircle(least)
spread = af.collapse_factor(thinnest, live=af.Settlement("left abutment", (-0.01, 0.0, 0.0)))
af.view.draw_collapse(thinnest, spread)

# %% [markdown]
# Two per cent thinner, there is no line of thrust. The limit analysis shows how it falls: the
# crown sinks, the haunches move out.

# %%
too_thin = semicircle(0.98 * least)
fall = af.collapse_factor(too_thin, live=af.BodyForce(1.0))
af.view.draw_collapse(too_thin, fall)

# %% [markdown]
# Milankovitch found $t/R = 0.1075$, with hinges at 54.5° from the crown. With 50 stones the nearest
# joints are at 54°, and a ring can only hinge at its joints: it may be slightly thinner.

# %%
angles = [90.0 - 3.6 * joint for joint, _ in spread.hinges]
f"t/R = {least:.5f}, {least / 0.1075 - 1.0:+.2%} off; hinges at {np.round(angles, 1)}°"

# %% [markdown]
# Flatter arches may be much thinner: their thrust line is nearer to a circle. The thickness above
# the least one is resistance to an earthquake. The map shows the constant horizontal acceleration
# that turns rings into mechanisms, with known values on it. They are Oppenheim's of 1992 for seven
# voussoirs at 157.5°, and Milankovitch's for the semicircle, which resists none.


# %%
def least_of(embrace):
    ring = {"radius": 1.0, "embrace": embrace, "voussoirs": 20}
    return af.minimum_thickness(lambda t: af.circular_arch(thickness=t, **ring), tolerance=1e-3)


def capacity_of(embrace, ratio):
    ring = af.circular_arch(radius=1.0, thickness=ratio, embrace=embrace, voussoirs=20)
    return af.collapse_factor(ring, live=af.BodyForce(1.0), friction=None).factor


KNOWN = {
    (120.0, 0.02285): 0.0,
    (180.0, 0.1075): 0.0,
    (120.0, 0.10): 0.580,
    (120.0, 0.15): 0.913,
    (120.0, 0.20): 1.264,
    (180.0, 0.15): 0.144,
    (180.0, 0.20): 0.284,
    (157.5, 0.15): 0.37,
}

points = (3, 4) if quick else (9, 12)
embraces, ratios = np.linspace(60.0, 180.0, points[0]), np.linspace(0.005, 0.25, points[1])
capacity = xr.DataArray(
    [[capacity_of(embrace, ratio) for ratio in ratios] for embrace in embraces],
    {"embrace": embraces, "ratio": ratios},
    ("embrace", "ratio"),
)
af.view.draw_capacity(capacity, {embrace: least_of(embrace) for embrace in embraces}, KNOWN)

# %% [markdown]
# ## A load finds its hinges
#
# An arch that stands can be loaded, and stones do not crush easily. It fails when its joints
# turn into hinges, one after another, until it moves. Here is the ring with which Demirel and
# Aldemir (2021) validated their springs: two equal loads, increased until it fails. The paper
# does not state their position. We put them on the edges of
# the keystone, 0.26 m from the crown. Stones have faces of four chords, as their mesh will, and
# joints that never slide, as in the paper.

# %%
rough = replace(af.masonry.STONE_TO_STONE, friction=None)
ring = af.circular_arch(
    radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, width=1.0, chords=4, contact=rough
)


def pair(x):
    return [af.PointLoad(x=side * x, force=(0.0, -1e3)) for side in (-1.0, 1.0)]


figure = af.view.draw_structure(ring)
arrow = {"arrowstyle": "-|>", "color": "black", "lw": 1.5}
for load in pair(0.26):
    figure.axes[0].annotate("", (load.x, 3.22), (load.x, 3.75), arrowprops=arrow)
figure.axes[0].set_ylim(0.2, 3.85)
figure

# %% [markdown]
# There are two methods. The first follows the equilibrium of elastic stones and joints, with
# the load factor $\lambda$ as one more unknown and its displacement $d$ prescribed:
#
# $$ f(q) = f_\text{weight} + \lambda\, f_\text{load}, \qquad f_\text{load} \cdot q =
# |f_\text{load}|\; d . $$
#
# The second needs no stiffness. Of all forces in equilibrium with the loads, with each joint's
# thrust between its two faces, it takes those with the largest factor:
#
# $$ \max \lambda \quad \text{subject to} \quad B\,(N, V, M) = f_\text{weight} + \lambda\,
# f_\text{load}, \qquad |M| \le \tfrac12 N h . $$
#
# Its dual is a motion of rigid stones, the mechanism. The curve of the first must rise to the
# number of the second.

# %%
limit = af.collapse_factor(ring, live=pair(0.26), friction=None)
model = af.build(ring, fidelity="full", cells=(4, 4), quadrature="nodal")
push = af.pushover(model, pair(0.26), control="displacement")
f"limit analysis {limit.factor:.2f} kN each; pushover {push.factor:.2f}: {push.outcome}"

# %%
af.view.draw_pushover({"five springs a joint": push}, limits={"limit analysis": limit.factor})

# %%
af.view.draw_collapse(ring, limit)

# %% [markdown]
# Crown, haunches and springings rotate. Each of the three is a pair, since ring and loads are
# symmetric, and four of the six would suffice. Sliding is excluded here. With friction of 0.6
# joints would slip at a somewhat lower load (`friction="coulomb"`).

# %% [markdown]
# ## In which order?
#
# That depends on the definition of a hinge. The table gives the share of the ultimate load at which
# joints first reach an eccentricity: 1/6, where a joint begins to open; 0.46, the paper's limit;
# 0.499, when the last of five springs carries all. Below the five springs, Lobatto's rule.


# %%
def first(push, e):
    tilt, share = abs(push.joints["eccentricity"]), push.curve["factor"] / push.factor
    places = {"crown": 8, "haunch": 4, "springing": 0}
    rising = {name: np.maximum.accumulate(tilt.values[:, k]) for name, k in places.items()}
    return {name: float(np.interp(e, values, share)) for name, values in rising.items()}


smooth = af.pushover(
    af.build(ring, fidelity="full", cells=(4, 4), quadrature="lobatto"), pair(0.26)
)
marks = {"1/6": 1 / 6, "1/3": 1 / 3, "0.46": 0.46, "0.499": 0.499}
table = {
    (rule, name): first(found, e)
    for rule, found in (("five springs", push), ("Lobatto", smooth))
    for name, e in marks.items()
}
pd.DataFrame(table).T.rename_axis(["joints", "|e| from"]).round(2)

# %% [markdown]
# The crown is first by every measure: weight alone has brought it to $e = 0.29$, and the loads
# stand beside it. Haunches hinge before springings by the limit 0.46. At the very end, where a
# hinge is the last of five springs, they hinge after them.
#
# The paper reports springings, crown, haunches. By the strict measure the haunches are last here
# too. But springings and crown become equal only where stones are weightless and loads stand 0.57 m
# from the crown. Neither the joints' stiffness nor any other position of the loads reverses them.

# %%
light = af.circular_arch(
    radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=4,
    material=af.Material(young=30e9, poisson=0.2, unit_weight=2.0), contact=rough,
)  # fmt: skip
row = af.build(light, fidelity="rigid", cells=(4, 1), quadrature="nodal")
pd.Series(first(af.pushover(row, pair(0.57)), 0.499), name="share of the ultimate load").round(3)

# %% [markdown]
# ## Where there is no limit
#
# At the quarter points of the span the same two loads have no limit load. The line of thrust under
# them alone, three straight struts, fits inside the ring. The larger they are, the nearer the
# thrust is to it.

# %%
unlimited = af.collapse_factor(ring, live=pair(1.40))
heavy = af.pushover(model, pair(1.40), stop=af.statics.Stop(displacement=0.02))
af.view.draw_structure(ring, heavy.joints.isel(step=-1))

# %%
f"{unlimited.outcome.sentence}; at {heavy.factor:.0f} kN each, {len(heavy.hinges)} joints hinge"

# %% [markdown]
# A single load at a quarter point differs: it forms exactly four hinges, on alternating
# faces, and the arch sways.

# %%
single = af.collapse_factor(ring, live=af.PointLoad(x=1.40, force=(0.0, -1e3)))
af.view.draw_collapse(ring, single)

# %% [markdown]
# ## Check
#
# Pushover and limit analysis share neither unknowns nor solver. The check compares the last point
# of the curve, and the number of hinges:

# %%
checked = push.factor / limit.factor
f"pushover / limit analysis = {checked:.5f}; one load: {len(single.hinges)} hinges"

# %% [markdown]
# ## What to try next
#
# - Seven voussoirs instead of 50: the ring may be 10 % thinner. Why does an arch with fewer joints
#   need less?
# - `contact=af.Contact(1.48e9, 0.3e9, friction=0.39)`, and no `friction=None`: below 0.395 the
#   springings slide before the arch reaches its least thickness.
# - `strength=1 * af.units.MPa` in `minimum_thickness`, and a radius of 20 m: when does the strength
#   of stone begin to matter?
# - `quadrature="exact"`: the compressed strip at a hinge narrows without end, and the curve only
#   approaches the limit. `push.limit` extrapolates it; `push.uncertainty` is its uncertainty.
# - `af.pushover(model, af.Settlement("left abutment", (-1.0, 0.0, 0.0)))`: the abutment moves,
#   and the thrust falls to the least that can hold the arch.
