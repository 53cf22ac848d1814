"""A bare `.npy`: joints, features of HumanML3D, Motion-X's rows, or what numpy.save made of a dictionary (PHUMA, MDM, TRAM)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from clips.clip import Clip
from clips.config import IDENTIFY
from clips.errors import ClipError
from clips.provenance import RawFile, ReadOptions
from clips.readers import pickles, point_arrays, smpl
from clips.readers.one_of_several import refuse_another
from clips.readers.unpickler import load
from robot_models.incoming import read_array

# Motion-X's 322 columns: orientation, body, hands, jaw, expression, face, place, betas.
_MOTION_X = 322
_BODY, _PLACE, _BETAS = slice(0, 66), slice(309, 312), slice(312, 322)


def recognises(raw: RawFile) -> bool:
    """Numpy's magic bytes."""
    return raw.head.startswith(b"\x93NUMPY")


def read(raw: RawFile, options: ReadOptions) -> Clip:
    """Read an array by its shape, or a dictionary by its keys.

    Raises:
        ClipError: a broken file, or one of no known shape or keys.
    """
    array = read_array(raw.data, raw.name, expected="a whole .npy", error=ClipError)
    if array is None:
        return _of_dictionary(raw, options)
    refuse_another(raw, options)
    if array.dtype.kind == "f":
        with np.errstate(all="ignore"):  # a signalling NaN in float32
            array = array.astype(float)
        if (np.abs(array) > IDENTIFY.absurd).any():
            raise ClipError(raw.name, found="numbers that are absurd", expected="metres and radians")
    if point_arrays.is_features(array):
        return point_arrays.read_features(raw, array, options)
    if array.ndim == 2 and array.shape[1] == _MOTION_X:
        data = {"poses": array[:, _BODY], "trans": array[:, _PLACE], "betas": array[:, _BETAS]}
        return smpl.read(raw, data, options, "Motion-X, 322 values")
    if array.ndim in (3, 4):
        return point_arrays.read(raw, array, options)
    raise ClipError(
        raw.name, found=f"an array of shape {array.shape}",
        expected="frames by joints by 3, Motion-X's 322 columns, HumanML3D's 263 or KIT-ML's 251",
    )  # fmt: skip


def _of_dictionary(raw: RawFile, options: ReadOptions) -> Clip:
    content = load(RawFile(path=raw.path, data=_pickled(raw)))
    if isinstance(content, Mapping) and "motion" in content:
        return point_arrays.read_mdm(raw, content, options)
    return pickles.read_content(raw, content, options)


def _pickled(raw: RawFile) -> bytes:
    """What follows the header of an array of objects."""
    npy: Any = np.lib.format
    stream = io.BytesIO(raw.data)
    try:
        header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
        shape, _, _ = header(stream)
    except Exception as e:  # as in `read_array`
        raise ClipError(raw.name, found=f"a broken header ({e})", expected="a whole .npy") from e
    if shape not in ((), (1,)):
        raise ClipError(raw.name, found=f"an array of {shape} Python objects", expected="numbers, or one dictionary")
    return stream.read()
