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
# # An arch stands
#
# Seventeen stones, no mortar. A single stone would fall, and together they stand. **Where does
# their weight go?** How fine must a model be before we may believe its answer, and how many
# springs does a joint need?

# %%
# %matplotlib inline
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import archfem as af
from archfem.view.style import Colour

# colours that stay apart in grey
mpl.rcParams.update({"axes.prop_cycle": mpl.cycler(color=Colour.LINES), "font.size": 8.0})

# %% [markdown]
# ## The structure
#
# The ring of Demirel and Aldemir (2021): mean radius 2.95 m, 0.55 m thick, 159° of a circle. The
# abutments, in grey, are blocks like the others, but fixed.

# %%
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
af.view.draw_structure(ring)

# %% [markdown]
# ## The equation
#
# Stones are elastic. A joint resists closure only. Where the stones on its two sides have
# approached by $\delta$ and slipped by $s$, its pressure is $t_n = k_n \max(\delta, 0)$. While
# closed, its shear traction is $t_s = k_s s$, until it slides at $|t_s| = \mu\, t_n$. The
# displacement $u$ may jump across joints. For each virtual displacement $v$ the work of the
# stresses, of the joints and of gravity is in balance:
#
# $$ \int_\text{stones} \sigma(u) : \varepsilon(v)
#  \;+\; \int_\text{joints} t_n(u)\, \delta(v) + t_s(u)\, s(v)
#  \;=\; \int_\text{stones} \rho\, g \cdot v . $$
#
# The tractions of a joint sum to a normal force $N$, a shear force $V$ and a moment $M$. The same
# thrust acts at a distance $M/N$ from mid-depth, or, as a fraction of the depth $h$,
#
# $$ e = \frac{M}{N h} , \qquad -\tfrac12 \le e \le \tfrac12 , $$
#
# The points where the thrust crosses the joints make the *thrust line*. At $e = \pm\tfrac12$ it has
# reached a face, and the joint is a hinge.

# %% [markdown]
# ## The solution

# %%
model = af.build(ring, fidelity="full", cells=(4, 4))
dead = af.dead_load(model)
table = dead.joints[["N", "V", "eccentricity", "friction"]].to_dataframe()
table[["name", "N", "V", "eccentricity", "friction"]].round(3)

# %%
af.view.draw_structure(ring, dead.joints)

# %% [markdown]
# The thrust line stays inside the stone along the whole arch: the arch stands. It rises toward the
# extrados at the crown and sinks toward the intrados at the haunches. Joints are open over part of
# their depth wherever $|e| > 1/6$; those beside the crown are, at the intrados.

# %%
f"largest |e| = {abs(table.eccentricity).max():.3f}; most friction used {table.friction.max():.2f}"

# %% [markdown]
# ## How fine is fine enough?
#
# The traction has a kink where a joint begins to open, so the evaluation points on a facet matter.
# Nodal quadrature is a row of springs. Lobatto's rule has points at both ends of a facet and one
# between; Gauss's has none at the ends. Exact facets integrate the traction in closed form. The
# converged eccentricity beside the crown is 0.2855.


# %%
def beside_crown(cells, rule):
    fine = af.build(ring, fidelity="full", cells=(cells, cells), quadrature=rule)
    return float(af.dead_load(fine).joints["eccentricity"][8])


rules, counts = ["exact", "lobatto", "nodal", "gauss"], [2, 4, 8]
found = pd.DataFrame({rule: [beside_crown(n, rule) for n in counts] for rule in rules}, counts)
found.rename_axis("cells").round(4)

# %% [markdown]
# The error of each, in thousandths of the depth:

# %%
((found - 0.2855) * 1000.0).rename_axis("cells").round(1)

# %% [markdown]
# A row of springs is too stiff in rotation, by $2/n^2$ with $n$ intervals: twice the cells leave a
# third or a quarter of the error. Lobatto and Gauss have three points a facet and are within two
# thousandths from the coarsest mesh on. But near a hinge a rule with no point at the face cannot
# reach $e = \pm\tfrac12$. Exact facets are within a tenth of a thousandth on every mesh. Therefore
# they are the default.

