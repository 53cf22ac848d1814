"""Several dances as one: segments, places, feet between them."""

import numpy as np
import pytest
from conftest import SAMPLES

from clips import FREE, cut, read_clip
from retarget import retarget_sequence
from robot_models import heel_toe_positions
from robot_models.maths import rotation as rot


@pytest.fixture(scope="module")
def song():
    from robot_models import load_robot

    dance = read_clip(SAMPLES / "groove.bvh")
    return retarget_sequence([cut(dance, 0.0, 2.0), cut(dance, 5.0, 7.0)], load_robot("dancer"))


def test_dances_and_bridges_follow_one_another(song):
    result, transitions = song
    r = result.reference
    assert r.meta["segment_names"] == ["lead-in", "dance", "bridge", "dance", "lead-out"]
    assert (r.segments[1:, 0] == r.segments[:-1, 1]).all() and r.segments[-1, 1] == r.frames
    assert (r.dance.start, r.dance.stop) == (r.segments[1, 0], r.segments[3, 1])
    assert len(transitions) == 1 and transitions[0].at_s == pytest.approx(r.segments[2, 0] / r.fps)
    assert [s["file"] for s in (r.meta["source"], *r.meta["more_sources"])] == ["groove.bvh"] * 2


def test_the_next_dance_begins_where_the_last_one_ended(song):
    r = song[0].reference
    (_, end, _), (start, _, _) = r.segments[1], r.segments[3]
    assert np.linalg.norm(r.body_pos_w[start, 0, :2] - r.body_pos_w[end - 1, 0, :2]) < 0.05
    turn = rot.yaw(r.body_quat_w[[end - 1, start], 0])
    assert abs(np.angle(np.exp(1j * np.diff(turn)[0]))) < 0.1


def test_feet_step_across_and_do_not_slide(song, dancer):
    r = song[0].reference
    bridge = slice(*r.segments[2, :2])
    edges = heel_toe_positions(dancer, r.body_pos_w, r.body_quat_w)[bridge]
    planted = r.contact[bridge] != FREE
    speed = np.linalg.norm(np.diff(edges[..., :2], axis=0), axis=-1) * r.fps
    assert np.percentile(speed[planted[1:] & planted[:-1]], 95) < 0.05
    assert planted.any(axis=1).all()  # never both feet off the floor


def test_all_gates_hold_over_bridges_and_leads(song):
    assert song[0].report.passed, song[0].report.failures


def test_a_loop_begins_again_from_its_first_pose(dancer):
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 2.0)
    result, transitions = retarget_sequence([clip, clip], dancer)
    r = result.reference
    first, again = (r.joint_pos[r.segments[k, 0] + 10] for k in (1, 3))
    np.testing.assert_allclose(first, again, atol=0.1)
    assert str(transitions[0]).startswith("seam at")
