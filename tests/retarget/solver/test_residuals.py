"""The rows of the whole-clip solver are derivatives of its residuals: every row, every coordinate, wherever the goals are."""

import dataclasses

import numpy as np
import pytest
from derivatives import TOLERANCE, assert_derivatives, central, random_poses, spoiled

from retarget import ObjectiveWeights
from retarget.solver.free_joints import free_joints
from retarget.solver.objective import Objective
from retarget.solver.residuals import residual_rows
from retarget.targets.targets import LIMBS
from robot_models import load_robot, surface_points
from robot_models.maths import rotation as rot
from robot_models.rigid_body.jacobians import integrate, kinematics

# Weights of about one, so that the tolerance means metres and radians; no two alike, so that none can stand for another.
WEIGHTS = ObjectiveWeights(pelvis_position=0.7, pelvis_orientation=1.3, torso_orientation=0.9, leg=1.1, arm=0.8)
GROUPS = {
    "limbs": slice(0, 24),
    "pelvis position": slice(24, 27),
    "pelvis orientation": slice(27, 30),
    "torso orientation": slice(30, 33),
    "edges": slice(33, 45),
    "roll": slice(45, 47),
}
POSITIONS = np.r_[GROUPS["limbs"], GROUPS["pelvis position"], GROUPS["edges"]]


@pytest.fixture(scope="module", params=["dancer", "g1"])
def robot(request):
    return load_robot(request.param)


def goals_about(robot, qpos, rng, *, apart, turned):
    """Goals that the poses miss by `apart` [m] in every position and by the rotation vectors `turned` in orientation."""
    kin, count = kinematics(robot, qpos), len(qpos)
    feet = [robot.body(sole.body) for sole in robot.soles.values()]
    bodies = [0, robot.landmark("torso"), *feet]
    wanted = rot.multiply(rot.exp(-np.broadcast_to(turned, (count, 4, 3))), kin.quat[:, bodies])
    middle = kin.pos[:, feet].repeat(2, axis=1)

    def missed(*shape):
        return apart * rng.normal(size=(count, *shape))

    return Objective(
        weights=WEIGHTS,
        pelvis_pos=kin.pos[:, 0] + missed(3),
        pelvis_quat=wanted[:, 0],
        torso_quat=wanted[:, 1],
        limbs=missed(len(LIMBS), 3),
        edges=middle + missed(4, 3),
        foot_quat=wanted[:, 2:],
        posture=np.zeros((count, len(robot.joint_names))),
        part_height=np.zeros((count, 0)),
        part_weight=np.zeros((count, 0)),
        part_body=np.zeros((count, 0), dtype=int),
        part_place=np.zeros((count, 0, 2)),
        part_place_weight=np.zeros((count, 0)),
        contact=np.zeros((count, 4), dtype=int),
        airborne=np.zeros(count, dtype=bool),
        edge_weight=rng.uniform(0.5, 1.5, (count, 4, 3)),
        roll_weight=rng.uniform(0.5, 1.5, (count, 2)),
        posture_weight=np.zeros((count, len(robot.joint_names))),
    )


def both(robot, objective, qpos, **step):
    """The Jacobian of the goals, and the finite differences of their residuals."""
    _, jacobian, _ = residual_rows(objective, kinematics(robot, qpos))
    return jacobian, central(lambda poses, q: residual_rows(objective.at(poses), kinematics(robot, q))[0], qpos, **step)


def left_jacobian_inverse(e):
    """d log(exp(d) exp(e)) / d d at d = 0 (Sola et al. 2018, eq. 146)."""
    angle = np.linalg.norm(e)
    across = np.cross(e, np.eye(3)).T
    bend = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    return np.eye(3) - 0.5 * across + bend * across @ across


def axis_errors(rng, angle, count=3):
    return angle * rot.unit(rng.normal(size=(count, 4, 3)))


@pytest.mark.parametrize("apart", [1e-3, 3.0])
def test_every_row_is_the_derivative_of_its_residual_where_no_orientation_is_off(robot, apart, rng):
    qpos = random_poses(robot, rng)
    jacobian, slopes = both(robot, goals_about(robot, qpos, rng, apart=apart, turned=np.zeros(3)), qpos)
    assert jacobian.shape[1:] == (47, robot.model.nv)
    for name, rows in GROUPS.items():
        assert np.abs(slopes[:, rows]).max() > 0.1, name  # none is idle
    assert_derivatives(jacobian, slopes)


