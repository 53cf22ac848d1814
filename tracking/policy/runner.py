"""Plays a policy from nothing but its bundle: sensors in, servo targets out.

No trainer and no simulator is imported: this is what stands on a robot. N robots at once, or one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.policy.contract import Contract
from tracking.policy.measurement import Measurement
from tracking.policy.motion import Motion
from tracking.policy.network import Policy


class Runner:
    """A policy on its way through a motion, for N robots side by side.

    Args:
        contract: what the policy was made for.
        policy: the network.
        motion: what it performs.
    """

    def __init__(self, contract: Contract, policy: Policy, motion: Motion) -> None:
        unknown = [row.name for row in contract.observation if row.kind not in MEASURES]
        if unknown:
            raise TrackingError(
                f"{contract.source or 'contract'}, observation", found=", ".join(unknown),
                expected=f"of {', '.join(MEASURES)}",
            )  # fmt: skip
        self.contract, self.motion = contract, motion
        self.policy = policy
        self._memory = 1 + max((-row.at for row in contract.observation), default=0)
        joints = len(contract.joint_names)
        self._chain = [
            (link, contract.joint_names.index(link.joint) if link.joint else 0) for link in contract.anchor_chain
        ]
        self.frame: Int[ndarray, "N"] = np.zeros(0, dtype=int)
        self.last_action: Float[ndarray, "N J"] = np.zeros((0, joints))
        self.seen: Float[ndarray, "N A"] = np.zeros((0, contract.observation_size))

    def start(self, measured: Measurement, frame: int | None = None) -> None:
        """Begin: at a frame of the motion, by default the dance's first; heading and place of now are the motion's."""
        n, joints = len(measured.quat), len(self.contract.joint_names)
        self.frame, self.begun = np.zeros((2, n), dtype=int)
        self.heading, self.place = np.zeros((n, 4)), np.zeros((n, 3))
        # The last ones, the newest first. Before the first there was, for all one knows, the same.
        self.measured = [measured.copy() for _ in range(self._memory)]
        self.actions = [np.zeros((n, joints)) for _ in range(self._memory)]
        self.last_action, self.last_target = np.zeros((2, n, joints))
        self.restart(np.arange(n), measured, np.full(n, self.motion.start if frame is None else frame))

    def restart(self, ids: Int[ndarray, "n"], measured: Measurement, frame: Int[ndarray, "n"]) -> None:
        """Begin anew with some of the robots, each at a frame of its own.

        Args:
            ids: which robots.
            measured: what their sensors tell.
            frame: of the motion.
        """
        m = self.motion
        self.frame[ids], self.begun[ids] = frame, frame
        self.heading[ids] = rot.from_yaw(rot.yaw(rot.multiply(measured.quat, rot.conjugate(m.root_quat[frame]))))
        place = np.zeros((len(ids), 3)) if measured.root_pos is None else measured.root_pos
        self.place[ids] = (place - rot.rotate(self.heading[ids], m.root_pos[frame])) * (1.0, 1.0, 0.0)
        for past in self.measured:
            past.put(ids, measured)
        for action in self.actions:
            action[ids] = 0.0
        self.last_action[ids], self.last_target[ids] = 0.0, measured.joint_pos

    @property
    def over(self) -> bool:
        """Whether the motion's last frame is reached."""
        return bool((self.frame >= self.motion.last[self.frame]).all())

    def act(self, measured: Measurement) -> Float[ndarray, "N J"]:
        """Servo targets [rad] for the control period that begins now; the motion goes on by one frame."""
        self.measured = [measured.copy() if self._memory > 1 else measured, *self.measured[:-1]]
        self.seen = self.observation()
        self.last_action = self.policy(self.seen)
        self.actions = [self.last_action, *self.actions[:-1]]
        self.frame = np.minimum(self.frame + 1, self.motion.last[self.frame])
        c = self.contract
        target = self.motion.targets[self.frame] + c.action_scale * self.last_action
        self.last_target = np.clip(target, c.target_lower, c.target_upper)
        return self.last_target

    def observation(self) -> Float[ndarray, "N A"]:
        """What the policy sees now, row by row of the contract's table."""
        parts = [row.scale * MEASURES[row.kind](self, row.at) for row in self.contract.observation]
        for row, part in zip(self.contract.observation, parts, strict=True):
            if part.shape[1] != row.size:
                raise TrackingError(
                    f"observation {row.name}",
                    found=f"{part.shape[1]} numbers",
                    expected=f"{row.size}, as in the contract",
                )
            part[:, list(row.zeroed)] = 0.0
        return np.concatenate(parts, axis=1).astype(np.float32)

    def ahead(self, table: Float[ndarray, "T K"], frames: int) -> Float[ndarray, "N K"]:
        """Rows of a table as they are shown some periods on, or were back; the first and the last hold beyond the ends."""
        now = np.maximum(self.frame + frames, self.begun) if frames < 0 else self.frame + frames
        return table[np.clip(now + self.contract.look_ahead, 0, self.motion.last[self.frame])]

    def planar_velocity(self, at: int) -> Float[ndarray, "N 2"]:
        """The motion's velocity in its root's frame, and what is missing in place times a gain, where the place is known."""
        velocity, now = self.ahead(self.motion.root_lin_vel, at), self.measured[-min(at, 0)]
        if self.contract.position_gain > 0.0 and now.root_pos is not None:
            frame = np.maximum(self.frame + min(at, 0), self.begun)
            missing = rot.rotate(self.heading, self.motion.root_pos[frame]) + self.place - now.root_pos
            velocity = velocity + self.contract.position_gain * rot.rotate(
                rot.conjugate(now.quat), missing * (1.0, 1.0, 0.0)
            )
        return velocity[:, :2]

    def yaw_rate(self, at: int) -> Float[ndarray, "N 1"]:
        """The motion's yaw rate in its root's frame, and what is missing in heading times a gain."""
        rate = self.ahead(self.motion.root_ang_vel, at)[:, 2:]
        frame = np.maximum(self.frame + min(at, 0), self.begun)
        wanted = rot.multiply(self.heading, self.motion.root_quat[frame])
        missing = rot.yaw(rot.multiply(wanted, rot.conjugate(self.measured[-min(at, 0)].quat)))
        return rate + self.contract.heading_gain * missing[:, None]

    def anchor(self, back: int = 0) -> tuple[Float[ndarray, "N 3"], Float[ndarray, "N 4"]]:
        """The robot's anchor: position off the root's, in world axes [m], and orientation."""
        now = self.measured[back]
        pos, quat = np.zeros((len(now.quat), 3)), now.quat
        for link, joint in self._chain:
            pos = pos + rot.rotate(quat, np.array(link.pos))
            quat = rot.multiply(quat, np.array(link.quat))
            if link.joint is not None:
                quat = rot.multiply(quat, rot.exp(now.joint_pos[:, joint, None] * np.array(link.axis)))
        return pos, quat

    def anchor_orientation(self, at: int) -> Float[ndarray, "N 6"]:
        """First two columns of robot_anchor_from_motion_anchor, row by row."""
        wanted = rot.multiply(self.heading, self.ahead(self.motion.anchor_quat, at))
        _, robot = self.anchor(-at)
        return rot.to_matrix(rot.multiply(rot.conjugate(robot), wanted))[..., :2].reshape(len(robot), 6)

    def anchor_position(self, at: int) -> Float[ndarray, "N 3"]:
        """The motion's anchor in the frame of the robot's [m]."""
        offset, quat = self.anchor(-at)
        wanted = rot.rotate(self.heading, self.ahead(self.motion.anchor_pos, at)) + self.place
        return rot.rotate(rot.conjugate(quat), wanted - _estimated(self.measured[-at].root_pos) - offset)


