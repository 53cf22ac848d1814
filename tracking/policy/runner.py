"""Plays a policy from nothing but its bundle: sensors in, servo targets out.

No trainer and no simulator is imported: this is what stands on a robot. N robots at once, or one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from clips import Reference
from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.policy.contract import FROM_REFERENCE, Contract
from tracking.policy.feed_forward import joint_targets

Policy = Callable[[Float[ndarray, "N A"]], Float[ndarray, "N J"]]
"""Observations to mean actions."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """What the sensors of N robots tell."""

    quat: Float[ndarray, "N 4"]  # of the root body, from its IMU, wxyz, heading arbitrary
    gyro: Float[ndarray, "N 3"]  # root body [rad/s]
    joint_pos: Float[ndarray, "N J"]  # encoders [rad]
    joint_vel: Float[ndarray, "N J"]  # [rad/s]
    # What no sensor tells. A simulation knows it, a robot only with a state estimator; policies of our own never ask.
    root_pos: Float[ndarray, "N 3"] | None = None  # world [m]
    root_lin_vel: Float[ndarray, "N 3"] | None = None  # root body [m/s]

    def picked(self, order: ndarray) -> Measurement:
        """The same with joints in another order, or some of them."""
        return replace(self, joint_pos=self.joint_pos[:, order], joint_vel=self.joint_vel[:, order])


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What the policy performs, by frame, joints in the policy's order."""

    joint_pos: Float[ndarray, "T J"]  # [rad]
    joint_vel: Float[ndarray, "T J"]  # [rad/s]
    root_pos: Float[ndarray, "T 3"]  # [m]
    root_quat: Float[ndarray, "T 4"]
    anchor_pos: Float[ndarray, "T 3"]  # [m]
    anchor_quat: Float[ndarray, "T 4"]
    targets: Float[ndarray, "T J"]  # of the servos, without the policy [rad]
    start: int = 0  # the dance's first frame, after the lead-in


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
        self._policy = policy
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
        n, m = len(measured.quat), self.motion
        self.frame = np.full(n, m.start if frame is None else frame)
        self.last_action = np.zeros((n, len(self.contract.joint_names)))
        self.heading = rot.from_yaw(rot.yaw(rot.multiply(measured.quat, rot.conjugate(m.root_quat[self.frame]))))
        place = np.zeros((n, 3)) if measured.root_pos is None else measured.root_pos
        self.place = (place - rot.rotate(self.heading, m.root_pos[self.frame])) * (1.0, 1.0, 0.0)
        # The last ones, the newest first. Before the first there was, for all one knows, the same.
        self.measured, self.actions = [measured] * self._memory, [self.last_action] * self._memory

    @property
    def over(self) -> bool:
        """Whether the motion's last frame is reached."""
        return bool((self.frame >= len(self.motion.joint_pos) - 1).all())

    def act(self, measured: Measurement) -> Float[ndarray, "N J"]:
        """Servo targets [rad] for the control period that begins now; the motion goes on by one frame."""
        self.measured = [measured, *self.measured[:-1]]
        self.seen = self.observation()
        self.last_action = self._policy(self.seen)
        self.actions = [self.last_action, *self.actions[:-1]]
        self.frame = np.minimum(self.frame + 1, len(self.motion.joint_pos) - 1)
        c = self.contract
        return np.clip(
            self.motion.targets[self.frame] + c.action_scale * self.last_action, c.target_lower, c.target_upper
        )

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
        return np.concatenate(parts, axis=1).astype(np.float32)

    def ahead(self, table: Float[ndarray, "T K"], frames: int) -> Float[ndarray, "N K"]:
        """Rows of a table some frames on or back; the first and the last hold beyond the ends."""
        return table[np.clip(self.frame + frames, 0, len(table) - 1)]

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


def _check_performs(reference: Reference, contract: Contract) -> None:
    for name, told, found in (
        ("joint_names", contract.joint_names, reference.joint_names),
        ("control_dt", contract.control_dt, 1.0 / reference.fps),
    ):
        if found != told:
            raise TrackingError(
                f"reference, {name}", found=str(found)[:60], expected=f"{str(told)[:60]}, as in the contract"
            )
    if contract.anchor not in reference.body_names:
        raise TrackingError("reference, body_names", found=f"no {contract.anchor}", expected="the contract's anchor")


def motion_of(reference: Reference, contract: Contract) -> Motion:
    """The tables of a reference that a policy of our own performs.

    Raises:
        TrackingError: its joints, their order or its rate are not the contract's.
    """
    _check_performs(reference, contract)
    anchor = reference.body_names.index(contract.anchor)
    at_rest = np.tile(contract.default_joint_pos, (reference.frames, 1))
    return Motion(
        joint_pos=np.asarray(reference.joint_pos, dtype=float),
        joint_vel=np.asarray(reference.joint_vel, dtype=float),
        root_pos=np.asarray(reference.body_pos_w[:, 0], dtype=float),
        root_quat=np.asarray(reference.body_quat_w[:, 0], dtype=float),
        anchor_pos=np.asarray(reference.body_pos_w[:, anchor], dtype=float),
        anchor_quat=np.asarray(reference.body_quat_w[:, anchor], dtype=float),
        targets=joint_targets(reference, contract) if contract.target == FROM_REFERENCE else at_rest,
        start=reference.dance.start,
    )


def onnx_policy(path: Path, observation: int | None = None, actions: int | None = None) -> Policy:
    """The mean action of an exported actor, by onnxruntime on one thread.

    Args:
        path: the network, input `obs`, output `actions`.
        observation: how many numbers it shall take.
        actions: how many it shall give.

    Raises:
        TrackingError: not a network, or not of these sizes.
    """
    session = open_onnx(path)
    for name, given, wanted in (
        ("observation", session.get_inputs()[0].shape[-1], observation),
        ("actions", session.get_outputs()[0].shape[-1], actions),
    ):
        if wanted is not None and given != wanted:
            raise TrackingError(f"{path}, {name}", found=f"{given} numbers", expected=f"{wanted}, as in the contract")

    def act(observation: np.ndarray) -> np.ndarray:
        return np.asarray(session.run(["actions"], {"obs": observation})[0], dtype=np.float64)

    return act


def open_onnx(path: Path) -> Any:
    """An ONNX network, on one thread.

    Raises:
        TrackingError: onnxruntime refuses it.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as e:  # onnxruntime's own exception types are not public
        raise TrackingError(
            str(path), found="a file that onnxruntime refuses", expected="policy.onnx of a bundle"
        ) from e
