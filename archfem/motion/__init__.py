"""The ground: records of eight formats, synthetic motions, spectra, matching, suites.

    motion          `Motion`: a ground acceleration, read, cut, filtered, rotated and scaled
    averages        mean accelerations between instants
    signals         what is done to one sampled acceleration: integrals, filters, base line
    measures        intensity measures: peaks, Arias, CAV, Housner, duration
    oscillator      a damped oscillator under straight-line accelerations
    spectra         response spectra, and scaling to them
    design_spectra  spectra of codes and of the user
    newer_codes     spectra of NTC 2018, ASCE 7-22 and EN 1998-1-1:2024
    synthetic       artificial accelerograms from a seed
    matching        a motion matched to a design spectrum by wavelets
    suite           `Suite`: the motions of one study, matched and scaled alike
    records         files of recorded motions: a module for each format, found by content

It imports from the ground only, and nothing in it knows of stones. Start reading at `motion`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
