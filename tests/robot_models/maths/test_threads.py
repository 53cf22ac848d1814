"""Linear algebra runs on one thread where the library says so, and on as many as before afterwards."""

import subprocess
import sys

SCRIPT = """
from threadpoolctl import threadpool_info
from clips import cut, read_clip
from retarget import retarget
from robot_models import load_robot

def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

import scipy.linalg
before, during = threads(), set()
clip = cut(read_clip("clips/samples/groove.bvh"), 0.0, 1.0)
retarget(clip, load_robot("dancer"), progress=lambda *_: during.update(threads()))
print(before, during, threads())
"""


def test_the_library_itself_keeps_its_solver_on_one_thread(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")  # as on a machine of two cores, whatever this one is
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[0] == "{2} {1} {2}"


def test_blocks_of_two_threads_that_overlap_leave_blas_as_it_was():
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info

    from robot_models.maths.threads import one_blas_thread

    def counts():
        return [p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas"]

    before = counts()
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)  # the first to come leaves first: the limit holds for the other
    assert set(counts()) == {1}
    second.__exit__(None, None, None)
    assert counts() == before
