"""A teacher: symmetric by construction, scheduled by steps, and the same after it was saved."""

import dataclasses

import numpy as np
import pytest
import torch

pytest.importorskip("torch")

from clips import load_reference
from tracking import TrackingError
from tracking.config import Ramp, TeacherConfig
from tracking.teaching.teacher import TeacherTrainer, teacher_actions, teaching_task
from tracking.teaching.teacher_file import load_teacher, restore_teacher, save_teacher

SMALL = dataclasses.replace(
    TeacherConfig(), envs=8, critic_hidden=(16,),
    ppo=dataclasses.replace(TeacherConfig().ppo, hidden=(32, 16), steps_per_env=6, minibatches=2),
)  # fmt: skip


@pytest.fixture
def trainer(dancer, groove_file):
    task = teaching_task(dancer, [load_reference(groove_file, dancer)], SMALL)
    yield TeacherTrainer(task, SMALL, 0)
    task.close()


def answers(trainer, seen):
    return teacher_actions(trainer.actor, seen)


def test_a_mirrored_state_is_answered_with_the_mirrored_action(trainer, rng):
    from tracking.task import symmetry_of

    symmetry, task = symmetry_of(trainer.task.robot), trainer.task
    seen = rng.normal(size=(5, task.teacher.size)).astype(np.float32)
    mirror = symmetry.of_rows(task.teacher.rows)
    one, other = answers(trainer, seen), answers(trainer, (mirror.sign * seen[:, mirror.order]).astype(np.float32))
    assert np.abs(one).max() > 1e-3
    np.testing.assert_allclose(other, symmetry.joints.sign * one[:, symmetry.joints.order], atol=1e-5)


def test_the_schedule_follows_the_steps_whatever_finishes(trainer):
    early, _, late = (
        trainer.iterate_at(steps) for steps in (0, 14_000_000, 14_000_000)
    )  # a rule holds from the next on
    assert early.steps == late.steps == 8 * 6
    assert (trainer.algorithm.gamma, trainer.algorithm.lam) == pytest.approx((0.99, 0.95))
    assert trainer.algorithm.entropy_coef == 0.0
    actor, critic = (group["lr"] for group in trainer.algorithm.optimizer.param_groups)
    assert actor == trainer.algorithm.learning_rate and critic == SMALL.critic_rate
    assert late.std <= 0.12 * SMALL.std_slack + 1e-6 < early.std
    assert trainer.task.pushes.strength == 1.0


def test_a_ramp_goes_in_equal_factors_and_stays_at_its_ends():
    ramp = Ramp(first=0.1, last=0.001, until=100.0, since=50.0)
    assert [ramp.at(s) for s in (0.0, 50.0, 75.0, 100.0, 1e9)] == pytest.approx([0.1, 0.1, 0.01, 0.001, 0.001])


def test_a_saved_teacher_goes_on_where_it_stopped(trainer, dancer, groove_file, tmp_path):
    trainer.iterate_at(0)
    save_teacher(tmp_path / "teacher.pt", trainer, 48)
    task = teaching_task(dancer, [load_reference(groove_file, dancer)], SMALL, seed=1)
    again = TeacherTrainer(task, SMALL, 7)
    teacher = load_teacher(tmp_path / "teacher.pt")
    restore_teacher(again, teacher)
    seen = np.ones((2, task.teacher.size), dtype=np.float32)
    assert teacher.steps == 48
    np.testing.assert_array_equal(answers(again, seen), answers(trainer, seen))
    assert again.algorithm.learning_rate == pytest.approx(trainer.algorithm.optimizer.param_groups[0]["lr"])
    save_teacher(tmp_path / "small.pt", trainer, 48, optimiser=False)
    assert (tmp_path / "small.pt").stat().st_size < 0.5 * (tmp_path / "teacher.pt").stat().st_size
    restore_teacher(again, load_teacher(tmp_path / "small.pt"))
    task.close()


def test_an_older_file_whose_networks_had_one_rate_goes_on_with_two(trainer, tmp_path):
    trainer.iterate_at(0)
    save_teacher(tmp_path / "teacher.pt", trainer, 48)
    told = torch.load(tmp_path / "teacher.pt", weights_only=True)
    actor, critic = told["algorithm"]["optimizer_state_dict"]["param_groups"]
    both = actor | {"params": actor["params"] + critic["params"]}
    told["algorithm"]["optimizer_state_dict"]["param_groups"] = [both]
    torch.save(told, tmp_path / "old.pt")
    moments = [s["exp_avg"].clone() for s in trainer.algorithm.optimizer.state.values()]
    restore_teacher(trainer, load_teacher(tmp_path / "old.pt"))
    actor, critic = trainer.algorithm.optimizer.param_groups
    assert actor["lr"] == both["lr"] == trainer.algorithm.learning_rate and critic["lr"] == SMALL.critic_rate
    now = [trainer.algorithm.optimizer.state[p]["exp_avg"] for group in (actor, critic) for p in group["params"]]
    assert all(torch.equal(a, b) for a, b in zip(now, moments, strict=True))


def test_what_is_no_teacher_of_this_robot_is_refused(trainer, tmp_path):
    from robot_models import load_robot

    (tmp_path / "broken.pt").write_bytes(b"PK nothing")
    for name, said in (("none.pt", "no such file"), ("broken.pt", "no teacher")):
        with pytest.raises(TrackingError, match=said):
            load_teacher(tmp_path / name)
    save_teacher(tmp_path / "teacher.pt", trainer, 0)
    other = dataclasses.replace(load_teacher(tmp_path / "teacher.pt"), robot_hash=load_robot("g1").hash)
    with pytest.raises(TrackingError, match="one of dancer"):
        restore_teacher(trainer, other)
    faster = dataclasses.replace(load_teacher(tmp_path / "teacher.pt"), control_dt=0.01)
    with pytest.raises(TrackingError, match="retarget the clip at 100"):
        restore_teacher(trainer, faster)


def test_episodes_are_cut_and_go_on_in_the_critics_word(trainer):
    trainer.config = dataclasses.replace(trainer.config, episode_s=2 * trainer.task.dt)
    trainer.iterate(0.01)
    assert trainer.age.max() < 2.0


def test_a_teacher_learns_under_its_pupils_noise_and_is_asked_without(trainer):
    """What it sees in training differs from look to look, by each term's noise and where there is any; what it tells does not."""
    task = trainer.task
    looks = np.stack([trainer._observe()["policy"].numpy() for _ in range(40)])
    exact = task.observe_all()[0]
    np.testing.assert_array_equal(exact, task.observe_all()[0])
    widths = np.repeat([row.noise for row in task.teacher.rows], [row.size for row in task.teacher.rows])
    off = np.abs(looks - exact).max(axis=(0, 1))
    assert (off[widths == 0.0] < 1e-6).all() and (off[widths > 0.0] > 0.5 * widths[widths > 0.0]).all()
    assert (off <= widths + 1e-6).all()
    slices = task.teacher.slices
    assert widths[slices["joint_vel"]].all() and not widths[slices["root_lin_vel"]].any()
