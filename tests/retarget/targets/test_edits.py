"""The user's own touches, key frames, tempo and side."""

import dataclasses

import numpy as np
import pytest
from conftest import SAMPLES
from damage import read_shared

from clips import FREE, GLIDING, PLANTED, ClipError, at_speed, cut, mirror, read_clip, warp_time
from retarget import (
    FitConfig,
    KeyFrame,
    RetargetConfig,
    RetargetError,
    fit_to_dynamics,
    read_contacts,
    read_keys,
    retarget,
    write_contacts,
)
from retarget.config import PhysicsConfig, WholeClipConfig
from retarget.targets.contacts import find_contacts
from retarget.targets.edits import apply_edits
from retarget.workflows.time_scaling import pace_for
from robot_models import PART_NAMES, lowest_points

SHORT = RetargetConfig(lead_in_s=0.0, lead_out_s=0.0)
AS_IT_IS = RetargetConfig(
    lead_in_s=0.0, lead_out_s=0.0, whole_clip=WholeClipConfig(physics=PhysicsConfig(weight=0.0))
)  # the solver bends nothing to what physics allows


@pytest.fixture(scope="module")
def clip():
    return cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 2.0)


def padded_by_leads(reference, labels):
    contact = np.array(reference.contact)
    contact[reference.dance] = labels
    return contact


def test_written_touches_read_back_as_the_same(groove, tmp_path):
    labels = groove.contacts.labels
    dance = dataclasses.replace(groove.reference, contact=padded_by_leads(groove.reference, labels))
    write_contacts(dance, tmp_path / "c.csv")
    nothing = find_contacts(groove.source, SHORT.contact)
    again = apply_edits(nothing, read_contacts(tmp_path / "c.csv"), 50.0)
    np.testing.assert_array_equal(again.labels, labels)


