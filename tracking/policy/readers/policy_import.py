"""Policies that other tools trained: the contract of any, and Unitree's `deploy.yaml` beside an ONNX.

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

from clips import Reference
from robot_models import RobotModel
from robot_models.incoming import MAX_CONFIG, expanded, read_text, reading
from tracking.errors import TrackingError
from tracking.policy.anchor_chain import anchor_chain
from tracking.policy.contract import FARTHEST, FROM_DEFAULT, Contract, Row
from tracking.policy.gains import standing_gains
from tracking.policy.motion import motion_of
from tracking.policy.network import open_onnx
from tracking.policy.observation_terms import KIND_OF, row_of
from tracking.policy.runner import Runner

_MOST_VALUES = 100_000  # of a file, every alias spelt out


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

    expected = "the keys of Unitree's deploy.yaml"
    text = read_text(path, expected=expected, most=MAX_CONFIG, error=TrackingError)
    with reading(str(path), expected=expected, error=TrackingError):
        try:
            told = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        except yaml.YAMLError as e:
            raise TrackingError(str(path), found=f"no YAML ({e})"[:200], expected=expected) from e
        if expanded(told) > _MOST_VALUES:
            raise TrackingError(str(path), found="aliases of aliases without end", expected="numbers spelt out")
        ids = [int(i) for i in told["joint_ids_map"]]
        action = told["actions"]["JointPositionAction"]
        dt, terms = float(told["step_dt"]), dict(told["observations"])
        kp, kd = (np.array(told[k], dtype=float) for k in ("stiffness", "damping"))
        offset, scale = (np.array(action[k], dtype=float) for k in ("offset", "scale"))
        default = np.array(told["default_joint_pos"], dtype=float)
        lengths = {len(ids), len(default), len(offset)}, {len(kp), len(kd)}
    if sorted(set(ids)) != sorted(ids) or not set(ids) <= set(range(len(robot.joint_names))):
        raise TrackingError(
            f"{path}, joint_ids_map",
            found=str(ids),
            expected=f"different motors of the {len(robot.joint_names)} of {robot.name}",
        )
    if scale.shape not in ((), (1,), default.shape):
        raise TrackingError(
            f"{path}, actions scale", found=f"shape {scale.shape}", expected=f"one number, or {default.shape}"
        )
    if not np.array_equal(offset, default):
        raise TrackingError(f"{path}, actions offset", found="not default_joint_pos", expected="the same")
    if lengths[0] != {len(ids)} or lengths[1] not in ({len(ids)}, {len(robot.joint_names)}):
        raise TrackingError(str(path), found="lists of different lengths", expected=f"{len(ids)} numbers in each")
    # Gains stand in the order of the motors, everything else in the policy's own.
    place = ids if len(kp) == len(robot.joint_names) else [sorted(ids).index(i) for i in ids]
    joints = tuple(robot.joint_names[i] for i in ids)
    contract = contract_for(
        robot, joints, policy_rows(terms, len(joints), str(path)), robot.profile.anchor, dt, str(path),
        default_joint_pos=default, kp=kp[place], kd=kd[place], action_scale=np.broadcast_to(scale, default.shape),
    )  # fmt: skip
    session = open_onnx(network)
    if len(session.get_inputs()) != 1 or len(session.get_inputs()[0].shape) != 2:
        raise TrackingError(str(network), found="other inputs than one row of numbers", expected="one input obs")
    check_size(contract, session.get_inputs()[0].shape[-1], str(network))
    if session.get_outputs()[0].shape[-1] != len(joints):
        raise TrackingError(str(network), found=f"{session.get_outputs()[0].shape} actions", expected=f"{len(joints)}")
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
    if not (arrays["kp"] > 0.0).all():
        raise TrackingError(
            f"{source}, kp", found=f"a stiffness of {arrays['kp'].min():g}", expected="stiffness above 0"
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


def policy_rows(terms: Mapping[str, Mapping[str, Any]], joints: int, source: str) -> tuple[Row, ...]:
    """The observation table; a term's history stands oldest first, as Isaac Lab flattens it."""
    unknown = sorted(set(terms) - set(KIND_OF))
    if unknown:
        raise TrackingError(f"{source}, observations", found=", ".join(unknown), expected=f"of {', '.join(KIND_OF)}")
    rows = []
    for name, told in terms.items():
        with reading(f"{source}, {name}", expected="scale, clip and history_length of a term", error=TrackingError):
            scale, length = np.unique(np.array(told.get("scale") or 1.0, dtype=float)), _history(told)
        if len(scale) > 1:
            raise TrackingError(f"{source}, {name}", found="a scale of several numbers", expected="one number")
        if told.get("clip") is not None:
            raise TrackingError(f"{source}, {name}", found=f"clip {told['clip']}", expected="none")
        rows += [row_of(KIND_OF[name], joints, at=-back, scale=float(scale[0])) for back in reversed(range(length))]
    return tuple(rows)


def _history(told: Mapping[str, Any]) -> int:
    """How many measurements of a term are shown, a whole number up to ten seconds of them."""
    length = float(told.get("history_length") or 1)
    if not (length.is_integer() and 1.0 <= length <= FARTHEST):
        raise ValueError(f"history_length {length:g}, of 1 to {FARTHEST}")
    return int(length)


def check_size(contract: Contract, size: object, source: str) -> None:
    """Refuse a network that takes another number of inputs than its list of observations has."""
    if size != contract.observation_size:
        table = ", ".join(f"{row.name} {row.size}" for row in contract.observation)
        raise TrackingError(
            f"{source}, obs", found=f"a network for {size} numbers", expected=f"{contract.observation_size}: {table}",
            cure="the list of observations is not this network's: do not run it",
        )  # fmt: skip


def reordered(reference: Reference, joints: Sequence[str]) -> Reference:
    """The same motion with its joints in another order."""
    order = [reference.joint_names.index(name) for name in joints]
    return replace(
        reference, joint_names=tuple(joints), joint_pos=reference.joint_pos[:, order], joint_vel=reference.joint_vel[:, order],
        joint_torque=None,
    )  # fmt: skip
