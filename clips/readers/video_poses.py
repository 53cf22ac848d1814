"""SMPL poses as estimators write them that watch a film: GVHMR, WHAM, TRAM, 4D-Humans. None of them says its frame rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.errors import ClipError
from clips.provenance import Finding, RawFile, ReadOptions
from clips.readers import smpl
from clips.readers.one_of_several import one_of_several
from robot_models.maths import rotation as rot

_CAMERA = Finding(
    what="world", value="the camera's", why="right only of a camera that stood still; a lean of it is looked for",
    confidence="assumed", option="level",
)  # fmt: skip


def recognises(content: object) -> bool:
    """Whether unpacked content is one of theirs."""
    return _reader(content) is not None


def read(raw: RawFile, content: Mapping[Any, Any], options: ReadOptions) -> HumanClip:
    """The person, or the one who is asked for.

    Raises:
        ClipError: several people and none asked for, shapes that are none of theirs, no frame rate stated.
    """
    if options.fps is None:
        raise ClipError(
            raw.name, found="no frame rate: it is the film's", expected="a stated one", cure="state it: most films have 30",
            option="fps", suggestion="30",
        )  # fmt: skip
    reader = _reader(content)
    if reader is None:
        raise ClipError(raw.name, found="other keys", expected="results of GVHMR, WHAM, TRAM or 4D-Humans")
    try:
        return reader(raw, content, options)
    except (TypeError, ValueError, KeyError, IndexError) as e:
        raise ClipError(raw.name, found=f"values of other shapes ({e})", expected="an estimator's whole result") from e


def _reader(content: object) -> Any:
    if not isinstance(content, Mapping) or not content:
        return None
    first = next(iter(content.values()))
    if isinstance(content.get("smpl_params_global"), Mapping):
        return _gvhmr
    if {"pred_rotmat", "pred_trans"} <= set(content):
        return _tram
    if isinstance(first, Mapping) and {"pose_world", "trans_world"} <= set(first):
        return _wham
    if isinstance(first, Mapping) and {"smpl", "tid"} <= set(first):
        return _phalp
    return None


def _gvhmr(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """`hmr4d_results.pt`: a world with y up, its heading that of the first frame."""
    found = content["smpl_params_global"]
    poses = np.concatenate((_rows(found["global_orient"], 3), _rows(found["body_pose"], 63)), axis=1)
    data = {"poses": poses, "trans": _rows(found["transl"], 3)} | _betas(found)
    return smpl.read(raw, data, options, "GVHMR result")


def _wham(raw: RawFile, content: Mapping[Any, Any], options: ReadOptions) -> HumanClip:
    """`wham_output.pkl`: people by number, each with poses in a world with y up."""
    people = list(content)
    k = one_of_several(list(map(str, people)), raw, options) if len(people) > 1 else 0
    found = content[people[k]]
    data = {"poses": _rows(found["pose_world"], 72), "trans": _rows(found["trans_world"], 3)} | _betas(found)
    _check_whole(raw, found.get("frame_ids"))
    return smpl.read(raw, data, options, "WHAM result")


def _tram(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """`hps_track_N.npy`: rotation matrices and a place in the camera's frame; where the camera went stands elsewhere."""
    turns = np.asarray(content["pred_rotmat"], dtype=float)
    data = {
        "poses": _axis_angle(turns), "trans": _rows(np.asarray(content["pred_trans"], dtype=float).reshape(-1, 3), 3),
    } | _betas({"betas": content.get("pred_shape")})  # fmt: skip
    _check_whole(raw, content.get("frame"))
    return smpl.read(raw, data, options, "TRAM track", [_CAMERA])


def _phalp(raw: RawFile, content: Mapping[str, Any], options: ReadOptions) -> HumanClip:
    """4D-Humans' `demo_*.pkl`: per image the people in it, with no place in a world."""
    if options.travel is None:
        raise ClipError(
            raw.name, found="4D-Humans' people, who have no place in a world", expected="the way that their feet make",
            cure="make it so", option="travel", suggestion="from-feet",
        )  # fmt: skip
    images = sorted(content)
    people = sorted({int(t) for image in images for t in content[image]["tid"]})
    k = one_of_several(list(map(str, people)), raw, options) if len(people) > 1 else 0
    seen = [(i, list(content[image]["tid"])) for i, image in enumerate(images)]
    rows = [(i, tids.index(people[k])) for i, tids in seen if people[k] in tids]
    found = [content[images[i]]["smpl"][place] for i, place in rows]
    turns = np.stack(
        [
            np.concatenate((np.reshape(f["global_orient"], (-1, 3, 3)), np.reshape(f["body_pose"], (-1, 3, 3))))
            for f in found
        ]
    )
    betas = np.stack([np.reshape(f["betas"], -1) for f in found]) if all("betas" in f for f in found) else None
    data = {"poses": _axis_angle(turns), "trans": np.zeros((len(turns), 3))} | _betas({"betas": betas})
    _check_whole(raw, [i for i, _ in rows])
    return smpl.read(raw, data, options, "4D-Humans track", [_CAMERA])


def _rows(value: Any, width: int) -> ndarray:
    array = np.asarray(value, dtype=float)
    if array.ndim != 2 or array.shape[1] != width or len(array) < MIN_FRAMES or not np.isfinite(array).all():
        raise ValueError(f"an array of shape {array.shape} where frames by {width} finite numbers are")
    return array


def _axis_angle(turns: ndarray) -> ndarray:
    """Rotation matrices of SMPL's 24 joints as axis-angle rows."""
    if turns.shape[1:] != (24, 3, 3) or not np.isfinite(turns).all():
        raise ValueError(f"rotations of shape {turns.shape} where frames by 24 matrices are")
    return rot.log(rot.from_matrix(turns)).reshape(len(turns), -1)


def _betas(found: Mapping[str, Any]) -> dict[str, ndarray]:
    betas = found.get("betas")
    return {} if betas is None else {"betas": np.asarray(betas, dtype=float)}


def _check_whole(raw: RawFile, frames: Any) -> None:
    """Refuse a track with frames missing in its middle, whose poses would leap.

    Raises:
        ClipError: it has some.
    """
    numbers = np.asarray([] if frames is None else frames).reshape(-1)
    steps = np.diff(numbers.astype(float))
    if (steps != 1.0).any():
        where = int(np.flatnonzero(steps != 1.0)[0])
        raise ClipError(
            raw.name, found=f"a person who is not seen between frames {numbers[where]} and {numbers[where + 1]} of the film",
            expected="a whole track", cure="cut the film there, or ask for another person",
        )  # fmt: skip
