"""MuJoCo in batches: robots do not know of each other, threads change nothing, and what blows up is seen."""

import dataclasses

import mujoco
import numpy as np
import pytest

from robot_models import forward_kinematics, lowest_point
from robot_models.geometry import body_geoms
from robot_models.maths import rotation as rot
from tracking.config import RandomisationConfig
from tracking.engines.mujoco import MujocoBatch, training_model
from tracking.task.randomisation import draw_robots


@pytest.fixture(scope="module")
def drawn(dancer):
    config = dataclasses.replace(RandomisationConfig(), delay=(0.0, 0.03))
    return draw_robots(dancer, 4, 0.005, config, np.random.default_rng(1))


def play(dancer, models, delay, ids, threads=1, periods=6):
    """States of some of the robots under targets of their own."""
    batch = MujocoBatch([models[i] for i in ids], control_dt=0.02, delay=delay[list(ids)], threads=threads)
    n, rest = len(ids), np.tile(dancer.default_qpos, (len(ids), 1))
    batch.set(np.arange(n), rest, np.zeros((n, batch.models[0].nv)), rest[:, 7:])
    for k in range(periods):
        batch.step(np.stack([dancer.default_joint_pos + 0.2 * np.sin(k + i + np.arange(28)) for i in ids]))
    batch.close()
    return batch.state


def test_a_robot_moves_as_it_would_alone_whoever_is_beside_it(dancer, drawn):
    together = play(dancer, drawn.models, drawn.delay, (0, 1, 2, 3))
    for i in range(4):
        np.testing.assert_array_equal(play(dancer, drawn.models, drawn.delay, (i,))[0], together[i])
    np.testing.assert_array_equal(play(dancer, drawn.models, drawn.delay, (2, 0, 3, 1)), together[[2, 0, 3, 1]])
    assert len({state.tobytes() for state in together}) == 4


def test_threads_change_no_bit(dancer, drawn):
    ends = [play(dancer, drawn.models, drawn.delay, (0, 1, 2, 3), threads) for threads in (1, 2, 3)]
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], ends[2])


def test_time_passes_as_control_periods_do(dancer, drawn):
    np.testing.assert_allclose(play(dancer, drawn.models, drawn.delay, (0, 1), periods=7)[:, 0], 7 * 0.02)


def test_only_soles_touch_in_training_and_the_robot_keeps_its_own_contacts(dancer):
    model = training_model(dancer, 0.005)
    in_contact = {model.geom(g).name for g in range(model.ngeom) if model.geom_contype[g] or model.geom_conaffinity[g]}
    assert {n for n in in_contact if "_sole_" not in n} == {"floor"} and len(in_contact) == 9
    assert dancer.model.geom_contype[body_geoms(dancer)].any()
    assert model.opt.timestep == 0.005 and training_model(dancer, 0.002).opt.timestep == 0.002


def lying_on(dancer, batch, seconds=1.5):
    """Dropped on its back from 35 cm, servos at rest."""
    qpos = dancer.default_qpos.copy()[None]
    qpos[0, 2], qpos[0, 3:7] = 0.35, rot.exp(np.array([0.0, -0.5 * np.pi, 0.0]))
    batch.set(np.array([0]), qpos, np.zeros((1, batch.models[0].nv)), qpos[:, 7:])
    for _ in range(round(seconds / 0.02)):
        batch.step(dancer.default_joint_pos[None])
    return batch.qpos[0]


def test_floor_work_is_carried_by_the_body_and_without_it_a_body_falls_through(dancer):
    for floor_work in (True, False):
        end = lying_on(dancer, MujocoBatch([training_model(dancer, 0.005, floor_work=floor_work)], control_dt=0.02))
        lowest = lowest_point(dancer, *forward_kinematics(dancer, end[None]))[0]
        assert (-0.01 < lowest < 0.005) if floor_work else lowest < -0.1


def test_a_whole_body_that_meets_the_floor_changes_no_bit_of_a_dance_on_two_feet(dancer, drawn):
    config = dataclasses.replace(RandomisationConfig(), delay=(0.0, 0.03))
    whole = draw_robots(dancer, 4, 0.005, config, np.random.default_rng(1), floor_work=True)
    some, every = (play(dancer, d.models, d.delay, (0, 1), periods=10) for d in (drawn, whole))
    np.testing.assert_array_equal(some, every)


def test_a_robot_that_blows_up_stays_broken_and_harms_nobody(dancer, drawn):
    kept = play(dancer, drawn.models, drawn.delay, (1,), periods=3)[0]
    batch = MujocoBatch(drawn.models[:2], control_dt=0.02, delay=drawn.delay[:2], threads=1)
    rest = np.tile(dancer.default_qpos, (2, 1))
    batch.set(np.arange(2), rest, np.zeros((2, batch.models[0].nv)), rest[:, 7:])
    batch.qvel[0, 8] = np.nan
    for k in range(3):
        batch.step(np.stack([dancer.default_joint_pos + 0.2 * np.sin(k + i + np.arange(28)) for i in (0, 1)]))
    batch.close()
    assert not np.isfinite(batch.state[0]).all()  # not silently put back to the zero pose
    np.testing.assert_array_equal(batch.state[1], kept)


def test_in_free_flight_the_centre_of_mass_falls_as_a_stone_whatever_the_joints_do(dancer):
    model = training_model(dancer, 0.001)
    batch = MujocoBatch([model], control_dt=0.02)
    qpos, qvel = dancer.default_qpos.copy()[None], np.zeros((1, model.nv))
    qpos[0, 2] += 3.0
    qvel[0, :3] = 0.5, -0.2, 1.0
    batch.set(np.array([0]), qpos, qvel, qpos[:, 7:])

    def centre():
        data = mujoco.MjData(model)
        data.qpos[:] = batch.qpos[0]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return data.subtree_com[0].copy()

    before = centre()
    for k in range(10):
        batch.step(dancer.default_joint_pos[None] + 0.3 * np.sin(k + np.arange(28)))
    fallen = before + 0.2 * qvel[0, :3] - [0.0, 0.0, 0.5 * 9.81 * 0.2**2]
    # An Euler step of 1 ms is late by half of it: g t dt / 2 = 1 mm.
    np.testing.assert_allclose(centre(), fallen, atol=1.5e-3)
    batch.close()
