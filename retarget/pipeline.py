"""From a clip to a reference, stage by stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Clip, HumanClip, Reference, RobotClip, full_qpos, make_reference, resample
from clips.place import recentred
from retarget.config import RetargetConfig
from retarget.contacts import Contacts, find_contacts
from retarget.feet import lifted, raised
from retarget.ik import follow_targets, repair_feet
from retarget.report import Report, measure
from retarget.robot_source import as_figure
from retarget.segments import Padded, add_leads
from retarget.smooth import smooth, smooth_quat
from retarget.targets import Targets, make_targets
from robot_models import RobotModel

Progress = Callable[[str, int, int], None]  # stage, frames done, frames in all


@dataclass(frozen=True, kw_only=True, eq=False)
class Retargeted:
    """A reference, what was measured on it, and the stages that led to it (for the recording)."""

    robot: RobotModel
    reference: Reference
    report: Report
    source: HumanClip  # at the reference's frame rate; its frames are the reference's dance
    contacts: Contacts
    targets: Targets


def retarget(
    clip: Clip, robot: RobotModel, config: RetargetConfig | None = None, *, progress: Progress | None = None
) -> Retargeted:
    """Bring a recorded motion to a robot.

    Args:
        clip: a person's or a robot's motion.
        robot: who shall perform it.
        config: the numbers of every stage.
        progress: told as frames are done.

    Raises:
        DanceError: the clip cannot be used; a poor result is no error but stands in the report.
    """
    config = config or RetargetConfig()
    tell = progress or (lambda stage, done, total: None)
    recorded = recentred(resample(clip, config.fps))
    source = as_figure(recorded) if isinstance(recorded, RobotClip) else recorded
    contacts = find_contacts(source, config.contact)
    targets = make_targets(source, contacts, robot, config)
    prior = _prior(recorded, robot)
    followed = follow_targets(
        robot, targets, config.ik, prior=prior, progress=lambda a, b: tell("follow the targets", a, b)
    )
    padded = add_leads(robot, _smoothed(followed.qpos, config), targets.feet, config)
    repaired = repair_feet(
        robot, padded.qpos, padded.feet, config.fps, config.ik, progress=lambda a, b: tell("set the feet down", a, b)
    )
    cleared = repair_feet(
        robot, repaired.qpos, lifted(padded.feet, robot, repaired.qpos, config.fps), config.fps, config.ik,
        progress=lambda a, b: tell("clear the floor", a, b),
    )  # fmt: skip
    qpos = raised(robot, cleared.qpos, config.fps)
    unsolved = sum(len(r.unsolved) for r in (followed, repaired, cleared))
    report = measure(_reference(robot, qpos, padded, {}, config), robot, source, config.gates, unsolved=unsolved)
    meta = _meta(source, config, report)
    return Retargeted(
        robot=robot,
        reference=_reference(robot, qpos, padded, meta, config),
        report=report,
        source=source,
        contacts=contacts,
        targets=targets,
    )


def _prior(recorded: Clip, robot: RobotModel) -> Float[ndarray, "T nq"] | None:
    """The recording itself, where it was made on this very robot."""
    if isinstance(recorded, RobotClip) and recorded.robot == robot.name:
        return full_qpos(recorded, robot)
    return None


def _smoothed(qpos: Float[ndarray, "T nq"], config: RetargetConfig) -> Float[ndarray, "T nq"]:
    return np.concatenate(
        (
            smooth(qpos[:, :3], config.fps, config.smooth_hz),
            smooth_quat(qpos[:, 3:7], config.fps, config.smooth_hz),
            smooth(qpos[:, 7:], config.fps, config.smooth_hz),
        ),
        axis=1,
    )


def _reference(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], padded: Padded, meta: Mapping[str, Any], config: RetargetConfig
) -> Reference:
    return make_reference(
        robot,
        qpos,
        config.fps,
        contact=padded.feet.contact,
        segments=padded.segments,
        meta={"segment_names": list(padded.names), **meta},
    )


def _meta(source: HumanClip, config: RetargetConfig, report: Report) -> dict[str, Any]:
    """Everything a later reader may ask of the file; nothing that changes from run to run."""
    origin = source.source
    return {
        "source": {
            "file": origin.file,
            "sha256": origin.sha256,
            "dialect": origin.dialect,
            "findings": [asdict(f) for f in origin.findings],
            "conversions": list(origin.conversions),
        },
        "config": asdict(config),
        "versions": {p: version(p) for p in ("numpy", "scipy", "mujoco", "mink")},
        "report": report.as_dict(),
    }
