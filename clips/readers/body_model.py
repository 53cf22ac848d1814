"""A user's own SMPL, SMPL-H or SMPL-X model: where the joints of a body of given betas are. None is shipped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError
from clips.provenance import RawFile
from clips.readers.unpickler import load
from robot_models.incoming import MAX_UNPACKED, read_arrays, read_bytes

_BODY = 22  # joints that SMPL, SMPL-H and SMPL-X share
_NEEDED = ("J_regressor", "v_template", "shapedirs")
# What the makers' pickles hold beside arrays: chumpy's variables, which have their value in `x`, and scipy's sparse matrices.
_HELD = (("chumpy.ch", "Ch"), ("scipy.sparse.csc", "csc_matrix"), ("scipy.sparse._csc", "csc_matrix"))


def joints_at_rest(path: Path, betas: Float[ndarray, "B"]) -> Float[ndarray, "22 3"]:
    """Joints of the body of some betas in the pose of zeros [m], in the model's axes: J (v + S betas) (Loper et al. 2015).

    Args:
        path: an .npz or a .pkl with J_regressor (J, V), v_template (V, 3) and shapedirs (V, 3, S).
        betas: as many as the file has; those beyond the model's are left out.

    Raises:
        ClipError: no such model.
    """
    data = read_bytes(path, expected="a body model", error=ClipError)
    if data.startswith(b"PK\x03\x04"):
        arrays = read_arrays(data, str(path), expected="a body model", error=ClipError)
    else:
        arrays = _of_pickle(RawFile(path=path, data=data))
    missing = [key for key in _NEEDED if key not in arrays]
    if missing:
        raise ClipError(str(path), found=f"no {', '.join(missing)}", expected="an SMPL, SMPL-H or SMPL-X model")
    regressor, template, directions = (np.asarray(arrays[key], dtype=float) for key in _NEEDED)
    if not (
        regressor.ndim == 2 and len(regressor) >= _BODY and template.shape == (regressor.shape[1], 3)
        and directions.ndim == 3 and directions.shape[:2] == template.shape
    ):  # fmt: skip
        shapes = f"J_regressor {regressor.shape}, v_template {template.shape}, shapedirs {directions.shape}"
        raise ClipError(str(path), found=shapes, expected="(J, V), (V, 3) and (V, 3, S)")
    used = min(len(betas), directions.shape[2])
    return np.asarray((regressor @ (template + directions[..., :used] @ betas[:used]))[:_BODY])


def _of_pickle(raw: RawFile) -> dict[str, Any]:
    """The arrays of a model's pickle, opened without chumpy, scipy's classes or anything else that it names."""
    content = load(raw, held=_HELD)
    if not isinstance(content, dict):
        raise ClipError(raw.name, found="no dictionary", expected="a body model as its makers give it, .npz or .pkl")
    return {key: _dense(content[key], raw) for key in _NEEDED if key in content}


def _dense(value: Any, raw: RawFile) -> Any:
    """An array, the value of a variable, or a matrix of columns."""
    from scipy.sparse import csc_array

    if not isinstance(value, dict):
        return value
    if "x" in value:
        return value["x"]
    try:
        rows, columns = shape = int(value["_shape"][0]), int(value["_shape"][1])
        if rows * columns * 8 > MAX_UNPACKED:
            raise ValueError(f"a matrix of shape {shape}")
        matrix = csc_array((np.asarray(value["data"], dtype=float), value["indices"], value["indptr"]), shape=shape)
        matrix.check_format()
        return matrix.toarray()
    except (KeyError, TypeError, ValueError) as e:
        raise ClipError(raw.name, found=f"a sparse matrix that is none ({e})", expected="one of columns") from e
