"""Rotation algebra on arrays: unit quaternions (w, x, y, z), rotation vectors, matrices.

Everything acts on the last axis and broadcasts over the rest. A quaternion named `a_from_b` turns the
coordinates of a vector in frame b into those in frame a, so neighbours cancel:
`a_from_c = multiply(a_from_b, b_from_c)`. Angular velocity comes from the logarithm, never from
differences of components (Sola, Deray & Atchuthan, "A micro Lie theory", 2018, section IV).

What a simulation needs at every step takes torch's tensors as well as numpy's arrays.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.maths.arrays import Array, array_namespace, room_beside

Quat = Float[ndarray, "*batch 4"]
Vec = Float[ndarray, "*batch 3"]
Mat = Float[ndarray, "*batch 3 3"]

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def multiply(a: Float[Array, "... 4"], b: Float[Array, "... 4"]) -> Float[Array, "... 4"]:
    """Hamilton product `a b`."""
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    out = room_beside(aw * bw - ax * bx - ay * by - az * bz, 4)
    out[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    out[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return out


def cross(a: Float[Array, "... 3"], b: Float[Array, "... 3"]) -> Float[Array, "... 3"]:
    """Vector product; several times faster than numpy's general one."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out = room_beside(ay * bz - az * by, 3)
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


def conjugate(q: Float[Array, "... 4"]) -> Float[Array, "... 4"]:
    """The inverse rotation of a unit quaternion."""
    out = -q
    out[..., 0] = q[..., 0]
    return out


def rotate(a_from_b: Float[Array, "... 4"], v_b: Float[Array, "... 3"]) -> Float[Array, "... 3"]:
    """Coordinates in frame a of vectors given in frame b."""
    w, u = a_from_b[..., :1], a_from_b[..., 1:]
    t = 2.0 * cross(u, v_b)
    return v_b + w * t + cross(u, t)


def normalise(q: Float[Array, "... 4"]) -> Float[Array, "... 4"]:
    """Unit quaternions; zero ones are the caller's fault and come back as NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return q / _length(q)


def exp(rotvec: Float[Array, "... 3"]) -> Float[Array, "... 4"]:
    """Quaternion of a rotation vector (axis times angle) [rad]."""
    xp, half = array_namespace(rotvec), 0.5 * _length(rotvec)
    return xp.concat((xp.cos(half), 0.5 * xp.sinc(half / np.pi) * rotvec), axis=-1)


def log(q: Float[Array, "... 4"]) -> Float[Array, "... 3"]:
    """Rotation vector of the shortest turn, length in [0, pi] [rad]."""
    xp = array_namespace(q)
    q = xp.where(q[..., :1] < 0.0, -q, q)
    sine = _length(q[..., 1:])
    angle = 2.0 * xp.atan2(sine, q[..., :1])
    tiny = sine < 1e-12
    return q[..., 1:] * xp.where(tiny, 2.0, angle / xp.where(tiny, 1.0, sine))


def angle_between(a: Float[Array, "... 4"], b: Float[Array, "... 4"]) -> Float[Array, "..."]:
    """Angle of the turn from a to b, in [0, pi] [rad]; does not care for signs."""
    xp, turn = array_namespace(a), multiply(conjugate(a), b)
    x, y, z = turn[..., 1], turn[..., 2], turn[..., 3]
    return 2.0 * xp.atan2(xp.sqrt(x * x + y * y + z * z), xp.abs(turn[..., 0]))


def _length(v: Array) -> Array:
    """Of vectors, the last axis kept; several times faster than numpy's norm on axes so short."""
    squares = v * v
    return array_namespace(v).sqrt(sum((squares[..., k : k + 1] for k in range(1, v.shape[-1])), squares[..., :1]))


def slerp(a: Float[ndarray, "... 4"], b: Float[ndarray, "... 4"], t: Float[ndarray, "..."]) -> Float[ndarray, "... 4"]:
    """Great-circle interpolation from a (t = 0) to b (t = 1) by the shorter way."""
    return multiply(a, exp(np.asarray(t)[..., None] * log(multiply(conjugate(a), b))))


