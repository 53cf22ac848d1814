"""Jumps as gravity makes them: in the air nothing pushes, so the time fixes the height, whatever the robot's size.

A person's jump scaled down to a smaller robot keeps its duration and would hang in the air. Between take-off and landing
the whole body is raised to the thrown body's parabola.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Int
from numpy import ndarray

from clips import FREE, HumanClip, heights_and_speeds, own_floor
from retarget.config import JumpConfig
from retarget.rules import GRAVITY
from retarget.targets.contacts import body_up, heel_toe_points
from retarget.targets.targets import Targets
from robot_models.maths import intervals_of


def raise_jumps(targets: Targets, source: HumanClip, config: JumpConfig = JumpConfig()) -> Targets:
    """The targets with every jump of the source raised, or lowered, to g T^2 / 8 over its chord.

    Args:
        targets: in the robot's size.
        source: what they were made from, frame by frame.
        config: what a jump is.
    """
    pelvis, feet, airborne = targets.pelvis_pos.copy(), targets.feet.pos.copy(), targets.airborne.copy()
    for a, b in jumps(targets.feet.contact, source, config):
        s = np.arange(1, b - a + 1) / (b - a + 1)  # 0 at the last touch before, 1 at the first after
        chord = pelvis[a - 1, 2] + s * (pelvis[b, 2] - pelvis[a - 1, 2])
        duration = (b - a + 1) / targets.fps
        raised = chord + 0.5 * GRAVITY * duration**2 * s * (1.0 - s) - pelvis[a:b, 2]
        pelvis[a:b, 2] += raised
        airborne[a:b] = True
        ground = np.minimum(feet[a - 1, :, 2], feet[b, :, 2])
        feet[a:b, :, 2] = np.maximum(feet[a:b, :, 2] + raised[:, None], ground)
    return replace(targets, pelvis_pos=pelvis, feet=replace(targets.feet, pos=feet), airborne=airborne)


def jumps(contact: Int[ndarray, "T 4"], source: HumanClip, config: JumpConfig = JumpConfig()) -> list[tuple[int, int]]:
    """Half-open frame ranges without a touch, between two touches, in which the source is in the air for certain."""
    points = heel_toe_points(source)
    height, _ = heights_and_speeds(points, source.fps, own_floor(points))
    high, up = np.asarray((height > config.height).all(axis=1)), body_up(source, config.body)
    return [
        (a, b)
        for a, b in intervals_of((contact == FREE).all(axis=1))
        if a > 0
        and b < len(contact)
        and high[a:b].any()
        and up[a:b].all()
        and (b - a + 1) / source.fps <= config.longest_s
    ]
