"""The range of a verdict: residual displacement over each property, falls above the line."""

import archfem as af

thin = af.circular_arch(radius=2.95, thickness=0.40, embrace=159.0, voussoirs=17)
motion = af.Motion.synthetic(duration=8.0, pga=4.5, seed=3)
figure = af.verdict_range(thin, motion, workers=2).plot()
