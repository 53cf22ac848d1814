"""Tempo and side: pace is the derivative of the way through the clip, and a reflection keeps what a mirror keeps."""

from dataclasses import replace

import numpy as np
import pytest
from stick_person import NAMES, PARENTS, person, robot_clip

from clips import ClipError, at_speed, full_qpos, mirror, warp_time
from robot_models import forward_kinematics, load_robot, other_side
from robot_models.maths import rotation as rot

MIRROR = np.array([1.0, -1.0, 1.0])


def counting(frames=200):
    """A clip whose points are where the frame's number says, so that an output tells where in the clip it came from."""
    clip = person(frames=frames)
    return replace(
        clip, positions=np.broadcast_to(np.arange(frames)[:, None, None], clip.positions.shape).astype(float)
    )


def test_speeds_multiply_and_frames_stay():
    for clip in (person(), robot_clip()):
        twice = at_speed(at_speed(clip, 0.5), 3.0)
        assert twice.fps == pytest.approx(1.5 * clip.fps) and twice.frames == clip.frames
        back = at_speed(at_speed(clip, 4.0), 0.25)
        assert back.fps == clip.fps and len(back.source.conversions) == 2
        assert at_speed(clip, 1.0) is clip


@pytest.mark.parametrize("factor", [-1.0, 100.0, float("nan"), float("inf")])
def test_a_speed_that_is_none_is_refused(factor):
    with pytest.raises(ClipError, match="speed: found .* positive factor"):
        at_speed(robot_clip(), factor)


def test_the_way_through_a_warped_clip_is_the_integral_of_its_pace():
    clip = counting()
    pace = 1.0 + 0.5 * np.sin(np.arange(200) / 15.0)
    at = warp_time(clip, pace).positions[:, 0, 0]
    assert at[0] == 0.0 and (np.diff(at) > 0).all() and 199 - 1.5 < at[-1] <= 199
    # One frame later it is `pace` frames further: the pace halfway between, which a chord misses by its curvature,
    # 0.5 / 15^2 / 8.
    halfway = np.interp(0.5 * (at[1:] + at[:-1]), np.arange(200), pace)
    np.testing.assert_allclose(np.diff(at), halfway, atol=0.01)
    assert np.abs(np.diff(at) - 1.0 / halfway).max() > 0.3  # negative control: the inverse pace


def test_a_steady_pace_of_one_changes_no_number():
    clip = person()
    same = warp_time(clip, np.ones(clip.frames))
    np.testing.assert_allclose(same.positions, clip.positions, atol=1e-12)
    assert rot.angle_between(same.orientations, clip.orientations).max() < 1e-7


def test_warping_by_a_pace_and_by_its_inverse_in_the_new_time_returns_the_clip():
    clip = counting()
    pace = np.linspace(0.5, 1.5, 200)
    slow = warp_time(clip, pace)
    there = slow.positions[:, 0, 0]  # the old frame of every new one
    back = warp_time(slow, 1.0 / np.interp(there, np.arange(200), pace)).positions[:, 0, 0]
    # Trapezoids of a smooth pace: their error adds up to some hundredths of a frame.
    np.testing.assert_allclose(back[:190], np.arange(190), atol=0.05)


@pytest.mark.parametrize("bad", [0.0, -0.5, float("nan")])
def test_a_pace_that_stands_still_or_runs_back_is_refused(bad):
    pace = np.ones(20)
    pace[3] = bad
    with pytest.raises(ClipError, match="pace: .*positive factors"):
        warp_time(robot_clip(), pace)


def test_the_slowest_moment_is_on_record_with_its_time():
    pace = np.ones(60)
    pace[45] = 0.25
    assert "0.25 of its speed at 1.50 s" in warp_time(person(fps=30.0), pace).source.conversions[-1]


