"""The report's numbers: what moves them, what does not, and that the tool's own labels cannot flatter it."""

import dataclasses

import numpy as np
import pytest
from dynamics_by_hand import dynamics_by_hand
from person import elsewhere, person, standing_feet, stepping
from standing import reference_of, standing

from clips import MetricKey, RobotClip
from retarget import Gates, Metric, Report, measure
from retarget.report import contact_labels
from retarget.targets.robot_figure import as_figure
from robot_models.maths import rotation as rot

FPS, FRAMES = 50.0, 40


def moving(robot):
    """A stand in which an arm and a knee move smoothly."""
    qpos, t = standing(robot, FRAMES), np.arange(FRAMES) / FPS
    qpos[:, 7 + robot.joint("left_elbow")] -= 0.5 * np.sin(4.0 * t) ** 2
    qpos[:, 7 + robot.joint("right_shoulder_pitch")] += 0.4 * np.sin(3.0 * t)
    return qpos


def itself(robot, qpos):
    """The motion as its own source."""
    source = stepping().source
    return as_figure(
        RobotClip(
            fps=FPS, robot=robot.name, joint_names=robot.joint_names, root_pos=qpos[:, :3], root_quat=qpos[:, 3:7],
            joint_pos=qpos[:, 7:], source=source,
        )
    )  # fmt: skip


def numbers(robot, qpos, source=None, **reference):
    source = itself(robot, qpos) if source is None else source
    report = measure(reference_of(robot, qpos, **reference), robot, source, Gates())
    return {m.key: m.value for m in report.metrics}


def test_a_robot_that_is_its_own_source_has_no_error_in_any_limb(dancer):
    values = numbers(dancer, moving(dancer))
    assert values[MetricKey.LIMB_DIRECTION_ERROR] == pytest.approx(
        0.0, abs=1e-5
    )  # arccos near one: the root of rounding
    assert values[MetricKey.SLIDE_WORST] == pytest.approx(0.0, abs=1e-6)
    assert values[MetricKey.AIRBORNE_OFF_SOURCE] == 0.0 and values[MetricKey.CONTACT_SHARE] == 100.0


def test_no_number_depends_on_where_the_dance_takes_place(dancer):
    qpos, source = moving(dancer), itself(dancer, moving(dancer))
    turn, shift, moved = rot.from_yaw(np.array(2.5)), np.array([7.0, -3.0, 0.0]), moving(dancer)
    moved[:, :3], moved[:, 3:7] = rot.rotate(turn, qpos[:, :3]) + shift, rot.multiply(turn[None], qpos[:, 3:7])
    here, there = numbers(dancer, qpos, source), numbers(dancer, moved, elsewhere(source, 2.5, shift))
    # Angles by arccos and jerks, which are third differences times 30^3, lose the most digits.
    assert there == pytest.approx(here, abs=1e-5)


def test_labels_of_the_reference_change_nothing_for_the_feet(dancer):
    qpos, source = moving(dancer), itself(dancer, moving(dancer))
    qpos[:, 0] += 0.001 * np.arange(FRAMES)  # it slides, as the source does not
    honest, flattering = (numbers(dancer, qpos, source, label=label) for label in (1, 0))
    assert honest == flattering
    assert honest[MetricKey.SLIDE_WORST] == pytest.approx(39.0, abs=1e-6)  # mm, over 39 steps
    assert honest[MetricKey.CONTACT_SPEED] == pytest.approx(5.0, abs=1e-6)  # cm/s


def test_the_size_of_the_source_does_not_change_the_limbs(dancer):
    qpos = moving(dancer)
    source = itself(dancer, qpos)
    large = dataclasses.replace(source, positions=1.3 * source.positions)
    assert numbers(dancer, qpos, large)[MetricKey.LIMB_DIRECTION_ERROR] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("angle", [0.1, 0.7])
