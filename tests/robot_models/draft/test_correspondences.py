"""Landmarks of drafts against another laboratory's table: which body of seven robots stands for which of a person's joints.

The table is that of GMR (general_motion_retargeting/ik_configs, MIT): written by hand, robot by robot, and not looked at when
drafting was written. Their toes are bodies of their own files and stand for the foot here; a hand or an end that is welded
stands for the body that it is welded to.
"""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from half_robots import mjcf

from robot_models.draft.profile_text import draft_profile
from robot_models.model_file import open_spec
from robot_models.profile import read_profile

ASSETS = Path(__file__).parents[3] / "robot_models" / "assets"
TABLE = {  # pelvis, torso; left hip, knee, foot; left shoulder, elbow, wrist
    "g1": """pelvis torso_link left_hip_roll_link left_knee_link left_ankle_roll_link
             left_shoulder_yaw_link left_elbow_link left_wrist_yaw_link""",
    "t1": "Waist Trunk Hip_Yaw_Left Shank_Left left_foot_link AL2 AL3 left_hand_link",
    "n1": """base_link waist_yaw_link left_thigh_roll_link left_shank_pitch_link left_foot_pitch_link
             left_upper_arm_yaw_link left_lower_arm_pitch_link left_hand_yaw_link""",
    "pm01": """LINK_BASE LINK_TORSO_YAW LINK_HIP_ROLL_L LINK_KNEE_PITCH_L LINK_ANKLE_ROLL_L
               LINK_SHOULDER_YAW_L LINK_ELBOW_PITCH_L LINK_ELBOW_YAW_L""",
    "h1": """pelvis torso_link left_hip_roll_link left_knee_link left_ankle_link
             left_shoulder_roll_link left_elbow_link left_elbow_link""",
    "h1_2": """pelvis torso_link left_hip_roll_link left_knee_link left_ankle_roll_link
               left_shoulder_yaw_link left_elbow_link left_wrist_yaw_link""",
    "hi": "base_link waist_link l_hip_roll_link l_calf_link l_ankle_roll_link l_shoulder_roll_link l_elbow_link l_wrist_link",
    "kuavo": "base_link base_link leg_l3_link leg_l4_link leg_l6_link zarm_l2_link zarm_l4_link zarm_l7_link",
}
LANDMARKS = ("pelvis", "torso", "left_hip", "left_knee", "left_foot", "left_shoulder", "left_elbow", "left_wrist")


def model_file(name, folder):
    if (ASSETS / f"{name}.xml").exists():
        return ASSETS / f"{name}.xml"
    (folder / f"{name}.xml").write_text(mjcf(name))
    return folder / f"{name}.xml"


def with_hands(folder):
    """H1-2 with a hand of four fingers and a thumb on each wrist, called as its maker's hands are."""
    spec = mujoco.MjSpec.from_file(str(ASSETS / "h1_2.xml"))
    for side, wrist, y in (("L", "left_wrist_yaw_link", 1.0), ("R", "right_wrist_yaw_link", -1.0)):
        for k, finger in enumerate(("thumb", "index", "middle", "ring", "pinky")):
            body, place = spec.body(wrist), [0.12, y * (0.03 - 0.015 * k), 0.0]
            for part in ("proximal", "intermediate", "distal"):
                body = body.add_body(
                    name=f"{side}_{finger}_{part}", pos=place, mass=0.01, ipos=[0.015, 0, 0], inertia=[1e-6] * 3
                )
                body.add_joint(name=f"{side}_{finger}_{part}_joint", axis=[0, 1, 0], range=[0.0, 1.7], limited=True)
                place = [0.03, 0.0, 0.0]
    (folder / "with_hands.xml").write_text(spec.to_xml())
    return folder / "with_hands.xml"


def agree(model, data, one, other):
    """Bodies that are one, parent and child, or joined by as good as no distance."""
    a, b = model.body(one).id, model.body(other).id
    near = a == b or b == model.body_parentid[a] or a == model.body_parentid[b]
    return near or np.linalg.norm(data.xpos[a] - data.xpos[b]) < 0.02


def posed(path):
    model = open_spec(path).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("name", TABLE)
def test_drafts_find_the_bodies_that_another_laboratory_chose(name, tmp_path):
    path, out = model_file(name, tmp_path), tmp_path / f"{name}_draft.toml"
    out.write_text(draft_profile(path, name, out).text)
    drafted, theirs = read_profile(out).landmarks, dict(zip(LANDMARKS, TABLE[name].split(), strict=True))
    model, data = posed(path)
    elsewhere = {k: (drafted[k], theirs[k]) for k in LANDMARKS if not agree(model, data, drafted[k], theirs[k])}
    assert not elsewhere, elsewhere


def test_fingers_are_no_wrists(tmp_path):
    """What went wrong once: the wrist of H1-2 with hands was a link of a finger."""
    out = tmp_path / "r.toml"
    out.write_text(draft_profile(with_hands(tmp_path), "r", out).text)
    drafted = read_profile(out)
    assert (
        drafted.landmarks["left_wrist"] == "left_wrist_yaw_link"
        and drafted.landmarks["left_elbow"] == "left_elbow_link"
    )
    assert len(drafted.freeze) == 30


def test_an_upper_arm_is_no_elbow_of_that_table(tmp_path):
    """What went wrong once: N1's elbow was the yaw joint of its upper arm, its wrist the elbow."""
    model, data = posed(model_file("n1", tmp_path))
    assert not agree(model, data, "left_upper_arm_roll_link", "left_lower_arm_pitch_link")
    assert not agree(model, data, "left_upper_arm_yaw_link", "left_hand_yaw_link")
