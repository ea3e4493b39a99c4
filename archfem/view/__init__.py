"""Figures and films of structures and of results.

    circles      surveyed points against circles
    collapse     limit analysis, falls
    films        films, pictures and a viewer of moving structures
    histories    joints over time, envelopes
    joint_marks  thrust line, hinges, sliding and open joints at an instant
    motions      accelerograms and spectra
    pages        HTML pages: the player of a run, and documents that embed it
    positions    positions of blocks over a run
    sketch       outlines of a drawing as read, with overlaps and gaps
    springs      cells and springs of a model, forces of springs
    statics      dead load, mode shapes, free body, pushover
    stress       stress map
    structure    structures, joint names, loads, displaced shapes
    studies      studies, IDA, fragility, sensitivity, convergence, accuracy
    style        common style of all figures
    verdicts     verdicts over uncertain properties and scales

Imports all rooms before it. Start reading at `structure`, then at `style`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