def test_a_mirror_keeps_lengths_and_takes_every_landmark_to_the_other_side():
    clip = person()
    other = mirror(clip)
    for part in ("knee", "wrist", "toe"):
        np.testing.assert_array_equal(other.point(f"left_{part}"), clip.point(f"right_{part}") * MIRROR)
        np.testing.assert_array_equal(other.point(f"right_{part}"), clip.point(f"left_{part}") * MIRROR)
    np.testing.assert_array_equal(other.point("head"), clip.point("head") * MIRROR)
    bones = [np.linalg.norm(c.positions[:, 1:] - c.positions[:, list(PARENTS[1:])], axis=-1) for c in (clip, other)]
    np.testing.assert_array_equal(*bones)


def test_a_mirrored_person_still_walks_ahead_which_a_reflection_alone_would_not():
    def ahead(clip):
        left = clip.point("left_hip") - clip.point("right_hip")
        forward = np.cross(left, [0.0, 0.0, 1.0])
        return np.sum(forward * (clip.point("left_toe") - clip.point("left_ankle")), axis=-1)

    clip = person()
    assert (ahead(clip) > 0).all() and (ahead(mirror(clip)) > 0).all()
    assert (ahead(replace(clip, positions=clip.positions * MIRROR)) < 0).all()  # negative control


def test_orientations_are_reflected_on_both_sides():
    """The frame of a mirrored point is M R M, so that a bone seen from its frame is the mirrored bone."""
    clip = person()
    other = mirror(clip)
    m = np.diag(MIRROR)
    np.testing.assert_allclose(rot.to_matrix(other.orientations), m @ rot.to_matrix(clip.orientations) @ m, atol=1e-12)
    k, parent = NAMES.index("left_wrist"), NAMES.index("left_elbow")
    seen = [rot.rotate(rot.conjugate(c.orientations[:, parent]), c.positions[:, k] - c.positions[:, parent])
            for c in (clip, other)]  # fmt: skip
    np.testing.assert_allclose(seen[1], seen[0] * MIRROR, atol=1e-12)
    assert np.abs(seen[1] - seen[0]).max() > 0.01  # negative control: not the unmirrored bone


@pytest.mark.parametrize("robot", ["dancer", "g1", "talos"])
@pytest.mark.parametrize("part", [slice(None), slice(3, None)], ids=["all joints", "some"])
def test_a_robots_mirror_image_has_its_bodies_on_the_other_side(robot, part):
    """By forward kinematics: every body is where its counterpart was, reflected; and twice mirrored is as it was."""
    model = load_robot(robot)
    rng = np.random.default_rng(0)
    kept = [n for n in model.joint_names if "wrist" not in n] if part.start else list(model.joint_names)
    at = [model.joint(n) for n in kept]
    angles = np.clip(rng.normal(0.0, 0.3, (20, len(kept))), 0.9 * model.lower[at], 0.9 * model.upper[at])
    clip = robot_clip(
        20, names=kept, robot=robot, joint_pos=angles, root_pos=rng.normal(size=(20, 3)),
        root_quat=rot.normalise(rng.normal(size=(20, 4))),
    )  # fmt: skip
    other = mirror(clip)
    pos, mirrored = (forward_kinematics(model, full_qpos(c, model))[0] for c in (clip, other))
    np.testing.assert_allclose(
        mirrored[:, other_side(model.body_names)], pos * MIRROR, atol=2e-5
    )  # G1's model is not quite alike
    again = mirror(other)
    assert set(again.joint_names) == set(kept)
    np.testing.assert_allclose(full_qpos(again, model), full_qpos(clip, model), atol=1e-12)


def test_a_robot_that_is_no_mirror_image_of_itself_is_refused():
    model = load_robot("jvrc1")
    clip = robot_clip(20, names=model.joint_names, robot="jvrc1", joint_pos=np.zeros((20, len(model.joint_names))))
    with pytest.raises(ClipError, match="whose two sides are not alike"):
        mirror(clip)
