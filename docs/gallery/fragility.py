"""Fragility curves from an incremental dynamic analysis of eight motions."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
analysis = af.Analysis(ring, fidelity="rigid", damping="effective", dt=0.005)
motions = [af.Motion.synthetic(duration=4.0, pga=3.0, seed=seed) for seed in range(8)]
ida = af.ida(analysis, motions, precision=0.1, workers=1)
limits = ("first hinge", "verified")
figure = af.view.draw_fragility({limit: ida.fragility(limit, "pga") for limit in limits})
