"""Compilation by numba: decorators of kernels and the folder of the compiled code.

A kernel allocates no arrays. Numba counts references to arrays wherever a function receives or
slices one, by atomic operations that take longer than the arithmetic of small functions. The option
`_nrt` removes the counting; a function that allocates nevertheless does not compile. Divisions do
not check for zero.

Numba stores compiled code beside the sources, or where these are read-only, in the user's cache.
It is used again only if no module with kernels has changed: kernels contain those that they call.
Each file ends with a checksum: a function whose file is damaged is compiled anew. Of several
processes that need the same code, one compiles it, and the others wait and load it.
"""

import hashlib
import io
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from multiprocessing import parent_process
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numba
from numba._dynfunc import make_function
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering

from archfem._files import lock_file
from archfem._threads import hold_signals
from archfem.errors import logger

# mypy: disable-error-code="no-untyped-call"

# Folders of the modules with compiled functions
SOURCE_FOLDERS = tuple(
    Path(__file__).parent / room
    for room in ("joints/large", "dynamics/solvers", "dynamics/rigid_body")
)

# Compiled code on disk of each function that was declared
_declared: list["HealingCache"] = []

KERNEL_OPTIONS: Any = {"error_model": "numpy", "_nrt": False}


class CheckedCacheFile(IndexDataCacheFile):
    """Index and data files of a function, each followed by the SHA-256 of its content."""

    # Unpickling ignores the checksum: a flipped bit would not be noticed before the code runs.

    def _load_index(self) -> Any:
        """Return the data files by signature; none if the index is damaged or unreadable."""
        try:
            return super()._load_index() if _is_intact(Path(self._index_path)) else {}
        except OSError:
            return {}

    def _load_data(self, name: str) -> Any:
        """Return the content of a data file; an OSError makes numba compile anew."""
        path = Path(self._data_path(name))
        if not _is_intact(path):
            raise OSError(f"{path} is damaged")
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        """Yield a file that replaces another when the block ends, then with its checksum."""
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + hashlib.sha256(content.getvalue()).digest())


def _delete_lock(path: Path) -> None:
    """Delete the file of a lock, which Windows does only when no process has it open."""
    with suppress(PermissionError):
        path.unlink(missing_ok=True)


class NotStored(Exception):
    """Compiled code is not on disk, and is not to be compiled now."""


_loads_only: list[bool] = [False]  # the last one holds


@contextmanager
def load_only() -> Iterator[None]:
    """Load compiled code in a block, which ends at the first function that is not stored."""
    _loads_only.append(True)
    try:
        with suppress(NotStored):
            yield
    finally:
        _loads_only.pop()


