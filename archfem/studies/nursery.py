"""Workers, forked from one process that has imported and loaded once what all of them need.

The driver begins this process, the nursery, and sends it the socket of each worker that it wants;
the nursery forks one, which answers through that socket, and is asked later how it ended. Nothing
in it may have threads, or have begun MPI, which no fork outlives: PETSc is left to who needs it.
Once its driver is gone, the nursery ends its workers and then itself; should it be killed, the
kernel ends them.
"""

import ctypes
import gc
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import traceback
from array import array
from contextlib import suppress
from typing import IO, Any

import numpy as np
from tqdm import tqdm

from archfem.studies.warm import warm
from archfem.studies.worker import SINGLE, serve

TEND = "import gc; gc.disable(); from archfem.studies.nursery import tend; tend({})"

THREADLESS = {"JE_ARROW_MALLOC_CONF": "background_thread:false"}
"""Environment in which importing begins no threads: pyarrow's allocator would."""

DIE_WITH_PARENT = 1
"""Option of Linux's prctl: the signal that a process gets when its parent ends."""

QUIETLY = getattr(socket, "MSG_NOSIGNAL", 0)
"""Sends to who is gone without SIGPIPE, which ends a process where gmsh has been at work."""

SIZE = 8
"""Bytes of a message: a whole number."""


class Nursery:
    """A process from which workers are forked, seen by its driver.

    Args:
        words: file to which it and they write what they have to say.
    """

    def __init__(self, words: IO[Any]) -> None:
        self._control, theirs = socket.socketpair()
        path = os.pathsep.join(each or os.getcwd() for each in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-c", TEND.format(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env={**os.environ, **SINGLE, **THREADLESS, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=words,
            stderr=words,
            start_new_session=True,  # Ctrl-C is for the driver, which ends its workers
        )
        theirs.close()
        self._workers = 0

    def worker(self) -> tuple[int, socket.socket]:
        """Ask for a worker, without waiting for it.

        Returns:
            Its number, and the pipe to it, which is at its end where the process is gone.
        """
        ours, theirs = socket.socketpair()
        self._workers += 1
        handle = socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", [theirs.fileno()])
        with theirs, suppress(OSError):
            self._control.sendmsg([_message(self._workers)], [handle], QUIETLY)
        return self._workers, ours

    def buried(self, worker: int) -> int | None:
        """End a worker that has not ended, and return its exit code, less than 0 for a signal.

        Args:
            worker: its number.

        Returns:
            The code; None where the nursery is gone, and its workers with it.
        """
        with suppress(OSError):
            self._control.sendall(_message(worker), QUIETLY)
            if told := self._control.recv(SIZE):
                return _number(told)
        return None

    def end(self) -> int:
        """End all workers and the process, and return its exit code."""
        self._control.close()  # by which one that forks already ends
        self._process.terminate()  # by which one does that imports still
        return self._process.wait()


def tend(handle: int) -> None:
    """Fork workers for as long as somebody may ask for them: what the process does.

    Args:
        handle: of the socket to the driver.
    """
    ready()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    workers: dict[int, int] = {}
    with socket.socket(fileno=handle) as control, suppress(OSError):
        while told := socket.recv_fds(control, SIZE, 1):
            message, handles, *_ = told
            if not message:
                break
            if handles:
                workers[_number(message)] = _forked(control, handles[0])
            else:
                control.sendall(_message(_buried(workers.pop(_number(message)))))
    for process in workers.values():
        _buried(process)
    _leave(0)


def ready() -> None:
    """Load what points need, on one thread, and leave it out of all collecting of garbage."""
    tqdm.monitor_interval = 0  # no thread that looks after bars
    tqdm.set_lock(threading.RLock())  # none that siblings share
    warm()
    gc.freeze()
    gc.enable()


def _forked(control: socket.socket, handle: int) -> int:
    """Fork a worker that serves a socket, and return its process."""
    sys.stdout.flush()
    sys.stderr.flush()
    nursery = os.getpid()
    process = os.fork()
    if process:
        os.close(handle)
        return process
    code = 1
    try:
        control.close()
        os.dup(handle)  # so that the driver sees its end when the process has ended, not before
        _begin(nursery)
        serve(handle)
        code = 0
    except SystemExit as error:  # of a user's function
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        _leave(code)
    return 0


def _begin(nursery: int) -> None:
    """Make a forked process one of its own: chance, signals, and no life without its parent."""
    random.seed()
    np.random.seed()  # noqa: NPY002  (of users' functions, which else draw the same everywhere)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != nursery:  # which ended meanwhile
            os._exit(0)


def _leave(code: int) -> None:
    """End this process at once, without what its parent has registered for its own end."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code & 0xFF)


def _buried(process: int) -> int:
    """End a process unless it has ended, and return its exit code, less than 0 for a signal."""
    os.kill(process, signal.SIGKILL)  # it is waited for here alone: its number is still its own
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _message(number: int) -> bytes:
    return number.to_bytes(SIZE, "little", signed=True)


def _number(message: bytes) -> int:
    return int.from_bytes(message, "little", signed=True)
