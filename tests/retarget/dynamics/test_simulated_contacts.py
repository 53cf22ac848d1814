"""Contact forces and torques beside those of MuJoCo simulations."""

import copy

import mujoco
import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="no Pinocchio wheels on Windows")

from standing import reference_of

from clips import FREE
from retarget.dynamics.inverse_dynamics import dynamics_of, inverse_dynamics
from robot_models import BODY_BIT
from robot_models.maths import rotation as rot


def simulated(robot, qpos0, targets, *, record, steps, seconds):
    """Simulate with stiff servos towards `targets(t)`; qpos, qvel, qacc, motor torques and foot wrenches per record."""
    model = copy.deepcopy(robot.model)
    # A short step: the implicit damping of a long one moves the body otherwise than the forces it reports.
    model.opt.timestep = 5e-4
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    model.dof_frictionloss[:] = 0.0
    model.actuator_gainprm[:, 0] *= 10.0
    model.actuator_biasprm[:, 1] *= 10.0
    model.actuator_biasprm[:, 2] *= 4.0
    model.actuator_forcelimited[:] = 0
    model.jnt_actfrclimited[:] = 0
    data = mujoco.MjData(model)
    data.qpos[:] = qpos0
    rows, wrench, floor = [], np.zeros(6), model.geom("floor").id
    for i in range(round(seconds / model.opt.timestep)):
        data.ctrl[:] = targets(data.time)
        mujoco.mj_forward(model, data)
        if i % steps == 0 and data.time >= record:
            feet, com = np.zeros((2, 6)), data.subtree_com[robot.body_ids[0]]
            for k, contact in enumerate(data.contact[: data.ncon]):
                assert floor in contact.geom  # no limb touches another
                sign = 1.0 if contact.geom[0] == floor else -1.0  # the force is that on the second geom
                foot = model.geom(int(contact.geom[1 if sign > 0.0 else 0])).name.split("_")[0]
                mujoco.mj_contactForce(model, data, k, wrench)
                force = sign * contact.frame.reshape(3, 3).T @ wrench[:3]
                feet[("left", "right").index(foot)] += np.concatenate((force, np.cross(contact.pos - com, force)))
            motors = data.qfrc_actuator[6:] + data.qfrc_passive[6:]
            rows.append([np.array(x) for x in (data.qpos, data.qvel, data.qacc, motors, feet)])
        mujoco.mj_step(model, data)
    return [np.array(x) for x in zip(*rows, strict=True)]


def test_a_simulated_squat_has_the_simulators_contact_forces(dancer):
    bend = {"hip_pitch": -0.3, "knee": 0.6, "ankle_pitch": -0.3}

    def targets(t):
        q = dancer.default_joint_pos.copy()
        for name, angle in bend.items():
            for side in ("left", "right"):
                q[dancer.joint(f"{side}_{name}")] += angle * 0.5 * (1.0 - np.cos(2.0 * np.pi * t))
        return q

    qpos, qvel, qacc, _, feet = simulated(dancer, dancer.default_qpos, targets, record=0.5, steps=20, seconds=1.5)
    demand = inverse_dynamics(dancer, qpos, qvel, qacc)
    assert np.ptp(demand.com_w[:, 2]) > 0.04 and np.ptp(feet[:, :, 2].sum(axis=1)) > 0.15 * demand.weight
    # Given the simulator's accelerations: as exact as its contact solver.
    total = feet.sum(axis=1)
    np.testing.assert_allclose(demand.force_w, total[:, :3], atol=1e-8 * demand.weight)
    np.testing.assert_allclose(demand.moment_w, total[:, 3:], atol=1e-8 * demand.weight)
    # From its positions alone, every 10 ms: what second differences lose, 1e-4 of the weight.
    d = dynamics_of(reference_of(dancer, qpos, fps=100.0), dancer)
    inner = slice(2, -2)
    np.testing.assert_allclose(d.net_wrench_w[inner, :3], total[inner, :3], atol=3e-4 * d.weight)
    np.testing.assert_allclose(d.net_wrench_w[inner, 3:], total[inner, 3:], atol=3e-4 * d.weight)
    ours = np.stack((d.force_w[:, :4].sum(axis=1), d.force_w[:, 4:].sum(axis=1)), axis=1)
    np.testing.assert_allclose(ours[inner, :, 2], feet[inner, :, 2], atol=3e-4 * d.weight)
    assert d.score[inner].max() < 0.1


