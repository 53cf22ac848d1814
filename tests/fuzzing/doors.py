"""Every door of the project: a function that takes bytes from outside, and seeds that pass it."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import clips.samples
import tracking
from clips import REQUIRED, ReadOptions, cut, load_reference, make_reference, read_clip, save_reference
from clips.identify.mapping import read_mapping
from clips.writers import LAYOUTS, write_motion
from retarget.targets.edits import read_contacts, read_keys
from robot_models import load_robot, read_profile
from robot_models.model_file import open_spec
from tracking.policy import read_contract, read_golden
from tracking.policy.readers.tracker import KNOWN, _read

POLICIES = Path(tracking.__file__).parent / "policies"
SAMPLES = Path(clips.samples.__path__[0])


@dataclass(frozen=True)
class Door:
    """One way in."""

    suffix: str
    take: Callable[[Path], object]
    seeds: tuple[bytes, ...]


def _reference_seed() -> bytes:
    whole = load_reference(POLICIES / "groove-dancer" / "reference.npz")
    robot, frames = load_robot("dancer"), 6
    short = make_reference(
        robot, whole.qpos[:frames], whole.fps, contact=whole.contact[:frames], segments=np.array([[0, frames, 0]]),
        meta={"source": {"file": "x.bvh", "sha256": "0"}, "segment_names": ["dance"]},
    )  # fmt: skip
    short = replace(short, joint_torque=np.zeros_like(short.joint_pos))
    path = Path(tempfile.mkdtemp()) / "r.npz"
    save_reference(short, path)
    return path.read_bytes()


def _golden_seed() -> bytes:
    whole = read_golden(POLICIES / "groove-dancer" / "golden.npz")
    out = io.BytesIO()
    np.savez(out, **{k: v[:2] for k, v in vars(whole).items()})
    return out.getvalue()


def _motions(suffix: str) -> tuple[bytes, ...]:
    """The sample dance in every layout of a suffix."""
    robot, short = load_robot("dancer"), _short_clip()
    folder, found = Path(tempfile.mkdtemp()), []
    for name, layout in LAYOUTS.items():
        if layout.suffix == suffix:
            path = folder / f"{name}{suffix}"
            write_motion(path, name, short, robot)
            found.append(path.read_bytes())
    return tuple(found)


def _short_clip() -> object:
    path = Path(tempfile.mkdtemp()) / "r.npz"
    save_reference(load_reference(POLICIES / "groove-dancer" / "reference.npz"), path)
    return cut(read_clip(path), 1.0, 1.2)


def _bvh() -> bytes:
    """The sample's skeleton with its first three frames."""
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("Frames:"))
    return "\n".join([*lines[:at], "Frames: 3", *lines[at + 1 : at + 5]]).encode()


def _clip(path: Path) -> object:
    return read_clip(path, ReadOptions(fps=30.0))


def doors() -> dict[str, Door]:
    """All of them by name."""
    from robot_models.profile import PROFILES

    g1 = load_robot("g1")
    deploy = {
        "joint_ids_map": list(range(29)), "step_dt": 0.02, "stiffness": g1.kp.tolist(), "damping": g1.kd.tolist(),
        "default_joint_pos": g1.default_joint_pos.tolist(),
        "actions": {"JointPositionAction": {"scale": [0.25] * 29, "offset": g1.default_joint_pos.tolist()}},
        "observations": {"base_ang_vel": {"scale": 0.2, "history_length": 1}, "last_action": {"history_length": 2}},
    }  # fmt: skip
    reference, xml = _reference_seed(), (PROFILES.parent / "assets" / "dancer.xml").read_bytes()
    names = tuple(f"Point{k}" for k in range(len(REQUIRED)))
    mapping = "[landmarks]\n" + "".join(f'{x} = "{n}"\n' for x, n in zip(REQUIRED, names, strict=True))
    return {
        "reference": Door(".npz", lambda p: load_reference(p, load_robot("dancer")), (reference,)),
        "golden": Door(".npz", read_golden, (_golden_seed(),)),
        "contract": Door(".json", read_contract, ((POLICIES / "groove-dancer" / "contract.json").read_bytes(),)),
        "profile": Door(".toml", read_profile, tuple(p.read_bytes() for p in sorted(PROFILES.glob("*.toml")))),
        "model": Door(".xml", open_spec, (xml,)),
        "tracker": Door(".toml", _read, tuple(p.read_bytes() for p in sorted(KNOWN.glob("*.toml")))),
        "unitree": Door(".yaml", _unitree(), (json.dumps(deploy).encode(),)),
        "mapping": Door(".toml", lambda p: read_mapping(p, names), (mapping.encode(),)),
        "contacts": Door(".csv", read_contacts, (b"start,end,edge,kind\n0.1,0.5,left_heel,planted\n",)),
        "keys": Door(".csv", read_keys, (b"time,joint,value\n0.5,left_knee,0.3\n",)),
        "bvh": Door(".bvh", _clip, (_bvh(),)),
        "csv": Door(".csv", _clip, _motions(".csv")),
        "npz": Door(".npz", _clip, (*_motions(".npz"), reference)),
        "pkl": Door(".pkl", _clip, _motions(".pkl")),
    }  # fmt: skip


def _network(inputs: int, outputs: int) -> Path:
    """An ONNX that gives zeros."""
    import onnx
    from onnx import helper, numpy_helper

    ends = [
        helper.make_tensor_value_info(n, onnx.TensorProto.FLOAT, [1, k])
        for n, k in (("obs", inputs), ("actions", outputs))
    ]
    weights = numpy_helper.from_array(np.zeros((inputs, outputs), dtype=np.float32), "w")
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["obs", "w"], ["actions"])], "g", ends[:1], ends[1:], [weights]
    )
    path = Path(tempfile.mkdtemp()) / "policy.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), str(path))
    return path


def _unitree() -> Callable[[Path], object]:
    import tracking.policy.readers.policy_import as module

    robot, reference = load_robot("g1"), load_reference(POLICIES / "groove-g1" / "reference.npz")
    network = _network(61, 29)
    session = module.open_onnx(network)
    module.open_onnx = lambda _: session  # one network for all: it is the YAML that is damaged
    return lambda path: module.read_unitree(path, robot, reference, network)
