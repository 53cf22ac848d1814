"""How good are the references, beside the loop that the field runs? The same clip, targets and judge for both.

    python benchmarks/retarget_quality.py CLIP [CLIP ...] [--robots g1,dancer] [--seconds 40]

Loop B, the per-frame baseline: mink FrameTasks on the same bodies, two weighted passes of up to 10 iterations each,
daqp, damping 0.5, stop when the error falls by less than 1e-3, position limits only; feet where the source has them.
The judge is the report (docs/report.md): its labels of touching feet come from the source. Last result stands in
retarget_quality.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mink
import numpy as np
from numpy import ndarray

from clips import MetricKey, ReadOptions, RobotClip, cut, make_reference, read_clip, repair
from clips.edit import recentre, resample
from retarget import RetargetConfig, dynamics_of, measure, retarget
from retarget.targets import Targets, as_figure, find_contacts, make_targets
from robot_models import FEET, RobotModel, load_robot

COLUMNS = {  # of the report, and their heads here
    MetricKey.FRAMES_UNDER_FLOOR: "under floor %",
    MetricKey.PENETRATION: "deepest mm",
    MetricKey.CONTACT_SPEED: "touching cm/s",
    MetricKey.SLIDE_MEAN: "slide mm",
    MetricKey.SLIDE_WORST: "worst mm",
    MetricKey.CONTACT_HEIGHT: "height mm",
    MetricKey.SPEED_SHARE: "speed share",
    MetricKey.ACCELERATION_SHARE: "acc. share",
    MetricKey.JERK_P95: "jerk p95",
    MetricKey.FRAMES_SELF_COLLIDING: "self-coll. %",
    MetricKey.SELF_COLLISION: "deepest mm",
    MetricKey.AIRBORNE: "airborne %",
    MetricKey.AIRBORNE_SOURCE: "source's airborne %",
    MetricKey.LIMB_DIRECTION_ERROR: "limbs °",
    MetricKey.IMPOSSIBLE_FRAMES: "impossible %",
    MetricKey.TORQUE_SHARE: "torque p99",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+")
    parser.add_argument("--robots", default="g1,dancer")
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--fps", type=float, default=None, help="of clips that do not say")
    parser.add_argument("--recordings", type=Path, default=None, help="folder for side-by-side recordings")
    args = parser.parse_args()
    print(f"| clip, robot | | frames/s | {' | '.join(COLUMNS.values())} |\n|{'---|' * (3 + len(COLUMNS))}")
    for path in args.clips:
        for name in args.robots.split(","):
            compare(path, load_robot(name), args.seconds, args.fps, args.recordings)


def compare(path: Path, robot: RobotModel, seconds: float, fps: float | None, recordings: Path | None) -> None:
    config = replace(RetargetConfig(), lead_in_s=0.0, lead_out_s=0.0)
    clip = cut(read_clip(path, ReadOptions(fps=fps)), 0.0, seconds)
    recorded = recentre(resample(repair(clip), config.fps))
    source = as_figure(recorded) if isinstance(recorded, RobotClip) else recorded
    contacts = find_contacts(source, config.contact)
    none = replace(contacts, in_contact=np.zeros_like(contacts.in_contact), pivoting=np.zeros_like(contacts.pivoting))
    free = make_targets(source, none, robot, config)
    qpos, rate_b = timed(lambda: loop_b(robot, free), source.frames)
    segments = np.array([[0, source.frames, 0]])
    baseline = make_reference(robot, qpos, config.fps, contact=contacts.labels, segments=segments, meta={})
    judged_b = {m.key: m for m in measure(baseline, robot, source, config.gates, dynamics_of(baseline, robot)).metrics}
    retarget(cut(clip, 0.0, 1.0), robot, config)  # imports
    ours, rate = timed(lambda: retarget(clip, robot, config), source.frames)
    judged = {m.key: m for m in ours.report.metrics}
    if recordings is not None:
        from retarget.recordings import save_comparison

        both = {"loop B": (robot, baseline), "whole clip": (robot, ours.reference)}
        save_comparison(recordings / f"{path.stem}_{robot.name}.rrd", both, source)
    for solver, speed, told in (("B", rate_b, judged_b), ("ours", rate, judged)):
        numbers = " | ".join(f"{float(f'{told[name].value:.3g}'):g}" for name in COLUMNS)
        who = f"{path.stem} ({source.frames / config.fps:.0f} s), {robot.name}" if solver == "B" else ""
        print(f"| {who} | {solver} | {speed:.0f} | {numbers} |", flush=True)


def timed(work: Callable[[], object], frames: int) -> tuple[object, float]:
    began = time.perf_counter()
    result = work()
    return result, frames / (time.perf_counter() - began)


def loop_b(robot: RobotModel, targets: Targets) -> ndarray:
    """The per-frame loop of the neighbours on our targets."""
    configuration = mink.Configuration(robot.model)
    configuration.update(robot.default_qpos.copy())
    limits = [mink.ConfigurationLimit(robot.model)]
    objective = frame_goals(robot, targets)
    passes = [
        [(mink.FrameTask(body, "body", position_cost=p, orientation_cost=r, lm_damping=1.0), pos, quat)
         for body, pos, quat, p, r in ((g[0], g[1], g[2], *g[3 + k]) for g in objective)]
        for k in range(2)
    ]  # fmt: skip
    out = np.zeros((len(targets.pelvis_pos), robot.nq))
    for t in range(len(out)):
        for tasks in passes:
            for task, pos, quat in tasks:
                task.set_target(mink.SE3(wxyz_xyz=np.concatenate((quat[t], pos[t]))))
            relax(configuration, [task for task, _, _ in tasks], limits)
        out[t] = configuration.q
    return out


def relax(configuration: mink.Configuration, tasks: list[mink.FrameTask], limits: list[mink.Limit]) -> None:
    last = np.inf
    for _ in range(10):
        error = float(np.linalg.norm(np.concatenate([task.compute_error(configuration) for task in tasks])))
        if last - error < 1e-3:
            return
        last = error
        velocity = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=0.5, limits=limits)
        configuration.integrate_inplace(velocity, 1.0)


def frame_goals(robot: RobotModel, targets: Targets) -> list[tuple]:
    """(body, positions, orientations, (position, rotation) cost of pass 1, of pass 2)."""
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (len(targets.pelvis_pos), 1))
    body = robot.profile.landmarks
    objective = [
        (body["pelvis"], targets.pelvis_pos, targets.pelvis_quat, (10.0, 10.0), (100.0, 5.0)),
        (body["torso"], targets.pelvis_pos, targets.torso_quat, (0.0, 10.0), (0.0, 10.0)),
    ]
    places = limb_places(robot, targets)
    for k, side in enumerate(FEET):
        objective.append(
            (body[f"{side}_foot"], targets.feet.pos[:, k], targets.feet.quat[:, k], (10.0, 10.0), (50.0, 10.0))
        )
        for part in ("knee", "elbow", "wrist"):
            objective.append((body[f"{side}_{part}"], places[f"{side}_{part}"], identity, (5.0, 0.0), (10.0, 0.0)))
    return objective


def limb_places(robot: RobotModel, targets: Targets) -> dict[str, ndarray]:
    """Knees, elbows and wrists laid out from pelvis and trunk targets."""
    from robot_models import forward_kinematics
    from robot_models.maths import rotation

    zero = np.zeros((1, robot.nq))
    zero[:, 3] = 1.0
    pos, quat = (a[0] for a in forward_kinematics(robot, zero))
    torso = robot.landmark("torso")
    count = len(targets.pelvis_pos)

    def carried(frame: ndarray, body: int, offset: ndarray) -> ndarray:
        local = rotation.rotate(rotation.conjugate(quat[body]), offset)
        return rotation.rotate(frame, np.broadcast_to(local, (count, 3)))

    places = {}
    trunk = targets.pelvis_pos + carried(targets.pelvis_quat, 0, pos[torso] - pos[0])
    for side in FEET:
        hip = targets.pelvis_pos + carried(targets.pelvis_quat, 0, pos[robot.landmark(f"{side}_hip")] - pos[0])
        shoulder = trunk + carried(targets.torso_quat, torso, pos[robot.landmark(f"{side}_shoulder")] - pos[torso])
        places[f"{side}_knee"] = hip + targets.limbs[f"{side}_hip", f"{side}_knee"]
        places[f"{side}_elbow"] = shoulder + targets.limbs[f"{side}_shoulder", f"{side}_elbow"]
        places[f"{side}_wrist"] = places[f"{side}_elbow"] + targets.limbs[f"{side}_elbow", f"{side}_wrist"]
    return places


if __name__ == "__main__":
    main()
