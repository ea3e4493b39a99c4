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
# # The paper's system by FEniCSx alone
#
# Gmsh makes the stones, DOLFINx assembles elastic plane stress and penalty terms at the joints,
# PETSc's SNES solves each Newmark step, and the joint tractions are integrated to resultants.
# **What does this path consist of, and when is it worth its price?**

# %%
# %matplotlib inline
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import ufl
from dolfinx import fem
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from PIL import Image

import archfem as af
from archfem.models.fem.forms import Forms, plane_stress, strain
from archfem.models.fem.mesh import generate_mesh
from archfem.models.fem.space import build_broken_space

quick = "ARCHFEM_QUICK" in os.environ  # a coarse study: for tests

# %% [markdown]
# ## The structure
#
# The ring by which Demirel and Aldemir (2021) validate their model. Its joints carry no tension
# and are sheared elastically; friction is a criterion, as in the paper.

# %%
contact = replace(af.masonry.STONE_TO_STONE, friction=None)
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, contact=contact)
analysis = af.Analysis(
    ring,
    fidelity="monolithic",
    quadrature="nodal",  # springs at nodes
    scheme=af.dynamics.Newmark(),
    method="snes",
    dt=0.005,
    damping=af.Rayleigh(0.05, (8.0, 16.0)),
    criteria=af.Criteria(friction=0.6),
    record=af.dynamics.Record(fields_every=1),  # displacements, for films
)

# %% [markdown]
# ## Zero-thickness joint facets
#
# Gmsh meshes all stones together: neighbours share the nodes and facets of their joint. The space
# of displacements is then renumbered, so that each stone has its own degrees of freedom on the
# joint. A joint has no thickness and no cells of its own, and $⟦u⟧$ is the difference of two sides
# of a facet.

# %%
mesh = generate_mesh(ring, analysis.discretisation)
space = build_broken_space(mesh)
vertices, nodes = mesh.grid.topology.index_map(0).size_local, len(space.places)
facets = len(space.facets.numbers)
f"{len(space.cells)} cells, {vertices} vertices, {nodes} nodes, {facets} facets on joints"

# %% [markdown]
# Under its weight the crown sinks, and joints open at the intrados there. Displacements are drawn
# 700-fold; where stones overlap the springs are compressed.

# %%
rest = analysis.dead_load()
cells, moved = rest.model.cells, 700.0 * rest.q.reshape(-1, 2)
outlines = [(cells.places + moved)[polygon] for polygon in cells.polygons]
figure = Figure(figsize=(6.4, 3.4), layout="constrained")
axes = figure.add_subplot()
colours = ["#d9cdb8" if owner % 2 else "#c3d0d9" for owner in cells.owner]
axes.add_collection(PolyCollection(outlines, facecolors=colours, edgecolors="#555555", lw=0.4))
axes.autoscale_view()
axes.set_aspect("equal")
axes.axis("off")
figure

# %% [markdown]
# ## The weak form
#
# Find $u$ such that for all $v$
#
# $$ \int w\, \rho\, \ddot u \cdot v + \int w\, \sigma(u) : \varepsilon(v)
#    + \sum_\text{joints} \int w\, (t_n ⟦v⟧ \cdot n + t_s ⟦v⟧ \cdot t) = \int w\, \rho\, b \cdot v,
#    \qquad t_n = k_n \min(⟦u⟧ \cdot n, 0), \qquad t_s = k_s ⟦u⟧ \cdot t . $$
#
# Here are the two internal terms in UFL, with nothing of archfem but mesh, space and measure. They
# give the forces of the model, to rounding. At random displacements half of the springs are open.

# %%
forms = Forms(space, analysis.discretisation.rule)
(patch,) = forms.facets.patches  # facets of one contact
u, v = fem.Function(space.functions), ufl.TestFunction(space.functions)
n = ufl.FacetNormal(mesh.grid)("+")


def jump(field):
    return field("-") - field("+")


gap, slip = ufl.dot(jump(u), n), jump(u) - ufl.dot(jump(u), n) * n
t_n = contact.normal_stiffness * ufl.conditional(ufl.lt(gap, 0.0), gap, 0.0)
t_s = contact.shear_stiffness * slip
stress = plane_stress(u, af.STONE.young, af.STONE.poisson)
stones = ring.width * ufl.inner(stress, strain(v)) * ufl.dx
joints = ring.width * (t_n * ufl.dot(jump(v), n) + ufl.dot(t_s, jump(v))) * patch.measure
q = 1e-4 * np.random.default_rng(1).standard_normal(rest.model.size)
u.x.array[space.free] = q
written = np.zeros_like(u.x.array)
fem.assemble_vector(written, fem.form(stones + joints))
force = rest.model.force(q)
off = np.abs(written[space.free] - force).max() / np.abs(force).max()
f"forces of the form above and of the model differ by {off:.0e}"

