"""Accents are where a part of the body stops or turns round, and nowhere else."""

import numpy as np
import pytest
from person import person, standing_feet

from clips.music import find_accents, parts_of, robot_parts

FPS = 50.0


def gesture(stops_s, fps=FPS, seconds=6.0, size=0.3):
    """One part that goes there and back, in a third of a second each, and comes to a stop at given times: (T, 1, 3)."""
    time = np.arange(int(seconds * fps)) / fps
    x = np.zeros(len(time))
    for k, at in enumerate(stops_s):
        share = np.clip((time - at) / 0.33 + 1.0, 0.0, 1.0)
        x += (1.0 if k % 2 == 0 else -1.0) * size * (share**3 * (10 - 15 * share + 6 * share**2))
    return np.stack((x, 0 * x, 0 * x), axis=-1)[:, None]


@pytest.mark.parametrize("fps", [30.0, 50.0, 120.0])
def test_a_stop_is_an_accent_at_whatever_rate(fps):
    stops = np.array([1.0, 2.1, 3.0, 4.7])
    found = find_accents(gesture(stops, fps), fps)
    assert len(found.times_s) == len(stops)
    # Smooth ends: it counts as stopped while a tenth of the speed is left.
    assert np.abs(found.times_s - stops).max() < 0.08


def test_accents_shift_with_the_dance_and_stretch_with_it():
    stops = np.array([1.0, 2.0, 3.0, 4.4])
    plain, later = (find_accents(gesture(stops + d), FPS).times_s for d in (0.0, 0.5))
    assert np.allclose(later, plain + 0.5, atol=0.006)


def test_parts_that_stop_together_are_one_strong_accent_and_one_by_one_they_are_two():
    together = np.concatenate((gesture([2.0]), gesture([2.0])), axis=1)
    apart = np.concatenate((gesture([2.0]), gesture([3.0])), axis=1)
    assert len(find_accents(together, FPS).times_s) == 1 and len(find_accents(apart, FPS).times_s) == 2
    both = np.concatenate((gesture([2.0, 4.0]), gesture([2.0])), axis=1)
    strength = find_accents(both, FPS).strength
    assert strength[0] > 1.5 * strength[1]


def test_who_stands_or_glides_evenly_has_none():
    assert not len(find_accents(np.zeros((200, 3, 3)), FPS).times_s)
    even = np.cumsum(np.full((200, 1, 3), 0.02), axis=0)
    assert not len(find_accents(even, FPS).times_s)
    assert not len(find_accents(np.zeros((3, 1, 3)), FPS).times_s)


def test_a_person_and_a_robot_have_parts(dancer):
    clip = person(*standing_feet(40))
    assert parts_of(clip).shape == (40, 5, 3)  # no head
    parts = robot_parts(dancer, np.tile(dancer.default_qpos, (7, 1)))
    assert parts.shape[0] == 7 and parts.shape[1] >= 5
    assert np.allclose(parts[0, 0], dancer.default_qpos[:3])  # the pelvis
