"""Where the soles touch, and the distance of a point from what they stand on: by another road, and its laws."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import nnls
from standing import reference_of, standing

from clips import FREE, PIVOTING, PLANTED
from retarget.dynamics.floor_points import continuous_ranges, floor_points
from retarget.dynamics.support import outside_support
from robot_models import sole_corners
from robot_models.maths import rotation as rot

POINTS = 8


def distances(points, feet, in_contact):
    """The same, a frame at a time: convex shares of the touching points whose sum is nearest, by Lawson and Hanson."""
    out = []
    for p, f, on in zip(points, feet, in_contact, strict=True):
        if not on.any():
            out.append(0.0)
            continue
        # Shares must sum to one: a heavy row says so, a millionth off.
        rows = np.concatenate((f[on].T, 1e4 * np.ones((1, on.sum()))))
        shares, _ = nnls(rows, np.append(p, 1e4))
        out.append(np.linalg.norm(f[on].T @ (shares / shares.sum()) - p))
    return np.array(out)


@pytest.fixture
def scene(rng):
    """Points about feet of which some points touch; in a frame none, in others one or two."""
    frames = 60
    in_contact = rng.random((frames, POINTS)) < 0.5
    in_contact[0], in_contact[1], in_contact[2] = False, np.arange(POINTS) == 3, np.arange(POINTS) < 2
    return 0.2 * rng.normal(size=(frames, 2)), 0.3 * rng.normal(size=(frames, POINTS, 2)), in_contact


def test_the_distance_is_that_of_the_nearest_convex_combination(scene):
    ours, theirs = outside_support(*scene), distances(*scene)
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    assert 10 < (ours > 0.0).sum() < 50


def test_turned_shifted_and_scaled_it_is_the_same_distance_scaled(scene, rng):
    point, feet, in_contact = scene
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = outside_support(3.0 * point @ turn.T + [5.0, -2.0], 3.0 * feet @ turn.T + [5.0, -2.0], in_contact)
    np.testing.assert_allclose(moved, 3.0 * outside_support(point, feet, in_contact), atol=1e-9)
    order = rng.permutation(POINTS)
    np.testing.assert_allclose(
        outside_support(point, feet[:, order], in_contact[:, order]),
        outside_support(point, feet, in_contact),
        atol=1e-12,
    )


def test_convex_combinations_are_inside_and_one_more_touching_point_is_never_farther(scene, rng):
    point, feet, in_contact = scene
    shares = rng.dirichlet(np.ones(POINTS), len(point)) * in_contact
    some = in_contact.any(axis=1)
    inside = np.einsum("tp,tpi->ti", shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-9), feet)
    assert outside_support(inside, feet, in_contact)[some].max() < 1e-9
    more = in_contact | (np.arange(POINTS) == 5)
    assert (outside_support(point, feet, more) <= outside_support(point, feet, in_contact) + 1e-12)[some].all()


def test_no_point_comes_nearer_faster_than_it_moves(scene, rng):
    point, feet, in_contact = scene
    step = 0.1 * rng.normal(size=point.shape)
    change = outside_support(point + step, feet, in_contact) - outside_support(point, feet, in_contact)
    assert (np.abs(change) <= np.linalg.norm(step, axis=1) + 1e-12).all()


def test_nothing_touching_and_no_point_count_as_no_distance(scene):
    point, feet, in_contact = scene
    point[5:8] = np.nan
    out = outside_support(point, feet, in_contact)
    assert out[0] == 0.0 and not out[5:8].any() and np.isfinite(out).all()


@pytest.mark.parametrize(
    ("segments", "ranges"),
    [
        ([[0, 9, 0]], [(0, 9)]),
        ([[0, 4, 0], [4, 9, 1]], [(0, 9)]),
        ([[0, 4, 0], [4, 9, 0]], [(0, 4), (4, 9)]),
        ([[0, 2, 0], [2, 5, 0], [5, 9, 1]], [(0, 2), (2, 9)]),
    ],
)
def test_pieces_part_the_frames_where_segments_do_not_join(dancer, segments, ranges):
    assert continuous_ranges(reference_of(dancer, standing(dancer, 9), segments=segments)) == ranges


def test_sole_points_are_on_the_soles_and_turn_with_the_robot(dancer):
    qpos = standing(dancer, 4)
    qpos[:, 7:] += 0.05
    points = floor_points(reference_of(dancer, qpos), dancer)
    reference = reference_of(dancer, qpos)
    corners = sole_corners(dancer, reference.body_pos_w, reference.body_quat_w).reshape(4, 8, 3)
    # In the plane of each sole and between its corners.
    for k in range(2):
        low, high = (f(corners[:, 4 * k : 4 * k + 4], axis=1) for f in (np.min, np.max))
        on = points.pos_w[
            :, [i for i, b in enumerate(points.body[0]) if b == dancer.body(list(dancer.soles.values())[k].body)]
        ]
        assert (on >= low[:, None] - 1e-9).all() and (on <= high[:, None] + 1e-9).all()
    turn, moved = rot.from_yaw(np.array(1.1)), qpos.copy()
    moved[:, :3], moved[:, 3:7] = (
        rot.rotate(turn, qpos[:, :3]) + [1.0, 2.0, 0.0],
        rot.multiply(turn[None], qpos[:, 3:7]),
    )
    there = floor_points(reference_of(dancer, moved), dancer)
    np.testing.assert_allclose(there.pos_w, rot.rotate(turn, points.pos_w) + [1.0, 2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * (there.yaw - points.yaw)), np.exp(1.1j), atol=1e-9)
    np.testing.assert_array_equal(there.in_contact, points.in_contact)


@pytest.mark.parametrize(("label", "contacts"), [(PLANTED, True), (PIVOTING, True), (FREE, False)])
def test_a_point_two_centimetres_up_carries_what_its_label_says_and_lower_or_higher_ones_do_not_ask(
    dancer, label, contacts
):
    for height, expected in ((0.0, True), (0.02, contacts), (0.04, False)):
        qpos = standing(dancer, 5)
        qpos[:, 2] += height
        assert (floor_points(reference_of(dancer, qpos, label=label), dancer).in_contact == expected).all(), height


def test_a_point_carries_a_frame_before_and_after_its_touch_but_not_across_a_cut(dancer):
    qpos = standing(dancer, 12)
    qpos[:, 2] += 0.02
    label = np.full((12, 4), FREE)
    label[5:7] = PLANTED
    whole = reference_of(dancer, qpos, label=label)
    assert floor_points(whole, dancer).in_contact.all(axis=1).tolist() == [4 <= t <= 7 for t in range(12)]
    cut = dataclasses.replace(whole, segments=np.array([[0, 7, 0], [7, 12, 0]]))
    assert floor_points(cut, dancer).in_contact.all(axis=1).tolist() == [4 <= t <= 6 for t in range(12)]


def test_an_unlabelled_point_on_the_floor_carries_if_it_is_slow(dancer):
    for speed, carries in ((0.2, True), (0.5, False)):
        qpos = standing(dancer, 10)
        qpos[:, 0] += speed * np.arange(10) / 50.0
        assert (floor_points(reference_of(dancer, qpos, label=FREE), dancer).in_contact == carries).all()
