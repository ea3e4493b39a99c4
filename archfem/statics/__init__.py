"""Static analyses: dead load, pushover, modes, stress and free bodies.

    assessed_mechanism    result of a kinematic assessment
    assessment_checks     rules of codes, capacity against demand
    continuation          load and displacement control
    equilibrium           equilibrium under dead load, plausibility checks
    fill_checks           fill in one piece or in coarse ones: what no soil does
    first_mechanism       mechanism of least factor at rest, fill as loads
    free_body             free-body diagram of a block
    mechanism_assessment  kinematic assessment against design spectra
    modes                 modes of vibration
    newton                Newton's method with fall-back line searches
    newton_iteration      Newton iterations on SciPy's sparse factors
    pushover              Pushover, stopping rules
    relaxation            pseudo-time relaxation, Tresca iteration, irreversible joints
    snes                  Newton iterations by PETSc SNES
    stress                principal stresses and strength use

Imports `models` and the rooms before it. Start reading at `equilibrium`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
