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
# # How thin can it be?
#
# A dry-stone arch has no mortar and no tension. It stands as long as a line of thrust fits inside
# its ring. So it stands by its shape alone: neither the stiffness nor the weight of the stone
# matters. Then there is a thinnest semicircle that stands at all. **How thin is it?**

# %%
# %matplotlib inline
import os

import numpy as np
import xarray as xr

import archfem as af

quick = "ARCHFEM_QUICK" in os.environ  # a map of few points: for tests

# %% [markdown]
# ## The structure
#
# A semicircle of 50 voussoirs with radius 1 m; a thickness in metres is then the ratio $t/R$. The
# radius could be 10 m as well: there is no scale in this problem.


# %%
def semicircle(thickness):
    return af.circular_arch(radius=1.0, thickness=thickness, embrace=180.0, voussoirs=50)


af.view.draw_structure(semicircle(0.15))

# %% [markdown]
# ## The equation
#
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
# ## What it looks like
#
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
# ## Check against theory
#
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
# ## What to try next
#
# - Seven voussoirs instead of 50: the ring may be 10 % thinner. Why does an arch with fewer joints
#   need less?
# - `contact=af.Contact(1.48e9, 0.3e9, friction=0.39)`, and no `friction=None`: below 0.395 the
#   springings slide before the arch reaches its least thickness.
# - `strength=1 * af.units.MPa` in `minimum_thickness`, and a radius of 20 m: when does the strength
#   of stone begin to matter?
# - `chords=1` cuts the stones with straight faces. Does the least thickness increase or decrease?

# %%
checked = least
