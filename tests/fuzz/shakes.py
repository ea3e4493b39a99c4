"""Random structures under random motions, displacements small and large."""

from pathlib import Path

from benchmarks.random_structures import Came as Shaken
from benchmarks.random_structures import tried

from archfem.dynamics.guard import WRONG
from fuzz.trial import ANSWERED, FOREIGN, NONSENSE, REFUSED, Came


def ready() -> None:
    """Load what is compiled."""
    tried(0, "small")


def trial(seed: int, number: int, folder: Path) -> Came:
    """Shake one."""
    del folder
    displacements = ("small", "large")[number % 2]
    told = f"benchmarks.random_structures.tried({1000 * seed + number}, {displacements!r})"
    came: Shaken = tried(1000 * seed + number, displacements)
    if came.kind == "FOREIGN":
        return Came(FOREIGN, came.words, told)
    if came.steps and not abs(came.drift) <= WRONG:
        return Came(NONSENSE, f"drift {came.drift:.0%}; {came.words}", told)
    return Came(ANSWERED if came.steps else REFUSED, came.words, told)
