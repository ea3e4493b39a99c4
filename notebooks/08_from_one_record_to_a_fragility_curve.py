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
# # From one record to a fragility curve
#
# Under one record four joints of a ring fail, or they do not. Another record of equal strength may
# have the opposite result. **What is the probability that an earthquake of some strength forms a
# mechanism?**

# %%
# %matplotlib inline
import os

import numpy as np

import archfem as af

quick = "ARCHFEM_QUICK" in os.environ  # few stones, few short motions: for tests

# %% [markdown]
# ## The structure
#
# A slender ring of rigid stones, with joints that slide. A case is a table, as in a file.

# %%
shape = {"shape": "circular_arch", "radius": 2.95, "embrace": 159.0}
damping = {"ratio": 0.05, "frequency": 8.0}
case = af.Case.of(
    {
        "title": "a slender ring",
        "structure": {**shape, "thickness": 0.35, "voussoirs": 7 if quick else 17},
        "model": {"fidelity": "rigid"},
        "analysis": {"dt": "10 ms" if quick else "5 ms", "damping": damping},
    }
)
motions = {
    f"motion {seed}": {"synthetic": {"seed": seed, "duration": 0.6 if quick else 4.0, "pga": 6.0}}
    for seed in range(1, 4 if quick else 13)
}

# %% [markdown]
# ## One record
#
# Synthetic motions replace records: under `[motion]` a case may as well name a file.

# %%
alone = af.Case.of({**case.settings, "motion": motions["motion 1"]})
run = af.cases.run_time_history(alone, alone.ground_motion(), af.cases.dead_load_of_case(alone))
found = af.studies.of_history(run)
f"|e| up to {found['eccentricity']:.3f}; four joints failed at {found['any joints at once']:.2f} s"

# %% [markdown]
# ## The equation
#
# Each motion is scaled up until a limit state is met: the search goes up by √2, then brackets are
# bisected. If the intensities $x_i$ at which motions meet it are lognormal, the probability for a
# motion of intensity $x$ is
#
# $$ P(x) = \Phi\!\left( \frac{\ln (x / \theta)}{\beta} \right) , $$
#
# The median $\theta$ and the dispersion $\beta$ maximise the likelihood of the brackets found.

# %%
settings = {"precision": 0.5, "between": (0.3, 5.0), "workers": 1} if quick else {"precision": 0.1}
ida = af.ida(case, motions, **settings)
ida.table[["pga", "first hinge", "four failures", "verified"]].to_dataframe()

# %% [markdown]
# ## Curves
#
# The single motions are grey. A curve may reverse: a stronger motion may meet the ring at a more
# favourable instant. Triangles are motions that did not meet a limit state at the scales tried.

# %%
capacities = {limit: ida.capacities(limit) for limit in ida.limits}
intensity = np.linspace(0.1, 1.5 * capacities["four failures"][1].max(), 60)
af.view.draw_ida(ida.curves(), capacities, fractiles=(intensity, ida.fractiles(intensity)))

# %% [markdown]
# ## The fragility curve, and its uncertainty
#
# The band is the bootstrap's, at 90 %: the uncertainty due to so few motions. The uncertain
# stiffness of joints widens the curve as well; `af.joint_stiffness` gives its range.

# %%
curves = {limit: ida.fragility(limit) for limit in ("first hinge", "four failures")}
drawn = {
    limit: (curve.probability(intensity), *curve.band(intensity)) for limit, curve in curves.items()
}
figure = af.view.draw_fragility(drawn, intensity)
for limit, curve in curves.items():
    low, high = curve.interval()
    print(f"{limit}: {curve.median:.2f} m/s² ({low:.2f} to {high:.2f}), β = {curve.dispersion:.2f}")
figure

# %%
print(af.joint_stiffness(30e9, 0.5, "weathered", stress=40e3).table())

# %% [markdown]
# ## Check
#
# Brackets are narrow relative to the spread of motions, so that the median must be the geometric
# mean of their middles.

# %%
lower, upper = ida.capacities("first hinge")
checked = curves["first hinge"].median / np.exp(np.log(np.sqrt(lower * upper)).mean())
f"median / geometric mean = {checked:.4f}"

# %% [markdown]
# ## What to try next
#
# - `ida.fragility("four failures", "sa")`: is Sa(T1) a better predictor than PGA, that is, is β
#   smaller?
# - `folder="out/ida"`: interrupt it, and call it again; it continues from the saved results.
# - `client="tcp://…"`: the same on a cluster.
# - `model.displacements = "large"`: collapse is then a limit state too.
