"""Files are written in one stroke: there is the old one or the new one, never half of it."""

import fcntl
import json
import os
import subprocess
import sys
import traceback
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, nullcontext
from pathlib import Path

import pytest

import archfem as af
from archfem import _files


@pytest.mark.parametrize("text", [None, "title = ", b"\xff"])
def test_a_file_that_cannot_be_read_has_one_traceback(tmp_path, text):
    """The message of archfem is the last and the only one: the error below it adds nothing."""
    path = tmp_path / "case.toml"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(af.InvalidInput) as raised:
        af.Case.read(path)
    shown = "".join(traceback.format_exception(raised.value))
    assert shown.count("Traceback") == 1
    assert shown.splitlines()[-1].startswith("archfem.errors.InvalidInput: ")


def test_a_file_appears_when_it_is_whole(tmp_path):
    path = tmp_path / "new" / "run.txt"
    with _files.atomic_write(path) as draft:
        draft.write_text("half")
        assert draft.suffix == ".txt"
        assert not path.exists()
    assert path.read_text() == "half"
    assert list(path.parent.iterdir()) == [path]


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "run.txt"
    path.write_text("old")

    def broken_off():
        with _files.atomic_write(path) as draft:
            draft.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_off()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_current_folder_is_no_file_to_write():
    with (
        pytest.raises(af.InvalidInput, match=r"\. is a folder: name a file in it"),
        _files.atomic_write(Path()),
    ):
        pass


@pytest.fixture
def dead_process():
    """Number of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def test_drafts_of_killed_processes_are_removed_by_the_next_writer(tmp_path, dead_process):
    """Those of processes that run, here or on other machines, stay."""
    machine = os.uname().nodename
    names = {
        number: f".run.{machine}.{number}.part.txt" for number in (dead_process, os.getppid(), "x")
    }
    others = (f".run.elsewhere.{dead_process}.part.txt", f".run2.{machine}.{dead_process}.part.txt")
    for name in (*names.values(), *others):
        (tmp_path / name).touch()
    with _files.atomic_write(tmp_path / "run.txt") as draft:
        draft.write_text("whole")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"run.txt", names[os.getppid()], *others}


def test_a_draft_that_another_has_linked_to_a_file_leaves_that_file(tmp_path):
    """The name of a draft can be guessed."""
    (tmp_path / "mine.txt").write_text("mine")
    draft = tmp_path / f".run.{os.uname().nodename}.{os.getpid()}.part.txt"
    draft.symlink_to(tmp_path / "mine.txt")
    with _files.atomic_write(tmp_path / "run.txt") as path:
        path.write_text("new")
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert not (tmp_path / "run.txt").is_symlink()


@pytest.mark.parametrize("flags", [_files.SAFE_FLAGS, 0])
def test_links_are_refused_without_flags_of_the_system_too(flags, tmp_path, monkeypatch):
    monkeypatch.setattr(_files, "SAFE_FLAGS", flags)
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / ".lock").symlink_to(tmp_path / "mine.txt")
    for use in (_files.lock_folder, lambda folder: nullcontext(_files.is_locked(folder))):
        with pytest.raises(af.InvalidInput, match="is a link"), use(tmp_path):
            pass
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_a_link_that_appears_after_the_check_is_not_opened(tmp_path, monkeypatch):
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / ".lock").symlink_to(tmp_path / "mine.txt")
    monkeypatch.setattr(_files, "path_inside", lambda folder, name: folder / name)
    with pytest.raises(af.InvalidInput, match="cannot be written"), _files.lock_folder(tmp_path):
        pass
    assert (tmp_path / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["/etc/passwd", "../a", "a/../../b", "x/../y"])
def test_names_outside_of_a_folder_are_refused(name, tmp_path):
    with pytest.raises(af.InvalidInput, match="outside"):
        _files.path_inside(tmp_path, name)


def test_a_folder_that_is_a_link_itself_is_the_users(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "disk")
    write(tmp_path / "out", "run", "one", a_txt="1")
    assert (tmp_path / "disk" / "a.txt").read_text() == "1"


def test_temporary_folders_of_killed_processes_are_removed_by_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    code = "import os, archfem._files as f\nwith f.temporary_folder() as x: (x / 'a').touch(); "
    killed = [sys.executable, "-c", f"{code}os.kill(os.getpid(), 9)"]
    subprocess.run(killed, env=os.environ | {"TMPDIR": str(tmp_path)}, check=False)
    (left,) = tmp_path.iterdir()
    assert {path.name for path in left.iterdir()} == {".lock", "a"}
    with _files.temporary_folder() as folder:
        assert list(tmp_path.iterdir()) == [folder]
        with _files.temporary_folder() as other:
            assert set(tmp_path.iterdir()) == {folder, other}
    assert list(tmp_path.iterdir()) == []


def contents(folder):
    """All files below a folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def write(folder, command, inputs, **texts):
    """Replace the results of a command by texts; underscores stand for dots."""
    with _files.replace_results(folder, command, inputs) as draft:
        for name, text in texts.items():
            path = draft / name.replace("_", ".").replace("pair.", "pair/")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)


