"""From markers to joints: the same under any set's names, wherever one stands, and mirrored for the other side."""

import numpy as np
import pytest

from clips.readers.markers import joint_centres

# Plug-in Gait, of somebody who stands at a slant, legs and arms unlike: metres.
GAIT = {
    "LASI": (0.10, 0.13, 1.00), "RASI": (0.11, -0.12, 1.01), "LPSI": (-0.10, 0.05, 1.02), "RPSI": (-0.09, -0.05, 1.03),
    "LKNE": (0.05, 0.17, 0.50), "RKNE": (0.12, -0.15, 0.52), "LANK": (-0.02, 0.15, 0.08), "RANK": (0.10, -0.14, 0.09),
    "LTOE": (0.18, 0.11, 0.03), "RTOE": (0.30, -0.12, 0.04), "LSHO": (0.0, 0.18, 1.45), "RSHO": (0.02, -0.19, 1.44),
    "LELB": (0.0, 0.46, 1.40), "RELB": (0.1, -0.4, 1.30), "LWRA": (0.03, 0.70, 1.40), "LWRB": (-0.03, 0.70, 1.42),
    "RWRA": (0.2, -0.6, 1.2), "RWRB": (0.25, -0.55, 1.2), "LFHD": (0.08, 0.07, 1.7), "RFHD": (0.08, -0.07, 1.7),
    "LBHD": (-0.08, 0.07, 1.72), "RBHD": (-0.08, -0.07, 1.72),
}  # fmt: skip
RIZZOLI = {
    "ASI": "IAS",
    "PSI": "IPS",
    "KNE": "FLE",
    "ANK": "FAL",
    "TOE": "FM2",
    "SHO": "CAJ",
    "ELB": "HLE",
    "WRA": "RSP",
    "WRB": "USP",
}
CMU = {"ASI": "FWT", "PSI": "BWT"}
FRAMES = 4


def markers(**changes):
    places = {k: v for k, v in (GAIT | changes).items() if v is not None}
    sway = 0.01 * np.sin(np.arange(FRAMES))[:, None] * [1.0, 0.5, 0.0]
    return {k: np.array(v) + sway for k, v in places.items()}


def joints(given):
    found = joint_centres(given)
    assert found is not None
    return found[0]


def everywhere(joint_places, change):
    return {k: change(v) for k, v in joint_places.items()}


def agree(a, b, atol=1e-12):
    assert a.keys() == b.keys()
    for k in a:
        np.testing.assert_allclose(a[k], b[k], atol=atol, err_msg=k)


def test_joints_move_with_the_person(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    shift = rng.normal(size=3)

    def move(p):
        return p @ turn.T + shift

    agree(joints(everywhere(markers(), move)), everywhere(joints(markers()), move))


def test_joints_of_the_mirrored_person_are_the_mirrored_joints():
    def reflect(named, left, right):
        return {(right + k[len(left):] if k.startswith(left) else left + k[len(right):] if k.startswith(right) else k):
                v * [1.0, -1.0, 1.0] for k, v in named.items()}  # fmt: skip

    agree(joints(reflect(markers(), "L", "R")), reflect(joints(markers()), "left", "right"))


@pytest.mark.parametrize(("renamed", "known"), [(CMU, "CMU"), (RIZZOLI, "Rizzoli")])
def test_the_sets_are_one_body_under_other_names(renamed, known):
    other = {k[0] + renamed.get(k[1:], k[1:]): v for k, v in markers().items()}
    points, finding = joint_centres(other)
    ours = joints(markers())
    if "LFHD" in other:
        agree(points, ours)
    assert known in finding.value and finding.option == "mapping"


def test_hips_scale_with_the_pelvis_and_lie_inside_it_below_the_bones():
    once, twice = joints(markers()), joints(everywhere(markers(), lambda p: 2.0 * p))
    for side, bone in (("left", "LASI"), ("right", "RASI")):
        np.testing.assert_allclose(twice[f"{side}_hip"], 2.0 * once[f"{side}_hip"], atol=1e-12)
        off = once[f"{side}_hip"] - markers()[bone]
        assert (off[:, 2] < -0.05).all() and (off[:, 0] < -0.02).all()  # down and back
        # Three shares of the pelvis' width along three axes, square to one another however the bones lie.
        shares = np.linalg.norm(off, axis=1) / np.linalg.norm(markers()["LASI"] - markers()["RASI"], axis=1)
        np.testing.assert_allclose(shares, np.linalg.norm([0.14, 0.30, 0.19]), atol=1e-9)
    wide = [
        np.linalg.norm(a - b, axis=1)
        for a, b in ((once["left_hip"], once["right_hip"]), (markers()["LASI"], markers()["RASI"]))
    ]
    np.testing.assert_allclose(wide[0] / wide[1], 1 - 2 * 0.14, atol=1e-9)  # Bell's 14 % from either side


def test_a_knee_lies_half_a_joints_width_inside_of_its_marker_square_to_the_thigh():
    found, given = joints(markers()), markers()
    for side, marker in (("left", "LKNE"), ("right", "RKNE")):
        inwards = found[f"{side}_knee"] - given[marker]
        thigh = given[marker] - found[f"{side}_hip"]
        np.testing.assert_allclose(np.sum(inwards * thigh, axis=1), 0.0, atol=1e-12)
        other = given["RKNE" if side == "left" else "LKNE"]
        assert (
            np.linalg.norm(found[f"{side}_knee"] - other, axis=1) < np.linalg.norm(given[marker] - other, axis=1)
        ).all()


def test_a_sacrum_marker_serves_for_the_two_behind():
    middle = 0.5 * (np.array(GAIT["LPSI"]) + np.array(GAIT["RPSI"]))
    agree(joints(markers(LPSI=None, RPSI=None, SACR=tuple(middle))), joints(markers()))
    agree(joints(markers(RPSI=None, SACR=tuple(middle))), joints(markers()))


def test_a_marker_that_was_never_seen_is_not_there():
    given = markers(LKNM=GAIT["RKNE"])
    settled = joints(given)["left_knee"]
    np.testing.assert_allclose(settled, 0.5 * (given["LKNE"] + given["LKNM"]))
    given["LKNM"] = np.full((FRAMES, 3), np.nan)
    agree(joints(given), joints(markers()))


def test_a_marker_lost_in_one_frame_costs_that_frame_and_no_other():
    given = markers()
    given["LANK"][2] = np.nan
    found = joints(given)
    assert np.isnan(found["left_ankle"][2]).all() and np.isfinite(found["left_ankle"][[0, 1, 3]]).all()
    agree(
        {k: v for k, v in found.items() if k != "left_ankle"},
        {k: v for k, v in joints(markers()).items() if k != "left_ankle"},
    )


@pytest.mark.parametrize("lost", ["LASI", "RASI", "LKNE", "RANK"])
def test_without_pelvis_or_a_leg_there_is_no_person(lost):
    assert joint_centres(markers(**{lost: None})) is None


def test_without_an_arm_or_the_head_only_these_are_absent():
    found = joints(markers(LELB=None, LBHD=None, RBHD=None))
    assert "left_elbow" not in found and {"right_elbow", "head", "left_wrist"} <= set(found)
    np.testing.assert_allclose(found["head"], 0.5 * (markers()["LFHD"] + markers()["RFHD"]))
    assert "neck" not in joints(markers(LSHO=None))
    assert joint_centres({"LASI": markers()["LASI"]}) is None
