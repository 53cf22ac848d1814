"""The observation table: rows side by side, each number in its own place, noise where the table says and nowhere else."""

import copy
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import tracking
from clips import load_reference
from robot_models import BodyStates
from robot_models.maths import rotation as rot
from tracking.config import ObservationNoise, RandomisationConfig, TaskConfig
from tracking.policy.contract import Row
from tracking.task.observations import actor_table, privileged_table
from tracking.task.tracking_task import TrackingTask

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
BACK = (1, 3)
STRAIGHT = np.tile(rot.IDENTITY, (5, 1))


@pytest.fixture(scope="module")
def task(dancer):
    config = TaskConfig(
        randomisation=RandomisationConfig(push_every=(0.02, 0.06)),
        look_back=BACK,
        look_ahead=(0, 1, 5),
        root_ahead=True,
    )
    made = TrackingTask(robot=dancer, reference=load_reference(FILE, dancer), envs=5, config=config, seed=2, threads=1)
    made.reset(np.arange(5), np.array([70, 200, 333, 480, made.tables.frames - 8]))
    for k in range(6):
        made.step(0.2 * np.sin(k + np.arange(28)) * np.ones((5, 1)))
    yield made
    made.close()


@pytest.fixture(params=["actor", "privileged"])
def table(task, request):
    return getattr(task, request.param)


def test_slices_tile_the_observation_in_order_and_names_are_different(table, task):
    ends = [0]
    for name, part in table.slices.items():
        assert part.start == ends[-1] < part.stop, name
        ends.append(part.stop)
    assert ends[-1] == table.size == table.values(task.task_state()).shape[1]
    assert len(table.slices) == len(table.rows)


def test_every_row_has_the_numbers_that_it_states_at_the_scale_that_it_states(table, task):
    s = task.task_state()
    values = table.values(s)
    assert values.dtype == np.float32
    for term, compute in zip(table.rows, table.computes, strict=True):
        raw = compute(s)
        assert raw.shape == (task.envs, term.size), term.name
        # float32 has seven digits
        np.testing.assert_allclose(values[:, table.slices[term.name]], term.scale * raw, rtol=1e-6, atol=1e-6)


def test_rows_of_one_kind_are_alike_but_for_their_time(task):
    by_kind = {}
    for row in task.actor.rows:
        by_kind.setdefault(row.kind, []).append(dataclasses.replace(row, at=0))
    assert all(len(set(rows)) == 1 for rows in by_kind.values())
    assert len(by_kind["gyro"]) == 1 + len(BACK) and len(by_kind["reference_joint_pos"]) == 3


def test_rows_are_what_a_file_can_hold(table):
    again = [Row(**row) for row in json.loads(json.dumps([dataclasses.asdict(row) for row in table.rows]))]
    assert again == list(table.rows) and [r.name for r in again] == list(table.slices)


def tagged(frames, joints):
    """Numbers that say which joint and which frame they are of."""
    return 100.0 * np.arange(joints) + np.arange(frames)[:, None]


