"""Comparison of the tables that studies write."""

import archfem as af


def equal_tables(one, other):
    """Return whether two folders have equal tables; HDF5 may write the time into a file."""
    tables = [af.studies.read_table(folder / "results.nc") for folder in (one, other)]
    texts = [(folder / "results.csv").read_bytes() for folder in (one, other)]
    return tables[0].identical(tables[1]) and texts[0] == texts[1]
