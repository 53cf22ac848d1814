"""When feet touch: noise does not break a touch, short gaps and short touches are none, a foot that turns pivots."""

import dataclasses

import numpy as np
import pytest
from person import ANKLE, backwards, elsewhere, person, standing_feet, stepping, toes_ahead

from clips import FREE, PIVOTING, PLANTED
from retarget import ContactConfig
from retarget.targets.contacts import find_contacts, foot_yaw_rate, heel_toe_points
from robot_models.maths import rotation as rot
from robot_models.maths.intervals import intervals_of

CONFIG = ContactConfig()
STRICT = dataclasses.replace(CONFIG, loose_speed=CONFIG.tight_speed, loose_height=CONFIG.tight_height)  # no hysteresis
FPS, FRAMES = 50.0, 100


def speeds(clip):
    """Of all edges, as central differences see them [m/s]."""
    return np.linalg.norm(rot.linear_velocity(heel_toe_points(clip), 1.0 / clip.fps), axis=-1)


def shaken(amount, rng):
    """A stand whose feet creep to and fro at `amount` [m/s], for two to six frames at a time."""
    velocity = np.zeros(FRAMES)
    for k, start in enumerate(range(10, FRAMES - 12, 8)):
        velocity[start : start + 2 + k % 5] = amount * rng.choice([-1.0, 1.0])
    ankles, toes = standing_feet(FRAMES)
    for points in (ankles, toes):
        points[:, :, 0] += (np.cumsum(velocity) / FPS)[:, None]
    return person(ankles, toes, FPS)


def lifted(frames, fps):
    """A stand from which the left foot is up for some frames, within one frame each way; for none it steps 4 cm aside."""
    ankles, toes = standing_feet(2 * FRAMES)
    for points in (ankles, toes):
        points[50 : 50 + frames, 0, 2] += 0.15
        points[50:, 0, 1] += 0.04 * (frames == 0)
    return person(ankles, toes, fps)


def longest_gap(in_contact):
    """Of an edge between two touches [frames]."""
    return max((b - a for a, b in intervals_of(~in_contact) if a > 0 and b < len(in_contact)), default=0)


def test_noise_beyond_the_tight_speed_and_within_the_loose_one_breaks_no_touch_and_would_without_hysteresis(rng):
    middle = 0.5 * (CONFIG.tight_speed + CONFIG.loose_speed)
    clip = shaken(middle, rng)
    fast = speeds(clip) > CONFIG.tight_speed
    # It really crosses the one, and not the other.
    assert fast.sum(axis=0).min() > 8 and speeds(clip).max() < CONFIG.loose_speed
    assert find_contacts(clip, CONFIG).in_contact.all()
    strict = find_contacts(clip, STRICT).in_contact
    assert (
        len(intervals_of(~strict[:, 0])) > 2 and longest_gap(strict[:, 0]) >= 3
    )  # shorter gaps are closed there as well


def test_noise_over_the_tight_height_and_under_the_loose_one_breaks_no_touch_and_would_without_hysteresis():
    between = 0.5 * (CONFIG.tight_height + CONFIG.loose_height)
    ankles, toes = standing_feet(FRAMES)
    t = np.arange(FRAMES)
    for points in (ankles, toes):  # slow, so that speed has no say
        points[..., 2] += (between * np.sin(np.pi * np.clip((t - 30) / 40, 0.0, 1.0)) ** 2)[:, None]
    clip = person(ankles, toes)
    assert speeds(clip).max() < CONFIG.tight_speed
    assert ((ankles[..., 2] - ANKLE) > CONFIG.tight_height).sum() > 10
    assert find_contacts(clip, CONFIG).in_contact.all()
    assert not find_contacts(clip, STRICT).in_contact[45:55].any()


def test_noise_beyond_the_loose_speed_breaks_a_touch_with_hysteresis_too(rng):
    clip = shaken(1.2 * CONFIG.loose_speed, rng)
    assert len(intervals_of(~find_contacts(clip, CONFIG).in_contact[:, 0])) > 2


def test_a_touch_that_is_never_tight_is_none_however_long_it_is_loose():
    ankles, toes = standing_feet(FRAMES)
    drift = 0.5 * (CONFIG.tight_speed + CONFIG.loose_speed) * np.arange(FRAMES) / FPS
    for points in (ankles, toes):
        points[..., 0] += drift[:, None]
    assert not find_contacts(person(ankles, toes), CONFIG).in_contact.any()


