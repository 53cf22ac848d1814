"""What actor and critic see, as a table of rows: slice, unit, frame, noise, and whether a robot can measure it.

The exported policy carries the same table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from robot_models import BodyStates, RobotModel
from robot_models import rotation as rot
from tracking.comparison import ReferenceTables
from tracking.config import ObservationNoise


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """Everything that an observation may be computed from, for N environments at one instant."""

    qpos: Float[ndarray, "P N nq"]  # now, and at the ends of the control periods before
    qvel: Float[ndarray, "P N nv"]
    states: BodyStates  # of the tracked bodies, now
    frame: Int[ndarray, "N"]  # of the reference
    last_action: Float[ndarray, "N J"]
    encoder_bias: Float[ndarray, "N J"]  # [rad]
    heading: Float[ndarray, "N 4"]  # turn from the reference's world to the robot's, fixed at the start of a rollout


@dataclass(frozen=True, kw_only=True)
class Term:
    """One row of the table."""

    name: str
    size: int
    unit: str
    frame: str
    noise: float  # half width of the uniform noise
    measurable: bool  # whether a robot has a sensor for it (the reference and the last action count)
    compute: Callable[[Situation], Float[ndarray, "N size"]]


@dataclass(frozen=True, kw_only=True)
class ObservationTable:
    """Rows in order, with their slices."""

    terms: tuple[Term, ...]

    @cached_property
    def size(self) -> int:
        """Numbers in one observation."""
        return sum(t.size for t in self.terms)

    @property
    def slices(self) -> Mapping[str, slice]:
        """Where each term stands."""
        ends = np.cumsum([t.size for t in self.terms])
        return {t.name: slice(int(e - t.size), int(e)) for t, e in zip(self.terms, ends, strict=True)}

    @cached_property
    def _noise(self) -> tuple[Int[ndarray, "K"], Float[ndarray, "K"]]:
        """Which numbers are noisy, and the half widths of their noise."""
        width = np.repeat([t.noise for t in self.terms], [t.size for t in self.terms]).astype(np.float32)
        noisy = np.flatnonzero(width)
        return noisy, width[noisy]

    def values(self, situation: Situation) -> Float[ndarray, "N size"]:
        """All terms side by side in float32, without noise."""
        out = np.empty((len(situation.frame), self.size), dtype=np.float32)
        at = 0
        for term in self.terms:
            out[:, at : at + term.size] = term.compute(situation)
            at += term.size
        return out

    def disturbed(self, values: Float[ndarray, "N size"], rng: np.random.Generator) -> Float[ndarray, "N size"]:
        """Values as sensors would give them."""
        noisy, width = self._noise
        out = values.copy()
        out[:, noisy] += width * rng.uniform(-1.0, 1.0, size=(len(values), len(noisy)))
        return out

    def as_rows(self) -> list[dict[str, object]]:
        """The table for a file."""
        return [
            {
                "name": t.name,
                "slice": [self.slices[t.name].start, self.slices[t.name].stop],
                "unit": t.unit,
                "frame": t.frame,
                "noise": t.noise,
                "measurable": t.measurable,
            }
            for t in self.terms
        ]


def actor_table(
    robot: RobotModel,
    tables: ReferenceTables,
    noise: ObservationNoise,
    look_ahead: tuple[int, ...],
    look_back: tuple[int, ...],
) -> ObservationTable:
    """What a robot can know: the reference, its IMU, its encoders and its own last action."""
    j = len(robot.joint_names)
    default = robot.default_joint_pos
    terms = []
    for ahead in look_ahead:
        terms += [
            Term(name=f"reference_joint_pos_{ahead}", size=j, unit="rad", frame="joint", noise=0.0, measurable=True,
                 compute=partial(_ahead, tables.joint_pos - default, ahead)),
            Term(name=f"reference_joint_vel_{ahead}", size=j, unit="0.1 rad/s", frame="joint", noise=0.0, measurable=True,
                 compute=partial(_ahead, 0.1 * tables.joint_vel, ahead)),
        ]  # fmt: skip
    terms += [
        Term(name="anchor_orientation", size=6, unit="", frame="robot anchor: first two columns of the reference anchor",
             noise=noise.orientation, measurable=True, compute=lambda s: _anchor_orientation(s, tables)),
        Term(name="last_action", size=j, unit="", frame="joint", noise=0.0, measurable=True,
             compute=lambda s: s.last_action),
    ]  # fmt: skip
    for back in (0, *look_back):
        name = "{}" if back == 0 else f"{{}}_{back}_ago"
        terms += [
            Term(name=name.format("gyro"), size=3, unit="0.25 rad/s", frame="root body", noise=0.25 * noise.gyro,
                 measurable=True, compute=partial(_gyro, back)),
            Term(name=name.format("joint_pos"), size=j, unit="rad", frame="joint, off the default pose",
                 noise=noise.joint_position, measurable=True, compute=partial(_joint_pos, back, default)),
            Term(name=name.format("joint_vel"), size=j, unit="0.1 rad/s", frame="joint", noise=0.1 * noise.joint_velocity,
                 measurable=True, compute=partial(_joint_vel, back)),
        ]  # fmt: skip
    return ObservationTable(terms=tuple(terms))


def privileged_table(tables: ReferenceTables) -> ObservationTable:
    """What only a simulator knows: the critic sees it beside everything that the actor sees, noise left away."""
    k = len(tables.bodies)
    terms = (
        Term(name="anchor_position", size=3, unit="m", frame="robot anchor", noise=0.0, measurable=False,
             compute=lambda s: _anchor_position(s, tables)),
        Term(name="root_lin_vel", size=3, unit="m/s", frame="root body", noise=0.0, measurable=False,
             compute=lambda s: rot.rotate(rot.conjugate(s.qpos[0, :, 3:7]), s.qvel[0, :, :3])),
        Term(name="body_pos", size=3 * k, unit="m", frame="robot anchor", noise=0.0, measurable=False,
             compute=lambda s: _body_positions(s, tables)),
        Term(name="phase", size=1, unit="share of the clip", frame="", noise=0.0, measurable=False,
             compute=lambda s: (s.frame / max(1, tables.frames - 1))[:, None]),
    )  # fmt: skip
    return ObservationTable(terms=terms)


def _ahead(table: ndarray, frames: int, s: Situation) -> ndarray:
    """Rows of a reference table some frames on; the last row holds at the end."""
    return np.asarray(table[np.minimum(s.frame + frames, len(table) - 1)])


def _gyro(back: int, s: Situation) -> ndarray:
    return np.asarray(0.25 * s.qvel[back, :, 3:6])


def _joint_pos(back: int, default: ndarray, s: Situation) -> ndarray:
    return np.asarray(s.qpos[back, :, 7:] + s.encoder_bias - default)


def _joint_vel(back: int, s: Situation) -> ndarray:
    return np.asarray(0.1 * s.qvel[back, :, 6:])


def _anchor_orientation(s: Situation, tables: ReferenceTables) -> ndarray:
    """First two columns of robot_anchor_from_reference_anchor, row by row (BeyondMimic's layout).

    The reference is turned by the heading difference of the rollout's start, which a robot fixes once with its IMU.
    """
    robot = s.states.quat[:, tables.anchor]
    wanted = rot.multiply(s.heading, tables.quat[s.frame, tables.anchor])
    matrix = rot.to_matrix(rot.multiply(rot.conjugate(robot), wanted))
    return matrix[..., :2].reshape(len(robot), 6)


def _anchor_position(s: Situation, tables: ReferenceTables) -> ndarray:
    a = tables.anchor
    return rot.rotate(rot.conjugate(s.states.quat[:, a]), tables.pos[s.frame, a] - s.states.pos[:, a])


def _body_positions(s: Situation, tables: ReferenceTables) -> ndarray:
    a = tables.anchor
    relative = s.states.pos - s.states.pos[:, a, None]
    return rot.rotate(rot.conjugate(s.states.quat[:, a, None]), relative).reshape(len(relative), -1)
