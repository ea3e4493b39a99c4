"""The quick look at failed joints against the programme that decides."""

import numpy as np
import pytest
from mechanisms import WEIGHT, beside, filled, piers

import archfem as af


def random_state(structure, rng):
    """A few joints that hinge, slide or come apart."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint in rng.choice(len(structure.joints), rng.integers(2, 9), replace=False):
        what = rng.choice(5, p=[0.4, 0.4, 0.08, 0.08, 0.04])
        arm = 0.5 * WEIGHT * structure.joints[joint].depth
        resultants[joint] = [
            (WEIGHT, 0.0, arm),
            (WEIGHT, 0.0, -arm),
            (WEIGHT, 0.7 * WEIGHT, 0.0),
            (WEIGHT, -0.7 * WEIGHT, 0.0),
            (0.0, 0.0, 0.0),
        ][what]
    return af.joints.joint_dataset(structure, resultants)


@pytest.mark.parametrize("structure", [piers(chords=1), filled(), beside("side wall")], ids="abc")
def test_loops_rule_out_only_what_the_programme_rules_out(structure):
    """Two formulations: the cone of gaps that close every loop, and the programme in motions."""
    verifier, rng = af.limit.Verifier(structure), np.random.default_rng(1)
    agreed = {True: 0, False: 0}
    for _ in range(60):
        joints = random_state(structure, rng)
        moves = verifier.verified(joints).kind != "none"
        permitted = verifier.screen.permit(verifier.freedoms(joints))
        assert permitted or not moves
        agreed[moves] += permitted == moves
    assert agreed[True] > 10
    assert agreed[False] > 10
    assert sum(agreed.values()) >= 59  # hinges almost in a line are left to the programme
