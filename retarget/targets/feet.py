"""Where the robot's feet shall be: planted ones locked to one place per stance, swinging ones led between them.

Each stance is anchored once; the difference between anchor and free motion is spread over the swing before and
after it, so that nothing jumps. A foot on its toe (or heel) turns about that edge of the sole. A pivoting foot keeps
its height and lies flat while its heading follows the source.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from clips import HumanClip
from retarget.config import FeetConfig
from retarget.targets.contacts import Contacts
from retarget.targets.segment_frames import foot_frames
from robot_models import FEET, RobotModel, Sole
from robot_models.maths import away_from, intervals_of
from robot_models.maths import rotation as rot

_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class FootTargets:
    """Poses of the two ankle bodies (sole parallel frame: x forward, z up) in the robot's world."""

    pos: Float[ndarray, "T 2 3"]  # [m]
    quat: Float[ndarray, "T 2 4"]  # wxyz
    contact: Int[ndarray, "T 4"]  # per edge: FREE, PLANTED or PIVOTING
    shift: Float[ndarray, "T 2 2"]  # how far each foot was moved from the source's way, xy [m]

    def moved(self, way: Float[ndarray, "T 2 2"]) -> FootTargets:
        """The same feet elsewhere on the floor."""
        pos = self.pos.copy()
        pos[..., :2] += way
        return replace(self, pos=pos, shift=self.shift + way)


def foot_targets(
    clip: HumanClip, contacts: Contacts, robot: RobotModel, scale: float, config: FeetConfig = FeetConfig()
) -> FootTargets:
    """Foot poses in the robot's size.

    Args:
        clip: the source, floor somewhere near z = 0.
        contacts: its touches.
        robot: gives the soles.
        scale: robot leg length over the person's.
        config: how swings are led.
    """
    poses = [_one_foot(clip, contacts, k, robot.soles[side], scale, config) for k, side in enumerate(FEET)]
    return FootTargets(
        pos=np.stack([p[0] for p in poses], axis=1),
        quat=np.stack([p[1] for p in poses], axis=1),
        contact=contacts.labels,
        shift=np.stack([p[2] for p in poses], axis=1),
    )


def contact_share(
    touching: Bool[ndarray, "T K"], fps: float, config: FeetConfig = FeetConfig()
) -> Float[ndarray, "T K"]:
    """Per edge or part 1 while it touches, falling smoothly to 0 when it does not: how firmly the solver shall hold it."""
    share = np.zeros(touching.shape)
    for k, held in enumerate(touching.T):
        if held.any():
            share[:, k] = 1.0 - smoothstep(away_from(held) / (config.ease_s * fps + 1.0))
    return share


def flat_height(clip: HumanClip, contacts: Contacts, foot: int) -> float:
    """Height of the source's ankle while its foot stands flat [m]: where its floor is for the robot."""
    flat = contacts.in_contact[:, 2 * foot : 2 * foot + 2].all(axis=1)
    z = clip.point(f"{FEET[foot]}_ankle")[:, 2]
    return float(np.median(z[flat])) if flat.any() else float(np.percentile(z, 5.0))


def _one_foot(
    clip: HumanClip, contacts: Contacts, foot: int, sole: Sole, scale: float, config: FeetConfig
) -> tuple[ndarray, ndarray, ndarray]:
    side = FEET[foot]
    heel, toe = contacts.in_contact[:, 2 * foot], contacts.in_contact[:, 2 * foot + 1]
    pivot = contacts.pivoting[:, foot]
    quat = foot_frames(clip, side, heel & toe & ~pivot)
    pos = scale * (clip.point(f"{side}_ankle") - flat_height(clip, contacts, foot) * _Z) - sole.z * _Z
    locked_pos, locked_quat = pos.copy(), quat.copy()
    locked = np.zeros(len(pos), dtype=bool)
    for a, b in intervals_of((heel | toe) & ~pivot):
        part = slice(a, b)
        locked_pos[part], locked_quat[part] = _stance(
            pos[part], quat[part], heel[part], toe[part], sole, config.ramp_s * clip.fps
        )
        locked[part] = True
    if not locked.any():
        return _above_floor(pos, quat, sole), quat, np.zeros((len(pos), 2))
    new_pos = pos + interpolate_offsets(locked_pos - pos, locked, clip.fps, config)
    turn = rot.log(rot.multiply(locked_quat, rot.conjugate(quat)))
    new_quat = rot.multiply(rot.exp(interpolate_offsets(turn, locked, clip.fps, config)), quat)
    new_pos, new_quat = _eased_off(
        new_pos, new_quat, locked_pos, locked_quat, locked & ~pivot, config.ease_s * clip.fps
    )
    new_quat[pivot] = rot.from_yaw(rot.yaw(new_quat[pivot]))
    new_pos[pivot, 2] = -sole.z
    shift = new_pos[:, :2] - pos[:, :2]
    return _above_floor(new_pos, new_quat, sole), rot.continuous(new_quat), shift


