"""glTF 2.0 with an animated skeleton: GLB, or JSON with its buffers inside. Metres, y up, quaternions xyzw (Khronos, glTF 2.0)."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.edit import sample_quat
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import FASTEST, SLOWEST, Finding, RawFile, ReadOptions
from clips.readers.one_of_several import one_of_several
from robot_models.incoming import parsed
from robot_models.maths import rotation as rot

_GLB = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_FLOAT = 5126
_MOST_NODES = 2000
_MOST_POSES = 8_000_000  # of a node at a frame
_DATA = "base64,"


def recognises(raw: RawFile) -> bool:
    """GLB's magic word, or JSON that names a glTF asset."""
    return raw.head.startswith(b"glTF") or (raw.head.lstrip().startswith(b"{") and b'"asset"' in raw.data[:100_000])


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Pose the skeleton of the first skin, or every node, by the animation, sampled at the rate of its keys.

    Raises:
        ClipError: a broken file, none or several animations and none asked for, keys of no even rate and none stated.
    """
    document, packed = _open(raw)
    try:
        return _read(raw, document, packed, options)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, struct.error, RecursionError) as e:
        raise ClipError(raw.name, found=f"a broken glTF ({type(e).__name__}: {e})", expected="a whole one") from e


def _read(raw: RawFile, document: Mapping[str, Any], packed: bytes, options: ReadOptions) -> HumanClip:
    nodes, animations = document.get("nodes", []), document.get("animations", [])
    if not animations or not 0 < len(nodes) <= _MOST_NODES:
        raise ClipError(
            raw.name, found=f"{len(nodes)} nodes and {len(animations)} animations", expected="an animated skeleton",
            cure="export with animations",
        )  # fmt: skip
    labels = [str(a.get("name", f"animation {k + 1}")) for k, a in enumerate(animations)]
    animation = animations[one_of_several(labels, raw, options) if len(animations) > 1 else 0]
    channels = {
        (int(c["target"]["node"]), str(c["target"]["path"])): animation["samplers"][c["sampler"]]
        for c in animation["channels"]
        if "node" in c["target"]
    }
    keys = {place: _accessor(document, packed, s["input"])[:, 0] for place, s in channels.items()}
    fps, finding = _rate(raw, list(keys.values()), options)
    start, end = min(k[0] for k in keys.values()), max(k[-1] for k in keys.values())
    count = int(np.floor((end - start) * fps + 1e-3)) + 1
    if not MIN_FRAMES <= count <= _MOST_POSES // len(nodes):
        raise ClipError(
            raw.name,
            found=f"{count} frames of {len(nodes)} nodes",
            expected=f"{MIN_FRAMES} to {_MOST_POSES // len(nodes)}",
        )
    times = start + np.arange(count) / fps
    above = {int(child): k for k, node in enumerate(nodes) for child in node.get("children", [])}
    order = _parents_first(len(nodes), above)
    positions, turns = np.zeros((count, len(nodes), 3)), np.tile(rot.IDENTITY, (count, len(nodes), 1))
    scales = np.ones((count, len(nodes), 3))
    for k in order:
        place, turn, size = _local(nodes[k], count)
        for path, value in (("translation", place), ("rotation", turn), ("scale", size)):
            if (k, path) in channels:
                value[:] = _sampled(document, packed, channels[k, path], keys[k, path], times, path)
        if k in above:
            p = above[k]
            positions[:, k] = positions[:, p] + rot.rotate(turns[:, p], scales[:, p] * place)
            turns[:, k], scales[:, k] = rot.multiply(turns[:, p], turn), scales[:, p] * size
        else:
            positions[:, k], turns[:, k], scales[:, k] = place, turn, size
    skins = document.get("skins", [])
    joints = [int(j) for j in skins[0]["joints"]] if skins else order
    names = [str(nodes[j].get("name", f"node {j}")) for j in joints]
    return human_clip(
        raw, dialect=f"glTF animation, {len(joints)} joints", fps=fps, names=names, positions=positions[:, joints],
        orientations=rot.normalise(turns[:, joints]),
        parents=[joints.index(above[j]) if above.get(j) in joints else -1 for j in joints], options=options,
        findings=[finding],
    )  # fmt: skip


def _open(raw: RawFile) -> tuple[dict[str, Any], bytes]:
    """The document, and the binary chunk of a GLB."""
    text, packed = raw.data, b""
    if raw.head.startswith(b"glTF"):
        if len(raw.data) < _GLB.size + _CHUNK.size or _GLB.unpack_from(raw.data)[2] != len(raw.data):
            raise ClipError(
                raw.name, found=f"{len(raw.data)} bytes", expected="as many as its header says", cure="copy it again"
            )
        chunks, at = dict[bytes, bytes](), _GLB.size
        while at + _CHUNK.size <= len(raw.data):
            size, kind = _CHUNK.unpack_from(raw.data, at)
            chunks[kind] = raw.data[at + _CHUNK.size : at + _CHUNK.size + size]
            at += _CHUNK.size + size
        text, packed = chunks.get(b"JSON", b""), chunks.get(b"BIN\0", b"")
    document = parsed(json.loads, text.decode(errors="replace"), raw.name, expected="glTF's JSON", error=ClipError)
    if not isinstance(document, dict):
        raise ClipError(raw.name, found="JSON of another kind", expected="a glTF document")
    return document, packed


def _accessor(document: Mapping[str, Any], packed: bytes, index: int) -> Float[ndarray, "N n"]:
    """An array of floats; sparse and interleaved ones are no exporter's for animations."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    buffer = document["buffers"][view["buffer"]]
    uri = buffer.get("uri")
    if uri is not None and _DATA not in uri:
        raise ValueError("buffers in files of their own: export it as one GLB")
    data = packed if uri is None else base64.b64decode(uri.partition(_DATA)[2], validate=True)
    width = _WIDTHS[accessor["type"]]
    if accessor["componentType"] != _FLOAT or view.get("byteStride", 4 * width) != 4 * width or "sparse" in accessor:
        raise ValueError("keys that are no plain floats")
    first = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    count = int(accessor["count"])
    if count < 1 or first < 0 or first + 4 * width * count > len(data):
        raise ValueError("keys that lie beyond the file's end")
    values = np.frombuffer(data, "<f4", count=width * count, offset=first).reshape(count, width).astype(float)
    if not np.isfinite(values).all():
        raise ValueError("keys that are not finite")
    return values


