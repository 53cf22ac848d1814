"""Rods, gears and belts taken out of a model file: the joints that motors move through them are driven themselves.

What ties two branches of the tree (a rod's end to the foot, a gear wheel to the limb) makes the speeds of the lighter one's
joints a linear function of the other's, dq_motor = A dq_joint, and by d'Alembert tau_joint = A^T tau_motor. Both are taken at
the pose of the file, where the ties hold. Two joints on two motors share what these can give: `motor_pairs` of a profile.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from robot_models.incoming.motors import motor_efforts

if TYPE_CHECKING:
    import mujoco

_LIGHTER = 0.5  # of the other branch's mass: whose joints go; two arms that are tied are no linkage
_NIL = 1e-6
_MOST_TIES = 200  # a robot with rods in ankles, knees, waist and fingers has sixty


@dataclass(frozen=True, kw_only=True)
class Linkage:
    """What became of a model's ties."""

    driven: Mapping[str, tuple[str, ...]]  # joint -> the motors' joints that moved it through a linkage
    pairs: tuple[tuple[str, str], ...]  # joints that two motors move together
    left: tuple[str, ...]  # ties that are none of a linkage, in words


def make_serial(spec: mujoco.MjSpec) -> Linkage:
    """Weld cranks, rods and gear wheels where they stand and let the joints that they move have the motors' torques.

    Args:
        spec: a model with its ties and motors; without the ties afterwards. One that MuJoCo does not compile, that has no motors,
            or more ties than any robot, only loses them.
    """
    words = [f"{e.name1} and {e.name2 or 'its place'} by an equality" for e in spec.equalities]
    model = _compiled(spec) if 0 < len(words) <= _MOST_TIES and spec.actuators else None
    for equality in list(spec.equalities):
        spec.delete(equality)
    if model is None:
        return Linkage(driven={}, pairs=(), left=tuple(words))
    tops, by_joint, light = _followers(model)
    driven, pairs = _hand_over(spec, model, by_joint, np.flatnonzero(light), np.flatnonzero(~light))
    motors = {m for by in driven.values() for m in by}
    at_work = {b for m in motors for b in _chain(model, int(model.joint(m).bodyid[0]))}
    done = {tie: top for tie, top in tops.items() if top in at_work}
    for body in range(1, model.nbody):
        if set(done.values()) & set(_chain(model, body)):
            _weld(spec, model, model.body(body).name)
    return Linkage(driven=driven, pairs=tuple(pairs), left=tuple(w for tie, w in enumerate(words) if tie not in done))


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel | None:
    """The model with its ties in dense rows, if there is one; the spec stays as it is."""
    import mujoco

    tried = spec.copy()
    tried.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    try:
        return tried.compile()
    except ValueError:
        return None


