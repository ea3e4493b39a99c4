"""Time stepping: one stepper, whose strategies give the history of equilibrium solves, faster.

`equation` is what is solved, `exact` solves it step by step by SNES, `stepper` takes many steps at
a time in the compiled `loop` by a strategy: `modal`, `banded` or `sparse`; `choice` says which.
Start reading at `stepper`, then `strategy` for what a further one has to provide.
"""
