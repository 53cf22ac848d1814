"""A person of points that sways and bends its knees, and clips whose numbers tell frame and column."""

import numpy as np

from clips import HumanClip, RobotClip
from clips.clip import OPTIONAL, REQUIRED
from clips.provenance import Provenance
from robot_models.maths import rotation as rot

# Metres, z up, facing +x: name -> (parent, place).
PLACES = {
    "pelvis": (None, (0.0, 0.0, 0.95)),
    "left_hip": ("pelvis", (0.0, 0.1, 0.92)), "left_knee": ("left_hip", (0.06, 0.1, 0.5)),
    "left_ankle": ("left_knee", (0.0, 0.1, 0.08)), "left_toe": ("left_ankle", (0.15, 0.1, 0.02)),
    "right_hip": ("pelvis", (0.0, -0.1, 0.92)), "right_knee": ("right_hip", (0.06, -0.1, 0.5)),
    "right_ankle": ("right_knee", (0.0, -0.1, 0.08)), "right_toe": ("right_ankle", (0.15, -0.1, 0.02)),
    "chest": ("pelvis", (0.0, 0.0, 1.3)), "neck": ("chest", (0.0, 0.0, 1.45)), "head": ("neck", (0.02, 0.0, 1.65)),
    "left_shoulder": ("chest", (0.0, 0.2, 1.4)), "left_elbow": ("left_shoulder", (-0.02, 0.25, 1.12)),
    "left_wrist": ("left_elbow", (0.08, 0.27, 0.88)),
    "right_shoulder": ("chest", (0.0, -0.2, 1.4)), "right_elbow": ("right_shoulder", (-0.02, -0.25, 1.12)),
    "right_wrist": ("right_elbow", (0.08, -0.27, 0.88)),
}  # fmt: skip
NAMES = tuple(PLACES)
PARENTS = tuple(-1 if parent is None else NAMES.index(parent) for parent, _ in PLACES.values())
SOURCE = Provenance(file="person.x", sha256="0" * 64, dialect="made up")
LANDMARKS = {k: k for k in (*REQUIRED, *OPTIONAL)}


def points(frames=60, fps=30.0):
    """Positions of all points: arms swing, the trunk sways, the feet stand."""
    t = (np.arange(frames) / fps)[:, None]
    place = np.repeat(np.array([p for _, p in PLACES.values()])[None], frames, axis=0)
    high = np.maximum(place[..., 2] - 0.1, 0.0)
    place[..., 0] += 0.03 * np.sin(2 * t) * high
    place[..., 1] += 0.05 * np.cos(3 * t) * high
    for side, sign in (("left", 1.0), ("right", -1.0)):
        place[:, NAMES.index(f"{side}_wrist"), 0] += 0.1 * sign * np.sin(4 * t[:, 0])
    return place


def person(frames=60, fps=30.0, **fields):
    """The same as a clip; every point turns on its own."""
    phase = np.arange(frames)[:, None] / fps + np.arange(len(NAMES))
    turns = rot.exp(np.stack((0.3 * np.sin(phase), 0.2 * np.cos(phase), 0.5 * np.sin(0.7 * phase)), axis=-1))
    given = {"fps": fps, "names": NAMES, "positions": points(frames, fps), "orientations": turns, "parents": PARENTS,
             "landmarks": LANDMARKS, "height": 1.7, "source": SOURCE}  # fmt: skip
    return HumanClip(**(given | fields))


def tagged(frames, columns):
    """100 x column + frame: a column or a frame in another place shows."""
    return 100.0 * np.arange(columns) + np.arange(frames)[:, None]


def robot_clip(frames=20, fps=30.0, names=("a", "b", "c"), **fields):
    """A robot's clip with tagged numbers and a steady turn."""
    given = {"fps": fps, "robot": "dancer", "joint_names": tuple(names), "root_pos": tagged(frames, 3) + 1e4,
             "root_quat": rot.from_yaw(0.05 * np.arange(frames)), "joint_pos": tagged(frames, len(names)),
             "source": SOURCE}  # fmt: skip
    return RobotClip(**(given | fields))
