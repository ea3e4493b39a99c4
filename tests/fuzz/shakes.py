"""Random structures under random motions, displacements small and large."""

import runpy
import sys
from pathlib import Path

from fuzz.trial import ANSWERED, FOREIGN, NONSENSE, REFUSED, Came

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "random_structures.py"
sys.path.insert(0, str(SCRIPT.parent))  # for the modules beside it
tried = runpy.run_path(str(SCRIPT))["tried"]
sys.path.remove(str(SCRIPT.parent))


def ready() -> None:
    """Load the compiled kernels."""
    tried(0, "small")


def trial(seed: int, number: int, folder: Path) -> Came:
    """Shake one."""
    del folder
    displacements = ("small", "large")[number % 2]
    call_text = f"{SCRIPT.name}: tried({1000 * seed + number}, {displacements!r})"
    came = tried(1000 * seed + number, displacements)
    if came.kind == "FOREIGN":
        return Came(FOREIGN, came.words, call_text)
    if came.steps and not abs(came.drift) <= 0.5:  # the monitor ends a run above
        return Came(NONSENSE, f"drift {came.drift:.0%}; {came.words}", call_text)
    return Came(ANSWERED if came.steps else REFUSED, came.words, call_text)
