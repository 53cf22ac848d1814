"""Body sensors against MuJoCo's own object velocities, and against time itself."""

import mujoco
import numpy as np
import pytest

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.engines.body_sensors import BodySensors

N = 3


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


@pytest.fixture
def sensors(robot):
    made = BodySensors(robot, bodies(robot), N, threads=1)
    yield made
    made.close()


def bodies(robot):
    return [robot.body(b) for b in robot.profile.tracked]


def states(robot, seed=0, n=N):
    rng = np.random.default_rng(seed)
    out = np.zeros((n, 1 + robot.nq + robot.model.nv))
    qpos, qvel = out[:, 1 : 1 + robot.nq], out[:, 1 + robot.nq :]
    qpos[:] = robot.default_qpos
    qpos[:, :3] += rng.normal(size=(n, 3))
    qpos[:, 3:7] = rot.normalise(rng.normal(size=(n, 4)))
    qpos[:, 7:] += 0.4 * rng.normal(size=(n, robot.nq - 7))
    qvel[:] = rng.normal(size=qvel.shape)
    return out


def by_object_velocity(robot, state):
    """MuJoCo's function for one body at a time, on the robot's own model."""
    m, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:], data.qvel[:] = state[1 : 1 + robot.nq], state[1 + robot.nq :]
    mujoco.mj_forward(m, data)
    told = {"pos": [], "quat": [], "lin_vel": [], "ang_vel": []}
    for b in bodies(robot):
        six, at = np.zeros(6), robot.body_ids[b]
        mujoco.mj_objectVelocity(m, data, mujoco.mjtObj.mjOBJ_XBODY, at, six, 0)
        for name, value in zip(told, (data.xpos[at], data.xquat[at], six[3:], six[:3]), strict=True):
            told[name].append(np.array(value))
    return {k: np.array(v) for k, v in told.items()}


def test_velocities_are_those_that_mujoco_tells_of_the_bodys_origin_in_the_world(robot, sensors):
    state = states(robot)
    sensors.read(state)
    for i in range(N):
        for name, value in by_object_velocity(robot, state[i]).items():
            np.testing.assert_allclose(getattr(sensors.states, name)[i], value, atol=1e-10, err_msg=name)


def test_a_velocity_is_the_derivative_of_the_pose(robot, sensors):
    state, h = states(robot), 1e-6
    ends = []
    for sign in (-h, h):
        moved = state.copy()
        for row in moved:
            qpos = row[1 : 1 + robot.nq].copy()
            mujoco.mj_integratePos(robot.model, qpos, row[1 + robot.nq :].copy(), sign)
            row[1 : 1 + robot.nq] = qpos
        sensors.read(moved)
        ends.append((sensors.states.pos.copy(), sensors.states.quat.copy()))
    sensors.read(state)
    (p0, q0), (p1, q1) = ends
    # Central differences of numbers up to some metres: 1e-16 / 1e-6 of rounding.
    np.testing.assert_allclose((p1 - p0) / (2 * h), sensors.states.lin_vel, atol=1e-6)
    np.testing.assert_allclose(
        rot.log(rot.multiply(q1, rot.conjugate(q0))) / (2 * h), sensors.states.ang_vel, atol=1e-6
    )
    # Negative control: the spin in the body's own axes is another.
    to_device = rot.rotate(rot.conjugate(sensors.states.quat), sensors.states.ang_vel)
    assert np.abs(to_device - sensors.states.ang_vel).max() > 0.5


def test_reading_leaves_the_state_alone_and_nothing_falls_or_touches(robot, sensors):
    state = states(robot)
    state[:, 3] = -5.0  # deep in the floor: a model that simulated would throw it out
    kept = state.copy()
    sensors.read(state)
    np.testing.assert_array_equal(state, kept)
    np.testing.assert_allclose(sensors.states.pos[:, 0, 2], -5.0)


def test_some_are_read_anew_and_the_others_stay_as_they_were(robot, sensors):
    first, second = states(robot, 1), states(robot, 2)
    sensors.read(first)
    before = {k: v.copy() for k, v in vars(sensors.states).items()}
    sensors.read_some(np.array([2, 0]), second[[2, 0]])
    sensors.read_some(np.array([], dtype=int), second[:0])
    mixed = {k: v.copy() for k, v in vars(sensors.states).items()}
    sensors.read(second)
    for name, value in mixed.items():
        np.testing.assert_array_equal(value[1], before[name][1], err_msg=name)
        np.testing.assert_array_equal(value[[0, 2]], getattr(sensors.states, name)[[0, 2]], err_msg=name)


def test_the_number_of_robots_and_threads_changes_no_number(robot):
    state, seen = states(robot), []
    for threads in (1, 2):
        sensors = BodySensors(robot, bodies(robot), N, threads=threads)
        sensors.read(state)
        seen.append({k: v.copy() for k, v in vars(sensors.states).items()})
        sensors.close()
    alone = BodySensors(robot, bodies(robot), 1)
    alone.read(state[1:2])
    for name in seen[0]:
        np.testing.assert_array_equal(seen[0][name], seen[1][name])
        np.testing.assert_array_equal(seen[0][name][1], getattr(alone.states, name)[0])
    alone.close()


def test_bodies_come_in_the_order_asked_for(robot, sensors):
    order = bodies(robot)[::-1]
    backwards = BodySensors(robot, order, N, threads=1)
    state = states(robot)
    for one in (sensors, backwards):
        one.read(state)
    for name in ("pos", "quat", "lin_vel", "ang_vel"):
        np.testing.assert_array_equal(getattr(sensors.states, name)[:, ::-1], getattr(backwards.states, name))
    backwards.close()