def _stance(
    pos: ndarray, quat: ndarray, heel: ndarray, toe: ndarray, sole: Sole, ramp: float
) -> tuple[ndarray, ndarray]:
    """Pose of a foot that touches all along: one heading, one place, turning about the edge that stays down."""
    flat = heel & toe
    base = flat if flat.any() else np.ones(len(pos), dtype=bool)
    heading = rot.yaw(rot.mean(quat[base])[None])
    level = np.broadcast_to(rot.from_yaw(heading)[0], quat.shape)
    pitch = _pitch(quat)
    # On the toes the heel can only be up, on the heel only the toes: the other sign would sink the free edge.
    pitch = np.where(toe & ~heel, np.maximum(pitch, 0.0), np.where(heel & ~toe, np.minimum(pitch, 0.0), 0.0))
    pitch = pitch * _ramp_from(flat, ramp)
    new_quat = rot.multiply(level, rot.exp(pitch[:, None] * np.array([0.0, 1.0, 0.0])))
    edge = np.where((pitch < 0.0)[:, None], np.array(sole.heel), np.array(sole.toe))
    if flat.any():
        ankle = np.array([*pos[flat, :2].mean(axis=0), -sole.z])
        anchor = ankle + rot.rotate(level, edge)
    else:
        anchor = np.broadcast_to((pos + rot.rotate(quat, edge)).mean(axis=0), pos.shape).copy()
        anchor[:, 2] = 0.0
    return anchor - rot.rotate(new_quat, edge), new_quat


def _pitch(quat: ndarray) -> ndarray:
    """Toe-down angle of the foot's x axis [rad]."""
    x = rot.rotate(quat, np.broadcast_to([1.0, 0.0, 0.0], (len(quat), 3)))
    return np.asarray(np.arcsin(np.clip(-x[:, 2], -1.0, 1.0)))


def _ramp_from(flat: ndarray, frames: float) -> ndarray:
    """0 in flat frames, rising smoothly to 1 with the distance from them; 1 all along without any."""
    if not flat.any():
        return np.ones(len(flat))
    return smoothstep(away_from(flat) / max(1.0, frames))


def interpolate_offsets(
    difference: Float[ndarray, "T n"], locked: Bool[ndarray, "T"], fps: float, config: FeetConfig = FeetConfig()
) -> Float[ndarray, "T n"]:
    """The difference where locked, eased between neighbouring locks elsewhere."""
    out = np.where(locked[:, None], difference, 0.0)
    fade = int(config.long_swing_s * fps / 2)
    for a, b in intervals_of(~locked):
        before = difference[a - 1] if a > 0 else None
        after = difference[b] if b < len(locked) else None
        steps = np.arange(1, b - a + 1)
        if before is not None and after is not None and b - a <= 2 * fade:
            w = smoothstep(steps / (b - a + 1))[:, None]
            out[a:b] = (1.0 - w) * before + w * after
            continue
        if before is not None:
            out[a:b] += (1.0 - smoothstep(steps / (fade + 1)))[:, None] * before
        if after is not None:
            out[a:b] += (1.0 - smoothstep(steps[::-1] / (fade + 1)))[:, None] * after
    return out


def _eased_off(
    pos: ndarray, quat: ndarray, locked_pos: ndarray, locked_quat: ndarray, locked: ndarray, ease: float
) -> tuple[ndarray, ndarray]:
    """Swings that leave and meet their stances at rest: a source is called touching while it still moves a little."""
    base_pos, base_quat = locked_pos.copy(), locked_quat.copy()
    for a, b in intervals_of(~locked):
        before, after = max(a - 1, 0), min(b, len(pos) - 1)
        before, after = (before if a > 0 else after), (after if b < len(pos) else before)
        s = smoothstep(np.arange(1, b - a + 1) / (b - a + 1))
        base_pos[a:b] = locked_pos[before] + s[:, None] * (locked_pos[after] - locked_pos[before])
        first, last = (np.broadcast_to(locked_quat[t], (b - a, 4)) for t in (before, after))
        base_quat[a:b] = rot.slerp(first, last, s)
    w = smoothstep(away_from(locked) / (ease + 1.0))
    return base_pos + w[:, None] * (pos - base_pos), rot.slerp(base_quat, quat, w)


def smoothstep(t: Float[ndarray, "..."]) -> Float[ndarray, "..."]:
    """Minimum-jerk blend from 0 to 1: 10 t^3 - 15 t^4 + 6 t^5 (Flash & Hogan 1985)."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t * t))


def _above_floor(pos: ndarray, quat: ndarray, sole: Sole) -> ndarray:
    """Feet raised where a corner of the sole would be under the floor."""
    corners = pos[:, None] + rot.rotate(quat[:, None], sole.corners[None])
    raised = pos.copy()
    raised[:, 2] += np.maximum(0.0, -corners[..., 2].min(axis=1))
    return raised