@pytest.mark.parametrize(
    ("fps", "up", "gap"),
    # Central differences see a lift one frame before and one after, and a step of one frame in two.
    [(50.0, 0, 2), (50.0, 1, 3), (100.0, 3, 5), (100.0, 4, 6)],
)
def test_a_gap_shorter_than_the_shortest_duration_is_closed_and_one_as_long_is_kept(fps, up, gap):
    clip, shortest = lifted(up, fps), round(CONFIG.min_duration_s * fps)
    raw = find_contacts(clip, dataclasses.replace(CONFIG, min_duration_s=0.0)).in_contact
    assert longest_gap(raw[:, 0]) == longest_gap(raw[:, 1]) == gap
    in_contact = find_contacts(clip, CONFIG).in_contact
    assert longest_gap(in_contact[:, 0]) == (gap if gap >= shortest else 0)
    assert in_contact[:, 2:].all()  # the other foot stood


@pytest.mark.parametrize(("held", "found"), [(2, False), (3, True)])
def test_a_touch_shorter_than_the_shortest_duration_is_dropped(held, found):
    """A swinging foot that comes down for a moment: at rest for `held` frames, as speeds see it."""
    assert round(CONFIG.min_duration_s * FPS) == 3
    ankles, toes = standing_feet(FRAMES)
    down = np.zeros(FRAMES, dtype=bool)
    down[60 : 60 + held + 2] = True  # its first and last frame are still fast
    down[:20] = True  # a stand, so that the floor is known
    for points in (ankles, toes):
        points[~down, 0, 2] += 0.15
    in_contact = find_contacts(person(ankles, toes), CONFIG).in_contact
    assert in_contact[:18, :2].all() and in_contact[:, 2:].all()
    assert in_contact[55:70, 0].any() == found and in_contact[55:70, 1].any() == found
    assert not found or in_contact[55:70, 0].sum() == held


@pytest.mark.parametrize(("share", "label"), [(0.8, PLANTED), (1.25, PIVOTING)])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_touching_foot_pivots_if_it_turns_faster_than_the_pivot_rate(share, label, side, sign):
    """On its heel; the toe draws a circle, slow enough to touch: 0.2 m at 1.9 rad/s are 0.37 m/s."""
    ankles, _ = standing_feet(FRAMES)
    t = np.clip((np.arange(FRAMES) - 40) / FPS, 0.0, 0.5)
    yaw = np.zeros((FRAMES, 2))
    yaw[:, side] = sign * share * CONFIG.pivot_rate * t
    contacts = find_contacts(person(ankles, ankles + toes_ahead(yaw)), CONFIG)
    assert contacts.in_contact.all()
    heel, toe = contacts.labels[45:60, 2 * side : 2 * side + 2].T
    assert (heel == label).all() and (toe == label).all()  # a foot turns as one
    other = contacts.labels[:, 2 * (1 - side) : 2 * (1 - side) + 2]
    assert (
        (other == PLANTED).all() and (contacts.labels[:38] == PLANTED).all() and (contacts.labels[68:] == PLANTED).all()
    )


def test_a_foot_that_turns_in_the_air_does_not_pivot():
    ankles, _ = standing_feet(FRAMES)
    ankles[40:70, 0, 2] += 0.2
    yaw = np.zeros((FRAMES, 2))
    yaw[:, 0] = 3.0 * np.clip((np.arange(FRAMES) - 42) / FPS, 0.0, 0.5)
    contacts = find_contacts(person(ankles, ankles + toes_ahead(yaw)), CONFIG)
    assert np.abs(foot_yaw_rate(person(ankles, ankles + toes_ahead(yaw)))[50, 0]) > CONFIG.pivot_rate
    assert not contacts.pivoting.any() and (contacts.labels[45:65, :2] == FREE).all()


def test_a_turn_through_south_is_no_jump_of_the_yaw_rate():
    """Headings run from -pi to pi; a foot that turns on at 2 rad/s does so across the seam as well."""
    ankles, _ = standing_feet(FRAMES)
    yaw = np.pi - 1.0 + 2.0 * np.arange(FRAMES)[:, None] / FPS * np.array([1.0, -1.0])
    # Central differences of a line are exact.
    rates = foot_yaw_rate(person(ankles, ankles + toes_ahead(yaw)))
    np.testing.assert_allclose(rates, np.tile([2.0, -2.0], (FRAMES, 1)), atol=1e-9)


