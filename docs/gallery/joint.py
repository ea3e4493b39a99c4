"""One joint over time: (a) friction and (b) eccentricity."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
analysis = af.Analysis(ring, fidelity="full", cells=(4, 4), damping="effective")
run = analysis.run(af.Motion.synthetic(duration=6.0, pga=6.0, seed=3))
figure = af.view.draw_joint({"this run": run}, "joint 6")
