"""Group axioms, round trips and derivatives, over many shapes and near the identity."""

import numpy as np
import pytest

from robot_models.maths import rotation as rot

SHAPES = [(), (5,), (4, 3)]


def quats(rng, shape, spread=3.0):
    return rot.exp(rng.normal(size=(*shape, 3)) * spread)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("spread", [1e-9, 1e-3, 1.0, 3.0])
def test_group_axioms(rng, shape, spread):
    a, b, c = (quats(rng, shape, spread) for _ in range(3))
    v = rng.normal(size=(*shape, 3))
    np.testing.assert_allclose(rot.multiply(rot.multiply(a, b), c), rot.multiply(a, rot.multiply(b, c)), atol=1e-14)
    assert rot.angle_between(rot.multiply(a, rot.conjugate(a)), np.broadcast_to(rot.IDENTITY, a.shape)).max() < 1e-14
    np.testing.assert_allclose(rot.rotate(a, rot.rotate(b, v)), rot.rotate(rot.multiply(a, b), v), atol=1e-13)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-6, 0.1, 3.0, np.pi - 1e-6])
def test_log_undoes_exp(rng, size):
    v = rot.unit(rng.normal(size=(20, 3))) * size
    np.testing.assert_allclose(rot.log(rot.exp(v)), v, atol=1e-9)


def test_matrices_and_back(rng):
    # Turns by pi about each axis are where the naive formula divides by zero.
    q = np.concatenate((quats(rng, (50,)), np.eye(4)))
    assert rot.angle_between(rot.from_matrix(rot.to_matrix(q)), q).max() < 1e-7
    m = rot.to_matrix(q)
    np.testing.assert_allclose(m @ m.swapaxes(-1, -2), np.broadcast_to(np.eye(3), m.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(m), 1.0)


def test_from_axes_keeps_x_and_is_right_handed(rng):
    x, hint = rng.normal(size=(2, 30, 3))
    m = rot.to_matrix(rot.from_axes(x, hint))
    np.testing.assert_allclose(m[..., 0], rot.unit(x), atol=1e-12)
    assert (np.sum(m[..., 1] * hint, axis=-1) > 0).all()


def test_angular_velocity_is_second_order():
    axis, rates = np.array([0.6, -0.0, 0.8]), []
    for fps in (50, 100, 200):
        t = np.arange(fps) / fps
        q = rot.exp(np.sin(3 * t)[:, None] * axis)
        exact = (3 * np.cos(3 * t))[:, None] * axis
        rates.append(np.abs(rot.angular_velocity(q, 1 / fps)[1:-1] - exact[1:-1]).max())
    assert rates[0] / rates[1] == pytest.approx(4.0, rel=0.1)
    assert rates[1] / rates[2] == pytest.approx(4.0, rel=0.1)


def test_angular_velocity_is_in_the_world_frame():
    # A body lying on its side that spins about the world's z: the body frame would say x or y.
    side = rot.exp(np.array([np.pi / 2, 0.0, 0.0]))
    q = rot.multiply(rot.from_yaw(0.5 * np.arange(10) / 50), side)
    np.testing.assert_allclose(rot.angular_velocity(q, 1 / 50), np.tile([0, 0, 0.5], (10, 1)), atol=1e-9)


def test_continuous_removes_sign_flips_and_nothing_else(rng):
    q = rot.exp(np.cumsum(rng.normal(scale=0.1, size=(40, 3)), axis=0))
    flipped = q * rng.choice([-1.0, 1.0], size=(40, 1))
    fixed = rot.continuous(flipped)
    assert (np.sum(fixed[1:] * fixed[:-1], axis=1) > 0).all()
    assert rot.angle_between(fixed, q).max() < 1e-7


def test_euler_orders_differ():
    angles = np.array([0.3, -0.5, 0.7])
    zyx = rot.from_euler(angles, "ZYX")
    by_hand = rot.multiply(
        rot.multiply(rot.exp(np.array([0, 0, 0.3])), rot.exp(np.array([0, -0.5, 0]))), rot.exp(np.array([0.7, 0, 0]))
    )
    assert rot.angle_between(zyx, by_hand) < 1e-12
    assert rot.angle_between(zyx, rot.from_euler(angles, "XYZ")) > 0.1  # negative control


def test_xyzw_is_a_permutation_both_ways():
    q = np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(rot.to_quat_xyzw(q), [2, 3, 4, 1])
    np.testing.assert_array_equal(rot.from_quat_xyzw(rot.to_quat_xyzw(q)), q)
