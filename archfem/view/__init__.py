"""Figures and films of structures and of results.

    collapse     limit analysis and falls
    films        films, still pictures and a viewer of moving structures
    histories    joints over time, envelopes
    joint_marks  hinges, thrust line, slips at an instant
    motions      accelerograms and spectra
    pages        HTML pages: the player of a run, and documents that embed it
    positions    positions of blocks and joint ends over a run
    statics      dead load, stress, modes, free body, pushover
    stress       stress map
    structure    a structure, its names, loads, displaced shape
    studies      study factors, IDA, fragility, tornado, convergence, accuracy
    style        one look for all figures

Imports all rooms before it. Start reading at `structure`, then at `style`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
