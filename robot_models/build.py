"""Profile + model file -> compiled, mesh-free, named `RobotModel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robot_models.errors import RobotError
from robot_models.model import RobotModel
from robot_models.model_file import read_spec
from robot_models.profile import FEET, RobotProfile, expand_patterns

if TYPE_CHECKING:
    import mujoco

# Contact points are small spheres resting on the sole plane, the layout that every engine of the project shares.
CONTACT_RADIUS = 0.005
FLOOR_BIT, BODY_BIT = 1, 2


def build_robot(profile: RobotProfile) -> RobotModel:
    """Compile a robot and bring it to one layout: root first, joints depth-first, one actuator per joint.

    Raises:
        RobotError: the model file and the profile do not fit each other.
    """
    spec = read_spec(profile)
    joint_names = tuple(j.name for j in spec.joints if j.name != "root")
    where = f"robot '{profile.name}'"
    tables = {
        key: np.array(
            expand_patterns(getattr(profile, key), joint_names, where=f"{where}, {key}", cover=key != "damping")
        )
        for key in ("kp", "kd", "armature", "damping")
    }
    dress(spec, profile)
    _actuate(spec, joint_names, tables["kp"], tables["kd"], profile.imu)
    for name, armature, damping in zip(joint_names, tables["armature"], tables["damping"], strict=True):
        spec.joint(name).armature = armature
        spec.joint(name).damping[0] = damping
    limits = {key: _limits(spec, profile, joint_names, key) for key in ("effort", "velocity")}
    for name, effort in zip(joint_names, limits["effort"], strict=True):
        spec.actuator(name).forcerange = [-effort, effort]
        spec.joint(name).actfrcrange = [-effort, effort]
    try:
        model = spec.compile()
    except (ValueError, RuntimeError) as e:
        raise RobotError(where, found=f"a model that MuJoCo cannot compile ({e})", expected="a robot") from e
    return _finish(profile, model, joint_names, tables, limits)


def dress(spec: mujoco.MjSpec, profile: RobotProfile) -> None:
    """Give the tree its capsules, contact points and floor, and tell what may touch what."""
    import mujoco

    for geom in spec.geoms:
        geom.contype, geom.conaffinity, geom.group = BODY_BIT, BODY_BIT, 0
    for c in profile.capsules:
        body = _body(spec, c.body, f"robot '{profile.name}', capsule '{c.name}'")
        body.add_geom(
            name=c.name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*c.start, *c.end], size=[c.radius, 0, 0], mass=0,
            contype=BODY_BIT, conaffinity=BODY_BIT, rgba=[0.75, 0.77, 0.8, 1],
        )  # fmt: skip
    for side in FEET:
        sole = profile.soles[side]
        body = _body(spec, sole.body, f"robot '{profile.name}', {side} sole")
        for i, (x, y) in enumerate(sole.points):
            body.add_geom(
                name=f"{side}_sole_{i}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[CONTACT_RADIUS, 0, 0], mass=0,
                pos=[x, y, sole.z + CONTACT_RADIUS], contype=0, conaffinity=FLOOR_BIT, condim=3, group=3,
                friction=[profile.friction, 0.005, 0.0001], priority=1,
            )  # fmt: skip
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], contype=FLOOR_BIT, conaffinity=0, group=2,
        material="floor",
    )  # fmt: skip
    _light(spec)
    for a, b in profile.excludes:
        where = f"robot '{profile.name}', excludes"
        spec.add_exclude(bodyname1=_body(spec, a, where).name, bodyname2=_body(spec, b, where).name)


def _light(spec: mujoco.MjSpec) -> None:
    """A stage to look at. Textures are tiny: training keeps one copy of the model per environment."""
    import mujoco

    kind, pattern = mujoco.mjtTexture, mujoco.mjtBuiltin
    spec.add_texture(
        name="sky", type=kind.mjTEXTURE_SKYBOX, builtin=pattern.mjBUILTIN_GRADIENT, width=8, height=48,
        rgb1=[0.32, 0.38, 0.48], rgb2=[0.07, 0.08, 0.1],
    )  # fmt: skip
    spec.add_texture(
        name="floor", type=kind.mjTEXTURE_2D, builtin=pattern.mjBUILTIN_CHECKER, width=16, height=16,
        rgb1=[0.30, 0.33, 0.38], rgb2=[0.26, 0.29, 0.33],
    )  # fmt: skip
    floor = spec.add_material(name="floor", texuniform=True, texrepeat=[1, 1])
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_light(
        pos=[1.5, -1.5, 5], dir=[-0.25, 0.25, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=[0.5, 0.5, 0.5]
    )
    spec.visual.rgba.haze = [0.12, 0.14, 0.17, 1.0]
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.45] * 3


def _actuate(spec: mujoco.MjSpec, joint_names: tuple[str, ...], kp: np.ndarray, kd: np.ndarray, imu: str) -> None:
    """One PD servo per joint, in joint order (MuJoCo's actuator order is the order of creation), and the gyro."""
    import mujoco

    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for name, p, d in zip(joint_names, kp, kd, strict=True):
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=p, kv=d)
        actuator.forcelimited = True
    spec.option.timestep = 0.005
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    site = imu or "imu"
    if not any(s.name == site for s in spec.sites):
        if imu:
            raise RobotError(
                "tracking.imu", found=f"no site '{imu}' in the model file", expected="an existing site, or no entry"
            )
        spec.worldbody.first_body().add_site(name=site)
    spec.add_sensor(name="gyro", type=mujoco.mjtSensor.mjSENS_GYRO, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)


