"""Landmarks from geometry alone: they do not depend on order, size, place or turn, but left and right on handedness."""

import numpy as np
from stick_person import LANDMARKS, NAMES, PARENTS, points

from clips.identify.landmark_geometry import estimate_landmarks


def guessed(places, names=NAMES, parents=PARENTS):
    return estimate_landmarks([f"<{n}>" for n in names], parents, places)


def wanted(table=LANDMARKS):
    return {k: f"<{n}>" for k, n in table.items()}


def test_a_person_is_found_whole():
    assert guessed(points()) == wanted()


def test_size_place_and_any_turn_do_not_matter(rng):
    for _ in range(5):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))  # no mirror among them
        assert guessed(100.0 * points() @ turn.T + 1e3 * rng.normal(size=3)) == wanted()


def test_in_a_mirrored_world_left_is_right():
    """A left-handed file cannot be told from its mirror image by geometry: the sides change, all else stays."""
    crossed = {k: n.replace("left", "#").replace("right", "left").replace("#", "right") for k, n in LANDMARKS.items()}
    assert guessed(points() * [1.0, -1.0, 1.0]) == wanted(crossed)


def test_a_person_who_turns_and_lies_down_is_the_same(rng):
    places, angle = points(), np.linspace(0.0, 2 * np.pi, 60)
    spin = np.zeros((60, 3, 3))
    spin[:, 0, 0] = spin[:, 2, 2] = np.cos(angle)
    spin[:, 0, 2], spin[:, 2, 0], spin[:, 1, 1] = np.sin(angle), -np.sin(angle), 1.0
    assert guessed(np.einsum("tij,tkj->tki", spin, places)) == wanted()  # heels over head once


def test_the_order_of_limbs_in_a_file_does_not_matter():
    order = sorted(range(len(NAMES)), key=lambda k: (depth(k), NAMES[k][::-1]))
    at = {k: i for i, k in enumerate(order)}
    parents = [at.get(PARENTS[k], -1) for k in order]
    assert all(p < i for i, p in enumerate(parents))
    assert guessed(points()[:, order], [NAMES[k] for k in order], parents) == wanted()


def depth(k):
    return 0 if PARENTS[k] < 0 else 1 + depth(PARENTS[k])


def test_a_collar_bone_and_finger_tips_do_not_shift_the_arms():
    """Every custom has other points along an arm; the two long bones are the arm."""
    names, parents, places = list(NAMES), list(PARENTS), points()
    for side in ("left", "right"):
        chest, shoulder, elbow, wrist = (
            names.index(n) for n in ("chest", *(f"{side}_{p}" for p in ("shoulder", "elbow", "wrist")))
        )
        tip = places[:, wrist] + 0.3 * (places[:, wrist] - places[:, elbow])
        places = np.concatenate((places, tip[:, None]), axis=1)
        names, parents = [*names, f"{side}_tip"], [*parents, wrist]
        # A collar bone between chest and shoulder has to stand before the shoulder: it takes the shoulder's place.
        collar = 0.6 * places[:, chest] + 0.4 * places[:, shoulder]
        places = np.insert(places, shoulder, collar, axis=1)
        names.insert(shoulder, f"{side}_collar")
        parents = [p + (p >= shoulder) for p in parents]
        parents.insert(shoulder, chest)
        parents[shoulder + 1] = shoulder
    assert guessed(places, names, parents) == wanted()


def test_a_trunk_longer_than_an_arm_is_no_upper_arm():
    """A skeleton whose shoulders hang from the waist: the way out of the trunk is its longest bone."""
    places = points()
    places[:, NAMES.index("chest")] = places[:, NAMES.index("pelvis")] + [0.0, 0.0, 0.05]
    assert guessed(places) == wanted()


def test_a_head_is_found_only_where_something_lies_beyond_the_neck():
    keep = [k for k, n in enumerate(NAMES) if n not in ("head", "neck")]
    parents = [keep.index(PARENTS[k]) if PARENTS[k] >= 0 else -1 for k in keep]
    found = guessed(points()[:, keep], [NAMES[k] for k in keep], parents)
    assert found == {k: n for k, n in wanted().items() if k not in ("head", "neck")}


def test_what_has_no_arms_or_limbs_of_one_bone_is_no_person():
    keep = [k for k, n in enumerate(NAMES) if not any(p in n for p in ("shoulder", "elbow", "wrist"))]
    parents = [keep.index(PARENTS[k]) if PARENTS[k] >= 0 else -1 for k in keep]
    assert guessed(points()[:, keep], [NAMES[k] for k in keep], parents) == {}
    assert guessed(points(), NAMES, [-1] + [0] * (len(NAMES) - 1)) == {}  # a hedgehog
