"""`Channel`: one recorded component, as every reader hands it on."""

import re
from dataclasses import dataclass

from archfem.arrays import Array

_DOWN = re.compile(r"\b(DWN|DOWN|DN)\b|DWN$", re.IGNORECASE)
_VERTICAL = re.compile(r"\b(UP|UPDO|VERT|VERTICAL|V|VER|U-D|UD|Z|[A-Z]{2}Z)\b|UP$", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Channel:
    """One component of a record.

    Args:
        samples: accelerations (n,) [m/s²]; a vertical counts upwards.
        dt: time between samples [s].
        direction: what the file calls the component, e.g. `N-S`, `270`, `UP`.
        is_vertical: whether the component is the vertical one.
    """

    samples: Array
    dt: float
    direction: str = ""
    is_vertical: bool = False

    @classmethod
    def directed(cls, samples: Array, dt: float, direction: str) -> "Channel":
        """Return the channel of a file's samples; a vertical that counts downwards is turned up.

        Args:
            samples: accelerations (n,) [m/s²].
            dt: time between samples [s].
            direction: what the file calls the component; it tells whether this is a vertical.
        """
        name = direction.strip()
        if _DOWN.search(name):
            return cls(-samples, dt, f"{name}, turned up", True)
        return cls(samples, dt, name, bool(_VERTICAL.search(name)))
