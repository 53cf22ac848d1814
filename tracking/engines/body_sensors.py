"""Poses and velocities of the tracked bodies of many robots, read from their states on MuJoCo's own threads.

`mujoco.rollout` returns sensors of one physics step before the state that it returns. So the bodies are read by a
second, one-step rollout that begins at that state: of a model with the robot's tree and sensors, and nothing to
simulate, which costs a fiftieth of a control period.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models import BodyStates, RobotModel
from robot_models.maths import available_threads

if TYPE_CHECKING:
    import mujoco


class BodySensors:
    """Sensors on K bodies of a robot.

    Args:
        robot: the robot.
        bodies: places in its `body_names`.
        count: number of robots N.
        threads: to read on; 0: as many as the process may use.
    """

    def __init__(self, robot: RobotModel, bodies: list[int], count: int, threads: int = 0) -> None:
        import mujoco
        from mujoco import rollout

        model = _sensor_model(robot, bodies)
        threads = (threads or available_threads()) if count > 1 else 1
        self._bodies, self._models = tuple(bodies), [model] * count
        self._data = [mujoco.MjData(model) for _ in range(threads)]
        self._rollout = rollout.Rollout(nthread=threads if count > 1 else 0)
        self._next = np.zeros((count, 1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        self._values, self._some = np.zeros((2, count, 1, model.nsensordata))

    @property
    def states(self) -> BodyStates:
        """World poses and velocities as they were last read; views, body axis K in the order given."""
        values, k = self._values[:, 0], len(self._bodies)
        pos, quat, lin, ang = np.split(values, (3 * k, 7 * k, 10 * k), axis=1)
        return BodyStates(
            pos=pos.reshape(-1, k, 3),
            quat=quat.reshape(-1, k, 4),
            lin_vel=lin.reshape(-1, k, 3),
            ang_vel=ang.reshape(-1, k, 3),
        )

    def read(self, state: Float[ndarray, "N S"]) -> None:
        """Read the bodies of all robots from their physics states."""
        self._into(self._values, state)

    def read_some(self, ids: Int[ndarray, "n"], state: Float[ndarray, "n S"]) -> None:
        """Read the bodies of some robots; the others stay as they were last read."""
        if len(ids):
            self._into(self._some[: len(ids)], state)
            self._values[ids] = self._some[: len(ids)]

    def _into(self, out: ndarray, state: ndarray) -> None:
        n = len(state)
        # Unchecked: the library's checks of arrays that are ours cost 0.7 ms a call for 256 robots.
        self._rollout.rollout(
            self._models[:n], self._data, np.ascontiguousarray(state, dtype=float), nstep=1, state=self._next[:n],
            sensordata=out, skip_checks=True,
        )  # fmt: skip

    def close(self) -> None:
        """End the threads."""
        self._rollout.close()


def _sensor_model(robot: RobotModel, bodies: list[int]) -> mujoco.MjModel:
    """The robot's tree of bodies and joints, with four frame sensors per body, and nothing else."""
    import mujoco

    m, spec = robot.model, mujoco.MjSpec()
    made = [spec.worldbody]
    for b in range(1, m.nbody):
        body = made[m.body_parentid[b]].add_body(
            name=f"{b}",
            pos=m.body_pos[b],
            quat=m.body_quat[b],
            mass=1.0,
            inertia=[1.0, 1.0, 1.0],
            explicitinertial=True,
        )
        for j in range(m.body_jntadr[b], m.body_jntadr[b] + m.body_jntnum[b]):
            body.add_joint(type=m.jnt_type[j], axis=m.jnt_axis[j], pos=m.jnt_pos[j])
        made.append(body)
    kind, off = mujoco.mjtSensor, mujoco.mjtDisableBit
    for sensor in (kind.mjSENS_FRAMEPOS, kind.mjSENS_FRAMEQUAT, kind.mjSENS_FRAMELINVEL, kind.mjSENS_FRAMEANGVEL):
        for b in bodies:
            spec.add_sensor(type=sensor, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=f"{robot.body_ids[b]}")
    # What is off would be computed and not used: the step that follows the reading is thrown away.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.disableflags = (
        off.mjDSBL_CONSTRAINT | off.mjDSBL_CONTACT | off.mjDSBL_EULERDAMP | off.mjDSBL_GRAVITY | off.mjDSBL_SPRING
        | off.mjDSBL_DAMPER | off.mjDSBL_ACTUATION | off.mjDSBL_AUTORESET
    )  # fmt: skip
    return spec.compile()
