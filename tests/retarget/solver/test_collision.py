"""Gaps of soles and bodies: where they are, how they change in every coordinate, and the springs that keep them."""

from collections import Counter

import numpy as np
import pytest
from derivatives import TOLERANCE, assert_derivatives, central, random_poses, spoiled

from retarget.solver.collision import WORLD, Clearance, Places, Proximity, Watch, low_soles, too_near
from robot_models import load_robot
from robot_models.geometry import body_geoms, self_collisions
from robot_models.maths import rotation as rot
from robot_models.rigid_body.jacobians import ancestors, integrate, kinematics


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


@pytest.fixture
def near_floor(robot, rng):
    """Random poses with something of the robot about the floor."""
    qpos = random_poses(robot, rng)
    qpos[:, 2] = 0.3
    return qpos


def rows_of(places, kin):
    """The derivative of every gap, read off the pull of one spring of strength 1 that is 1 m too short."""
    out, nv = np.zeros((len(places.gap), kin.robot.model.nv)), kin.robot.model.nv
    for k in range(len(out)):
        one = places.where(np.arange(len(out)) == k)
        blocks, gradient = np.zeros((len(kin.pos), nv, nv)), np.zeros((len(kin.pos), nv))
        Clearance(one, kin, one.gap + 1.0, np.ones(1)).add_to(blocks, gradient)
        out[k] = -gradient[one.frame[0]]
        assert not np.delete(gradient, one.frame[0], axis=0).any()
    return out


def gaps_of_points(robot, places, qpos):
    """Gaps between two points, each fixed to its body, along normals that stay: (poses, places)."""
    start, ends = kinematics(robot, qpos), (places.first, places.second)
    arms = [places.point - start.pos[places.frame, body] for body in ends]
    local = [rot.rotate(rot.conjugate(start.quat[places.frame, body]), a) for body, a in zip(ends, arms, strict=True)]

    def gaps(poses, q):
        kin = kinematics(robot, q)
        first, second = (
            np.where((body == WORLD)[:, None], places.point, kin.pos[:, body] + rot.rotate(kin.quat[:, body], a))
            for body, a in zip(ends, local, strict=True)
        )
        return np.sum(places.normal * (second - first), axis=2)

    return gaps


def test_gaps_of_soles_change_in_every_coordinate_as_their_rows_say(robot, rng):
    qpos = random_poses(robot, rng)

    def heights(poses, q):
        return low_soles(robot, kinematics(robot, q), 10.0).gap.reshape(len(q), 8)  # so wide that none is left out

    kin = kinematics(robot, qpos)
    places = low_soles(robot, kin, 10.0)
    np.testing.assert_array_equal(places.frame, np.repeat([0, 1, 2], 8))
    rows = rows_of(places, kin).reshape(3, 8, -1)
    slopes = central(heights, qpos)
    assert_derivatives(rows, slopes)
    moves = np.abs(rows).max(axis=(0, 1)) > 1e-12
    legs = ancestors(robot)[[robot.body(s.body) for s in robot.soles.values()]].any(axis=0)
    np.testing.assert_array_equal(moves[6:], legs)  # no arm lifts a foot
    np.testing.assert_array_equal(
        moves[:6], [False, False, True, True, True, False]
    )  # nor a step or a turn on the floor
    for column, bad in spoiled(rows):
        if moves[column]:
            with pytest.raises(AssertionError, match=f"column {column} off"):
                assert_derivatives(bad, slopes)


def test_gaps_of_bodies_change_as_those_of_two_points_fixed_to_them(robot, near_floor):
    places = Proximity(robot, 0.1)(near_floor)
    assert len(places.gap) > 15
    rows = rows_of(places, kinematics(robot, near_floor))
    slopes = central(gaps_of_points(robot, places, near_floor), near_floor)
    slopes = slopes[places.frame, np.arange(len(places.gap))]
    assert_derivatives(rows, slopes)
    for column, bad in spoiled(rows):
        if np.abs(rows[:, column]).max() > 1e-12:
            with pytest.raises(AssertionError, match=f"column {column} off"):
                assert_derivatives(bad, slopes)


