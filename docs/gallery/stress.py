"""The larger principal compression in every cell of the stones."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
model = af.build(ring, fidelity="full", cells=(6, 6))
figure = af.view.draw_stress(model, af.dead_load(model).q)
