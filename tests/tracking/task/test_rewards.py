"""Rewards: the most for no error, less for more, each from its own error alone."""

import dataclasses

import numpy as np
import pytest

from robot_models.maths import rotation as rot
from tracking.config import RewardConfig
from tracking.task.rewards import action_rate, beyond_soft_limits, closeness, mean_square, reward_terms
from tracking.task.tracking_errors import TrackingErrors

C, N, K, J = RewardConfig(), 6, 5, 4
OWN = {
    "anchor_position": "anchor_pos", "anchor_orientation": "anchor_angle", "body_position": "body_pos",
    "body_orientation": "body_angle", "body_linear_velocity": "body_lin_vel", "body_angular_velocity": "body_ang_vel",
}  # fmt: skip


def errors_of(rng, scale=0.3):
    shapes = {"anchor_pos": (N, 3), "anchor_angle": (N,), "anchor_tilt": (N,), "body_angle": (N, K)}
    names = [f.name for f in dataclasses.fields(TrackingErrors)]
    return TrackingErrors(**{n: scale * rng.normal(size=shapes.get(n, (N, K, 3))) for n in names})


def terms(errors, action=None, last=None, over=None, config=C):
    still = np.zeros((N, J))
    return reward_terms(
        errors, still if action is None else action, still if last is None else last,
        np.zeros(N) if over is None else over, config,
    )  # fmt: skip


def test_no_term_is_worth_more_than_its_weight_and_none_that_rewards_is_worth_less_than_nothing(rng):
    told = terms(errors_of(rng), rng.normal(size=(N, J)), rng.normal(size=(N, J)), rng.uniform(size=N))
    for name, value in told.items():
        weight = getattr(C, name)
        low, high = (0.0, weight) if weight > 0.0 else (-np.inf, 0.0)
        assert ((low < value) & (value < high)).all(), name


@pytest.mark.parametrize("name", OWN)
def test_a_term_hears_of_its_own_error_alone_and_falls_as_it_grows(rng, name):
    errors = errors_of(rng)
    before = terms(errors)
    for factor in (1.2, 3.0):
        worse = terms(dataclasses.replace(errors, **{OWN[name]: factor * getattr(errors, OWN[name])}))
        assert (worse[name] < before[name]).all()
        for other in set(before) - {name}:
            np.testing.assert_array_equal(worse[other], before[other])


def test_it_does_not_matter_which_body_is_off_nor_which_way(rng):
    errors, order = errors_of(rng), rng.permutation(K)
    turn = rot.exp(rng.normal(size=3))
    names = [f.name for f in dataclasses.fields(errors)]
    mixed = {n: getattr(errors, n)[:, order] for n in names if n.startswith("body")}
    turned = {
        n: rot.rotate(np.broadcast_to(turn, (*getattr(errors, n).shape[:-1], 4)), getattr(errors, n))
        for n in names if getattr(errors, n).shape[-1] == 3
    }  # fmt: skip
    before = terms(errors)
    for change in (mixed, turned):
        for name, value in terms(dataclasses.replace(errors, **change)).items():
            np.testing.assert_allclose(value, before[name], rtol=1e-12, err_msg=name)


def test_robots_are_rewarded_one_by_one(rng):
    errors, action, over = errors_of(rng), rng.normal(size=(N, J)), rng.uniform(size=N)
    order = rng.permutation(N)
    swapped = dataclasses.replace(errors, **{k: v[order] for k, v in vars(errors).items()})
    before = terms(errors, action, over=over)
    for name, value in terms(swapped, action[order], over=over[order]).items():
        np.testing.assert_array_equal(value, before[name][order])


@pytest.mark.parametrize("width", [0.1, 0.4, 3.14])
def test_closeness_asks_how_many_widths_and_nothing_else(rng, width):
    squared = rng.uniform(0.0, 4.0, size=20)
    np.testing.assert_allclose(closeness(squared * width**2, width), closeness(squared, 1.0), rtol=1e-12)
    assert (closeness(squared, 2.0 * width) > closeness(squared, width)).all()  # a wider one forgives more
    assert closeness(np.zeros(1), width)[0] == 1.0


def test_the_change_of_an_action_counts_both_ways_alike_and_its_size_not_at_all(rng):
    a, b, shift = rng.normal(size=(3, N, J))
    np.testing.assert_allclose(action_rate(a, b), action_rate(b, a))
    np.testing.assert_allclose(action_rate(a + shift, b + shift), action_rate(a, b))
    np.testing.assert_allclose(action_rate(3.0 * a, 3.0 * b), 9.0 * action_rate(a, b))
    assert not action_rate(a, a).any()


def test_soft_limits_cost_nothing_inside_and_a_radian_per_radian_beyond(rng):
    lower, upper = -rng.uniform(0.5, 2.0, size=J), rng.uniform(0.5, 2.0, size=J)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    inside = middle + 0.9 * half * rng.uniform(-1.0, 1.0, size=(50, J))
    assert beyond_soft_limits(inside, lower, upper, 0.9).max() < 1e-12
    for side in (-1.0, 1.0):  # both ends alike
        for beyond in (0.0, 0.1, 0.7):
            pose = (middle + side * (0.9 * half + beyond))[None]
            assert beyond_soft_limits(pose, lower, upper, 0.9)[0] == pytest.approx(J * beyond, abs=1e-12)
    outside = middle + 2.0 * half * rng.uniform(-1.0, 1.0, size=(50, J))
    costs = [beyond_soft_limits(outside, lower, upper, share) for share in (0.5, 0.9, 1.0)]
    assert (costs[0] >= costs[1]).all() and (costs[1] >= costs[2]).all()
    hard = np.maximum(lower - outside, outside - upper).clip(0.0).sum(axis=1)  # with the whole range: the limits
    np.testing.assert_allclose(costs[2], hard, atol=1e-12)


def test_mean_square_is_that_of_the_lengths(rng):
    vectors = rng.normal(size=(N, K, 3))
    np.testing.assert_allclose(mean_square(vectors), (np.linalg.norm(vectors, axis=-1) ** 2).mean(axis=-1))


def test_tensors_are_rewarded_as_arrays_are(rng):
    torch = pytest.importorskip("torch")
    errors, action = errors_of(rng), rng.normal(size=(N, J))
    tensors = TrackingErrors(**{k: torch.from_numpy(v) for k, v in vars(errors).items()})
    here = terms(errors, action)
    there = terms(tensors, torch.from_numpy(action), torch.zeros((N, J)), torch.zeros(N))
    for name, value in there.items():
        np.testing.assert_allclose(value.numpy(), here[name], rtol=1e-12, err_msg=name)
