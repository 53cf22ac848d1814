"""Poses and robots that no profile has: random configurations, and the dancer with its tree made awkward."""

import mujoco
import numpy as np

from robot_models import load_robot
from robot_models.maths import rotation as rot
from robot_models.profile import PROFILES

ASSETS = PROFILES.parent / "assets"


def random_qpos(robot, rng, count):
    """Anywhere, turned anyhow, joints anywhere in their ranges."""
    q = np.tile(robot.default_qpos, (count, 1))
    q[:, :3] = rng.normal(size=(count, 3))
    q[:, 3:7] = rot.normalise(rng.normal(size=(count, 4)))
    q[:, 7:] = rng.uniform(robot.lower, robot.upper, (count, robot.nq - 7))
    return q


def posed(robot, qpos, qvel=None):
    """MuJoCo's own state at a pose."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = qpos
    if qvel is not None:
        data.qvel[:] = qvel
    mujoco.mj_forward(robot.model, data)
    return data


def profiled(folder, xml, *changes, profile="dancer"):
    """A robot of another model file and an altered profile: (old, new) pairs of text."""
    text = (PROFILES / f"{profile}.toml").read_text().replace(f"../assets/{profile}.xml", "mine.xml")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (folder / "mine.xml").write_text(xml)
    (folder / "mine.toml").write_text(text)
    return str(folder / "mine.toml")


def dancer_xml(*changes):
    """The dancer's model file with (old, new) pairs of text exchanged."""
    text = (ASSETS / "dancer.xml").read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def awkward(folder):
    """The dancer with hinges off its bodies' origins, a turned body, slanted axes and a fixed body between two joints."""
    xml = dancer_xml(
        ('<joint name="left_knee" axis="0 1 0"', '<joint name="left_knee" axis="0.1 1 0.2" pos="0.02 -0.01 0.05"'),
        ('<joint name="waist_yaw" axis="0 0 1"', '<joint name="waist_yaw" axis="0.3 -0.2 1" pos="0.01 0.02 -0.03"'),
        ('"right_elbow_link" pos="0 0 -0.24"', '"right_elbow_link" pos="0 0 -0.24" quat="0.9 0.3 -0.2 0.1"'),
        (
            '<body name="left_elbow_link" pos="0 0 -0.24">',
            '<body name="spacer" pos="0.01 0 -0.1" quat="0.9 0.1 0.3 -0.2"><inertial pos="0 0 0" mass="0.1" '
            'diaginertia="0.001 0.001 0.001"/><body name="left_elbow_link" pos="0 0.02 -0.14" quat="0.9 -0.1 0.2 0">',
        ),
    )  # fmt: skip
    # The spacer ends where the left arm ends.
    at = xml.index('<body name="right_shoulder_pitch_link"')
    return load_robot(profiled(folder, xml[:at] + "</body>" + xml[at:]))
