"""The source's body as a rigid-segment figure: frames of pelvis, trunk and feet from points and orientations.

All frames are x forward, y left, z up when the person stands upright: the frame that every robot body has at its
zero pose, so that a target orientation is the segment's frame times the body's zero orientation.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from clips import HumanClip
from robot_models.maths import nearest
from robot_models.maths import rotation as rot

_INSTEP = np.radians(25.0)  # by which the line from ankle to toe falls, of a foot that is flat
_BENT = 0.3  # sine of an elbow's bend from which it tells where the thumb is
_LEVEL = 0.35  # cosine between an arm and the way up, of a T-pose
_LIES, _STANDS = 0.2, 0.6  # sines of a shin's angle over the horizontal


def trunk_frames(clip: HumanClip) -> tuple[Float[ndarray, "T 4"], Float[ndarray, "T 4"]]:
    """Orientations of pelvis and upper trunk.

    Geometry gives both (hip line, shoulder line, the way up to the neck); where the file has orientations, they
    give the motion and geometry only their constant offset, found by averaging over the clip.
    """
    hips, shoulders = (
        clip.point("left_hip") - clip.point("right_hip"),
        clip.point("left_shoulder") - clip.point("right_shoulder"),
    )
    up = clip.point("neck") - 0.5 * (clip.point("left_hip") + clip.point("right_hip"))
    frames = []
    for landmark, left in (("pelvis", hips), ("chest", shoulders)):
        geometric = _from_left_and_up(left, up)
        recorded = clip.orientation(landmark)
        if recorded is not None:
            geometric = recorded if clip.upright else calibrate(recorded, geometric)
        frames.append(geometric)
    return frames[0], frames[1]


def foot_frames(clip: HumanClip, side: str, flat: Bool[ndarray, "T"]) -> Float[ndarray, "T 4"]:
    """Orientation of a foot: level, heading from ankle to toe, on average over the frames in `flat`.

    Where there are none, as of one who only crawls, the sole is taken to lie as under most people's ankles.
    """
    along = foot_direction(clip, side)
    recorded = clip.orientation(f"{side}_ankle")
    if recorded is not None and clip.upright:
        return recorded
    geometric = rot.from_axes(along, _foot_left(clip, side, along))
    if recorded is None:
        recorded = geometric
    if not flat.any():
        slope = _INSTEP if f"{side}_toe" in clip.landmarks else 0.0
        return calibrate(recorded, rot.multiply(geometric, rot.exp(np.array([[0.0, -slope, 0.0]]))))
    heading = np.arctan2(along[:, 1], along[:, 0])
    return calibrate(recorded, rot.from_yaw(heading), where=flat)


def _foot_left(clip: HumanClip, side: str, along: Float[ndarray, "T 3"]) -> Float[ndarray, "T 3"]:
    """A hint to the foot's left: across shin and foot; where they are in line, as on pointed toes, the last good one."""
    shin = rot.unit(clip.point(f"{side}_knee") - clip.point(f"{side}_ankle"))
    left = rot.cross(shin, rot.unit(along))
    good = np.linalg.norm(left, axis=1) > 0.3
    if not good.any():
        return clip.point("left_hip") - clip.point("right_hip")
    return np.asarray(left[nearest(good)])


def foot_direction(clip: HumanClip, side: str) -> Float[ndarray, "T 3"]:
    """From ankle to toe; without a toe, the pelvis' front: made level over a shin that is up, across one that lies."""
    if f"{side}_toe" in clip.landmarks:
        return clip.point(f"{side}_toe") - clip.point(f"{side}_ankle")
    left = clip.point("left_hip") - clip.point("right_hip")
    shin = rot.unit(clip.point(f"{side}_knee") - clip.point(f"{side}_ankle"))
    upright = np.clip((shin[:, 2:] - _LIES) / (_STANDS - _LIES), 0.0, 1.0)
    return np.cross(left, shin + upright * (np.array([0.0, 0.0, 1.0]) - shin))


def hand_frames(clip: HumanClip, side: str) -> Float[ndarray, "T 4"] | None:
    """Orientation of a hand: x along the forearm where the wrist is straight, z towards the thumb; None where it has none.

    A skeleton whose zero pose is a T with the palms down tells it exactly: there the thumb is ahead. Of any other the
    constant offset is the one that makes the wrist straight and the forearm neither turned in nor out on average.
    """
    recorded = clip.orientation(f"{side}_wrist")
    if recorded is None:
        return None
    at_zero = None if clip.upright else _hand_in_a_t(clip, side)
    if at_zero is not None:
        return np.asarray(rot.multiply(recorded, np.broadcast_to(at_zero, recorded.shape)))
    along = rot.unit(clip.point(f"{side}_wrist") - clip.point(f"{side}_elbow"))
    bend = clip.point(f"{side}_shoulder") - clip.point(f"{side}_elbow")
    flexed = bend - np.sum(bend * along, axis=1, keepdims=True) * along
    bent = np.linalg.norm(flexed, axis=1) > _BENT * np.linalg.norm(bend, axis=1)
    if not bent.any():
        return None
    thumb = rot.unit(np.where(bent[:, None], flexed, 1.0))
    geometric = rot.from_axes(along, np.cross(thumb, along))
    return calibrate(recorded, geometric, where=bent)


def _hand_in_a_t(clip: HumanClip, side: str) -> Float[ndarray, "4"] | None:
    """The hand's frame at the zero pose of a skeleton, in the file's axes; None where that is no T-pose.

    Bones are constant in the frame that they hang in, so that they tell the zero pose.
    """
    bones = {}
    for name, start, end in (
        ("up", "pelvis", "chest"), ("thigh", f"{side}_hip", f"{side}_knee"), ("left", "left_elbow", "left_wrist"),
        ("right", "right_elbow", "right_wrist"), ("upper", f"{side}_shoulder", f"{side}_elbow"),
    ):  # fmt: skip
        turn = clip.orientation(start)
        if turn is None or end not in clip.landmarks:
            return None
        bones[name] = rot.unit(np.median(rot.rotate(rot.conjugate(turn), clip.point(end) - clip.point(start)), axis=0))
    up, left, right = bones["up"], bones["left"], bones["right"]
    level = abs(float(left @ up)) < _LEVEL and abs(float(bones["upper"] @ up)) < _LEVEL
    if float(bones["thigh"] @ up) > -0.9 or float(left @ right) > -0.9 or not level:
        return None
    along, ahead = bones[side], rot.unit(np.cross(left, up))
    return rot.from_axes(along, np.cross(ahead, along))


def calibrate(
    recorded: Float[ndarray, "T 4"], wanted: Float[ndarray, "T 4"], where: Bool[ndarray, "T"] | None = None
) -> Float[ndarray, "T 4"]:
    """`recorded` times the constant offset that brings it nearest to `wanted` over the frames `where`."""
    chosen = slice(None) if where is None or not where.any() else where
    offset = rot.mean(rot.multiply(rot.conjugate(recorded[chosen]), wanted[chosen]))
    return rot.continuous(rot.multiply(recorded, np.broadcast_to(offset, recorded.shape)))


def _from_left_and_up(left: ndarray, up: ndarray) -> ndarray:
    """The frame with y along `left` and z as near to `up` as can be."""
    y = rot.unit(left)
    x = rot.unit(np.cross(y, up))
    return rot.continuous(rot.from_matrix(np.stack((x, y, np.cross(x, y)), axis=-1)))
