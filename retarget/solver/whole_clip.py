"""The whole-clip solver: all frames as one problem, on grids from coarse to fine, long clips in blended windows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from retarget.config import GridStage, PhysicsConfig, WholeClipConfig
from retarget.solver.gauss_newton import refine
from retarget.solver.objective import Objective
from retarget.solver.ways_round import lead_round
from retarget.targets import smoothstep
from robot_models import RobotModel
from robot_models.maths import Progress, silent
from robot_models.maths import rotation as rot


def coarse_poses(
    robot: RobotModel, objective: Objective, start: Float[ndarray, "T nq"], fps: float, config: WholeClipConfig
) -> Float[ndarray, "T nq"]:
    """A first guess on a coarse grid, from a start that may be far away."""
    far = replace(config, damping=config.coarse_damping, largest_turn=config.coarse_turn)
    return _on_grids(robot, objective, start, fps, (config.coarse,), far, silent)


def optimise(
    robot: RobotModel,
    objective: Objective,
    start: Float[ndarray, "T nq"],
    fps: float,
    config: WholeClipConfig,
    *,
    progress: Progress = silent,
) -> Float[ndarray, "T nq"]:
    """Bring a rough motion to its goals, within all limits."""
    return _on_grids(robot, objective, start, fps, config.fine, config, progress)


def make_possible(
    robot: RobotModel,
    objective: Objective,
    start: Float[ndarray, "T nq"],
    fps: float,
    config: WholeClipConfig,
    *,
    progress: Progress = silent,
) -> Float[ndarray, "T nq"]:
    """Bend a motion that is at its goals until floor and motors can give what it needs, within all limits."""
    physics = config.physics
    possible = _on_grids(robot, objective, start, fps, (physics.stage,), config, progress, physics)
    return lead_round(robot, objective, possible, fps, config, physics)


def _on_grids(
    robot: RobotModel,
    objective: Objective,
    start: ndarray,
    fps: float,
    stages: tuple[GridStage, ...],
    config: WholeClipConfig,
    progress: Progress,
    physics: PhysicsConfig | None = None,
) -> ndarray:
    windows = list(_windows(len(start), fps, config))
    out = np.array(start)
    for done, window in enumerate(windows):
        part, inside = np.array(start[window]), objective.at(np.arange(window.start, window.stop))
        for k, stage in enumerate(stages):
            grid = _grid(len(part), max(1, round(stage.step_s * fps)))
            stride = grid[1] if len(grid) > 1 else 1
            solved = refine(robot, inside.at(grid), part[grid], fps / stride, stage, config, physics)
            part = solved if len(grid) == len(part) else _between(solved, grid, len(part))
            progress(
                "optimise" if physics is None else "physics", done * len(stages) + k + 1, len(windows) * len(stages)
            )
        _blend_in(out, part, window, 0 if window.start == 0 else round(config.overlap_s * fps))
    return out


def _windows(frames: int, fps: float, config: WholeClipConfig) -> Iterator[slice]:
    """Slices that overlap by `overlap_s`, none much longer than `window_s`."""
    length, overlap = round(config.window_s * fps), round(config.overlap_s * fps)
    # A short rest is better solved with its neighbour than alone.
    count = max(1, round(max(0, frames - overlap) / max(1, length - overlap)))
    step = -(-(frames - overlap) // count) if count > 1 else frames
    for k in range(count):
        yield slice(k * step, frames if k == count - 1 else k * step + step + overlap)


def _blend_in(out: ndarray, part: ndarray, window: slice, overlap: int) -> None:
    """Write a window's frames; fade from what stands there over the middle half of the overlap."""
    w = smoothstep(2.0 * (np.arange(overlap) + 0.5) / max(1, overlap) - 0.5)[:, None]
    old, new = out[window][:overlap], part[:overlap]
    blended = old + w * (new - old)
    blended[:, 3:7] = rot.slerp(old[:, 3:7], new[:, 3:7], w[:, 0])
    out[window] = np.concatenate((blended, part[overlap:]))


def _grid(frames: int, stride: int) -> Int[ndarray, "F"]:
    """Every stride-th frame and the last."""
    grid = np.arange(0, frames, stride)
    return grid if grid[-1] == frames - 1 else np.append(grid, frames - 1)


def _between(coarse: ndarray, grid: ndarray, frames: int) -> ndarray:
    """Cubic splines through the grid's poses."""
    if len(grid) < 3:
        weight = np.arange(frames) / max(1, frames - 1)
        out = coarse[0] + weight[:, None] * (coarse[-1] - coarse[0])
    else:
        from scipy.interpolate import CubicSpline

        through = np.concatenate((coarse[:, :3], rot.continuous(coarse[:, 3:7]), coarse[:, 7:]), axis=1)
        out = CubicSpline(grid, through)(np.arange(frames))
    out[:, 3:7] = rot.normalise(out[:, 3:7])
    return np.asarray(out)
