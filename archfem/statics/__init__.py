"""A model at rest and about rest: dead load, pushover, modes, stress, free bodies.

    newton       one equilibrium solve
    attempts     what it is asked, and what comes of it
    snes         Newton's method by PETSc SNES
    superlu      the same by SciPy, where PETSc is not installed
    loading      loads that grow together
    lasting      equilibria that joints which dilate or break do not upset
    relaxation   a structure creeps to rest where Newton's method fails
    search       the next equilibrium, from the last one
    equilibrium  dead load and other loads that stay
    plausible    whether friction can hold what a dead load asks of it
    path         paths of equilibrium under a load that grows
    support_path the same under the dead load, over a support that moves
    pushover     a load grows until hardly anything resists
    following    how it goes from step to step
    ends         where that ends, and what is tried before it does
    eigen        the lowest vibrations of sparse matrices, by SLEPc
    dense_eigen  those of small ones by LAPACK, where SLEPc is not installed
    modes        vibrations about a state
    stress       principal stresses in the blocks
    strength     use of the blocks' strength
    freebody     one block cut free, and whether its forces balance

It imports from `models` and what is left of it. Start reading at `equilibrium`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
