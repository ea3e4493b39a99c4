"""Energy by scheme, and how long two steppers agree: random structures under motions of up to 2 g.

    python tests/benchmarks/drift_and_equality.py [--count 40] [--seed 0]

Of each of `random_structures`, with rigid stones, steps of 5 ms and 4 s: by average acceleration
and HHT(-0.1), whose joints never slide, and by the conserving scheme, how many end plain, in doubt
(energy drifts by more than 5 % at any step) or refused (50 %), and the largest drift that was
answered; and of "contact" against "compliance" when N of a joint differs by 1e-6 of the largest.
"""

import argparse
import logging
from collections import Counter
from dataclasses import replace

import numpy as np
from random_structures import structure

import archfem as af
from archfem.dynamics.determined import parted

SCHEMES = {
    "conserving": af.dynamics.Conserving(),
    "average acceleration": af.dynamics.Newmark(),
    "HHT(-0.1)": af.HHT(-0.1),
}
DT = 0.005


def held(built: af.Structure) -> af.Structure:
    """The same, whose joints never slide."""
    joints = tuple(
        replace(joint, contact=replace(joint.contact, friction=None)) for joint in built.joints
    )
    return replace(built, joints=joints)


def main() -> None:
    """Print the totals."""
    made = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    made.add_argument("--count", type=int, default=40)
    made.add_argument("--seed", type=int, default=0)
    asked = made.parse_args()
    logging.getLogger("archfem").setLevel(logging.CRITICAL)
    kinds: dict[str, Counter[str]] = {name: Counter() for name in SCHEMES}
    largest, equal = dict.fromkeys(SCHEMES, 0.0), []
    for seed in range(asked.seed, asked.seed + asked.count):
        rng = np.random.default_rng(seed)
        built = structure(rng)
        pga, number = rng.uniform(0.5, 20.0), int(rng.integers(1000))
        motion = af.Motion.synthetic(duration=4.0, pga=pga, seed=number)
        given = {
            "dt": DT,
            "damping": None if rng.random() < 0.3 else af.StiffnessDamping(0.05, 8.0),
        }
        for name, scheme in SCHEMES.items():
            model = af.build(built if name == "conserving" else held(built), fidelity="rigid")
            try:
                run = af.time_history(model, motion, scheme=scheme, method="contact", **given)
            except af.DidNotConverge:
                kinds[name]["refused"] += 1
                continue
            drift = abs(float(run.dataset.attrs["energy_drift"]))
            kinds[name]["in doubt" if drift > 0.05 else "plain"] += 1
            largest[name] = max(largest[name], drift)
            if name == "conserving":
                other = af.time_history(model, motion, method="compliance", **given)
                equal.append((given["damping"] is not None, parted(run, other)))
    for name, counts in kinds.items():
        print(f"{name}: {dict(counts)}, largest drift answered {largest[name]:.1e}")
    for damped in (True, False):
        own = [each for kind, each in equal if kind is damped]
        print(
            f"steppers, {'damped' if damped else 'undamped'}: {len(own)} pairs, "
            f"{sum(each.until == np.inf for each in own)} the same to 1e-6; the others part from "
            f"{min((each.until for each in own), default=np.inf):.2g} s on; the largest |e| of a "
            f"joint differs by {max((each.peaks for each in own), default=0.0):.1e} at most"
        )


if __name__ == "__main__":
    main()
