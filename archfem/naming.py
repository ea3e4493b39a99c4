"""Joints and blocks found by name or by number."""

import difflib
from collections.abc import Sequence

import xarray as xr

from archfem.errors import InvalidInput, InvalidStructure


def joint_number(names: Sequence[str], joint: str | int) -> int:
    """Number of a joint, given by its name or by that number.

    Args:
        names: of all joints, in order.
        joint: its name or number.

    Raises:
        InvalidInput: there is no such joint; the nearest name is suggested.
    """
    if isinstance(joint, str):
        if joint in names:
            return list(names).index(joint)
        near = difflib.get_close_matches(joint, names, 1, cutoff=0.0)
        raise InvalidInput(f"there is no joint '{joint}': did you mean '{near[0]}'?")
    if not 0 <= joint < len(names):
        raise InvalidInput(
            f"there is no joint {joint}: give a number from 0 to {len(names) - 1}, or a name "
            f"such as '{names[0]}'"
        )
    return int(joint)


def block_number(names: Sequence[str], block: str | int) -> int:
    """Number of a block, given by its name or by that number.

    Args:
        names: of all blocks, in order.
        block: its name or number.

    Raises:
        InvalidStructure: there is no such block; the nearest names are suggested.
    """
    if isinstance(block, str) and block in names:
        return list(names).index(block)
    if isinstance(block, int) and 0 <= block < len(names):
        return block
    near = difflib.get_close_matches(str(block), names, n=3) or [*names[:3], "…"]
    raise InvalidStructure(
        f"there is no block {block!r}: give a number below {len(names)}, or a name such as {near}"
    )


def one_joint(joints: xr.Dataset, joint: str | int) -> xr.Dataset:
    """What is known of one joint, over time where the joints are.

    Args:
        joints: as made by `joint_dataset`, all of them.
        joint: name or number.
    """
    names = [str(name) for name in joints["name"].values]
    return joints.isel(joint=joint_number(names, joint))
