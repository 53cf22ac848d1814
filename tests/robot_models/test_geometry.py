"""Heights and overlaps against MuJoCo's own collision code."""

import mujoco
import numpy as np

from robot_models import forward_kinematics, load_robot, sole_corners
from robot_models.geometry import body_geoms, lowest_point, lowest_points, self_collisions, surface_points
from robot_models.maths import rotation as rot


def test_lowest_point_agrees_with_sampled_geometry(rng):
    robot = load_robot("g1")
    q = np.tile(robot.default_qpos, (8, 1))
    q[:, 3:7] = rot.normalise(rng.normal(size=(8, 4)))
    q[:, 7:] = rng.uniform(robot.lower, robot.upper, (8, robot.nq - 7))
    lowest = lowest_point(robot, *forward_kinematics(robot, q))
    data = mujoco.MjData(robot.model)
    plane = robot.model.geom("floor").id
    for t in range(8):
        data.qpos[:] = q[t]
        mujoco.mj_kinematics(robot.model, data)
        gaps = [mujoco.mj_geomDistance(robot.model, data, plane, g, 10.0, None) for g in body_geoms(robot)]
        soles = sole_corners(robot, *forward_kinematics(robot, q[t : t + 1]))[..., 2].min()
        assert abs(lowest[t] - min(*gaps, soles)) < 1e-6


def test_the_lowest_surface_point_is_the_lowest_point_of_bodies_of_capsules_and_boxes(rng, dancer):
    q = np.tile(dancer.default_qpos, (20, 1))
    q[:, 3:7] = rot.normalise(rng.normal(size=(20, 4)))
    q[:, 7:] = rng.uniform(dancer.lower, dancer.upper, (20, dancer.nq - 7))
    pos, quat = forward_kinematics(dancer, q)
    surface, lowest = surface_points(dancer), lowest_points(dancer, pos, quat)
    heights = surface.heights(pos, quat)
    feet = [dancer.body(sole.body) for sole in dancer.soles.values()]  # their soles are no primitives
    for body in set(surface.body.tolist()) - set(feet):
        np.testing.assert_allclose(heights[:, surface.body == body].min(axis=1), lowest[:, body], atol=1e-9)


def test_a_hand_in_the_chest_is_seen_and_a_free_pose_is_not(dancer):
    pose = dancer.default_qpos.copy()
    assert self_collisions(dancer, pose[None]).depth[0] == 0.0
    pose[7 + dancer.joint("left_shoulder_pitch")] = -0.3
    pose[7 + dancer.joint("left_shoulder_yaw")] = -1.5
    pose[7 + dancer.joint("left_elbow")] = -1.9
    assert self_collisions(dancer, pose[None]).depth[0] > 0.02
