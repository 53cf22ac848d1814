"""PhysX 5 (by SAPIEN, on the CPU): the second engine, built joint by joint from the first one's models.

Traps that this file steps around: PhysX's own defaults are joint friction and link damping of 0.05; SAPIEN's settings
belong to the process, and are read when a scene or a shape is made; its joints come in an order of its own; velocities
of links are those of their centres of mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import import_or_refuse
from robot_models.maths import rotation as rot
from tracking.engines.actuators import servo_gains, torque_limits
from tracking.engines.mujoco import floor_geoms
from tracking.engines.physics import EngineOptions, PhysicsBatch
from tracking.errors import TrackingError

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, kw_only=True)
class PhysxProfile:
    """How PhysX is run."""

    name: str
    physics_dt: float  # longest step [s]
    drives: bool  # implicit drives of the engine; otherwise our own servo, as a clipped torque, each step
    position_iterations: int
    velocity_iterations: int


ISAAC = PhysxProfile(name="isaac", physics_dt=0.005, drives=True, position_iterations=8, velocity_iterations=4)
"""As Isaac Lab's trackers are trained."""
MOTOR = PhysxProfile(name="motor", physics_dt=0.001, drives=False, position_iterations=8, velocity_iterations=1)
"""The law of real motor boards."""


class PhysxBatch(PhysicsBatch):
    """N robots, each in a scene of its own with a floor of its sole's friction.

    Args:
        models: MuJoCo models of the robots; what of them meets the floor in training does here.
        profile: step, motors and solver.
        options: as in `PhysicsBatch`; scenes are stepped one after the other, on one thread.

    Raises:
        TrackingError: SAPIEN is not installed, or a model has what this builder does not know.
    """

    def __init__(
        self, models: Sequence[mujoco.MjModel], *, profile: PhysxProfile = ISAAC, **options: Unpack[EngineOptions]
    ) -> None:
        step = options["control_dt"] / np.ceil(options["control_dt"] / profile.physics_dt - 1e-9)
        super().__init__(models, physics_dt=float(step), **options)
        self.scenes = [PhysxScene(m, self.physics_dt, profile) for m in self.models]
        self._written = np.full_like(self.state, np.nan)

    def _advance(self, targets: Float[ndarray, "N S J"]) -> None:
        for i, scene in enumerate(self.scenes):
            if not np.isfinite(self.state[i]).all():
                continue
            # A state that is as the engine left it is not written back: that would forget its contacts.
            if not np.array_equal(self.state[i], self._written[i]):
                scene.write(self.qpos[i], self.qvel[i])
            for target in targets[i]:
                scene.step(target)
            self.qpos[i], self.qvel[i] = scene.read()
            self.state[i, 0] += self.substeps * self.physics_dt
            self._written[i] = self.state[i]


class PhysxScene:
    """One robot on one floor."""

    def __init__(self, model: mujoco.MjModel, dt: float, profile: PhysxProfile) -> None:
        sapien = _sapien()
        px = sapien.physx
        px.set_shape_config(contact_offset=0.01, rest_offset=0.0)
        px.set_scene_config(
            gravity=model.opt.gravity, enable_tgs=True, enable_enhanced_determinism=True, bounce_threshold=0.5
        )
        px.set_body_config(
            solver_position_iterations=profile.position_iterations,
            solver_velocity_iterations=profile.velocity_iterations,
            sleep_threshold=0.0,
        )
        self.system = px.PhysxCpuSystem()
        self.scene = sapien.Scene([self.system])
        self.scene.set_timestep(dt)
        touching = floor_geoms(model)
        mu = float(model.geom_friction[touching[0], 0])
        # Both sides of the contact get the sole's friction: PhysX takes the mean, MuJoCo the sole's by its priority.
        self.material = px.PhysxMaterial(mu, mu, 0.0)
        self.scene.add_ground(0.0, render=False, material=self.material)
        self.robot = _articulation(sapien, self.scene, model, touching, self.material)
        joints = {j.name: j for j in self.robot.active_joints}
        self._names = [model.joint(j).name for j in range(1, model.njnt)]
        self.joints = [joints[name] for name in self._names]
        order = [j.name for j in self.robot.active_joints]
        self._to_engine = np.array([self._names.index(name) for name in order])
        self._from_engine = np.array([order.index(name) for name in self._names])
        self._model = model
        self._kp, self._kd = servo_gains(model)
        self._effort, self._damping = np.array(model.actuator_forcerange[:, 1]), np.array(model.dof_damping[6:])
        self._drives = profile.drives
        for i, joint in enumerate(self.joints):
            joint.set_friction(0.0)
            joint.set_armature([float(model.dof_armature[6 + i])])
            if profile.drives:
                joint.set_drive_properties(
                    float(self._kp[i]), float(self._kd[i] + self._damping[i]), float(self._effort[i]), "force"
                )
        self._root = self.robot.root
        self._com = np.array(self._root.cmass_local_pose.p, dtype=float)

    def write(self, qpos: Float[ndarray, "nq"], qvel: Float[ndarray, "nv"]) -> None:
        """Put the robot into a state in MuJoCo's layout."""
        sapien = _sapien()
        quat = rot.normalise(qpos[3:7])
        spin = rot.rotate(quat, qvel[3:6])
        self.robot.set_root_pose(sapien.Pose(qpos[:3], quat))
        self.robot.set_root_linear_velocity(qvel[:3] + np.cross(spin, rot.rotate(quat, self._com)))
        self.robot.set_root_angular_velocity(spin)
        self.robot.set_qpos(qpos[7:][self._to_engine])
        self.robot.set_qvel(qvel[6:][self._to_engine])

    def read(self) -> tuple[Float[ndarray, "nq"], Float[ndarray, "nv"]]:
        """The state in MuJoCo's layout: root velocity of the body's origin, spin in the body's axes."""
        pose = self.robot.root_pose
        quat = rot.normalise(np.array(pose.q, dtype=float))
        spin = np.array(self.robot.root_angular_velocity, dtype=float)
        velocity = np.array(self.robot.root_linear_velocity, dtype=float) - np.cross(spin, rot.rotate(quat, self._com))
        joint_pos, joint_vel = self._joints()
        return (
            np.concatenate((pose.p, quat, joint_pos)),
            np.concatenate((velocity, rot.rotate(rot.conjugate(quat), spin), joint_vel)),
        )

    def step(self, target: Float[ndarray, "J"]) -> None:
        """One physics step under joint targets [rad]."""
        if self._drives:
            for joint, angle in zip(self.joints, target, strict=True):
                joint.set_drive_target(float(angle))
        else:
            pos, vel = self._joints()
            torque = np.clip(self._kp * (target - pos) - self._kd * vel, *torque_limits(self._model, vel))
            self.robot.set_qf((torque - self._damping * vel)[self._to_engine])
        self.system.step()

    def _joints(self) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
        order = self._from_engine
        return np.array(self.robot.qpos, dtype=float)[order], np.array(self.robot.qvel, dtype=float)[order]


