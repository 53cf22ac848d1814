"""Streams: one frame after the other, nothing known of the future, within what the motors reach."""

import dataclasses

import numpy as np
import pytest
from person import stepping

from retarget import IkConfig, RetargetConfig, RetargetError
from retarget.per_frame.base import FrameSolver, reachable
from retarget.per_frame.streams import follow, frame_solver
from retarget.targets.contacts import find_contacts
from retarget.targets.targets import make_targets

FPS, CONFIG = 50.0, IkConfig()


@pytest.fixture(scope="module")
def walk(dancer):
    clip, config = stepping(), RetargetConfig()
    return make_targets(clip, find_contacts(clip, config.contact), dancer, config)


def backends():
    return [pytest.param("mink"), pytest.param("placo", marks=pytest.mark.filterwarnings("ignore::DeprecationWarning"))]


def solver_of(name, robot, config=CONFIG):
    if name == "placo":
        pytest.importorskip("placo")
    return frame_solver(name, robot, config, FPS)


def test_a_solver_that_is_none_is_refused_with_the_names_of_those_there_are(dancer):
    with pytest.raises(RetargetError, match="whole-clip, mink or placo"):
        frame_solver("levenberg", dancer, CONFIG, FPS)


def test_every_frame_is_sent_once_and_in_order_and_progress_is_told_after_each(walk, dancer):
    seen, told = [], []
    posture = np.arange(6.0)[:, None] * np.ones(len(dancer.joint_names))

    def stub(targets, near):
        assert len(targets.pelvis_pos) == 1 and near.shape == (len(dancer.joint_names),)
        seen.append((targets.pelvis_pos[0].tolist(), near[0]))
        return np.full(dancer.nq, float(len(seen)))

    out = follow(stub, walk.at(np.arange(6)), posture, progress=lambda stage, done, total: told.append((done, total)))
    assert seen == [(walk.pelvis_pos[t].tolist(), float(t)) for t in range(6)]
    assert told == [(t, 6) for t in range(1, 7)]
    np.testing.assert_array_equal(out[:, 0], np.arange(1.0, 7.0))


@pytest.mark.parametrize("name", backends())
def test_what_comes_later_does_not_change_what_came_before(name, walk, dancer):
    frames = np.arange(3, 11)
    posture = np.tile(dancer.default_joint_pos, (8, 1))
    other = walk.at(np.concatenate((frames[:5], [90, 91, 92])))
    one, two = (follow(solver_of(name, dancer), t, posture) for t in (walk.at(frames), other))
    assert isinstance(solver_of(name, dancer), FrameSolver)
    np.testing.assert_array_equal(one[:5], two[:5])
    assert np.abs(one[5:] - two[5:]).max() > 1e-3


@pytest.mark.parametrize("name", backends())
def test_targets_that_leap_are_followed_no_faster_than_the_motors_go(name, walk, dancer):
    frames = np.array([5, 5, 5, 95, 95, 20, 20])  # from one step into another
    leaps = walk.at(frames)
    swung = {k: (v * [1.0, 1.0, -1.0] if "elbow" in k[0] else v) for k, v in leaps.limbs.items()}
    leaps = dataclasses.replace(
        leaps, limbs={k: np.where([[t % 2] for t in range(7)], swung[k], v) for k, v in leaps.limbs.items()}
    )
    q = follow(solver_of(name, dancer), leaps, np.tile(dancer.default_joint_pos, (7, 1)))
    share = np.abs(np.diff(q[:, 7:], axis=0)) * FPS / dancer.velocity
    assert share.max() <= CONFIG.speed_share * (1.0 + 1e-9)
    assert share.max() > 0.9 * CONFIG.speed_share  # the control: the limit is not idle
    low, high = dancer.ranges(CONFIG.limit_margin)
    assert (q[:, 7:] >= low - 1e-9).all() and (q[:, 7:] <= high + 1e-9).all()


def test_what_can_be_reached_is_the_range_cut_to_one_frames_way(dancer, rng):
    low, high = dancer.ranges(CONFIG.limit_margin)
    np.testing.assert_array_equal(reachable(dancer, None, CONFIG, FPS), (low, high))
    last = rng.uniform(low, high)
    for fps in (25.0, 50.0):
        lower, upper = reachable(dancer, last, CONFIG, fps)
        assert (low <= lower).all() and (upper <= high).all() and (lower <= last).all() and (last <= upper).all()
        free = (lower > low) & (upper < high)
        np.testing.assert_allclose((upper - lower)[free], 2.0 * CONFIG.speed_share * dancer.velocity[free] / fps)
        assert free.any()
