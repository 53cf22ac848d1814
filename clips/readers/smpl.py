"""SMPL, SMPL-H and SMPL-X poses on the mean skeleton: no body model is needed, and none is shipped.

Offsets of the mean neutral shape, from the MJCF humanoid of ZhengyiLuo/PHC. A file's `betas` are applied to a model that the
user names; without one bone proportions stay those of the mean person, and the clip's source says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.body_model import joints_at_rest
from clips.readers.rates import rate
from robot_models.maths import rotation as rot

# name, parent, offset to the parent in metres in the model's axes (x left, y up, z forward)
_JOINTS = (
    ("pelvis", -1, (-0.0018, -0.2233, 0.0282)),
    ("left_hip", 0, (0.0695, -0.0914, -0.0068)),
    ("right_hip", 0, (-0.0677, -0.0905, -0.0043)),
    ("spine1", 0, (-0.0025, 0.109, -0.0267)),
    ("left_knee", 1, (0.0343, -0.3752, -0.0045)),
    ("right_knee", 2, (-0.0383, -0.3826, -0.0089)),
    ("spine2", 3, (0.0055, 0.1352, 0.0011)),
    ("left_ankle", 4, (-0.0136, -0.398, -0.0437)),
    ("right_ankle", 5, (0.0158, -0.3984, -0.0423)),
    ("spine3", 6, (0.0015, 0.0529, 0.0254)),
    ("left_foot", 7, (0.0264, -0.0558, 0.1193)),
    ("right_foot", 8, (-0.0254, -0.0481, 0.1233)),
    ("neck", 9, (-0.0028, 0.2139, -0.0429)),
    ("left_collar", 9, (0.0788, 0.1217, -0.0341)),
    ("right_collar", 9, (-0.0818, 0.1188, -0.0386)),
    ("head", 12, (0.0052, 0.065, 0.0513)),
    ("left_shoulder", 13, (0.091, 0.0305, -0.0089)),
    ("right_shoulder", 14, (-0.096, 0.0326, -0.0091)),
    ("left_elbow", 16, (0.2596, -0.0128, -0.0275)),
    ("right_elbow", 17, (-0.2537, -0.0133, -0.0214)),
    ("left_wrist", 18, (0.2492, 0.009, -0.0012)),
    ("right_wrist", 19, (-0.2553, 0.0078, -0.0056)),
)
_MEAN = np.array([j[2] for j in _JOINTS])
_MOST_BETA = 20.0  # standard deviations of a shape; no person is beyond 5
_FAMILY = {66: "body", 72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}


def read(
    raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions, dialect: str = "", findings: Sequence[Finding] = ()
) -> HumanClip:
    """Points and orientations of 22 joints from axis-angle poses.

    Args:
        raw: the file.
        data: its arrays; `poses` (T, 66 | 72 | 156 | 165) axis-angle [rad], `trans` (T, 3) [m]; `betas` where it has them.
        options: what the user states.
        dialect: what was recognised; by default AMASS's keys.
        findings: what was decided before.

    Raises:
        ClipError: another number of pose values, or no frame rate.
    """
    poses, trans = np.asarray(data["poses"], dtype=float), np.asarray(data["trans"], dtype=float)
    if poses.ndim != 2 or poses.shape[1] not in _FAMILY or trans.shape != (len(poses), 3) or len(poses) < MIN_FRAMES:
        raise ClipError(
            f"{raw.name}, poses", found=f"shape {poses.shape} with trans {trans.shape}",
            expected="frames by 66, 72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X), and by 3",
        )  # fmt: skip
    if not np.abs(poses).max() < 4.0 * np.pi:
        raise ClipError(f"{raw.name}, poses", found=f"{np.abs(poses).max():.3g}", expected="axis-angle in radians")
    # AMASS spells the key in two ways: SMPL-H files without, SMPL-X files with the second underscore.
    fps, finding = rate(raw, data, options, "mocap_framerate", "mocap_frame_rate", "fps")
    offsets, skeleton = _offsets(raw, data, options)
    positions, orientations = _pose(rot.exp(poses[:, : 3 * len(_JOINTS)].reshape(len(poses), -1, 3)), trans, offsets)
    names = [j[0] for j in _JOINTS]
    return human_clip(
        raw,
        dialect=dialect or f"AMASS-like {_FAMILY[poses.shape[1]]} poses, {poses.shape[1]} values",
        fps=fps,
        names=names,
        positions=positions,
        orientations=orientations,
        parents=[j[1] for j in _JOINTS],
        options=options,
        findings=[finding, skeleton, *findings],
    )


def _offsets(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> tuple[Float[ndarray, "22 3"], Finding]:
    """Offsets to the parents: of the user's model with the file's betas, or of the mean skeleton."""
    if options.body_model is None:
        return _MEAN, Finding(
            what="skeleton", value="mean SMPL proportions", why="the file holds poses, not a body; betas are not applied",
            confidence="assumed", option="body_model",
        )  # fmt: skip
    betas = np.asarray(data.get("betas", np.zeros(0)), dtype=float)
    shape = np.median(betas, axis=0) if betas.ndim == 2 else betas.reshape(-1)
    if not np.isfinite(shape).all() or np.abs(shape).max(initial=0.0) > _MOST_BETA:
        raise ClipError(f"{raw.name}, betas", found=str(shape.tolist())[:60], expected=f"numbers within {_MOST_BETA:g}")
    joints = joints_at_rest(Path(options.body_model), shape)
    offsets = joints - joints[[max(j[1], 0) for j in _JOINTS]]
    offsets[0] = joints[0]
    gender = str(data["gender"]) if "gender" in data else "none"
    return offsets, Finding(
        what="skeleton", value=f"{Path(options.body_model).name} with {len(shape)} betas",
        why=f"given; the file's gender is {gender}", confidence="stated", option="body_model",
    )  # fmt: skip


def _pose(turns: ndarray, trans: ndarray, offsets: ndarray = _MEAN) -> tuple[ndarray, ndarray]:
    """World positions and orientations; the root's own offset is part of SMPL's translation."""
    positions, orientations = np.zeros((*turns.shape[:2], 3)), np.zeros(turns.shape)
    for i, (_, parent, _offset) in enumerate(_JOINTS):
        local = np.broadcast_to(offsets[i], trans.shape)
        if parent < 0:
            positions[:, i], orientations[:, i] = trans + local, turns[:, i]
        else:
            positions[:, i] = positions[:, parent] + rot.rotate(orientations[:, parent], local)
            orientations[:, i] = rot.multiply(orientations[:, parent], turns[:, i])
    return positions, orientations