def _rate(raw: RawFile, keys: list[ndarray], options: ReadOptions) -> tuple[float, Finding]:
    """The rate at which the keys stand, where they stand evenly."""
    if options.fps is not None:
        return options.fps, Finding(
            what="fps", value=f"{options.fps:.6g}", why="given", confidence="stated", option="fps"
        )
    longest = max(keys, key=len)
    steps = np.diff(longest)
    step = float(np.median(steps)) if len(steps) else 0.0
    even = len(steps) > 1 and step > 0.0 and np.abs(steps - step).max() < 0.05 * step
    if not even or not SLOWEST <= 1.0 / step <= FASTEST:
        raise ClipError(
            raw.name, found="keys at uneven times", expected="one at every frame, or a stated rate",
            cure="bake the animation, or state the rate to sample it at", option="fps", suggestion="30",
        )  # fmt: skip
    fps = 1.0 / step
    fps = round(fps) if abs(fps - round(fps)) < 1e-3 * fps else fps
    why = f"{len(longest)} keys stand {step:.4g} s apart"
    return float(fps), Finding(what="fps", value=f"{fps:.6g}", why=why, confidence="measured", option="fps")


def _parents_first(count: int, above: Mapping[int, int]) -> list[int]:
    order, known = list[int](), set[int]()
    for k in range(count):
        chain = []
        while k not in known:
            chain.append(k)
            known.add(k)
            if k not in above:
                break
            k = above[k]
            if k in chain:
                raise ValueError("nodes that hang on themselves")
        order += reversed(chain)
    return order


def _local(node: Mapping[str, Any], count: int) -> tuple[ndarray, ndarray, ndarray]:
    """A node's own place, turn and scale, as often as there are frames."""
    if "matrix" in node:
        m = np.array(node["matrix"], dtype=float).reshape(4, 4).T
        size = np.linalg.norm(m[:3, :3], axis=0)
        place, turn = m[:3, 3], rot.from_matrix(m[:3, :3] / size)
    else:
        place = np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=float)
        turn = rot.from_quat_xyzw(np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=float))
        size = np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=float)
    return np.tile(place, (count, 1)), np.tile(rot.normalise(turn), (count, 1)), np.tile(size, (count, 1))


def _sampled(
    document: Mapping[str, Any], packed: bytes, sampler: Mapping[str, Any], keys: ndarray, times: ndarray, path: str
) -> ndarray:
    values = _accessor(document, packed, sampler["output"])
    how = sampler.get("interpolation", "LINEAR")
    if how == "CUBICSPLINE":
        values = values[1::3]  # its keys; between them a straight line, which differs where keys are far apart
    if len(values) != len(keys) or (np.diff(keys) <= 0.0).any():
        raise ValueError("as many values as keys, whose times rise, are not there")
    at = np.interp(times, keys, np.arange(len(keys)))
    at = np.floor(at + 1e-6) if how == "STEP" else at
    if path == "rotation":
        turns = rot.continuous(rot.normalise(rot.from_quat_xyzw(values)))
        return np.asarray(sample_quat(turns, at)) if len(turns) > 1 else np.repeat(turns, len(at), axis=0)
    return np.stack([np.interp(at, np.arange(len(keys)), v) for v in values.T], axis=1)
