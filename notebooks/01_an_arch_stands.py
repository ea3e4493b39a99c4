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
# their weight go?** And how fine must a model be before we may believe its answer?

# %%
# %matplotlib inline
import pandas as pd

import archfem as af

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
# ## Check
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
# ## What to try next
#
# - `fidelity="rigid"`: only the joints deform. How much does the elasticity of the stones
#   matter to the thrust line?
# - `thickness=0.30`: the thrust line approaches both faces. At which thickness does
#   `dead_load` say that the arch cannot carry itself? The next notebook has the answer.
# - `af.PointLoad` at a quarter of the span: where do the four hinges form?
# - `af.view.picture(model, dead, colour="stress")` shows the deformed stones.

# %%
crown = float(found.loc[8, "exact"])
