"""Model files of any kind come in as one bare tree with a free root; what cannot be one is refused."""

import mujoco
import numpy as np
import pytest
from any_pose import ASSETS, dancer_xml, profiled, random_qpos

from robot_models import RobotError, forward_kinematics, load_robot
from robot_models.model_file import locate, open_spec
from robot_models.profile import Source

# A link fixed to the upper arm; a box, a mesh and a visual; an inertia that no body has.
URDF = """<robot name="arm">
<mujoco><compiler meshdir="nowhere" fusestatic="false"/></mujoco>
<link name="base"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="absent.stl"/></geometry></visual>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="upper"><inertial><mass value="2"/><inertia ixx="{ixx}" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="absent.stl"/></geometry></collision></link>
<link name="pad"><inertial><mass value="0.5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" effort="9" velocity="4"/></joint>
<joint name="glue" type="fixed"><parent link="upper"/><child link="pad"/><origin xyz="0.2 0 0"/></joint></robot>"""


def urdf(folder, ixx="1"):
    path = folder / "arm.urdf"
    path.write_text(URDF.format(ixx=ixx))
    return path


def test_a_urdf_loses_its_meshes_and_keeps_its_joints_weights_and_limits(tmp_path):
    model = open_spec(urdf(tmp_path)).compile()
    assert [model.joint(j).name for j in range(model.njnt)] == ["root", "elbow"]
    assert model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE and model.nmesh == 0
    assert model.body_mass.sum() == pytest.approx(3 + 2 + 0.5)
    assert model.body("upper").mass[0] == pytest.approx(2 + 0.5)  # the glued pad is part of the arm
    np.testing.assert_array_equal(model.joint("elbow").range, [-1, 2])
    assert model.jnt_actfrcrange[1][1] == 9


def test_its_own_primitives_are_kept_only_on_demand(tmp_path):
    assert [open_spec(urdf(tmp_path), primitives=p).compile().ngeom for p in (True, False)] == [1, 0]


def test_an_impossible_inertia_is_refused_and_mended_on_demand(tmp_path):
    path = urdf(tmp_path, ixx="5")  # A + B >= C holds for every body; 1 + 1 < 5
    with pytest.raises(ValueError, match="[Ii]nertia"):
        open_spec(path).compile()
    assert open_spec(path, repair=True).compile().body("upper").mass[0] == pytest.approx(2.5)


@pytest.mark.parametrize("body", ['<freejoint name="float"/>', '<joint name="float" type="free"/>', ""])
def test_the_root_is_free_once_and_at_the_origin_however_the_file_has_it(tmp_path, body):
    (tmp_path / "r.xml").write_text(
        f'<mujoco><worldbody><geom name="ground" type="plane" size="1 1 1"/><body name="trunk" pos="1 2 3">{body}'
        '<geom size="0.1"/><body name="head" pos="0 0 1"><joint name="neck"/><geom size="0.1"/></body></body>'
        "</worldbody></mujoco>"
    )
    model = open_spec(tmp_path / "r.xml").compile()
    assert [model.joint(j).name for j in range(model.njnt)] == ["root", "neck"]
    np.testing.assert_array_equal(model.qpos0, [0, 0, 0, 1, 0, 0, 0, 0])
    assert model.ngeom == 2  # the scenery's plane is gone


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"<mujoco><worldbody/></mujoco>", "found no body"),
        (b"<mujoco><worldbody>", "MuJoCo refuses"),
        (b"no xml at all", "MuJoCo refuses"),
        (b"<sdf><model/></sdf>", "MuJoCo"),
        (b"\xff\xfe\x00robot", "no text in UTF-8"),
        (b"<robot name='x'></robot>", "MuJoCo refuses|no body"),
    ],
)
def test_what_is_no_robot_is_refused_with_its_path(tmp_path, content, said):
    (tmp_path / "r.xml").write_bytes(content)
    with pytest.raises(RobotError, match=rf"r\.xml: .*({said})"):
        open_spec(tmp_path / "r.xml")


def test_an_absent_model_file_is_refused_by_open_and_by_the_profile(tmp_path):
    with pytest.raises(RobotError, match="no such file"):
        open_spec(tmp_path / "no.urdf")
    path = profiled(tmp_path, "")
    (tmp_path / "mine.xml").unlink()
    with pytest.raises(RobotError, match=r"no model file mine\.xml"):
        load_robot(path)


def test_frozen_joints_stand_at_zero_and_change_nothing_else(tmp_path, dancer, rng):
    frozen = [j for j in dancer.joint_names if "wrist" in j]
    path = profiled(
        tmp_path, dancer_xml(), ("friction = 0.9", 'friction = 0.9\nfreeze = [".*_wrist_.*"]'),
        ('".*_wrist_.*" = 25.0', ""), ("csv_columns", "columns_of_the_whole_robot"),
        *((f'"{s}_wrist_yaw_link"', f'"{s}_elbow_link"') for s in ("left", "right")),
    )  # fmt: skip
    stiff = load_robot(path)
    assert set(dancer.joint_names) - set(stiff.joint_names) == set(frozen)
    q = random_qpos(stiff, rng, 3)
    whole = np.tile(dancer.zero_qpos, (3, 1))
    whole[:, :7] = q[:, :7]
    whole[:, [7 + dancer.joint(j) for j in stiff.joint_names]] = q[:, 7:]
    ours, theirs = forward_kinematics(stiff, q)[0], forward_kinematics(dancer, whole)[0]
    np.testing.assert_allclose(ours, theirs[:, [dancer.body(b) for b in stiff.body_names]], atol=1e-12)
    with pytest.raises(RobotError, match=r"freeze pattern 'tail_\.\*'"):
        load_robot(profiled(tmp_path, dancer_xml(), ("friction = 0.9", 'friction = 0.9\nfreeze = ["tail_.*"]')))


def test_files_lie_beside_the_profile_or_in_an_installed_package(tmp_path):
    told = {"licence": "", "origin": ""}
    assert locate(Source(path="../assets/dancer.xml", **told), ASSETS) == ASSETS / "../assets/dancer.xml"
    inside = locate(Source(path="assets/dancer.xml", package="robot_models", **told), tmp_path)
    assert inside is not None and inside.samefile(ASSETS / "dancer.xml")
    for path, package in (("assets/no.xml", "robot_models"), ("dancer.xml", "no_such_package"), ("x", "not-a-name")):
        assert locate(Source(path=path, package=package, **told), tmp_path) is None