class HealingCache(FunctionCache):
    """Compiled code of a function on disk; what cannot be loaded is discarded."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        # numba itself would miss a change of a kernel that this one calls, in another module
        base, stamp = self._impl.filename_base, source_digest()
        self._cache_file = CheckedCacheFile(self._cache_path, base, stamp)
        self.lock = ExitStack()  # of the code that this process compiles, until it is stored
        _declared.append(self)

    @property
    def is_stored(self) -> bool:
        """Whether code for any signature is on disk, as new as the sources."""
        return bool(self._cache_file._load_index())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature, or None, upon which numba compiles it."""
        code = self._load(sig, target_context)
        if code is not None:
            return code
        if _loads_only[-1]:
            raise NotStored
        _announce_compilation(f"{self._py_func.__module__}.{self._py_func.__name__} {sig}")
        with suppress(OSError):  # without a lock each process compiles
            self._wait_for_others(hashlib.sha256(str(sig).encode()).hexdigest()[:16])
        return self._load(sig, target_context)

    def _wait_for_others(self, digest: str) -> None:
        """Wait until no other process compiles for a signature, and let others wait for this."""
        path = Path(self._cache_path) / f"{self._impl.filename_base}-{digest}.lock"
        file = self.lock.enter_context(path.open("ab"))
        self.lock.callback(_delete_lock, path)
        lock_file(file, wait=True)

    def _load(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature, or None; what cannot be loaded is discarded."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # an intact file of another LLVM or processor, for instance
            logger.info("compiled code in %s cannot be loaded: %s", self._cache_path, error)
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the code for a signature; a run does not need the file."""
        try:
            super().save_overload(sig, data)
            self._delete_moved()
        except OSError as error:
            _warn_unsaved(self._cache_path, error.strerror or str(error))

    def _delete_moved(self) -> None:
        """Delete files of this function from when it began at another line of its module."""
        base = self._impl.filename_base
        for path in Path(self._cache_path).glob(re.sub(r"-\d+\.", "-*.", base) + ".*nb[ic]"):
            if not path.name.startswith(f"{base}."):
                path.unlink(missing_ok=True)


@cache
def _warn_unsaved(folder: str, reason: str) -> None:
    """Warn that compiled code cannot be stored, once a folder."""
    logger.warning(
        "compiled code cannot be stored in %s (%s): this run needs no file, but the next one "
        "compiles again; make room there, or set NUMBA_CACHE_DIR to another folder",
        *(folder, reason),
    )


def _is_intact(path: Path) -> bool:
    """Return whether a file ends with its checksum."""
    content = path.read_bytes()
    return hashlib.sha256(content[:-32]).digest() == content[-32:]


def store_compiled(compile_function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a decorator that compiles as another one does, and stores the code on disk."""

    def decorate(function: Any) -> Any:
        dispatcher = compile_function(function)
        try:
            dispatcher._cache = cache = HealingCache(function)
        except RuntimeError:  # there is no folder that numba may write to
            _warn_unsaved("any folder that numba tries", "none may be written to")
            return dispatcher
        compile_signature = dispatcher.compile

        def compile_once(signature: Any) -> Any:
            with hold_signals(), cache.lock:  # released also if it does not compile
                return compile_signature(signature)

        dispatcher.compile = compile_once
        return dispatcher

    return decorate


# Compiles a kernel that Python calls, and stores it on disk.
entry: Any = store_compiled(numba.njit(**KERNEL_OPTIONS))

# Compiles a function that may allocate arrays, and stores it on disk.
allocating_entry: Any = store_compiled(numba.njit())


class InnerLibrary(JITCodeLibrary):
    """Intermediate code of a kernel, which is optimised in its callers and not by itself."""

    def finalize(self) -> None:
        """Link the kernels that are called; no machine code is generated."""
        for library in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=False)
class DeclareInnerKernel(LoweringPass):
    """Declare a kernel to its callers, by a function that Python cannot call."""

    _name = "declare_inner_kernel"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Declare it after its lowering to intermediate code."""
        lowered = state.cr
        name, module = lowered.fndesc.qualname, lowered.fndesc.lookup_module()
        function = make_function(module, name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(function, lowered.fndesc, [state.library])
        state.cr = lowered._replace(cfunc=function)
        return True


class InnerCompiler(CompilerBase):
    """Compiles a kernel to intermediate code only."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes of numba, which end at the lowering to intermediate code."""
        state = self.state
        name = state.func_id.func_qualname
        state.library = InnerLibrary(state.targetctx.codegen(), name)
        state.flags.no_compile = True
        passes = DefaultPassBuilder.define_nopython_pipeline(state)
        passes.add_pass_after(DeclareInnerKernel, NativeLowering)
        passes.finalize()
        return [passes]


# Kernels that only kernels call are part of the callers' code. Machine code and optimisation of
# their own, and wrappers for Python, would double the compile time. A call from Python is an error.
INNER_OPTIONS: Any = KERNEL_OPTIONS | {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": InnerCompiler,
}

# Compiles a function that allocates no arrays.
kernel: Any = numba.njit(**INNER_OPTIONS)

# Compiles a kernel as part of its callers. Any other call passes all numbers of its tuples by the
# stack, over 2 kB for a system of steps, which takes as long as the law of several joints.
inlined_kernel: Any = numba.njit(**INNER_OPTIONS, forceinline=True)

