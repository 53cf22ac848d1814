"""A policy that dances while one looks on: it is the policy of the judgements, and a shove is what makes it fall."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from tracking.engines import floor_geoms
from tracking.evaluation import Hindrance, LiveDance, stream_policy

DANCER = Path("groove-dancer")


@pytest.fixture
def dance():
    made = LiveDance(DANCER)
    yield made
    made.close()


def test_unhindered_it_dances_as_the_stream_does(dance):
    """Another road to the same poses; the motors of the live robot lose torque with speed, which here hardly matters."""
    poses = stream_policy(DANCER).poses
    for _ in range(60):
        expected, _ = next(poses)
        np.testing.assert_allclose(dance.qpos[:3], expected[:3], atol=0.02)
        dance.step()
    assert dance.frame == 60 and not dance.over and 0.0 < dance.off_mm < 60.0


def test_a_shove_makes_it_fall_and_nothing_else_does(dance):
    for _ in range(100):
        dance.step()
    assert not dance.fell
    before = dance.qpos
    dance.push(4.0, 0.0)
    dance.step()
    facing = 1.0  # the dancer looks along x
    assert (dance.qpos - before)[0] * facing > 0.03
    while not dance.over:
        dance.step()
    assert dance.fell and dance.falls == 1 and dance.frame < 200
    dance.restart()
    assert dance.frame == 0 and not dance.fell and dance.falls == 1


def test_the_robot_is_as_it_was_asked_for(dance):
    nominal = dance._task.physics.models[0]
    weight, soles = nominal.body_mass.sum(), nominal.geom_friction[floor_geoms(nominal), 0]
    dance.restart(Hindrance(friction=0.3, mass=1.2, delay_s=0.02))
    model = dance._task.physics.models[0]
    assert model.body_mass.sum() == pytest.approx(1.2 * weight)
    np.testing.assert_allclose(model.geom_friction[floor_geoms(model), 0], 0.3)
    assert not np.allclose(soles, 0.3) and dance._task.delay[0] == pytest.approx(0.02)
