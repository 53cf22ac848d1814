"""From policy to wire: every way to damping by injecting its fault, the stages on a simulated robot, and the wire itself."""

import dataclasses
import json
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

import cli.deploy
from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.deploy.guard import Guard, GuardConfig
from tracking.deploy.loop import perform
from tracking.deploy.messages import Command, State
from tracking.deploy.outlet import DryOutlet
from tracking.deploy.rehearsal.robot import SimulatedBody
from tracking.deploy.robot_limits import RobotLimits
from tracking.deploy.stages import Controller, Stage, StageConfig
from tracking.policy.bundle import read_runner
from tracking.policy.gains import standing_gains

ROBOT = RobotLimits.of(load_robot("g1"))
pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere


@pytest.fixture(scope="module")
def folder_and_runner(request):
    from pathlib import Path

    return read_runner(Path("groove-g1"))


@pytest.fixture
def runner(folder_and_runner):
    return folder_and_runner[1]


def resting(contract, **changes):
    j = len(contract.joint_names)
    still = {
        "quat": np.array([1.0, 0, 0, 0]), "gyro": np.zeros(3), "joint_pos": contract.default_joint_pos.copy(),
        "joint_vel": np.zeros(j), "received": 10.0,
    }  # fmt: skip
    return State(**still | changes)


def one(array, value, at=3):
    out = np.array(array, dtype=float)
    out[at] = value
    return out


FAULTS = {
    "tilt": lambda c: {"quat": rot.exp(np.array([1.1, 0.0, 0.0]))},
    "joint speed: left_knee_joint": lambda c: {"joint_vel": one(np.zeros(29), 1.1 * c.velocity[3])},
    "joint position: left_knee_joint": lambda c: {"joint_pos": one(c.default_joint_pos, c.upper[3] + 0.2)},
    "stale state": lambda c: {"received": 9.8},
    "corrupt state: numbers": lambda c: {"gyro": np.array([0.0, np.nan, 0.0])},
    "corrupt state": lambda c: {"quat": np.array([0.5, 0.0, 0.0, 0.0])},
    "state of 12 joints": lambda c: {"joint_pos": np.zeros(12), "joint_vel": np.zeros(12)},
}


@pytest.mark.parametrize("said", FAULTS)
def test_a_state_that_is_wrong_becomes_damping_and_stays_so_until_a_person_resets(runner, said):
    c, guard = runner.contract, Guard(ROBOT)
    controller = Controller(runner, guard)
    good, bad = resting(c), resting(c, **FAULTS[said](c))
    assert controller.tick(good, 10.0, 10.0) and not guard.tripped
    command = controller.tick(bad, 10.02, 10.02 if said != "stale state" else 10.0)
    assert said in guard.tripped and controller.stage is Stage.OVER
    again = controller.tick(dataclasses.replace(good, received=10.04), 10.04, 10.04)
    for c in (command, again):
        assert not c.kp.any() and (c.kd > 0.0).all() and np.isfinite(c.target).all()
    assert said in guard.tripped
    guard.reset()
    assert guard.state(dataclasses.replace(good, received=10.06), 10.06, 10.06)


def test_a_late_tick_becomes_damping(runner):
    controller = Controller(runner, Guard(ROBOT))
    controller.tick(resting(runner.contract), 10.0, 10.0)
    assert not controller.tick(resting(runner.contract, received=10.15), 10.15, 10.02).kp.any()
    assert "late tick" in controller.guard.tripped


def test_a_persons_stop_is_damping(runner):
    controller = Controller(runner, Guard(ROBOT))
    controller.stop("stopped by a person")
    assert not controller.tick(resting(runner.contract), 10.0, 10.0).kp.any() and controller.stage is Stage.OVER


@pytest.mark.parametrize(
    ("action", "said"),
    [(np.nan, "non-finite action"), (40.0, "target jump|torque estimate"), (-40.0, "target jump|torque")],
)
def test_an_action_that_is_wrong_never_reaches_the_wire(runner, action, said):
    import re

    c = runner.contract
    wild = type(runner)(
        dataclasses.replace(c, target_lower=c.lower - 50.0, target_upper=c.upper + 50.0),
        lambda seen: np.full((len(seen), 29), action), runner.motion,
    )  # fmt: skip
    controller = Controller(wild, Guard(ROBOT), StageConfig(damping_s=0.02, rise_s=0.02, stand_s=0.02))
    sent, state = [], resting(c)
    for k in range(8):
        now = 10.0 + 0.02 * k
        sent.append(controller.tick(dataclasses.replace(state, received=now), now, now))
    assert re.search(said, controller.guard.tripped)
    assert all(np.isfinite(s.target).all() for s in sent) and not sent[-1].kp.any()
    reach = np.abs([s.target - c.default_joint_pos for s in sent]).max()
    assert reach < 1.0  # none of the wild targets came through


def test_a_jump_between_two_ticks_is_caught_where_each_target_alone_would_pass(runner):
    c, guard = runner.contract, Guard(ROBOT, GuardConfig(torque=100.0))
    state, step = resting(c), np.zeros(29)
    step[5] = 2.5 * c.effort[5] / c.kp[5]
    assert guard.command(Command(target=c.default_joint_pos, kp=c.kp, kd=c.kd), state, 10.0)
    assert not guard.command(Command(target=c.default_joint_pos + step, kp=c.kp, kd=c.kd), state, 10.02)
    assert "target jump: left_ankle_roll_joint" in guard.tripped


