"""Rigid-body dynamics of references: two engines, simulations, and motions that cannot be."""

import copy
import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.optimize import nnls

pytest.importorskip("pinocchio", reason="no Pinocchio wheels on Windows")

from clips import PLANTED, make_reference
from retarget.contact_forces import friction_pyramid, nonnegative_ridge
from retarget.dynamics import differences, dynamics_of, inverse_dynamics
from retarget.errors import RetargetError
from retarget.hardship import flight_fit, hardest
from retarget.support import outside_support, sole_points
from robot_models import load_robot
from robot_models import rotation as rot

FPS = 50.0
G = 9.81


def reference_of(robot, qpos, *, label=PLANTED, fps=FPS, segments=None):
    contact = np.broadcast_to(label, (len(qpos), 4))
    segments = [[0, len(qpos), 0]] if segments is None else segments
    return make_reference(robot, np.asarray(qpos), fps, contact=contact, segments=np.array(segments), meta={})


def standing(robot, frames=5):
    return np.repeat(robot.default_qpos[None], frames, axis=0)


def free_model(robot):
    """MuJoCo's model with nothing but inertia and gravity in its inverse dynamics."""
    model = copy.deepcopy(robot.model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    return model


def mujoco_inverse(model, q, v, a):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(model, data)
    return data, np.array(data.qfrc_inverse)


def generalised(robot, data, points, t, forces):
    """J^T f of forces on the sole points, by MuJoCo's Jacobians."""
    out, jacobian = np.zeros(robot.model.nv), np.zeros((3, robot.model.nv))
    for k, force in enumerate(forces):
        body = robot.body_ids[points.body[k]]
        mujoco.mj_jac(robot.model, data, jacobian, None, points.pos_w[t, k], body)
        out += jacobian.T @ force
    return out


# The wrench that a motion needs


@pytest.mark.parametrize("name", ["dancer", "g1", "jvrc1"])
def test_inverse_dynamics_agrees_with_mujoco_root_included(name, rng):
    if name == "jvrc1":
        pytest.importorskip("jvrc_description")
    robot = load_robot(name)
    model, frames, nv = free_model(robot), 6, robot.model.nv
    qpos = np.concatenate(
        (rng.normal(size=(frames, 3)), rot.normalise(rng.normal(size=(frames, 4))), rng.normal(size=(frames, nv - 6))),
        1,
    )
    qvel, qacc = rng.normal(size=(2, frames, nv)) * np.array([[[2.0]], [[20.0]]])
    demand = inverse_dynamics(robot, qpos, qvel, qacc)
    assert demand.weight == pytest.approx(model.body_mass.sum() * -model.opt.gravity[2], rel=1e-12)
    for t in range(frames):
        data, theirs = mujoco_inverse(model, qpos[t], qvel[t], qacc[t])
        root = robot.body_ids[0]
        np.testing.assert_allclose(demand.com_w[t], data.subtree_com[root], atol=1e-9)
        # MuJoCo's free joint: force in the world, moment in the body frame about the body's origin.
        moment = rot.rotate(qpos[t, 3:7], theirs[3:6]) + np.cross(qpos[t, :3] - demand.com_w[t], theirs[:3])
        small = 1e-9 * np.abs(theirs).max()
        np.testing.assert_allclose(demand.force_w[t], theirs[:3], atol=small)
        np.testing.assert_allclose(demand.moment_w[t], moment, atol=small)
        np.testing.assert_allclose(demand.torque[t], theirs[6:], atol=small)


def test_differences_are_of_second_order_in_the_body_frame():
    a, b = np.array([0.3, -1.1, 0.7]), np.array([-0.9, 0.4, 1.3])

    def errors(dt):
        t = 0.7 + dt * np.arange(-2, 3)[:, None]  # away from 0, where body and world frame are one
        quat = rot.multiply(rot.exp(t * a), rot.exp(t * b))
        qpos = np.concatenate((np.sin(1.0 + t * a), quat, np.cos(0.5 + t)), axis=1)
        qvel, qacc = differences(qpos, dt)
        a_b = rot.rotate(rot.conjugate(rot.exp(t * b)), np.broadcast_to(a, (5, 3)))  # a as the body sees it
        true_v = np.concatenate((a * np.cos(1.0 + t * a), a_b + b, -np.sin(0.5 + t)), axis=1)
        true_a = np.concatenate((-(a**2) * np.sin(1.0 + t * a), -np.cross(b, a_b), -np.cos(0.5 + t)), axis=1)
        ends = np.abs(qvel - true_v)[[0, -1]].max()
        return np.array([np.abs(qvel - true_v)[2].max(), np.abs(qacc - true_a)[2].max(), ends])

    # Halving the step quarters the error; a wrong frame or a missing term would leave it as it is.
    np.testing.assert_allclose(errors(0.02) / errors(0.01), 4.0, rtol=0.1)


def test_nothing_differentiates_across_a_cut(dancer):
    qpos = standing(dancer, 8)
    qpos[4:, 0] += 1.0
    qpos[4:, 7] += 0.3
    joined = dynamics_of(reference_of(dancer, qpos), dancer)
    cut_ = dynamics_of(reference_of(dancer, qpos, segments=[[0, 4, 0], [4, 8, 0]]), dancer)
    assert joined.score.max() > 10.0
    # A slightly other hip is still a stand: the force is the weight.
    np.testing.assert_allclose(cut_.net_wrench_w[:, :3], np.tile([0.0, 0.0, cut_.weight], (8, 1)), atol=1e-9)


# What the floor gives


def test_standing_needs_the_weight_and_gets_it(dancer):
    reference = reference_of(dancer, standing(dancer))
    d = dynamics_of(reference, dancer)
    np.testing.assert_allclose(d.net_wrench_w[:, :3], np.tile([0.0, 0.0, d.weight], (5, 1)), atol=1e-9 * d.weight)
    np.testing.assert_allclose(d.net_wrench_w[:, 3:], 0.0, atol=1e-9 * d.weight)
    # What choosing among forces costs: 1e-5 of a gate, and some.
    np.testing.assert_allclose(d.residual, 0.0, atol=1e-4 * d.weight * 0.25)
    np.testing.assert_allclose(d.zmp_w, d.com_w[:, :2], atol=1e-12)
    assert (d.zmp_outside == 0.0).all() and d.touching.all()
    assert d.score.max() < 0.1 and not hardest(d)
    model = free_model(dancer)
    data, theirs = mujoco_inverse(model, dancer.default_qpos, np.zeros(model.nv), np.zeros(model.nv))
    left = theirs - generalised(dancer, data, sole_points(reference, dancer), 0, d.foot_force_w[0])
    np.testing.assert_allclose(d.joint_torque[0], left[6:], atol=1e-6 * np.abs(left[6:]).max())
    np.testing.assert_allclose(d.residual[0, :3], left[:3], atol=1e-6 * d.weight)


def test_forces_stay_in_the_friction_cone_and_on_touching_points(groove_like):
    robot, _, d = groove_like
    tangent = np.linalg.norm(d.foot_force_w[..., :2], axis=-1)
    assert (tangent <= robot.profile.friction * d.foot_force_w[..., 2] + 1e-9).all()
    assert (d.foot_force_w[~d.touching] == 0.0).all()
    assert d.solve_error.max() < 1e-6


def test_torques_and_forces_of_a_dance_fulfil_the_equation_of_motion(groove_like):
    robot, reference, d = groove_like
    model = free_model(robot)
    qvel, qacc = differences(reference.qpos, 1.0 / reference.fps)
    points = sole_points(reference, robot)
    for t in range(1, reference.frames - 1, 17):
        data, theirs = mujoco_inverse(model, reference.qpos[t], qvel[t], qacc[t])
        left = theirs - generalised(robot, data, points, t, d.foot_force_w[t])
        np.testing.assert_allclose(d.joint_torque[t], left[6:], atol=1e-8 * np.abs(theirs).max())
        np.testing.assert_allclose(d.residual[t, :3], left[:3], atol=1e-8 * np.abs(theirs).max())


def test_the_zmp_is_the_centre_of_pressure_where_the_feet_can_give_it(groove_like):
    robot, reference, d = groove_like
    given = d.score < 1e-3
    assert given.sum() > 100 and np.abs(d.net_wrench_w[given, :2]).max() > 0.05 * d.weight
    at, force = sole_points(reference, robot).pos_w, d.foot_force_w
    moment = at[..., :2] * force[..., 2:] - at[..., 2:] * force[..., :2]
    pressure = moment.sum(axis=1) / force[..., 2].sum(axis=1, keepdims=True)
    # A thousandth of the weight that is missing, half a metre up, is half a millimetre on the floor.
    np.testing.assert_allclose(d.zmp_w[given], pressure[given], atol=5e-4)
    assert d.zmp_outside[given].max() < 1e-3  # of the points, half a millimetre over the floor, and friction


def test_nonnegative_ridge_agrees_with_lawson_and_hanson(rng):
    # Pyramids of eight points, some absent, against targets that they can give, cannot, and nearly can.
    frames, ridge = 3000, 1e-6
    points = rng.uniform([-0.2, -0.2, -0.8], [0.2, 0.2, -0.8], size=(frames, 8, 3))
    edges = friction_pyramid(rng.uniform(-3.0, 3.0, size=(frames, 8)), 0.8)
    edges = edges * (rng.random((frames, 8)) < 0.6)[..., None, None]
    arms = np.cross(np.broadcast_to(points[:, :, None], edges.shape), edges)
    matrix = np.concatenate((edges.reshape(frames, 32, 3) * 4.0, arms.reshape(frames, 32, 3) * 10.0), -1).swapaxes(1, 2)
    given = (matrix @ rng.exponential(size=(frames, 32, 1)))[..., 0]
    target = given * rng.choice([0.01, 0.1, 1.0], size=(frames, 1)) + rng.normal(size=(frames, 6)) * np.array(
        [[0.0], [0.1], [5.0]]
    ).repeat(frames // 3, 0)
    x, error = nonnegative_ridge(matrix, target, ridge)
    assert error.max() < 1e-6 and (x >= 0.0).all()  # a line search that misses cycles in some of the 3000
    for t in range(0, frames, 50):
        on = matrix[t].any(axis=0)  # with columns of nothing but rounding, SciPy's answer is only good to 1e-3
        stacked = np.vstack((matrix[t][:, on], np.sqrt(ridge) * np.eye(on.sum())))
        theirs, _ = nnls(stacked, np.append(target[t], np.zeros(on.sum())))
        np.testing.assert_allclose(matrix[t] @ x[t], matrix[t][:, on] @ theirs, atol=1e-7)
        np.testing.assert_allclose(x[t, on], theirs, atol=1e-6)
        assert not x[t, ~on].any()


def test_outside_support_agrees_with_a_polygon_by_hand():
    feet = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [5.0, 5.0]])
    touching = np.array([True, True, True, True, False])
    at = np.array([[0.5, 0.5], [0.9, 0.2], [1.5, 0.5], [2.0, 2.0], [0.3, -0.2], [np.nan, 0.0]])
    many = outside_support(at, np.repeat(feet[None], 6, 0), np.repeat(touching[None], 6, 0))
    np.testing.assert_allclose(many, [0.0, 0.0, 0.5, np.sqrt(2.0), 0.2, 0.0], atol=1e-12)
    # One point, a line, nothing.
    one, line, none = np.eye(5, dtype=bool)[0], np.array([1, 1, 0, 0, 0], dtype=bool), np.zeros(5, dtype=bool)
    three = outside_support(np.full((3, 2), 0.5), np.repeat(feet[None], 3, 0), np.stack((one, line, none)))
    np.testing.assert_allclose(three, [np.sqrt(0.5), 0.5, 0.0], atol=1e-12)


