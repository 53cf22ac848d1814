"""A process that tries what may come to grief: with a limit on its time and its memory, and nothing to lose."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

from robot_models.incoming.limits import CHILD_BYTES, CHILD_SECONDS

_BEGIN = """
import sys
try:
    import resource
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = int(sys.argv[1]) if hard == resource.RLIM_INFINITY else min(int(sys.argv[1]), hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except ImportError:
    pass  # no such limits on Windows
sys.argv = sys.argv[1:]
"""


def refusal_of_child(
    code: str, words: Sequence[str], *, memory: int = CHILD_BYTES, seconds: float = CHILD_SECONDS
) -> str:
    """Why a piece of Python did not end well in a process of its own; empty where it did.

    Args:
        code: it finds `words` in `sys.argv[1:]`.
        words: arguments.
        memory: most address space [bytes].
        seconds: most time, the interpreter's start included [s].
    """
    command = [
        sys.executable,
        "-P",
        "-c",
        _BEGIN + code,
        str(memory),
        *words,
    ]  # -P: nothing of the current folder is code
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds, check=False, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return f"did not end within {seconds:g} s"
    if done.returncode == 0:
        return ""
    said = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode < 0 or not said:
        return f"ended by signal {-done.returncode}, or out of {memory >> 20} MB of memory"
    return said[-1][:300]
