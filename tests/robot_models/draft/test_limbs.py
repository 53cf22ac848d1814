"""Limbs of an unknown humanoid: told from its tree, whatever its bodies are called and in which order they stand."""

import re

import mujoco
import numpy as np
import pytest
from any_pose import dancer_xml

from robot_models import RobotError
from robot_models.draft.limbs import find_limbs, joint_centre, middle_joint
from robot_models.model_file import open_spec


def opened(folder, xml):
    (folder / "r.xml").write_text(xml)
    model = open_spec(folder / "r.xml").compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def limbs_of(folder, xml):
    return find_limbs(*opened(folder, xml), "r.xml")


@pytest.fixture
def plain(tmp_path):
    return limbs_of(tmp_path, dancer_xml())


def test_chains_go_outwards_along_the_tree_and_left_is_at_plus_y(tmp_path, plain):
    model, data = opened(tmp_path, dancer_xml())
    for chains in (plain.legs, plain.arms):
        for chain in chains.values():
            parents = [model.body(int(model.body(b).parentid[0])).name for b in chain]
            assert parents[1:] == list(chain[:-1])
        left, right = (np.mean([data.body(b).xpos[1] for b in chains[s]]) for s in ("left", "right"))
        assert left > 0 > right
    feet, hands = ([data.body(c[-1]).xpos[2] for c in chains.values()] for chains in (plain.legs, plain.arms))
    assert max(feet) < min(hands)


def test_names_do_not_matter(tmp_path, plain):
    """Bodies called b0, b1, ... give the same chains."""
    xml, names = dancer_xml(), re.findall(r'<body name="(\w+)"', dancer_xml())
    for i, name in enumerate(names):
        xml = re.sub(rf'<body name="{name}"', f'<body name="b{i}"', xml)
    xml, back = re.sub(r'joint name="\w+"', "joint", xml), {f"b{i}": n for i, n in enumerate(names)}
    strange = limbs_of(tmp_path, xml)
    assert (back[strange.pelvis], back[strange.torso], back[strange.head]) == (plain.pelvis, plain.torso, plain.head)
    for ours, theirs in ((plain.legs, strange.legs), (plain.arms, strange.arms)):
        assert {s: tuple(back[b] for b in c) for s, c in theirs.items()} == dict(ours)


def test_sides_follow_the_place_and_not_the_name(tmp_path, plain):
    swapped = dancer_xml().replace("left_", "tmp_").replace("right_", "left_").replace("tmp_", "right_")
    strange = limbs_of(tmp_path, swapped)
    assert strange.legs["left"][0].startswith("right_") and strange.arms["right"][0].startswith("left_")
    assert len(strange.legs["left"]) == len(plain.legs["left"])


def test_fixed_bodies_between_the_joints_are_passed_over(tmp_path, plain):
    body = '<body name="left_knee_link" pos="0 0 -0.33">'
    xml = dancer_xml((body, '<body name="sleeve" pos="0 0 -0.2"><body name="left_knee_link" pos="0 0 -0.13">'))
    at = xml.index('<body name="right_hip_yaw_link"')
    xml = xml[:at].rstrip().removesuffix("</body>") + "</body></body>" + xml[at:]
    assert limbs_of(tmp_path, xml) == plain


@pytest.mark.parametrize("name", ["left_index_1", "L_thumb", "left_gripper", "pinky", "left_hand_x_0", "ring_1"])
def test_fingers_are_loose_with_all_that_hangs_from_them_and_change_no_limb(tmp_path, plain, name):
    geom = '<geom size="0.01" mass="0.01"/>'
    tip = f'<body name="tip" pos="0 0 -0.3"><joint name="b"/>{geom}</body>'
    finger = f'<body name="{name}" pos="0 0 -0.09"><joint name="a"/>{geom}{tip}</body>'
    hand = '<geom name="left_hand" class="light"'
    found = limbs_of(tmp_path, dancer_xml((hand, finger + hand)))
    assert set(found.loose) == {name, "tip"} and found.arms == plain.arms and found.legs == plain.legs


def test_words_that_contain_a_finger_or_a_toe_are_none(tmp_path):
    """Negative control: 'ring' and 'toe' inside other words."""
    found = limbs_of(tmp_path, dancer_xml(('"waist_roll_link"', '"steering_link"'), ('"waist_roll"', '"toethless"')))
    assert found.loose == ()


def test_toes_without_a_telling_name_are_told_by_lying_ahead_of_the_ankle(tmp_path, plain):
    toes = '<body name="{s}_front" pos="0.12 0 -0.05"><joint name="{s}_front"/><geom size="0.01" mass="0.01"/></body>'
    changes = [(f'<geom name="{s}_foot"', toes.format(s=s) + f'<geom name="{s}_foot"') for s in ("left", "right")]
    found = limbs_of(tmp_path, dancer_xml(*changes))
    assert set(found.loose) == {"left_front", "right_front"} and found.legs == plain.legs
    assert found.landmarks["left_foot"] == plain.landmarks["left_foot"]


