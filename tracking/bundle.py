"""A policy bundle on disk: `policy.onnx`, `contract.json` and the `reference.npz` that it performs."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clips import Reference, load_reference
from robot_models import RobotModel, load_robot
from tracking.config import TaskConfig
from tracking.errors import TrackingError
from tracking.evaluation import Policy
from tracking.export import check_contract, onnx_policy

REFERENCE = "reference.npz"
SHIPPED = Path(__file__).parent / "policies"


@dataclass(frozen=True, kw_only=True, eq=False)
class Bundle:
    """A policy with everything that it runs on, checked against each other."""

    robot: RobotModel
    reference: Reference
    policy: Policy
    contract: dict[str, Any]
    config: TaskConfig


def load_bundle(
    folder: Path, *, reference: Path | None = None, robot: str | None = None, config: TaskConfig | None = None
) -> Bundle:
    """Read a bundle and refuse what does not belong together.

    Args:
        folder: where dance-train wrote it, or the name of a policy that comes with the package.
        reference: the reference file, where it is not the bundle's own.
        robot: path of the robot's profile, where it is not a built-in one.
        config: the task that it shall run in.

    Raises:
        TrackingError: not a bundle, or the contract was made for another robot, reference or task.
    """
    folder = _found(folder)
    config, path = config or TaskConfig(), reference or folder / REFERENCE
    contract = _contract(folder / "contract.json")
    model = load_robot(robot or load_reference(path).robot)
    check_contract(contract, model, config, hashlib.sha256(path.read_bytes()).hexdigest())
    return Bundle(
        robot=model,
        reference=load_reference(path, model),
        policy=onnx_policy(folder / "policy.onnx"),
        contract=contract,
        config=config,
    )


def _found(folder: Path) -> Path:
    """The folder itself, or the shipped policy of that name."""
    if folder.exists() or not (SHIPPED / folder.name).is_dir():
        return folder
    return SHIPPED / folder.name


def _contract(path: Path) -> dict[str, Any]:
    try:
        told: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return told
    except (OSError, ValueError) as e:
        names = ", ".join(sorted(p.name for p in SHIPPED.glob("*/")))
        raise TrackingError(
            str(path), found="no contract", expected=f"a bundle folder that dance-train wrote, or one of: {names}"
        ) from e
