"""Points of a person without names, (T, K, 3): arrays of joints, Kimodo's archives, MDM's results, HumanML3D's features."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.identify import human_clip, point_layout
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers.one_of_several import one_of_several
from clips.readers.rates import rate
from robot_models.maths import rotation as rot

_FEATURES = {263: ("smpl22", 22, 20.0), 251: ("kit21", 21, 12.5)}  # HumanML3D, KIT-ML: joints and frames per second


def read(
    raw: RawFile, points: ndarray, options: ReadOptions, *, dialect: str = "points without names",
    fps: tuple[float, Finding] | None = None, orientations: ndarray | None = None, known: Sequence[str] = (),
    names: Sequence[str] = (), findings: Sequence[Finding] = (),
) -> HumanClip:  # fmt: skip
    """A person from points.

    Args:
        raw: the file.
        points: (T, K, 3) in any unit; a leading axis of one is dropped.
        options: what the user states.
        dialect: what was recognised.
        fps: the rate and what told it; by default it must be stated.
        orientations: (T, K, 4) wxyz.
        known: the orders that this kind of file may have.
        names: of the points, where the file has them.
        findings: what was decided before.

    Raises:
        ClipError: another shape, no order that keeps the bones, no frame rate.
    """
    if points.ndim == 4 and len(points) == 1:
        points = points[0]
        orientations = orientations[0] if orientations is not None and orientations.ndim == 4 else orientations
    if points.ndim != 3 or points.shape[2] != 3 or len(points) < MIN_FRAMES or points.dtype.kind not in "fiu":
        raise ClipError(
            raw.name,
            found=f"an array of shape {points.shape}, {points.dtype}",
            expected="frames by points by 3 numbers",
        )
    with np.errstate(all="ignore"):  # a signalling NaN in float32
        points = points.astype(float)
    if not (np.abs(np.nan_to_num(points, posinf=np.inf)) < IDENTIFY.absurd).all():
        raise ClipError(raw.name, found="places that are not finite, or absurd", expected="where somebody was")
    if not np.isfinite(points).any(axis=(0, 2)).all():
        raise ClipError(raw.name, found="points without any number", expected="points that were seen")
    speed, finding = (options.fps, _given(options.fps)) if options.fps is not None else fps or (None, None)
    if speed is None or finding is None:
        raise raw.no_fps()
    layout, order = point_layout(raw, points, options, known, names)
    return human_clip(
        raw, dialect=f"{dialect}, {points.shape[1]} joints", fps=speed, names=layout.names, positions=points,
        orientations=orientations, parents=layout.parents, options=options, findings=[finding, order, *findings],
    )  # fmt: skip


def read_kimodo(raw: RawFile, data: Mapping[str, ndarray], options: ReadOptions) -> HumanClip:
    """Kimodo's `posed_joints` with `global_rot_mats`; y up, metres; names and rate where they were added.

    Raises:
        ClipError: as `read`, and rotations that are not the points'.
    """
    points, turns = data["posed_joints"], data.get("global_rot_mats")
    orientations = None
    if turns is not None:
        if turns.shape != (*points.shape, 3) or not np.isfinite(turns).all():
            raise ClipError(
                f"{raw.name}, global_rot_mats", found=f"shape {turns.shape}", expected=f"{(*points.shape, 3)}, finite"
            )
        with np.errstate(all="ignore"):  # as in `read`
            orientations = rot.normalise(rot.from_matrix(turns.astype(float)))
    fps = rate(raw, data, options, "fps", "mocap_framerate") if options.fps is not None or "fps" in data else None
    names = [str(n) for n in data.get("joint_names", np.zeros(0)).reshape(-1)]
    return read(
        raw, points, options, dialect="Kimodo motion", fps=fps, orientations=orientations,
        known=("smpl22", "soma77", "soma30"), names=names,
    )  # fmt: skip


def read_mdm(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """MDM's `results.npy`: `motion` (N, K, 3, T), of which one is asked for; HumanML3D's 20 frames per second.

    Raises:
        ClipError: as `read`; several motions, and none asked for.
    """
    motion = np.asarray(content["motion"])
    if motion.ndim != 4 or motion.shape[2] != 3 or motion.dtype.kind != "f":
        raise ClipError(f"{raw.name}, motion", found=f"shape {motion.shape}", expected="clips by joints by 3 by frames")
    texts = [str(t) for t in content.get("text", ())]
    labels = texts if len(set(texts)) == len(motion) else [f"motion {k + 1}" for k in range(len(motion))]
    k = one_of_several(labels, raw, options) if len(motion) > 1 else 0
    lengths = np.asarray(content.get("lengths", ())).reshape(-1)
    frames = int(lengths[k]) if len(lengths) == len(motion) else motion.shape[3]
    if not MIN_FRAMES <= frames <= motion.shape[3]:
        raise ClipError(f"{raw.name}, lengths", found=str(frames), expected=f"{MIN_FRAMES} to {motion.shape[3]} frames")
    _, _, fps = _FEATURES[263]
    return read(
        raw, np.moveaxis(motion[k, ..., :frames], -1, 0), options, dialect="MDM result", fps=(fps, _by_definition(fps)),
        known=("smpl22", "kit21"),
    )  # fmt: skip


def is_features(array: ndarray) -> bool:
    """Whether an array has as many columns as HumanML3D's or KIT-ML's features."""
    return array.ndim == 2 and array.shape[1] in _FEATURES and array.dtype.kind == "f"


def read_features(raw: RawFile, features: Float[ndarray, "T F"], options: ReadOptions) -> HumanClip:
    """HumanML3D's features (Guo et al. 2022), not normalised: the root's turn and steps summed up, joints beside it.

    Raises:
        ClipError: as `read`; joints whose bones change their lengths, as normalised features make.
    """
    layout, joints, fps = _FEATURES[features.shape[1]]
    values = features.astype(float)
    if not np.isfinite(values).all():
        raise ClipError(raw.name, found="features that are not finite", expected="a whole motion")
    turn = np.concatenate(([0.0], np.cumsum(values[:-1, 0])))
    # The turn is kept as that of the world against the person, and in half angles, as its authors' quaternions have it.
    facing = np.stack((np.cos(turn), 0.0 * turn, -np.sin(turn), 0.0 * turn), axis=-1)
    step = np.zeros((len(values), 3))
    step[1:, [0, 2]] = values[:-1, 1:3]
    root = np.cumsum(rot.rotate(facing, step), axis=0)
    beside = values[:, 4 : 4 + 3 * (joints - 1)].reshape(len(values), joints - 1, 3)
    points = rot.rotate(facing[:, None], beside)
    points[..., [0, 2]] += root[:, None, [0, 2]]
    root[:, 1] = values[:, 3]
    points = np.concatenate((root[:, None], points), axis=1)
    kind = "HumanML3D" if layout == "smpl22" else "KIT-ML"
    return read(raw, points, options, dialect=f"{kind} features", fps=(fps, _by_definition(fps)), known=(layout,))


def _given(fps: float) -> Finding:
    return Finding(what="fps", value=f"{fps:.6g}", why="given", confidence="stated", option="fps")


def _by_definition(fps: float) -> Finding:
    return Finding(
        what="fps", value=f"{fps:.6g}", why="the data set's, by its definition", confidence="assumed", option="fps"
    )
