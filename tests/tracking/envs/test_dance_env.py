"""The tutorial's environment: every fault that was put right stays right."""

import numpy as np
import pytest

pytest.importorskip("torch")
gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env

import tracking.envs  # noqa: F401  (registers the ids)
from robot_models.maths import rotation as rot
from robot_models.maths.rotation import roll_pitch
from tracking.envs.dance_env import DanceEnv

pytestmark = pytest.mark.filterwarnings("ignore:.*A Box observation space")


@pytest.fixture
def env(groove_file):
    made = DanceEnv(groove_file)
    yield made
    made.close()


def hold(env):
    """The action that asks for the next frame of the reference."""
    following = env.reference.joint_pos[env.frame + 1]
    return (following - env._middle) / env._half


def test_sizes_are_the_tutorials_and_gymnasium_is_content(groove_file, env):
    assert env.observation_space.shape == (35 + 34 + 28 + 1,) and env.action_space.shape == (28,)
    made = gymnasium.make("DanceEnv-v0", reference=groove_file)
    check_env(made.unwrapped, skip_render_check=True)
    made.close()


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.0, -2.0])
def test_an_upright_robot_has_neither_roll_nor_pitch_whatever_its_heading(heading):
    turn = rot.from_yaw(np.array(heading))
    np.testing.assert_allclose(roll_pitch(turn), 0.0, atol=1e-12)
    for axis, place in (([0.3, 0, 0], 0), ([0, 0.3, 0], 1)):
        tilted = roll_pitch(rot.multiply(turn, rot.exp(np.array(axis))))
        assert tilted[place] == pytest.approx(0.3) and tilted[1 - place] == pytest.approx(0.0, abs=1e-12)


def test_an_upright_robot_is_not_fallen_and_a_fallen_one_terminates(env):
    env.reset(seed=0)
    _, _, terminated, truncated, _ = env.step(hold(env))
    assert not terminated and not truncated
    for _ in range(300):
        *_, terminated, truncated, _ = env.step(np.ones(28))
        if terminated:
            break
    assert terminated and not truncated


def test_running_out_of_clip_truncates_and_does_not_terminate(env):
    env.reset(seed=0, options={"frame": env.reference.frames - 3})
    ends = [env.step(hold(env))[2:4], env.step(np.zeros(28))[2:4]]
    assert ends == [(False, False), (False, True)]


def test_resets_leave_the_reference_alone(env):
    before = env.reference.qpos.copy(), env._qpos.copy()
    for seed in range(5):
        env.reset(seed=seed)
        env.step(np.zeros(28))
    np.testing.assert_array_equal(env.reference.qpos, before[0])
    np.testing.assert_array_equal(env._qpos, before[1])


def test_the_seed_decides_everything(groove_file):
    def run(seed):
        env = DanceEnv(groove_file, randomise=True)
        seen = [env.reset(seed=seed)[0]]
        seen += [env.step(hold(env))[0] for _ in range(5)]
        masses = env._physics.models[0].body_mass.copy()
        env.close()
        return np.array(seen), masses

    (a, m), (b, n), (c, o) = run(1), run(1), run(2)
    assert (a == b).all() and (m == n).all() and (a != c).any() and (m != o).any()


def test_one_step_is_one_frame_of_the_reference_whatever_the_physics_step(env):
    env.reset(seed=0)
    first = env.frame
    env.step(hold(env))
    assert env.frame == first + 1
    assert env._physics.substeps * env._physics.models[0].opt.timestep == pytest.approx(1 / env.reference.fps)


def test_torque_is_limited_once_and_the_reference_stands_in_joint_order(env):
    model = env._draw().models[0]
    np.testing.assert_allclose(model.actuator_forcerange[:, 1], env.robot.effort)
    env.reset(seed=0)
    assert env.step(hold(env))[4]["reward_terms"]["imitation"] > 0.9  # in another order it would be far off
