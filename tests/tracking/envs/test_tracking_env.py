"""The Gymnasium environment is the task for one robot, and says what happens in it."""

import numpy as np
import pytest

pytest.importorskip("torch")
gymnasium = pytest.importorskip("gymnasium")

from pathlib import Path

import tracking
from clips import load_reference
from tracking import TrackingError, TrackingTask
from tracking.config import RandomisationConfig, StartNoise, TaskConfig
from tracking.envs.tracking_env import DanceTrackingEnv

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
CALM = TaskConfig(randomisation=RandomisationConfig(enabled=False), start_noise=StartNoise(scale=0.0))


@pytest.fixture
def env():
    made = DanceTrackingEnv(FILE, config=CALM)
    yield made
    made.close()


def test_it_is_the_task_with_one_robot(env, dancer, rng):
    """By two roads: the environment, and the task that it stands for, with the same numbers drawn."""
    task = TrackingTask(robot=dancer, reference=load_reference(FILE, dancer), envs=1, config=CALM, threads=1)
    task.rng = np.random.default_rng(7)
    task.reset(np.array([0]), np.array([120]))
    seen, info = env.reset(seed=7, options={"frame": 120})
    assert info == {"frame": 120}
    np.testing.assert_array_equal(seen, task.observe()[0][0])
    for _ in range(4):
        action = 0.2 * rng.normal(size=28).astype(np.float32)
        seen, reward, terminated, truncated, info = env.step(action)
        result = task.step(action[None].astype(float))
        np.testing.assert_array_equal(seen, task.observe()[0][0])
        assert (reward, terminated, truncated) == (result.reward[0], result.terminated[0], result.truncated[0])
        assert info["frame"] == task.frame[0]
    task.close()


def test_the_reward_is_the_sum_of_its_terms_over_a_control_period(env):
    env.reset(seed=0)
    _, reward, *_, info = env.step(np.zeros(28))
    assert reward == pytest.approx(env.task.dt * sum(info["reward_terms"].values()))
    assert info["causes"] == [] and type(reward) is float


def test_a_robot_that_is_thrown_down_terminates_with_its_causes(env):
    env.reset(seed=0, options={"frame": 100})
    env.task.physics.qpos[0, 2] += 1.0
    _, _, terminated, truncated, info = env.step(np.zeros(28))
    assert terminated is True and truncated is False and "anchor_height" in info["causes"]


def test_the_clips_end_truncates(env):
    env.reset(seed=0, options={"frame": env.task.tables.frames - 3})
    ends = [env.step(np.zeros(28))[2:4] for _ in range(2)]
    assert ends == [(False, False), (False, True)]


@pytest.mark.parametrize("random_start", [True, False])
def test_without_a_random_start_every_dance_begins_at_its_first_frame(random_start):
    env = DanceTrackingEnv(FILE, config=CALM, random_start=random_start)
    frames = {env.reset(seed=0 if k == 0 else None)[1]["frame"] for k in range(8)}
    opening = load_reference(FILE).dance.start
    assert (len(frames) > 3) if random_start else (frames == {opening})
    env.close()


def test_one_seed_is_one_path_and_later_resets_go_on_from_it(env):
    def frames(*seeds):
        return [env.reset(seed=s)[1]["frame"] for s in seeds]

    assert frames(5, None, None) == frames(5, None, None) != frames(6, None, None)


def test_copies_without_a_seed_begin_differently():
    copies = [DanceTrackingEnv(FILE, config=CALM) for _ in range(2)]
    frames = [[env.reset()[1]["frame"] for _ in range(6)] for env in copies]
    assert frames[0] != frames[1]
    for env in copies:
        env.close()


def test_its_spaces_and_its_rate_are_the_tasks(env):
    assert env.observation_space.shape == (env.task.actor.size,) and env.action_space.shape == (28,)
    assert env.metadata["render_fps"] == 50 and DanceTrackingEnv.metadata["render_modes"] == ["human", "rgb_array"]
    assert env.reset(seed=0)[0] in env.observation_space and env.render() is None


def test_a_way_to_draw_that_nobody_knows_is_refused():
    with pytest.raises(TrackingError, match="render_mode"):
        DanceTrackingEnv(FILE, render_mode="ansi")
