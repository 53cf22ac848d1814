"""A hand brought to a place: it is there by forward kinematics, or as near as its arm reaches."""

import numpy as np
import pytest

from retarget.per_frame import reach
from robot_models import forward_kinematics, load_robot


def place_of(robot, qpos, landmark):
    return robot.landmark_pos((landmark,), *(a[0] for a in forward_kinematics(robot, qpos[None])))[0]


@pytest.mark.parametrize("name", ["dancer", "g1"])
@pytest.mark.parametrize("landmark", ["left_wrist", "right_wrist", "left_foot"])
def test_it_gets_there_with_its_own_limb_alone(name, landmark):
    robot = load_robot(name)
    wanted = place_of(robot, robot.default_qpos, landmark) + (0.06, 0.0, 0.05)
    angles, off = reach(robot, robot.default_qpos, landmark, wanted)
    assert off < 1e-3
    qpos = robot.default_qpos.copy()
    for joint, angle in angles.items():
        j = robot.joint(joint)
        assert robot.lower[j] <= angle <= robot.upper[j]
        qpos[7 + j] = angle
    np.testing.assert_allclose(place_of(robot, qpos, landmark), wanted, atol=2e-3)
    side = landmark.split("_")[0]
    assert all(side in joint for joint in angles)


def test_what_is_out_of_reach_is_told(dancer):
    far = place_of(dancer, dancer.default_qpos, "left_wrist") + (0.0, 0.0, 5.0)
    _, off = reach(dancer, dancer.default_qpos, "left_wrist", far)
    assert off > 3.0


def test_where_it_is_nothing_has_to_move(dancer):
    here = place_of(dancer, dancer.default_qpos, "right_wrist")
    angles, off = reach(dancer, dancer.default_qpos, "right_wrist", here)
    assert off < 1e-4
    for joint, angle in angles.items():
        assert angle == pytest.approx(dancer.default_joint_pos[dancer.joint(joint)])
