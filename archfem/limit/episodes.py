"""How long a mechanism lasts, and how far it opens: most close again before anything falls."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from archfem.errors import InvalidInput
from archfem.joints.criteria import failed, flagged
from archfem.joints.duration import step_lengths
from archfem.limit.counted import Mechanism
from archfem.units import mm


@dataclass(frozen=True)
class Episode:
    """The unbroken time for which the joints of a mechanism stay failed, all of them.

    Attributes:
        duration: of it [s]; a record lasts for the step that ends with it.
        opening: largest opening of any of its joints meanwhile [m]; None where that is not known.
        closes: whether it ends before the record does.
    """

    duration: float
    opening: float | None
    closes: bool

    def __str__(self) -> str:
        """How long, how far, and whether it closes again."""
        wide = "" if self.opening is None else f", opens by up to {self.opening / mm:.3g} mm"
        if self.closes:
            return f"it lasts {lasting(self.duration)}{wide} and closes again"
        return f"it lasts {lasting(self.duration)}{wide} and has not closed when the record ends"


def lasting(duration: float) -> str:
    """Return a duration in words, short ones in milliseconds.

    Args:
        duration: [s].
    """
    return f"{duration:.3g} s" if duration >= 1.0 else f"{1e3 * duration:.3g} ms"


def episode(joints: xr.Dataset, found: Mechanism) -> Episode:
    """Follow a mechanism from its instant on, for as long as its joints stay failed.

    Args:
        joints: over time and joint, as those in which it was found, with their flags.
        found: a mechanism with a time, by count or by motion.

    Returns:
        Its duration and opening.

    Raises:
        InvalidInput: the mechanism has no time, or one that was not recorded.
    """
    times = joints["time"].values
    start = np.flatnonzero(times == found.time)
    if not len(start):
        raise InvalidInput(
            f"the mechanism's time {found.time} is none of those recorded: give the joints in "
            "which it was found, over time"
        )
    places = joints["joint"].isin(list(found.joints))
    own = flagged(joints).isel(joint=np.flatnonzero(places.values), time=slice(int(start[0]), None))
    stays = failed(own).all("joint").values
    count = len(stays) if stays.all() else int(stays.argmin())
    after = int(start[0]) + count
    duration = float(step_lengths(times)[int(start[0]) : after].sum())
    opening = float(own["opening"][:count].max()) if "opening" in own else None
    return Episode(duration, opening, after < len(times))
