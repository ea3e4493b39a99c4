"""Units of acceleration, as headers of records and users write them."""

import re

from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY

# The order matters: the longer unit is tried first and blotted out before the next is looked for.
_UNITS = (
    (r"mm\s*/\s*s(?:ec|n)?(?:\s*/\s*s(?:ec|n)?|\s*(?:\^|\*\*)?\s*2|²)", 1e-3),
    (r"cm\s*/\s*s(?:ec|n)?(?:\s*/\s*s(?:ec|n)?|\s*(?:\^|\*\*)?\s*2|²)", 1e-2),
    (r"\bgals?\b", 1e-2),
    (r"\bm\s*/\s*s(?:ec|n)?(?:\s*/\s*s(?:ec|n)?|\s*(?:\^|\*\*)?\s*2|²)", 1.0),
    (r"units?\s*(?:of|:|=|in)?\s*\(?g\b|[(\[]\s*g\s*[)\]]|\bin\s+g\b", STANDARD_GRAVITY),
)
_NAMES = {"g": STANDARD_GRAVITY, "m/s2": 1.0, "cm/s2": 1e-2, "gal": 1e-2, "mm/s2": 1e-3}


def unit_named(name: str) -> float:
    """Return a unit of acceleration given by keyword [m/s²].

    Args:
        name: g, m/s2, cm/s2, gal or mm/s2.

    Raises:
        InvalidInput: it is not one of g, m/s2, cm/s2, gal, mm/s2.
    """
    key = str(name).lower().replace("²", "2").replace("^", "").replace(" ", "")
    if key not in _NAMES:
        raise InvalidInput(f"units {name!r} are unknown: use one of {', '.join(_NAMES)}")
    return _NAMES[key]


def units_written(header: str) -> set[float]:
    """Return the units of acceleration that a header mentions [m/s²].

    Args:
        header: lines of the header.
    """
    found = set()
    for pattern, unit in _UNITS:
        header, count = re.subn(pattern, " ", header, flags=re.IGNORECASE)
        if count:
            found.add(unit)
    return found
