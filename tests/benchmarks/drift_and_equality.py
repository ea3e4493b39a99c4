"""Energy by scheme, and how long two methods agree: random structures, motions of up to 2 g.

    python tests/benchmarks/drift_and_equality.py [--count 40] [--seed 0]

Rigid stones of `random_structures`, steps of 5 ms over 4 s. Average acceleration and HHT(-0.1) run
with joints that never slide, the conserving scheme with friction. The totals are runs that end
plainly, in doubt (energy drift of more than 5 % at any step) or refused (50 %), and the largest
drift of a finished run; then the time at which N of a joint differs by 1e-6 of the largest between
the method that "auto" selects and "snes".
"""

import logging
from collections import Counter
from collections.abc import Sequence

import numpy as np
from random_structures import structure
from scenes import with_friction
from setting import plain_options

import archfem as af
from archfem.dynamics.accuracy import peak_eccentricities
from archfem.dynamics.error_estimation import largest_difference

SCHEMES = {
    "conserving": af.dynamics.Conserving(),
    "average acceleration": af.dynamics.Newmark(),
    "HHT(-0.1)": af.HHT(-0.1),
}
DT = 0.005


def divergence(one: af.History, other: af.History) -> tuple[float, float]:
    """Compare two histories that should be equal.

    Returns:
        The time at which N of a joint first differs by a millionth of the largest N [s], infinite
        where it never does, and the difference of the largest |e| of a joint [-].
    """
    steps = min(len(one.time), len(other.time))
    forces = [run.joints["N"].values[:steps] for run in (one, other)]
    unequal = np.abs(forces[0] - forces[1]).max(axis=1) > 1e-6 * np.abs(forces[0]).max()
    until = float(one.time[np.argmax(unequal)]) if unequal.any() else np.inf
    return until, largest_difference(peak_eccentricities(one), peak_eccentricities(other))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the totals."""
    made = plain_options(__doc__)
    made.add_argument("--count", type=int, default=40)
    made.add_argument("--seed", type=int, default=0)
    chosen = made.parse_args(arguments)
    if chosen.quick:
        chosen.count, duration = 1, 0.3
    else:
        duration = 4.0
    logging.getLogger("archfem").setLevel(logging.CRITICAL)
    kinds: dict[str, Counter[str]] = {name: Counter() for name in SCHEMES}
    largest, equal = dict.fromkeys(SCHEMES, 0.0), []
    for seed in range(chosen.seed, chosen.seed + chosen.count):
        rng = np.random.default_rng(seed)
        built = structure(rng)
        pga, number = rng.uniform(0.5, 20.0), int(rng.integers(1000))
        motion = af.Motion.synthetic(duration=duration, pga=pga, seed=number)
        given = {
            "dt": DT,
            "damping": None if rng.random() < 0.3 else af.StiffnessDamping(0.05, 8.0),
            "record": af.Record(repeat=False),
        }
        for name, scheme in SCHEMES.items():
            model = af.build(
                built if name == "conserving" else with_friction(built, None), fidelity="rigid"
            )
            try:
                run = af.time_history(model, motion, scheme=scheme, **given)
            except af.DidNotConverge:
                kinds[name]["refused"] += 1
                continue
            drift = abs(float(run.dataset.attrs["energy_drift"]))
            kinds[name]["in doubt" if drift > 0.05 else "plain"] += 1
            largest[name] = max(largest[name], drift)
            if name == "conserving":
                other = af.time_history(model, motion, method="snes", **given)
                equal.append((given["damping"] is not None, *divergence(run, other)))
    for name, counts in kinds.items():
        print(f"{name}: {dict(counts)}, largest drift answered {largest[name]:.1e}")
    for damped in (True, False):
        own = [each for kind, *each in equal if kind is damped]
        print(
            f"methods, {'damped' if damped else 'undamped'}: {len(own)} pairs, "
            f"{sum(until == np.inf for until, _ in own)} the same to 1e-6; the others part from "
            f"{min((until for until, _ in own), default=np.inf):.2g} s on; the largest |e| of a "
            f"joint differs by {max((peaks for _, peaks in own), default=0.0):.1e} at most"
        )


if __name__ == "__main__":
    main()
