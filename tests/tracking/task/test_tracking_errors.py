"""Robot against reference: nothing off is no error; heading and place count where they shall, and only there."""

import dataclasses
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import tracking
from clips import load_reference
from robot_models import BodyStates
from robot_models.maths import rotation as rot
from tracking.config import TerminationConfig
from tracking.task.tracking_errors import ReferenceTables, compare, failures

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
LIMITS = TerminationConfig()
FRAMES = np.array([70, 200, 333, 480])


@pytest.fixture(scope="module")
def tables(dancer):
    return ReferenceTables([load_reference(FILE, dancer)], dancer)


def perfect(tables, frame=FRAMES):
    return BodyStates(
        pos=tables.pos[frame], quat=tables.quat[frame], lin_vel=tables.lin_vel[frame], ang_vel=tables.ang_vel[frame]
    )


def wobbly(tables, rng):
    """Robots that are somewhat off in everything."""
    exact = perfect(tables)
    return BodyStates(
        pos=exact.pos + 0.1 * rng.normal(size=exact.pos.shape),
        quat=rot.multiply(exact.quat, rot.exp(0.2 * rng.normal(size=exact.pos.shape))),
        lin_vel=exact.lin_vel + 0.3 * rng.normal(size=exact.pos.shape),
        ang_vel=exact.ang_vel + 0.3 * rng.normal(size=exact.pos.shape),
    )


def moved(states, yaw=0.0, by=(0.0, 0.0, 0.0)):
    turn = np.broadcast_to(rot.from_yaw(np.array(yaw)), states.quat.shape)
    return BodyStates(
        pos=rot.rotate(turn, states.pos) + np.array(by), quat=rot.multiply(turn, states.quat),
        lin_vel=rot.rotate(turn, states.lin_vel), ang_vel=rot.rotate(turn, states.ang_vel),
    )  # fmt: skip


def as_arrays(errors):
    return {f.name: getattr(errors, f.name) for f in dataclasses.fields(errors)}


def test_a_robot_that_is_where_the_reference_is_has_no_error_at_all(tables):
    for name, error in as_arrays(compare(perfect(tables), tables, FRAMES)).items():
        assert np.abs(error).max() < 1e-7, name  # angles: square roots of rounding errors


def test_one_body_that_is_off_is_the_only_one_with_an_error_and_it_points_from_robot_to_reference(tables):
    body = next(b for b in range(len(tables.bodies)) if b != tables.anchor)
    states, off = perfect(tables), np.array([0.03, -0.02, 0.05])
    pos = states.pos.copy()
    pos[:, body] -= off
    error = compare(dataclasses.replace(states, pos=pos), tables, FRAMES).body_pos
    np.testing.assert_allclose(error[:, body], np.tile(off, (4, 1)), atol=1e-12)
    assert np.abs(np.delete(error, body, axis=1)).max() < 1e-12


@pytest.mark.parametrize("yaw", [0.4, -2.0, np.pi])
@pytest.mark.parametrize("by", [(0.0, 0.0), (3.0, -7.0)])
def test_heading_and_place_on_the_floor_do_not_count_for_bodies_but_for_the_anchor(tables, rng, yaw, by):
    states = wobbly(tables, rng)
    here, there = compare(states, tables, FRAMES), compare(moved(states, yaw, (*by, 0.0)), tables, FRAMES)
    # Body errors are told in the robot's heading: they turn with it, and nothing else happens to them.
    turn = np.broadcast_to(rot.from_yaw(np.array(yaw)), (*here.body_angle.shape, 4))
    np.testing.assert_allclose(there.body_pos, rot.rotate(turn, here.body_pos), atol=1e-12)
    np.testing.assert_allclose(there.body_angle, here.body_angle, atol=1e-7)
    np.testing.assert_allclose(there.anchor_tilt, here.anchor_tilt, atol=1e-12)
    np.testing.assert_allclose(there.anchor_pos[:, 2], here.anchor_pos[:, 2], atol=1e-12)
    assert (np.abs(there.anchor_angle - here.anchor_angle) > 0.05).all()
    # In the room: a robot that dances the same way in another direction has other velocities than it should.
    assert np.abs(there.body_lin_vel - here.body_lin_vel).max() > 0.05


