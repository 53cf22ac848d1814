"""A policy bundle on disk: `policy.onnx`, `contract.json` and the `reference.npz` that it performs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from clips import Reference, load_reference
from robot_models import RobotModel, load_robot
from tracking.config import TaskConfig
from tracking.contract import Contract, read_contract
from tracking.errors import TrackingError
from tracking.export import check_contract
from tracking.runner import Runner, motion_of, onnx_policy

POLICY, CONTRACT, REFERENCE = "policy.onnx", "contract.json", "reference.npz"
SHIPPED = Path(__file__).parent / "policies"


@dataclass(frozen=True, kw_only=True, eq=False)
class Bundle:
    """A policy with everything that it runs on, checked against each other."""

    folder: Path
    robot: RobotModel
    reference: Reference
    runner: Runner
    config: TaskConfig

    @property
    def contract(self) -> Contract:
        """What the policy was made for."""
        return self.runner.contract


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
    if not (folder / CONTRACT).exists():
        names = ", ".join(sorted(p.name for p in SHIPPED.glob("*/")))
        raise TrackingError(
            str(folder / CONTRACT),
            found="no contract",
            expected=f"a bundle folder that dance-train wrote, or one of: {names}",
        )
    path = reference or folder / REFERENCE
    contract = read_contract(folder / CONTRACT)
    model = load_robot(robot or contract.robot)
    check_contract(contract, model, hashlib.sha256(path.read_bytes()).hexdigest())
    motion = load_reference(path, model)
    policy = onnx_policy(folder / POLICY, contract.observation_size, len(contract.joint_names))
    return Bundle(
        folder=folder,
        robot=model,
        reference=motion,
        runner=Runner(contract, policy, motion_of(motion, contract)),
        config=config or TaskConfig(),
    )


def _found(folder: Path) -> Path:
    """The folder itself, or the shipped policy of that name."""
    if folder.exists() or not (SHIPPED / folder.name).is_dir():
        return folder
    return SHIPPED / folder.name