def test_the_answer_does_not_turn_with_the_world(groove_like):
    robot, reference, d = groove_like
    turn = rot.from_yaw(np.array(1.1))
    qpos = reference.qpos.copy()
    qpos[:, :3] = rot.rotate(turn, qpos[:, :3]) + np.array([3.0, -2.0, 0.0])
    qpos[:, 3:7] = rot.multiply(turn, qpos[:, 3:7])
    other = dynamics_of(reference_of(robot, qpos, label=reference.contact, fps=reference.fps), robot)
    np.testing.assert_allclose(other.score, d.score, atol=1e-5)
    np.testing.assert_allclose(other.foot_force_w, rot.rotate(turn, d.foot_force_w), atol=1e-3)
    np.testing.assert_allclose(other.zmp_outside, d.zmp_outside, atol=1e-6)


def test_a_point_carries_where_it_is_labelled_or_low_and_slow_and_one_frame_around(dancer):
    qpos = standing(dancer, 12)
    qpos[:, 2] += np.array([0, 0, 0, 0, 1, 2, 4, 6, 7, 8, 8, 8]) * 0.005  # [m]; 0.25 to 0.5 m/s on the way
    label = np.zeros((12, 4), dtype=int)
    label[5] = [1, 0, 2, 0]
    points = sole_points(reference_of(dancer, qpos, label=label), dancer)
    edges = points.touching[:, [0, 2, 4, 6]]  # left heel, left toe, right heel, right toe
    low = [True] * 4 + [True] + [False] * 7  # frame 4 is 5 mm high and as fast as 0.25 m/s; frame 5 beside it
    np.testing.assert_array_equal(edges[:, 1], np.array(low) | (np.arange(12) == 5))
    # The label at frame 5 (1 cm high) reaches frame 6 (2 cm); 3 cm is too high for any.
    np.testing.assert_array_equal(edges[:, 0], np.arange(12) <= 6)
    np.testing.assert_array_equal(edges[:, 2:], edges[:, :2])
    late = np.zeros((12, 4), dtype=int)
    late[9:] = 1
    assert not sole_points(reference_of(dancer, qpos, label=late), dancer).touching[9:].any()


