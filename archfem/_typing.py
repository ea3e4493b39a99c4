"""Type aliases: arrays, and numbers with the unit that a key of a case file has.

A field or argument with such an annotation declares its key: `Metres` reads 2.95 and "2.95 m"; with
None in place of the unit it is no key.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]  # of blocks, joints, points and the like
Flags = NDArray[np.bool_]

Metres = Annotated[float, "m"]
Seconds = Annotated[float, "s"]
Hertz = Annotated[float, "Hz"]
MetresPerSecondSquared = Annotated[float, "m/s**2"]
Newtons = Annotated[float, "N"]
NewtonsPerMetre = Annotated[float, "N/m"]
NewtonsPerCubicMetre = Annotated[float, "N/m**3"]
Pascals = Annotated[float, "Pa"]
PascalsPerMetre = Annotated[float, "Pa/m"]
Degrees = Annotated[float, "degree"]

# Angle that may keep its unit, "5 degree", where a bare 5 could be radians
Angle = Annotated[float | str, "degree"]


@dataclass(frozen=True)
class NumberOrWord:
    """Kind of a key that takes a number, or a word for None."""

    unit: str  # of the number
    word: str


# Coefficient of friction; a joint of "none" never slides
Friction = Annotated[float | None, NumberOrWord("1", "none")]

# Strength of the stones at joints, which do not crush with "none"
CrushingStrength = Annotated[float | None, NumberOrWord("Pa", "none")]
