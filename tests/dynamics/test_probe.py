"""What a model is judged by before it is chosen."""

import numpy as np
import pytest
from mechanisms import filled, piers

import archfem as af
from archfem.dynamics.probe import peaks, severe_motion, strongest, usual_damping


def test_the_error_of_a_model_is_measured_on_rings_and_piers():
    model = af.build(filled(), fidelity="rigid")
    motion = af.Motion(np.array([0.0, 1.0, 0.0]), dt=0.05)
    run = af.time_history(model, motion, dt=0.01)
    own = abs(run.joints["eccentricity"]).max("time").values
    found = peaks(model, motion, None, 0.01)
    assert found == pytest.approx(own[: len(piers(chords=1).joints)])


@pytest.mark.parametrize(
    ("peak", "length", "window"),
    [
        (10.0, 20.0, (6.0, 14.0)),
        (1.0, 20.0, (0.0, 8.0)),
        (19.0, 20.0, (12.0, 20.0)),
        (1, 5, (0, 5)),
    ],
)
def test_the_strongest_part_is_eight_seconds_about_the_peak(peak, length, window):
    """As far as the motion reaches; a push to either side counts, one upward does not."""
    dt = 0.01
    horizontal, vertical = np.full((2, round(length / dt) + 1), 0.01)
    horizontal[round(peak / dt)], vertical[0] = -3.0, 9.0
    found = strongest(af.Motion(horizontal, dt, vertical))
    begin, end = (round(each / dt) for each in window)
    assert found.horizontal == pytest.approx(horizontal[begin : end + 1])


@pytest.mark.parametrize(("slenderness", "known"), [(2.0, 0.4), (80.0, 0.02)])
def test_a_severe_motion_brings_the_thrust_near_the_edge(slenderness, known):
    """Of a block under a g, e = a H / (2 B): 0.4 at a = 0.8 B / H, but 2 % of g at least.

    Found by ten halvings of 2 g: to 2 g / 1024.
    """
    block = af.column(breadth=1.0, heights=[slenderness])
    found = severe_motion(af.build(block, fidelity="rigid"))
    assert found.pga / 9.81 == pytest.approx(known, abs=2.0 / 1024.0)
    assert known - found.pga / 9.81 >= 0.0  # the side that is not beyond
    again = af.Motion.synthetic(duration=8.0, pga=found.pga, seed=1)
    assert found.horizontal == pytest.approx(again.horizontal)


def test_usual_damping_is_five_per_cent_at_the_first_frequency():
    """Of a rigid block on a closed joint: sway and rocking by their two by two matrices."""
    breadth, height = 0.6, 2.4
    contact = af.Contact(1e9, 4e8)
    block = af.column(breadth=breadth, heights=[height], contact=contact)
    mass = 2e4 / 9.81 * breadth * height
    sway, arm = 4e8 * breadth, height / 2.0
    turning = 1e9 * breadth**3 / 12.0 + sway * arm**2
    stiffness = np.array([[sway, sway * arm], [sway * arm, turning]])
    inertia = np.diag([mass, mass * (breadth**2 + height**2) / 12.0])
    square = np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).min()
    found = usual_damping(af.build(block, fidelity="rigid"))
    assert found.ratio == 0.05
    assert found.frequency == pytest.approx(np.sqrt(square) / (2.0 * np.pi), rel=1e-9)
