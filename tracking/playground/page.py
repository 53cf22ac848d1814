"""A policy and its robot's physics as one HTML file: it dances, it can be pushed, and it fetches nothing."""

from __future__ import annotations

import base64
import gzip
import json
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from clips import OutputError, write_whole
from robot_models import surface
from tracking.config import TaskConfig
from tracking.engines import training_model
from tracking.errors import TrackingError
from tracking.playground.model_xml import model_xml
from tracking.playground.network import layers_of
from tracking.policy import GOLDEN, POLICY, TOLERANCE, Bundle, read_golden

BUILT = Path(__file__).parent / "built"
_TABLES = ("joint_pos", "joint_vel", "anchor_quat", "root_quat", "root_pos", "root_lin_vel", "targets")  # of the motion
_SENSED = ("gyro", "joint_pos", "joint_vel")  # what the page remembers
_KINDS = (
    "reference_joint_pos", "reference_joint_vel", "reference_planar_velocity", "reference_root_height", "anchor_orientation",
    "last_action", *_SENSED,
)  # fmt: skip


def save_playground(path: Path, bundle: Bundle, title: str) -> None:
    """Write the page of a policy.

    Args:
        path: the file; whole or absent.
        bundle: the policy with its robot and reference.
        title: stands over it.

    Raises:
        OutputError: the parts of the page are not built, or the file cannot be written.
        TrackingError: a policy that a page cannot compute.
    """
    script, physics = (_built(name) for name in ("playground.js", "mujoco.wasm.gz"))
    data = gzip.compress(json.dumps(_told(bundle), default=_packed).encode(), 9, mtime=0)
    page = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
    source = bundle.reference.meta.get("source", {}).get("file", "") or "a reference"
    parts = {
        "TITLE": escape(title),
        "SUBTITLE": escape(f"{source} on {bundle.robot.name}, {bundle.reference.duration_s:.1f} s"),
        "DANCE": base64.b64encode(data).decode(),
        "WASM": base64.b64encode(physics).decode(),
        "SCRIPT": script.decode().replace("</script", "<\\/script"),
    }
    for name, text in parts.items():
        page = page.replace(f"%{name}%", text)
    with write_whole(path) as stream:
        stream.write(page.encode())


def _built(name: str) -> bytes:
    try:
        return (BUILT / name).read_bytes()
    except OSError as e:
        raise OutputError(
            "page", found=f"no {name}, which is built from JavaScript and comes with the wheel", expected="it built",
            cure="make web (Node.js 20 or later)",
        ) from e  # fmt: skip


def _told(bundle: Bundle) -> dict[str, Any]:
    """Everything that the page computes with."""
    contract, motion, robot, reference = bundle.contract, bundle.runner.motion, bundle.robot, bundle.reference
    rows = contract.observation
    others = sorted(
        {row.kind for row in rows if row.kind not in _KINDS or row.zeroed or (row.at < 0 and row.kind not in _SENSED)}
    )
    if others or contract.position_gain > 0.0:
        raise TrackingError(
            "policy", found=f"an observation of {', '.join(others) or 'its place'}",
            expected=f"{', '.join(_KINDS)}, and of the past {', '.join(_SENSED)}",
            cure="show it with dance-view, where Python computes it",
        )  # fmt: skip
    task = TaskConfig()
    model = training_model(robot, task.physics_dt)
    order = [robot.joint(name) for name in contract.joint_names]
    tables = {name: getattr(motion, name) for name in _TABLES}
    places = {name: model.body(name).id for name in robot.body_names}
    golden = bundle.folder / GOLDEN
    return {
        "contract": {
            **{name: getattr(contract, name) for name in ("default_joint_pos", "action_scale", "target_lower", "target_upper")},
            "anchor_chain": [_link(link, contract.joint_names) for link in contract.anchor_chain],
            "observation": [{"kind": row.kind, "at": row.at, "scale": row.scale} for row in rows],
        },
        "layers": layers_of(bundle.folder / POLICY),
        "motion": {**tables, "frames": reference.frames, "start": motion.start},
        "golden": _golden(golden) if golden.is_file() else None,
        "tolerance": TOLERANCE,
        "model_xml": model_xml(model, robot.kp, robot.kd),
        "friction": robot.profile.friction,
        "soles": [f"{side}_sole_{k}" for side, sole in robot.soles.items() for k in range(len(sole.points))],
        "qpos": reference.qpos,
        "qvel": reference.qvel,
        "order": order,
        "dt": contract.control_dt,
        "substeps": round(contract.control_dt / task.physics_dt),
        "rules": {
            "body": places[contract.anchor], "height": task.terminations.anchor_height, "tilt": task.terminations.anchor_tilt,
        },
        "surface": [
            {"body": places[p.body], "rgba": list(p.rgba), "vertices": p.vertices, "faces": p.faces} for p in surface(robot)
        ],
    }  # fmt: skip


def _link(link: Any, joints: tuple[str, ...]) -> dict[str, Any]:
    return asdict(link) | {"place": None if link.joint is None else joints.index(link.joint)}


def _golden(path: Path) -> dict[str, Any]:
    trace = vars(read_golden(path))
    return {**trace, "periods": len(trace["quat"])}


def _packed(value: object) -> Any:
    """Arrays as their bytes; what else JSON does not know, by its elements."""
    if isinstance(value, ndarray) and value.dtype.kind in "iu":
        return {"u32": base64.b64encode(value.astype("<u4").tobytes()).decode()}
    if isinstance(value, ndarray):
        return {"f32": base64.b64encode(value.astype("<f4").tobytes()).decode()}
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"no JSON for {type(value)}")
