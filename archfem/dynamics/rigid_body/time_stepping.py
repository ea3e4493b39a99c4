"""Moreau-Jean time stepping of free rigid blocks with impacts and friction, until they rest.

H has the rows of normal and tangential relative velocity at the contacts found at the middle of the
step, q + ½ Δt v. With θ = ½,

    M (v₁ - v₀) = Δt p + Hᵀ P,   0 <= u_N1 + e u_N0 ⊥ P_N >= 0,   q₁ = q₀ + ½ Δt (v₀ + v₁),

|P_T| <= μ P_N + Δt c A with A half of the common area at each point of two faces. P_T opposes u_T1
where that is not zero (Moreau, in: Nonsmooth Mechanics and Applications, 1988; Jean, Comput.
Methods Appl. Mech. Eng. 177 (1999) 235). Sweeps over the faces, each with both of its points at
once, solve for the impulses P, from those of the step before. They have momentum with restart
(Nesterov, Soviet Math. Dokl. 27 (1983) 372; O'Donoghue and Candès, Found. Comput. Math. 15 (2015)
715), and end once no contact violates its conditions by more than a stated speed. Rebounds are
reduced where they would add energy. Overlaps are corrected in positions. Points that would pass
each other by the end of the step are contacts too, except beside faces with a rocking ratio. There
a couple C between the two blocks, the same on both, bounds the rate at which the old end opens:

    0 <= C ⊥ r |Δu_N0| - Δu_N1 >= 0   with Δu_N the difference of u_N at both ends.

Its work -C Δu_N1 is therefore never positive.
"""

from typing import NamedTuple

import numpy as np

from archfem._numba import allocating_entry, entry, kernel
from archfem._typing import Array
from archfem.dynamics.rigid_body import contact_detection

# Residual of settled impulses: speed by which a contact violates its condition, relative to that
# which a body gains by its weight in a step [-]
SETTLED = 1e-3

# Largest number of sweeps over the contacts of a step, for each hundred stones begun; the
# residual is corrected in later steps. Fewer save nothing in large walls: impulses that are cut off
# are a bad start of the next steps. A wall of 405 stones that slides takes up to 2400.
MAX_SWEEPS = 1000

# Energy that a run should not gain beyond the work of the ground, over the energy exchanged [-]
MAX_ENERGY_GAIN = 1e-4


class StepParameters(NamedTuple):
    """Parameters of all steps."""

    dt: float  # Δt [s]
    gravity: float  # downward [m/s²]
    foresight: float  # time by which contacts are foreseen, half a step or none [s]
    restitution: float  # e [-]
    min_impact_speed: float  # speed of approach below which e is zero [m/s]
    min_rocking_speed: float  # the same for the speed ratio of a rocking block [m/s]
    max_sweeps: int  # over the contacts of a step
    tolerance: float  # on the residual of the impulses, a speed [m/s]
    energy_noise: float  # that a run without exchange of energy may gain [J]


class SweepResult(NamedTuple):
    """Velocities and impulses after a sweep."""

    speeds: Array  # (b + 1, 3)
    impulse: Array  # (c, 3)


class StepWorkspace(NamedTuple):
    """Workspace of the time steps."""

    world: contact_detection.PlacedPieces
    contacts: contact_detection.Contacts
    stored: contact_detection.StoredImpulses
    middle: Array  # poses at the middle of the step (b, 3)
    # of each contact: cross products of the arms with the normal, first and second body, and with
    # the tangent; 1/(H M⁻¹ Hᵀ) of normal and tangent; target u_N and u_T; μ; coupling of u_N with
    # the impulse of the next contact, if of the same face; rebound in the target u_N; H M⁻¹ Hᵀ of
    # normal and tangent; 1/determinant of the normal equations of a face, zero for none; limit of
    # the tangential impulse by cohesion; of a face with a rocking ratio that closes, its length, as
    # the arm of the rate at which it opens, zero for none, and the bound of that rate (c, 17)
    rows: Array
    speeds: Array  # velocities during the sweeps, the ground's last (b + 1, 3)
    last: SweepResult  # of the sweep before
    rebounding: SweepResult  # with rebound


