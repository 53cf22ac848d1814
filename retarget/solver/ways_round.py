"""Another way round for limbs that are caught: where bodies still overlap, the passage is begun anew without the detour.

Clearances lead out of an overlap by the nearest side. A hand that is caught between arm and chest has a body on either side,
and stays: the way that leads it there was the wrong one. Begun from the straight way between the poses before and after,
the same problem has another answer.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from retarget.config import PhysicsConfig, WholeClipConfig
from retarget.solver.collision import Places, Proximity
from retarget.solver.gauss_newton import refine
from retarget.solver.objective import Objective
from robot_models import RobotModel, moved
from robot_models.maths import dilate, intervals_of


def lead_round(
    robot: RobotModel,
    objective: Objective,
    qpos: Float[ndarray, "T nq"],
    fps: float,
    config: WholeClipConfig,
    physics: PhysicsConfig,
) -> Float[ndarray, "T nq"]:
    """The motion with its caught passages solved from other beginnings, each where that is better."""
    out, search = qpos, Proximity(robot, 0.0)
    caught = _depth(search(qpos), len(qpos)) > config.caught
    for a, b in intervals_of(dilate(caught, round(config.settle_margin_s * fps))):
        around = slice(max(0, a - round(config.passage_s * fps)), b + round(config.passage_s * fps))
        part, goals = out[around], objective.at(np.arange(len(out))[around])
        best, depth = part, _depth(search(part), len(part)).max()
        for begun, anew in _beginnings(robot, search, part, a - around.start, b - around.start, fps, config):
            tried = refine(robot, goals, begun, fps, physics.stage, config, physics, anew)
            there = _depth(search(tried), len(tried)).max()
            if there < depth:
                best, depth = tried, there
            if depth < config.caught:
                break
        out = np.concatenate((out[: around.start], best, out[around.start + len(best) :]))
    return out


def _beginnings(
    robot: RobotModel, search: Proximity, part: ndarray, a: int, b: int, fps: float, config: WholeClipConfig
) -> Iterator[tuple[ndarray, ndarray]]:
    """Other beginnings of a passage [a, b): its limbs on the straight way, over longer and longer times; and its frames."""
    pairs = search(part[a:b])
    turns = moved(robot)
    joints = np.flatnonzero((turns[pairs.first] != turns[pairs.second]).any(axis=0)[6:])
    for reach_s in config.reaches_s:
        reach = round(reach_s * fps)
        first, last = max(0, a - reach), min(len(part) - 1, b + reach)
        begun, weight = part.copy(), np.linspace(0.0, 1.0, last - first + 1)[:, None]
        ends = part[[first, last]][:, 7 + joints]
        begun[first : last + 1, 7 + joints] = ends[0] + weight * (ends[1] - ends[0])
        anew = np.zeros(len(part), dtype=bool)
        anew[first : last + 1] = True
        yield begun, anew


def _depth(places: Places, frames: int) -> Float[ndarray, "T"]:
    """How deep bodies are in one another or in the floor, by frame [m]."""
    out = np.zeros(frames)
    np.maximum.at(out, places.frame, -places.gap)
    return out