def test_a_head_is_the_tip_above_the_shoulders_and_a_tail_is_none(tmp_path, plain):
    chest = '<geom name="chest"'
    part = '<body name="{n}" pos="0 0 {z}"><joint name="{n}"/><geom size="0.05" mass="0.1"/></body>'
    above = limbs_of(tmp_path, dancer_xml((chest, part.format(n="neck", z=0.4) + chest)))
    below = limbs_of(tmp_path, dancer_xml((chest, part.format(n="tail", z=-0.1) + chest)))
    assert above.head == "neck" and below.head == below.torso == plain.head


def test_a_robot_with_one_arm_is_refused_with_its_bodies(tmp_path):
    spec = mujoco.MjSpec.from_string(dancer_xml())
    spec.delete(spec.body("left_shoulder_pitch_link"))
    with pytest.raises(RobotError, match=r"no two legs and two arms among pelvis.*right_wrist_yaw_link"):
        limbs_of(tmp_path, spec.to_xml())


HIP = """<mujoco><worldbody><body name="base"><freejoint/><geom size=".1"/>
<body name="a" pos="{a}"><joint axis="0 0 1"/><geom size=".01"/><body name="b" pos="{b}"><joint axis="1 0 0"/><geom size=".01"/>
<body name="c" pos="{c}"><joint axis="0 1 0"/><geom size=".01"/><body name="knee" pos="0 0 -.4"><joint axis="0 1 0"/>
<geom size=".01"/><body name="foot" pos="0 0 -.4"><joint axis="1 0 0"/><geom size=".01"/></body></body></body></body></body>
</body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("a", "b", "c", "centre"),
    [
        # Yaw about (0, .1), roll about z = -.1, pitch about x = 0, z = -.1: they meet at (0, .1, -.1).
        ("0 .1 0", "0 0 -.1", "0 0 0", "c"),  # b and c share the place: the last one moves with the limb
        ("0 .1 -.1", "-.05 0 0", "0.05 .05 0", "a"),
        ("0 .1 0", "0 0 -.1", "0 .06 0", "b"),
    ],
)
def test_the_centre_of_a_hip_is_the_body_where_its_axes_meet(tmp_path, a, b, c, centre):
    model, data = opened(tmp_path, HIP.format(a=a, b=b, c=c))
    chain = ("a", "b", "c", "knee", "foot")
    assert joint_centre(model, data, chain) == centre
    assert middle_joint(model, data, chain) == "knee"


ARM = """<mujoco><worldbody><body name="root"><freejoint/><geom size=".1"/>
<body name="pitch" pos="0 .2 0"><joint axis="0 1 0" range="-90 90"/><geom size=".01"/>
<body name="roll"><joint axis="1 0 0" range="-90 90"/><geom size=".01"/>
<body name="yaw" pos="0 0 -.2"><joint axis="0 0 1" range="-90 90"/><geom size=".01"/>
<body name="elbow" pos="0 0 {drop}"><joint axis="0 1 0" range="-90 90"/><geom size=".01"/>
<body name="wrist" pos="{forearm}"><joint axis="1 0 0" range="-90 90"/><geom size=".01" pos=".05 0 0"/>
</body></body></body></body></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(("drop", "forearm"), [("0", ".12 0 0"), ("-.02", ".1 0 0"), ("-.05", "0 0 -.2")])
def test_an_elbow_is_never_the_joint_that_twists_the_upper_arm(tmp_path, drop, forearm):
    model, data = opened(tmp_path, ARM.format(drop=drop, forearm=forearm))
    assert middle_joint(model, data, ("pitch", "roll", "yaw", "elbow", "wrist")) == "elbow"


def test_legs_arms_and_head_on_one_body_are_told_apart(tmp_path):
    """As on small robots: the lowest tips are feet."""
    hinge = '<joint axis="0 1 0" range="-90 90"/><geom size=".01"/>'

    def limb(name, side, y, z, length):
        parts = "".join(f'<body name="{side}_{name}{k}" pos="0 0 {-length}">{hinge}' for k in (1, 2))
        return f'<body name="{side}_{name}0" pos="0 {y} {z}">{hinge}{parts}</body></body></body>'

    limbs = "".join(
        limb("arm", s, sign * 0.12, 0.1, 0.11) + limb("leg", s, sign * 0.05, -0.1, 0.1)
        for s, sign in (("left", 1), ("right", -1))
    )
    head = f'<body name="head" pos="0 0 .2">{hinge}</body>'
    xml = (
        f'<mujoco><worldbody><body name="trunk"><freejoint/><geom size=".1"/>{head}{limbs}</body></worldbody></mujoco>'
    )
    found = limbs_of(tmp_path, xml)
    assert found.legs["left"] == ("left_leg0", "left_leg1", "left_leg2") and found.arms["right"][0] == "right_arm0"
    assert (found.pelvis, found.torso, found.head) == ("trunk", "trunk", "head")
