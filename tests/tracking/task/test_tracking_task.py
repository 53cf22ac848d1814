"""The tracking task: rewards by hand, sensors at the right instant, and the laws of environments."""

import dataclasses
import json
import os
import re
import subprocess
import sys

import mujoco
import numpy as np
import pytest

pytest.importorskip("torch")

from clips import load_reference
from robot_models import BodyStates, body_states, load_robot
from robot_models.maths import rotation as rot
from tracking import TaskConfig, TrackingError, TrackingTask
from tracking.config import RandomisationConfig, RewardConfig, TerminationConfig
from tracking.engines.mujoco import MujocoBatch, training_model
from tracking.evaluation.rollouts import evaluate, evaluation_task, wilson
from tracking.policy.feed_forward import joint_targets
from tracking.task.randomisation import Pushes, draw_robots
from tracking.task.rewards import action_rate, beyond_soft_limits, closeness, mean_square, reward_terms
from tracking.task.tracking_errors import ReferenceTables, TrackingErrors, compare, failures


@pytest.fixture(scope="module")
def reference(groove_file):
    return load_reference(groove_file, load_robot("dancer"))


def quiet(config=None):
    config = config or TaskConfig()
    return dataclasses.replace(
        config,
        start_noise=dataclasses.replace(config.start_noise, scale=0.0),
        randomisation=dataclasses.replace(config.randomisation, enabled=False),
    )


def make(reference, envs=4, **kwargs):
    return TrackingTask(robot=load_robot("dancer"), reference=reference, envs=envs, threads=1, **kwargs)


def tracked(robot, q, v):
    every, bodies = body_states(robot, q, v), [robot.body(b) for b in robot.profile.tracked]
    return BodyStates(**{k: getattr(every, k)[:, bodies] for k in ("pos", "quat", "lin_vel", "ang_vel")})


def zero_errors(n=1, k=14):
    return TrackingErrors(
        anchor_pos=np.zeros((n, 3)), anchor_angle=np.zeros(n), anchor_tilt=np.zeros(n), body_pos=np.zeros((n, k, 3)),
        body_angle=np.zeros((n, k)), body_lin_vel=np.zeros((n, k, 3)), body_ang_vel=np.zeros((n, k, 3)),
    )  # fmt: skip


def test_perfect_tracking_scores_the_maximum():
    c = RewardConfig()
    terms = reward_terms(zero_errors(), np.zeros((1, 28)), np.zeros((1, 28)), np.zeros(1), c)
    assert sum(v[0] for v in terms.values()) == pytest.approx(0.5 + 0.5 + 4 * 1.0)
    assert terms["action_rate"][0] == terms["joint_limit"][0] == 0.0


@pytest.mark.parametrize(
    "field, change, term, expected",
    [
        ("anchor_pos", [[0.3, 0, 0]], "anchor_position", 0.5 * np.exp(-1)),
        ("anchor_angle", [0.8], "anchor_orientation", 0.5 * np.exp(-4)),
        ("body_pos", np.full((1, 14, 3), 0.1), "body_position", np.exp(-0.03 / 0.09)),
        ("body_angle", np.full((1, 14), 0.4), "body_orientation", np.exp(-1)),
        ("body_lin_vel", np.full((1, 14, 3), [1.0, 0, 0]), "body_linear_velocity", np.exp(-1)),
        ("body_ang_vel", np.full((1, 14, 3), [0, 0, 3.14]), "body_angular_velocity", np.exp(-1)),
    ],
)
def test_each_reward_on_a_hand_computed_case(field, change, term, expected):
    errors = dataclasses.replace(zero_errors(), **{field: np.array(change, dtype=float)})
    terms = reward_terms(errors, np.zeros((1, 28)), np.zeros((1, 28)), np.zeros(1), RewardConfig())
    assert terms[term][0] == pytest.approx(expected)


def test_small_functions_by_hand():
    assert closeness(np.array([0.25]), 0.5)[0] == pytest.approx(np.exp(-1))
    assert mean_square(np.array([[[1.0, 2, 2], [0, 0, 0]]]))[0] == 4.5
    assert action_rate(np.array([[1.0, 2.0]]), np.array([[0.0, 0.0]]))[0] == 5.0
    over = beyond_soft_limits(np.array([[0.95, 0.0]]), np.array([-1.0, -1]), np.array([1.0, 1]), 0.9)
    assert over[0] == pytest.approx(0.05)


