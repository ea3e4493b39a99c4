"""The folder of compiled code, and the handling of damaged files."""

import errno
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from repeats import each_once

from archfem import _numba, _threads


def test_compilation_is_reported_once_for_each_part(capsys, monkeypatch):
    monkeypatch.setattr(_numba, "_announced", set())
    monkeypatch.setattr(_numba, "_time_compilation", lambda: 0.2)
    steps_alone = "joints.large.forces.facet_slips", "joints.large.forces.compute_step_forces"
    modules = (*steps_alone, "dynamics.solvers.base", "dynamics.solvers.supernodal_lu")
    steps = "dynamics.solvers.base (SmallSystem(float64))"
    for module in (*modules, "dynamics.rigid_body.time_stepping", steps, steps):
        _numba._announce_compilation(f"archfem.{module}")
    first, second, third = capsys.readouterr().err.splitlines()
    assert "compiling the time steps of large displacements, which takes about 38 s" in first
    assert "compiling the fall of loose blocks, which takes about 37 s" in second
    assert "compiling the time steps, which takes about 23 s" in third


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_a_kernel_is_compiled(number):
    """An exception within a callback of LLVM would be lost, and the kernel with it."""

    def interrupt(*_):
        raise KeyboardInterrupt

    def compile_slowly():
        with _threads.hold_signals():
            signal.raise_signal(number)
            reached.append("the end")

    before = signal.signal(number, interrupt)
    reached = []
    try:
        with pytest.raises(KeyboardInterrupt):
            compile_slowly()
        assert signal.getsignal(number) is interrupt
        held = []
        compiled = _numba.entry(lambda x: x + 1)
        compiled._cache.load_overload = lambda *_: held.append(signal.getsignal(number))
        assert compiled(1) == 2
        assert interrupt not in held
        assert len(held) > 0
    finally:
        signal.signal(number, before)
    assert reached == ["the end"]


@pytest.mark.slow
def test_the_stated_time_is_that_of_the_compilation(tmp_path):
    script = tmp_path / "measure.py"
    script.write_text(MEASUREMENT)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.getcwd()}
    words = [sys.executable, script]
    ran = subprocess.run(words, env=environment, text=True, capture_output=True, check=True)
    stated = float(re.search(r"takes about (\d+) s", ran.stderr)[1])
    # processor time, which other processes of the machine change less than they do the time
    assert 1 / 1.5 < stated / float(ran.stdout) < 1.5


# Prints the processor time that kernels of small displacements take to compile; a notice states it
# from processor time as well.
MEASUREMENT = """
import time
from archfem import _numba, _threads
from archfem.dynamics.warm_up import compile_variant
_numba.perf_counter = time.process_time
start = time.process_time()
compile_variant("newton, Conserving")
print(time.process_time() - start)
"""


def add_half(value):
    return value + 0.5


def compiled(hits):
    """Compile a small function, or load it; `hits` is how often it must come from its files."""
    function = _numba.entry(add_half)
    assert function(2.0) == 2.5
    assert sum(function.stats.cache_hits.values()) == hits
    return function


@pytest.fixture
def stored(monkeypatch, tmp_path):
    """Index and code of a small function, in a folder of their own."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(_numba, "_declared", [])
    compiled(hits=0)
    (index,), (code,) = tmp_path.rglob("*.nbi"), tmp_path.rglob("*.nbc")
    return {"index": index, "code": code}


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


DAMAGES = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-40]),
    "empty": lambda path: path.write_bytes(b""),
    "flipped": flip,
    "unreadable": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize(("damage", "which"), each_once(DAMAGES, ("index", "code")))
def test_damaged_code_is_found_and_compiled_anew(which, damage, stored):
    compiled(hits=1)
    assert not _numba.find_damaged_files()
    DAMAGES[damage](stored[which])
    assert _numba.find_damaged_files() == [stored[which]]
    compiled(hits=0)
    if damage != "unreadable":  # no file replaces a folder
        assert not _numba.find_damaged_files()
        compiled(hits=1)


@pytest.mark.slow
def test_one_of_two_processes_compiles(tmp_path):
    """They begin at once, and one loads the code that the other has stored."""
    (tmp_path / "functions.py").write_text(FUNCTION)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    environment["PYTHONPATH"] = os.pathsep.join([os.getcwd(), str(tmp_path)])
    options = {"env": environment, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    words = [sys.executable, "-c", "import functions"]
    processes = [subprocess.Popen(words, text=True, **options) for _ in range(2)]
    for process in processes:  # until both have been imported
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        process.stdin.close()
    hits = [process.stdout.read().strip() for process in processes]
    assert sorted(hits) == ["0", "1"]
    for process in processes:
        process.stdout.close()
        assert process.wait() == 0
    assert not list(tmp_path.rglob("*.lock"))


FUNCTION = """
import sys
from archfem import _numba, _threads

