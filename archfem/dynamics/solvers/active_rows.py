"""The dense problem of a step in the active joint rows, by Newton's method.

With z the gaps of the rows, z̄ those if nothing were released, and F their compliance,

    z = z̄ + F λ(z).

A joint that slides lowers its shear as it opens, but does not open as it slides: λ is not the
gradient of an energy, and the problem is not symmetric. Iterations solve

    (1 - λ′ F) μ = λ(z̄ + F λ) - λ

for the correction μ of λ, by a dense factor where the rows are few. Else they take generalised
minimal residuals in single precision (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856):
an iteration only leads to the next one. Rows are active where joints open or slide, and where
openings press on those. They are predicted before the step, and checked at the gaps that result.
"""

import numpy as np

from archfem._numba import kernel, summing_kernel
from archfem.dynamics.solvers import joint_law
from archfem.dynamics.solvers.active_compliance import (
    MAX_KRYLOV_VECTORS,
    add_columns,
    add_gaps,
    multiply_rows,
    row_room,
    rows_of,
    update_columns,
)
from archfem.joints.large.point_law import shear_limit

# Equations up to which a problem is solved by its factor; at 100, steps of a wall that never slides
# take twice as long
MAX_DIRECT_ROWS = 48


@kernel
def predict_active_rows(law, active, work):  # type: ignore
    """Mark in `near` the rows that are active, or soon will be at the rates of the gaps."""
    near, marks, openings = active.near, active.marks, law.openings
    gap, before, force, ahead = work.gap, work.gap_before, work.force, work.spare
    joint_law.predict_gaps(law, gap, before)
    for row in range(len(gap)):
        near[row] = force[row] != 0.0
        # rows that were active, or open within the next two steps
        opens = row < openings and gap[row] + 2.0 * (gap[row] - before[row]) > 0.0
        marks[row] = near[row] or opens
        # the end of the path on which the law sees the gaps
        base = law.start[row] if law.gain > 0.0 else gap[row]
        ahead[row] = base + 2.0 * (law.guess[row] - base)
    for segment in law.segments:
        if marks[segment.near] or marks[segment.far]:
            near[segment.near] = near[segment.far] = True
    marks[: len(gap)] = False
    _add_active(law, active, ahead, near, True)
    _add_slips_near_limit(law, near)
    _add_pressing(law, near)


@kernel
def _add_slips_near_limit(law, near):  # type: ignore
    """Add slips of points whose shear exceeds half of Coulomb's limit, where joints may open."""
    for segment in law.segments:
        if not (near[segment.near] and near[segment.far]):
            continue
        for k in range(segment.begin, segment.end):
            point, state = law.points[k], law.point_states[k]
            limit = shear_limit(point, state.normal, state.area)
            if point.slip_row >= 0 and abs(state.shear) > 0.5 * limit:
                near[point.slip_row] = True


@kernel
def _add_pressing(law, near):  # type: ignore
    """Add openings at points of active slip rows, whose normal force sets Coulomb's limit there."""
    for k in range(len(law.points)):
        point = law.points[k]
        if point.slip_row >= 0 and near[point.slip_row]:
            segment = law.segments[point.segment]
            near[segment.near] = near[segment.far] = True


@kernel
def check_active_rows(law, active, gap, near):  # type: ignore
    """Return whether λ fits the gaps of the whole structure; adds rows that are active, too.

    λ of the rows fits the guess of their gaps: so these need only be equal, to ten times the
    tolerance of the iterations, as rounding of the whole structure adds to theirs.
    """
    guess, error = law.guess, 0.0
    for row in range(len(gap)):
        if near[row]:
            error = max(error, law.stiffness[row] * abs(gap[row] - guess[row]))
        guess[row] = gap[row]
    everywhere = error > 1e-11 * joint_law.largest_force(law, gap)
    return _add_active(law, active, gap, near, everywhere) and not everywhere


