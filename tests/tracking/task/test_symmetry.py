"""A robot in the mirror: what physics makes of a mirrored state and action is the mirror image of what it makes of them."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("torch")

from clips import make_reference
from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking import TaskConfig, TrackingTask
from tracking.config import RandomisationConfig, StartNoise
from tracking.policy import TERMS
from tracking.task import symmetry_of
from tracking.task.symmetry import SIGNS

FRAMES = 30


def reflected_qpos(qpos, symmetry):
    """By hand: the root's place and turn, and the joints."""
    out = qpos.copy()
    out[..., 1] *= -1.0
    out[..., 3:7] = qpos[..., 3:7] * (1.0, -1.0, 1.0, -1.0)  # wxyz of a turn about a reflected axis
    out[..., 7:] = symmetry.joints.sign * qpos[..., 7 + symmetry.joints.order]
    return out


@pytest.fixture(scope="module", params=["g1", "dancer"])
def robot(request):
    return load_robot(request.param)


def swaying(robot, rng):
    t = np.arange(FRAMES)[:, None] / 50.0
    qpos = np.tile(robot.default_qpos, (FRAMES, 1))
    qpos[:, 7:] += 0.2 * np.sin(3.0 * t + rng.uniform(0.0, 6.0, robot.nq - 7))
    qpos[:, :2] += 0.1 * np.sin(2.0 * t + [0.0, 1.0])
    qpos[:, 3:7] = rot.from_yaw(0.3 * np.sin(2.0 * t[:, 0]))
    return qpos


def task_of(robot, qpos):
    reference = make_reference(
        robot, qpos, 50.0, contact=np.zeros((FRAMES, 4), dtype=np.int8), segments=np.array([[0, FRAMES, 1]]), meta={}
    )
    still = dataclasses.replace(
        TaskConfig(), start_noise=StartNoise(scale=0.0), randomisation=RandomisationConfig(enabled=False)
    )
    task = TrackingTask(robot=robot, reference=reference, envs=1, config=still, threads=1)
    task.reset(np.array([0]), np.array([3]))
    return task


def test_what_a_mirrored_robot_sees_and_does_is_the_mirror_image(robot, rng):
    symmetry, qpos = symmetry_of(robot), swaying(robot, rng)
    one, other = task_of(robot, qpos), task_of(robot, reflected_qpos(qpos, symmetry))
    seen = symmetry.of_rows(one.teacher.rows)
    for _ in range(6):
        action = rng.normal(size=(1, one.actions))
        for task, a in ((one, action), (other, symmetry.joints.sign * action[:, symmetry.joints.order])):
            task.step(a)
        np.testing.assert_allclose(other.physics.qpos, reflected_qpos(one.physics.qpos, symmetry), atol=2e-3)
        np.testing.assert_allclose(
            other.observe_all()[0], seen.sign * one.observe_all()[0][:, seen.order], atol=2e-2
        )  # the model itself is symmetric to a millimetre only
    for task in (one, other):
        task.close()


def test_a_mirror_image_of_a_mirror_image_is_the_thing_itself(robot):
    symmetry, task = symmetry_of(robot), task_of(robot, np.tile(robot.default_qpos, (FRAMES, 1)))
    task.close()
    for reflection in (symmetry.joints, symmetry.of_rows(task.teacher.rows)):
        twice = reflection.order[reflection.order]
        assert (twice == np.arange(len(twice))).all()
        assert (reflection.sign * reflection.sign[reflection.order] == 1.0).all()


def test_a_robot_with_two_different_sides_has_no_mirror_image():
    robot = load_robot("dancer")
    crooked = robot.default_qpos.copy()
    crooked[
        7 + robot.joint("left_elbow_joint" if "left_elbow_joint" in robot.joint_names else robot.joint_names[0])
    ] += 0.1
    assert symmetry_of(robot) is not None
    assert symmetry_of(dataclasses.replace(robot, default_qpos=crooked)) is None


def test_every_term_says_what_it_is_in_a_mirror():
    for name, term in TERMS.items():
        assert term.reflection in ("joints", "bodies") or len(SIGNS[term.reflection]) == term.size, name
        assert (term.reflection == "joints") == bool(term.per_joint), name
        assert (term.reflection == "bodies") == bool(term.per_body), name
