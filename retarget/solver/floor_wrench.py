"""What floor and motors cannot give, as rows of the whole-clip solver: what a motion lacks, it is bent until it has it.

The contact wrench that a motion needs is held against the cone of what its touching sole points can give. What is left
over is a residual in gates; its derivative is that of the wrench, seen through the projector off the cone's active face.
Torque beyond a motor's, with the contact forces that suit best, is a residual too. Both are one-sided: a row that the
next step would satisfy of itself leaves the active set, as of every other limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from retarget.config import PhysicsConfig
from retarget.dynamics import (
    PER_WEIGHT,
    FloorPoints,
    ForceCone,
    MomentumRate,
    carrying_joints,
    carrying_parts,
    carrying_points,
    force_cone,
    momentum_rate,
)
from retarget.rules import GRAVITY, DynamicsConfig
from retarget.solver.physics_rows import WRENCH, PhysicsRows
from robot_models import Kinematics, RobotModel, forces, kinematics, skew
from robot_models.maths import dilate

_RULES = DynamicsConfig()


class FloorWrench:
    """A clip's physics: which of its sole points carry, and which rows the last step ended on."""

    def __init__(
        self,
        robot: RobotModel,
        contact: Int[ndarray, "T 4"],
        airborne: Bool[ndarray, "T"],
        start: Float[ndarray, "T nq"],
        fps: float,
        config: PhysicsConfig,
    ) -> None:
        self._robot, self._fps, self._config = robot, fps, config
        kin = kinematics(robot, start)
        # Where soles carry is settled at the start: the motion shall not flee from what it lacks.
        self._carrying = carrying_points(robot, kin.pos, kin.quat, contact, fps, airborne)
        self.score = np.zeros(len(start))  # how far every frame is from what can be [gates], as `Dynamics.score`
        self._held = np.zeros(len(start), dtype=bool)
        self._outwards = np.zeros((len(start), WRENCH))
        self._strained = np.zeros((len(start), len(robot.joint_names)), dtype=bool)
        joints = carrying_joints(robot, self._carrying.soles.shape[1] + self._carrying.parts.shape[1])
        self._dual = np.zeros((len(start), WRENCH + len(joints)))  # of the forces that were best

    def beyond(self, frames: Int[ndarray, "F"], kin: Kinematics, qpos: Float[ndarray, "F nq"]) -> Bool[ndarray, "T"]:
        """Frames of the clip that cannot be, and those around that may help.

        Args:
            frames: all that moved since this was asked last, and two more on either side.
            kin: their poses.
            qpos: the same as configurations.
        """
        c, state = self._config, self._state(frames, kin, qpos)
        self.score[frames[state.rate.inner]] = state.score(self._robot)[state.rate.inner]
        return dilate(self.score > c.settled, round(c.margin_s * self._fps))

    def rows(self, frames: Int[ndarray, "F"], kin: Kinematics, qpos: Float[ndarray, "F nq"]) -> PhysicsRows:
        """The rows of some frames, linearised about their poses; frames beside a gap have none."""
        if self._carrying.parts.shape[1]:  # a hand that turns is on other points of its surface
            self._carrying.parts[frames] = carrying_parts(self._robot, kin.pos, kin.quat, self._carrying.parts.shape[1])
        state, config, robot = self._state(frames, kin, qpos), self._config, self._robot
        inner, strain = state.rate.inner, robot.torque_share(state.torque) - config.effort_share
        fresh = state.missing > config.least
        held = self._held[frames] & ~fresh & inner
        strained = ((strain > 0.0) | self._strained[frames]) & inner[:, None]
        at = np.flatnonzero(fresh | held | strained.any(axis=1))
        face = _Face.of(state, at)
        needed = state.rate.derivatives(at)
        needed[1] += self._levers(kin, state, at)  # what is given goes with the points that it acts on
        needed /= state.gates[:, None]
        size = np.linalg.norm(state.residual[at], axis=1, keepdims=True)
        outwards = np.where(fresh[at, None], state.residual[at] / np.maximum(size, 1e-9), self._outwards[frames[at]])
        # A frame that was brought inside the cone is held from without: along its last residual.
        along = outwards[:, :, None] * outwards[:, None]
        off = np.where(fresh[at, None, None], face.off, along) * (fresh | held)[at, None, None]
        wrench = np.where(fresh[at, None], state.residual[at], (along @ state.wanted[at][..., None])[..., 0])
        wrench *= (fresh | held)[at, None]
        joints, over, strain_by = self._worst_joints(state, face, at, needed, np.where(strained, strain, -np.inf))
        return PhysicsRows(
            frames=at,
            residual=np.concatenate((wrench, over), axis=1),
            by=np.concatenate((off @ needed, strain_by), axis=2),
            outwards=outwards,
            joints=joints,
            config=config,
        )

    def remember(self, frames: Int[ndarray, "F"], rows: PhysicsRows) -> None:
        """Keep which rows the step from `rows` ended on."""
        self._held[frames], self._strained[frames] = False, False
        at = frames[rows.frames]
        self._held[at], self._outwards[at] = rows.holds_wrench, rows.outwards
        for joints, on in zip(rows.joints.T, rows.holds_joint.T, strict=True):
            self._strained[at[on], joints[on]] = True

    def _state(self, frames: Int[ndarray, "F"], kin: Kinematics, qpos: ndarray) -> _State:
        inner = np.zeros(len(frames), dtype=bool)
        inner[1:-1] = frames[2:] - frames[:-2] == 2
        rate = momentum_rate(kin, qpos, 1.0 / self._fps, inner)
        points = self._carrying.at(frames).placed(self._robot, kin.pos, kin.quat)
        demand = rate.demand
        gates = demand.weight * np.repeat((_RULES.moment_gate, _RULES.force_gate), 3)
        cone = force_cone(kin, points, demand.com_w, demand.weight, gates)
        wanted = np.concatenate((demand.moment_w, demand.force_w), axis=1) / gates
        share, self._dual[frames], _ = cone.shares(wanted, demand.torque, self._dual[frames])
        torque = demand.torque.copy()
        torque[:, cone.joints] += (cone.torque @ share[..., None])[..., 0] * inner[:, None]
        residual = (wanted - (cone.wrench @ share[..., None])[..., 0]) * inner[:, None]
        return _State(
            rate=rate,
            points=points,
            cone=cone,
            gates=gates,
            wanted=wanted,
            share=share,
            residual=residual,
            torque=torque,
        )

    def _levers(self, kin: Kinematics, state: _State, at: ndarray) -> Float[ndarray, "F 6 nv"]:
        """The moment about the CoM that contact forces lose as their points move, per unit of every coordinate [N m]."""
        bodies, pos = state.points.body[at], state.points.pos_w[at]
        moves = kin.at(at).derivatives(
            np.repeat(bodies, 3, axis=1), forces(pos).reshape(len(at), 3 * bodies.shape[1], 6)
        )
        moves = moves.reshape(*bodies.shape, 3, moves.shape[2])
        force = state.cone.at(at).forces(state.share[at])
        moment = (skew(force) @ moves).sum(axis=1)
        return np.concatenate((moment, np.zeros_like(moment)), axis=1)

    def _worst_joints(
        self, state: _State, face: _Face, at: ndarray, needed: ndarray, strain: ndarray
    ) -> tuple[ndarray, ndarray, ndarray]:
        """The joints beyond their motors, the worst few of each frame (-1: none): how far [gates], and its derivatives."""
        joints = np.argsort(-strain[at], axis=1)[:, : self._config.joints]
        over = np.take_along_axis(strain[at], joints, axis=1)
        real = np.isfinite(over)
        by = np.zeros((3, *joints.shape, needed.shape[-1]))
        some = np.flatnonzero(real.any(axis=1))
        if len(some):
            inertia = state.rate.mass.mass_matrix(at[some])[:, 6:] / state.rate.dt**2
            bare = np.stack((inertia, -2.0 * inertia, inertia))  # of the torques, were the wrench to act on the root
            bare[1] += state.rate.mass.holding_torques(at[some], GRAVITY)
            part, legs = face.at(some), state.cone.joints
            bare[:, :, legs] += part.torque @ part.shares(needed[:, some], bare[:, :, legs])
            slope = np.sign(state.torque[at[some]]) / (_RULES.effort_gate * self._robot.effort)
            shares = self._robot.sharing @ (bare * slope[..., None])
            by[:, some] = np.take_along_axis(shares, joints[None, some, :, None], axis=2) * real[some, :, None]
        return np.where(real, joints, -1), np.where(real, over, 0.0) / _RULES.effort_gate, by


