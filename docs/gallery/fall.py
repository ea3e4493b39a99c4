"""A thin ring under a strong motion, from the first loose block (a) to the ground (d)."""

import archfem as af

ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.40, voussoirs=17)
analysis = af.Analysis(ring, fidelity="rigid", displacements="large", damping="effective")
figure = af.view.draw_fall(analysis.run(af.Motion.synthetic(duration=6.0, pga=9.0, seed=3)))