# %% [markdown]
# ## Equilibrium
#
# The two springings must carry the whole weight and push against each other. The cells have
# straight edges, four to a stone, so the model is lighter than the ring by
# $\varphi^2/6 = 0.03\,\%$, with $\varphi$ the angle of one cell. The springings must carry the
# weight of the model to the last digit.

# %%
springings = [0, len(ring.joints) - 1]
force = dead.joints["N"].values[:, None] * ring.normals
force -= dead.joints["V"].values[:, None] * ring.tangents
carried = force[springings[0]] - force[springings[1]]
weight = -af.statics.self_weight(model).reshape(-1, 2).sum(axis=0)[1]
pd.Series(
    {"ring": ring.weight, "model": weight, "carried": carried[1], "across": carried[0]},
    name="force [N]",
).round(6)

# %% [markdown]
# ## How many springs?
#
# A row of springs opens one by one. Demirel and Aldemir (2021) compared five springs a joint with
# eight, and gaps of 1 and 3 mm between the stones, on this ring, loaded at both edges of its
# keystone until it fails. Joints never slide.

# %%
ROUGH = replace(af.masonry.STONE_TO_STONE, friction=None)
SHAPE = {"radius": 2.95, "embrace": 159.0, "voussoirs": 17, "contact": ROUGH}
loaded = af.circular_arch(thickness=0.55, **SHAPE)
pair = [af.PointLoad(x=x, force=(0.0, -1e3)) for x in (-0.26, 0.26)]
limit = af.collapse_factor(loaded, live=pair, friction=None)
f"limit analysis: {limit.factor:.2f} kN each"

# %% [markdown]
# Springs at distances $r_i$ from mid-depth, each for a length $l_i$ of the joint, carry
#
# $$ N = -\sum_i w\, l_i\, k_n \min(g_i, 0), \qquad M = -\sum_i w\, l_i\, k_n \min(g_i, 0)\, r_i, $$
#
# with $g_i$ the opening at the spring. Two things follow. While all are closed, a row over $n$
# intervals is stiffer against rotation than the joint, by $1 + 2/n^2$. And once a single spring is
# left, $M = N r_i$: the outermost one decides how near to the face the thrust can be.
#
# A gap $\delta$ between the stones does not exist in joints of no thickness. We model its effects.
# Stones are shorter, and lighter by $18\,\delta$ in 8.19 m of centre line. The shear force $V$ has
# an arm $\delta/2$ from the middle of the gap to the stones' faces. So the thrust there is off
# by $V\delta/2N$ to either side. Joints that are shallower by $\delta\,V/N$ bound the effect, and
# at the crown's hinges $V/N = 0.6$.


# %%
def with_gap(gap):
    thickness = 0.55 - gap * float(limit.joints["friction"][8])
    lighter = 1.0 - 18 * gap / (2.95 * np.radians(159.0))
    stone = replace(af.STONE, unit_weight=lighter * af.STONE.unit_weight * 0.55 / thickness)
    return af.circular_arch(thickness=thickness, material=stone, **SHAPE)


def push(structure, springs, rule="nodal"):
    model = af.build(structure, fidelity="rigid", cells=(springs - 1, 1), quadrature=rule)
    return af.pushover(model, pair)


# %% [markdown]
# ### Five and eight springs, gaps of 1 and 3 mm
#
# The four curves of the paper's figure, and two without a gap:

# %%
rings = {gap: with_gap(1e-3 * gap) for gap in (0, 1, 3)}
pushed = {(n, gap): push(rings[gap], n) for n in (5, 8) for gap in rings}
curves = {f"{n} springs, {gap} mm": found for (n, gap), found in pushed.items()}
af.view.draw_pushover(curves, limits={"limit analysis, no gap": limit.factor})


# %%
def row(found, gap):
    curve = found.curve
    known = af.collapse_factor(rings[gap], live=pair, friction=None).factor
    half = np.interp(0.5 * known, curve["factor"], curve["displacement"])
    return {"ultimate": found.factor, "limit analysis": known, "mm at half of it": 1e3 * half}


ultimate = pd.DataFrame({key: row(found, key[1]) for key, found in pushed.items()}).T
ultimate.rename_axis(["springs", "gap [mm]"]).round(2)

