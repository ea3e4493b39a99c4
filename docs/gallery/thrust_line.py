"""The thrust line of a ring under its own weight, at joints that open over part of their depth."""

import archfem as af

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
dead = af.dead_load(af.build(ring, fidelity="full", cells=(4, 4)))
figure = af.view.draw_structure(ring, dead.joints)
