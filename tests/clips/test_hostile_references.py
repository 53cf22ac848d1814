"""References that claim what is not so: each alteration is refused with a place and a cure, or changes nothing that counts."""

import io
import json
import os
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import tracking
from clips import ReferenceFileError, load_reference
from robot_models import load_robot

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
FRAMES = 60
pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals of what the shape checker would catch before


@pytest.fixture(scope="module")
def arrays():
    """A reference of a second, as the keys of its file."""
    with np.load(FILE) as file:
        whole = {k: file[k] for k in file.files}
    robot = load_robot("dancer")
    from clips import make_reference, save_reference

    reference = load_reference(FILE)
    short = make_reference(
        robot, reference.qpos[200 : 200 + FRAMES], reference.fps, contact=reference.contact[200 : 200 + FRAMES],
        segments=np.array([[0, FRAMES, 0]]), meta={"source": {"file": "x.bvh", "sha256": "0"}, "segment_names": ["dance"]},
    )  # fmt: skip
    stream = io.BytesIO()
    path = Path(os.environ.get("TMPDIR", "/tmp")) / f"short-{os.getpid()}.npz"
    save_reference(short, path)
    stream.write(path.read_bytes())
    path.unlink()
    with np.load(io.BytesIO(stream.getvalue())) as file:
        made = {k: file[k] for k in file.files}
    made["joint_torque"] = whole["joint_torque"][200 : 200 + FRAMES]
    return made


def loaded(arrays, tmp_path, **changes):
    changed = {k: v for k, v in (arrays | changes).items() if v is not None}
    np.savez(tmp_path / "r.npz", **changed)
    return load_reference(tmp_path / "r.npz", load_robot("dancer"))


def meta(arrays, **changes):
    told = json.loads(str(arrays["meta"])) | changes
    return np.array(json.dumps({k: v for k, v in told.items() if v is not ...}))


