"""Robots without a surface: capsules along their limbs; feet that a tilted hip would turn stand level."""

import mujoco
import numpy as np
import pytest

from robot_models import load_robot
from robot_models.draft.level_feet import level_feet
from robot_models.draft.limb_capsules import limb_capsules
from robot_models.draft.stance import _UNKNOWN_SOLE, stood_up
from robot_models.profile import FEET, PROFILES


@pytest.fixture(scope="module")
def h2():
    return stood_up(PROFILES.parent / "assets" / "h2.xml")[0]


def test_a_capsule_lies_along_every_half_of_a_limb(h2):
    soles = dict.fromkeys(FEET, _UNKNOWN_SOLE)
    bodies = {h2.model.body(b).name for b in range(1, h2.model.nbody)}
    capsules = {c.name: c for c in limb_capsules(h2, soles, {}, bodies)}
    assert len(capsules) == 2 * (4 + 2) + 3  # and trunk, pelvis, head
    for name, start, end in (("left_thigh", "left_hip", "left_knee"), ("right_forearm", "right_elbow", "right_wrist")):
        c = capsules[name]
        frame = h2.data.body(c.body)
        ends = [frame.xpos + frame.xmat.reshape(3, 3) @ np.array(p) for p in (c.start, c.end)]
        first, last = (np.array(h2.data.body(h2.landmarks[mark]).xpos) for mark in (start, end))
        along = (last - first) / np.linalg.norm(last - first)
        for p in ends:  # on the line, and its cap not beyond either joint
            way = float((p - first) @ along)
            assert np.linalg.norm(p - first - way * along) < 1e-3
            assert c.radius - 1e-3 <= way <= np.linalg.norm(last - first) - c.radius + 1e-3
    # A shank is the body that bends at the knee and not the ankle's cross, which turns with the foot.
    assert capsules["left_shank"].body == h2.landmarks["left_knee"]
    assert limb_capsules(h2, soles, {}, ()) == []


def test_a_tilted_hip_leaves_the_feet_level(h2):
    """H2's hips pitch about an axis 30 degrees off y: bent alone, they turn the foot; the other joints turn it back."""
    angles = {n: 0.0 for n in h2.joints} | {f"{s}_hip_pitch_joint": -0.15 for s in FEET}
    angles |= {f"{s}_knee_joint": 0.3 for s in FEET} | {f"{s}_ankle_pitch_joint": -0.15 for s in FEET}
    data = mujoco.MjData(h2.model)
    tilt = []
    for pose in (angles, angles | level_feet(h2, angles)):
        for name, angle in pose.items():
            data.qpos[int(h2.model.joint(name).qposadr[0])] = angle
        mujoco.mj_kinematics(h2.model, data)
        up = [data.body(h2.landmarks[f"{s}_foot"]).xmat[8] for s in FEET]
        tilt.append(float(np.arccos(np.clip(min(up), -1.0, 1.0))))
    assert tilt[0] > 0.02 and tilt[1] < 1e-3
    straight = dict.fromkeys(h2.joints, 0.0)
    assert level_feet(h2, straight) == {}


@pytest.mark.parametrize("name", ["h1", "h1_2", "r1", "h2", "t1", "k1", "n1", "pm01"])
def test_left_mirrors_right_in_every_robot_that_is_built_in(name):
    """Numbers typed off the makers' files: masses equal, places and centres of mass mirrored, ranges too."""
    robot = load_robot(name)
    m = robot.model

    def other(body):
        for a, b in (("left", "right"), ("Left", "Right"), ("_L", "_R"), ("AL", "AR")):
            if a in body:
                return body.replace(a, b)
        return None

    pairs = [(b, other(b)) for b in robot.body_names if other(b) in robot.body_names]
    assert len(pairs) >= 9
    for left, right in pairs:
        a, b = m.body(left), m.body(right)
        assert np.isclose(a.mass[0], b.mass[0], rtol=0.05)
        assert np.allclose(a.pos, b.pos * [1, -1, 1], atol=2e-3)
        assert np.allclose(a.ipos, b.ipos * [1, -1, 1], atol=6e-3)
        assert np.allclose(a.inertia, b.inertia, rtol=0.15, atol=2e-5)
