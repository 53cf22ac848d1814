"""Policies that other tools trained: BeyondMimic's ONNX with its metadata, and Unitree's `deploy.yaml` beside an ONNX.

Everything that runs them is read from their own files: joint order, gains, scales, the list of observations. What those
files do not say, the effort of the motors and the way from the IMU to the anchor, is the robot's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference, make_reference
from robot_models import RobotModel
from robot_models.maths import rotation as rot
from tracking.errors import TrackingError
from tracking.policy.anchor_chain import anchor_chain
from tracking.policy.contract import FROM_DEFAULT, Contract, Row
from tracking.policy.gains import standing_gains
from tracking.policy.motion import Motion, motion_of
from tracking.policy.network import open_onnx
from tracking.policy.observation_terms import KIND_OF, row_of
from tracking.policy.runner import Runner


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
    if "joint_names" not in told or "time_step" not in {i.name for i in session.get_inputs()}:
        raise TrackingError(
            str(path), found=f"metadata {', '.join(sorted(told)) or 'none'}",
            expected="joint_names and the rest of BeyondMimic's metadata, and an input time_step",
            cure="give the folder of a bundle, or Unitree's deploy.yaml",
        )  # fmt: skip
    names, histories = _words(told, "observation_names", path), told.get("observation_history_lengths", "")
    joints = tuple(_words(told, "joint_names", path))
    lengths = _numbers(told, "observation_history_lengths", path).astype(int) if histories else np.ones(len(names), int)
    if len(lengths) != len(names) or (lengths < 1).any():
        raise TrackingError(
            f"{path}, observation_history_lengths", found=histories, expected=f"{len(names)} numbers from 1 on"
        )
    terms = {name: {"history_length": h} for name, h in zip(names, lengths, strict=True)}
    rows = _rows(terms, len(joints), str(path))
    anchor = told.get("anchor_body_name") or robot.profile.anchor
    contract = contract_for(
        robot, joints, rows, anchor, control_dt, str(path),
        default_joint_pos=_numbers(told, "default_joint_pos", path), kp=_numbers(told, "joint_stiffness", path),
        kd=_numbers(told, "joint_damping", path), action_scale=_numbers(told, "action_scale", path),
    )  # fmt: skip
    size = session.get_inputs()[0].shape[-1]
    _same_size(contract, size, str(path))
    bodies = _words(told, "body_names", path)
    if anchor not in bodies or robot.body_names[0] not in bodies:
        raise TrackingError(
            f"{path}, body_names", found=", ".join(bodies), expected=f"{robot.body_names[0]} and {anchor}"
        )
    motion = _motion_inside(session, size, told)
    root, at = bodies.index(robot.body_names[0]), bodies.index(anchor)
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
    outputs = {o.name for o in session.get_outputs()}
    if "actions" not in outputs:
        raise TrackingError(f"{path}, outputs", found=", ".join(sorted(outputs)), expected="actions")

    def policy(observation: ndarray) -> ndarray:
        steps = runner.frame.astype(np.float32)[:, None, None]
        feeds = ({"obs": o[None], "time_step": t} for o, t in zip(observation, steps, strict=True))
        return np.asarray([session.run(["actions"], feed)[0][0] for feed in feeds], dtype=np.float64)

    runner = Runner(contract, policy, tables)
    return runner, _reference(robot, contract, tables, str(path))


def _in_root(velocity: ndarray, motion: Mapping[str, ndarray], root: int) -> Float[ndarray, "T 3"]:
    return np.asarray(rot.rotate(rot.conjugate(motion["body_quat_w"][:, root]), velocity), dtype=float)


def read_unitree(path: Path, robot: RobotModel, reference: Reference, network: Path) -> Runner:
    """A policy with Unitree's `deploy.yaml` (unitree_rl_lab), which performs a reference that is given beside it.

    Args:
        path: the yaml.
        robot: its robot; the yaml's motor numbers are places in its joint order.
        reference: the motion. On a file of another robot or rate it is refused.
        network: the ONNX, input `obs`.

    Raises:
        TrackingError: keys or terms that are missing or unknown, or sizes that do not add up.
    """
    import yaml

    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        ids = [int(i) for i in told["joint_ids_map"]]
        action = told["actions"]["JointPositionAction"]
        dt, terms = float(told["step_dt"]), dict(told["observations"])
        kp, kd = (np.array(told[k], dtype=float) for k in ("stiffness", "damping"))
        offset, scale = (np.array(action[k], dtype=float) for k in ("offset", "scale"))
        default = np.array(told["default_joint_pos"], dtype=float)
        lengths = {len(ids), len(default), len(offset)}, {len(kp), len(kd)}
    except (OSError, KeyError, TypeError, ValueError, yaml.YAMLError) as e:
        raise TrackingError(
            str(path), found=f"{type(e).__name__}: {e}", expected="the keys of Unitree's deploy.yaml"
        ) from e
    if sorted(set(ids)) != sorted(ids) or not set(ids) <= set(range(len(robot.joint_names))):
        raise TrackingError(
            f"{path}, joint_ids_map",
            found=str(ids),
            expected=f"different motors of the {len(robot.joint_names)} of {robot.name}",
        )
    if not np.array_equal(offset, default):
        raise TrackingError(f"{path}, actions offset", found="not default_joint_pos", expected="the same")
    if lengths[0] != {len(ids)} or lengths[1] not in ({len(ids)}, {len(robot.joint_names)}):
        raise TrackingError(str(path), found="lists of different lengths", expected=f"{len(ids)} numbers in each")
    # Gains stand in the order of the motors, everything else in the policy's own.
    place = ids if len(kp) == len(robot.joint_names) else [sorted(ids).index(i) for i in ids]
    joints = tuple(robot.joint_names[i] for i in ids)
    contract = contract_for(
        robot, joints, _rows(terms, len(joints), str(path)), robot.profile.anchor, dt, str(path),
        default_joint_pos=default, kp=kp[place], kd=kd[place], action_scale=np.broadcast_to(scale, default.shape),
    )  # fmt: skip
    session = open_onnx(network)
    _same_size(contract, session.get_inputs()[0].shape[-1], str(network))
    entry, result = session.get_inputs()[0].name, session.get_outputs()[0].name

    def policy(observation: ndarray) -> ndarray:
        rows = [session.run([result], {entry: o[None]})[0][0] for o in observation]
        return np.asarray(rows, dtype=np.float64)

    return Runner(contract, policy, motion_of(reordered(reference, joints), contract))


def contract_for(
    robot: RobotModel,
    joints: tuple[str, ...],
    rows: tuple[Row, ...],
    anchor: str,
    dt: float,
    source: str,
    more: Mapping[str, Any] = MappingProxyType({}),
    **arrays: Float[ndarray, "_"],
) -> Contract:
    """The contract of a policy that another tool trained.

    Args:
        robot: its robot, which knows what the policy's files do not say: efforts, limits, the way to the anchor.
        joints: the policy's, in its order.
        rows: what it observes.
        anchor: name of the body.
        dt: control period [s].
        source: where it was read, for messages.
        more: further fields of the contract.
        arrays: gains, default pose and the like, one number per joint.
    """
    missing = sorted(set(joints) - set(robot.joint_names))
    if missing:
        raise TrackingError(
            f"{source}, joint_names", found=f"{', '.join(missing[:3])} ...", expected=f"joints of {robot.name}",
            cure="name the policy's robot", option="robot",
        )  # fmt: skip
    ids = [robot.joint(name) for name in joints]
    for name, array in arrays.items():
        if array.shape != (len(joints),):
            raise TrackingError(
                f"{source}, {name}", found=f"{array.shape[-1]} numbers", expected=f"{len(joints)}, one per joint"
            )
    reach = robot.effort[ids] / arrays["kp"]
    stand_kp, stand_kd = standing_gains(robot)
    besides = {
        "target": FROM_DEFAULT,
        "target_lower": robot.lower[ids] - reach,
        "target_upper": robot.upper[ids] + reach,
    }
    return Contract(
        robot=robot.name,
        robot_hash="",
        reference_sha256="",
        control_dt=dt,
        joint_names=joints,
        effort=robot.effort[ids],
        velocity=robot.velocity[ids],
        lower=robot.lower[ids],
        upper=robot.upper[ids],
        stand_kp=stand_kp[ids],
        stand_kd=stand_kd[ids],
        anchor=anchor,
        anchor_chain=anchor_chain(robot, anchor, joints),
        observation=rows,
        delay_trained_with_s=(0.0, 0.0),
        source=source,
        **{**besides, **arrays, **more},
    )


def _rows(terms: Mapping[str, Mapping[str, Any]], joints: int, source: str) -> tuple[Row, ...]:
    """The observation table; a term's history stands oldest first, as Isaac Lab flattens it."""
    unknown = sorted(set(terms) - set(KIND_OF))
    if unknown:
        raise TrackingError(f"{source}, observations", found=", ".join(unknown), expected=f"of {', '.join(KIND_OF)}")
    rows = []
    for name, told in terms.items():
        scale = np.unique(np.array(told.get("scale") or 1.0, dtype=float))
        if len(scale) > 1:
            raise TrackingError(f"{source}, {name}", found="a scale of several numbers", expected="one number")
        if told.get("clip") is not None:
            raise TrackingError(f"{source}, {name}", found=f"clip {told['clip']}", expected="none")
        rows += [
            row_of(KIND_OF[name], joints, at=-back, scale=float(scale[0]))
            for back in reversed(range(int(told.get("history_length") or 1)))
        ]
    return tuple(rows)


