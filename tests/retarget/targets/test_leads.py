"""Lead-in and lead-out: still at their ends, joined to the dance, slow enough for the motors, the same both ways."""

import dataclasses

import numpy as np
import pytest
from derivatives import random_poses
from own_motion import own_targets

from clips import FREE, PLANTED
from retarget import RetargetConfig
from retarget.targets.leads import add_leads, blend_frames
from retarget.targets.targets import LIMBS
from robot_models import forward_kinematics, load_robot, sole_corners
from robot_models.maths import rotation as rot

CONFIG = RetargetConfig()
STILL = round(CONFIG.stand_s * CONFIG.fps)


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


@pytest.fixture
def swaying(robot, rng):
    """Five poses near the default one, turned and shifted, with bent knees."""
    qpos = np.tile(robot.default_qpos, (5, 1))
    qpos[:, 7:] += 0.2 * rng.normal(size=(1, qpos.shape[1] - 7)) + 0.01 * np.arange(5)[:, None]
    qpos[:, :2], qpos[:, 3:7] = [2.0, -1.0], rot.from_yaw(np.full(5, 0.9))
    return qpos


def test_targets_of_a_motion_are_its_own_kinematics(robot, rng):
    qpos = random_poses(robot, rng, 4)
    targets, (pos, quat) = own_targets(robot, qpos), forward_kinematics(robot, qpos)
    np.testing.assert_allclose(targets.pelvis_pos, qpos[:, :3], atol=1e-12)
    assert rot.angle_between(targets.torso_quat, quat[:, robot.landmark("torso")]).max() < 1e-7
    for start, end in LIMBS:
        way = pos[:, robot.landmark(end)] - pos[:, robot.landmark(start)]
        np.testing.assert_allclose(targets.limbs[start, end], way, atol=1e-12)


def test_leads_stand_still_at_their_ends_and_meet_the_dance_at_rest(robot, swaying):
    padded = add_leads(robot, swaying, own_targets(robot, swaying), CONFIG)
    assert padded.names == ("lead-in", "dance", "lead-out")
    np.testing.assert_array_equal(padded.qpos[padded.dance], swaying)
    head, tail = padded.qpos[: padded.dance.start], padded.qpos[padded.dance.stop :]
    for lead, end in ((head, swaying[0]), (tail[::-1], swaying[-1])):
        assert not np.diff(lead[:STILL], axis=0).any()
        np.testing.assert_allclose(lead[0, 7:], robot.default_joint_pos, atol=1e-12)
        # A minimum-jerk blend of n frames misses its end by 10 / n^3 of its way one frame before.
        n = len(lead) - STILL
        assert np.abs(lead[-1, 7:] - end[7:]).max() <= 11.0 / n**3 * np.abs(end[7:] - lead[0, 7:]).max()
    soles = sole_corners(robot, *forward_kinematics(robot, padded.qpos[[0, -1]]))
    np.testing.assert_allclose(soles[..., 2], 0.0, atol=2e-3)  # the default pose stands on its soles


def test_frames_are_divided_among_segments_without_gap_or_overlap(robot, swaying):
    for lead_in, lead_out in ((1.0, 0.0), (0.0, 0.5), (0.0, 0.0)):
        config = dataclasses.replace(CONFIG, lead_in_s=lead_in, lead_out_s=lead_out)
        padded = add_leads(robot, swaying, own_targets(robot, swaying), config)
        present = ["lead-in"] * (lead_in > 0.0) + ["dance"] + ["lead-out"] * (lead_out > 0.0)
        assert list(padded.names) == present
        ends = padded.segments[:, 1]
        np.testing.assert_array_equal(padded.segments[:, 0], [0, *ends[:-1]])
        assert ends[-1] == len(padded.qpos) == len(padded.targets.pelvis_pos)
        np.testing.assert_array_equal(padded.segments[:, 2], [0] + [1] * (len(present) - 1))  # continuous but the first


def test_the_lead_out_is_the_lead_in_of_the_dance_played_backwards(robot, swaying):
    there = add_leads(robot, swaying, own_targets(robot, swaying), CONFIG)
    back = add_leads(robot, swaying[::-1].copy(), own_targets(robot, swaying[::-1].copy()), CONFIG)
    np.testing.assert_allclose(there.qpos[::-1][:, :3], back.qpos[:, :3], atol=1e-12)
    np.testing.assert_allclose(there.qpos[::-1][:, 7:], back.qpos[:, 7:], atol=1e-12)
    assert rot.angle_between(there.qpos[::-1, 3:7], back.qpos[:, 3:7]).max() < 1e-7
    np.testing.assert_array_equal(there.targets.feet.contact[::-1], back.targets.feet.contact)
    np.testing.assert_allclose(there.targets.feet.pos[::-1], back.targets.feet.pos, atol=1e-12)


