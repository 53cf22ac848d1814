"""The person in the robot's proportions: directions are the person's, lengths the robot's, feet within reach."""

import dataclasses

import numpy as np
import pytest
from person import backwards, elsewhere, stepping

from retarget import RetargetConfig
from retarget.targets.contacts import find_contacts
from retarget.targets.targets import LIMBS, join, make_targets
from robot_models import FEET, forward_kinematics, leg_length, load_robot
from robot_models.maths import rotation as rot

CONFIG = RetargetConfig()
ARRAYS = ("pelvis_pos", "pelvis_quat", "torso_quat")


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


def laid_out(clip, robot, contacts=None, config=CONFIG):
    return make_targets(clip, contacts or find_contacts(clip, config.contact), robot, config)


def test_limbs_have_the_robots_lengths_and_the_persons_directions(robot):
    clip = stepping()
    targets = laid_out(clip, robot)
    pos, _ = forward_kinematics(robot, np.stack((robot.zero_qpos, robot.default_qpos)))  # lengths are those of any pose
    for start, end in LIMBS:
        lengths = np.linalg.norm(pos[:, robot.landmark(end)] - pos[:, robot.landmark(start)], axis=1)
        vector = targets.limbs[start, end]
        np.testing.assert_allclose(np.linalg.norm(vector, axis=1), lengths[0], rtol=1e-9)
        assert lengths[1] == pytest.approx(lengths[0], rel=0.05)  # but for joints beside the limb's line
        theirs = clip.point(end.replace("foot", "ankle")) - clip.point(start)
        np.testing.assert_allclose(rot.unit(vector), rot.unit(theirs), atol=1e-12)


@pytest.mark.parametrize("factor", [0.5, 1.7])
def test_the_size_of_the_person_does_not_matter(robot, factor):
    """Touches are found in metres, so they are handed on; all else is the same."""
    clip = stepping()
    contacts = find_contacts(clip, CONFIG.contact)
    large = dataclasses.replace(clip, positions=factor * clip.positions)
    here, there = laid_out(clip, robot, contacts), laid_out(large, robot, contacts)
    assert here.scale == pytest.approx(factor * there.scale)
    for name in ARRAYS:
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), atol=1e-9)
    np.testing.assert_allclose(here.feet.pos, there.feet.pos, atol=1e-9)
    for limb in LIMBS:
        np.testing.assert_allclose(here.limbs[limb], there.limbs[limb], atol=1e-12)


def test_targets_turn_and_move_with_the_person(robot):
    clip, turn, shift = stepping(), 2.2, np.array([2.0, -3.0, 0.3])
    here, there = laid_out(clip, robot), laid_out(elsewhere(clip, turn, shift), robot)
    q, way = rot.from_yaw(np.array(turn)), here.scale * shift * [1.0, 1.0, 0.0]
    for ours, theirs in ((here.pelvis_pos, there.pelvis_pos), (here.feet.pos, there.feet.pos)):
        np.testing.assert_allclose(theirs, rot.rotate(q, ours) + way, atol=1e-9)
    for name in ("pelvis_quat", "torso_quat"):
        assert rot.angle_between(rot.multiply(q[None], getattr(here, name)), getattr(there, name)).max() < 1e-7
    for limb in LIMBS:
        np.testing.assert_allclose(there.limbs[limb], rot.rotate(q, here.limbs[limb]), atol=1e-12)


def test_targets_run_backwards_with_time(robot):
    clip = stepping(55.0)  # at 50 the crouch's window is even and looks half a frame ahead
    here, back = laid_out(clip, robot), laid_out(backwards(clip), robot)
    np.testing.assert_allclose(back.pelvis_pos[::-1], here.pelvis_pos, atol=1e-8)
    np.testing.assert_allclose(back.feet.pos[::-1], here.feet.pos, atol=1e-8)
    np.testing.assert_array_equal(back.feet.contact[::-1], here.feet.contact)


@pytest.mark.parametrize("reach", [0.9, 0.985])
def test_planted_feet_stay_within_reach_of_their_hips(robot, reach):
    """But for what smoothing the crouch gives back: it peaks for at least 0.2 s, which 2 Hz keep to a few millimetres."""
    clip = stepping()
    positions = clip.positions.copy()
    above = [k for k, n in enumerate(clip.names) if "ankle" not in n and "toe" not in n and "knee" not in n]
    positions[:, above, 2] += 0.15  # on stilts, with the same legs' directions
    stilts = dataclasses.replace(clip, positions=positions)
    far = []
    for config in (dataclasses.replace(CONFIG, reach=reach), dataclasses.replace(CONFIG, reach=5.0)):
        targets = laid_out(stilts, robot, config=config)
        zero, zero_quat = forward_kinematics(robot, robot.zero_qpos[None])
        frame = rot.multiply(targets.pelvis_quat, rot.conjugate(zero_quat[:, 0]))
        away = []
        for k, side in enumerate(FEET):
            offset = zero[0, robot.landmark(f"{side}_hip")] - zero[0, 0]
            hip = targets.pelvis_pos + rot.rotate(frame, np.broadcast_to(offset, targets.pelvis_pos.shape))
            planted = (targets.feet.contact[:, 2 * k : 2 * k + 2] != 0).any(axis=1)
            away.append(np.linalg.norm(hip - targets.feet.pos[:, k], axis=1)[planted].max() / leg_length(robot))
        far.append(max(away))
    assert far[0] < reach + 0.01
    assert far[1] > reach + 0.02  # the control: nothing held it


def test_parts_joined_are_the_whole_and_frames_picked_are_those(robot):
    whole = laid_out(stepping(), robot)
    frames = np.arange(len(whole.pelvis_pos))
    again = join([whole.at(frames[:30]), whole.at(frames[30:31]), whole.at(frames[31:])])
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
    for name in ("pos", "quat", "contact", "shift"):
        np.testing.assert_array_equal(getattr(again.feet, name), getattr(whole.feet, name))
    for limb in LIMBS:
        np.testing.assert_array_equal(again.limbs[limb], whole.limbs[limb])
    assert (again.fps, again.scale) == (whole.fps, whole.scale)
    picked = whole.at(np.array([7, 3]))
    np.testing.assert_array_equal(picked.pelvis_pos, whole.pelvis_pos[[7, 3]])
    np.testing.assert_array_equal(picked.limbs[LIMBS[0]], whole.limbs[LIMBS[0]][[7, 3]])


def test_joined_quaternions_do_not_change_sign_from_frame_to_frame(robot):
    whole = laid_out(stepping(), robot)
    frames = np.arange(10)
    flipped = dataclasses.replace(whole, pelvis_quat=-whole.pelvis_quat, torso_quat=-whole.torso_quat)
    again = join([whole.at(frames), flipped.at(frames), whole.at(frames)])
    for name in ("pelvis_quat", "torso_quat"):
        assert (np.sum(getattr(again, name)[1:] * getattr(again, name)[:-1], axis=1) > 0.9).all()
