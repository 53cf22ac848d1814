"""`dance-play`: a policy, or a reference alone, in MuJoCo's viewer or in a film."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray
from rich.console import Console

from cli.terminal import BELOW_GATE, DONE, ClipPath, command, progress
from clips import OutputError, load_reference
from robot_models import RobotModel, load_robot


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Watch a policy dance in the simulator, live; or a reference, as it is.

    Examples:
        dance-play groove-g1
        dance-play runs/groove
        dance-play runs/groove --film groove.mp4
        dance-play groove.npz
    """

    what: ClipPath
    """Folder of a policy bundle, the name of one that comes with the package (groove-dancer, groove-g1), or a
    reference (.npz), which is shown without physics."""
    film: Path | None = None
    """Write a film (.mp4) and open no window; for machines without a display."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""
    seed: int = 1
    """Seed of the sensors' noise."""
    width: int = 960
    """Of the film, in pixels."""
    height: int = 720
    """Of the film, in pixels."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Show:
    """Something to watch: poses as they come, and the reference's beside them where a policy dances."""

    robot: RobotModel
    fps: float
    frames: int
    poses: Iterator[tuple[ndarray, ndarray | None]]  # qpos, qpos of the ghost


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-play`."""
    return command(Arguments, run, name="dance-play", argv=argv)


def run(args: Arguments) -> int:
    """Open what is named and show it."""
    if args.film is not None and args.film.suffix != ".mp4":
        raise OutputError(f"--film {args.film}", found="that name", expected="a file that ends in .mp4")
    if args.film is not None and not _has_display():
        os.environ.setdefault("MUJOCO_GL", "egl")  # read when MuJoCo is first imported
    show = _reference(args) if args.what.suffix == ".npz" else _policy(args)
    shown = _film(show, args) if args.film is not None else _live(show)
    console = Console(highlight=False, soft_wrap=True)
    fell = shown < show.frames
    console.print(
        f"{show.robot.name}: {shown / show.fps:.1f} of {show.frames / show.fps:.1f} s" + ", then it fell" * fell
    )
    if args.film is not None:
        console.print(f"wrote {args.film} ({args.film.stat().st_size / 1e6:.1f} MB)", markup=False)
    return BELOW_GATE if fell else DONE


def _reference(args: Arguments) -> Show:
    robot = load_robot(args.robot or load_reference(args.what).robot)
    reference = load_reference(args.what, robot)
    poses: Iterator[tuple[ndarray, ndarray | None]] = ((q, None) for q in reference.qpos)
    return Show(robot=robot, fps=reference.fps, frames=reference.frames, poses=poses)


def _policy(args: Arguments) -> Show:
    """The policy on its nominal robot, with noisy sensors, from the first frame of the lead-in."""
    from tracking import StartNoise, TaskConfig, TrackingTask, evaluation_task, load_bundle, play, start

    bundle = load_bundle(args.what, robot=args.robot)
    calm = TaskConfig(start_noise=StartNoise(scale=0.0))
    task = TrackingTask(
        robot=bundle.robot, reference=bundle.reference, envs=1, config=evaluation_task(calm, randomised=False),
        seed=args.seed, threads=1,
    )  # fmt: skip

    def poses() -> Iterator[tuple[ndarray, ndarray | None]]:
        task.reset(np.array([0]), np.array([0]))
        start(bundle.runner, task, 0)
        for ghost in bundle.reference.qpos:
            yield task.physics.qpos[0].copy(), ghost
            if play(bundle.runner, task).terminated[0]:
                break
        task.close()

    return Show(robot=bundle.robot, fps=bundle.reference.fps, frames=bundle.reference.frames, poses=poses())


def _has_display() -> bool:
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _live(show: Show) -> int:
    """In a window, in real time; returns the number of frames shown."""
    import mujoco

    if not _has_display():
        raise OutputError(
            "viewer",
            found="no display",
            expected="one",
            cure="write a film instead",
            option="film",
            suggestion="out.mp4",
        )
    import mujoco.viewer

    data, shown = mujoco.MjData(show.robot.model), 0
    with mujoco.viewer.launch_passive(show.robot.model, data) as window:
        began = time.perf_counter()
        for shown, (qpos, _) in enumerate(show.poses, start=1):
            if not window.is_running():
                return show.frames  # closed by hand: nobody fell
            data.qpos[:] = qpos
            mujoco.mj_forward(show.robot.model, data)
            window.sync()
            time.sleep(max(0.0, began + shown / show.fps - time.perf_counter()))
    return shown


def _film(show: Show, args: Arguments) -> int:
    from cli.recordings import write_film

    with progress("frames") as tell:
        return write_film(
            args.film or Path(), show.robot, show.poses, show.fps, (args.width, args.height),
            progress=lambda done: tell("film", done, show.frames),
        )  # fmt: skip