def test_leads_turn_and_move_with_the_dance(robot, swaying):
    turn, shift = rot.from_yaw(np.array(-2.0)), np.array([0.5, 3.0, 0.0])
    moved = swaying.copy()
    moved[:, :3], moved[:, 3:7] = rot.rotate(turn, swaying[:, :3]) + shift, rot.multiply(turn[None], swaying[:, 3:7])
    here, there = (add_leads(robot, q, own_targets(robot, q), CONFIG) for q in (swaying, moved))
    np.testing.assert_allclose(there.qpos[:, :3], rot.rotate(turn, here.qpos[:, :3]) + shift, atol=1e-9)
    np.testing.assert_allclose(there.qpos[:, 7:], here.qpos[:, 7:], atol=1e-9)
    feet = rot.rotate(turn, here.targets.feet.pos) + shift
    np.testing.assert_allclose(there.targets.feet.pos, feet, atol=1e-9)


def test_feet_that_stand_where_the_dance_begins_are_never_moved_and_those_in_the_air_lift_after_the_weight_has_shifted(
    robot,
):
    qpos = np.tile(robot.default_qpos, (3, 1))
    targets = own_targets(robot, qpos, [FREE, FREE, PLANTED, PLANTED])
    targets.feet.pos[:, 0, 2] += 0.2
    feet = add_leads(robot, qpos, targets, CONFIG).targets.feet
    assert (feet.contact[:, 2:] == PLANTED).all() and np.ptp(feet.pos[:, 1, :2], axis=0).max() < 1e-9
    assert np.ptp(feet.pos[:, 1, 2]) < 1e-3  # set flat: a default pose stands on its soles to half a millimetre
    up = feet.contact[:, 0] == FREE
    assert not up[0] and not up[-1] and up[: STILL + 50].any()
    assert feet.pos[~up, 0, 2].max() - feet.pos[0, 0, 2] < 1e-3  # it leaves the floor as its label says
    first = int(np.flatnonzero(up)[0])
    assert first > STILL + 10  # a quarter of the blend's way is nine twentieths of its time


@pytest.mark.parametrize("fps", [30.0, 50.0, 200.0])
def test_no_joint_is_led_faster_than_half_its_motor_and_no_lead_is_shorter_than_asked(robot, fps, rng):
    start, end = random_poses(robot, rng, 2)
    end[2:7] = robot.default_qpos[2:7]
    config = dataclasses.replace(CONFIG, fps=fps, lead_in_s=0.1, lead_out_s=0.0)
    frames = blend_frames(robot, start, end, fps, 0.1)
    head = add_leads(robot, end[None].repeat(3, axis=0), own_targets(robot, end[None].repeat(3, axis=0)), config)
    speed = np.abs(np.diff(head.qpos[: head.dance.start + 1, 7:], axis=0)).max(axis=0) * fps
    assert (speed <= 0.5 * robot.velocity * (1.0 + 1e-9)).all()
    assert (speed / robot.velocity).max() > 0.4  # the slowest motor sets the time: no longer than needed
    assert frames >= 0.1 * fps and blend_frames(robot, start, start, fps, 0.1) == np.ceil(0.1 * fps)
    assert blend_frames(robot, start, end, fps, 0.1) == blend_frames(robot, end, start, fps, 0.1)


@pytest.mark.parametrize("trunk", [0.0, 0.5], ids=["sits low", "lies"])
def test_a_dance_that_begins_on_the_floor_begins_there(robot, swaying, trunk):
    """No blend brings a robot from a stand onto the floor."""
    low = swaying.copy()
    half = slice(0, len(low) // 2)
    low[half, 2] *= 0.3 if trunk == 0.0 else 1.0
    low[half, 3:7] = rot.exp(np.array([0.0, trunk * np.pi, 0.0]))
    assert add_leads(robot, low, own_targets(robot, low), CONFIG).names == ("dance", "lead-out")
    back = low[::-1].copy()
    assert add_leads(robot, back, own_targets(robot, back), CONFIG).names == ("lead-in", "dance")
