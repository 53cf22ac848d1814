"""CSV of a robot's root pose and joints: Unitree's headerless rows, the original dance environment, SEED.

docs/formats.md has the three layouts side by side.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy import ndarray

from clips.clip import RobotClip
from clips.errors import ClipError
from clips.identify import NamelessMotion, choose_layout, joint_order, joints_by_name, robot_clip
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import table
from clips.readers.table import Table
from robot_models.maths import rotation as rot

_DOF = re.compile(r"^dof_(.+?)(?:\(rad\))?$|^(.+?)_dof$")


def recognises(raw: RawFile) -> bool:
    """Any other table of numbers: with a header of joints, or with none at all."""
    if not table.looks_like_table(raw):
        return False
    names = table.header(raw)
    return not names or sum(bool(_DOF.match(n)) for n in names) >= 2


def read(raw: RawFile, options: ReadOptions) -> RobotClip:
    """Read rows of a robot.

    Raises:
        ClipError: no frame rate, unknown robot or joints, undecidable quaternion order.
    """
    data = table.parse(raw)
    fps = options.fps or data.fps
    if fps is None:
        raise raw.no_fps()
    bad = np.flatnonzero(~np.isfinite(data.values).all(axis=1))
    if len(bad):
        raise ClipError(
            f"{raw.name}, data row {bad[0] + 1}",
            found=f"empty or non-finite cells in {len(bad)} rows",
            expected="numbers",
        )
    why = "given" if options.fps else data.fps_why
    findings = [Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="stated", option="fps")]
    findings += [
        Finding(what="text layout", value=n, why="seen in its lines", confidence="measured") for n in data.notes
    ]
    if not data.columns:
        return _headless(raw, data, fps, options, findings)
    return _with_header(raw, data, fps, options, findings)


def _headless(raw: RawFile, data: Table, fps: float, options: ReadOptions, findings: list[Finding]) -> RobotClip:
    """Unitree: root xyz [m], quaternion, joints [rad] in MuJoCo order."""
    motion = NamelessMotion(root_pos=data.values[:, :3], root_quat=data.values[:, 3:7], joint_pos=data.values[:, 7:])
    robot, names, finding = choose_layout(raw, motion, options)
    names, order = joint_order(raw, robot, names, motion.root_pos, motion.root_quat, motion.joint_pos, options)
    return robot_clip(
        raw,
        dialect=f"headerless robot CSV, {data.values.shape[1]} columns",
        fps=fps,
        robot=robot,
        joint_names=names,
        root_pos=data.values[:, :3],
        root_quat=data.values[:, 3:7],
        quat_order=None,
        joint_pos=data.values[:, 7:],
        options=options,
        findings=[*findings, finding, order],
        repairs=data.repairs,
    )


def _with_header(raw: RawFile, data: Table, fps: float, options: ReadOptions, findings: list[Finding]) -> RobotClip:
    columns = [(c, m.group(1) or m.group(2)) for c in data.columns if (m := _DOF.match(c))]
    if any(c.startswith("root_translate") for c in data.columns):
        return _seed(raw, data, fps, options, findings, columns)
    robot, joints = joints_by_name(raw, [n for _, n in columns], options)
    if all(n in data.columns for n in ("root_rot_w", "root_rot_x", "root_rot_y", "root_rot_z")):
        position = [c for axis in "xyz" for c in data.columns if re.fullmatch(rf"root_pos_{axis}(\(m\))?", c)]
        rotation, order, dialect = [f"root_rot_{a}" for a in "wxyz"], "wxyz", "robot CSV with named root columns"
    else:
        lead = [c for c in data.columns if not _DOF.match(c) and c.strip().lower() not in ("frame", "index", "")]
        if len(lead) != 7:
            raise ClipError(
                f"{raw.name}, header", found=f"{len(lead)} columns beside the joints ({', '.join(lead)})",
                expected="7: x, y, z [m] and the quaternion w, x, y, z of the pelvis, as they stand in MuJoCo's qpos",
            )  # fmt: skip
        position, rotation, order, dialect = lead[:3], lead[3:], None, "dof_<link> CSV of the dance environment"
    return robot_clip(
        raw,
        dialect=dialect,
        fps=fps,
        robot=robot,
        joint_names=joints,
        root_pos=_columns(data, position),
        root_quat=_columns(data, rotation),
        quat_order=order,
        joint_pos=_columns(data, [c for c, _ in columns]),
        options=options,
        customary_order="wxyz",
        findings=findings,
        repairs=data.repairs,
    )


def _seed(
    raw: RawFile, data: Table, fps: float, options: ReadOptions, findings: list[Finding], columns: list[tuple[str, str]]
) -> RobotClip:
    """SEED / SONIC: cm, degrees, extrinsic x-y-z Euler angles."""
    robot, joints = joints_by_name(raw, [n for _, n in columns], options)
    degrees = _columns(data, [f"root_rotate{a}" for a in "XYZ"])
    # Extrinsic x, y, z is intrinsic z, y, x read backwards.
    quat = rot.from_euler(np.radians(degrees[:, ::-1]), "ZYX")
    return robot_clip(
        raw,
        dialect="SEED robot CSV",
        fps=fps,
        robot=robot,
        joint_names=joints,
        root_pos=0.01 * _columns(data, [f"root_translate{a}" for a in "XYZ"]),
        root_quat=quat,
        quat_order="wxyz",
        joint_pos=np.radians(_columns(data, [c for c, _ in columns])),
        options=options,
        findings=findings,
        repairs=data.repairs,
        conversions=["cm -> m", "degrees -> rad", "extrinsic xyz Euler -> quaternion"],
    )


def _columns(data: Table, names: Sequence[str]) -> ndarray:
    missing = [n for n in names if n not in data.columns]
    if missing:
        raise ClipError(f"{data.raw.name}, header", found=f"no column {', '.join(missing)}", expected="all of them")
    return np.stack([data.column(n) for n in names], axis=1)