@kernel
def _add_active(law, active, gap, near, everywhere):  # type: ignore
    """Add rows that are active at some gaps; returns whether there are none.

    Evaluates all rows, or only those that are not near.
    """
    openings, more, count, slip_count = law.openings, False, 0, 0
    segments, slips = active.segments, active.slips
    for number in range(len(law.segments)):
        segment = law.segments[number]
        if everywhere or not (near[segment.near] and near[segment.far]):
            segments[count] = number
            count += 1
    for row in range(openings, len(near)):
        if everywhere or not near[row]:
            slips[slip_count] = row
            slip_count += 1
    joint_law.evaluate_openings(law, gap, segments[:count])
    joint_law.evaluate_slips(law, gap, slips[:slip_count])
    for number in segments[:count]:
        segment, state = law.segments[number], law.segment_states[number]
        if state.near != 0.0 or state.far != 0.0:
            more = more or not (near[segment.near] and near[segment.far])
            near[segment.near] = near[segment.far] = True
    for row in slips[:slip_count]:
        if law.slips[row - openings, 0] != 0.0:
            more = more or not near[row]
            near[row] = True
    _add_pressing(law, near)
    return not more


@kernel
def subtract_released(active, force, gap):  # type: ignore
    """Subtract the share of released forces from the gaps of the rows, z̄ = z - F λ."""
    for k in range(active.sizes[0]):
        active.force[k], active.gap[k] = force[active.numbers[k]], 0.0
    add_columns(active, active.force, 0)
    add_gaps(active, active.force, active.gap)
    for k in range(active.sizes[0]):
        gap[active.numbers[k]] -= active.gap[k]


@kernel
def solve_active_rows(law, start, active, force, tolerance):  # type: ignore
    """Solve for λ of the rows from the guess of their gaps; returns iterations, or -1."""
    count, own, iterations = active.sizes[0], active.numbers, -1
    inside, slip_count = _select_joints(law, active)
    selection = active.place, active.segments[:inside], active.slips[:slip_count]
    for full_steps in (4, 1):
        for k in range(count):
            # a second try restarts from the guess, with a line search from its begin
            if full_steps > 1:
                active.guess[k] = law.guess[own[k]]
            law.guess[own[k]] = active.guess[k]
            active.force[k], active.free[k] = force[own[k]], start[own[k]]
        iterations = _iterate(law, active, selection, tolerance, full_steps)
        if iterations > 0:
            break
    for k in range(count):
        force[own[k]] = active.force[k]
    return iterations


@kernel
def _select_joints(law, active):  # type: ignore
    """List the segments and the slip rows of a problem; returns how many there are of each."""
    place, inside, slip_count = active.place, 0, 0
    for number in range(len(law.segments)):
        if place[law.segments[number].near] >= 0 and place[law.segments[number].far] >= 0:
            active.segments[inside] = number
            inside += 1
    for k in range(active.sizes[0]):
        if active.numbers[k] >= law.openings:
            active.slips[slip_count] = active.numbers[k]
            slip_count += 1
    return inside, slip_count


@kernel
def _iterate(law, active, selection, tolerance, full_steps):  # type: ignore
    """Take Newton iterations from the guess; returns how many, or -1.

    The first residual is that of the gaps, later ones are those of λ. The equations serve again
    where the last iteration promises that they suffice for the next.
    """
    size, error, (places, values) = active.sizes[0], np.inf, active.derivatives
    force, released, change, gap = active.force, active.released, active.change, active.gap
    _evaluate(law, selection, released[:size])
    count = joint_law.collect_derivatives(law, selection, active.derivatives)
    update_columns(active, force, released, count)
    for k in range(size):
        force[k] = released[k]
        gap[k], change[k] = active.free[k] - law.guess[active.numbers[k]], 0.0
    prepare_equations(active, count)
    # right side λ′ (z̄ + F λ - z) of the first iteration
    add_gaps(active, released, gap)
    for k in range(count):
        change[places[k, 0]] += values[k] * gap[places[k, 1]]
    for iteration in range(1, 17):
        solve_equations(change, active, count)
        last, error = error, _take_correction(law, active, selection, iteration >= full_steps)
        if error <= tolerance or last <= error <= 10.0 * tolerance:
            return iteration
        if not error < np.inf:
            return -1
        add_columns(active, released, 0)
        if iteration == 1 or error**2 > last * tolerance:
            count = joint_law.collect_derivatives(law, selection, active.derivatives)
            add_columns(active, released, count)
            prepare_equations(active, count)
        for k in range(size):
            change[k] = released[k] - force[k]
    return -1


