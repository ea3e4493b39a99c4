"""Arrays over time as text in a page: whole numbers of a quantum, differences, deflate, base64.

Neighbours in time are alike, so that their differences are small whole numbers, which deflate packs
well: bytes of like weight stand together. A browser undoes it in a few lines.
"""

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array

NOTHING = -(2**29)
"""Stands for an undefined value (NaN)."""


@dataclass
class Pack:
    """Arrays that are being packed.

    Attributes:
        head: of each array its shape (series, samples) and its quantum, in the order of the bytes.
    """

    head: list[dict[str, Any]] = field(default_factory=list)
    _planes: list[bytes] = field(default_factory=list)

    def add(self, name: str, values: Array, quantum: float) -> None:
        """Add an array.

        Args:
            name: what to call it.
            values: (series, samples), undefined (NaN) where nothing is known.
            quantum: of which whole numbers are kept, in the unit of the values.
        """
        values = np.asarray(values, float)
        known = np.isfinite(values)
        whole = np.where(known, np.rint(np.where(known, values, 0.0) / quantum), NOTHING)
        steps = np.diff(whole.astype(np.int64), axis=1, prepend=0)
        folded = ((steps << 1) ^ (steps >> 63)).astype("<u4")  # 0, -1, 1, -2, … as 0, 1, 2, 3, …
        self._planes.append(folded.ravel().view(np.uint8).reshape(-1, 4).T.tobytes())
        self.head.append({"name": name, "shape": list(values.shape), "quantum": quantum})

    @property
    def text(self) -> str:
        """All arrays, as text."""
        return b64encode(zlib.compress(b"".join(self._planes), 6)).decode("ascii")


def quantum_of(values: Array, levels: int) -> float:
    """Return the quantum that splits the largest size of some values into so many levels.

    Args:
        values: of any shape.
        levels: at least 1.
    """
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return largest / levels or 1.0


def unpacked(head: list[Mapping[str, Any]], text: str) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a pack by name, as a page reads them.

    Args:
        head: as by `Pack.head`.
        text: as by `Pack.text`.
    """
    raw = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8)
    found, start = {}, 0
    for each in head:
        count = int(np.prod(each["shape"]))
        planes = raw[start : start + 4 * count].reshape(4, count)
        folded = np.ascontiguousarray(planes.T).view("<u4").reshape(each["shape"]).astype(np.int64)
        whole = np.cumsum((folded >> 1) ^ -(folded & 1), axis=1)
        found[each["name"]] = np.where(whole == NOTHING, np.nan, whole * each["quantum"])
        start += 4 * count
    return found
