"""Conditions of a sweep: each changes one thing, none trains, and cells come out in the order asked for."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("torch")

import tracking.evaluation.condition_sweep as module
from tracking.config import ObservationNoise, RandomisationConfig, StartNoise, TaskConfig
from tracking.engines.mujoco import training_model
from tracking.evaluation.condition_sweep import CONDITIONS, NOMINAL, Cell, sweep, under
from tracking.task.randomisation import draw_robots

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

TASK = TaskConfig(
    observation_noise=ObservationNoise(gyro=0.7), start_noise=StartNoise(scale=0.7), look_back=(1,), action_scale=0.3
)
ONE = {
    "delay": {"delay"}, "gains": {"gains"}, "friction": {"friction"}, "mass": {"mass"}, "torque": {"torque_speed"},
    "motors": {"torque_speed", "knee", "no_load"}, "pushes": {"pushes", "push_linear", "push_angular"}, "encoder": {"encoder_bias"},
    "IMU": {"imu_mounting"},
}  # fmt: skip


def differing(a, b):
    return {f.name for f in dataclasses.fields(a) if getattr(a, f.name) != getattr(b, f.name)}


@pytest.mark.parametrize("name", [n for n in CONDITIONS if n not in ("as trained, no pushes", "nominal")])
def test_a_condition_differs_from_the_nominal_one_in_what_it_is_named_after(name):
    draw, noise = CONDITIONS[name]
    if name.endswith("noise doubled"):
        assert draw == NOMINAL
        changed = differing(noise, ObservationNoise())
        assert changed == ({"orientation", "gyro"} if "IMU" in name else {"joint_position", "joint_velocity"})
        assert all(getattr(noise, k) == 2.0 * getattr(ObservationNoise(), k) for k in changed)
        return
    assert noise == ObservationNoise()
    changed = differing(draw, NOMINAL)
    assert changed and changed <= ONE[name.split()[0]]


def test_no_two_conditions_are_the_same():
    assert len({repr(c) for c in CONDITIONS.values()}) == len(CONDITIONS)


@pytest.mark.parametrize("name", CONDITIONS)
def test_only_robots_and_sensors_change_the_task_stays(name):
    task = under(name, TASK)
    assert differing(task, TASK) <= {"randomisation", "observation_noise"}
    assert task.randomisation.pushes == name.startswith("pushes")
    assert task.randomisation.enabled and task.observation_noise == CONDITIONS[name][1]


def test_ranges_of_one_value_are_that_value_in_every_robot(dancer):
    def model(name):
        return draw_robots(dancer, 2, 0.005, under(name, TASK).randomisation, np.random.default_rng(0))

    for ms in (10, 40):
        np.testing.assert_allclose(model(f"delay {ms} ms").delay, 1e-3 * ms)
    base = training_model(dancer, 0.005)
    for name, factor in (("mass 0.8", 0.8), ("mass 1.2", 1.2), ("nominal", 1.0)):
        for one in model(name).models:
            assert one.body_mass.sum() == pytest.approx(factor * base.body_mass.sum())
    assert not model("nominal").encoder_bias.any() and model("encoder bias 0.03 rad").encoder_bias.any()


def test_trained_with_is_what_training_draws_from_but_for_the_pushes():
    draw, noise = CONDITIONS["as trained, no pushes"]
    assert differing(draw, RandomisationConfig()) == {"pushes"} and noise == ObservationNoise()


def test_cells_stand_in_the_order_asked_for_and_every_one_is_told(monkeypatch):
    seen, told = [], []

    def judge(runner, robot, reference, config, *, rollouts, seed, threads, engine):
        seen.append((config, rollouts, seed, threads, engine))
        return SimpleNamespace(as_dict=lambda: {"finished": 0.5})

    bundle = SimpleNamespace(runner=None, robot=None, reference=None)
    monkeypatch.setattr(module, "load_bundle", lambda path, reference, robot: bundle)
    monkeypatch.setattr(module, "evaluate", judge)
    names, engines = ("mass 1.2", "nominal", "delay 10 ms"), ("mujoco", "physx-motor")
    cells = sweep(
        Path("x"),
        engines,
        conditions=names,
        rollouts=7,
        seed=3,
        progress=lambda stage, done, of: told.append((done, of)),
    )
    assert [(c.condition, c.engine) for c in cells] == [(c, e) for c in names for e in engines]
    assert told == [(k, 6) for k in range(1, 7)]
    assert {s[1:4] for s in seen} == {(7, 3, 1)}  # the same noise and robots everywhere
    assert {id(s[4]) for s in seen} == {id(module.ENGINES[e]) for e in engines}
    assert [s[0] for s in seen].count(under("mass 1.2", TaskConfig())) == 2
    assert cells[0].as_dict() == {"condition": "mass 1.2", "engine": "mujoco", "finished": 0.5}
    assert isinstance(cells[0], Cell)
