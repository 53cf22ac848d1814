"""Several joints on a body as a chain of bodies: the same kinematics and dynamics, one joint each."""

import mujoco
import numpy as np
import pytest
from smpl_like import mjcf

from robot_models.incoming import split_joints

SMALL = """<mujoco><default><default class="stiff"><joint armature="0.3" range="-1 1"/></default></default>
<worldbody><body name="trunk" pos="0 0 1"><freejoint name="root"/><geom size="0.1"/>
  <body name="arm" pos="0 0.2 0.1" quat="0.8 0.2 0.4 0.4" childclass="stiff">
    <joint name="a" axis="1 0 0" pos="0 0 0.01"/><joint name="b" axis="0 1 0.3"/><joint name="arm_z" axis="0 0 1" pos="0.02 0 0"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
    <body name="hand" pos="0.3 0 0"><joint name="h" axis="0 1 0"/><geom size="0.04"/></body>
  </body>
  <body name="a" pos="0 -0.2 0"><joint name="other" range="-1 1"/><geom size="0.04"/></body>
</body></worldbody></mujoco>"""


@pytest.mark.parametrize("text", [SMALL, mjcf()], ids=["small", "smpl-like"])
def test_a_chain_moves_as_the_body_did(text, rng):
    one = mujoco.MjSpec.from_string(text).compile()
    other = split_joints(mujoco.MjSpec.from_string(text)).compile()
    assert other.body_jntnum.max() == 1 and other.njnt == one.njnt
    assert [one.joint(k).name for k in range(one.njnt)] == [other.joint(k).name for k in range(one.njnt)]
    np.testing.assert_allclose(other.dof_armature, one.dof_armature)
    a, b = mujoco.MjData(one), mujoco.MjData(other)
    for _ in range(5):
        qpos = np.concatenate((rng.normal(size=3), [1.0, 0.0, 0.0, 0.0], rng.uniform(-1.0, 1.0, one.nq - 7)))
        speeds = rng.normal(size=one.nv)
        for data, model in ((a, one), (b, other)):
            data.qpos[:], data.qvel[:] = qpos, speeds
            mujoco.mj_forward(model, data)
        for body in range(1, one.nbody):
            name = one.body(body).name
            np.testing.assert_allclose(b.body(name).xpos, a.body(name).xpos, atol=1e-6)
            np.testing.assert_allclose(b.body(name).xmat, a.body(name).xmat, atol=1e-6)
        # What is needed to hold it, but for a few milligrams of links.
        np.testing.assert_allclose(b.qfrc_bias, a.qfrc_bias, atol=2e-2 * np.abs(a.qfrc_bias).max())


def test_a_body_of_a_joint_that_is_a_bodys_name_gets_another(rng):
    names = {b.name for b in split_joints(mujoco.MjSpec.from_string(SMALL)).bodies}
    assert {"arm", "hand", "a", "a_link", "b"} <= names


def test_a_robot_with_one_joint_a_body_is_left_alone():
    spec = mujoco.MjSpec.from_string(
        SMALL.replace('<joint name="a" axis="1 0 0" pos="0 0 0.01"/><joint name="b" axis="0 1 0.3"/>', "")
    )
    assert split_joints(spec) is spec