def test_rows_of_parts_on_the_floor_are_heights_and_places_and_their_derivatives(robot, rng):
    qpos = random_poses(robot, rng)
    bodies = np.tile([robot.landmark("left_knee"), 0, robot.landmark("right_wrist")], (len(qpos), 1))
    objective = dataclasses.replace(
        goals_about(robot, qpos, rng, apart=1.0, turned=np.zeros(3)),
        part_height=np.zeros(bodies.shape), part_weight=rng.uniform(0.5, 1.5, bodies.shape), part_body=bodies,
        part_place=rng.normal(size=(*bodies.shape, 2)), part_place_weight=rng.uniform(0.5, 1.5, bodies.shape),
    )  # fmt: skip
    kin = kinematics(robot, qpos)
    lowest = surface_points(robot).heights(kin.pos, kin.quat)
    for k, body in enumerate(bodies[0]):
        height = lowest[:, surface_points(robot).body == body].min(axis=1)
        np.testing.assert_allclose(residual_rows(objective, kin)[0][:, 47 + k], objective.part_weight[:, k] * height)
        away = kin.pos[:, body, :2] - objective.part_place[:, k]
        rows = slice(47 + len(bodies[0]) + 2 * k, 47 + len(bodies[0]) + 2 * k + 2)
        np.testing.assert_allclose(
            residual_rows(objective, kin)[0][:, rows], objective.part_place_weight[:, k, None] * away
        )
    jacobian, slopes = both(robot, objective, qpos)
    assert np.abs(slopes[:, 47:]).max() > 0.1
    assert_derivatives(jacobian, slopes)


def test_a_column_of_the_wrong_sign_or_a_tenth_too_large_would_be_seen(robot, rng):
    qpos = random_poses(robot, rng)
    jacobian, slopes = both(robot, goals_about(robot, qpos, rng, apart=1.0, turned=np.zeros(3)), qpos)
    idle = np.abs(jacobian).max(axis=(0, 1)) < 1e-12
    assert not (idle[6:] & ~free_joints(robot)).any() and not idle[:6].any()  # it turns a hand, which nothing asks for
    for column, bad in spoiled(jacobian):
        if not idle[column]:
            with pytest.raises(AssertionError, match=f"column {column} off"):
                assert_derivatives(bad, slopes)


def test_rows_of_positions_are_derivatives_however_far_everything_is_turned(robot, rng):
    qpos = random_poses(robot, rng)
    objective = goals_about(robot, qpos, rng, apart=3.0, turned=axis_errors(rng, 2.5))
    jacobian, slopes = both(robot, objective, qpos)
    assert_derivatives(jacobian[:, POSITIONS], slopes[:, POSITIONS])


def test_what_differences_and_rows_differ_by_falls_with_the_square_of_the_step(robot, rng):
    qpos = random_poses(robot, rng, 1)
    objective = goals_about(robot, qpos, rng, apart=1.0, turned=np.zeros(3))
    off = []
    for step in (0.02, 0.01):
        jacobian, slopes = both(robot, objective, qpos, step=step)
        off.append(np.linalg.norm((jacobian - slopes)[:, POSITIONS]))
    # The next term of the series is 1e-4 of this one. A row that were slightly wrong would leave a ratio of 1.
    assert off[0] / off[1] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("angle", [1e-2, 0.5, 2.5])
def test_rows_of_orientations_are_off_by_the_bending_of_the_log_and_nothing_else(robot, angle, rng):
    """A turn d in front of the error e gives log(exp(d) exp(e)) = e + J(e) d; the rows take J as one."""
    qpos, turned = random_poses(robot, rng), axis_errors(rng, angle)
    objective = goals_about(robot, qpos, rng, apart=1.0, turned=turned)
    jacobian, slopes = both(robot, objective, qpos)
    for k, name in enumerate(("pelvis orientation", "torso orientation")):
        for pose, e in enumerate(turned[:, k]):
            bent = left_jacobian_inverse(e) @ jacobian[pose, GROUPS[name]]
            # Formula and log lose digits as 1e-16 / angle^2 near zero: less than the tolerance at these angles.
            np.testing.assert_allclose(bent, slopes[pose, GROUPS[name]], atol=5.0 * TOLERANCE)


