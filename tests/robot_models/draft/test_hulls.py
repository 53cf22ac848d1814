"""Soles and capsules from clouds of points: inside the surface, and moving, growing and turning with it."""

import mujoco
import numpy as np
import pytest
from any_pose import ASSETS, posed

from robot_models.draft.hulls import capsules_of, sole_of, surface_points

CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


@pytest.fixture
def foot(rng):
    """A flat plate with an ankle and a toe cap above, both wider than the plate."""
    plate = np.array([0.1, 0.04, 0.0]) * CORNERS[::2] + [0.03, 0.01, -0.05]
    above = rng.uniform([-0.3, -0.2, -0.04], [0.3, 0.2, 0.1], size=(50, 3))
    return np.concatenate((plate, above))


def test_a_sole_is_the_flat_part_of_the_foot_less_a_rim(foot):
    (back, front), (right, left), z = sole_of(foot)
    assert z == pytest.approx(-0.05)
    assert -0.07 < back < front < 0.13 and -0.03 < right < left < 0.05  # inside the plate
    assert front - back > 0.9 * 0.2 and left - right > 0.9 * 0.08  # most of it
    assert (0.5 * (front + back), 0.5 * (left + right)) == pytest.approx((0.03, 0.01))


def test_a_sole_moves_and_grows_with_its_foot(foot):
    shift = np.array([0.2, -0.1, 0.4])
    x, y, z = sole_of(foot)
    moved_x, moved_y, moved_z = sole_of(foot + shift)
    np.testing.assert_allclose(
        [*moved_x, *moved_y, moved_z], [*(x + shift[0]), *(y + shift[1]), z + shift[2]], atol=1e-12
    )
    wide_x, wide_y, _ = sole_of(foot * [2.0, 3.0, 1.0])
    np.testing.assert_allclose([*wide_x, *wide_y], [*(2 * np.array(x)), *(3 * np.array(y))], atol=1e-12)


def test_points_above_the_skin_do_not_widen_a_sole(foot):
    assert sole_of(foot) == sole_of(foot[:4])


@pytest.mark.parametrize("along", [0, 1, 2])
def test_a_capsule_lies_inside_the_box_of_its_body_along_the_longest_side(along, rng):
    half = np.full(3, 0.06)
    half[along], half[along - 1] = 0.2, 0.08
    centre = rng.normal(size=3)
    (capsule,) = capsules_of({"arm": centre + half * CORNERS}, ["arm"])
    start, end, rounding = np.array(capsule.start), np.array(capsule.end), 2e-4  # written to a tenth of a millimetre
    assert np.flatnonzero(np.abs(end - start) > rounding).tolist() == [along]
    assert (np.maximum(start, end) + capsule.radius <= centre + half + rounding).all()
    assert (np.minimum(start, end) - capsule.radius >= centre - half - rounding).all()
    assert 0.7 * 0.06 < capsule.radius < 0.06
    np.testing.assert_allclose(0.5 * (start + end), centre, atol=rounding)


def test_a_ball_is_a_capsule_without_length_and_a_wire_is_none():
    (ball,) = capsules_of({"head": 0.1 * CORNERS}, ["head"])
    assert np.linalg.norm(np.subtract(ball.end, ball.start)) < 0.1 * 2 * 0.2
    assert capsules_of({"wire": [0.3, 0.01, 0.2] * CORNERS}, ["wire"]) == []


def test_only_bodies_that_are_asked_for_and_have_a_surface_get_one():
    cloud = 0.1 * CORNERS
    assert [c.body for c in capsules_of({"a": cloud, "b": cloud, "c": cloud}, ["c", "x", "a"])] == ["c", "a"]
    names = [c.name for c in capsules_of({"a": cloud, "b": cloud}, ["a", "b"])]
    assert len(set(names)) == 2


def test_points_of_every_primitive_lie_in_the_frame_of_the_body_that_carries_it(tmp_path):
    """Two fixed bodies, turned and shifted, under a hinge: MuJoCo's own world, taken back into the hinged body."""
    (tmp_path / "r.xml").write_text(
        '<mujoco><worldbody><geom type="box" size="5 5 1"/><body name="trunk" pos="1 2 3" quat="0.9 0.1 0.3 -0.2"><joint/>'
        '<geom size="0.2"/><body pos="0.3 0 0.1" quat="0.7 0.7 0 0"><body pos="0 0.4 0" quat="0.9 0 0.4 0.1">'
        '<geom type="box" pos="0.1 0.2 0.3" quat="0.8 0.2 0.1 -0.3" size="0.1 0.2 0.3" name="far"/>'
        "</body></body></body></worldbody></mujoco>"
    )
    points = surface_points(tmp_path / "r.xml", ["trunk"])
    assert set(points) == {"trunk"} and len(points["trunk"]) == 16  # the floor belongs to nobody
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "r.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    far, trunk = data.geom("far"), data.body("trunk")
    world = far.xpos + (CORNERS * model.geom("far").size) @ far.xmat.reshape(3, 3).T
    expected = (world - trunk.xpos) @ trunk.xmat.reshape(3, 3)
    for corner in expected:
        assert np.linalg.norm(points["trunk"] - corner, axis=1).min() < 1e-12
    assert surface_points(tmp_path / "r.xml", ["somebody"]) == {}


def test_a_foots_points_reach_down_to_the_floor_where_the_robot_stands(dancer):
    points = surface_points(ASSETS / "dancer.xml", dancer.body_names)
    data = posed(dancer, dancer.default_qpos)
    for sole in dancer.soles.values():
        at = data.body(sole.body)
        low = (at.xpos + points[sole.body] @ at.xmat.reshape(3, 3).T)[:, 2].min()
        assert abs(low) < 1e-9


def test_a_file_whose_meshes_are_absent_has_no_surface(tmp_path):
    (tmp_path / "r.xml").write_text(
        '<mujoco><asset><mesh name="m" file="absent.stl"/></asset><worldbody><body name="b"><joint/>'
        '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    assert surface_points(tmp_path / "r.xml", ["b"]) == {}
