"""A user's own SMPL, SMPL-H or SMPL-X model: where the joints of a body of given betas are. None is shipped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.errors import ClipError
from robot_models.incoming import read_arrays, read_bytes

_BODY = 22  # joints that SMPL, SMPL-H and SMPL-X share
_NEEDED = ("J_regressor", "v_template", "shapedirs")


def joints_at_rest(path: Path, betas: Float[ndarray, "B"]) -> Float[ndarray, "22 3"]:
    """Joints of the body of some betas in the pose of zeros [m], in the model's axes: J (v + S betas) (Loper et al. 2015).

    Args:
        path: an .npz with J_regressor (J, V), v_template (V, 3) and shapedirs (V, 3, S).
        betas: as many as the file has; those beyond the model's are left out.

    Raises:
        ClipError: no such model.
    """
    data = read_bytes(path, expected="a body model", error=ClipError)
    if not data.startswith(b"PK\x03\x04"):
        raise ClipError(
            str(path), found="no .npz", expected="the model as its makers give it in .npz",
            cure="of a .pkl: python -c \"import numpy, pickle; m = pickle.load(open('MODEL.pkl', 'rb'), encoding='latin1'); "
            "numpy.savez('MODEL.npz', J_regressor=m['J_regressor'].toarray(), v_template=m['v_template'], "
            "shapedirs=numpy.array(m['shapedirs']))\" (it runs what stands in the file: of your own download only)",
        )  # fmt: skip
    arrays = read_arrays(data, str(path), expected="a body model", error=ClipError)
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