@allocating_entry
def advance_steps(bodies, parameters, workspace, state):  # type: ignore
    """Advance poses and velocities by steps, with their energies.

    Returns the deepest overlap, and whether there are too many contacts.
    """
    q, v, ground, energy, settling = state
    contacts, overlap = workspace.contacts, 0.0
    for k in range(len(ground)):
        before = q.copy()
        # once a quarter of the admissible energy is gained, impulses settle until they add none
        admissible = MAX_ENERGY_GAIN * energy[6] + parameters.energy_noise
        strict = energy[5] - energy[3] > 0.25 * admissible
        state_of_step = q, v, ground[k], strict
        touching, sweeps, residual = take_step(bodies, parameters, workspace, state_of_step)
        for j in range(touching):
            overlap = max(overlap, -contacts.gap[j])
        if touching < 0:
            return overlap, True
        settling[0] = max(settling[0], residual)
        settling[1] += residual > parameters.tolerance
        settling[2] += 1.0
        settling[3] += sweeps
        kinetic = kinetic_energy(bodies, v)
        rise, work = _exchange(bodies, parameters, q - before, ground[k])
        # the loss is the rest of the balance
        lost = energy[3] + work - rise - (kinetic - energy[0])
        energy[0] = kinetic
        if _separate(bodies, parameters, workspace, touching):
            # what lifts the blocks is taken from the strain energy of compressed joints, from the
            # losses of the step, and from a small share of all energy exchanged
            moved = workspace.speeds[: len(q)]
            lift, push = _exchange(bodies, parameters, moved, ground[k])
            available = max(lost - energy[5] + 0.05 * MAX_ENERGY_GAIN * energy[6], 0.0)
            available += energy[7]
            factor = min(1.0, available / (lift - push)) if lift > push else 1.0
            q += factor * moved
            rise, work = rise + factor * lift, work + factor * push
            strain = min(max(factor * (lift - push), 0.0), energy[7])
            energy[7] -= strain
            lost -= factor * (lift - push) - strain
        energy[1] += rise
        energy[2] += work
        energy[3] = lost
        # a loss below its maximum is energy gained
        energy[5] = max(energy[5], lost)
        energy[4] = max(energy[4], energy[5] - lost)
        energy[6] = max(energy[6], kinetic + lost)
    return overlap, False


@kernel
def _exchange(bodies, parameters, moved, ground):  # type: ignore
    """Return the rise of potential energy by displacements, and the work of inertia forces [J]."""
    rise, work = 0.0, 0.0
    for b in range(len(moved)):
        mass = bodies.mass[b, 0]
        rise += mass * parameters.gravity * moved[b, 1]
        work -= mass * (ground[0] * moved[b, 0] + ground[1] * moved[b, 1])
    return rise, work


@entry
def kinetic_energy(bodies, v):  # type: ignore
    """Return the kinetic energy of all bodies [J]."""
    kinetic = 0.0
    for b in range(len(v)):
        m, inertia = bodies.mass[b]
        kinetic += 0.5 * m * (v[b, 0] ** 2 + v[b, 1] ** 2) + 0.5 * inertia * v[b, 2] ** 2
    return kinetic


@allocating_entry
def take_step(bodies, parameters, workspace, state):  # type: ignore
    """Advance by one step; return the contacts, -1 for too many, the sweeps and the residual."""
    contacts, middle, speeds = workspace.contacts, workspace.middle, workspace.speeds
    q, v, ground, strict = state
    touching, rebounds = _begin_step(bodies, parameters, workspace, (q, v, ground))
    if touching < 0:
        return -1, -1, 0.0
    # impulses that add energy settle further: up to 40 times as many sweeps
    tolerance, sweeps = parameters.tolerance, 0
    for _ in range(40):
        more, residual = _settle_impulses(
            bodies, workspace, touching, tolerance, parameters.max_sweeps
        )
        sweeps += more
        work, kinetic = _impulse_work(bodies, parameters, v, speeds, ground)
        if work <= (0.0 if strict else 1e-5 * kinetic) or rebounds:
            break
        if residual <= tolerance:
            if not strict or tolerance <= 1e-3 * parameters.tolerance:
                break
            tolerance *= 0.1
    if rebounds and work > 0.0:
        more, residual = _limit_rebounds(bodies, parameters, workspace, touching, (v, ground))
        sweeps += more
    contact_detection.store_impulses(bodies, middle, contacts, touching, workspace.stored)
    # trapezoidal rule for the poses
    q += 0.5 * parameters.dt * (v + speeds[: len(q)])
    v[:] = speeds[: len(q)]
    return touching, sweeps, residual


