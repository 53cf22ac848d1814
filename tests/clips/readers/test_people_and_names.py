"""Several people in one file are told apart, names are kept whole, and a collar bone is no shoulder."""

import re

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, ReadOptions, read_clip
from clips.identify.mapping import UnknownSkeletonError

GROOVE = (SAMPLES / "groove.bvh").read_text()
WALK = "bvh/cmu_12_01_walk.bvh"


def parts(text):
    """Hierarchy, frame time, and rows of a BVH."""
    head, _, motion = text.partition("MOTION")
    lines = [line for line in motion.splitlines() if line.strip()]
    return head.partition("HIERARCHY")[2], lines[1], [line.split() for line in lines[2:]]


def bvh(tree, time, rows):
    return "\n".join(["HIERARCHY", tree.strip(), "MOTION", f"Frames: {len(rows)}", time, *(" ".join(r) for r in rows)])


def together(first, second, rename=lambda n: n):
    """Two BVH files in one, the second with other names; as long as the shorter, at the first one's rate."""
    (tree, time, rows), (other, _, more) = parts(first), parts(second)
    other = re.sub(r"(ROOT|JOINT)[ ]+(\S+)", lambda m: f"{m[1]} {rename(m[2])}", other)
    return bvh(f"{tree.strip()}\n{other.strip()}", time, [a + b for a, b in zip(rows, more, strict=False)])


def renamed(text, names):
    return re.sub(r"(ROOT|JOINT)([ ]+)(\S+)", lambda m: f"{m[1]}{m[2]}{names.get(m[3], m[3])}", text)