def test_results_of_a_command_are_replaced_together(tmp_path):
    write(tmp_path, "run", "one", a_txt="1", b_txt="1", pair_c_txt="1")
    write(tmp_path, "modes", "one", modes_txt="of one")
    write(tmp_path, "report", "one", report_html="of one")
    assert {*contents(tmp_path)} == {
        *("a.txt", "b.txt", "pair/c.txt", "modes.txt", "report.html", "archfem.json"),
    }
    write(tmp_path, "run", "two", a_txt="2")
    # files of the other run alone are gone, and its report; the other command's file is its own
    assert {*contents(tmp_path)} == {"a.txt", "modes.txt", "archfem.json"}
    assert not (tmp_path / "pair").exists()
    groups = _files.read_file_list(tmp_path)
    assert {name: group.inputs for name, group in groups.items()} == {"run": "two", "modes": "one"}
    write(tmp_path, "run", "two", modes_txt="of two")
    assert _files.read_file_list(tmp_path)["modes"].files == {}


def test_files_of_other_results_are_removed_with_them(tmp_path):
    """A report stays only where the very same run is repeated."""
    for text, left in (("first", True), ("first", True), ("second", False)):
        write(tmp_path, "run", "inputs", case_toml=text)
        if text == "first":
            write(tmp_path, "report", "inputs", report_html="of the first")
        assert (tmp_path / "report.html").exists() == left
    write(tmp_path, "report", "inputs", report_html="of the second")
    write(tmp_path, "run", "other inputs", case_toml="second")
    assert (tmp_path / "report.html").exists()


def test_a_command_that_fails_leaves_the_folder_as_it_was(tmp_path):
    write(tmp_path, "run", "one", a_txt="1")
    before = contents(tmp_path)

    def broken_off():
        with _files.replace_results(tmp_path, "run", "two") as draft:
            (draft / "a.txt").write_text("2")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_off()
    assert contents(tmp_path) == before
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("moves", range(6))
def test_a_kill_while_files_are_moved_loses_none(moves, tmp_path, monkeypatch):
    """The draft, its list, and each file: whichever is moved last, one of both runs is whole."""
    write(tmp_path, "modes", "one", a_txt="1", b_txt="1", c_txt="1")
    left, actual = [moves], {name: getattr(os, name) for name in ("replace", "rename")}

    def killed(name):
        def move(*paths):
            if not left[0]:
                raise SystemExit
            left[0] -= 1
            actual[name](*paths)

        return move

    with monkeypatch.context() as patch:
        for name in actual:
            patch.setattr(os, name, killed(name))
        patch.setattr(_files.shutil, "rmtree", lambda *_, **__: None)  # nor is the draft removed
        with pytest.raises(SystemExit):
            write(tmp_path, "modes", "two", a_txt="2", b_txt="2", d_txt="2")
    _files.complete_publication(tmp_path)
    found = {name: text for name, text in contents(tmp_path).items() if "/" not in name}
    digit = b"1" if moves < 2 else b"2"  # the list of the draft, then its name
    names = {"a.txt", "b.txt", "c.txt" if moves < 2 else "d.txt"}
    assert found.pop("archfem.json")
    assert found == dict.fromkeys(names, digit)
    for name in names:
        _files.check_listed(tmp_path / name, digit)
    write(tmp_path, "modes", "three", a_txt="3")
    assert {*contents(tmp_path)} == {"a.txt", "archfem.json"}


def test_a_changed_file_is_refused_and_another_is_not(tmp_path):
    write(tmp_path, "run", "one", a_txt="1", pair_c_txt="1")
    _files.check_listed(tmp_path / "a.txt", b"1")
    _files.check_listed(tmp_path / "unlisted.txt", b"5")
    for name in ("a.txt", "pair/c.txt"):
        with pytest.raises(af.InvalidInput, match="is not the file that archfem wrote there"):
            _files.check_listed(tmp_path / name, b"2")


