"""The validation ring under its own weight: converged values, balance, invariances.

@article{demirel2021, author={Demirel, I. O. and Aldemir, A.}, title={Simplified approach for
seismic performance assessment of dry-joint masonry arch bridges}, journal={Buildings},
volume={11}, year={2021}}
"""

from dataclasses import replace

import numpy as np
import pytest
from glued import glued

import archfem as af

CONVERGED = {"sliding": 0.2855, "glued": 0.2853}
"""Crown eccentricity that all rules approach, to four digits: of joints that carry no shear where
they are open, and of joints that never slide, which do."""

TRIAL = {  # cells, rule, points: crown eccentricity as found in a trial of joints that never slide
    (4, "nodal", None): 0.2948,
    (8, "nodal", None): 0.2884,
    (16, "nodal", None): 0.2860,
    (4, "gauss", 3): 0.2857,
    (4, "lobatto", 3): 0.2867,
    (4, "lobatto", 4): 0.2849,
    (2, "lobatto", 3): 0.2853,
}


@pytest.mark.parametrize(
    "setting",
    # other tests have meshes as fine
    [pytest.param(each, marks=pytest.mark.slow if each[0] >= 8 else ()) for each in TRIAL],
    ids=str,
)
def test_crown_eccentricity(ring, setting):
    cells, rule, points = setting
    model = af.build(glued(ring), cells=(cells, cells), quadrature=rule, quadrature_points=points)
    found = af.dead_load(model).joints
    assert float(found["eccentricity"][8]) == pytest.approx(TRIAL[setting], abs=6e-5)


@pytest.fixture(params=["sliding", pytest.param("glued", marks=pytest.mark.slow)])
def lawful(ring, request):
    """The ring with either law of its joints, and the crown eccentricity that it approaches."""
    return {"sliding": ring, "glued": glued(ring)}[request.param], CONVERGED[request.param]


@pytest.mark.parametrize(
    "rule",
    ["nodal", *(pytest.param(rule, marks=pytest.mark.slow) for rule in ("lobatto", "gauss"))],
)
@pytest.mark.parametrize("law", ["sliding", pytest.param("glued", marks=pytest.mark.slow)])
def test_converges_under_refinement(ring, law, rule):
    """Of glued joints the values of each rule are pinned by `test_crown_eccentricity`."""
    ring, converged = {"sliding": ring, "glued": glued(ring)}[law], CONVERGED[law]
    errors = []
    for cells in (4, 16):
        found = af.dead_load(af.build(ring, cells=(cells, cells), quadrature=rule)).joints
        errors.append(abs(float(found["eccentricity"][8]) - converged))
    assert errors[-1] < 8e-4
    assert errors[1] < 0.5 * errors[0]


def test_dead_load_values(lawful, verified):
    ring, converged = lawful
    found = af.dead_load(af.build(ring, cells=(16, 16))).joints
    assert float(found["eccentricity"][8]) == pytest.approx(converged, abs=1e-4)
    assert float(found["eccentricity"][0]) == pytest.approx(0.124, abs=5e-4)
    assert float(found["N"][8]) == pytest.approx(21.65e3, rel=1e-3)
    law = "never slide" if converged == CONVERGED["glued"] else "slide"
    case = f"crown eccentricity of the validation ring, joints that {law}"
    crown = float(found["eccentricity"][8])
    verified(case, converged, "limit of four rules under refinement", crown)


