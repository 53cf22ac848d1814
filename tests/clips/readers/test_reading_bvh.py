"""BVH: channels, offsets, units and names."""

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, read_clip


def test_the_two_sample_files_are_one_dance():
    bvh, csv = read_clip(SAMPLES / "groove.bvh"), read_clip(SAMPLES / "groove.csv")
    for landmark in ("left_ankle", "right_wrist", "head"):
        a, b = (c.point(landmark) - c.point("pelvis")[:1] for c in (bvh, csv))
        # 1e-3 degrees of the BVH's rounding over a body's length, and the interpolated gap at the left wrist.
        np.testing.assert_allclose(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1), atol=2e-4)


def test_bvh_channel_order_is_read_per_joint(tmp_path):
    text = (SAMPLES / "groove.bvh").read_text()
    other = text.replace("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS 3 Xrotation Yrotation Zrotation")
    (tmp_path / "x.bvh").write_text(other)
    a, b = read_clip(SAMPLES / "groove.bvh"), read_clip(tmp_path / "x.bvh")
    assert np.abs(a.point("left_wrist") - b.point("left_wrist")).max() > 0.05  # the order matters, and is obeyed


def test_bvh_position_channels_that_repeat_the_offset_do_not_double_the_bones(tmp_path):
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    offset = next(line.split()[1:] for i, line in enumerate(lines) if "LeftLeg" in lines[i - 2] and "OFFSET" in line)
    at = next(i for i, line in enumerate(lines) if "JOINT LeftLeg" in line) + 3
    lines[at] = "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation"
    names = [line.split()[1] for line in lines if "JOINT" in line or "ROOT" in line]
    column = 6 + 3 * (names.index("LeftLeg") - 1)
    start = next(i for i, line in enumerate(lines) if "Frame Time" in line) + 1
    for i in range(start, len(lines)):
        cells = lines[i].split()
        lines[i] = " ".join(cells[:column] + offset + cells[column:])
    (tmp_path / "six.bvh").write_text("\n".join(lines))
    a, b = read_clip(SAMPLES / "groove.bvh"), read_clip(tmp_path / "six.bvh")
    np.testing.assert_allclose(a.point("left_ankle"), b.point("left_ankle"), atol=1e-5)


@pytest.mark.parametrize("factor, unit", [(1.0, "cm"), (0.01, "m"), (10.0, "mm"), (0.45 / 2.54, "cmu")])
def test_units_are_found_from_the_legs(tmp_path, factor, unit):
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if "Frame Time" in line) + 1
    for i, line in enumerate(lines):
        words = line.split()
        if "OFFSET" in line:
            lines[i] = "OFFSET " + " ".join(repr(factor * float(w)) for w in words[1:])
        elif i >= start:
            lines[i] = " ".join([*(repr(factor * float(w)) for w in words[:3]), *words[3:]])
    (tmp_path / "u.bvh").write_text("\n".join(lines))
    clip = read_clip(tmp_path / "u.bvh")
    assert {f.what: f.value for f in clip.source.findings}["unit"] == unit
    assert clip.height == pytest.approx(read_clip(SAMPLES / "groove.bvh").height, rel=1e-3)


def test_a_cut_off_bvh_is_refused(tmp_path):
    text = (SAMPLES / "groove.bvh").read_text()
    (tmp_path / "c.bvh").write_text(text[: len(text) // 2])
    with pytest.raises(ClipError, match="expected 601 frames"):
        read_clip(tmp_path / "c.bvh")


@pytest.mark.parametrize(
    "names",
    [
        "Hips Spine Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot LeftToeBase",
        "mixamorig:Hips mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand "
        "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:LeftToeBase",
        "mixamorig1LeftArm mixamorig1LeftForeArm mixamorig1LeftHand mixamorig1LeftUpLeg mixamorig1LeftLeg mixamorig1LeftFoot",
        "Hips LeftCollar LeftShoulder LeftElbow LeftWrist LeftHip LeftKnee LeftAnkle LeftToe",
        "Hips Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L Toes_L",
        "pelvis left_collar left_shoulder left_elbow left_wrist left_hip left_knee left_ankle left_foot",
        "Root Hips LeftShoulder LeftArm LeftForeArm LeftHand LeftLeg LeftShin LeftFoot LeftToeBase",
        "Bip01 Bip01_L_Clavicle Bip01_L_UpperArm Bip01_L_Forearm Bip01_L_Hand Bip01_L_Thigh Bip01_L_Calf Bip01_L_Foot Bip01_L_Toe0",
        "J_Bip_C_Hips J_Bip_L_Shoulder J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand "
        "J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot",
        "DEF-spine DEF-upper_arm.L DEF-forearm.L DEF-hand.L DEF-thigh.L DEF-shin.L DEF-foot.L DEF-toe.L",
        "Character1_Hips Character1_LeftArm Character1_LeftForeArm Character1_LeftHand Character1_LeftUpLeg Character1_LeftLeg "
        "Character1_LeftFoot",
        "hip lCollar lShldrBend lForearmBend lHand lThighBend lShin lFoot",
        "Hips UpperArmL ForeArmL HandL ThighL ShinL FootL",
        "pelvis clavicle_l upperarm_l lowerarm_l hand_l thigh_l calf_l foot_l ball_l neck_01",
        "hip lCollar lShldr lForeArm lHand lThigh lShin lFoot lToe",
    ],
)
def test_the_left_limbs_are_found_in_every_naming_custom(names):
    from clips.identify.landmark_names import find_landmarks

    words = names.split()
    found = find_landmarks(words)
    order = [words.index(found[f"left_{p}"]) for p in ("shoulder", "elbow", "wrist")]
    legs = [words.index(found[f"left_{p}"]) for p in ("hip", "knee", "ankle")]
    assert order == sorted(order) and len(set(order)) == 3  # every custom lists its chains outwards
    assert legs == sorted(legs) and len(set(legs)) == 3
    assert "Collar" not in found["left_shoulder"] and "Clavicle" not in found["left_shoulder"]