# %% [markdown]
# The ultimate load does not depend on the number of springs: each row has one at the face, and a
# hinge needs no more. A gap of 3 mm costs 2.6 % at most. But at half the ultimate load five springs
# have moved three quarters as far as eight.

# %% [markdown]
# ### From 3 to 33 springs, and other rules
#
# The paper did not try more springs, or rules with three points on each facet. Lobatto's rule has
# points at both ends of a facet, Gauss's has none. Exact facets integrate the triangle of
# compression in closed form.

# %%
numbers, rules = [3, 5, 9, 17, 33], ["nodal", "lobatto", "gauss"]
pushes = {rule: [push(loaded, n, rule) for n in numbers] for rule in rules}
pushes["exact"] = [push(loaded, 2, "exact")] * len(numbers)


def soft(one):
    return np.interp(0.5 * limit.factor, one.curve["factor"], one.curve["displacement"])


figure = Figure(figsize=(6.4, 3.2), layout="constrained")
left, right = figure.subplots(1, 2)
left.set_ylabel("missing of the limit load [%]")
right.set_ylabel("error in the displacement at half of it [%]")
for rule, row_of in pushes.items():
    missing = [100.0 * (1.0 - one.factor / limit.factor) for one in row_of]
    off = [100.0 * abs(soft(one) / soft(pushes["exact"][0]) - 1.0) for one in row_of]
    left.plot(numbers, missing, "o-", label=rule, ms=4)
    right.plot(numbers, off, "o-", label=rule, ms=4)
for axes in (left, right):
    axes.set_xscale("log", base=2)
    axes.set_xticks(numbers, numbers)
    axes.set_xlabel("springs, or ends of facets [-]")
right.set_yscale("log", nonpositive="mask")  # exact facets are the reference
left.legend(frameon=False, fontsize=8)
figure

# %% [markdown]
# Nodal springs and Lobatto's points reach the limit load with any number. Gauss's outermost point
# is inside the face, which shortens each lever arm: together more than a quarter of the load is
# lost on four facets. Exact facets never stop closing: their hinge has a compressed strip that
# narrows with the square root of the rotation. After 0.7 m, a tenth of the ring, 5 % are missing.
# (So are 3 % on 32 of Lobatto's facets, the last of which is as narrow.)
#
# Before the ultimate load the order is reversed. Exact facets are the reference, Lobatto's and
# Gauss's rules are within half a per cent on eight facets, and a row of springs needs 33 for 2 %.
# So the number of springs does not matter for the ultimate load. It matters most for the
# displacement, as in an earthquake.

# %%
extrapolated = pushes["exact"][0].limit / limit.factor
f"the curve of exact facets, extrapolated: {extrapolated:.4f} of the limit load"

# %% [markdown]
# ## Check
#
# If the outermost Gauss point decides, then four facets are a thinner ring of the same
# weight, for limit analysis. The point is $(1 - \sqrt{3/5})/2$ of a facet inside the face.

# %%
thin = 0.55 * (1.0 - (1.0 - np.sqrt(0.6)) / 4)
stone = replace(af.STONE, unit_weight=af.STONE.unit_weight * 0.55 / thin)
thinner = af.circular_arch(thickness=thin, material=stone, **SHAPE)
known = af.collapse_factor(thinner, live=pair, friction=None).factor
gauss = pushes["gauss"][numbers.index(5)].factor
f"pushover with Gauss's rule {gauss:.2f}, limit analysis of the thinner ring {known:.2f}"

# %% [markdown]
# ## What to try next
#
# - `thickness=0.30`: the thrust line approaches both faces. At which thickness does
#   `dead_load` say that the arch cannot carry itself? The next notebook has the answer.
# - `fidelity="rigid"`, `"faces"` or `"condensed"`: how much does the elasticity of the stones
#   matter, to the thrust line and in `push`?
# - A time history: how far is the largest $|e|$ of five springs from that of exact facets?
# - `af.view.picture(model, dead, colour="stress")` shows the deformed stones.

# %%
crown, checked = float(found.loc[8, "exact"]), gauss / known
