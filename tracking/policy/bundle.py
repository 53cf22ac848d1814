"""A policy bundle on disk: `policy.onnx`, `contract.json` and the `reference.npz` that it performs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from clips import Reference, check_reference_against, load_reference
from robot_models import RobotModel, load_robot
from robot_models.incoming import read_bytes
from tracking.errors import TrackingError, shortened
from tracking.policy.anchor_chain import anchor_chain
from tracking.policy.contract import Contract, read_contract
from tracking.policy.gains import with_gains
from tracking.policy.motion import motion_of
from tracking.policy.network import onnx_policy
from tracking.policy.readers import is_tracker, read_tracker
from tracking.policy.runner import Runner

POLICY, CONTRACT, REFERENCE, GOLDEN = "policy.onnx", "contract.json", "reference.npz", "golden.npz"
SHIPPED = Path(__file__).parent.parent / "policies"


@dataclass(frozen=True, kw_only=True, eq=False)
class Bundle:
    """A policy with everything that it runs on, checked against each other."""

    folder: Path
    robot: RobotModel
    reference: Reference
    runner: Runner

    @property
    def contract(self) -> Contract:
        """What the policy was made for."""
        return self.runner.contract


def _no_bundle(folder: Path) -> TrackingError:
    names = ", ".join(sorted(p.name for p in SHIPPED.glob("*/")))
    found = (
        "no contract in it" if folder.is_dir() else "a file that is no policy" if folder.exists() else "no such folder"
    )
    return TrackingError(
        str(folder), found=found,
        expected=f"a bundle folder that dance-train wrote, BeyondMimic's ONNX, Unitree's deploy.yaml, or one of: {names}",
    )  # fmt: skip


def load_bundle(folder: Path | str, *, reference: Path | str | None = None, robot: str | None = None) -> Bundle:
    """Read a bundle and refuse what does not belong together.

    Args:
        folder: where dance-train wrote it, or the name of a policy that comes with the package; or another tool's
            policy: an ONNX with BeyondMimic's metadata, or Unitree's `deploy.yaml` with its ONNX beside it.
        reference: the reference file, where it is not the bundle's own.
        robot: path of the robot's profile, where it is not a built-in one.

    Raises:
        TrackingError: not a bundle, or the contract was made for another robot or reference.
    """
    folder, reference = find_policy(Path(folder)), None if reference is None else Path(reference)
    if is_tracker(folder):
        return _tracker(folder, reference, robot)
    if folder.suffix == ".onnx" or (_unitree(folder) and not (folder / CONTRACT).exists()):
        return _foreign(folder, reference, robot)
    if not (folder / CONTRACT).exists():
        raise _no_bundle(folder)
    contract = read_contract(folder / CONTRACT)
    path = _reference_of(folder, contract, reference)
    model = with_gains(load_robot(robot or contract.robot), contract)
    check_contract(contract, model, _sha256(path))
    motion = load_reference(path, model)
    policy = onnx_policy(folder / POLICY, contract.observation_size, len(contract.joint_names))
    runner = Runner(contract, policy, motion_of(motion, contract))
    return Bundle(folder=folder, robot=model, reference=motion, runner=runner)


def read_runner(folder: Path, reference: Path | None = None) -> tuple[Path, Runner]:
    """A bundle's folder and runner, from its files alone: no simulator is needed, and no robot model.

    Args:
        folder: as for `load_bundle`, a bundle of ours.
        reference: what a tracker shall follow.

    Raises:
        TrackingError: not a bundle, or its files do not belong together.
    """
    folder = find_policy(folder)
    contract = read_contract(folder / CONTRACT)
    file = _reference_of(folder, contract, reference)
    if _sha256(file) != contract.reference_sha256 and not contract.follows_any:
        raise TrackingError(str(file), found="another reference", expected="the one whose hash the contract states")
    policy = onnx_policy(folder / POLICY, contract.observation_size, len(contract.joint_names))
    return folder, Runner(contract, policy, motion_of(load_reference(file), contract))


def _reference_of(folder: Path, contract: Contract, named: Path | None) -> Path:
    if named is None and contract.follows_any:
        raise _no_reference(folder)
    return named or folder / REFERENCE


def _no_reference(tracker: Path) -> TrackingError:
    return TrackingError(
        str(tracker), found="a tracker, which follows any reference", expected="the one that it shall follow",
        cure="name it", option="ref",
    )  # fmt: skip


def _sha256(reference: Path) -> str:
    if not reference.exists():
        expected = "the one that the policy performs"
        raise TrackingError(str(reference), found="no reference", expected=expected, option="ref")
    expected = "the reference that the policy performs"
    return hashlib.sha256(read_bytes(reference, expected=expected, error=TrackingError)).hexdigest()


def _unitree(path: Path) -> Path | None:
    """Unitree's `deploy.yaml`, given itself or the folder that it lies in (`params/`, or above)."""
    candidates = (path, path / "deploy.yaml", path / "params" / "deploy.yaml")
    return next((p for p in candidates if p.suffix in (".yaml", ".yml") and p.is_file()), None)


