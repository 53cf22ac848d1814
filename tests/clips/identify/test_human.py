"""Raw points to a person: whatever axis is up and whatever the unit, it is the same person, never a mirrored one."""

from pathlib import Path

import numpy as np
import pytest
from stick_person import LANDMARKS, NAMES, PARENTS, person, points

from clips import ClipError, ReadOptions
from clips.identify.human import human_clip
from clips.provenance import UNITS, RawFile
from robot_models.maths import rotation as rot

RAW = RawFile(path=Path("file.x"), data=b"x")
# Where up points in the file -> a turn that brings the z axis there.
UPS = {"z": [0, 0, 0], "y": [-np.pi / 2, 0, 0], "-y": [np.pi / 2, 0, 0], "x": [0, np.pi / 2, 0], "-x": [0, -np.pi / 2, 0],
       "-z": [np.pi, 0, 0]}  # fmt: skip


def read(positions, options=None, **fields):
    given = {"dialect": "d", "fps": 30.0, "names": NAMES, "orientations": None, "parents": PARENTS,
             "options": options or ReadOptions()}  # fmt: skip
    return human_clip(RAW, positions=positions, **(given | fields))


def found(clip, what):
    return next(f for f in clip.source.findings if f.what == what)


def distances(places):
    return np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("heading", [0.0, 1.0, 2.5])
def test_whatever_axis_is_up_it_becomes_z_and_the_person_stays_one(up, heading):
    turn = rot.multiply(rot.exp(np.array(UPS[up], dtype=float)), rot.from_yaw(np.array(heading)))
    clip = read(rot.rotate(np.broadcast_to(turn, (60, len(NAMES), 4)), points()))
    assert found(clip, "up axis").value == up
    np.testing.assert_allclose(clip.positions[..., 2], points()[..., 2], atol=1e-12)  # heights over the floor
    np.testing.assert_allclose(distances(clip.positions), distances(points()), atol=1e-12)
    # No mirror: the left side lies to the left of where the toes point.
    ahead = clip.point("left_toe") - clip.point("left_ankle")
    assert (np.cross(ahead, clip.point("left_hip") - clip.point("right_hip"))[:, 2] > 0).all()


@pytest.mark.parametrize("unit", UNITS)
def test_whatever_the_unit_it_becomes_metres(unit):
    clip = read(points() / UNITS[unit])
    np.testing.assert_allclose(clip.positions, points(), atol=1e-9)
    assert found(clip, "unit").value == unit
    assert any("unit -> m" in c for c in clip.source.conversions) == (unit != "m")


def test_orientations_turn_with_their_points():
    """A bone seen from the frame of its parent is the same in the file's axes and in ours."""
    ours = person()
    turn = np.broadcast_to(rot.exp(np.array(UPS["y"])), ours.orientations.shape)
    clip = read(100.0 * rot.rotate(turn, points()), orientations=rot.multiply(turn, ours.orientations))
    k, p = NAMES.index("left_wrist"), NAMES.index("left_elbow")
    seen = [
        rot.rotate(rot.conjugate(c.orientations[:, p]), c.positions[:, k] - c.positions[:, p]) for c in (ours, clip)
    ]
    np.testing.assert_allclose(*seen, atol=1e-9)
    assert rot.angle_between(clip.orientations, ours.orientations).max() < 1e-7


def test_without_a_statement_somebody_on_their_head_is_put_on_their_feet():
    assert found(read(points() * [1.0, -1.0, -1.0] + [0.0, 0.0, 2.0]), "up axis").value == "-z"


def test_a_stated_axis_is_obeyed_where_somebody_lies_on_their_back():
    lying = points() @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert found(read(lying), "up axis").value == "-x"
    clip = read(lying, ReadOptions(up="z"))
    np.testing.assert_allclose(clip.positions, lying, atol=1e-12)
    assert found(clip, "up axis").confidence == "stated"


@pytest.mark.parametrize("turn", [[np.pi, 0.0, 0.0], [0.0, np.pi / 2, 0.0]], ids=["headstand", "face down"])
def test_somebody_who_is_not_upright_is_not_taken_for_a_mirror_image(turn):
    turned = rot.rotate(np.broadcast_to(rot.exp(np.array(turn)), (60, len(NAMES), 4)), points())
    np.testing.assert_allclose(read(turned, ReadOptions(up="z")).positions, turned, atol=1e-12)