# Compiles a kernel whose sums may be reordered, so that several terms are added at a time.
summing_kernel: Any = numba.njit(**INNER_OPTIONS, fastmath={"contract", "reassoc"})

# Compiles a function that returns slices of its arrays, as part of its callers.
view_kernel: Any = numba.njit(**INNER_OPTIONS, inline="always")


class CompilationNotice(NamedTuple):
    """Which part of a run is compiled, and how long this takes."""

    part: str
    seconds: float

    def write(self) -> None:
        """Write the notice, except in a child process: its parent says what it is for."""
        if parent_process() is not None:
            return
        seconds = self.seconds
        duration = f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.1f} minutes"
        sys.stderr.write(
            f"archfem: compiling the {self.part}, which takes about {duration}; later runs reuse "
            "the result ('archfem compile' compiles everything, 'archfem doctor' shows the "
            "folder)\n"
        )
        sys.stderr.flush()


# Function that notices are passed to: a worker of a study sends them to its driver.
send_notice: Callable[[CompilationNotice], None] = CompilationNotice.write

_announced: set[str] = set()


def _announce_compilation(name: str) -> None:
    """Announce the part of a run that is compiled, once, by a function and the types it is for."""
    # what is compiled at once, by a word of its first kernel, and its time as a multiple of that
    # of the reference function; others of joints.large take seconds where they alone are missing
    parts = {
        "rigid_body.time_stepping": ("fall of loose blocks", 185.0),
        "solvers.supernodal_lu": ("steps of elastic blocks", 160.0),
        "joints.large.forces.compute_step_forces": ("time steps of large displacements", 190.0),
        "SmallSystem": ("time steps", 115.0),  # of rigid blocks with small displacements
    }
    part, multiple = next((parts[word] for word in parts if word in name), ("", 0.0))
    if not part or part in _announced:
        return
    # kernels of large displacements include those of elastic blocks
    _announced.update({part, "steps of elastic blocks"} if "joints.large" in name else {part})
    send_notice(CompilationNotice(part, multiple * _time_compilation()))


def _time_compilation(repeats: int = 3) -> float:
    """Return the time that the compilation of a small reference function takes [s]."""
    times = []
    for _ in range(repeats + 1):
        start = perf_counter()
        numba.njit("void(f8[:,::1], f8[::1])", **KERNEL_OPTIONS)(_eliminate)
        times.append(perf_counter() - start)
    return sorted(times[1:])[repeats // 2]  # the first one loads the compiler as well


def _eliminate(a: Any, b: Any) -> None:
    """Solve a x = b by elimination without pivots, x in place of b; only to be compiled."""
    n = len(b)
    for k in range(n):
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            for j in range(k, n):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]


def cache_folders() -> list[Path]:
    """Return the folders of the code of all functions that were declared."""
    return sorted({Path(each.cache_path) for each in _declared})


def count_cached_functions() -> int:
    """Count the functions that were declared and whose code on disk is that of their sources."""
    return sum(each.is_stored for each in _declared)


def find_damaged_files() -> list[Path]:
    """Return the files of compiled code that cannot be read or have no valid checksum."""
    damaged = []
    for path in (path for folder in cache_folders() for path in folder.glob("*.nb[ic]")):
        try:
            intact = _is_intact(path)
        except FileNotFoundError:  # another process has deleted it
            continue
        except OSError:
            intact = False
        damaged += [] if intact else [path]
    return damaged


def delete_damaged_files() -> None:
    """Delete damaged files of compiled code; those in use are replaced by the next compilation."""
    for path in find_damaged_files():
        with suppress(OSError):  # a folder, or read-only
            path.unlink()


@cache
def source_digest() -> str:
    """Compute a digest of the names and contents of all modules with compiled functions."""
    digest = hashlib.sha256()
    for path in sorted(path for folder in SOURCE_FOLDERS for path in folder.glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
