"""Half a body from one clip and half from another."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES

from clips import read_clip
from clips.edit import placed, recentre
from retarget import retarget
from retarget.targets import as_figure, join_halves, with_standing_legs
from robot_models import load_robot


@pytest.fixture(scope="module")
def groove_clip():
    return read_clip(SAMPLES / "groove.bvh")


def still(clip):
    """The same person, who does not move."""
    turns = None if clip.orientations is None else np.repeat(clip.orientations[:1], clip.frames, axis=0)
    return replace(clip, positions=np.repeat(clip.positions[:1], clip.frames, axis=0), orientations=turns)


def test_a_clip_joined_with_itself_is_itself(groove_clip):
    whole = join_halves(groove_clip, groove_clip)
    for mark in ("left_wrist", "right_ankle", "head", "pelvis", "left_toe"):
        assert np.allclose(whole.point(mark), groove_clip.point(mark), atol=1e-9)
    assert whole.orientations is not None
    assert np.allclose(np.abs(np.sum(whole.orientation("head") * groove_clip.orientation("head"), axis=1)), 1.0)


def test_where_the_other_clip_stands_faces_and_how_tall_it_is_does_not_count(groove_clip):
    other = placed(groove_clip, 2.0, np.array([3.0, -1.0, 0.4]), "elsewhere")
    small = replace(other, positions=0.7 * other.positions, height=0.7 * other.height)
    for arms in (other, small):
        whole = join_halves(groove_clip, arms)
        assert np.allclose(whole.point("left_wrist"), groove_clip.point("left_wrist"), atol=1e-6)


def test_legs_of_one_and_arms_of_another_keep_their_own_motion(groove_clip):
    whole = join_halves(still(groove_clip), groove_clip)
    assert np.ptp(whole.point("left_ankle"), axis=0).max() < 1e-9
    beside = whole.point("left_wrist") - whole.point("pelvis")
    assert np.ptp(beside, axis=0).max() > 0.2
    other = join_halves(groove_clip, still(groove_clip))
    assert np.allclose(other.point("left_ankle"), groove_clip.point("left_ankle"))
    half = replace(groove_clip, positions=groove_clip.positions[:100], orientations=groove_clip.orientations[:100])
    assert join_halves(groove_clip, half).frames == 100


def test_a_robots_recording_gives_a_half_too(groove, groove_clip):
    clip = as_figure(_robot_clip(groove.reference))
    whole = join_halves(groove_clip, clip)
    assert whole.fps == groove_clip.fps and whole.frames > 100
    assert np.allclose(whole.point("left_ankle"), groove_clip.point("left_ankle")[: whole.frames])


def _robot_clip(reference):
    from clips.clip import RobotClip
    from clips.provenance import Provenance

    return RobotClip(
        fps=reference.fps, robot=reference.robot, joint_names=tuple(reference.joint_names), root_pos=reference.body_pos_w[:, 0],
        root_quat=reference.body_quat_w[:, 0], joint_pos=reference.joint_pos,
        source=Provenance(file="x.npz", sha256="0", dialect="test"),
    )  # fmt: skip


def test_standing_legs_stand_and_the_robot_signs_over_them(groove_clip):
    figure = with_standing_legs(recentre(groove_clip))
    assert np.ptp(figure.point("left_ankle"), axis=0).max() == 0.0
    lift = figure.point("pelvis")[:, 2] - figure.point("left_ankle")[:, 2]
    assert np.allclose(lift, lift[0]) and figure.point("left_toe")[0, 2] == pytest.approx(0.0, abs=1e-9)
    assert np.all(figure.point("left_toe")[:, 0] > figure.point("left_ankle")[:, 0] + 0.1)  # it faces ahead
    result = retarget(figure, load_robot("g1"))
    assert not result.report.failures
    feet = result.reference.body_pos_w[60:-60, list(result.reference.body_names).index("left_ankle_roll_link")]
    assert np.ptp(feet, axis=0).max() < 2e-3
