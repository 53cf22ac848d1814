"""What people already use trains on our environments: stable-baselines3, a CleanRL-style loop, RLlib."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")
gymnasium = pytest.importorskip("gymnasium")

import tracking.envs  # noqa: F401  (registers the ids)

IDS = ["DanceTracking-v0", "DanceEnv-v0"]
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # of the other libraries
    pytest.mark.filterwarnings("ignore:.*A Box observation space"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),  # tqdm's rich bar, when it goes
    pytest.mark.filterwarnings("ignore:rich is experimental"),
]


@pytest.mark.parametrize("name", IDS)
def test_vector_environments(groove_file, name):
    envs = gymnasium.make_vec(name, num_envs=3, reference=str(groove_file))
    first, _ = envs.reset(seed=[1, 1, 2])
    assert (first[0] == first[1]).all() and (first[0] != first[2]).any()
    seen, reward, *_ = envs.step(np.zeros(envs.action_space.shape, dtype=np.float32))
    assert seen.shape == first.shape and np.isfinite(reward).all()
    envs.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_stable_baselines3_with_everything_a_tutorial_uses(groove_file, tmp_path, name):
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.callbacks import EvalCallback
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    def make():
        return Monitor(gymnasium.make(name, reference=str(groove_file)))

    check_env(make(), warn=False)
    watch = EvalCallback(
        DummyVecEnv([make]), best_model_save_path=str(tmp_path), eval_freq=512, n_eval_episodes=2, verbose=0
    )
    model = sb3.PPO(
        "MlpPolicy", DummyVecEnv([make] * 2), n_steps=256, batch_size=128, n_epochs=2, seed=0, device="cpu",
        tensorboard_log=str(tmp_path / "board"),
    )  # fmt: skip
    model.learn(2048, callback=watch, progress_bar=True)
    assert (tmp_path / "best_model.zip").exists() and list((tmp_path / "board").rglob("events*"))
    env = make()
    seen, _ = env.reset(seed=3)
    action, _ = sb3.PPO.load(tmp_path / "best_model.zip").predict(seen, deterministic=True)
    assert env.action_space.contains(action)


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_a_plain_loop_in_the_way_of_cleanrl(groove_file, name):
    envs = gymnasium.vector.SyncVectorEnv(
        [
            lambda: gymnasium.wrappers.RecordEpisodeStatistics(gymnasium.make(name, reference=str(groove_file)))
            for _ in range(4)
        ]
    )
    torch.manual_seed(0)
    actor = torch.nn.Sequential(
        torch.nn.Linear(envs.single_observation_space.shape[0], 32), torch.nn.Tanh(),
        torch.nn.Linear(32, envs.single_action_space.shape[0]),
    )  # fmt: skip
    optimiser, episodes = torch.optim.Adam(actor.parameters(), lr=1e-3), 0
    seen, _ = envs.reset(seed=0)
    for _ in range(3):
        logs, rewards = [], []
        for _ in range(64):
            normal = torch.distributions.Normal(actor(torch.as_tensor(seen)), 0.3)
            action = normal.sample()
            seen, reward, terminated, truncated, infos = envs.step(action.clamp(-1, 1).numpy())
            episodes += int((terminated | truncated).sum())
            assert "episode" in infos or not (terminated | truncated).any()
            logs.append(normal.log_prob(action).sum(-1))
            rewards.append(torch.as_tensor(reward, dtype=torch.float32))
        loss = -(torch.stack(logs) * (torch.stack(rewards) - torch.stack(rewards).mean())).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    assert episodes > 0 and all(torch.isfinite(p).all() for p in actor.parameters())
    envs.close()


@pytest.mark.slow
def test_rllib(groove_file):
    pytest.importorskip("ray.rllib")
    import ray
    from ray.rllib.algorithms.ppo import PPOConfig

    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False, configure_logging=False)
    try:
        algorithm = (
            PPOConfig()
            .environment("tracking.envs:DanceTracking-v0", env_config={"reference": str(groove_file)})
            .env_runners(num_env_runners=0)
            .training(train_batch_size=256, minibatch_size=128, num_epochs=1)
            .build_algo()
        )
        result = algorithm.train()
        assert result["num_env_steps_sampled_lifetime"] >= 256
        algorithm.stop()
    finally:
        ray.shutdown()