@pytest.mark.parametrize("turn", [-0.5, 0.5], ids=["on its back", "on its face"])
def test_a_simulated_robot_that_lies_is_judged_possible_and_one_that_hovers_is_not(dancer, turn):
    model = copy.deepcopy(dancer.model)
    own = (model.geom_contype & BODY_BIT) != 0
    floor = model.geom("floor").id
    model.geom_conaffinity[floor] |= BODY_BIT
    model.body_conaffinity[0] |= BODY_BIT
    assert own.any()
    data = mujoco.MjData(model)
    data.qpos[:] = dancer.default_qpos
    data.qpos[2], data.qpos[3:7] = 0.35, rot.exp(np.array([0.0, turn * np.pi, 0.0]))
    data.ctrl[:] = dancer.default_joint_pos
    while data.time < 3.0:
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 0.02 and data.qpos[2] < 0.3
    lying = np.repeat(data.qpos[None], 9, axis=0)
    d = dynamics_of(reference_of(dancer, lying, label=FREE), dancer)
    assert d.score.max() < 0.2 and not d.flight.any()
    up = d.force_w[4, :, 2].sum()
    assert up == pytest.approx(d.weight, rel=1e-3)
    lying[:, 2] += 0.05
    assert dynamics_of(reference_of(dancer, lying, label=FREE), dancer).score.min() > 1.0


def one_legged(robot):
    """Standing on the left foot with the CoM over its middle, the right knee up."""
    sole = robot.soles["left"]
    low, high = -0.6, 0.6
    for _ in range(40):
        lean = 0.5 * (low + high)
        q = robot.default_qpos.copy()
        q[7 + robot.joint("left_hip_roll")] += lean
        q[7 + robot.joint("left_ankle_roll")] -= lean
        q[7 + robot.joint("right_hip_pitch")] -= 0.6
        q[7 + robot.joint("right_knee")] += 0.9
        q[7 + robot.joint("right_hip_roll")] -= 0.3
        data = mujoco.MjData(robot.model)
        data.qpos[:] = q
        mujoco.mj_forward(robot.model, data)
        body = data.body(sole.body)
        middle = body.xpos + body.xmat.reshape(3, 3) @ np.array([np.mean(sole.x), np.mean(sole.y), sole.z])
        over = data.subtree_com[robot.body_ids[0]][1] - middle[1]
        low, high = (low, lean) if over < 0.0 else (lean, high)
    q[2] -= middle[2]
    assert abs(over) < 1e-6
    return q


def test_on_one_leg_foot_force_and_torques_are_the_simulators(dancer):
    start = one_legged(dancer)
    sway = dancer.joint("waist_yaw")

    def targets(t):
        q = start[7:].copy()
        q[sway] += 0.3 * np.sin(2.0 * np.pi * t) * min(1.0, t)
        return q

    qpos, _, _, motors, feet = simulated(dancer, start, targets, record=1.0, steps=20, seconds=1.6)
    assert not feet[:, 1].any()
    d = dynamics_of(reference_of(dancer, qpos, label=np.array([1, 1, 0, 0]), fps=100.0), dancer)
    inner = slice(2, -2)
    assert d.in_contact[:, :4].all() and not d.in_contact[:, 4:].any()
    np.testing.assert_allclose(d.force_w[inner].sum(axis=1), feet[inner, 0, :3], atol=5e-4 * d.weight)
    # The foot's wrench follows from the motion, so the torques do.
    np.testing.assert_allclose(d.joint_torque[inner], motors[inner], atol=5e-4 * np.abs(motors).max())
    assert d.score[inner].max() < 0.1


def test_a_simulated_hop_is_judged_possible_and_what_pushes_off_from_the_air_is_not(dancer):
    bend = {"hip_pitch": -0.5, "knee": 1.0, "ankle_pitch": -0.5}

    def targets(t):
        q = dancer.default_joint_pos.copy()
        crouch = 0.8 * np.clip(t / 0.5, 0.0, 1.0) - np.clip((t - 0.6) / 0.12, 0.0, 1.0)
        for name, angle in bend.items():
            for side in ("left", "right"):
                q[dancer.joint(f"{side}_{name}")] += angle * crouch
        return q

    qpos, _, _, _, feet = simulated(dancer, dancer.default_qpos, targets, record=0.4, steps=20, seconds=0.9)
    d = dynamics_of(reference_of(dancer, qpos, label=FREE, fps=100.0), dancer)
    carried = feet[:, :, 2].sum(axis=1) / d.weight
    in_air = carried == 0.0
    assert in_air.sum() > 8 and carried.max() > 3.0
    assert d.score.max() < 0.1
    qpos[:, 2] += 0.05
    raised = dynamics_of(reference_of(dancer, qpos, label=FREE, fps=100.0), dancer)
    assert raised.flight.all()
    inner = in_air[1:-1] & in_air[2:] & in_air[:-2]
    assert raised.score[1:-1][inner].max() < 0.1 and raised.score[carried > 0.5].min() > 1.0
