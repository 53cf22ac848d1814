"""A policy of BeyondMimic's whole_body_tracking or of mjlab: one ONNX with its metadata and its motion inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference, make_reference
from clips.identify import NamedMotion, in_root
from robot_models import RobotModel
from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.policy.contract import Contract
from tracking.policy.motion import Motion
from tracking.policy.network import open_onnx
from tracking.policy.readers.policy_import import check_size, contract_for, policy_rows
from tracking.policy.runner import Runner

_FEWEST_FRAMES, _MOST_FRAMES = 3, 60_000  # of the motion inside: up to twenty minutes
_FASTEST = 100.0  # joint of a motion [rad/s]: three times what motors of humanoids do


def read_beyondmimic(path: Path, robot: RobotModel, control_dt: float = 0.02) -> tuple[Runner, Reference]:
    """A policy exported by BeyondMimic's whole_body_tracking or mjlab, with the motion that it has inside.

    Args:
        path: the ONNX, inputs `obs` and `time_step`, with metadata.
        robot: its robot.
        control_dt: its control period [s]; the file does not say, and BeyondMimic's is 20 ms.

    Raises:
        TrackingError: metadata, terms or joints that are missing or unknown, or sizes that do not add up.
    """
    session = open_onnx(path)
    told = dict(session.get_modelmeta().custom_metadata_map)
    if "joint_names" not in told or {i.name for i in session.get_inputs()} != {"obs", "time_step"}:
        raise TrackingError(
            str(path), found=f"metadata {', '.join(sorted(told)) or 'none'}",
            expected="joint_names and the rest of BeyondMimic's metadata, and an input time_step",
            cure="give the folder of a bundle, or Unitree's deploy.yaml",
        )  # fmt: skip
    names, histories = _words(told, "observation_names", path), told.get("observation_history_lengths", "")
    joints = tuple(_words(told, "joint_names", path))
    lengths = _numbers(told, "observation_history_lengths", path) if histories else np.ones(len(names))
    if len(lengths) != len(names):
        raise TrackingError(
            f"{path}, observation_history_lengths", found=histories, expected=f"{len(names)} numbers from 1 on"
        )
    terms = {name: {"history_length": h} for name, h in zip(names, lengths, strict=True)}
    rows = policy_rows(terms, len(joints), str(path))
    anchor = told.get("anchor_body_name") or robot.profile.anchor
    source = f"{path}" + ("" if told.get("anchor_body_name") else f" (names no anchor_body_name; {anchor} is assumed)")
    contract = contract_for(
        robot, joints, rows, anchor, control_dt, source,
        default_joint_pos=_numbers(told, "default_joint_pos", path), kp=_numbers(told, "joint_stiffness", path),
        kd=_numbers(told, "joint_damping", path), action_scale=_numbers(told, "action_scale", path),
    )  # fmt: skip
    size = {i.name: i.shape for i in session.get_inputs()}["obs"][-1]
    check_size(contract, size, str(path))
    bodies = _words(told, "body_names", path)
    if anchor not in bodies or robot.body_names[0] not in bodies:
        raise TrackingError(
            f"{path}, body_names", found=", ".join(bodies), expected=f"{robot.body_names[0]} and {anchor}"
        )
    _check_outputs(session, len(joints), len(bodies), str(path))
    motion = _motion_inside(session, size, told, path)
    root, at = bodies.index(robot.body_names[0]), bodies.index(anchor)
    _hold_against_itself(robot, joints, bodies, motion, path)
    tables = Motion(
        joint_pos=motion["joint_pos"],
        joint_vel=motion["joint_vel"],
        root_pos=motion["body_pos_w"][:, root],
        root_quat=motion["body_quat_w"][:, root],
        anchor_pos=motion["body_pos_w"][:, at],
        anchor_quat=motion["body_quat_w"][:, at],
        targets=np.tile(contract.default_joint_pos, (len(motion["joint_pos"]), 1)),
        root_lin_vel=_in_root(rot.linear_velocity(motion["body_pos_w"][:, root], control_dt), motion, root),
        last=np.full(len(motion["joint_pos"]), len(motion["joint_pos"]) - 1),
        root_ang_vel=_in_root(rot.angular_velocity(motion["body_quat_w"][:, root], control_dt), motion, root),
    )

    def policy(observation: ndarray) -> ndarray:
        steps = runner.frame.astype(np.float32)[:, None, None]
        feeds = ({"obs": o[None], "time_step": t} for o, t in zip(observation, steps, strict=True))
        return np.asarray([session.run(["actions"], feed)[0][0] for feed in feeds], dtype=np.float64)

    runner = Runner(contract, policy, tables)
    return runner, _reference(robot, contract, tables, str(path))


def _hold_against_itself(
    robot: RobotModel, joints: Sequence[str], bodies: Sequence[str], motion: Mapping[str, ndarray], path: Path
) -> None:
    """Refuse names that the motion inside contradicts: forward kinematics of its joints has to give its bodies."""
    places = in_root(motion["body_pos_w"], motion["body_quat_w"], bodies.index(robot.body_names[0]))
    named = NamedMotion(
        robot=robot, joints=tuple(joints), joint_pos=motion["joint_pos"], bodies=tuple(bodies), places=places
    )
    wrong = named.contradiction()
    if wrong:
        expected = "joint_names and body_names in the order of the network's numbers"
        raise TrackingError(f"{path}, metadata", found=wrong[0], expected=expected, cure=wrong[1])


def _in_root(velocity: ndarray, motion: Mapping[str, ndarray], root: int) -> Float[ndarray, "T 3"]:
    return np.asarray(rot.rotate(rot.conjugate(motion["body_quat_w"][:, root]), velocity), dtype=float)


def _check_outputs(session: Any, joints: int, bodies: int, source: str) -> None:
    """Refuse a network whose outputs are not actions and the motion's tables, of so many joints and bodies."""
    wanted = {
        "actions": [joints], "joint_pos": [joints], "joint_vel": [joints], "body_pos_w": [bodies, 3], "body_quat_w": [bodies, 4]
    }  # fmt: skip
    there = {o.name: list(o.shape[1:]) for o in session.get_outputs()}
    for name, shape in wanted.items():
        if there.get(name) != shape:
            found = f"shape {there[name]}" if name in there else f"none among {', '.join(there)}"
            raise TrackingError(f"{source}, output {name}", found=found[:200], expected=f"{shape} numbers")