def _articulation(sapien: Any, scene: Any, model: mujoco.MjModel, touching: list[int], material: Any) -> Any:
    """The tree of bodies, joints and shapes that meet the floor of a MuJoCo model."""
    builder = scene.create_articulation_builder()
    links: dict[int, Any] = {0: None}
    for b in range(1, model.nbody):
        parent = links[int(model.body_parentid[b])]
        if b > 1 and parent is None:
            raise TrackingError(f"body {model.body(b).name}", found="a second root", expected="one tree")
        links[b] = link = builder.create_link_builder(parent)
        link.set_name(model.body(b).name)
        link.set_mass_and_inertia(
            float(model.body_mass[b]), sapien.Pose(model.body_ipos[b], model.body_iquat[b]), model.body_inertia[b]
        )
        placed = sapien.Pose(model.body_pos[b], model.body_quat[b])
        if b == 1:
            link.set_joint_properties("undefined", (-np.inf, np.inf), sapien.Pose(), sapien.Pose())
        elif model.body_jntnum[b] == 0:
            link.set_joint_properties("fixed", (-np.inf, np.inf), placed, sapien.Pose())
        else:
            j = int(model.body_jntadr[b])
            axis = sapien.Pose(model.jnt_pos[j], _from_x(model.jnt_axis[j]))
            link.set_joint_name(model.joint(j).name)
            link.set_joint_properties("revolute", [tuple(model.jnt_range[j])], placed * axis, axis)
    for g in touching:
        _add_shape(links[int(model.geom_bodyid[g])], sapien, model, g, {"material": material, "density": 0.0})
    robot = builder.build()
    for link in robot.links:
        link.linear_damping = link.angular_damping = 0.0
        link.max_depenetration_velocity = 1.0
        # One common bit in the second word of a group: these shapes ignore each other.
        for shape in link.collision_shapes:
            shape.set_collision_groups([1, 1, 1, 0])
    return robot


def _add_shape(link: Any, sapien: Any, model: mujoco.MjModel, geom: int, options: dict[str, Any]) -> None:
    """A primitive of a MuJoCo model; SAPIEN's capsules and cylinders lie along x, MuJoCo's along z."""
    import mujoco

    pos, quat, size = model.geom_pos[geom], model.geom_quat[geom], model.geom_size[geom]
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        link.add_sphere_collision(sapien.Pose(pos, quat), radius=float(size[0]), **options)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        link.add_box_collision(sapien.Pose(pos, quat), half_size=size, **options)
    elif kind in (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER):
        along = sapien.Pose(pos, rot.multiply(quat, _from_x(np.array([0.0, 0.0, 1.0]))))
        add = link.add_capsule_collision if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else link.add_cylinder_collision
        add(along, radius=float(size[0]), half_length=float(size[1]), **options)
    else:
        raise TrackingError(
            f"geom {model.geom(geom).name}",
            found=f"a {kind.name[7:].lower()}",
            expected="a sphere, capsule, box or cylinder",
        )


def _from_x(axis: Float[ndarray, "3"]) -> Float[ndarray, "4"]:
    """A rotation that takes x to an axis: PhysX's joints turn about x."""
    across = np.cross((1.0, 0.0, 0.0), axis)
    if np.linalg.norm(across) < 1e-9:
        return np.array((1.0, 0.0, 0.0, 0.0)) if axis[0] > 0 else np.array((0.0, 0.0, 0.0, 1.0))
    return rot.normalise(np.concatenate(((1.0 + axis[0],), across)))


def _sapien() -> Any:
    cure = "pip install 'dance-retarget[sim2sim]'"
    refusal = TrackingError("the second engine", found="no SAPIEN", expected="it installed", cure=cure)
    return import_or_refuse("sapien", refusal)
