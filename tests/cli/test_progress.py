import pytest

from cli.shell import progress_bar as progress


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test sets."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


@pytest.mark.parametrize("before", [0, 6000])
def test_the_time_to_go_counts_only_what_was_done_in_this_run(clock, capsys, before):
    with progress.progress("steps") as tell:
        tell("train", before, 9000)
        clock[0] = 20.0
        tell("train", before + 500, 9000, "standing")
    left = (9000 - before - 500) / 25.0  # 500 in 20 s
    assert capsys.readouterr().err == f"train: {before + 500}/9000 steps, {left:.0f} s to go, standing\n"