def test_gaps_that_mujoco_measures_again_change_as_their_rows_say(robot, near_floor):
    """The points where two surfaces are nearest wander as the bodies move, but only along the surfaces."""
    find, nv, step = Proximity(robot, 0.1), robot.model.nv, 1e-6
    places = find(near_floor)
    rows = rows_of(places, kinematics(robot, near_floor))
    pairs = Counter(zip(places.frame, places.first, places.second, strict=True))
    tried = 0
    for t, q in enumerate(near_floor):
        ahead, behind = (find(integrate(np.repeat(q[None], nv, axis=0), s * np.eye(nv))) for s in (step, -step))
        for k in np.flatnonzero(places.frame == t):
            same = [p.where((p.first == places.first[k]) & (p.second == places.second[k])) for p in (ahead, behind)]
            # Boxes have several places: which is which cannot be told.
            if pairs[t, places.first[k], places.second[k]] > 1 or any(len(p.gap) != nv for p in same):
                continue
            tried += 1
            np.testing.assert_allclose((same[0].gap - same[1].gap) / (2.0 * step), rows[k], atol=TOLERANCE)
    assert tried >= 8


def test_springs_cost_what_energies_of_springs_do_however_many_a_frame_has(dancer, rng):
    """Half of every spring's square, of its gap after the step, for those that are too near before it."""
    qpos = random_poses(dancer, rng, 4)
    kin, nv = kinematics(dancer, qpos), dancer.model.nv
    soles, counts = low_soles(dancer, kin, 10.0), [1, 4, 8, 16]  # up to four, up to eight and more go different ways
    places = soles.along_with(soles)
    place = np.concatenate([np.flatnonzero(places.frame == t)[:n] for t, n in enumerate(counts)])
    places = places.where(np.isin(np.arange(len(places.gap)), place))
    assert np.bincount(places.frame).tolist() == counts
    wanted, spring = places.gap + rng.normal(size=len(places.gap)), rng.uniform(0.5, 2.0, len(places.gap))
    blocks, gradient = np.zeros((4, nv, nv)), np.zeros((4, nv))
    Clearance(places, kin, wanted, spring).add_to(blocks, gradient)
    step, rows = rng.normal(size=(4, nv)), rows_of(places, kin)
    short = places.gap - wanted
    after = short + np.sum(rows * step[places.frame], axis=1)
    energy = 0.5 * spring**2 * (after**2 - short**2) * (short < 0.0)
    given = np.sum(gradient * step, axis=1) + 0.5 * np.einsum("ti,tij,tj->t", step, blocks, step)
    np.testing.assert_allclose(given, np.bincount(places.frame, energy), rtol=1e-9)


def test_a_place_joins_when_a_step_would_bring_it_too_near_and_leaves_when_it_would_part_it(dancer):
    qpos = np.tile(dancer.default_qpos, (3, 1))
    qpos[:, 2] += 0.02
    kin, nv = kinematics(dancer, qpos), dancer.model.nv
    places = low_soles(dancer, kin, 0.05)
    clearance = Clearance(places, kin, np.full(24, 0.01), np.ones(24))
    down = np.zeros((3, nv))
    down[:, 2] = [0.0, -0.0095, -0.02]  # a centimetre over what is wanted: half a millimetre left, and one too many

    def pulled():
        blocks, gradient = np.zeros((3, nv, nv)), np.zeros((3, nv))
        clearance.add_to(blocks, gradient)
        return np.abs(gradient).any(axis=1).tolist()

    assert pulled() == [False, False, False]
    assert clearance.update(down) == 8 and pulled() == [False, False, True]
    assert clearance.update(down) == 0  # at rest
    assert clearance.update(np.zeros((3, nv))) == 8 and pulled() == [False, False, False]


def test_places_of_two_sources_stay_together_and_in_time_order(dancer, rng):
    qpos = random_poses(dancer, rng, 6)
    places = low_soles(dancer, kinematics(dancer, qpos), 10.0)
    odd = places.frame % 2 == 1
    again = places.where(odd).along_with(places.where(~odd))
    for name in ("frame", "first", "second", "point", "normal", "gap"):
        np.testing.assert_array_equal(getattr(again, name), getattr(places, name))
    nothing = places.where(np.zeros(len(places.gap), dtype=bool))
    assert isinstance(nothing.along_with(nothing), Places) and not len(nothing.along_with(nothing).gap)


