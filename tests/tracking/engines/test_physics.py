"""What every engine shares: targets that are heard late, states that are put, and time that passes."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracking import TrackingError
from tracking.engines.physics import PhysicsBatch

DT = 0.005


class Recorder(PhysicsBatch):
    """An engine that moves nothing and keeps what it was asked for in every physics step."""

    def __init__(self, count=1, substeps=4, delay=None, control_dt=None):
        model = SimpleNamespace(nq=9, nv=8, nu=2)
        super().__init__(
            [model] * count, control_dt=substeps * DT if control_dt is None else control_dt, physics_dt=DT, delay=delay
        )
        self.heard = []

    def _advance(self, targets):
        self.heard.append(np.array(targets))

    @property
    def steps(self):
        """Targets by robot and physics step."""
        return np.concatenate(self.heard, axis=1)


def put(batch, value=0.0):
    n = batch.count
    batch.set(np.arange(n), np.zeros((n, 9)), np.zeros((n, 8)), np.full((n, 2), value))


@pytest.mark.parametrize("substeps", [1, 3, 4])
def test_each_robot_hears_every_target_its_own_delay_late_to_the_physics_step(substeps):
    late = np.arange(10)  # in physics steps
    batch = Recorder(len(late), substeps, delay=DT * late)
    put(batch, -1.0)
    for period in range(12):
        batch.step(np.full((len(late), 2), float(period)))
    for robot, wait in enumerate(late):
        sent = np.repeat(np.arange(12.0), substeps)
        wanted = np.concatenate((np.full(wait, -1.0), sent))[
            : len(sent)
        ]  # shifted, and before: what was asked for at the start
        np.testing.assert_array_equal(batch.steps[robot], np.stack([wanted] * 2, axis=1))


@pytest.mark.parametrize("seconds", [0.0, 0.0024, 0.0026, 0.01])
def test_delays_are_rounded_to_physics_steps(seconds):
    batch = Recorder(1, 4, delay=np.array([seconds]))
    put(batch, -1.0)
    batch.step(np.ones((1, 2)))
    assert (batch.steps[0, :, 0] < 0.0).sum() == round(seconds / DT)


def test_a_delay_that_grows_and_shrinks_is_heard_from_the_next_period_on():
    batch = Recorder(2, 4, delay=np.array([0.02, 0.01]))
    put(batch, -1.0)
    batch.set_delay(np.zeros(2))
    batch.step(np.full((2, 2), 1.0))
    batch.set_delay(np.array([0.02, 0.01]))
    batch.step(np.full((2, 2), 2.0))
    np.testing.assert_array_equal(batch.heard[0], 1.0)
    np.testing.assert_array_equal(batch.heard[1][0], 1.0)
    np.testing.assert_array_equal(batch.heard[1][1, :, 0], [1.0, 1.0, 2.0, 2.0])


def test_joints_and_robots_keep_their_own_targets():
    batch = Recorder(3, 2, delay=np.array([0.0, DT, 3 * DT]))
    put(batch)
    tags = [100.0 * period + 10.0 * np.arange(3)[:, None] + np.arange(2) for period in range(4)]
    for tag in tags:
        batch.step(tag)
    for robot, wait in enumerate((0, 1, 3)):
        for step in range(wait, 8):
            np.testing.assert_array_equal(batch.steps[robot, step], tags[(step - wait) // 2][robot])


def test_a_target_that_the_caller_changes_later_is_not_changed_here():
    batch = Recorder(1, 2, delay=np.array([2 * DT]))
    put(batch)
    mine = np.ones((1, 2))
    batch.step(mine)
    mine[:] = 9.0
    batch.step(np.full((1, 2), 2.0))
    np.testing.assert_array_equal(batch.heard[1], 1.0)


def test_some_are_put_anew_with_clock_and_memory_and_the_others_go_on():
    batch = Recorder(3, 2, delay=np.full(3, 4 * DT))
    put(batch, -1.0)
    batch.step(np.full((3, 2), 1.0))
    batch.state[:] += 7.0
    qpos, qvel = np.arange(9.0)[None], 10.0 + np.arange(8.0)[None]
    batch.set(np.array([1]), qpos, qvel, np.full((1, 2), 5.0))
    np.testing.assert_array_equal(batch.state[1], np.concatenate(([0.0], qpos[0], qvel[0])))
    np.testing.assert_array_equal(batch.state[[0, 2]], 7.0)
    for _ in range(2):
        batch.step(np.full((3, 2), 2.0))
    assert (batch.steps[1, 2:] == 5.0).all() and 5.0 not in batch.steps[[0, 2]]  # nothing of its life before


def test_qpos_and_qvel_are_views_that_tile_the_state_after_the_clock():
    batch = Recorder(2)
    batch.qpos[:], batch.qvel[:] = 1.0, 2.0
    np.testing.assert_array_equal(batch.state[0], [0.0, *[1.0] * 9, *[2.0] * 8])
    past = np.arange(36.0).reshape(1, 2, 18)
    np.testing.assert_array_equal(np.concatenate((batch.qpos_of(past), batch.qvel_of(past)), axis=-1), past[..., 1:])
    assert np.shares_memory(batch.qpos_of(past), past)


@pytest.mark.parametrize("control_dt", [0.0, 0.004, 0.0075, 0.0201])
def test_a_control_period_is_some_whole_physics_steps(control_dt):
    with pytest.raises(TrackingError, match="control period.*whole number"):
        Recorder(control_dt=control_dt)
