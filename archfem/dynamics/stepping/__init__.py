"""Time stepping: one stepper, whose strategies give the history of equilibrium solves, faster.

`equation` is what is solved, `exact` solves it step by step by SNES, `stepper` takes many steps at
a time in the compiled `loop` by a strategy: `modal`, `banded` or `sparse`; `choice` says which.
Start reading at `stepper`, then `strategy` for what a further one has to provide.

    equation         of motion, and how time is discretised
    exact            every scheme, step by step by SNES
    stepper          many steps at a time by a strategy, by SNES what that gives up
    pace             steps of lengths of their own, as an error allows
    strategy         what a strategy has to provide
    choice           which strategy takes a run
    loop             the one compiled loop over steps
    newmark          the formulas of all schemes, compiled
    linear           a step of what is linear but for its joints, written at an instant
    passing          the same with the means over a step, of joints that open, close and slide
    joint_law        what joints do not carry at an instant, compiled
    path_law         the same on the mean of a step: what it knows and remembers
    path_forces      and what joints carry by it
    gap_rows         gaps of the joints from which all others follow
    small_problem    of the joint points that open or slide: what solves it
    open_points      its solution at an instant
    sliding_points   its solution over a step
    at_work          which of its rows those are
    newton_pass      of which this is one pass
    residuals        the solution of its equations where they are many
    compliance       that of the joints, and room for such problems
    columns          the part of it that they need
    chain            joints of a chain of blocks, and the band that they make
    chain_newton     the same solution in that band
    modal            the strategy in the modes of the closed structure
    banded           the strategy for chains of blocks, with a banded factor
    band             that factor
    sparse           the strategy for large structures, with one sparse factor
    tangent          the strategy for large structures that slide, with their sparse tangent
    tangent_newton   its passes
    tangent_pass     what each takes: rates of joints, and the tangent with them
    panels           that factor, dense block by dense block
    turning          the strategy for blocks that move as far as they like
    turning_newton   Newton's method for a step of theirs
    band_lu          its elimination in a band, with row exchanges
    panel_lu         its elimination in dense panels, condensed onto what joints move
    panel_solution   solutions by it
    elimination      the order in which its unknowns are eliminated
    sparse_rows      compiled products of matrices and vectors
"""

from archfem import compiled

compiled.prepare()
