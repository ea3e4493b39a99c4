"""Kernels that were compiled beforehand are those that runs need."""

from types import SimpleNamespace

import numba.core.event as event
import numpy as np
import pytest

import archfem as af
from archfem.dynamics import State
from archfem.dynamics.separation import MeetingMonitor
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


def test_what_follows_a_run_with_large_displacements_is_compiled():
    """Stones of an arch are searched for meetings, and stiff joints compared with elastic ones."""
    compile_variant("newton, large displacements, chain of rigid stones")
    arch = af.circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=3)
    rigid, elastic = (
        af.build(arch, fidelity=each, displacements="large") for each in ("rigid", "condensed")
    )
    start = State(0.0, *np.zeros((3, rigid.size)))
    batch = SimpleNamespace(read=lambda observer: np.array([observer.read(start.q)] * 2))
    counting = Compilations()
    with event.install_listener("numba:compile", counting):
        # a negative tolerance, so that even blocks that have not moved are tested
        MeetingMonitor(rigid, start, tolerance=-1.0).find_first(batch)
        assert elastic.face_mismatch(np.zeros(elastic.size))[1]
    assert counting.count == 0


def test_a_kind_that_is_not_known_is_refused():
    with pytest.raises(af.InvalidInput, match="method 'band' does not exist"):
        compile_variant("band, Newmark")
