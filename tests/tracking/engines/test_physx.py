"""The second engine is the same robot: mass, state, motion, contact, friction; and PhysX repeats itself."""

from functools import partial

import mujoco
import numpy as np
import pytest

pytest.importorskip("sapien")

from robot_models import forward_kinematics, load_robot, lowest_point
from robot_models.maths import rotation as rot
from tracking.config import RandomisationConfig
from tracking.engines.actuators import servo_gains
from tracking.engines.mujoco import MujocoBatch, training_model
from tracking.engines.physx import ISAAC, MOTOR, PhysxBatch
from tracking.task.randomisation import draw_robots

PROFILES = pytest.mark.parametrize("profile", [ISAAC, MOTOR], ids=lambda p: p.name)


@pytest.fixture(scope="module")
def dancer():
    return load_robot("dancer")


def physx(models, profile, control_dt=0.02, **more):
    return PhysxBatch(models, control_dt=control_dt, profile=profile, **more)


def put(batch, qpos, qvel=None):
    n = batch.count
    qvel = np.zeros(batch.models[0].nv) if qvel is None else qvel
    batch.set(np.arange(n), np.tile(qpos, (n, 1)), np.tile(qvel, (n, 1)), np.tile(qpos[7:], (n, 1)))


def spinning(robot, rng):
    qpos, qvel = robot.default_qpos.copy(), np.zeros(robot.model.nv)
    qpos[2] += 4.0
    qpos[3:7] = 0.8, 0.6, 0.0, 0.0
    qvel[:6] = 0.3, 0.1, 1.0, 0.5, 1.0, 1.5
    qvel[6:] = 0.5 * rng.normal(size=len(qvel) - 6)
    return qpos, qvel


def test_every_number_of_the_robot_arrives(dancer, rng):
    drawn = draw_robots(dancer, 2, 0.005, RandomisationConfig(), rng).models
    for model, scene in zip(drawn, physx(drawn, ISAAC).scenes, strict=True):
        assert sum(link.mass for link in scene.robot.links) == pytest.approx(model.body_mass.sum(), rel=1e-6)
        assert [j.name for j in scene.joints] == list(dancer.joint_names)
        for i, joint in enumerate(scene.joints):
            assert joint.armature[0] == pytest.approx(model.dof_armature[6 + i], rel=1e-6)
            assert joint.force_limit == pytest.approx(model.actuator_forcerange[i, 1], rel=1e-6)
            assert joint.stiffness == pytest.approx(servo_gains(model)[0][i], rel=1e-6)
            np.testing.assert_allclose(joint.limits[0], model.jnt_range[1 + i], rtol=1e-6, atol=1e-7)
            assert joint.friction == 0.0
        soles = [g for g in range(model.ngeom) if "_sole_" in model.geom(g).name]
        shapes = [s for link in scene.robot.links for s in link.collision_shapes]
        assert len(shapes) == len(soles) == 8
        assert scene.material.dynamic_friction == pytest.approx(model.geom_friction[soles[0], 0], rel=1e-6)
        for shape in shapes:
            assert shape.physical_material.dynamic_friction == pytest.approx(scene.material.dynamic_friction)


@PROFILES
def test_a_state_written_is_the_state_read(dancer, rng, profile):
    qpos, qvel = spinning(dancer, rng)
    scene = physx([training_model(dancer, 0.005)], profile).scenes[0]
    scene.write(qpos, qvel)
    read = scene.read()
    np.testing.assert_allclose(read[0], qpos, atol=1e-6)
    np.testing.assert_allclose(read[1], qvel, atol=1e-5)


@PROFILES
def test_the_velocity_told_is_the_derivative_of_the_pose(dancer, rng, profile):
    qpos, qvel = spinning(dancer, rng)
    scene = physx([training_model(dancer, 0.001)], profile, control_dt=0.001).scenes[0]
    scene.write(qpos, qvel)
    before = scene.read()
    scene.step(qpos[7:])
    after = scene.read()
    moved = np.zeros(dancer.model.nv)
    mujoco.mj_differentiatePos(dancer.model, moved, 0.001, before[0], after[0])
    np.testing.assert_allclose(moved[:3], after[1][:3], atol=5e-3)
    # The servos brake the joints within the step: the mean velocity lies between those at its ends.
    np.testing.assert_allclose(moved[3:], after[1][3:], atol=0.1)
    # The centre of mass is not the origin: told by the wrong one of them, this would be off by a cm/s and more.
    assert np.linalg.norm(np.cross(before[1][3:6], scene._com)) > 1e-2


