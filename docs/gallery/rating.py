"""A rating: (a) the factor of a vehicle at every place on a bridge, (b) the worst mechanism."""

import archfem as af

arch = af.shapes.Arch(span=5.0, rise=1.25, thickness=0.4, voussoirs=20)
walls = [
    af.shapes.Sidewall(length=2.0, height=1.0, state="fixed", name=f"{side} wall")
    for side in ("left", "right")
]
cover = af.shapes.Backfill(cover=0.3)
bridge = af.bridge(arches=[arch], sidewalls=walls, backfill=cover, width=3.0)
figure = af.rate(bridge, "LM1", fill=af.limit.Fill(friction_angle=35.0)).plot()
