"""What is asked for before anything is learned: the torques of the motion, inside what motors can give."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import tracking
from clips import load_reference
from tracking import read_contract
from tracking.policy.feed_forward import joint_targets, target_range

FOLDER = Path(tracking.__file__).parent / "policies" / "groove-dancer"


@pytest.fixture(scope="module")
def reference(dancer):
    return load_reference(FOLDER / "reference.npz", dancer)


def servos(robot, **factors):
    return SimpleNamespace(**{k: factors.get(k, 1.0) * getattr(robot, k) for k in ("kp", "kd", "effort")})


def middle(x):
    return 0.5 * (x[1:] + x[:-1])


def test_a_robot_and_the_contract_made_for_it_ask_for_the_same(reference, dancer):
    np.testing.assert_array_equal(
        joint_targets(reference, dancer), joint_targets(reference, read_contract(FOLDER / "contract.json"))
    )


def test_the_stiffer_the_servo_the_nearer_its_target_to_the_motion(reference, dancer):
    wanted = middle(reference.joint_pos)
    off = [np.abs(joint_targets(reference, servos(dancer, kp=f))[1:] - wanted) for f in (1.0, 10.0, 1e9)]
    np.testing.assert_allclose(off[0], 10.0 * off[1], atol=1e-12)  # inversely as the gain
    assert off[2].max() < 1e-6


def test_no_target_asks_for_more_than_the_motor_has(reference, dancer):
    wild = dataclasses.replace(reference, joint_torque=1e3 * reference.joint_torque)
    targets = joint_targets(wild, dancer)[1:]
    torque = dancer.kp * (targets - middle(wild.joint_pos)) - dancer.kd * middle(wild.joint_vel)
    assert (np.abs(torque) <= dancer.effort * (1.0 + 1e-9)).all() and np.isclose(np.abs(torque), dancer.effort).any()


def test_torque_and_damping_add_up(reference, dancer):
    """Without damping only torque moves the target off the motion, without torque only damping does."""
    whole = joint_targets(reference, dancer)
    limp = joint_targets(dataclasses.replace(reference, joint_torque=None), dancer)
    undamped = joint_targets(reference, servos(dancer, kd=0.0))
    plain = joint_targets(dataclasses.replace(reference, joint_torque=None), servos(dancer, kd=0.0))
    np.testing.assert_allclose(whole - limp, undamped - plain, atol=1e-12)
    assert np.abs(whole - limp).max() > 0.1 and np.abs(limp - plain).max() > 0.01


def test_where_the_robot_stands_in_the_room_does_not_matter_and_joints_in_another_order_do(reference, dancer):
    there = dataclasses.replace(reference, body_pos_w=reference.body_pos_w + [5.0, 2.0, 0.0])
    before = joint_targets(reference, dancer)
    np.testing.assert_array_equal(joint_targets(there, dancer), before)
    swapped = {k: getattr(reference, k)[:, ::-1] for k in ("joint_pos", "joint_vel", "joint_torque")}
    turned = SimpleNamespace(**{k: getattr(dancer, k)[::-1] for k in ("kp", "kd", "effort")})
    backwards = dataclasses.replace(reference, **swapped)
    np.testing.assert_array_equal(joint_targets(backwards, turned)[:, ::-1], before)
    assert np.abs(joint_targets(backwards, dancer)[:, ::-1] - before).max() > 0.1  # gains of other joints


def test_the_first_frame_has_none_before_it_and_stands_for_itself(reference, dancer):
    still = dataclasses.replace(
        reference, joint_vel=0.0 * reference.joint_vel, joint_torque=None, joint_pos=reference.joint_pos
    )
    np.testing.assert_array_equal(joint_targets(still, dancer)[0], reference.joint_pos[0])


def test_at_the_ends_of_the_range_a_motor_pushes_with_all_it_has_from_a_joint_at_its_limit(dancer):
    low, high = target_range(dancer, dancer.lower, dancer.upper)
    np.testing.assert_allclose(dancer.kp * (low - dancer.lower), -dancer.effort)
    np.testing.assert_allclose(dancer.kp * (high - dancer.upper), dancer.effort)
    assert (low < dancer.lower).all() and (high > dancer.upper).all()
