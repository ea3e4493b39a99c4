"""Where a pushover ends: the rules, and what is tried, and said, where no equilibrium is found."""

from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset
from archfem.statics.path import LoadPath
from archfem.statics.support_path import SupportPath

Path = LoadPath | SupportPath

CREEP, KNOWN = 0.05, 0.002
"""Growth of the load, of itself, under which a structure creeps on that is found no other way, and
that to which it is halved before giving up: so well is the limit known."""

TINY = np.finfo(float).tiny

CRAWL, HARDLY = 40, 0.01
"""Steps in which a path whose joints slide must go on, and the share of all its displacement by
which it must; others leave small steps behind, as about a hinge that moves on."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """When a pushover ends, whichever comes first.

    Attributes:
        slope: tangent of the curve relative to its initial tangent [-].
        displacement: of the loaded point, relative to the structure's size [-].
        hinges: number of hinged joints, or None not to count them.
        steps: number of steps.
    """

    slope: float = 1e-6
    displacement: float = 0.1
    hinges: int | None = None
    steps: int = 400

    def __post_init__(self) -> None:
        """Refuse what would stop at once, or never."""
        if not 0.0 <= self.slope < 1.0:
            raise InvalidInput(f"slope {self.slope:.3g} is not between 0 and 1")
        if not (self.displacement > 0.0 and self.steps >= 1):
            raise InvalidInput(
                f"displacement {self.displacement:.3g} and steps {self.steps} must be above 0"
            )


def finished(path: Path, stop: Stop, criteria: Criteria, moved: Array) -> str | None:
    """Return the rule that is met, in words, or None.

    Args:
        path: so far.
        stop: the rules.
        criteria: what makes a joint hinge.
        moved: displacement and factor of the last step, in units of the first (2,).
    """
    slope, reached = abs(float(moved[1] / moved[0])), float(path.displacements[-1])
    if slope <= stop.slope:
        return f"the slope fell to {slope:.2g} of the initial one"
    if path.factors[-1] <= 0.0 and path.units == "1":
        return "it bears no load any more"
    if reached >= stop.displacement * path.model.structure.size:
        return f"the {path.moving} moved by {reached:.3g} m"
    if stop.hinges is not None:
        joints = joint_dataset(path.model.structure, path.resisted[-1], criteria=criteria)
        count = int((joints["hinge"] != 0).sum())
        if count >= stop.hinges:
            return f"{count} joints hinge"
    if len(path.states) > CRAWL and _crawls(path) and sliding(path, criteria):
        return (
            f"it crawls: in {CRAWL} steps the {path.moving} moved by no more than {HARDLY:.0%} of "
            f"{reached:.3g} m, and the factor went no further than {path.factors[-1]:.5g}"
        )
    return f"{stop.steps} steps were taken" if len(path.states) > stop.steps else None


def _crawls(path: Path) -> bool:
    """Whether neither displacement nor factor goes on, although each step finds its state."""
    moved, factors = path.displacements[[-CRAWL, -1]], np.array(path.factors)[[-CRAWL, -1]]
    grown = abs(factors[1] - factors[0]) / max(abs(factors[1]), TINY)
    return bool(moved[1] - moved[0] <= HARDLY * moved[1] and grown <= KNOWN)


def crept(path: Path, stop: Stop, criteria: Criteria) -> str | None:
    """Let a structure whose joints slide creep on, and return the rule that ended it, if any did.

    Args:
        path: to which states are added.
        stop: the rules.
        criteria: what makes a joint hinge, and slide.

    Returns:
        The rule in words; None where the structure does not creep to rest any further.
    """
    if not (isinstance(path, LoadPath) and len(path.states) > 1 and sliding(path, criteria)):
        return None
    farthest, share = stop.displacement * path.model.structure.size, CREEP
    while share > KNOWN:
        if not path.creep(share * path.factors[-1], farthest):
            share /= 2.0
            continue
        last = np.array([path.displacements[-2:], path.factors[-2:]])
        moved = np.diff(last)[:, 0] / np.array(path.unit)
        if reason := finished(path, stop, criteria, moved):
            return reason
    return None


def sliding(path: Path, criteria: Criteria) -> list[str]:
    """Return the names of the joints that slide in the last state.

    Args:
        path: so far.
        criteria: what makes a joint slide.
    """
    joints = joint_dataset(path.model.structure, path.resisted[-1], criteria=criteria)
    return [str(name) for name in joints["name"].values[joints["slide"].values]]


def stuck(path: Path, control: str, criteria: Criteria) -> str:
    """Say that no further equilibrium was found, and what slides there.

    Args:
        path: that ended.
        control: by which it was followed; where the load was, it has reached its limit.
        criteria: what makes a joint slide.

    Returns:
        That in words.

    Raises:
        DidNotConverge: there is no equilibrium just after the dead load.
    """
    if len(path.states) == 1:
        raise DidNotConverge("no equilibrium just after the dead load: the structure hardly stands")
    slides = sliding(path, criteria) if isinstance(path, LoadPath) else []
    limit = control == "force" or (slides and control != "path")
    what = "the load cannot grow beyond" if limit else "no equilibrium was found past"
    words = f"{what} a factor of {path.factors[-1]:.5g}"
    if slides:
        words += f", at which {len(slides)} joints slide, such as '{slides[0]}'"
    if slides and any(block.grain for block in path.model.structure.blocks):
        words += "; pieces of fill flow where little holds them: cohesion does, or a wall"
    return words
