"""The ladder of models: each fidelity against the one above it, and against assembled forms."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from glued import glued
from repeats import each_once

import archfem as af
from archfem.joints.contact_law import ContactLaw
from archfem.joints.normal_law import Facets, Springs
from archfem.joints.quadrature import JointPoints

MOTION = af.Motion.synthetic(duration=4.0, pga=2.5, seed=5)
TIGHT = af.statics.Newton(tolerance=1e-13)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()


def envelope(model, **given):
    """Largest |e| of every joint over a run."""
    given = {"damping": af.Rayleigh(0.05, (8.0, 16.0)), "dt": 0.005, **given}
    run = af.time_history(model, MOTION, **given)
    return abs(run.joints["eccentricity"]).max("time").values


@pytest.fixture(scope="module")
def full(ring):
    return af.build(ring, cells=(4, 4))


def test_sizes(ring):
    sizes = {
        fidelity: af.build(ring, fidelity=fidelity).size
        for fidelity in ("rigid", "faces", "condensed")
    }
    assert sizes == {"rigid": 51, "faces": 102, "condensed": 340}


def test_static_condensation_is_exact_for_statics(ring, full, verified):
    """Guyan: joint displacements under any static load are those of the whole model."""
    reference = af.dead_load(full, TIGHT).joints
    found = af.dead_load(af.build(ring, fidelity="condensed"), TIGHT).joints
    for key in ("N", "V", "M"):
        scale = float(abs(reference[key]).max())
        off = float(np.abs(found[key] - reference[key]).max()) / scale
        case = "statically condensed against all nodes, dead load: N, V, M"
        verified(case, "equal", "Guyan (1965)", "equal", difference=off)
        assert off < 1e-9


@pytest.mark.parametrize(
    "rule", ["lobatto", "nodal", pytest.param("gauss", marks=pytest.mark.slow)]
)
def test_monolithic_is_full(ring, rule):
    """UFL forms assembled at each iteration, with joint tractions integrated as forms too."""
    full = af.build(ring, cells=(2, 2), quadrature=rule)
    slow = af.build(ring, cells=(2, 2), quadrature=rule, fidelity="monolithic")
    dead = [af.dead_load(model, TIGHT) for model in (full, slow)]
    assert dead[0].q == pytest.approx(dead[1].q, abs=1e-9 * np.abs(dead[1].q).max())
    for key in ("N", "V", "M"):
        scale = float(abs(dead[0].joints[key]).max())
        assert np.abs(dead[0].joints[key] - dead[1].joints[key]).max() < 1e-9 * scale
    assert full.energy(dead[0].q) == pytest.approx(slow.energy(dead[0].q), rel=1e-10)


@pytest.mark.slow
def test_monolithic_history_is_that_of_full(ring):
    short, given = MOTION.cut(1.0, 1.1), {"newton": TIGHT, "method": "snes", "dt": 0.005}
    runs = []
    for fidelity in ("full", "monolithic"):
        model = af.build(ring, cells=(2, 2), fidelity=fidelity, quadrature="lobatto")
        runs.append(af.time_history(model, short, **given).joints["M"])
    assert np.abs(runs[0] - runs[1]).max() < 1e-8 * np.abs(runs[0]).max()


@pytest.mark.parametrize(
    "law",
    [pytest.param(glued, marks=pytest.mark.slow), lambda same: same],
    ids=["holds", "slides"],
)
def test_errors_fall_up_the_ladder(ring, law):
    """Against all nodes on the same mesh; bounds up to twice what was found on this motion.

    Found are 8e-6, 0.0019 and 0.0070 where joints hold, 9e-6, 0.0021 and 0.0065 where they slide:
    four facets a joint, which all fidelities have here, follow the edges that are pressed little
    and slide first.
    """
    structure = law(ring)
    reference = envelope(af.build(structure, cells=(4, 4)))
    off = {
        fidelity: np.abs(envelope(af.build(structure, fidelity=fidelity)) - reference).max()
        for fidelity in ("rigid", "faces", "condensed")
    }
    assert off["condensed"] < 1.5e-5 < off["faces"] < 0.0035 < off["rigid"] < 0.012


@pytest.mark.slow
def test_one_facet_does_not_see_where_a_joint_begins_to_slide(ring):
    """Found are 0.043 with one facet and 0.007 with four; where joints hold the number is idle."""
    for structure, least, most in ((ring, 0.03, 0.06), (glued(ring), 0.0, 1e-9)):
        one, four = (envelope(af.build(structure, fidelity="rigid", cells=(n, 1))) for n in (1, 4))
        assert least <= np.abs(one - four).max() < most


SCHEMES = [
    ("closed", CONSERVING),
    ("initial", CONSERVING),
    ("closed", NEWMARK),
    ("initial", af.HHT(-0.1)),
]
SLOW = pytest.mark.slow


FIDELITIES, RULES = ("rigid", "faces", "condensed"), ("nodal", "lobatto", "gauss", "exact")


def quick(fidelity, rule, way):
    """Each fidelity, rule and law of joints at least once, but not with each other."""
    place = RULES.index(rule)
    return fidelity == FIDELITIES[place % len(FIDELITIES)] and way == SCHEMES[place]


@pytest.mark.parametrize(
    ("fidelity", "rule", "joints", "scheme"),
    [
        pytest.param(fidelity, rule, *way, marks=() if quick(fidelity, rule, way) else SLOW)
        for fidelity, rule, way in product(FIDELITIES, RULES, SCHEMES)
    ],
)
def test_compiled_steppers_give_the_history_of_snes(ring, fidelity, rule, joints, scheme):
    """Histories agree to 1e-8 of the largest, as joints open, and slide where the scheme allows."""
    slides = scheme == CONSERVING
    structure = ring if slides else glued(ring)
    model = af.build(structure, fidelity=fidelity, quadrature=rule, cells=(2, 2))
    given = {
        "start": af.dead_load(model, TIGHT),
        "damping": af.Rayleigh(0.05, (8.0, 16.0), joints),
        "scheme": scheme,
        "newton": TIGHT,
        "dt": 0.005,
    }
    short = MOTION.cut(1.2, 1.4)
    slow = af.time_history(model, short, method="snes", **given)
    for method in ("newton", "compliance"):
        fast = af.time_history(model, short, method=method, **given)
        assert fast.dataset.attrs["method"] == method
        assert fast.dataset.attrs["fallback_steps"] == 0
        assert fast.dataset["iterations"].max() > 1  # points have opened
        for key in ("N", "V", "M"):
            off = np.abs(fast.joints[key] - slow.joints[key]).max()
            assert off < 1e-8 * np.abs(slow.joints[key]).max()
        drift = fast.dataset["energy_drift"].values - slow.dataset["energy_drift"].values
        assert np.abs(drift).max() < 1e-6  # of a joule, where a hundred are exchanged


@pytest.mark.parametrize(
    ("stones", "fidelity"), each_once((2, 8, 16), ("full", "condensed", "faces"))
)
def test_a_joint_at_the_crown(stones, fidelity):
    """Its normal lies along x: openings there have exact zeros, which patterns must survive."""
    ring = af.circular_arch(radius=2.95, thickness=0.8, embrace=150.0, voussoirs=stones)
    found = af.dead_load(af.build(ring, fidelity=fidelity, cells=(2, 2), quadrature="exact")).joints
    e = found["eccentricity"].values
    assert e == pytest.approx(e[::-1], abs=1e-6)


def test_compiled_solvers_refuse_laws_that_are_not_compiled(ring, full):
    slow = af.build(glued(ring), cells=(1, 1), fidelity="monolithic")
    far = af.build(ring, fidelity="rigid", displacements="large")
    for model, method in ((slow, "newton"), (slow, "compliance"), (far, "compliance")):
        with pytest.raises(af.InvalidInput, match="use method='auto' or 'snes'"):
            af.time_history(model, MOTION, method=method)
    with pytest.raises(af.InvalidInput, match="method 'fast' does not exist"):
        af.time_history(full, MOTION, method="fast")


@pytest.mark.parametrize(
    ("scheme", "method"), each_once((NEWMARK, CONSERVING), ("newton", "compliance"))
)
def test_damping_on_the_blocks_alone(ring, scheme, method):
    structure = ring if scheme == CONSERVING else glued(ring)
    model = af.build(structure, fidelity="faces", cells=(2, 2), quadrature="nodal")
    damping = af.Rayleigh(0.05, (8.0, 16.0), "none")
    given = {"damping": damping, "scheme": scheme, "newton": TIGHT, "dt": 0.005}
    short = MOTION.cut(1.2, 1.3)
    runs = [af.time_history(model, short, method=m, **given).joints["M"] for m in ("snes", method)]
    assert np.abs(runs[0] - runs[1]).max() < 1e-8 * np.abs(runs[0]).max()


def test_fidelities_may_differ_from_block_to_block(ring):
    fidelities, structure = (
        {"voussoir 5": "full", "voussoir 9": "rigid", "rest": "faces"},
        glued(ring),
    )
    mixed = af.build(structure, fidelity=fidelities)
    assert mixed.size == 15 * 6 + 50 + 3
    off = np.abs(envelope(mixed) - envelope(af.build(structure, cells=(4, 4)))).max()
    assert off < 0.003
    with pytest.raises(af.InvalidInput, match="no blocks or parts"):
        af.build(ring, fidelity={"voussoir 99": "full"})
    with pytest.raises(af.InvalidInput, match=r"fidelities \['soft'\] are not known"):
        af.build(ring, fidelity={"rest": "soft"})


def test_inner_fields_are_recovered(ring, full):
    """Stress of the condensed model is that of all nodes, but for the weight inside a block."""
    condensed = af.build(ring, fidelity="condensed")
    whole = full.cells.stress @ af.dead_load(full).q
    found = condensed.cells.stress @ af.dead_load(condensed).q
    weight = 20e3 * 0.55  # the stress that a stone's own weight makes in it [Pa]
    assert np.abs(found - whole).max() < weight
    assert np.abs(whole).max() > 10.0 * weight


def test_rigid_and_condensed_are_wrong_where_a_block_is_soft(caplog):
    """A stone on a metre of backfill: rigid misses it all, condensation its inner modes."""
    stack = af.column(breadth=1.0, heights=[1.0, 0.5])
    soft = replace(stack.blocks[1], material=af.masonry.BACKFILL)
    stack = replace(stack, blocks=(stack.blocks[0], soft, stack.blocks[2]))
    reference = envelope(af.build(stack, fidelity="full"))
    off = {}
    for fidelity in ("rigid", "condensed"):
        off[fidelity] = np.abs(envelope(af.build(stack, fidelity=fidelity)) - reference).max()
        assert "soft blocks begin" in caplog.text
        assert ": block 1;" in caplog.text
        caplog.clear()
    assert off["rigid"] > 0.01
    assert off["condensed"] > 0.002
    mixed = af.build(stack, fidelity={"block 1": "full", "rest": "faces"})
    assert np.abs(envelope(mixed) - reference).max() < 0.002
    assert not caplog.text


@pytest.mark.parametrize("rule", ["exact", "lobatto"])
def test_joint_forces_integrate_the_traction(rule):
    """Against 4000 points on one facet, for gaps that are open, closed and mixed."""
    points = JointPoints(
        np.zeros(2, dtype=int),
        np.array([-0.25, 0.25]),
        np.array([0.25, 0.25]),
        ContactLaw.at_points([af.Contact(2e9, 1e9, None)], np.zeros(2, dtype=int)),
        1,
    )
    law = Facets(points) if rule == "exact" else Springs(points)
    place = (np.arange(4000) + 0.5) / 4000.0
    for a, b in ((-1.0, -2.0), (-1.0, 2.0), (3.0, -1.0), (1.0, 2.0), (0.0, -1.0), (0.0, 0.0)):
        gap = 1e-5 * (a + (b - a) * place)
        traction = 2e9 * np.minimum(gap, 0.0) * 0.5 / 4000.0
        sampled = np.array([traction @ (1.0 - place), traction @ place])
        found = law.forces(1e-5 * np.array([a, b]))
        near = np.abs(found - sampled).max() <= 1e-5 * np.abs(sampled).max() + 1e-12
        assert near == (rule == "exact" or (a == b == 0.0) or (a > 0.0 and b > 0.0))


def test_exact_facets_are_the_limit_of_quadrature(ring):
    """On one mesh, rules with more and more points approach the closed form.

    Of joints that hold: where they slide, exact facets carry shear at their ends alone.
    """

    def dead(**given):
        model = af.build(glued(ring), fidelity="rigid", **given)
        return af.dead_load(model).joints["eccentricity"].values

    exact = dead(quadrature="exact")
    off = [np.abs(dead(quadrature_points=n, cells=(8, 1)) - exact).max() for n in (2, 4, 8)]
    assert off[2] < off[1] < off[0]
    assert off[2] < 1e-4


def test_exact_quadrature_needs_linear_facets(ring):
    for given in ({"degree": 2}, {"fidelity": "monolithic"}):
        with pytest.raises(af.InvalidInput, match="linear along a facet"):
            af.build(ring, quadrature="exact", **given)
