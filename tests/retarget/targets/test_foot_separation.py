"""Soles do not overlap: a stance that gives way does so as one, a swing goes round."""

import numpy as np
import pytest

from clips import FREE, PLANTED
from retarget.targets.feet import FootTargets
from retarget.targets.foot_separation import separate_feet
from robot_models import FEET, load_robot
from robot_models.maths import rotation as rot

FPS = 50.0


@pytest.fixture(scope="module")
def robot():
    return load_robot("dancer")


def walking(robot, apart, yaw=0.0, height=0.03):
    """Both feet stand, left swings to where it overlaps more, both stand, right swings away; `apart` in y [m]."""
    stands = np.ones((120, 2), dtype=bool)
    stands[40:60, 0], stands[90:100, 1] = False, False
    pos = np.zeros((120, 2, 3))
    pos[:, 0, 1] = np.interp(np.arange(120), (39, 60), (apart, 0.5 * apart))
    pos[:, 1, 1] = np.interp(np.arange(120), (89, 100), (0.0, -0.5))
    pos[..., 2] = [-robot.soles[s].z for s in FEET]
    pos[40:60, 0, 2] += height
    quat = np.stack((rot.from_yaw(np.full(120, yaw)), rot.from_yaw(np.zeros(120))), axis=1)
    contact = np.where(np.repeat(stands, 2, axis=1), PLANTED, FREE)
    return FootTargets(pos=pos, quat=quat, contact=contact, shift=np.zeros((120, 2, 2)))


def grid(robot, feet, t, k):
    """Points all over a sole, in the world, level."""
    corners = np.asarray(robot.soles[FEET[k]].corners)[:, :2]
    x, y = (np.linspace(corners[:, i].min(), corners[:, i].max(), 41) for i in (0, 1))
    points = np.stack([*np.meshgrid(x, y), np.zeros((41, 41))], axis=-1).reshape(-1, 3)
    return (feet.pos[t, k] + rot.rotate(feet.quat[t, k], points))[:, :2]


def shared(robot, feet, t):
    """Whether some point of the left sole is on the right one."""
    points = grid(robot, feet, t, 0) - feet.pos[t, 1, :2]
    corners = np.asarray(robot.soles[FEET[1]].corners)[:, :2]
    return bool(((points > corners.min(axis=0)) & (points < corners.max(axis=0))).all(axis=1).any())


@pytest.mark.parametrize("yaw", [0.0, 0.4, -0.7])
def test_standing_soles_are_parted_and_each_stance_moves_as_one(robot, yaw):
    before = walking(robot, apart=0.06, yaw=yaw)
    after = separate_feet(before, robot, FPS)
    assert shared(robot, before, 20) and shared(robot, before, 70)  # the negative control
    assert not shared(robot, after, 20) and not shared(robot, after, 70)
    moved = (after.pos - before.pos)[..., :2]
    np.testing.assert_allclose(after.shift, moved, atol=1e-12)
    for k, (a, b) in ((0, (0, 40)), (0, (60, 120)), (1, (0, 90)), (1, (100, 120))):
        assert np.ptp(moved[a:b, k], axis=0).max() < 1e-12
    assert np.abs(np.diff(moved, axis=0)).max() < 0.02  # swings ease from one to the next


def test_a_foot_that_swings_goes_round_the_one_that_stands_but_not_if_it_is_far_above(robot):
    low, high = (separate_feet(walking(robot, apart=0.06, height=h), robot, FPS) for h in (0.03, 0.3))
    assert shared(robot, walking(robot, apart=0.06), 50)
    assert not any(shared(robot, low, t) for t in range(41, 59))
    # Where it passes far above it goes no further aside than its stances do.
    stances = high.shift[[20, 70], 0, 1]
    assert stances.min() - 1e-9 <= high.shift[50, 0, 1] <= stances.max() + 1e-9


def test_feet_that_stand_clear_of_one_another_stay(robot):
    before = walking(robot, apart=0.5)
    np.testing.assert_array_equal(separate_feet(before, robot, FPS).pos, before.pos)
