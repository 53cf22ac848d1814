"""The guard: every limit on both of its sides, the first reason that stays, and a person's reset."""

import dataclasses

import numpy as np
import pytest

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.deploy.guard import Guard, GuardConfig
from tracking.deploy.messages import Command, State
from tracking.deploy.robot_limits import RobotLimits

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

C = load_robot("g1")
ROBOT = RobotLimits.of(C)
J, LIMITS = len(C.joint_names), GuardConfig()
INSIDE, BEYOND = 0.98, 1.02  # of a limit


def one(value, at, base=None):
    out = np.zeros(J) if base is None else base.copy()
    out[at] = value
    return out


def state(**changes):
    still = {
        "quat": np.array([1.0, 0, 0, 0]), "gyro": np.zeros(3), "joint_pos": C.default_joint_pos, "joint_vel": np.zeros(J),
        "received": 5.0,
    }  # fmt: skip
    return State(**(still | changes))


def command(target=None, kp=None, kd=None):
    return Command(
        target=C.default_joint_pos if target is None else target,
        kp=C.kp if kp is None else kp,
        kd=C.kd if kd is None else kd,
    )


def leaning(angle, direction=0.0, heading=0.0):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    return rot.multiply(rot.from_yaw(np.array(heading)), rot.exp(angle * axis))


STATES = {
    **{f"tilt to {d}": (lambda s, d=d: {"quat": leaning(s * LIMITS.tilt, d)}, "tilt") for d in (0.0, 1.0, -2.0)},
    "speed forwards": (lambda s: {"joint_vel": one(s * LIMITS.speed * C.velocity[4], 4)}, f"joint speed: {C.joint_names[4]}"),
    "speed backwards": (lambda s: {"joint_vel": one(-s * LIMITS.speed * C.velocity[9], 9)}, f"joint speed: {C.joint_names[9]}"),
    "above the range": (
        lambda s: {"joint_pos": one(C.upper[3] + s * LIMITS.beyond, 3, C.default_joint_pos)}, f"joint position: {C.joint_names[3]}"
    ),
    "below the range": (
        lambda s: {"joint_pos": one(C.lower[8] - s * LIMITS.beyond, 8, C.default_joint_pos)}, f"joint position: {C.joint_names[8]}"
    ),
    "old": (lambda s: {"received": 5.0 - s * LIMITS.stale}, "stale state"),
    "a long quaternion": (lambda s: {"quat": np.array([1.0 + 0.01 * s, 0, 0, 0])}, "corrupt state"),
    "a short quaternion": (lambda s: {"quat": np.array([1.0 - 0.01 * s, 0, 0, 0])}, "corrupt state"),
}  # fmt: skip


@pytest.mark.parametrize("what", STATES)
def test_a_state_just_inside_a_limit_passes_and_one_just_beyond_trips_by_name(what):
    change, said = STATES[what]
    guard = Guard(ROBOT)
    assert guard.state(state(**change(INSIDE)), 5.0, 5.0) and not guard.tripped
    assert not guard.state(state(**change(BEYOND)), 5.0, 5.0)
    assert guard.tripped.startswith(said)


def test_a_tick_just_in_time_passes_and_one_too_late_does_not():
    guard = Guard(ROBOT)
    assert guard.state(state(), 5.0, 5.0 - INSIDE * LIMITS.late)
    assert guard.state(state(), 5.0, 9.0)  # early is fine
    assert not guard.state(state(), 5.0, 5.0 - BEYOND * LIMITS.late) and guard.tripped.startswith("late tick")


@pytest.mark.parametrize("heading", [0.5, 3.1, -2.0])
def test_heading_is_no_tilt_and_a_quaternions_sign_no_turn(heading):
    for angle, fine in ((0.0, True), (INSIDE * LIMITS.tilt, True), (BEYOND * LIMITS.tilt, False), (np.pi, False)):
        for sign in (1.0, -1.0):
            assert Guard(ROBOT).state(state(quat=sign * leaning(angle, 0.3, heading)), 5.0, 5.0) is fine