# MuJoCo's own simulation as the second road


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
    ours = np.stack((d.foot_force_w[:, :4].sum(axis=1), d.foot_force_w[:, 4:].sum(axis=1)), axis=1)
    np.testing.assert_allclose(ours[inner, :, 2], feet[inner, :, 2], atol=3e-4 * d.weight)
    assert d.score[inner].max() < 0.1


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
    assert d.touching[:, :4].all() and not d.touching[:, 4:].any()
    np.testing.assert_allclose(d.foot_force_w[inner].sum(axis=1), feet[inner, 0, :3], atol=5e-4 * d.weight)
    # The foot's wrench follows from the motion, so the torques do.
    np.testing.assert_allclose(d.joint_torque[inner], motors[inner], atol=5e-4 * np.abs(motors).max())
    assert d.score[inner].max() < 0.1


# What cannot be


def test_hovering_and_a_leap_from_nowhere_are_impossible(dancer):
    hover = standing(dancer, 20)
    hover[:, 2] += 0.3
    d = dynamics_of(reference_of(dancer, hover), dancer)  # labelled planted: the label is not believed
    assert d.score.min() >= 1.0 and d.flight.all()
    assert "nothing touching" in hardest(d)[0].text and np.isnan(d.zmp_w).all()
    leap = standing(dancer, 40)
    phase = np.clip((np.arange(40) - 10) / 10.0, 0.0, 1.0)
    leap[:, 2] += phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)  # 1 m in 0.2 s
    d = dynamics_of(reference_of(dancer, leap), dancer)
    assert d.score[:9].max() < 0.1  # it still stands
    assert d.score[13:].min() >= 1.0 and d.score.max() > 40.0  # 15 times the weight out of the air
    worst = hardest(d)[0]
    assert worst.cause == "force" and 0.2 <= worst.start_s <= 0.3 and "upwards" in worst.text


