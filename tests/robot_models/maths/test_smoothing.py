"""The smoother as a linear map: the least of its energy, symmetric, the same forwards and backwards, column by column."""

import numpy as np
import pytest

from robot_models.maths.smoothing import smooth

FPS, HZ = 50.0, 4.0


def matrix(frames, fps=FPS, hz=HZ):
    return smooth(np.eye(frames), fps, hz)


def test_the_curve_is_the_least_of_closeness_and_third_differences_by_its_normal_equations(rng):
    x, frames = rng.normal(size=40), 40
    third = np.diff(np.eye(frames), 3, axis=0)
    strength = (2.0 * np.sin(np.pi * HZ / FPS)) ** -6
    y = smooth(x, FPS, HZ)
    # The slope of |y - x|^2 / 2 + strength |third differences|^2 / 2: rounding of about 1 times the strength, 250.
    np.testing.assert_allclose((y - x) + strength * third.T @ (third @ y), 0.0, atol=1e-11)


def test_it_is_linear_symmetric_and_keeps_sums_and_first_moments(rng):
    m, (a, b) = matrix(30), rng.normal(size=(2, 30, 3))
    np.testing.assert_allclose(smooth(2.0 * a - b, FPS, HZ), 2.0 * (m @ a) - m @ b, atol=1e-11)
    np.testing.assert_allclose(m, m.T, atol=1e-11)
    t = np.arange(30.0)
    for moment in (t**0, t, t**2):  # it passes quadratics, so, being symmetric, it keeps sums against them
        np.testing.assert_allclose(moment @ (m @ a), moment @ a, atol=1e-7)


def test_no_wave_is_raised_or_turned_round():
    values = np.linalg.eigvalsh(matrix(40))
    assert values.min() > 0.0 and values.max() < 1.0 + 1e-9
    assert (values > 1.0 - 1e-9).sum() == 3  # constants, lines and parabolas alone are kept whole


def test_time_runs_both_ways_and_every_column_goes_alone(rng):
    x = rng.normal(size=(25, 2, 3))
    y = smooth(x, FPS, HZ)
    np.testing.assert_allclose(smooth(x[::-1], FPS, HZ)[::-1], y, atol=1e-11)
    np.testing.assert_allclose(y[:, 1, 2], smooth(x[:, 1, 2], FPS, HZ), atol=1e-12)


@pytest.mark.parametrize("fps", [30.0, 60.0, 240.0])
def test_half_of_a_wave_of_the_named_frequency_is_left_at_any_frame_rate(fps):
    t = np.arange(round(6.0 * fps)) / fps
    wave = np.sin(2.0 * np.pi * HZ * t)
    inner = slice(len(t) // 4, -len(t) // 4)
    gain = smooth(wave, fps, HZ)[inner] @ wave[inner] / (wave[inner] @ wave[inner])
    assert gain == pytest.approx(0.5, abs=1e-3)  # what is left of the ends in the middle


@pytest.mark.parametrize(("frames", "hz"), [(3, HZ), (30, 0.0), (30, 0.5 * FPS), (30, FPS)])
def test_what_cannot_be_smoothed_comes_back_as_a_copy(frames, hz, rng):
    x = rng.normal(size=(frames, 2))
    y = smooth(x, FPS, hz)
    np.testing.assert_array_equal(y, x)
    assert y is not x
