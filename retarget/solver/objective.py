"""What the whole-clip solver pulls towards, and how firmly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import FREE, GLIDING, PIVOTING
from retarget.config import FeetConfig, ObjectiveWeights
from retarget.solver.free_joints import free_joints
from retarget.targets import LIMBS, Targets, contact_share, landmark_of
from robot_models import FEET, PART_NAMES, RobotModel
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True, eq=False)
class Objective:
    """Wanted poses on T frames, and the weights of those that change in time."""

    weights: ObjectiveWeights
    pelvis_pos: Float[ndarray, "T 3"]
    pelvis_quat: Float[ndarray, "T 4"]
    torso_quat: Float[ndarray, "T 4"]
    limbs: Float[ndarray, "T L 3"]  # vectors, in the order of LIMBS [m]
    edges: Float[ndarray, "T 4 3"]  # heel and toe of the left and the right sole [m]
    foot_quat: Float[ndarray, "T 2 4"]
    posture: Float[ndarray, "T J"]
    edge_weight: Float[ndarray, "T 4 3"]
    roll_weight: Float[ndarray, "T 2"]
    posture_weight: Float[ndarray, "T J"]
    part_height: Float[ndarray, "T P"]  # of the lowest points of bodies that are on the floor [m]
    part_weight: Float[ndarray, "T P"]
    part_body: Int[ndarray, "T P"]  # place in `body_names`
    part_place: Float[ndarray, "T P 2"]  # on the floor, of the origins of those bodies [m]
    part_place_weight: Float[ndarray, "T P"]
    contact: Int[ndarray, "T 4"]  # of the edges
    airborne: Bool[ndarray, "T"]  # frames of jumps, in which nothing carries

    def at(self, frames: Int[ndarray, "F"]) -> Objective:
        """The same goals on some of the frames."""
        picked = {f.name: getattr(self, f.name)[frames] for f in fields(self) if f.name != "weights"}
        return Objective(weights=self.weights, **picked)


def make_objective(
    robot: RobotModel,
    targets: Targets,
    weights: ObjectiveWeights,
    posture: Float[ndarray, "T J"],
    pins: Float[ndarray, "T J"] | None = None,
    feet_config: FeetConfig = FeetConfig(),
    turned: Sequence[int] = (),
) -> Objective:
    """Weigh the targets.

    Args:
        robot: the robot.
        targets: where pelvis, trunk, limbs and feet shall be.
        weights: how firmly.
        posture: joint angles to stay near where the targets leave freedom [rad].
        pins: joint angles of key frames [rad], NaN where there is none.
        feet_config: how fast a foot that leaves the floor is let go.
        turned: wrists' joints whose posture turns a hand as the person's.
    """
    feet = targets.feet
    edges = [
        feet.pos[:, k] + rot.rotate(feet.quat[:, k], np.broadcast_to(point, feet.pos[:, k].shape))
        for k, side in enumerate(FEET)
        for point in (robot.soles[side].heel, robot.soles[side].toe)
    ]
    places = np.stack(edges, axis=1)
    glides = contact_share(feet.contact == GLIDING, targets.fps, feet_config)
    share = contact_share((feet.contact != FREE) & (feet.contact != GLIDING), targets.fps, feet_config)
    places[..., 2] *= np.where(share < 1.0, 1.0 - glides, 1.0)  # what glides is on the floor
    edge_weight = np.repeat((weights.swing + share * (weights.planted - weights.swing))[..., None], 3, axis=2)
    edge_weight[..., :2][feet.contact == PIVOTING] = weights.pivot
    edge_weight[..., 2] = np.maximum(edge_weight[..., 2], weights.swing + glides * (weights.planted - weights.swing))
    in_contact = share.reshape(-1, 2, 2).max(axis=2)
    firmness = np.where(free_joints(robot), weights.free_joint, weights.posture)
    firmness[list(turned)] = weights.hand
    posture_weight = np.broadcast_to(firmness, posture.shape)
    if pins is not None:
        pinned = np.isfinite(pins)
        posture, posture_weight = np.where(pinned, pins, posture), np.where(pinned, weights.pin, posture_weight)
    parts, bodies = targets.parts, np.array([landmark_of(robot, name) for name in PART_NAMES])
    down = parts.share.any(axis=0)
    return Objective(
        weights=weights,
        pelvis_pos=targets.pelvis_pos,
        pelvis_quat=targets.pelvis_quat,
        torso_quat=targets.torso_quat,
        limbs=np.stack([targets.limbs[limb] for limb in LIMBS], axis=1),
        edges=places,
        foot_quat=feet.quat,
        posture=posture,
        edge_weight=edge_weight,
        roll_weight=weights.swing_roll + in_contact * (weights.planted_roll - weights.swing_roll),
        posture_weight=posture_weight,
        part_height=parts.height[:, down],
        part_weight=weights.part * parts.share[:, down],
        part_body=np.broadcast_to(bodies[down], (len(posture), int(down.sum()))),
        part_place=parts.anchor[:, down],
        part_place_weight=weights.part_place * parts.held[:, down],
        contact=feet.contact,
        airborne=targets.airborne,
    )