def continuous(q: Float[ndarray, "T ... 4"]) -> Float[ndarray, "T ... 4"]:
    """The same rotations with signs chosen so that neighbours in time lie in one half space."""
    flips = np.where(np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.concatenate((q[:1], q[1:] * np.cumprod(flips, axis=0)), axis=0)


def mean(q: Float[ndarray, "N 4"]) -> Float[ndarray, "4"]:
    """The rotation nearest to all: top eigenvector of the sum of q q^T (Markley et al. 2007, eq. 12)."""
    return np.asarray(np.linalg.eigh(q.T @ q)[1][:, -1])


def from_matrix(m: Float[ndarray, "... 3 3"]) -> Float[ndarray, "... 4"]:
    """Quaternion of rotation matrices: the best conditioned of four formulas (Shepperd 1978)."""
    t = np.stack(
        (
            m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2],
            m[..., 0, 0] - m[..., 1, 1] - m[..., 2, 2],
            -m[..., 0, 0] + m[..., 1, 1] - m[..., 2, 2],
            -m[..., 0, 0] - m[..., 1, 1] + m[..., 2, 2],
        ),
        axis=-1,
    )
    yz, zx, xy = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    zy, xz, yx = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    w, x, y, z = np.moveaxis(1.0 + t, -1, 0)
    rows = np.stack(
        (
            np.stack((w, yz - zy, zx - xz, xy - yx), axis=-1),
            np.stack((yz - zy, x, xy + yx, zx + xz), axis=-1),
            np.stack((zx - xz, xy + yx, y, yz + zy), axis=-1),
            np.stack((xy - yx, zx + xz, yz + zy, z), axis=-1),
        ),
        axis=-2,
    )
    best = np.argmax(t, axis=-1)[..., None, None]
    return normalise(np.take_along_axis(rows, best, axis=-2)[..., 0, :])


def to_matrix(q: Float[Array, "... 4"]) -> Float[Array, "... 3 3"]:
    """Rotation matrices of unit quaternions."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
    return array_namespace(q).stack(rows, axis=-1).reshape(*q.shape[:-1], 3, 3)


def from_axes(x: Float[ndarray, "... 3"], y_hint: Float[ndarray, "... 3"]) -> Float[ndarray, "... 4"]:
    """The frame whose x axis is along `x` and whose y axis is as near to `y_hint` as can be."""
    x = unit(x)
    z = unit(cross(x, y_hint))
    return from_matrix(np.stack((x, cross(z, x), z), axis=-1))


def from_euler(angles: Float[Array, "... k"], order: str) -> Float[Array, "... 4"]:
    """Intrinsic turns about the k axes named in `order`, applied left to right; angles in rad in that order."""
    q = _about(order[0], angles[..., 0])
    for i in range(1, len(order)):
        q = multiply(q, _about(order[i], angles[..., i]))
    return q


def from_yaw(yaw: Float[Array, "..."]) -> Float[Array, "... 4"]:
    """Turn about the vertical by `yaw` [rad]."""
    return _about("Z", yaw)


def yaw(q: Float[Array, "... 4"]) -> Float[Array, "..."]:
    """Heading of the rotated x axis about the vertical, in (-pi, pi] [rad]."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return array_namespace(q).atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))


def roll_pitch(q: Float[Array, "... 4"]) -> Float[Array, "... 2"]:
    """Roll and pitch [rad] of intrinsic z-y-x angles: an upright body has none, whatever its heading."""
    xp = array_namespace(q)
    w, x, y, z = (q[..., k] for k in range(4))
    up_x, up_y, up_z = (
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )  # the world's, in the body
    return xp.stack((xp.arctan2(up_y, up_z), xp.arctan2(-up_x, xp.hypot(up_y, up_z))), axis=-1)


def _about(axis: str, angle: Array) -> Array:
    """Turn about a named axis [rad]."""
    xp, half = array_namespace(angle), 0.5 * angle
    parts = [xp.cos(half)] + [xp.zeros_like(half)] * 3
    parts[1 + "XYZ".index(axis)] = xp.sin(half)
    return xp.stack(parts, axis=-1)


def from_quat_xyzw(q_xyzw: Float[ndarray, "... 4"]) -> Float[ndarray, "... 4"]:
    """wxyz of quaternions stored scalar-last (Pinocchio, SciPy, most CSV and PKL files)."""
    return np.asarray(q_xyzw)[..., [3, 0, 1, 2]]


def to_quat_xyzw(q: Float[ndarray, "... 4"]) -> Float[ndarray, "... 4"]:
    """Scalar-last order of wxyz quaternions."""
    return np.asarray(q)[..., [1, 2, 3, 0]]


def unit(v: Float[ndarray, "... 3"]) -> Float[ndarray, "... 3"]:
    """Vectors of length one; zero vectors stay zero."""
    return v / np.maximum(_length(v), 1e-12)


def angular_velocity(q: Float[ndarray, "T ... 4"], dt: float) -> Float[ndarray, "T ... 3"]:
    """World-frame angular velocity [rad/s] of world_from_body: central log differences, one-sided at the ends.

    Second order inside: log(q(t+1) q(t-1)^-1) / 2 dt.
    """
    if len(q) < 2:
        return np.zeros((*q.shape[:-1], 3))
    step = log(multiply(q[1:], conjugate(q[:-1]))) / dt
    inner = log(multiply(q[2:], conjugate(q[:-2]))) / (2.0 * dt)
    return np.concatenate((step[:1], inner, step[-1:]), axis=0)


def linear_velocity(x: Float[ndarray, "T ..."], dt: float) -> Float[ndarray, "T ..."]:
    """Time derivative: central differences inside, one-sided at the ends."""
    return np.gradient(x, dt, axis=0) if len(x) > 1 else np.zeros_like(x)
