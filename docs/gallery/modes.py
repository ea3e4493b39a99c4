"""Modes about the dead load, with the effective mass of each."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
model = af.build(ring, fidelity="rigid")
figure = af.view.draw_modes(af.modes(model, 4, af.dead_load(model)))
