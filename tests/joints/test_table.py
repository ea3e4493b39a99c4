"""Tables of joint forces: their rows, and the rows of a sheet."""

import pytest

import archfem as af
from archfem.joints import resultants

pd = pytest.importorskip("pandas")


def test_a_row_for_each_joint_at_each_instant(joints):
    found = resultants.joint_table(joints)
    assert list(found.columns[:5]) == ["time", "joint", "name", "part", "role"]
    assert len(found) == 5 * 18
    row = found[(found["joint"] == 7) & (found["time"] == joints["time"].values[3])]
    assert row["V"].item() == -700.0
    at_rest = resultants.joint_table(joints.isel(time=2))
    assert len(at_rest) == 18
    assert at_rest["eccentricity"][14] == pytest.approx(0.47)
    assert "time" not in at_rest.columns[:1]


@pytest.mark.parametrize(("rows", "fits"), [(1_048_575, True), (1_048_576, False)])
def test_a_sheet_has_two_to_the_twentieth_rows_and_one_is_its_head(
    joints, tmp_path, monkeypatch, rows, fits
):
    frame = pd.DataFrame(index=range(rows))
    written = []
    monkeypatch.setattr(resultants, "joint_table", lambda joints: frame)
    monkeypatch.setattr(pd.DataFrame, "to_excel", lambda self, *_, **__: written.append(len(self)))
    monkeypatch.setattr(resultants, "atomic_write", lambda path: _Draft(path))
    if fits:
        resultants.write_joint_table(joints, tmp_path / "joints.xlsx")
        assert written == [2**20 - 1]
    else:
        with pytest.raises(af.InvalidInput, match="1048576 rows do not fit into a sheet of Excel"):
            resultants.write_joint_table(joints, tmp_path / "joints.xlsx")


class _Draft:
    """A file that is not written."""

    def __init__(self, path):
        self.path = path

    def __enter__(self):
        return self.path

    def __exit__(self, *_):
        return None