def _estimated(value: ndarray | None) -> ndarray:
    """What only a state estimator tells."""
    if value is None:
        raise TrackingError(
            "policy", found="an observation that no sensor measures (root position or velocity)", expected="a state estimator",
            cure="play it in simulation; on a robot it cannot run by its sensors alone",
        )  # fmt: skip
    return value


MEASURES: dict[str, Callable[[Runner, int], ndarray]] = {
    "reference_joint_pos": lambda r, at: r.ahead(r.motion.joint_pos - r.contract.default_joint_pos, at),
    "reference_joint_vel": lambda r, at: r.ahead(r.motion.joint_vel, at),
    "motion_joint_pos": lambda r, at: r.ahead(r.motion.joint_pos, at),
    "command": lambda r, at: r.ahead(np.concatenate((r.motion.joint_pos, r.motion.joint_vel), axis=1), at),
    "reference_planar_velocity": lambda r, at: r.planar_velocity(at),
    "reference_root_height": lambda r, at: r.ahead(r.motion.root_pos, at)[:, 2:],
    "reference_roll_pitch": lambda r, at: rot.roll_pitch(r.ahead(r.motion.root_quat, at)),
    "reference_yaw_rate": lambda r, at: r.yaw_rate(at),
    "reference_anchor_quat_xyzw": lambda r, at: rot.to_quat_xyzw(
        rot.multiply(r.heading, r.ahead(r.motion.anchor_quat, at))
    ),
    "anchor_quat_xyzw": lambda r, at: rot.to_quat_xyzw(r.anchor(-at)[1]),
    "roll_pitch": lambda r, at: rot.roll_pitch(r.measured[-at].quat),
    "encoders": lambda r, at: r.measured[-at].joint_pos,
    "last_target": lambda r, _: r.last_target,
    "anchor_orientation": lambda r, at: r.anchor_orientation(at),
    "anchor_position": lambda r, at: r.anchor_position(at),
    "last_action": lambda r, at: r.actions[-at],
    "gyro": lambda r, at: r.measured[-at].gyro,
    "gravity": lambda r, at: rot.rotate(rot.conjugate(r.measured[-at].quat), np.array((0.0, 0.0, -1.0))),
    "root_lin_vel": lambda r, at: _estimated(r.measured[-at].root_lin_vel),
    "joint_pos": lambda r, at: r.measured[-at].joint_pos - r.contract.default_joint_pos,
    "joint_vel": lambda r, at: r.measured[-at].joint_vel,
}
"""How each term is computed from measurements; what it means stands in `TERMS`."""
