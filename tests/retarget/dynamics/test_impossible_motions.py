"""Motions that cannot be are called impossible; a thrown body needs nothing."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="no Pinocchio wheels on Windows")

from standing import G, reference_of, standing

from retarget.dynamics.feasibility import flight_fit, hardest_stretches
from retarget.dynamics.floor_points import floor_points
from retarget.dynamics.inverse_dynamics import dynamics_of
from robot_models.maths import rotation as rot


def test_hovering_and_a_leap_from_nowhere_are_impossible(dancer):
    hover = standing(dancer, 20)
    hover[:, 2] += 0.3
    d = dynamics_of(reference_of(dancer, hover), dancer)  # labelled planted: the label is not believed
    assert d.score.min() >= 1.0 and d.flight.all()
    assert "nothing touching" in hardest_stretches(d)[0].text and np.isnan(d.zmp_w).all()
    leap = standing(dancer, 40)
    phase = np.clip((np.arange(40) - 10) / 10.0, 0.0, 1.0)
    leap[:, 2] += phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)  # 1 m in 0.2 s
    d = dynamics_of(reference_of(dancer, leap), dancer)
    assert d.score[:9].max() < 0.1  # it still stands
    assert d.score[13:].min() >= 1.0 and d.score.max() > 40.0  # 15 times the weight out of the air
    worst = hardest_stretches(d)[0]
    assert worst.cause == "force" and 0.2 <= worst.start_s <= 0.3 and "upwards" in worst.text


def test_leaning_over_the_toes_is_missed_by_the_zmp(dancer):
    # The stand tipped as one piece about the front edge: gravity's arm is all there is.
    angle, at = 0.45, np.array([dancer.soles["left"].x[1], 0.0, 0.0])
    points = floor_points(reference_of(dancer, standing(dancer)), dancer).pos_w[0]
    at[0] = points[:, 0].max()
    tip = rot.exp(np.array([0.0, angle, 0.0]))
    qpos = standing(dancer)
    qpos[:, :3] = at + rot.rotate(tip, qpos[:, :3] - at)
    qpos[:, 3:7] = rot.multiply(tip, qpos[:, 3:7])
    d = dynamics_of(reference_of(dancer, qpos), dancer)
    assert d.in_contact[0].sum() == 4
    np.testing.assert_allclose(d.zmp_outside, d.com_w[:, 0] - at[0], atol=1e-9)
    assert d.zmp_outside[0] > 0.1 and d.score.min() > 0.3


def test_motors_that_are_too_weak_are_named(dancer):
    share = dynamics_of(reference_of(dancer, standing(dancer)), dancer).effort_share[0]
    weak = dataclasses.replace(dancer, effort=dancer.effort * share * 0.5)
    d = dynamics_of(reference_of(weak, standing(weak)), weak)
    assert d.score[0] > 1.0
    worst = hardest_stretches(d)[0]
    assert worst.cause == "effort" and d.worst_joint[0] in worst.text


def raise_jumps(robot, gravity, frames=21, fps=50.0):
    qpos, t = standing(robot, frames), np.arange(frames) / fps
    qpos[:, 2] += 0.3 + 0.5 * gravity * (t * (t[-1] - t))
    qpos[:, 0] += 1.5 * t
    return reference_of(robot, qpos, label=0, fps=fps)


def test_a_thrown_body_needs_nothing(dancer):
    d = dynamics_of(raise_jumps(dancer, G), dancer)
    assert d.flight.all() and np.isnan(d.zmp_w).all()
    # Second differences of a parabola are exact.
    np.testing.assert_allclose(d.residual, 0.0, atol=1e-8 * d.weight)
    np.testing.assert_allclose(d.joint_torque, 0.0, atol=1e-8 * d.weight)
    (flight,) = flight_fit(d)
    assert flight.off_gravity < 1e-6
    assert flight.rise == pytest.approx(flight.ballistic_rise, rel=1e-6) == pytest.approx(G * 0.4**2 / 8.0, rel=1e-6)


def test_a_floating_jump_is_told_from_a_thrown_one(dancer):
    d = dynamics_of(raise_jumps(dancer, 0.4 * G), dancer)
    (flight,) = flight_fit(d)
    assert flight.off_gravity == pytest.approx(0.6 * G, rel=1e-6)
    assert flight.rise == pytest.approx(0.4 * flight.ballistic_rise, rel=1e-6)
    assert d.score.min() >= 1.0
