"""A model shaken: schemes, events, histories, scales, and which rung a scene needs.

    time_history  a whole run: from dead load to the end of the motion
    schemes       damping, and the scheme that steps
    damping       damping right at the effective modes
    impact        what a rocking block loses at impacts, and damping for a wanted loss
    steps         what passes between stepper and run: states, steps, batches
    stepping      the one stepper and its strategies
    compiling     all compiled code, compiled beforehand
    falling       loose rigid blocks: impacts, and the way to the ground
    collapse      from a structure that parts to what lies on the ground
    energy        the energy balance of a run
    guard         doubts about a run while it goes on
    glance        a quick look at joints at every step
    events        what ends a run: enough failed joints, or blocks that can move
    corners       displacements of the corners of blocks
    recorder      what a run leaves behind
    sentences     what a run means, in words
    history       the record of a run, and its file
    exports       what a run is written as for other programs
    series        runs as series of files: VTU and PVD, XDMF
    verdicts      when a run first meets a mechanism, by each definition
    scales        by what factor a motion must be multiplied for a mechanism
    collapse_scale  by what factor until the structure falls
    ladder        which rung, mesh and step a scene needs
    candidates    models that may be chosen, and finer ones to compare them with
    yardstick     what a model and its steps err by
    smallness     what it errs by to take displacements as small
    probe         what a short run tells of a model
    determined    how long a history is one, and not one of many
    tradeoff      speed against error over settings

It imports from `motion`, `statics` and what is left of it. Start reading at `time_history`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
