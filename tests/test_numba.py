"""Where compiled code is kept."""

import logging
import os
from pathlib import Path

import pytest

from archfem import _numba


@pytest.fixture
def closed(monkeypatch, tmp_path):
    """Folders in which nothing can be written: those of the sources, and any that are added."""
    folders = {source / "__pycache__" for source in _numba.SOURCE_FOLDERS}
    monkeypatch.setattr(
        _numba, "_is_writable", lambda folder: not {folder, *folder.parents} & folders
    )
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(_numba.CACHE_VARIABLE, raising=False)
    return folders


def test_beside_the_sources_where_that_can_be(monkeypatch):
    monkeypatch.delenv(_numba.CACHE_VARIABLE, raising=False)
    monkeypatch.setattr(_numba, "_is_writable", lambda folder: True)
    assert _numba._cache_folder() is None
    assert [path.parent for path in _numba.cache_folders()] == list(_numba.SOURCE_FOLDERS)


def test_else_in_the_cache_of_the_user(closed, tmp_path):
    assert _numba._cache_folder().parent == tmp_path / "cache"


def test_where_it_is_asked_for_apart_for_each_state_of_the_sources(closed, monkeypatch, tmp_path):
    monkeypatch.setenv(_numba.CACHE_VARIABLE, str(tmp_path / "mine"))
    chosen = _numba._cache_folder()
    assert chosen.parent == tmp_path / "mine"
    monkeypatch.setenv(
        _numba.CACHE_VARIABLE, str(chosen)
    )  # as a process has it that was started here
    assert _numba._cache_folder() == chosen
    monkeypatch.setattr(_numba, "source_digest", lambda: "changed")
    assert _numba._cache_folder() == chosen.with_name("archfem-changed")


def test_nowhere_else_until_the_process_ends(closed, monkeypatch, tmp_path, caplog):
    closed.add(tmp_path / "cache")
    kept = []
    monkeypatch.setattr(_numba.atexit, "register", lambda *given, **_: kept.append(given[1]))
    with caplog.at_level(logging.WARNING):
        chosen = _numba._cache_folder()
    assert kept == [chosen]
    assert chosen.stat().st_mode & 0o077 == 0  # what lies there is run: nobody else may write it
    assert "run compiles for a minute" in caplog.text
    os.rmdir(chosen)


def test_what_is_kept_is_counted(monkeypatch, tmp_path):
    monkeypatch.setenv(_numba.CACHE_VARIABLE, str(tmp_path))
    assert _numba.count_cached_functions() == 0
    Path(tmp_path / "solvers_0123").mkdir()
    (tmp_path / "solvers_0123" / "a.nbi").touch()
    assert _numba.count_cached_functions() == 1


def test_that_it_compiles_is_said_once(capsys):
    _numba._announce_compilation.cache_clear()
    _numba._announce_compilation()
    _numba._announce_compilation()
    assert capsys.readouterr().err.count("takes about a minute") == 1
