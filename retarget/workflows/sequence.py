"""Several dances as one, or one over and over: each begins where the last one ended, and the feet step across.

Between two dances the body blends and each foot that has to move is lifted over, one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import FREE, PLANTED, Clip, HumanClip, make_reference
from clips.edit import placed
from retarget.config import RetargetConfig, SequenceConfig
from retarget.dynamics import Dynamics
from retarget.pipeline import (
    Prepared,
    Retargeted,
    finish_reference,
    meta_of,
    physics_of,
    prepare,
    reference_of,
    solve,
)
from retarget.report import Report, measure
from retarget.targets import (
    FootTargets,
    MotionWithLeads,
    Targets,
    add_leads,
    blend_frames,
    join,
    smoothstep,
    targets_of,
)
from robot_models import RobotModel
from robot_models.maths import Progress, one_blas_thread, silent
from robot_models.maths import rotation as rot


@dataclass(frozen=True, kw_only=True)
class Transition:
    """How far the end of one dance is from the beginning of the next."""

    at_s: float  # in the reference
    turn: float  # largest joint angle between the two poses [rad]
    step: float  # farther of the two feet's ways [m]
    transition_s: float

    def __str__(self) -> str:
        return (
            f"seam at {self.at_s:.2f} s: poses differ by up to {np.degrees(self.turn):.0f} deg, feet by "
            f"{100 * self.step:.0f} cm; bridged in {self.transition_s:.2f} s"
        )


@one_blas_thread()
def retarget_sequence(
    clips: Sequence[Clip],
    robot: RobotModel,
    config: RetargetConfig | None = None,
    *,
    transition_config: SequenceConfig = SequenceConfig(),
    progress: Progress = silent,
) -> tuple[Retargeted, list[Transition]]:
    """Retarget clips into one reference, in the order given.

    The report holds, for every number, the worst of the dances; gates on the whole body see bridges and leads too.

    Args:
        clips: at least one; the same clip again makes a loop.
        robot: who shall perform them.
        config: as for `retarget`.
        transition_config: how one dance is led into the next.
        progress: told as the solver goes on.
    """
    config = config or RetargetConfig()
    parts = [prepare(clip, robot, config) for clip in clips]
    coarse, targets, posture = [parts[0].coarse], [parts[0].targets], [parts[0].posture]
    names, transitions, sources = ["dance"], [], [parts[0].source]
    for part in parts[1:]:
        nxt = _placed_after(coarse[-1][-1], part)
        qpos, feet, transition = _bridge(robot, coarse[-1][-1], targets[-1].feet, nxt, config.fps, transition_config)
        transitions.append(replace(transition, at_s=sum(map(len, coarse)) / config.fps))
        coarse += [qpos, nxt.coarse]
        targets += [targets_of(robot, qpos, feet, part.targets), nxt.targets]
        posture += [qpos, nxt.posture]
        names += ["bridge", "dance"]
        sources.append(nxt.source)
    padded = _with_leads(robot, coarse, targets, names, config)
    lead = padded.dance.start
    near, pins = np.concatenate(posture), np.full((padded.dance.stop - lead, len(robot.joint_names)), np.nan)
    solution, padded = solve(robot, padded, near, pins, config, progress, {})
    bare = reference_of(robot, solution, padded, config)
    dynamics = physics_of(bare, robot) if config.dynamics else None
    report = _worst(robot, solution, padded, sources, config, dynamics)
    result = Retargeted(
        robot=robot,
        reference=finish_reference(bare, meta_of(sources, config, report), dynamics),
        report=report,
        sources=tuple(sources),
        contacts=parts[0].contacts,
        targets=padded.targets.at(np.arange(padded.dance.start, padded.dance.stop)),
        dynamics=dynamics,
    )
    return result, [replace(s, at_s=s.at_s + lead / config.fps) for s in transitions]


def _placed_after(end: Float[ndarray, "nq"], part: Prepared) -> Prepared:
    """A dance moved so that its root begins where, and facing as, the last one ended."""
    start = part.coarse[0]
    turn = float(rot.yaw(end[None, 3:7])[0] - rot.yaw(start[None, 3:7])[0])
    q = rot.from_yaw(np.array(turn))
    shift = np.append(end[:2] - rot.rotate(q, start[:3])[:2], 0.0)

    def points(x: ndarray) -> ndarray:
        return rot.rotate(np.broadcast_to(q, (*x.shape[:-1], 4)), x) + shift

    def turns(x: ndarray) -> ndarray:
        return rot.multiply(np.broadcast_to(q, x.shape), x)

    def poses(x: ndarray) -> ndarray:
        return np.concatenate((points(x[:, :3]), turns(x[:, 3:7]), x[:, 7:]), axis=1)

    t = part.targets
    moved = replace(
        t,
        pelvis_pos=points(t.pelvis_pos),
        pelvis_quat=turns(t.pelvis_quat),
        torso_quat=turns(t.torso_quat),
        limbs={k: points(v) - shift for k, v in t.limbs.items()},
        feet=replace(t.feet, pos=points(t.feet.pos), quat=turns(t.feet.quat)),
    )
    source = placed(
        part.source, turn, shift / t.scale, f"placed after the dance before, turned by {np.degrees(turn):.0f} deg"
    )
    assert isinstance(source, HumanClip)
    return replace(part, targets=moved, source=source, coarse=poses(part.coarse), posture=poses(part.posture))


def _bridge(
    robot: RobotModel, end: ndarray, before: FootTargets, nxt: Prepared, fps: float, config: SequenceConfig
) -> tuple[ndarray, FootTargets, Transition]:
    """Poses and feet between the last pose and the first of the next dance, both without."""
    start, after = nxt.coarse[0], nxt.targets.feet
    count = blend_frames(robot, end, start, fps, config.transition_s)
    u = np.arange(1, count + 1) / (count + 1)
    w = smoothstep(u)
    qpos = end + w[:, None] * (start - end)
    qpos[:, 3:7] = rot.slerp(np.tile(end[3:7], (count, 1)), np.tile(start[3:7], (count, 1)), w)
    way = after.pos[0] - before.pos[-1]
    far = np.linalg.norm(way[:, :2], axis=1)
    pos, quat = np.zeros((count, 2, 3)), np.zeros((count, 2, 4))
    contact = np.full((count, 4), PLANTED)
    # A foot that is in the air comes down first; one that the next dance begins with in the air goes last.
    in_air = (before.contact[-1].reshape(2, 2) == FREE).all(axis=1)
    lifts_off = (after.contact[0].reshape(2, 2) == FREE).all(axis=1)
    order = sorted((0, 1), key=lambda k: (not in_air[k], lifts_off[k], k))
    for k, (a, b) in zip(order, pairwise(config.steps), strict=True):
        s = smoothstep((u - a) / (b - a))
        pos[:, k] = before.pos[-1, k] + s[:, None] * way[k]
        quat[:, k] = rot.slerp(np.tile(before.quat[-1, k], (count, 1)), np.tile(after.quat[0, k], (count, 1)), s)
        if far[k] > config.near or in_air[k] or lifts_off[k]:
            pos[:, k, 2] += config.lift * 4.0 * s * (1.0 - s)
            there, arrived = (s > 1e-3), (s < 1.0 - 1e-3)
            free = (there & arrived) | (in_air[k] & arrived) | (lifts_off[k] & there)
            contact[free, 2 * k : 2 * k + 2] = FREE
    feet = FootTargets(pos=pos, quat=quat, contact=contact, shift=np.zeros((count, 2, 2)))
    transition = Transition(
        at_s=0.0, turn=float(np.abs(start[7:] - end[7:]).max()), step=float(far.max()), transition_s=count / fps
    )
    return qpos, feet, transition


def _with_leads(
    robot: RobotModel, coarse: list[ndarray], targets: list[Targets], names: list[str], config: RetargetConfig
) -> MotionWithLeads:
    """Leads around all of it; the middle keeps its own segments."""
    whole = add_leads(robot, np.concatenate(coarse), join(targets), config)
    ends = whole.dance.start + np.cumsum([len(q) for q in coarse])
    inner = [[int(e) - len(q), int(e), 1] for e, q in zip(ends, coarse, strict=True)]
    inner[0][2] = int(whole.segments[whole.names.index("dance")][2])
    k = whole.names.index("dance")
    segments = np.concatenate((whole.segments[:k], np.array(inner), whole.segments[k + 1 :]))
    return replace(whole, segments=segments, names=(*whole.names[:k], *names, *whole.names[k + 1 :]))


def _worst(
    robot: RobotModel,
    qpos: ndarray,
    padded: MotionWithLeads,
    sources: Sequence[HumanClip],
    config: RetargetConfig,
    dynamics: Dynamics | None,
) -> Report:
    """Every dance measured against its own source, the body over all frames; of each number the worst."""
    first = MotionWithLeads(
        qpos=qpos, targets=padded.targets, segments=padded.segments,
        names=tuple(n if i == padded.names.index("dance") else n.replace("dance", "other") for i, n in enumerate(padded.names)),
    )  # fmt: skip
    whole = measure(reference_of(robot, qpos, first, config), robot, sources[0], config.gates, dynamics)
    worst = {m.key: m for m in whole.metrics}
    dances = [s for s, n in zip(padded.segments, padded.names, strict=True) if n == "dance"]
    for (a, b, _), source in list(zip(dances, sources, strict=True))[1:]:
        alone = make_reference(
            robot,
            qpos[a:b],
            config.fps,
            contact=padded.targets.feet.contact[a:b],
            segments=np.array([[0, b - a, 0]]),
            meta={},
        )
        for metric in measure(alone, robot, source, config.gates).metrics:
            if metric.worse_than(worst[metric.key]):
                where = None if metric.where is None else metric.where.later(a / config.fps)
                worst[metric.key] = replace(metric, where=where)
    return Report(metrics=tuple(worst.values()), series=whole.series, bounds=whole.bounds)
