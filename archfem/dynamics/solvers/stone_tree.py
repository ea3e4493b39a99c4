"""Elimination of chains of rigid stones, without a closed loop.

The stones of an arch and its piers form chains, or trees where rings share a pier: joints link each
stone to at most one that is eliminated later. The tangent then has blocks of three by three, D_i on
the diagonal, U_i to the right of it and L_i below it. Its factor has no others:

    F_i = L_i D_i⁻¹,   D_p ← D_p - F_i U_i,

with p the stone to which i is linked.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components

from archfem._numba import inlined_kernel
from archfem.dynamics.solvers.equation import Equation


class StoneTree(NamedTuple):
    """Order of elimination of stones that joints link without a closed loop."""

    order: Any  # coordinates (n,)
    parent: Any  # stone that is eliminated later and linked to each; their number if none (m,)


def find_stone_tree(equation: Equation) -> StoneTree | None:
    """Return the order of elimination of rigid stones; None for other structures and damping."""
    model: Any = equation.model
    if not model.large_displacements:
        return None
    sides = model.joints.kinematics
    rigid = np.isin(sides.size, (0, 3)).all() and not sides.stretch.size
    points = np.diff(model.joints.face_law.first_point)
    if not rigid or len(points) != model.joints.joint_count or points.min() < points.max():
        return None
    if not model.has_frame.all() or equation.rest.data.any() or model.block_stiffness.data.any():
        return None
    mass = model.mass.diagonal()
    off_diagonal = model.mass - sparse.diags(mass)
    if abs(off_diagonal).max() > 1e-12 * mass.max():
        return None
    count = model.size // 3
    pairs = sides.index[:, :, 0][(sides.size == 3).all(axis=1)] // 3
    links = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), (count, count))
    links = ((links + links.T) > 0).astype(int)
    parts, part = connected_components(links, directed=False)
    if links.nnz // 2 != count - parts:  # a closed loop
        return None
    last_first, parent = [], np.full(count, -1)
    for number in range(parts):
        root = _middle_of(links, int(np.flatnonzero(part == number)[0]))
        order, parents = breadth_first_order(links, root, directed=False)
        last_first += order.tolist()
        parent[order] = parents[order]
    stones = np.array(last_first[::-1])
    place = np.append(np.argsort(stones), count)
    parents = np.where(parent < 0, count, parent)[stones]
    return StoneTree((3 * stones[:, None] + np.arange(3)).ravel(), place[parents])


def _middle_of(links: Any, stone: int) -> int:
    """Return the stone in the middle of the longest way through a tree that has a stone."""
    # from there both halves are eliminated side by side, by steps that do not wait for each other
    end = breadth_first_order(links, stone, directed=False)[0][-1]
    order, before = breadth_first_order(links, end, directed=False)
    way = [int(order[-1])]
    while way[-1] != end:
        way.append(int(before[way[-1]]))
    return way[len(way) // 2]


@inlined_kernel
def add_joint_blocks(coupling, joint, stones, parent, blocks):  # type: ignore
    """Add the derivatives of a joint to the blocks of both its stones."""
    low, high = stones
    diagonal, right, below = blocks[0], blocks[1], blocks[2]
    child, is_low = min(low, high), low < high
    linked = parent[child] == max(low, high) if child < len(parent) else False
    for i in range(3):
        for k in range(3):
            place = 3 * i + k
            diagonal[low, i, k] += coupling[place, joint]
            diagonal[high, i, k] += coupling[place + 27, joint]
            if linked:
                across, back = coupling[place + 9, joint], coupling[place + 18, joint]
                right[child, i, k] += across if is_low else back
                below[child, i, k] += back if is_low else across


@inlined_kernel
def eliminate_stones(parent, blocks):  # type: ignore
    """Factorise the tangent: invert D, and store F; returns whether all of it is finite."""
    diagonal, right, below, factor = blocks[0], blocks[1], blocks[2], blocks[3]
    total = 0.0
    for i in range(len(parent)):
        d = diagonal[i]
        a, b, c = d[0, 0], d[0, 1], d[0, 2]
        p, q, r = d[1, 0], d[1, 1], d[1, 2]
        u, v, w = d[2, 0], d[2, 1], d[2, 2]
        x, y, z = q * w - r * v, r * u - p * w, p * v - q * u
        scale = 1.0 / (a * x + b * y + c * z)
        total += scale
        d[0, 0], d[0, 1], d[0, 2] = x * scale, (c * v - b * w) * scale, (b * r - c * q) * scale
        d[1, 0], d[1, 1], d[1, 2] = y * scale, (a * w - c * u) * scale, (c * p - a * r) * scale
        d[2, 0], d[2, 1], d[2, 2] = z * scale, (b * u - a * v) * scale, (a * q - b * p) * scale
        if parent[i] == len(parent):
            continue
        e, f, g, h = below[i], factor[i], right[i], diagonal[parent[i]]
        for k in range(3):
            f0 = e[k, 0] * d[0, 0] + e[k, 1] * d[1, 0] + e[k, 2] * d[2, 0]
            f1 = e[k, 0] * d[0, 1] + e[k, 1] * d[1, 1] + e[k, 2] * d[2, 1]
            f2 = e[k, 0] * d[0, 2] + e[k, 1] * d[1, 2] + e[k, 2] * d[2, 2]
            f[k, 0], f[k, 1], f[k, 2] = f0, f1, f2
            for m in range(3):
                h[k, m] -= f0 * g[0, m] + f1 * g[1, m] + f2 * g[2, m]
    return np.isfinite(total)


@inlined_kernel
def substitute_stones(parent, blocks, x):  # type: ignore
    """Solve with the factor, x in place of the right side."""
    count = len(parent)
    inverse, right, factor = blocks[0], blocks[1], blocks[3]
    for i in range(count):
        if parent[i] < count:
            f, k, m = factor[i], 3 * i, 3 * parent[i]
            a, b, c = x[k], x[k + 1], x[k + 2]
            x[m] -= f[0, 0] * a + f[0, 1] * b + f[0, 2] * c
            x[m + 1] -= f[1, 0] * a + f[1, 1] * b + f[1, 2] * c
            x[m + 2] -= f[2, 0] * a + f[2, 1] * b + f[2, 2] * c
    for i in range(count - 1, -1, -1):
        d, k = inverse[i], 3 * i
        a, b, c = x[k], x[k + 1], x[k + 2]
        if parent[i] < count:
            g, m = right[i], 3 * parent[i]
            p, q, r = x[m], x[m + 1], x[m + 2]
            a -= g[0, 0] * p + g[0, 1] * q + g[0, 2] * r
            b -= g[1, 0] * p + g[1, 1] * q + g[1, 2] * r
            c -= g[2, 0] * p + g[2, 1] * q + g[2, 2] * r
        x[k] = d[0, 0] * a + d[0, 1] * b + d[0, 2] * c
        x[k + 1] = d[1, 0] * a + d[1, 1] * b + d[1, 2] * c
        x[k + 2] = d[2, 0] * a + d[2, 1] * b + d[2, 2] * c
