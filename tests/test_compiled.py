"""Where compiled code is kept."""

import logging
import os
from pathlib import Path

import pytest

from archfem import compiled


@pytest.fixture
def closed(monkeypatch, tmp_path):
    """Folders in which nothing can be written: those of the sources, and any that are added."""
    folders = {source / "__pycache__" for source in compiled.SOURCES}
    monkeypatch.setattr(
        compiled, "_writable", lambda folder: not {folder, *folder.parents} & folders
    )
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(compiled.GIVEN, raising=False)
    return folders


def test_beside_the_sources_where_that_can_be(monkeypatch):
    monkeypatch.delenv(compiled.GIVEN, raising=False)
    monkeypatch.setattr(compiled, "_writable", lambda folder: True)
    assert compiled._chosen() is None
    assert [path.parent for path in compiled.kept_in()] == list(compiled.SOURCES)


def test_else_in_the_cache_of_the_user(closed, tmp_path):
    assert compiled._chosen().parent == tmp_path / "cache"


def test_where_it_is_asked_for_apart_for_each_state_of_the_sources(closed, monkeypatch, tmp_path):
    monkeypatch.setenv(compiled.GIVEN, str(tmp_path / "mine"))
    chosen = compiled._chosen()
    assert chosen.parent == tmp_path / "mine"
    monkeypatch.setenv(compiled.GIVEN, str(chosen))  # as a process has it that was started here
    assert compiled._chosen() == chosen
    monkeypatch.setattr(compiled, "_digest", lambda: "changed")
    assert compiled._chosen() == chosen.with_name("archfem-changed")


def test_nowhere_else_until_the_process_ends(closed, monkeypatch, tmp_path, caplog):
    closed.add(tmp_path / "cache")
    kept = []
    monkeypatch.setattr(compiled.atexit, "register", lambda *given, **_: kept.append(given[1]))
    with caplog.at_level(logging.WARNING):
        chosen = compiled._chosen()
    assert kept == [chosen]
    assert chosen.stat().st_mode & 0o077 == 0  # what lies there is run: nobody else may write it
    assert "every run compiles" in caplog.text
    os.rmdir(chosen)


def test_what_is_kept_is_counted(monkeypatch, tmp_path):
    monkeypatch.setenv(compiled.GIVEN, str(tmp_path))
    assert compiled.count_kept() == 0
    Path(tmp_path / "stepping_0123").mkdir()
    (tmp_path / "stepping_0123" / "a.nbi").touch()
    assert compiled.count_kept() == 1


def test_that_it_compiles_is_said_once(capsys):
    compiled._tell.cache_clear()
    compiled._tell()
    compiled._tell()
    assert capsys.readouterr().err.count("takes about a minute") == 1
