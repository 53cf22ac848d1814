"""A robot that stands, its references, and MuJoCo's inverse dynamics: what the tests of dynamics share."""

import copy

import mujoco
import numpy as np

from clips import PLANTED, make_reference

FPS = 50.0
G = 9.81


def reference_of(robot, qpos, *, label=PLANTED, fps=FPS, segments=None):
    contact = np.broadcast_to(label, (len(qpos), 4))
    segments = [[0, len(qpos), 0]] if segments is None else segments
    return make_reference(robot, np.asarray(qpos), fps, contact=contact, segments=np.array(segments), meta={})


def standing(robot, frames=5):
    return np.repeat(robot.default_qpos[None], frames, axis=0)


def free_model(robot):
    """MuJoCo's model with nothing but inertia and gravity in its inverse dynamics."""
    model = copy.deepcopy(robot.model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    return model


def mujoco_inverse(model, q, v, a):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(model, data)
    return data, np.array(data.qfrc_inverse)