def test_what_rows_of_orientations_leave_out_grows_no_faster_than_the_angle(robot, rng):
    """J(e) - 1 has the norm angle / 2 for small errors and at most 0.6 angle up to half a turn."""
    qpos, direction = random_poses(robot, rng), axis_errors(rng, 1.0)
    share = []
    for angle in (1e-3, 1e-2, 0.1, 0.5, 1.0, 2.0, 3.0):
        objective = goals_about(robot, qpos, rng, apart=1.0, turned=angle * direction)
        jacobian, slopes = both(robot, objective, qpos)
        turns = (GROUPS["pelvis orientation"], GROUPS["torso orientation"])
        # The root's own turns are unit columns: there the norm of what is left out is that of J(e) - 1.
        share.append([np.linalg.norm((slopes - jacobian)[:, r, 3:6], 2, axis=(1, 2)) / angle for r in turns])
    share = np.array(share) / np.array([WEIGHTS.pelvis_orientation, WEIGHTS.torso_orientation])[:, None]
    np.testing.assert_allclose(share[:2], 0.5, atol=1e-5)
    assert share.max() <= 0.6
    assert (np.diff(share, axis=0) > -1e-5).all()


def test_the_gradient_of_squared_orientation_errors_is_exact_at_any_angle(robot, rng):
    """e is its own image under J(e) transposed: steps bend, but they lead downhill."""
    qpos = random_poses(robot, rng)
    objective = goals_about(robot, qpos, rng, apart=0.3, turned=axis_errors(rng, 2.5))
    objective = dataclasses.replace(objective, roll_weight=np.zeros((3, 2)))  # a part of e only; tested below

    def energy(poses, q):
        return 0.5 * np.square(residual_rows(objective.at(poses), kinematics(robot, q))[0]).sum(axis=1)

    residual, jacobian, _ = residual_rows(objective, kinematics(robot, qpos))
    # Energies are about 10, so rounding is ten times a residual's.
    assert_derivatives((residual[:, None] @ jacobian)[:, 0], central(energy, qpos), 10.0 * TOLERANCE)


@pytest.mark.parametrize("angle", [-2.0, 0.3])
def test_the_row_of_a_foots_roll_is_exact_where_the_foot_is_off_in_roll_alone(robot, angle, rng):
    qpos = random_poses(robot, rng)
    kin = kinematics(robot, qpos)
    feet = [robot.body(sole.body) for sole in robot.soles.values()]
    length = rot.rotate(kin.quat[:, feet], np.broadcast_to([1.0, 0.0, 0.0], (3, 2, 3)))
    turned = np.concatenate((np.zeros((3, 2, 3)), angle * length), axis=1)
    objective = goals_about(robot, qpos, rng, apart=1.0, turned=turned)
    residual, _, _ = residual_rows(objective, kin)
    np.testing.assert_allclose(residual[:, GROUPS["roll"]], angle * objective.roll_weight, atol=1e-12)
    jacobian, slopes = both(robot, objective, qpos)
    assert_derivatives(jacobian[:, GROUPS["roll"]], slopes[:, GROUPS["roll"]])


@pytest.mark.parametrize("axis", [1, 2])
def test_heels_and_toes_hold_a_foots_pitch_and_yaw_and_the_row_of_roll_holds_roll_alone(robot, axis, rng):
    qpos = random_poses(robot, rng, 1)
    kin, foot = kinematics(robot, qpos), robot.body(robot.soles["left"].body)
    _, jacobian, _ = residual_rows(goals_about(robot, qpos, rng, apart=0.0, turned=np.zeros(3)), kin)
    frame, arm = rot.to_matrix(kin.quat[0, foot]), kin.pos[0, 0] - kin.pos[0, foot]

    def seen(rows, axis):
        """How much rows change when the whole robot turns about an axis through its left ankle."""
        about = frame[:, axis]
        turn = np.concatenate((np.cross(about, arm), about, np.zeros(len(robot.joint_names))))
        return np.linalg.norm(jacobian[0, rows] @ turn)

    edges, roll = slice(33, 39), slice(45, 46)
    assert seen(edges, axis) > 0.03 and seen(roll, axis) < 1e-12
    assert seen(roll, 0) > 0.4