@_numba.entry
def add_half(value):
    return value + 0.5

print("ready", flush=True)
sys.stdin.read()
assert add_half(2.0) == 2.5
print(sum(add_half.stats.cache_hits.values()))
"""


def test_a_function_that_does_not_compile_is_locked_no_longer(monkeypatch, tmp_path):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(_numba, "_declared", [])
    function = _numba.entry(add_half)
    for _ in range(2):  # the second would wait for ever
        with pytest.raises(numba.TypingError):
            function("two")
    assert not list(tmp_path.rglob("*.lock"))


def test_code_is_loaded_without_being_compiled(stored):
    function, other = _numba.entry(add_half), _numba.entry(add_half)
    with _numba.load_only():
        assert function(2.0) == 2.5
        other(2)  # of another type, which is not stored
        pytest.fail("it was compiled")
    assert not other.signatures
    assert other(2) == 2.5


def test_stored_functions_are_counted(stored):
    assert _numba.cache_folders() == [stored["index"].parent]
    assert _numba.count_cached_functions() == 1
    stored["index"].unlink()
    assert _numba.count_cached_functions() == 0


def test_code_is_compiled_anew_if_any_kernel_has_changed(stored, monkeypatch):
    monkeypatch.setattr(_numba, "source_digest", lambda: "changed")
    compiled(hits=0)
    compiled(hits=1)


def test_code_of_a_function_at_another_line_is_deleted(stored, monkeypatch):
    """Code of another function, or of another Python, stays."""
    folder, name = stored["index"].parent, stored["index"].name
    line = re.search(r"-(\d+)\.", name)[1]
    moved = folder / name.replace(f"-{line}.", "-7.")
    names = moved.name.replace("add_half", "add"), re.sub(r"\.py\d+", ".py27", moved.name)
    others = [folder / each for each in names]
    for path in (moved, *others):
        path.touch()
    monkeypatch.setattr(_numba, "source_digest", lambda: "changed")
    compiled(hits=0)
    assert not moved.exists()
    assert all(path.exists() for path in others)


def test_the_digest_is_that_of_all_kernels(monkeypatch, tmp_path):
    monkeypatch.setattr(_numba, "SOURCE_FOLDERS", (tmp_path,))
    digests = set()
    for name, content in (("a.py", "1"), ("b.py", "1"), ("b.py", "2")):
        (tmp_path / name).write_text(content)
        digests.add(_numba.source_digest.__wrapped__())
    assert len(digests) == 3


def test_code_that_is_intact_but_cannot_be_loaded_is_compiled_anew(stored, monkeypatch):
    def refuse(*_):
        raise RuntimeError("made by another LLVM")

    with monkeypatch.context() as patch:
        patch.setattr("numba.core.compiler.CompileResult._rebuild", refuse)
        compiled(hits=0)
    compiled(hits=1)


def test_a_full_disk_stops_no_run(monkeypatch, tmp_path, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(os, "replace", full)
    compiled(hits=0)
    assert "No space left on device" in caplog.text
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_without_any_folder_it_compiles_and_reports_it(monkeypatch, caplog):
    for locator in numba.core.caching.CacheImpl._locator_classes:
        monkeypatch.setattr(locator, "from_function", lambda *_: None)
    _numba._warn_unsaved.cache_clear()
    assert _numba.entry(add_half)(2.0) == 2.5
    assert "compiled code cannot be stored" in caplog.text
    assert "NUMBA_CACHE_DIR" in caplog.text


def test_damaged_files_are_deleted_before_all_is_compiled(stored):
    flip(stored["code"])
    _numba.delete_damaged_files()
    assert not stored["code"].exists()
    assert stored["index"].exists()


def test_every_stored_function_is_checked():
    package = Path(_numba.__file__).parent
    modules = [path for path in package.rglob("*.py") if "cache=True" in path.read_text("utf-8")]
    assert not modules, "numba's own cache does not notice damage: use entry or allocating_entry"


def test_a_kernel_that_kernels_call_is_part_of_them_and_has_no_machine_code():
    inner = _numba.kernel(add_half)

    @numba.njit
    def outer(value):
        return 2.0 * inner(value)

    assert outer(1.0) == 3.0
    (compiled,) = inner.overloads.values()
    defined = [each.name for each in compiled.library.get_defined_functions()]
    assert defined
    engine = compiled.library.codegen._engine
    assert not any(engine.is_symbol_defined(name) for name in defined)
