"""The mechanism of limit analysis: four hinges, pushed sideways."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
figure = af.view.draw_collapse(ring, af.collapse_factor(ring, live=af.BodyForce(1.0, 0.0)))
