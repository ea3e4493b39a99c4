"""Ground motions: records, synthetic motions, spectra, spectral matching and suites.

    design_spectra          design spectra of codes
    ground_motion_models    peak ground acceleration from magnitude and distance
    matching                spectral matching by wavelets
    motion                  Motion: a ground acceleration
    record_selection        selection of records by the rules of codes
    records                 files of recorded ground motions, one module for each format
    hazard                  hazard curves of a site
    response_spectra        response spectra; PGA, Arias, CAV, duration
    signal_processing       filters, integration, baseline, resampling, artificial accelerograms
    suite                   Suite of motions

Imports the support modules only. Start reading at `motion`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
