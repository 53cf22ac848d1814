"""mink's task for a limb's direction: its Jacobian in MuJoCo's own tangent, every coordinate."""

import mink
import mujoco
import numpy as np
import pytest
from derivatives import assert_derivatives, random_poses, spoiled

from retarget.per_frame.segment_task import SegmentTask
from retarget.targets.targets import LIMBS
from robot_models import forward_kinematics, load_robot


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


def at(robot, q):
    configuration = mink.Configuration(robot.model)
    configuration.update(q)
    return configuration


def task_for(robot, limb):
    start, end = (robot.body_ids[robot.landmark(name)] for name in limb)
    return SegmentTask(start, end, 2.0)


def slopes(robot, task, q, step=1e-5):
    """Central differences of the error, by MuJoCo's integration: its root turns in the body's frame."""
    out = np.zeros((3, robot.model.nv))
    for column in range(robot.model.nv):
        ends = []
        for sign in (1.0, -1.0):
            moved, velocity = np.array(q), np.zeros(robot.model.nv)
            velocity[column] = sign
            mujoco.mj_integratePos(robot.model, moved, velocity, step)
            ends.append(task.compute_error(at(robot, moved)))
        out[:, column] = (ends[0] - ends[1]) / (2.0 * step)
    return out


@pytest.mark.parametrize("limb", [LIMBS[0], LIMBS[7]], ids=["thigh", "forearm"])
def test_the_jacobian_is_the_errors_derivative_in_every_coordinate(robot, limb, rng):
    task = task_for(robot, limb)
    for q in random_poses(robot, rng, 2):
        task.set_target(3.0 * rng.normal(size=3))
        jacobian, differences = task.compute_jacobian(at(robot, q)), slopes(robot, task, q)
        assert_derivatives(jacobian, differences)
        assert not jacobian[:, :3].any()  # a vector does not move with the robot
        for column, bad in spoiled(jacobian):
            if np.abs(jacobian[:, column]).max() > 1e-12:
                with pytest.raises(AssertionError, match=f"column {column} off"):
                    assert_derivatives(bad, differences)


def test_the_error_is_what_the_vector_misses_and_nothing_at_the_robots_own(robot, rng):
    (q,) = random_poses(robot, rng, 1)
    pos, _ = forward_kinematics(robot, q[None])
    for limb in LIMBS:
        task, vector = task_for(robot, limb), pos[0, robot.landmark(limb[1])] - pos[0, robot.landmark(limb[0])]
        task.set_target(vector)
        np.testing.assert_allclose(task.compute_error(at(robot, q)), 0.0, atol=1e-12)
        task.set_target(vector - [0.1, 0.0, -0.2])
        np.testing.assert_allclose(task.compute_error(at(robot, q)), [0.1, 0.0, -0.2], atol=1e-12)


def test_steps_of_mink_bring_the_limb_to_its_target_and_the_error_falls_at_every_one(dancer):
    q = dancer.default_qpos
    configuration, task = at(dancer, q), task_for(dancer, ("left_shoulder", "left_elbow"))
    length = np.linalg.norm(task.compute_error(configuration))  # the target is still nothing
    task.set_target(length * np.array([0.6, 0.8, 0.0]))
    errors = []
    for _ in range(8):
        errors.append(np.linalg.norm(task.compute_error(configuration)))
        configuration.integrate_inplace(mink.solve_ik(configuration, [task], 1.0, "daqp", damping=1e-6), 1.0)
    # Gauss-Newton at a target that can be reached: the error falls with its square in the end.
    assert errors[0] > 0.1 and errors[-1] < 1e-6
