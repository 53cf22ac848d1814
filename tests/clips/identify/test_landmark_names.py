"""Names to landmarks and legs to units: sides mirror, order and prefixes do not matter, a person fits one unit."""

import numpy as np
import pytest
from stick_person import LANDMARKS, NAMES, points

from clips import ClipError, ReadOptions
from clips.identify.landmark_names import find_landmarks, find_unit, leg_lengths, stature
from clips.provenance import UNITS

CUSTOMS = {
    "mixamo": "Hips Spine Spine1 Spine2 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot LeftToeBase",
    "plain": "pelvis chest neck head left_shoulder left_elbow left_wrist left_hip left_knee left_ankle left_toe",
    "suffix": "Hips Chest Neck Head UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L Toes_L",
    "smpl": "pelvis spine3 neck head left_shoulder left_elbow left_wrist left_hip left_knee left_ankle left_foot",
}  # fmt: skip


def swapped(name):
    for a, b in (("Left", "Right"), ("left", "right"), ("_L", "_R")):
        name = name.replace(a, "#").replace(b, a).replace("#", b) if a in name or b in name else name
    return name


@pytest.fixture(params=CUSTOMS)
def names(request):
    left = CUSTOMS[request.param].split()
    return [*left, *(swapped(n) for n in left if swapped(n) != n)]


def test_the_other_side_is_found_at_the_mirrored_name(names):
    found = find_landmarks(names)
    assert set(LANDMARKS) <= set(found)
    for landmark, name in found.items():
        other = landmark.replace("left", "#").replace("right", "left").replace("#", "right")
        assert found[other] == swapped(name)


def test_capitals_have_their_side_in_front_or_behind():
    parts = ["ARM", "FOREARM", "HAND", "UPLEG", "LEG", "FOOT", "TOEBASE"]
    front = find_landmarks(["HIPS", "CHEST", "NECK", "HEAD", *(f"{side}{p}" for side in "LR" for p in parts)])
    assert set(LANDMARKS) <= set(front) and front["left_knee"] == "LLEG" and front["right_hip"] == "RUPLEG"
    behind = find_landmarks(["LOWERARM_L", "LOWERARM_R", "LOWERLEG_L", "LOWERLEG_R"])
    assert behind["right_elbow"] == "LOWERARM_R" and behind["left_knee"] == "LOWERLEG_L"


def test_no_point_is_two_parts_of_a_side(names):
    found = find_landmarks(names)
    assert len(set(found.values())) == len(found)


def test_order_and_a_subjects_prefix_do_not_matter(names, rng):
    found = find_landmarks(names)
    assert find_landmarks([names[i] for i in rng.permutation(len(names))]) == found
    assert find_landmarks([f"Ana:{n}" for n in names]) == {k: f"Ana:{n}" for k, n in found.items()}


def test_capitals_do_not_matter():
    names = [n for n in CUSTOMS["suffix"].split() if n.endswith("_L")]
    names += [swapped(n) for n in names]
    assert find_landmarks([n.upper() for n in names]) == {k: n.upper() for k, n in find_landmarks(names).items()}


def test_names_that_tell_nothing_find_nothing_and_words_with_an_l_are_no_left():
    assert find_landmarks([f"J{i}" for i in range(20)]) == {}
    assert find_landmarks(["lowerback", "rib", "Link", "roll"]) == {"pelvis": "lowerback"}


@pytest.mark.parametrize("unit", UNITS)
def test_a_persons_legs_fit_the_unit_they_are_in_and_no_other(unit):
    for leg in np.linspace(0.63, 1.04, 12):  # metres
        scale, finding = find_unit(np.full((5, 2), leg / UNITS[unit]), ReadOptions(), "x")
        assert (finding.value, finding.confidence) == (unit, "measured")
        assert scale == UNITS[unit]


def test_the_longer_half_of_the_frames_does_not_decide_nor_does_one_wild_frame():
    legs = np.full((9, 2), 80.0)
    legs[3] = 1e6
    assert find_unit(legs, ReadOptions(), "x")[1].value == "cm"


@pytest.mark.parametrize(("stated", "scale"), [("mm", 0.001), ("0.3", 0.3), ("m", 1.0)])
def test_a_stated_unit_wins_over_the_legs(stated, scale):
    got, finding = find_unit(np.full((5, 2), 80.0), ReadOptions(unit=stated), "x")
    assert (got, finding.confidence) == (scale, "stated")


@pytest.mark.parametrize("leg", [3.7, 80.0, 1e-4])
def test_a_stated_stature_makes_a_person_that_tall_whatever_the_unit(leg):
    legs = np.full((5, 2), leg)
    scale, _ = find_unit(legs, ReadOptions(stature=1.62), "x")
    assert stature(scale * legs) == pytest.approx(1.62)


def test_legs_of_no_unit_are_assumed_to_be_a_persons_and_say_so_and_no_legs_are_refused():
    scale, finding = find_unit(np.full((5, 2), 3.7), ReadOptions(), "x")
    assert finding.confidence == "assumed" and 1.5 < stature(scale * np.full((5, 2), 3.7)) < 1.9
    with pytest.raises(ClipError, match="legs of length zero"):
        find_unit(np.zeros((5, 2)), ReadOptions(), "x")


def test_leg_lengths_are_those_of_the_bones_side_by_side_and_do_not_depend_on_where_one_stands(rng):
    places = points(8)
    legs = leg_lengths(places, NAMES, LANDMARKS)
    bone = {s: np.hypot(0.06, 0.42) + np.hypot(0.06, 0.42) for s in ("left", "right")}
    assert legs[0] == pytest.approx([bone["left"], bone["right"]], abs=0.01)  # the sway bends them a little
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    np.testing.assert_allclose(leg_lengths(places @ turn.T + 5.0, NAMES, LANDMARKS), legs, atol=1e-12)
    np.testing.assert_allclose(leg_lengths(40.0 * places, NAMES, LANDMARKS), 40.0 * legs, atol=1e-12)
    longer = places.copy()
    longer[:, NAMES.index("right_ankle"), 2] -= 0.2
    assert (leg_lengths(longer, NAMES, LANDMARKS)[:, 1] > legs[:, 1] + 0.15).all()
    np.testing.assert_array_equal(leg_lengths(longer, NAMES, LANDMARKS)[:, 0], legs[:, 0])


def test_small_letters_tell_a_side_where_both_sides_are_there():
    """MakeHuman's CMU rig: `lhip` beside `rhip`; a `lamp` is no left anything."""
    sided = [
        f"{s}{part}" for s in "lr" for part in ("buttock", "hip", "knee", "foot", "collar", "shldr", "forearm", "hand")
    ]
    found = find_landmarks(["hip", "abdomen", "chest", "neck", "head", *sided])
    want = {"hip": "hip", "knee": "knee", "ankle": "foot", "shoulder": "shldr", "elbow": "forearm", "wrist": "hand"}
    assert {f"{side}_{part}": found[f"{side}_{part}"] for side in ("left", "right") for part in want} == {
        f"{side}_{part}": f"{side[0]}{name}" for side in ("left", "right") for part, name in want.items()
    }
    assert found["pelvis"] == "hip"
    assert find_landmarks(["lamp", "ramp", "lknee"]) == {}
