"""Signs of large displacements: toward the extrados, on whichever side of the normal that is."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import archfem as af
from archfem.models.large.model import CorotationalCoordinates

SOFT = af.Material(young=1e8, poisson=0.2, unit_weight=25e3)
"""Stones that bend by as much as joints give."""


def pushed(structure, fidelity, displacements):
    model = af.build(structure, fidelity=fidelity, displacements=displacements)
    return af.pushover(model, af.BodyForce(1.0), stop=af.statics.Stop(steps=2, displacement=1e-4))


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize(
    "structure",
    [
        pytest.param(
            af.column(breadth=0.4, heights=[0.8, 0.8, 0.8], material=SOFT), marks=pytest.mark.slow
        ),
        af.circular_arch(
            radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, chords=1, material=SOFT
        ),
    ],
    ids=["column", "ring"],
)
def test_a_small_push_acts_as_with_small_displacements(structure, fidelity, caplog):
    """Joints of a column have the extrados on the right, those of a ring on the left.

    The weight of soft stones that lean adds to what bends them, by some per cent; of what shears
    them, which is small, it is more, so that of this only the sign is tested.
    """
    caplog.set_level(logging.ERROR)
    small, large = (pushed(structure, fidelity, kind) for kind in ("small", "large"))
    sides = structure.normals[:, 0] * structure.tangents[:, 1]
    sides -= structure.normals[:, 1] * structure.tangents[:, 0]
    assert abs(sides) == pytest.approx(1.0)
    for name in ("eccentricity", "V", "M", "slip", "rotation"):
        known, found = (push.joints[name].values[-1] for push in (small, large))
        scale = np.abs(known).max()
        if name not in ("V", "slip"):
            np.testing.assert_allclose(found, known, atol=0.1 * scale, err_msg=name)
        assert (np.sign(found) == np.sign(known))[np.abs(known) > 0.1 * scale].all(), name
    assert large.factor == pytest.approx(small.factor, rel=0.05)


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_own_coordinates_are_about_centres_of_mass(fidelity):
    """A push through the centre does not turn a block, and elastic motions have no momentum.

    The mass of cells with straight sides is not where that of stones with arcs is.
    """
    ring = af.circular_arch(radius=2.0, thickness=0.6, embrace=120.0, voussoirs=3)
    small = af.build(ring, fidelity=fidelity, cells=(2, 2))
    own = CorotationalCoordinates.of(small)
    mass = (own.basis.T @ small.mass @ own.basis).toarray()
    for span, turns in own.blocks.values():
        assert turns
        rigid = mass[span.start : span.start + 3].copy()
        rigid[range(3), span[:3]] = 0.0  # but for mass and moment of inertia
        assert np.abs(rigid).max() < 1e-9 * mass.max()
        assert mass[span[0], span[0]] == pytest.approx(mass[span[1], span[1]])
        assert mass[span[0], span[0]] * 9.81 == pytest.approx(ring.weight / 3.0, rel=0.03)


def test_faces_that_bend_see_few_coordinates():
    """A facet has four displacements of nodes, and the frame; two a joint have common ones.

    The coordinates span the model's: frequencies of closed joints are the same.
    """
    column = af.column(breadth=2.0, heights=[0.4, 0.4, 0.4])
    small = af.build(column, fidelity="full", cells=(6, 2))
    large = af.build(column, fidelity="full", cells=(6, 2), displacements="large")
    size = large.joints.kinematics.size.reshape(3, 6, 2)
    assert np.sum(size[:, :, 1] == 7, axis=1).tolist() == [4, 4, 4]
    assert (size[1:, :, 0] == 7).all()  # the other face of these joints
    exact, found = (
        eigh(model.closed_tangent().toarray(), model.mass.toarray(), eigvals_only=True)
        for model in (small, large)
    )
    assert found == pytest.approx(exact, rel=1e-9)  # eigenvalues span five decades


@pytest.mark.parametrize(
    ("fidelity", "grain", "turns"),
    [("rigid", False, True), ("faces", False, False), ("faces", True, True)],
)
def test_a_fill_turns_where_it_is_rigid_or_in_grains(fidelity, grain, turns):
    plain = af.column(breadth=1.0, heights=[1.0], material=af.masonry.BACKFILL)
    base, block = (replace(each, role="other") for each in plain.blocks)
    (joint,) = (replace(each, role="other") for each in plain.joints)
    blocks = (base, replace(block, grain=grain))
    small = af.build(replace(plain, blocks=blocks, joints=(joint,)), fidelity=fidelity)
    assert [each for _, each in CorotationalCoordinates.of(small).blocks.values()] == [turns]
