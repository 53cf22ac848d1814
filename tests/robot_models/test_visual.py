"""Pieces of surface lie where the physics has them; meshes follow fixed links, turns and scales to a body."""

import mujoco
import numpy as np
import pytest
import trimesh
from any_pose import posed, random_qpos

from robot_models import forward_kinematics
from robot_models.geometry import body_geoms
from robot_models.maths import rotation as rot
from robot_models.visual import mesh_parts, primitive_parts, visual_parts

SIZE = np.array([0.1, 0.2, 0.4])


def test_primitives_lie_where_mujocos_geoms_are_at_any_pose(dancer, rng):
    q = random_qpos(dancer, rng, 3)
    pos, quat = forward_kinematics(dancer, q)
    parts, geoms = primitive_parts(dancer), body_geoms(dancer)
    assert len(parts) == len(geoms)
    for t in range(3):
        data = posed(dancer, q[t])
        for part, geom in zip(parts, geoms, strict=True):
            b = dancer.body(part.body)
            np.testing.assert_allclose(pos[t, b] + rot.rotate(quat[t, b], part.pos), data.geom_xpos[geom], atol=1e-12)
            turned = rot.to_matrix(rot.multiply(quat[t, b], part.quat))
            np.testing.assert_allclose(turned.ravel(), data.geom_xmat[geom], atol=1e-12)


def test_floor_and_contact_points_are_no_part_of_the_robots_looks(dancer):
    kinds = [p.kind for p in primitive_parts(dancer)]
    drawn = mujoco.MjSpec.from_file(str(dancer.profile.folder / dancer.profile.source.path)).geoms
    assert len(kinds) == len(list(drawn)) and set(kinds) == {"box", "capsule"}
    assert [p.kind for p in visual_parts(dancer)] == kinds  # it has no meshes


@pytest.fixture
def urdf(tmp_path):
    """A URDF writer: its one mesh, a box of SIZE, hangs on `tip`, which two fixed joints hold to `arm`."""
    trimesh.creation.box(SIZE).export(tmp_path / "box.stl")

    def write(scale="1 1 1", mesh="box.stl", kind="fixed", placed='<origin xyz="0 0 0.5" rpy="0 0 0"/>'):
        (tmp_path / "r.urdf").write_text(
            f'<robot name="r"><link name="base"/><link name="arm"/><link name="hand"/><link name="tip"><visual>{placed}'
            f'<geometry><mesh filename="{mesh}" scale="{scale}"/></geometry></visual></link>'
            '<joint name="c" type="fixed"><parent link="hand"/><child link="tip"/>'
            '<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>'
            '<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="9 9 9"/></joint>'
            f'<joint name="b" type="{kind}"><parent link="arm"/><child link="hand"/>'
            '<origin xyz="0 2 0" rpy="1.5707963267948966 0 0"/></joint></robot>'
        )
        return tmp_path / "r.urdf"

    return write


def test_a_mesh_behind_fixed_joints_lands_in_the_frame_of_the_body_that_moves(urdf):
    (part,) = mesh_parts(["base", "arm"], urdf())
    assert part.body == "arm"
    # By hand: 0.5 up in `tip`; tip is 1 ahead in `hand`; hand lies 2 to the left in `arm`, rolled by a quarter turn, so
    # that its z is the arm's -y.
    np.testing.assert_allclose(part.vertices.mean(axis=0), [1.0, 2.0 - 0.5, 0.0], atol=1e-6)
    # Yaw first (x along y), then roll (y along z, z along -y): sizes x, y, z -> z, x, y.
    np.testing.assert_allclose(np.ptp(part.vertices, axis=0), SIZE[[1, 2, 0]], atol=1e-6)


@pytest.mark.parametrize("scale", ["1 1 1", "2 3 0.5", "1 -1 1", "-1 -1 -1", "-1 1 -1"])
def test_surfaces_look_outwards_whatever_the_scale(urdf, scale):
    (part,) = mesh_parts(["base", "arm"], urdf(scale))
    volume = trimesh.Trimesh(part.vertices, part.faces, process=False).volume  # negative if inside out
    wanted = np.prod(SIZE) * abs(np.prod([float(s) for s in scale.split()]))
    assert volume == pytest.approx(wanted, rel=1e-5)  # single precision in the file


def test_a_body_that_moves_carries_its_own_mesh(urdf):
    (part,) = mesh_parts(["base", "arm", "hand", "tip"], urdf())
    assert part.body == "tip"
    np.testing.assert_allclose(part.vertices.mean(axis=0), [0.0, 0.0, 0.5], atol=1e-6)


@pytest.mark.parametrize("mesh", ["absent.stl", "/etc/passwd", "box.txt", "package://r/absent.stl"])
def test_meshes_that_are_not_there_are_left_out(urdf, mesh):
    assert mesh_parts(["base", "arm"], urdf(mesh=mesh)) == []


