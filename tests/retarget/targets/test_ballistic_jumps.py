"""Jumps of targets: nothing pushes in the air, so the pelvis falls with g, however large the person and fine the frames."""

import dataclasses

import numpy as np
import pytest
from person import ANKLE, backwards, elsewhere, person, standing_feet

from retarget import RetargetConfig
from retarget.targets.ballistic_jumps import jumps, raise_jumps
from retarget.targets.contacts import find_contacts
from retarget.targets.targets import make_targets

G = 9.81
CONFIG = RetargetConfig()


def jumping(fps=50.0, *, air_s=0.4, height=0.2, ahead=0.5):
    """Stands for a second, flies forward, and stands."""
    frames = round((2.0 + air_s) * fps)
    t = np.clip((np.arange(frames) / fps - 1.0) / air_s, 0.0, 1.0)
    way = np.stack((ahead * t, 0.0 * t, 4.0 * height * t * (1.0 - t)), axis=1)
    ankles, toes = (points + way[:, None] for points in standing_feet(frames))
    return person(ankles, toes, fps, middle=way + [0.0, 0.0, ANKLE])


def laid_out(clip, robot):
    """(targets before, after) the throw, and the frames of the jump."""
    before = make_targets(clip, find_contacts(clip, CONFIG.contact), robot, CONFIG)
    return before, raise_jumps(before, clip), jumps(before.feet.contact, clip)


@pytest.mark.parametrize("fps", [50.0, 120.0])
@pytest.mark.parametrize("height", [0.08, 0.2, 0.6])
def test_between_take_off_and_landing_the_second_difference_is_that_of_a_thrown_body(dancer, fps, height):
    before, after, ((a, b),) = laid_out(jumping(fps, height=height), dancer)
    fall = np.diff(after.pelvis_pos[a - 1 : b + 1, 2], 2) * fps**2
    np.testing.assert_allclose(fall, -G, atol=1e-8)  # rounding of metres times the rate squared
    source = np.diff(before.pelvis_pos[a - 1 : b + 1, 2], 2) * fps**2
    assert np.abs(source + G).max() > 1.0  # the control


def test_how_high_it_goes_follows_from_the_time_alone(dancer):
    rises = []
    for height in (0.1, 0.3):
        _, after, ((a, b),) = laid_out(jumping(height=height), dancer)
        arc = after.pelvis_pos[a - 1 : b + 1, 2]
        rises.append((arc - np.linspace(arc[0], arc[-1], len(arc))).max())
        # g T^2 / 8, less what the middle of an odd number of frames misses.
        assert rises[-1] == pytest.approx(G * ((b - a + 1) / 50.0) ** 2 / 8.0, rel=0.01)
    assert rises[0] == pytest.approx(rises[1], rel=0.15)  # a higher one is off the floor a frame longer


def test_feet_go_up_with_the_pelvis_and_nothing_else_changes(dancer):
    before, after, ((a, b),) = laid_out(jumping(), dancer)
    raised = after.pelvis_pos - before.pelvis_pos
    assert not raised[:, :2].any() and not np.delete(raised, np.arange(a, b), axis=0).any() and raised[a:b, 2].any()
    lifted = after.feet.pos - before.feet.pos
    assert not lifted[..., :2].any()
    np.testing.assert_allclose(lifted[a:b, :, 2], np.repeat(raised[a:b, 2:], 2, axis=1), atol=1e-12)
    np.testing.assert_array_equal(after.feet.contact, before.feet.contact)
    for name in ("pelvis_quat", "torso_quat"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))


def test_no_foot_is_pressed_under_the_floor_it_left(dancer):
    """A person who floats far higher than the time allows is brought down, but not through the floor."""
    clip = jumping(air_s=0.3, height=0.5)
    before, after, ((a, b),) = laid_out(clip, dancer)
    assert (after.pelvis_pos[a:b, 2] < before.pelvis_pos[a:b, 2] - 0.1).any()
    ground = before.feet.pos[a - 1, :, 2]
    assert (after.feet.pos[a:b, :, 2] >= ground - 1e-9).all()


def test_what_is_thrown_stays_thrown(dancer):
    clip = jumping()
    _, once, _ = laid_out(clip, dancer)
    np.testing.assert_allclose(raise_jumps(once, clip).pelvis_pos, once.pelvis_pos, atol=1e-12)


def test_jumps_run_backwards_with_time_and_turn_with_the_world(dancer):
    clip = jumping(55.0)  # at 50 the crouch's window is even and looks half a frame ahead
    _, there, ((a, b),) = laid_out(clip, dancer)
    _, back, ((c, d),) = laid_out(backwards(clip), dancer)
    assert (c, d) == (clip.frames - b, clip.frames - a)
    np.testing.assert_allclose(back.pelvis_pos[::-1, 2], there.pelvis_pos[:, 2], atol=1e-9)
    _, turned, _ = laid_out(elsewhere(clip, 2.0, (1.0, 2.0, 0.0)), dancer)
    np.testing.assert_allclose(turned.pelvis_pos[:, 2], there.pelvis_pos[:, 2], atol=1e-9)


@pytest.mark.parametrize(("air_s", "found"), [(0.6, True), (0.8, False)])
def test_who_is_up_for_longer_than_a_person_can_hovers_and_is_left_alone(dancer, air_s, found):
    before, after, ways = laid_out(jumping(air_s=air_s, height=0.3), dancer)
    assert bool(ways) == found
    assert (after.pelvis_pos != before.pelvis_pos).any() == found


def test_a_slide_over_the_floor_is_no_jump_and_neither_is_a_flight_without_both_its_ends(dancer):
    low = jumping(height=0.02, ahead=0.8)
    contact = find_contacts(low, CONFIG.contact).labels
    assert (contact == 0).all(axis=1).any() and not jumps(contact, low)
    clip = jumping()
    contact = find_contacts(clip, CONFIG.contact).labels
    ((a, b),) = jumps(contact, clip)
    for part in (slice(0, b - 2), slice(a + 2, None)):
        cut = dataclasses.replace(clip, positions=clip.positions[part])
        assert not jumps(contact[part], cut)


def test_who_sits_and_rocks_with_both_feet_up_does_not_jump(dancer):
    clip = jumping()
    low = clip.positions.copy()
    for name in ("left_hip", "right_hip"):
        low[:, clip.names.index(name), 2] = 0.1
    sitting = dataclasses.replace(clip, positions=low)
    assert len(laid_out(clip, dancer)[2]) == 1
    before, after, found = laid_out(sitting, dancer)
    assert not found and not after.airborne.any()
    np.testing.assert_array_equal(after.pelvis_pos, before.pelvis_pos)