def test_height_counts_for_every_body(tables, rng):
    states = wobbly(tables, rng)
    low, high = (compare(moved(states, by=(0.0, 0.0, z)), tables, FRAMES) for z in (0.0, 0.2))
    np.testing.assert_allclose(high.body_pos, low.body_pos - (0.0, 0.0, 0.2), atol=1e-12)
    np.testing.assert_allclose(high.anchor_pos, low.anchor_pos - (0.0, 0.0, 0.2), atol=1e-12)


def test_a_quaternion_and_its_negative_are_one_rotation_and_xyzw_is_another(tables, rng):
    states = wobbly(tables, rng)
    flipped = dataclasses.replace(states, quat=-states.quat)
    here, there = as_arrays(compare(states, tables, FRAMES)), as_arrays(compare(flipped, tables, FRAMES))
    for name, error in here.items():
        np.testing.assert_allclose(there[name], error, atol=1e-7, err_msg=name)
    swapped = dataclasses.replace(perfect(tables), quat=rot.to_quat_xyzw(tables.quat[FRAMES]))
    assert compare(swapped, tables, FRAMES).anchor_angle.min() > 0.5


def test_tensors_have_the_same_errors_as_arrays(tables, rng):
    torch = pytest.importorskip("torch")
    states = wobbly(tables, rng)
    on = tables.on(torch.from_numpy)
    theirs = BodyStates(**{k: torch.from_numpy(v) for k, v in vars(states).items()})
    here, there = compare(states, tables, FRAMES), compare(theirs, on, torch.from_numpy(FRAMES))
    for name, error in as_arrays(there).items():
        np.testing.assert_allclose(error.numpy(), getattr(here, name), atol=1e-12, err_msg=name)
    assert isinstance(tables.pos, np.ndarray)  # the tables in memory stay there


def test_what_has_failed_fails_too_when_every_error_is_larger(tables, rng):
    errors = compare(wobbly(tables, rng), tables, FRAMES)
    seen = []
    for factor in (0.0, 0.5, 1.0, 2.0, 4.0, 100.0):
        scaled = dataclasses.replace(errors, **{k: factor * v for k, v in as_arrays(errors).items()})
        seen.append(np.stack(list(failures(scaled, tables, LIMITS).values())))
    assert not seen[0].any() and seen[-1].all()
    assert all((before <= after).all() for before, after in pairwise(seen))


def test_too_high_fails_as_too_low_does_and_leaning_forwards_as_back(tables, rng):
    errors = compare(wobbly(tables, rng), tables, FRAMES)
    for factor in (1.0, 5.0, 100.0):
        seen = [
            failures(dataclasses.replace(errors, **{k: s * v for k, v in as_arrays(errors).items()}), tables, LIMITS)
            for s in (factor, -factor)
        ]
        for cause, failed in seen[0].items():
            np.testing.assert_array_equal(failed, seen[1][cause], err_msg=cause)


def test_errors_along_the_floor_and_of_inner_bodies_end_nothing(tables):
    errors = compare(perfect(tables), tables, FRAMES)
    body = np.full(errors.body_pos.shape, 5.0)
    body[:, tables.ends, 2] = 0.0
    wide = dataclasses.replace(errors, anchor_pos=np.tile([9.0, 9.0, 0.0], (4, 1)), body_pos=body)
    assert not any(v.any() for v in failures(wide, tables, LIMITS).values())


def test_several_references_stand_one_after_the_other_and_no_step_leads_from_one_into_the_next(dancer):
    whole = load_reference(FILE, dancer)
    both, alone = ReferenceTables([whole, whole], dancer), ReferenceTables([whole], dancer)
    n, every = whole.frames, np.arange(2 * whole.frames)
    for name in ("qpos", "qvel", "joint_pos", "joint_vel", "pos", "quat", "lin_vel", "ang_vel"):
        np.testing.assert_array_equal(getattr(both, name), np.tile(getattr(alone, name).T, 2).T, err_msg=name)
    assert list(both.openings) == [whole.dance.start, n + whole.dance.start] and both.frames == 2 * n
    assert (both.first <= every).all() and (every <= both.last).all() and set(both.last) == {n - 1, 2 * n - 1}
    for a, b in ((1, 5), (50, 1000), (0, 0)):
        there = both.ahead(both.ahead(every, a), b)
        np.testing.assert_array_equal(there, both.ahead(every, a + b))  # steps add up
        assert ((there < n) == (every < n)).all()
