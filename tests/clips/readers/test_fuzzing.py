"""Files that fit a layout in form and in nothing else: every reader gives a clip or a refusal, never a traceback."""

import contextlib
import io
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from clips import ReadOptions, read_clip
from robot_models import DanceError

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "40"))
LIMITS = settings(
    max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True, database=None
)
ARRAYS = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int64, np.uint8, np.bool_, "<U5"]),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=72),
)
NUMBERS = hnp.arrays(
    np.float64,
    st.tuples(st.integers(0, 6), st.sampled_from([0, 1, 3, 4, 22, 23, 28, 29, 35, 66, 72, 156, 165])),
    elements=st.floats(allow_nan=True, allow_infinity=True, width=64),
)
VALUES = st.one_of(
    ARRAYS, NUMBERS, st.none(), st.integers(), st.floats(), st.text(max_size=9),
    st.recursive(st.integers(0, 3), lambda x: st.lists(x, max_size=3), max_leaves=6),
)  # fmt: skip
PICKLES = (
    "fps",
    "root_pos",
    "root_rot",
    "dof_pos",
    "root_trans_offset",
    "dof",
    "frames",
    "smpl_poses",
    "smpl_trans",
    "smpl_scaling",
    "root_trans",
    "root_ori",
    "smpl_params_global",
    "pred_rotmat",
    "pred_trans",
    "motion",
    "lengths",
)
ARCHIVES = (
    "fps", "joint_pos", "body_pos_w", "body_quat_w", "joint_names", "meta", "dof_positions", "body_positions", "body_rotations",
    "dof_names", "body_names", "qpos", "frequency", "split_points", "poses", "trans", "mocap_framerate", "root_orient", "pose_body",
    "betas", "posed_joints", "global_rot_mats", "joint_vel",
)  # fmt: skip
CELLS = st.one_of(st.floats(width=32).map(str), st.integers().map(str), st.text(max_size=6), st.just(""))
BVH = st.sampled_from(["ROOT", "JOINT", "End", "{", "}", "OFFSET", "CHANNELS", "3", "Xrotation"])
HEADS = st.sampled_from(
    ["left_hip_x", "left_hip_y", "left_hip_z", "dof_left_knee_link", "Frame", "time", "root_rotateX", "a", ""]
)


def tried(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    with contextlib.suppress(DanceError):
        read_clip(path, ReadOptions(fps=30.0))


@LIMITS
@given(content=st.dictionaries(st.sampled_from(PICKLES), VALUES), wrapped=st.booleans())
def test_any_pickle(tmp_path_factory, content, wrapped):
    content = {"clip": content} if wrapped else content
    tried(tmp_path_factory.getbasetemp() / "any.pkl", pickle.dumps(content))


@LIMITS
@given(content=st.dictionaries(st.sampled_from(ARCHIVES), st.one_of(ARRAYS, NUMBERS), min_size=2))
def test_any_archive(tmp_path_factory, content):
    out = io.BytesIO()
    np.savez(out, **content)
    tried(tmp_path_factory.getbasetemp() / "any.npz", out.getvalue())


@LIMITS
@given(
    head=st.lists(HEADS, max_size=12), rows=st.lists(st.lists(CELLS, max_size=12), max_size=5),
    separator=st.sampled_from([",", ";", "\t", " "]), encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "gb18030"]),
)  # fmt: skip
def test_any_table(tmp_path_factory, head, rows, separator, encoding):
    text = "\r\n".join(separator.join(row) for row in [head, *rows])
    tried(tmp_path_factory.getbasetemp() / "any.csv", text.encode(encoding, errors="replace"))


@LIMITS
@given(words=st.lists(st.one_of(CELLS, BVH)))
def test_any_hierarchy(tmp_path_factory, words):
    text = "HIERARCHY\n" + " ".join(words) + "\nMOTION\nFrames: 3\nFrame Time: 0.1\n" + "1 " * 9
    tried(tmp_path_factory.getbasetemp() / "any.bvh", text.encode("utf-8", errors="replace"))


@LIMITS
@given(
    frames=st.recursive(
        st.one_of(st.none(), st.floats(), st.text(max_size=3)), lambda x: st.lists(x, max_size=44), max_leaves=60
    )
)
def test_any_json(tmp_path_factory, frames):
    tried(tmp_path_factory.getbasetemp() / "any.txt", json.dumps({"Loop": "wrap", "Frames": frames}).encode())


@LIMITS
@given(words=st.lists(st.one_of(CELLS, st.sampled_from(["root", "lfemur", "1", "2", ":DEGREES"])), max_size=60))
def test_any_acclaim(tmp_path_factory, words):
    folder = tmp_path_factory.getbasetemp()
    (folder / "any.asf").write_text(":root\norder TX RX\naxis XYZ\n:bonedata\n:hierarchy\n", encoding="utf-8")
    tried(folder / "any.amc", (":FULLY-SPECIFIED\n:DEGREES\n" + "\n".join(words)).encode("utf-8", errors="replace"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bvh", "pkl", "npz", "csv"])
def test_coverage_guided_fuzzing_finds_nothing_in_fifteen_seconds(kind, tmp_path, groove):
    pytest.importorskip("atheris")
    from conftest import ROOT, SAMPLES

    from clips import cut, save_reference
    from clips.writers import LAYOUTS, write_motion
    from robot_models import load_robot

    seeds, found = tmp_path / "seeds", tmp_path / "found"
    seeds.mkdir(), found.mkdir()
    save_reference(groove.reference, tmp_path / "ours.npz")
    clip = cut(read_clip(tmp_path / "ours.npz"), 0.0, 0.1)
    for name, layout in LAYOUTS.items():
        if layout.suffix == f".{kind}":
            write_motion(seeds / f"{name}{layout.suffix}", name, clip, load_robot("dancer"))
    if kind == "bvh":
        (seeds / "groove.bvh").write_bytes((SAMPLES / "groove.bvh").read_bytes()[:6000])
    fuzzer = Path(__file__).with_name("fuzz_readers.py")
    done = subprocess.run(
        [sys.executable, str(fuzzer), str(found), str(seeds), "-max_total_time=15", f"-artifact_prefix={tmp_path}/"],
        capture_output=True, text=True, timeout=200, check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT), "FUZZ_SUFFIX": f".{kind}"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    assert "Done" in done.stderr