@pytest.mark.parametrize("fidelity", ["rigid", "full"])
def test_every_block_is_in_balance(fidelity):
    """Joint resultants and weight of each voussoir, forces and moments, to 1e-9 of the weight."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=4)
    joints = af.dead_load(af.build(ring, fidelity=fidelity)).joints
    for number in ring.free:
        block = ring.blocks[number]
        force = np.array([0.0, -block.area * block.material.unit_weight * ring.width])
        turning = 0.0
        for k, joint in enumerate(ring.joints):
            if number not in joint.blocks:
                continue
            side = 1.0 if number == joint.higher else -1.0
            normal, shear, e = (float(joints[key][k]) for key in ("N", "V", "eccentricity"))
            push = side * (normal * ring.normals[k] - shear * joint.tangent)
            arm = joint.middle + e * joint.depth * joint.tangent - block.centroid
            force += push
            turning += arm[0] * push[1] - arm[1] * push[0]
        assert np.abs(force).max() < 1e-9 * ring.weight
        assert abs(turning) < 1e-9 * ring.weight * ring.size


def test_rigid_is_full_projected_on_rigid_motions():
    """Same joint quadrature: BᵀMB and G B of the full model are the rigid model's own."""
    from archfem.masonry.structure import rigid_motion_matrix

    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, chords=3)
    same = {"cells": (3, 3), "quadrature": "lobatto"}  # exact joints of rigid blocks have one facet
    full, rigid = af.build(ring, **same), af.build(ring, **same, fidelity="rigid")
    places = full.cells.places
    owner = np.full(len(places), -1)
    for cell, block in zip(full.cells.polygons, full.cells.owner, strict=True):
        owner[cell] = block
    basis = np.zeros((full.size, rigid.size))
    for k, number in enumerate(ring.free):
        own = np.flatnonzero(owner == number)
        motion = rigid_motion_matrix(places[own], ring.blocks[number].centroid)
        rows = (2 * own[:, None] + np.arange(2)).ravel()
        basis[rows, 3 * k : 3 * k + 3] = motion.reshape(-1, 3)
    mass = basis.T @ (full.mass @ basis)
    assert np.abs(mass - rigid.mass.toarray()).max() < 1e-10 * np.abs(mass).max()
    for rows, own in (
        (full.operator.opening, rigid.operator.opening),
        (full.operator.slip, rigid.operator.slip),
    ):
        assert np.abs(rows @ basis - own.toarray()).max() < 1e-11  # gmsh places nodes to 1e-12


def test_full_approaches_rigid_as_stone_hardens():
    """Elasticity's share falls as 1/E: to 1e-5 of e at a thousand times the modulus of stone.

    On the same points of the joints: which of them are open, and so carry no shear, is then alike.
    """
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17, "chords": 4}

    def tilts(fidelity, **material):
        ring = af.circular_arch(**given, **material)
        model = af.build(ring, fidelity=fidelity, quadrature="lobatto")
        return af.dead_load(model).joints["eccentricity"]

    rigid, off = tilts("rigid"), []
    for factor in (10.0, 100.0, 1000.0):
        hard = af.Material(factor * 30e9 / 10.0, 0.2, 20e3)
        off.append(float(abs(tilts("full", material=hard) - rigid).max()))
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.1)
    assert off[1] / off[2] == pytest.approx(10.0, rel=0.1)
    assert off[2] < 1e-5


def test_results_per_width_do_not_depend_on_the_width(ring):
    reference = af.dead_load(af.build(ring, fidelity="rigid")).joints
    for width in (1e-3, 100.0):
        found = af.dead_load(af.build(replace(ring, width=width), fidelity="rigid")).joints
        assert np.abs(found["eccentricity"] - reference["eccentricity"]).max() < 1e-9
        assert found["N"].values / width == pytest.approx(reference["N"].values, rel=1e-9)


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("full", marks=pytest.mark.slow)])
def test_numbering_changes_nothing_physical(ring, fidelity):
    """Blocks renumbered at random and joints listed the other way round."""
    order = np.random.default_rng(3).permutation(len(ring.blocks))
    place = np.argsort(order)
    joints = tuple(
        replace(j, blocks=(int(place[j.blocks[1]]), int(place[j.blocks[0]]))) for j in ring.joints
    )
    shuffled = af.Structure(tuple(ring.blocks[k] for k in order), joints, ring.width, ring.gravity)
    first = af.dead_load(af.build(ring, fidelity=fidelity)).joints
    second = af.dead_load(af.build(shuffled, fidelity=fidelity)).joints
    for key in ("N", "eccentricity", "friction"):
        assert second[key].values == pytest.approx(first[key].values, rel=1e-7, abs=1e-9)


def test_softer_joints_change_forces_little_and_displacements_in_proportion(ring):
    """With k_n and k_s a hundred times less the stones are rigid beside them: q grows likewise."""
    soft = af.Contact(1.48e7, 0.30e7)
    loose = replace(ring, joints=tuple(replace(j, contact=soft) for j in ring.joints))
    first = af.dead_load(af.build(ring, fidelity="rigid"))
    second = af.dead_load(af.build(loose, fidelity="rigid"))
    assert second.q == pytest.approx(100.0 * first.q, rel=1e-6, abs=1e-12)
