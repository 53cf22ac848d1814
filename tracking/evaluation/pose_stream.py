"""Something to watch: poses as they come, of a reference as it is or of a policy that dances it in the simulator."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference, load_reference
from clips.music import Music, music_of
from robot_models import RobotModel, load_robot
from tracking.config import StartNoise, TaskConfig
from tracking.evaluation.rollouts import evaluation_task, play, start
from tracking.policy import load_bundle
from tracking.task import FALLS, TrackingTask

Pose = tuple[Float[ndarray, "nq"], Float[ndarray, "nq"] | None]
"""qpos, and that of the ghost."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseStream:
    """Poses one after the other, and the reference's beside them where a policy dances."""

    robot: RobotModel
    fps: float
    frames: int
    begins_s: float  # of the dance, after the lead-in [s]
    poses: Iterator[Pose]
    music: Music | None = None  # that the reference was made for


def stream_reference(path: Path, robot: str | None = None) -> PoseStream:
    """A reference as it is, without physics; the robot's profile where it is not a built-in one."""
    model = load_robot(robot or load_reference(path).robot)
    reference = load_reference(path, model)
    poses: Iterator[Pose] = ((q, None) for q in reference.qpos)
    return _stream(model, reference, poses)


def stream_policy(path: Path, robot: str | None = None, seed: int = 1, reference: Path | None = None) -> PoseStream:
    """A policy on its nominal robot, with noisy sensors, from the first frame of the lead-in to the fall or the end.

    Args:
        path: as for `load_bundle`.
        robot: as for `load_bundle`.
        seed: of the noise.
        reference: as for `load_bundle`.
    """
    bundle = load_bundle(path, reference=reference, robot=robot)
    config = evaluation_task(TaskConfig(start_noise=StartNoise(scale=0.0)), randomised=False)
    task = TrackingTask(robot=bundle.robot, reference=bundle.reference, envs=1, config=config, seed=seed, threads=1)

    def poses() -> Iterator[Pose]:
        with closing(task):
            task.reset(np.array([0]), np.array([0]))
            start(bundle.runner, task, 0)
            for ghost in bundle.reference.qpos:
                yield task.physics.qpos[0].copy(), ghost
                causes = play(bundle.runner, task).causes
                if any(causes[fall][0] for fall in FALLS):
                    break

    return _stream(bundle.robot, bundle.reference, poses())


def _stream(robot: RobotModel, reference: Reference, poses: Iterator[Pose]) -> PoseStream:
    begins_s = reference.dance.start / reference.fps
    return PoseStream(
        robot=robot, fps=reference.fps, frames=reference.frames, begins_s=begins_s, poses=poses, music=music_of(reference),
    )  # fmt: skip