@allocating_entry
def _begin_step(bodies, parameters, workspace, state):  # type: ignore
    """Find contacts, and velocities with the impulses of the step before; return rebounds too."""
    q, v, ground = state
    contacts, middle, speeds = workspace.contacts, workspace.middle, workspace.speeds
    # contacts at the middle of the step, with the impulses of the step before
    half, count = 0.5 * parameters.dt, len(q)
    middle[:] = q + half * v
    contact_detection.place_pieces(bodies, middle, workspace.world)
    # contacts and targets follow from the velocities before the step, hence first
    speeds[:count] = v
    speeds[count] = 0.0
    motion = middle, speeds, parameters.foresight
    touching = contact_detection.find_contacts(bodies, workspace.world, contacts, motion)
    if touching < 0:
        return -1, False
    contact_detection.restore_impulses(bodies, middle, contacts, touching, workspace.stored)
    contact_detection.prepare_rows(bodies, parameters, workspace, touching)
    rebounds = _add_rebounds(bodies, parameters, workspace, touching)
    # free velocities: inertia forces of the ground motion, and weight
    for b in range(count):
        if bodies.inverse_mass[b, 0] > 0.0:
            speeds[b, 0] -= parameters.dt * ground[0]
            speeds[b, 1] -= parameters.dt * (parameters.gravity + ground[1])
    contact_detection.apply_initial_impulses(bodies, workspace, touching)
    return touching, rebounds


@allocating_entry
def _limit_rebounds(bodies, parameters, workspace, touching, step):  # type: ignore
    """Reduce all rebounds by one factor, so that the impulses of the step add no energy."""
    contacts, speeds, rows = workspace.contacts, workspace.speeds, workspace.rows
    rebounding, (before, ground) = workspace.rebounding, step
    rebounding.speeds[:] = speeds
    rebounding.impulse[:touching] = contacts.impulse[:touching]
    rows[:touching, 6] -= rows[:touching, 10]
    sweeps, residual = _settle_impulses(
        bodies, workspace, touching, parameters.tolerance, parameters.max_sweeps
    )
    # The work is quadratic in the factor, not positive without rebounds and positive with all of
    # them. Impulses between those two are admissible too, since cones of friction are convex.
    least, _ = _impulse_work(bodies, parameters, before, speeds, ground)
    most, _ = _impulse_work(bodies, parameters, before, rebounding.speeds, ground)
    mean = 0.5 * (speeds + rebounding.speeds)
    middle, _ = _impulse_work(bodies, parameters, before, mean, ground)
    curvature = 2.0 * (least + most - 2.0 * middle)
    slope = most - least - curvature
    factor = 0.0
    if least < 0.0:
        factor = -2.0 * least / (slope + np.sqrt(slope**2 - 4.0 * curvature * least))
    speeds += factor * (rebounding.speeds - speeds)
    impulse = contacts.impulse[:touching]
    impulse += factor * (rebounding.impulse[:touching] - impulse)
    return sweeps, residual


@allocating_entry
def _separate(bodies, parameters, workspace, touching):  # type: ignore
    """Find displacements that reduce overlaps; return whether there are any, in `speeds`.

    They are the least, weighted by mass, that undo overlaps beyond the admissible one and cause no
    others. No velocity changes.
    """
    contacts, speeds, rows = workspace.contacts, workspace.speeds, workspace.rows
    deepest, half = 0.0, 0.5 * parameters.dt
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        speed = contact_detection.relative_speed(speeds, (a, b), (nx, ny), (rows[k, 0], rows[k, 1]))
        excess = -bodies.slop - (contacts.gap[k] + half * speed)
        deepest = max(deepest, excess)
        # the displacement of the contact, and no friction
        rows[k, 6] = excess
        rows[k, 7] = rows[k, 8] = rows[k, 14] = rows[k, 15] = 0.0
    if deepest <= 0.0:
        return False
    speeds[:] = 0.0
    contacts.impulse[:touching] = 0.0
    _settle_impulses(bodies, workspace, touching, 0.1 * bodies.slop, 50)
    return True