def test_roll_pitch_and_yaw_are_about_the_parents_axes_in_this_order(urdf):
    angles = (0.3, -0.5, 0.7)
    placed = f'<origin xyz="0 0 0" rpy="{angles[0]} {angles[1]} {angles[2]}"/>'
    (part,) = mesh_parts(["tip"], urdf(placed=placed))
    roll, pitch, yaw = (rot.exp(a * np.eye(3)[k]) for k, a in enumerate(angles))
    turn = rot.multiply(yaw, rot.multiply(pitch, roll))
    corners = 0.5 * SIZE * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for corner in rot.rotate(np.tile(turn, (8, 1)), corners):
        assert np.linalg.norm(part.vertices - corner, axis=1).min() < 1e-6
    other = rot.multiply(roll, rot.multiply(pitch, yaw))
    assert np.linalg.norm(part.vertices - rot.rotate(other, corners[7]), axis=1).min() > 1e-3  # negative control


def test_a_model_to_look_at_has_the_same_bodies_in_the_same_places_and_weighs_the_same(dancer, rng):
    """Its surface is drawn over the robot's own; nothing of it touches, and primitives below it are hidden."""
    import mujoco

    from robot_models import model_to_look_at, surface

    pieces = [piece for piece in surface(dancer) if piece.body != "left_elbow_link"]
    model = model_to_look_at(dancer, pieces)
    assert model.nmesh == len(pieces) and model.nq == dancer.nq
    assert model.body_mass.sum() == pytest.approx(dancer.model.body_mass.sum())
    qpos = np.array(dancer.default_qpos)
    qpos[7:] = rng.uniform(dancer.lower, dancer.upper)
    ours, theirs = mujoco.MjData(dancer.model), mujoco.MjData(model)
    ours.qpos[:], theirs.qpos[:] = qpos, qpos
    mujoco.mj_kinematics(dancer.model, ours), mujoco.mj_kinematics(model, theirs)
    for name in dancer.body_names:
        np.testing.assert_allclose(ours.body(name).xpos, theirs.body(name).xpos, atol=1e-9)
    for g in range(model.ngeom):
        body = model.body(int(model.geom_bodyid[g])).name
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH:
            assert not model.geom_contype[g] and not model.geom_conaffinity[g] and model.geom_group[g] == 0
        elif body != "world":
            assert (model.geom_group[g] < 3) == (body == "left_elbow_link")
    # A vertex stands where the piece has it.
    k = next(i for i, piece in enumerate(pieces) if piece.body == dancer.body_names[0])
    geom = next(g for g in range(model.ngeom) if model.geom_dataid[g] == k)
    first = model.mesh_vertadr[k]
    mesh = np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], dtype=float)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    placed = mesh @ turn.reshape(3, 3).T + model.geom_pos[geom]
    np.testing.assert_allclose(placed.min(axis=0), pieces[k].vertices.min(axis=0), atol=1e-5)
    np.testing.assert_allclose(placed.max(axis=0), pieces[k].vertices.max(axis=0), atol=1e-5)


def test_the_meshes_of_an_mjcf_are_drawn_where_its_bodies_are(tmp_path):
    """Of a body with meshes that touch nothing these alone; welded bodies go with who carries them."""
    import trimesh

    from robot_models.visual import mjcf_mesh_parts

    trimesh.creation.box((0.2, 0.1, 0.4)).export(tmp_path / "box.stl")
    hinge = '<joint axis="0 1 0" range="-90 90"/>'
    (tmp_path / "r.xml").write_text(
        '<mujoco><asset><mesh name="box" file="box.stl"/></asset><worldbody><body name="trunk"><freejoint/>'
        '<geom type="mesh" mesh="box" contype="0" conaffinity="0" rgba="1 0 0 1"/><geom type="mesh" mesh="box"/>'
        f'<body name="arm" pos="0 .3 0">{hinge}<geom size=".1"/><body name="hand" pos="0 0 -.3" quat="0 1 0 0">'
        '<geom type="mesh" mesh="box" pos=".1 0 0"/></body></body></body></worldbody></mujoco>'
    )
    trunk, hand = mjcf_mesh_parts(("trunk", "arm"), tmp_path / "r.xml")
    assert (trunk.body, trunk.rgba) == ("trunk", (1.0, 0.0, 0.0, 1.0)) and hand.body == "arm"
    np.testing.assert_allclose(trunk.vertices.max(axis=0), (0.1, 0.05, 0.2), atol=1e-6)
    np.testing.assert_allclose(hand.vertices.mean(axis=0), (0.1, 0.0, -0.3), atol=1e-6)
    (tmp_path / "box.stl").unlink()
    assert mjcf_mesh_parts(("trunk", "arm"), tmp_path / "r.xml") == []