def _limits(spec: mujoco.MjSpec, profile: RobotProfile, joint_names: tuple[str, ...], key: str) -> np.ndarray:
    """Effort or velocity limits: the profile's numbers, else the model file's; a joint without one is refused."""
    where = f"robot '{profile.name}', {key}"
    values = np.array(expand_patterns(getattr(profile, key), joint_names, where=where, cover=False))
    if key == "effort":
        in_file = np.array([spec.joint(n).actfrcrange[1] for n in joint_names])
        values = np.where(values > 0.0, values, in_file)
    bad = [n for n, v in zip(joint_names, values, strict=True) if not v > 0.0]
    if bad:
        raise RobotError(where, found=f"no limit for {', '.join(bad)}", expected=f"a pattern under [joints.{key}]")
    return values


def _finish(
    profile: RobotProfile,
    model: mujoco.MjModel,
    joint_names: tuple[str, ...],
    tables: dict[str, np.ndarray],
    limits: dict[str, np.ndarray],
) -> RobotModel:
    where = f"robot '{profile.name}'"
    ids = [model.joint(n).id for n in joint_names]
    if [int(model.jnt_qposadr[i]) for i in ids] != list(range(7, model.nq)):
        raise RobotError(where, found="joints that are not hinges or not in one tree", expected="one root, hinges only")
    ranges = model.jnt_range[ids]
    free = [n for n, i in zip(joint_names, ids, strict=True) if not model.jnt_limited[i]]
    if free:
        raise RobotError(where, found=f"no position limit for {', '.join(free)}", expected="a range for every joint")
    body_ids = (int(model.body(profile.root).id), *(int(model.jnt_bodyid[i]) for i in ids))
    robot = RobotModel(
        profile=profile,
        model=model,
        joint_names=joint_names,
        body_names=tuple(model.body(b).name for b in body_ids),
        body_ids=body_ids,
        lower=_frozen(ranges[:, 0]),
        upper=_frozen(ranges[:, 1]),
        velocity=_frozen(limits["velocity"]),
        effort=_frozen(limits["effort"]),
        kp=_frozen(tables["kp"]),
        kd=_frozen(tables["kd"]),
        default_qpos=_frozen(_standing(profile, model, joint_names)),
    )
    for name in (
        *profile.landmarks.values(),
        profile.anchor,
        *profile.tracked,
        *(s.body for s in robot.soles.values()),
    ):
        robot.body(name)
    paired = [name for pair in profile.motor_pairs for name in pair]
    if len(set(paired)) < len(paired):
        raise RobotError(f"{where}, motor_pairs", found="a joint that stands in it twice", expected="pairs of joints")
    for name in paired:
        robot.joint(name)
    return robot


def _standing(profile: RobotProfile, model: mujoco.MjModel, joint_names: tuple[str, ...]) -> np.ndarray:
    """Default pose with the lowest sole corner on the floor."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    data.qpos[7:] = expand_patterns(
        profile.default_pose, joint_names, where=f"robot '{profile.name}', default_pose", cover=False
    )
    mujoco.mj_kinematics(model, data)
    lowest = min(
        float((data.body(s.body).xpos + s.corners @ data.body(s.body).xmat.reshape(3, 3).T)[:, 2].min())
        for s in profile.soles.values()
    )
    data.qpos[2] = -lowest
    return np.array(data.qpos)


def _body(spec: mujoco.MjSpec, name: str, where: str) -> mujoco.MjsBody:
    body = spec.body(name)
    if body is None:
        raise RobotError(where, found=f"no body '{name}'", expected=f"one of {', '.join(b.name for b in spec.bodies)}")
    return body


def _frozen(a: np.ndarray) -> np.ndarray:
    a = np.array(a, dtype=float)
    a.setflags(write=False)
    return a
