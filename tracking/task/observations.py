"""What actor and critic see, as a table of rows: slice, unit, frame, noise, and whether a robot can measure it.

The exported policy carries the same table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models import BodyStates, RobotModel
from robot_models.maths import Array, array_namespace
from robot_models.maths import rotation as rot
from tracking.config import ObservationNoise
from tracking.engines import Rng
from tracking.policy import Row, row_of
from tracking.task.tracking_errors import ReferenceTables


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskState:
    """Everything that an observation may be computed from, for N environments at one instant."""

    qpos: Float[Array, "P N nq"]  # now, and at the ends of the control periods before
    qvel: Float[Array, "P N nv"]
    states: BodyStates  # of the tracked bodies, now
    frame: Int[Array, "N"]  # of the reference
    last_action: Float[Array, "N J"]
    encoder_bias: Float[Array, "N J"]  # [rad]
    imu: Float[Array, "N 4"]  # root_from_imu, beyond the nominal mounting
    heading: Float[Array, "N 4"]  # turn from the reference's world to the robot's, fixed at the start of a rollout


Compute = Callable[[TaskState], Array]
"""How the simulation computes a term: for N environments (N, size)."""


@dataclass(frozen=True, kw_only=True)
class ObservationTable:
    """Rows in order, with their slices."""

    rows: tuple[Row, ...]
    computes: tuple[Compute, ...]  # of each row
    to_device: Callable[[ndarray], Array] = np.asarray  # brings arrays to where the task computes

    @cached_property
    def size(self) -> int:
        """Numbers in one observation."""
        return sum(row.size for row in self.rows)

    @property
    def slices(self) -> Mapping[str, slice]:
        """Where each term stands."""
        ends = np.cumsum([row.size for row in self.rows])
        return {row.name: slice(int(end - row.size), int(end)) for row, end in zip(self.rows, ends, strict=True)}

    @cached_property
    def _noise(self) -> tuple[Int[Array, "K"], Float[Array, "K"]]:
        """Which numbers are noisy, and the half widths of their noise."""
        width = np.repeat([row.noise for row in self.rows], [row.size for row in self.rows]).astype(np.float32)
        noisy = np.flatnonzero(width)
        return self.to_device(noisy), self.to_device(width[noisy])

    def values(self, task_state: TaskState) -> Float[Array, "N size"]:
        """All terms side by side in float32, without noise."""
        xp, frame = array_namespace(task_state.frame), task_state.frame
        out = xp.empty((len(frame), self.size), dtype=xp.float32, device=frame.device)
        at = 0
        for row, compute in zip(self.rows, self.computes, strict=True):
            out[:, at : at + row.size] = row.scale * compute(task_state)
            at += row.size
        return out

    def some(self, task_state: TaskState, name: str) -> Float[Array, "N size"]:
        """One term alone in float32, without noise."""
        at = [row.name for row in self.rows].index(name)
        value = self.rows[at].scale * self.computes[at](task_state)
        xp = array_namespace(value)
        return xp.asarray(value, dtype=xp.float32)

    def disturbed(self, values: Float[Array, "N size"], rng: Rng) -> Float[Array, "N size"]:
        """Values as sensors would give them."""
        noisy, width = self._noise
        out = values + 0.0
        out[:, noisy] += width * rng.uniform(-1.0, 1.0, size=(len(values), len(noisy)))
        return out


def actor_table(
    robot: RobotModel,
    tables: ReferenceTables,
    noise: ObservationNoise,
    look_ahead: tuple[int, ...],
    look_back: tuple[int, ...],
    to_device: Callable[[ndarray], Array] = np.asarray,
    *,
    root_ahead: bool = False,
) -> ObservationTable:
    """What a robot can know: the reference, its IMU, its encoders and its own last action."""
    j, default = len(robot.joint_names), to_device(robot.default_joint_pos)
    terms: list[tuple[Row, Compute]] = []
    for ahead in look_ahead:
        terms += [
            (row_of("reference_joint_pos", j, at=ahead), partial(_ahead, tables, tables.joint_pos - default, ahead)),
            (row_of("reference_joint_vel", j, at=ahead, scale=0.1), partial(_ahead, tables, tables.joint_vel, ahead)),
        ]
    travel = rot.rotate(rot.conjugate(tables.qpos[:, 3:7]), tables.qvel[:, :3])[:, :2]
    for ahead in look_ahead if root_ahead else ():
        terms += [
            (row_of("reference_planar_velocity", 0, at=ahead), partial(_ahead, tables, travel, ahead)),
            (row_of("reference_root_height", 0, at=ahead), partial(_ahead, tables, tables.qpos[:, 2:3], ahead)),
        ]
    terms += [
        (row_of("anchor_orientation", j, noise=noise.orientation), lambda s: _anchor_orientation(s, tables)),
        (row_of("last_action", j), lambda s: s.last_action),
    ]
    for back in (0, *look_back):
        positions = row_of("joint_pos", j, at=-back, noise=noise.joint_position)
        terms += [
            (row_of("gyro", j, at=-back, scale=0.25, noise=0.25 * noise.gyro), partial(_gyro, back)),
            (positions, partial(_joint_pos, back, default)),
            (row_of("joint_vel", j, at=-back, scale=0.1, noise=0.1 * noise.joint_velocity), partial(_joint_vel, back)),
        ]
    rows, computes = zip(*terms, strict=True)
    return ObservationTable(rows=rows, computes=computes, to_device=to_device)


def privileged_table(tables: ReferenceTables) -> ObservationTable:
    """What only a simulator knows: the critic sees it beside everything that the actor sees, noise left away."""
    k = len(tables.bodies)
    return _table(
        (row_of("anchor_position", 0), lambda s: _anchor_position(s, tables)),
        (row_of("root_lin_vel", 0), _root_velocity),
        (row_of("body_pos", 0, bodies=k), lambda s: _body_positions(s, tables)),
        (row_of("phase", 0), lambda s: _phase(s, tables)),
    )


TEACHER_SEES_AHEAD = (1, 5)  # frames of the reference, whatever a pupil is shown


def teacher_table(
    robot: RobotModel, tables: ReferenceTables, to_device: Callable[[ndarray], Array]
) -> ObservationTable:
    """What a teacher sees: what an actor can know now, whatever the actor of the task is shown, and the robot's whole state."""
    k, ahead = len(tables.bodies), tables.in_anchor()
    known = actor_table(robot, tables, ObservationNoise(), TEACHER_SEES_AHEAD, (), to_device)
    besides = _table(
        (row_of("root_lin_vel", 0), _root_velocity),
        (row_of("body_pos", 0, bodies=k), lambda s: _body_positions(s, tables)),
        (row_of("height_error", 0), lambda s: _height_error(s, tables)),
        (row_of("reference_body_pos", 0, at=1, bodies=k), partial(_ahead, tables, ahead.pos, 1)),
        (row_of("reference_anchor_vel", 0, at=1), partial(_ahead, tables, ahead.lin_vel, 1)),
        (row_of("reference_anchor_height", 0, at=1), partial(_ahead, tables, ahead.height, 1)),
    )
    return replace(known, rows=(*known.rows, *besides.rows), computes=(*known.computes, *besides.computes))


