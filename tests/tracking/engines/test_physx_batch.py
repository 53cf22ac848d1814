"""PhysX in batches: what is not the physics itself: steps, scenes apart from each other, broken states, and refusals."""

import sys

import mujoco
import numpy as np
import pytest

pytest.importorskip("sapien")

from robot_models.maths import rotation as rot
from tracking import TrackingError
from tracking.engines.mujoco import training_model
from tracking.engines.physx import ISAAC, MOTOR, PhysxBatch, _from_x

PROFILES = pytest.mark.parametrize("profile", [ISAAC, MOTOR], ids=lambda p: p.name)


@pytest.fixture(scope="module")
def model(dancer):
    return training_model(dancer, 0.005)


def put(batch, dancer, height=0.0):
    n, rest = batch.count, np.tile(dancer.default_qpos, (batch.count, 1))
    rest[:, 2] += height
    batch.set(np.arange(n), rest, np.zeros((n, batch.models[0].nv)), rest[:, 7:])


def targets(dancer, robots, periods=4):
    return [
        np.stack([dancer.default_joint_pos + 0.2 * np.sin(k + i + np.arange(28)) for i in robots])
        for k in range(periods)
    ]


@PROFILES
@pytest.mark.parametrize("control_dt", [0.02, 1 / 30, 0.01, 0.003])
def test_a_control_period_is_cut_into_equal_steps_none_longer_than_the_profiles(model, profile, control_dt):
    batch = PhysxBatch([model], control_dt=control_dt, profile=profile)
    assert batch.substeps * batch.physics_dt == pytest.approx(control_dt)
    assert batch.physics_dt <= profile.physics_dt + 1e-12
    assert (
        batch.substeps == 1 or control_dt / (batch.substeps - 1) > profile.physics_dt
    )  # and no more of them than needed
    assert batch.scenes[0].scene.get_timestep() == pytest.approx(batch.physics_dt)


@PROFILES
def test_a_robot_moves_as_it_would_alone_whoever_is_beside_it(dancer, model, profile):
    def play(robots):
        batch = PhysxBatch([model] * len(robots), control_dt=0.02, profile=profile)
        put(batch, dancer)
        for target in targets(dancer, robots):
            batch.step(target)
        return batch.state

    together = play((0, 1, 2))
    for i in range(3):
        np.testing.assert_array_equal(play((i,))[0], together[i])
    np.testing.assert_allclose(together[:, 0], 4 * 0.02)


def test_a_broken_robot_stays_broken_and_the_others_go_on(dancer, model):
    def play(spoilt):
        batch = PhysxBatch([model] * 2, control_dt=0.02)
        put(batch, dancer)
        if spoilt:
            batch.qpos[0, 9] = np.nan
        for target in targets(dancer, (0, 1)):
            batch.step(target)
        return batch

    whole, spoilt = play(False), play(True)
    assert np.isnan(spoilt.qpos[0, 9]) and spoilt.state[0, 0] == 0.0
    np.testing.assert_array_equal(spoilt.state[1], whole.state[1])
    spoilt.set(np.array([0]), dancer.default_qpos[None], np.zeros((1, model.nv)), dancer.default_joint_pos[None])
    spoilt.step(targets(dancer, (0, 1))[0])
    assert np.isfinite(spoilt.state).all()  # put back, it lives again


def test_only_a_state_that_someone_has_changed_is_written_into_the_engine(dancer, model, monkeypatch):
    batch, written = PhysxBatch([model] * 2, control_dt=0.02), []
    for i, scene in enumerate(batch.scenes):
        monkeypatch.setattr(scene, "write", lambda q, v, i=i, real=scene.write: (written.append(i), real(q, v)))
    put(batch, dancer)
    first = targets(dancer, (0, 1))
    batch.step(first[0])
    assert written == [0, 1]
    batch.step(first[1])
    assert written == [0, 1]  # contacts are remembered
    batch.qvel[1, 0] += 0.3  # a push
    batch.step(first[2])
    assert written == [0, 1, 1]


def test_a_push_is_felt(dancer, model):
    batch = PhysxBatch([model] * 2, control_dt=0.02)
    put(batch, dancer, height=1.0)
    batch.step(targets(dancer, (0, 0))[0])
    batch.qvel[1, :3] += [0.5, -0.3, 0.2]
    batch.step(targets(dancer, (0, 0))[1])
    # In the air nothing else acts on it; gravity and servos are the same for both.
    np.testing.assert_allclose(batch.qpos[1, :3] - batch.qpos[0, :3], 0.02 * np.array([0.5, -0.3, 0.2]), atol=1e-4)


@PROFILES
def test_a_late_motor_moves_late(dancer, model, profile):
    """Three robots, one target: the joint stands still until its motor has heard."""
    batch = PhysxBatch([model] * 3, control_dt=0.02, delay=np.array([0.0, 0.01, 0.02]), profile=profile)
    put(batch, dancer, height=1.0)
    target = np.tile(dancer.default_joint_pos, (3, 1))
    target[:, dancer.joint("left_elbow")] += 0.5
    batch.step(target)
    moved = batch.qpos[:, 7 + dancer.joint("left_elbow")] - dancer.default_joint_pos[dancer.joint("left_elbow")]
    assert moved[0] > 2.0 * moved[1] > 1e-3 and abs(moved[2]) < 1e-3


@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1), (0.6, 0.0, 0.8), (-0.6, 0.48, -0.64)])
def test_a_joints_x_axis_is_laid_along_its_axis(axis):
    turn = _from_x(np.array(axis, dtype=float))
    assert np.linalg.norm(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(rot.rotate(turn, np.array([1.0, 0.0, 0.0])), axis, atol=1e-12)


def test_a_model_with_two_roots_is_refused():
    body = '<body name="{0}"><freejoint/><geom name="{0}_sole_0" size="0.1" mass="1"/>{1}</body>'
    child = '<body name="c"><joint name="j" range="-1 1"/><geom size="0.1" mass="1"/></body>'
    two = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{body.format('a', child)}{body.format('b', '')}</worldbody>"
        '<actuator><position joint="j" kp="1" kv="1" forcerange="-1 1"/></actuator></mujoco>'
    )
    with pytest.raises(TrackingError, match="body b: found a second root"):
        PhysxBatch([two], control_dt=0.02)


def test_without_sapien_the_line_that_installs_it_is_told(model, monkeypatch):
    monkeypatch.setitem(sys.modules, "sapien", None)
    with pytest.raises(TrackingError, match=r"no SAPIEN.*pip install 'dance-retarget\[sim2sim\]'"):
        PhysxBatch([model], control_dt=0.02)
