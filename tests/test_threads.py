"""Linear algebra takes one thread in any environment, and so gives the same bits."""

import os
import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import archfem as af
from archfem._threads import single_threaded

WORK = """
import hashlib
import archfem as af
quake = af.Motion.synthetic(duration=2.0, pga=6.0, seed=3)
ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
for fidelity, method in (("full", "newton"), ("faces", "newton"), ("full", "compliance")):
    model = af.build(ring, fidelity=fidelity, cells=(4, 4))
    given = {"dt": 0.005, "damping": af.Rayleigh(0.05, (8.0, 16.0)), "method": method}
    run = af.time_history(model, quake, **given)
    bits = b"".join(run.joints[name].values.tobytes() for name in ("N", "V", "M"))
    print(hashlib.sha256(bits).hexdigest())
"""


def threads():
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_a_decorated_function_takes_one_thread_and_restores_the_limit():
    inner = single_threaded(threads)
    with threadpool_limits(limits=2, user_api="blas"):
        assert threads() == {2}
        assert single_threaded(lambda: (inner(), threads()))() == ({1}, {1})
        assert threads() == {2}


def test_a_run_takes_one_thread():
    """An event of the run reads the number of threads."""
    seen = {}
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    af.dead_load(model)  # loads the libraries, of which each begins with a limit of its own
    with threadpool_limits(limits=2, user_api="blas"):
        af.time_history(
            model,
            af.Motion.synthetic(duration=0.3, pga=0.5),
            dt=0.01,
            until=lambda structure, resultants: seen.update(run=threads()),
        )
        assert threads() == {2}
    assert seen == {"run": {1}}


@pytest.mark.slow
def test_another_process_another_cache_and_two_threads_give_the_same_bits(tmp_path):
    found = set()
    for threads, cache in (("1", None), ("2", None), ("2", tmp_path)):
        variables = {"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        variables |= {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
        done = subprocess.run(
            [sys.executable, "-c", WORK],
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            check=True,
        )
        found.add(done.stdout)
    assert len(found) == 1
