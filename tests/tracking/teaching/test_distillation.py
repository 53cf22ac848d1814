"""A pupil learns what it is told, in the states that it comes to; a run of teaching goes on exactly where it stopped."""

import dataclasses
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from excerpt import excerpt

torch = pytest.importorskip("torch")
pytest.importorskip("onnxruntime")

from tracking import REHEARSAL, PpoConfig, TaskConfig, TrackingError, TrackingTask, TrainConfig, load_bundle, teach
from tracking.config import DistillationConfig, FocusConfig, TeacherConfig
from tracking.policy.bundle import SHIPPED
from tracking.task import read_named_reference, write_rehearsal_set
from tracking.teaching import TeacherTrainer, load_teacher, save_teacher, teaching_task
from tracking.teaching.adviser import TrackerAdviser
from tracking.teaching.distillation import Distillation
from tracking.teaching.lesson import make_pupil
from tracking.teaching.teach import _score
from tracking.training import LABELS, begin_with, torch_policy

SMALL = DistillationConfig(samples=6 * 8 * 10, steps_per_env=6, batch=32)


@pytest.fixture(autouse=True)
def one_thread():
    """Whatever a run before has set: small networks on threads that spin for one another take forty times as long."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def bundle():
    return load_bundle(SHIPPED / "groove-dancer")


@pytest.fixture
def task(bundle):
    task = TrackingTask(robot=bundle.robot, reference=bundle.reference, envs=8, config=TaskConfig(), threads=1)
    yield task
    task.close()


class Constant:
    """Says always the same."""

    def __init__(self, task, value):
        self.advice, self.heard, self.restarted = np.full((task.envs, task.actions), value), [], []

    def restart(self, ids):
        self.restarted.append(ids)

    def advise(self):
        return self.advice

    def hear(self, action):
        self.heard.append(action.copy())


def test_a_pupil_comes_to_do_what_it_is_told_and_the_teacher_drives_less_and_less(task, tmp_path):
    torch.manual_seed(0)
    config = dataclasses.replace(SMALL, samples=6 * 8 * 20, batch=64, passes=40.0, rate=(3e-3, 3e-3))
    adviser, pupil = Constant(task, 0.3), make_pupil(task, TrainConfig())
    lesson = Distillation(task, adviser, pupil, config, tmp_path / LABELS)
    assert lesson.driving == 1.0 and [len(ids) for ids in adviser.restarted] == [8]
    lesson.iterate()
    assert all((heard == 0.3).all() for heard in adviser.heard)  # the teacher drives everyone in the beginning
    first = lesson.loss
    while lesson.samples < config.samples:
        lesson.iterate()
    assert lesson.driving == pytest.approx(0.2) and lesson.loss < 0.2 * first
    assert not (np.stack(adviser.heard[-6:]) == 0.3).all()


def test_a_trackers_advice_asks_for_the_targets_that_it_would_ask_for(bundle, task):
    """The shipped policy as its own tracker: its advice is its own action."""
    adviser = TrackerAdviser([bundle.runner], task)
    ids = np.array([1, 4])
    task.reset(ids, np.array([100, 200]))
    adviser.restart(ids)
    np.testing.assert_array_equal(adviser._runner.frame, task.frame)
    advice = adviser.advise()
    inside = (adviser._runner.last_target > bundle.contract.target_lower) & (
        adviser._runner.last_target < bundle.contract.target_upper
    )
    np.testing.assert_allclose(advice[inside], adviser._runner.last_action[inside], atol=1e-9)
    adviser.hear(np.zeros_like(advice))
    np.testing.assert_allclose(adviser._runner.actions[0], 0.0, atol=1e-9)  # residuals of the same feed-forward


def short(bundle):
    """Two seconds of the sample dance."""
    piece = read_named_reference(bundle.folder / "reference.npz")
    return dataclasses.replace(piece, reference=excerpt(piece.reference, 60, 160))


@pytest.fixture(scope="module")
def teacher(tmp_path_factory, bundle):
    config = dataclasses.replace(
        TeacherConfig(), envs=4, critic_hidden=(8,),
        ppo=dataclasses.replace(TeacherConfig().ppo, hidden=(16, 8), steps_per_env=4, minibatches=2),
    )  # fmt: skip
    task = teaching_task(bundle.robot, [bundle.reference], config)
    path = tmp_path_factory.mktemp("teacher") / "teacher.pt"
    trainer = TeacherTrainer(task, config, 0)
    save_teacher(path, trainer, 0, optimiser=False)
    save_teacher(path.with_name("learning.pt"), trainer, 0)
    write_rehearsal_set(path.with_name(REHEARSAL), [short(bundle)], "by us")
    task.close()
    return path


CONFIG = TrainConfig(
    rollouts=2,
    fewest_rollouts=2,
    threads=1,
    envs=8,
    focus=FocusConfig(most_steps=64, evaluate_every=32, stands=2.0),
    distillation=dataclasses.replace(SMALL, samples=480, evaluate_every=240, evaluate_share=0.0),
)


def run(folder, teacher, bundle, **more):
    return teach(bundle.robot, [short(bundle)], folder, teacher, CONFIG, **more)


def test_a_run_that_was_told_to_stop_goes_on_exactly_from_its_last_judgement(tmp_path, teacher, bundle):
    whole = run(tmp_path / "whole", teacher, bundle)
    assert whole.stopped.startswith("budget") and (tmp_path / "whole" / LABELS).exists()  # it did not reach its target

    def stop_once(stage, done, total, note=""):
        if 300 < done < 400:
            os.kill(os.getpid(), signal.SIGTERM)

    stopped = run(tmp_path / "cut", teacher, bundle, progress=stop_once)
    assert "resumed" in stopped.stopped and len(stopped.curves) == 1
    resumed = run(tmp_path / "cut", teacher, bundle, resume=True)
    pick = [[(r["steps"], r["loss"], r["survived_s"]) for r in each.curves] for each in (whole, resumed)]
    assert pick[0] == pick[1] and len(pick[0]) == 2
    assert load_bundle(tmp_path / "cut").contract.joint_names == bundle.contract.joint_names


def test_a_run_goes_on_with_a_larger_budget(tmp_path, teacher, bundle):
    run(tmp_path / "run", teacher, bundle)
    more = dataclasses.replace(CONFIG, distillation=dataclasses.replace(CONFIG.distillation, samples=720))
    piece = short(bundle)
    again = teach(bundle.robot, [piece], tmp_path / "run", teacher, more, resume=True)
    assert [row["steps"] for row in again.curves] == [240, 480, 720]
    assert again.outcome["finished"] == max(row["finished"] for row in again.curves)


def test_the_pupil_that_was_judged_best_is_kept(task, tmp_path):
    lesson = Distillation(task, Constant(task, 0.3), make_pupil(task, TrainConfig()), SMALL, tmp_path / LABELS)
    seen = task.observe(noisy=False)[0]
    lesson.iterate()
    lesson.judged(0.9)
    best = torch_policy(lesson.actor)(seen)
    lesson.iterate()
    lesson.judged(0.5)
    assert np.abs(torch_policy(lesson.actor)(seen) - best).max() > 1e-4
    lesson.keep_best()
    np.testing.assert_array_equal(torch_policy(lesson.actor)(seen), best)


def test_of_several_dances_a_hopeless_one_does_not_say_which_pupil_is_kept(bundle):
    pieces = [dataclasses.replace(short(bundle), name=name) for name in ("first", "hopeless")]
    early = {"finished": 0.1, "finished first": 0.3, "finished hopeless": 0.1, "survived_s": 1.0}
    late = {"finished": 0.0, "finished first": 0.9, "finished hopeless": 0.0, "survived_s": 1.0}
    assert _score(late, pieces) > _score(early, pieces)
    assert _score(late, pieces[:1]) < _score(early, pieces[:1])  # of one dance it is its own number


def test_a_run_whose_pupil_was_shown_other_things_is_refused_when_resumed(tmp_path, teacher, bundle):
    run(tmp_path / "run", teacher, bundle)
    piece = short(bundle)
    more = dataclasses.replace(CONFIG, task=dataclasses.replace(CONFIG.task, look_back=(1,)))
    with pytest.raises(TrackingError, match="shown other things"):
        teach(bundle.robot, [piece], tmp_path / "run", teacher, more, resume=True)


def test_a_pupil_that_begins_with_a_policy_is_judged_before_it_learns(tmp_path, teacher, bundle):
    told = dataclasses.replace(CONFIG, task=TaskConfig(root_ahead=True, look_back=(1,)), ppo=PpoConfig(hidden=(16, 8)))
    piece = short(bundle)
    assert teach(bundle.robot, [piece], tmp_path / "first", teacher, told).curves[0]["steps"] > 0
    second = teach(bundle.robot, [piece], tmp_path / "second", teacher, told, begin=tmp_path / "first")
    assert second.curves[0]["steps"] == 0.0
    other = dataclasses.replace(told, ppo=PpoConfig(hidden=(8, 8)))
    with pytest.raises(TrackingError, match=r"mlp.0.weight of \(16,"):
        teach(bundle.robot, [piece], tmp_path / "third", teacher, other, begin=tmp_path / "first")


def test_who_begins_with_a_policy_drives_at_once_and_keeps_its_normaliser(task, tmp_path):
    pupil = make_pupil(task, TrainConfig())
    begin_with(pupil, SHIPPED / "groove-dancer", task)
    lesson = Distillation(task, Constant(task, 0.3), pupil, SMALL, tmp_path / LABELS)
    lesson.begun = True
    mean = pupil.obs_normalizer.mean
    assert lesson.driving == pytest.approx(SMALL.driving[1])
    lesson.iterate()
    assert torch.equal(pupil.obs_normalizer.mean, mean)
    low, high = SMALL.rate
    rates, fresh = [], SMALL.steps_per_env * task.envs
    while lesson.samples < SMALL.samples:
        lesson.iterate()
        rates.append(lesson._optimiser.param_groups[0]["lr"])
    assert lesson.rests == (
        2 * fresh,
        3 * fresh,
        5 * fresh,
        10 * fresh,
    )  # an eighth, a quarter, a half, all: in whole rounds
    judged = [rates[rest // fresh - 2] for rest in lesson.rests]  # the first round was above
    assert judged == pytest.approx([low] * 4) and max(rates) > 0.5 * high


def test_what_cannot_be_resumed_is_refused(tmp_path, teacher, bundle):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "checkpoint.pt").write_bytes(b"nothing")
    with pytest.raises(TrackingError, match="no run of teaching"):
        run(tmp_path / "run", teacher, bundle, resume=True)
    with pytest.raises(TrackingError, match="already there"):
        run(tmp_path / "run", teacher, bundle)
    with pytest.raises(TrackingError, match="no such file|no teacher"):
        run(tmp_path / "other", Path("nobody.pt"), bundle)


def test_a_teacher_with_its_critic_focuses_first_on_what_it_rehearses_with(tmp_path, teacher, bundle):
    learning = tmp_path / "learning.pt"
    learning.write_bytes(teacher.with_name("learning.pt").read_bytes())
    write_rehearsal_set(tmp_path / REHEARSAL, [short(bundle)], "by us")
    told = []
    run(tmp_path / "run", learning, bundle, progress=lambda *what: told.append(what))
    stages = [stage for stage, *_ in told if stage != "rollouts"]  # those are of judgements
    assert stages == sorted(stages, key=("focus, at most", "teach").index)
    focused = load_teacher(tmp_path / "run" / "teacher.pt")
    assert focused.steps == 32 and focused.can_learn  # as it was last judged


def test_a_focus_that_is_told_to_stop_keeps_its_teacher_and_goes_on_when_resumed(tmp_path, teacher, bundle):
    def stop_in_the_focus(stage, done, total, note=""):
        if "focus" in stage and done > 32:
            os.kill(os.getpid(), signal.SIGTERM)

    learning = teacher.with_name("learning.pt")
    stopped = run(tmp_path / "run", learning, bundle, progress=stop_in_the_focus)
    assert "SIGTERM" in stopped.stopped and not stopped.curves and not (tmp_path / "run" / "policy.onnx").exists()
    assert load_teacher(tmp_path / "run" / "teacher.pt").steps == 32
    with pytest.raises(TrackingError, match="already there"):
        run(tmp_path / "run", learning, bundle)
    whole = run(tmp_path / "run", learning, bundle, resume=True)
    assert whole.curves and load_teacher(tmp_path / "run" / "teacher.pt").steps > 32
    assert load_bundle(tmp_path / "run").contract.reference_sha256