def _foreign(path: Path, reference: Path | None, robot: str | None) -> Bundle:
    """A policy that another tool trained, on a robot with that policy's gains."""
    from tracking.policy.readers import read_beyondmimic, read_unitree

    model = load_robot(robot or "g1")
    yaml = _unitree(path)
    if yaml is None:
        runner, motion = read_beyondmimic(path, model)
    else:
        places = (yaml.parent / POLICY, yaml.parent.parent / "exported" / POLICY)
        network = next((p for p in places if p.is_file()), None)
        if network is None or reference is None:
            raise TrackingError(
                str(yaml), found="no policy.onnx beside it" if network is None else "no motion inside",
                expected=f"{places[0]} or {places[1]}" if network is None else "the reference that it shall perform",
                **({} if network is None else {"cure": "name it", "option": "ref"}),
            )  # fmt: skip
        motion = load_reference(reference, model)
        runner = read_unitree(yaml, model, motion, network)
    return Bundle(folder=path, robot=with_gains(model, runner.contract), reference=motion, runner=runner)


def _tracker(path: Path, reference: Path | None, robot: str | None) -> Bundle:
    """A policy that follows any reference, on the one that is named."""
    if reference is None:
        raise _no_reference(path)
    motion = load_reference(reference)
    model = load_robot(robot or motion.robot)
    check_reference_against(motion, model, str(reference))
    runner = read_tracker(path, model, motion)
    return Bundle(folder=path, robot=with_gains(model, runner.contract), reference=motion, runner=runner)


def find_policy(folder: Path) -> Path:
    """The folder itself, or that of the policy of this name that comes with the package."""
    if folder.exists() or not (SHIPPED / folder.name).is_dir():
        return folder
    return SHIPPED / folder.name


def check_contract(told: Contract, robot: RobotModel, reference_sha256: str) -> None:
    """Refuse to run a policy on anything but what it was trained for.

    Raises:
        TrackingError: another reference, robot, joint order or gain than the contract's.
    """
    now = {
        "reference_sha256": told.reference_sha256 if told.follows_any else reference_sha256,
        "robot_hash": robot.hash,
        "joint_names": robot.joint_names,
        "robot": robot.name,
        "effort": robot.effort,
        "velocity": robot.velocity,
        "lower": robot.lower,
        "upper": robot.upper,
        "default_joint_pos": robot.default_joint_pos,
        "anchor_chain": anchor_chain(robot, told.anchor),
    }
    for key, value in now.items():
        same = np.array_equal(getattr(told, key), value) if isinstance(value, ndarray) else getattr(told, key) == value
        if not same:
            raise TrackingError(
                f"contract, {key}", found=shortened(getattr(told, key)), expected=f"{shortened(value)}, as it is now",
                cure="use the reference and robot that the policy was trained with, or train again",
            )  # fmt: skip
