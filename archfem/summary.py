"""What a run did to the joints, as a table of text."""

import numpy as np
import xarray as xr

from archfem.criteria import HINGE, envelope, first_time, hinged, longest_duration, opened, sliding


def joint_table(joints: xr.Dataset, dead: xr.Dataset | None = None, limit: float = HINGE) -> str:
    """One line a joint: envelope, and when and how long it hinged, slid and was open.

    Args:
        joints: over time and joint.
        dead: over joint, under dead load alone.
        limit: of |e| for a hinge [-].
    """
    span = envelope(joints)
    flags = {
        "hinge": hinged(joints, limit) != 0,
        "slide": sliding(joints),
        "open": opened(joints),
    }
    times = {
        key: list(zip(first_time(flag).values, longest_duration(flag).values, strict=True))
        for key, flag in flags.items()
    }
    head = ["joint", "e dead", "e min", "e max", "max V/N"]
    head += [f"{key} {what}" for key in flags for what in ("from", "for")]
    rows = []
    for k, name in enumerate(joints["name"].values):
        numbers = [span[key].values[k] for key in ("lowest", "highest", "friction")]
        rest = np.nan if dead is None else float(dead["eccentricity"][k])
        cells = [str(name), *(_number(x) for x in (rest, *numbers))]
        for key in flags:
            start, longest = times[key][k]
            cells += [_seconds(start), _seconds(longest) if longest > 0.0 else "-"]
        rows.append(cells)
    return aligned(head, rows)


def aligned(head: list[str], rows: list[list[str]]) -> str:
    """Columns of text, the first to the left, the others to the right."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [head, *rows]
    )


def _number(value: float) -> str:
    return "open" if np.isnan(value) else f"{value:.3f}"


def _seconds(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.3f} s"
