"""Datasets in NetCDF files that are sealed, so that a damaged one is known before it is read.

A file ends with the digest of all that stands before it, which readers of NetCDF pass over. It is
made in memory and written in one stroke: where the disk is full, the error is that of the disk.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import netCDF4
import xarray as xr

from archfem.errors import InvalidInput
from archfem.files import content_of, in_one_stroke

SEAL = b"\narchfem: SHA-256 of all before this line "
"""Stands before the digest, at the end of a file."""

SEALED = "sealed"
"""Attribute of a dataset whose file has a seal, which tells where it is cut off."""

LARGEST = 2**40
"""Bytes of a file: there is no other limit than the disk's."""


def write_dataset(
    dataset: xr.Dataset, path: Path, encoding: Mapping[Any, Any] = MappingProxyType({})
) -> Path:
    """Write a dataset in one stroke: a killed run leaves the old file or the new one.

    Args:
        dataset: to be kept.
        path: the file; folders are made.
        encoding: of its variables, as xarray takes it.

    Returns:
        The file.
    """
    made = netCDF4.Dataset(path.name, "w", memory=1)
    try:
        store = xr.backends.NetCDF4DataStore(made)  # type: ignore[no-untyped-call]
        dataset.assign_attrs({SEALED: 1}).dump_to_store(store, encoding=dict(encoding))
    finally:
        content = bytes(made.close())
    with in_one_stroke(path) as draft:
        draft.write_bytes(content + SEAL + _digest(content))
    return path


def read_dataset(path: str | Path, what: str) -> xr.Dataset:
    """Return what is in a NetCDF file, which is read once, seal and all.

    Args:
        path: the file; one of an earlier version has no seal.
        what: it should be, for errors: "history file".

    Raises:
        InvalidInput: there is no such file, it is damaged, or something else.
    """
    content = content_of(path, what, LARGEST)
    before, seal, digest = content.rpartition(SEAL)
    damaged = InvalidInput(
        f"{path} is damaged: it is not what was written there; delete it and run again"
    )
    if seal and digest != _digest(before):
        raise damaged
    try:
        inside = netCDF4.Dataset(Path(path).name, memory=before if seal else content)
        store = xr.backends.NetCDF4DataStore(inside)  # type: ignore[no-untyped-call]
        with xr.open_dataset(store) as opened:
            dataset = opened.load()
    except Exception as error:  # of HDF5, NetCDF or xarray, as it happens to be damaged
        raise InvalidInput(f"{path} is not a NetCDF file: {error}") from error
    if dataset.attrs.pop(SEALED, None) is not None and not seal:
        raise damaged
    return dataset


def _digest(content: bytes) -> bytes:
    """Digest in letters."""
    return hashlib.sha256(content).hexdigest().encode()
