"""What a joint carries over a step: the law of `overlap` and the shear of `rubbing`, compiled.

Where faces stretch, points slide by s + x η, η how much longer the higher face has become than the
lower, and the forces that do the work on η are Σ x_i τ̄_i.

A point that slides one way when it is looked at, and the other way when next it is, has gone past
where it holds. Newton's method would go to and fro between both; so the rates of such a point are
those of one that holds, and what it would then carry more is told apart.
"""

import numpy as np

from archfem.joints.moving.compiled import inlined
from archfem.joints.moving.overlap import carried, lap, slope, stored
from archfem.joints.moving.rubbing import limits, rubbed


@inlined
def carry(faces, joint, ends, late, memory):  # type: ignore
    """Return what a joint carries over a step.

    Args:
        faces: `Faces`.
        joint: its number.
        ends: opening, slip and turn at the start, the same at the end, and the stretch at both.
        late: lag of damping over the length of the step [-].
        memory: how far each point has slid for good before; the same at the end, filled for this
            joint (p,) [m]; and which way each slid when last looked at, brought up to date (p,).

    Returns:
        Mean forces on opening, slip, turn and stretch [N, N, N m, N]; their derivatives by opening,
        slip and turn at the end, row by row; those of slip and of stretch by the stretch; the shear
        [N]; the energy that friction and the lag take [J]; and what of the forces on slip and on
        stretch is missing if points held that have turned round [N].
    """
    laps = lap(faces, joint, ends[0][1]), lap(faces, joint, ends[1][1])
    (l0, _), (l1, shrinks) = laps
    mean, half, tilts = 0.5 * (l0 + l1), 0.5 * shrinks, shrinks * ends[1][2]
    bounds = ends[0][0], ends[1][0], l0 * ends[0][2], l1 * ends[1][2]
    (total, moment, gap, place, square, lag), rubs = _summed(
        faces, joint, (bounds, ends), (mean, half, tilts, l1), late, memory
    )
    leans = place, -tilts * square, -l1 * square  # of the moment by the measures
    stiff = faces.normal[joint]
    scale = stiff * mean
    opens = scale * gap, stiff * (half * total - mean * tilts * place), -scale * l1 * place
    turns = (
        -scale * mean * leans[0],
        -scale * (mean * leans[1] + 2.0 * half * moment),
        -scale * mean * leans[2],
    )
    push, slides = _edge(faces, joint, ends, laps, (moment, leans))
    force = scale * total, push + rubs[0], -scale * mean * moment, rubs[1]
    slides = slides[0] + rubs[3], slides[1] + rubs[4], slides[2] + rubs[5]
    rates = opens, slides, turns, (rubs[6], rubs[7], rubs[8])
    told = rubs[0], rubs[2] + scale * lag, (rubs[11], rubs[12])
    return force, rates, (rubs[9], rubs[10]), told


@inlined
def _edge(faces, joint, ends, laps, known):  # type: ignore
    """Push of faces off their edges, of which less overlaps the further they slide; its rates."""
    if faces.paired[joint]:
        return 0.0, (0.0, 0.0, 0.0)
    ((g0, s0, t0), (g1, s1, t1), _), (first, last) = ends, laps
    (l0, _), (l1, shrinks), (moment, leans) = first, last, known
    mean, turn = 0.5 * (l0 + l1), 0.5 * (t0 + t1)
    before = stored(faces, joint, l0, g0, t0)[0]
    after, whole, tilted = stored(faces, joint, l1, g1, t1)
    way, bends = slope(s0, s1, first, last)
    push, stiff = 0.5 * (before + after) - mean * turn * moment, faces.normal[joint]
    by_opening = 0.5 * whole - mean * turn * leans[0]
    by_slip = -0.5 * shrinks * (t1 * tilted + turn * moment) - mean * turn * leans[1]
    by_turn = -0.5 * (l1 * tilted + mean * moment) - mean * turn * leans[2]
    by_slip = stiff * (way * by_slip + bends * push)
    return stiff * way * push, (stiff * way * by_opening, by_slip, stiff * way * by_turn)


@inlined
def _summed(faces, joint, ends, leaning, late, memory):  # type: ignore
    """Sums over the points of a joint: of what they press and its rates, and of what they rub."""
    (g0, g1, r0, r1), measures = ends
    total = moment = by_gap = by_place = by_square = lost = 0.0
    rubs = 13 * (0.0,)
    stride = 2 if faces.facets else 1
    for point in range(faces.first[joint], faces.first[joint + 1], stride):
        x0, x1 = faces.place[point], faces.place[point + stride - 1]
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        p, q, share = late * (b - a), late * (d - c), faces.share[point]
        lagged = a + p, c + q, b + p, d + q
        pressed = carried(lagged, late, faces.facets)
        (n0, n1), (k00, k01, k11) = pressed
        if late > 0.0:
            m0, m1 = carried((a, c, b, d), 0.0, faces.facets)[0]
            lost += share * ((n0 - m0) * (b - a) + (n1 - m1) * (d - c))
        near, far = k00 + k01, k01 + k11
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        by_gap += share * (near + far)
        by_place += share * (x0 * near + x1 * far)
        by_square += share * (x0 * x0 * k00 + 2.0 * x0 * x1 * k01 + x1 * x1 * k11)
        (near, far), (k00, k01, k11) = limits(faces, point, joint, pressed, lagged, late)
        held = near, k00 + k01, x0 * k00 + x1 * k01
        rubs = _rub(faces, point, (measures, late), (held, leaning), memory, rubs)
        if faces.facets:
            held = far, k01 + k11, x0 * k01 + x1 * k11
            rubs = _rub(faces, point + 1, (measures, late), (held, leaning), memory, rubs)
    return (total, moment, by_gap, by_place, by_square, lost), rubs


@inlined
def _rub(faces, point, step, known, memory, sums):  # type: ignore
    """Add the shear of a point to the sums of a joint; remember how far it slid, and which way."""
    (((_, s0, _), (_, s1, _), (e0, e1)), late), (slid, left, ways) = step, memory
    (limit, by_gap, by_place), (mean, half, tilts, length) = known
    stiff, place = faces.shear[point], faces.place[point]
    begin, now = s0 + place * e0, s1 + place * e1
    first, change = stiff * (begin - slid[point]), stiff * (now - begin)
    most = mean * limit if limit < np.inf else limit
    shear, over, by_change, by_limit, rubbing = rubbed(first, change, late, most)
    left[point] = slid[point] + over / stiff
    way, more = np.sign(over), 0.0
    if way * ways[point] < 0.0:
        by_change, by_limit, way = 0.5 + late, 0.0, 0.0
        more = first + by_change * change - shear
    ways[point] = way
    along = stiff * by_change
    a = b = c = 0.0
    if by_limit != 0.0:
        a, c = by_limit * mean * by_gap, -by_limit * mean * length * by_place
        b = by_limit * (half * limit - mean * tilts * by_place)
    return (
        sums[0] + shear,
        sums[1] + place * shear,
        sums[2] + rubbing / stiff,
        sums[3] + a,
        sums[4] + b + along,
        sums[5] + c,
        sums[6] + place * a,
        sums[7] + place * (b + along),
        sums[8] + place * c,
        sums[9] + place * along,
        sums[10] + place * place * along,
        sums[11] + more,
        sums[12] + place * more,
    )
