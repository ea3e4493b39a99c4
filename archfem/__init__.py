"""archfem: does a dry-stone arch or bridge survive an earthquake?

    import archfem as af

    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    model = af.build(ring, fidelity="full", cells=(4, 4))
    dead = af.dead_load(model)
    run = af.time_history(model, af.Motion.read("file.AT2"), start=dead)

SI units throughout. N > 0 is compression, eccentricity > 0 toward the extrados, gravity along -y.

Eleven rooms, from left to right: `motion`, `masonry`, `joints`, `limit`, `models`, `statics`,
`dynamics`, `view`, `cases`, `studies`, `commands`. What is used most is here; `__init__.pyi` lists
it and says where it is defined. Everything is loaded when first used, so the masonry side
(structures, motions, limit analysis) works without FEniCSx and PETSc.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