def test_a_person_who_lies_askew_has_no_clear_up_and_is_asked_for_it():
    askew = np.broadcast_to(rot.exp(np.array([0.6, -0.7, 0.0])), (60, len(NAMES), 4))
    with pytest.raises(ClipError, match="one axis that is clearly up") as refusal:
        read(rot.rotate(askew, points()))
    assert refusal.value.option == "up"


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mirrored_file_is_refused_whatever_axis_was_turned_about(axis):
    mirror = np.ones(3)
    mirror[axis] = -1.0
    with pytest.raises(ClipError, match="left and right are swapped, or the file is mirrored"):
        read(points() * mirror)
    with pytest.raises(ClipError, match="left and right are swapped"):  # or names that are
        read(points(), names=[n.replace("left", "#").replace("right", "left").replace("#", "right") for n in NAMES])


def test_straight_legs_without_toes_cannot_tell_their_side_and_this_is_said():
    places = points()
    for name in ("left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle"):
        places[:, NAMES.index(name), 0] = 0.0
    keep = [k for k, n in enumerate(NAMES) if "toe" not in n]
    parents = [keep.index(PARENTS[k]) if PARENTS[k] >= 0 else -1 for k in keep]
    clip = read(places[:, keep], names=[NAMES[k] for k in keep], parents=parents)
    assert (
        found(clip, "handedness").confidence == "assumed"
        and found(read(points()), "handedness").confidence == "measured"
    )


def test_a_wrong_unit_is_refused_with_the_right_one_and_a_stature_is_taken():
    with pytest.raises(ClipError, match=r"a person 0\.017\d* m tall, with unit cm") as refusal:
        read(points(), ReadOptions(unit="cm"))
    assert (refusal.value.option, refusal.value.suggestion) == ("unit", "m")
    plain, small = read(points()), read(37.0 * points(), ReadOptions(stature=1.5))
    assert small.height == 1.5
    np.testing.assert_allclose(small.positions, 1.5 / plain.height * plain.positions, atol=1e-12)


def test_parents_are_renumbered_where_a_point_is_left_out():
    places = points()
    places[10:40, NAMES.index("chest")] = np.nan  # nobody needs it, but neck and shoulders hang from it
    clip = read(places)
    assert clip.names == tuple(n for n in NAMES if n != "chest") and "chest" not in clip.landmarks
    for name, parent in zip(clip.names, clip.parents, strict=True):
        before = NAMES[PARENTS[NAMES.index(name)]] if PARENTS[NAMES.index(name)] >= 0 else None
        assert (clip.names[parent] if parent >= 0 else None) == (None if before == "chest" else before)
    np.testing.assert_array_equal(clip.point("right_toe"), points()[:, NAMES.index("right_toe")])


def test_orientations_follow_their_points_through_cut_ends_and_left_out_columns():
    ours, places = person(), points()
    places[10:40, NAMES.index("chest")], places[:5, NAMES.index("left_hip")] = np.nan, np.nan
    clip = read(places, orientations=ours.orientations)
    assert clip.frames == 55
    for name in ("head", "left_toe", "right_wrist"):
        theirs = ours.orientations[5:, NAMES.index(name)]
        assert rot.angle_between(clip.orientation(name), theirs).max() < 1e-7, name


def test_landmarks_that_a_dialect_knows_win_over_names():
    names = [f"P{i}" for i in range(len(NAMES))]
    clip = read(points(), names=names, landmarks={k: names[NAMES.index(n)] for k, n in LANDMARKS.items()})
    np.testing.assert_array_equal(clip.point("left_elbow"), points()[:, NAMES.index("left_elbow")])


@pytest.mark.parametrize("fps", [0.5, 5000.0])
def test_a_rate_that_no_recording_has_is_refused(fps):
    with pytest.raises(ClipError, match="frames per second") as refusal:
        read(points(), fps=fps)
    assert refusal.value.option == "fps"