# %% [markdown]
# The stiffness of the stones does not change, and is assembled once. The terms of the joints are
# assembled in each iteration, and `ufl.derivative` gives their tangent.
#
# ## Options and log of SNES
#
# `Newton(petsc=…)` takes any option of SNES, KSP and PC, also as `[analysis.newton.petsc]` in a
# case. What PETSc does not read is an error, not silence:

# %%
try:
    af.dead_load(rest.model, af.statics.Newton(petsc={"snes_typ": "newtontr"}))
except af.InvalidInput as error:
    print(error)

with tempfile.TemporaryDirectory() as folder:
    log = Path(folder) / "snes.txt"
    options = {"snes_monitor": f"ascii:{log}", "pc_factor_mat_ordering_type": "rcm"}
    af.dead_load(rest.model, af.statics.Newton(petsc=options))
    print(log.read_text())

# %% [markdown]
# The law is linear between a few states of each spring, so that the last step of Newton's method
# is exact: the residual falls by ten orders at once.
#
# ## A time history
#
# The strong part of a synthetic motion. Tractions are integrated over each joint,
#
# $$ N = -\int w\, t_n, \quad V = \int w\, t_s, \quad M = -\int w\, t_n\, r, \quad e = M / (N h), $$
#
# a joint with $|e| \ge 0.46$ is a hinge, and one with $|V| \ge 0.6 N$ slides.

# %%
motion = af.Motion.synthetic(duration=10.0, pga=3.0, seed=3).cut(1.5, 3.0)
started = time.process_time()
run = analysis.run(motion)
spent = time.process_time() - started
print(run.verdict)
run.joints["hinge"].any("time").sum().item(), "joints hinge"

# %%
af.view.draw_envelope({"monolithic": run}, dead=rest.joints)

# %% [markdown]
# ## Hinges, filmed
#
# `renderer="pyvista"` draws each frame by PyVista, with the hinges marked and the thrust line.
# This is the frame with most hinges of the film:

# %%
hinged = run.joints["hinge"].sum("joint")
with tempfile.TemporaryDirectory() as folder:
    film = Path(folder) / "hinges.mp4"
    shown = {"seconds": 3.0, "size": (960, 540), "renderer": "pyvista", "colour": "stress"}
    af.view.film(rest.model, run, film, **shown)
    frames = iio.imread(film)
most = round(int(hinged.argmax()) / (len(hinged) - 1) * (len(frames) - 1))
Image.fromarray(frames[most])

# %% [markdown]
# ## Sensitivity to the mesh, from a script
#
# `mesh_sensitivity` repeats the run with other meshes, steps, rules and fidelities, and
# extrapolates. The finding is the largest displacement under half of the motion, since $|e|$ has
# the bound 0.5.

# %%
weak = motion.scaled(0.5).cut(0.0, 0.4 if quick else 1.0)
sizes = {"cells": (1, 2, 3) if quick else (2, 4, 8), "steps": (0.02, 0.01, 0.005)}
rules = ("nodal", "lobatto", "gauss")
found = analysis.mesh_sensitivity(weak, quantity="largest_displacement", rules=rules, **sizes)
for name, path in (("mesh", found.mesh), ("step", found.step)):
    print(f"{name}: {1e3 * path.limit:.3f} mm extrapolated, error bar {1e3 * path.error:.3f} mm")
print({rule: f"{1e3 * value:.3f} mm" for rule, value in found.rules.items()})
af.view.draw_convergence(found, "largest displacement [m]")

# %% [markdown]
# With springs at nodes a finer mesh is also a longer row of springs, and eight cells miss 7 % of
# the extrapolated value. On the same mesh the rules of Lobatto and Gauss are within 2 % of it.
#
# ## The price
#
# The compiled path has the same law at the same springs: `fidelity="full"` and `method="auto"`. It
# finds the same history from other formulas, which assemble nothing.

# %%
compiled = replace(analysis, fidelity="full", method="auto")
compiled.run(motion)  # compiles what is not in the cache
started = time.process_time()
other = compiled.run(motion)
ratio = spent / (time.process_time() - started)
moments, known = (abs(each.joints["M"]).max("time").values for each in (run, other))
checked = float((moments / known).mean())
apart = np.abs(moments / known - 1.0).max()
print(f"largest moments are {apart:.0e} apart, at {ratio:.0f} times the cost")

# %% [markdown]
# So this path is for checks, and for experiments: another solver of PETSc, another form. Large
# displacements, construction in stages and laws of the user are not on it.
#
# ## What to try next
#
# - `degree=2`, with fewer cells: does the largest displacement converge faster?
# - `af.Contact(…, friction=0.6)` and `scheme=af.dynamics.Conserving()`: joints slide.
# - `petsc={"pc_factor_mat_solver_type": "mumps"}`, or `{"snes_lag_jacobian": "2"}`, which needs
#   fewer factors and more iterations: what do they cost?