@kernel
def _take_correction(law, active, selection, search):  # type: ignore
    """Add the correction to λ, or with a line search a share of it; returns the residual [N]."""
    size, share, square, change = active.sizes[0], 1.0, 0.0, active.change
    force, released, before, trial = active.force, active.released, active.before, active.trial
    for k in range(size):
        before[k] = released[k]
        square += (released[k] - force[k]) ** 2
    while True:
        for k in range(size):
            trial[k], active.gap[k] = force[k] + share * change[k], active.free[k]
            # points that would reverse their slip are held: no derivative sees where they stick
            if before[k] * trial[k] < 0.0:
                trial[k] = 0.0
        add_gaps(active, trial, active.gap)
        for k in range(size):
            law.guess[active.numbers[k]] = active.gap[k]
        _evaluate(law, selection, released[:size])
        error, now = 0.0, 0.0
        for k in range(size):
            off = abs(released[k] - trial[k])
            now += off**2
            if not off <= error:  # also where it is not a number
                error = off
        # the square of the residual has to fall by a tenth with a whole correction
        if not search or share <= 1.0 / 32.0 or now <= (1.0 - 0.1 * share) * square:
            for k in range(size):
                force[k] = trial[k]
            return error
        share *= 0.5


@kernel
def _evaluate(law, selection, released):  # type: ignore
    """Evaluate λ of the rows at the guess of their gaps."""
    joint_law.evaluate_openings(law, law.guess, selection[1])
    joint_law.evaluate_slips(law, law.guess, selection[2])
    joint_law.collect_released(law, selection, released)


@kernel
def prepare_equations(active, count):  # type: ignore
    """Fill the equations 1 - λ′ F of the columns, and factorise them where they are few."""
    active.sizes[3] = size = active.sizes[1]
    if size <= MAX_DIRECT_ROWS:
        _factorise_equations(active, count)
    else:
        _fill_equations(active, count, rows_of(active.single, size, row_room(size)))


@kernel
def _factorise_equations(active, count):  # type: ignore
    """Factorise 1 - λ′ F of the columns."""
    size = active.sizes[3]
    matrix = rows_of(active.matrix, size, size)
    _fill_equations(active, count, matrix)
    factorise_dense(matrix, active.pivots)


@summing_kernel
def _fill_equations(active, count, matrix):  # type: ignore
    """Fill the matrix 1 - λ′ F of the columns."""
    (places, values), (size, wide), entry = active.derivatives, matrix.shape, 0
    entries = rows_of(active.entries, active.sizes[0], active.sizes[2])
    for i in range(size):
        for k in range(wide):
            matrix[i, k] = 0.0
        matrix[i, i] = 1.0
    while entry < count:
        row, value = places[entry, 0], values[entry]
        own, other = matrix[active.column_of[row]], entries[places[entry, 1]]
        entry += 1
        # two derivatives of the same force at a time: its row is loaded once for both
        if entry < count and places[entry, 0] == row:
            second, further = values[entry], entries[places[entry, 1]]
            for k in range(wide):
                own[k] -= value * other[k] + second * further[k]
            entry += 1
        else:
            for k in range(wide):
                own[k] -= value * other[k]


@kernel
def solve_equations(change, active, count):  # type: ignore
    """Solve (1 - λ′ F) μ = d in place; in rows without an equation μ is d."""
    size, own = active.sizes[3], active.column
    for k in range(size):
        own[k] = change[active.row_of[k]]
    direct = size <= MAX_DIRECT_ROWS
    if not (direct or minimise_residual(active, own[:size])):
        _factorise_equations(active, count)
        direct = True
    if direct:
        solve_dense(rows_of(active.matrix, size, size), active.pivots, own)
    for k in range(size):
        change[active.row_of[k]] = own[k]


