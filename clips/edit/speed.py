"""Changes that a dancer asks for: another tempo, a tempo that changes, the other side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip, HumanClip, RobotClip
from clips.edit.resample import sample_clip
from clips.errors import ClipError
from robot_models import AXIAL, POLAR, load_robot, reflected_joints

_MIRRORED = "mirrored: left and right exchanged"


def at_speed(clip: Clip, factor: float) -> Clip:
    """The same motion `factor` times as fast: every frame is kept, the frame rate changes.

    Raises:
        ClipError: the factor is not positive.
    """
    if not 0.0 < factor < 100.0:
        raise ClipError("speed", found=repr(factor), expected="a positive factor: 0.5 is half as fast")
    if factor == 1.0:
        return clip
    return replace(clip, fps=clip.fps * factor, source=clip.source.noting(f"played at {factor:g} times its speed"))


def warp_time(clip: Clip, pace: Float[ndarray, "T"]) -> Clip:
    """The same motion at a pace that changes: frame t goes by `pace[t]` times as fast, the frame rate stays.

    Raises:
        ClipError: a pace is not positive.
    """
    if not (pace > 0.0).all():
        raise ClipError("pace", found=f"{pace.min():g}", expected="positive factors")
    took = np.concatenate(([0.0], np.cumsum(2.0 / (pace[1:] + pace[:-1]))))  # frames of the new clip up to each old one
    times = np.interp(np.arange(int(took[-1] + 1e-9) + 1), took, np.arange(len(pace)))
    slowest = int(pace.argmin())
    note = f"paced: {len(pace)} -> {len(times)} frames, {pace.min():.2f} of its speed at {slowest / clip.fps:.2f} s"
    return sample_clip(clip, times, clip.fps, note)


def mirror(clip: Clip) -> Clip:
    """Left and right exchanged: reflected in the plane y = 0, with the landmarks or joints of the other side.

    A reflection M turns an orientation R into M R M, again a rotation: of its axis only y keeps its sign.

    Raises:
        ClipError: a robot's clip, and its two sides are not alike.
    """
    return _mirrored_robot(clip) if isinstance(clip, RobotClip) else _mirrored_person(clip)


def _mirrored_robot(clip: RobotClip) -> RobotClip:
    robot = load_robot(clip.robot)
    joints = reflected_joints(robot)
    if joints is None:
        raise ClipError(
            clip.source.file, found=f"a clip of {robot.name}, whose two sides are not alike",
            expected="a robot that is its own mirror image, or a person", option="mirror",
        )  # fmt: skip
    full = np.tile(robot.default_joint_pos, (clip.frames, 1))
    own = [robot.joint(name) for name in clip.joint_names]
    full[:, own] = clip.joint_pos
    others = [robot.joint_names[joints.order[i]] for i in own]  # whose angles these joints get
    kept = [k for k, name in enumerate(others) if name in clip.joint_names]
    return replace(
        clip,
        joint_names=tuple(clip.joint_names[k] for k in kept),
        joint_pos=joints.of(full)[:, [own[k] for k in kept]],
        root_pos=clip.root_pos * POLAR,
        root_quat=clip.root_quat * np.array([1.0, *AXIAL]),
        source=clip.source.noting(_MIRRORED),
    )


def _mirrored_person(clip: HumanClip) -> HumanClip:

    def other(name: str) -> str:
        side, _, part = name.partition("_")
        return {"left": f"right_{part}", "right": f"left_{part}"}.get(side, name)

    turned = None if clip.orientations is None else clip.orientations * np.array([1.0, -1.0, 1.0, -1.0])
    return replace(
        clip,
        positions=clip.positions * np.array([1.0, -1.0, 1.0]),
        orientations=turned,
        landmarks={other(k): point for k, point in clip.landmarks.items()},
        source=clip.source.noting(_MIRRORED),
    )
