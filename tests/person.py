"""A person of points, laid out on the way of two feet; and the same person elsewhere, at another rate, backwards."""

import dataclasses

import numpy as np

from clips import HumanClip
from clips.provenance import Provenance
from robot_models.maths import rotation as rot

FOOT = 0.2  # from ankle to toe [m]
ANKLE, TOE = 0.08, 0.02  # their heights where the foot stands [m]
_OVER_ANKLES = {
    "knee": (0.03, 0.4),
    "hip": (0.0, 0.8),
    "shoulder": (0.0, 1.25),
    "elbow": (0.02, 0.98),
    "wrist": (0.1, 0.75),
}


def standing_feet(frames, *, apart=0.2, yaw=0.0):
    """Ankles and toes that stand, heading `yaw` [rad]: (T, 2 feet, 3) each."""
    ankles = np.zeros((frames, 2, 3))
    ankles[:, :, 1], ankles[..., 2] = [0.5 * apart, -0.5 * apart], ANKLE
    return ankles, ankles + toes_ahead(np.broadcast_to(yaw, (frames, 2)))


def toes_ahead(yaw):
    """From ankles to toes that head `yaw` [rad]."""
    return np.stack((FOOT * np.cos(yaw), FOOT * np.sin(yaw), np.full(yaw.shape, TOE - ANKLE)), axis=-1)


def person(ankles, toes, fps=50.0, *, middle=None):
    """Points of a person whose feet these are; the body upright over `middle` (T, 3), else over the middle of a stand."""
    frames = len(ankles)
    middle = np.tile([0.0, 0.0, ANKLE], (frames, 1)) if middle is None else middle
    points = {}
    for k, (side, left) in enumerate((("left", 0.1), ("right", -0.1))):
        points[f"{side}_ankle"], points[f"{side}_toe"] = ankles[:, k], toes[:, k]
        for part, (ahead, up) in _OVER_ANKLES.items():
            wide = left * (1.8 if part in ("shoulder", "elbow", "wrist") else 1.0)
            points[f"{side}_{part}"] = middle + np.array([ahead, wide, up])
    return HumanClip(
        fps=fps, names=tuple(points), positions=np.stack(list(points.values()), axis=1), orientations=None,
        parents=(-1,) * len(points), landmarks={n: n for n in points}, height=1.7,
        source=Provenance(file="made", sha256="0" * 64, dialect="made"),
    )  # fmt: skip


def stepping(fps=50.0, seconds=2.0):
    """A step of either foot and a pivot of the right one, at the same times whatever the rate."""
    frames = round(seconds * fps)
    t = np.arange(frames) / fps
    ankles, _ = standing_feet(frames)
    for k, start in enumerate((0.4, 1.2)):
        phase = np.clip((t - start) / 0.4, 0.0, 1.0)
        ankles[:, k, 2] += 0.15 * np.sin(np.pi * phase) ** 2
        ankles[:, k, 0] += 0.3 * (phase - np.sin(2.0 * np.pi * phase) / (2.0 * np.pi))
    yaw = np.zeros((frames, 2))
    yaw[:, 1] = 1.9 * np.clip(t - 0.5, 0.0, 0.5)
    toes = ankles + toes_ahead(yaw)
    return person(ankles, toes, fps, middle=ankles.mean(axis=1) * [1.0, 1.0, 0.0] + [0.0, 0.0, ANKLE])


def elsewhere(clip, turn_rad, shift):
    """The same person turned about the vertical, then shifted."""
    turn = rot.from_yaw(np.array(turn_rad))
    orientations = clip.orientations
    if orientations is not None:
        orientations = rot.multiply(np.broadcast_to(turn, orientations.shape), orientations)
    return dataclasses.replace(
        clip, positions=rot.rotate(turn, clip.positions) + np.asarray(shift), orientations=orientations
    )


def backwards(clip):
    """The same person with time reversed."""
    orientations = None if clip.orientations is None else clip.orientations[::-1]
    return dataclasses.replace(clip, positions=clip.positions[::-1], orientations=orientations)
