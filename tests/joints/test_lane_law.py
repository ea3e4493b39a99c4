"""Eight joints at a time, beside the same joints one by one."""

import numba
import numpy as np
import pytest
from kernels import from_python
from repeats import each_once

import archfem as af
from archfem._numba import kernel
from archfem.joints.large.lane_law import (
    lane_damping_loss,
    lane_energy,
    lane_forces,
    lane_law,
    lane_overlap,
    pad,
)
from archfem.joints.large.lanes import (
    LANES,
    WIDTH,
    any_lane,
    gather,
    greatest,
    lane,
    least,
    load,
    select,
    store,
    with_lane,
)
from archfem.joints.large.overlap_law import closing_energy, damping_loss, overlap, segment_forces

STONE = {"normal_stiffness": 1e10, "shear_stiffness": 4e9}
CONTACTS = {
    "dry": {"friction": 0.6},
    "never slides": {"friction": None},
    "without friction": {"friction": 0.0},
    "cohesive": {"friction": 0.6, "cohesion": 1e5},
    "closing": {"friction": 0.6, "closure": 1e-4},
}


@kernel
def operate(rows, places, out):
    a, b = load(rows, 0, 0), gather(rows, 1, places, 0, 0)
    total = 0.0
    for k in range(3):  # a number that becomes a vector
        total += k * a
    store(out, 0, 0, select((a < b) & ~(b > 0.5), -abs(a / b), total - 2))
    store(out, 1, 0, least(a, b) + greatest(a, 0.0) * 1.0)
    store(out, 2, 0, with_lane(a, 3, lane(b, 5)))
    return any_lane((a == b) | (a != a)), any_lane(a >= b)


def test_vectors_compute_as_numpy_does():
    rng = np.random.default_rng(1)
    rows, places = rng.normal(size=(2, WIDTH)), rng.permutation(WIDTH)[None]
    out = np.zeros((3, WIDTH))
    a, b = rows[0], rows[1, places[0]]
    assert from_python(operate)(rows, places, out) == (False, bool((a >= b).any()))
    expected = np.where((a < b) & ~(b > 0.5), -np.abs(a / b), 3.0 * a - 2)
    assert out[0] == pytest.approx(expected, rel=1e-15)
    assert out[1] == pytest.approx(np.minimum(a, b) + np.maximum(a, 0.0), rel=1e-15)
    assert out[2].tolist() == [*a[:3], b[5], *a[4:]]
    assert LANES.unify(None, numba.types.float64) is LANES
    assert LANES.unify(None, numba.types.complex128) is None


@kernel
def evaluate_lanes(law, start, end, lag, memory, out):
    for at in range(0, start.shape[1], WIDTH):
        g0, s0, t0 = load(start, 0, at), load(start, 1, at), load(start, 2, at)
        g1, s1, t1 = load(end, 0, at), load(end, 1, at), load(end, 2, at)
        (l0, _), (c0, _) = lane_overlap(law, at, s0)
        (l1, _), (c1, _) = lane_overlap(law, at, s1)
        g0 = g0 - c0 * t0
        before = lane_energy(law, at, l0, g0, t0)[0]
        force, rates, others, missing, after = lane_forces(
            law, at, (g0, s0, t0, l0, c0, before), (g1, s1, t1), lag, memory
        )
        ends = (g0, l0 * t0, l0), (g1 - c1 * t1, l1 * t1, l1)
        loss = lane_damping_loss(law, at, *ends, lag, memory[3])
        for k in range(3):
            store(out, k, at, force[k])
            store(out, 3 + k, at, others[k])
            for m in range(3):
                store(out, 6 + 3 * k + m, at, rates[k][m])
        store(out, 15, at, missing)
        store(out, 16, at, after)
        store(out, 17, at, loss)


