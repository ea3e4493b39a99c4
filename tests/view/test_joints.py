"""Pictures of structures side by side."""

import numpy as np
import pytest

from archfem.dynamics.ladder import build
from archfem.dynamics.schemes import Rayleigh
from archfem.dynamics.time_history import time_history
from archfem.errors import InvalidInput
from archfem.masonry.shapes import circular_arch
from archfem.motion.motion import Motion
from archfem.view.joints import draw_joint
from archfem.view.structure import draw_instants


@pytest.fixture(scope="module")
def runs():
    """A thick and a thin ring under one motion."""
    motion = Motion.synthetic(duration=2.0, pga=3.0, seed=1)
    rings = {
        name: circular_arch(radius=2.95, thickness=t, embrace=159.0, voussoirs=9)
        for name, t in {"thick": 0.6, "thin": 0.5}.items()
    }
    return {
        name: time_history(
            build(ring, fidelity="rigid"), motion, damping=Rayleigh(0.05, (8.0, 16.0))
        )
        for name, ring in rings.items()
    }


def test_structures_one_below_the_other(runs):
    states = {name: (run.structure, run.joints.isel(time=-1)) for name, run in runs.items()}
    figure = draw_instants({**states, "bare": (states["thin"][0], None)})
    assert [axes.get_title() for axes in figure.axes] == [
        "thick, t = 2.000 s",
        "thin, t = 2.000 s",
        "bare",
    ]
    lines = [[line.get_gid() for line in axes.lines] for axes in figure.axes]
    assert "thrust" in lines[0]
    assert "thrust" not in lines[2]


def test_one_joint_of_several_runs(runs):
    figure = draw_joint(runs, "joint 4")
    upper, lower = figure.axes[:2], figure.axes[2:]
    for axes, below, (name, run) in zip(upper, lower, runs.items(), strict=True):
        assert axes.get_title() == f"{name}: joint 4"
        own = run.joint(4)
        drawn = axes.lines[-1].get_ydata()
        assert np.nanmax(np.abs(drawn)) == pytest.approx(float(own["friction"].max()))
        assert below.lines[-1].get_ydata() == pytest.approx(own["eccentricity"].values, nan_ok=True)
    assert upper[0].get_ylim() == upper[1].get_ylim()
    with pytest.raises(InvalidInput, match="joint 44"):
        draw_joint(runs, "joint 44")
