"""Modules that all workers share: the fork server of `multiprocessing` imports this one once.

Importing it changes the process, so no other module may import it. Neither threads nor MPI may be
started here, since they do not survive a fork; PETSc is left to the workers that need it.
"""

import gc
import os
import signal
import threading

# Libraries read these variables when they are loaded, hence before the other imports.
os.environ |= {
    **{f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")},
    "OMPI_MCA_ess_singleton_isolated": "1",  # no daemon of Open MPI beside each worker
    "JE_ARROW_MALLOC_CONF": "background_thread:false",  # no thread of pyarrow's allocator
}
signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the driver, which ends the workers
gc.disable()

from tqdm import tqdm  # noqa: E402

import archfem.studies.process_pool  # noqa: E402, F401  (with it all modules that workers use)
from archfem._numba import load_only  # noqa: E402
from archfem.dynamics.warm_up import compile_variant  # noqa: E402

tqdm.monitor_interval = 0  # no thread that refreshes progress bars
tqdm.set_lock(threading.RLock())  # a lock of each worker: a killed one would keep a shared lock
with load_only():  # on a first day workers compile what their points need
    compile_variant("compliance, Conserving")
gc.freeze()  # the collector would write to the loaded objects, whose pages workers share
gc.enable()
