"""Soles and bodies kept out of the floor and out of one another, in the whole-clip solver.

Every place where two surfaces are near gives one linearised inequality, gap >= wanted. It joins the active set of a
step when the step would break it, and acts as a spring then: firm enough to part bodies, soft enough not to jolt.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from robot_models import BODY_BIT, Kinematics, RobotModel, ancestors, moved, sole_corners
from robot_models.maths import rotation as rot

WORLD = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class Places:
    """N places where surfaces are near, sorted by frame. Bodies are places in `body_names`, or WORLD."""

    frame: Int[ndarray, "N"]
    first: Int[ndarray, "N"]
    second: Int[ndarray, "N"]
    point: Float[ndarray, "N 3"]  # between the surfaces, world [m]
    normal: Float[ndarray, "N 3"]  # unit, from first to second
    gap: Float[ndarray, "N"]  # [m], negative where they overlap

    def where(self, mask: Bool[ndarray, "N"]) -> Places:
        """Some of the places."""
        return Places(**{f.name: getattr(self, f.name)[mask] for f in fields(Places)})

    def along_with(self, other: Places) -> Places:
        """Both, sorted by frame."""
        order = np.argsort(np.concatenate((self.frame, other.frame)), kind="stable")
        both = {f.name: np.concatenate((getattr(self, f.name), getattr(other, f.name)))[order] for f in fields(Places)}
        return Places(**both)


class Clearance:
    """gap >= wanted at some places, linearised about one configuration of the clip."""

    def __init__(
        self,
        places: Places,
        kin: Kinematics,
        wanted: Float[ndarray, "N"],
        spring: Float[ndarray, "N"],
        slack: float = 0.0,
    ) -> None:
        """Begin with the places held that are too near, or by less than `slack` not [m].

        What rests on a spring lies about where the spring ends: let go, it would fall through it in the next step.
        """
        self._gap, self._wanted = places.gap, wanted
        self._frame = places.frame
        self._rows = _rows(places, kin)
        self._spring = spring  # per metre: half of its square is the energy
        self._active = places.gap < wanted + slack
        self.parted = np.unique(self._frame[(places.gap < 0.0) & (places.first != WORLD) & (places.second != WORLD)])
        self.missed = self._frame[:0]  # frames that the last step brings too near, for nothing held them yet

    def add_to(self, blocks: Float[ndarray, "T nv nv"], gradient: Float[ndarray, "T nv"]) -> None:
        """Add the springs of the places in the active set to a quadratic model."""
        on = np.flatnonzero(self._active)
        rows, short = self._rows[on] * self._spring[on, None], (self._gap - self._wanted)[on] * self._spring[on]
        frames, first, count = np.unique(self._frame[on], return_index=True, return_counts=True)
        # One matrix per frame, padded with zero rows, its products in one batch: frames with many places by themselves.
        rows, short = np.vstack((rows, np.zeros(rows.shape[1]))), np.append(short, 0.0)
        for most, fewer in ((4, 0), (8, 4), (len(rows), 8)):
            some = (count > fewer) & (count <= most)
            if not some.any():
                continue
            slots = np.arange(min(most, count[some].max()))
            place = np.where(slots < count[some, None], first[some, None] + slots, len(on))
            stacked = rows[place]
            blocks[frames[some]] += stacked.swapaxes(1, 2) @ stacked
            gradient[frames[some]] += (short[place][:, None] @ stacked)[:, 0]

    def update(self, step: Float[ndarray, "T nv"]) -> int:
        """Let places join and leave by what a step would do; how many did."""
        short = self._wanted - self._gap - (self._rows * step[self._frame]).sum(axis=1)
        active = short > 0.0
        changed = int((active != self._active).sum())
        self.missed = self._frame[active & ~self._active & too_near(self._wanted - short, self._wanted)]
        self._active = active
        return changed


def too_near(gap: Float[ndarray, "N"], wanted: Float[ndarray, "N"]) -> Bool[ndarray, "N"]:
    """Where a gap is not to be left as it is; the springs between bodies are soft, none reaches its whole gap."""
    return np.asarray(gap < 0.5 * wanted - 0.001)


def _rows(places: Places, kin: Kinematics) -> ndarray:
    """Derivatives of the gaps: n . (velocity of second - velocity of first) at the point."""
    force = np.concatenate((rot.cross(places.point, places.normal), places.normal), axis=1)
    moves = moved(kin.robot)
    out = (kin.screws[places.frame] @ force[..., None])[..., 0]
    return np.asarray(out * (moves[places.second] - moves[places.first]))


def low_soles(robot: RobotModel, kin: Kinematics, within: float) -> Places:
    """Corners of the soles less than `within` over the floor [m]."""
    corners = sole_corners(robot, kin.pos, kin.quat)
    frame, foot, corner = np.nonzero(corners[..., 2] < within)
    bodies = np.array([robot.body(s.body) for s in robot.soles.values()])
    point = corners[frame, foot, corner]
    return Places(
        frame=frame,
        first=np.full(len(frame), WORLD),
        second=bodies[foot],
        point=point,
        normal=np.tile([0.0, 0.0, 1.0], (len(frame), 1)),
        gap=point[:, 2],
    )


class Proximity:
    """MuJoCo's collision pass over the frames of a clip: bodies near one another or near the floor."""

    def __init__(self, robot: RobotModel, within: float) -> None:
        import mujoco

        self._model = model = copy.copy(robot.model)
        self._own = (model.geom_contype & BODY_BIT) != 0
        # Here bodies shall feel the floor; MuJoCo asks its geom and, before that, its body.
        model.geom_conaffinity[model.geom("floor").id] |= BODY_BIT
        model.body_conaffinity[0] |= BODY_BIT
        model.geom_margin[self._own] = 0.5 * within  # the margins of both sides count
        model.geom_margin[model.geom("floor").id] = 0.5 * within
        self._data = mujoco.MjData(model)
        self._place = robot.place_of_body
        self._neighbours = np.zeros((len(robot.body_names) + 1,) * 2, dtype=bool)
        self._neighbours = self._near_at_rest(robot)

    def _near_at_rest(self, robot: RobotModel) -> ndarray:
        """Pairs of bodies, one carried by the other, that are near in the default pose; the last index is the world."""
        carried = ancestors(robot)
        above = (carried[:, None] <= carried[None]).all(axis=2)  # every joint of the first carries the second too
        kin = np.pad(above | above.T, (0, 1))
        rest = self(robot.default_qpos[None])
        near = np.zeros_like(kin)
        near[rest.first, rest.second] = near[rest.second, rest.first] = True
        return near & kin

    def __call__(self, qpos: Float[ndarray, "T nq"]) -> Places:
        """Places nearer than the distance asked for."""
        import mujoco

        model, data = self._model, self._data
        found, counts = list[tuple[ndarray, ...]](), np.zeros(len(qpos), dtype=int)
        # A loop: MuJoCo's broad phase works on one state at a time.
        for t, q in enumerate(qpos):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            if data.ncon:
                c = data.contact
                found.append((c.geom + 0, c.pos + 0.0, c.frame[:, :3] + 0.0, c.dist + 0.0))
            counts[t] = data.ncon
        nothing = (np.zeros((0, 2), int), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
        geoms, point, normal, gap = (np.concatenate(a) for a in zip(nothing, *found, strict=True))
        frame = np.repeat(np.arange(len(qpos)), counts)
        body = self._place[model.geom_bodyid[geoms]]
        places = Places(frame=frame, first=body[:, 0], second=body[:, 1], point=point, normal=normal, gap=gap)
        # A link and the one after its neighbour are near by construction: only their overlap counts.
        by_construction = self._neighbours[places.first, places.second] & (gap > 0.0)
        return places.where(self._own[geoms].any(axis=1) & ~by_construction)


class Watch:
    """A clip's near places from step to step: frames that did not move are not searched again."""

    def __init__(self, robot: RobotModel, frames: int, within: float) -> None:
        self._search = Proximity(robot, within)
        self._qpos = np.full((frames, robot.model.nq), np.nan)  # when searched
        self._found = self._search(self._qpos[:0])

    def near(self, frames: Int[ndarray, "F"], qpos: Float[ndarray, "F nq"]) -> Places:
        """The near places of some of the clip's frames, numbered among these."""
        new = np.flatnonzero((qpos != self._qpos[frames]).any(axis=1))
        found = self._search(qpos[new])
        known = np.ones(len(self._qpos), dtype=bool)
        known[frames[new]] = False
        found = replace(found, frame=frames[new][found.frame])
        self._found = self._found.where(known[self._found.frame]).along_with(found)
        self._qpos[frames[new]] = qpos[new]
        place = np.full(len(self._qpos), -1)
        place[frames] = np.arange(len(frames))
        own = self._found.where(place[self._found.frame] >= 0)
        return replace(own, frame=place[own.frame])
