"""Files are written in one stroke: there is the old one or the new one, never half of it."""

import pytest

from archfem._files import atomic_write


def test_a_file_appears_when_it_is_whole(tmp_path):
    path = tmp_path / "new" / "run.txt"
    with atomic_write(path) as draft:
        draft.write_text("half")
        assert draft.suffix == ".txt"
        assert not path.exists()
    assert path.read_text() == "half"
    assert list(path.parent.iterdir()) == [path]


def test_what_breaks_off_leaves_the_old_file(tmp_path):
    path = tmp_path / "run.txt"
    path.write_text("old")

    def broken_off():
        with atomic_write(path) as draft:
            draft.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_off()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
