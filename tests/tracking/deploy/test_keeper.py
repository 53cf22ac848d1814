"""The keeper and the controller's way through it: what passes, what ends it, and that nothing stiff follows a trip."""

import contextlib
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from robot_models import load_robot
from tracking import TrackingError
from tracking.deploy.keeper import FADE, LINGER, SILENCE, TRIP, Keeper, keep, packed
from tracking.deploy.messages import Command, State
from tracking.deploy.outlet import DryOutlet, KeptOutlet
from tracking.deploy.robot_limits import RobotLimits

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

ROBOT = RobotLimits.of(load_robot("g1"))
REST = ROBOT.robot.default_joint_pos
STIFF = Command(target=REST + 0.1, kp=ROBOT.stand_kp, kd=ROBOT.stand_kd)
STATE = State(
    quat=np.array([1.0, 0, 0, 0]), gyro=np.zeros(3), joint_pos=REST + 0.2, joint_vel=np.zeros(29), received=0.0
)


def told(command=STIFF):
    return packed(command, STATE.joint_pos)


def test_a_command_goes_out_once_and_as_it_was_sent():
    keeper = Keeper(ROBOT)
    assert keeper.command(0.0) is None  # nothing is said before the first
    keeper.hear(told(), 0.001)
    out = keeper.command(0.002)
    for name in ("target", "kp", "kd"):
        np.testing.assert_array_equal(getattr(out, name), getattr(STIFF, name))
    assert keeper.command(0.004) is None  # the SDK repeats it


@pytest.mark.parametrize("ending", [b"", TRIP + b"enough", b"?", b"C" + bytes(8), "not finite", "silence"])
def test_whatever_ends_it_nothing_chosen_before_goes_out_and_stiffness_only_falls(ending):
    keeper = Keeper(ROBOT)
    keeper.hear(told(), 1.0)
    assert keeper.command(1.0) is not None
    at = 1.0 + SILENCE + 1e-3 if ending == "silence" else 1.01
    if ending != "silence":
        keeper.hear(told(), at)  # chosen, not yet gone out
        bad = told(Command(target=np.full(29, np.nan), kp=STIFF.kp, kd=STIFF.kd))
        keeper.hear(bad if ending == "not finite" else ending, at)
    out = [keeper.command(at + k * 0.002) for k in range(int(FADE / 0.002) + 3)]
    keeper.hear(told(), at + 1.0)  # and nothing heals it
    out += [keeper.command(at + 1.0 + k) for k in range(5)]
    assert keeper.tripped and all(o is not None for o in out)
    stiffness = [o.kp.max() for o in out]
    assert stiffness == sorted(stiffness, reverse=True) and stiffness[-6:] == [0.0] * 6
    for o in out:
        assert (
            o.target == STATE.joint_pos
        ).all() or not o.kp.any()  # where the joints were, never where they should go
        np.testing.assert_array_equal(o.kd, ROBOT.stand_kd)


def test_the_first_reason_stays():
    keeper = Keeper(ROBOT)
    keeper.hear(TRIP + b"first", 0.0)
    keeper.hear(b"", 0.1)
    assert keeper.tripped == "first"


def test_a_robot_that_was_never_told_anything_stays_so():
    keeper = Keeper(ROBOT)
    keeper.hear(b"", 0.0)
    assert keeper.command(1.0) is None


def test_where_the_joints_are_unknown_damping_is_immediate():
    keeper = Keeper(ROBOT)
    keeper.hear(packed(STIFF, np.full(29, np.nan)), 0.0)
    keeper.command(0.0)
    keeper.hear(TRIP + b"x", 0.0)
    assert not keeper.command(0.0).kp.any()


def test_no_word_of_the_controllers_gets_past_the_robots_limits(rng):
    keeper, robot = Keeper(ROBOT), ROBOT.robot
    for scale in (1.0, 1e3, 1e9):
        target, kp, kd = scale * rng.normal(size=(3, 29))
        keeper.hear(told(Command(target=target, kp=kp, kd=kd)), 0.0)
        out = keeper.command(0.0)
        reach = robot.effort / ROBOT.kp_band[0]
        assert (out.target <= robot.upper + reach).all() and (out.target >= robot.lower - reach).all()
        assert (out.kp >= 0).all() and (out.kp <= np.maximum(ROBOT.kp_band[1], ROBOT.stand_kp)).all()
        assert (out.kd >= 0).all() and (out.kd <= np.maximum(ROBOT.kd_band[1], ROBOT.stand_kd)).all()


@pytest.fixture
def patient(monkeypatch):
    """A machine that stands still for a moment is no process that hangs; a second is."""
    import tracking.deploy.keeper as keeper
    import tracking.deploy.outlet as outlet

    monkeypatch.setattr(keeper, "SILENCE", 1.0)
    monkeypatch.setattr(outlet, "_HANGING", 1.0)


class Wire:
    """What a keeper writes, with times."""

    def __init__(self):
        self.sent = []

    def write(self, command):
        self.sent.append((time.monotonic(), command))


class Process:
    """A keeper's process that can only be killed."""

    killed = False

    def poll(self):
        return None

    def kill(self):
        self.killed = True


