"""From clip to reference: stages that agree with one another, what each is told, what is refused."""

import dataclasses

import numpy as np
import pytest
from conftest import SAMPLES
from person import elsewhere, stepping

from clips import RobotClip, cut, read_clip
from retarget import RetargetConfig, RetargetError, retarget
from retarget.pipeline import finish_reference, meta_of, prepare, solve
from retarget.targets.leads import add_leads
from robot_models.maths import rotation as rot
from robot_models.maths import silent

BARE = RetargetConfig(lead_in_s=0.0, lead_out_s=0.0, dynamics=False)


@pytest.fixture(scope="module")
def clip():
    return cut(read_clip(SAMPLES / "groove.bvh"), 1.0, 1.12)


def test_stages_one_by_one_give_what_the_whole_gives(clip, dancer):
    part = prepare(clip, dancer, BARE)
    padded = add_leads(dancer, part.coarse, part.targets, BARE)
    qpos, _ = solve(dancer, padded, part.posture, part.pins, BARE, silent, part.hands)
    whole = retarget(clip, dancer, BARE)
    np.testing.assert_allclose(whole.reference.joint_pos, qpos[:, 7:], atol=1e-12)
    np.testing.assert_array_equal(whole.reference.contact, part.contacts.labels)
    assert whole.reference.frames == part.source.frames == len(part.coarse)
    assert whole.dynamics is None and whole.reference.joint_torque is None


@pytest.mark.parametrize("solver", ["mink", "whole-clip"])
def test_progress_runs_to_its_end_and_is_told_in_order(clip, dancer, solver):
    told = []
    retarget(clip, dancer, dataclasses.replace(BARE, solver=solver), progress=lambda *what: told.append(what))
    stages, done, total = zip(*told, strict=True)
    assert list(dict.fromkeys(stages)) == (["optimise", "physics"] if solver == "whole-clip" else ["frame by frame"])
    for stage in set(stages):
        its = [(d, n) for s, d, n in zip(stages, done, total, strict=True) if s == stage]
        assert its == sorted(its) and its[-1][0] == its[-1][1] and len({n for _, n in its}) == 1


def test_a_solver_that_is_none_is_refused(clip, dancer):
    with pytest.raises(RetargetError, match="whole-clip, mink or placo"):
        retarget(clip, dancer, dataclasses.replace(BARE, solver="newton"))


def test_the_dance_begins_over_the_origin_facing_x_wherever_it_was_recorded(dancer):
    clip = stepping()
    clip = dataclasses.replace(clip, positions=clip.positions[18:30])
    here, there = (prepare(c, dancer, BARE) for c in (clip, elsewhere(clip, 2.0, (5.0, -8.0, 0.0))))
    np.testing.assert_allclose(there.targets.pelvis_pos, here.targets.pelvis_pos, atol=1e-9)
    # Half of the sway that 1 Hz of following leaves.
    assert np.abs(here.targets.pelvis_pos[0, :2]).max() < 0.05
    assert abs(rot.yaw(here.targets.pelvis_quat[0])) < 0.02
    np.testing.assert_allclose(there.coarse[:, 7:], here.coarse[:, 7:], atol=1e-4)  # iterated, and damped by rounding


def recording(robot, frames=8):
    qpos, t = np.tile(robot.default_qpos, (frames, 1)), np.arange(frames) / 50.0
    qpos[:, 7 + robot.joint("left_elbow")] -= 0.4 * np.sin(3.0 * t)
    return RobotClip(
        fps=50.0, robot=robot.name, joint_names=robot.joint_names, root_pos=qpos[:, :3], root_quat=qpos[:, 3:7],
        joint_pos=qpos[:, 7:], source=stepping().source,
    )  # fmt: skip


def test_a_recording_of_this_very_robot_is_its_own_posture_and_one_of_another_is_not(dancer):
    from robot_models import load_robot

    clip = recording(dancer)
    np.testing.assert_allclose(prepare(clip, dancer, BARE).posture[:, 7:], clip.joint_pos, atol=1e-12)
    other = load_robot("g1")
    posture = prepare(clip, other, BARE).posture
    unturned = [
        7 + k for k, name in enumerate(other.joint_names) if "wrist" not in name
    ]  # hands are turned as the dancer's
    np.testing.assert_array_equal(posture[:, unturned], np.tile(other.default_qpos[unturned], (8, 1)))


def test_what_was_found_out_is_added_to_a_reference_and_its_motion_stays(clip, dancer):
    result = retarget(clip, dancer, BARE)
    meta = meta_of([result.source, result.source], BARE, result.report)
    assert meta["source"]["file"] == "groove.bvh" and len(meta["more_sources"]) == 1
    assert "more_sources" not in meta_of([result.source], BARE, result.report)
    assert meta == meta_of([result.source, result.source], BARE, result.report)  # nothing of time or place
    again = finish_reference(result.reference, {"note": 1}, None)
    assert again.meta["note"] == 1 and again.meta["segment_names"] == result.reference.meta["segment_names"]
    np.testing.assert_array_equal(again.qpos, result.reference.qpos)


def test_the_references_rate_is_the_configurations_whatever_the_clips(dancer):
    for fps in (30.0, 50.0):
        config = dataclasses.replace(BARE, fps=fps, solver="mink")
        result = retarget(stepping(100.0, seconds=0.3), dancer, config)
        assert result.reference.fps == fps
        assert result.reference.duration_s == pytest.approx(0.29, abs=1.0 / fps)
