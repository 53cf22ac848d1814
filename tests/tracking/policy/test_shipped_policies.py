"""The policies that come with the package fit the robots as they are now, and dance."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from clips import save_reference
from robot_models import load_robot
from tracking import TaskConfig, TrackingError, evaluate, evaluation_task, load_bundle


@pytest.mark.parametrize("name", ["groove-dancer", pytest.param("groove-g1", marks=pytest.mark.slow)])
def test_a_shipped_policy_finishes_its_dance(name):
    bundle = load_bundle(Path(name))
    task = evaluation_task(TaskConfig())
    result = evaluate(bundle.runner, bundle.robot, bundle.reference, task, rollouts=10, seed=3)
    assert result.finished >= 0.7 and result.body_error_mm < 60.0

    def nothing(seen):
        return np.zeros((len(seen), len(bundle.robot.joint_names)))

    still = evaluate(nothing, bundle.robot, bundle.reference, task, rollouts=10, seed=3)
    assert still.finished <= 0.1  # the policy does it, not the prior


def test_what_is_no_bundle_is_refused_with_the_names_of_those_there_are(tmp_path):
    with pytest.raises(TrackingError, match="groove-dancer, groove-g1"):
        load_bundle(tmp_path / "nothing")


def test_the_shipped_tracker_is_whole_and_dances_what_it_was_not_made_for():
    from tracking.policy import SHIPPED
    from tracking.task import read_rehearsal_set
    from tracking.teaching import find_teacher, load_teacher

    teacher = find_teacher("auto", "g1", 0.02)
    assert teacher == find_teacher("tracker-g1", "g1", 0.02) == SHIPPED / "tracker-g1" / "teacher.pt"
    assert find_teacher("none", "g1", 0.02) is None and find_teacher("auto", "jvrc1", 0.02) is None
    assert find_teacher("auto", "g1", 1 / 30) is None  # another rate: nobody teaches
    assert load_teacher(teacher).can_learn
    bundle = load_bundle(Path("tracker-g1"), reference=SHIPPED / "groove-g1" / "reference.npz")
    rehearsed = read_rehearsal_set(teacher.with_name("rehearsal.npz"), bundle.robot)
    assert len(rehearsed) > 30 and sum(p.reference.duration_s for p in rehearsed) > 900.0
    result = evaluate(
        bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()), rollouts=4, seed=3, threads=1
    )
    assert result.stood_s > 7.0  # of ten, untaught; zero action: one second
    with pytest.raises(TrackingError, match="follows any reference"):
        load_bundle(Path("tracker-g1"))


def test_the_dancers_tracker_teaches_without_being_asked_and_dances_untaught():
    from tracking.policy import SHIPPED
    from tracking.task import rehearsal_names
    from tracking.teaching import find_teacher, load_teacher

    folder = SHIPPED / "tracker-dancer"
    assert (
        find_teacher("auto", "dancer", 0.02) == folder / "teacher.pt" and load_teacher(folder / "teacher.pt").can_learn
    )
    assert len(rehearsal_names(folder / "rehearsal.npz")) > 30
    bundle = load_bundle(folder, reference=SHIPPED / "groove-dancer" / "reference.npz")
    task = evaluation_task(TaskConfig())
    result = evaluate(bundle.runner, bundle.robot, bundle.reference, task, rollouts=4, seed=3, threads=1)
    assert result.stood_s > 7.0


def test_the_shipped_repertoire_dances_what_it_names(tmp_path):
    from tracking.policy import SHIPPED
    from tracking.task import read_rehearsal_set, rehearsal_names

    folder, file = SHIPPED / "repertoire-g1", tmp_path / "step_touch.npz"
    assert len(rehearsal_names(folder / "rehearsal.npz")) >= 10
    (piece,) = read_rehearsal_set(folder / "rehearsal.npz", load_robot("g1"), ["step_touch"])
    save_reference(piece.reference, file)
    bundle, task = load_bundle(folder, reference=file), evaluation_task(TaskConfig())
    result = evaluate(bundle.runner, bundle.robot, bundle.reference, task, rollouts=8, seed=3, threads=1)
    assert result.finished >= 0.75 and result.body_error_mm < 60.0

    def nothing(seen):
        return np.zeros((len(seen), len(bundle.robot.joint_names)))

    assert evaluate(nothing, bundle.robot, bundle.reference, task, rollouts=8, seed=3, threads=1).finished == 0.0


def test_a_teacher_that_is_not_there_is_refused_with_what_there_is():
    from tracking.teaching import find_teacher

    with pytest.raises(TrackingError, match="tracker-g1"):
        find_teacher("nobody.pt", "g1", 0.02)
