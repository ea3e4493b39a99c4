"""Kernels that were compiled beforehand are those that runs need."""

import numba.core.event as event
import numpy as np
import pytest

import archfem as af
from archfem.dynamics.warm_up import COMPILED_VARIANTS, compile_variant


class Compilations(event.Listener):
    """Counts functions that are compiled and not found on disk or in memory."""

    def __init__(self):
        self.count = 0

    def on_start(self, _):
        self.count += 1

    def on_end(self, _):
        pass


SMALL = [each for each in COMPILED_VARIANTS if "large" not in each]


@pytest.mark.parametrize(
    ("kind", "closure"), [*((kind, None) for kind in SMALL), ("newton, Conserving", 1e-4)]
)
def test_a_run_finds_every_kernel_compiled(kind, closure):
    """Another structure, at another fidelity, by another rule; also where joints stiffen."""
    compile_variant(kind)
    method, scheme = kind.split(", ")
    counting = Compilations()
    friction = None if scheme == "Newmark" else 0.6
    contact = af.Contact(1e9, 4e8, friction=friction, closure=closure)
    model = af.build(
        af.column(breadth=1.0, heights=[1.0, 1.0], contact=contact),
        fidelity="condensed" if closure else "faces",
        quadrature="nodal",
    )
    with event.install_listener("numba:compile", counting):
        af.time_history(
            model,
            af.Motion(np.full(9, 0.3), 0.01),
            dt=0.01,
            method=method,
            scheme=getattr(af.dynamics, scheme)(),
        )
    assert counting.count == 0


def test_a_kind_that_is_not_known_is_refused():
    with pytest.raises(af.InvalidInput, match="method 'band' does not exist"):
        compile_variant("band, Newmark")