@kernel
def _add_rebounds(bodies, parameters, workspace, touching):  # type: ignore
    """Add the rebounds of impacts to the target velocities; return whether there are any.

    Newton's law applies to each contact. Where a face closes at one end, its other end opens by
    the given share of the speed at which the face has turned: the impulse is distributed over
    the face, with its resultant within the closing end. It opens no faster than that either.
    """
    contacts, rows, speeds = workspace.contacts, workspace.rows, workspace.speeds
    any_rebound = False
    for k in range(touching):
        rows[k, 10] = rows[k, 15] = 0.0
    for k in range(touching):
        a, b = contacts.bodies[k]
        normal = contacts.normal[k, 0], contacts.normal[k, 1]
        speed = contact_detection.relative_speed(speeds, (a, b), normal, (rows[k, 0], rows[k, 1]))
        ratio = bodies.rocking[a, b]
        is_end = k > 0 and contact_detection.has_partner(contacts, k - 1, touching)
        if ratio == 0.0 or not (is_end or contact_detection.has_partner(contacts, k, touching)):
            # a point still apart rebounds where it would cross by the end of the step
            closing = 2.0 * contacts.gap[k] / parameters.dt
            closing = closing if contacts.gap[k] > bodies.contact_gap else 0.0
            if parameters.restitution > 0.0 and speed < -max(closing, parameters.min_impact_speed):
                rows[k, 10] = closing - parameters.restitution * speed
        elif not is_end:
            other = contact_detection.relative_speed(
                speeds, (a, b), normal, (rows[k + 1, 0], rows[k + 1, 1])
            )
            # the speed common to both ends rebounds by Newton's law
            if max(speed, other) < -parameters.min_impact_speed:
                rows[k, 10] = rows[k + 1, 10] = -parameters.restitution * max(speed, other)
            if min(speed, other) < -parameters.min_rocking_speed:
                opening, closing = (k, k + 1) if speed > other else (k + 1, k)
                rows[k, 16] = ratio * abs(other - speed)
                rows[k, 15] = rows[opening, 1] - rows[closing, 1]
                rows[opening, 10] += rows[k, 16]
    for k in range(touching):
        rows[k, 6] += rows[k, 10]
        any_rebound = any_rebound or rows[k, 10] > 0.0
    return any_rebound


@kernel
def _impulse_work(bodies, parameters, before, after, ground):  # type: ignore
    """Return the work of the impulses of a step, and the kinetic energy after it [J]."""
    work = kinetic = 0.0
    for b in range(len(before)):
        m, inertia = bodies.mass[b]
        if bodies.inverse_mass[b, 0] == 0.0:
            continue
        # impulse m (v₁ - v₀ + Δt a) times the mean velocity
        (x0, y0, w0), (x1, y1, w1) = before[b], after[b]
        along = x1 - x0 + parameters.dt * ground[0]
        up = y1 - y0 + parameters.dt * (parameters.gravity + ground[1])
        work += 0.5 * m * (along * (x0 + x1) + up * (y0 + y1)) + 0.5 * inertia * (w1**2 - w0**2)
        kinetic += 0.5 * m * (x1**2 + y1**2) + 0.5 * inertia * w1**2
    return work, kinetic


@allocating_entry
def _settle_impulses(bodies, workspace, touching, tolerance, max_sweeps):  # type: ignore
    """Sweep with momentum until impulses settle; return the sweeps and the residual [m/s]."""
    contacts, speeds = workspace.contacts, workspace.speeds
    last = workspace.last
    last.speeds[:] = speeds
    last.impulse[:touching] = contacts.impulse[:touching]
    weight, least, residual = 1.0, np.inf, 0.0
    for sweep in range(1, max_sweeps + 1):
        residual = _sweep_contacts(bodies, workspace, touching)
        if residual <= tolerance:
            residual = contact_detection.measure_residual(bodies, workspace, touching)
            if residual <= tolerance:
                return sweep, residual
        # Momentum that diverges is dropped. Residuals of faces that open or slide rise for a few
        # sweeps: restarts at four times the least cost walls up to twice as many sweeps.
        if residual > 10.0 * least:
            weight, least = 1.0, residual
        least = min(least, residual)
        before, weight = weight, 0.5 + np.sqrt(0.25 + weight**2)
        _add_momentum(workspace, touching, (before - 1.0) / weight)
    speeds[:] = last.speeds
    contacts.impulse[:touching] = last.impulse[:touching]
    return max_sweeps, contact_detection.measure_residual(bodies, workspace, touching)


@kernel
def _add_momentum(workspace, touching, share):  # type: ignore
    """Continue the change between two sweeps by a share of it (Nesterov)."""
    speeds, impulse, last = workspace.speeds, workspace.contacts.impulse, workspace.last
    # velocities are linear in the impulses, and need no pass over the contacts
    for b in range(len(speeds)):
        for axis in range(3):
            new = speeds[b, axis]
            speeds[b, axis] += share * (new - last.speeds[b, axis])
            last.speeds[b, axis] = new
    for k in range(touching):
        for axis in range(3):
            new = impulse[k, axis]
            impulse[k, axis] += share * (new - last.impulse[k, axis])
            last.impulse[k, axis] = new


