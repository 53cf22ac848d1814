"""Stances too wide for the ankles are drawn in as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from clips import FREE, PLANTED
from retarget.targets.feet import FootTargets
from retarget.targets.stance_width import narrow_stances
from robot_models.maths import rotation as rot

FPS, FRAMES, HIPS = 50.0, 60, 0.6  # [frames/s], frames, height of the hips over the ankles [m]


def stood(beside, heading=0.0):
    """Two flat feet `beside` their hips [m], turned with them; and the hips."""
    turn = rot.from_yaw(np.full(1, heading))
    feet, hips = (
        np.stack([rot.rotate(turn, np.array([[0.0, s * y, z]]))[0] for s in (1.0, -1.0)])
        for y, z in ((0.1 + beside, 0.0), (0.1, HIPS))
    )
    targets = FootTargets(
        pos=np.tile(feet, (FRAMES, 1, 1)),
        quat=np.tile(turn, (FRAMES, 2, 1)),
        contact=np.full((FRAMES, 4), PLANTED),
        shift=np.zeros((FRAMES, 2, 2)),
    )
    return targets, np.tile(hips, (FRAMES, 1, 1))


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_stance_too_wide_is_drawn_in_until_the_soles_can_lie_flat(dancer, heading):
    feet, hips = stood(0.5, heading)
    out = narrow_stances(feet, hips, dancer, FPS)
    roll = dancer.upper[dancer.joint("left_ankle_roll")]
    beside = np.linalg.norm((hips - out.pos)[..., :2], axis=2)
    np.testing.assert_allclose(np.arctan2(beside, HIPS), roll - 0.02, atol=1e-9)
    assert np.ptp(out.pos, axis=0).max() < 1e-12  # nothing slides
    np.testing.assert_allclose(out.shift, (out.pos - feet.pos)[..., :2], atol=1e-12)


def test_a_stance_that_the_ankles_allow_stays(dancer):
    feet, hips = stood(0.2)
    np.testing.assert_array_equal(narrow_stances(feet, hips, dancer, FPS).pos, feet.pos)


def test_a_sway_that_passes_draws_nothing_in(dancer):
    feet, hips = stood(0.2)
    hips[:20, :, 1] -= 0.3
    np.testing.assert_array_equal(narrow_stances(feet, hips, dancer, FPS).pos, feet.pos)


def test_a_foot_in_the_air_may_be_anywhere(dancer):
    feet, hips = stood(0.5)
    feet.contact[:] = FREE
    np.testing.assert_array_equal(narrow_stances(feet, hips, dancer, FPS).pos, feet.pos)
