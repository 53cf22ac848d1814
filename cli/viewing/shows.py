"""Files and policies as shows."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from cli.judging import judge_all, reference_for
from cli.shell import FileOptions, make_console, progress
from cli.viewing.live_panel import NOBODY, LivePanel
from cli.viewing.mending import Mending
from cli.viewing.mending_panel import MendingPanel, show_of_result
from cli.viewing.upload_panel import UploadPanel
from clips import ClipError, HumanClip, Reference, file_and_name, is_reference, load_reference, read_clip
from retarget import Retargeted, dynamics_of
from retarget.stage import Figure, Panel, Show, show_reference, show_side_by_side
from retarget.workflows import SUFFIXES
from robot_models import DEFAULT_ROBOT, RobotModel, forward_kinematics, load_robot

_POLICIES = (".onnx", ".pt", ".yaml")


def show_of(files: Sequence[Path], robot: str | None, options: FileOptions, follow: Path | None = None) -> Show:
    """What there is to see of one file, or of several side by side.

    Args:
        files: references, other tools' motions of robots, recordings of people; or one policy.
        robot: that people are retargeted to, or the profile of a reference's.
        options: what is stated about files that are no references.
        follow: what a tracker shall follow.

    Raises:
        DanceError: a file that is none of these.
    """
    if len(files) > 1:
        for file in files:
            if not is_motion(file):
                raise ClipError(
                    str(file), found="a policy among motions", expected="motions", cure="show a policy alone"
                )
        names = [file.name for file in files]
        told = {str(f) if names.count(f.name) > 1 else f.name: f for f in files}
        return show_side_by_side({name: _motion(file, robot, options) for name, file in told.items()})
    (file,) = files
    if not is_motion(file):
        return _danced(file, robot, options, follow)
    if is_reference(file):
        model, reference = _reference(file, robot)
        return show_reference(model, reference, dynamics_of(reference, model))
    return show_of_result(_solved(file, robot, options))


def panel_of(
    files: Sequence[Path],
    robot: str | None,
    options: FileOptions,
    stack: ExitStack,
    follow: Path | None = None,
    tracker: str = NOBODY,
) -> Panel | None:
    """What can be done beside looking, where one looks live: a recording is mended, a policy pushed; else None.

    Args:
        files: as for `show_of`.
        robot: as for `show_of`.
        options: as for `show_of`.
        stack: keeps what a policy needs for as long as it dances.
        follow: as for `show_of`.
        tracker: as for `MendingPanel`.
    """
    if not files:
        return UploadPanel(robot or DEFAULT_ROBOT, options, tracker)
    if len(files) > 1:
        return None
    (file,) = files
    if is_motion(file):
        mending = mending_of(files, robot, options)
        return None if mending is None else MendingPanel(mending, tracker)
    from tracking.evaluation import LiveDance

    ref = stack.enter_context(reference_for(follow, options, make_console()))
    dance = LiveDance(file, robot, reference=ref)
    stack.callback(dance.close)
    return LivePanel(dance, file.name)


def mending_of(files: Sequence[Path], robot: str | None, options: FileOptions) -> Mending | None:
    """The mending of a recording that is brought to a robot; None for whatever is shown as it is."""
    if len(files) > 1 or not is_motion(files[0]) or is_reference(files[0]):
        return None
    if robot is None and not isinstance(read_clip(files[0], options.reading()), HumanClip):
        return None
    with progress("solved") as told:
        return Mending(files[0], robot or DEFAULT_ROBOT, options, told)


def is_motion(file: Path) -> bool:
    """A file, or one of its clips; else it is a policy.

    Raises:
        ClipError: the name of a motion that is not there.
    """
    path = file_and_name(file)[0]
    if path.suffix.lower() in SUFFIXES and not path.exists():
        raise ClipError(str(file), found="no such file", expected="a reference, a recording, or a policy")
    return path.is_file() and path.suffix not in _POLICIES


def _motion(file: Path, robot: str | None, options: FileOptions) -> tuple[RobotModel, Reference]:
    if is_reference(file):
        return _reference(file, robot)
    result = _solved(file, robot, options)
    return result.robot, result.reference


def _reference(file: Path, robot: str | None) -> tuple[RobotModel, Reference]:
    model = load_robot(robot or load_reference(file).robot)
    return model, load_reference(file, model)


def _solved(file: Path, robot: str | None, options: FileOptions) -> Retargeted:
    """A person brought to a robot; a robot's motion as it stands, or brought to the robot that is named."""
    mending = mending_of([file], robot, options)
    return judge_all([file], options)[0].result if mending is None else mending.result


def _danced(policy: Path, robot: str | None, options: FileOptions, follow: Path | None) -> Show:
    """A policy on its nominal robot beside its reference, from the beginning to the end or the fall."""
    from tracking.evaluation import stream_policy

    with reference_for(follow, options, make_console()) as ref:
        stream = stream_policy(policy, robot, reference=ref)
        poses, meant = [], []
        with progress("frames") as told:
            for k, (qpos, ghost) in enumerate(stream.poses, start=1):
                poses.append(qpos)
                meant.append(ghost)
                told("simulated", k, stream.frames)
    danced, fell = len(poses) / stream.fps, len(poses) < stream.frames
    return Show(
        title=f"{policy.name} on {stream.robot.name}, in the simulator",
        passed=not fell,
        verdict=f"{danced:.1f} of {stream.frames / stream.fps:.1f} s{', then it fell' if fell else ''}",
        fps=stream.fps,
        figures=(
            _posed(policy.name, stream.robot, np.array(poses)),
            _posed("its reference", stream.robot, np.array(meant), ghost=True),
        ),
    )


def _posed(name: str, robot: RobotModel, qpos: np.ndarray, *, ghost: bool = False) -> Figure:
    pos, quat = forward_kinematics(robot, qpos)
    return Figure(name=name, robot=robot, body_pos_w=pos, body_quat_w=quat, ghost=ghost)