def test_free_flight_is_that_of_the_first_engine(dancer, rng):
    model = training_model(dancer, 0.001)
    ours, theirs = MujocoBatch([model], control_dt=0.02), physx([model], MOTOR)
    qpos, qvel = spinning(dancer, rng)
    for batch in (ours, theirs):
        put(batch, qpos, qvel)
    for k in range(50):
        target = (qpos[7:] + 0.2 * np.sin(0.1 * k + np.arange(28)))[None]
        ours.step(target)
        theirs.step(target)
    assert np.sqrt(np.mean(np.square(ours.qpos - theirs.qpos)[:, 7:])) < 1e-3
    np.testing.assert_allclose(theirs.qpos[0, :3], ours.qpos[0, :3], atol=2e-3)


@PROFILES
def test_it_stands_and_the_floor_carries_its_weight(dancer, profile):
    model = training_model(dancer, 0.005)
    batch = physx([model], profile)
    put(batch, dancer.default_qpos)
    for _ in range(75):
        batch.step(dancer.default_joint_pos[None])
    assert abs(batch.qpos[0, 2] - dancer.default_qpos[2]) < 0.02
    scene = batch.scenes[0]
    forces = []
    for _ in range(50):
        scene.step(dancer.default_joint_pos)
        impulses = [p.impulse[2] for c in scene.system.get_contacts() for p in c.points]
        forces.append(abs(np.sum(impulses)) / batch.physics_dt)
    assert np.mean(forces) == pytest.approx(9.81 * model.body_mass.sum(), rel=0.01)


@PROFILES
def test_whoever_lies_is_carried_as_in_the_first_engine(dancer, profile):
    ends = []
    for batch in (physx([training_model(dancer, 0.005, floor_work=True)], profile),
                  MujocoBatch([training_model(dancer, 0.005, floor_work=True)], control_dt=0.02)):  # fmt: skip
        qpos = dancer.default_qpos.copy()
        qpos[2], qpos[3:7] = 0.35, rot.exp(np.array([0.0, -0.5 * np.pi, 0.0]))
        put(batch, qpos)
        for _ in range(75):
            batch.step(dancer.default_joint_pos[None])
        ends.append(batch.qpos[0].copy())
    lowest = lowest_point(dancer, *forward_kinematics(dancer, np.array(ends)))
    assert (np.abs(lowest) < 0.01).all() and abs(ends[0][2] - ends[1][2]) < 0.02


@PROFILES
def test_the_same_run_twice_is_the_same_to_the_last_bit(dancer, rng, profile):
    model, ends = training_model(dancer, 0.005), []
    targets = dancer.default_joint_pos + 0.2 * rng.normal(size=(20, 2, 28))
    for _ in range(2):
        batch = physx([model] * 2, profile, delay=np.array([0.0, 0.01]))
        put(batch, dancer.default_qpos)
        for target in targets:
            batch.step(target)
        ends.append(batch.state.copy())
    np.testing.assert_array_equal(*ends)
    assert not np.array_equal(ends[0][0], ends[0][1])  # a delay is a difference


BOX = """<mujoco><option timestep="{dt}"/><worldbody><geom name="floor" type="plane" size="0 0 1"/>
<body name="box" pos="0 0 {z}"><freejoint/><inertial pos="0 0 0" mass="2" diaginertia="0.02 0.02 0.02"/>
{points}<body name="arm" pos="0 0 0"><joint name="arm" axis="0 0 1" range="-1 1" limited="true"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
<actuator><position joint="arm" kp="10" kv="1" forcerange="-5 5"/></actuator></mujoco>"""


@pytest.mark.parametrize("engine", [MujocoBatch, partial(PhysxBatch, profile=MOTOR)], ids=["mujoco", "physx"])
def test_a_sliding_box_stops_where_coulomb_says(engine):
    point = '<geom name="box_sole_{k}" type="sphere" size="0.005" pos="{x} {y} -0.05" priority="1" friction="0.1 0.005 0.0001"/>'
    corners = [(x, y) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    points = "".join(point.format(k=k, x=x, y=y) for k, (x, y) in enumerate(corners))
    model = mujoco.MjModel.from_xml_string(BOX.format(dt=0.001, z=0.055, points=points))
    batch = engine([model], control_dt=0.02)
    put(batch, np.array([0, 0, 0.055, 1, 0, 0, 0, 0.0]), np.array([0.5, 0, 0, 0, 0, 0, 0]))
    for _ in range(50):
        batch.step(np.zeros((1, 1)))
    assert batch.qpos[0, 0] == pytest.approx(0.5**2 / (2 * 0.1 * 9.81), rel=0.02)  # v^2 / (2 mu g)