def _followers(model: mujoco.MjModel) -> tuple[dict[int, int], ndarray, Bool[ndarray, "nv"]]:
    """Branches that ties make follow others: tops by tie, their speeds by those of the others, which coordinates are theirs."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tops = {tie: top for tie in range(model.neq) if (top := _lighter_branch(model, tie))}
    for _ in range(2):  # what a tie that holds nobody says of the others is nothing
        light = np.array([bool(set(tops.values()) & set(_chain(model, int(b)))) for b in model.dof_bodyid])
        rows, of = _rows(data, list(tops))
        by_joint = -np.linalg.pinv(rows[:, light], rcond=_NIL) @ rows[:, ~light]
        off = np.abs(rows[:, light] @ by_joint + rows[:, ~light])
        tops = {tie: top for tie, top in tops.items() if off[of == tie].max(initial=0.0) < 1e3 * _NIL}
    return tops, by_joint, light


def _hand_over(
    spec: mujoco.MjSpec, model: mujoco.MjModel, by_joint: ndarray, dofs: ndarray, kept: ndarray
) -> tuple[dict[str, tuple[str, ...]], list[tuple[str, str]]]:
    """Torque limits, armature and ranges of motors to the joints that they move: motors and pairs."""
    efforts, driven, pairs = motor_efforts(model), {}, []
    joint_of = [str(model.joint(int(j)).name) for j in model.dof_jntid]
    motors = [i for i, d in enumerate(dofs) if joint_of[d] in efforts]
    ratio = by_joint[motors]
    for moved in _groups(np.abs(ratio) > _NIL):
        by = [k for k in range(len(motors)) if (np.abs(ratio[k, moved]) > _NIL).any()]
        a = ratio[np.ix_(by, moved)]
        if len(by) != len(moved) or np.linalg.cond(a) > 1e4:
            continue
        names = [joint_of[kept[i]] for i in moved]
        of_motors = [joint_of[dofs[motors[k]]] for k in by]
        most = _alone(a, np.array([efforts[m] for m in of_motors]))
        rotors = model.dof_armature[dofs[[motors[k] for k in by]]]
        for i, name in enumerate(names):
            joint = spec.joint(name)
            joint.actfrcrange, joint.actfrclimited = [-most[i], most[i]], True
            joint.armature = float(joint.armature + (a[:, i] ** 2 * rotors).sum())
            if not model.jnt_limited[model.joint(name).id] and len(names) == 1:
                joint.range = sorted(model.joint(of_motors[0]).range / a[0, 0])
                joint.limited = True
            driven[name] = tuple(of_motors)
        if len(names) == 2:
            pairs.append((names[0], names[1]))
    return driven, pairs


def _alone(a: Float[ndarray, "M M"], most: Float[ndarray, "M"]) -> Float[ndarray, "M"]:
    """The largest torque about each joint, none about the others, with motors that give so much [N m]."""
    needed = np.abs(np.linalg.inv(a).T)  # of each motor, for one newton metre about each joint
    return np.asarray((most[:, None] / np.maximum(needed, _NIL)).min(axis=0))


def _groups(moves: ndarray) -> list[list[int]]:
    """Joints that have motors in common, by the columns of what moves what."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    columns = np.flatnonzero(moves.any(axis=0))
    together = moves[:, columns].astype(int)
    _, group = connected_components(coo_array(together.T @ together), directed=False)
    return [[int(c) for c in columns[group == g]] for g in range(group.max(initial=-1) + 1)]


def _lighter_branch(model: mujoco.MjModel, tie: int) -> int:
    """The body at the top of the lighter of the two branches that a tie joins; 0 where neither is light."""
    import mujoco

    kind, of = mujoco.mjtEq(model.eq_type[tie]), mujoco.mjtObj(model.eq_objtype[tie])
    if kind not in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD, mujoco.mjtEq.mjEQ_JOINT):
        return 0
    body_of = model.site_bodyid if of == mujoco.mjtObj.mjOBJ_SITE else np.arange(model.nbody)
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        body_of = model.jnt_bodyid
    ends = [int(model.eq_obj1id[tie]), int(model.eq_obj2id[tie])]
    first, second = (_chain(model, int(body_of[e])) if e >= 0 else [] for e in ends)
    tops = [next((b for b in reversed(a) if b not in other), 0) for a, other in ((first, second), (second, first))]
    masses = [float(model.body_subtreemass[top]) for top in tops]
    if 0 in tops or min(masses) > _LIGHTER * max(masses):
        return 0
    return tops[int(np.argmin(masses))]


def _chain(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all above it, the world left out."""
    chain = []
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain


def _rows(data: mujoco.MjData, ties: Sequence[int]) -> tuple[ndarray, ndarray]:
    """How the errors of some ties change with every coordinate, and which tie a row is of."""
    import mujoco

    kind, of = np.asarray(data.efc_type[: data.nefc]), np.asarray(data.efc_id[: data.nefc])
    equal = (kind == mujoco.mjtConstraint.mjCNSTR_EQUALITY) & np.isin(of, ties)
    return np.asarray(data.efc_J).reshape(data.nefc, -1)[equal], of[equal]


def _weld(spec: mujoco.MjSpec, model: mujoco.MjModel, name: str) -> None:
    """Leave of a body its mass alone."""
    body, compiled = spec.body(name), model.body(name)
    for joint in list(body.joints):
        for actuator in [a for a in spec.actuators if a.target == joint.name]:
            spec.delete(actuator)
        spec.delete(joint)
    for geom in list(body.geoms):
        spec.delete(geom)
    body.explicitinertial, body.mass = True, float(compiled.mass[0])
    body.ipos, body.iquat, body.inertia = compiled.ipos, compiled.iquat, compiled.inertia
