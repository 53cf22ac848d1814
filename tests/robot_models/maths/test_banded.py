"""Banded systems as energies: the solution is where the energy has no slope, and what differences leave alone is free."""

import numpy as np
import pytest

from robot_models.maths.banded import HALF_BANDWIDTH, BandedSystem, difference_transposed, dilate
from robot_models.maths.intervals import away_from


def problem(rng, frames=10, nv=3):
    root = rng.normal(size=(frames, nv, nv))
    blocks = root @ root.swapaxes(1, 2) + np.eye(nv)
    terms = [(order, rng.uniform(0.5, 2.0, (frames - order, nv))) for order in range(min(frames, HALF_BANDWIDTH + 1))]
    return blocks, terms, rng.normal(size=(frames, nv))


def energy(x, blocks, terms, b):
    """Half of x A x - b x, from the definition: blocks per frame and squares of time differences."""
    own = 0.5 * np.einsum("ti,tij,tj->", x, blocks, x) - np.sum(b * x)
    return own + sum(0.5 * np.sum(weight * np.diff(x, order, axis=0) ** 2) for order, weight in terms)


def solution(blocks, terms, b):
    system = BandedSystem(blocks)
    for order, weight in terms:
        system.add_differences(order, weight)
    return system.solve(b)


def slopes(f, x):
    """Central differences; of a quadratic they are exact whatever the step, so a step of 1 costs no digits."""
    out = np.zeros(x.shape)
    for place in np.ndindex(x.shape):
        step = np.zeros(x.shape)
        step[place] = 1.0
        out[place] = 0.5 * (f(x + step) - f(x - step))
    return out


def test_at_the_solution_the_energy_has_no_slope_in_any_coordinate_of_any_frame(rng):
    blocks, terms, b = problem(rng)
    x = solution(blocks, terms, b)
    # Energies of some hundred, to sixteen digits.
    np.testing.assert_allclose(slopes(lambda y: energy(y, blocks, terms, b), x), 0.0, atol=1e-11)
    wrong = [(order, weight * (1.1 if order == 2 else 1.0)) for order, weight in terms]
    assert np.abs(slopes(lambda y: energy(y, blocks, wrong, b), x)).max() > 1e-3  # the control


@pytest.mark.parametrize("order", [1, 2, 3])
def test_spread_differences_are_the_slope_of_their_squares(order, rng):
    x, weight = rng.normal(size=(9, 2)), rng.uniform(0.5, 2.0, (9 - order, 2))
    given = difference_transposed(weight * np.diff(x, order, axis=0), order)
    of_squares = slopes(lambda y: 0.5 * np.sum(weight * np.diff(y, order, axis=0) ** 2), x)
    np.testing.assert_allclose(given, of_squares, atol=1e-12)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_spreading_back_twice_is_spreading_back_the_sum_of_the_orders(order, rng):
    y = rng.normal(size=(5, 2))
    np.testing.assert_allclose(
        difference_transposed(difference_transposed(y, order), 1), difference_transposed(y, order + 1), atol=1e-12
    )


@pytest.mark.parametrize("order", [1, 2, 3])
def test_what_is_spread_back_has_no_push_on_polynomials_of_lower_degree(order, rng):
    y, t = rng.normal(size=(8, 1)), np.arange(8.0 + order)[:, None]
    for degree in range(order + 1):
        push = np.sum(difference_transposed(y, order) * t**degree)
        if degree < order:
            assert push == pytest.approx(0.0, abs=1e-9)  # terms up to 10^2
        else:
            assert abs(push) > 0.1  # the control


def test_data_that_are_a_parabola_pass_a_penalty_on_third_differences_whatever_its_weight():
    t = np.arange(12.0)[:, None] / 12.0
    parabola = np.concatenate((1.0 - 2.0 * t + 3.0 * t**2, t), axis=1)
    blocks = np.broadcast_to(np.eye(2), (12, 2, 2))
    for weight, cubic_stays in ((1e-3, True), (1e5, False)):
        terms = [(3, np.full((9, 2), weight))]
        np.testing.assert_allclose(solution(blocks, terms, parabola), parabola, atol=1e-9)  # condition 1e6
        assert (np.abs(solution(blocks, terms, t**3 + 0.0 * parabola) - t**3).max() < 1e-4) == cubic_stays


def test_time_runs_both_ways(rng):
    blocks, terms, b = problem(rng)
    back = solution(blocks[::-1], [(order, weight[::-1]) for order, weight in terms], b[::-1])
    np.testing.assert_allclose(back[::-1], solution(blocks, terms, b), atol=1e-12)


@pytest.mark.parametrize(("held", "parted"), [(HALF_BANDWIDTH, True), (HALF_BANDWIDTH - 1, False)])
def test_as_many_held_frames_as_the_band_reaches_part_the_stretches_on_their_sides(held, parted, rng):
    blocks, terms, b = problem(rng, frames=14)
    blocks[6 : 6 + held] += 1e12 * np.eye(3)
    other = b.copy()
    other[6 + held :] += rng.normal(size=other[6 + held :].shape)
    before, after = (solution(blocks, terms, rhs)[:6] for rhs in (b, other))
    assert (np.abs(before - after).max() < 1e-9) == parted  # 1e-12 of the change seeps through a held frame


def test_differences_of_some_coordinates_leave_the_others_alone(rng):
    blocks, _, b = problem(rng)
    blocks = blocks * np.eye(3)  # no coupling within a frame
    system = BandedSystem(blocks)
    system.add_differences(2, np.full((8, 2), 50.0), first=1)
    alone = b / np.einsum("tii->ti", blocks)
    x = system.solve(b)
    np.testing.assert_allclose(x[:, 0], alone[:, 0], rtol=1e-12)
    assert np.abs(np.diff(x[:, 1:], 2, axis=0)).max() < 0.2 * np.abs(np.diff(alone[:, 1:], 2, axis=0)).max()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_clips_shorter_than_the_band_are_solved_frame_by_frame(frames, rng):
    blocks, _, b = problem(rng, frames=frames)
    np.testing.assert_allclose(solution(blocks, [], b), np.linalg.solve(blocks, b[..., None])[..., 0], rtol=1e-9)


@pytest.mark.parametrize("reach", [0, 1, 4])
def test_a_widened_mask_holds_every_frame_within_reach_and_grows_step_by_step(reach, rng):
    mask = rng.random(40) < 0.1
    assert mask.any() and not mask.all()
    np.testing.assert_array_equal(dilate(mask, reach), away_from(mask) <= reach)
    np.testing.assert_array_equal(dilate(dilate(mask, reach), 2), dilate(mask, reach + 2))
    assert not dilate(np.zeros(5, dtype=bool), reach).any()
