"""A limb that is caught in another body gets out by another beginning, and nobody else moves."""

import numpy as np
import pytest

from retarget import ObjectiveWeights, RetargetConfig, WholeClipConfig
from retarget.solver.objective import make_objective
from retarget.solver.ways_round import lead_round
from robot_models import self_collisions


@pytest.fixture(scope="module")
def problem(groove):
    """The dance of four seconds, solved, and its goals."""
    targets, dance = groove.targets, groove.reference.dance
    qpos = groove.reference.qpos[dance]
    pins = np.full((len(qpos), qpos.shape[1] - 7), np.nan)
    config = RetargetConfig()
    return make_objective(groove.robot, targets, ObjectiveWeights(), qpos[:, 7:], pins, config.feet), qpos


def solved(problem, robot, qpos):
    config = WholeClipConfig()
    return lead_round(robot, problem[0], qpos, 50.0, config, config.physics)


def test_a_caught_hand_gets_out_and_the_rest_of_the_dance_stays(problem, dancer):
    qpos = problem[1].copy()
    arm = [7 + dancer.joint(f"left_{j}") for j in ("shoulder_pitch", "shoulder_roll", "elbow")]
    for shift in np.linspace(-1.5, 1.5, 31):  # until the arm is in the body
        qpos[98:103, arm] = problem[1][98:103, arm]
        qpos[98:103, arm[1]] += shift
        qpos[98:103, arm[2]] -= 0.8
        if self_collisions(dancer, qpos[98:103]).depth.max() > 0.02:
            break
    assert self_collisions(dancer, qpos).depth.max() > 0.02  # the control: it is caught
    out = solved(problem, dancer, qpos)
    assert self_collisions(dancer, out).depth.max() < WholeClipConfig().caught
    np.testing.assert_array_equal(out[:40], qpos[:40])
    np.testing.assert_array_equal(out[160:], qpos[160:])
    limits = dancer.lower - 1e-9 <= out[:, 7:], out[:, 7:] <= dancer.upper + 1e-9
    assert all(np.all(held) for held in limits)


def test_a_dance_where_nobody_is_caught_is_left_as_it_is(problem, dancer):
    assert self_collisions(dancer, problem[1]).depth.max() < WholeClipConfig().caught
    np.testing.assert_array_equal(solved(problem, dancer, problem[1]), problem[1])
