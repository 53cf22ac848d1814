"""A performance's loop by itself: its clock, whom it obeys, and what it tells the outlet."""

from types import SimpleNamespace

import numpy as np
import pytest

import tracking.deploy.loop as module
from tracking import TrackingError
from tracking.deploy.loop import Performance, perform
from tracking.deploy.messages import Command, State
from tracking.deploy.outlet import DryOutlet
from tracking.deploy.stages import Stage

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

DT = 0.002
STATE = State(
    quat=np.array([1.0, 0, 0, 0]),
    gyro=np.zeros(3),
    joint_pos=np.zeros(2),
    joint_vel=np.zeros(2),
    received=0.0,
    rate=500.0,
)
STIFF = Command(target=np.ones(2), kp=np.ones(2), kd=np.ones(2))
SOFT = Command(target=np.zeros(2), kp=np.zeros(2), kd=np.ones(2))


class Script:
    """A controller that goes through its stages, so many ticks each."""

    def __init__(self, ticks=((Stage.DAMPING, 2), (Stage.DANCE, 4))):
        self.plan = [stage for stage, count in ticks for _ in range(count)]
        self.stage, self.dances, self.due, self.states = Stage.DAMPING, 0, [], []
        self.guard = SimpleNamespace(tripped="")
        self.runner = SimpleNamespace(contract=SimpleNamespace(control_dt=DT))

    def stop(self, reason):
        self.guard.tripped = self.guard.tripped or reason

    def tick(self, state, now, due):
        self.due.append(due)
        self.states.append(state)
        self.stage = self.plan.pop(0) if self.plan and not self.guard.tripped else Stage.OVER
        self.dances = int(self.stage is Stage.OVER)
        return STIFF if self.stage is Stage.DANCE else SOFT


class Tape:
    """Both ends of a wire: states to read, and an outlet that keeps what is written and can complain."""

    def __init__(self, states=(), complaints=()):
        self.sent, self.states, self.complaints, self.tripped = [], list(states), list(complaints), []

    def read(self):
        return self.states.pop(0) if self.states else STATE

    def write(self, command, state):
        self.sent.append(command)

    def trip(self, reason):
        self.tripped.append(reason)

    def complaint(self):
        return self.complaints.pop(0) if self.complaints else ""


def test_ticks_are_due_a_control_period_apart_and_every_command_is_sent():
    controller, tape, told = Script(), Tape(), []
    done = perform(controller, tape, tape, tell=lambda stage, dances: told.append((stage, dances)), linger_s=3 * DT)
    np.testing.assert_allclose(np.diff(controller.due), DT, rtol=1e-6)  # whatever each tick took
    assert [c is STIFF for c in tape.sent[:7]] == [False] * 2 + [True] * 4 + [False]
    assert len(tape.sent) == len(done.ticks) == len(done.thinking) == len(controller.due) > 7  # damping is repeated
    assert told == [(Stage.DAMPING, 0), (Stage.DANCE, 0), (Stage.OVER, 1)]
    assert [name for _, name in done.stages] == ["damping", "dance", "over"] and done.dances == 1
    assert (np.diff(done.ticks) > 0.0).all() and min(done.thinking) >= 0.0 and done.tripped == ""
    assert tape.tripped == ["the end"] and set(done.rates) == {500.0}


def test_where_no_new_state_comes_the_first_is_shown_again_for_the_guard_to_judge():
    controller = Script()
    perform(controller, Tape([None, STATE, *[None] * 500]), DryOutlet(), linger_s=0.0)
    assert set(map(id, controller.states)) == {id(STATE)}


@pytest.mark.parametrize("who", ["a person", "the keeper", "a lost parent"])
def test_whoever_asks_for_the_end_is_obeyed_in_the_same_tick(who, monkeypatch):
    controller, tape, asked = Script(((Stage.DANCE, 100),)), Tape(), iter([""] * 3 + ["enough"] * 100)
    if who == "the keeper":
        tape.complaints = list(asked)
    if who == "a lost parent":
        parents = iter([7] * 4 + [1] * 200)
        monkeypatch.setattr(module.os, "getppid", lambda: next(parents))
    stopped = (lambda: next(asked)) if who == "a person" else lambda: ""
    done = perform(controller, tape, tape, stopped=stopped, linger_s=0.0)
    assert [c is STIFF for c in tape.sent[:4]] == [True] * 3 + [False]
    assert done.tripped == ("the parent process is gone" if who == "a lost parent" else "enough")
    assert tape.tripped == [done.tripped]  # before the command that follows it


def test_a_keeper_that_ends_after_the_end_is_no_complaint():
    tape = Tape(complaints=[""] * 7 + ["the end"] * 50)
    assert perform(Script(), tape, tape, linger_s=5 * DT).tripped == ""


def test_a_wire_without_a_robot_is_an_error_with_the_cure(monkeypatch):
    monkeypatch.setattr(module, "_PATIENCE", 0.05)
    silent = Tape([None] * 1000)
    with pytest.raises(TrackingError, match=r"LowState.*rehearse"):
        perform(Script(), silent, silent)
    assert not silent.sent


@pytest.mark.parametrize("ticks", [[], [3.0]])
def test_no_two_commands_have_no_period(ticks):
    assert Performance(ticks=ticks).periods_ms() == (0.0, 0.0, 0.0)


def test_periods_are_in_milliseconds_and_do_not_care_when_it_began(rng):
    gaps = rng.uniform(0.015, 0.03, size=200)
    early, late = (Performance(ticks=list(t + np.cumsum(gaps))).periods_ms() for t in (0.0, 1e4))
    assert early == pytest.approx(late, abs=1e-6)
    assert early[0] <= early[1] <= early[2] == pytest.approx(1e3 * gaps[1:].max())
