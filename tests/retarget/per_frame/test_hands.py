"""Hands turned as the person's: the frame of a hand, the wrist's angles, what the solver makes of them."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES
from scipy.spatial.transform import Rotation

from clips import HumanClip, MetricKey, read_clip
from clips.edit import resample
from clips.provenance import Provenance
from retarget import RetargetConfig, retarget
from retarget.per_frame import hand_errors, hand_goals, hold_hands, wrists
from retarget.targets import hand_frames
from robot_models import forward_kinematics, load_robot
from robot_models.maths import rotation as rot

FRAMES = 40


def person(turn, zero):
    """Somebody in a T-pose or with hanging arms at zero, whose left forearm is ahead and turned about its length by `turn` [rad].

    Args:
        turn: (T,) of the hand about the forearm, from the thumb up.
        zero: where the left arm points at the skeleton's zero pose: "out" or "down".
    """
    names = ("pelvis", "chest", "head") + tuple(
        f"{s}_{p}" for s in ("left", "right") for p in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    )
    place = {"pelvis": (0, 0, 1.0), "chest": (0, 0, 1.3), "head": (0, 0, 1.7)}
    for side, y in (("left", 1), ("right", -1)):
        place |= {
            f"{side}_hip": (0, 0.1 * y, 1.0), f"{side}_knee": (0.02, 0.1 * y, 0.5), f"{side}_ankle": (0, 0.1 * y, 0.05),
            f"{side}_shoulder": (0, 0.2 * y, 1.4), f"{side}_elbow": (0, 0.2 * y, 1.1), f"{side}_wrist": (0.25, 0.2 * y, 1.1),
        }  # fmt: skip
    turns = {n: Rotation.identity() for n in names}
    for side, y in (("left", 1), ("right", -1)):
        # From the zero pose: an arm that points out comes down, its forearm ahead; hanging, the forearm comes up.
        arm = Rotation.from_rotvec([-y * np.pi / 2, 0, 0]) if zero == "out" else Rotation.identity()
        forearm = Rotation.from_rotvec([0, -np.pi / 2, 0]) * arm
        turns |= {f"{side}_shoulder": arm, f"{side}_elbow": forearm, f"{side}_wrist": forearm}
    points = np.tile(np.array([place[n] for n in names], dtype=float), (FRAMES, 1, 1))
    quats = np.tile([turns[n].as_quat()[[3, 0, 1, 2]] for n in names], (FRAMES, 1, 1)).astype(float)
    hand = Rotation.from_rotvec(np.outer(turn, [1.0, 0.0, 0.0])) * turns["left_wrist"]
    quats[:, names.index("left_wrist")] = hand.as_quat()[:, [3, 0, 1, 2]]
    return HumanClip(
        fps=50.0, names=names, positions=points, orientations=quats, parents=(-1,) * len(names), landmarks={n: n for n in names},
        height=1.75, source=Provenance(file="x", sha256="0", dialect="test"),
    )  # fmt: skip


TURN = np.linspace(0.5, 1.5, FRAMES)


def test_a_t_pose_tells_the_thumb_exactly_and_hanging_arms_on_average():
    exact, mean = (hand_frames(person(TURN, zero), "left") for zero in ("out", "down"))
    want = Rotation.from_rotvec(np.outer(TURN, [1.0, 0.0, 0.0]))  # x ahead, z up where the turn is 0
    assert (Rotation.from_quat(exact[:, [1, 2, 3, 0]]) * want.inv()).magnitude().max() < 1e-6
    # Without a T-pose the mean turn is taken for none: the motion stays, its middle is lost.
    off = (
        Rotation.from_quat(mean[:, [1, 2, 3, 0]])
        * Rotation.from_rotvec(np.outer(TURN - TURN.mean(), [1.0, 0.0, 0.0])).inv()
    )
    assert off.magnitude().max() < 1e-3
    without = replace(person(TURN, "out"), orientations=None)
    assert hand_frames(without, "left") is None and hand_goals(without, load_robot("g1")) == {}


@pytest.mark.parametrize("name", ["g1", "dancer", "h2"])
def test_a_wrist_turns_the_hand_to_its_goal_inside_its_ranges(name):
    robot = load_robot(name)
    chains = wrists(robot)
    assert all(len(joints) == 3 for joints in chains.values())
    rng = np.random.default_rng(0)
    joints = [j for side in chains.values() for j in side]
    qpos = np.tile(robot.default_qpos, (FRAMES, 1))
    swing = 0.5 * np.sin(np.linspace(0, 3, FRAMES))[:, None] * rng.uniform(0.3, 1.0, len(joints))
    qpos[:, [7 + j for j in joints]] = np.clip(swing, robot.lower[joints] + 0.05, robot.upper[joints] - 0.05)
    _, quat = forward_kinematics(robot, qpos)
    goals = {side: quat[:, robot.landmark(f"{side}_wrist")] for side in chains}
    start = np.tile(robot.default_qpos, (FRAMES, 1))
    held = hold_hands(robot, start, goals, 50.0)
    off, can = hand_errors(robot, held, goals)
    assert np.degrees(off).mean() < 3.0 and can.all()
    assert np.array_equal(
        np.delete(held, [7 + j for j in joints], axis=1), np.delete(start, [7 + j for j in joints], axis=1)
    )
    far = {side: np.tile([0.0, 0.0, 1.0, 0.0], (FRAMES, 1)) for side in chains}  # behind: no wrist can
    capped = hold_hands(robot, start, far, 50.0)[:, 7:]
    assert np.all(capped >= robot.lower - 1e-9) and np.all(capped <= robot.upper + 1e-9)
    assert not hand_errors(robot, hold_hands(robot, start, far, 50.0), far)[1].all()


def test_a_robot_whose_arms_end_at_the_elbow_gets_no_goal():
    assert wrists(load_robot("h1")) == {} and wrists(load_robot("t1")) == {}
    assert hand_goals(person(TURN, "out"), load_robot("h1")) == {}


def test_hands_are_turned_in_the_dance_and_reported():
    clip = read_clip(SAMPLES / "groove.bvh")
    turns = np.array(clip.orientations[:200])
    hand = clip.names.index(clip.landmarks["left_wrist"])
    swing = np.zeros((200, 3))
    swing[:, 0] = 0.8 * np.sin(np.linspace(0.0, 8.0, 200))
    turns[:, hand] = rot.multiply(turns[:, hand], rot.exp(swing))
    clip = resample(replace(clip, positions=clip.positions[:200], orientations=turns), 50.0)
    values = []
    for hands in (False, True):
        result = retarget(clip, load_robot("g1"), RetargetConfig(hands=hands))
        assert not result.report.failures
        values.append({m.key: m.value for m in result.report.metrics})
    assert values[1][MetricKey.HAND_TURN_ERROR] < 6.0 and values[0][MetricKey.HAND_TURN_ERROR] > 12.0
    assert values[1][MetricKey.HAND_IN_REACH] > 95.0
    assert abs(values[1][MetricKey.LIMB_DIRECTION_ERROR] - values[0][MetricKey.LIMB_DIRECTION_ERROR]) < 0.5