@kernel
def _sweep_contacts(bodies, workspace, touching):  # type: ignore
    """Sweep once over the faces; return the largest violation of a contact found [m/s]."""
    # single elements are read, since views of rows cost more than the arithmetic
    contacts, speeds, rows = workspace.contacts, workspace.speeds, workspace.rows
    pairs, normals, impulse = contacts.bodies, contacts.normal, contacts.impulse
    inverse_mass = bodies.inverse_mass
    worst, k = 0.0, 0
    while k < touching:
        a, b, nx, ny = pairs[k, 0], pairs[k, 1], normals[k, 0], normals[k, 1]
        ma, ia = inverse_mass[a, 0], inverse_mass[a, 1]
        mb, ib = inverse_mass[b, 0], inverse_mass[b, 1]
        wa, wb = speeds[a, 2], speeds[b, 2]
        # relative velocity, normal and tangential
        x, y = speeds[b, 0] - speeds[a, 0], speeds[b, 1] - speeds[a, 1]
        along, across = y * nx - x * ny, x * nx + y * ny
        # normal impulses, projected on P_N >= 0, of the two points of a face at once
        old = impulse[k, 0]
        gap = across + rows[k, 1] * wb - rows[k, 0] * wa - rows[k, 6]
        new = max(old - rows[k, 4] * gap, 0.0)
        worst = max(worst, abs(new - old) * rows[k, 11])
        end, normal = k + 1, 0.0
        if rows[k, 13] > 0.0:
            end, old2 = k + 2, impulse[k + 1, 0]
            gap2 = across + rows[k + 1, 1] * wb - rows[k + 1, 0] * wa - rows[k + 1, 6]
            new2 = max(old2 - rows[k + 1, 4] * gap2, 0.0)
            worst = max(worst, abs(new2 - old2) * rows[k + 1, 11])
            inverse = rows[k, 11], rows[k + 1, 11], rows[k, 9], rows[k, 13]
            new, new2 = contact_detection.solve_face(inverse, (old, old2), (gap, gap2))
            impulse[k + 1, 0] = new2
            normal = new2 - old2
            wa -= ia * rows[k + 1, 0] * normal
            wb += ib * rows[k + 1, 1] * normal
        impulse[k, 0] = new
        wa -= ia * rows[k, 0] * (new - old)
        wb += ib * rows[k, 1] * (new - old)
        normal += new - old
        # tangential impulses, projected on the friction cone of the new normal impulse
        tangential, wa, wb, worst = _sweep_friction(
            rows, impulse, (k, end), (along, wa, wb, worst), (ma + mb, ia, ib)
        )
        px, py = normal * nx - tangential * ny, normal * ny + tangential * nx
        speeds[a, 0], speeds[a, 1] = speeds[a, 0] - ma * px, speeds[a, 1] - ma * py
        speeds[b, 0], speeds[b, 1] = speeds[b, 0] + mb * px, speeds[b, 1] + mb * py
        speeds[a, 2], speeds[b, 2] = wa, wb
        k = end
    return worst


@kernel
def _sweep_friction(rows, impulse, points, speeds, inverse_mass):  # type: ignore
    """Solve for friction of a face and its couple; return the change, both spins, and the slip."""
    (along, wa, wb, worst), (m, ia, ib) = speeds, inverse_mass
    total = 0.0
    for j in range(points[0], points[1]):
        old, limit = impulse[j, 1], rows[j, 8] * impulse[j, 0] + rows[j, 14]
        # the impulse that stops the slip, at most the limit by friction and cohesion; then
        # velocities with its change
        slip = along + rows[j, 3] * wb - rows[j, 2] * wa - rows[j, 7]
        change = min(max(old - rows[j, 5] * slip, -limit), limit) - old
        worst = max(worst, abs(change) * rows[j, 12])
        impulse[j, 1] = old + change
        along += m * change
        wa -= ia * rows[j, 2] * change
        wb += ib * rows[j, 3] * change
        total += change
    if rows[points[0], 15] != 0.0:
        wa, wb, worst = _sweep_couple(rows, impulse, points[0], (wa, wb, worst), (ia, ib))
    return total, wa, wb, worst


@kernel
def _sweep_couple(rows, impulse, k, speeds, inverse_inertia):  # type: ignore
    """Solve for the couple of a face that opens too fast; return both spins, and its excess."""
    (wa, wb, worst), (ia, ib) = speeds, inverse_inertia
    arm, old = rows[k, 15], impulse[k, 2]
    inverse = arm * arm * (ia + ib)
    # a pair of forces at both ends, projected on C >= 0
    change = max(old + (arm * (wb - wa) - rows[k, 16]) / inverse, 0.0) - old
    impulse[k, 2] = old + change
    return wa + ia * arm * change, wb - ib * arm * change, max(worst, abs(change) * inverse)
