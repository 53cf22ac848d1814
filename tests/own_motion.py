"""A robot's motion as targets for itself: what can be reached exactly."""

import numpy as np

from clips import PLANTED
from retarget.targets.contacts import UNSTATED
from retarget.targets.feet import FootTargets
from retarget.targets.floor_parts import no_parts
from retarget.targets.leads import targets_of
from retarget.targets.targets import LIMBS, Targets
from robot_models import FEET, forward_kinematics


def own_targets(robot, qpos, contact=PLANTED, fps=50.0):
    """Its feet labelled as given, per edge or for all."""
    (pos, quat), frames = forward_kinematics(robot, qpos), len(qpos)
    at = [robot.body(robot.soles[side].body) for side in FEET]
    feet = FootTargets(
        pos=pos[:, at],
        quat=quat[:, at],
        contact=np.broadcast_to(contact, (frames, 4)).copy(),
        shift=np.zeros((frames, 2, 2)),
    )
    like = Targets(
        fps=fps, scale=1.0, pelvis_pos=pos[:, 0], pelvis_quat=quat[:, 0], torso_quat=quat[:, 0],
        limbs=dict.fromkeys(LIMBS, pos[:, 0]), feet=feet, airborne=np.zeros(frames, dtype=bool),
        parts=no_parts(frames),
        stated=np.full((frames, 4), UNSTATED),
    )  # fmt: skip
    return targets_of(robot, qpos, feet, like)
