"""Momentum of whole clips at once, from screws: what each coordinate's velocity gives, and how that changes.

All about the world's origin, wrenches and momenta as [moment, force], velocities as [angular, linear of the origin]; the
inertia of a body is then one symmetric matrix, and those of a subtree add up (Featherstone 2008, section 2.13; Orin &
Goswami 2008). T frames, B bodies, nv coordinates of robot_models.rigid_body.jacobians.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from robot_models.maths import rotation as rot
from robot_models.model import RobotModel
from robot_models.rigid_body.jacobians import Kinematics, moved


@dataclass(frozen=True, kw_only=True, eq=False)
class Momentum:
    """What poses make of velocities."""

    kin: Kinematics
    com: Float[ndarray, "T 3"]  # centre of mass [m]
    inertia: Float[ndarray, "T B 6 6"]  # of every body about the world's origin

    def at(self, frames: Int[ndarray, "F"] | slice) -> Momentum:
        """Some of the frames."""
        return Momentum(kin=self.kin.at(frames), com=self.com[frames], inertia=self.inertia[frames])

    @cached_property
    def composite(self) -> Float[ndarray, "T nv 6 6"]:
        """Inertia of all that each coordinate moves."""
        carried = moved(self.kin.robot)[:-1]
        flat = self.inertia.reshape(*self.inertia.shape[:2], 36)
        return np.asarray((carried.T @ flat).reshape(len(flat), -1, 6, 6))

    @cached_property
    def matrix(self) -> Float[ndarray, "T 6 nv"]:
        """Momentum per unit of each coordinate's velocity."""
        return np.asarray((self.composite @ self.kin.screws[..., None])[..., 0].swapaxes(1, 2))

    def mass_matrix(self, frames: Int[ndarray, "F"]) -> Float[ndarray, "F nv nv"]:
        """Joint-space inertia in some frames, armature included [kg m2, kg m, kg]."""
        robot = self.kin.robot
        below = _below(robot)
        full = self.kin.screws[frames] @ self.matrix[frames]  # [j, k] is right where k moves only what j moves
        out = np.where(below, full, 0.0) + np.where(below.T & ~below, full.swapaxes(1, 2), 0.0)
        joints = np.arange(6, out.shape[1])
        out[:, joints, joints] += robot.model.dof_armature[6:]
        return np.asarray(out)

    def holding_torques(self, frames: Int[ndarray, "F"], gravity: float) -> Float[ndarray, "F J nv"]:
        """Derivatives of the joints' torques against gravity [m/s2], by all coordinates, in some frames [N m per unit].

        A coordinate below a joint shifts the weight that the joint holds; one above turns the joint with all it holds.
        """
        robot, part = self.kin.robot, self.at(frames)
        screws, below = part.kin.screws, _below(robot)[6:]
        own = part.composite[:, 6:, 3:]
        shift = np.where(
            below[..., None],
            part.matrix[:, None, 3:].swapaxes(2, 3),
            (own @ screws[:, None].swapaxes(2, 3)).swapaxes(2, 3),
        )  # mass times how each coordinate moves the centre of what each joint holds
        related = below | _below(robot).T[6:]
        turn = screws[:, 6:, None, :3]
        lever = turn[..., 0] * shift[..., 1] - turn[..., 1] * shift[..., 0]
        weight = part.composite[:, 6:, None, :, 5]  # wrench per unit of gravity
        first = screws[:, None, :, :3], screws[:, None, :, 3:]
        bent_turn = rot.cross(first[0], turn)
        bent_shift = rot.cross(first[0], screws[:, 6:, None, 3:]) + rot.cross(first[1], turn)
        bent = (bent_turn * weight[..., :3]).sum(axis=-1) + (bent_shift * weight[..., 3:]).sum(axis=-1)
        return np.asarray(gravity * (lever * related + np.where(below, 0.0, bent * related)))

    def body_momenta(self, velocity: Float[ndarray, "T nv"]) -> Float[ndarray, "T B 6"]:
        """Of every body by itself."""
        return np.asarray((self.inertia @ self.twists(velocity)[..., None])[..., 0])

    def twists(self, velocity: Float[ndarray, "T nv"]) -> Float[ndarray, "T B 6"]:
        """How every body moves."""
        return np.asarray(moved(self.kin.robot)[:-1] @ (self.kin.screws * velocity[..., None]))

    def turning(self, velocity: Float[ndarray, "T nv"]) -> Float[ndarray, "T 6 nv"]:
        """Derivatives of the momentum by the coordinates, with their velocities held.

        A coordinate k carries its bodies' momentum along, [s_k x* h], and the joints in them, which then give other
        velocities: - I_k (s_k x V_k), where V_k is the twist of what it moves.
        """
        robot, screws = self.kin.robot, self.kin.screws
        twists = self.twists(velocity)
        momenta = (self.inertia @ twists[..., None])[..., 0]
        carried = moved(robot)[:-1].T @ momenta
        own = np.zeros_like(screws)  # the root's translation moves whatever velocity it gives
        own[:, 3:6], own[:, 6:] = twists[:, :1], twists[:, _turned(robot)]
        turn, shift = screws[..., :3], screws[..., 3:]
        bent = np.concatenate(
            (rot.cross(turn, own[..., :3]), rot.cross(turn, own[..., 3:]) + rot.cross(shift, own[..., :3])), axis=-1
        )
        along = np.concatenate(
            (
                rot.cross(turn, carried[..., :3]) + rot.cross(shift, carried[..., 3:]),
                rot.cross(turn, carried[..., 3:]),
            ),
            axis=-1,
        )
        return np.asarray((along - (self.composite @ bent[..., None])[..., 0]).swapaxes(1, 2))


