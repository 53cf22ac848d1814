"""Robots of their own: each range moves what it names by as much as it says, and nothing else."""

import dataclasses

import mujoco
import numpy as np
import pytest

from tracking.config import RandomisationConfig
from tracking.engines.actuators import servo_gains
from tracking.engines.mujoco import training_model
from tracking.task.randomisation import Pushes, draw_robots

NOTHING = RandomisationConfig(
    friction=(1.0, 1.0), mass=(1.0, 1.0), torso_com=0.0, gains=(1.0, 1.0), encoder_bias=0.0, torque_speed=False,
    delay=(0.0, 0.0), pushes=False,
)  # fmt: skip


def drawn(robot, seed=0, count=3, **changes):
    return draw_robots(robot, count, 0.005, dataclasses.replace(NOTHING, **changes), np.random.default_rng(seed))


def arrays(model):
    """Every array of a compiled model."""
    named = {k: getattr(model, k) for k in dir(model) if not k.startswith("_")}
    return {k: v for k, v in named.items() if isinstance(v, np.ndarray)}


def changed(model, like):
    before = arrays(like)
    return {k for k, v in arrays(model).items() if not np.array_equal(v, before[k])}


def soles(model):
    return [g for g in range(model.ngeom) if "_sole_" in model.geom(g).name]


@pytest.mark.parametrize(
    ("changes", "touched"),
    [
        ({}, set()),
        ({"friction": (0.3, 0.3)}, {"geom_friction"}),
        ({"mass": (1.2, 1.2)}, {"body_mass", "body_inertia"}),
        ({"torso_com": 0.03}, {"body_ipos"}),
        ({"gains": (0.8, 0.8)}, {"actuator_gainprm", "actuator_biasprm"}),
        ({"encoder_bias": 0.03}, set()),
        ({"delay": (0.01, 0.02)}, set()),
    ],
)
def test_a_range_changes_what_it_names_and_nothing_else_of_the_model(dancer, changes, touched):
    base, kept = training_model(dancer, 0.005), {k: v.copy() for k, v in arrays(dancer.model).items()}
    friction = base.geom_friction[soles(base), 0]
    robots = drawn(dancer, **({"friction": (friction[0],) * 2} | changes))
    for model in robots.models:
        assert changed(model, base) == touched
    assert robots.encoder_bias.any() == ("encoder_bias" in changes) and robots.delay.any() == ("delay" in changes)
    for name, value in arrays(dancer.model).items():  # the robot itself is nobody's to change
        np.testing.assert_array_equal(value, kept[name], err_msg=name)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_factors_are_factors(dancer, factor):
    base = training_model(dancer, 0.005)
    model = drawn(dancer, mass=(factor, factor), gains=(factor, factor), friction=(factor, factor)).models[0]
    np.testing.assert_allclose(model.body_mass, factor * base.body_mass, rtol=1e-12)
    np.testing.assert_allclose(model.body_inertia, factor * base.body_inertia, rtol=1e-12)
    for ours, theirs in zip(servo_gains(model), servo_gains(base), strict=True):
        np.testing.assert_allclose(ours, factor * theirs, rtol=1e-12)
    others = np.setdiff1d(np.arange(model.ngeom), soles(model))
    np.testing.assert_allclose(model.geom_friction[soles(model), 0], factor)
    np.testing.assert_array_equal(model.geom_friction[others], base.geom_friction[others])


def test_draws_lie_in_their_ranges_and_bodies_keep_their_shape(dancer):
    c, base = RandomisationConfig(), training_model(dancer, 0.005)
    robots = draw_robots(dancer, 24, 0.005, c, np.random.default_rng(0))
    heavy = base.body_mass > 0.0
    for model in robots.models:
        factor = model.body_mass[heavy] / base.body_mass[heavy]
        assert (c.mass[0] <= factor).all() and (factor <= c.mass[1]).all() and np.ptp(factor) > 0.0
        # As heavy as drawn, but as long and wide as before: radii of gyration stay.
        np.testing.assert_allclose(
            model.body_inertia[heavy] / model.body_mass[heavy, None],
            base.body_inertia[heavy] / base.body_mass[heavy, None],
        )
        moved = np.flatnonzero((model.body_ipos != base.body_ipos).any(axis=1))
        assert list(moved) == [dancer.body_ids[dancer.body(dancer.profile.anchor)]]
        assert np.abs(model.body_ipos - base.body_ipos).max() <= c.torso_com
    mu = np.array([m.geom_friction[soles(m)[0], 0] for m in robots.models])
    for values, (low, high) in (
        (mu, c.friction), (robots.delay, c.delay), (robots.encoder_bias, (-c.encoder_bias, c.encoder_bias))
    ):  # fmt: skip
        assert values.min() >= low and values.max() <= high
        assert np.ptp(values) > 0.7 * (high - low)  # of 24 and more draws


