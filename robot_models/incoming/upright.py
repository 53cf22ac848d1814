"""Bodies whose axes are not the world's at zero, turned so that they are: a sole wants x ahead and z up in its foot's frame.

So does a root, which else lies on its back at zero where the file was made with y up. Only the frame is turned: where the
body is, what hangs on it and how its joint turns stay as they were.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.maths import rotation as rot

if TYPE_CHECKING:
    import mujoco


def turns_of(model: mujoco.MjModel, bodies: Collection[str], yaw: float = 0.0) -> dict[str, Float[ndarray, "4"]]:
    """world_from_body of some bodies with all joints at zero, the root as the file turns it and by `yaw` [rad] besides."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[7:] = 0.0
    mujoco.mj_kinematics(model, data)
    return {name: rot.multiply(rot.from_yaw(np.array(yaw)), np.array(data.body(name).xquat)) for name in bodies}


def turn_upright(spec: mujoco.MjSpec, bodies: Collection[str], yaw: float = 0.0) -> mujoco.MjSpec:
    """The same robot with the frames of some bodies turned to the world's at zero; the spec itself where there are none.

    Raises:
        ValueError: MuJoCo refuses it; KeyError: no body of that name.
    """
    import mujoco

    if not bodies:
        return spec
    turns = turns_of(spec.compile(), bodies, yaw)
    # Written out and read again, every place and turn stands where it counts: no Euler angles, no ends of capsules.
    plain = mujoco.MjSpec.from_string(spec.to_xml())
    for name, turn in turns.items():
        _turn(plain.body(name), turn)
    plain.worldbody.first_body().quat = rot.IDENTITY  # where the root begins is nobody's business
    return plain


def _turn(body: mujoco.MjsBody, turn: Float[ndarray, "4"]) -> None:
    """Turn a body's frame back by what it is turned by, and everything in it on by as much."""
    body.quat = rot.multiply(np.array(body.quat), rot.conjugate(turn))
    body.ipos, body.iquat = rot.rotate(turn, np.array(body.ipos)), rot.multiply(turn, np.array(body.iquat))
    if np.isfinite(body.fullinertia).all():
        xx, yy, zz, xy, xz, yz = body.fullinertia
        about = rot.to_matrix(turn) @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rot.to_matrix(turn).T
        body.fullinertia = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    for part in (*body.geoms, *body.sites, *body.bodies, *body.cameras):
        part.pos, part.quat = rot.rotate(turn, np.array(part.pos)), rot.multiply(turn, np.array(part.quat))
    for joint in body.joints:
        joint.pos, joint.axis = rot.rotate(turn, np.array(joint.pos)), rot.rotate(turn, np.array(joint.axis))


def turned(points: Mapping[str, Float[ndarray, "V 3"]], turns: Mapping[str, Float[ndarray, "4"]]) -> dict[str, ndarray]:
    """Points in bodies' frames, in those frames as they are turned."""
    return {
        name: rot.rotate(np.broadcast_to(turns[name], (len(at), 4)), at) if name in turns else np.asarray(at)
        for name, at in points.items()
    }
