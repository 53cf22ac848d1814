"""A robot's motion from any tool, judged and used as it stands: no solver touches it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clips import Clip, ClipError, MetricKey, RobotClip, full_qpos, make_reference
from clips.edit import resample
from retarget.config import RetargetConfig
from retarget.pipeline import Retargeted, finish_reference, meta_of, physics_of
from retarget.report import measure
from retarget.targets import as_figure, find_contacts, floor_parts
from robot_models import RobotModel
from robot_models.maths import one_blas_thread

_OF_A_SOURCE = {  # or of leads, and there is neither
    MetricKey.LIMB_DIRECTION_ERROR, MetricKey.AIRBORNE_SOURCE, MetricKey.AIRBORNE_OFF_SOURCE, MetricKey.HOVERING_LEADS,
}  # fmt: skip


@one_blas_thread()
def as_it_stands(clip: Clip, robot: RobotModel, config: RetargetConfig | None = None) -> Retargeted:
    """The reference that a robot's recorded motion is, at the reference's frame rate, with its report.

    Its own feet say what touches; nothing is moved, mended or led in. The report has no number against a source.

    Args:
        clip: joint-space motion of this robot.
        robot: the clip's robot.
        config: gives frame rate, contact rule and gates; whether physics is asked.

    Raises:
        ClipError: a person's motion, or another robot's.
    """
    if not isinstance(clip, RobotClip) or clip.robot != robot.name:
        whose = clip.robot if isinstance(clip, RobotClip) else "a person"
        raise ClipError(
            clip.source.file, found=f"the motion of {whose}", expected=f"joints of {robot.name}", cure="retarget it"
        )
    config = config or RetargetConfig()
    recorded = resample(clip, config.fps)
    assert isinstance(recorded, RobotClip)
    source = as_figure(recorded, robot)
    contacts = find_contacts(source, config.contact)
    bare = make_reference(
        robot, full_qpos(recorded, robot), config.fps, contact=contacts.labels,
        part_contact=floor_parts(source, 1.0, config.parts).kind,
        segments=np.array([[0, recorded.frames, 0]]), meta={"segment_names": ["dance"]},
    )  # fmt: skip
    dynamics = physics_of(bare, robot) if config.dynamics else None
    measured = measure(bare, robot, source, config.gates, dynamics)
    report = replace(measured, metrics=tuple(m for m in measured.metrics if m.key not in _OF_A_SOURCE))
    meta = meta_of([source], config, report) | {"as_it_stands": True}
    return Retargeted(
        robot=robot, reference=finish_reference(bare, meta, dynamics), report=report, sources=(source,),
        contacts=contacts, targets=None, dynamics=dynamics,
    )  # fmt: skip
