"""Why a gate does not hold: made wrong on purpose, it has to be named, timed, laid at the right door, and cured."""

import dataclasses

import numpy as np
import pytest
from person import person, standing_feet
from standing import reference_of, standing

from clips import MetricKey, cut, read_clip
from clips.edit import mirror
from retarget import Gates, RetargetConfig, diagnose, measure, retarget, retarget_sequence
from retarget.report.diagnosis import _parting
from robot_models import self_collisions

FPS, FRAMES = 50.0, 300


def told(robot, qpos, source, **gates):
    reference = reference_of(robot, qpos)
    report = measure(reference, robot, source, Gates(**gates))
    return {d.metric.key: d for d in diagnose(report, reference, [source])}


@pytest.fixture
def still():
    return person(*standing_feet(FRAMES), fps=FPS)


def test_a_hand_in_a_thigh_is_named_with_its_moment_and_the_recordings_distance(dancer, still):
    qpos = standing(dancer, FRAMES)
    through = np.exp(-0.5 * ((np.arange(FRAMES) - 100) / 5.0) ** 2)
    for name, angle in (("left_shoulder_roll", -0.3), ("left_elbow", 0.2)):
        qpos[:, 7 + dancer.joint(name)] += angle * through
    assert self_collisions(dancer, qpos).depth.max() > 0.01
    found = told(dancer, qpos, still)[MetricKey.SELF_COLLISION]
    where = found.metric.where
    assert where.at_s == pytest.approx(2.0, abs=0.1) and all(a <= 2.0 <= b for a, b in where.stretches)
    assert all(part.startswith("left ") or part in ("pelvis", "torso") for part in where.parts)
    assert f"at {where.at_s:.2f} s" in found.what and "cm" in found.why
    (drop,) = [c for c in found.cures if c.help == "drop"]
    ((a, b),) = drop.stretches
    assert a < where.stretches[0][0] and b > where.stretches[-1][1] and b - a < 1.5


def test_the_deepest_point_under_the_floor_names_its_body_and_its_time(dancer, still):
    qpos = standing(dancer, FRAMES)
    qpos[60:70, 2] -= 0.03
    found = told(dancer, qpos, still)[MetricKey.PENETRATION]
    assert found.metric.where.stretches == ((1.2, 1.38),) and "foot 30 mm under the floor" in found.what


def test_a_slide_names_its_edge_and_whose_it_is(dancer, still):
    qpos = standing(dancer, FRAMES)
    qpos[:, 0] += 0.1 * np.clip((np.arange(FRAMES) - 50) / 50, 0.0, 1.0)
    found = told(dancer, qpos, still)[MetricKey.SLIDE_WORST]
    assert "slides 100 mm" in found.what and "own foot stands" in found.why
    assert found.cures[0].help == "state contacts"


def test_a_joint_beyond_its_motor_is_slowed_and_the_solver_that_keeps_limits_named_first(dancer, still):
    qpos = standing(dancer, FRAMES)
    joint = dancer.joint("left_elbow")
    qpos[100:, 7 + joint] += 1.5 * dancer.velocity[joint] / FPS
    found = told(dancer, qpos, still)[MetricKey.SPEED_SHARE]
    assert found.what.startswith("left_elbow") and found.metric.where.at_s == pytest.approx(1.98)
    assert [c.help for c in found.cures] == ["whole clip", "slower"]


@pytest.mark.parametrize(
    ("stretches", "length", "cure"),
    [
        ([(5.0, 5.1)], 20.0, ("drop", ((4.7, 5.4),))),
        ([(5.0, 5.1), (6.0, 6.1)], 20.0, ("drop", ((4.7, 6.4),))),  # nearer than what is worth keeping
        ([(5.0, 5.1), (12.0, 12.0)], 20.0, ("drop", ((4.7, 5.4), (11.7, 12.3)))),
        ([(0.0, 9.0)], 20.0, ("keep", ((9.3, 20.0),))),  # half of it is no drop any more
        ([(0.1, 19.0)], 20.0, None),  # what is left is not worth keeping
        ([(-3.0, -1.0), (25.0, 26.0)], 20.0, None),  # of other dances
        ([], 20.0, None),
    ],
)
def test_what_is_dropped_or_kept(stretches, length, cure):
    got = [
        (c.help, tuple((pytest.approx(a), pytest.approx(b)) for a, b in c.stretches))
        for c in _parting(stretches, length)
    ]
    assert got == ([] if cure is None else [cure])


def test_a_flight_of_the_second_dance_is_no_hovering_of_the_leads(groove_clip, dancer):
    first = cut(groove_clip, 0.0, 1.0)
    jump = cut(groove_clip, 0.0, 2.0)
    lifted = jump.positions.copy()
    t = np.arange(jump.frames) / jump.fps
    lifted[..., 2] += np.maximum(0.0, 2.0 * (t - 0.7) - 4.905 * (t - 0.7) ** 2)[:, None] * (t > 0.7)[:, None]
    jump = dataclasses.replace(jump, positions=lifted)
    result, _ = retarget_sequence([first, jump], dancer, RetargetConfig(dynamics=False))
    assert result.report[MetricKey.AIRBORNE_SOURCE].value > 5.0
    assert result.report[MetricKey.HOVERING_LEADS].value == 0.0


@pytest.fixture(scope="module")
def groove_clip():
    from conftest import SAMPLES

    return read_clip(SAMPLES / "groove.bvh")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "robot", "parts", "help"),
    [
        ("csv/g1moves/M_Move10.csv", "g1", {"left heel"}, "drop"),
        ("csv/g1moves/M_Move10.csv", "dancer", {"left heel"}, "drop"),
    ],
)
def test_a_recording_that_fails_is_diagnosed_and_its_cure_cures(shared, file, robot, parts, help):
    from damage import read_shared

    from clips import repair
    from robot_models import load_robot

    model, clip = load_robot(robot), repair(read_shared(shared, file))
    (found,) = retarget(clip, model).diagnoses
    assert set(found.metric.where.parts) == parts
    (cure,) = [c for c in found.cures if c.help == help]
    ((a, b),) = cure.stretches
    mended, _ = retarget_sequence([cut(clip, 0.0, a), cut(clip, b, None)], model)
    assert mended.report.passed


def test_the_mirror_image_fails_at_the_same_time_on_the_other_side(dancer, still):
    qpos = standing(dancer, FRAMES)
    qpos[60:70, 2] -= 0.03
    one, other = (told(dancer, qpos, clip)[MetricKey.PENETRATION] for clip in (still, mirror(still)))
    assert one.metric.where.stretches == other.metric.where.stretches
