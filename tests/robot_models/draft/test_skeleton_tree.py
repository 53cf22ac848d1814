"""Branches of a tree: lengths along the bones, ways down, and the pairs that are alike."""

from itertools import pairwise

import numpy as np
import pytest

from robot_models.draft.skeleton_tree import SkeletonTree

# A figure: pelvis 0; legs 1 2 3 and 4 5 6; chest 7; arms 8 9 10 and 11 12 13; head 14.
PARENTS = [-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 9, 7, 11, 12, 7]
PLACES = np.array(
    [[0, 0, 0.9], [0, 0.1, 0.9], [0, 0.1, 0.5], [0, 0.1, 0.1], [0, -0.1, 0.9], [0, -0.1, 0.5], [0, -0.1, 0.1], [0, 0, 1.3],
     [0, 0.2, 1.3], [0, 0.45, 1.3], [0, 0.7, 1.3], [0, -0.2, 1.3], [0, -0.45, 1.3], [0, -0.7, 1.3], [0, 0, 1.5]]
)  # fmt: skip


def figure(places=PLACES, frames=1):
    return SkeletonTree(PARENTS, np.repeat(places[None], frames, axis=0))


def test_the_reach_of_a_chain_is_the_sum_of_its_bones():
    tree = figure()
    for k in range(len(PARENTS)):
        assert tree.reach[k] == pytest.approx(sum(tree.bone[j] for j in tree.way(k)))


def test_a_way_goes_down_from_child_to_child_to_a_tip():
    tree = figure()
    for k in range(len(PARENTS)):
        way = tree.way(k)
        assert way[0] == k and not tree.children[way[-1]]
        assert all(PARENTS[b] == a for a, b in pairwise(way))


def test_below_is_an_order():
    tree, all_points = figure(), range(len(PARENTS))
    assert all(tree.below(k, k) for k in all_points)
    assert not any(tree.below(a, b) and tree.below(b, a) for a in all_points for b in all_points if a != b)
    chain = [
        (a, b, c) for a in all_points for b in all_points for c in all_points if tree.below(a, b) and tree.below(b, c)
    ]
    assert all(tree.below(a, c) for a, _, c in chain)
    assert all(tree.below(0, k) for k in all_points) and not tree.below(7, 3)


def test_legs_are_the_pair_at_the_root_and_arms_the_pair_at_the_chest():
    assert figure().legs_and_arms() == ((0, 1, 4), (7, 8, 11))


def test_the_answer_does_not_depend_on_size_place_or_turn(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    assert figure(40.0 * PLACES @ turn.T + rng.normal(size=3)).legs_and_arms() == figure().legs_and_arms()


def test_one_frame_that_flew_off_changes_no_length():
    places = np.repeat(PLACES[None], 5, axis=0)
    places[2] *= 1000.0
    np.testing.assert_array_equal(SkeletonTree(PARENTS, places).reach, figure().reach)


@pytest.mark.parametrize(("share", "alike"), [(1.05, True), (1.25, False)])
def test_limbs_a_quarter_longer_than_the_other_are_no_pair(share, alike):
    places = PLACES.copy()
    places[9:11, 1] = 0.2 + share * (places[9:11, 1] - 0.2)
    assert (figure(places).legs_and_arms() is not None) == alike


def test_a_snake_has_no_pairs():
    assert SkeletonTree([-1, 0, 1, 2], PLACES[None, :4]).legs_and_arms() is None
