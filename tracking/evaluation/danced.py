"""A reference that a robot has danced: possible by construction, for other trainers, and for robots of the same kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from clips import Provenance, RobotClip
from retarget import Retargeted, as_it_stands
from tracking.errors import TrackingError
from tracking.evaluation.pose_stream import stream_policy
from tracking.policy import load_bundle


def danced_reference(path: Path, robot: str | None = None, reference: Path | None = None, seed: int = 1) -> Retargeted:
    """What a policy makes of its reference on the nominal robot, leads included, as a reference of its own.

    Touches and torques are found from the motion itself. Where it drifts from its reference in the room it stays: feet
    would slide if it were brought back.

    Args:
        path: as for `load_bundle`.
        robot: as for `load_bundle`.
        reference: as for `load_bundle`.
        seed: of the sensors' noise.

    Raises:
        TrackingError: it falls on the way.
    """
    bundle = load_bundle(path, reference=reference, robot=robot)
    stream = stream_policy(path, robot, seed, reference)
    qpos = np.array([pose for pose, _ in stream.poses])
    if len(qpos) < stream.frames:
        raise TrackingError(
            f"policy {path.name}", found=f"a fall after {len(qpos) / stream.fps:.1f} of {stream.frames / stream.fps:.1f} s",
            expected="a dance without one", cure="another seed, or more training",
        )  # fmt: skip
    asked = bundle.reference
    source = asked.meta.get("source", {})
    clip = RobotClip(
        fps=stream.fps, robot=stream.robot.name, joint_names=stream.robot.joint_names,
        root_pos=qpos[:, :3], root_quat=qpos[:, 3:7], joint_pos=qpos[:, 7:],
        source=Provenance(
            file=str(source.get("file", "")), sha256=str(source.get("sha256", "")), dialect=f"danced by {path.name} in MuJoCo"
        ),
    )  # fmt: skip
    result = as_it_stands(clip, stream.robot)
    meta = {**result.reference.meta, "danced": True}
    meta["segment_names"] = asked.meta.get("segment_names", [])
    return replace(result, reference=replace(result.reference, segments=asked.segments, meta=meta))