@kernel
def evaluate_one_by_one(law, start, end, lag, memory, out):
    for joint in range(len(law.depth)):
        first = start[0, joint], start[1, joint], start[2, joint]
        last = end[0, joint], end[1, joint], end[2, joint]
        force, rates, _, others = segment_forces(law, joint, (first, last, (0.0, 0.0)), lag, memory)
        for k in range(3):
            out[k, joint] = force[k]
            for m in range(3):
                out[6 + 3 * k + m, joint] = rates[k][m]
        out[3, joint], out[4, joint] = others[0]
        out[5, joint], out[15, joint] = others[1], others[2][0]
        (length, _), (middle, _) = overlap(law, joint, last[1])
        gap = last[0] - middle * last[2]
        out[16, joint] = closing_energy(law, joint, length, gap, last[2])[0]
        out[17, joint] = damping_loss(law, joint, (first, last), lag)


def joints_of(contact, quadrature=None):
    """Return the law of the joints of 18 stones on each other, some of whose faces are longer."""
    ends = 0.5 + 0.1 * np.random.default_rng(2).integers(0, 3, (18, 2))
    blocks = []
    for k, (left, right) in enumerate(ends.tolist()):
        outline = ((-left, k), (right, k), (right, k + 1.0), (-left, k + 1.0))
        blocks.append(af.Block(outline, af.STONE, f"stone {k}", fixed=k == 0))
    structure = af.masonry.assembled(blocks, af.Contact(**STONE, **contact), width=0.7)
    options = {"quadrature": quadrature} if quadrature else {}
    law = af.build(structure, fidelity="rigid", displacements="large", **options).joints.face_law
    assert set(np.sign(law.end_slip).ravel()) == {-1.0, 0.0, 1.0}
    return law


def random_measures(rng, count, depth):
    """Return opening, slip and rotation: closed, partly open and open, some parted (3, j)."""
    size = 10.0 ** rng.uniform(-7.0, -3.5, (3, count))
    slip = np.where(rng.random(count) < 0.1, depth * rng.normal(size=count), size[1])
    signs = rng.choice([-1.0, 1.0], (3, count))
    return signs * [size[0], slip, size[2]]


@pytest.mark.parametrize(
    ("name", "quadrature", "lag"), each_once([*CONTACTS], [None, "lobatto"], [0.4, 0.0])
)
def test_joints_side_by_side_equal_joints_one_by_one(name, quadrature, lag, each_way):
    """Random steps, each joint by another part of the law; equal to rounding."""
    law, rng = joints_of(CONTACTS[name], quadrature), np.random.default_rng(5)
    side_by_side_forces, one_by_one_forces = each_way(evaluate_lanes), each_way(evaluate_one_by_one)
    count, points = len(law.depth), int(law.first_point[1])
    side_by_side, seen = lane_law(law), 0
    width = pad(count)
    for _ in range(30 if each_way is from_python else 10):
        start, end = np.zeros((2, 3, width))
        start[:, :count] = random_measures(rng, count, law.depth)
        change = random_measures(rng, count, law.depth)
        end[:, :count] = start[:, :count] + change * 10.0 ** rng.uniform(-2.0, 0.0)
        slip = start[1, :count] + 1e-5 * rng.normal(size=(points, count))
        direction = rng.choice([-1.0, 0.0, 1.0], (points, count))
        one_by_one = [each.T.ravel() for each in (slip, 0.0 * slip, direction)]
        memory = np.zeros((4, points, width))
        memory[0, :, :count], memory[2, :, :count] = slip, direction
        found, expected = np.zeros((18, width)), np.zeros((18, count))
        side_by_side_forces(side_by_side, start, end, lag, tuple(memory), found)
        one_by_one_forces(law, start, end, lag, tuple(one_by_one), expected)
        # sums of terms of at most this size, added in another order; tangents of closing joints
        # are up to 2500 k_n, and cancel in that of the moment by the opening
        scale = np.abs(expected).max(axis=1, keepdims=True)
        ratio = (np.abs(found[:, :count] - expected) / np.maximum(scale, 1e-300)).max(axis=1)
        assert ratio.max() <= (1e-10 if name == "closing" else 1e-12)
        for part, flat in zip(memory[1:3, :, :count], one_by_one[1:], strict=True):
            assert part.T.ravel() == pytest.approx(flat, abs=1e-15)
        seen += np.count_nonzero(expected[15])
    if CONTACTS[name]["friction"]:
        assert seen > 0  # points that reverse their slip