def test_a_foot_that_points_up_or_down_has_no_yaw_rate():
    ankles, toes = standing_feet(FRAMES)
    toes[:, 0] = ankles[:, 0] + [0.001, 0.0, -0.2]
    toes[::2, 0, 1] += 0.01  # its heading is noise
    rates = foot_yaw_rate(person(ankles, toes))
    assert not rates[:, 0].any()


def test_the_dance_used_below_has_labels_of_all_kinds():
    labels = find_contacts(stepping(), CONFIG).labels
    assert {FREE, PLANTED, PIVOTING} == set(np.unique(labels)) and (labels == FREE).sum() > 20


@pytest.mark.parametrize(
    ("turn", "shift"), [(2.4, (3.0, -1.0, 0.0)), (-1.0, (0.0, 0.0, 0.7)), (0.0, (-50.0, 0.0, -2.0))]
)
def test_labels_do_not_depend_on_heading_place_or_the_height_of_the_floor(turn, shift):
    clip = stepping()
    moved = find_contacts(elsewhere(clip, turn, shift), CONFIG).labels
    np.testing.assert_array_equal(moved, find_contacts(clip, CONFIG).labels)


def test_labels_run_backwards_with_time():
    clip = stepping()
    np.testing.assert_array_equal(
        find_contacts(backwards(clip), CONFIG).labels[::-1], find_contacts(clip, CONFIG).labels
    )


@pytest.mark.parametrize("fps", [100.0, 150.0, 200.0])
def test_labels_change_at_the_same_times_at_another_frame_rate(fps):
    """Speeds are central differences over two frames: a change may be seen one frame of the coarse clip off."""
    coarse = find_contacts(stepping(), CONFIG).labels
    fine = find_contacts(stepping(fps), CONFIG).labels[:: round(fps / FPS)]
    stays = np.ones((len(coarse), 4), dtype=bool)
    changes = np.diff(coarse, axis=0) != 0
    stays[1:] &= ~changes
    stays[:-1] &= ~changes
    assert stays.mean() > 0.8
    np.testing.assert_array_equal(fine[stays], coarse[stays])


@pytest.mark.parametrize("side", [0, 1])
def test_an_edge_is_judged_by_its_own_floor(side):
    """A foot in a high shoe stands as well as the other."""
    clip = stepping()
    positions = clip.positions.copy()
    raised = [k for k, n in enumerate(clip.names) if n == ("left_ankle", "right_toe")[side]]
    positions[:, raised, 2] += 0.3
    other = find_contacts(dataclasses.replace(clip, positions=positions), CONFIG)
    np.testing.assert_array_equal(other.in_contact, find_contacts(clip, CONFIG).in_contact)


def test_without_toes_the_ankle_stands_for_both_edges_and_no_foot_pivots():
    clip = stepping()
    bare = dataclasses.replace(clip, landmarks={k: n for k, n in clip.landmarks.items() if "toe" not in k})
    contacts, whole = find_contacts(bare, CONFIG), find_contacts(clip, CONFIG)
    np.testing.assert_array_equal(contacts.in_contact[:, ::2], whole.in_contact[:, ::2])
    np.testing.assert_array_equal(contacts.in_contact[:, 1::2], whole.in_contact[:, ::2])
    assert not contacts.pivoting.any() and whole.pivoting.any()


def test_a_heel_that_rises_leaves_its_toe_touching():
    ankles, toes = standing_feet(FRAMES)
    ankles[30:70, 0, 2] += 0.1 * np.sin(np.pi * np.arange(40) / 40) ** 2
    in_contact = find_contacts(person(ankles, toes), CONFIG).in_contact
    assert in_contact[:, 1].all() and not in_contact[45:55, 0].any()


def test_feet_of_one_whose_shins_are_level_lie_on_the_floor_and_do_not_stand():
    ankles, toes = standing_feet(60)
    upright = person(ankles, toes)
    kneeling = upright.positions.copy()
    for side, y in (("left", 0.1), ("right", -0.1)):
        kneeling[30:, upright.names.index(f"{side}_knee")] = (0.4, y, ANKLE)
    clip = dataclasses.replace(upright, positions=kneeling)
    assert find_contacts(upright, CONFIG).in_contact.all()
    assert find_contacts(clip, CONFIG).in_contact[:30].all() and not find_contacts(clip, CONFIG).in_contact[30:].any()
