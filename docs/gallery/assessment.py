"""A kinematic assessment: (a) mechanism, (b) capacity curve and the demand of a spectrum."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
site = af.motion.Ntc2018(ag=0.25, f0=2.4, tc_star=0.32, site="B")
figure = af.kinematic_assessment(ring, site).plot()
