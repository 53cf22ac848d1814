"""Two generators, one behaviour: what the task asks of chance holds for NumPy's and for torch's."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from robot_models.maths.arrays import to_numpy
from tracking.engines.random import TorchRng

KINDS = {"numpy": np.random.default_rng, "torch": lambda seed: TorchRng(seed, torch.device("cpu"))}


@pytest.fixture(params=KINDS)
def make(request):
    return KINDS[request.param]


def to_device(rng, values):
    return torch.as_tensor(values) if isinstance(rng, TorchRng) else np.asarray(values)


def some(rng):
    """A bit of everything."""
    drawn = rng.random(5), rng.uniform(-1.0, 2.0, size=(2, 3)), rng.integers(0, 1000, size=7)
    return np.concatenate([to_numpy(x).ravel() for x in drawn])


def test_the_seed_decides(make):
    np.testing.assert_array_equal(some(make(3)), some(make(3)))
    assert (some(make(3)) != some(make(4))).any()
    rng = make(3)
    assert (some(rng) != some(rng)).any()


def test_a_kept_state_goes_on_with_the_same_numbers_even_through_a_file(make):
    rng = make(0)
    some(rng)
    kept = json.dumps(rng.bit_generator.state)
    first = some(rng)
    other = make(99)
    other.bit_generator.state = json.loads(kept)
    np.testing.assert_array_equal(some(other), first)


@pytest.mark.parametrize("size", [0, 6, (6,), (2, 3), (0, 3)])
def test_shapes_are_those_asked_for(make, size):
    shape = (size,) if isinstance(size, int) else size
    for drawn in (make(0).random(size), make(0).uniform(0.0, 1.0, size=size), make(0).integers(0, 5, size=size)):
        assert tuple(drawn.shape) == shape


def test_numbers_fill_their_range_and_do_not_leave_it(make):
    rng = make(0)
    for drawn, low, high in ((rng.random(4000), 0.0, 1.0), (rng.uniform(-3.0, 5.0, size=4000), -3.0, 5.0)):
        drawn = to_numpy(drawn)
        assert low <= drawn.min() < low + 0.01 * (high - low) and high - 0.01 * (high - low) < drawn.max() < high
        assert abs(drawn.mean() - 0.5 * (low + high)) < 0.025 * (high - low)  # over five standard errors
    whole = to_numpy(rng.integers(2, 6, size=400))
    assert set(whole.tolist()) == {2, 3, 4, 5} and whole.dtype == np.int64


def test_bounds_may_differ_from_number_to_number(make):
    rng = make(0)
    width = to_device(rng, np.array([0.0, 1.0, 10.0]))
    drawn = to_numpy(rng.uniform(-width, width, size=(500, 3)))
    assert not drawn[:, 0].any()
    assert (np.abs(drawn).max(axis=0) <= [0.0, 1.0, 10.0]).all() and (
        np.abs(drawn).max(axis=0) >= [0.0, 0.95, 9.5]
    ).all()
