"""DeepMimic's txt: JSON of rows with the humanoid3d skeleton, y up, quaternions wxyz.

Robot variants of the layout have other columns and are refused: nothing in them names the joints.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from clips.clip import HumanClip
from clips.edit import sample_quat
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models.maths import rotation as rot

_OFF_UNIT = (
    0.5  # of a quaternion's length: DeepMimic's own are up to 0.42 off, for they were blended; it normalises them
)
_LONGEST = 4.0  # of the shortest duration of a frame
_COLUMNS = 44  # duration, root position and quaternion, then the joints below
# name, parent, offset [m], numbers in the file: 4 a quaternion, 1 an angle about z, 0 fixed.
_LEGS_AND_ARMS = (
    ("hip", "root", (0.0, 0.0, 0.084887), 4),
    ("knee", "hip", (0.0, -0.421546, 0.0), 1),
    ("ankle", "knee", (0.0, -0.409870, 0.0), 4),
    ("shoulder", "chest", (-0.02405, 0.24350, 0.18311), 4),
    ("elbow", "shoulder", (0.0, -0.274788, 0.0), 1),
)
_SKELETON = (
    ("root", "", (0.0, 0.0, 0.0), 4),
    ("chest", "root", (0.0, 0.236151, 0.0), 4),
    ("neck", "chest", (0.0, 0.223894, 0.0), 4),
    *(
        (f"{side}_{name}", parent if parent in ("root", "chest") else f"{side}_{parent}", (x, y, sign * z), numbers)
        for side, sign in (("right", 1.0), ("left", -1.0))
        for name, parent, (x, y, z), numbers in _LEGS_AND_ARMS
    ),
    *(
        (f"{side}_{name}", f"{side}_{parent}", offset, 0)
        for side in ("right", "left")
        for name, parent, offset in (("wrist", "elbow", (0.0, -0.258947, 0.0)), ("toe", "ankle", (0.135, -0.05, 0.0)))
    ),
    ("head", "neck", (0.0, 0.175, 0.0), 0),
)


def recognises(raw: RawFile) -> bool:
    """JSON with a list of Frames."""
    return raw.head.lstrip().startswith(b"{") and b'"Frames"' in raw.data[:100_000]


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Read a DeepMimic motion of its humanoid.

    Raises:
        ClipError: broken JSON, rows of another width, durations that differ, quaternions of another order.
    """
    try:
        rows = np.array(json.loads(raw.text())["Frames"], dtype=float)
    except (ValueError, KeyError, TypeError, RecursionError) as e:
        raise ClipError(raw.name, found=f"JSON that is no motion ({e})", expected="Frames: rows of equal length") from e
    if rows.ndim != 2 or rows.shape[1] != _COLUMNS or len(rows) < 2:
        raise ClipError(
            raw.name, found=f"rows of shape {rows.shape}", expected=f"{_COLUMNS} columns, DeepMimic's humanoid3d",
            cure="a robot's DeepMimic file does not name its joints: convert it where it was made",
        )  # fmt: skip
    if not (np.abs(rows) < 1e6).all():
        raise ClipError(raw.name, found="numbers that are not finite, or absurd", expected="metres and radians")
    steps = rows[:-1, 0]
    if not (steps > 0.0).all() or steps.max() > _LONGEST * steps.min():
        raise ClipError(
            raw.name, found=f"frames of {steps.min():.4g} to {steps.max():.4g} s", expected="durations that are alike"
        )
    step = float(np.median(steps))
    fps = 1.0 / step
    fps = float(round(fps)) if abs(fps - round(fps)) < 2e-3 * fps else fps
    names = [name for name, *_ in _SKELETON]
    positions, turns = _pose(rows, raw.name)
    told = f"column 0: {step:.6g} s per frame"
    if np.ptp(steps) > 1e-3 * step:
        told = f"column 0: {steps.min():.4g} to {steps.max():.4g} s per frame, brought to one rate"
        positions, turns = _evenly(positions, turns, steps, fps)
    return human_clip(
        raw,
        dialect="DeepMimic txt, humanoid3d",
        fps=options.fps or fps,
        names=names,
        positions=positions,
        orientations=turns,
        parents=[names.index(parent) if parent else -1 for _, parent, *_ in _SKELETON],
        options=options if options.up else replace(options, up="y"),
        findings=[
            Finding(
                what="fps", value=f"{options.fps or fps:g}", confidence="stated", option="fps",
                why="given" if options.fps else told,
            ),
            Finding(what="quaternion order", value="wxyz", why="the layout's; norms checked", confidence="stated"),
        ],
        landmarks={n: n for n in names if "_" in n} | {"pelvis": "root", "chest": "chest", "neck": "neck", "head": "head"},
    )  # fmt: skip


def _evenly(positions: np.ndarray, turns: np.ndarray, steps: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and turns of frames of unequal durations, at one rate."""
    from scipy.interpolate import CubicSpline

    times = np.concatenate(([0.0], np.cumsum(steps)))
    even = np.arange(int(times[-1] * fps + 1e-6) + 1) / fps
    there = CubicSpline(times, positions, axis=0, bc_type="natural")(np.minimum(even, times[-1]))
    return np.asarray(there), sample_quat(turns, np.interp(even, times, np.arange(len(times))))


def _pose(rows: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray]:
    names, at = [name for name, *_ in _SKELETON], 4
    positions, turns = np.zeros((len(rows), len(names), 3)), np.tile(rot.IDENTITY, (len(rows), len(names), 1))
    for i, (name, parent, offset, numbers) in enumerate(_SKELETON):
        local = np.broadcast_to(rot.IDENTITY, (len(rows), 4))
        if numbers == 4:
            local = rows[:, at : at + 4]
            off = np.abs(np.linalg.norm(local, axis=1) - 1.0).max()
            if off > _OFF_UNIT:
                raise ClipError(
                    f"{where}, {name}", found=f"quaternions {off:.2g} off unit length", expected=f"within {_OFF_UNIT:g}"
                )
            local = rot.normalise(local)
        elif numbers == 1:
            local = rot.exp(rows[:, at : at + 1] * np.array((0.0, 0.0, 1.0)))
        at += numbers
        if not parent:
            positions[:, i], turns[:, i] = rows[:, 1:4], local
            continue
        p = names.index(parent)
        positions[:, i] = positions[:, p] + rot.rotate(turns[:, p], np.array(offset))
        turns[:, i] = rot.multiply(turns[:, p], local)
    return positions, turns
