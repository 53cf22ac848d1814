"""The controller's stages tick by tick: when each begins, from where to where targets go, and that nothing leads out of the end."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import tracking
from clips import load_reference
from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking import Measurement, Runner, motion_of, read_contract
from tracking.deploy.guard import Guard
from tracking.deploy.messages import State
from tracking.deploy.robot_limits import RobotLimits
from tracking.deploy.stages import Controller, Stage, StageConfig

FOLDER = Path(tracking.__file__).parent / "policies" / "groove-g1"
FRAMES, DT = 6, 0.02
ROBOT = RobotLimits.of(load_robot("g1"))
CONFIG = StageConfig(damping_s=0.06, rise_s=0.2, stand_s=0.1)


@pytest.fixture(scope="module")
def parts():
    contract = read_contract(FOLDER / "contract.json")
    motion = motion_of(load_reference(FOLDER / "reference.npz"), contract)
    tables = (
        "root_lin_vel",
        "root_ang_vel",
        "joint_pos",
        "joint_vel",
        "root_pos",
        "root_quat",
        "anchor_pos",
        "anchor_quat",
        "targets",
    )
    return contract, dataclasses.replace(
        motion, **{k: getattr(motion, k)[:FRAMES] for k in tables}, last=np.full(FRAMES, FRAMES - 1), start=0
    )


@pytest.fixture
def make(parts):
    contract, motion = parts

    def controller(config=CONFIG, policy=lambda seen: np.zeros((len(seen), 29))):
        return Controller(Runner(contract, policy, motion), Guard(ROBOT), config)

    return controller


def resting(contract, joints=None, heading=0.0):
    return State(
        quat=rot.from_yaw(np.array(heading)), gyro=np.zeros(3), joint_vel=np.zeros(29), received=0.0,
        joint_pos=contract.default_joint_pos if joints is None else joints,
    )  # fmt: skip


def run(controller, joints=None, ticks=200, heading=0.0):
    """Stages and commands of a robot that follows nothing, until it is over."""
    seen = []
    while not seen or (seen[-1][0] is not Stage.OVER and len(seen) < ticks):
        state = resting(controller.runner.contract, joints, heading)
        command = controller.tick(state, 0.0, 0.0)
        seen.append((controller.stage, command))
    return seen


def lengths(seen):
    """Stages with the number of their ticks."""
    out = []
    for stage, _ in seen:
        if not out or out[-1][0] is not stage:
            out.append([stage, 0])
        out[-1][1] += 1
    return [tuple(x) for x in out]


@pytest.mark.parametrize("loops", [1, 3])
def test_each_stage_lasts_as_long_as_it_is_told_to(make, loops):
    controller = make(dataclasses.replace(CONFIG, loops=loops))
    seen = lengths(run(controller))
    stand, dance = (Stage.STAND, round((CONFIG.rise_s + CONFIG.stand_s) / DT)), (Stage.DANCE, FRAMES - 1)
    told = [(stage, count) for stage, count in seen]
    assert told[0] == (Stage.DAMPING, round(CONFIG.damping_s / DT) - 1)
    assert [s for s, _ in told[1:]] == [Stage.STAND, *[Stage.DANCE, Stage.STAND] * loops, Stage.OVER]
    for stage, count in told[1:-1]:
        assert abs(count - dict((stand, dance))[stage]) <= 1  # a tick belongs to the stage that it ends or begins
    assert controller.dances == loops and not controller.guard.tripped


def test_standing_leads_in_a_straight_line_from_where_the_joints_are_to_the_motions_first_pose(make, parts):
    contract, motion = parts
    joints = contract.default_joint_pos + 0.05 * np.cos(np.arange(29))
    targets = np.array([c.target for stage, c in run(make(), joints) if stage is Stage.STAND])
    first = targets[: round((CONFIG.rise_s + CONFIG.stand_s) / DT)]
    rise = round(CONFIG.rise_s / DT)
    np.testing.assert_array_equal(first[0], joints)
    np.testing.assert_allclose(first[rise:], np.tile(motion.joint_pos[0], (len(first) - rise, 1)), atol=1e-12)
    np.testing.assert_allclose(
        np.diff(first[: rise + 1], axis=0), np.tile((motion.joint_pos[0] - joints) / rise, (rise, 1)), atol=1e-12
    )


def test_every_stage_has_its_own_gains(make, parts):
    contract, _ = parts
    for stage, command in run(make()):
        if stage in (Stage.DAMPING, Stage.OVER):
            assert not command.kp.any() and (command.kd == ROBOT.stand_kd).all()
        else:
            kp, kd = (ROBOT.stand_kp, ROBOT.stand_kd) if stage is Stage.STAND else (contract.kp, contract.kd)
            np.testing.assert_array_equal(command.kp, kp)
            np.testing.assert_array_equal(command.kd, kd)


def test_the_dance_is_what_the_runner_alone_would_ask_for(make, parts):
    contract, motion = parts

    def policy(seen):
        return 0.1 * np.tanh(seen[:, :29])

    targets = [c.target for stage, c in run(make(policy=policy)) if stage is Stage.DANCE]
    alone = Runner(contract, policy, motion)
    state = resting(contract)
    now = Measurement(**{k: getattr(state, k)[None] for k in ("quat", "gyro", "joint_pos", "joint_vel")})
    alone.start(now, 0)
    np.testing.assert_array_equal(targets, [alone.act(now)[0] for _ in targets])


@pytest.mark.parametrize("heading", [1.0, -3.0])
def test_every_way_to_face_is_the_dances_forwards(make, heading):
    """The heading is fixed when the dance begins: what is sent does not depend on it."""

    def policy(seen):
        return 0.1 * np.tanh(seen @ np.linspace(-1.0, 1.0, seen.shape[1] * 29).reshape(-1, 29))

    sent = [np.array([c.target for _, c in run(make(policy=policy), heading=h)]) for h in (0.0, heading)]
    np.testing.assert_allclose(sent[0], sent[1], atol=1e-5)  # the network sees float32


@pytest.mark.parametrize("at", [0, 5, 20])
def test_a_stop_in_any_stage_is_damping_at_the_next_tick_and_for_good(make, at):
    controller = make()
    run(controller, ticks=at) if at else None
    controller.stop("enough")
    for _ in range(3):
        assert not controller.tick(resting(controller.runner.contract), 0.0, 0.0).kp.any()
    assert controller.stage is Stage.OVER and controller.guard.tripped == "enough"


def test_what_is_over_is_damping_even_from_a_state_that_is_no_state(make):
    controller = make()
    run(controller)
    broken = State(
        quat=np.full(4, np.nan), gyro=np.zeros(3), joint_pos=np.zeros(2), joint_vel=np.zeros(2), received=-9.0
    )
    command = controller.tick(broken, 0.0, 0.0)
    assert np.isfinite(command.target).all() and not command.kp.any() and len(command.target) == 29
    controller.guard.reset()
    assert not controller.tick(resting(controller.runner.contract), 0.0, 0.0).kp.any()  # nor does a reset begin it anew


def test_no_time_of_damping_and_none_of_standing_still_stand_once(make):
    seen = lengths(run(make(StageConfig(damping_s=0.0, rise_s=DT, stand_s=0.0))))
    assert [s for s, _ in seen] == [Stage.STAND, Stage.DANCE, Stage.STAND, Stage.OVER]


@pytest.mark.parametrize("end", [0, -1], ids=["begins", "ends"])
@pytest.mark.parametrize("pose", ["sits", "lies"])
def test_a_motion_that_is_on_the_floor_at_an_end_is_no_motion_for_a_robot(parts, end, pose):
    contract, motion = parts
    root_pos, root_quat = motion.root_pos.copy(), motion.root_quat.copy()
    root_pos[end, 2] = 0.2 if pose == "sits" else root_pos[end, 2]
    root_quat[end] = root_quat[end] if pose == "sits" else rot.exp(np.array([0.0, 1.5, 0.0]))
    low = dataclasses.replace(motion, root_pos=root_pos, root_quat=root_quat)
    with pytest.raises(tracking.TrackingError, match="begins" if end == 0 else "ends"):
        Controller(Runner(contract, lambda seen: np.zeros((len(seen), 29)), low), Guard(ROBOT), CONFIG)
