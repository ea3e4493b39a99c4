"""A damaged file is known before it is read."""

from resource import RUSAGE_SELF, getrusage

import netCDF4
import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem._netcdf import read_dataset, write_dataset


@pytest.fixture
def written(tmp_path):
    values = np.random.default_rng(0).normal(size=(50, 4))
    dataset = xr.Dataset(
        {"N": (("time", "joint"), values), "name": ("joint", list("abcd"))},
        coords={"time": np.arange(50.0)},
        attrs={"title": "as it was", "steps": 49},
    )
    path = write_dataset(dataset, tmp_path / "run.nc", "history file", {"N": {"zlib": True}})
    return dataset, path


def test_a_file_contains_the_written_data(written):
    dataset, path = written
    assert read_dataset(path, "history file").identical(dataset)
    with xr.open_dataset(path) as plain:  # other readers ignore the seal
        assert plain["N"].equals(dataset["N"])


def test_texts_of_any_length_are_attributes(tmp_path):
    """An attribute of HDF5 holds 64 kB: the blocks of 200 stones take as much."""
    dataset = xr.Dataset({"N": (("time", "joint"), np.ones((2, 2)))}, attrs={"archfem_format": 1})
    for size in (60_000, 66_000, 2_000_000):
        dataset = dataset.assign_attrs(case="é" * (size // 2), title="short")
        path = write_dataset(dataset, tmp_path / "run.nc", "history file")
        read = read_dataset(path, "history file")
        assert (list(read), read.attrs) == (["N"], {"case": "é" * (size // 2), "title": "short"})


def test_a_file_is_read_once(written, monkeypatch):
    """The checked data are the data that are read: the file is gone before its numbers are used."""
    dataset, path = written
    content = path.read_bytes()
    monkeypatch.setattr(
        "archfem._files.read_bytes", lambda path, what, max_bytes: path.unlink() or content
    )
    assert read_dataset(path, "history file").identical(dataset)


def test_any_damage_is_detected(written):
    """Each of 60 files is cut off, or has a byte changed, left out or put in, seal included."""
    _, path = written
    whole, rng = path.read_bytes(), np.random.default_rng(1)
    for number in range(60):
        last = number % 5 == 0  # the seal itself
        at = int(rng.integers(len(whole) - 110 if last else 0, len(whole)))
        other = bytes([whole[at] ^ (1 << int(rng.integers(8)))])
        content = (
            whole[:at],
            whole[:at] + other + whole[at + 1 :],
            whole[:at] + whole[at + 1 :],
            whole[:at] + b"\0" + whole[at:],
        )[number % 4]
        path.write_bytes(content)
        with pytest.raises(af.InvalidInput, match=r"is damaged|is not a NetCDF file"):
            read_dataset(path, "history file")


@pytest.mark.parametrize("shape", [(1_500_000_000,), (2**32, 2**32), (1, 2**40)])
@pytest.mark.parametrize("kind", ["f8", str])
def test_sizes_are_checked_before_values_are_read(shape, kind, tmp_path):
    """A file of kilobytes that declares terabytes, of which HDF5 stores none, takes no memory."""
    path = tmp_path / "large.nc"
    with netCDF4.Dataset(path, "w") as file:
        dimensions = [f"d{k}" for k in range(len(shape))]
        for name, size in zip(dimensions, shape, strict=True):
            file.createDimension(name, size)
        chunks = [min(size, 1000) for size in shape]
        file.createVariable("N", kind, dimensions, zlib=kind == "f8", chunksizes=chunks)
    before = getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(af.InvalidInput, match=r"large\.nc declares .* GB, and its \d+ bytes hold"):
        read_dataset(path, "history file")
    assert getrusage(RUSAGE_SELF).ru_maxrss - before < 100_000  # kB


@pytest.mark.slow
def test_what_compresses_best_is_read(tmp_path):
    """Zeros are the content that deflate compresses most, to a thousandth."""
    dataset = xr.Dataset({"N": (("time", "joint"), np.zeros((1000, 5000)))})
    packed = {"N": {"zlib": True, "complevel": 9}}
    path = write_dataset(dataset, tmp_path / "run.nc", "history file", packed)
    assert path.stat().st_size < 1e5
    assert read_dataset(path, "history file").identical(dataset)


@pytest.mark.slow
def test_a_damaged_history_is_run_again(small, unplotted, capsys):
    """The one of two finished pairs whose file has another byte is run again."""
    out = small.parent / "out"
    command = ["run", str(small), "--out", str(out)]
    assert af.commands.main(command) == 0
    path = out / "second" / "history.nc"
    before = path.read_bytes()
    path.write_bytes(before[:5000] + bytes([before[5000] ^ 1]) + before[5001:])
    capsys.readouterr()
    assert af.commands.main(command) == 0
    said = capsys.readouterr().out
    assert "first: finished before" in said
    assert "second: finished before" not in said
    with af.History.read(path).dataset as again:
        assert again.attrs["ended"] == "finished"