def test_a_file_that_no_command_has_written_is_kept_beside_the_result(tmp_path, caplog):
    (tmp_path / "a.txt").write_text("mine")
    write(tmp_path, "run", "one", a_txt="1", b_txt="1")
    assert "a.txt is in no list of results: it is kept as a.txt.kept" in caplog.text
    caplog.clear()
    write(tmp_path, "run", "two", a_txt="2", b_txt="2")
    found = contents(tmp_path)
    assert (found["a.txt"], found["b.txt"], found["a.txt.kept"]) == (b"2", b"2", b"mine")
    assert caplog.text == ""


def test_a_list_names_no_files_outside_its_folder(tmp_path):
    out = tmp_path / "out"
    write(out, "run", "one", a_txt="1")
    (tmp_path / "mine.txt").write_text("mine")
    files = {"../mine.txt": "", "a.txt": ""}
    _files.write_sealed_json(out / "archfem.json", {"run": {"inputs": "one", "files": files}})
    write(out, "run", "two", b_txt="2")
    assert {*contents(tmp_path)} == {"mine.txt", "out/b.txt", "out/archfem.json"}


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"content": 1, "sha256": ""}', "5"])
def test_a_damaged_list_is_refused_and_written_anew(text, tmp_path):
    write(tmp_path, "run", "one", a_txt="1")
    (tmp_path / "archfem.json").write_text(text)
    with pytest.raises(af.InvalidInput, match=r"archfem\.json is damaged"):
        _files.check_listed(tmp_path / "a.txt", b"1")
    write(tmp_path, "run", "two", a_txt="2")
    _files.check_listed(tmp_path / "a.txt", b"2")


def test_sealed_numbers_are_read_and_changed_ones_refused(tmp_path):
    path, content = tmp_path / "row.json", {"b": [0.1, 1e300, float("inf")], "a": "text"}
    _files.write_sealed_json(path, content)
    assert _files.read_sealed_json(path, "row") == content
    path.write_text(path.read_text().replace("0.1", "0.2"))
    with pytest.raises(af.InvalidInput, match="damaged"):
        _files.read_sealed_json(path, "row")
    assert json.loads(path.read_text())["content"]["b"][0] == 0.2


def test_a_folder_has_one_writer(tmp_path):
    assert not _files.is_locked(tmp_path)
    with _files.lock_folder(tmp_path):
        assert _files.is_locked(tmp_path)
        refused = rf"another command runs in .*process {os.getpid()}"
        with pytest.raises(af.InvalidInput, match=refused), _files.lock_folder(tmp_path):
            pass
        assert _files.is_locked(tmp_path)
    assert not _files.is_locked(tmp_path)
    assert not list(tmp_path.iterdir())


def test_finished_results_wait_for_the_command_that_writes_to_their_folder(tmp_path, monkeypatch):
    with ThreadPoolExecutor() as pool, ExitStack() as first:
        first.enter_context(_files.lock_folder(tmp_path))
        waiting = pool.submit(write, tmp_path, "scale --pair b", "x", b="2")
        with pytest.raises(TimeoutError):
            waiting.result(0.3)
        first.close()
        waiting.result(10.0)
    assert (tmp_path / "b").read_text() == "2"
    monkeypatch.setattr(_files, "WRITING_PATIENCE", 0.2)
    refused = pytest.raises(af.InvalidInput, match="another command runs in")
    with _files.lock_folder(tmp_path), refused:
        write(tmp_path, "scale --pair b", "x", b="3")
    assert (tmp_path / "b").read_text() == "2"


def test_a_lock_whose_file_its_owner_deletes_is_taken_anew(tmp_path, monkeypatch):
    """The owner may end between opening and locking of the file by the next one."""
    flock, files = fcntl.flock, []

    def delete_first(file, operation):
        flock(file, operation)
        files.append(file)
        if len(files) == 1:
            (tmp_path / ".lock").unlink()

    monkeypatch.setattr(fcntl, "flock", delete_first)
    with _files.lock_folder(tmp_path):
        assert len(files) == 2
        assert (tmp_path / ".lock").read_bytes().startswith(b"process")


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / ".lock").mkdir()
    with pytest.raises(af.InvalidInput, match="cannot be written to"), _files.lock_folder(tmp_path):
        pass