@contextlib.contextmanager
def keeping(wire):
    """A keeper on a thread, and our end of its socket."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    import tracking.deploy.keeper as module

    kept, module._ENDINGS = module._ENDINGS, ()  # a thread may not listen to signals
    thread = threading.Thread(target=keep, args=(its, wire, ROBOT))
    thread.start()
    try:
        yield ours, thread
    finally:
        ours.close()
        thread.join(LINGER + 5.0)
        module._ENDINGS = kept
        its.close()


def outlet_to(ours, wire):
    outlet = KeptOutlet(Process(), ours, wire, ROBOT)
    outlet.wait_until_ready()
    return outlet


@pytest.mark.usefixtures("patient")
def test_a_performance_through_the_keeper_ends_at_a_word():
    through, past = Wire(), Wire()
    with keeping(through) as (ours, thread):
        outlet = outlet_to(ours, past)
        for _ in range(5):
            outlet.write(STIFF, STATE)
            time.sleep(0.01)
        assert outlet.complaint() == ""
        outlet.end()
        thread.join(2.0)
        assert not thread.is_alive()
    assert not past.sent
    assert [bool(c.kp.any()) for _, c in through.sent[:5]] == [True] * 5 and len(through.sent) > 5
    assert all((c.target == STATE.joint_pos).all() or not c.kp.any() for _, c in through.sent[5:])
    assert not through.sent[-1][1].kp.any()  # the last word is damping


def test_a_socket_that_closes_is_damping_for_as_long_as_a_robot_needs_to_sink():
    through = Wire()
    with keeping(through) as (ours, _):
        outlet_to(ours, Wire()).write(STIFF, STATE)
        time.sleep(0.02)
    first = next(at for at, c in through.sent if not c.kp.any())
    assert through.sent[-1][0] - first > 0.8 * LINGER
    assert all(not c.kp.any() for at, c in through.sent if at >= first)


@pytest.mark.usefixtures("patient")
def test_what_the_keeper_stops_for_reaches_the_controller():
    with keeping(Wire()) as (ours, _):
        outlet = outlet_to(ours, Wire())
        outlet.write(STIFF, STATE)
        time.sleep(1.3)
        outlet.complaint()  # what waited while nobody listened
        time.sleep(0.1)
        assert outlet.complaint().startswith("no command for")


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize("how", ["dies", "hangs"])
def test_a_keeper_that_is_no_more_is_killed_and_the_robot_damped_past_it(how):
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    its.send(b"A")
    past = Wire()
    outlet = outlet_to(ours, past)
    outlet.write(STIFF, STATE)
    assert not past.sent and outlet.complaint() == ""
    if how == "dies":
        its.close()
    else:
        time.sleep(1.2)
    assert ("died" if how == "dies" else "hung") in outlet.complaint()
    assert outlet._process.killed
    outlet.write(STIFF, STATE)
    outlet.trip("x")
    assert len(past.sent) == 2 and all(not c.kp.any() for _, c in past.sent)
    ours.close()
    its.close()


@pytest.mark.usefixtures("patient")
def test_a_keeper_that_takes_nothing_any_more_is_found_out_before_its_queue_is_drained():
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    its.send(b"A")
    past = Wire()
    outlet = outlet_to(ours, past)
    its.setblocking(False)
    for _ in range(2000):
        with contextlib.suppress(BlockingIOError):
            its.send(b"A")  # it beats, and does not read
        outlet.write(STIFF, STATE)
    assert past.sent and outlet._process.killed and "no more" in outlet.complaint()
    ours.close()
    its.close()


def test_a_keeper_that_does_not_begin_is_an_error():
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    with pytest.raises(TrackingError, match="no sign of life"), its:
        KeptOutlet(dead, ours, Wire(), ROBOT).wait_until_ready()
    ours.close()
    its.close()


def test_a_keeper_that_never_began_leads_to_no_command_of_ours():
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    past = Wire()
    outlet = KeptOutlet(Process(), ours, past, ROBOT)
    its.close()
    outlet.trip("it never came")
    outlet.write(STIFF, STATE)
    assert not past.sent  # nobody had commanded this robot
    ours.close()


def test_a_keeper_that_does_not_end_is_killed_and_the_robot_damped_for_a_while(monkeypatch):
    import tracking.deploy.outlet as module

    class Stuck(Process):
        def wait(self, seconds):
            raise subprocess.TimeoutExpired("keeper", seconds)

    monkeypatch.setattr(module, "LINGER", 0.05)
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    its.send(b"A")
    past = Wire()
    outlet = KeptOutlet(Stuck(), ours, past, ROBOT)
    outlet.wait_until_ready()
    outlet.write(STIFF, STATE)
    outlet.see_off()
    assert outlet._process.killed and len(past.sent) == 1 and not past.sent[0][1].kp.any()
    ours.close()
    its.close()


def test_a_dry_run_tells_which_joints_move():
    said = []
    outlet = DryOutlet(ROBOT.joint_names, said.append)
    outlet.write(STIFF, STATE)
    assert "deg" in said[0] and "roll +0 pitch +0" in said[0] and outlet.complaint() == ""


def test_no_outlet_says_and_sends_nothing():
    outlet = DryOutlet()
    outlet.write(STIFF, STATE)
    outlet.trip("x")
    assert outlet.complaint() == ""