def test_touches_given_back_unedited_are_the_same_dance(shared, dancer, tmp_path):
    fast = cut(read_shared(shared, "amc/cmu_charleston1.amc"), 0.0, 4.0)
    first = retarget(fast, dancer, SHORT)
    assert (first.reference.contact == GLIDING).any()
    write_contacts(first.reference, tmp_path / "c.csv")
    again = retarget(fast, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv"))
    np.testing.assert_array_equal(again.reference.contact, first.reference.contact)
    np.testing.assert_allclose(again.reference.joint_pos, first.reference.joint_pos, atol=1e-9)


def test_other_parts_of_the_body_touch_as_stated_and_are_written_beside_the_soles(clip, dancer, tmp_path):
    (tmp_path / "c.csv").write_text("start,end,edge,kind\n0.5,1.0,left_hand,planted\n0.2,0.4,pelvis,gliding\n")
    edits = read_contacts(tmp_path / "c.csv")
    reference = retarget(clip, dancer, AS_IT_IS, contacts=edits).reference
    hand, pelvis = (reference.part_contact[:, PART_NAMES.index(name)] for name in ("left_hand", "pelvis"))
    assert (hand[25:50] == PLANTED).all() and (pelvis[10:20] == GLIDING).all()
    assert not hand[:25].any() and reference.part_contact.astype(bool).sum() == 35
    lowest = lowest_points(dancer, reference.body_pos_w, reference.body_quat_w)
    assert lowest[35:45, dancer.landmark("left_wrist")].max() < 0.05  # led down, as far as goals of other parts let it
    write_contacts(reference, tmp_path / "again.csv")
    again = [e for e in read_contacts(tmp_path / "again.csv") if e.edge == "left_hand" and e.kind != "free"]
    assert again == [edits[0]]


def test_touches_of_floor_work_given_back_unedited_are_the_same_dance(shared, dancer, tmp_path):
    clip = read_shared(shared, "deepmimic/humanoid3d_getup_facedown.txt")
    first = retarget(clip, dancer, SHORT)
    write_contacts(first.reference, tmp_path / "c.csv")
    again = retarget(clip, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv")).reference
    assert first.reference.part_contact.any()
    np.testing.assert_array_equal(again.part_contact, first.reference.part_contact)
    np.testing.assert_allclose(again.joint_pos, first.reference.joint_pos, atol=1e-9)


def test_touches_outside_the_dance_are_refused(clip, dancer, tmp_path):
    (tmp_path / "c.csv").write_text("start;end;edge;kind\n5.0;6.0;left_toe;gliding\n")
    with pytest.raises(RetargetError, match="seconds of the dance"):
        retarget(clip, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv"))


def test_stated_touches_win_over_detected_ones(clip, dancer, tmp_path):
    (tmp_path / "c.csv").write_text("start,end,edge,kind\n0.5,1.0,left_heel,free\n0.5,1.0,left_toe,pivoting\n")
    result = retarget(clip, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv"))
    assert (result.reference.contact[25:50, 0] == 0).all() and (result.reference.contact[25:50, 1] == 2).all()


def test_what_is_said_to_glide_glides_and_what_is_said_to_be_free_does_not(clip, dancer, tmp_path):
    """A turn on one foot without a touch of its own: the solver lets edges carry that no row speaks of."""
    free = "".join(f"0.5,1.0,{edge},free\n" for edge in ("left_heel", "left_toe", "right_heel"))
    (tmp_path / "c.csv").write_text(f"start,end,edge,kind\n{free}0.5,1.0,right_toe,gliding\n")
    contact = retarget(clip, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv")).reference.contact[25:50]
    assert (contact[:, 3] == GLIDING).all() and (contact[:, :3] == FREE).all()
    (tmp_path / "c.csv").write_text(f"start,end,edge,kind\n{free}")
    assert (
        retarget(clip, dancer, SHORT, contacts=read_contacts(tmp_path / "c.csv")).reference.contact[25:50, :3] == 0
    ).all()


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("start,end,edge\n0,1,left_toe\n", "columns"),
        ("start,end,edge,kind\n0,1,left_tow,free\n", "line 2"),
        ("start,end,edge,kind\n0,1,left_toe,stuck\n", "planted"),
        ("start,end,edge,kind\n1,0,left_toe,free\n", "start before end"),
        ("start,end,edge,kind\n0,nan,left_toe,free\n", "finite"),
        ("start,end,edge,kind\n0,1,left_toe\n", "too few"),
    ],
)
def test_bad_touches_are_refused_with_their_line(tmp_path, text, match):
    (tmp_path / "c.csv").write_text(text)
    with pytest.raises(RetargetError, match=match):
        read_contacts(tmp_path / "c.csv")


def test_key_frames_are_respected_and_smooth(clip, dancer, tmp_path):
    j = dancer.joint("left_elbow")
    free = retarget(clip, dancer, SHORT).reference
    wanted = float(free.joint_pos[50, j]) + (0.4 if free.joint_pos[50, j] + 0.4 < dancer.upper[j] else -0.4)
    (tmp_path / "k.csv").write_text(f"time,joint,value\n1.0,left_elbow,{wanted}\n")
    result = retarget(clip, dancer, SHORT, keys=read_keys(tmp_path / "k.csv"))
    assert result.reference.joint_pos[50, j] == pytest.approx(wanted, abs=0.02)
    assert result.report.passed, result.report.failures
    np.testing.assert_allclose(result.reference.joint_pos[:10], free.joint_pos[:10], atol=0.02)


def test_key_frames_may_be_in_degrees(tmp_path):
    (tmp_path / "k.csv").write_text("time,joint,degrees\n1.0,left_elbow,90\n")
    (key,) = read_keys(tmp_path / "k.csv")
    assert key.value == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(("time", "value", "match"), [(9.0, 0.0, "9 s"), (1.0, 9.0, "rad")])
def test_key_frames_that_cannot_be_are_refused(clip, dancer, time, value, match):
    with pytest.raises(RetargetError, match=match):
        retarget(clip, dancer, SHORT, keys=[KeyFrame(time=time, joint="left_elbow", value=value)])


def test_mirrored_twice_is_the_clip(clip):
    again = mirror(mirror(clip))
    np.testing.assert_array_equal(again.positions, clip.positions)
    np.testing.assert_array_equal(again.orientations, clip.orientations)
    assert again.landmarks == clip.landmarks


def test_a_mirrored_clip_gives_the_mirrored_dance(clip, dancer):
    plain, other = retarget(clip, dancer, SHORT).reference, retarget(mirror(clip), dancer, SHORT).reference
    for name in ("elbow", "knee", "hip_pitch", "shoulder_pitch"):
        a, b = (r.joint_pos[:, dancer.joint(f"{s}_{name}")] for r, s in ((plain, "left"), (other, "right")))
        assert np.abs(np.abs(a) - np.abs(b)).mean() < 0.02, name


def test_speed_changes_the_length_and_not_the_path(clip):
    slow = at_speed(clip, 0.5)
    assert (slow.frames, slow.fps) == (clip.frames, clip.fps / 2)
    with pytest.raises(ClipError, match="positive"):
        at_speed(clip, 0.0)


def test_a_warped_clip_takes_the_time_that_its_pace_says(clip):
    slow = warp_time(clip, np.full(clip.frames, 0.5))
    assert slow.frames == 2 * clip.frames - 1 and slow.fps == clip.fps
    np.testing.assert_allclose(slow.positions[::2], clip.positions, atol=1e-9)


def test_pace_leaves_alone_what_is_easy_and_what_flies():
    score, flight = np.zeros(200), np.zeros(200, dtype=bool)
    score[100], score[180], flight[175:185] = 3.0, 3.0, True
    pace = pace_for(score, flight, 50.0, FitConfig())
    assert pace[100] < 0.65 and (pace[:60] > 0.99).all() and (pace[175:185] == 1.0).all()


def test_fitting_slows_a_hurried_dance_until_physics_allows_it(dancer):
    pytest.importorskip("pinocchio")
    hurried = at_speed(cut(read_clip(SAMPLES / "groove.bvh"), 7.0, 9.5), 2.0)
    plain, slowed = retarget(hurried, dancer, AS_IT_IS), fit_to_dynamics(hurried, dancer, AS_IT_IS)
    impossible = [(r.dynamics.score >= 1.0).sum() for r in (plain, slowed)]
    assert impossible[0] > 5  # the control
    assert impossible[1] < 0.3 * impossible[0]
    assert slowed.reference.frames > plain.reference.frames
    assert any("paced" in c for c in slowed.source.source.conversions)


def test_key_frames_are_refused_where_they_would_be_ignored(clip, dancer):
    key = KeyFrame(time=1.0, joint="left_elbow", value=0.0)
    with pytest.raises(RetargetError, match="whole-clip"):
        retarget(clip, dancer, RetargetConfig(solver="mink"), keys=[key])
