"""Finite differences of whatever depends on a robot's pose, in every coordinate of its tangent, and the poses for them."""

import numpy as np

from robot_models.maths import rotation as rot
from robot_models.rigid_body.jacobians import integrate

STEP = 1e-5
# What central differences leave: STEP^2 / 6 of the third derivative, and rounding of the values over STEP, which is
# 1e-16 / 1e-5 of each. Both are 1e-11 for values and third derivatives of about 1; chains of a dozen joints have ten
# times that, and values of several metres as much again.
TOLERANCE = 2e-9


def random_poses(robot, rng, count=3):
    """Anywhere, turned any way, every joint anywhere between its limits."""
    return np.concatenate(
        (
            rng.normal(size=(count, 3)),
            rot.normalise(rng.normal(size=(count, 4))),
            rng.uniform(robot.lower, robot.upper, (count, len(robot.joint_names))),
        ),
        axis=1,
    )


def central(values, qpos, step=STEP):
    """Derivatives of values(poses, qpos), one pose after the other in every coordinate: (P, ..., nv)."""
    count, nv = len(qpos), qpos.shape[1] - 1
    poses, steps = np.repeat(np.arange(count), nv), np.tile(step * np.eye(nv), (count, 1))
    ahead, behind = (values(poses, integrate(qpos[poses], s)) for s in (steps, -steps))
    slopes = (ahead - behind) / (2.0 * step)
    return np.moveaxis(slopes.reshape(count, nv, *slopes.shape[1:]), 1, -1)


def assert_derivatives(jacobian, slopes, tolerance=TOLERANCE):
    """All columns, none left out."""
    assert jacobian.shape == slopes.shape
    off = np.abs(jacobian - slopes).reshape(-1, jacobian.shape[-1]).max(axis=0)
    assert off.max() <= tolerance, f"column {off.argmax()} off by {off.max():.3g}"


def spoiled(jacobian):
    """The same with one column of the wrong sign, or a tenth too large; every column once in both ways."""
    for column in range(jacobian.shape[-1]):
        for factor in (-1.0, 1.1):
            bad = jacobian.copy()
            bad[..., column] *= factor
            yield column, bad
