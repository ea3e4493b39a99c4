"""Cost of joints that stiffen as they close, beside that of linear joints of one k_n.

    python tests/benchmarks/closing_law.py [--only ring] [--steps 200] [--threshold 0.3]

The README's ring under 8 s of a synthetic motion, in small and large displacements, then all scenes
of `scenes.py`. Joints of stones have k_n δ_m = p_0 of 0.3 MPa, the least of
`tests/validation/closing_arch.csv`. Times of a step are of the processor: both laws run by turns in
one process, and the least counts. Evaluations of the joints in a step say how much of the ratio is
Newton's.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scenes import Scene, all_scenes, ring
from setting import plain_options
from stepping import SteppedRun
from timing import table

import archfem as af


def with_threshold(structure: af.Structure, threshold: float) -> af.Structure:
    """Return a structure whose joints of stones close by the law, with a given k_n δ_m [Pa]."""
    stone, joints = af.masonry.STONE_TO_STONE.name, []
    for joint in structure.joints:
        contact = joint.contact
        if contact.name == stone:
            contact = replace(contact, closure=threshold / contact.normal_stiffness)
        joints.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints))


@dataclass(frozen=True, kw_only=True)
class ClosingScene(Scene):
    """A scene with joints that close by the law."""

    threshold: float

    @property
    def structure(self) -> af.Structure:
        """Build the structure."""
        return with_threshold(super().structure, self.threshold)


def ring_history(displacements: Any, dt: float, threshold: float | None, duration: float) -> Any:
    """Return a function that shakes the ring."""
    structure = ring() if threshold is None else with_threshold(ring(), threshold)
    model = af.build(structure, fidelity="rigid", displacements=displacements)
    motion = af.Motion.synthetic(duration=duration, pga=6.0, seed=3)
    settings = {"start": af.dead_load(model), "damping": af.StiffnessDamping(0.05, 8.0), "dt": dt}
    settings["record"] = af.Record(repeat=False)
    return lambda: af.time_history(model, motion, **settings)


def row(name: str, calls: Sequence[Callable[[], af.History]], repeat: int) -> list[object]:
    """Time steps of the linear and of the closing law by turns."""
    try:
        runs = [SteppedRun(call) for call in calls]
    except af.ArchfemError as error:
        return [name, "", "", "", "", f"{type(error).__name__}: {str(error)[:60]}"]
    times = [float("inf")] * 2
    for _ in range(repeat):
        times = [min(least, run.time_steps(1).cpu) for least, run in zip(times, runs, strict=True)]
    evaluations = [f"{run.iterations:.2f}" for run in runs]
    found = [*(f"{1e3 * each:.0f}" for each in times), f"{times[1] / times[0]:.2f}"]
    fallbacks = f", {runs[1].fallbacks} by SNES" if runs[1].fallbacks else ""
    return [name, *found, " / ".join(evaluations), runs[1].method + fallbacks]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each setting."""
    parser = plain_options(__doc__)
    parser.add_argument("--only", nargs="+", default=[""], help="texts that names contain")
    parser.add_argument("--steps", type=int, help="time steps of each scene")
    parser.add_argument("--threshold", type=float, default=0.3, help="k_n times closure [MPa]")
    parser.add_argument("--repeat", type=int, default=3, help="turns, of which the least counts")
    chosen = parser.parse_args(arguments)
    logging.disable(logging.WARNING)
    threshold, rows = 1e6 * chosen.threshold, []
    settings = [(kind, dt) for kind in ("small", "large") for dt in (0.002, 0.001)]
    scenes = all_scenes()
    if chosen.quick:
        settings, scenes, chosen.steps, chosen.repeat = settings[:1], scenes[:1], 20, 1
    cases: dict[str, Callable[[], list[Callable[[], af.History]]]] = {}
    for kind, dt in settings:
        cases[f"README's ring, {kind}, {1e3 * dt:g} ms"] = lambda kind=kind, dt=dt: [
            ring_history(kind, dt, each, 0.25 if chosen.quick else 8.0)
            for each in (None, threshold)
        ]
    for scene in scenes:
        closing = ClosingScene(**vars(scene), threshold=threshold)
        cases[f"{scene.group}: {scene.name}"] = lambda pair=(scene, closing): [
            lambda each=each: each.history(chosen.steps or each.step_count, "auto") for each in pair
        ]
    for name, calls in cases.items():
        if all(text in name for text in chosen.only):
            rows.append(row(name, calls(), chosen.repeat))
            print(*rows[-1], sep=" | ", flush=True)
    head = ["scene", "linear [µs]", "closing [µs]", "ratio", "evaluations", "method"]
    print(table(head, rows))


if __name__ == "__main__":
    main()
