"""Formulas that take tensors give on them what they give on arrays."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from robot_models.maths import rotation as rot
from robot_models.maths.arrays import array_namespace, to_numpy


@pytest.fixture
def values(rng):
    """Unit quaternions twice, vectors, angles; the first turn is none at all."""
    turns = rng.normal(size=(2, 40, 3))
    turns[:, 0] = 0.0
    return rot.exp(turns[0]), rot.exp(turns[1]), rng.normal(size=(40, 3)), rng.normal(size=40)


FORMULAS = {
    "multiply": lambda a, b, v, t: rot.multiply(a, b),
    "cross": lambda a, b, v, t: rot.cross(v, a[..., 1:]),
    "conjugate": lambda a, b, v, t: rot.conjugate(a),
    "rotate": lambda a, b, v, t: rot.rotate(a, v),
    "normalise": lambda a, b, v, t: rot.normalise(3.0 * a),
    "exp": lambda a, b, v, t: rot.exp(v),
    "log": lambda a, b, v, t: rot.log(a),
    "angle_between": lambda a, b, v, t: rot.angle_between(a, b),
    "to_matrix": lambda a, b, v, t: rot.to_matrix(a),
    "from_euler": lambda a, b, v, t: rot.from_euler(v, "ZYX"),
    "from_yaw": lambda a, b, v, t: rot.from_yaw(t),
    "yaw": lambda a, b, v, t: rot.yaw(a),
}


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_tensors_come_to_the_same_and_stay_tensors(values, name, precision):
    with np.errstate(all="raise"):
        on_arrays = FORMULAS[name](*values)
    tensors = [torch.asarray(v, dtype=getattr(torch, precision)) for v in values]
    on_tensors = FORMULAS[name](*tensors)
    assert on_tensors.dtype == tensors[0].dtype
    np.testing.assert_allclose(to_numpy(on_tensors), on_arrays, atol=1e-14 if precision == "float64" else 3e-6)


@pytest.mark.parametrize("name", FORMULAS)
def test_no_number_leaves_the_device(values, name):
    # Tensors without numbers: whoever looked at one in main memory would be refused.
    nothing = [torch.asarray(v, device="meta") for v in values]
    assert FORMULAS[name](*nothing).device.type == "meta"
    with pytest.raises(NotImplementedError):
        to_numpy(nothing[0])


def test_what_is_no_tensor_is_numpys():
    assert array_namespace(np.zeros(2)) is np and array_namespace(np.float64(1.0)) is np and array_namespace(1.0) is np
    assert array_namespace(torch.zeros(2)) is torch
