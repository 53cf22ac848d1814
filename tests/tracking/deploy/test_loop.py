"""A performance's loop, outlet and watchdog, each by itself."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

import tracking.deploy.loop as module
from tracking.deploy.guard import Command, State
from tracking.deploy.loop import Performance, _CommandGate, _watchdog, perform
from tracking.deploy.stages import Stage

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

DT = 0.002
STATE = State(
    quat=np.array([1.0, 0, 0, 0]), gyro=np.zeros(3), joint_pos=np.zeros(2), joint_vel=np.zeros(2), received=0.0
)
STIFF = Command(target=np.ones(2), kp=np.ones(2), kd=np.ones(2))
SOFT = Command(target=np.zeros(2), kp=np.zeros(2), kd=np.ones(2))


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A machine that stands still for a moment is no loop that hangs."""
    monkeypatch.setattr(module, "_HANGING", 30.0)


class Script:
    """A controller that goes through its stages, so many ticks each."""

    def __init__(self, ticks=((Stage.DAMPING, 2), (Stage.DANCE, 4))):
        self.plan = [stage for stage, count in ticks for _ in range(count)]
        self.stage, self.dances, self.due, self.states = Stage.DAMPING, 0, [], []
        self.guard = SimpleNamespace(tripped="")
        self.runner = SimpleNamespace(contract=SimpleNamespace(control_dt=DT))

    def stop(self, reason):
        self.guard.tripped = self.guard.tripped or reason

    def damping(self):
        return SOFT

    def tick(self, state, now, due):
        self.due.append(due)
        self.states.append(state)
        self.stage = self.plan.pop(0) if self.plan and not self.guard.tripped else Stage.OVER
        self.dances = int(self.stage is Stage.OVER)
        return STIFF if self.stage is Stage.DANCE else SOFT


class Tape:
    """A wire that keeps what is written."""

    def __init__(self, states=()):
        self.sent, self.states = [], list(states)

    def read(self):
        return self.states.pop(0) if self.states else STATE

    def write(self, command):
        self.sent.append(command)


def test_ticks_are_due_a_control_period_apart_and_every_command_is_sent():
    controller, transport, told = Script(), Tape(), []
    done = perform(
        controller, transport, send=True, tell=lambda stage, dances: told.append((stage, dances)), linger_s=3 * DT
    )
    np.testing.assert_allclose(np.diff(controller.due), DT, rtol=1e-6)  # whatever each tick took
    assert [c is STIFF for c in transport.sent[:7]] == [False] * 2 + [True] * 4 + [False]
    assert (
        len(transport.sent) == len(done.ticks) == len(done.thinking) == len(controller.due) > 7
    )  # damping is repeated
    assert told == [(Stage.DAMPING, 0), (Stage.DANCE, 0), (Stage.OVER, 1)]
    assert [name for _, name in done.stages] == ["damping", "dance", "over"] and done.dances == 1
    assert (np.diff(done.ticks) > 0.0).all() and min(done.thinking) >= 0.0 and done.tripped == ""


def test_where_no_new_state_comes_the_first_is_shown_again_for_the_guard_to_judge():
    controller = Script()
    perform(controller, Tape([None, STATE, *[None] * 500]), send=True, linger_s=0.0)
    assert set(map(id, controller.states)) == {id(STATE)}


def test_a_person_who_stops_is_obeyed_in_the_same_tick():
    controller, transport, pressed = Script(((Stage.DANCE, 100),)), Tape(), iter([False] * 3 + [True] * 100)
    done = perform(controller, transport, send=True, stopped=lambda: next(pressed), linger_s=0.0)
    assert [c is STIFF for c in transport.sent[:4]] == [True] * 3 + [False]
    assert done.tripped == "stopped by a person"


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_however_the_loop_ends_the_last_word_is_damping(error):
    transport, calls = Tape(), iter(range(100))

    def stopped():
        if next(calls) == 3:
            raise error("mine")
        return False

    with pytest.raises(error):
        perform(Script(((Stage.DANCE, 100),)), transport, send=True, stopped=stopped)
    assert transport.sent[-1] is SOFT and transport.sent[-2] is STIFF
    assert threading.active_count() < 20


def test_an_outlet_without_a_wire_sends_nothing_and_after_a_trip_only_damping_passes():
    controller, transport = Script(), Tape()
    _CommandGate(controller, None).write(STIFF)
    gate = _CommandGate(controller, transport)
    gate.write(STIFF)
    controller.stop("x")
    gate.write(STIFF)
    assert transport.sent == [STIFF, SOFT]


def test_a_write_that_hangs_does_not_hold_back_another_for_long(monkeypatch):
    monkeypatch.setattr(module, "_HANGING", 0.02)
    free, controller = threading.Event(), Script()

    class Hanging(Tape):
        def write(self, command):
            self.sent.append(command)
            if command is STIFF:
                free.wait(5.0)

    transport = Hanging()
    gate = _CommandGate(controller, transport)
    first = threading.Thread(target=gate.write, args=(STIFF,))
    first.start()
    while not transport.sent:
        time.sleep(0.001)
    gate.write(SOFT)
    assert transport.sent == [STIFF, SOFT] and first.is_alive()
    free.set()
    first.join()
    gate.write(SOFT)  # the lock is free again
    assert len(transport.sent) == 3


def test_the_watchdog_damps_a_loop_that_hangs_and_is_still_when_it_is_told_to_end(monkeypatch):
    monkeypatch.setattr(module, "_HANGING", 0.03)
    controller, transport = Script(), Tape()
    alive = [time.monotonic() + 1e6]
    end = _watchdog(alive, controller, _CommandGate(controller, transport))
    time.sleep(0.05)
    assert not transport.sent and not controller.guard.tripped  # the loop is alive
    alive[0] = time.monotonic() - 1.0
    until = time.monotonic() + 5.0
    while not transport.sent and time.monotonic() < until:
        time.sleep(0.005)
    assert set(map(id, transport.sent)) == {id(SOFT)} and "hung" in controller.guard.tripped
    end.set()
    time.sleep(0.05)
    count = len(transport.sent)
    time.sleep(0.05)
    assert len(transport.sent) == count


@pytest.mark.parametrize("ticks", [[], [3.0]])
def test_no_two_commands_have_no_period(ticks):
    assert Performance(ticks=ticks).periods_ms() == (0.0, 0.0, 0.0)


def test_periods_are_in_milliseconds_and_do_not_care_when_it_began(rng):
    gaps = rng.uniform(0.015, 0.03, size=200)
    early, late = (Performance(ticks=list(t + np.cumsum(gaps))).periods_ms() for t in (0.0, 1e4))
    assert early == pytest.approx(late, abs=1e-6)
    assert early[0] <= early[1] <= early[2] == pytest.approx(1e3 * gaps[1:].max())