@kernel
def factorise_dense(matrix, pivots):  # type: ignore
    """Factorise a matrix in place; faster than LAPACK up to some tens of rows.

    Solutions with the factor of a singular matrix are not numbers.
    """
    size = len(matrix)
    for k in range(size):
        # partial pivoting: the largest entry of the column moves to the diagonal
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if best != k:
            for j in range(size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        scale = 1.0 / matrix[k, k] if matrix[k, k] != 0.0 else np.nan
        # elimination of the column below; the diagonal stores the inverse pivot
        top = matrix[k][k + 1 :]
        for i in range(k + 1, size):
            factor, row = scale * matrix[i, k], matrix[i][k + 1 :]
            matrix[i, k] = factor
            for j in range(len(top)):
                row[j] -= factor * top[j]
        matrix[k, k] = scale


@summing_kernel
def solve_dense(matrix, pivots, right):  # type: ignore
    """Solve in place by the factor of `factorise_dense`."""
    size = len(matrix)
    # forward substitution with the row exchanges, then back substitution
    for k in range(size):
        best = pivots[k]
        right[k], right[best] = right[best], right[k]
    for k in range(size):
        total = right[k]
        for j in range(k):
            total -= matrix[k, j] * right[j]
        right[k] = total
    for k in range(size - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, size):
            total -= matrix[k, j] * right[j]
        right[k] = total * matrix[k, k]


@summing_kernel
def minimise_residual(active, right):  # type: ignore
    """Solve in place by minimal residuals; returns False if that takes too many products."""
    size, square_sum, basis = len(right), 0.0, active.basis
    rotations, triangle, wide = active.rotations, active.triangle, row_room(size)
    matrix = rows_of(active.single, size, wide)
    for k in range(size):
        square_sum += right[k] ** 2
    rotations[0, 2] = first = np.sqrt(square_sum)
    if first == 0.0:
        return True
    for k in range(size):
        basis[0, k] = right[k] / first
    for k in range(size, wide):
        basis[0, k] = 0.0
    for step in range(MAX_KRYLOV_VECTORS):
        # Arnoldi: the next vector of the basis, orthogonal to all before
        multiply_rows(matrix, basis[step][:wide], basis[step + 1][:size])
        for k in range(size, wide):
            basis[step + 1, k] = 0.0
        norm = _orthogonalise(basis, step + 1, wide, triangle[step])
        _rotate(triangle[step], step, norm, rotations)
        # the next Newton iteration takes up what remains
        if abs(rotations[step + 1, 2]) <= 3e-4 * first:
            _combine(basis, step + 1, active, right)
            return True
    return False


@summing_kernel
def _orthogonalise(basis, number, size, shares):  # type: ignore
    """Subtract from a vector its components along those before it, and scale it; its norm."""
    # modified Gram-Schmidt: one vector after another, which rounds less than all at once
    own, square_sum, zero = basis[number], 0.0, np.float32(0.0)
    for j in range(number):
        other, share = basis[j], zero
        for k in range(size):
            share += other[k] * own[k]
        shares[j] = share
        for k in range(size):
            own[k] -= share * other[k]
    for k in range(size):
        square_sum += own[k] * own[k]
    norm = np.sqrt(square_sum)
    inverse = np.float32(1.0 / norm if norm > 0.0 else 0.0)
    for k in range(size):
        own[k] *= inverse
    return norm


@kernel
def _rotate(column, step, norm, rotations):  # type: ignore
    """Bring a column of the Hessenberg matrix into a triangle by Givens rotations."""
    # rotations of the columns before, then one that makes the entry below the diagonal zero
    for j in range(step):
        above, cosine, sine = column[j], rotations[j, 0], rotations[j, 1]
        column[j] = cosine * above + sine * column[j + 1]
        column[j + 1] = cosine * column[j + 1] - sine * above
    length = np.sqrt(column[step] ** 2 + norm**2)
    cosine, sine = column[step] / length, norm / length
    rotations[step, 0], rotations[step, 1], column[step] = cosine, sine, length
    rotations[step + 1, 2] = -sine * rotations[step, 2]
    rotations[step, 2] *= cosine


@summing_kernel
def _combine(basis, count, active, right):  # type: ignore
    """Combine the vectors of the basis by back substitution in the triangle."""
    triangle, rotations = active.triangle, active.rotations
    right[:] = 0.0
    for step in range(count - 1, -1, -1):
        rotations[step, 2] /= triangle[step, step]
        for j in range(step):
            rotations[j, 2] -= rotations[step, 2] * triangle[step, j]
        own = basis[step]
        for k in range(len(right)):
            right[k] += rotations[step, 2] * own[k]
