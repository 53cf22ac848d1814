"""The page of numbers: ranges that are ranges, and settings that cannot be."""

import dataclasses
import json
import math

import pytest

from tracking import TrackingError
from tracking.config import PpoConfig, RandomisationConfig, RewardConfig, TaskConfig, TerminationConfig, TrainConfig

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

NUMBERS = [f.name for f in dataclasses.fields(TrainConfig) if f.type in ("int", "float")]
MAY_BE_ZERO = {"seed", "threads", "target"}


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [-1, -0.5, math.nan, -math.inf])
def test_a_setting_below_nothing_or_no_number_is_refused_by_name(name, value):
    with pytest.raises(TrackingError, match=f"setting {name}"):
        TrainConfig(**{name: value})


@pytest.mark.parametrize("name", NUMBERS)
def test_nothing_is_a_number_only_of_seeds_threads_and_targets(name):
    if name in MAY_BE_ZERO:
        assert getattr(TrainConfig(**{name: 0}), name) == 0
    else:
        with pytest.raises(TrackingError, match=f"setting {name}"):
            TrainConfig(**{name: 0})


def test_no_limit_of_time_is_a_limit_that_never_comes():
    assert TrainConfig().minutes == math.inf and TrainConfig(minutes=math.inf) == TrainConfig()


def ranges(config):
    return {
        f.name: v for f in dataclasses.fields(config) if isinstance(v := getattr(config, f.name), tuple) and len(v) == 2
    }


@pytest.mark.parametrize("config", [RandomisationConfig(), PpoConfig()], ids=["randomisation", "ppo"])
def test_every_range_goes_upwards(config):
    for name, (low, high) in ranges(config).items():
        assert name == "hidden" or 0.0 <= low <= high, name


def test_motors_lose_their_torque_after_they_begin_to():
    c = RandomisationConfig()
    assert c.knee[1] < c.no_load[0]


def test_rewards_reward_and_penalties_punish():
    c, widths = RewardConfig(), 0
    for f in dataclasses.fields(c):
        value = getattr(c, f.name)
        if f.name.endswith("_width"):
            widths += 1
            assert value > 0.0 and getattr(c, f.name.removesuffix("_width")) > 0.0
        elif f.name != "soft_limit":
            assert (value < 0.0) == (f.name in ("action_rate", "joint_limit")), f.name
    assert widths == 6 and 0.0 < c.soft_limit <= 1.0
    assert all(v > 0.0 for v in vars(TerminationConfig()).values())


def test_updates_become_smaller_as_a_run_settles():
    c = PpoConfig()
    assert c.first_kl > c.settled_kl > c.finishing_kl > 0.0


def test_settings_are_kept_in_a_checkpoint_as_plain_values_and_two_runs_share_none():
    text = json.dumps(dataclasses.asdict(TrainConfig()), sort_keys=True)
    assert json.dumps(json.loads(text), sort_keys=True) == text
    with pytest.raises(dataclasses.FrozenInstanceError):
        TaskConfig().action_scale = 1.0
    assert TrainConfig() == TrainConfig() and TrainConfig(seed=1) != TrainConfig()