def _motion_inside(session: Any, size: int, told: Mapping[str, str], path: Path) -> dict[str, ndarray]:
    """The motion that the file carries: its outputs at every time step, which hold at the last."""
    names = ["joint_pos", "joint_vel", "body_pos_w", "body_quat_w"]
    blank = np.zeros((1, size), dtype=np.float32)

    def at(t: int) -> list[ndarray]:
        values = session.run(names, {"obs": blank, "time_step": np.array([[t]], dtype=np.float32)})
        return [np.asarray(v[0], dtype=float) for v in values]

    stated = _numbers(told, "total_time_steps", path) if "total_time_steps" in told else np.array([_MOST_FRAMES])
    if not (len(stated) == 1 and float(stated[0]).is_integer() and _FEWEST_FRAMES <= stated[0] <= _MOST_FRAMES):
        raise TrackingError(
            f"{path}, metadata total_time_steps", found=told["total_time_steps"][:60],
            expected=f"one whole number from {_FEWEST_FRAMES} to {_MOST_FRAMES}",
        )  # fmt: skip
    frames, last = [at(0)], at(_MOST_FRAMES)
    while len(frames) < stated[0]:
        frames.append(at(len(frames)))
        if "total_time_steps" not in told and all(np.array_equal(a, b) for a, b in zip(frames[-1], last, strict=True)):
            break
    motion = {name: np.stack(values) for name, values in zip(names, zip(*frames, strict=True), strict=True)}
    _check_motion(motion, str(path))
    return motion


def _check_motion(motion: Mapping[str, ndarray], source: str) -> None:
    """Refuse a motion that is none: not finite, no unit quaternions, velocities that are another motion's."""
    long = not all(np.isfinite(x).all() and len(x) >= _FEWEST_FRAMES for x in motion.values())
    if long or np.abs(np.linalg.norm(motion["body_quat_w"], axis=-1) - 1.0).max() > 0.01:
        raise TrackingError(
            f"{source}, motion", found="numbers that are not finite, quaternions that are none, or too few frames",
            expected="the motion that the policy performs",
        )  # fmt: skip
    fastest = np.abs(motion["joint_vel"]).max()
    if fastest > _FASTEST:
        raise TrackingError(
            f"{source}, motion joint_vel", found=f"{fastest:.3g} rad/s", expected=f"at most {_FASTEST:g}"
        )


def _reference(robot: RobotModel, contract: Contract, motion: Motion, source: str) -> Reference:
    """The motion as a reference of ours, to be judged against; joints that the policy does not know rest."""
    qpos = np.tile(robot.default_qpos, (len(motion.joint_pos), 1))
    qpos[:, :3], qpos[:, 3:7] = motion.root_pos, motion.root_quat
    qpos[:, 7 + np.array([robot.joint(name) for name in contract.joint_names])] = motion.joint_pos
    frames = len(qpos)
    return make_reference(
        robot, qpos, 1.0 / contract.control_dt, contact=np.zeros((frames, 4), dtype=int),
        segments=np.array([[0, frames, 0]]), meta={"source": {"file": source}},
    )  # fmt: skip


def _words(told: Mapping[str, str], key: str, path: Path) -> list[str]:
    if key not in told:
        raise TrackingError(f"{path}, metadata", found=f"no {key}", expected="BeyondMimic's metadata")
    return [word.strip() for word in told[key].split(",")]


def _numbers(told: Mapping[str, str], key: str, path: Path) -> Float[ndarray, "J"]:
    try:
        return np.array([float(word) for word in _words(told, key, path)])
    except ValueError as e:
        raise TrackingError(f"{path}, metadata {key}", found=str(e), expected="numbers") from e
