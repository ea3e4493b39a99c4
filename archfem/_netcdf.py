"""Datasets in NetCDF files with a checksum, so that a damaged file is recognised when it is read.

The file ends with the SHA-256 digest of everything before it, which NetCDF readers skip. The file
is created in memory and written atomically: a full disk raises the error of the disk.
"""

import hashlib
import os
from collections.abc import Mapping
from math import prod
from pathlib import Path
from types import MappingProxyType
from typing import Any

import netCDF4
import xarray as xr

from archfem import _files
from archfem.errors import InvalidInput

# Precedes the digest at the end of a file.
CHECKSUM_MARK = b"\narchfem: SHA-256 of all before this line "

# Prefix of variables that hold texts for which an attribute has no room [bytes]
LONG_ATTRIBUTE, MAX_ATTRIBUTE_SIZE = "attribute ", 60_000

# Attribute of a file with its kind and format: without the mark such a file is truncated.
FORMAT_ATTRIBUTE = "archfem_format"


def write_dataset(
    dataset: xr.Dataset, path: Path, what: str, encoding: Mapping[Any, Any] = MappingProxyType({})
) -> Path:
    """Write a dataset, a file of a kind, atomically: a killed run leaves the old or the new one."""
    _files.refuse_listed(path)
    file = netCDF4.Dataset(path.name, "w", memory=1)
    try:
        store = xr.backends.NetCDF4DataStore(file)  # type: ignore[no-untyped-call]
        large = [name for name, values in dataset.items() if values.ndim > 1]
        small = dataset.drop_vars(large).assign_attrs({FORMAT_ATTRIBUTE: f"{what} {_files.FORMAT}"})
        for name, text in dataset.attrs.items():
            if isinstance(text, str) and len(text.encode()) > MAX_ATTRIBUTE_SIZE:
                small[f"{LONG_ATTRIBUTE}{name}"] = small.attrs.pop(name)
        dataset = dataset.assign_attrs()
        dataset.attrs.clear()  # which each part would write again
        # encoding copies: of a long history one variable at a time, with coordinates only once
        bare = dataset.drop_vars(dataset.coords)
        for part in (small, *(bare[[name]] for name in large)):
            own = {name: encoding[name] for name in part if name in encoding}
            part.dump_to_store(store, encoding=own)
            for name in own:
                file[name].set_var_chunk_cache(1)  # compresses it now, and frees its values
    finally:
        content = file.close()  # a view of memory, which is not copied
    with _files.atomic_write(path) as draft, draft.open("wb") as target:
        target.write(content)
        target.write(CHECKSUM_MARK + _digest(content))
    return path


def read_dataset(path: str | Path, what: str) -> xr.Dataset:
    """Read a NetCDF file of a kind and verify checksum and format; in a folder also its list."""
    # a history has no other limit of size than the disk's
    content = _files.read_bytes(path, what, max_bytes=2**40)
    end = content.rfind(CHECKSUM_MARK)
    damaged = InvalidInput(
        f"{path} is damaged: it is not what was written there; delete it and run again"
    )
    # no part of it is copied: a history may be large
    if end >= 0 and content[end + len(CHECKSUM_MARK) :] != _digest(memoryview(content)[:end]):
        raise damaged
    _files.check_listed(Path(path), content)
    try:
        file = netCDF4.Dataset(Path(path).name, memory=content)
        _check_sizes(file, len(content))
        store = xr.backends.NetCDF4DataStore(file)  # type: ignore[no-untyped-call]
        with xr.open_dataset(store) as opened:
            dataset = opened.load()
    except InvalidInput as error:
        raise InvalidInput(f"{path} {error}") from error
    except Exception as error:  # HDF5, NetCDF and xarray raise errors of many classes
        raise InvalidInput(f"{path} is not a NetCDF file: {error}") from error
    for name in [str(name) for name in dataset if str(name).startswith(LONG_ATTRIBUTE)]:
        dataset.attrs[name.removeprefix(LONG_ATTRIBUTE)] = str(dataset[name].item())
        dataset = dataset.drop_vars(name)
    found = str(dataset.attrs.pop(FORMAT_ATTRIBUTE, "none"))
    if found != "none" and end < 0:
        raise damaged
    _files.check_format(path, what, found)
    return dataset


def name_flags(table: xr.Dataset) -> xr.Dataset:
    """Return a table with the meanings of flags among its coordinates (CF Conventions, 3.5)."""
    coordinates = dict[Any, Any]()  # all, which keeps their order
    for name, each in table.coords.items():
        words, own = each.attrs.get("flag_meanings", "").split(), each.variable
        coordinates[name] = (own.dims, [words[int(x)] for x in own.values]) if words else own
    return table.drop_vars(coordinates).assign_coords(coordinates)


def _check_sizes(file: netCDF4.Dataset, size: int) -> None:
    """Refuse variables that declare more than a file of a size holds, or than fits into memory."""
    # texts of any length are Python's, which take more; NumPy's product may overflow
    sizes = [(prod(map(int, v.shape)), v.dtype) for v in file.variables.values()]
    declared = sum(count * getattr(dtype, "itemsize", 64) for count, dtype in sizes)
    most = 1032 * size  # deflate compresses no content further
    if hasattr(os, "sysconf"):  # which Windows has not
        most = min(most, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    if declared > most:
        raise InvalidInput(
            f"declares {declared / 1e9:.3g} GB, and its {size} bytes hold at most {most / 1e9:.3g} "
            "on this machine: delete it and run again"
        )


def _digest(content: bytes | memoryview) -> bytes:
    """Compute the SHA-256 digest of a file's content, as hexadecimal text."""
    return hashlib.sha256(content).hexdigest().encode()