def test_every_number_is_of_its_own_joint_and_frame(task):
    """Tagged data: any swap of joints, frames, or of past and present shows."""
    tables, s = copy.copy(task.tables), task.task_state()
    tables.joint_pos, tables.joint_vel = tagged(tables.frames, 28), -tagged(tables.frames, 28)
    noise = ObservationNoise()
    seen = actor_table(task.robot, tables, noise, (0, 1, 5), BACK)
    qpos, qvel = np.zeros_like(s.qpos), np.zeros_like(s.qvel)
    qpos[:, :, 7:] = (100.0 * np.arange(28) + np.arange(4)[:, None])[:, None]
    qvel[:, :, 6:], qvel[:, :, 3:6] = -qpos[:, :, 7:], np.arange(4)[:, None, None] + [[[0.1, 0.2, 0.3]]]
    last = np.tile(100.0 * np.arange(28) + 7.0, (5, 1))
    tags = dataclasses.replace(s, qpos=qpos, qvel=qvel, last_action=last, encoder_bias=np.zeros((5, 28)), imu=STRAIGHT)
    values, default = seen.values(tags), task.robot.default_joint_pos

    def told(name):
        return values[:, seen.slices[name]]

    for name, ahead in (("", 0), ("_1", 1), ("_5", 5)):
        at = np.minimum(s.frame + ahead, tables.last[s.frame])
        where = 100.0 * np.arange(28) + at[:, None]
        np.testing.assert_allclose(told(f"reference_joint_pos{name}"), where - default, rtol=1e-6)
        np.testing.assert_allclose(told(f"reference_joint_vel{name}"), -0.1 * where, rtol=1e-6)
    for name, back in (("", 0), ("_1_ago", 1), ("_3_ago", 3)):
        where = 100.0 * np.arange(28) + back
        np.testing.assert_allclose(told(f"joint_pos{name}"), np.tile(where - default, (5, 1)), rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(told(f"joint_vel{name}"), np.tile(-0.1 * where, (5, 1)), rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(
            told(f"gyro{name}"), np.tile(0.25 * (back + np.array([0.1, 0.2, 0.3])), (5, 1)), rtol=1e-6
        )
    np.testing.assert_array_equal(told("last_action"), last)


def test_an_encoders_bias_is_seen_in_positions_now_and_before_and_nowhere_else(task):
    s = task.task_state()
    bias = np.linspace(-0.03, 0.03, 28) * np.ones((5, 1))
    without, biased = (task.actor.values(dataclasses.replace(s, encoder_bias=b)) for b in (np.zeros((5, 28)), bias))
    for row in task.actor.rows:
        apart = (biased - without)[:, task.actor.slices[row.name]]
        np.testing.assert_allclose(apart, bias if row.kind == "joint_pos" else 0.0, atol=1e-6, err_msg=row.name)


def turned(s, yaw, by):
    """The same situation somewhere else in the room: robot, its heading, and how it moves."""
    turn = rot.from_yaw(np.array(yaw))

    def vectors(v):
        return rot.rotate(np.broadcast_to(turn, (*v.shape[:-1], 4)), v)

    def turns(q):
        return rot.multiply(np.broadcast_to(turn, q.shape), q)

    qpos, qvel, b = s.qpos.copy(), s.qvel.copy(), s.states
    qpos[..., :3], qpos[..., 3:7] = vectors(qpos[..., :3]) + by, turns(qpos[..., 3:7])
    qvel[..., :3] = vectors(qvel[..., :3])
    states = BodyStates(
        pos=vectors(b.pos) + by, quat=turns(b.quat), lin_vel=vectors(b.lin_vel), ang_vel=vectors(b.ang_vel)
    )
    return dataclasses.replace(s, qpos=qpos, qvel=qvel, states=states, heading=turns(s.heading))


@pytest.mark.parametrize("yaw", [1.0, -2.5])
def test_the_actor_cannot_tell_where_in_the_room_it_stands_nor_which_way_it_faces(task, yaw):
    s = task.task_state()
    there = turned(s, yaw, np.array([4.0, -2.0, 0.0]))
    np.testing.assert_allclose(task.actor.values(there), task.actor.values(s), atol=2e-6)
    slices, here, apart = task.privileged.slices, task.privileged.values(s), task.privileged.values(there)
    for name in ("root_lin_vel", "body_pos", "phase"):
        np.testing.assert_allclose(apart[:, slices[name]], here[:, slices[name]], atol=2e-6, err_msg=name)
    assert np.abs(apart - here)[:, slices["anchor_position"]].min(axis=1).max() > 0.1  # the critic can
    # Negative control: a velocity in the room's axes, taken for one in the body's, gives itself away.
    assert np.abs(there.qvel[0, :, :3] - s.qvel[0, :, :3]).max() > 0.05


def test_a_robot_in_the_references_own_pose_sees_no_turn_and_no_way_to_go(task):
    tables, frame = task.tables, np.array([70, 200, 333, 480, 600])
    qpos, qvel = np.tile(tables.qpos[frame], (4, 1, 1)), np.tile(tables.qvel[frame], (4, 1, 1))
    states = BodyStates(
        pos=tables.pos[frame], quat=tables.quat[frame], lin_vel=tables.lin_vel[frame], ang_vel=tables.ang_vel[frame]
    )
    s = dataclasses.replace(
        task.task_state(), qpos=qpos, qvel=qvel, states=states, frame=frame, heading=np.tile(rot.IDENTITY, (5, 1)),
        encoder_bias=np.zeros((5, 28)), imu=STRAIGHT,
    )  # fmt: skip
    actor, critic = task.actor.values(s), task.privileged.values(s)
    slices = task.actor.slices
    np.testing.assert_allclose(actor[:, slices["anchor_orientation"]], np.tile([1, 0, 0, 1, 0, 0], (5, 1)), atol=1e-6)
    np.testing.assert_allclose(critic[:, task.privileged.slices["anchor_position"]], 0.0, atol=1e-6)
    # Two roads to one number: what the robot measures, and what the reference says of the same frame.
    for kind in ("pos", "vel"):
        np.testing.assert_allclose(
            actor[:, slices[f"joint_{kind}"]], actor[:, slices[f"reference_joint_{kind}"]], atol=1e-5
        )
    wrong = dataclasses.replace(s, states=dataclasses.replace(states, quat=rot.to_quat_xyzw(states.quat)))
    assert np.abs(task.actor.values(wrong) - actor)[:, slices["anchor_orientation"]].max() > 0.5


def test_the_six_numbers_of_an_orientation_are_two_columns_of_a_rotation(task):
    six = task.actor.values(task.task_state())[:, task.actor.slices["anchor_orientation"]].reshape(-1, 3, 2)
    np.testing.assert_allclose(np.einsum("nij,nik->njk", six, six), np.tile(np.eye(2), (5, 1, 1)), atol=1e-6)


def test_the_phase_goes_from_nothing_to_one_and_never_back(task):
    s = task.task_state()
    every = np.arange(task.tables.frames)[::70].clip(max=task.tables.frames - 1)
    frames = np.unique([*every, task.tables.frames - 1])
    table = privileged_table(task.tables)
    compute = table.computes[[row.kind for row in table.rows].index("phase")]
    phase = compute(dataclasses.replace(s, frame=frames))
    assert phase[0] == 0.0 and phase[-1] == 1.0 and (np.diff(phase[:, 0]) > 0.0).all()


def test_noise_is_on_noisy_rows_alone_within_its_width_and_fills_it(task):
    values = np.tile(task.actor.values(task.task_state()), (40, 1))
    kept = values.copy()
    apart = task.actor.disturbed(values, np.random.default_rng(0)) - values
    np.testing.assert_array_equal(values, kept)
    noisy = 0
    for row in task.actor.rows:
        part = apart[:, task.actor.slices[row.name]]
        assert np.abs(part).max() <= row.noise + 1e-5, row.name  # float32 of numbers up to some tens
        if row.noise:
            noisy += 1
            assert part.max() > 0.9 * row.noise and part.min() < -0.9 * row.noise
            assert abs(part.mean()) < 0.1 * row.noise
            assert np.abs(np.corrcoef(part[:, 0], part[:, 1])[0, 1]) < 0.3  # each number has its own
    assert noisy == 1 + 3 * (1 + len(BACK))
    assert {r.kind for r in task.actor.rows if not r.noise} == {
        "reference_joint_pos",
        "reference_joint_vel",
        "reference_planar_velocity",
        "reference_root_height",
        "last_action",
    }


def test_the_critic_sees_the_actors_numbers_without_their_noise(task):
    noisy, critic = task.observe()
    clean, _ = task.observe(noisy=False)
    np.testing.assert_array_equal(critic[:, : task.actor.size], clean)
    assert (noisy != clean).any() and critic.shape[1] == task.actor.size + task.privileged.size