def test_leaning_over_the_toes_is_missed_by_the_zmp(dancer):
    # The stand tipped as one piece about the front edge: gravity's arm is all there is.
    angle, at = 0.45, np.array([dancer.soles["left"].x[1], 0.0, 0.0])
    points = sole_points(reference_of(dancer, standing(dancer)), dancer).pos_w[0]
    at[0] = points[:, 0].max()
    tip = rot.exp(np.array([0.0, angle, 0.0]))
    qpos = standing(dancer)
    qpos[:, :3] = at + rot.rotate(tip, qpos[:, :3] - at)
    qpos[:, 3:7] = rot.multiply(tip, qpos[:, 3:7])
    d = dynamics_of(reference_of(dancer, qpos), dancer)
    assert d.touching[0].sum() == 4
    np.testing.assert_allclose(d.zmp_outside, d.com_w[:, 0] - at[0], atol=1e-9)
    assert d.zmp_outside[0] > 0.1 and d.score.min() > 0.3


def test_motors_that_are_too_weak_are_named(dancer):
    share = dynamics_of(reference_of(dancer, standing(dancer)), dancer).effort_share[0]
    weak = dataclasses.replace(dancer, effort=dancer.effort * share * 0.5)
    d = dynamics_of(reference_of(weak, standing(weak)), weak)
    assert d.score[0] > 1.0
    worst = hardest(d)[0]
    assert worst.cause == "effort" and d.worst_joint[0] in worst.text


def test_another_robots_reference_is_refused(dancer):
    with pytest.raises(RetargetError, match="g1"):
        dynamics_of(reference_of(dancer, standing(dancer)), load_robot("g1"))


# Flight


def thrown(robot, gravity, frames=21, fps=50.0):
    qpos, t = standing(robot, frames), np.arange(frames) / fps
    qpos[:, 2] += 0.3 + 0.5 * gravity * (t * (t[-1] - t))
    qpos[:, 0] += 1.5 * t
    return reference_of(robot, qpos, label=0, fps=fps)


def test_a_thrown_body_needs_nothing(dancer):
    d = dynamics_of(thrown(dancer, G), dancer)
    assert d.flight.all() and np.isnan(d.zmp_w).all()
    # Second differences of a parabola are exact.
    np.testing.assert_allclose(d.residual, 0.0, atol=1e-8 * d.weight)
    np.testing.assert_allclose(d.joint_torque, 0.0, atol=1e-8 * d.weight)
    (flight,) = flight_fit(d)
    assert flight.off_gravity < 1e-6
    assert flight.rise == pytest.approx(flight.ballistic_rise, rel=1e-6) == pytest.approx(G * 0.4**2 / 8.0, rel=1e-6)


def test_a_floating_jump_is_told_from_a_thrown_one(dancer):
    d = dynamics_of(thrown(dancer, 0.4 * G), dancer)
    (flight,) = flight_fit(d)
    assert flight.off_gravity == pytest.approx(0.6 * G, rel=1e-6)
    assert flight.rise == pytest.approx(0.4 * flight.ballistic_rise, rel=1e-6)
    assert d.score.min() >= 1.0


@pytest.fixture(scope="module")
def groove_like(groove):
    """(robot, reference, dynamics) of a real dance."""
    robot = load_robot("dancer")
    return robot, groove.reference, dynamics_of(groove.reference, robot)