def test_a_servo_of_another_stiffness_is_still_a_servo(dancer):
    """What pulls to the target and what pulls back from the joint's own angle are one stiffness."""
    model = drawn(dancer, gains=(0.5, 1.5)).models[0]
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 1])
    kp, kd = (now / then for now, then in zip(servo_gains(model), (dancer.kp, dancer.kd), strict=True))
    assert np.ptp(kp) > 0.5 and np.ptp(kd) > 0.5 and abs(np.corrcoef(kp, kd)[0, 1]) < 0.6  # each by itself


def test_the_seed_decides_the_robots(dancer):
    def summary(seed):
        robots = draw_robots(dancer, 3, 0.005, RandomisationConfig(), np.random.default_rng(seed))
        models = [
            np.concatenate([m.body_mass, m.actuator_gainprm.ravel(), m.geom_friction.ravel()]) for m in robots.models
        ]
        return np.concatenate([*models, robots.encoder_bias.ravel(), robots.delay])

    np.testing.assert_array_equal(summary(4), summary(4))
    assert (summary(4) != summary(5)).any()


def test_a_heavier_robot_takes_as_much_more_to_hold_up(dancer):
    """By another road: the force that MuJoCo's inverse dynamics asks at the root to keep it from falling."""
    held = []
    for factor in (1.0, 1.2):
        model = drawn(dancer, mass=(factor, factor), count=1).models[0]
        data = mujoco.MjData(model)
        data.qpos[:] = dancer.default_qpos
        data.qpos[2] += 1.0  # off the floor
        mujoco.mj_inverse(model, data)
        held.append(data.qfrc_inverse[2])
    assert held[1] / held[0] == pytest.approx(1.2)


def pushed(strength, waits, seed=0):
    config = RandomisationConfig(push_every=(0.2, 0.4))
    pushes = Pushes(len(waits), 0.02, config, np.random.default_rng(0))
    pushes.strength, pushes.wait = strength, np.array(waits, dtype=float)
    qvel = np.zeros((len(waits), 34))
    pushes.apply(qvel, np.random.default_rng(seed))
    return qvel, pushes.wait


def test_only_those_whose_time_has_come_are_pushed_and_then_wait_anew():
    qvel, wait = pushed(1.0, [1.0, 5.0, 0.5, 2.0])
    np.testing.assert_array_equal(qvel[:, :6].any(axis=1), [True, False, True, False])
    assert not qvel[:, 6:].any()
    assert wait[1] == 4.0 and wait[3] == 1.0
    assert all(10.0 <= w <= 20.0 for w in wait[[0, 2]])  # 0.2 to 0.4 s in periods of 20 ms


def test_a_push_half_as_strong_is_half_as_large_and_none_beyond_its_width():
    whole, half = (pushed(s, [1.0] * 400)[0][:, :6] for s in (1.0, 0.5))
    np.testing.assert_allclose(half, 0.5 * whole)
    c = RandomisationConfig()
    width = np.array((*c.push_linear, *c.push_angular))
    assert (np.abs(whole) <= width).all() and (np.abs(whole).max(axis=0) > 0.95 * width).all()
    assert (np.abs(whole.mean(axis=0)) < 0.15 * width).all()  # to all sides; five standard errors of 400


def test_without_strength_time_passes_all_the_same():
    qvel, wait = pushed(0.0, [1.0, 3.0])
    assert not qvel.any() and wait[0] >= 10.0 and wait[1] == 2.0
