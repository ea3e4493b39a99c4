"""Solvers of a time step: "snes" by PETSc; "newton" and "compliance", compiled, give its results.

`equation` is the equation of motion; `snes` solves it step by step. `integrator` takes many steps
at a time in the compiled loop of `base` by one of two solvers, which `selection` selects by a rule.
SNES takes the steps at which they fail.

    equation           equation of motion, its damping and time discretisation
    snes               every scheme, step by step by PETSc's SNES
    integrator         batches of steps by a solver, with fall-back to SNES or shorter steps
    adaptive           steps of a length that an error controls
    selection          rule that selects a solver
    base               protocol of a solver, and the compiled loop over steps
    newmark            formulas of all schemes
    joint_law          gaps of the joints, and forces released as they open and slide
    linear_step        step of a structure that is linear but for its joints
    newton             solver "newton": Newton's method on all coordinates
    compliance         solver "compliance": one sparse factor, and unknowns in active joint rows
    active_rows        their dense problem
    active_compliance  its compliance and workspace
    supernodal_lu      sparse factors in dense panels
    sparse_products    products of sparse matrices

Symbols, which all of them share:

    w           contact displacement, at which the equation of a step is written [m, rad]
    z, row      gaps z = G w + z₀; a row is an opening of a point, or the slip of a segment [m]
    λ, λ′       released forces of the rows, the elastic forces of closed joints less the actual
                ones [N], and their derivative by z [N/m]
    F           compliance of the rows, F = G (K + μ M + ν R)⁻¹ Gᵀ [m/N]
    active      row that is open or slides, so that its λ is not zero
    column      active row that has a number in the dense problem of a step
    image       product of the state with one of the matrices M, K and R
"""