@pytest.mark.parametrize("name", ["quat", "gyro", "joint_pos", "joint_vel"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_none_is_corrupt_wherever_it_stands(name, value):
    guard, broken = Guard(ROBOT), getattr(state(), name).copy()
    broken[-1] = value
    assert not guard.state(state(**{name: broken}), 5.0, 5.0) and guard.tripped.startswith("corrupt state")


@pytest.mark.parametrize("sizes", [(J - 1, J - 1), (J, J - 1), (J + 1, J + 1), (0, 0)])
def test_a_state_of_other_joints_is_refused(sizes):
    guard = Guard(ROBOT)
    assert not guard.state(state(joint_pos=np.zeros(sizes[0]), joint_vel=np.zeros(sizes[1])), 5.0, 5.0)
    assert f"the robot has {J}" in guard.tripped


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("how", ["spring", "damper"])
def test_a_command_may_ask_for_so_much_torque_and_no_more(sign, how):
    for share, fine in ((INSIDE, True), (BEYOND, False)):
        torque, guard = sign * share * LIMITS.torque * C.effort[6], Guard(ROBOT)
        if how == "spring":
            asked, now = command(one(C.default_joint_pos[6] + torque / C.kp[6], 6, C.default_joint_pos)), state()
        else:
            asked, now = command(), state(joint_vel=one(torque / C.kd[6], 6))
        assert guard.command(asked, now, 5.0) is fine
        assert fine or guard.tripped.startswith(f"torque estimate: {C.joint_names[6]}")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_target_may_jump_so_far_between_two_ticks_and_no_farther(sign):
    for share, fine in ((INSIDE, True), (BEYOND, False)):
        guard, step = Guard(ROBOT), sign * share * LIMITS.jump * C.effort[2] / C.kp[2]
        assert guard.command(command(), state(), 5.0)
        assert guard.command(command(one(C.default_joint_pos[2] + step, 2, C.default_joint_pos)), state(), 5.0) is fine
        assert fine or guard.tripped.startswith(f"target jump: {C.joint_names[2]}")


def test_jumps_are_from_the_command_before_not_from_the_first():
    guard, step = Guard(ROBOT), 0.9 * LIMITS.jump * C.effort[2] / C.kp[2]
    for k in (0, 1, 0, -1):
        assert guard.command(command(one(C.default_joint_pos[2] + k * step, 2, C.default_joint_pos)), state(), 5.0)
    assert not guard.command(command(one(C.default_joint_pos[2] + step, 2, C.default_joint_pos)), state(), 5.0)


@pytest.mark.parametrize("forget", ["forget_target", "reset"])
def test_other_servos_may_begin_anywhere(forget):
    guard, step = Guard(ROBOT), 2.5 * C.effort[2] / C.kp[2]
    guard.command(command(), state(), 5.0)
    getattr(guard, forget)()
    assert guard.command(command(one(C.default_joint_pos[2] + step, 2, C.default_joint_pos)), state(), 5.0)


@pytest.mark.parametrize("part", ["target", "kp", "kd"])
def test_a_command_that_holds_no_numbers_never_passes_and_is_not_what_the_next_jumps_from(part):
    guard = Guard(ROBOT)
    assert guard.command(command(), state(), 5.0)
    assert not guard.command(command(**{part: one(np.nan, 1, getattr(command(), part))}), state(), 5.0)
    assert guard.tripped == "non-finite action"
    guard.tripped = ""
    assert guard.command(command(), state(), 5.0)


def test_damping_passes_at_any_pose_inside_the_speed_limit():
    soft = command(kp=np.zeros(J), kd=ROBOT.stand_kd)
    assert Guard(ROBOT).command(soft, state(joint_pos=C.upper, joint_vel=np.zeros(J)), 5.0)


def test_the_first_reason_stays_whatever_comes_later_until_a_person_resets():
    guard = Guard(ROBOT)
    guard.trip("first")
    guard.trip("second")
    guard.state(state(quat=leaning(2.0)), 5.0, 5.0)
    guard.command(command(np.full(J, np.nan)), state(), 5.0)
    guard.forget_target()
    assert guard.tripped == "first"
    assert not guard.state(state(), 5.0, 5.0) and not guard.command(command(), state(), 5.0)  # good ones do not heal it
    guard.reset()
    assert guard.state(state(), 5.0, 5.0) and guard.command(command(), state(), 5.0) and not guard.tripped


def test_limits_are_those_given():
    assert not Guard(ROBOT, dataclasses.replace(LIMITS, tilt=0.1)).state(state(quat=leaning(0.2)), 5.0, 5.0)
    assert Guard(ROBOT, dataclasses.replace(LIMITS, tilt=2.0)).state(state(quat=leaning(1.5)), 5.0, 5.0)


def held(guard, seconds, **changes):
    """What a guard says to the same state for so long, at 50 Hz."""
    for k in range(round(50 * seconds) + 1):
        now = 5.0 + 0.02 * k
        if not guard.state(state(**changes, received=now), now, now):
            return guard.tripped
    return ""


def test_a_lean_trips_only_when_it_lasts_and_off_the_motions_vertical_not_the_worlds():
    angle = BEYOND * LIMITS.lean
    assert held(Guard(ROBOT), 0.9 * LIMITS.lean_s, quat=leaning(angle)) == ""
    assert held(Guard(ROBOT), 1.2 * LIMITS.lean_s, quat=leaning(angle)).startswith("lean")
    assert held(Guard(ROBOT), 3.0, quat=leaning(INSIDE * LIMITS.lean)) == ""
    bow = Guard(ROBOT)
    for k in range(100):  # a dance that bows, done by a robot that faces elsewhere
        now = 5.0 + 0.02 * k
        meant = leaning(angle)
        assert bow.state(state(quat=rot.multiply(rot.from_yaw(np.array(2.0)), meant), received=now), now, now, meant)


def test_a_lean_that_is_given_up_begins_anew():
    guard = Guard(ROBOT)
    for _ in range(5):
        assert held(guard, 0.7 * LIMITS.lean_s, quat=leaning(BEYOND * LIMITS.lean)) == ""
        assert held(guard, 0.02) == ""


def test_a_fall_trips_long_before_the_floor_and_a_slow_bow_does_not():
    for rate, said in ((1.2 * LIMITS.falling_rate, "falling"), (0.2 * LIMITS.falling_rate, "lean")):
        guard, angle, now = Guard(ROBOT), 0.0, 5.0
        while guard.state(state(quat=leaning(angle), received=now), now, now):
            angle, now = angle + 0.02 * rate, now + 0.02
        assert guard.tripped.startswith(said) and angle < LIMITS.tilt


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gyro_temperature_battery_and_strain_on_both_sides_of_their_limits(sign):
    for share, fine in ((INSIDE, True), (BEYOND, False)):
        turning = Guard(ROBOT)
        assert turning.state(state(gyro=np.array([0.0, sign * share * LIMITS.gyro, 0.0])), 5.0, 5.0) is fine
        assert fine or turning.tripped.startswith("gyro")
        hot = Guard(ROBOT)
        assert hot.state(state(temperature=one(share * LIMITS.temperature, 7)), 5.0, 5.0) is fine
        assert fine or hot.tripped == f"temperature: {C.joint_names[7]} at {share * LIMITS.temperature:.0f} deg C"
        low = Guard(ROBOT)
        assert low.state(state(voltage=np.full(J, LIMITS.voltage / share)), 5.0, 5.0) is fine
        assert fine or low.tripped.startswith("battery")
        torque = one(sign * share * LIMITS.strain * C.effort[3], 3)
        assert (held(Guard(ROBOT), 0.9 * LIMITS.strain_s, torque=torque) == "") and (
            held(Guard(ROBOT), 1.1 * LIMITS.strain_s, torque=torque) == ""
        ) is fine


def test_a_robot_that_tells_no_voltage_is_not_taken_for_empty():
    assert Guard(ROBOT).state(state(voltage=np.zeros(J)), 5.0, 5.0)


@pytest.mark.parametrize(
    ("buttons", "fine"), [(0, True), (1 << 3, False), (1 << 5, True), (1 << 9, True), ((1 << 5) | (1 << 9), False)]
)
def test_the_remotes_select_stops_and_its_damping_keys_together(buttons, fine):
    guard = Guard(ROBOT)
    assert guard.state(state(buttons=buttons), 5.0, 5.0) is fine
    assert fine or guard.tripped == "stopped by the remote"


def test_one_motor_that_tells_no_voltage_hides_nothing():
    low = np.full(J, 30.0)
    low[7] = 0.0
    guard = Guard(ROBOT)
    assert not guard.state(state(voltage=low), 5.0, 5.0) and guard.tripped.startswith("battery")


def test_a_link_that_is_bad_from_the_start_trips_once_a_second_has_been_counted():
    guard = Guard(ROBOT)
    for now in (5.0, 6.0):
        assert guard.state(state(rate=100.0, received=now), now, now)
    assert not guard.state(state(rate=100.0, received=7.0), 7.0, 7.0) and guard.tripped.startswith("lost states")


def test_states_that_get_lost_trip_against_the_best_second_and_a_slow_robot_does_not():
    for first in (500.0, 300.0):
        for share, fine in ((1.0 - INSIDE * LIMITS.loss, True), (1.0 - BEYOND * LIMITS.loss, False)):
            guard = Guard(ROBOT)
            assert guard.state(state(rate=0.5 * first), 5.0, 5.0)  # the first second is not yet full
            assert guard.state(state(rate=first), 5.0, 5.0)
            assert guard.state(state(rate=share * first), 5.0, 5.0) is fine
            assert fine or guard.tripped.startswith("lost states")


def test_a_pose_that_puts_the_arms_into_the_body_trips_when_it_lasts():
    into = C.default_joint_pos.copy()
    into[C.joint_names.index("left_shoulder_roll_joint")] = C.lower[C.joint_names.index("left_shoulder_roll_joint")]
    into[C.joint_names.index("left_elbow_joint")] = 0.5
    guard, config = Guard(ROBOT, dataclasses.replace(LIMITS, torque=1e3)), LIMITS
    assert guard._overlap(command(into)) > config.overlap > guard._overlap(command())
    assert guard.command(command(into), state(), 5.0)
    assert guard.command(command(into), state(), 5.0 + 0.9 * config.overlap_s)
    assert not guard.command(command(into), state(), 5.0 + 1.1 * config.overlap_s)
    assert guard.tripped.startswith("self-collision")
    soft = command(into, kp=np.zeros(J), kd=ROBOT.stand_kd)
    assert Guard(ROBOT)._overlap(soft) == 0.0  # damping asks for no pose