def test_the_reference_itself_has_no_error_and_a_turned_one_only_an_anchor_error(reference):
    robot = load_robot("dancer")
    tables, frame = ReferenceTables([reference], robot), np.array([60, 90])
    q, v = reference.qpos[frame], reference.qvel[frame]
    errors = compare(tracked(robot, q, v), tables, frame)
    assert max(np.abs(errors.body_pos).max(), np.abs(errors.body_lin_vel).max()) < 0.05  # velocities are differences
    assert np.abs(errors.body_pos).max() < 1e-9 and errors.anchor_angle.max() < 1e-6
    turn = rot.from_yaw(np.array(1.0))
    q[:, :3] = rot.rotate(np.tile(turn, (2, 1)), q[:, :3]) + [1.0, 2.0, 0.0]
    q[:, 3:7] = rot.multiply(np.tile(turn, (2, 1)), q[:, 3:7])
    moved = compare(tracked(robot, q, v), tables, frame)
    assert np.abs(moved.body_pos).max() < 1e-9 and moved.body_angle.max() < 1e-6
    assert moved.anchor_angle.min() > 0.9


def test_each_termination_fires_alone(reference):
    tables = ReferenceTables([reference], load_robot("dancer"))
    limits = TerminationConfig()
    base = zero_errors(1, len(tables.bodies))
    assert not any(v.any() for v in failures(base, tables, limits).values())
    low = dataclasses.replace(base, anchor_pos=np.array([[0, 0, 0.26]]))
    tilted = dataclasses.replace(base, anchor_tilt=np.array([0.81]))
    foot = base.body_pos.copy()
    foot[0, tables.ends[0], 2] = -0.26
    kicked = dataclasses.replace(base, body_pos=foot)
    for errors, cause in ((low, "anchor_height"), (tilted, "anchor_tilt"), (kicked, "end_effector_height")):
        assert [k for k, v in failures(errors, tables, limits).items() if v[0]] == [cause]


def test_body_sensors_agree_with_our_own_kinematics(reference, rng):
    task = make(reference, config=quiet())
    task.step(rng.normal(size=(4, 28)))
    task.reset(np.array([2]), np.array([50]))  # one read alone, the others as they were
    seen, to_device = task.sensors.states, tracked(task.robot, task.physics.qpos, task.physics.qvel)
    for name in ("pos", "lin_vel", "ang_vel"):
        np.testing.assert_allclose(getattr(seen, name), getattr(to_device, name), atol=1e-12)
    assert rot.angle_between(seen.quat, to_device.quat).max() < 1e-7


def test_the_prior_asks_for_the_torque_that_the_motion_needs(reference):
    robot = load_robot("dancer")
    target = joint_targets(reference, robot)
    middle = [0.5 * (x[1:] + x[:-1]) for x in (reference.joint_pos, reference.joint_vel, reference.joint_torque)]
    servo = robot.kp * (target[1:] - middle[0]) - robot.kd * middle[1]
    np.testing.assert_allclose(servo, middle[2], atol=1e-9)
    bare = joint_targets(dataclasses.replace(reference, joint_torque=None), robot)
    assert np.abs(robot.kp * (target - bare))[:, :12].max() > 20.0  # the legs carry the robot


def test_pushes_come_within_their_times_and_stay_away_when_off(reference):
    config = RandomisationConfig(push_every=(0.1, 0.2))
    for on in (True, False):
        pushes = Pushes(50, 0.02, dataclasses.replace(config, pushes=on), np.random.default_rng(0))
        qvel, rng, hits = np.zeros((50, 34)), np.random.default_rng(1), 0
        for _ in range(10):
            before = qvel.copy()
            pushes.apply(qvel, rng)
            hits += int((qvel != before).any(axis=1).sum())
        assert (50 <= hits <= 100) if on else hits == 0  # one or two in 0.2 s
        assert not qvel[:, 6:].any() and np.abs(qvel[:, 0]).max() <= 2 * config.push_linear[0]


def test_what_was_measured_before_is_shown_again(reference, rng):
    task = make(reference, config=dataclasses.replace(quiet(), look_back=(1, 2)))
    slices = task.actor.slices
    seen = [task.observe(noisy=False)[0]]
    for _ in range(3):
        task.step(0.1 * rng.normal(size=(4, 28)))
        seen.append(task.observe(noisy=False)[0])
    for name in ("gyro", "joint_pos", "joint_vel"):
        for back in (1, 2):
            np.testing.assert_array_equal(seen[3][:, slices[f"{name}_{back}_ago"]], seen[3 - back][:, slices[name]])


