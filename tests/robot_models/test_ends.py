"""Wrists without a body of their own: a point of the forearm, in every formula alike."""

import numpy as np
import pytest
from any_pose import dancer_xml, profiled
from conftest import SAMPLES
from derivatives import random_poses

from clips import cut, read_clip
from retarget import ObjectiveWeights, retarget
from retarget.solver.residuals import _limbs
from robot_models import RobotError, forward_kinematics, integrate, kinematics, load_robot
from robot_models.maths import rotation as rot

END = (0.02, -0.01, -0.2)


@pytest.fixture(scope="module")
def handless(tmp_path_factory):
    """The dancer with wrists that are points of its elbows' bodies."""
    folder = tmp_path_factory.mktemp("handless")
    at_the_elbow = [(f'{s}_wrist = "{s}_wrist_yaw_link"', f'{s}_wrist = "{s}_elbow_link"') for s in ("left", "right")]
    path = profiled(folder, dancer_xml(), *at_the_elbow)
    with open(path, "a") as stream:
        stream.write(f"\n[ends]\nleft_wrist = {list(END)}\nright_wrist = {list(END)}\n")
    return load_robot(path)


def test_a_wrist_is_a_point_of_the_forearm(handless, rng):
    pos, quat = forward_kinematics(handless, random_poses(handless, rng, 4))
    elbow = handless.landmark("left_elbow")
    wrist = handless.landmark_pos(("left_elbow", "left_wrist"), pos, quat)
    np.testing.assert_array_equal(wrist[:, 0], pos[:, elbow])
    expected = pos[:, elbow] + rot.to_matrix(quat[:, elbow]) @ np.array(END)
    np.testing.assert_allclose(wrist[:, 1], expected, atol=1e-12)


def test_the_solver_rows_follow_that_point(handless, groove, rng):
    from retarget.solver.objective import make_objective

    qpos = random_poses(handless, rng, 2)
    goals = make_objective(handless, groove.targets.at(np.arange(2)), ObjectiveWeights(), qpos[:, 7:])
    kin = kinematics(handless, qpos)
    group = _limbs(goals, kin)
    by = kin.derivatives(group.rows_of, group.wrenches)
    for axis in (0, 4, 6 + handless.joint("left_elbow"), 6 + handless.joint("left_shoulder_roll")):
        small = np.zeros((2, handless.model.nv))
        small[:, axis] = 1e-6
        ends = [
            handless.landmark_pos(("left_wrist",), *forward_kinematics(handless, integrate(qpos, s * small)))[:, 0]
            for s in (1.0, -1.0)
        ]
        k = list(groove.targets.limbs).index(("left_elbow", "left_wrist"))
        weight = group.weight[k, 0]
        np.testing.assert_allclose(by[:, 3 * k : 3 * k + 3, axis], weight * (ends[0] - ends[1]) / 2e-6, atol=1e-5)


def test_such_a_robot_dances_with_its_forearms_where_the_persons_are(handless):
    result = retarget(cut(read_clip(SAMPLES / "groove.bvh"), 1.0, 3.0), handless)
    assert result.report.passed
    assert {m.key: m.value for m in result.report.metrics}["limb_direction_error"] < 4.0


def test_ends_are_of_wrists_alone(tmp_path):
    path = profiled(tmp_path, dancer_xml())
    with open(path, "a") as stream:
        stream.write("\n[ends]\nleft_knee = [0, 0, 0]\n")
    with pytest.raises(RobotError, match="a wrist"):
        load_robot(str(path))
