"""Dynamic analyses: time histories, damping, events, motion scaling and falls.

    accuracy          processor time against error over settings
    analysis          Analysis: all of an analysis but the ground motion
    collapse_state    stands, dislocated, partly fallen or fallen, from positions
    damping           damping from effective modes or restitution
    error_estimation  a-posteriori error of model, time step and small displacements
    events            events that end a run
    export            VTU, PVD and XDMF series of a run
    fall              fall of loose blocks, from their release to rest
    history           History, its file, first mechanisms
    loose_fill        fill that falls: grains in place of its bodies
    model_selection   build, and selection of a model by predicted error
    monitor           energy balance and validity checks of a run
    motion_scaling    scale of a motion at first mechanism or collapse
    recorder          Record, recording of a run
    rigid_body        free rigid blocks with impacts and friction
    scale_search      search of scales: runs, brackets, next scale
    schemes           time integration schemes, Rayleigh and stiffness damping
    separation        joints that let go, stones that meet, blocks that overturn
    slip_error        error of the slip of joints in time stepping
    solvers           solvers of a time step: newton, compliance, snes
    state             State, Step, Batch
    time_history      time_history, last_state
    verdict           outcome, doubts, displacements and mechanisms of a run
    verdict_range     verdicts over uncertain properties
    warm_up           compilation of all kernels ahead of time
    walls_across      walls across their plane as one rigid body

Imports `motion`, `statics` and the rooms before them. Start reading at `analysis`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