@dataclass(frozen=True, kw_only=True, eq=False)
class _State:
    """What some frames need, and what they get. F frames."""

    rate: MomentumRate
    points: FloorPoints
    cone: ForceCone
    gates: Float[ndarray, "6"]  # [N m, N]
    wanted: Float[ndarray, "F 6"]  # wrench [gates]
    share: Float[ndarray, "F N"]
    residual: Float[ndarray, "F 6"]  # [gates]
    torque: Float[ndarray, "F J"]  # with the contact forces [N m]

    @property
    def missing(self) -> Float[ndarray, "F"]:
        """The larger of missing force and missing moment [gates]."""
        return np.asarray(np.linalg.norm(self.residual.reshape(-1, 2, 3), axis=-1).max(axis=1))

    def score(self, robot: RobotModel) -> Float[ndarray, "F"]:
        """That, or the torque beyond a motor's [gates]."""
        beyond = np.maximum(robot.torque_share(self.torque) - 1.0, 0.0).max(axis=1)
        return np.asarray(np.maximum(self.missing, beyond / _RULES.effort_gate))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Face:
    """The faces of the cones that the best forces lie on, as far as small changes go."""

    off: Float[ndarray, "F 6 6"]  # what of a wrench no force on the face gives
    wrench: Float[ndarray, "F 6 N"]
    torque: Float[ndarray, "F L N"]
    per_torque: Float[ndarray, "L"]
    gram: Float[ndarray, "F N N"]

    @staticmethod
    def of(state: _State, at: Int[ndarray, "F"]) -> _Face:
        """Of some frames."""
        cone, active = state.cone.at(at), (state.share[at] > 0.0)[:, None]
        wrench, torque = cone.wrench * active, cone.torque * active
        felt = torque * cone.per_torque[:, None]
        gram = wrench.swapaxes(1, 2) @ wrench + felt.swapaxes(1, 2) @ felt + PER_WEIGHT * np.eye(wrench.shape[2])
        off = np.eye(6) - wrench @ np.linalg.solve(gram, wrench.swapaxes(1, 2))
        return _Face(off=off, wrench=wrench, torque=torque, per_torque=cone.per_torque, gram=gram)

    def at(self, frames: Int[ndarray, "f"]) -> _Face:
        """Some of the frames."""
        picked = {name: getattr(self, name)[frames] for name in ("off", "wrench", "torque", "gram")}
        return replace(self, **picked)

    def shares(self, wrench: Float[ndarray, "3 F 6 nv"], torque: Float[ndarray, "3 F L nv"]) -> ndarray:
        """How the shares change with the wrench that is wanted [gates] and the legs' torques without them [N m]."""
        felt = (self.torque * self.per_torque[:, None] ** 2).swapaxes(1, 2)
        return np.linalg.solve(self.gram, self.wrench.swapaxes(1, 2) @ wrench - felt @ torque)