def one(array, value, at=None):
    out = np.array(array, dtype=float)
    out.ravel()[out.size // 2 if at is None else at] = value
    return out


def turned(array):
    out = np.array(array)
    out[1::2] *= -1.0
    return out


MOTION = ("joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w", "joint_torque")


def of_rates(a):
    """Another rate, or none; velocities of another motion."""
    own = float(a["fps"][0])
    for value in (np.nan, 0.0, -50.0, np.inf, 1e300, 1e-300, 1e6, 0.98 * own, 1.02 * own, 2.0 * own, 0.5 * own):
        yield f"fps {value}", {"fps": np.array([value])}
    for value in (np.array([]), np.array(["abc"]), np.array([50.0 + 1j]), np.array([50.0, 50.0]), np.array([True])):
        yield f"fps {value!r}", {"fps": value}
    for name in ("joint_vel", "body_lin_vel_w", "body_ang_vel_w"):
        for factor in (7.0, 0.0, -1.0, -3.0, 1.01, 1e300):
            yield f"{name} x {factor}", {name: a[name] * factor}
        yield f"{name} of the frame before", {name: np.roll(a[name], 1, axis=0)}
    for factor in (-50.0, 1e9, 1e300):
        yield f"torque x {factor}", {"joint_torque": a["joint_torque"] * factor}


def of_arrays(a):
    """Numbers that are none, other kinds and shapes, keys that are missing, other conventions."""
    for name in MOTION:
        for value in (np.nan, np.inf, -np.inf, 1e300, 1e6):
            yield f"{name} {value}", {name: one(a[name], value)}
        yield f"{name} as text", {name: a[name].astype("U8")}
        yield f"{name} complex", {name: a[name].astype(complex)}
        yield f"{name} shorter", {name: a[name][:-1]}
        yield f"{name} of one body or joint less", {name: a[name][:, :-1]}
        yield f"{name} flat", {name: a[name].ravel()}
        yield f"{name} a number", {name: np.array(1.0)}
    for name in sorted(set(a) - {"joint_torque"}):
        yield f"no {name}", {name: None}
    for frames in (0, 1, 2):
        short = {k: a[k][:frames] for k in (*MOTION, "contact")}
        yield f"{frames} frames", short | {"segments": np.array([[0, max(1, frames), 0]])}
    yield "quaternions twice as long", {"body_quat_w": 2.0 * a["body_quat_w"]}
    yield "quaternions of another order", {"body_quat_w": a["body_quat_w"][..., [1, 2, 3, 0]]}
    yield "quaternions of changing sign", {"body_quat_w": turned(a["body_quat_w"])}
    yield "metres as centimetres", {"body_pos_w": 100.0 * a["body_pos_w"]}
    yield "joints in degrees", {"joint_pos": np.degrees(a["joint_pos"])}
    yield "joints exchanged", {"joint_pos": a["joint_pos"][:, ::-1]}


def of_labels(a):
    """Contacts, segments and names."""
    for value in (99, -1, 4, 127, 0.5, np.nan):
        yield f"contact {value}", {"contact": np.where(a["contact"] == 1, value, a["contact"])}
    rows = (
        [[0, 10**9, 0]],
        [[0, -1, 0]],
        [[-5, 3, 0]],
        [[5, 3, 0]],
        [[0, FRAMES, 7]],
        np.zeros((0, 3), int),
        [[0.0, 1.5, 0.0]],
    )
    yield from ((f"segments {np.asarray(r).tolist()}", {"segments": np.array(r)}) for r in rows)
    names = a["joint_names"]
    for other in (names[::-1], names[:-1], ["x"] * 28, "x", ["x" * 10**6] * 28, ["\x1b[2J", *names[1:]], np.arange(28)):
        yield f"joint_names {str(other)[:30]}", {"joint_names": np.array(other)}
    yield "contact names", {"contact_names": a["contact_names"][::-1]}


METAS = {
    "robot": (..., 5, None, "x" * 10**6, "g1", "a\x1b[2J"),
    "robot_hash": (..., 5, "0" * 64),
    "format_version": (..., 3, 0, True, "1"),
    "units": ("cm",), "quaternion_order": ("xyzw",), "world_frame": ("y up",),
    "report": ([], {"x": 5}, {"x": {}}),
    "source": ([], "x", {"file": "/dev/zero"}, {"file": "../../x"}, {"file": "x" * 5000}, {"file": 7}),
    "segment_names": (5, ["a", "b"], [["a"]], ["a\x1b[2J"]),
}  # fmt: skip


def of_metadata(a):
    """Other words and kinds of words, and what is no JSON."""
    for key, values in METAS.items():
        yield from ((f"meta {key} {str(v)[:40]}", {"meta": meta(a, **{key: v})}) for v in values)
    for text in ("", "{", "[]", "3", "null", '"x"', "[" * 100_000, '{"x":' * 100_000, "9" * 10**5):
        yield f"meta {text[:10]!r} of {len(text)}", {"meta": np.array(text)}
    yield "meta a number", {"meta": np.array(7)}


def alterations(a):
    """Name and changed keys of files that nobody should train on or send to a robot."""
    for group in (of_rates, of_arrays, of_labels, of_metadata):
        yield from group(a)


def test_no_alteration_gets_through(arrays, tmp_path):
    assert loaded(arrays, tmp_path).frames == FRAMES  # the control
    tried, passed, slow = 0, [], []
    for name, changes in alterations(arrays):
        began, tried = time.perf_counter(), tried + 1
        try:
            loaded(arrays, tmp_path, **changes)
            passed.append(name)
        except ReferenceFileError as e:
            assert e.found and e.expected, name
        slow += [name] if time.perf_counter() - began > 5.0 else []
    assert not passed and not slow and tried > 130


@pytest.mark.parametrize("how", ["pipe", "device", "folder", "npy", "text", "bomb", "header"])
def test_what_is_no_archive_neither_hangs_nor_fills_the_memory(arrays, tmp_path, how):
    path = tmp_path / "r.npz"
    if how == "pipe":
        os.mkfifo(path)
    elif how == "device":
        path.symlink_to("/dev/zero")
    elif how == "folder":
        path.mkdir()
    elif how == "npy":
        with open(path, "wb") as stream:
            np.save(stream, np.zeros(3))
    elif how == "text":
        path.write_text("hello")
    else:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            head = b"\x93NUMPY\x01\x00" + (118).to_bytes(2, "little")
            shape = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 29), }".ljust(117) + b"\n"
            archive.writestr("joint_pos.npy", head + shape)
            if how == "bomb":
                archive.writestr("x.npy", bytes(600 << 20))
    with pytest.raises(ReferenceFileError):
        load_reference(path)
