"""How a run hears that it shall stop."""

import signal
import threading

import pytest

from tracking.training.stop_signals import Signals

BOTH = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture(autouse=True)
def handlers():
    """Whatever a test does to them, they are as before."""
    before = {s: signal.getsignal(s) for s in BOTH}
    yield before
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("which", BOTH)
def test_the_first_signal_is_kept_and_interrupts_nothing(which, handlers):
    with Signals() as signals:
        assert not signals.came
        signal.raise_signal(which)
        assert signals.came.startswith(f"stopped by {which.name}") and "can be resumed" in signals.came
    assert {s: signal.getsignal(s) for s in BOTH} == handlers


@pytest.mark.parametrize("first", BOTH)
def test_a_second_ctrl_c_interrupts_at_once_and_the_handlers_come_back(first, handlers):
    with pytest.raises(KeyboardInterrupt), Signals() as signals:
        signal.raise_signal(first)
        signal.raise_signal(signal.SIGINT)
    assert signals.came.startswith(f"stopped by {first.name}")
    assert {s: signal.getsignal(s) for s in BOTH} == handlers


def test_a_second_sigterm_is_patient():
    with Signals() as signals:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)
    assert signals.came


def test_an_error_inside_passes_and_leaves_the_handlers_as_they_were(handlers):
    with pytest.raises(ValueError, match="mine"), Signals():
        raise ValueError("mine")
    assert {s: signal.getsignal(s) for s in BOTH} == handlers


def test_one_inside_another_hears_alone_and_then_the_outer_one_again():
    with Signals() as outer:
        with Signals() as inner:
            signal.raise_signal(signal.SIGTERM)
        assert inner.came and not outer.came
        signal.raise_signal(signal.SIGTERM)
        assert outer.came


def test_in_another_thread_it_listens_to_nothing_and_breaks_nothing(handlers):
    seen = []

    def work():
        with Signals() as signals:
            seen.append((signals.came, {s: signal.getsignal(s) for s in BOTH}))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [("", handlers)]
