"""Many cases: points, what is asked of each, and what it is computed on; nothing found is lost.

    points      one case of a study: a case file and what differs from it
    over        full products, listed points, samples from distributions
    asking      one function from a case to findings
    finders     what can be found of a case, by name
    memory      models, damping and motions that a process remembers between points
    steppers    steppers that runs under many motions share
    warm        compiled code, loaded once a process
    worker      one point at a time, on one thread, and a row even where it fails
    nursery     the process from which workers are forked
    processes   points on processes of this machine
    cluster     points on a cluster: all that knows Dask
    store       rows of finished points, a file each
    table       the findings as one dataset, and its files
    progress    how far a study has come
    files       a study's file as tables
    study       `Study`: all of these together
    comparison  several cases side by side
    findings    what was found of one of them, and tables of all
    compared    cases side by side, carried out
    intensity   measures of a motion as it is scaled
    hunt        scales of one motion at which limit states are met
    ida         incremental dynamic analysis
    fragility   the probability of a limit state over intensity
    convergence what findings hang on besides the structure: mesh, step, quadrature, rung
    tradeoff    speed against error of a case, a point a setting
    stiffness   of dry joints, and what hangs on it
    pairs       pairs of a suite on processes
    slurm       the file of a job for SLURM

It imports from all rooms to its left. Start reading at `study`, then at `worker`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