def _table(*terms: tuple[Row, Compute]) -> ObservationTable:
    rows, computes = zip(*terms, strict=True)
    return ObservationTable(rows=rows, computes=computes)


def _ahead(tables: ReferenceTables, table: Array, frames: int, s: TaskState) -> Array:
    return table[tables.ahead(s.frame, frames)]


def _gyro(back: int, s: TaskState) -> Array:
    return rot.rotate(rot.conjugate(s.imu), s.qvel[back, :, 3:6])


def _joint_pos(back: int, default: Array, s: TaskState) -> Array:
    return s.qpos[back, :, 7:] + s.encoder_bias - default


def _joint_vel(back: int, s: TaskState) -> Array:
    return s.qvel[back, :, 6:]


def _anchor_orientation(s: TaskState, tables: ReferenceTables) -> Array:
    """First two columns of robot_anchor_from_reference_anchor, row by row (BeyondMimic's layout).

    The reference is turned by the heading difference of the rollout's start, which a robot fixes once with its IMU.
    """
    # The anchor hangs from where the root is believed to be: its IMU's word for it.
    root = s.qpos[0, :, 3:7]
    robot = rot.multiply(rot.multiply(rot.multiply(root, s.imu), rot.conjugate(root)), s.states.quat[:, tables.anchor])
    wanted = rot.multiply(s.heading, tables.quat[s.frame, tables.anchor])
    matrix = rot.to_matrix(rot.multiply(rot.conjugate(robot), wanted))
    return matrix[..., :2].reshape(len(robot), 6)


def _root_velocity(s: TaskState) -> Array:
    return rot.rotate(rot.conjugate(s.qpos[0, :, 3:7]), s.qvel[0, :, :3])


def _height_error(s: TaskState, tables: ReferenceTables) -> Array:
    a = tables.anchor
    return (tables.pos[s.frame, a, 2] - s.states.pos[:, a, 2])[:, None]


def _phase(s: TaskState, tables: ReferenceTables) -> Array:
    first, last = tables.first[s.frame], tables.last[s.frame]
    return ((s.frame - first) / array_namespace(first).clip(last - first, 1, None))[:, None]


def _anchor_position(s: TaskState, tables: ReferenceTables) -> Array:
    a = tables.anchor
    return rot.rotate(rot.conjugate(s.states.quat[:, a]), tables.pos[s.frame, a] - s.states.pos[:, a])


def _body_positions(s: TaskState, tables: ReferenceTables) -> Array:
    a = tables.anchor
    relative = s.states.pos - s.states.pos[:, a, None]
    return rot.rotate(rot.conjugate(s.states.quat[:, a, None]), relative).reshape(len(relative), -1)