def momentum(kin: Kinematics) -> Momentum:
    """The inertias of a clip's poses."""
    mass, centre, inertia = body_inertias(kin.robot)
    at = kin.pos + rot.rotate(kin.quat, np.broadcast_to(centre, kin.pos.shape))
    turn, arm, m = rot.to_matrix(kin.quat), skew(at), mass[:, None, None]
    out = np.zeros((*kin.pos.shape[:2], 6, 6))
    out[..., :3, :3] = turn @ inertia @ turn.swapaxes(-1, -2) - m * (arm @ arm)
    out[..., :3, 3:], out[..., 3:, :3] = m * arm, -m * arm
    out[..., 3:, 3:] = m * np.eye(3)
    return Momentum(kin=kin, com=(mass[:, None] * at).sum(axis=1) / mass.sum(), inertia=out)


def skew(v: Float[ndarray, "*batch 3"]) -> Float[ndarray, "*batch 3 3"]:
    """The matrix whose product with w is v x w."""
    out = np.zeros((*v.shape[:-1], 3, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


@lru_cache(maxsize=16)
def body_inertias(
    robot: RobotModel,
) -> tuple[Float[ndarray, "B"], Float[ndarray, "B 3"], Float[ndarray, "B 3 3"]]:
    """Of every body with what is welded to it: mass [kg], centre [m] and inertia about it [kg m2], in its frame."""
    m, place = robot.model, {b: i for i, b in enumerate(robot.body_ids)}
    mass, first, second = np.zeros(len(place)), np.zeros((len(place), 3)), np.zeros((len(place), 3, 3))
    for part in range(1, m.nbody):
        pos, quat, body = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), part
        while body not in place:
            pos = m.body_pos[body] + rot.rotate(m.body_quat[body], pos)
            quat, body = rot.multiply(m.body_quat[body], quat), int(m.body_parentid[body])
        centre = pos + rot.rotate(quat, m.body_ipos[part])
        turn, i = rot.to_matrix(rot.multiply(quat, m.body_iquat[part])), place[body]
        mass[i] += m.body_mass[part]
        first[i] += m.body_mass[part] * centre
        second[i] += turn @ np.diag(m.body_inertia[part]) @ turn.T - m.body_mass[part] * skew(centre) @ skew(centre)
    centre = first / np.maximum(mass, 1e-12)[:, None]
    return mass, centre, second + mass[:, None, None] * (skew(centre) @ skew(centre))


@lru_cache(maxsize=16)
def _below(robot: RobotModel) -> Bool[ndarray, "nv nv"]:
    """[j, k]: k moves only what j moves too."""
    moves = moved(robot)[:-1] > 0.0
    return np.asarray(~(moves[:, None] & ~moves[:, :, None]).any(axis=0))


@lru_cache(maxsize=16)
def _turned(robot: RobotModel) -> Int[ndarray, "J"]:
    """The body that each joint turns: of those that it moves, the one which fewest joints move."""
    moves = moved(robot)[:-1, 6:] > 0.0
    return np.where(moves, moves.sum(axis=1)[:, None], moves.shape[1] + 1).argmin(axis=0)
