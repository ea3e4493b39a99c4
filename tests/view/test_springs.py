"""Pictures of meshes with their springs, and of the forces of springs on a block."""

import numpy as np
import pytest
from pictures import drawn

import archfem as af
from archfem.view import draw_mesh, draw_spring_forces


@pytest.fixture(scope="module")
def sprung(ring):
    """The ring with five springs a joint."""
    return af.build(ring, cells=(4, 4), quadrature="nodal")


def bodies(artist):
    return [path.vertices[:-1] for path in artist.get_paths()]


def test_all_cells_are_drawn_and_part_at_the_joints(sprung, ring):
    """Points in a joint move by half the gap, away from each other; those inside stay."""
    figure = draw_mesh(sprung, "voussoir 5")
    above, below = figure.axes
    assert "272 cells, 90 points in joints" in " ".join(above.get_title().split())
    gap = float(below.get_title().split(" by ")[1].removesuffix(" mm")) / 1e3
    (cells,) = [each for each in below.collections if each.get_gid() == "cells"]
    corners, built = bodies(cells), [sprung.cells.places[k] for k in sprung.cells.polygons]
    assert len(corners) == 17 * 16
    moves = [a - b for a, b in zip(corners, built, strict=True)]
    away = np.linalg.norm(np.concatenate(moves), axis=1)
    # of five columns of nodes in a stone the outer two lie in joints
    assert set(np.round(away, 3)) == {0.0, round(gap / 2.0, 3)}
    joint = ring.joint_number("joint 5")
    for number, sign in ((ring.joints[joint].lower, -1.0), (ring.joints[joint].higher, 1.0)):
        own = np.flatnonzero(sprung.cells.owner == number)
        along = [moves[k] @ ring.normals[joint] for k in own]
        assert (sign * np.concatenate(along)).max() == pytest.approx(gap / 2.0, abs=6e-4)


def test_springs_are_at_the_points_of_the_joints_of_a_block(sprung, ring):
    """Their ends part with the blocks, so that their middles stay."""
    figure = draw_mesh(sprung, "voussoir 5")
    springs = np.array(drawn(figure, "springs").get_segments())
    joints = [ring.joint_number(name) for name in ("joint 4", "joint 5")]
    share = np.linspace(0.0, 1.0, 5)[:, None]
    ends = ring.ends[joints]
    places = np.concatenate([(1.0 - share) * low + share * high for low, high in ends])
    assert springs.mean(axis=1) == pytest.approx(places, abs=1e-9)
    across = springs[:, -1] - springs[:, 0]
    assert np.abs(across @ ring.tangents[joints].T).min(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_supports_are_hatched_and_rigid_blocks_are_drawn(bridge):
    model = af.build(bridge, fidelity="rigid")
    above = draw_mesh(model).axes[0]
    (supports,) = [each for each in above.collections if each.get_gid() == "supports"]
    assert supports.get_hatch()
    assert len(bodies(supports)) == sum(block.fixed for block in bridge.blocks)


def test_arrows_of_springs_add_up_to_the_thrust(sprung, ring):
    """Each pushes inward, on its own spring; the sum and the moment are those of the joint."""
    dead = af.dead_load(sprung)
    figure = draw_spring_forces(dead, "voussoir 5")
    arrows = [each for each in figure.axes[0].texts if each.arrow_patch is not None]
    heads, tails = (np.array([getattr(each, key) for each in arrows]) for key in ("xy", "xyann"))
    centre = np.array(ring.blocks[ring.block_number("voussoir 5")].centroid)
    assert (np.einsum("ij,ij->i", heads - tails, centre - heads) > 0.0).all()
    number = ring.joint_number("joint 5")
    joint = dead.joints.isel(joint=number)
    own = np.abs((heads - ring.middles[number]) @ ring.normals[number]) < 1e-9
    sizes = np.linalg.norm(heads - tails, axis=1)[own]
    offsets = (heads[own] - ring.middles[number]) @ ring.tangents[number]
    e = (sizes @ offsets) / sizes.sum() / ring.depths[number]
    assert e == pytest.approx(float(joint["eccentricity"]), abs=1e-9)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"joint 5: {float(joint['N']) / 1e3:.1f} kN by 5 springs" in labels[1]


def test_models_without_springs_are_refused(stack):
    large = af.build(stack, fidelity="rigid", displacements="large")
    for draw in (draw_mesh, lambda model: draw_spring_forces(af.dead_load(model), 1)):
        with pytest.raises(af.InvalidInput, match="no springs at points to draw"):
            draw(large)