@pytest.mark.parametrize(
    ("weight", "group"),
    [
        ("leg", "limbs"), ("arm", "limbs"), ("pelvis_position", "pelvis position"),
        ("pelvis_orientation", "pelvis orientation"), ("torso_orientation", "torso orientation"),
        ("edge_weight", "edges"), ("roll_weight", "roll"),
    ],
)  # fmt: skip
def test_a_weight_scales_the_rows_of_its_goal_and_their_derivatives_and_no_others(dancer, weight, group, rng):
    qpos = random_poses(dancer, rng, 1)
    objective = goals_about(dancer, qpos, rng, apart=1.0, turned=np.ones(3))
    if hasattr(objective, weight):
        heavier = dataclasses.replace(objective, **{weight: 3.0 * getattr(objective, weight)})
    else:
        heavier = dataclasses.replace(
            objective, weights=dataclasses.replace(WEIGHTS, **{weight: 3.0 * getattr(WEIGHTS, weight)})
        )
    (error, rows, _), (error_3, rows_3, _) = (residual_rows(g, kinematics(dancer, qpos)) for g in (objective, heavier))
    ratio = error_3[0] / error[0]
    np.testing.assert_allclose(rows_3[0], ratio[:, None] * rows[0], atol=1e-12)
    changed = np.abs(ratio - 1.0) > 1e-9
    inside = np.zeros(47, dtype=bool)
    inside[GROUPS[group]] = True
    np.testing.assert_allclose(ratio[changed], 3.0)
    assert not changed[~inside].any()
    assert changed[inside].mean() == (0.5 if group == "limbs" else 1.0)  # legs or arms


def test_squared_errors_and_what_the_joints_feel_do_not_change_when_everything_is_turned_and_shifted(robot, rng):
    qpos = random_poses(robot, rng)
    objective = goals_about(robot, qpos, rng, apart=1.0, turned=axis_errors(rng, 1.0))
    # The floor's two directions weigh alike in use; the random weights here would not.
    objective = dataclasses.replace(objective, edge_weight=np.repeat(objective.edge_weight[..., :1], 3, axis=2))
    turn, shift = rot.from_yaw(np.array(2.1)), np.array([3.0, -1.0, 0.4])
    pose = np.concatenate(
        (rot.rotate(turn, qpos[:, :3]) + shift, rot.multiply(turn[None], qpos[:, 3:7]), qpos[:, 7:]), axis=1
    )
    moved = dataclasses.replace(
        objective,
        pelvis_pos=rot.rotate(turn, objective.pelvis_pos) + shift,
        edges=rot.rotate(turn, objective.edges) + shift,
        limbs=rot.rotate(turn, objective.limbs),
        **{k: rot.multiply(turn, getattr(objective, k)) for k in ("pelvis_quat", "torso_quat", "foot_quat")},
    )
    error, rows, _ = residual_rows(objective, kinematics(robot, qpos))
    error_2, rows_2, _ = residual_rows(moved, kinematics(robot, pose))
    assert np.abs(error - error_2).max() > 0.1  # the rows themselves are the world's
    np.testing.assert_allclose(np.square(error).sum(axis=1), np.square(error_2).sum(axis=1), rtol=1e-10)
    np.testing.assert_allclose((error[:, None] @ rows)[..., 6:], (error_2[:, None] @ rows_2)[..., 6:], atol=1e-10)


def test_gauss_newton_from_a_random_start_comes_to_goals_that_can_be_reached(dancer, rng):
    """Undamped steps converge from half a radian away: the last ones to rounding, as they do only with exact rows."""
    qpos = random_poses(dancer, rng, 1)
    kin = kinematics(dancer, qpos)
    own = goals_about(dancer, qpos, rng, apart=0.0, turned=np.zeros(3))
    own = dataclasses.replace(
        own,
        limbs=np.stack([kin.pos[:, dancer.landmark(b)] - kin.pos[:, dancer.landmark(a)] for a, b in LIMBS], axis=1),
    )
    edges = residual_rows(own, kin)[0][:, GROUPS["edges"]].reshape(1, 4, 3) / own.edge_weight
    own = dataclasses.replace(own, edges=own.edges + edges)
    near = integrate(qpos, 0.1 * rng.normal(size=(1, dancer.model.nv)))
    left = []
    for _ in range(6):
        error, rows, _ = residual_rows(own, kinematics(dancer, near))
        left.append(np.linalg.norm(error))
        near = integrate(near, -np.linalg.lstsq(rows[0], error[0], rcond=1e-9)[0][None])
    assert left[0] > 0.1 and left[-1] < 1e-10