def test_a_limb_that_is_off_by_an_angle_counts_an_eighth_of_it(dancer, angle):
    qpos = standing(dancer, FRAMES)
    source, joint = itself(dancer, qpos), 7 + dancer.joint("left_elbow")
    bent = qpos.copy()
    bent[:, joint] -= angle  # the forearm is across the elbow's axis, so it turns by the whole angle
    error = numbers(dancer, bent, source)[MetricKey.LIMB_DIRECTION_ERROR]
    assert error == pytest.approx(np.degrees(angle) / 8.0, rel=0.02)


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_shares_of_the_motors_limits_are_those_of_a_steady_speed_and_a_steady_push(dancer, share):
    joint = dancer.joint("left_shoulder_pitch")
    t = np.arange(6) / FPS
    qpos = standing(dancer, 6)
    qpos[:, 7 + joint] += share * dancer.velocity[joint] * t
    source = person(*standing_feet(6))
    steady = numbers(dancer, qpos, source)
    assert steady[MetricKey.SPEED_SHARE] == pytest.approx(share)
    assert steady[MetricKey.ACCELERATION_SHARE] == pytest.approx(0.0, abs=1e-8)
    qpos[:, 7 + joint] = 0.5 * share * dancer.acceleration[joint] * t**2
    pushed = measure(reference_of(dancer, qpos), dancer, source, Gates())
    metric = pushed[MetricKey.ACCELERATION_SHARE]
    assert metric.value == pytest.approx(share) and metric.passed == (share < 1.0)
    assert metric.where.parts == ("left_shoulder_pitch",) and bool(metric.where.stretches) == (share > 1.0)


def test_a_report_passes_if_every_gate_does_and_numbers_without_one_cannot_fail():
    good, told = (
        Metric(key=MetricKey.PENETRATION, value=1.0, unit="", meaning="", limit=1.0),
        Metric(key=MetricKey.AIRBORNE, value=1e9, unit="", meaning=""),
    )
    bad = dataclasses.replace(good, key=MetricKey.SELF_COLLISION, value=1.0 + 1e-9)
    assert Report(metrics=(good, told), series={}).passed
    report = Report(metrics=(good, bad, told), series={})
    assert not report.passed and report.failures == (bad,)
    assert report.as_dict()["airborne_frames"] == {"value": 1e9, "unit": "", "limit": None, "passed": True}
    assert not dataclasses.replace(good, value=float("nan")).passed  # what could not be measured does not pass


def test_dynamics_add_two_numbers_and_change_no_other(dancer):
    qpos = moving(dancer)
    reference, source = reference_of(dancer, qpos), itself(dancer, moving(dancer))
    force = np.zeros((FRAMES, 3))
    force[:10, 2] = 1.0
    plain = measure(reference, dancer, source, Gates())
    told = measure(reference, dancer, source, Gates(), dynamics_by_hand(FRAMES, force=force))
    assert told.metrics[: len(plain.metrics)] == plain.metrics
    extra = {m.key: m.value for m in told.metrics[len(plain.metrics) :]}
    assert extra[MetricKey.IMPOSSIBLE_FRAMES] == pytest.approx(25.0) and len(extra) == 2


def test_the_fixed_rule_of_touching_turns_with_the_world_and_drops_what_is_short():
    clip = stepping()
    here, there = contact_labels(clip), contact_labels(elsewhere(clip, 1.0, (2.0, 0.0, 0.5)))
    np.testing.assert_array_equal(here, there)
    in_contact, pivoting = here
    assert (pivoting <= in_contact).all() and pivoting.any() and not in_contact.all()
    ankles, toes = standing_feet(FRAMES)
    for points in (ankles, toes):
        points[10:30, 0, 2] += 0.2
        points[20:23, 0, 2] -= 0.2  # down for three frames, of which one is slow
    assert not contact_labels(person(ankles, toes))[0][12:28, :2].any()


def test_whoever_skates_is_below_the_gate_and_whoever_walks_is_not(shared):
    from damage import read_shared, travelling

    from clips import repair
    from retarget.report.feet import _flying, _uncarried

    def unsupported(clip):
        uncarried = _uncarried(clip, _flying(clip))
        return 100.0 * uncarried.mean()

    walks = [
        "bvh/cmu_12_01_walk.bvh",
        "deepmimic/humanoid3d_walk.txt",
        "bvh/perfume_aachan.bvh",
        "npz/asap_smpl_apt_level1.npz",
    ]
    for file in walks:
        assert unsupported(repair(read_shared(shared, file))) < 30.0
    for file in walks[:2]:  # who never stands
        assert unsupported(travelling(repair(read_shared(shared, file)), (0.0, 0.0, 1.0))) > 90.0
    for file in ("bvh/rokoko_jesse_dance.bvh", "deepmimic/humanoid3d_dance_b.txt"):  # feet that float, and that slide
        assert unsupported(repair(read_shared(shared, file))) > 50.0
