"""Rods and gears taken out: the torques that are left at the joints, against levers worked out by hand and against MuJoCo."""

import mujoco
import numpy as np
import pytest
from any_pose import dancer_xml

from robot_models import load_robot
from robot_models.draft.profile_text import draft_profile
from robot_models.incoming import make_serial
from robot_models.model_file import linkages, open_spec

CRANK, BACK, ASIDE, MOST = 0.03, 0.045, 0.02, 12.0  # [m], [m], [m], [N m]


def parallel_ankles(ties=""):
    """The dancer with cranks on the shins that rods join to the backs of the feet, and motors on the cranks alone."""
    xml = dancer_xml()
    cranks = "".join(
        f'<body name="SIDE_crank_{k}" pos="{CRANK - BACK} {s * ASIDE} -0.13"><joint name="SIDE_motor_{k}" axis="0 1 0" '
        f'range="-1 1" armature="0.002"/><geom type="capsule" fromto="0 0 0 {-CRANK} 0 0" size="0.005" mass="0.05"/>'
        f'<body name="SIDE_rod_{k}" pos="{-CRANK} 0 0"><joint type="ball" name="SIDE_ball_{k}"/>'
        f'<geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.004" mass="0.02"/></body></body>'
        for k, s in (("a", 1), ("b", -1))
    )
    equalities, motors = "", ""
    for side in ("left", "right"):
        at = f'<body name="{side}_ankle_pitch_link"'
        xml = xml.replace(at, cranks.replace("SIDE", side) + at)
        for k in "ab":
            equalities += f'<connect body1="{side}_rod_{k}" body2="{side}_ankle_roll_link" anchor="0 0 -0.2"/>'
            motors += f'<motor joint="{side}_motor_{k}" gear="1" ctrllimited="true" ctrlrange="{-MOST} {MOST}"/>'
    return xml.replace("</mujoco>", f"<equality>{equalities}{ties}</equality><actuator>{motors}</actuator></mujoco>")


@pytest.fixture
def ankles(tmp_path):
    (tmp_path / "parallel.xml").write_text(parallel_ankles())
    return tmp_path / "parallel.xml"


def test_an_ankle_on_rods_has_the_torques_of_its_levers(ankles):
    linkage = linkages(ankles)
    assert linkage.driven["left_ankle_pitch"] == ("left_motor_a", "left_motor_b")
    assert linkage.pairs == (("left_ankle_pitch", "left_ankle_roll"), ("right_ankle_pitch", "right_ankle_roll"))
    assert linkage.left == ()
    model = open_spec(ankles).compile()
    assert [model.joint(j).name for j in range(1, model.njnt)] == _joints(dancer_xml())
    for side in ("left", "right"):
        pitch, roll = (model.joint(f"{side}_ankle_{way}") for way in ("pitch", "roll"))
        np.testing.assert_allclose(model.jnt_actfrcrange[pitch.id][1], 2 * MOST * BACK / CRANK, rtol=1e-6)
        np.testing.assert_allclose(model.jnt_actfrcrange[roll.id][1], 2 * MOST * ASIDE / CRANK, rtol=1e-6)
        rotors = 2 * 0.002 * (BACK / CRANK) ** 2
        np.testing.assert_allclose(model.dof_armature[pitch.dofadr[0]], rotors, rtol=1e-6)
    weighed = mujoco.MjSpec.from_string(parallel_ankles()).compile()
    np.testing.assert_allclose(model.body_mass.sum(), weighed.body_mass.sum())


def test_motors_hold_the_foot_where_the_joints_torque_does(ankles):
    """MuJoCo's own constraints: cranks at their limit hold nineteen twentieths of the pitch's torque and no more."""
    moved = {}
    for extra in (0.95, 1.05):
        model = mujoco.MjSpec.from_file(str(ankles)).compile()
        model.opt.gravity[:], model.dof_damping[:], model.eq_solimp[:, :2] = 0.0, 0.0, 0.9999
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        dof = int(model.joint("left_ankle_pitch").dofadr[0])
        data.ctrl[:2] = -MOST
        data.qfrc_applied[dof] = extra * 2 * MOST * BACK / CRANK
        mujoco.mj_forward(model, data)
        moved[extra] = float(data.qacc[dof])
    assert moved[0.95] < 0.0 < moved[1.05]


def _joints(xml):
    model = mujoco.MjSpec.from_string(xml).compile()
    return [model.joint(j).name for j in range(1, model.njnt)]


def test_the_draft_names_the_pair_and_its_robot_shares_its_torque(ankles, tmp_path):
    draft = draft_profile(ankles, "parallel", tmp_path / "parallel.toml")
    (tmp_path / "parallel.toml").write_text(draft.text)
    told = "left_ankle_pitch and left_ankle_roll have the torques that left_motor_a and left_motor_b"
    assert any(told in guess for guess in draft.guesses)
    robot = load_robot(str(tmp_path / "parallel.toml"))
    torque, first, second = np.zeros(len(robot.joint_names)), *map(robot.joint, ("left_ankle_pitch", "left_ankle_roll"))
    torque[[first, second]] = 0.7 * robot.effort[[first, second]] * [1, -1]
    assert robot.torque_share(torque)[first] == pytest.approx(1.4)
    assert robot.torque_share(torque)[second] == pytest.approx(0.7)


def test_a_gear_wheel_gives_its_torque_armature_and_range_times_the_ratio():
    wheel = (
        '<body name="wheel" pos="0.05 0 -0.1"><joint name="left_knee_motor" axis="0 1 0" range="-0.2 10" armature="0.001"/>'
        '<geom type="cylinder" size="0.02 0.005" mass="0.1"/></body>'
    )
    xml = dancer_xml(
        ('<body name="left_knee_link"', wheel + '<body name="left_knee_link"'),
        (
            '<joint name="left_knee" axis="0 1 0" range="-0.05 2.5"/>',
            '<joint name="left_knee" axis="0 1 0" limited="false"/>',
        ),
        (
            "</mujoco>",
            '<equality><joint joint1="left_knee_motor" joint2="left_knee" polycoef="0 4 0 0 0"/></equality>'
            '<actuator><motor joint="left_knee_motor" forcelimited="true" forcerange="-15 15"/></actuator></mujoco>',
        ),
    )
    spec = mujoco.MjSpec.from_string(xml)
    linkage = make_serial(spec)
    assert linkage.driven == {"left_knee": ("left_knee_motor",)} and linkage.pairs == ()
    model = spec.compile()
    knee = model.joint("left_knee")
    np.testing.assert_allclose(model.jnt_actfrcrange[knee.id], [-60.0, 60.0])
    np.testing.assert_allclose(model.jnt_range[knee.id], [-0.05, 2.5])
    np.testing.assert_allclose(model.dof_armature[knee.dofadr[0]], 0.016)
    assert model.nu == 0 and model.neq == 0


def test_arms_that_are_tied_to_one_another_are_no_linkage(tmp_path):
    (tmp_path / "tied.xml").write_text(parallel_ankles('<joint joint1="left_elbow" joint2="right_elbow"/>'))
    linkage = linkages(tmp_path / "tied.xml")
    assert linkage.left == ("left_elbow and right_elbow by an equality",)
    assert len(linkage.pairs) == 2
    assert "left_elbow" in [j.name for j in open_spec(tmp_path / "tied.xml").joints]
