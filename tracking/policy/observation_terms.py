"""What an observation may be made of: one definition of each term, which task, runner, import and export share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tracking.policy.contract import Row


@dataclass(frozen=True, kw_only=True)
class ObservationTerm:
    """What one kind of term means, wherever it is computed."""

    meaning: str
    unit: str
    frame: str
    size: int = 0  # numbers besides those per joint or body
    per_joint: int = 0
    per_body: int = 0  # of the tracked bodies
    measurable: bool = True  # whether a robot has a sensor for it
    aliases: tuple[str, ...] = ()  # the field's names: Isaac Lab's, BeyondMimic's, Unitree's
    reflection: str = "joints"  # what it is in a mirror: a key of `symmetry.SIGNS`, joints or bodies

    def numbers(self, joints: int, bodies: int = 0) -> int:
        """How many numbers it is for a policy of so many joints."""
        return self.size + self.per_joint * joints + self.per_body * bodies


TERMS: Mapping[str, ObservationTerm] = {
    "reference_joint_pos": ObservationTerm(
        meaning="joint positions of the reference", unit="rad", frame="joint, off the default pose", per_joint=1,
    ),
    "reference_joint_vel": ObservationTerm(
        meaning="joint velocities of the reference", unit="rad/s", frame="joint", per_joint=1, aliases=("motion_joint_vel",),
    ),
    "motion_joint_pos": ObservationTerm(
        meaning="joint positions of the reference", unit="rad", frame="joint", per_joint=1, aliases=("motion_joint_pos",),
    ),
    "command": ObservationTerm(
        meaning="joint positions, then velocities of the reference", unit="rad, rad/s", frame="joint", per_joint=2,
        aliases=("command", "motion_command"),
    ),
    "reference_planar_velocity": ObservationTerm(
        meaning="velocity of the reference's root, x and y", unit="m/s", frame="reference root body", size=2, reflection="planar",
    ),
    "reference_root_height": ObservationTerm(
        meaning="height of the reference's root", unit="m", frame="world, z", size=1, reflection="scalar",
    ),
    "reference_roll_pitch": ObservationTerm(
        meaning="roll and pitch of the reference's root", unit="rad", frame="world, intrinsic z-y-x", size=2, reflection="turns",
    ),
    "reference_yaw_rate": ObservationTerm(
        meaning="angular velocity of the reference's root about its z, and what is missing in heading times a gain",
        unit="rad/s", frame="reference root body", size=1, reflection="odd",
    ),
    "reference_anchor_quat_xyzw": ObservationTerm(
        meaning="orientation of the reference's anchor, turned to the robot's heading", unit="", frame="world", size=4,
        reflection="quat_xyzw",
    ),
    "anchor_orientation": ObservationTerm(
        meaning="where the reference's anchor is turned to", unit="", size=6,
        frame="robot anchor: first two columns of the reference anchor", aliases=("motion_anchor_ori_b",), reflection="columns",
    ),
    "anchor_position": ObservationTerm(
        meaning="where the reference's anchor is", unit="m", frame="robot anchor", size=3, measurable=False,
        aliases=("motion_anchor_pos_b",), reflection="polar",
    ),
    "last_action": ObservationTerm(
        meaning="the policy's last output", unit="", frame="joint", per_joint=1, aliases=("actions", "last_action"),
    ),
    "gyro": ObservationTerm(
        meaning="angular velocity of the root", unit="rad/s", frame="root body", size=3, aliases=("base_ang_vel",),
        reflection="axial",
    ),
    "roll_pitch": ObservationTerm(
        meaning="roll and pitch of the root", unit="rad", frame="world, intrinsic z-y-x", size=2, reflection="turns",
    ),
    "anchor_quat_xyzw": ObservationTerm(
        meaning="orientation of the anchor", unit="", frame="world", size=4, reflection="quat_xyzw",
    ),
    "gravity": ObservationTerm(
        meaning="direction of gravity", unit="", frame="root body", size=3, aliases=("projected_gravity",), reflection="polar",
    ),
    "root_lin_vel": ObservationTerm(
        meaning="linear velocity of the root", unit="m/s", frame="root body", size=3, measurable=False,
        aliases=("base_lin_vel",), reflection="polar",
    ),
    "joint_pos": ObservationTerm(
        meaning="encoders", unit="rad", frame="joint, off the default pose", per_joint=1, aliases=("joint_pos", "joint_pos_rel"),
    ),
    "encoders": ObservationTerm(
        meaning="encoders, off zero", unit="rad", frame="joint", per_joint=1,
    ),
    "last_target": ObservationTerm(
        meaning="the last servo targets", unit="rad", frame="joint", per_joint=1,
    ),
    "joint_vel": ObservationTerm(
        meaning="encoders' velocities", unit="rad/s", frame="joint", per_joint=1, aliases=("joint_vel", "joint_vel_rel"),
    ),
    "body_pos": ObservationTerm(
        meaning="where the tracked bodies are", unit="m", frame="robot anchor", per_body=3, measurable=False, reflection="bodies",
    ),
    "height_error": ObservationTerm(
        meaning="how far the reference's anchor is above the robot's", unit="m", frame="world, z", size=1, measurable=False,
        reflection="scalar",
    ),
    "reference_body_pos": ObservationTerm(
        meaning="where the reference's tracked bodies are", unit="m", frame="reference anchor", per_body=3, reflection="bodies",
    ),
    "reference_anchor_vel": ObservationTerm(
        meaning="linear velocity of the reference's anchor", unit="m/s", frame="reference anchor", size=3, reflection="polar",
    ),
    "reference_anchor_height": ObservationTerm(
        meaning="height of the reference's anchor", unit="m", frame="world, z", size=1, reflection="scalar",
    ),
    "phase": ObservationTerm(
        meaning="how much of the reference has passed", unit="share of the clip", frame="", size=1, measurable=False,
        reflection="scalar",
    ),
}  # fmt: skip
KIND_OF = {alias: kind for kind, term in TERMS.items() for alias in term.aliases}
"""The field's names -> ours."""


def row_of(
    kind: str,
    joints: int,
    *,
    at: int = 0,
    bodies: int = 0,
    scale: float = 1.0,
    noise: float = 0.0,
    zeroed: tuple[int, ...] = (),
) -> Row:
    """A row of an observation table.

    Args:
        kind: key of `TERMS`.
        joints: of the policy.
        at: control periods from now, ahead in the reference, back in time (negative) in all else.
        bodies: tracked bodies.
        scale: of the numbers.
        noise: half width of the noise in training, after the scale.
        zeroed: places in it that are shown as 0.
    """
    term = TERMS[kind]
    return Row(
        kind=kind, at=at, size=term.numbers(joints, bodies), scale=scale, unit=term.unit, frame=term.frame, noise=noise,
        measurable=term.measurable, zeroed=zeroed,
    )  # fmt: skip