def _same_size(contract: Contract, size: object, source: str) -> None:
    if size != contract.observation_size:
        table = ", ".join(f"{row.name} {row.size}" for row in contract.observation)
        raise TrackingError(
            f"{source}, obs", found=f"a network for {size} numbers", expected=f"{contract.observation_size}: {table}",
            cure="the list of observations is not this network's: do not run it",
        )  # fmt: skip


def _motion_inside(session: Any, size: int, told: Mapping[str, str]) -> dict[str, ndarray]:
    """The motion that the file carries: its outputs at every time step, which hold at the last."""
    names = ["joint_pos", "joint_vel", "body_pos_w", "body_quat_w"]
    blank = np.zeros((1, size), dtype=np.float32)

    def at(t: int) -> list[ndarray]:
        values = session.run(names, {"obs": blank, "time_step": np.array([[t]], dtype=np.float32)})
        return [np.asarray(v[0], dtype=float) for v in values]

    frames, last = [at(0)], at(10**6)
    total = int(float(told["total_time_steps"])) if "total_time_steps" in told else 10**6
    while len(frames) < total:
        frames.append(at(len(frames)))
        if total == 10**6 and all(np.array_equal(a, b) for a, b in zip(frames[-1], last, strict=True)):
            break
    return {name: np.stack(values) for name, values in zip(names, zip(*frames, strict=True), strict=True)}


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


def reordered(reference: Reference, joints: Sequence[str]) -> Reference:
    """The same motion with its joints in another order."""
    order = [reference.joint_names.index(name) for name in joints]
    return replace(
        reference, joint_names=tuple(joints), joint_pos=reference.joint_pos[:, order], joint_vel=reference.joint_vel[:, order],
        joint_torque=None,
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
