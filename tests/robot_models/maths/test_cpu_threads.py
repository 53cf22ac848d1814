"""As many threads as the process may use, not as many as the machine has."""

import os

import pytest

from robot_models.maths.threads import available_threads


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="only Linux ties processes to cores")
def test_a_process_tied_to_one_core_has_one_thread():
    allowed = os.sched_getaffinity(0)
    assert available_threads() == len(allowed)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert available_threads() == 1
    finally:
        os.sched_setaffinity(0, allowed)


def test_where_nobody_can_tell_there_is_at_least_one(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert available_threads() == 1
