"""How functions are compiled that only compute: that make no arrays, and return none.

Numba counts references to arrays wherever a function is given some or takes a part of one, by
operations that must not be interrupted: in small functions that takes longer than what they
compute. Where none is made there is nothing to count, and numba's option `_nrt` leaves it out; a
function that makes arrays nevertheless does not compile. Nor do divisions ask whether to raise.
"""

from typing import Any

import numba

_SETTINGS: Any = {"cache": True, "error_model": "numpy", "_nrt": False}

computing: Any = numba.njit(**_SETTINGS)
"""Compiles a function that makes no arrays."""

inlined: Any = numba.njit(**_SETTINGS, forceinline=True)
"""The same, as part of those that call it."""

summing: Any = numba.njit(**_SETTINGS, fastmath={"contract", "reassoc"})
"""Compiles one whose sums may be taken in any order, several terms at a time."""

viewing: Any = numba.njit(**_SETTINGS, inline="always")
"""Compiles one that returns parts of arrays it is given, as part of those that call it."""