def write(tmp_path, text, name="clip.bvh"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


@pytest.mark.parametrize(
    "rename", [lambda n: n, lambda n: f"Ben_{n}", lambda n: f"ben:{n}"], ids=["same", "prefix", "space"]
)
@pytest.mark.parametrize("other", ["bvh/bandai1_dance_short_normal_001.bvh", WALK, "bvh/lafan1_dance1_subject2.bvh"])
def test_two_people_are_asked_for_and_told_apart(tmp_path, shared, other, rename):
    path = write(tmp_path, together(GROOVE, (shared / other).read_text(), rename))
    with pytest.raises(ClipError, match="2 people") as refused:
        read_clip(path)
    assert (refused.value.option, refused.value.suggestion) == ("person", "1")
    one, two = read_clip(path, ReadOptions(person="1")), read_clip(f"{path}#2")
    alone = read_clip(SAMPLES / "groove.bvh")
    for part in ("left_wrist", "right_ankle", "head"):
        np.testing.assert_allclose(one.point(part), alone.point(part)[: one.frames], atol=1e-9)
    ben = read_clip(shared / other)
    assert len(two.names) == len(ben.names) and two.height == pytest.approx(ben.height, rel=1e-6)
    np.testing.assert_allclose(two.point("left_wrist"), ben.point("left_wrist")[: two.frames], atol=1e-6)


def test_a_person_is_asked_for_by_name_and_somebody_else_is_refused(tmp_path, shared):
    path = write(tmp_path, together(GROOVE, (shared / WALK).read_text(), lambda n: f"Ben_{n}"))
    assert read_clip(path, ReadOptions(person="Ben_Hips")).height == pytest.approx(
        read_clip(shared / WALK).height, rel=1e-6
    )
    for nobody in ("3", "0", "Anna"):
        with pytest.raises(ClipError, match="one of Hips, Ben_Hips"):
            read_clip(path, ReadOptions(person=nobody))


def test_a_person_with_a_prop_needs_no_statement(tmp_path):
    tree, time, rows = parts(GROOVE)
    prop = """ROOT Cane
    {
    OFFSET 0 0 0
    CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
    End Site
    {
    OFFSET 0 90 0
    }
    }"""
    path = write(tmp_path, bvh(f"{tree.strip()}\n{prop}", time, [r + ["50", "0", "0", "0", "0", "0"] for r in rows]))
    np.testing.assert_array_equal(
        read_clip(path).point("left_wrist"), read_clip(SAMPLES / "groove.bvh").point("left_wrist")
    )


SPACED = {
    "3ds Max": {
        "Hips": "Bip01", "LeftUpLeg": "Bip01 L Thigh", "LeftLeg": "Bip01 L Calf", "LeftFoot": "Bip01 L Foot",
        "LeftShoulder": "Bip01 L Clavicle", "LeftArm": "Bip01 L UpperArm", "LeftForeArm": "Bip01 L Forearm",
        "LeftHand": "Bip01 L Hand",
    },
    "words": {
        "LeftUpLeg": "Left Up Leg", "LeftLeg": "Left Leg", "LeftFoot": "Left Foot",
        "LeftShoulder": "Left Shoulder", "LeftArm": "Left Arm", "LeftForeArm": "Left Fore Arm", "LeftHand": "Left Hand",
    },
    "a take's name": {n: f"Skeleton 001:{n}" for n in re.findall(r"(?:ROOT|JOINT)[ ]+(\S+)", GROOVE)},
}  # fmt: skip


@pytest.mark.parametrize("custom", SPACED)
def test_names_with_spaces_are_kept_whole(tmp_path, custom):
    names = SPACED[custom]
    right = {
        k.replace("Left", "Right"): v.replace(" L ", " R ").replace("Left", "Right")
        for k, v in names.items()
        if "Left" in k
    }
    clip = read_clip(write(tmp_path, renamed(GROOVE, names | right)))
    assert set(names.values()) <= set(clip.names)
    for landmark in ("left_hip", "left_elbow", "right_ankle", "right_wrist"):
        np.testing.assert_array_equal(clip.point(landmark), read_clip(SAMPLES / "groove.bvh").point(landmark))


@pytest.mark.parametrize("layout", ["brace on the line", "one line", "tabs and returns"])
def test_however_a_hierarchy_is_laid_out(tmp_path, layout):
    head, _, motion = renamed(GROOVE, {"LeftUpLeg": "Left Up Leg", "RightUpLeg": "Right Up Leg"}).partition("MOTION")
    if layout == "brace on the line":
        head = re.sub(r"\n\s*\{", " {", head)
    elif layout == "one line":
        head = " ".join(re.sub(r"\n\s*\{", " {", head).split())
        head = re.sub(r"(ROOT|JOINT)", r"\n\1", head)  # names end where lines or braces do
    else:
        head = head.replace("\n", "\r\n").replace("  ", "\t")
    clip = read_clip(write(tmp_path, head + "\nMOTION" + motion))
    np.testing.assert_array_equal(clip.positions, read_clip(SAMPLES / "groove.bvh").positions)


COLLARS = {
    "Motive": ("LShoulder", "LUArm", "LFArm", "LHand"),
    "collar called shoulder": ("LeftShoulder", "LeftBiceps", "LeftElbow", "LeftWrist"),
    "numbered": ("shoulder_l", "arm01_l", "elbow_l", "hand_l"),
}


@pytest.mark.parametrize("custom", COLLARS)
def test_a_collar_bone_is_no_shoulder(tmp_path, custom):
    joints = ("LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand")
    left = dict(zip(joints, COLLARS[custom], strict=True))
    right = {
        k.replace("Left", "Right"): re.sub("^L(?!eft)", "R", v).replace("Left", "Right").replace("_l", "_r")
        for k, v in left.items()
    }
    clip = read_clip(write(tmp_path, renamed(GROOVE, left | right)))
    assert clip.landmarks["left_shoulder"] == left["LeftArm"]
    limbs = next(f for f in clip.source.findings if f.what == "limbs")
    assert limbs.value == "along their bones within 0.0 deg" and limbs.confidence == "measured"


def test_a_mapping_that_takes_a_collar_bone_shows_by_its_number(tmp_path):
    honest = read_clip(SAMPLES / "groove.bvh")
    lines = [f'{k} = "{v}"' for k, v in (dict(honest.landmarks) | {"left_shoulder": "LeftShoulder"}).items()]
    (tmp_path / "m.toml").write_text("[landmarks]\n" + "\n".join(lines))
    clip = read_clip(SAMPLES / "groove.bvh", ReadOptions(mapping=str(tmp_path / "m.toml")))
    limbs = next(f for f in clip.source.findings if f.what == "limbs")
    assert limbs.confidence == "assumed" and "left_shoulder to left_elbow" in limbs.why
    assert clip.landmarks["left_shoulder"] == "LeftShoulder"  # what is stated is obeyed


def test_a_draft_prefers_the_bone_that_bends(tmp_path):
    """Names that tell the collar bone and not the rest: the draft begins the arm where its long bones meet."""
    names = {
        "LeftArm": "lb1",
        "LeftForeArm": "lb2",
        "LeftHand": "lb3",
        "RightArm": "rb1",
        "RightForeArm": "rb2",
        "RightHand": "rb3",
    }
    with pytest.raises(UnknownSkeletonError) as refused:
        read_clip(write(tmp_path, renamed(GROOVE, names)))
    assert 'left_shoulder = "lb1"' in refused.value.draft and 'left_wrist = "lb3"' in refused.value.draft


def test_a_twist_bone_is_no_elbow(tmp_path):
    """A roll joint half-way down the upper arm is in line with it, so the arm begins where it began."""
    at = GROOVE.index("JOINT LeftForeArm")
    offset = re.search(r"OFFSET ([^\n]+)", GROOVE[at:])[1].split()
    half = " ".join(str(0.5 * float(x)) for x in offset)
    forearm = GROOVE[at:]
    depth, end = 0, 0
    for match in re.finditer(r"[{}]", forearm):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            end = match.end()
            break
    inner = forearm[:end].replace(" ".join(offset), half, 1)
    roll = f"JOINT LeftArmRoll\n{{\nOFFSET {half}\nCHANNELS 3 Zrotation Yrotation Xrotation\n{inner}\n}}"
    text = GROOVE[:at] + roll + forearm[end:]
    order = [n for n in re.findall(r"(?:ROOT|JOINT)[ ]+(\S+)", GROOVE)]
    column = 6 + 3 * (order.index("LeftForeArm") - 1)
    tree, time, rows = parts(text)
    path = write(tmp_path, bvh(tree, time, [r[:column] + ["0", "0", "0"] + r[column:] for r in rows]))
    assert read_clip(path).landmarks["left_shoulder"] == "LeftArm"


@pytest.mark.parametrize("time", ["0", "0.0", "nan", "none", "-0.016667"])
def test_a_frame_time_that_says_nothing_is_cured_by_the_rate(tmp_path, time):
    path = write(tmp_path, re.sub(r"Frame Time: \S+", f"Frame Time: {time}", GROOVE))
    with pytest.raises(ClipError, match="Frame Time") as refused:
        read_clip(path)
    assert refused.value.option == "fps"
    assert read_clip(path, ReadOptions(fps=60.0)).fps == 60.0


@pytest.mark.parametrize("of", ["the frame time", "all numbers"])
def test_decimal_commas_are_read(tmp_path, of):
    text = (
        re.sub(r"(Frame Time: \d+)\.(\d+)", r"\1,\2", GROOVE)
        if of == "the frame time"
        else re.sub(r"(\d)\.(\d)", r"\1,\2", GROOVE)
    )
    assert text != GROOVE
    clip, honest = read_clip(write(tmp_path, text)), read_clip(SAMPLES / "groove.bvh")
    assert clip.fps == pytest.approx(honest.fps)
    np.testing.assert_array_equal(clip.positions, honest.positions)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
@pytest.mark.parametrize("sample", ["groove.bvh", "groove.csv"])
def test_texts_of_windows_are_read(tmp_path, sample, encoding):
    mark = {"utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}.get(encoding, b"")
    (tmp_path / sample).write_bytes(mark + (SAMPLES / sample).read_text().encode(encoding))
    np.testing.assert_array_equal(read_clip(tmp_path / sample).positions, read_clip(SAMPLES / sample).positions)


SPACES = ["bvh/lafan1_dance1_subject2.bvh", "bvh/perfume_aachan.bvh", "bvh/rokoko_jesse_dance.bvh", "bvh/fair1_dab.bvh"]


def joint_names(text):
    return re.findall(r"(?:ROOT|JOINT)[ \t]+(\S+)", text)


@pytest.mark.parametrize("style", ["words", "take"])
@pytest.mark.parametrize("file", SPACES)
def test_real_skeletons_keep_their_landmarks_under_names_with_spaces(tmp_path, shared, file, style):
    text = (shared / file).read_text()
    apart = {
        n: re.sub(r"(?<=[a-z])(?=[A-Z])", " ", n) if style == "words" else f"Take 3 Ben:{n}" for n in joint_names(text)
    }
    clip, honest = read_clip(write(tmp_path, renamed(text, apart))), read_clip(shared / file)
    assert clip.landmarks == {k: apart.get(v, v) for k, v in honest.landmarks.items()}
    np.testing.assert_array_equal(clip.positions, honest.positions)


@pytest.mark.parametrize("file", [SPACES[0], SPACES[2]])
def test_real_collar_bones_under_the_name_of_a_shoulder_begin_no_arm(tmp_path, shared, file):
    text = (shared / file).read_text()
    motive = {"Shoulder": "Shoulder", "Arm": "UArm", "ForeArm": "FArm", "Hand": "Hand"}
    names = {f"{side}{k}": f"{side[0]}{v}" for side in ("Left", "Right") for k, v in motive.items()}
    clip, honest = read_clip(write(tmp_path, renamed(text, names))), read_clip(shared / file)
    for landmark in ("left_shoulder", "left_elbow", "right_wrist"):
        np.testing.assert_array_equal(clip.point(landmark), honest.point(landmark))


def test_words_of_the_format_inside_names_are_names(tmp_path):
    clip = read_clip(write(tmp_path, renamed(GROOVE, {"Hips": "MOTION_Hips", "Spine": "LOCOMOTION"})))
    assert {"MOTION_Hips", "LOCOMOTION"} <= set(clip.names)


def test_decimal_commas_beside_names_with_dots_are_read(tmp_path):
    text = re.sub(r"(\d)\.(\d)", r"\1,\2", renamed(GROOVE, {"LeftUpLeg": "thigh.L", "RightUpLeg": "thigh.R"}))
    np.testing.assert_array_equal(
        read_clip(write(tmp_path, text)).positions, read_clip(SAMPLES / "groove.bvh").positions
    )


def test_frames_without_a_blank_and_an_absurd_frame_time(tmp_path):
    assert read_clip(write(tmp_path, GROOVE.replace("Frames: ", "Frames:"))).frames == 601
    with pytest.raises(ClipError, match="frames per second"):
        read_clip(write(tmp_path, re.sub(r"Frame Time: \S+", "Frame Time: 1e-320", GROOVE)))


def test_a_second_person_of_a_file_that_holds_one_is_refused(tmp_path):
    assert read_clip(f"{SAMPLES / 'groove.csv'}#1").frames == 601
    with pytest.raises(ClipError, match="this file holds one person"):
        read_clip(f"{SAMPLES / 'groove.csv'}#2")
    with pytest.raises(ClipError, match="one of the two"):
        read_clip(f"{SAMPLES / 'groove.bvh'}#2", ReadOptions(person="3"))
