"""Speed against error: fidelities, quadratures and time steps against a converged reference."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
motion = af.Motion.synthetic(duration=8.0, pga=1.7, seed=1)
damping = af.Rayleigh(0.05, (8.0, 16.0))
found = af.accuracy(ring, motion, damping=damping, cells=((4, 4),), steps=(0.005, 0.0025))
print(found.table())
figure = af.view.draw_accuracy(found)