class Simulated:
    """A wire that ends in a simulated robot; time goes as the ticks do."""

    def __init__(self, robot):
        self.body, self.sent, self.command = SimulatedBody(robot), [], None

    def read(self):
        q, v = self.body.qpos, self.body.qvel
        return State(quat=q[3:7], gyro=v[3:6], joint_pos=q[7:], joint_vel=v[6:], received=time.monotonic())

    def write(self, command):
        self.sent.append(command)
        if command.kp.any() or any(c.kp.any() for c in self.sent):  # on the gantry until then
            for _ in range(10):
                self.body.step(command.kp, command.kd, command.target)


def test_the_stages_lead_through_the_whole_dance_and_the_robot_stands_at_the_end(runner):
    robot = load_robot("g1")
    transport = Simulated(robot)
    controller = Controller(runner, Guard(ROBOT), StageConfig(damping_s=0.1, rise_s=1.0, stand_s=0.5))
    seen, now = [], 0.0
    while controller.stage is not Stage.OVER:
        state = dataclasses.replace(transport.read(), received=now)
        transport.write(controller.tick(state, now, now))
        if not seen or seen[-1] is not controller.stage:
            seen.append(controller.stage)
        if controller.stage is not Stage.OVER:
            last = transport.body.qpos
        now += 0.02
    assert seen == [Stage.DAMPING, Stage.STAND, Stage.DANCE, Stage.STAND, Stage.OVER]
    assert not controller.guard.tripped and controller.dances == 1
    assert last[2] > 0.9 * robot.default_qpos[2] and abs(last[3]) > 0.9
    assert now - 0.1 - 2 * 1.5 == pytest.approx(12.6, abs=0.1)  # lead-in, dance and lead-out


def test_standing_gains_stand_and_the_policys_alone_do_not():
    robot = load_robot("g1")
    heights = []
    for kp, kd in (standing_gains(robot), (robot.kp, robot.kd)):
        body = SimulatedBody(robot)
        for _ in range(2000):
            body.step(kp, kd, robot.default_joint_pos)
        heights.append(body.qpos[2] / robot.default_qpos[2])
    assert heights[0] > 0.98 and heights[1] < 0.7


def test_a_new_stage_does_not_reset_what_has_tripped(runner):
    controller = Controller(runner, Guard(ROBOT))
    controller.stop("stopped by a person")
    controller._enter(Stage.DANCE, resting(runner.contract))
    assert controller.guard.tripped == "stopped by a person"


def test_a_dry_run_sends_nothing(runner):
    transport = Simulated(load_robot("g1"))
    controller = Controller(runner, Guard(ROBOT), StageConfig(damping_s=0.1, rise_s=0.1, stand_s=0.1))
    stopped = lambda: "enough" if controller.stage is Stage.DANCE else ""  # noqa: E731
    done = perform(controller, transport, DryOutlet(), stopped=stopped, linger_s=0.0)
    assert len(done.ticks) > 10 and not transport.sent and done.tripped == "enough"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["groove-g1", "--interface", "eth0", "--send"], "--i-stand-clear"),
        (["groove-g1", "--interface", "eth0", "--rehearse"], "loopback alone"),
        (["groove-g1", "--fault", "tilt"], "without a rehearsal"),
        (["groove-g1", "--rehearse", "--fault", "boredom"], "one of tilt"),
        (["groove-g1", "--recording", "a.rrd"], "--rehearse"),
        (["groove-g1", "--loops", "-1"], "positive"),
        (["groove-g1", "--stand", "nan"], "positive"),
        (["groove-g1", "--rehearse", "--fault", "tilt", "--fault-after", "nan"], "positive"),
    ],
)
def test_what_could_move_a_robot_by_mistake_is_refused(words, said, capsys):
    assert cli.deploy.main(words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("gone", ["contract.json", "policy.onnx", "reference.npz", "golden.npz"])
def test_a_missing_file_is_an_error_before_any_wire_is_opened(gone, tmp_path, folder_and_runner, monkeypatch, capsys):
    import shutil

    import tracking.deploy.transport

    monkeypatch.setattr(tracking.deploy.transport, "_interface", lambda *_: pytest.fail("a wire was opened"))
    shutil.copytree(folder_and_runner[0], tmp_path / "b")
    (tmp_path / "b" / gone).unlink()
    assert cli.deploy.main([str(tmp_path / "b")]) == 2
    assert gone in capsys.readouterr().err


def test_a_network_interface_that_is_not_there_is_refused_with_those_that_are(capsys):
    pytest.importorskip("unitree_interface")
    assert cli.deploy.main(["groove-g1", "--interface", "nosuch0"]) == 2
    assert "one of lo" in capsys.readouterr().err


def test_a_robot_of_another_kind_is_refused(capsys):
    pytest.importorskip("unitree_interface")
    assert cli.deploy.main(["groove-dancer"]) == 2
    assert "contract, robot: found dancer" in capsys.readouterr().err


@pytest.mark.slow
def test_a_rehearsal_over_the_robots_own_messages(tmp_path):
    pytest.importorskip("unitree_interface")
    words = ["groove-g1", "--rehearse", "--json", str(tmp_path / "r.json")]
    script = f"import sys, cli.deploy; sys.exit(cli.deploy.main({words!r}))"
    for _ in range(3):  # a machine that stands still for 0.1 s trips the guard, as it should
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=120)
        told = json.loads((tmp_path / "r.json").read_text())
        if not told["stopped by"].startswith(("stale", "late")):
            break
    assert done.returncode == 0, (told, done.stdout, done.stderr)
    assert not told["fell"] and told["messages with a bad CRC"] == 0 and told["dances finished"] == 1
    assert 19.0 < told["command period p50, p99, max [ms]"][0] < 21.0