def test_batched_physics_is_mujocos_own(dancer, rng):
    model = training_model(dancer, 0.005)
    delay = np.array([0, 3, 6])  # physics steps of 5 ms in periods of 20 ms
    batch = MujocoBatch([model] * 3, control_dt=0.02, delay=0.005 * delay, threads=2)
    rest = np.tile(dancer.default_qpos, (3, 1))
    batch.set(np.arange(3), rest, np.zeros((3, model.nv)), rest[:, 7:])
    targets = dancer.default_joint_pos + 0.1 * rng.normal(size=(5, 3, 28))
    singles = []
    for k in range(3):
        data = mujoco.MjData(model)
        data.qpos[:] = dancer.default_qpos
        for step in range(20):
            if step % 4 == 0:
                data.qacc_warmstart[:] = 0.0  # rollout starts every call cold
            heard = step - delay[k]
            data.ctrl[:] = targets[heard // 4, k] if heard >= 0 else dancer.default_joint_pos
            mujoco.mj_step(model, data, 1)
        singles.append(np.array(data.qpos))
    for t in range(5):
        batch.step(targets[t])
    np.testing.assert_allclose(batch.qpos, singles, atol=1e-7)
    batch.close()


def test_observations_are_of_the_state_after_the_step_not_one_physics_step_before(reference):
    task = make(reference, config=quiet())
    task.reset(np.arange(4), np.array([10, 20, 30, 40]))
    task.step(np.zeros((4, 28)))
    seen, _ = task.observe(noisy=False)
    slices = task.actor.slices
    data = mujoco.MjData(task.robot.model)
    for k in range(4):
        data.qpos[:], data.qvel[:] = task.physics.qpos[k], task.physics.qvel[k]
        mujoco.mj_forward(task.robot.model, data)
        gyro = data.sensor("gyro").data
        np.testing.assert_allclose(seen[k, slices["gyro"]], 0.25 * gyro, atol=1e-6)
        joints = data.qpos[7:] - task.robot.default_joint_pos
        np.testing.assert_allclose(seen[k, slices["joint_pos"]], joints, atol=1e-6)


def test_the_actor_sees_only_what_a_robot_measures(reference):
    task = make(reference)
    assert all(t.measurable for t in task.actor.rows)
    assert not all(t.measurable for t in task.privileged.rows)
    assert max(s.stop for s in task.actor.slices.values()) == task.actor.size


def test_zero_action_from_a_perfect_start_scores_nearly_the_maximum_at_first(reference):
    task = make(reference, config=quiet())
    task.reset(np.arange(4), np.full(4, reference.dance.start))
    result = task.step(np.zeros((4, 28)))
    assert (result.reward / task.dt > 0.9 * 5.0).all()
    assert not result.terminated.any()


def test_running_out_of_clip_truncates_and_falling_terminates(reference):
    task = make(reference, config=quiet())
    task.reset(np.arange(4), np.full(4, reference.frames - 2))
    result = task.step(np.zeros((4, 28)))
    assert result.truncated.all() and not result.terminated.any()
    task.reset(np.arange(4), np.full(4, 20))
    task.physics.qpos[0, 2] += 0.5
    fallen = task.step(np.zeros((4, 28)))
    assert fallen.terminated[0] and not fallen.truncated[0]
    assert fallen.causes["anchor_height"][0]


def test_same_seed_same_steps_other_seed_other_steps(reference, rng):
    actions = rng.normal(size=(10, 4, 28))

    def play(seed):
        task = make(reference, seed=seed)
        return np.stack([task.step(a).reward for a in actions]), task.observe()[0]

    (a, seen_a), (b, seen_b), (c, _) = play(3), play(3), play(4)
    np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(seen_a, seen_b)
    assert np.abs(a - c).max() > 0


def test_randomisation_makes_different_robots_and_off_makes_one(reference):
    robot = load_robot("dancer")
    drawn = draw_robots(robot, 5, 0.005, RandomisationConfig(), np.random.default_rng(0))
    masses = [m.body_mass.sum() for m in drawn.models]
    assert len(set(drawn.delay)) == 5 and drawn.delay.max() <= 0.02
    assert len(set(np.round(masses, 6))) == 5
    assert np.abs(np.array(masses) / robot.model.body_mass.sum() - 1).max() < 0.05
    plain = draw_robots(robot, 5, 0.005, RandomisationConfig(enabled=False), np.random.default_rng(0)).models
    assert all(m is plain[0] for m in plain)
    assert robot.model.geom_contype.sum() > plain[0].geom_contype.sum()  # the robot's own model is left alone


def test_a_saved_task_goes_on_bit_for_bit(reference, rng):
    actions = rng.normal(size=(8, 4, 28))
    one = make(reference)
    for a in actions[:4]:
        one.step(a)
    state = one.state_dict()
    rest = [one.step(a).reward for a in actions[4:]]
    seen = one.observe()[0]
    two = make(reference)
    two.load_state_dict(state)
    np.testing.assert_array_equal(rest, [two.step(a).reward for a in actions[4:]])
    np.testing.assert_array_equal(seen, two.observe()[0])


def test_evaluation_of_doing_nothing_counts_the_fallen(reference):
    robot = load_robot("dancer")
    result = evaluate(
        lambda seen: np.zeros((len(seen), 28)), robot, reference, evaluation_task(TaskConfig()), rollouts=8, threads=1
    )
    assert 0.0 < result.survived_s <= result.duration_s
    assert result.finished_low <= result.finished <= result.finished_high
    assert len(next(iter(result.shown.values()))) >= 2 and sum(result.causes.values()) >= round(
        8 * (1 - result.finished)
    )
    assert sum(s.failed for s in result.seconds) == round(8 * (1 - result.finished))
    assert result.finished_in_place <= result.finished and result.hardest in result.seconds
    assert 0.0 < sum(result.terms.values()) < 5.0
    json.dumps(result.as_dict(), allow_nan=False)


def test_wilson_interval_by_hand():
    low, high = wilson(50, 100)
    assert (low, high) == (pytest.approx(0.4038, abs=1e-3), pytest.approx(0.5962, abs=1e-3))
    assert wilson(100, 100)[1] == pytest.approx(1.0) and wilson(100, 100)[0] == pytest.approx(0.963, abs=1e-3)


def test_a_control_period_that_is_no_whole_number_of_steps_is_refused(dancer):
    with pytest.raises(TrackingError, match="whole number"):
        MujocoBatch([training_model(dancer, 0.005)], control_dt=1 / 30)


@pytest.mark.filterwarnings("ignore:.*A Box observation space")  # joint speeds have no bound to state
def test_gymnasiums_own_checker_is_content(groove_file):
    import gymnasium
    from gymnasium.utils.env_checker import check_env

    import tracking.envs  # noqa: F401  (registers the ids)

    env = gymnasium.make("DanceTracking-v0", reference=groove_file)
    check_env(env.unwrapped, skip_render_check=True)
    first, info = env.reset(seed=5)
    again, _ = env.reset(seed=5)
    np.testing.assert_array_equal(first, again)
    assert info["frame"] >= 0
    _, reward, terminated, truncated, info = env.step(np.zeros(28, dtype=np.float32))
    assert reward > 0 and not terminated and not truncated
    assert set(info["reward_terms"]) == set(reward_names())
    env.close()


def reward_names():
    return reward_terms(zero_errors(), np.zeros((1, 28)), np.zeros((1, 28)), np.zeros(1), RewardConfig())


DRAW = """
import gymnasium, tracking.envs
env = gymnasium.make("DanceTracking-v0", reference={path!r}, render_mode="rgb_array")
env.reset(seed=0)
picture = env.render()
print(picture.shape, picture.std() > 5)
env.close()
"""


def test_the_environment_draws_itself(groove_file):
    """In a process of its own: the way to draw is chosen when MuJoCo is imported, and may be missing altogether."""
    said = []
    for way in ("egl", "osmesa", "glfw"):
        run = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", DRAW.format(path=str(groove_file))], capture_output=True, text=True,
            env={**os.environ, "MUJOCO_GL": way},
        )  # fmt: skip
        if run.returncode == 0:
            assert run.stdout.split("\n")[0] == "(480, 640, 3) True"
            return
        said.append(run.stderr.strip().splitlines()[-1])
    if not all(re.search(r"\bgl|GL|DISPLAY|Display|Mesa", line) for line in said):
        pytest.fail(f"drawing failed for another reason than a missing GL: {said}")
    pytest.skip(f"no off-screen rendering on this machine: {said}")


def test_delays_and_pushes_grow_with_the_training(reference):
    task, heard = make(reference), []
    for progress in (0.0, 0.15, 0.3, 1.0):
        task.advance_curriculum(progress)
        heard.append((task.physics._which > 0).sum())
        assert task.pushes.strength == pytest.approx(min(1.0, progress / 0.3))
    assert heard[0] == 0 < heard[1] < heard[2] == heard[3]


def test_references_of_two_rates_are_refused(reference):
    with pytest.raises(TrackingError, match="30 and 50 frames per second"):
        make([reference, dataclasses.replace(reference, fps=30.0)])