def test_the_deepest_overlap_is_that_of_the_report_and_normals_lead_from_first_to_second(robot, rng):
    qpos = random_poses(robot, rng, 6)
    qpos[:, 2] = 5.0  # far from the floor
    places = Proximity(robot, 0.01)(qpos)
    deepest = [-places.gap[places.frame == t].min(initial=0.0) for t in range(6)]
    np.testing.assert_allclose(deepest, self_collisions(robot, qpos).depth, atol=1e-12)
    assert max(deepest) > 0.02
    np.testing.assert_allclose(np.linalg.norm(places.normal, axis=1), 1.0, atol=1e-9)


def test_the_lowest_gap_over_the_floor_is_the_one_that_mujocos_plane_gives(robot, rng):
    import mujoco

    qpos = random_poses(robot, rng, 4)
    qpos[:, 2] = 0.1
    places, data = Proximity(robot, 0.02)(qpos), mujoco.MjData(robot.model)
    floor = robot.model.geom("floor").id
    for t, q in enumerate(qpos):
        data.qpos[:] = q
        mujoco.mj_kinematics(robot.model, data)
        lowest = min(mujoco.mj_geomDistance(robot.model, data, floor, g, 10.0, None) for g in body_geoms(robot))
        on_floor = (places.frame == t) & ((places.first == WORLD) | (places.second == WORLD))
        assert lowest < 0.02  # nothing to find otherwise
        assert places.gap[on_floor].min(initial=1.0) == pytest.approx(lowest, abs=1e-6)  # MuJoCo's own tolerance


def test_no_place_is_farther_than_asked_for(robot, near_floor):
    assert Proximity(robot, 0.05)(near_floor).gap.max() < 0.05


def test_gaps_do_not_depend_on_heading_or_place(robot, near_floor):
    turned = near_floor.copy()
    turn = rot.from_yaw(np.full(3, -2.2))
    turned[:, :3] = rot.rotate(turn, near_floor[:, :3]) + [5.0, 1.0, 0.0]
    turned[:, 3:7] = rot.multiply(turn, near_floor[:, 3:7])
    here, there = (Proximity(robot, 0.05)(q) for q in (near_floor, turned))
    np.testing.assert_array_equal((here.frame, here.first, here.second), (there.frame, there.first, there.second))
    np.testing.assert_allclose(here.gap, there.gap, atol=1e-9)
    np.testing.assert_allclose(rot.rotate(turn[here.frame], here.normal), there.normal, atol=1e-7)


def test_a_watch_finds_what_a_search_finds_whatever_moved_since(robot, rng):
    qpos, watch, search = random_poses(robot, rng, 9), Watch(robot, 9, 0.05), Proximity(robot, 0.05)
    for frames, moved in (([0, 1, 2, 3, 4], []), ([1, 3, 4, 7, 8], [3, 8]), (range(9), [0, 1]), ([5], [])):
        frames = np.array(list(frames))
        qpos[moved, 2] += 0.01
        got, wanted = watch.near(frames, qpos[frames]), search(qpos[frames])
        assert len(wanted.gap)
        for name in ("frame", "first", "second", "gap", "point"):
            np.testing.assert_array_equal(getattr(got, name), getattr(wanted, name))


def test_at_rest_nothing_is_near_anything_but_the_floor(robot):
    places = Proximity(robot, 0.01)(robot.default_qpos[None])
    assert ((places.first == WORLD) | (places.second == WORLD)).all()


def test_corners_are_counted_as_low_by_their_height_alone(robot, rng):
    qpos = random_poses(robot, rng)
    kin = kinematics(robot, qpos)
    everything = low_soles(robot, kin, 10.0)
    within = float(np.median(everything.gap))
    some = low_soles(robot, kin, within)
    np.testing.assert_array_equal(some.gap, everything.gap[everything.gap < within])


def test_a_gap_is_too_near_only_beyond_half_of_what_is_wanted_and_a_millimetre():
    wanted = np.full(4, 0.01)
    assert too_near(np.array([0.01, 0.0041, 0.0039, -0.1]), wanted).tolist() == [False, False, True, True]
    assert not too_near(np.array([-0.0009]), np.zeros(1)).any()  # on the floor a millimetre is left alone
